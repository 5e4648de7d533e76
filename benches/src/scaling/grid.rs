//! Measures times over sizes, kinds of objects, methods and processors.

use std::time::Duration;

use softgrasp_core::mesh::BuiltIn;
use softgrasp_core::solve::Method;

use crate::reference::Reference;
use crate::report::{ReportError, check, progress};
use crate::sample::{Competitor, Effort, Spread, take_turns};
use crate::scene::Pressed;
use crate::threads::pool;

/// All rounds of one method on one object with one number of threads.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Series {
    pub shape: BuiltIn,
    pub nodes: usize,
    pub unknown_dofs: usize,
    pub method: Method,
    pub threads: usize,
    /// Time of the whole analysis in each round, s.
    pub seconds: Vec<f64>,
    /// Largest error of all rounds against the exact answer.
    pub error_rel: f64,
}

/// The thesis's method, the dense one that replaces it, and the sparse one that replaces both.
pub(super) const METHODS: [Method; 3] = [Method::GaussJordan, Method::DenseInverse, Method::Front];
/// Number of nodes from which on a round is so long that warming up does not show.
const LONG_NODES: usize = 700;
const ERROR_ALLOWED: f64 = 1e-9;

impl Series {
    pub fn spread(&self) -> Spread {
        Spread::of(self.seconds.iter().copied())
    }
}

/// Measures objects of one size: every method with every number of threads, in turns.
pub(super) fn measure_objects(
    objects: &[(BuiltIn, usize)],
    thread_counts: &[usize],
    is_quick: bool,
) -> Result<Vec<Series>, ReportError> {
    let mut scenes = Vec::new();
    for &(shape, nodes) in objects {
        progress("scaling", &format!("{shape}, {nodes} nodes"));
        let scene = Pressed::try_new(shape, nodes)?;
        let (model, known) = scene.model()?;
        scenes.push((Reference::of(&model, &known)?, scene));
    }
    let pools = thread_counts.iter().map(|&t| pool(t)).collect::<Result<Vec<_>, _>>()?;
    let mut series = Vec::new();
    let mut competitors: Vec<Competitor<'_, (f64, f64), ReportError>> = Vec::new();
    for (reference, scene) in &scenes {
        for method in METHODS {
            for (pool, &threads) in pools.iter().zip(thread_counts) {
                series.push(Series {
                    shape: scene.shape,
                    nodes: scene.mesh.node_count(),
                    unknown_dofs: scene.unknown_dofs(),
                    method,
                    threads,
                    seconds: Vec::new(),
                    error_rel: 0.0,
                });
                competitors.push(Box::new(move || {
                    let (times, solution) = pool.install(|| scene.analyse(method))?;
                    let error = reference.error_of(solution.displacement.iter().copied(), 1.0);
                    check(|| format!("{method} on the {}", scene.shape), error, ERROR_ALLOWED)?;
                    Ok((1e-3 * times.total, error))
                }));
            }
        }
    }
    let nodes = scenes.iter().map(|(_, scene)| scene.mesh.node_count()).max().unwrap_or(0);
    let results = take_turns(&effort(nodes, is_quick), &mut competitors)?;
    for (series, runs) in series.iter_mut().zip(results) {
        series.seconds = runs.iter().map(|run| run.0).collect();
        series.error_rel = Spread::of(runs.iter().map(|run| run.1)).max;
    }
    Ok(series)
}

fn effort(nodes: usize, is_quick: bool) -> Effort {
    let (warm_up_rounds, rounds_min, rounds_max, seconds) = match (is_quick, nodes >= LONG_NODES) {
        (true, _) => (1, 3, 6, 1),
        (false, false) => (1, 5, 40, 15),
        (false, true) => (0, 3, 40, 15),
    };
    let budget = Duration::from_secs(seconds);
    Effort { warm_up_rounds, rounds_min, rounds_max, budget }
}
