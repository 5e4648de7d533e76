//! Many right-hand sides of one factor, solved and refined together.

use softgrasp_core::solve::{Factored, Loads, Method};

use super::round::Problem;
use crate::report::{ReportError, check};
use crate::sample::timed_ms;

/// Number of right-hand sides: seven contacts with three directions each.
const LOADS: usize = 21;

/// Factors of one problem in both precisions.
pub struct Several {
    front: Factored,
    mixed: Factored,
    /// Known displacements of each load case, m.
    q_known: Vec<Vec<f64>>,
}

impl Several {
    /// Factors of a problem in both precisions.
    ///
    /// # Errors
    /// [`ReportError`] if there is no factor.
    pub fn try_new(problem: &Problem) -> Result<Self, ReportError> {
        let factored = |method| {
            let partition = problem.partition.clone();
            Factored::try_new(problem.model.stiffness(), partition, method, &mut |_| {})
        };
        let known = problem.partition.known().len();
        let value = |load: usize, k: usize| 1e-3 * ((1 + k + 5 * load) as f64).sin();
        let q_known = (0..LOADS).map(|load| (0..known).map(|k| value(load, k)).collect()).collect();
        Ok(Self { front: factored(Method::Front)?, mixed: factored(Method::FrontMixed)?, q_known })
    }

    /// Times for all load cases by `front` and by `front-mixed`, ms.
    ///
    /// # Errors
    /// [`ReportError`] if the answers of the two differ.
    pub fn round(&self, problem: &Problem) -> Result<[f64; 2], ReportError> {
        let stiffness = problem.model.stiffness();
        let loads: Vec<Loads<'_>> =
            self.q_known.iter().map(|q_known| Loads { q_known, ..Loads::default() }).collect();
        let solve = |factored: &Factored| {
            timed_ms(|| factored.solve_several(stiffness, &loads, &mut |_| {}))
        };
        let (front_ms, front) = solve(&self.front);
        let (mixed_ms, mixed) = solve(&self.mixed);
        for (front, mixed) in front?.iter().zip(mixed?) {
            let largest = front.displacement.iter().fold(0.0f64, |m, u| m.max(u.abs()));
            let pairs = front.displacement.iter().zip(&mixed.displacement);
            let off = pairs.fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
            check(|| "front and front-mixed".to_owned(), off / largest, 1e-11)?;
        }
        Ok([front_ms, mixed_ms])
    }
}
