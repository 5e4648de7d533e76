//! Recording of a run: its header, and the check that an object is the recorded one.

use std::path::Path;

use anyhow::ensure;
use nalgebra::Isometry3;
use softgrasp_core::mesh::TetMesh;
use softgrasp_hand::devices::calibration::toml_text;
use softgrasp_hand::loaded_object::LoadedObject;
use softgrasp_hand::recording::{
    RecordedFriction, RecordedHand, RecordedRegion, RecordedSetup, Recorder, VERSION,
    VERSION_OF_ONE_HAND, VERSION_OF_TWO_HANDS,
};

use super::hand_arguments::SecondHand;
use super::run_plan::RunPlan;
use crate::ask::digest::Digest;
use crate::ask::solve_settings::{SolveSettings, Subscription};
use crate::object::object_place::ObjectPlace;
use crate::object::region_choice::RegionChoice;

/// Begins the recording of a run.
///
/// # Errors
/// The file cannot be written.
pub(super) fn start_recorder(
    path: &Path,
    plan: &RunPlan,
    loaded: &LoadedObject,
) -> anyhow::Result<Recorder> {
    let SolveSettings { material, element, method, contact, subscription, elasticity, max_error } =
        &plan.first.settings;
    let setup = RecordedSetup {
        version: version_needed(plan),
        program: concat!("glove-client ", env!("CARGO_PKG_VERSION")).to_owned(),
        object: plan.first.object.to_string(),
        nodes: plan.first.nodes,
        size_m: loaded.brought_to_m,
        mesh: mesh_digest(loaded.object.rest()),
        young_pa: material.young,
        poisson: material.poisson,
        regions: plan.first.regions.iter().map(recorded_region).collect(),
        element: element.to_string(),
        method: method.to_string(),
        contact: contact.to_string(),
        whole: *subscription == Subscription::Whole,
        deformation: elasticity.deformation.to_string(),
        law: elasticity.law.to_string(),
        yield_pa: elasticity.yield_stress,
        max_error: *max_error,
        placed_in_hand: plan.place == ObjectPlace::Hand,
        friction: plan.first.contact_scene.map(|scene| RecordedFriction {
            friction: scene.friction,
            finger_compliance_m_n: scene.finger_compliance,
            density_kg_m3: scene.density,
            viscosity_s: scene.viscosity,
            gravity: scene.gravity.into(),
        }),
        hand: plan.hand_name(),
        period_s: plan.period.map(|period| period.as_secs_f64()),
        hand_setup: plan.hand_configuration.to_text(),
        calibration: toml_text(&plan.hand_configuration.setup.calibration)?,
        is_live: plan.is_live,
        is_even: plan.is_even,
        world_from_sender: plan.world_from_sender.as_ref().map(recorded_place),
        second_hand: plan.second.as_ref().map(recorded_hand).transpose()?,
    };
    Ok(Recorder::start(path, setup)?)
}

/// The oldest version of the messages that does not lose what the run needs.
fn version_needed(plan: &RunPlan) -> u32 {
    match &plan.second {
        second if plan.is_even || second.as_ref().is_some_and(|hand| hand.is_even) => VERSION,
        Some(_) => VERSION_OF_TWO_HANDS,
        None => VERSION_OF_ONE_HAND,
    }
}

fn recorded_hand(second: &SecondHand) -> anyhow::Result<RecordedHand> {
    let SecondHand { configuration, is_live, is_even, shares_stream, world_from_sender, .. } =
        second;
    Ok(RecordedHand {
        hand_setup: configuration.to_text(),
        calibration: toml_text(&configuration.setup.calibration)?,
        is_live: *is_live,
        is_even: *is_even,
        shares_stream: *shares_stream,
        world_from_sender: world_from_sender.as_ref().map(recorded_place),
    })
}

fn recorded_place(pose: &Isometry3<f64>) -> [f64; 7] {
    let ([x, y, z], [qx, qy, qz, qw]): ([f64; 3], [f64; 4]) =
        (pose.translation.vector.into(), pose.rotation.coords.into());
    [x, y, z, qx, qy, qz, qw]
}

fn recorded_region(region: &RegionChoice) -> RecordedRegion {
    RecordedRegion {
        name: region.name.clone(),
        young_pa: region.young_pa,
        poisson: region.poisson,
        ellipsoid_m: region.ellipsoid.map(|of| [of.centre_m, of.radii_m]),
    }
}

/// Compares the loaded object with the recorded one.
///
/// # Errors
/// The objects differ.
pub(super) fn check_object(setup: &RecordedSetup, loaded: &LoadedObject) -> anyhow::Result<()> {
    ensure!(
        mesh_digest(loaded.object.rest()) == setup.mesh,
        "the recording was made with another {}: its mesh has changed since, or a flag asks for \
         another object",
        setup.object
    );
    Ok(())
}

/// Digest of the positions and elements of a mesh.
fn mesh_digest(mesh: &TetMesh) -> String {
    let mut digest = Digest::default();
    mesh.vertices().iter().for_each(|vertex| digest.numbers(vertex.coords.as_slice()));
    mesh.tets().iter().flatten().for_each(|node| digest.count(u64::from(*node)));
    digest.end()
}
