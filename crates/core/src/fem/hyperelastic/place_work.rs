//! How the work of forces in a virtual displacement changes when nodes have other places at rest.
//!
//! A node that moves by δX changes the volume of a point by tr D and every gradient H by −H D, with
//! `D = Σ δX_a ∇N_aᵀ`. So `P : A` of a point, A the gradient of the virtual displacement, has the derivative
//! `M ∇N_a` by the place of node a, with `M = (P : A) I − Hᵀ dP(A) − Aᵀ P`.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::Moduli;
use super::body::{Body, Shape, gradient_of, points_of};
use super::connectivity::{Averaging, Locals};
use super::material_work::{ForcesOf, averaged_changes};
use crate::fem::tet10::{QUADRATURE, shape_functions};

/// Fields whose work is meant: displacements, a virtual displacement, and what acts on each unit of mass.
///
/// Shapes: `u`, `v` 3N; `densities` one for each element, or none. Units: m, kg/m³, m/s².
#[derive(Clone, Copy)]
pub struct PlaceWork<'a> {
    /// Displacements.
    pub u: &'a [f64],
    /// The virtual displacement.
    pub v: &'a [f64],
    /// Which forces the elements have.
    pub forces: ForcesOf,
    /// Density of each element; none where there is no weight.
    pub densities: &'a [f64],
    /// Acceleration of the weight.
    pub acceleration: Vector3<f64>,
}

/// What is known of the patches of t4-anp: changes of volume by u, and by v as `F` changes.
struct Patches<'a> {
    averaging: &'a Averaging,
    changes: Vec<f64>,
    changes_by_v: Vec<f64>,
}

impl PlaceWork<'_> {
    /// Derivatives by the places of all nodes of the system; see [`super::Elements::place_work`].
    pub(super) fn of(&self, body: &Body) -> Vec<f64> {
        match &body.shape {
            Shape::Linear(locals) => self.by_points(body, locals, None),
            Shape::Quadratic(locals) => self.by_points(body, locals, None),
            Shape::Averaged(locals, averaging) => {
                let changes = averaged_changes(body, (locals, averaging), self.u, self.forces);
                let by_v = |(tet, nodes): (usize, &[u32; 4])| {
                    let gradients = body.gradients_at::<4>(tet, 0);
                    let [h, dh] =
                        [self.u, self.v].map(|field| gradient_of(nodes, &gradients, field));
                    self.forces.volume_change(&h).1.dot(&dh)
                };
                let by_v: Vec<f64> =
                    locals.tets.par_iter().enumerate().with_min_len(256).map(by_v).collect();
                let changes_by_v = averaging.average(&body.rest, &by_v);
                self.by_points(body, locals, Some(&Patches { averaging, changes, changes_by_v }))
            }
        }
    }

    fn by_points<const K: usize>(
        &self,
        body: &Body,
        locals: &Locals<K>,
        patches: Option<&Patches<'_>>,
    ) -> Vec<f64> {
        let mut parts = Vec::new();
        locals.for_each(&mut parts, |tet, parts, (): &mut ()| {
            let nodes = &locals.tets[tet];
            let mut so_far = [Vector3::zeros(); K];
            for point in 0..points_of::<K>() {
                let gradients = body.gradients_at::<K>(tet, point);
                let weight = body.rest[tet].volume * body.share_of::<K>(tet, point);
                let [h, dh] = [self.u, self.v].map(|field| gradient_of(nodes, &gradients, field));
                let mut change = self.of_stress(&body.moduli.of(tet), tet, (&h, &dh), patches);
                if let Some(density) = self.densities.get(tet) {
                    let v = virtual_at(nodes, point, self.v);
                    change -= Matrix3::from_diagonal_element(density * self.acceleration.dot(&v));
                }
                for (part, gradient) in so_far.iter_mut().zip(&gradients) {
                    *part += change * gradient * weight;
                }
            }
            *parts = so_far.map(Into::into);
        });
        locals.gather(&parts)
    }

    /// `M` of a point of an element.
    fn of_stress(
        &self,
        moduli: &Moduli,
        tet: usize,
        (h, dh): (&Matrix3<f64>, &Matrix3<f64>),
        patches: Option<&Patches<'_>>,
    ) -> Matrix3<f64> {
        let own = match patches {
            None => *moduli,
            Some(_) => moduli.without_volume(),
        };
        let stress = self.forces.stress(&own, h);
        let mut change = changed(&stress, &self.forces.stress_change(&own, h, dh), (h, dh));
        let Some(Patches { averaging, changes, changes_by_v }) = patches else { return change };
        // U′(J_a) of the corners, and U″(J_a) times the change of J_a by v.
        let (mut pressure, mut by_volume, mut by_rest) = (0.0, 0.0, 0.0);
        for &patch in &averaging.of_corners[tet] {
            let of_patch = changes[patch as usize];
            let bulk = self.forces.bulk(moduli, of_patch) * changes_by_v[patch as usize];
            pressure += 0.25 * self.forces.pressure(moduli, of_patch);
            by_volume += 0.25 * bulk;
            by_rest -= 0.25 * bulk * of_patch;
        }
        let (volume, slope) = self.forces.volume_change(h);
        let slope_by_v = match self.forces {
            ForcesOf::TheLaw => cofactor_change(&(h + Matrix3::identity()), dh),
            ForcesOf::LinearElasticity => Matrix3::zeros(),
        };
        change += changed(&slope, &slope_by_v, (h, dh)) * pressure;
        change -= h.tr_mul(&slope) * by_volume;
        change + Matrix3::from_diagonal_element(volume * by_volume + by_rest)
    }
}

/// `(P : A) I − Hᵀ dP − Aᵀ P`.
fn changed(
    stress: &Matrix3<f64>,
    stress_change: &Matrix3<f64>,
    (h, dh): (&Matrix3<f64>, &Matrix3<f64>),
) -> Matrix3<f64> {
    Matrix3::from_diagonal_element(stress.dot(dh)) - h.tr_mul(stress_change) - dh.tr_mul(stress)
}

/// Change of the cofactor matrix of `F` where that changes by `dF`.
fn cofactor_change(f: &Matrix3<f64>, df: &Matrix3<f64>) -> Matrix3<f64> {
    let column =
        |i: usize, k: usize| df.column(i).cross(&f.column(k)) + f.column(i).cross(&df.column(k));
    Matrix3::from_columns(&[column(1, 2), column(2, 0), column(0, 1)])
}

/// A field at a point of an element.
fn virtual_at<const K: usize>(nodes: &[u32; K], point: usize, v: &[f64]) -> Vector3<f64> {
    let shares = match K {
        4 => [0.25; 10],
        _ => shape_functions(QUADRATURE[point]),
    };
    let terms = nodes.iter().zip(shares);
    terms.fold(Vector3::zeros(), |sum, (&node, share)| {
        let at = 3 * node as usize;
        sum + Vector3::new(v[at], v[at + 1], v[at + 2]) * share
    })
}
