//! Which contacts the server is asked to prepare while the hand comes near.

use nalgebra::Point3;
use softgrasp_protocol::Masks;

use crate::contact_model::ContactModel;
use crate::soft_object::SoftObject;

/// Contacts whose columns the server has been asked to prepare for this rest shape.
#[derive(Clone, Debug, Default)]
pub struct Prefetched {
    /// Node and finger (0 where any finger's is the same), ascending.
    contacts: Vec<(u32, usize)>,
}

/// What the server is asked to prepare next.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hint {
    /// Nodes.
    pub nodes: Vec<u32>,
    /// Masks of tips at nodes.
    pub masks: Masks,
}

/// Nodes nearer to a fingertip than this may be touched soon, m …
const DISTANCE: f64 = 0.012;
/// … but no more than so many contacts per rest shape are prepared.
const CONTACTS_MAX: usize = 160;

impl Prefetched {
    /// Contacts near the tips that have not been asked for yet.
    ///
    /// Units: m. Frame: `tips_in_object` the object's.
    pub fn next(
        &mut self,
        model: ContactModel,
        object: &SoftObject,
        tip_radii: [f64; 5],
        tips_in_object: &[Point3<f64>; 5],
    ) -> Hint {
        let mut near = Vec::new();
        for (finger, tip) in tips_in_object.iter().enumerate() {
            let mut nodes = Vec::new();
            object.tree().nodes_near(tip, DISTANCE, &mut nodes);
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
        let mut hint = Hint::default();
        for (node, finger) in near {
            match model {
                ContactModel::Mask => {
                    hint.masks.push(object.tip_mask(node, tip_radii[finger]).entries());
                }
                ContactModel::Vertex | ContactModel::Patch => hint.nodes.push(node),
            }
        }
        hint
    }

    /// Forgets all: the rest shape has changed.
    pub fn clear(&mut self) {
        self.contacts.clear();
    }
}

impl Hint {
    /// Whether there is nothing to prepare.
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
        let object = SoftObject::try_new(generate(BuiltIn::Sphere, 500).unwrap()).unwrap();
        let tip = object.rest().vertices()[object.surface().nodes[3] as usize];
        let far = Point3::new(1.0, 1.0, 1.0);
        let (tips, radii) = ([tip, tip, far, far, far], [0.008, 0.007, 0.007, 0.007, 0.006]);
        let mut nodes = Prefetched::default();
        let hint = nodes.next(ContactModel::Vertex, &object, radii, &tips);
        assert!(!hint.nodes.is_empty() && hint.masks.is_empty());
        assert!(nodes.next(ContactModel::Vertex, &object, radii, &tips).is_empty());
        let mut masks = Prefetched::default();
        let by_mask = masks.next(ContactModel::Mask, &object, radii, &tips);
        assert!(by_mask.nodes.is_empty() && by_mask.masks.len() == 2 * hint.nodes.len());
        assert!(masks.next(ContactModel::Mask, &object, radii, &tips).is_empty());
        masks.clear();
        let again = masks.next(ContactModel::Mask, &object, radii, &tips);
        assert_eq!(again, by_mask, "the very bits that a frame will name");
    }
}
