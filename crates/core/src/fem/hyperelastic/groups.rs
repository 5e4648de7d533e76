//! Linear elements in groups, as many as a vector of the processor takes: energy, forces, change and
//! limit of a step.
//!
//! The formulas are those of [`super::Deformed`], [`super::Moduli`] and the step limit, which work on
//! one element at a time and are the oracle of the tests.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::Law;
use super::body::{Body, Evaluated, PieceSum};
use super::connectivity::{ELEMENTS_TOGETHER, Locals};
use super::lanes::{
    LANES_MAX, LaneMatrix, Lanes, cofactor, determinant, dot, product, scaled, trace,
};
use super::law::ModuliPart;
use super::shrink::shrink_lanes;
use super::step_limit::limit_of;

/// A group of elements of a body, the last one repeated where there are fewer.
#[derive(Clone, Copy)]
struct Group<'a, S> {
    simd: S,
    body: &'a Body,
    tets: &'a [[u32; 4]],
    of: [usize; LANES_MAX],
}

/// Gradients of the shape functions: `[corner][axis]`.
type LaneShapes<S> = [[Lanes<S>; 3]; 4];

impl<'a, S: Simd> Group<'a, S> {
    #[inline(always)]
    fn new(simd: S, body: &'a Body, tets: &'a [[u32; 4]], first: usize) -> Self {
        let mut of = [tets.len() - 1; LANES_MAX];
        for lane in 0..LANES_MAX {
            of[lane] = of[lane].min(first + lane);
        }
        Self { simd, body, tets, of }
    }

    #[inline(always)]
    fn shapes(&self) -> LaneShapes<S> {
        let mut shapes = [[Lanes::all(self.simd, 0.0); 3]; 4];
        for corner in 0..4 {
            for axis in 0..3 {
                let mut numbers = [0.0; LANES_MAX];
                for lane in 0..S::F64_LANES {
                    numbers[lane] = self.body.rest[self.of[lane]].of_shape[corner][axis];
                }
                shapes[corner][axis] = Lanes::of(self.simd, &numbers);
            }
        }
        shapes
    }

    /// `H = Σ u_a ∇N_aᵀ`.
    #[inline(always)]
    fn gradient(&self, shapes: &LaneShapes<S>, u: &[[f64; 3]]) -> LaneMatrix<S> {
        let mut h = [[Lanes::all(self.simd, 0.0); 3]; 3];
        for corner in 0..4 {
            let mut places = [[0.0; 3]; LANES_MAX];
            for lane in 0..S::F64_LANES {
                places[lane] = u[self.tets[self.of[lane]][corner] as usize];
            }
            for i in 0..3 {
                let mut numbers = [0.0; LANES_MAX];
                for lane in 0..S::F64_LANES {
                    numbers[lane] = places[lane][i];
                }
                let of_corner = Lanes::of(self.simd, &numbers);
                for j in 0..3 {
                    h[i][j] = h[i][j] + of_corner * shapes[corner][j];
                }
            }
        }
        h
    }

    #[inline(always)]
    fn moduli(&self, part: ModuliPart) -> LaneModuli<S> {
        let first = part.of(self.body.moduli.of(self.of[0]));
        let (mut mu, mut volumetric) = ([first.mu; LANES_MAX], [first.volumetric; LANES_MAX]);
        if !self.body.moduli.is_one() {
            for lane in 0..S::F64_LANES {
                let moduli = part.of(self.body.moduli.of(self.of[lane]));
                (mu[lane], volumetric[lane]) = (moduli.mu, moduli.volumetric);
            }
        }
        let (mu, volumetric) = (Lanes::of(self.simd, &mu), Lanes::of(self.simd, &volumetric));
        LaneModuli { law: first.law, mu, volumetric }
    }

    #[inline(always)]
    fn volumes(&self) -> Lanes<S> {
        let mut volumes = [0.0; LANES_MAX];
        for lane in 0..S::F64_LANES {
            volumes[lane] = self.body.rest[self.of[lane]].volume;
        }
        Lanes::of(self.simd, &volumes)
    }
}

