//! What forces do in a virtual displacement for each unit of the moduli: how forces depend on materials.
//!
//! Both laws are linear in their two moduli, `W = μ W_μ + m W_m` with m = κ or λ. So the derivative of the
//! forces by a modulus is the force that a body of this modulus alone would have.

use nalgebra::Matrix3;
use rayon::prelude::*;

use super::body::{Body, Shape, gradient_of, points_of};
use super::connectivity::{Averaging, Locals};
use super::deformed::cofactor;
use super::{Deformed, Law, Moduli};
use crate::fem::Material;

/// Work of the forces of one region in a virtual displacement, for each unit of its moduli.
///
/// Units: J/Pa.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ModuliWork {
    /// For each unit of the shear modulus μ.
    pub shear: f64,
    /// For each unit of κ of [`Law::NeoHookean`] or λ of [`Law::NeoHookeanLog`].
    pub volumetric: f64,
}

/// Derivatives of a quantity by the material of one region.
///
/// Units: those of the quantity per Pa, and those of the quantity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MaterialSlope {
    /// By Young's modulus.
    pub young: f64,
    /// By Poisson's ratio.
    pub poisson: f64,
}

/// Which forces do the work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ForcesOf {
    /// Those of the law at the displacement field.
    TheLaw,
    /// Those of linear elasticity: the tangent at rest times the displacement field.
    LinearElasticity,
}

impl ModuliWork {
    /// As derivatives of the work by Young's modulus and Poisson's ratio of a material.
    pub fn by_material(&self, law: Law, material: &Material) -> MaterialSlope {
        let (young, nu) = (material.young(), material.poisson());
        let (wide, narrow) = (1.0 + nu, 1.0 - 2.0 * nu);
        let (shear, shear_by_nu) = (0.5 / wide, -0.5 * young / (wide * wide));
        let (volumetric, volumetric_by_nu) = match law {
            Law::NeoHookean => (1.0 / (3.0 * narrow), 2.0 * young / (3.0 * narrow * narrow)),
            Law::NeoHookeanLog => {
                let both = wide * narrow;
                (nu / both, young * (1.0 + 2.0 * nu * nu) / (both * both))
            }
        };
        MaterialSlope {
            young: shear * self.shear + volumetric * self.volumetric,
            poisson: shear_by_nu * self.shear + volumetric_by_nu * self.volumetric,
        }
    }
}

impl ForcesOf {
    /// Stress `P` of moduli at a displacement gradient.
    ///
    /// Shapes: 3 × 3. Units: Pa.
    #[inline]
    pub(super) fn stress(self, moduli: &Moduli, h: &Matrix3<f64>) -> Matrix3<f64> {
        match self {
            Self::TheLaw => moduli.stress(&Deformed::new(h)),
            Self::LinearElasticity => self.stress_change(moduli, h, h),
        }
    }

    /// Change of the stress at a displacement gradient where that changes by `dh`.
    ///
    /// Shapes: 3 × 3. Units: Pa.
    #[inline]
    pub(super) fn stress_change(
        self,
        moduli: &Moduli,
        h: &Matrix3<f64>,
        dh: &Matrix3<f64>,
    ) -> Matrix3<f64> {
        let at = match self {
            Self::TheLaw => Deformed::new(h),
            Self::LinearElasticity => Deformed::new(&Matrix3::zeros()),
        };
        moduli.tangent(&at).apply(&at, dh)
    }

    /// Change of an element's volume over its volume at rest, and what that changes by with `F`.
    #[inline]
    pub(super) fn volume_change(self, h: &Matrix3<f64>) -> (f64, Matrix3<f64>) {
        match self {
            Self::TheLaw => (Deformed::new(h).j_minus_one, cofactor(&(h + Matrix3::identity()))),
            Self::LinearElasticity => (h.trace(), Matrix3::identity()),
        }
    }

