//! The ways in which the question is answered: a method of one server, or a worker on some ranks.

use softgrasp_core::solve::Method;

use crate::programs::{Programs, Server};
use crate::report::ReportError;
use crate::threads::processors;

/// One way to the answer, each in processes of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Way {
    /// A `fea-server` that is asked for a method.
    One(Method),
    /// A `fea-worker` on so many ranks.
    Ranks(usize),
}

/// All ways, in the order of the tables; the first is the one that others are compared with.
pub(super) const WAYS: [Way; 6] = [
    Way::One(Method::Front),
    Way::One(Method::FrontMixed),
    Way::One(Method::Multigrid),
    Way::Ranks(1),
    Way::Ranks(2),
    Way::Ranks(4),
];

impl Way {
    /// Name in the tables.
    pub fn name(self) -> String {
        match self {
            Self::One(method) => method.name().to_owned(),
            Self::Ranks(1) => "worker, 1 rank".to_owned(),
            Self::Ranks(ranks) => format!("worker, {ranks} ranks"),
        }
    }

    /// Method that its process is asked for.
    pub fn method(self) -> &'static str {
        match self {
            Self::One(method) => method.name(),
            Self::Ranks(_) => "cluster-cg",
        }
    }

    /// Whether its answer took steps of conjugate gradients, so that their number says something.
    pub fn is_iterated(self) -> bool {
        !matches!(self, Self::One(Method::Front | Method::FrontMixed))
    }

    /// Starts its process, or processes, which may take `memory` bytes together.
    ///
    /// # Errors
    /// [`ReportError`] if they do not start.
    pub fn start(self, programs: &Programs, memory: u64) -> Result<Server, ReportError> {
        let (nodes, elements) = (NODES_MAX.to_string(), (6 * NODES_MAX).to_string());
        match self {
            Self::One(_) => {
                let (memory, threads) = (memory.to_string(), processors().to_string());
                programs.serve_as(&[
                    "--listen",
                    "127.0.0.1:0",
                    "--threads",
                    &threads,
                    "--max-nodes",
                    &nodes,
                    "--max-elements",
                    &elements,
                    "--memory-limit",
                    &memory,
                ])
            }
            Self::Ranks(ranks) => {
                let each = (memory / ranks as u64).to_string();
                programs.serve_on(
                    ranks,
                    &["--listen", "127.0.0.1:0", "--max-nodes", &nodes, "--memory-per-rank", &each],
                )
            }
        }
    }
}

/// Largest mesh that the processes take.
const NODES_MAX: usize = 2_000_000;

/// Why there is no worker to ask; `None` if there is one.
pub(super) fn why_no_worker(programs: &Programs) -> Option<String> {
    let started = programs.serve_on(1, &["--listen", "127.0.0.1:0"]);
    started.err().map(|error| error.to_string())
}
