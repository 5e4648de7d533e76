//! Which way to the answer a request is given: the one asked for, or the one that fits it.

use softgrasp_core::model::Known;
use softgrasp_core::solve::Method;
use softgrasp_core::solve::memory::Way;
use softgrasp_protocol::Question;

use crate::reject::Refusal;
use crate::store::StoredModel;

/// A way to the answer, and why it was taken.
pub(crate) enum Approach {
    /// Cached columns and a small system.
    Condensed { because: String },
    /// A factor or inverse of `K11`.
    Direct { method: Method, because: String },
}

/// Name of the condensed engine on the wire.
const CONDENSED: &str = "condensed";
const ASKED: &str = "asked for";
/// Above so many touched degrees of freedom the small system is not small any more.
const TOUCHED_DOFS_MAX: usize = 600;

impl Approach {
    /// For a request that brings its own mesh: nothing can be reused, so `auto` without a wish
    /// factors once; wishes are weighed in `planned.rs`.
    pub fn for_once(question: &Question) -> Result<Self, Refusal> {
        let name = question.method.as_str();
        if !question.masks.is_empty() {
            let forces = !question.forces.is_empty();
            return for_masks(name, forces.then_some(Refusal::CondensedForces));
        }
        match name {
            CONDENSED if !question.forces.is_empty() => Err(Refusal::CondensedForces),
            CONDENSED => Ok(Self::Condensed { because: ASKED.to_owned() }),
            "auto" => Ok(Self::Direct {
                method: Method::Front,
                because: "one request: the parallel exact factor is the fastest".to_owned(),
            }),
            name => Ok(Self::Direct { method: name.parse()?, because: ASKED.to_owned() }),
        }
    }

    /// For a frame on a kept model: `auto` condenses whatever can be condensed.
    pub fn for_frame(
        question: &Question,
        stored: &StoredModel,
        known: &Known,
    ) -> Result<Self, Refusal> {
        let name = question.method.as_str();
        let has_masks = !question.masks.is_empty();
        if !is_auto(question) && name != CONDENSED && !has_masks {
            return Ok(Self::Direct { method: name.parse()?, because: ASKED.to_owned() });
        }
        let obstacle = match stored.base() {
            Err(error) => Some(Refusal::Model(error)),
            Ok(_) if !question.forces.is_empty() => Some(Refusal::CondensedForces),
            Ok(_) => moved_fixed_node(stored, known).map(|node| Refusal::FixedMoved { node }),
        };
        if has_masks {
            return for_masks(name, obstacle);
        }
        let touched = known.dofs.len() - stored.model.fixed().len().min(known.dofs.len());
        if name == "auto" && touched > TOUCHED_DOFS_MAX {
            return Ok(Self::Direct {
                method: Method::Front,
                because: format!("not condensed: {touched} degrees of freedom are held at once"),
            });
        }
        match obstacle {
            None if name == "auto" => Ok(Self::Condensed {
                because: "frames on a kept model: exact from cached columns".to_owned(),
            }),
            None => Ok(Self::Condensed { because: ASKED.to_owned() }),
            Some(refusal) if name == CONDENSED => Err(refusal),
            Some(refusal) => Ok(Self::Direct {
                method: Method::Front,
                because: format!("not condensed: {refusal}"),
            }),
        }
    }

    /// Ways that may be gone for one request, the first that fits in memory: a factor that the
    /// server chose may be one in single precision, refined.
    pub fn ways(&self, question: &Question) -> Vec<Way> {
        match *self {
            Self::Condensed { .. } => vec![Way::Condensed],
            Self::Direct { method, .. } if is_auto(question) => {
                [method, Method::FrontMixed].map(Way::Direct).to_vec()
            }
            Self::Direct { method, .. } => vec![Way::Direct(method)],
        }
    }

    /// Why it was taken.
    pub fn because(&self) -> &str {
        match self {
            Self::Condensed { because } | Self::Direct { because, .. } => because,
        }
    }
}

/// For a question with masks there is one way, or none.
fn for_masks(name: &str, obstacle: Option<Refusal>) -> Result<Approach, Refusal> {
    let because = match name {
        CONDENSED => ASKED,
        "auto" => "masks: only condensed answers them",
        // A name that does not exist is told as such.
        name => {
            let method: Method = name.parse()?;
            return Err(Refusal::MasksDirect { method: method.to_string() });
        }
    };
    match obstacle {
        None => Ok(Approach::Condensed { because: because.to_owned() }),
        Some(refusal) => Err(Refusal::MasksNotCondensed(Box::new(refusal))),
    }
}

/// Whether the choice is left to the server.
pub(crate) fn is_auto(question: &Question) -> bool {
    question.method.as_str() == "auto"
}

/// A node that the scene fixes and the question moves all the same.
fn moved_fixed_node(stored: &StoredModel, known: &Known) -> Option<u32> {
    let fixed = stored.model.fixed();
    let moved = |(dof, q): (&u32, &f64)| *q != 0.0 && fixed.binary_search(dof).is_ok();
    let mut pairs = known.dofs.iter().zip(&known.q_known);
    pairs.find(|&pair| moved(pair)).map(|(dof, _)| dof / 3)
}
