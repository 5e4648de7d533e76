//! Contacts whose columns the server is asked to prepare while the hand comes near.

use nalgebra::Point3;
use softgrasp_grasp::object::{ContactModel, RestShape};
use softgrasp_grasp::sphere_tree::SphereTree;
use softgrasp_protocol::Masks;

/// Contacts whose columns the server has been asked to prepare for this rest shape.
#[derive(Clone, Debug, Default)]
pub struct Prefetched {
    /// Contacts in ascending order.
    contacts: Vec<NearContact>,
}

/// Contact that may be made soon: node and finger (0 where the finger makes no difference).
pub type NearContact = (u32, usize);

/// Contacts that the server is asked to prepare next.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hint {
    /// Nodes that may be touched, by their numbers in the mesh.
    pub nodes: Vec<u32>,
    /// Masks of fingertips at such nodes.
    pub masks: Masks,
}

/// Chosen: distance to a fingertip, m, within which a node may be touched soon.
const DISTANCE: f64 = 0.012;
/// Chosen: largest number of contacts that are prepared for each rest shape.
const CONTACTS_MAX: usize = 160;

impl Prefetched {
    /// Contacts near the fingertips that have not been asked for yet.
    ///
    /// Units: m. Frame: `tips_in_object` the object's, as `tree`.
    pub fn next(
        &mut self,
        model: ContactModel,
        tree: &SphereTree,
        tips_in_object: &[Point3<f64>; 5],
    ) -> Vec<NearContact> {
        let mut near = Vec::new();
        for (finger, tip) in tips_in_object.iter().enumerate() {
            let mut nodes = Vec::new();
            tree.nodes_near(tip, DISTANCE, &mut nodes);
            // A node's columns are the same for every finger, a mask's are not.
            let finger = if model == ContactModel::Mask { finger } else { 0 };
            near.extend(nodes.into_iter().map(|node| (node, finger)));
        }
        near.sort_unstable();
        near.dedup();
        near.retain(|contact| self.contacts.binary_search(contact).is_err());
        near.truncate(CONTACTS_MAX.saturating_sub(self.contacts.len()));
        self.contacts.extend_from_slice(&near);
        self.contacts.sort_unstable();
        near
    }

    /// Forgets all contacts, because the rest shape has changed.
    pub fn clear(&mut self) {
        self.contacts.clear();
    }
}

impl Hint {
    /// Hint that names these contacts. Computing masks takes long.
    ///
    /// Units: `tip_radii` m.
    pub fn new(
        model: ContactModel,
        rest: &RestShape,
        tip_radii: [f64; 5],
        contacts: &[NearContact],
    ) -> Self {
        let mut hint = Self::default();
        for &(node, finger) in contacts {
            match model {
                ContactModel::Mask => {
                    hint.masks.push(rest.tip_mask(node, tip_radii[finger]).entries());
                }
                ContactModel::Vertex | ContactModel::Patch | ContactModel::Friction => {
                    hint.nodes.push(node);
                }
            }
        }
        hint
    }

    /// Adds another hint to this one.
    pub fn append(&mut self, other: &Self) {
        self.nodes.extend_from_slice(&other.nodes);
        self.masks.append(&other.masks);
    }

    /// Whether the hint names no contact.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty() && self.masks.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softgrasp_core::mesh::{BuiltIn, generate};

    #[test]
    fn each_contact_is_asked_for_once_and_masks_by_finger() {
        let rest = RestShape::try_new(generate(BuiltIn::Sphere, 500).unwrap()).unwrap();
        let tip = rest.mesh().vertices()[rest.surface().nodes[3] as usize];
        let far = Point3::new(1.0, 1.0, 1.0);
        let (tips, radii) = ([tip, tip, far, far, far], [0.008, 0.007, 0.007, 0.007, 0.006]);
        let hint = |prefetched: &mut Prefetched, model| {
            let contacts = prefetched.next(model, rest.tree(), &tips);
            Hint::new(model, &rest, radii, &contacts)
        };
        let mut nodes = Prefetched::default();
        let by_node = hint(&mut nodes, ContactModel::Vertex);
        assert!(!by_node.nodes.is_empty() && by_node.masks.is_empty());
        assert!(hint(&mut nodes, ContactModel::Vertex).is_empty());
        let mut masks = Prefetched::default();
        let by_mask = hint(&mut masks, ContactModel::Mask);
        assert!(by_mask.nodes.is_empty() && by_mask.masks.len() == 2 * by_node.nodes.len());
        assert!(hint(&mut masks, ContactModel::Mask).is_empty());
        masks.clear();
        let again = hint(&mut masks, ContactModel::Mask);
        assert_eq!(again, by_mask, "the very bits that a frame will name");
    }
}
