//! The elements of a body at rest, and sums over their points.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::connectivity::{Averaging, ELEMENTS_TOGETHER, Locals};
use super::law::ModuliPart;
use super::{Deformed, Law, Moduli};
use crate::fem::tet4::{self, Gradients};
use crate::fem::tet10_points::Points;
use crate::fem::{AssemblyError, Element, LameByRegion, Material, QuadraticMesh, dof, tet10};
use crate::mesh::TetMesh;

/// Elements of a body at rest, with their moduli.
///
/// Shapes: M elements, N nodes of the system (mid-edge nodes that were made behind the corners). Units: m, Pa.
#[derive(Clone, Debug)]
pub(super) struct Body {
    pub shape: Shape,
    /// Gradients of the linear shape functions at rest, and the volume of each element.
    pub rest: Vec<Gradients>,
    /// Elements at rest at their points, where edges may be curved; else empty.
    curved: Vec<Points>,
    pub moduli: ModuliOf,
    pub node_count: usize,
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
    /// Region of each element; empty where one material serves all.
    regions: Vec<u32>,
}

impl ModuliOf {
    /// Largest Poisson's ratio.
    pub fn poisson_max(&self) -> f64 {
        self.by_region.iter().map(Moduli::poisson).fold(-1.0, f64::max)
    }

    /// Number of materials.
    pub fn len(&self) -> usize {
        self.by_region.len()
    }

    /// The law of all of them.
    pub fn law(&self) -> Law {
        self.by_region.first().map_or_else(Law::default, |moduli| moduli.law)
    }

    /// Number of the material of one element.
    pub fn region_of(&self, tet: usize) -> usize {
        match self.is_one() {
            true => 0,
            false => self.regions.get(tet).map_or(0, |&region| region as usize),
        }
    }

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

/// A quadrature point of an element.
#[derive(Clone, Copy)]
pub(super) struct At {
    pub tet: usize,
    /// Number of the point among those of all elements.
    pub point: usize,
    /// Volume at rest that the point stands for, m³.
    pub weight: f64,
}

/// Quadrature points of an element of K nodes.
pub(super) const fn points_of<const K: usize>() -> usize {
    if K == 4 { 1 } else { 4 }
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

impl Body {
    /// See [`super::Elements::try_new`].
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
        let mut rest = tet4::gradients_of(mesh.tets().len(), |t| mesh.corners(t));
        let curved: Vec<Points> = match quadratic.filter(|own| own.is_curved()) {
            None => Vec::new(),
            Some(own) => (0..own.tets().len()).into_par_iter().map(|t| own.points(t)).collect(),
        };
        rest.iter_mut().zip(&curved).for_each(|(rest, points)| rest.volume = points.volume);
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
        Ok(Self { shape, rest, curved, moduli, node_count })
    }

    /// Gradients of the K shape functions of an element at one of its points.
    #[inline]
    pub fn gradients_at<const K: usize>(&self, tet: usize, point: usize) -> [Vector3<f64>; K] {
        let rest = &self.rest[tet];
        if K == 4 {
            return std::array::from_fn(|i| rest.of_shape[i]);
        }
        let all = match self.curved.get(tet) {
            None => tet10::shape_gradients(rest, tet10::QUADRATURE[point]),
            Some(points) => points.gradients[point],
        };
        std::array::from_fn(|i| all[i])
    }

    /// Share of the volume of an element of K nodes that one of its points stands for.
    #[inline]
    pub fn share_of<const K: usize>(&self, tet: usize, point: usize) -> f64 {
        let of_curved = self.curved.get(tet).map(|points| points.shares[point]);
        of_curved.unwrap_or(1.0 / points_of::<K>() as f64)
    }

    /// Bytes that it holds in memory, roughly.
    pub fn bytes(&self) -> usize {
        let per_tet = match self.shape {
            Shape::Linear(_) => 32,
            Shape::Averaged(..) => 96,
            Shape::Quadratic(_) => 80,
        };
        let curved = size_of_val(self.curved.as_slice());
        self.rest.len() * (size_of::<Gradients>() + per_tet) + curved + 4 * self.node_count
    }

    /// Energy and forces of an elastic body, element by element and point by point.
    pub fn evaluate_points<const K: usize>(
        &self,
        locals: &Locals<K>,
        u: &[f64],
        part: ModuliPart,
    ) -> Evaluated {
        let stress = |at: At, _: &[Vector3<f64>; K], deformed: &Deformed, sum: &mut PieceSum| {
            let moduli = part.of(self.moduli.of(at.tet));
            sum.see(at.weight * moduli.energy(deformed), deformed.j);
            moduli.stress(deformed)
        };
        let (sums, forces) = self.forces_of(locals, u, stress);
        Evaluated::of_pieces(&sums, forces)
    }

    /// Sums the forces of stresses at all points, and what every piece of the elements adds up.
    ///
    /// `stress(point, gradients of its shape functions, its deformation, what the piece has so far)`.
    pub fn forces_of<const K: usize, T: Send + Default>(
        &self,
        locals: &Locals<K>,
        u: &[f64],
        stress: impl Fn(At, &[Vector3<f64>; K], &Deformed, &mut T) -> Matrix3<f64> + Sync,
    ) -> (Vec<T>, Vec<f64>) {
        let mut forces = Vec::new();
        let points = points_of::<K>();
        let sums = locals.for_each(&mut forces, |tet, forces, sum| {
            let mut so_far = [Vector3::zeros(); K];
            for point in 0..points {
                let weight = self.rest[tet].volume * self.share_of::<K>(tet, point);
                let gradients = self.gradients_at::<K>(tet, point);
                let deformed = Deformed::new(&gradient_of(&locals.tets[tet], &gradients, u));
                let at = At { tet, point: points * tet + point, weight };
                let stress = stress(at, &gradients, &deformed, sum) * weight;
                for (force, gradient) in so_far.iter_mut().zip(&gradients) {
                    *force += stress * gradient;
                }
            }
            *forces = so_far.map(Into::into);
        });
        (sums, locals.gather(&forces))
    }

    /// Calls `see(element, point of all points, H, what the piece has so far)` for the displacement
    /// gradient H of every element at every point; gives one result for each piece of the elements.
    pub fn by_pieces<T: Send + Default>(
        &self,
        u: &[f64],
        see: impl Fn(usize, usize, &Matrix3<f64>, &mut T) + Sync,
    ) -> Vec<T> {
        match &self.shape {
            Shape::Linear(locals) | Shape::Averaged(locals, _) => {
                self.by_pieces_of(locals, u, &see)
            }
            Shape::Quadratic(locals) => self.by_pieces_of(locals, u, &see),
        }
    }

    fn by_pieces_of<const K: usize, T: Send + Default>(
        &self,
        locals: &Locals<K>,
        u: &[f64],
        see: &(impl Fn(usize, usize, &Matrix3<f64>, &mut T) + Sync),
    ) -> Vec<T> {
        let pieces = locals.tets.par_chunks(ELEMENTS_TOGETHER).enumerate();
        let of_piece = |(piece, tets): (usize, &[[u32; K]])| {
            let mut so_far = T::default();
            for (i, nodes) in tets.iter().enumerate() {
                let tet = piece * ELEMENTS_TOGETHER + i;
                for point in 0..points_of::<K>() {
                    let gradients = self.gradients_at::<K>(tet, point);
                    let h = gradient_of(nodes, &gradients, u);
                    see(tet, points_of::<K>() * tet + point, &h, &mut so_far);
                }
            }
            so_far
        };
        pieces.map(of_piece).collect()
    }
}