    /// `U′` of a patch whose volume has changed by a share, Pa.
    #[inline]
    pub(super) fn pressure(self, moduli: &Moduli, change: f64) -> f64 {
        match self {
            Self::TheLaw => moduli.pressure_of_volume(change),
            Self::LinearElasticity => self.bulk(moduli, change) * change,
        }
    }

    /// `U″` of a patch whose volume has changed by a share, Pa.
    #[inline]
    pub(super) fn bulk(self, moduli: &Moduli, change: f64) -> f64 {
        match self {
            Self::TheLaw => moduli.bulk_of_volume(change),
            Self::LinearElasticity => moduli.bulk_of_volume(0.0),
        }
    }
}

/// Work of the forces of a displacement field u in a virtual displacement v, of every region; see
/// [`super::Elements::material_work`].
pub(super) fn of_regions(
    body: &Body,
    (u, v): (&[f64], &[f64]),
    forces: ForcesOf,
) -> Vec<ModuliWork> {
    let [of_shape, of_volume] = Moduli::units(body.moduli.law());
    let whole = |_: usize, h: &Matrix3<f64>, dh: &Matrix3<f64>| {
        [of_shape, of_volume].map(|unit| forces.stress(&unit, h).dot(dh))
    };
    let of_tets = match &body.shape {
        Shape::Linear(locals) => of_elements(body, locals, (u, v), whole),
        Shape::Quadratic(locals) => of_elements(body, locals, (u, v), whole),
        Shape::Averaged(locals, averaging) => {
            let changes = averaged_changes(body, (locals, averaging), u, forces);
            let averaged = |tet: usize, h: &Matrix3<f64>, dh: &Matrix3<f64>| {
                let at = averaging.of_corners[tet].map(|patch| changes[patch as usize]);
                let pressure =
                    at.iter().map(|j| 0.25 * forces.pressure(&of_volume, *j)).sum::<f64>();
                let shape = of_shape.without_volume();
                [forces.stress(&shape, h).dot(dh), pressure * forces.volume_change(h).1.dot(dh)]
            };
            of_elements(body, locals, (u, v), averaged)
        }
    };
    let mut sums = vec![ModuliWork::default(); body.moduli.len()];
    for (tet, [shear, volumetric]) in of_tets.into_iter().enumerate() {
        if let Some(sum) = sums.get_mut(body.moduli.region_of(tet)) {
            sum.shear += shear;
            sum.volumetric += volumetric;
        }
    }
    sums
}

/// Change of the volume of every patch over its volume at rest.
pub(super) fn averaged_changes(
    body: &Body,
    (locals, averaging): (&Locals<4>, &Averaging),
    u: &[f64],
    forces: ForcesOf,
) -> Vec<f64> {
    let of_tet = |(tet, nodes): (usize, &[u32; 4])| {
        forces.volume_change(&gradient_of(nodes, &body.gradients_at::<4>(tet, 0), u)).0
    };
    let of_tets: Vec<f64> =
        locals.tets.par_iter().enumerate().with_min_len(256).map(of_tet).collect();
    averaging.average(&body.rest, &of_tets)
}

/// `Σ weight × work` over the points of every element; `work(element, ∇u, ∇v)`.
fn of_elements<const K: usize>(
    body: &Body,
    locals: &Locals<K>,
    (u, v): (&[f64], &[f64]),
    work: impl Fn(usize, &Matrix3<f64>, &Matrix3<f64>) -> [f64; 2] + Sync,
) -> Vec<[f64; 2]> {
    let of_tet = |(tet, nodes): (usize, &[u32; K])| {
        let mut sums = [0.0; 2];
        for point in 0..points_of::<K>() {
            let gradients = body.gradients_at::<K>(tet, point);
            let weight = body.rest[tet].volume * body.share_of::<K>(tet, point);
            let [h, dh] = [u, v].map(|field| gradient_of(nodes, &gradients, field));
            let of_point = work(tet, &h, &dh);
            sums.iter_mut().zip(of_point).for_each(|(sum, work)| *sum += weight * work);
        }
        sums
    };
    locals.tets.par_iter().enumerate().with_min_len(256).map(of_tet).collect()
}
