//! What a displacement field strains and stresses a model to.

use super::Model;
use crate::fem::fields::{
    Fields, Materials, Recovery, states_of_averaged, states_of_tet4, states_of_tet10,
};
use crate::fem::{Element, hyperelastic::Elements};

impl Model {
    /// Strain, stress and energy by linear elasticity, with the estimate of the error if `is_judged`,
    /// in parallel, the same bits for any number of threads.
    ///
    /// Shapes: `displacement` 3 per node of the system. Units: m.
    ///
    /// # Panics
    /// If `displacement` does not hold three numbers per node of the system.
    ///
    /// Source: thesis (3.12), (3.28); Zienkiewicz and Zhu 1987 for the estimate.
    pub fn fields(&self, displacement: &[f64], is_judged: bool) -> Fields {
        assert_eq!(
            displacement.len(),
            3 * self.system_node_count(),
            "displacements do not fit the body"
        );
        let mesh = &self.mesh;
        let materials = Materials { by_region: &self.materials, regions: mesh.regions() };
        let largest = displacement.iter().fold(0.0, |most: f64, u| most.max(u.abs()));
        match (self.element, &self.quadratic) {
            (Element::Tet10, Some(quadratic)) => {
                let states = states_of_tet10(quadratic, materials, displacement);
                Recovery { mesh, states, largest }.fields(is_judged)
            }
            (Element::Tet4Anp, _) => {
                let states = states_of_averaged(mesh, materials, displacement);
                Recovery { mesh, states, largest }.fields(is_judged)
            }
            _ => {
                let states = states_of_tet4(mesh, materials, displacement);
                Recovery { mesh, states, largest }.fields(is_judged)
            }
        }
    }

    /// The same at large deformation, by the law of `elements`, which are those of this model.
    ///
    /// Shapes: `displacement` 3 per node of the system. Units: m.
    ///
    /// # Panics
    /// If `displacement` does not hold three numbers per node of the system.
    pub fn large_fields(
        &self,
        elements: &Elements,
        displacement: &[f64],
        is_judged: bool,
    ) -> Fields {
        elements.fields(&self.mesh, displacement, is_judged)
    }
}
