//! The arguments that say how an object deforms: equations, law, yield stress.

use anyhow::{Context, bail};
use clap::Args;
use softgrasp_protocol::{Deformation, LawName, MethodName};

use super::numbers::positive;
use crate::ask::solve_settings::Elasticity;
use crate::object::scene::SceneFile;

/// How the object deforms.
#[derive(Args, Clone, Copy, Default)]
pub(super) struct ElasticityArguments {
    /// Equations: linear (thesis 3.43), large, or auto, which takes the linear ones where rotation
    /// and strain promise an error within what is allowed [default: linear for solve, press and
    /// --grasp contact, large with --yield; auto for other runs, linear with --method of linear
    /// elasticity].
    #[arg(long, value_name = "linear|large|auto")]
    deformation: Option<Deformation>,
    /// Law of large deformation: neo-hookean (that of Abaqus, Ansys, CalculiX) or neo-hookean-log
    /// (that of FEBio, SOFA) [default: neo-hookean].
    #[arg(long, value_name = "neo-hookean|neo-hookean-log")]
    material: Option<LawName>,
    /// Yield stress, Pa: above it the material flows and stays deformed, in logarithmic strain
    /// (Hencky); t4 and t10 only.
    #[arg(long = "yield", value_name = "PA", value_parser = positive, allow_hyphen_values = true)]
    yield_stress: Option<f64>,
}

impl ElasticityArguments {
    /// Whether large deformation was asked for.
    pub fn wants_large(&self) -> bool {
        self.yield_stress.is_some()
            || matches!(self.deformation, Some(Deformation::Large | Deformation::Auto))
    }

    /// Elasticity of a run: flags win over the scene, and a method of linear elasticity means linear
    /// elasticity.
    ///
    /// # Errors
    /// Names in the scene that are none, and large deformation by a linear method.
    pub fn of_run(&self, scene: &SceneFile, method: &MethodName) -> anyhow::Result<Elasticity> {
        let (named, law) = self.named(scene)?;
        let is_linear_method = !matches!(method.as_str(), "auto" | "front" | "front-mixed");
        let deformation = match named {
            Some(deformation) if is_linear_method && deformation != Deformation::Linear => bail!(
                "--method {method} is of linear elasticity; take auto, front or front-mixed with \
                 --deformation {deformation}"
            ),
            Some(deformation) => deformation,
            None if method.as_str() == "auto" => Deformation::Auto,
            None => Deformation::Linear,
        };
        let yield_stress = self.yield_stress.or(scene.yield_pa);
        checked(Elasticity { deformation, law, yield_stress })
    }

    /// Equations that were named, and the law: flags win over the scene.
    fn named(&self, scene: &SceneFile) -> anyhow::Result<(Option<Deformation>, LawName)> {
        let deformation = match (self.deformation, &scene.deformation) {
            (Some(deformation), _) => Some(deformation),
            (None, Some(name)) => Some(name.parse().context("the scene's deformation")?),
            (None, None) => None,
        };
        let law = match (self.material, &scene.material) {
            (Some(law), _) => law,
            (None, Some(name)) => name.parse().context("the scene's material")?,
            (None, None) => LawName::default(),
        };
        Ok((deformation, law))
    }

    /// Elasticity of a grasp by contact: flags win over the scene; linear if nothing else was named, large
    /// with a yield stress.
    ///
    /// # Errors
    /// Names in the scene that are none, and a yield stress with linear elasticity.
    pub fn of_contact(&self, scene: &SceneFile) -> anyhow::Result<Elasticity> {
        let (deformation, law) = self.named(scene)?;
        let yield_stress = self.yield_stress.or(scene.yield_pa);
        let deformation = deformation.unwrap_or(usual(yield_stress));
        checked(Elasticity { deformation, law, yield_stress })
    }

    /// Elasticity of one request: linear if nothing else was named.
    ///
    /// # Errors
    /// A yield stress with linear elasticity.
    pub fn of_request(&self) -> anyhow::Result<Elasticity> {
        let deformation = self.deformation.unwrap_or(usual(self.yield_stress));
        let law = self.material.unwrap_or_default();
        checked(Elasticity { deformation, law, yield_stress: self.yield_stress })
    }
}

/// Equations where none were named.
fn usual(yield_stress: Option<f64>) -> Deformation {
    match yield_stress {
        None => Deformation::Linear,
        Some(_) => Deformation::Large,
    }
}

fn checked(elasticity: Elasticity) -> anyhow::Result<Elasticity> {
    if elasticity.yield_stress.is_some() && elasticity.deformation == Deformation::Linear {
        bail!("a yield stress needs --deformation large or auto: linear elasticity has none");
    }
    Ok(elasticity)
}
