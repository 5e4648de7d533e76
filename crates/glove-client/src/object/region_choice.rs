//! Regions of an object that are to be of a material of their own: named in its file, or marked by an ellipsoid.

use std::str::FromStr;

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};
use softgrasp_core::fem::{Material, MaterialError};
use softgrasp_core::mesh::TetMesh;
use softgrasp_grasp::object::Regions;

/// A region and its material, as `ID:E:NU` says or a table `[[region]]` of a scene.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct RegionChoice {
    /// Name (or number) of the region in the mesh file, or a new name for what the ellipsoid holds.
    pub name: String,
    /// Young's modulus, Pa.
    pub young_pa: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Where the region is, unless the mesh file says it.
    #[serde(default)]
    pub ellipsoid: Option<Ellipsoid>,
}

/// A part of the object: the elements whose centroids lie in it.
///
/// Units: m. Frame: the object's, whose box is centred at the origin.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Serialize)]
pub struct Ellipsoid {
    /// Centre.
    pub centre_m: [f64; 3],
    /// Half axes along x, y, z.
    pub radii_m: [f64; 3],
}

/// Why a region is not given its material.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RegionError {
    /// A word that is no region.
    #[error("'{0}' is no region: ID:E:NU is expected, as in stone:1e9:0.3")]
    Form(String),
    /// Constants that no material has.
    #[error("region {region}: {source}")]
    Material {
        /// Name of the region.
        region: String,
        /// What is wrong with it.
        source: MaterialError,
    },
    /// The object has no such region.
    #[error("the object has no region {region}; it has {there}")]
    Unknown {
        /// Name that was asked for.
        region: String,
        /// Names of its regions.
        there: String,
    },
    /// A region that is named twice.
    #[error("region {0} is named twice")]
    Twice(String),
    /// An ellipsoid in which no element lies.
    #[error(
        "region {0}: no element lies in its ellipsoid; move it, make it larger, or take a finer mesh"
    )]
    Empty(String),
    /// An ellipsoid without a size.
    #[error("region {0}: centre_m must be finite, radii_m finite and above 0")]
    Ellipsoid(String),
}

impl FromStr for RegionChoice {
    type Err = RegionError;

    fn from_str(text: &str) -> Result<Self, RegionError> {
        let wrong = || RegionError::Form(text.to_owned());
        // Names of files may have colons.
        let mut from_right = text.rsplitn(3, ':');
        let number = |word: Option<&str>| word?.trim().parse::<f64>().ok();
        let poisson = number(from_right.next()).ok_or_else(wrong)?;
        let young_pa = number(from_right.next()).ok_or_else(wrong)?;
        let name = from_right.next().filter(|name| !name.is_empty()).ok_or_else(wrong)?.to_owned();
        let choice = Self { name, young_pa, poisson, ellipsoid: None };
        choice.material()?;
        Ok(choice)
    }
}

impl RegionChoice {
    /// Its material.
    ///
    /// # Errors
    /// [`RegionError::Material`].
    pub fn material(&self) -> Result<Material, RegionError> {
        let wrong = |source| RegionError::Material { region: self.name.clone(), source };
        Material::try_new(self.young_pa, self.poisson).map_err(wrong)
    }
}

/// Names of a mesh's regions, and the materials of those that were named.
///
/// Shapes: `names` one per region number of the mesh, or none for a mesh of one region.
///
/// # Errors
/// [`RegionError`].
pub fn regions_of(
    mesh: &TetMesh,
    names: &[String],
    choices: &[RegionChoice],
) -> Result<Regions, RegionError> {
    let count = mesh.regions().iter().max().map_or(1, |&most| most as usize + 1);
    let name = |region: usize| names.get(region).cloned().unwrap_or_else(|| region.to_string());
    let mut regions = Regions::named((0..count).map(name).collect());
    for (place, choice) in choices.iter().enumerate() {
        if choices[..place].iter().any(|earlier| earlier.name == choice.name) {
            return Err(RegionError::Twice(choice.name.clone()));
        }
        if choice.ellipsoid.is_some() {
            continue;
        }
        let Some(region) = region_named(regions.names(), &choice.name) else {
            return Err(RegionError::Unknown {
                region: choice.name.clone(),
                there: regions.names().join(", "),
            });
        };
        regions.set(region as u32, choice.material()?);
    }
    Ok(regions)
}

