//! All elements of a body: their energy, forces and tangent at any displacement field.

use std::sync::Arc;

use super::averaged_volume::AveragedVolume;
use super::body::{Body, Evaluated, Shape};
use super::groups::Groups;
use super::law::ModuliPart;
use super::material_work::{self, ForcesOf, ModuliWork};
use super::place_work::PlaceWork;
use super::principal::Curvature;
use super::states::States;
use super::summary::{LargeSummary, gradient_change_max};
use super::yielding::{Plastic, YieldError, Yielding};
use super::{Law, step_limit, tangent};
use crate::fem::fields::Fields;
use crate::fem::{AssemblyError, Element, Material, QuadraticMesh, Stiffness, StiffnessPattern};
use crate::mesh::TetMesh;

/// Elements of a body: shape at rest, law, moduli, and the plastic state where they yield.
///
/// Shapes: M elements, N nodes of the system (mid-edge nodes that were made behind the corners). Units: m, Pa.
#[derive(Clone, Debug)]
pub struct Elements {
    /// What no step changes, shared by copies.
    pub(super) body: Arc<Body>,
    /// `None` where the elements have no yield stress.
    pub(super) plastic: Option<Plastic>,
}

impl Elements {
    /// Elements of a mesh with a law and materials.
    ///
    /// Shapes: `materials` one for the whole mesh, or one per region label; `quadratic` the mesh
    /// with mid-edge nodes for [`Element::Tet10`].
    ///
    /// # Errors
    /// [`AssemblyError::NoMaterial`] if a region label has no material.
    pub fn try_new(
        mesh: &TetMesh,
        element: Element,
        quadratic: Option<&QuadraticMesh>,
        law: Law,
        materials: &[Material],
    ) -> Result<Self, AssemblyError> {
        let body = Body::try_new(mesh, element, quadratic, law, materials)?;
        Ok(Self { body: Arc::new(body), plastic: None })
    }

    /// These elements with a yield stress, without plastic strain at first. Their elasticity is
    /// Hencky's then, with the moduli of the materials, whatever the law was:
    /// `W = μ dev e : dev e + κ/2 (tr e)²`, e the logarithmic strain of `Fe` in `F = Fe Fp`. They
    /// flow where von Mises' stress `√(3/2) ‖dev τ‖` of Kirchhoff's stress τ would exceed the yield
    /// stress (no hardening).
    ///
    /// [`Elements::evaluate`] answers with the potential of a step from the last
    /// [`Elements::commit`]: energy stored and what the step dissipates.
    ///
    /// Units: Pa.
    ///
    /// # Errors
    /// [`YieldError::Stress`] if it is not a finite number above 0, [`YieldError::Averaged`] for
    /// t4-anp.
    ///
    /// Source: Simo, CMAME 99 (1992) 61.
    pub fn with_yield(self, stress_pa: f64) -> Result<Self, YieldError> {
        let plastic = Some(Plastic::try_new(&self.body, stress_pa)?);
        Ok(Self { plastic, ..self })
    }

    /// Nodes of the system.
    pub fn node_count(&self) -> usize {
        self.body.node_count
    }

    /// Largest Poisson's ratio of the moduli.
    pub fn poisson_max(&self) -> f64 {
        self.body.moduli.poisson_max()
    }

    /// Bytes that it holds in memory.
    pub fn bytes(&self) -> usize {
        self.body.bytes() + self.plastic.as_ref().map_or(0, Plastic::bytes)
    }

    /// Whether the elements have a yield stress.
    pub fn is_plastic(&self) -> bool {
        self.plastic.is_some()
    }

    /// Yield stress, Pa; `None` where the elements have none.
    pub fn yield_stress(&self) -> Option<f64> {
        self.plastic.as_ref().map(Plastic::yield_stress)
    }

    /// Largest accumulated plastic strain of a point, `Σ √(2/3) ‖dev e‖` of what flowed; 0 without a
    /// yield stress.
    pub fn plastic_strain_max(&self) -> f64 {
        self.plastic.as_ref().map_or(0.0, Plastic::strain_max)
    }

    /// Makes the plastic flow of a shape permanent, in parallel, the same bits for any number of
    /// threads. Without a yield stress it does nothing.
    ///
    /// Shapes: `u` 3N. Units: m.
    ///
    /// # Panics
    /// If `u` does not hold 3N numbers.
    pub fn commit(&mut self, u: &[f64]) {
        self.check(u);
        if let Some(plastic) = &mut self.plastic {
            plastic.commit(&self.body, u);
        }
    }

    /// Strain, stress and energy of a displacement field by the law of the elements, with the estimate
    /// of the error if `is_judged`. Where elements yield, the strain is the whole one and the energy
    /// what can be had back.
    ///
    /// Shapes: `mesh` the one the elements were made of; `u` 3N, mid-edge nodes included. Units: m.
    ///
    /// # Panics
    /// If `u` does not hold 3N numbers.
    pub fn fields(&self, mesh: &TetMesh, u: &[f64], is_judged: bool) -> Fields {
        self.check(u);
        let states = States { body: &self.body, plastic: self.plastic.as_ref() };
        states.fields(mesh, u, is_judged)
    }

