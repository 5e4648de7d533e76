//! The arguments that say how the hand grasps: by the thesis's rules, or by contact with friction.

use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use softgrasp_grasp::object::ContactModel;

use super::elasticity_arguments::ElasticityArguments;
use super::numbers::{positive, speed};
use crate::object::scene::SceneFile;
use crate::run::contact_grasp::ContactScene;

/// How a hand grasps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum GraspChoice {
    /// Every segment of the hand presses with friction; the object has weight and lies on a table.
    Contact,
    /// Three fingertips hold it, five deform it, and nothing slips (thesis 4.5).
    Thesis,
}

/// How the hand grasps.
#[derive(Args, Clone, Copy, Default)]
pub(super) struct ContactArguments {
    /// contact (fingers press with friction, the object has weight and lies on a table; linear
    /// elasticity unless --deformation says otherwise) or thesis (three fingertips hold it, five
    /// deform it) [default: contact; thesis with --contact, --method, --deformation large|auto, --yield and
    /// the scripts of the thesis's grasp].
    #[arg(long, value_name = "contact|thesis")]
    pub(super) grasp: Option<GraspChoice>,
    /// With --grasp thesis, what a fingertip holds: vertex (the node it touched, as in the thesis),
    /// patch (every surface node under it) or mask (their mean, weighted by the tip's pressure)
    /// [default: mask].
    #[arg(long, value_name = "vertex|patch|mask")]
    contact: Option<ContactModel>,
    /// With --grasp contact: coefficient of friction of hand and table [default: 0.8].
    #[arg(long, value_name = "MU", value_parser = speed, allow_hyphen_values = true)]
    friction: Option<f64>,
    /// With --grasp contact: density of the object, kg/m³ [default: 1000].
    #[arg(long, value_name = "KG/M3", value_parser = positive, allow_hyphen_values = true)]
    density: Option<f64>,
    /// With --grasp contact: force by which a finger presses per way that it is pushed back, N/m
    /// [default: 1000].
    #[arg(long, value_name = "N/M", value_parser = positive, allow_hyphen_values = true)]
    finger_stiffness: Option<f64>,
    /// With --grasp contact: time in which the shape forgets a force, s (Kelvin and Voigt)
    /// [default: 0.02].
    #[arg(long, value_name = "T", value_parser = speed, allow_hyphen_values = true)]
    viscosity: Option<f64>,
}

/// Rules by which a run grasps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GraspRule {
    /// What a fingertip holds by the thesis's rules.
    pub(super) contact: ContactModel,
    /// Constants of a grasp by friction, `None` for the thesis's rules; the object sets the table's
    /// height.
    pub(super) scene: Option<ContactScene>,
}

impl ContactArguments {
    /// How the run grasps: flags win over the scene. Where nobody says how, `needs_thesis` does:
    /// whether something else that was asked for is of the thesis's rules.
    ///
    /// # Errors
    /// Names in the scene that are none, and flags that do not go together.
    pub(super) fn of_run(
        &self,
        scene: &SceneFile,
        elasticity: &ElasticityArguments,
        needs_thesis: bool,
    ) -> anyhow::Result<GraspRule> {
        let of_large = scene.deformation.is_some() || scene.yield_pa.is_some();
        let in_scene = scene.grasp.as_deref().map(|name| {
            GraspChoice::from_str(name, false).map_err(|_| {
                anyhow::anyhow!("the scene's grasp is '{name}'; there are contact and thesis")
            })
        });
        let named = match (self.grasp, in_scene) {
            (Some(choice), _) => Some(choice),
            (None, in_scene) => in_scene.transpose()?,
        };
        let held = match (self.contact, &scene.contact) {
            (Some(contact), _) => Some(contact),
            (None, Some(name)) => Some(name.parse().context("the scene's contact")?),
            (None, None) => None,
        };
        let by_friction = match (named, held) {
            (Some(GraspChoice::Contact), _) | (None, Some(ContactModel::Friction)) => true,
            (Some(GraspChoice::Thesis), _) | (None, Some(_)) => false,
            (None, None) => !(needs_thesis || of_large || elasticity.wants_large()),
        };
        if !by_friction {
            if held == Some(ContactModel::Friction) {
                bail!("--contact friction is --grasp contact");
            }
            return Ok(GraspRule { contact: held.unwrap_or_default(), scene: None });
        }
        if held.is_some_and(|held| held != ContactModel::Friction) {
            bail!("--contact says what a fingertip of --grasp thesis holds; leave one of both out");
        }
        let usual = ContactScene::default();
        let friction = self.friction.or(scene.friction).unwrap_or(usual.friction);
        let density = self.density.or(scene.density_kg_m3).unwrap_or(usual.density);
        if !(friction >= 0.0 && friction.is_finite() && density > 0.0 && density.is_finite()) {
            bail!("the scene's friction and density must be numbers, at least 0 and above 0");
        }
        let compliance = self.finger_stiffness.map_or(usual.finger_compliance, |k| 1.0 / k);
        let scene = ContactScene {
            friction,
            density,
            finger_compliance: compliance,
            viscosity: self.viscosity.unwrap_or(usual.viscosity),
            ..usual
        };
        Ok(GraspRule { contact: ContactModel::Friction, scene: Some(scene) })
    }
}
