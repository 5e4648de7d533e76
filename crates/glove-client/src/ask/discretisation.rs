//! Estimates the error of the mesh's discretisation by solving once more with the other element.

use softgrasp_protocol::{
    Answer, Ask, Body, DofValue, ElementChoice, ElementName, MeshData, MethodName, NodeChoice,
    Question, Want,
};

use crate::ask::connection::ServerConnection;

/// Estimate of the error of the mesh's discretisation.
#[derive(Clone, Debug, PartialEq)]
pub struct DiscretisationEstimate {
    /// `‖u_t4 − u_t10‖ / ‖u_t10‖` over the corners of the mesh, for the same prescribed displacements and
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
        let is_corner = is_corner(&body.mesh);
        let is_middle = |of: &&DofValue| {
            let node = of.dof as usize / 3;
            !body.mesh.mid_edge.is_empty() && is_corner.get(node) == Some(&false)
        };
        if let Some(of) = question.known.iter().chain(&question.forces).find(is_middle) {
            let node = of.dof / 3;
            let why = format!("node {node} is a mid-edge node, which linear elements do not have");
            return Self { rel: None, why };
        }
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
        let at_corners = |all: &[[f64; 3]]| -> Vec<[f64; 3]> {
            let both = all.iter().zip(&is_corner);
            both.filter(|(_, is_corner)| **is_corner).map(|(u, _)| *u).collect()
        };
        match difference_rel(&at_corners(linear), &at_corners(quadratic)) {
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

/// For each node, whether it is a corner of an element.
fn is_corner(mesh: &MeshData) -> Vec<bool> {
    let mut is_corner = vec![false; mesh.vertices.len()];
    for &node in mesh.tets.iter().flatten() {
        if let Some(is_corner) = is_corner.get_mut(node as usize) {
            *is_corner = true;
        }
    }
    is_corner
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
