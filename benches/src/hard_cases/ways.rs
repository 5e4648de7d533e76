//! The ways to an answer: every method with every element, and `condensed`.

use std::time::Instant;

use softgrasp_core::model::{Element, Model, ModelError};
use softgrasp_core::solve::condensed::{Columns, ContactSet, Delivery, Touched};
use softgrasp_core::solve::{Certainty, Loads, Method};

use super::case::{Question, Reach};

/// One way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Way {
    /// A factor or inverse of `K11`.
    Direct(Element, Method),
    /// Columns of the compliance.
    Condensed(Element),
}

/// What a way answers.
#[derive(Clone, Debug)]
pub(super) struct Answer {
    /// Of every degree of freedom of the system, m.
    pub displacement: Vec<f64>,
    pub residual_rel: f64,
    pub condition: f64,
    /// Error that the answer states of itself.
    pub stated_rel: f64,
    /// Proven bound on the norm of the error over that of the answer.
    pub bound_rel: Option<f64>,
    /// From the mesh to the displacements.
    pub ms: f64,
}

/// Memory for columns; more than any case needs.
const COLUMN_BYTES: usize = 1 << 30;
/// Nodes up to which the bound is proven: it takes a second factor.
const PROVEN_NODES_MAX: usize = 20_000;

impl Way {
    /// Ways that a case of this reach is asked.
    pub fn of(reach: Reach) -> Vec<Self> {
        let direct = |element: Element| Method::ALL.map(|m| Self::Direct(element, m));
        let linear = [Element::Tet4, Element::Tet4Anp];
        let all = Element::ALL.into_iter().flat_map(direct).chain(linear.map(Self::Condensed));
        let is_of_each_kind = |way: &Self| match way {
            Self::Direct(_, method) => {
                matches!(method, Method::GaussJordan | Method::Front | Method::FrontMixed)
            }
            Self::Condensed(_) => true,
        };
        let is_for_large = |way: &Self| match way {
            Self::Direct(element, method) => {
                let by_auto = matches!(method, Method::Front | Method::FrontMixed | Method::Pcg);
                *element == Element::Tet4 && by_auto
            }
            Self::Condensed(element) => *element == Element::Tet4,
        };
        match reach {
            Reach::All => all.collect(),
            Reach::OfEachKind => all.filter(is_of_each_kind).collect(),
            Reach::Large => all.filter(is_for_large).collect(),
        }
    }

    pub fn element(self) -> Element {
        match self {
            Self::Direct(element, _) | Self::Condensed(element) => element,
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Direct(_, method) => method.name(),
            Self::Condensed(_) => "condensed",
        }
    }

    pub fn precision(self) -> &'static str {
        match self {
            Self::Direct(_, method) => method.precision(),
            Self::Condensed(_) => "f64",
        }
    }

    /// Whether its factor is in single precision.
    pub fn is_single(self) -> bool {
        matches!(self, Self::Direct(_, Method::FrontMixed | Method::Pcg))
    }

    /// Answers a question on the current rayon pool.
    ///
    /// # Errors
    /// The reason for which there is no answer, in words.
    pub fn answer(self, question: &Question) -> Result<Answer, String> {
        let begin = Instant::now();
        let answered = match self {
            Self::Direct(element, method) => direct(question, element, method, begin),
            Self::Condensed(element) => condensed(question, element, begin),
        };
        let answer = answered.map_err(|error| error.to_string())?;
        let certainty = Certainty { condition: answer.condition, error_rel: answer.stated_rel };
        match certainty.is_none() {
            true => Err(format!(
                "no digit of the answer is certain: the condition is {:.1e}, the error about {:.1e}",
                answer.condition, answer.stated_rel
            )),
            false => Ok(answer),
        }
    }
}

/// The model of a question.
///
/// # Errors
/// [`ModelError`].
pub(super) fn model_of(question: &Question, element: Element) -> Result<Model, ModelError> {
    let Question { mesh, materials, fixed, .. } = question;
    Model::try_new(mesh.clone(), element, materials, fixed.clone(), &mut |_| {})
}

fn since(begin: Instant) -> f64 {
    1e3 * begin.elapsed().as_secs_f64()
}

fn direct(
    question: &Question,
    element: Element,
    method: Method,
    begin: Instant,
) -> Result<Answer, ModelError> {
    let model = model_of(question, element)?;
    let known = model.known(question.pairs.clone())?;
    let factored = model.factor(&known.dofs, method, &mut |_| {})?;
    let loads = Loads { q_known: &known.q_known, ..Loads::default() };
    let solution = factored.solve(model.stiffness(), loads, &mut |_| {})?;
    let ms = since(begin);
    let certainty = factored.certainty(model.stiffness(), solution.backward_error);
    Ok(Answer {
        residual_rel: solution.residual_rel,
        displacement: solution.displacement,
        condition: certainty.condition,
        stated_rel: certainty.error_rel,
        bound_rel: None,
        ms,
    })
}

fn condensed(question: &Question, element: Element, begin: Instant) -> Result<Answer, ModelError> {
    let model = model_of(question, element)?;
    let known = model.known(question.pairs.clone())?;
    model.check_held(&known.dofs, &[])?;
    let base = model.condense(&mut |_| {})?;
    // What the scene holds is part of the base; no case moves it.
    let is_touched = |dof: u32| model.fixed().binary_search(&dof).is_err();
    let pairs = known.dofs.iter().zip(&known.q_known).filter(|(dof, _)| is_touched(**dof));
    let (dofs, q): (Vec<u32>, Vec<f64>) = pairs.map(|(dof, q)| (*dof, *q)).unzip();
    let columns = Columns::new(COLUMN_BYTES);
    let set = ContactSet::try_new(&base, &columns, &Touched::of_dofs(&dofs))?;
    let answer = set.solve(&q)?;
    let displacement = set.full_displacement(&base, &answer);
    let ms = since(begin);
    if model.mesh().node_count() <= PROVEN_NODES_MAX {
        // Kept by the base, and `certify` finds it there.
        let _ = base.prove_eigenvalue_min();
    }
    let delivered = displacement.as_chunks::<3>().0;
    let certificate = set.certify(&base, &q, &answer, delivered, Delivery::Double);
    base.estimate_condition();
    let certainty = set.certainty(&base);
    Ok(Answer {
        residual_rel: certificate.residual_rel,
        condition: certainty.map_or(f64::NAN, |c| c.condition),
        stated_rel: certainty.map_or(f64::NAN, |c| c.error_rel),
        bound_rel: certificate.error_bound_rel.ok(),
        displacement,
        ms,
    })
}
