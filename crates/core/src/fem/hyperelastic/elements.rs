//! All elements of a body at rest, and what they answer to a displacement field.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::averaged::Averaging;
use super::law::ModuliPart;
use super::locals::{ELEMENTS_TOGETHER, Locals};
use super::plastic::{Plastic, PlasticPoint};
use super::{Deformed, Law, Moduli};
use crate::fem::tet4::{self, Gradients};
use crate::fem::{AssemblyError, Element, LameByRegion, Material, QuadraticMesh, dof, tet10};
use crate::mesh::TetMesh;

/// Elements of a body: shape at rest, law and moduli.
///
/// Shapes: M elements, N nodes of the system (mid-edge nodes behind the corners). Units: m, Pa.
#[derive(Clone, Debug)]
pub struct Elements {
    pub(super) shape: Shape,
    /// Gradients of the linear shape functions at rest, and the volume.
    pub(super) rest: Vec<Gradients>,
    pub(super) moduli: ModuliOf,
    pub(super) node_count: usize,
    /// Where the elements yield.
    pub(super) plastic: Option<Plastic>,
}

/// Nodes of the elements, by the kind of element.
#[derive(Clone, Debug)]
pub(super) enum Shape {
    /// Four nodes, one point.
    Linear(Locals<4>),
    /// Four nodes, one point, the volume ratio averaged around nodes.
    Averaged(Locals<4>, Averaging),
    /// Ten nodes, four points.
    Quadratic(Locals<10>),
}

/// Moduli of every element.
#[derive(Clone, Debug)]
pub(super) struct ModuliOf {
    by_region: Vec<Moduli>,
    /// Empty where one serves all.
    regions: Vec<u32>,
}

impl ModuliOf {
    /// Whether all elements have the same.
    #[inline]
    pub fn is_one(&self) -> bool {
        self.by_region.len() == 1
    }

    /// Those of one element.
    #[inline]
    pub fn of(&self, tet: usize) -> Moduli {
        match self.by_region.as_slice() {
            [only] => *only,
            several => several[self.regions.get(tet).map_or(0, |&r| r as usize)],
        }
    }
}

/// What a body answers to a displacement field.
#[derive(Clone, Debug)]
pub struct Evaluated {
    /// Stored energy, and what a step dissipates where elements yield, J; infinite if an element
    /// is inside out.
    pub energy: f64,
    /// Forces that hold the field, `∂W/∂u`, 3N, N; of no meaning where the energy is infinite.
    pub forces: Vec<f64>,
    /// Smallest volume ratio of an element at its points.
    pub jacobian_min: f64,
}

/// What one piece of the elements adds up.
#[derive(Clone, Copy)]
pub(super) struct PieceSum {
    energy: f64,
    jacobian_min: f64,
}

impl Default for PieceSum {
    fn default() -> Self {
        Self { energy: 0.0, jacobian_min: f64::INFINITY }
    }
}

impl PieceSum {
    pub fn see(&mut self, energy: f64, j: f64) {
        self.energy += energy;
        // A NaN counts as inside out.
        self.jacobian_min = if j >= self.jacobian_min { self.jacobian_min } else { j };
    }
}

impl Evaluated {
    /// What pieces of the elements add up to, with forces that were summed already.
    pub(super) fn of_pieces(sums: &[PieceSum], forces: Vec<f64>) -> Self {
        let mut total = PieceSum::default();
        sums.iter().for_each(|piece| total.see(piece.energy, piece.jacobian_min));
        let is_inside_out = total.jacobian_min <= 0.0 || total.jacobian_min.is_nan();
        let energy = if is_inside_out { f64::INFINITY } else { total.energy };
        Self { energy, forces, jacobian_min: total.jacobian_min }
    }
}

/// Points of an element of K nodes and the share of its volume that each stands for.
pub(super) const fn points_of<const K: usize>() -> usize {
    if K == 4 { 1 } else { 4 }
}

/// Gradients of the K shape functions at one of the points.
#[inline]
pub(super) fn gradients_at<const K: usize>(rest: &Gradients, point: usize) -> [Vector3<f64>; K] {
    if K == 4 {
        std::array::from_fn(|i| rest.of_shape[i])
    } else {
        let all = tet10::shape_gradients(rest, tet10::QUADRATURE[point]);
        std::array::from_fn(|i| all[i])
    }
}

