//! The argument of `glove-client run` that says which device the forces go to.

use anyhow::bail;
use clap::Args;
use softgrasp_force::Target;

use crate::run::contact_grasp::ContactScene;

/// The forces of a grasp by contact.
#[derive(Args, Clone, Debug, Default)]
pub struct ForceArguments {
    /// With --grasp contact: let the hand feel the object: haply[:ws://HOST:PORT] (Inverse3),
    /// lucid:PORT (LucidGloves on a serial port), level:HOST:PORT (a level for each finger by UDP), or
    /// record:F.csv (docs/force.md).
    #[arg(long, value_name = "DEVICE", value_parser = target)]
    pub(super) force: Option<Target>,
}

fn target(text: &str) -> Result<Target, String> {
    text.parse().map_err(|error: softgrasp_force::TargetError| error.to_string())
}

impl ForceArguments {
    /// Device of the forces, and the constants of a grasp that it can hold still with: a finger is no
    /// stiffer than that.
    ///
    /// # Errors
    /// Forces that were asked for of a grasp by the thesis's rules.
    pub(super) fn of_run(
        &self,
        scene: Option<ContactScene>,
    ) -> anyhow::Result<(Option<Target>, Option<ContactScene>)> {
        let Some(target) = &self.force else { return Ok((None, scene)) };
        let Some(scene) = scene else {
            bail!("--force lets a hand feel contact with friction: take --grasp contact with it");
        };
        let least = 1.0 / target.limits().stiffness_max();
        let finger_compliance = scene.finger_compliance.max(least);
        Ok((Some(target.clone()), Some(ContactScene { finger_compliance, ..scene })))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_finger_is_no_stiffer_than_its_device_holds() {
        let of = |text: &str| ForceArguments { force: Some(text.parse().unwrap()) };
        let scene = ContactScene::default();
        let (target, softened) = of("haply").of_run(Some(scene)).unwrap();
        assert_eq!(target.unwrap().name(), "haply");
        assert!((softened.unwrap().finger_compliance - 3e-3).abs() < 1e-12);
        let (_, same) = of("lucid:COM3").of_run(Some(scene)).unwrap();
        assert_eq!(same, Some(scene), "brakes hold any stiffness");
        assert!(of("haply").of_run(None).is_err());
        assert!(ForceArguments::default().of_run(None).unwrap().0.is_none());
    }
}
