//! The state of a free object on the wire: pose, velocities, and the forces that shape it.

use wincode::{SchemaRead, SchemaWrite};

use super::rigid_body::Pose;
use crate::limits::check_count;
use crate::payload::{PayloadReader, PayloadWriter, count_of};
use crate::{DecodeError, EncodeError, Limits};

/// State of a free object between two steps; a client sends back the state that it received.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectState {
    /// Pose of the object's mesh in the world frame.
    pub pose: Pose,
    /// Velocity of the centre of mass, m/s, in the world frame.
    pub velocity: [f64; 3],
    /// Angular velocity, rad/s, in the world frame.
    pub angular_velocity: [f64; 3],
    /// Nodes with forces whose elastic response is the present shape.
    pub force_nodes: Vec<u32>,
    /// Forces on these nodes, N, in the object's frame.
    pub forces: Vec<[f64; 3]>,
    /// Contacts at the end of the last step, with which the next one begins.
    pub contacts: Vec<HeldContact>,
}

/// A contact at the end of a step: the next one begins with it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldContact {
    /// Position of the body in the list of bodies.
    pub body: u32,
    /// Nodes of the surface triangle that the contact lies in.
    pub nodes: [u32; 3],
    /// Weights of these nodes at the contact's position.
    pub weights: [f64; 3],
    /// Force on the object, N, in the object's frame.
    pub force: [f64; 3],
}

/// Announces the arrays of an [`ObjectState`].
#[derive(Clone, Copy, Debug, SchemaRead, SchemaWrite)]
pub(super) struct ObjectStatePart {
    pose: Pose,
    velocity: [f64; 3],
    angular_velocity: [f64; 3],
    force_count: u32,
    contact_count: u32,
}

const FORCES: &str = "forces of the state";
const CONTACTS: &str = "contacts of the state";

impl ObjectState {
    /// State of an undeformed object that rests at `pose`.
    pub fn at_rest(pose: Pose) -> Self {
        Self {
            pose,
            velocity: [0.0; 3],
            angular_velocity: [0.0; 3],
            force_nodes: Vec::new(),
            forces: Vec::new(),
            contacts: Vec::new(),
        }
    }

    pub(super) fn part(&self) -> Result<ObjectStatePart, EncodeError> {
        let (count, expected) = (self.forces.len(), self.force_nodes.len());
        if count != expected {
            return Err(EncodeError::CountMismatch { what: FORCES, count, expected });
        }
        Ok(ObjectStatePart {
            pose: self.pose,
            velocity: self.velocity,
            angular_velocity: self.angular_velocity,
            force_count: count_of(FORCES, expected)?,
            contact_count: count_of(CONTACTS, self.contacts.len())?,
        })
    }

    /// Writes the arrays: nodes with forces, forces; of the contacts body and nodes, weights and forces.
    pub(super) fn write_arrays(&self, writer: &mut PayloadWriter<'_>) {
        writer.array(&self.force_nodes);
        writer.array(&self.forces);
        let names: Vec<u32> = self
            .contacts
            .iter()
            .flat_map(|contact| std::iter::once(contact.body).chain(contact.nodes))
            .collect();
        writer.array(&names);
        let numbers: Vec<[[f64; 3]; 2]> =
            self.contacts.iter().map(|contact| [contact.weights, contact.force]).collect();
        writer.array(numbers.as_flattened());
    }

    /// Reads the arrays that [`write_arrays`](Self::write_arrays) wrote; the counts have been checked.
    pub(super) fn read_arrays(
        reader: &mut PayloadReader<'_>,
        part: ObjectStatePart,
    ) -> Result<Self, DecodeError> {
        let (force_count, contact_count) = (part.force_count as usize, part.contact_count as usize);
        let force_nodes = reader.array(FORCES, force_count)?;
        let forces = reader.array(FORCES, force_count)?;
        let names: Vec<u32> = reader.array(CONTACTS, 4 * contact_count)?;
        let numbers: Vec<[f64; 3]> = reader.array(CONTACTS, 2 * contact_count)?;
        let both = names.as_chunks::<4>().0.iter().zip(numbers.as_chunks::<2>().0);
        let contacts = both
            .map(|(&[body, a, b, c], &[weights, force])| HeldContact {
                body,
                nodes: [a, b, c],
                weights,
                force,
            })
            .collect();
        Ok(Self {
            pose: part.pose,
            velocity: part.velocity,
            angular_velocity: part.angular_velocity,
            force_nodes,
            forces,
            contacts,
        })
    }
}

impl ObjectStatePart {
    pub(super) fn check(&self, limits: &Limits) -> Result<(), DecodeError> {
        check_count(FORCES, self.force_count, limits.node_count_max)?;
        check_count(CONTACTS, self.contact_count, limits.dof_count_max)?;
        Ok(())
    }
}
