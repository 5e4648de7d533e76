//! A contact problem between its points alone: without the corners of the surface, and without its springs.
//!
//! Five fingertips that hold a fruit have a few tens of points between a hundred corners, and each point has up to
//! two springs. What costs the square or the cube of a size is done between the points then, and the springs, which
//! obey a linear law, are eliminated before the points are solved for.

use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef, Par};
use nalgebra::DMatrix;

use super::cone::{PointForce, chosen, put_back};
use super::delassus::{CornerColumn, Delassus, PointPlace};
use super::law::PointLaw;
use super::newton::solve_in_place;
use super::problem::ContactProblem;

/// A contact problem between the points that obey Coulomb's law, and what their forces move its springs by.
pub(super) struct BetweenPoints {
    problem: ContactProblem,
    /// Points that obey Coulomb's law, by their position in the problem that was given, ascending.
    points: Vec<usize>,
    /// The springs.
    springs: Vec<Spring>,
    /// Motion of the springs by the forces of the points, and behind it their motion without any: `[P | p]`.
    ///
    /// Shapes: s springs, n points; s × (3n + 1). Units: m/N, m.
    moved: DMatrix<f64>,
}

/// A spring: its position in the problem that was given, and its force for each metre of its motion, N/m.
struct Spring {
    position: usize,
    stiffness: PointForce,
}

/// Most points: with more of them the matrix of points and springs would take more memory than is counted.
const POINTS_MAX: usize = 300;

impl BetweenPoints {
    /// `None` where the corners have no more rows than the points, where there are too many of them, or where
    /// the springs cannot be eliminated.
    ///
    /// Where springs move by `u_s = W_sp λ + b_s − W_ss u_s` and press by −k u_s, the points move by
    /// `u = (W_pp − W_ps P) λ + b_p − W_ps p` with `[P | p] = (I + W_ss)⁻¹ [W_sp | b_s]`; the columns of `W_ps`
    /// and `W_ss` have the stiffness in them.
    pub fn new(given: &ContactProblem) -> Option<Self> {
        let (mut points, mut springs) = (Vec::new(), Vec::new());
        for (position, law) in given.laws.iter().enumerate() {
            match law {
                PointLaw::Contact(_) => points.push(position),
                PointLaw::Spring { stiffness } => {
                    springs.push(Spring { position, stiffness: *stiffness });
                }
            }
        }
        if 3 * points.len() >= given.w.corner_rows() || points.len() > POINTS_MAX {
            return None;
        }
        let Eliminated { w, moved, b } = Eliminated::new(given, &points, &springs);
        let places = (0..points.len() as u32).map(PointPlace::corner).collect();
        let problem = ContactProblem {
            w: Delassus::try_new(w, places).ok()?,
            b,
            laws: points.iter().map(|&i| given.laws[i]).collect(),
            // Of the point with its springs at rest: the residual means the same in both problems.
            rho: points.iter().map(|&i| given.rho[i]).collect(),
        };
        let is_finite = problem.b.iter().chain(&moved).all(|x| x.is_finite());
        is_finite.then_some(Self { problem, points, springs, moved })
    }

    /// The problem between the points alone.
    pub fn problem(&self) -> &ContactProblem {
        &self.problem
    }

    /// The forces of the points, of those of points and springs.
    ///
    /// Shapes: n points and s springs; `lambda` 3(n + s), result 3n. Units: N.
    pub fn of_points(&self, lambda: &[f64]) -> Vec<f64> {
        chosen(lambda, &self.points)
    }

    /// The forces of points and springs, of those of the points.
    ///
    /// Shapes: n points and s springs; `lambda` 3n, result 3(n + s). Units: N.
    pub fn with_springs(&self, lambda: &[f64]) -> Vec<f64> {
        let mut all = vec![0.0; 3 * (self.points.len() + self.springs.len())];
        put_back(lambda, &self.points, &mut all);
        for (row, spring) in self.springs.iter().enumerate() {
            let of_row = self.moved.row(row);
            let by_points: f64 = of_row.iter().zip(lambda).map(|(p, force)| p * force).sum();
            let motion = by_points + of_row[lambda.len()];
            let to = &mut all[3 * spring.position..3 * spring.position + 3];
            to.iter_mut().zip(&spring.stiffness).for_each(|(force, k)| *force = -k * motion);
        }
        all
    }
}

/// What is left of a problem when its springs are eliminated.
struct Eliminated {
    /// `W_pp − W_ps P`, 3n × 3n, m/N.
    w: DMatrix<f64>,
    /// `[P | p]`.
    moved: DMatrix<f64>,
    /// `b_p − W_ps p`, 3n, m.
    b: Vec<f64>,
}

impl Eliminated {
    fn new(given: &ContactProblem, points: &[usize], springs: &[Spring]) -> Self {
        let (n, s) = (3 * points.len(), springs.len());
        let of_points = points.iter().flat_map(|&i| [0, 1, 2].map(|axis| (i, axis)));
        let motions: Vec<CornerColumn> = of_points
            .clone()
            .chain(springs.iter().map(|spring| (spring.position, 0)))
            .map(|(i, axis)| given.w.motion_row(i, axis))
            .collect();
        let axes = [PointForce::x(), PointForce::y(), PointForce::z()];
        let forces: Vec<CornerColumn> = of_points
            .map(|(i, axis)| (i, axes[axis]))
            .chain(springs.iter().map(|spring| (spring.position, spring.stiffness)))
            .map(|(i, force)| given.w.force_column(i, &force))
            .collect();
        let all = given.w.between(&motions, &forces);
        let mut moved = DMatrix::zeros(s, n + 1);
        moved.columns_mut(0, n).copy_from(&all.view((n, 0), (s, n)));
        for (row, spring) in springs.iter().enumerate() {
            moved[(row, n)] = given.b[3 * spring.position];
        }
        let own = all.view((n, n), (s, s)) + DMatrix::identity(s, s);
        solve_in_place(own, moved.as_mut_slice());
        let mut w = DMatrix::zeros(n, n + 1);
        w.columns_mut(0, n).copy_from(&all.view((0, 0), (n, n)));
        for (row, &point) in points.iter().enumerate() {
            (0..3).for_each(|axis| w[(3 * row + axis, n)] = given.b[3 * point + axis]);
        }
        let of_springs = &all.as_slice()[n * (n + s)..];
        matmul(
            MatMut::from_column_major_slice_mut(w.as_mut_slice(), n, n + 1),
            Accum::Add,
            MatRef::from_column_major_slice_with_stride(of_springs, n, s, n + s),
            MatRef::from_column_major_slice(moved.as_slice(), s, n + 1),
            -1.0,
            Par::Seq,
        );
        let b = w.column(n).iter().copied().collect();
        Self { w: w.remove_column(n), moved, b }
    }
}
