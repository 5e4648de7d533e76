//! What an equilibrium is asked for: prescribed displacements (Dirichlet values), means of masks and
//! forces, the motion to them, and when an answer is good enough.

use super::hold::Hold;

/// Known displacements and means of masks that an equilibrium is asked for.
///
/// Shapes: `q_known` one for each known degree of freedom of the hold; `mask_q` three for each mask;
/// `forces` 3N of the system, or empty. Units: m, N.
#[derive(Clone, Copy, Debug)]
pub struct Goal<'a> {
    /// Prescribed displacements (Dirichlet values) `Q_k`.
    pub q_known: &'a [f64],
    /// Mean displacement of each mask.
    pub mask_q: &'a [f64],
    /// Forces, which keep their directions. What acts on a known degree of freedom moves nothing: its
    /// support carries it.
    pub forces: &'a [f64],
}

/// When an equilibrium is good enough.
#[derive(Clone, Copy)]
pub struct Wish<'a> {
    /// Estimated error of a displacement over the largest displacement at which to stop; `None`
    /// goes on until the residual is rounding.
    pub error_rel: Option<f64>,
    /// Says that time is up: the best that is there is answered.
    pub is_late: &'a (dyn Fn() -> bool + Sync),
    /// Says whether there is time to wait for a factor; where not, [`super::Path::renewal`] asks for
    /// one to be made beside the frames. The first factor is waited for in any case.
    pub may_factor: &'a (dyn Fn() -> bool + Sync),
    /// Whether the last balanced shape on the way will do, where time is up or the way ends; what is
    /// missing is in the estimate then.
    pub part_will_do: bool,
}

impl Wish<'_> {
    /// Until the residual is rounding, whatever it takes.
    pub const EXACT: Self =
        Self { error_rel: None, is_late: &|| false, may_factor: &|| true, part_will_do: false };
}

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
    /// From the shape `q` of a body that is held and that forces act on.
    pub fn begin(hold: &Hold, q: &[f64], forces: &[f64], end: &'a Goal<'a>) -> Self {
        let start = Constraints {
            q_known: hold.dofs().iter().map(|&dof| q[dof as usize]).collect(),
            mask_q: hold.means(q),
            forces: forces.to_vec(),
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
