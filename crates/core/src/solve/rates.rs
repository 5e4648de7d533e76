//! The time that a machine takes for a unit of work, and the predicted time of an answer.

use super::Method;
use super::work::Work;

/// Seconds per unit of [`Work`], as measured by whoever has a clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rates {
    /// Assembly, s per pair of nodes of an element.
    pub assemble_pair_s: f64,
    /// Order and analysis, s per block.
    pub order_block_s: f64,
    /// Product with the stiffness, s per block.
    pub product_block_s: f64,
    /// Factor over fronts in double precision.
    pub double: FactorRates,
    /// Factor over fronts in single precision.
    pub single: FactorRates,
    /// Tiled dense Cholesky factor, s per operation.
    pub dense_flop_s: f64,
}

/// Cost of a factor over the tree of fronts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FactorRates {
    /// s per number of the factor: what does not grow with the size of the fronts.
    pub entry_s: f64,
    /// s per operation.
    pub flop_s: f64,
    /// s per number of the factor, in one substitution forward and back.
    pub solve_entry_s: f64,
}

/// One factor that was timed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FactorSample {
    /// Numbers of the factor.
    pub entries: f64,
    /// Floating-point operations of the factor.
    pub flops: f64,
    /// Time of the factor, s.
    pub factor_s: f64,
    /// Time of one substitution forward and back, s.
    pub solve_s: f64,
}

/// Digits that one step with a single-precision factor gains; four to seven are usual.
const DIGITS_PER_STEP: f64 = 4.0;
/// What a hierarchy costs, and one step by it, in products with the stiffness; its steps for each digit
/// and besides. Measured by `examples/multigrid_times.rs`.
const HIERARCHY_PRODUCTS: f64 = 110.0;
const CYCLE_PRODUCTS: f64 = 5.0;
const STEPS_PER_DIGIT: f64 = 2.0;
const STEPS_BEFORE: f64 = 3.0;
/// What direct methods in double precision reach.
pub const ERROR_EXACT: f64 = 1e-13;
/// What a single-precision factor reaches when it is refined.
pub const ERROR_REFINED: f64 = 1e-12;
/// What conjugate gradients without a factor are asked for where nothing else is said.
pub const ERROR_ITERATED: f64 = 1e-10;

impl FactorRates {
    /// Rates that give both samples back, or, where no positive ones do, the larger sample.
    ///
    /// The time is taken for a·entries + b·flops with a, b ≥ 0.
    pub fn fit(small: FactorSample, large: FactorSample) -> Self {
        let solve_entry_s = large.solve_s / large.entries;
        let det = small.entries * large.flops - large.entries * small.flops;
        let entry_s = (small.factor_s * large.flops - large.factor_s * small.flops) / det;
        let flop_s = (small.entries * large.factor_s - large.entries * small.factor_s) / det;
        let (entry_s, flop_s) = match (entry_s >= 0.0, flop_s >= 0.0) {
            (true, true) => (entry_s, flop_s),
            // A disturbed sample: the larger one says more.
            (false, true) => (0.0, large.factor_s / large.flops),
            _ => (0.5 * large.factor_s / large.entries, 0.5 * large.factor_s / large.flops),
        };
        Self { entry_s, flop_s, solve_entry_s }
    }

    fn factor_s(&self, work: &Work) -> f64 {
        self.entry_s * work.factor_entries + self.flop_s * work.factor_flops
    }
}

impl Rates {
    /// For a machine that has not been measured: one core of about 2020.
    pub const ASSUMED: Self = Self {
        assemble_pair_s: 60e-9,
        order_block_s: 500e-9,
        product_block_s: 10e-9,
        double: FactorRates { entry_s: 5e-9, flop_s: 0.06e-9, solve_entry_s: 1.5e-9 },
        single: FactorRates { entry_s: 4e-9, flop_s: 0.03e-9, solve_entry_s: 0.8e-9 },
        dense_flop_s: 0.08e-9,
    };

    /// Time until `K11` can be factored: assembly, and the order where the method has one.
    ///
    /// Units: ms.
    pub fn preparation_ms(&self, work: &Work, method: Method) -> f64 {
        let order = if method.is_sparse() { self.order_block_s * work.blocks } else { 0.0 };
        1e3 * (self.assemble_pair_s * work.element_pairs + order)
    }

