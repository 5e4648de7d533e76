//! All methods on one system: cold starts, then warm frames, each compared with the right answer.

use std::time::Duration;

use softgrasp_core::mesh::TetMesh;
use softgrasp_core::model::{Element, Known, Model, ModelError};
use softgrasp_core::solve::condensed::{Base, Columns, ContactSet, Delivery, Touched};
use softgrasp_core::solve::{Factored, Loads, Method};

use super::system::{System, assembled, at_nodes, rms_rel};
use crate::reference::error_rel;
use crate::report::{ReportError, check, progress};
use crate::sample::{Competitor, Effort, Spread, take_turns, timed_ms};

/// Method by which an answer is computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Way {
    Direct { method: Method, residual_rel: f64 },
    Condensed,
}

/// Times and errors of one method on one system.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Outcome {
    pub way: Way,
    /// Time from the mesh to the first answer, ms.
    pub cold: Spread,
    /// Time of one more answer, with other displacements of the same patches, ms.
    pub warm: Spread,
    pub residual_rel: f64,
    /// Largest difference to the exact answer of the same system, over the largest displacement.
    pub algebraic_rel: f64,
    /// Root mean square of the difference to the answer on the finest mesh, relative to that answer.
    pub total_rel: f64,
}

/// Relative residuals at which conjugate gradients stop.
const TOLERANCES: [f64; 4] = [1e-3, 1e-6, 1e-9, 1e-12];
/// Size in bytes above which a dense matrix is left out.
const DENSE_BYTES_MAX: u64 = 512 << 20;
/// Number of unknowns above which an elimination takes minutes; every cold start makes one.
const GAUSS_JORDAN_DOFS_MAX: usize = 3500;
/// Number of unknowns above which eliminations are left out of the small form of the report.
const GAUSS_JORDAN_DOFS_QUICK: usize = 500;
/// Largest algebraic error of a method that promises an exact answer.
const EXACT: f64 = 1e-8;

impl Way {
    /// Every method that fits in memory.
    fn all(element: Element, unknown_dofs: usize, is_quick: bool) -> Vec<Self> {
        let eliminated = if is_quick { GAUSS_JORDAN_DOFS_QUICK } else { GAUSS_JORDAN_DOFS_MAX };
        let fits = |m: &Method| {
            m.dense_bytes(unknown_dofs).is_none_or(|bytes| bytes <= DENSE_BYTES_MAX)
                && (*m != Method::GaussJordan || unknown_dofs <= eliminated)
        };
        let direct = |method: Method| {
            let tolerances: &[f64] = if method == Method::Pcg { &TOLERANCES } else { &[0.0] };
            tolerances.iter().map(move |&residual_rel| Self::Direct { method, residual_rel })
        };
        let all = Method::DIRECT.into_iter().filter(fits).flat_map(direct);
        all.chain((element != Element::Tet10).then_some(Self::Condensed)).collect()
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Direct { method, .. } => method.name(),
            Self::Condensed => "condensed",
        }
    }

    pub fn precision(self) -> &'static str {
        match self {
            Self::Direct { method, .. } => method.precision(),
            Self::Condensed => "f64",
        }
    }

    /// Residual at which the method may stop, if it is iterative.
    pub fn tolerance(self) -> Option<f64> {
        match self {
            Self::Direct { residual_rel, .. } if residual_rel > 0.0 => Some(residual_rel),
            _ => None,
        }
    }
}

/// Factor, or other data, that a method keeps between answers.
enum Kept {
    Direct(Box<Factored>),
    Condensed { base: Box<Base>, set: Box<ContactSet> },
}

/// Displacements of the watched nodes (3 for each node, m), and the residual that the method reports.
type Answer = (Vec<f64>, f64);

impl Kept {
    fn prepare(
        way: Way,
        model: &Model,
        known: &Known,
        watched: &[u32],
    ) -> Result<Self, ReportError> {
        match way {
            Way::Direct { method, .. } => {
                Ok(Self::Direct(Box::new(model.factor(&known.dofs, method, &mut |_| {})?)))
            }
            Way::Condensed => {
                let base = model.condense(None, &mut |_| {})?;
                model.held_partition(&known.dofs)?;
                let columns = Columns::new(usize::MAX);
                let mut set = ContactSet::try_new(&base, &columns, &Touched::of_dofs(&known.dofs))
                    .map_err(ModelError::from)?;
                set.want(&base, watched);
                Ok(Self::Condensed { base: Box::new(base), set: Box::new(set) })
            }
        }
    }

    fn answer(
        &self,
        way: Way,
        model: &Model,
        q_known: &[f64],
        watched: &[u32],
    ) -> Result<Answer, ReportError> {
        match self {
            Self::Direct(factored) => {
                let residual_rel = way.tolerance().unwrap_or(0.0);
                let loads = Loads { q_known, residual_rel, ..Loads::default() };
                let solution = factored.solve(model.stiffness(), loads, &mut |_| {})?;
                Ok((at_nodes(&solution.displacement, watched), solution.residual_rel))
            }
            Self::Condensed { base, set } => {
                let solved = set.solve(q_known).map_err(ModelError::from)?;
                let delivered = set.wanted_displacements(&solved);
                let certificate = set.certify(base, q_known, &solved, &delivered, Delivery::Double);
                Ok((delivered.into_iter().flatten().collect(), certificate.residual_rel))
            }
        }
    }
}

