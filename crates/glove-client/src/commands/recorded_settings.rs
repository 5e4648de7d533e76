//! Settings of a recorded run, for its replay.

use anyhow::Context;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use softgrasp_hand::devices::calibration::read_toml;
use softgrasp_hand::hand_setup::HandConfiguration;
use softgrasp_hand::recording::{RecordedRegion, RecordedSetup};
use softgrasp_protocol::{ElementName, LawName, Material};

use super::hand_arguments::SecondHand;
use crate::ask::solve_settings::Elasticity;
use crate::ask::solve_settings::{SolveSettings, Subscription};
use crate::object::region_choice::{Ellipsoid, RegionChoice};
use crate::run::contact_grasp::ContactScene;

/// Material and settings of the solves of a recorded run.
///
/// # Errors
/// A name that this version does not know.
pub(super) fn recorded_settings(setup: &RecordedSetup) -> anyhow::Result<SolveSettings> {
    let said = "the recording's";
    Ok(SolveSettings {
        material: Material { young: setup.young_pa, poisson: setup.poisson },
        element: recorded_element(&setup.element)?,
        method: setup.method.parse().with_context(|| format!("{said} method"))?,
        contact: setup.contact.parse().with_context(|| format!("{said} contact"))?,
        subscription: if setup.whole { Subscription::Whole } else { Subscription::Surface },
        elasticity: Elasticity {
            deformation: setup
                .deformation
                .parse()
                .with_context(|| format!("{said} deformation"))?,
            law: match setup.law.as_str() {
                "" => LawName::default(),
                law => law.parse().with_context(|| format!("{said} law"))?,
            },
            yield_stress: setup.yield_pa,
        },
        max_error: setup.max_error,
    })
}

/// Regions of a recorded object that are of a material of their own.
pub(super) fn recorded_regions(setup: &RecordedSetup) -> Vec<RegionChoice> {
    let of = |recorded: &RecordedRegion| RegionChoice {
        name: recorded.name.clone(),
        young_pa: recorded.young_pa,
        poisson: recorded.poisson,
        ellipsoid: recorded.ellipsoid_m.map(|[centre_m, radii_m]| Ellipsoid { centre_m, radii_m }),
    };
    setup.regions.iter().map(of).collect()
}

/// Constants of a recorded grasp by friction; `None` for the thesis's rules.
pub(super) fn recorded_scene(setup: &RecordedSetup) -> Option<ContactScene> {
    let recorded = setup.friction.as_ref()?;
    Some(ContactScene {
        friction: recorded.friction,
        finger_compliance: recorded.finger_compliance_m_n,
        density: recorded.density_kg_m3,
        viscosity: recorded.viscosity_s,
        gravity: recorded.gravity.into(),
        table_y: None,
    })
}

fn recorded_element(name: &str) -> anyhow::Result<ElementName> {
    let known = [ElementName::T4, ElementName::T4Anp, ElementName::T10];
    let found = known.into_iter().find(|element| element.to_string() == name);
    found.with_context(|| format!("the recording's element is '{name}', which is none"))
}

/// Configuration of the hand of a recorded run, its glove and its tracker.
///
/// # Errors
/// A text that this version cannot read.
pub(super) fn recorded_hand(setup: &RecordedSetup) -> anyhow::Result<HandConfiguration> {
    configuration(&setup.hand_setup, &setup.calibration)
}

/// Second hand of a recorded run, which the recording's bytes carry; `None` for a run of one hand.
///
/// # Errors
/// A text that this version cannot read.
pub(super) fn recorded_second_hand(setup: &RecordedSetup) -> anyhow::Result<Option<SecondHand>> {
    let Some(recorded) = &setup.second_hand else { return Ok(None) };
    Ok(Some(SecondHand {
        request: None,
        shares_stream: recorded.shares_stream,
        configuration: configuration(&recorded.hand_setup, &recorded.calibration)?,
        is_live: recorded.is_live,
        is_even: recorded.is_even,
        world_from_sender: recorded.world_from_sender.map(pose_of),
    }))
}

fn configuration(hand_setup: &str, calibration: &str) -> anyhow::Result<HandConfiguration> {
    let read = HandConfiguration::read(hand_setup);
    let mut configuration = read.context("the recording's hand")?;
    let calibration = read_toml(calibration);
    configuration.setup.calibration = calibration.context("the recording's calibration")?;
    Ok(configuration)
}

/// Pose in the world of a sender of joints in a recorded run.
pub(super) fn recorded_place(setup: &RecordedSetup) -> Option<Isometry3<f64>> {
    setup.world_from_sender.map(pose_of)
}

fn pose_of([x, y, z, qx, qy, qz, qw]: [f64; 7]) -> Isometry3<f64> {
    // The quaternion is one already: it comes back with its bits.
    let rotation = UnitQuaternion::new_unchecked(Quaternion::new(qw, qx, qy, qz));
    Isometry3::from_parts(Translation3::new(x, y, z), rotation)
}
