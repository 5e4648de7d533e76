//! Shape of the elements: dihedral angles, radius ratios, volumes.

use std::f64::consts::PI;

use nalgebra::{Point3, Vector3};

use super::TetMesh;
use super::surface::OUTWARD;
use super::tet_mesh::signed_volume;

/// Shape of one tetrahedron.
///
/// Units: angles rad, volume m³; `radius_ratio` 0 (flat) to 1 (regular).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TetQuality {
    /// Smallest of the six dihedral angles; 70.53° for the regular one, 0 for flat ones.
    pub dihedral_min: f64,
    /// Largest of the six dihedral angles.
    pub dihedral_max: f64,
    /// Three times the inscribed radius over the circumscribed radius.
    pub radius_ratio: f64,
    /// Signed volume of the element, m³.
    pub volume: f64,
}

/// Shape of a whole mesh.
///
/// Units: angles rad, volumes m³.
#[derive(Clone, Debug, PartialEq)]
pub struct Quality {
    /// Smallest dihedral angle of all elements.
    pub dihedral_min: f64,
    /// Largest dihedral angle of all elements.
    pub dihedral_max: f64,
    /// Smallest radius ratio of all elements.
    pub radius_ratio_min: f64,
    /// Mean radius ratio of all elements.
    pub radius_ratio_mean: f64,
    /// Smallest element volume.
    pub volume_min: f64,
    /// Largest element volume.
    pub volume_max: f64,
    /// Sum of the element volumes.
    pub volume: f64,
    /// Elements by their smallest dihedral angle: below 10°, below 20°, …, below 80°.
    pub dihedral_histogram: [usize; 8],
    /// Elements with the smallest radius ratios, worst first; ties by index.
    pub worst: Vec<usize>,
}

impl Quality {
    /// Measures every element and keeps the `worst_count_max` worst.
    pub fn from_mesh(mesh: &TetMesh, worst_count_max: usize) -> Self {
        let shapes: Vec<TetQuality> =
            (0..mesh.tets().len()).map(|t| tet_quality(&mesh.corners(t))).collect();
        let least = |f: fn(&TetQuality) -> f64| shapes.iter().map(f).fold(f64::INFINITY, f64::min);
        let most = |f: fn(&TetQuality) -> f64| shapes.iter().map(f).fold(0.0, f64::max);
        let mut dihedral_histogram = [0; 8];
        for shape in &shapes {
            // At most 70.53°, so the last bin is never passed.
            let bin = (shape.dihedral_min.to_degrees() / 10.0) as usize;
            dihedral_histogram[bin.min(7)] += 1;
        }
        let mut worst: Vec<usize> = (0..shapes.len()).collect();
        let by_ratio = |a: &usize, b: &usize| {
            shapes[*a].radius_ratio.total_cmp(&shapes[*b].radius_ratio).then(a.cmp(b))
        };
        let kept = worst_count_max.min(worst.len());
        if kept > 0 && kept < worst.len() {
            // Selecting first keeps a large mesh from being sorted for a short list.
            worst.select_nth_unstable_by(kept - 1, by_ratio);
        }
        worst.truncate(kept);
        worst.sort_unstable_by(by_ratio);
        Self {
            dihedral_min: least(|q| q.dihedral_min),
            dihedral_max: most(|q| q.dihedral_max),
            radius_ratio_min: least(|q| q.radius_ratio),
            radius_ratio_mean: shapes.iter().map(|q| q.radius_ratio).sum::<f64>()
                / shapes.len() as f64,
            volume_min: least(|q| q.volume),
            volume_max: most(|q| q.volume),
            volume: shapes.iter().map(|q| q.volume).sum(),
            dihedral_histogram,
            worst,
        }
    }
}

