//! Estimates the error of the mesh's discretisation by solving once more with the other element.

use softgrasp_protocol::{
    Answer, Ask, Body, ElementChoice, ElementName, MethodName, NodeChoice, Question, Want,
};

use crate::ask::connection::ServerConnection;

/// Estimate of the error of the mesh's discretisation.
#[derive(Clone, Debug, PartialEq)]
pub struct DiscretisationEstimate {
    /// `‖u_t4 − u_t10‖ / ‖u_t10‖` over the nodes of the mesh, for the same prescribed displacements and
    /// forces; `None` where there is none.
    pub rel: Option<f64>,
    /// How the estimate was made, or why there is none.
    pub why: String,
}

/// Relative error of the second answer: the estimate needs a few digits only.
const SECOND_ERROR_MAX: f64 = 1e-6;

impl DiscretisationEstimate {
    /// Result where no estimate was asked for.
    pub fn not_asked() -> Self {
        Self { rel: None, why: "not asked for (--estimate-discretisation)".to_owned() }
    }

    /// Asks once more with the other element and compares.
    ///
    /// Shapes: `displacements` one per node of the request's mesh. Units: m.
    ///
    /// If the server refuses the second request or goes, there is no estimate, and the reason is told;
    /// the first answer is not affected.
    pub fn of(
        connection: &mut ServerConnection,
        (body, question): (&Body, &Question),
        answer: &Answer,
        displacements: &[[f64; 3]],
    ) -> Self {
        let is_quadratic = answer.report.element == ElementName::T10;
        let element = if is_quadratic { ElementChoice::T4 } else { ElementChoice::T10 };
        let question = Question {
            method: MethodName::auto(),
            max_error: Some(SECOND_ERROR_MAX),
            deadline_ms: None,
            want: Want { nodes: NodeChoice::All, reactions: false, ..Want::default() },
            ..question.clone()
        };
        let second = match connection.answer(Ask::new(Body { element, ..body.clone() }, question)) {
            Ok(second) => second.displacements.into_f64(),
            Err(error) => {
                let why = format!("the second solve, by the other element, failed: {error}");
                return Self { rel: None, why };
            }
        };
        let (linear, quadratic) = match is_quadratic {
            false => (displacements, second.as_slice()),
            true => (second.as_slice(), displacements),
        };
        match difference_rel(linear, quadratic) {
            Some(rel) => Self {
                rel: Some(rel),
                why: "an estimate, not a bound: the difference between linear and ten-node \
                      elements on this mesh"
                    .to_owned(),
            },
            None => Self { rel: None, why: "nothing moves".to_owned() },
        }
    }
}

/// `‖a − b‖ / ‖b‖`; `None` if `b` is zero or one of them is too large.
fn difference_rel(a: &[[f64; 3]], b: &[[f64; 3]]) -> Option<f64> {
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    let difference: f64 = pairs.map(|(a, b)| (a - b).powi(2)).sum();
    let size: f64 = b.iter().flatten().map(|b| b * b).sum();
    let rel = (difference / size).sqrt();
    (a.len() == b.len() && rel.is_finite()).then_some(rel)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn difference_is_relative_to_the_second_field() {
        let a = [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
        let b = [[1.0, 0.0, 0.0], [0.0, 2.0, 1.0]];
        assert_eq!(difference_rel(&a, &b), Some((1.0f64 / 6.0).sqrt()));
        assert_eq!(difference_rel(&a, &a), Some(0.0));
    }

    #[test]
    fn fields_that_cannot_be_compared_have_no_difference() {
        assert_eq!(difference_rel(&[[0.0; 3]], &[[0.0; 3]]), None);
        assert_eq!(difference_rel(&[[1.0; 3]], &[[1.0; 3]; 2]), None);
        assert_eq!(difference_rel(&[[f64::NAN; 3]], &[[1.0; 3]]), None);
    }
}
