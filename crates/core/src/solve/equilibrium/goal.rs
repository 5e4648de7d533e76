//! What an equilibrium is asked for: what is known, and when it is good enough.

/// Known displacements and means of masks that an equilibrium is asked for.
///
/// Shapes: `q_known` one for each known degree of freedom of the hold; `mask_q` three for each mask;
/// `forces` 3N of the system, or empty. Units: m, N.
#[derive(Clone, Copy, Debug)]
pub struct Goal<'a> {
    /// `Q_k`.
    pub q_known: &'a [f64],
    /// Mean displacement of each mask.
    pub mask_q: &'a [f64],
    /// Forces on unknown degrees of freedom, which keep their directions.
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
