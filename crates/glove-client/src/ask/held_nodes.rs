//! Degrees of freedom and masks that the fingertips hold, as the server is asked, and their forces.

use nalgebra::Vector3;
use softgrasp_grasp::grasp::KnownNode;
use softgrasp_grasp::object::{ContactModel, SoftObject};
use softgrasp_protocol::{DofValue, Masks};

/// Contacts of five fingertips, computed once for each set of touched nodes.
#[derive(Clone, Debug, Default)]
pub struct HeldNodes {
    touched: Option<[u32; 5]>,
    /// Held node and finger, ascending by node.
    held: Vec<(u32, usize)>,
    /// Masks, one for each finger, thumb first; empty if nodes are held.
    masks: Masks,
}

/// Displacements that five fingertips prescribe.
///
/// Units: m. Frame: the object's.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PrescribedDisplacements {
    /// Prescribed displacement of each held degree of freedom.
    pub of_dofs: Vec<DofValue>,
    /// Masks whose mean displacement is prescribed.
    pub masks: Masks,
    /// Prescribed mean displacement of each mask.
    pub of_masks: Vec<[f64; 3]>,
}

impl HeldNodes {
    /// Displacements that the fingertips prescribe.
    ///
    /// Units: `tip_radii` and displacements m. Frame: the object's, at rest: a fingertip covers a part of
    /// the rest surface, which stays the same while the object deforms.
    pub fn prescribed_displacements(
        &mut self,
        model: ContactModel,
        object: &SoftObject,
        tip_radii: [f64; 5],
        known: &[KnownNode; 5],
    ) -> PrescribedDisplacements {
        let touched = known.map(|k| k.node);
        if self.touched != Some(touched) {
            *self = Self { touched: Some(touched), ..Self::default() };
            let fingers = touched.into_iter().enumerate();
            match model {
                ContactModel::Vertex => {
                    self.held = fingers.map(|(finger, node)| (node, finger)).collect();
                }
                ContactModel::Patch => self.held = patches(object, tip_radii, &touched),
                // Fingers that press with friction hold nothing.
                ContactModel::Friction => {}
                ContactModel::Mask => fingers.for_each(|(finger, node)| {
                    self.masks
                        .push(object.rest_shape().tip_mask(node, tip_radii[finger]).entries());
                }),
            }
            self.held.sort_unstable();
        }
        let values = self.held.iter().flat_map(|&(node, finger)| {
            let u = known[finger].displacement_in_object;
            (0..3u32).map(move |axis| DofValue { dof: 3 * node + axis, value: u[axis as usize] })
        });
        let of_masks = known.iter().map(|k| k.displacement_in_object.into());
        PrescribedDisplacements {
            of_dofs: values.collect(),
            masks: self.masks.clone(),
            of_masks: of_masks.take(self.masks.len()).collect(),
        }
    }

    /// Force of each fingertip on the object, thumb first, from an answer to the last prescribed
    /// displacements; `None` if the answer has no forces.
    ///
    /// Shapes: `reactions` at any degrees of freedom, of which only held ones count; `mask_forces` one
    /// for each finger, or empty. Units: N. Frame: the object's.
    pub fn fingertip_forces(
        &self,
        reactions: &[DofValue],
        mask_forces: &[[f64; 3]],
    ) -> Option<[Vector3<f64>; 5]> {
        if !self.masks.is_empty() {
            let forces: [[f64; 3]; 5] = mask_forces.try_into().ok()?;
            return Some(forces.map(Vector3::from));
        }
        if reactions.is_empty() {
            return None;
        }
        let mut forces = [Vector3::zeros(); 5];
        for DofValue { dof, value } in reactions {
            if let Ok(at) = self.held.binary_search_by_key(&(dof / 3), |held| held.0) {
                forces[self.held[at].1][*dof as usize % 3] += value;
            }
        }
        Some(forces)
    }

    /// Forgets the contacts, because the rest shape has changed.
    pub fn clear(&mut self) {
        self.touched = None;
    }
}

