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

/// Work on the object.
pub enum ObjectJob {
    /// Make a deformed shape the next rest shape: check it, rebuild the tree, form the model.
    Keep {
        /// Present rest shape.
        rest: Arc<RestShape>,
        /// Every vertex of the shape to keep, m, in the object's frame.
        vertices: Vec<Point3<f64>>,
        /// Least share of the displacement from the present rest shape that is not to be kept; a larger one is
        /// left where elements would be turned inside out. `None`: all is kept, or nothing.
        share_left: Option<f64>,
        /// Number of rest shapes so far.
        rest_shapes: u64,
        /// Material of the model.
        material: Material,
        /// Element of the model.
        element: ElementName,
    },
    /// Make an object with another rest shape, and form its model.
    Replace {
        /// Rest shape of the new object.
        rest: Arc<RestShape>,
        /// Number of rest shapes, the new one included.
        rest_shapes: u64,
        /// Material of the model.
        material: Material,
        /// Element of the model.
        element: ElementName,
    },
    /// Write a shape to a file.
    Save(ShapeToSave),
    /// Compute the hint that tells the server which columns to prepare.
    Prefetch {
        /// Rest shape that the contacts are on.
        rest: Arc<RestShape>,
        /// Number of rest shapes so far.
        rest_shapes: u64,
        /// What a fingertip holds: a node, a patch or a mask.
        model: ContactModel,
        /// Radius of each fingertip, m.
        tip_radii: [f64; 5],
        /// Contacts that may be made soon.
        contacts: Vec<NearContact>,
    },
}

/// Outcome of a job.
pub enum ObjectDone {
    /// Object with its next rest shape and the model of it, or the reason why it cannot be kept.
    Kept(Result<Box<KeptShape>, ObjectError>),
    /// Object that replaces the present one, and its model.
    Replacement(Box<KeptShape>),
    /// Sentence that tells what was written, or why nothing was.
    Saved(Result<String, String>),
    /// Hint for the server, and the rest shape that it belongs to.
    Prefetch {
        /// Number of rest shapes when the job began.
        rest_shapes: u64,
        /// Contacts whose columns the server is to prepare.
        hint: Hint,
    },
}

/// An object with its next rest shape.
pub struct KeptShape {
    /// Object at rest.
    pub object: SoftObject,
    /// Model of the rest shape.
    pub model: ModelUpload,
    /// Share of the displacement from the rest shape before that has not become a part of this one.
    pub share_left: f64,
}

/// Largest share of a displacement that is not kept: something is.
const SHARE_LEFT_MAX: f64 = 0.9;
/// Larger shares that are tried where elements would be turned inside out.
const SHARES_TRIED: u32 = 8;

/// The rest shape that a deformed shape makes, and the share of its displacement that is not in it.
fn kept(
    rest: &RestShape,
    vertices: Vec<Point3<f64>>,
    share_left: Option<f64>,
) -> Result<(RestShape, f64), ObjectError> {
    let Some(least) = share_left else { return Ok((rest.kept(vertices)?, 0.0)) };
    let without = |share: f64| {
        let places = vertices.iter().zip(rest.mesh().vertices());
        places.map(|(place, at_rest)| place + share * (at_rest - place)).collect::<Vec<_>>()
    };
    let least = least.clamp(0.0, SHARE_LEFT_MAX);
    let more = (SHARE_LEFT_MAX - least) / f64::from(SHARES_TRIED);
    let shares = (0..=SHARES_TRIED).map(|i| least + f64::from(i) * more);
    let fits = |share: &f64| rest.check(&without(*share)).is_ok();
    let share = shares.into_iter().find(fits).unwrap_or(least);
    Ok((rest.kept(without(share))?, share))
}

impl ObjectJob {
    fn work(self) -> ObjectDone {
        match self {
            Self::Keep { rest, vertices, share_left, rest_shapes, material, element } => {
                ObjectDone::Kept(kept(&rest, vertices, share_left).map(|(kept, share_left)| {
                    let object = SoftObject::at_rest(kept, rest_shapes + 1);
                    let model = ModelUpload::new(
                        object.rest_shape(),
                        object.rest_shapes(),
                        material,
                        element,
                    );
                    Box::new(KeptShape { object, model, share_left })
                }))
            }
            Self::Replace { rest, rest_shapes, material, element } => {
                let object = SoftObject::at_rest(rest, rest_shapes);
                let model = ModelUpload::new(object.rest_shape(), rest_shapes, material, element);
                ObjectDone::Replacement(Box::new(KeptShape { object, model, share_left: 0.0 }))
            }
            Self::Save(shape) => ObjectDone::Saved(shape.save().map_err(|error| one_line(&error))),
            Self::Prefetch { rest, rest_shapes, model, tip_radii, contacts } => {
                let hint = Hint::new(model, &rest, tip_radii, &contacts);
                ObjectDone::Prefetch { rest_shapes, hint }
            }
        }
    }
}

/// Does jobs: in the background in real time; at once, while the tick waits, in lockstep.
pub enum ObjectWork {
    /// Jobs are done at once; outcomes that have not been taken yet.
    AtOnce(VecDeque<ObjectDone>),
    /// Jobs are done on a thread of its own.
    Beside(Beside<ObjectJob, ObjectDone>),
}

impl ObjectWork {
    /// Worker that fits the pace.
    ///
    /// # Errors
    /// Error of the operating system if it starts no thread.
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

    /// Takes the next outcome, in the order of the jobs, if `is_due` accepts it; otherwise it stays the
    /// next. Never waits. Outcomes of background work are always taken.
    pub fn take_if(&mut self, is_due: impl FnOnce(&ObjectDone) -> bool) -> Option<ObjectDone> {
        match self {
            Self::AtOnce(done) if done.front().is_some_and(is_due) => done.pop_front(),
            Self::AtOnce(_) => None,
            Self::Beside(beside) => beside.take(),
        }
    }

    /// Waits until all jobs are done; their outcomes are still to be taken.
    pub fn settle(&mut self) {
        if let Self::Beside(beside) = self {
            beside.settle();
        }
    }

    /// Whether there are jobs whose outcome has not been taken.
    pub fn is_busy(&self) -> bool {
        match self {
            Self::AtOnce(done) => !done.is_empty(),
            Self::Beside(beside) => beside.is_busy(),
        }
    }
}
