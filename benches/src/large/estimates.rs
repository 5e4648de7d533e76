//! Compares the estimated error of frames with the true one, over random squeezes.

use softgrasp_core::solve::equilibrium::{Goal, Path, Wish};

use super::trial::Trial;
use crate::report::ReportError;

/// Difference of two settled shapes, relative to the largest displacement, above which they are two
/// equilibria.
const ELSEWHERE: f64 = 1e-6;
/// Estimate below which only rounding is left.
const ROUNDING: f64 = 1e-11;

/// Totals of the frames of one error budget over squeezes.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Judged {
    pub frames: usize,
    /// Number of frames without an equilibrium, and of those after such a one.
    pub refused: usize,
    /// Number of frames while the body snaps, which are not judged.
    pub snaps: usize,
    /// Number of judged frames whose true error is above the estimate.
    pub above: usize,
    /// Number of judged frames whose true error is above twice the estimate.
    pub above_twice: usize,
    /// Number of judged frames whose estimate is above the budget.
    pub over_budget: usize,
    pub solves: usize,
    /// Number of factors made while a frame waited, and in the background.
    pub factors: usize,
    pub renewals: usize,
    /// Ratio of the true error to the estimate of every judged frame.
    pub ratios: Vec<f64>,
}

impl Judged {
    /// Adds the totals of other squeezes.
    pub fn append(&mut self, mut other: Self) {
        self.frames += other.frames;
        self.refused += other.refused;
        self.snaps += other.snaps;
        self.above += other.above;
        self.above_twice += other.above_twice;
        self.over_budget += other.over_budget;
        self.solves += other.solves;
        self.factors += other.factors;
        self.renewals += other.renewals;
        self.ratios.append(&mut other.ratios);
    }
}

/// Exact shapes of a squeeze, and the frames in which it snaps.
pub(super) struct Reference {
    shapes: Vec<(Vec<f64>, bool)>,
}

impl Reference {
    /// Follows the squeeze in double precision until every residual is at rounding, as far as there are
    /// equilibria.
    ///
    /// # Errors
    /// [`ReportError`] where the object cannot be held.
    pub fn follow(trial: &Trial) -> Result<Self, ReportError> {
        let mut path = trial.path(false)?;
        let mut shapes = Vec::new();
        for frame in 1..=trial.frames {
            let mask_q = trial.at(frame as f64 / trial.frames as f64);
            let wish = Wish { error_rel: Some(1e-12), ..Wish::EXACT };
            let Ok(found) = path.advance(&goal(&mask_q), &wish) else { break };
            if let Some(renewal) = path.renewal() {
                path.install(renewal.make(), 1);
            }
            shapes.push((path.displacement().to_vec(), found.jumped));
        }
        Ok(Self { shapes })
    }

    /// Number of frames that have an equilibrium.
    pub fn len(&self) -> usize {
        self.shapes.len()
    }
}

/// Plays a squeeze with an error budget, and compares each frame's estimate with its distance to the
/// equilibrium that it settles to. Factors are made between the frames, as a run makes them in the
/// background.
///
/// # Errors
/// [`ReportError`] where the object cannot be held.
pub(super) fn judge(
    trial: &Trial,
    reference: &Reference,
    budget: f64,
) -> Result<Judged, ReportError> {
    let mut path = trial.path(true)?;
    let mut judged = Judged { frames: reference.len(), ..Judged::default() };
    let mut is_snapping = false;
    for (frame, (right, jumps)) in reference.shapes.iter().enumerate() {
        let mask_q = trial.at((frame + 1) as f64 / trial.frames as f64);
        let wish = Wish { error_rel: Some(budget), ..Wish::EXACT };
        let Ok(found) = path.advance(&goal(&mask_q), &wish) else {
            judged.refused += reference.len() - frame;
            break;
        };
        judged.solves += found.linear_solves as usize;
        judged.factors += found.factors as usize;
        let (error, is_elsewhere) = true_error(trial, &path, &mask_q, right)?;
        let estimate = found.error_estimate_rel;
        is_snapping |= *jumps || found.jumped || is_elsewhere && error > estimate;
        let is_above = error > estimate && estimate > ROUNDING;
        if is_snapping && is_above {
            judged.snaps += 1;
        } else {
            is_snapping = false;
            judged.above += usize::from(is_above);
            judged.above_twice += usize::from(is_above && error > 2.0 * estimate);
            judged.over_budget += usize::from(estimate > budget);
            judged.ratios.push(error / estimate.max(ROUNDING));
        }
        if let Some(renewal) = path.renewal() {
            path.install(renewal.make(), 1);
            judged.renewals += 1;
        }
    }
    Ok(judged)
}

fn goal(mask_q: &[f64]) -> Goal<'_> {
    Goal { q_known: &[], mask_q, forces: &[] }
}

/// Distance of the shape to the equilibrium that it settles to, relative to the largest displacement, and
/// whether that is another one than the exact shape.
fn true_error(
    trial: &Trial,
    path: &Path,
    mask_q: &[f64],
    right: &[f64],
) -> Result<(f64, bool), ReportError> {
    let shape = path.displacement();
    let near = largest_error(shape, right);
    if near < ROUNDING {
        return Ok((near, false));
    }
    let mut settling = trial.path_from(shape.to_vec(), false)?;
    match settling.advance(&goal(mask_q), &Wish::EXACT) {
        Ok(_) => {
            let own = settling.displacement();
            Ok((largest_error(shape, own), largest_error(own, right) > ELSEWHERE))
        }
        // Nothing to settle to: the branch has ended.
        Err(_) => Ok((near, true)),
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
