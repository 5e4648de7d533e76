//! What a model gives to equilibria at large deformation: its elements with a law, and its holds.

use super::{Model, ModelError};
use crate::contact::Mask;
use crate::fem::hyperelastic::{Elements, Law};
use crate::solve::Partition;
use crate::solve::equilibrium::{Hold, HoldOf};

impl Model {
    /// The elements of the model with a law for large deformation; they take the moduli from the
    /// materials of the model.
    ///
    /// # Errors
    /// None that making the model did not have.
    pub fn hyperelastic(&self, law: Law) -> Result<Elements, ModelError> {
        let quadratic = self.quadratic.as_ref();
        Ok(Elements::try_new(&self.mesh, self.element, quadratic, law, &self.materials)?)
    }

    /// Hyperelastic elements with a yield stress above which they flow and stay deformed, if there is one.
    ///
    /// Units: Pa.
    ///
    /// # Errors
    /// [`ModelError::Yield`] for a stress that is none, and for elements that cannot.
    pub fn yielding(&self, law: Law, yield_stress: Option<f64>) -> Result<Elements, ModelError> {
        let elements = self.hyperelastic(law)?;
        Ok(match yield_stress {
            Some(stress) => elements.with_yield(stress)?,
            None => elements,
        })
    }

    /// Largest Poisson's ratio of its materials.
    pub fn poisson_max(&self) -> f64 {
        self.materials.iter().map(crate::fem::Material::poisson).fold(-1.0, f64::max)
    }

    /// Known degrees of freedom and masks as a hold for equilibria; `before` lends its order if it
    /// is by the same degrees of freedom.
    ///
    /// Shapes: `dofs` ascending, fixed ones among them; `masks` of this model.
    ///
    /// # Errors
    /// [`ModelError::Partition`], [`ModelError::Free`], [`ModelError::Dependent`].
    pub fn hold(
        &self,
        dofs: &[u32],
        masks: Vec<Mask>,
        before: Option<&Hold>,
    ) -> Result<Hold, ModelError> {
        self.check_held(dofs, &masks)?;
        let partition = Partition::try_new(&self.used, dofs)?;
        let Self { mesh, bodies, rigid, stiffness, .. } = self;
        let body = HoldOf { mesh, bodies, rigid, stiffness };
        Ok(Hold::try_new(body, partition, masks, before)?)
    }
}
