//! The motion from the constraints of the shape that was reached to those asked for, and its parts.

use super::goal::Goal;
use super::path::Path;

/// Known displacements, means of masks and forces at the beginning and at the end of a motion.
///
/// Units: m, N.
pub(super) struct Motion<'a> {
    start: Constraints,
    end: &'a Goal<'a>,
}

/// What is asked for at one place of a motion.
#[derive(Clone)]
pub(super) struct Constraints {
    q_known: Vec<f64>,
    mask_q: Vec<f64>,
    pub forces: Vec<f64>,
}

impl<'a> Motion<'a> {
    /// From where a path is.
    pub fn begin(path: &Path, end: &'a Goal<'a>) -> Self {
        let start = Constraints {
            q_known: path.hold.dofs().iter().map(|&dof| path.q[dof as usize]).collect(),
            mask_q: path.hold.means(&path.q),
            forces: path.forces.clone(),
        };
        Self { start, end }
    }

    /// The constraints at a share of the motion; all of it ends at the very numbers asked for.
    pub fn at(&self, share: f64) -> Constraints {
        let Self { start, end } = self;
        if share == 0.0 {
            return start.clone();
        }
        if share == 1.0 {
            return Constraints {
                q_known: end.q_known.to_vec(),
                mask_q: end.mask_q.to_vec(),
                forces: end.forces.to_vec(),
            };
        }
        Constraints {
            q_known: between(&start.q_known, end.q_known, share),
            mask_q: between(&start.mask_q, end.mask_q, share),
            forces: between(&start.forces, end.forces, share),
        }
    }
}

impl Constraints {
    /// As a goal.
    pub fn goal(&self) -> Goal<'_> {
        Goal { q_known: &self.q_known, mask_q: &self.mask_q, forces: &self.forces }
    }
}

/// Numbers at a share of the way; those that one side has not are zero there.
fn between(a: &[f64], b: &[f64], share: f64) -> Vec<f64> {
    let of = |numbers: &[f64], at: usize| numbers.get(at).copied().unwrap_or(0.0);
    let at = |i| of(a, i) + share * (of(b, i) - of(a, i));
    (0..a.len().max(b.len())).map(at).collect()
}
