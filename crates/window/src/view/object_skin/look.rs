//! Which look an object gets, told by its name.

use std::path::Path;

/// Look of an object: one for each built-in object, and one for every other mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Look {
    /// A ripe fruit with seeds, leaves and a stalk; the stalk's end is +Y.
    Strawberry,
    /// A printed tube with a screw cap; the nozzle's end is −X.
    Toothpaste,
    /// A block of yellow foam with a fine grid on it.
    Cube,
    /// A ball in two colours.
    Sphere,
    /// Clay of a bluish green, which no hand has.
    Imported,
}

impl Look {
    /// The look of a built-in object's name, or of a file whose name contains one.
    ///
    /// A mesh file of a strawberry is painted like ours; a file without such a word is clay.
    pub fn of(object_name: &str) -> Self {
        let stem = Path::new(object_name).file_stem().unwrap_or_default();
        let stem = stem.to_string_lossy().to_lowercase();
        NAMES.iter().find(|(name, _)| stem.contains(name)).map_or(Self::Imported, |(_, look)| *look)
    }

    /// Angle between two faces, rad, above which the edge between them is drawn sharp.
    ///
    /// Fruit, ball and tube are drawn without edges: those of a coarse mesh are not the object's.
    pub(super) fn crease_angle(self) -> f64 {
        let degrees: f64 = match self {
            Self::Strawberry | Self::Sphere | Self::Toothpaste => 180.0,
            Self::Cube => 40.0,
            Self::Imported => 50.0,
        };
        degrees.to_radians()
    }
}

/// Words in names, and what they mean.
const NAMES: [(&str, Look); 4] = [
    ("strawberry", Look::Strawberry),
    ("toothpaste", Look::Toothpaste),
    ("cube", Look::Cube),
    ("sphere", Look::Sphere),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn built_in_names_and_file_names_get_their_look() {
        assert_eq!(Look::of("strawberry"), Look::Strawberry);
        assert_eq!(Look::of("toothpaste"), Look::Toothpaste);
        assert_eq!(Look::of("cube"), Look::Cube);
        assert_eq!(Look::of("sphere"), Look::Sphere);
        assert_eq!(Look::of("/somewhere/My_Strawberry-2.msh"), Look::Strawberry);
        assert_eq!(Look::of("cube.appended.vtu"), Look::Cube);
        assert_eq!(Look::of("strawberry/liver.msh"), Look::Imported);
        assert_eq!(Look::of(""), Look::Imported);
    }
}
