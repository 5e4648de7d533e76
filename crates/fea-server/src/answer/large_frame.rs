//! Answers one frame question at large deformation: the session's path on a kept model goes on.

use std::sync::Arc;
use std::time::Instant;

use softgrasp_core::fem::hyperelastic::LargeSummary;
use softgrasp_core::solve::equilibrium::{Hold, Path};
use softgrasp_core::solve::{Method, Stage};
use softgrasp_protocol::{
    Answer, Deformation, Displacements, LargeAsk, ModelHash, NodeChoice, Pace, PathChoice,
    Question as QuestionMessage, Want, Warning, WarningCode, WarningLevel,
};

use super::fields::{Shape, field_values};
use super::frame::answer_frame;
use super::gradient::{of_equilibrium, reserve_tangent};
use super::large::{Found, FramePace, LINEAR_ERROR_REL, LargeQuestion, law_of};
use super::large_once::{admit_path, linear_answer, promised_error};
use crate::awaited::Awaited;
use crate::clock::{StageClock, StageWatch, ms_since};
use crate::lock::Lock;
use crate::paths::{Coming, ModelPath, Seat, Seated, UnderWay};
use crate::plan::Subject;
use crate::refusal::Refusal;
use crate::resources::Resources;
use crate::store::StoredModel;

/// Answer to a frame question, and the work to be done in the background for those that follow.
pub(crate) struct Answered {
    /// Answer to the frame question.
    pub answer: Answer,
    /// Makes the session's path, where linear elasticity has answered because there was no path yet.
    pub making: Option<Box<dyn FnOnce() + Send>>,
}

/// Answers one frame question from the shape of the session's last one. The first questions of a live
/// grip are answered by linear elasticity while the path is made in the background, if `may_make` allows
/// it.
///
/// # Errors
/// [`Refusal`]; the path then stays unchanged.
pub(crate) fn answer_large_frame(
    resources: &Arc<Resources>,
    seat: &Seat,
    (hash, ask, message): (ModelHash, LargeAsk, QuestionMessage),
    clock: StageClock,
    may_make: bool,
) -> Result<Answered, Refusal> {
    let resources = Arc::clone(resources);
    let stored = resources.models.find(hash).ok_or(Refusal::UnknownModel(hash))?;
    let question = LargeQuestion::new(&stored.model, &ask, &message)?;
    if question.by_multigrid {
        return Err(Refusal::LargeMethod { method: Method::Multigrid });
    }
    let frame = Arc::new(Frame { resources, hash, stored, ask, message, question });
    let (kept, coming) = match seat.with(Option::take) {
        None => (None, None),
        Some(Seated::Path(path)) => (Some(path), None),
        Some(Seated::Coming(coming)) => match coming.take() {
            Some(made) => (Some(made?), None),
            None => (None, Some(coming).filter(|coming| !coming.is_alone())),
        },
    };
    let kept = kept.filter(|kept| frame.goes_on(kept));
    if frame.ask.deformation == Deformation::Auto
        && kept.is_none()
        && let Some((answer, promised)) = frame.linear(&clock)?
    {
        let is_exact = promised <= frame.allowed();
        if is_exact {
            seat.with(|seat| *seat = coming.map(Seated::Coming));
            return Ok(Answered { answer: linear_answer(answer, promised), making: None });
        }
        if frame.is_live() && (may_make || coming.is_some()) {
            let (coming, making) = match coming {
                Some(coming) => (coming, None),
                None => {
                    let coming = Coming::default();
                    let making = frame.making(coming.clone());
                    (coming, Some(making))
                }
            };
            seat.with(|seat| *seat = Some(Seated::Coming(coming)));
            return Ok(Answered { answer: frame.meanwhile(answer, promised), making });
        }
    }
    let mut clock = clock;
    let mut path = match kept {
        Some(path) => path,
        None => frame.path_at_rest(&mut clock)?,
    };
    let answered = frame.advance(&mut path, clock);
    // A path that found no equilibrium is where it was.
    seat.with(|seat| *seat = Some(Seated::Path(path)));
    frame.resources.models.trim();
    answered.map(|answer| Answered { answer, making: None })
}

/// A frame question with its model and the server's resources.
struct Frame {
    resources: Arc<Resources>,
    hash: ModelHash,
    stored: Arc<StoredModel>,
    ask: LargeAsk,
    message: QuestionMessage,
    question: LargeQuestion,
}

impl Frame {
    /// Whether the question continues a kept path: same law and yield stress, and not from rest.
    fn goes_on(&self, kept: &ModelPath) -> bool {
        self.ask.path == PathChoice::Continue
            && kept.law == law_of(self.ask.law)
            && kept.yield_stress == self.ask.yield_stress
    }

