//! The answer of a contact set, of a body that loads act on or of one that only its contacts move.

use std::sync::Arc;

use softgrasp_core::solve::condensed::{
    Base, Certificate, CondensedError, ContactAnswer, ContactSet, Delivery, LoadedAnswer, LoadedSet,
};

use crate::store::Asked;

/// Small system of a set of contacts with the loads of its question, and whether it was kept from an earlier
/// frame question.
pub(super) struct PreparedSet {
    pub set: Arc<ContactSet>,
    /// The same with loads, if some act.
    pub loaded: Option<Arc<LoadedSet>>,
    pub is_kept: bool,
}

/// Forces and motions that answer one question.
pub(super) enum Solved {
    /// By the contacts alone.
    Bare(ContactAnswer),
    /// With loads, and their set.
    Loaded(Arc<LoadedSet>, LoadedAnswer),
}

impl PreparedSet {
    /// Numbers multiplied for one answer at the wanted nodes.
    pub fn products(&self) -> usize {
        match &self.loaded {
            None => self.set.products(),
            Some(loaded) => loaded.products(),
        }
    }

    /// Forces and motions of a question.
    ///
    /// # Errors
    /// [`CondensedError`] where the contacts hold the body too weakly.
    pub fn solve(&self, asked: &Asked) -> Result<Solved, CondensedError> {
        match (&self.loaded, &asked.loads) {
            (Some(loaded), Some(loads)) => {
                let answer = loaded.solve(&asked.q, &loads.amounts)?;
                Ok(Solved::Loaded(Arc::clone(loaded), answer))
            }
            _ => self.set.solve(&asked.q).map(Solved::Bare),
        }
    }
}

impl Solved {
    /// Forces of the contacts, N.
    pub fn lambda(&self) -> &[f64] {
        match self {
            Self::Bare(answer) => &answer.lambda,
            Self::Loaded(_, answer) => &answer.contact.lambda,
        }
    }

    /// Displacements at the wanted nodes, m.
    pub fn wanted_displacements(&self, set: &ContactSet) -> Vec<[f64; 3]> {
        match self {
            Self::Bare(answer) => set.wanted_displacements(answer),
            Self::Loaded(loaded, answer) => loaded.wanted_displacements(answer),
        }
    }

    /// Displacement of every degree of freedom, m.
    pub fn full_displacement(&self, base: &Base, set: &ContactSet) -> Vec<f64> {
        match self {
            Self::Bare(answer) => set.full_displacement(base, answer),
            Self::Loaded(loaded, answer) => loaded.full_displacement(base, answer),
        }
    }

    /// How wrong the answer can be.
    pub fn certify(
        &self,
        (base, set): (&Base, &ContactSet),
        q: &[f64],
        delivered: &[[f64; 3]],
        delivery: Delivery,
    ) -> Certificate {
        match self {
            Self::Bare(answer) => set.certify(base, q, answer, delivered, delivery),
            Self::Loaded(loaded, answer) => loaded.certify(base, q, answer, delivered, delivery),
        }
    }

    /// Takes the loads out of forces of every degree of freedom: what is left is that of supports, N.
    pub fn subtract_loads(&self, forces: &mut [f64]) {
        if let Self::Loaded(loaded, answer) = self {
            loaded.subtract_loads(&answer.amounts, forces);
        }
    }
}
