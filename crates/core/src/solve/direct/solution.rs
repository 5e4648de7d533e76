//! Load cases of a partition, and the displacements and reactions that they cause.

use std::fmt;

use super::error::SolveError;
use crate::fem::Stiffness;
use crate::solve::k11::right_hand_side;
use crate::solve::{Method, Partition};

/// One load case: prescribed displacements (Dirichlet values) and external forces.
///
/// Shapes: `q_known` one per known degree of freedom of the partition, in its order; `forces`
/// empty or 3N. Units: m, N.
#[derive(Clone, Copy, Debug, Default)]
pub struct Loads<'a> {
    /// Prescribed displacements (Dirichlet values) `Q_k`.
    pub q_known: &'a [f64],
    /// `f` of (3.7). What acts on a known degree of freedom moves nothing: its support carries it.
    pub forces: &'a [f64],
    /// Relative residual and estimated relative error that are good enough, both, for a method that
    /// can stop early ([`Method::Pcg`](crate::solve::Method::Pcg)); zero asks for all there is.
    pub residual_rel: f64,
}

/// Why a factor in single precision did not do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fallback {
    /// A pivot of the factor was not positive in single precision.
    NoFactor,
    /// Refinement with the factor came to a halt before the answer was right.
    Stalled,
}

impl fmt::Display for Fallback {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let why = match self {
            Self::NoFactor => "single precision finds no factor",
            Self::Stalled => "refinement with a single-precision factor comes to a halt",
        };
        write!(f, "{why}, so double precision was taken")
    }
}

/// Displacements, reactions and how exact they are.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// Displacement of every degree of freedom, 3N, m; zero at orphan nodes.
    pub displacement: Vec<f64>,
    /// Reaction `F_u` (3.43b) of every known degree of freedom, in the partition's order, N: the force of
    /// its support.
    pub reaction: Vec<f64>,
    /// `‖K11 Q_u − b‖₂ / ‖b‖₂`, zero when `b` is.
    pub residual_rel: f64,
    /// Componentwise backward error of the free rows: see [`certainty`](super::Factored::certainty).
    pub backward_error: f64,
    /// Estimate of `‖error‖ / ‖Q_u‖` where a method stops by it, as `Method::Pcg` does; no bound.
    pub error_estimate_rel: Option<f64>,
    /// Refinement steps taken.
    pub refinement_steps: u32,
    /// Why double precision answered where single had been asked for, if it did.
    pub fallback: Option<Fallback>,
}

/// `K11` of one partition, and what its answers are told with.
#[derive(Clone, Copy)]
pub(super) struct System<'a> {
    pub stiffness: &'a Stiffness,
    pub partition: &'a Partition,
    pub method: Method,
    pub fallback: Option<Fallback>,
}

impl System<'_> {
    /// Whether a load case fits the partition.
    pub fn check(self, loads: Loads<'_>) -> Result<(), SolveError> {
        let expected = self.partition.known().len();
        if loads.q_known.len() != expected {
            let given = loads.q_known.len();
            return Err(SolveError::LoadCount { what: "known displacements", given, expected });
        }
        let expected = self.partition.dof_count();
        if !loads.forces.is_empty() && loads.forces.len() != expected {
            let given = loads.forces.len();
            return Err(SolveError::LoadCount { what: "external forces", given, expected });
        }
        Ok(())
    }

    /// Right-hand side of (3.42a), n.
    pub fn right_hand_side(self, loads: Loads<'_>) -> Vec<f64> {
        right_hand_side(self.stiffness, self.partition, loads.q_known, loads.forces)
    }

    /// Sets the prescribed displacements in a field of 3N.
    pub fn prescribe(self, loads: Loads<'_>, q: &mut [f64]) {
        for (&dof, &value) in self.partition.known().iter().zip(loads.q_known) {
            q[dof as usize] = value;
        }
    }

    /// The field of 3N with the prescribed displacements alone.
    pub fn prescribed(self, loads: Loads<'_>) -> Vec<f64> {
        let mut q = vec![0.0; self.partition.dof_count()];
        self.prescribe(loads, &mut q);
        q
    }

    /// `K11 x`, through the whole stiffness with zeros at the known degrees of freedom.
    pub fn apply_k11(self, x: &[f64]) -> Vec<f64> {
        let mut q = vec![0.0; self.partition.dof_count()];
        self.partition.scatter_unknown(x, &mut q);
        let f = self.stiffness.mul(&q);
        self.partition.unknown().iter().map(|&dof| f[dof as usize]).collect()
    }

    /// Refuses displacements that are not finite numbers.
    pub fn check_finite(self, q: &[f64]) -> Result<(), SolveError> {
        match q.iter().all(|x| x.is_finite()) {
            true => Ok(()),
            false => Err(SolveError::NotFinite { method: self.method }),
        }
    }

    /// Reactions (3.43b) at the known degrees of freedom: what the supports give beside the loads.
    pub fn reactions(self, q: &[f64], forces: &[f64]) -> Vec<f64> {
        let f = self.stiffness.mul(q);
        let external = |dof: usize| forces.get(dof).copied().unwrap_or(0.0);
        self.partition.known().iter().map(|&dof| f[dof as usize] - external(dof as usize)).collect()
    }
}
