//! Makes an object ready for the hand: mesh, sphere tree, and a plan to grasp it; where wanted in the
//! background, with its progress shown.

use std::sync::Arc;

use softgrasp_grasp::object::{
    ContactModel, ObjectChoice, ObjectError, RestShape, SoftObject, lying,
};
use softgrasp_hand::hand_reader::HandSetup;
use softgrasp_hand::loaded_object::{LoadStage, LoadedObject, ObjectSummary};
use softgrasp_hand::scripted::{NoGrasp, PlanRequest};

use crate::object::region_choice::{MeshOfRegions, RegionChoice, RegionError};
use crate::object::scene::{SceneError, SceneObject, load_object};

/// Object that is wanted, and the hand that is to grasp it.
#[derive(Clone)]
pub struct ObjectRequest {
    /// Built-in object or file.
    pub choice: ObjectChoice,
    /// Number of nodes of a built-in object.
    pub nodes: usize,
    /// Longest extent of the object, m; `None` where the hand may choose it.
    pub size_m: Option<f64>,
    /// Regions of a material of their own.
    pub regions: Vec<RegionChoice>,
    /// Dimensions and devices of the hand.
    pub setup: HandSetup,
    /// What a fingertip holds: a node, a patch or a mask.
    pub contact: ContactModel,
}

/// Why there is no object.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The object cannot be read or generated.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// Regions that it has not.
    #[error(transparent)]
    Region(#[from] RegionError),
    /// The mesh is none that can be touched.
    #[error(transparent)]
    Object(#[from] ObjectError),
}

/// Factor by which an imported object is enlarged while the hand finds no grip, and the largest extent,
/// m.
const ENLARGE: f64 = 1.25;
const ENLARGED_MAX_M: f64 = 0.2;

/// Rotation below which an object counts as not rotated, rad.
const TURN_WORTH_SAYING: f64 = 1e-3;

/// Makes an object ready. `goes_on` is told each stage and returns whether to go on; if it does not, the
/// result is `None`.
///
/// An imported object whose size was not asked for is enlarged until the hand finds a grip.
///
/// # Errors
/// [`LoadError`] if there is no object.
pub fn load(
    request: &ObjectRequest,
    mut goes_on: impl FnMut(LoadStage) -> bool,
) -> Result<Option<LoadedObject>, LoadError> {
    let ObjectRequest { choice, nodes, size_m, regions, setup, contact } = request;
    let mut size = *size_m;
    loop {
        if !goes_on(LoadStage::Mesh) {
            return Ok(None);
        }
        let SceneObject { mesh, region_names, mut notes } = load_object(choice, *nodes, size)?;
        let made = MeshOfRegions::try_new(mesh, &region_names, regions)?;
        let (mut mesh, regions) = (made.mesh, made.regions);
        notes.extend(made.notes);
        if *contact == ContactModel::Friction {
            let (lies, turn) = lying(&mesh).map_err(ObjectError::Shape)?;
            mesh = lies;
            if turn.angle() > TURN_WORTH_SAYING {
                let degrees = turn.angle().to_degrees();
                notes.push(format!("turned by {degrees:.0}° so that it lies on the table"));
            }
        }
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
        let object = SoftObject::at_rest(RestShape::try_new(mesh)?.with_regions(regions), 1);
        if !goes_on(LoadStage::Plan) {
            return Ok(None);
        }
        let rest = Arc::clone(object.rest_shape());
        let plan = PlanRequest::new(rest, setup.clone(), *contact).grip();
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

#[cfg(test)]
mod tests {
    use super::*;

    fn request(object: &str) -> ObjectRequest {
        ObjectRequest {
            choice: object.parse().unwrap(),
            nodes: 64,
            size_m: None,
            regions: Vec::new(),
            setup: HandSetup::default(),
            contact: ContactModel::default(),
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
        assert_eq!(stages, LoadStage::ALL);
        assert_eq!((loaded.summary.nodes, loaded.object.shape().len()), (64, 64));
        assert!(loaded.plan.is_ok());
    }

    #[test]
    fn object_that_nobody_wants_any_more_is_not_made() {
        for last in LoadStage::ALL {
            assert!(load(&request("cube"), |stage| stage < last).unwrap().is_none());
        }
    }

    #[test]
    fn file_that_is_not_there_is_told_in_a_sentence() {
        let Err(error) = load(&request("no-such-file.msh"), |_| true) else { panic!("loaded") };
        assert!(error.to_string().starts_with("cannot read no-such-file.msh"), "{error}");
    }
}