    /// Whether an answer in time matters more than an exact one.
    fn is_live(&self) -> bool {
        self.ask.path == PathChoice::Continue
            && self.ask.pace == Pace::Timely
            && self.question.deadline_ms.is_some()
    }

    /// Relative error that a linear answer may have.
    fn allowed(&self) -> f64 {
        self.question.max_error.unwrap_or(LINEAR_ERROR_REL)
    }

    /// Linear answer, and the largest error that rotation and strain of the whole body promise; `None`
    /// where linear elasticity cannot answer.
    fn linear(&self, clock: &StageClock) -> Result<Option<(Answer, f64)>, Refusal> {
        if self.ask.yield_stress.is_some() {
            return Ok(None);
        }
        let node_count = self.stored.model.mesh().node_count();
        let mut question = self.message.clone();
        question.max_error = None;
        question.want =
            Want { nodes: NodeChoice::All, reactions: question.want.reactions, ..Want::default() };
        let mut answer = answer_frame(&self.resources, self.hash, question, clock.clone())?;
        let all = std::mem::replace(&mut answer.displacements, Displacements::F64(Vec::new()));
        let all = all.into_f64();
        if self.stored.model.system_node_count() != node_count {
            // Mid-edge nodes stay with the server: their strain is that of the report.
            return Ok(None);
        }
        let strain = self.stored.model.strain(all.as_flattened(), &mut || {});
        let promised = promised_error(strain.rotation_max, strain.strain_max);
        // An answer that is too far off and that nobody waits for is not given: it needs no fields.
        if promised <= self.allowed() || self.is_live() {
            let shape = Shape::Linear(all.as_flattened());
            answer.fields = field_values(&self.stored.model, &shape, &self.message.want);
        }
        let rows = match &self.message.want.nodes {
            NodeChoice::All => all,
            NodeChoice::Nodes(nodes) => nodes.iter().map(|&n| all[n as usize]).collect(),
        };
        answer.nodes = self.message.want.nodes.clone();
        answer.displacements = Displacements::of(rows, self.message.want.precision);
        answer.report.max_rotation_deg = strain.rotation_max.to_degrees();
        answer.report.max_strain = strain.strain_max;
        answer.report.warnings.clear();
        Ok(Some((answer, promised)))
    }

    /// Linear answer while the path is being made, with a warning that says so.
    fn meanwhile(&self, answer: Answer, promised: f64) -> Answer {
        let mut answer = linear_answer(answer, promised);
        let report = &mut answer.report;
        report.chosen_because += "; the equilibrium is being prepared";
        report.warning_level = WarningLevel::CAUTION;
        let text = format!(
            "linear elasticity answers while the equilibrium at large deformation is prepared: it may be \
             off by {promised:.1e} of the largest displacement; wanted was {:.1e}",
            self.allowed()
        );
        report.warnings.push(Warning::new(WarningCode::PREPARING, text));
        if let Some(large) = &mut answer.large {
            large.settled = false;
        }
        answer
    }

    /// Work that makes the path and moves it to this question's displacements, for the questions that
    /// follow.
    fn making(self: &Arc<Self>, coming: Coming) -> Box<dyn FnOnce() + Send> {
        let frame = Arc::clone(self);
        Box::new(move || {
            if coming.is_alone() {
                return;
            }
            let clock = || {
                let (now, watch) = (Instant::now(), StageWatch::default());
                StageClock::new(0.0, now, watch, Awaited::default())
            };
            coming.arrive(frame.path_at_rest(&mut clock()).map(|mut kept| {
                let pace = FramePace { factor_ms: None, part_will_do: true };
                // Where it is not found, the next frame goes on from rest.
                let _ = frame.question.advance(&mut kept.path, &clock(), pace);
                kept
            }));
        })
    }

    fn hold(&self, before: Option<&Hold>, clock: &mut StageClock) -> Result<Arc<Hold>, Refusal> {
        clock.begin(Stage::Order);
        let LargeQuestion { known, masks, .. } = &self.question;
        Ok(Arc::new(self.stored.model.hold(&known.dofs, masks.clone(), before)?))
    }

    fn path_at_rest(&self, clock: &mut StageClock) -> Result<Box<ModelPath>, Refusal> {
        let model = &self.stored.model;
        let law = law_of(self.ask.law);
        clock.begin(Stage::Assemble);
        let elements = Arc::new(model.yielding(law, self.ask.yield_stress)?);
        let hold = self.hold(None, clock)?;
        let reservation = self.resources.budget.reservation();
        let is_single = self.question.is_single;
        let subject = Subject::about(model, self.question.known.dofs.len(), Some(self.hash));
        admit_path(&self.resources, &reservation, model, (&hold, is_single), &subject)?;
        let rest = vec![0.0; 3 * model.system_node_count()];
        let path = Path::new(elements, model.stiffness(), hold, rest, is_single);
        Ok(Box::new(ModelPath {
            law,
            yield_stress: self.ask.yield_stress,
            path,
            reservation,
            under_way: None,
            summary_ms: None,
            factor_ms: None,
        }))
    }