/// Moduli of a group.
struct LaneModuli<S: Simd> {
    law: Law,
    mu: Lanes<S>,
    volumetric: Lanes<S>,
}

/// Stress, energy for each unit of volume, and volume ratio.
struct LanePoint<S: Simd> {
    stress: LaneMatrix<S>,
    energy: Lanes<S>,
    j: Lanes<S>,
}

/// `F = I + H`.
#[inline(always)]
fn deformation<S: Simd>(h: &LaneMatrix<S>) -> LaneMatrix<S> {
    let mut f = *h;
    for i in 0..3 {
        f[i][i] = h[i][i] + h[i][i].like(1.0);
    }
    f
}

/// Green's strain of a group from its displacement gradients.
#[inline(always)]
fn green<S: Simd>(h: &LaneMatrix<S>) -> LaneMatrix<S> {
    let mut green = *h;
    for i in 0..3 {
        for k in i..3 {
            let square = h[0][i] * h[0][k] + h[1][i] * h[1][k] + h[2][i] * h[2][k];
            green[i][k] = (h[i][k] + h[k][i] + square) * 0.5;
            green[k][i] = green[i][k];
        }
    }
    green
}

/// `det(I + H) − 1` by the invariants of H.
#[inline(always)]
fn volume_change<S: Simd>(h: &LaneMatrix<S>) -> Lanes<S> {
    let of_h = trace(h);
    let across = h[0][1] * h[1][0] + h[0][2] * h[2][0] + h[1][2] * h[2][1];
    let along = h[0][0] * h[0][0] + h[1][1] * h[1][1] + h[2][2] * h[2][2];
    let second = (of_h * of_h - (along + across * 2.0)) * 0.5;
    of_h + second + determinant(h, &cofactor(h))
}

impl<S: Simd> LaneModuli<S> {
    #[inline(always)]
    fn at(&self, h: &LaneMatrix<S>) -> LanePoint<S> {
        let x = volume_change(h);
        let one = x.like(1.0);
        let j = one + x;
        let green = green(h);
        let stretched = trace(&green);
        let (twice, on_diagonal, energy) = match self.law {
            Law::NeoHookean => {
                let shrunk = shrink_lanes(x);
                let grown = one + shrunk;
                let twice = self.mu * grown * 2.0;
                let volumetric = self.volumetric * x;
                let deviatoric = self.mu * (shrunk * 3.0 + stretched * grown * 2.0);
                let mean = twice * stretched * (1.0 / 3.0);
                (twice, j * volumetric - mean, (deviatoric + volumetric * x) * 0.5)
            }
            Law::NeoHookeanLog => {
                let mut logarithms = x.numbers();
                for lane in 0..S::F64_LANES {
                    logarithms[lane] = logarithms[lane].ln_1p();
                }
                let ln = Lanes::of(x.simd(), &logarithms);
                let volumetric = self.volumetric * ln;
                let energy = self.mu * (stretched - ln) + volumetric * ln * 0.5;
                (self.mu * 2.0, volumetric, energy)
            }
        };
        let mut inner = scaled(&green, twice);
        for i in 0..3 {
            inner[i][i] = inner[i][i] + on_diagonal;
        }
        let inverse_transposed = scaled(&cofactor(&deformation(h)), one.over(j));
        LanePoint { stress: product(&inverse_transposed, &inner), energy, j }
    }
}

/// The linear elements of a body, worked on in groups.
#[derive(Clone, Copy)]
pub(super) struct Groups<'a> {
    pub body: &'a Body,
    pub locals: &'a Locals<4>,
}

