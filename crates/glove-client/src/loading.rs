//! Makes an object ready for the hand: mesh, sphere tree, and a plan to grasp it; beside everything
//! else where that is wanted, with its progress to be seen.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, channel};

use crate::contact_model::ContactModel;
use crate::hand_reader::HandSetup;
use crate::rest_shape::ObjectError;
use crate::run_report::ObjectSummary;
use crate::scene::{ObjectChoice, SceneError, SceneObject, load_object};
use crate::scripted::{GraspPlan, NoGrasp, PlanRequest};
use crate::soft_object::SoftObject;

/// Which object is wanted, and the hand that is to grasp it.
#[derive(Clone)]
pub struct ObjectRequest {
    /// The object.
    pub choice: ObjectChoice,
    /// Nodes of a built-in object.
    pub nodes: usize,
    /// Longest extent, m; `None` where the hand may choose it.
    pub size_m: Option<f64>,
    /// The hand.
    pub setup: HandSetup,
    /// What its fingertips hold.
    pub contact: ContactModel,
}

/// An object ready for the hand.
pub struct LoadedObject {
    /// What it is, for reports.
    pub summary: ObjectSummary,
    /// Longest extent that the mesh was brought to, m; `None` where it kept its own.
    pub brought_to_m: Option<f64>,
    /// The object, at rest.
    pub object: SoftObject,
    /// How the hand grasps it, or why it cannot.
    pub plan: Result<GraspPlan, NoGrasp>,
}

/// Why there is no object.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// No mesh.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A mesh that cannot be touched.
    #[error(transparent)]
    Object(#[from] ObjectError),
    /// The thread that loads ended without a result.
    #[error("loading ended abnormally; this is a fault of the program")]
    Lost,
}

/// What is being done.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LoadStage {
    /// The mesh is read and checked, or generated.
    Mesh,
    /// Surface, sphere tree and normals are made.
    Tree,
    /// A good way to grasp it is looked for.
    Plan,
    /// It is there.
    Ready,
}

/// Factor by which an imported object grows while the hand finds no grip, and where it ends, m.
const ENLARGE: f64 = 1.25;
const ENLARGED_MAX_M: f64 = 0.2;

/// Makes an object ready; says at which stage it is, and asks whether to go on: a caller who does
/// not want it any more gets `None` soon.
///
/// An imported object whose size was not asked for is enlarged until the hand finds a grip.
///
/// # Errors
/// [`LoadError`].
pub fn load(
    request: &ObjectRequest,
    mut goes_on: impl FnMut(LoadStage) -> bool,
) -> Result<Option<LoadedObject>, LoadError> {
    let ObjectRequest { choice, nodes, size_m, setup, contact } = request;
    let mut size = *size_m;
    loop {
        if !goes_on(LoadStage::Mesh) {
            return Ok(None);
        }
        let SceneObject { mesh, notes } = load_object(choice, *nodes, size)?;
        let summary = ObjectSummary {
            name: choice.to_string(),
            nodes: mesh.node_count(),
            tets: mesh.tets().len(),
            size_m: mesh.size(),
            notes,
        };
        if !goes_on(LoadStage::Tree) {
            return Ok(None);
        }
        let object = SoftObject::try_new(mesh)?;
        if !goes_on(LoadStage::Plan) {
            return Ok(None);
        }
        let rest = Arc::clone(object.rest_shape());
        let plan =
            PlanRequest { object: rest, setup: setup.clone(), contact: *contact, avoid_gaze: None };
        let plan = plan.grip();
        match plan {
            Err(NoGrasp::OutOfReach { extent_m })
                if size_m.is_none()
                    && matches!(choice, ObjectChoice::File(_))
                    && extent_m < ENLARGED_MAX_M =>
            {
                size = Some(ENLARGE * extent_m);
            }
            plan => {
                let wanted = goes_on(LoadStage::Ready);
                return Ok(wanted.then_some(LoadedObject {
                    summary,
                    brought_to_m: size,
                    object,
                    plan,
                }));
            }
        }
    }
}

/// An object that is being loaded on a thread of its own. Dropping it cancels.
pub struct Loading {
    /// [`LoadStage`] as a number, or [`CANCELLED`].
    stage: Arc<AtomicU8>,
    result: Receiver<Result<LoadedObject, LoadError>>,
}

const STAGES: [LoadStage; 4] =
    [LoadStage::Mesh, LoadStage::Tree, LoadStage::Plan, LoadStage::Ready];
/// Nobody wants the object any more.
const CANCELLED: u8 = u8::MAX;

impl Loading {
    /// Begins. To be called from a thread without real-time priority.
    ///
    /// # Errors
    /// The system's, when it gives no thread.
    pub fn start(request: ObjectRequest) -> std::io::Result<Self> {
        let stage = Arc::new(AtomicU8::new(0));
        let (sender, result) = channel();
        let shared = Arc::clone(&stage);
        std::thread::Builder::new().name("loading".to_owned()).spawn(move || {
            let goes_on = |at: LoadStage| {
                let tell = |was| (was != CANCELLED).then_some(at as u8);
                shared.fetch_update(Ordering::Relaxed, Ordering::Relaxed, tell).is_ok()
            };
            if let Some(loaded) = load(&request, goes_on).transpose() {
                // Whoever cancelled does not listen.
                let _ = sender.send(loaded);
            }
        })?;
        Ok(Self { stage, result })
    }

    /// What is being done.
    pub fn stage(&self) -> LoadStage {
        let at = usize::from(self.stage.load(Ordering::Relaxed));
        STAGES.get(at).copied().unwrap_or(LoadStage::Ready)
    }

    /// The result, once it is there; never waits. It is there once.
    pub fn take(&self) -> Option<Result<LoadedObject, LoadError>> {
        match self.result.try_recv() {
            Ok(loaded) => Some(loaded),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err(LoadError::Lost)),
        }
    }
}

impl Drop for Loading {
    fn drop(&mut self) {
        self.stage.store(CANCELLED, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(object: &str) -> ObjectRequest {
        ObjectRequest {
            choice: object.parse().unwrap(),
            nodes: 64,
            size_m: None,
            setup: HandSetup::default(),
            contact: ContactModel::default(),
        }
    }

    fn wait(loading: &Loading) -> Result<LoadedObject, LoadError> {
        loop {
            if let Some(loaded) = loading.take() {
                return loaded;
            }
            std::thread::yield_now();
        }
    }

    #[test]
    fn object_comes_with_its_tree_and_a_plan_after_every_stage() {
        let mut stages = Vec::new();
        let loaded = load(&request("cube"), |stage| {
            stages.push(stage);
            true
        });
        let loaded = loaded.unwrap().unwrap();
        assert_eq!(stages, STAGES);
        assert_eq!((loaded.summary.nodes, loaded.object.shape().len()), (64, 64));
        assert!(loaded.plan.is_ok());
        let beside = wait(&Loading::start(request("cube")).unwrap()).unwrap();
        assert_eq!(beside.plan, loaded.plan);
    }

    #[test]
    fn object_that_nobody_wants_any_more_is_not_made() {
        for last in STAGES {
            assert!(load(&request("cube"), |stage| stage < last).unwrap().is_none());
        }
    }

    #[test]
    fn file_that_is_not_there_is_told_in_a_sentence() {
        let loading = Loading::start(request("no-such-file.msh")).unwrap();
        let Err(error) = wait(&loading) else { panic!("loaded") };
        assert!(error.to_string().starts_with("cannot read no-such-file.msh"), "{error}");
    }
}
