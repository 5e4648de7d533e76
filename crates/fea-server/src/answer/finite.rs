//! Checks that all displacements, forces and errors of a reply are finite numbers.

use softgrasp_protocol::{Answer, Displacements, GradientValues, Reply, SolveReport};

/// Whether every displacement, force and error of a reply is a finite number. Values that a report leaves
/// open on purpose (rotation, strain) may be NaN.
pub(crate) fn is_finite(reply: &Reply) -> bool {
    match reply {
        Reply::Answer(answer) => answer_is_finite(answer),
        Reply::ContactAnswer(contact) => {
            let vectors = |point: &softgrasp_protocol::ContactPoint| {
                all(point.place.iter().chain(&point.normal).chain(&point.force).chain(&point.slip))
            };
            let state = &contact.state;
            answer_is_finite(&contact.answer)
                && contact.points.iter().all(vectors)
                && all(state.pose.iter().chain(&state.velocity).chain(&state.angular_velocity))
                && all(state.forces.iter().flatten())
                && all(&contact.small_system.compliance)
        }
        _ => true,
    }
}

/// Whether displacements, forces and errors of one answer, and of its cases, are finite.
pub(super) fn answer_is_finite(answer: &Answer) -> bool {
    let Answer { report, displacements, reactions, mask_forces, cases, fields, gradient, .. } =
        answer;
    let are_displacements = match displacements {
        Displacements::F64(values) => all(values.iter().flatten()),
        Displacements::F32Quantised { scale, values } => {
            scale.is_finite() && values.iter().flatten().all(|value| value.is_finite())
        }
    };
    let SolveReport { residual_rel, error_bound_rel, error_estimate_rel, .. } = report;
    let errors = [*error_bound_rel, *error_estimate_rel, Some(*residual_rel)];
    are_displacements
        && all(reactions.iter().map(|reaction| &reaction.value))
        && all(mask_forces.iter().flatten())
        && all(errors.iter().flatten())
        && cases.iter().all(|case| all(case.displacements.iter().flatten()) && all(&case.reactions))
        && fields.iter().all(|case| {
            case.energy.is_finite() && case.arrays.iter().all(|(_, values)| all(values))
        })
        && gradient.iter().all(GradientValues::is_finite)
}

fn all<'a>(values: impl IntoIterator<Item = &'a f64>) -> bool {
    // A sum of zeros times them is zero exactly where all are finite, and vectorises.
    values.into_iter().map(|value| 0.0 * value).sum::<f64>() == 0.0
}

#[cfg(test)]
mod tests {
    use softgrasp_protocol::{CaseAnswer, Field, FieldValues};

    use super::*;

    #[test]
    fn one_number_that_is_none_is_found_wherever_it_stands() {
        let sound = Answer {
            report: SolveReport { max_strain: f64::NAN, ..SolveReport::default() },
            large: None,
            nodes: softgrasp_protocol::NodeChoice::All,
            displacements: Displacements::F64(vec![[1.0; 3]; 40]),
            reactions: vec![softgrasp_protocol::DofValue { dof: 0, value: -1e308 }; 3],
            mask_forces: vec![[0.0; 3]; 2],
            cases: vec![CaseAnswer { displacements: vec![[2.0; 3]; 40], reactions: vec![0.5; 3] }],
            fields: vec![FieldValues {
                energy: 0.5,
                error_rel: f64::NAN,
                arrays: vec![(Field::ElementEnergy, vec![0.25; 2])],
            }],
            gradient: Some(GradientValues { by_pressures: vec![0.5], ..GradientValues::default() }),
        };
        let is_sound = |answer: &Answer| is_finite(&Reply::Answer(Box::new(answer.clone())));
        assert!(is_sound(&sound));
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let damages: [fn(&mut Answer, f64); 12] = [
                |answer, value| {
                    let gradient =
                        GradientValues { by_pressures: vec![value], ..Default::default() };
                    answer.gradient = Some(gradient);
                },
                |answer, value| answer.fields[0].energy = value,
                |answer, value| answer.fields[0].arrays[0].1[1] = value,
                |answer, value| {
                    answer.displacements = Displacements::F64(vec![[0.0, 0.0, value]]);
                },
                |answer, value| {
                    let values = vec![[0.0; 3]];
                    answer.displacements = Displacements::F32Quantised { scale: value, values };
                },
                |answer, value| answer.reactions[2].value = value,
                |answer, value| answer.mask_forces[1][1] = value,
                |answer, value| answer.cases[0].displacements[39][2] = value,
                |answer, value| answer.cases[0].reactions[1] = value,
                |answer, value| answer.report.residual_rel = value,
                |answer, value| answer.report.error_bound_rel = Some(value),
                |answer, value| answer.report.error_estimate_rel = Some(value),
            ];
            for (i, damage) in damages.iter().enumerate() {
                let mut damaged = sound.clone();
                damage(&mut damaged, value);
                assert!(!is_sound(&damaged), "damage {i} with {value}");
            }
        }
    }
}
