//! Force and pressure of contact at the nodes of a surface.

use nalgebra::{Point3, Vector3};

/// What contacts put on the nodes of a body.
///
/// Shapes: N nodes. Units: N, Pa. Frame: that of the places and forces given.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceLoad {
    /// Force on the body at every node; those of all nodes add up to the force of all contacts.
    pub force: Vec<[f64; 3]>,
    /// Pressure at every node, positive where the body is pressed in: the part of the node's force
    /// against its outward normal, over the node's share of the deformed surface, a third of every
    /// triangle at it. So it is a mean over about one triangle around the node; a contact that is
    /// smaller than that is pressed harder than it says.
    pub pressure: Vec<f64>,
}

impl SurfaceLoad {
    /// From forces at nodes, of which several may act at one; without a surface around a node its
    /// pressure is zero.
    ///
    /// Shapes: `places` one per node; `triangles` the whole boundary, counter-clockwise seen from
    /// outside. Units: m, N.
    ///
    /// # Panics
    /// If a triangle or a force names a node that has no place.
    pub fn new(
        places: &[Point3<f64>],
        triangles: &[[u32; 3]],
        forces: impl IntoIterator<Item = (u32, Vector3<f64>)>,
    ) -> Self {
        let mut force = vec![Vector3::zeros(); places.len()];
        forces.into_iter().for_each(|(node, of_contact)| force[node as usize] += of_contact);
        let (mut area, mut outward) =
            (vec![0.0; places.len()], vec![Vector3::zeros(); places.len()]);
        for corners in triangles {
            let [a, b, c] = corners.map(|node| places[node as usize]);
            let twice = (b - a).cross(&(c - a));
            for &node in corners {
                area[node as usize] += twice.norm() / 6.0;
                outward[node as usize] += twice;
            }
        }
        let pressure = |node: usize| {
            let (force, area): (&Vector3<f64>, f64) = (&force[node], area[node]);
            let normal: Option<Vector3<f64>> = outward[node].try_normalize(0.0);
            match normal {
                Some(normal) if area > 0.0 && *force != Vector3::zeros() => {
                    -force.dot(&normal) / area
                }
                _ => 0.0,
            }
        };
        let pressure = (0..places.len()).map(pressure).collect();
        Self { force: force.into_iter().map(Into::into).collect(), pressure }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{BuiltIn, Surface, generate};

    #[test]
    fn an_even_pressure_on_the_top_of_a_cube_is_found_at_its_inner_nodes() {
        let mesh = generate(BuiltIn::Cube, 125).unwrap();
        let surface = Surface::from_mesh(&mesh);
        let (low, high) = mesh.bounds();
        let is_top = |node: &u32| mesh.vertices()[*node as usize].z > high.z - 1e-9;
        // Consistent forces of 300 Pa: a third of every triangle at each of its corners.
        let mut forces = Vec::new();
        for corners in surface.triangles.iter().filter(|corners| corners.iter().all(is_top)) {
            let [a, b, c] = corners.map(|node| mesh.vertices()[node as usize]);
            let third = (b - a).cross(&(c - a)) * (-300.0 / 6.0);
            forces.extend(corners.map(|node| (node, third)));
        }
        let load = SurfaceLoad::new(mesh.vertices(), &surface.triangles, forces);
        let total: f64 = load.force.iter().map(|force| force[2]).sum();
        let area = (high.x - low.x) * (high.y - low.y);
        assert!((total + 300.0 * area).abs() < 1e-10 * area * 300.0, "{total}");
        let mut inner = 0;
        for node in surface.nodes.iter().copied() {
            let place = mesh.vertices()[node as usize];
            let is_inner = [(place.x, low.x, high.x), (place.y, low.y, high.y)]
                .iter()
                .all(|(at, low, high)| at - low > 1e-9 && high - at > 1e-9);
            let pressure = load.pressure[node as usize];
            if is_top(&node) && is_inner {
                inner += 1;
                assert!((pressure - 300.0).abs() < 1e-9, "node {node}: {pressure} Pa");
            } else if !is_top(&node) {
                assert_eq!(pressure, 0.0, "node {node}");
            }
        }
        assert_eq!(inner, 9);
    }

    #[test]
    fn a_force_out_of_the_body_is_a_negative_pressure_and_one_along_it_none() {
        let places = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(Point3::from);
        let forces = [(0, Vector3::new(0.0, 0.0, 1.0)), (1, Vector3::new(1.0, 2.0, 0.0))];
        let load = SurfaceLoad::new(&places, &[[0, 1, 2]], forces);
        assert!((load.pressure[0] + 6.0).abs() < 1e-15);
        assert_eq!(load.pressure[1..], [0.0, 0.0]);
    }
}
