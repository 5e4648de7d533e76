//! Frames of one squeeze with one error budget: time, solves, estimated and true error of each.

use std::sync::Arc;

use softgrasp_core::solve::condensed::{Columns, CondensedError, ContactSet, Touched};
use softgrasp_core::solve::equilibrium::{Goal, Wish};
use softgrasp_core::solve::{FrontAnalysis, FrontFactor};

use super::squeeze::Squeeze;
use crate::report::ReportError;
use crate::sample::{Spread, timed_ms};

/// Squeeze in a number of frames, and the exact shape after each.
pub(super) struct Truth {
    pub frames: usize,
    shapes: Vec<Vec<f64>>,
}

impl Truth {
    /// Follows the squeeze in double precision until every residual is at rounding.
    ///
    /// # Errors
    /// [`ReportError`] where a frame has no equilibrium.
    pub fn new(squeeze: &Squeeze, frames: usize) -> Result<Self, ReportError> {
        let mut path = squeeze.path(false)?;
        let mut shapes = Vec::with_capacity(frames);
        for frame in 1..=frames {
            let mask_q = squeeze.at(frame as f64 / frames as f64);
            let wish = Wish { error_rel: Some(1e-12), ..Wish::EXACT };
            path.advance(&Goal { q_known: &[], mask_q: &mask_q, forces: &[] }, &wish)?;
            if let Some(renewal) = path.renewal() {
                path.install(renewal.make(), 1);
            }
            shapes.push(path.displacement().to_vec());
        }
        Ok(Self { frames, shapes })
    }

    /// Largest error of a shape, relative to the largest displacement.
    fn error(&self, frame: usize, shape: &[f64]) -> f64 {
        largest_error(shape, &self.shapes[frame])
    }
}

/// Largest error of a shape, relative to the largest displacement of the exact one.
fn largest_error(shape: &[f64], right: &[f64]) -> f64 {
    let length = |u: &[f64]| u.iter().map(|x| x * x).sum::<f64>();
    let (mut off, mut most) = (0.0f64, 0.0f64);
    for (a, b) in shape.chunks_exact(3).zip(right.chunks_exact(3)) {
        let difference: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
        off = off.max(length(&difference));
        most = most.max(length(b));
    }
    (off / most).sqrt()
}

/// Equilibrium that a shape settles to, in double precision, until its residual is at rounding.
///
/// # Errors
/// [`ReportError`] if there is none.
fn settled(squeeze: &Squeeze, shape: &[f64], goal: &Goal<'_>) -> Result<Vec<f64>, ReportError> {
    let mut path = squeeze.path_from(shape.to_vec(), false)?;
    path.advance(goal, &Wish::EXACT)?;
    Ok(path.displacement().to_vec())
}

/// Difference of two settled shapes, relative to the largest displacement, above which they are two
/// equilibria.
const ELSEWHERE: f64 = 1e-6;

/// Times and errors of the frames with one error budget.
pub(super) struct Measured {
    /// Time of a frame, ms, without the factors made in the background.
    pub ms: Spread,
    /// Time of a solve by `front` in single precision, measured in turn with the frames, ms.
    pub solve_ms: Spread,
    /// Ratio of the time of a frame to that of the solve beside it.
    pub ratio: Spread,
    pub solves: Spread,
    pub error: Spread,
    pub estimate_max: f64,
    /// Largest ratio of a true error to its estimate.
    pub error_over_estimate: f64,
    /// Number of frames whose true error is more than twice its estimate.
    pub over_twice: usize,
    /// Number of frames on another branch of equilibria than the path in double precision.
    pub elsewhere: usize,
    /// Number of frames without an equilibrium; the shape stayed.
    pub refused: usize,
    pub factors: usize,
    pub factor_ms: f64,
    pub bytes: usize,
    pub model_bytes: usize,
}

