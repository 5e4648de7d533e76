//! The object as a run shows it: its shape and pose, and the answer that the shape comes from.

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
    /// Whether the shape has flowed, so that it will not go back to rest.
    has_flowed: bool,
}

impl Shown {
    /// An object whose frame is the world's.
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

    /// Moves the object as a whole.
    pub(crate) fn place(&mut self, world_from_object: Isometry3<f64>) {
        self.world_from_object = world_from_object;
    }

    /// Names the answer that the shape comes from.
    pub(crate) fn name_answer(
        &mut self,
        tick: u64,
        forces: Option<[Vector3<f64>; 5]>,
        has_flowed: bool,
    ) {
        (self.tick, self.forces, self.has_flowed) = (Some(tick), forces, has_flowed);
    }

    /// The shape comes from no answer of a grip any more.
    pub(crate) fn forget_answer(&mut self) {
        (self.tick, self.forces) = (None, None);
    }

    /// What has flowed is taken care of.
    pub(crate) fn forget_flow(&mut self) {
        self.has_flowed = false;
    }

    /// Moves the answered nodes by their displacements (m, in the object's frame).
    ///
    /// # Errors
    /// [`ObjectError`] when they are not those of this object.
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

    /// Goes back to the rest shape.
    ///
    /// # Errors
    /// [`ObjectError`] when the object cannot be shown any more.
    pub(crate) fn relax(&mut self) -> Result<(), ObjectError> {
        self.object.relax()
    }

    /// From now on the object is another one, or has another rest shape.
    pub(crate) fn replace(&mut self, object: SoftObject) {
        self.object = object;
        self.forget_answer();
        self.forget_flow();
    }
}