    fn check(&self, u: &[f64]) {
        assert_eq!(u.len(), 3 * self.node_count(), "displacements do not fit the body");
    }

    fn yielding<'a>(&'a self, plastic: &'a Plastic) -> Yielding<'a> {
        Yielding { body: &self.body, plastic }
    }

    /// Energy and forces of a displacement field, in parallel, the same bits for any number of
    /// threads.
    ///
    /// Shapes: `u` 3N. Units: m.
    ///
    /// # Panics
    /// If `u` does not hold 3N numbers.
    pub fn evaluate(&self, u: &[f64]) -> Evaluated {
        self.check(u);
        if let Some(plastic) = &self.plastic {
            return self.yielding(plastic).evaluate(u);
        }
        let body = &self.body;
        match &body.shape {
            Shape::Linear(locals) => Groups { body, locals }.evaluate(u, ModuliPart::Whole),
            Shape::Quadratic(locals) => body.evaluate_points(locals, u, ModuliPart::Whole),
            Shape::Averaged(locals, averaging) => {
                let mut evaluated = Groups { body, locals }.evaluate(u, ModuliPart::WithoutVolume);
                AveragedVolume::new(body, (locals, averaging), u).add_to(&mut evaluated);
                evaluated
            }
        }
    }

    /// The tangent stiffness of a displacement field, on the pattern of the linear one.
    ///
    /// Shapes: `u` 3N; `pattern` that of the element ([`StiffnessPattern`]). Units: m, N/m.
    ///
    /// # Panics
    /// If pattern or displacements are those of another body.
    pub fn tangent(
        &self,
        pattern: &Arc<StiffnessPattern>,
        u: &[f64],
        curvature: Curvature,
    ) -> Stiffness {
        self.check(u);
        let yielding = self.plastic.as_ref().map(|plastic| self.yielding(plastic));
        tangent::assembled(&self.body, yielding.as_ref(), pattern, u, curvature)
    }

    /// The tangent times a vector, without assembling it.
    ///
    /// Shapes: `u`, `v` and the result 3N. Units: m, N.
    ///
    /// # Panics
    /// If the vectors do not hold 3N numbers.
    pub fn tangent_times(&self, u: &[f64], v: &[f64]) -> Vec<f64> {
        self.check(v);
        match &self.plastic {
            Some(plastic) => self.yielding(plastic).tangent_times(u, v),
            None => tangent::times(&self.body, u, v),
        }
    }

    /// The law of the elements; where they yield it is not that of their stress.
    pub fn law(&self) -> Law {
        self.body.moduli.law()
    }

    /// Work `vᵀ f(u)` of the forces of every region for each unit of its moduli, in parallel, the same bits
    /// for any number of threads: the forces are linear in the moduli. Plastic flow is not in it.
    ///
    /// Shapes: `u`, `v` 3N; result one for each material. Units: m.
    ///
    /// # Panics
    /// If the vectors do not hold 3N numbers.
    pub fn material_work(&self, u: &[f64], v: &[f64], forces: ForcesOf) -> Vec<ModuliWork> {
        self.check(u);
        self.check(v);
        material_work::of_regions(&self.body, (u, v), forces)
    }

    /// Derivative of the work `vᵀ (f(u) − weight)` by the place of every node of the system at rest, in
    /// parallel, the same bits for any number of threads. Plastic flow is not in it.
    ///
    /// Shapes: result 3N. Units: N for a virtual displacement in m.
    ///
    /// # Panics
    /// If the vectors do not hold 3N numbers.
    pub fn place_work(&self, work: PlaceWork<'_>) -> Vec<f64> {
        self.check(work.u);
        self.check(work.v);
        work.of(&self.body)
    }

    /// Largest share, at most 1, of a step that leaves every element its volume: 0.9 of the smallest
    /// positive root of any element's cubic `det(F + t dF)`, or 1.
    ///
    /// Shapes: `u`, `step` 3N. Units: m. Every element of `u` must have volume.
    ///
    /// Source: as in incremental potential contact (Li and others 2020), filtering of line search.
    pub fn step_limit(&self, u: &[f64], step: &[f64]) -> f64 {
        let body = &self.body;
        match &body.shape {
            Shape::Linear(locals) | Shape::Averaged(locals, _) => {
                Groups { body, locals }.step_limit(u, step)
            }
            Shape::Quadratic(locals) => step_limit::one_by_one(body, locals, u, step),
        }
    }

    /// Largest change of a deformation gradient (Frobenius norm) that a step makes.
    ///
    /// Shapes: `step` 3N. Units: m; result 1.
    pub fn gradient_change_max(&self, step: &[f64]) -> f64 {
        let body = &self.body;
        match &body.shape {
            Shape::Linear(locals) | Shape::Averaged(locals, _) => {
                Groups { body, locals }.gradient_change_max(step)
            }
            Shape::Quadratic(_) => gradient_change_max(body, step),
        }
    }

    /// Largest rotation and stretches of a displacement field, in parallel.
    ///
    /// Shapes: `u` 3N. Units: m.
    pub fn summary(&self, u: &[f64]) -> LargeSummary {
        LargeSummary::of(&self.body, u)
    }
}

#[cfg(test)]
mod tests;