/// Measures one tetrahedron.
///
/// Shapes: `corners` 4 points, positive orientation as [`TetMesh`] has it. A flat one has
/// angles 0 and π and radius ratio 0; an inverted one has the angles of its mirror image and
/// radius ratio 0. Never NaN for finite corners.
pub fn tet_quality(corners: &[Point3<f64>; 4]) -> TetQuality {
    let volume = signed_volume(corners);
    let flat = TetQuality { dihedral_min: 0.0, dihedral_max: PI, radius_ratio: 0.0, volume };
    let edges: [Vector3<f64>; 3] = [0, 1, 2].map(|c| corners[c] - corners[3]);
    // Measured at edge length 1, so that tiny and huge elements neither vanish nor overflow.
    let scale = edges.iter().map(Vector3::amax).fold(0.0, f64::max);
    if !(scale > 0.0 && scale.is_finite()) {
        return flat;
    }
    let [a, b, c] = edges.map(|e| e / scale);
    let unit = [a, b, c, Vector3::zeros()];
    let normals = OUTWARD.map(|[i, j, k]| (unit[j] - unit[i]).cross(&(unit[k] - unit[i])));
    let mut dihedral_min = PI;
    let mut dihedral_max = 0.0f64;
    for i in 0..4 {
        for j in 0..i {
            // atan2 stays exact near 0 and π, where slivers are.
            let angle = normals[i].cross(&normals[j]).norm().atan2(-normals[i].dot(&normals[j]));
            dihedral_min = dihedral_min.min(angle);
            dihedral_max = dihedral_max.max(angle);
        }
    }
    let det = a.dot(&b.cross(&c));
    let area_doubled: f64 = normals.iter().map(Vector3::norm).sum();
    let circum = (b.cross(&c) * a.norm_squared()
        + c.cross(&a) * b.norm_squared()
        + a.cross(&b) * c.norm_squared())
    .norm();
    // r = det / Σ 2A and R = |…| / (2 det).
    let radius_ratio = 6.0 * det * det / (area_doubled * circum);
    if !(det > 0.0 && radius_ratio.is_finite()) {
        let angles =
            if det == 0.0 { flat } else { TetQuality { dihedral_min, dihedral_max, ..flat } };
        return angles;
    }
    TetQuality { dihedral_min, dihedral_max, radius_ratio: radius_ratio.min(1.0), volume }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn regular() -> [Point3<f64>; 4] {
        [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]].map(Point3::from)
    }

    fn positive(mut corners: [Point3<f64>; 4]) -> [Point3<f64>; 4] {
        if signed_volume(&corners) < 0.0 {
            corners.swap(0, 1);
        }
        corners
    }

    #[test]
    fn regular_tetrahedron_has_ratio_one_and_arccos_one_third() {
        let q = tet_quality(&positive(regular()));
        assert!((q.radius_ratio - 1.0).abs() < 1e-14);
        assert!((q.dihedral_min - (1.0f64 / 3.0).acos()).abs() < 1e-14);
        assert!((q.dihedral_max - q.dihedral_min).abs() < 1e-14);
    }

    #[test]
    fn right_corner_has_known_angles_and_ratio() {
        let corners = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]];
        let q = tet_quality(&corners.map(Point3::from));
        assert!((q.dihedral_min - (1.0 / 3.0f64.sqrt()).acos()).abs() < 1e-14);
        assert!((q.dihedral_max - PI / 2.0).abs() < 1e-14);
        // r = 1 / (3 + √3), R = √3 / 2.
        let ratio = 3.0 / (3.0 + 3.0f64.sqrt()) / (3.0f64.sqrt() / 2.0);
        assert!((q.radius_ratio - ratio).abs() < 1e-14);
    }

    #[test]
    fn flat_and_extreme_elements_give_numbers() {
        let flat = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0; 3]].map(Point3::from);
        let q = tet_quality(&flat);
        assert_eq!((q.dihedral_min, q.dihedral_max, q.radius_ratio), (0.0, PI, 0.0));
        let point = tet_quality(&[Point3::origin(); 4]);
        assert_eq!(point.radius_ratio, 0.0);
        for scale in [1e-90, 1e90] {
            let q = tet_quality(&positive(regular()).map(|p| p * scale));
            assert!((q.radius_ratio - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn worst_elements_come_first_and_the_histogram_counts_all() {
        let mut vertices = positive(regular()).to_vec();
        let sliver = [[5.0, 0.0, 0.0], [6.0, 1.0, 0.01], [5.0, 1.0, 0.0], [6.0, 0.0, 0.0]];
        vertices.extend(positive(sliver.map(Point3::from)));
        let mesh = TetMesh::try_new(vertices, vec![[0, 1, 2, 3], [4, 5, 6, 7]], vec![]).unwrap();
        let q = Quality::from_mesh(&mesh, 1);
        assert_eq!(q.worst, [1]);
        assert_eq!(Quality::from_mesh(&mesh, 9).worst, [1, 0]);
        assert_eq!(q.dihedral_histogram.iter().sum::<usize>(), 2);
        assert_eq!(q.dihedral_histogram[0], 1);
        assert!((q.volume - q.volume_min - q.volume_max).abs() < 1e-15);
        assert!(q.dihedral_max > 3.0 && q.radius_ratio_min < 0.02);
    }

    proptest! {
        #[test]
        fn angles_and_ratio_agree_with_their_definitions(
            coords in prop::array::uniform4(prop::array::uniform3(-1.0f64..1.0))
        ) {
            let c = positive(coords.map(Point3::from));
            prop_assume!(signed_volume(&c) > 1e-3);
            let q = tet_quality(&c);
            // The angle at an edge is that between the two other corners seen along the edge.
            let mut angles = Vec::new();
            for (i, j, k, l) in [(0, 1, 2, 3), (0, 2, 1, 3), (0, 3, 1, 2), (1, 2, 0, 3),
                                 (1, 3, 0, 2), (2, 3, 0, 1)] {
                let along = (c[j] - c[i]).normalize();
                let across = |p: Point3<f64>| (p - c[i]) - along * along.dot(&(p - c[i]));
                angles.push(across(c[k]).angle(&across(c[l])));
            }
            let least = angles.iter().copied().fold(f64::INFINITY, f64::min);
            let most = angles.iter().copied().fold(0.0, f64::max);
            prop_assert!((q.dihedral_min - least).abs() < 1e-7);
            prop_assert!((q.dihedral_max - most).abs() < 1e-7);
            prop_assert!(q.radius_ratio > 0.0 && q.radius_ratio <= 1.0);
            // The circumcentre is as far from all corners; its radius gives the ratio.
            let rows = nalgebra::Matrix3::from_rows(
                &[0, 1, 2].map(|i| (c[i] - c[3]).transpose()));
            let rhs = Vector3::from([0, 1, 2].map(|i| (c[i] - c[3]).norm_squared() / 2.0));
            let circumradius = rows.lu().solve(&rhs).unwrap().norm();
            let area: f64 = OUTWARD.iter()
                .map(|&[i, j, k]| (c[j] - c[i]).cross(&(c[k] - c[i])).norm() / 2.0).sum();
            let ratio = 3.0 * (3.0 * q.volume / area) / circumradius;
            prop_assert!((q.radius_ratio - ratio).abs() < 1e-9);
        }
    }
}