    /// Time from there to the answer, stopped at a relative error where the method can.
    ///
    /// Units: ms; `error_rel` 1.
    pub fn factor_and_solve_ms(&self, work: &Work, method: Method, error_rel: f64) -> f64 {
        let n = work.unknown_dofs;
        let product = self.product_block_s * work.blocks;
        let double_solve = self.double.solve_entry_s * work.factor_entries + product;
        let single_solve = self.single.solve_entry_s * work.factor_entries + product;
        // Rows of a dense factor or inverse are read as those of a sparse one.
        let dense_solve = 0.5 * n * n * self.double.solve_entry_s + product;
        let seconds = match method {
            // A factor of the held base; columns are solves, five nodes at once.
            Method::Condensed | Method::Front => self.double.factor_s(work) + 2.0 * double_solve,
            // One thread, however many there are: not told apart, so an estimate from below.
            Method::SparseCholesky => self.double.factor_s(work) + 2.0 * double_solve,
            Method::FrontMixed | Method::Pcg => {
                let digits = -error_rel.clamp(ERROR_REFINED, 0.1).log10();
                let steps = (digits / DIGITS_PER_STEP).ceil() + 1.0;
                self.single.factor_s(work) + steps * single_solve
            }
            Method::Multigrid => {
                let digits = -error_rel.clamp(ERROR_ITERATED, 0.1).log10();
                let steps = STEPS_BEFORE + STEPS_PER_DIGIT * digits;
                product * (HIERARCHY_PRODUCTS + steps * CYCLE_PRODUCTS)
            }
            Method::DenseCholesky => self.dense_flop_s * n.powi(3) / 3.0 + 2.0 * dense_solve,
            Method::DenseInverse => self.dense_flop_s * n.powi(3) + 4.0 * dense_solve,
            // Twice the operations of the symmetric inverse.
            Method::GaussJordan => 2.0 * self.dense_flop_s * n.powi(3) + 4.0 * dense_solve,
            // Row by row, not in tiles: an order of magnitude less of the machine is used.
            Method::GaussJordanPlain => 20.0 * self.dense_flop_s * n.powi(3) + 4.0 * dense_solve,
        };
        1e3 * seconds
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::Element;
    use crate::solve::work::MeshSize;

    fn sample(entries: f64, flops: f64, rates: (f64, f64)) -> FactorSample {
        let factor_s = rates.0 * entries + rates.1 * flops;
        FactorSample { entries, flops, factor_s, solve_s: 2e-9 * entries }
    }

    #[test]
    fn fit_gives_the_rates_back_that_made_the_samples() {
        let made = |rates| FactorRates::fit(sample(1e4, 1e6, rates), sample(4e5, 3e8, rates));
        let fitted = made((6e-9, 0.05e-9));
        assert!((fitted.entry_s / 6e-9 - 1.0).abs() < 1e-9);
        assert!((fitted.flop_s / 0.05e-9 - 1.0).abs() < 1e-9);
        assert!((fitted.solve_entry_s / 2e-9 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn disturbed_samples_still_give_rates_above_zero_that_fit_the_larger_one() {
        let good = sample(4e5, 3e8, (6e-9, 0.05e-9));
        for disturbed in [0.01, 50.0] {
            let mut small = sample(1e4, 1e6, (6e-9, 0.05e-9));
            small.factor_s *= disturbed;
            let fitted = FactorRates::fit(small, good);
            assert!(fitted.entry_s >= 0.0 && fitted.flop_s >= 0.0, "{fitted:?}");
            let again = fitted.entry_s * good.entries + fitted.flop_s * good.flops;
            assert!((again / good.factor_s - 1.0).abs() < 1e-9, "{disturbed}: {fitted:?}");
        }
    }

    #[test]
    fn predictions_grow_with_the_work_and_fall_with_the_digits_asked_for() {
        let rates = Rates::ASSUMED;
        let work = |nodes| Work::estimate(MeshSize { nodes, tets: 5 * nodes }, Element::Tet4);
        for method in Method::DIRECT {
            let ms = |nodes| {
                rates.preparation_ms(&work(nodes), method)
                    + rates.factor_and_solve_ms(&work(nodes), method, 1e-12)
            };
            assert!(ms(100) > 0.0 && ms(1000) > 2.0 * ms(100), "{method}");
        }
        let pcg = |error| rates.factor_and_solve_ms(&work(10_000), Method::Pcg, error);
        assert!(pcg(1e-3) < pcg(1e-9) && pcg(1e-9) <= pcg(1e-12));
        let front = rates.factor_and_solve_ms(&work(10_000), Method::Front, 0.0);
        let dense = rates.factor_and_solve_ms(&work(10_000), Method::DenseCholesky, 0.0);
        assert!(pcg(1e-12) < front && front < dense);
    }
}