/// An object whose regions have their materials.
#[derive(Debug)]
pub struct MeshOfRegions {
    /// The mesh; elements in an ellipsoid carry the number of its region.
    pub mesh: TetMesh,
    /// Names and materials, by region number.
    pub regions: Regions,
    /// Sentences for the user.
    pub notes: Vec<String>,
}

impl MeshOfRegions {
    /// Gives the regions of a mesh their materials.
    ///
    /// Shapes: `names` one per region number of the mesh, or none for a mesh of one region.
    ///
    /// # Errors
    /// [`RegionError`].
    pub fn try_new(
        mesh: TetMesh,
        names: &[String],
        choices: &[RegionChoice],
    ) -> Result<Self, RegionError> {
        let regions = regions_of(&mesh, names, choices)?;
        let mut made = Self { mesh, regions, notes: Vec::new() };
        for choice in choices {
            if let Some(ellipsoid) = &choice.ellipsoid {
                made.mark(choice, ellipsoid)?;
            }
        }
        Ok(made)
    }

    /// Makes a region of the elements in an ellipsoid.
    fn mark(&mut self, choice: &RegionChoice, of: &Ellipsoid) -> Result<(), RegionError> {
        let is_finite = of.centre_m.iter().chain(&of.radii_m).all(|x| x.is_finite());
        if !is_finite || of.radii_m.iter().any(|radius| *radius <= 0.0) {
            return Err(RegionError::Ellipsoid(choice.name.clone()));
        }
        let number = self.regions.add(choice.name.clone(), choice.material()?);
        let mesh = &self.mesh;
        let mut labels = match mesh.regions() {
            [] => vec![0; mesh.tets().len()],
            labels => labels.to_vec(),
        };
        let (mut elements, mut volume) = (0, 0.0);
        for (tet, label) in labels.iter_mut().enumerate() {
            let corners = mesh.corners(tet);
            if of.holds(&centroid(&corners)) {
                *label = number;
                elements += 1;
                volume += softgrasp_core::mesh::signed_volume(&corners).abs();
            }
        }
        if elements == 0 {
            return Err(RegionError::Empty(choice.name.clone()));
        }
        self.notes.push(format!(
            "region {}: {elements} elements, {:.2} cm³; its ellipsoid has {:.2}",
            choice.name,
            1e6 * volume,
            1e6 * of.volume()
        ));
        let (vertices, tets) = (mesh.vertices().to_vec(), mesh.tets().to_vec());
        self.mesh = TetMesh::try_new(vertices, tets, labels).expect("only labels have changed");
        Ok(())
    }
}

impl Ellipsoid {
    fn holds(&self, point: &Point3<f64>) -> bool {
        let from_centre = point - Point3::from(self.centre_m);
        from_centre.component_div(&Vector3::from(self.radii_m)).norm_squared() <= 1.0
    }

    fn volume(&self) -> f64 {
        4.0 / 3.0 * std::f64::consts::PI * self.radii_m.iter().product::<f64>()
    }
}

fn centroid(corners: &[Point3<f64>; 4]) -> Point3<f64> {
    Point3::from(corners.iter().map(|p| p.coords).sum::<Vector3<f64>>() / 4.0)
}

/// Number of the region with a name: the whole name, or either half of one such as `P1 (stone)`, which files
/// with a name and a number for each part have.
fn region_named(names: &[String], wanted: &str) -> Option<usize> {
    let is_half = |name: &String| {
        name.strip_suffix(')')
            .and_then(|name| name.split_once(" ("))
            .is_some_and(|(first, second)| first == wanted || second == wanted)
    };
    let halves = || {
        let mut found = (0..names.len()).filter(|&region| is_half(&names[region]));
        found.next().filter(|_| found.next().is_none())
    };
    names.iter().position(|name| name == wanted).or_else(halves)
}