/// Surface nodes within a fingertip's radius of its touched node; a node near two belongs to the nearer.
fn patches(object: &SoftObject, tip_radii: [f64; 5], touched: &[u32; 5]) -> Vec<(u32, usize)> {
    let rest = object.rest().vertices();
    let finger_of = |node: u32| {
        // A touched node is its own finger's, however near another tip is.
        if let Some(finger) = touched.iter().position(|t| *t == node) {
            return Some(finger);
        }
        let distance =
            |finger: usize| (rest[node as usize] - rest[touched[finger] as usize]).norm();
        (0..5)
            .filter(|&finger| distance(finger) <= tip_radii[finger])
            .min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
    };
    let nodes = object.surface().nodes.iter();
    nodes.filter_map(|&node| finger_of(node).map(|finger| (node, finger))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use softgrasp_core::mesh::{BuiltIn, generate};

    fn sphere() -> SoftObject {
        SoftObject::try_new(generate(BuiltIn::Sphere, 2000).unwrap()).unwrap()
    }

    fn known(object: &SoftObject) -> [KnownNode; 5] {
        let nodes = &object.surface().nodes;
        std::array::from_fn(|i| KnownNode {
            node: nodes[i * nodes.len() / 5],
            displacement_in_object: Vector3::new(0.001 * (i + 1) as f64, 0.0, -0.002),
        })
    }

    #[test]
    fn vertex_holds_the_touched_nodes_and_nothing_else() {
        let object = sphere();
        let known = known(&object);
        let values = HeldNodes::default()
            .prescribed_displacements(ContactModel::Vertex, &object, [0.007; 5], &known)
            .of_dofs;
        assert_eq!(values.len(), 15);
        let first = values.iter().find(|v| v.dof == 3 * known[2].node).unwrap();
        assert_eq!(first.value, 0.003);
    }

    #[test]
    fn patch_moves_every_covered_surface_node_with_its_nearest_tip() {
        let object = sphere();
        let known = known(&object);
        let radii = [0.008; 5];
        let values = HeldNodes::default()
            .prescribed_displacements(ContactModel::Patch, &object, radii, &known)
            .of_dofs;
        assert!(values.len() > 15 && values.windows(2).all(|w| w[0].dof < w[1].dof));
        let rest = object.rest().vertices();
        for &node in &object.surface().nodes {
            let near = |k: &KnownNode| (rest[node as usize] - rest[k.node as usize]).norm();
            let covered = known.iter().any(|k| near(k) <= 0.008);
            assert_eq!(covered, values.iter().any(|v| v.dof == 3 * node));
        }
    }

    #[test]
    fn forces_of_a_finger_are_those_of_its_nodes_or_that_of_its_mask() {
        let object = sphere();
        let known = known(&object);
        let radii = [0.008; 5];
        let at = |dof: u32| DofValue { dof, value: f64::from(dof % 3 + 1) };
        let mut held = HeldNodes::default();
        assert_eq!(held.fingertip_forces(&[], &[]), None);
        let asked = held.prescribed_displacements(ContactModel::Patch, &object, radii, &known);
        // A reaction at a node that no finger holds is no finger's.
        let free = object.surface().nodes.iter().find(|n| held.held.iter().all(|h| h.0 != **n));
        let reactions = asked.of_dofs.iter().map(|v| at(v.dof)).chain(free.map(|n| at(3 * n)));
        let forces = held.fingertip_forces(&reactions.collect::<Vec<_>>(), &[]).unwrap();
        for (finger, force) in forces.iter().enumerate() {
            let nodes = held.held.iter().filter(|h| h.1 == finger).count() as f64;
            assert_eq!(*force, Vector3::new(nodes, 2.0 * nodes, 3.0 * nodes));
        }
        held.clear();
        held.prescribed_displacements(ContactModel::Mask, &object, radii, &known);
        let of_masks: [[f64; 3]; 5] = std::array::from_fn(|i| [i as f64, 0.0, -1.0]);
        let forces = held.fingertip_forces(&[], &of_masks).unwrap();
        assert_eq!(forces[4], Vector3::new(4.0, 0.0, -1.0));
        assert_eq!(held.fingertip_forces(&[], &of_masks[..4]), None);
    }

    #[test]
    fn mask_gives_each_finger_one_mean_around_its_node() {
        let object = sphere();
        let mut known = known(&object);
        let mut held = HeldNodes::default();
        let asked = held.prescribed_displacements(ContactModel::Mask, &object, [0.008; 5], &known);
        assert!(asked.of_dofs.is_empty() && asked.masks.len() == 5);
        for ((nodes, weights), touched) in asked.masks.iter().zip(&known) {
            let at = nodes.binary_search(&touched.node).unwrap();
            assert!(nodes.len() > 3 && weights.iter().all(|w| *w <= weights[at]));
        }
        assert_eq!(asked.of_masks[4], [0.005, 0.0, -0.002]);
        // The next frame holds the same; another node is another mask.
        known[0].displacement_in_object.x = 0.5;
        let next = held.prescribed_displacements(ContactModel::Mask, &object, [0.008; 5], &known);
        assert!(next.masks == asked.masks && next.of_masks[0][0] == 0.5);
        known[0].node = object.surface().nodes[7];
        let other = held.prescribed_displacements(ContactModel::Mask, &object, [0.008; 5], &known);
        assert!(other.masks != asked.masks);
    }
}