/// Displacement gradient `H = Σ u_a ∇N_aᵀ` of an element.
#[inline]
pub(super) fn gradient_of<const K: usize>(
    nodes: &[u32; K],
    gradients: &[Vector3<f64>; K],
    u: &[f64],
) -> Matrix3<f64> {
    let mut h = Matrix3::zeros();
    for (&node, gradient) in nodes.iter().zip(gradients) {
        let at = dof(node as usize, 0);
        let u = Vector3::new(u[at], u[at + 1], u[at + 2]);
        h += u * gradient.transpose();
    }
    h
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
        LameByRegion::try_new(mesh.regions(), mesh.tets().len(), materials)?;
        let by_region: Vec<Moduli> = materials.iter().map(|m| Moduli::new(law, m)).collect();
        let moduli = ModuliOf { by_region, regions: mesh.regions().to_vec() };
        let rest = tet4::gradients_of(mesh.tets().len(), |t| mesh.corners(t));
        let corners = || Locals::new(mesh.node_count(), mesh.tets());
        let (shape, node_count) = match (element, quadratic) {
            (Element::Tet10, Some(quadratic)) => {
                let count = quadratic.node_count();
                (Shape::Quadratic(Locals::new(count, quadratic.tets())), count)
            }
            (Element::Tet4Anp, _) => {
                let averaging = Averaging::new(mesh, &rest);
                (Shape::Averaged(corners(), averaging), mesh.node_count())
            }
            _ => (Shape::Linear(corners()), mesh.node_count()),
        };
        Ok(Self { shape, rest, moduli, node_count, plastic: None })
    }

    /// Nodes of the system.
    pub fn node_count(&self) -> usize {
        self.node_count
    }

    /// Largest Poisson's ratio of the moduli.
    pub fn poisson_max(&self) -> f64 {
        self.moduli.by_region.iter().map(Moduli::poisson).fold(-1.0, f64::max)
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let per_tet = match self.shape {
            Shape::Linear(_) => 32,
            Shape::Averaged(..) => 96,
            Shape::Quadratic(_) => 80,
        };
        let points = self.plastic.as_ref().map_or(0, |plastic| plastic.points.len());
        self.rest.len() * (size_of::<Gradients>() + per_tet)
            + 4 * self.node_count
            + points * size_of::<PlasticPoint>()
    }

    /// Energy and forces of a displacement field, in parallel, the same bits for any number of
    /// threads.
    ///
    /// Shapes: `u` 3N. Units: m.
    ///
    /// # Panics
    /// If `u` does not hold 3N numbers.
    pub fn evaluate(&self, u: &[f64]) -> Evaluated {
        assert_eq!(u.len(), 3 * self.node_count, "displacements do not fit the body");
        if let Some(plastic) = &self.plastic {
            return self.evaluate_yielding(plastic, u);
        }
        match &self.shape {
            Shape::Linear(locals) => self.evaluate_groups(locals, u, ModuliPart::Whole),
            Shape::Quadratic(locals) => self.evaluate_points(locals, u, ModuliPart::Whole),
            Shape::Averaged(locals, averaging) => {
                let mut evaluated = self.evaluate_groups(locals, u, ModuliPart::WithoutVolume);
                self.add_averaged(&mut evaluated, (locals, averaging), u);
                evaluated
            }
        }
    }

    /// Energy and forces, element by element and point by point.
    pub(super) fn evaluate_points<const K: usize>(
        &self,
        locals: &Locals<K>,
        u: &[f64],
        part: ModuliPart,
    ) -> Evaluated {
        let mut forces = Vec::new();
        let points = points_of::<K>();
        let sums = locals.for_each(&mut forces, |tet, forces, sum: &mut PieceSum| {
            let (rest, moduli) = (&self.rest[tet], part.of(self.moduli.of(tet)));
            let weight = rest.volume / points as f64;
            *forces = [[0.0; 3]; K];
            for point in 0..points {
                let gradients = gradients_at::<K>(rest, point);
                let deformed = Deformed::new(&gradient_of(&locals.tets[tet], &gradients, u));
                sum.see(weight * moduli.energy(&deformed), deformed.j);
                let stress = moduli.stress(&deformed) * weight;
                for (force, gradient) in forces.iter_mut().zip(&gradients) {
                    let f = stress * gradient;
                    force.iter_mut().zip(f.iter()).for_each(|(sum, f)| *sum += f);
                }
            }
        });
        Evaluated::of_pieces(&sums, locals.gather(&forces))
    }

    /// Calls `see(element, point of all points, H)` for the displacement gradient of every element at every point, and
    /// gives one result for each piece of the elements.
    pub(super) fn by_pieces<T: Send + Default>(
        &self,
        u: &[f64],
        see: impl Fn(usize, usize, &Matrix3<f64>, &mut T) + Sync,
    ) -> Vec<T> {
        let pieces = (0..self.piece_count()).into_par_iter();
        pieces.map(|piece| self.piece(u, piece, &see)).collect()
    }

    /// Pieces of the elements.
    pub(super) fn piece_count(&self) -> usize {
        self.rest.len().div_ceil(ELEMENTS_TOGETHER)
    }

    /// One piece of [`Elements::by_pieces`].
    pub(super) fn piece<T: Default>(
        &self,
        u: &[f64],
        piece: usize,
        see: &impl Fn(usize, usize, &Matrix3<f64>, &mut T),
    ) -> T {
        match &self.shape {
            Shape::Linear(locals) | Shape::Averaged(locals, _) => {
                self.piece_of(locals, u, piece, see)
            }
            Shape::Quadratic(locals) => self.piece_of(locals, u, piece, see),
        }
    }

    fn piece_of<const K: usize, T: Default>(
        &self,
        locals: &Locals<K>,
        u: &[f64],
        piece: usize,
        see: &impl Fn(usize, usize, &Matrix3<f64>, &mut T),
    ) -> T {
        let mut so_far = T::default();
        let first = piece * ELEMENTS_TOGETHER;
        for tet in first..(first + ELEMENTS_TOGETHER).min(locals.tets.len()) {
            for point in 0..points_of::<K>() {
                let gradients = gradients_at::<K>(&self.rest[tet], point);
                let place = points_of::<K>() * tet + point;
                see(tet, place, &gradient_of(&locals.tets[tet], &gradients, u), &mut so_far);
            }
        }
        so_far
    }
}

#[cfg(test)]
mod tests;
