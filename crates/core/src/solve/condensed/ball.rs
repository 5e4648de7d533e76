//! Small matrices with a bound on the error of each entry.

use nalgebra::DMatrix;

use super::rounding::{SLACK, gamma};

/// All matrices whose entries are within `radius` of those of `middle`.
///
/// Source: midpoint-radius arithmetic, Rump, Fast and parallel interval arithmetic (1999); the order
/// of summation does not matter, and a fused multiply-add only loses less.
#[derive(Clone, Debug)]
pub(super) struct Ball {
    pub middle: DMatrix<f64>,
    pub radius: DMatrix<f64>,
}

impl Ball {
    /// A matrix that is known exactly.
    pub fn exact(middle: DMatrix<f64>) -> Self {
        let radius = DMatrix::zeros(middle.nrows(), middle.ncols());
        Self { middle, radius }
    }

    /// The product of any two members, and the rounding of computing it.
    pub fn times(&self, other: &Self) -> Self {
        let middle = &self.middle * &other.middle;
        let (a, b) = (self.middle.abs(), other.middle.abs());
        let terms = gamma(self.middle.ncols() + 1);
        let wide = &b + &other.radius;
        let radius = (&a * &b) * terms + &a * &other.radius + &self.radius * wide;
        Self { middle, radius: radius * SLACK }
    }

    /// All transposes.
    pub fn transposed(&self) -> Self {
        Self { middle: self.middle.transpose(), radius: self.radius.transpose() }
    }

    /// Bound of the Frobenius norm, and so of the spectral norm, of every member.
    pub fn norm(&self) -> f64 {
        (self.middle.norm() + self.radius.norm()) * SLACK
    }

    /// Bound of the norm of one column of every member.
    pub fn column_norm(&self, j: usize) -> f64 {
        (self.middle.column(j).norm() + self.radius.column(j).norm()) * SLACK
    }

    /// Bound of `‖I − A‖` for every member A; made of the radius where rounding is all there is.
    pub fn distance_from_identity(&self) -> f64 {
        let gap = DMatrix::identity(self.middle.nrows(), self.middle.ncols()) - &self.middle;
        let rounding = self.radius.norm() + gamma(2) * self.middle.norm();
        super::rounding::settled(gap.norm(), rounding) * SLACK
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn product_of_members_is_a_member_of_the_product() {
        let entry = |seed: usize| move |i: usize, j: usize| ((7 * i + 3 * j + seed) as f64).sin();
        let a = Ball {
            middle: DMatrix::from_fn(4, 5, entry(1)),
            radius: DMatrix::from_element(4, 5, 1e-3),
        };
        let b = Ball {
            middle: DMatrix::from_fn(5, 3, entry(2)),
            radius: DMatrix::from_element(5, 3, 2e-3),
        };
        let product = a.times(&b);
        for (s, t) in [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0)] {
            let member = (&a.middle + &a.radius * s) * (&b.middle + &b.radius * t);
            let off = (member - &product.middle).abs() - &product.radius;
            assert!(off.max() <= 0.0, "{off}");
        }
        let third = DMatrix::from_element(1, 1, 1.0 / 3.0);
        let one = Ball::exact(third.clone()).times(&Ball::exact(third.map(|x| 1.0 / x)));
        assert!(one.distance_from_identity() > 0.0 && one.distance_from_identity() < 1e-14);
    }
}