/// One answer with its time and errors.
struct Timed {
    ms: f64,
    residual_rel: f64,
    algebraic_rel: f64,
    total_rel: f64,
}

/// Compares an answer to `scale` times the known displacements.
fn compared(
    system: &System,
    finest: &[f64],
    way: Way,
    scale: f64,
    (ms, (answer, residual_rel)): (f64, Answer),
) -> Result<Timed, ReportError> {
    let right = system.right.iter().map(|u| scale * u);
    let algebraic_rel = match answer.len() == system.right.len() {
        true => error_rel(answer.iter().copied().zip(right)),
        false => f64::INFINITY,
    };
    let (error, allowed) = match way.tolerance() {
        // An iteration promises a residual.
        Some(tolerance) => (residual_rel, tolerance),
        None => (algebraic_rel, EXACT),
    };
    check(|| format!("{} with {}", way.name(), system.discretisation.name()), error, allowed)?;
    let at_one: Vec<f64> = answer.iter().map(|u| u / scale).collect();
    Ok(Timed { ms, residual_rel, algebraic_rel, total_rel: rms_rel(&at_one, finest) })
}

/// Runs every method on one system, on the current rayon pool.
///
/// Shapes: `finest` displacements of the watched nodes on the finest mesh, 3 for each node, m.
///
/// # Errors
/// [`ReportError`], also for an answer whose error is above what its method promises.
pub(super) fn contest(
    object: &str,
    system: &System,
    finest: &[f64],
    is_quick: bool,
) -> Result<Vec<Outcome>, ReportError> {
    let name = system.discretisation.name();
    progress("frontier", &format!("{object}, {name}, {} unknowns", system.unknown_dofs()));
    let ways = Way::all(system.model.element(), system.unknown_dofs(), is_quick);
    let (known, watched) = (&system.known, system.watched.as_slice());
    let mut kept: Vec<Option<Kept>> = ways.iter().map(|_| None).collect();
    let mut starts: Vec<Competitor<'_, Timed, ReportError>> = Vec::new();
    for (&way, place) in ways.iter().zip(&mut kept) {
        starts.push(Box::new(move || {
            // What is kept from the round before goes first: two would not fit everywhere.
            *place = None;
            let mesh: TetMesh = system.model.mesh().clone();
            let (ms, first) = timed_ms(|| -> Result<_, ReportError> {
                let model = assembled(mesh, system.model.element())?;
                let ready = Kept::prepare(way, &model, known, watched)?;
                let answer = ready.answer(way, &model, &known.q_known, watched)?;
                Ok((ready, answer, model))
            });
            let (ready, answer, _) = first?;
            *place = Some(ready);
            compared(system, finest, way, 1.0, (ms, answer))
        }));
    }
    let cold = take_turns(&cold_effort(is_quick), &mut starts)?;
    drop(starts);
    // Every way has started at least once.
    let kept: Vec<Kept> = kept.into_iter().flatten().collect();
    let mut frames: Vec<Competitor<'_, Timed, ReportError>> = Vec::new();
    for (&way, ready) in ways.iter().zip(&kept) {
        let mut asked = 0u32;
        frames.push(Box::new(move || {
            asked += 1;
            let scale = 1.0 + 0.25 * f64::from(asked).sin();
            let q_known: Vec<f64> = known.q_known.iter().map(|q| scale * q).collect();
            let (ms, answer) = timed_ms(|| ready.answer(way, &system.model, &q_known, watched));
            compared(system, finest, way, scale, (ms, answer?))
        }));
    }
    let warm = take_turns(&warm_effort(is_quick), &mut frames)?;
    let results = ways.into_iter().zip(cold).zip(warm);
    Ok(results.map(|((way, cold), warm)| Outcome::of(way, &cold, &warm)).collect())
}

impl Outcome {
    fn of(way: Way, cold: &[Timed], warm: &[Timed]) -> Self {
        let ms = |timed: &[Timed]| Spread::of(timed.iter().map(|t| t.ms));
        let worst = |of: fn(&Timed) -> f64| Spread::of(cold.iter().chain(warm).map(of)).max;
        Self {
            way,
            cold: ms(cold),
            warm: ms(warm),
            residual_rel: worst(|t| t.residual_rel),
            algebraic_rel: worst(|t| t.algebraic_rel),
            total_rel: worst(|t| t.total_rel),
        }
    }
}

fn cold_effort(is_quick: bool) -> Effort {
    let (rounds_min, rounds_max, seconds) = if is_quick { (1, 2, 1) } else { (3, 9, 6) };
    let budget = Duration::from_secs(seconds);
    Effort { warm_up_rounds: 0, rounds_min, rounds_max, budget }
}

fn warm_effort(is_quick: bool) -> Effort {
    let (rounds_min, rounds_max, seconds) = if is_quick { (5, 20, 1) } else { (15, 200, 4) };
    let budget = Duration::from_secs(seconds);
    Effort { warm_up_rounds: 2, rounds_min, rounds_max, budget }
}
