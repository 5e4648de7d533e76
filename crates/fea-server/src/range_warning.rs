//! Where linear elasticity itself stops being right, said with every answer.

use softgrasp_core::fem::StrainSummary;

/// Linear elasticity errs by the square of the rotation: 1.5 % at 10°.
const ROTATION_WARNING_DEG: f64 = 10.0;
/// Above this the small-strain measure itself is off by several per cent.
const STRAIN_WARNING: f64 = 0.1;

/// Sentences for answers that leave the range of small rotations and strains.
pub(crate) fn warnings(summary: StrainSummary) -> Vec<String> {
    let (rotation_deg, strain) = (summary.rotation_max.to_degrees(), summary.strain_max);
    let mut warnings = Vec::new();
    if rotation_deg > ROTATION_WARNING_DEG {
        warnings.push(format!(
            "an element turns by {rotation_deg:.1} degrees; linear elasticity is off by about \
             {:.0} % there",
            50.0 * rotation_deg.to_radians().powi(2)
        ));
    }
    if strain > STRAIN_WARNING {
        warnings.push(format!(
            "an element is strained by {:.0} %; linear elasticity is meant for small strains",
            100.0 * strain
        ));
    }
    warnings
}
