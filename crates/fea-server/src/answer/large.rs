//! Shared by all answers at large deformation: the checked question, and the answer from an equilibrium.

use std::time::Instant;

use softgrasp_core::contact::Mask;
use softgrasp_core::fem::hyperelastic::{LargeSummary, Law};
use softgrasp_core::model::{Known, Model};
use softgrasp_core::solve::Method;
use softgrasp_core::solve::equilibrium::{Equilibrium, Goal, NoEquilibrium, Path, Wish};
use softgrasp_protocol::{
    Answer, Deformation, Displacements, DofValue, GradientValues, LargeAsk, LargeReport, LawName,
    NodeChoice, Question as QuestionMessage, SolveReport, Warning, WarningCode, WarningLevel,
};

use super::fields::{Shape, field_values};
use super::gradient::{check_equilibrium, check_quantity};
use super::warnings::add_late;
use crate::clock::{StageClock, ms_since};
use crate::machine_memory::last_peak_rss_bytes;
use crate::refusal::Refusal;
use crate::request::{checked_forces, checked_masks, name_of, pairs, question_of};

/// Name of the method in reports.
const METHOD: &str = "newton";
/// Relative error that a linear answer may have where the question does not say how much.
pub(super) const LINEAR_ERROR_REL: f64 = 2e-3;
/// Poisson's ratio above which a factor in single precision is a poor inverse.
const POISSON_FOR_DOUBLE: f64 = 0.48;
/// Smallest principal stretch below which surfaces crease and meshes do not converge to a smooth answer.
const CREASE_STRETCH: f64 = 0.6;

/// A question about large deformation, checked against its model.
pub(super) struct LargeQuestion {
    pub known: Known,
    pub masks: Vec<Mask>,
    pub mask_q: Vec<f64>,
    pub forces: Vec<f64>,
    pub is_single: bool,
    /// Whether tangents are inverted by multigrid because the question asks for that.
    pub by_multigrid: bool,
    pub max_error: Option<f64>,
    pub deadline_ms: Option<f64>,
}

impl LargeQuestion {
    /// Takes from the messages what is asked of a model.
    ///
    /// # Errors
    /// [`Refusal`] naming the node, the mask or the number.
    pub fn new(model: &Model, ask: &LargeAsk, message: &QuestionMessage) -> Result<Self, Refusal> {
        if ask.deformation == Deformation::Linear {
            return Err(Refusal::LargeLinear);
        }
        if let Some(value) = ask.yield_stress.filter(|v| !(*v > 0.0 && v.is_finite())) {
            return Err(Refusal::Yield { value });
        }
        let question = question_of(message, Some(model.element()), model.poisson_max())?;
        let is_single = match question.method {
            None => model.poisson_max() < POISSON_FOR_DOUBLE,
            Some(Method::FrontMixed) => true,
            Some(Method::Front | Method::Multigrid) => false,
            Some(method) => return Err(Refusal::LargeMethod { method }),
        };
        let by_multigrid = question.method == Some(Method::Multigrid);
        let known = model.known(pairs(&message.known))?;
        check_quantity(model, &known.dofs, message)?;
        check_equilibrium(ask, message)?;
        let forces = checked_forces(model, &known, message)?;
        let (masks, mask_q) = checked_masks(model, message)?;
        let (max_error, deadline_ms) = (question.max_error, question.deadline_ms);
        Ok(Self { known, masks, mask_q, forces, is_single, by_multigrid, max_error, deadline_ms })
    }

    /// Moves the path of a live grasp to the prescribed displacements, until the answer is accurate
    /// enough or the deadline has passed.
    ///
    /// # Errors
    /// [`NoEquilibrium`]; the path is then unchanged.
    pub fn advance(
        &self,
        path: &mut Path,
        clock: &StageClock,
        pace: FramePace,
    ) -> Result<Equilibrium, NoEquilibrium> {
        let Self { known, mask_q, forces, .. } = self;
        let goal = Goal { q_known: &known.q_known, mask_q, forces };
        let deadline_ms = self.deadline_ms.unwrap_or(f64::INFINITY);
        let is_late = || clock.elapsed_ms() > deadline_ms;
        let may_factor = || {
            // Without a measured one it is taken not to fit.
            let factor_ms = pace.factor_ms.unwrap_or(f64::INFINITY);
            !pace.part_will_do || clock.elapsed_ms() + FACTOR_MARGIN * factor_ms <= deadline_ms
        };
        let (error_rel, part_will_do) = (self.max_error, pace.part_will_do);
        let wish = Wish { error_rel, is_late: &is_late, may_factor: &may_factor, part_will_do };
        path.advance(&goal, &wish)
    }

    /// Goes from rest to the prescribed displacements within one request, by all means there are.
    ///
    /// # Errors
    /// [`NoEquilibrium`] with its cause.
    pub fn find(&self, path: &mut Path, clock: &StageClock) -> Result<Equilibrium, NoEquilibrium> {
        let Self { known, mask_q, forces, .. } = self;
        let goal = Goal { q_known: &known.q_known, mask_q, forces };
        let deadline_ms = self.deadline_ms.unwrap_or(f64::INFINITY);
        let is_late = || clock.elapsed_ms() > deadline_ms;
        path.find(&goal, &Wish { error_rel: self.max_error, is_late: &is_late, ..Wish::EXACT })
    }
}

