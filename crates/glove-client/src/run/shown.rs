//! The object as a run shows it: shape and pose, and the answer that the shape comes from.

use nalgebra::{Isometry3, Vector3};
use softgrasp_grasp::object::{ObjectError, SoftObject};
use softgrasp_protocol::NodeChoice;

/// The object as a run shows it.
pub(crate) struct Shown {
    object: SoftObject,
    world_from_object: Isometry3<f64>,
    /// Tick whose answer the object shows.
    tick: Option<u64>,
    /// Force of each fingertip in that answer, N, in the object's frame.
    forces: Option<[Vector3<f64>; 5]>,
    /// Whether the material has flowed, so that the object will not return to its rest shape.
    has_flowed: bool,
}

impl Shown {
    /// Object at the origin of the world.
    pub(crate) fn new(object: SoftObject) -> Self {
        let world_from_object = Isometry3::identity();
        Self { object, world_from_object, tick: None, forces: None, has_flowed: false }
    }

    pub(crate) fn object(&self) -> &SoftObject {
        &self.object
    }

    pub(crate) fn world_from_object(&self) -> &Isometry3<f64> {
        &self.world_from_object
    }

    pub(crate) fn tick(&self) -> Option<u64> {
        self.tick
    }

    pub(crate) fn forces(&self) -> Option<[Vector3<f64>; 5]> {
        self.forces
    }

    pub(crate) fn has_flowed(&self) -> bool {
        self.has_flowed
    }

    /// Sets the pose of the object.
    pub(crate) fn place(&mut self, world_from_object: Isometry3<f64>) {
        self.world_from_object = world_from_object;
    }

    /// Sets the answer that the shape comes from.
    pub(crate) fn name_answer(
        &mut self,
        tick: u64,
        forces: Option<[Vector3<f64>; 5]>,
        has_flowed: bool,
    ) {
        (self.tick, self.forces, self.has_flowed) = (Some(tick), forces, has_flowed);
    }

    /// Forgets the answer, because the shape comes from none of this grip.
    pub(crate) fn forget_answer(&mut self) {
        (self.tick, self.forces) = (None, None);
    }

    /// Forgets that the material has flowed, because its dent is being kept.
    pub(crate) fn forget_flow(&mut self) {
        self.has_flowed = false;
    }

    /// Moves the answered nodes by their displacements, m, in the object's frame.
    ///
    /// # Errors
    /// [`ObjectError`] if they are not nodes of this object.
    pub(crate) fn deform(
        &mut self,
        nodes: &NodeChoice,
        displacement: Vec<[f64; 3]>,
    ) -> Result<(), ObjectError> {
        match nodes {
            NodeChoice::All => self.object.apply(displacement),
            NodeChoice::Nodes(_) => self.object.apply_to_surface(&displacement),
        }
    }

    /// Returns to the rest shape.
    ///
    /// # Errors
    /// [`ObjectError`] if the object cannot be shown.
    pub(crate) fn relax(&mut self) -> Result<(), ObjectError> {
        self.object.relax()
    }

    /// Shows another object, or one with another rest shape, from now on.
    pub(crate) fn replace(&mut self, object: SoftObject) {
        self.object = object;
        self.forget_answer();
        self.forget_flow();
    }
}
