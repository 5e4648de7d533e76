//! Elements that a deformation turns inside out.

use std::fmt;

use nalgebra::Point3;

use super::TetMesh;
use super::tet_mesh::signed_volume;

/// Elements that would have no volume, or a negative one, if the vertices moved.
#[derive(Clone, Debug, PartialEq)]
pub struct Inversion {
    /// Number of inverted elements.
    pub count: usize,
    /// Elements of the mesh.
    pub tets: usize,
    /// The first of them, ascending, [`Inversion::LISTED`] at most.
    pub first: Vec<usize>,
    /// The one that is turned furthest.
    pub worst: usize,
    /// Its volume over the one it has at rest, ≤ 0.
    pub volume_rel_min: f64,
}

impl Inversion {
    /// Elements that are listed.
    pub const LISTED: usize = 5;

    /// Elements of a mesh that moved vertices turn inside out; `None` if there are none.
    ///
    /// Shapes: `moved` as many points as the mesh has nodes. A volume that is not a number counts
    /// as turned.
    ///
    /// Source: thesis (3.33) for the volume, 6.1.2 for keeping a shape.
    pub fn of(mesh: &TetMesh, moved: &[Point3<f64>]) -> Option<Self> {
        let mut found: Option<Self> = None;
        for (tet, corners) in mesh.tets().iter().enumerate() {
            let volume = match corners.map(|n| moved.get(n as usize).copied()) {
                [Some(a), Some(b), Some(c), Some(d)] => signed_volume(&[a, b, c, d]),
                _ => f64::NAN,
            };
            if volume > 0.0 {
                continue;
            }
            let volume_rel = volume / mesh.signed_volume(tet);
            let inversion = found.get_or_insert_with(|| Self {
                count: 0,
                tets: mesh.tets().len(),
                first: Vec::new(),
                worst: tet,
                volume_rel_min: volume_rel,
            });
            inversion.count += 1;
            if inversion.first.len() < Self::LISTED {
                inversion.first.push(tet);
            }
            if volume_rel < inversion.volume_rel_min {
                (inversion.worst, inversion.volume_rel_min) = (tet, volume_rel);
            }
        }
        found
    }
}

impl fmt::Display for Inversion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let listed: Vec<String> = self.first.iter().map(usize::to_string).collect();
        let more = if self.count > listed.len() { ", …" } else { "" };
        write!(
            f,
            "{} of {} elements would be turned inside out ({}{more}), element {} furthest, to {:.2} \
             of its volume",
            self.count,
            self.tets,
            listed.join(", "),
            self.worst,
            self.volume_rel_min
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{BuiltIn, generate};

    #[test]
    fn mirrored_body_is_inverted_whole_and_to_minus_its_volume() {
        let mesh = generate(BuiltIn::Cube, 64).unwrap();
        assert_eq!(Inversion::of(&mesh, mesh.vertices()), None);
        let mirrored: Vec<_> =
            mesh.vertices().iter().map(|p| Point3::new(-p.x, p.y, p.z)).collect();
        let inversion = Inversion::of(&mesh, &mirrored).unwrap();
        assert_eq!(inversion.count, mesh.tets().len());
        assert_eq!(inversion.first, [0, 1, 2, 3, 4]);
        assert!((inversion.volume_rel_min + 1.0).abs() < 1e-9);
        assert!(inversion.to_string().contains("(0, 1, 2, 3, 4, …)"));
    }

    #[test]
    fn pulled_node_inverts_some_of_its_elements_and_the_worst_is_named() {
        let mesh = generate(BuiltIn::Cube, 64).unwrap();
        let mut moved = mesh.vertices().to_vec();
        moved[21] += nalgebra::Vector3::new(0.0, 0.03, 0.0);
        let inversion = Inversion::of(&mesh, &moved).unwrap();
        let naive: Vec<(usize, f64)> = (0..mesh.tets().len())
            .map(|t| (t, signed_volume(&mesh.tets()[t].map(|n| moved[n as usize]))))
            .filter(|(_, volume)| *volume <= 0.0)
            .map(|(t, volume)| (t, volume / mesh.signed_volume(t)))
            .collect();
        assert!(!naive.is_empty() && naive.len() < mesh.tets().len());
        assert_eq!(inversion.count, naive.len());
        let least = naive.iter().map(|(_, v)| *v).fold(f64::INFINITY, f64::min);
        assert_eq!(inversion.volume_rel_min, least);
        assert!(naive.contains(&(inversion.worst, least)));
    }

    #[test]
    fn coordinates_that_are_no_numbers_count_as_inverted() {
        let mesh = generate(BuiltIn::Cube, 64).unwrap();
        let mut moved = mesh.vertices().to_vec();
        moved[0].x = f64::NAN;
        assert!(Inversion::of(&mesh, &moved).is_some());
        assert_eq!(Inversion::of(&mesh, &[]).unwrap().count, mesh.tets().len());
    }
}
