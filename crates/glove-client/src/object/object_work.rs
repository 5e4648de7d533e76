//! Work on the object that can take longer than a tick: a new rest shape, a file to be
//! written, masks to be prefetched.

use std::collections::VecDeque;
use std::sync::Arc;

use nalgebra::Point3;
use softgrasp_grasp::object::{ContactModel, ObjectError, RestShape, SoftObject};
use softgrasp_os::{Beside, one_line};
use softgrasp_protocol::{ElementName, Material};

use crate::ask::model_upload::ModelUpload;
use crate::ask::prefetch::{Hint, NearContact};
use crate::object::saving::ShapeToSave;
use crate::pace::Pace;

/// A piece of work.
pub enum ObjectJob {
    /// Make a deformed shape the next rest shape: check it, rebuild the tree, form the model.
    Keep {
        /// The rest shape so far.
        rest: Arc<RestShape>,
        /// Every vertex of the shape to keep, m.
        vertices: Vec<Point3<f64>>,
        /// How many rest shapes there have been.
        rest_shapes: u64,
        /// Material of the model.
        material: Material,
        /// Element of the model.
        element: ElementName,
    },
    /// Make an object with another rest shape, and form its model.
    Replace {
        /// The rest shape.
        rest: Arc<RestShape>,
        /// How many rest shapes there will have been.
        rest_shapes: u64,
        /// Material of the model.
        material: Material,
        /// Element of the model.
        element: ElementName,
    },
    /// Write a shape to a file.
    Save(ShapeToSave),
    /// Work out what the server is asked to prepare.
    Prefetch {
        /// The rest shape that the contacts are on.
        rest: Arc<RestShape>,
        /// How many rest shapes there have been.
        rest_shapes: u64,
        /// What a fingertip holds.
        model: ContactModel,
        /// Radius of each fingertip, m.
        tip_radii: [f64; 5],
        /// Contacts that may be made soon.
        contacts: Vec<NearContact>,
    },
}

/// What has come of it.
pub enum ObjectDone {
    /// The object with its next rest shape, and the model of it; or why it cannot be kept.
    Kept(Result<Box<KeptShape>, ObjectError>),
    /// The object that takes the place of the one so far, and its model.
    Replacement(Box<KeptShape>),
    /// What was written, or why nothing was; a sentence.
    Saved(Result<String, String>),
    /// What the server is asked to prepare for a rest shape.
    Prefetch {
        /// How many rest shapes there had been.
        rest_shapes: u64,
        /// What to prepare.
        hint: Hint,
    },
}

/// An object with its next rest shape.
pub struct KeptShape {
    /// The object, at rest.
    pub object: SoftObject,
    /// Its model.
    pub model: ModelUpload,
}

impl ObjectJob {
    fn work(self) -> ObjectDone {
        match self {
            Self::Keep { rest, vertices, rest_shapes, material, element } => {
                ObjectDone::Kept(rest.kept(vertices).map(|kept| {
                    let object = SoftObject::at_rest(kept, rest_shapes + 1);
                    let model =
                        ModelUpload::new(object.rest(), object.rest_shapes(), material, element);
                    Box::new(KeptShape { object, model })
                }))
            }
            Self::Replace { rest, rest_shapes, material, element } => {
                let object = SoftObject::at_rest(rest, rest_shapes);
                let model = ModelUpload::new(object.rest(), rest_shapes, material, element);
                ObjectDone::Replacement(Box::new(KeptShape { object, model }))
            }
            Self::Save(shape) => ObjectDone::Saved(shape.save().map_err(|error| one_line(&error))),
            Self::Prefetch { rest, rest_shapes, model, tip_radii, contacts } => {
                let hint = Hint::new(model, &rest, tip_radii, &contacts);
                ObjectDone::Prefetch { rest_shapes, hint }
            }
        }
    }
}

/// Does the work: beside the ticks in real time; at once, while the tick waits, in lockstep.
pub enum ObjectWork {
    /// At once; what was done and has not been taken yet.
    AtOnce(VecDeque<ObjectDone>),
    /// On a thread of its own.
    Beside(Beside<ObjectJob, ObjectDone>),
}

impl ObjectWork {
    /// The way that fits the pace.
    ///
    /// # Errors
    /// The system's, when it gives no thread.
    pub fn start(pace: Pace) -> std::io::Result<Self> {
        Ok(match pace {
            Pace::Lockstep => Self::AtOnce(VecDeque::new()),
            Pace::Free => Self::Beside(Beside::start("object", ObjectJob::work)?),
        })
    }

    /// Hands a job over.
    pub fn begin(&mut self, job: ObjectJob) {
        match self {
            Self::AtOnce(done) => done.push_back(job.work()),
            Self::Beside(beside) => beside.begin(job),
        }
    }

    /// The next piece of work that is done, in the order it was handed over, if it is to be taken now;
    /// else it stays the next. Never waits. Work beside the ticks is always taken.
    pub fn take_if(&mut self, is_due: impl FnOnce(&ObjectDone) -> bool) -> Option<ObjectDone> {
        match self {
            Self::AtOnce(done) if done.front().is_some_and(is_due) => done.pop_front(),
            Self::AtOnce(_) => None,
            Self::Beside(beside) => beside.take(),
        }
    }

    /// Waits until all work that was handed over is done; the outcomes are still to be taken.
    pub fn settle(&mut self) {
        if let Self::Beside(beside) = self {
            beside.settle();
        }
    }

    /// Whether work was handed over whose outcome has not been taken.
    pub fn is_busy(&self) -> bool {
        match self {
            Self::AtOnce(done) => !done.is_empty(),
            Self::Beside(beside) => beside.is_busy(),
        }
    }
}