#[cfg(test)]
mod tests {
    use softgrasp_core::mesh::{BuiltIn, generate};

    use super::*;

    fn choice(text: &str) -> RegionChoice {
        text.parse().unwrap()
    }

    #[test]
    fn word_of_the_command_line_names_region_stiffness_and_poisson_s_ratio() {
        let stone = choice("stone:1e9:0.3");
        assert_eq!((stone.name.as_str(), stone.young_pa, stone.poisson), ("stone", 1e9, 0.3));
        assert_eq!(choice("a:b:5:0").name, "a:b");
        for word in ["", "stone", "stone:1e9", ":1e9:0.3", "stone:hard:0.3"] {
            assert_eq!(word.parse::<RegionChoice>(), Err(RegionError::Form(word.to_owned())));
        }
        for word in ["stone:-1:0.3", "stone:1e9:0.5", "stone:1e9:nan"] {
            let refused = word.parse::<RegionChoice>().unwrap_err();
            assert!(matches!(refused, RegionError::Material { .. }), "{word}: {refused}");
        }
    }

    #[test]
    fn regions_are_found_by_name_by_number_and_by_half_of_a_double_name() {
        let cube = generate(BuiltIn::Cube, 64).unwrap();
        let labels = (0..cube.tets().len() as u32).map(|tet| tet % 3).collect();
        let mesh =
            TetMesh::try_new(cube.vertices().to_vec(), cube.tets().to_vec(), labels).unwrap();
        let names = ["P0 (soft)", "P1 (hard)", "7"].map(str::to_owned);
        let of = |words: &[&str]| {
            let choices: Vec<_> = words.iter().map(|word| choice(word)).collect();
            MeshOfRegions::try_new(mesh.clone(), &names, &choices)
        };
        let body = Material::try_new(1.0, 0.0).unwrap();
        let made = of(&["hard:5:0", "7:7:0.25"]).unwrap();
        let materials = made.regions.materials(body);
        let young: Vec<f64> = materials.iter().map(Material::young).collect();
        assert_eq!((young, materials[2].poisson()), (vec![1.0, 5.0, 7.0], 0.25));
        let error = of(&["bone:5:0"]).unwrap_err().to_string();
        assert_eq!(error, "the object has no region bone; it has P0 (soft), P1 (hard), 7");
        assert_eq!(of(&["P1:5:0", "P1:6:0"]).unwrap_err(), RegionError::Twice("P1".to_owned()));
    }

    #[test]
    fn ellipsoid_marks_the_elements_in_it_and_says_how_much_that_is() {
        let mesh = generate(BuiltIn::Sphere, 3000).unwrap();
        let radius = 0.5 * mesh.size();
        let pit = |share: f64| RegionChoice {
            ellipsoid: Some(Ellipsoid { centre_m: [0.0; 3], radii_m: [share * radius; 3] }),
            ..choice("pit:1e9:0.3")
        };
        let made = MeshOfRegions::try_new(mesh.clone(), &[], &[pit(0.5)]).unwrap();
        let marked = made.mesh.regions().iter().filter(|&&region| region == 1).count();
        let share = marked as f64 / mesh.tets().len() as f64;
        assert!((0.05..0.3).contains(&share), "{share}");
        assert!(made.notes[0].contains("elements"), "{:?}", made.notes);
        assert_eq!(made.regions.names(), ["0", "pit"]);
        let nowhere = MeshOfRegions::try_new(mesh.clone(), &[], &[pit(1e-6)]).unwrap_err();
        assert_eq!(nowhere, RegionError::Empty("pit".to_owned()));
        for wrong in [f64::NAN, 0.0, -1.0] {
            let refused = MeshOfRegions::try_new(mesh.clone(), &[], &[pit(wrong)]).unwrap_err();
            assert_eq!(refused, RegionError::Ellipsoid("pit".to_owned()));
        }
    }
}
