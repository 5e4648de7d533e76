//! One figure of a followed shape beside what it should be, and what the shape cost.

use softgrasp_core::solve::equilibrium::{Equilibrium, NoEquilibrium};

use crate::accuracy::outcome::Outcome;

/// A figure of a case for one element on one mesh under one load.
#[derive(Clone, Debug)]
pub struct Row {
    /// The figure; where there is no shape, nothing computed and an error that is no number.
    pub outcome: Outcome,
    /// The load, in the unit that the case names.
    pub load: f64,
    /// How the shape was come to.
    pub end: End,
}

/// How a shape was come to.
#[derive(Clone, Debug, PartialEq)]
pub enum End {
    /// It was given at every node, so nothing was looked for.
    Given,
    /// Found, at this cost.
    Found(Cost),
    /// Not found.
    Lost {
        /// Step of the load, from 1, that had no shape.
        step: usize,
        /// Steps of the load.
        steps: usize,
        /// What the engine says.
        why: NoEquilibrium,
    },
    /// Not looked for, because a smaller load had no shape.
    NotTried,
}

/// What a shape cost, since the shape under the load before.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// Steps of the load.
    pub steps: usize,
    /// Pieces that these were cut into.
    pub pieces: usize,
    /// Solves with a factor.
    pub solves: usize,
    /// Factors made.
    pub factors: usize,
    /// Forces out of balance in the end, over those that hold the body.
    pub residual_rel: f64,
    /// Whether a step ended far from where the tangent led.
    pub jumped: bool,
}

impl Cost {
    /// Adds what a step cost.
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
    /// The cost of a shape that was found.
    pub fn cost(&self) -> Option<&Cost> {
        match self {
            Self::Found(cost) => Some(cost),
            _ => None,
        }
    }

    /// Whether there is a shape to look at.
    pub fn has_shape(&self) -> bool {
        matches!(self, Self::Given | Self::Found(_))
    }

    /// In words, with the sentence of the engine.
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
    /// Whether the other is the same figure under the same load on another mesh.
    pub fn is_like(&self, other: &Self) -> bool {
        self.load == other.load && self.outcome.is_like(&other.outcome)
    }

    /// The order of convergence from a coarser mesh to this one.
    pub fn order_from(&self, coarser: &Self) -> f64 {
        self.outcome.order_from(&coarser.outcome)
    }
}