    /// Moves the path to the prescribed displacements, and answers.
    fn advance(&self, kept: &mut ModelPath, mut clock: StageClock) -> Result<Answer, Refusal> {
        let Self { question, message, stored, .. } = self;
        if !kept.path.hold().is_by(&question.known.dofs, &question.masks) {
            let LargeQuestion { known, masks, .. } = question;
            let is_new_grip = !kept.path.hold().shares_a_node(&known.dofs, masks);
            let hold = self.hold(Some(kept.path.hold()), &mut clock)?;
            kept.path.hold_by(hold);
            // Between two grips nothing held the body.
            if is_new_grip && kept.yield_stress.is_none() {
                kept.path.spring_back();
            }
        }
        self.take_factor(kept, &mut clock);
        clock.begin(Stage::Solve);
        let part_will_do = self.ask.pace == Pace::Timely && question.deadline_ms.is_some();
        let pace = FramePace { factor_ms: kept.factor_ms, part_will_do };
        let equilibrium = question.advance(&mut kept.path, &clock, pace)?;
        let hold = kept.path.hold();
        let of_tangent =
            reserve_tangent(&self.resources, (&stored.model, hold), message, Some(self.hash))?;
        let gradient = of_equilibrium(&stored.model, message, (&kept.path, &equilibrium))?;
        drop(of_tangent);
        clock.end();
        self.begin_factor(kept);
        let summary = self.summary(kept, &clock);
        kept.reservation.settle((kept.path.bytes() + kept.path.elements().bytes()) as u64);
        let found = Found {
            model: &stored.model,
            path: &kept.path,
            factor_reused: equilibrium.factors == 0,
            equilibrium,
            summary,
            is_single: question.is_single,
            chosen_because: match self.ask.deformation {
                Deformation::Large | Deformation::Linear => "asked for".to_owned(),
                Deformation::Auto => {
                    "large: linear elasticity promises no error within what is allowed".to_owned()
                }
            },
            gradient,
        };
        Ok(found.answer(question, message, clock))
    }

    /// Takes the factor that was made in the background, or makes one now where the elapsed time must not
    /// decide.
    fn take_factor(&self, kept: &mut ModelPath, clock: &mut StageClock) {
        if self.ask.pace == Pace::Repeatable
            && let Some(renewal) = kept.path.renewal()
        {
            clock.begin(Stage::Factor);
            kept.path.install(renewal.make(), 1);
        }
        let Some(mut under_way) = kept.under_way.take() else { return };
        under_way.frames += 1;
        match under_way.made.with(Option::take) {
            Some((made, took_ms)) => {
                kept.factor_ms = Some(took_ms);
                kept.path.install(made, under_way.frames);
            }
            None => kept.under_way = Some(under_way),
        }
    }

    /// Begins a factor of the newest shape in the background, if the present factor has become old.
    fn begin_factor(&self, kept: &mut ModelPath) {
        if self.ask.pace != Pace::Timely || kept.under_way.is_some() {
            return;
        }
        let Some(renewal) = kept.path.renewal() else { return };
        let made = Arc::new(Lock::default());
        kept.under_way = Some(UnderWay { made: Arc::clone(&made), frames: 0 });
        self.resources.workers.factor_beside(move || {
            let start = Instant::now();
            let renewed = renewal.make();
            made.with(|made| *made = Some((renewed, ms_since(start))));
        });
    }

    /// Rotation and stretches of this shape; NaN where the deadline leaves no time for them.
    fn summary(&self, kept: &mut ModelPath, clock: &StageClock) -> LargeSummary {
        let deadline_ms = self.question.deadline_ms.filter(|_| self.ask.pace == Pace::Timely);
        let left_ms = deadline_ms.map_or(f64::INFINITY, |deadline| deadline - clock.elapsed_ms());
        // What the last one took is known; the first one is taken to fit.
        if SUMMARY_MARGIN * kept.summary_ms.unwrap_or(0.0) > left_ms {
            return LargeSummary::UNKNOWN;
        }
        let start = Instant::now();
        let summary = kept.path.elements().summary(kept.path.displacement());
        kept.summary_ms = Some(ms_since(start));
        summary
    }
}

/// Time that must be left for rotation and stretches, as a multiple of what they took last.
const SUMMARY_MARGIN: f64 = 2.0;
