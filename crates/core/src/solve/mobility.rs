//! Finds rigid motions and other motions without energy that the prescribed displacements (Dirichlet
//! values) leave free.
//!
//! `K11` is positive definite exactly when no such motion is left; it is decided here before
//! anything is factored.

use std::fmt;

use nalgebra::{Point3, Vector3};

use super::zero_energy::{BodyMotions, RigidBodies, dofs_by_body};
use crate::contact::Mask;
use crate::mesh::{Bodies, TetMesh};

/// A body that can still move without deforming.
#[derive(Clone, Debug, PartialEq)]
pub struct FreeMotion {
    /// Body, from 0 in the order of the file's elements.
    pub body: usize,
    /// Lowest node of the body.
    pub first_node: usize,
    /// Number of nodes of the body.
    pub node_count: usize,
    /// Known degrees of freedom on the body.
    pub known_dofs: usize,
    /// Masks on the body.
    pub masks: usize,
    /// The motion left free.
    pub motion: Motion,
    /// The motion moves a part of the body about a hinge and leaves the rest where it is.
    pub hinged: bool,
}

/// A rigid motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// A translation along a direction of length one.
    Translation {
        /// Direction of the axis, of length one.
        direction: Vector3<f64>,
    },
    /// A rotation about an axis.
    Rotation {
        /// A point of the axis, in mesh units.
        point: Point3<f64>,
        /// Unit direction of the axis.
        axis: Vector3<f64>,
    },
}

impl fmt::Display for FreeMotion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { body, first_node, node_count, known_dofs, masks, motion, hinged } = self;
        let part = if *hinged { "a part of body" } else { "body" };
        write!(f, "{part} {body} ({node_count} nodes, the first is node {first_node}; ")?;
        write!(f, "{known_dofs} known degrees of freedom")?;
        if *masks > 0 {
            write!(f, ", {masks} mask{}", if *masks == 1 { "" } else { "s" })?;
        }
        f.write_str(") can still ")?;
        match motion {
            Motion::Translation { direction: d } => {
                write!(f, "move along ({:.3}, {:.3}, {:.3})", d.x, d.y, d.z)?;
            }
            Motion::Rotation { point: p, axis: a } => {
                write!(f, "turn about the axis through ({:.4e}, {:.4e}, {:.4e}) ", p.x, p.y, p.z)?;
                write!(f, "along ({:.3}, {:.3}, {:.3})", a.x, a.y, a.z)?;
            }
        }
        f.write_str("; prescribe all three axes of at least three nodes ")?;
        f.write_str(if *masks > 0 { "or masks " } else { "" })?;
        f.write_str("of it that are not in line")
    }
}

/// First body that can move without deforming, if any.
///
/// Shapes: `rigid` that of `mesh` and `bodies`; `known` ascending degrees of freedom; each mask on
/// nodes of one body. Units: those of the mesh.
///
/// Source: thesis (3.43) presumes that `K11⁻¹` exists; this is the condition.
pub fn find_free_motion(
    mesh: &TetMesh,
    bodies: &Bodies,
    rigid: &RigidBodies,
    known: &[u32],
    masks: &[Mask],
) -> Option<FreeMotion> {
    let body_of = |mask: &Mask| bodies.of_node[mask.entries().first()?.0 as usize];
    dofs_by_body(bodies, known).into_iter().enumerate().find_map(|(body, held)| {
        let is_on_body = |mask: &&Mask| body_of(mask).is_some_and(|of| of as usize == body);
        let on_body: Vec<&Mask> = masks.iter().filter(is_on_body).collect();
        let motions = BodyMotions::of_body(mesh, rigid, body, &held, &on_body)?;
        let motion = motions.basis.first()?.as_slice();
        let moving: Vec<f64> = motion.chunks(6).map(|m| m.iter().map(|x| x * x).sum()).collect();
        let part = (0..moving.len()).max_by(|&a, &b| moving[a].total_cmp(&moving[b]))?;
        let of_part = &motion[6 * part..6 * part + 6];
        Some(FreeMotion {
            body,
            first_node: motions.body.nodes.first().map_or(0, |&n| n as usize),
            node_count: motions.body.nodes.len(),
            known_dofs: held.len(),
            masks: on_body.len(),
            motion: motion_from(of_part, motions.body.centre, motions.body.size),
            hinged: moving.iter().any(|&m| m < 1e-12 * moving[part]),
        })
    })
}

/// Reads translation and rotation out of `(t, ω)` about `centre`.
fn motion_from(t_and_omega: &[f64], centre: Point3<f64>, size: f64) -> Motion {
    let t = Vector3::from_column_slice(&t_and_omega[..3]);
    let omega = Vector3::from_column_slice(&t_and_omega[3..]);
    if omega.norm() <= 1e-6 * t.norm() {
        return Motion::Translation { direction: tidy(t.normalize()) };
    }
    // ω here is per unit of r, i.e. times `size`; points of the axis have no motion across it.
    let offset = omega.cross(&t) / omega.norm_squared() * size;
    Motion::Rotation { point: centre + offset, axis: tidy(omega.normalize()) }
}

