//! What the averaged change of volume does to a body: its pressure, forces and energy.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::Deformed;
use super::averaged::{Averaging, NodalVolumes};
use super::deformed::cofactor;
use super::elements::{Elements, Evaluated, gradient_of, gradients_at};
use super::locals::Locals;

impl Elements {
    /// `U′(J_a)` averaged over the corners of an element, Pa.
    pub(super) fn averaged_pressure(
        &self,
        averaging: &Averaging,
        volumes: &NodalVolumes,
        tet: usize,
    ) -> f64 {
        let moduli = self.moduli.of(tet);
        let of_patch = |&p: &u32| moduli.pressure_of_volume(volumes.j_minus_one[p as usize]);
        0.25 * averaging.of_corners[tet].iter().map(of_patch).sum::<f64>()
    }

    /// `J_e − 1` of every element.
    pub(super) fn volume_changes(&self, locals: &Locals<4>, u: &[f64]) -> Vec<f64> {
        let tets = locals.tets.par_iter().zip(&self.rest).with_min_len(256);
        tets.map(|(nodes, rest)| {
            let h = gradient_of(nodes, &gradients_at::<4>(rest, 0), u);
            Deformed::new(&h).j_minus_one
        })
        .collect()
    }

    /// Adds energy and forces of the averaged change of volume.
    pub(super) fn add_averaged(
        &self,
        evaluated: &mut Evaluated,
        (locals, averaging): (&Locals<4>, &Averaging),
        u: &[f64],
    ) {
        let of_tets = self.volume_changes(locals, u);
        let volumes = averaging.average(&self.rest, &of_tets);
        let mut forces = Vec::new();
        locals.for_each(&mut forces, |tet, forces, (): &mut ()| {
            let pressure = self.averaged_pressure(averaging, &volumes, tet);
            let slopes = volume_slopes(self, locals, u, tet);
            *forces = slopes.map(|slope| (slope * pressure).into());
        });
        let sums = locals.gather(&forces);
        evaluated.forces.iter_mut().zip(sums).for_each(|(f, sum)| *f += sum);
        let energy = |patch: usize| {
            let moduli = self.moduli.of(averaging.tets(patch)[0] as usize);
            averaging.volume(patch) * moduli.energy_of_volume(volumes.j_minus_one[patch])
        };
        evaluated.energy += (0..averaging.len()).map(energy).sum::<f64>();
    }
}

/// `∂v_e/∂u` of the four corners of an element: `V_e cof(F) ∇N_a`, m².
#[inline]
pub(super) fn volume_slopes(
    elements: &Elements,
    locals: &Locals<4>,
    u: &[f64],
    tet: usize,
) -> [Vector3<f64>; 4] {
    let rest = &elements.rest[tet];
    let gradients = gradients_at::<4>(rest, 0);
    let f = gradient_of(&locals.tets[tet], &gradients, u) + nalgebra::Matrix3::identity();
    let cofactor = cofactor(&f) * rest.volume;
    gradients.map(|gradient| cofactor * gradient)
}
