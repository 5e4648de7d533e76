//! The state of every element at large deformation: Green's strain, Cauchy's stress, stored energy.

use nalgebra::Matrix3;
use rayon::prelude::*;

use super::averaged_volume::AveragedVolume;
use super::body::{Body, Shape, gradient_of, points_of};
use super::connectivity::Locals;
use super::yielding::{Plastic, Yielding};
use super::{Deformed, Moduli};
use crate::fem::fields::{
    ElementState, Fields, Recovery, Tensor, at_corners, steepest_of, tensor_of, with_pressure,
};
use crate::mesh::TetMesh;

/// Strain, stress and energy at one point of an element.
struct PointState {
    strain: Tensor,
    stress: Tensor,
    /// Energy for each unit of volume at rest, J/m³.
    density: f64,
}

/// A body whose state is asked for, and how far its elements have yielded.
pub(super) struct States<'a> {
    pub body: &'a Body,
    pub plastic: Option<&'a Plastic>,
}

impl States<'_> {
    /// Strain, stress and energy of a displacement field by the law of the elements, with the estimate
    /// of the error if `is_judged`.
    ///
    /// Shapes: `u` 3N. Units: m.
    pub fn fields(&self, mesh: &TetMesh, u: &[f64], is_judged: bool) -> Fields {
        let largest = u.iter().fold(0.0, |most: f64, u| most.max(u.abs()));
        match &self.body.shape {
            Shape::Linear(locals) => {
                let states = self.states(|tet| self.state_of_one_point(locals, tet, u));
                Recovery { mesh, states, largest }.fields(is_judged)
            }
            Shape::Averaged(locals, averaging) => {
                let volumes = AveragedVolume::new(self.body, (locals, averaging), u);
                let states = self.states(|tet| self.averaged_state(locals, &volumes, tet, u));
                Recovery { mesh, states, largest }.fields(is_judged)
            }
            Shape::Quadratic(locals) => {
                let states = self.states(|tet| self.state_of_four_points(locals, tet, u));
                Recovery { mesh, states, largest }.fields(is_judged)
            }
        }
    }

    fn states<const C: usize>(
        &self,
        state: impl Fn(usize) -> ElementState<C> + Sync + Send,
    ) -> Vec<ElementState<C>> {
        (0..self.body.rest.len()).into_par_iter().with_min_len(256).map(state).collect()
    }

    fn state_of_one_point(&self, locals: &Locals<4>, tet: usize, u: &[f64]) -> ElementState<1> {
        let rest = &self.body.rest[tet];
        let h = gradient_of(&locals.tets[tet], &self.body.gradients_at::<4>(tet, 0), u);
        let point = self.point_state(tet, points_of::<4>() * tet, &h);
        ElementState {
            strain: [point.strain],
            stress: [point.stress],
            energy: rest.volume * point.density,
            volume: rest.volume,
            moduli: self.body.moduli.of(tet).at_small_strain(),
            steepest: steepest_of(rest),
        }
    }

    fn state_of_four_points(&self, locals: &Locals<10>, tet: usize, u: &[f64]) -> ElementState<4> {
        let rest = &self.body.rest[tet];
        let points: [PointState; 4] = std::array::from_fn(|point| {
            let h = gradient_of(&locals.tets[tet], &self.body.gradients_at::<10>(tet, point), u);
            self.point_state(tet, points_of::<10>() * tet + point, &h)
        });
        let density = |point: usize| self.body.share_of::<10>(tet, point) * points[point].density;
        let density = (0..points.len()).map(density).sum::<f64>();
        ElementState {
            strain: at_corners(std::array::from_fn(|i| points[i].strain)),
            stress: at_corners(std::array::from_fn(|i| points[i].stress)),
            energy: rest.volume * density,
            volume: rest.volume,
            moduli: self.body.moduli.of(tet).at_small_strain(),
            steepest: steepest_of(rest),
        }
    }

    /// The element's own stress, and at each corner the pressure `U′(J_a)` of its patch.
    fn averaged_state(
        &self,
        locals: &Locals<4>,
        volumes: &AveragedVolume<'_>,
        tet: usize,
        u: &[f64],
    ) -> ElementState<4> {
        let (rest, moduli) = (&self.body.rest[tet], self.body.moduli.of(tet));
        let h = gradient_of(&locals.tets[tet], &self.body.gradients_at::<4>(tet, 0), u);
        let own = elastic_state(&moduli.without_volume(), &Deformed::new(&h));
        let changes = volumes.changes_at_corners(tet);
        let of_volume = changes.iter().map(|&change| 0.25 * moduli.energy_of_volume(change));
        ElementState {
            strain: [own.strain; 4],
            stress: changes
                .map(|change| with_pressure(own.stress, moduli.pressure_of_volume(change))),
            energy: rest.volume * (own.density + of_volume.sum::<f64>()),
            volume: rest.volume,
            moduli: moduli.at_small_strain(),
            steepest: steepest_of(rest),
        }
    }

    /// State at a point, of all points the one numbered `place`.
    fn point_state(&self, tet: usize, place: usize, h: &Matrix3<f64>) -> PointState {
        let (moduli, deformed) = (self.body.moduli.of(tet), Deformed::new(h));
        let yielding = self.plastic.map(|plastic| Yielding { body: self.body, plastic });
        let yielded = yielding.as_ref().and_then(|yielding| {
            Some(yielding.trial(place, &deformed)?.potential_and_stress(yielding.hencky(tet)))
        });
        match yielded {
            Some((density, piola)) => PointState { density, ..cauchy(&deformed, &piola) },
            None => elastic_state(&moduli, &deformed),
        }
    }
}

fn elastic_state(moduli: &Moduli, deformed: &Deformed) -> PointState {
    PointState { density: moduli.energy(deformed), ..cauchy(deformed, &moduli.stress(deformed)) }
}

/// Green's strain, and Cauchy's stress `σ = P Fᵀ / J` from the first Piola–Kirchhoff one.
fn cauchy(deformed: &Deformed, piola: &Matrix3<f64>) -> PointState {
    let stress = piola * deformed.f.transpose() / deformed.j;
    PointState { strain: tensor_of(&deformed.green), stress: tensor_of(&stress), density: 0.0 }
}
