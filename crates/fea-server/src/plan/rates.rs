//! Measures once how fast this machine is at each kind of work, to predict times.

use std::time::Instant;

use softgrasp_core::fem::{Element, Material};
use softgrasp_core::mesh::{BuiltIn, generate};
use softgrasp_core::model::Model;
use softgrasp_core::solve::rates::{FactorRates, FactorSample, Rates};
use softgrasp_core::solve::work::{MeshSize, Work};
use softgrasp_core::solve::{Analysed, Factored, FrontFactor, FrontPrecision, Method, Partition};

use crate::lock::Lock;

/// Rates of this machine's solving threads, once they are measured.
#[derive(Default)]
pub(crate) struct MeasuredRates {
    state: Lock<State>,
}

#[derive(Clone, Copy, Default, PartialEq)]
enum State {
    #[default]
    Unknown,
    Running,
    Known(Rates),
}

/// Nodes of the two cubes that are timed, which together takes a few hundredths of a second.
const NODES_SMALL: usize = 216;
const NODES_LARGE: usize = 1728;
/// Number of runs, of which the fastest counts: every disturbance makes a run slower.
const RUNS: usize = 2;

impl MeasuredRates {
    /// Measured rates; measured now on the current pool if they are not. While another thread measures,
    /// those of a typical machine.
    pub fn get(&self) -> Rates {
        let before = self.state.with(|state| {
            let before = *state;
            if before == State::Unknown {
                *state = State::Running;
            }
            before
        });
        match before {
            State::Known(rates) => return rates,
            State::Running => return Rates::ASSUMED,
            State::Unknown => {}
        }
        let start = Instant::now();
        let rates = measure().unwrap_or_else(|| {
            tracing::error!("the speed of this machine could not be measured");
            Rates::ASSUMED
        });
        let ms = 1e3 * start.elapsed().as_secs_f64();
        tracing::info!(ms, ?rates, "speed of this machine measured");
        self.state.with(|state| *state = State::Known(rates));
        rates
    }

    /// Measured rates, or those of a typical machine; for predictions that need not be exact.
    pub fn known(&self) -> Rates {
        match self.state.with(|state| *state) {
            State::Known(rates) => rates,
            State::Running | State::Unknown => Rates::ASSUMED,
        }
    }
}

/// Rates of this machine with `threads` threads, for predictions without a server; takes some hundredths
/// of a second. `None` if they cannot be measured.
pub fn measure_rates(threads: usize) -> Option<Rates> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().ok()?;
    pool.install(measure)
}

/// Result of one run and its time, s.
fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let result = work();
    // A clock that stands still must not make a machine infinitely fast.
    (result, start.elapsed().as_secs_f64().max(1e-9))
}

/// Result of the fastest run and its time, s.
fn fastest<T>(mut work: impl FnMut() -> Option<T>) -> Option<(T, f64)> {
    let mut best: Option<(T, f64)> = None;
    for _ in 0..RUNS {
        let (result, seconds) = timed(&mut work);
        let result = result?;
        if best.as_ref().is_none_or(|(_, least)| seconds < *least) {
            best = Some((result, seconds));
        }
    }
    best
}

/// Rates from the times of two cubes; `None` if one of them cannot be solved.
fn measure() -> Option<Rates> {
    let small = Cube::new(NODES_SMALL)?;
    let large = Cube::new(NODES_LARGE)?;
    let work = &large.work;
    let q = vec![1.0; 3 * large.model.system_node_count()];
    let (_, product_s) = fastest(|| Some(large.model.stiffness().mul(&q)))?;
    let (_, dense_s) = fastest(|| small.factor_dense())?;
    Some(Rates {
        assemble_pair_s: large.assemble_s / work.element_pairs,
        order_block_s: large.order_s / work.blocks,
        product_block_s: product_s / work.blocks,
        double: FactorRates::fit(small.sample::<f64>()?, large.sample::<f64>()?),
        single: FactorRates::fit(small.sample::<f32>()?, large.sample::<f32>()?),
        dense_flop_s: 3.0 * dense_s / small.work.unknown_dofs.powi(3),
    })
}

/// Cube held at its first nodes, assembled and ordered.
struct Cube {
    model: Model,
    partition: Partition,
    analysed: Analysed,
    work: Work,
    assemble_s: f64,
    order_s: f64,
}

impl Cube {
    fn new(nodes: usize) -> Option<Self> {
        let mesh = generate(BuiltIn::Cube, nodes).ok()?;
        let size = MeshSize { nodes: mesh.node_count(), tets: mesh.tets().len() };
        // More nodes than lie on one line, so that the cube is held.
        let held: Vec<u32> = (0..3 * size.nodes as u32 / 10).collect();
        let used = mesh.used_nodes();
        let material = Material::try_new(1.0e5, 0.3).ok()?;
        let assemble =
            || Model::try_new(mesh.clone(), Element::Tet4, &[material], vec![], &mut |_| {}).ok();
        let (model, assemble_s) = fastest(assemble)?;
        let partition = Partition::try_new(&used, &held).ok()?;
        let order = || Some(Analysed::new(model.stiffness(), partition.clone(), &mut |_| {}));
        let (analysed, order_s) = fastest(order)?;
        let estimate = Work::estimate(size, Element::Tet4);
        let blocks = model.stiffness().pattern().block_count() as f64;
        let work = Work { blocks, ..estimate.counted(analysed.analysis()) };
        Some(Self { model, partition, analysed, work, assemble_s, order_s })
    }

    fn sample<T: FrontPrecision>(&self) -> Option<FactorSample> {
        let analysis = self.analysed.analysis();
        let (factor, factor_s) =
            fastest(|| FrontFactor::<T>::try_new(analysis, self.model.stiffness()).ok())?;
        let mut b = vec![1.0; analysis.row_count()];
        let ((), solve_s) = fastest(|| {
            factor.solve_in_place(&mut b, 1);
            Some(())
        })?;
        let Work { factor_entries: entries, factor_flops: flops, .. } = self.work;
        Some(FactorSample { entries, flops, factor_s, solve_s })
    }

    fn factor_dense(&self) -> Option<Factored> {
        let (stiffness, partition) = (self.model.stiffness(), self.partition.clone());
        Factored::try_new(stiffness, partition, Method::DenseCholesky, &mut |_| {}).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measured_rates_are_positive_and_measured_once() {
        let measured = MeasuredRates::default();
        let rates = measured.get();
        for rate in [
            rates.assemble_pair_s,
            rates.order_block_s,
            rates.product_block_s,
            rates.dense_flop_s,
            rates.double.entry_s + rates.double.flop_s,
            rates.single.entry_s + rates.single.flop_s,
            rates.double.solve_entry_s,
            rates.single.solve_entry_s,
        ] {
            assert!(rate > 0.0 && rate.is_finite(), "{rates:?}");
        }
        assert_eq!(measured.get(), rates);
    }

    #[test]
    fn who_comes_while_another_measures_does_not_wait() {
        let measured = MeasuredRates::default();
        measured.state.with(|state| *state = State::Running);
        assert_eq!(measured.get(), Rates::ASSUMED);
    }
}