impl Groups<'_> {
    /// Energy and forces of a displacement field.
    pub fn evaluate(self, u: &[f64], part: ModuliPart) -> Evaluated {
        let Self { body, locals } = self;
        let (u, arch) = (u.as_chunks().0, Arch::new());
        let mut forces = Vec::new();
        let sums = locals.for_each_piece(&mut forces, |first, forces| {
            arch.dispatch(EvaluatePiece { body, tets: &locals.tets, u, part, first, forces })
        });
        Evaluated::of_pieces(&sums, locals.gather(&forces))
    }

    /// Largest norm of `dF` that a step makes of an element; no number if one has none.
    pub fn gradient_change_max(self, step: &[f64]) -> f64 {
        self.most_of_pieces(step, None).sqrt()
    }

    /// Largest share of a step that leaves every element its volume.
    pub fn step_limit(self, u: &[f64], step: &[f64]) -> f64 {
        1.0 - self.most_of_pieces(step, Some(u))
    }

    fn most_of_pieces(self, step: &[f64], u: Option<&[f64]>) -> f64 {
        let Self { body, locals: Locals { tets, .. } } = self;
        let arch = Arch::new();
        let (step, u) = (step.as_chunks().0, u.map(|u| u.as_chunks().0));
        let pieces = (0..tets.len().div_ceil(ELEMENTS_TOGETHER)).into_par_iter();
        let most = pieces.map(|piece| {
            let first = piece * ELEMENTS_TOGETHER;
            let end = (first + ELEMENTS_TOGETHER).min(tets.len());
            arch.dispatch(MostOfPiece { body, tets, step, u, first, end })
        });
        most.collect::<Vec<f64>>().into_iter().fold(0.0, larger)
    }
}

/// Energy and forces of one piece of the elements.
struct EvaluatePiece<'a> {
    body: &'a Body,
    tets: &'a [[u32; 4]],
    u: &'a [[f64; 3]],
    part: ModuliPart,
    first: usize,
    forces: &'a mut [[[f64; 3]; 4]],
}

impl WithSimd for EvaluatePiece<'_> {
    type Output = PieceSum;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> PieceSum {
        let mut sum = PieceSum::default();
        for (at, forces) in self.forces.chunks_mut(S::F64_LANES).enumerate() {
            let first = self.first + S::F64_LANES * at;
            let group = Group::new(simd, self.body, self.tets, first);
            let shapes = group.shapes();
            let point = group.moduli(self.part).at(&group.gradient(&shapes, self.u));
            let volumes = group.volumes();
            let stress = scaled(&point.stress, volumes);
            for corner in 0..4 {
                for i in 0..3 {
                    let g = &shapes[corner];
                    let along = stress[i][0] * g[0] + stress[i][1] * g[1] + stress[i][2] * g[2];
                    let along = along.numbers();
                    for (lane, force) in forces.iter_mut().enumerate() {
                        force[corner][i] = along[lane];
                    }
                }
            }
            let (energy, j) = ((point.energy * volumes).numbers(), point.j.numbers());
            for lane in 0..forces.len() {
                sum.see(energy[lane], j[lane]);
            }
        }
        sum
    }
}

/// The largest squared norm of `dF` in one piece of the elements, or, with a shape given, the largest
/// share of the step that is too much.
struct MostOfPiece<'a> {
    body: &'a Body,
    tets: &'a [[u32; 4]],
    step: &'a [[f64; 3]],
    u: Option<&'a [[f64; 3]]>,
    first: usize,
    end: usize,
}

impl WithSimd for MostOfPiece<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let mut most = 0.0f64;
        for first in (self.first..self.end).step_by(S::F64_LANES) {
            let group = Group::new(simd, self.body, self.tets, first);
            let shapes = group.shapes();
            let df = group.gradient(&shapes, self.step);
            let Some(u) = self.u else {
                let squares = dot(&df, &df).numbers();
                for lane in 0..S::F64_LANES {
                    most = larger(most, squares[lane]);
                }
                continue;
            };
            let f = deformation(&group.gradient(&shapes, u));
            let (of_f, of_df) = (cofactor(&f), cofactor(&df));
            let c0 = determinant(&f, &of_f).numbers();
            let c1 = dot(&of_f, &df).numbers();
            let c2 = dot(&f, &of_df).numbers();
            let c3 = determinant(&df, &of_df).numbers();
            for lane in 0..S::F64_LANES {
                most = larger(most, 1.0 - limit_of([c0[lane], c1[lane], c2[lane], c3[lane]]));
            }
        }
        most
    }
}

/// What is no number counts as the largest.
#[inline(always)]
fn larger(most: f64, x: f64) -> f64 {
    if x <= most || most.is_nan() { most } else { x }
}

#[cfg(test)]
mod tests;