/// Time that a frame question at large deformation may take, and whether it must reach its end.
#[derive(Clone, Copy, Default)]
pub(super) struct FramePace {
    /// Time that the last factor took, ms.
    pub factor_ms: Option<f64>,
    /// Whether a balanced shape before the end of the motion suffices as the answer.
    pub part_will_do: bool,
}

/// Time that must be left for a factor, as a multiple of what the last one took.
const FACTOR_MARGIN: f64 = 1.5;

/// Material law that a name on the wire stands for.
pub(super) fn law_of(name: LawName) -> Law {
    match name {
        LawName::NeoHookean => Law::NeoHookean,
        LawName::NeoHookeanLog => Law::NeoHookeanLog,
    }
}

/// An equilibrium and how it was found.
pub(super) struct Found<'a> {
    pub model: &'a Model,
    pub path: &'a Path,
    pub equilibrium: Equilibrium,
    pub summary: LargeSummary,
    pub is_single: bool,
    pub factor_reused: bool,
    pub chosen_because: String,
    /// Derivatives of the question's quantity.
    pub gradient: Option<GradientValues>,
}

impl Found<'_> {
    /// The answer with the wanted results of the equilibrium, and its report.
    pub fn answer(
        mut self,
        question: &LargeQuestion,
        message: &QuestionMessage,
        clock: StageClock,
    ) -> Answer {
        let gradient = self.gradient.take();
        let Self { model, path, equilibrium, summary, .. } = &self;
        let mut stage_ms = clock.finish();
        let start = Instant::now();
        let displacement = path.displacement();
        let of = |n: usize| {
            let u = &displacement[3 * n..3 * n + 3];
            [u[0], u[1], u[2]]
        };
        let rows = match &message.want.nodes {
            NodeChoice::All => (0..model.mesh().node_count()).map(of).collect(),
            NodeChoice::Nodes(nodes) => nodes.iter().map(|&n| of(n as usize)).collect(),
        };
        let displacements = Displacements::of(rows, message.want.precision);
        let (mut reactions, mut mask_forces) = (Vec::new(), Vec::new());
        if message.want.reactions {
            let pairs = path.hold().dofs().iter().zip(&equilibrium.reactions);
            reactions = pairs.map(|(&dof, &value)| DofValue { dof, value }).collect();
            mask_forces = equilibrium.mask_forces.as_chunks().0.to_vec();
        }
        let shape = Shape::Large(path.elements(), path.displacement());
        let fields = field_values(model, &shape, &message.want);
        stage_ms.encode = ms_since(start);
        let known_dofs = question.known.dofs.len() + question.mask_q.len();
        let mut report = SolveReport {
            method: METHOD.to_owned(),
            element: name_of(model.element()).into(),
            unknown_dofs: (model.modelled_dofs() - known_dofs) as u64,
            known_dofs: known_dofs as u64,
            stage_ms,
            residual_rel: equilibrium.residual_rel,
            error_bound_rel: None,
            error_bound_why: Some(
                "no bound is proven at large deformation; estimated is the error of the equilibrium"
                    .to_owned(),
            ),
            max_rotation_deg: summary.rotation_max.to_degrees(),
            max_strain: summary.strain_max,
            precision: if self.is_single { "f32+f64" } else { "f64" }.to_owned(),
            error_estimate_rel: Some(equilibrium.error_estimate_rel),
            peak_rss_bytes: last_peak_rss_bytes(),
            factor_reused: self.factor_reused,
            chosen_because: self.chosen_because.clone(),
            ..SolveReport::default()
        };
        add_warnings(equilibrium, summary, question, &mut report);
        Answer {
            report,
            large: Some(self.large_report()),
            nodes: message.want.nodes.clone(),
            displacements,
            reactions,
            mask_forces,
            cases: Vec::new(),
            fields,
            gradient,
        }
    }

    fn large_report(&self) -> LargeReport {
        let Self { equilibrium, summary, .. } = self;
        LargeReport {
            is_linear: false,
            newton_steps: equilibrium.newton_steps,
            linear_solves: equilibrium.linear_solves,
            factor_age: equilibrium.factor_age,
            substeps: equilibrium.substeps,
            min_jacobian: equilibrium.jacobian_min,
            energy_error_rel: Some(equilibrium.energy_error_rel),
            max_stretch: summary.stretch_max,
            jumped: equilibrium.jumped,
            settled: equilibrium.settled,
            plastic_strain: equilibrium.plastic_strain,
        }
    }
}

fn add_warnings(
    equilibrium: &Equilibrium,
    summary: &LargeSummary,
    question: &LargeQuestion,
    report: &mut SolveReport,
) {
    let error = equilibrium.error_estimate_rel;
    if let Some(wanted) = question.max_error.filter(|wanted| error > *wanted) {
        report.warning_level = WarningLevel::CAUTION;
        let text = format!(
            "the equilibrium is estimated to be off by {error:.1e} of the largest displacement; \
             wanted was {wanted:.1e}"
        );
        report.warnings.push(Warning::new(WarningCode::ERROR, text));
    }
    add_late(question.deadline_ms, report);
    if equilibrium.jumped {
        let text = "the equilibrium jumped: the shape snapped to another one on the way";
        report.warnings.push(Warning::new(WarningCode::SNAP, text));
    }
    if summary.stretch_min < CREASE_STRETCH {
        let text = format!(
            "an element is pressed to {:.0} % of its length; surfaces crease from about 60 % on, \
             and no mesh gives a smooth answer there",
            100.0 * summary.stretch_min
        );
        report.warnings.push(Warning::new(WarningCode::CREASE, text));
    }
}
