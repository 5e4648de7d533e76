//! Makes an object ready for the hand: mesh, sphere tree, and a plan to grasp it; where wanted in the
//! background, with its progress shown.

use std::sync::Arc;

use softgrasp_grasp::object::{
    ContactModel, ObjectChoice, ObjectError, RestShape, SoftObject, lying,
};
use softgrasp_hand::hand_setup::HandSetup;
use softgrasp_hand::loaded_object::{LoadStage, LoadedObject, ObjectSummary};
use softgrasp_hand::scripted::{NoGrasp, PlanRequest};
use softgrasp_protocol::ElementName;

use crate::object::element_nodes::{ElementNodesError, with_nodes_of};
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
    /// Element whose nodes the object has.
    pub element: ElementName,
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
    /// The mesh cannot have the nodes of the element.
    #[error(transparent)]
    Element(#[from] ElementNodesError),
    /// The mesh is none that can be touched.
    #[error(transparent)]
    Object(#[from] ObjectError),
}

/// Factor by which an imported object is enlarged while the hand finds no grip, and the largest extent,
/// m.
const ENLARGE: f64 = 1.25;
const ENLARGED_MAX_M: f64 = 0.2;

/// Note for an object that this hand has no grip for within the cones of friction.
const MAY_SLIDE: &str = "no grip was found that friction holds for sure, so the object may slide out of the \
                         hand: try another --object-size, or --grasp thesis";

/// Rotation below which an object counts as not rotated, rad.
const TURN_WORTH_SAYING: f64 = 1e-3;

/// Makes an object ready. `goes_on` is told each stage and returns whether to go on; if it does not, the
/// result is `None`.
///
/// An imported object whose size was not asked for is enlarged until the hand finds a grip, one that holds it
/// if fingertips press with friction; where no size has such a grip, the smallest that the hand reaches is
/// taken.
///
/// # Errors
/// [`LoadError`] if there is no object.
pub fn load(
    request: &ObjectRequest,
    mut goes_on: impl FnMut(LoadStage) -> bool,
) -> Result<Option<LoadedObject>, LoadError> {
    let may_grow = request.size_m.is_none() && matches!(request.choice, ObjectChoice::File(_));
    let mut size = request.size_m;
    let mut smallest: Option<LoadedObject> = None;
    loop {
        let Some(loaded) = load_at(request, size, &mut goes_on)? else { return Ok(None) };
        let extent_m = size.unwrap_or_else(|| loaded.object.rest().size());
        let is_gripped = match &loaded.plan {
            Ok(plan) => plan.holds_by_friction || request.contact != ContactModel::Friction,
            Err(reason) => matches!(reason, NoGrasp::TooFewNodes { .. }),
        };
        if is_gripped || !may_grow || extent_m >= ENLARGED_MAX_M {
            let found = if is_gripped { loaded } else { smallest.unwrap_or(loaded) };
            return Ok(goes_on(LoadStage::Ready).then_some(found));
        }
        if loaded.plan.is_ok() {
            smallest.get_or_insert(loaded);
        }
        size = Some((ENLARGE * extent_m).min(ENLARGED_MAX_M));
    }
}

/// Makes an object of one size ready, as far as `goes_on` allows: mesh, sphere tree and plan.
fn load_at(
    request: &ObjectRequest,
    size: Option<f64>,
    goes_on: &mut impl FnMut(LoadStage) -> bool,
) -> Result<Option<LoadedObject>, LoadError> {
    let ObjectRequest { choice, nodes, regions, setup, contact, element, .. } = request;
    if !goes_on(LoadStage::Mesh) {
        return Ok(None);
    }
    let SceneObject { mesh, region_names, mut notes } = load_object(choice, *nodes, size)?;
    let made = MeshOfRegions::try_new(mesh, &region_names, regions)?;
    let (mut mesh, regions) = (made.mesh, made.regions);
    notes.extend(made.notes);
    let by_friction = *contact == ContactModel::Friction;
    if by_friction {
        let (lies, turn) = lying(&mesh).map_err(ObjectError::Shape)?;
        mesh = lies;
        if turn.angle() > TURN_WORTH_SAYING {
            let degrees = turn.angle().to_degrees();
            notes.push(format!("turned by {degrees:.0}° so that it lies on the table"));
        }
    }
    let mesh = with_nodes_of(mesh, *element)?;
    let mut summary = ObjectSummary {
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
    if by_friction && plan.as_ref().is_ok_and(|plan| !plan.holds_by_friction) {
        summary.notes.push(MAY_SLIDE.to_owned());
    }
    Ok(Some(LoadedObject { summary, brought_to_m: size, object, plan }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;
    use softgrasp_core::mesh::{BuiltIn, generate};
    use softgrasp_core::mesh_io::write_msh41;

    fn request(object: &str) -> ObjectRequest {
        ObjectRequest {
            choice: object.parse().unwrap(),
            nodes: 64,
            size_m: None,
            regions: Vec::new(),
            setup: HandSetup::default(),
            contact: ContactModel::default(),
            element: ElementName::T4,
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
    fn object_of_ten_node_elements_can_be_touched_between_its_corners() {
        let asked = ObjectRequest { element: ElementName::T10, ..request("cube") };
        let loaded = load(&asked, |_| true).unwrap().unwrap();
        let rest = loaded.object.rest_shape();
        let nodes = rest.mesh().node_count();
        assert!(nodes > 300 && loaded.summary.nodes == nodes, "{nodes}");
        assert!(rest.surface().nodes.iter().any(|node| *node >= 64));
        assert!(loaded.plan.is_ok());
    }

    #[test]
    fn object_that_nobody_wants_any_more_is_not_made() {
        for last in LoadStage::ALL {
            assert!(load(&request("cube"), |stage| stage < last).unwrap().is_none());
        }
    }

    #[test]
    fn file_of_a_thing_too_thin_for_a_thumb_is_enlarged_until_friction_can_hold_it() {
        let cube = generate(BuiltIn::Cube, 64).unwrap();
        let edge = cube.bounds().1.x - cube.bounds().0.x;
        let rod = |p: &Point3<f64>| Point3::new(p.x, 0.16 * p.y, 0.2 * p.z) * (0.08 / edge);
        let rod = cube.with_vertices(cube.vertices().iter().map(rod).collect()).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rod.msh");
        std::fs::write(&path, write_msh41(&rod)).unwrap();
        let asked = request(path.to_str().unwrap());
        let sizes = [ContactModel::Mask, ContactModel::Friction].map(|contact| {
            let loaded = load(&ObjectRequest { contact, ..asked.clone() }, |_| true);
            let loaded = loaded.unwrap().unwrap();
            let plan = loaded.plan.unwrap();
            assert_eq!(plan.holds_by_friction, contact == ContactModel::Friction);
            loaded.summary.size_m
        });
        assert!(sizes[1] > 1.2 * sizes[0], "{sizes:?} m");
        let given = ObjectRequest { contact: ContactModel::Friction, size_m: Some(0.08), ..asked };
        let loaded = load(&given, |_| true).unwrap().unwrap();
        assert!((loaded.summary.size_m - 0.08).abs() < 0.01, "a size that was asked for is kept");
        assert!(
            loaded.summary.notes.iter().any(|note| note == MAY_SLIDE),
            "and what that means told"
        );
    }

    #[test]
    fn file_that_is_not_there_is_told_in_a_sentence() {
        let Err(error) = load(&request("no-such-file.msh"), |_| true) else { panic!("loaded") };
        assert!(error.to_string().starts_with("cannot read no-such-file.msh"), "{error}");
    }
}
