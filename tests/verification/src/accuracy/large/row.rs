//! One figure of a followed shape beside its expected value, and the cost of the shape.

use softgrasp_core::solve::equilibrium::{Equilibrium, NoEquilibrium};

use crate::accuracy::outcome::Outcome;

/// Figure of a case, for one element on one mesh under one load.
#[derive(Clone, Debug)]
pub struct Row {
    /// Figure with its error; without a shape, no computed value and the error NaN.
    pub outcome: Outcome,
    /// Load, in the unit that the case names.
    pub load: f64,
    /// How the shape was found.
    pub end: End,
}

/// How a shape was found.
#[derive(Clone, Debug, PartialEq)]
pub enum End {
    /// The shape was prescribed at every node.
    Given,
    /// The shape was found, at this cost.
    Found(Cost),
    /// No shape was found.
    Lost {
        /// Step of the load, from 1, that had no equilibrium.
        step: usize,
        /// Number of steps of the load.
        steps: usize,
        /// Reason that the core gives.
        why: NoEquilibrium,
    },
    /// No shape was looked for, because a smaller load had none.
    NotTried,
}

/// Cost of a shape, since the shape under the load before.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// Number of steps of the load.
    pub steps: usize,
    /// Number of pieces that these steps were cut into.
    pub pieces: usize,
    /// Number of solves with a factor.
    pub solves: usize,
    /// Number of factors made.
    pub factors: usize,
    /// Norm of the forces out of balance at the end, relative to those that hold the body.
    pub residual_rel: f64,
    /// Whether a step ended far from where the tangent led.
    pub jumped: bool,
}

impl Cost {
    /// Adds the cost of a step.
    pub fn add(&mut self, found: &Equilibrium) {
        self.steps += 1;
        self.pieces += found.substeps as usize;
        self.solves += found.linear_solves as usize;
        self.factors += found.factors as usize;
        self.residual_rel = found.residual_rel;
        self.jumped |= found.jumped;
    }
}

impl End {
    /// Cost of a shape that was found.
    pub fn cost(&self) -> Option<&Cost> {
        match self {
            Self::Found(cost) => Some(cost),
            _ => None,
        }
    }

    /// Whether there is a shape.
    pub fn has_shape(&self) -> bool {
        matches!(self, Self::Given | Self::Found(_))
    }

    /// The end in words, with the reason of the core.
    pub fn words(&self) -> String {
        match self {
            Self::Given => "given".to_owned(),
            Self::Found(cost) if cost.jumped => "found, after a jump".to_owned(),
            Self::Found(_) => "found".to_owned(),
            Self::Lost { steps: 1, why, .. } => why.to_string(),
            Self::Lost { step, steps, why } => format!("step {step} of {steps}: {why}"),
            Self::NotTried => "not tried, a smaller load had no shape".to_owned(),
        }
    }
}

impl Row {
    /// Whether `other` is the same figure under the same load on another mesh.
    pub fn is_like(&self, other: &Self) -> bool {
        self.load == other.load && self.outcome.is_like(&other.outcome)
    }

    /// Order of convergence from a coarser mesh to this one.
    pub fn order_from(&self, coarser: &Self) -> f64 {
        self.outcome.order_from(&coarser.outcome)
    }
}