/// Clears rounding dust and makes the first sizeable component positive, so that messages do not
/// print `-0.000` and do not depend on the sign the decomposition happened to choose.
fn tidy(v: Vector3<f64>) -> Vector3<f64> {
    let sign = v.iter().find(|c| c.abs() > 1e-6).map_or(1.0, |c| c.signum());
    v.map(|c| if c.abs() < 1e-9 { 0.0 } else { c * sign })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh(vertices: &[[f64; 3]], tets: &[[u32; 4]]) -> TetMesh {
        let vertices = vertices.iter().map(|&v| Point3::from(v)).collect();
        TetMesh::try_new(vertices, tets.to_vec(), vec![]).unwrap()
    }

    fn unit_tet() -> TetMesh {
        mesh(&[[1., 0., 0.], [0., 1., 0.], [0., 0., 1.], [0.; 3]], &[[0, 1, 2, 3]])
    }

    fn all_axes(nodes: &[u32]) -> Vec<u32> {
        nodes.iter().flat_map(|n| 3 * n..3 * n + 3).collect()
    }

    fn free(mesh: &TetMesh, known: &[u32]) -> Option<FreeMotion> {
        let bodies = Bodies::from_mesh(mesh);
        find_free_motion(mesh, &bodies, &RigidBodies::new(mesh, &bodies), known, &[])
    }

    #[test]
    fn three_nodes_not_in_line_hold_a_body() {
        assert_eq!(free(&unit_tet(), &all_axes(&[0, 1, 3])), None);
        // Statically determinate 3 + 2 + 1 as well.
        assert_eq!(free(&unit_tet(), &[1, 2, 5, 9, 10, 11]), None);
    }

    #[test]
    fn two_nodes_leave_a_rotation_about_their_line() {
        let found = free(&unit_tet(), &all_axes(&[0, 3])).unwrap();
        let Motion::Rotation { point, axis } = found.motion else { panic!("{found:?}") };
        assert!((axis - Vector3::x()).norm() < 1e-9);
        assert!(point.y.abs() < 1e-9 && point.z.abs() < 1e-9);
        assert!(found.to_string().contains("turn about the axis through"));
    }

    /// Masks on three edges hold by their means; two hold as two nodes at their means do.
    #[test]
    fn masks_hold_a_body_by_their_means() {
        let mesh = unit_tet();
        let bodies = Bodies::from_mesh(&mesh);
        let rigid = RigidBodies::new(&mesh, &bodies);
        let edge = |a: u32, b: u32| Mask::try_new(vec![(a, 1.0), (b, 3.0)]).unwrap();
        let three = [edge(0, 1), edge(1, 2), edge(2, 3)];
        assert_eq!(find_free_motion(&mesh, &bodies, &rigid, &[], &three), None);
        assert_eq!(find_free_motion(&mesh, &bodies, &rigid, &all_axes(&[0]), &three[1..]), None);
        let found = find_free_motion(&mesh, &bodies, &rigid, &[], &three[..2]).unwrap();
        let Motion::Rotation { axis, .. } = found.motion else { panic!("{found:?}") };
        // Means (1, 3, 0)/4 and (0, 1, 3)/4.
        let line = Vector3::new(1.0, 2.0, -3.0).normalize();
        assert!((axis - line).norm() < 1e-9, "{axis}");
        let text = found.to_string();
        assert!(text.contains("2 masks") && text.contains("nodes or masks of it"), "{text}");
    }

    #[test]
    fn nodes_held_along_two_axes_leave_a_translation() {
        let known = [0, 1, 3, 4, 6, 7, 9, 10];
        let found = free(&unit_tet(), &known).unwrap();
        assert!(
            matches!(found.motion, Motion::Translation { direction } if direction == Vector3::z())
        );
    }

    #[test]
    fn untouched_second_body_is_named() {
        let shifted = [[3., 0., 0.], [2., 1., 0.], [2., 0., 1.], [2., 0., 0.]];
        let first = [[1., 0., 0.], [0., 1., 0.], [0., 0., 1.], [0.; 3]];
        let both = mesh(&[first, shifted].concat(), &[[0, 1, 2, 3], [4, 5, 6, 7]]);
        let found = free(&both, &all_axes(&[0, 1, 2])).unwrap();
        assert_eq!((found.body, found.first_node, found.known_dofs), (1, 4, 0));
    }

    #[test]
    fn piece_hinged_at_an_edge_is_found_and_held_by_one_more_node() {
        // Two tetrahedra that share the edge 0–3 only.
        let vertices =
            [[1., 0., 0.], [0., 1., 0.], [0., 0., 1.], [0.; 3], [0., -1., 0.], [0., 0., -1.]];
        let hinged = mesh(&vertices, &[[0, 1, 2, 3], [0, 4, 5, 3]]);
        let found = free(&hinged, &all_axes(&[0, 1, 2])).unwrap();
        assert!(found.hinged);
        let Motion::Rotation { axis, .. } = found.motion else { panic!("{found:?}") };
        assert!((axis - Vector3::x()).norm() < 1e-9);
        assert_eq!(free(&hinged, &all_axes(&[0, 1, 2, 4])), None);
    }

    #[test]
    fn answer_does_not_depend_on_the_unit_of_the_mesh() {
        for scale in [1e-6, 1.0, 1e6] {
            let vertices = [[1., 0., 0.], [0., 1., 0.], [0., 0., 1.], [5.; 3]]
                .map(|v: [f64; 3]| v.map(|c| c * scale));
            let tet = mesh(&vertices, &[[0, 2, 1, 3]]);
            assert_eq!(free(&tet, &all_axes(&[0, 1, 3])), None, "scale {scale}");
            assert!(free(&tet, &all_axes(&[0, 1])).is_some(), "scale {scale}");
        }
    }
}
