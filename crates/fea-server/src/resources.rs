//! The resources that all requests of one server share.

use crate::access::Access;
use crate::budget::Budget;
use crate::config::ServerConfig;
use crate::log_line::LogLines;
use crate::metrics::Metrics;
use crate::plan::MeasuredRates;
use crate::store::{MeshStore, ModelStore};
use crate::workers::Workers;

/// Settings, kept models, memory budget, solving threads, their measured rates, counters and log limits.
pub(crate) struct Resources {
    pub config: ServerConfig,
    pub access: Access,
    pub models: ModelStore,
    /// Models that the engine answers for.
    pub meshes: MeshStore,
    pub budget: Budget,
    pub workers: Workers,
    pub rates: MeasuredRates,
    pub metrics: Metrics,
    pub log_lines: LogLines,
}

impl Resources {
    /// Resources of a server that has just started.
    pub fn new(config: ServerConfig, workers: Workers) -> Self {
        let budget = Budget::new(config.memory_limit);
        let models = ModelStore::new(budget.clone());
        let access = Access::new(config.tokens.clone());
        let (rates, metrics) = (MeasuredRates::default(), Metrics::default());
        let (log_lines, meshes) = (LogLines::default(), MeshStore::default());
        Self { config, access, models, meshes, budget, workers, rates, metrics, log_lines }
    }
}