/// Plays the squeeze with an error budget. Every frame after the first one, which makes the first factor,
/// is timed; further factors are made between the frames, as a run makes them in the background.
///
/// # Errors
/// [`ReportError`] where the object cannot be held.
pub(super) fn play(squeeze: &Squeeze, truth: &Truth, budget: f64) -> Result<Measured, ReportError> {
    let mut path = squeeze.path(true)?;
    let stiffness = squeeze.model.stiffness();
    let dofs: Vec<u32> = touched_dofs(squeeze);
    let partition = squeeze.model.held_partition(&dofs)?;
    let analysis = Arc::new(FrontAnalysis::new(stiffness, &partition));
    let front = FrontFactor::<f32>::try_new(&analysis, stiffness)?;
    let mut b = vec![1.0; partition.unknown().len()];
    let (mut ms, mut solve_ms, mut solves, mut errors) = (vec![], vec![], vec![], vec![]);
    let (mut estimate_max, mut over) = (0.0f64, 0.0f64);
    let (mut factors, mut factor_ms) = (0, 0.0f64);
    let (mut elsewhere, mut refused, mut over_twice) = (0, 0, 0);
    for frame in 0..truth.frames {
        let mask_q = squeeze.at((frame + 1) as f64 / truth.frames as f64);
        let goal = Goal { q_known: &[], mask_q: &mask_q, forces: &[] };
        let wish = Wish { error_rel: Some(budget), ..Wish::EXACT };
        let (took, found) = timed_ms(|| path.advance(&goal, &wish));
        let Ok(found) = found else {
            refused += 1;
            continue;
        };
        let (solved_ms, ()) = timed_ms(|| front.solve_in_place(&mut b, 1));
        b.iter_mut().for_each(|x| *x = 1.0);
        let mut error = truth.error(frame, path.displacement());
        if error > found.error_estimate_rel.max(ELSEWHERE) {
            // Where the body may buckle there are several equilibria; an error is the way to one's own.
            let own = settled(squeeze, path.displacement(), &goal);
            if let Some(own) = own.ok().filter(|own| truth.error(frame, own) > ELSEWHERE) {
                elsewhere += 1;
                error = largest_error(path.displacement(), &own);
            }
        }
        if frame > 0 {
            ms.push(took);
            solve_ms.push(solved_ms);
            solves.push(f64::from(found.linear_solves));
            errors.push(error);
        }
        estimate_max = estimate_max.max(found.error_estimate_rel);
        // Below this both are rounding.
        if found.error_estimate_rel > 1e-11 {
            over = over.max(error / found.error_estimate_rel);
            over_twice += usize::from(error > 2.0 * found.error_estimate_rel);
        }
        if let Some(renewal) = path.renewal() {
            let (took, made) = timed_ms(|| renewal.make());
            path.install(made, 1);
            (factors, factor_ms) = (factors + 1, factor_ms.max(took));
        }
    }
    Ok(Measured {
        ratio: Spread::of_ratio(&ms, &solve_ms),
        ms: Spread::of(ms),
        solve_ms: Spread::of(solve_ms),
        solves: Spread::of(solves),
        error: Spread::of(errors),
        estimate_max,
        error_over_estimate: over,
        over_twice,
        elsewhere,
        refused,
        factors,
        factor_ms,
        bytes: path.bytes() + path.elements().bytes(),
        model_bytes: squeeze.model.bytes(),
    })
}

/// Degrees of freedom of two nodes under each tip; they hold the body for a factor to compare with.
fn touched_dofs(squeeze: &Squeeze) -> Vec<u32> {
    let entries = squeeze.masks.iter().flat_map(|mask| mask.entries().iter().take(2));
    let mut nodes: Vec<u32> = entries.map(|entry| entry.0).collect();
    nodes.sort_unstable();
    nodes.dedup();
    nodes.iter().flat_map(|n| (0..3).map(move |axis| 3 * n + axis)).collect()
}

/// Linear answers to every frame, with times and errors.
pub(super) struct Linear {
    pub ms: Spread,
    pub error: Spread,
    /// Size of the data that is kept between frames beside the model (factor and columns), bytes.
    pub bytes: usize,
}

/// Linear answer to each frame by the method that frames otherwise have: its true error and time.
///
/// # Errors
/// [`ReportError`].
pub(super) fn linear(squeeze: &Squeeze, truth: &Truth) -> Result<Linear, ReportError> {
    let base = squeeze.model.condense(None, &mut |_| {})?;
    let touched = Touched { dofs: Vec::new(), masks: squeeze.masks.clone() };
    let columns = Columns::new(1 << 30);
    let set = ContactSet::try_new(&base, &columns, &touched)?;
    let (mut ms, mut errors) = (Vec::new(), Vec::new());
    for frame in 0..truth.frames {
        let mask_q = squeeze.at((frame + 1) as f64 / truth.frames as f64);
        let (took, answer) = timed_ms(|| {
            let answer = set.solve(&mask_q)?;
            Ok::<_, CondensedError>(set.full_displacement(&base, &answer))
        });
        ms.push(took);
        errors.push(truth.error(frame, &answer?));
    }
    let bytes = base.bytes() + columns.bytes(&base) + set.bytes();
    Ok(Linear { ms: Spread::of(ms), error: Spread::of(errors), bytes })
}
