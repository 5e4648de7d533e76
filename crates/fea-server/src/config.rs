//! The settings of a server, checked before it starts.

use std::net::SocketAddr;
use std::time::Duration;

use softgrasp_protocol::Limits;

use crate::clock::StageWatch;

/// Settings of one server.
#[derive(Clone, Debug)]
pub struct ServerConfig {
    /// Address to listen on; port 0 picks a free one.
    pub listen: SocketAddr,
    /// Threads that solve; exactly as many.
    pub threads: usize,
    /// Largest number of nodes of a mesh.
    pub max_nodes: u32,
    /// Sessions at the same time; one more is turned away.
    pub max_sessions: usize,
    /// Bytes that all that is kept between requests and all that requests under way make may take.
    pub memory_limit: u64,
    /// Bytes of compliance columns kept per model.
    pub column_cache: u64,
    /// Shared secret a client must show, if any.
    pub token: Option<String>,
    /// Whether the machine's speed is measured at once, beside the first requests, and not by the
    /// first request that needs it.
    pub measure_at_start: bool,
    /// Whether the thread of the sockets asks for real-time scheduling, so that frames need not wait
    /// for other work on the machine.
    pub real_time: bool,
    /// A client that stops inside a frame for this long is given up.
    pub stall_limit: Duration,
    /// Where the stage of the newest request can be read, for whoever started the server.
    pub stage: StageWatch,
}

/// Settings that make no sense.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ConfigError {
    /// No thread to solve with.
    #[error("--threads is 0; at least one thread must solve")]
    NoThreads,
    /// More threads than any machine has.
    #[error("--threads is {threads}; more than {max} is surely a slip")]
    TooManyThreads {
        /// Threads asked for.
        threads: usize,
        /// Most that are accepted.
        max: usize,
    },
    /// Nothing could be served.
    #[error("{option} is 0; nothing could be served")]
    Zero {
        /// The option's name.
        option: &'static str,
    },
}

const THREADS_MAX: usize = 1024;

impl Default for ServerConfig {
    fn default() -> Self {
        Self {
            listen: SocketAddr::from(([127, 0, 0, 1], 7878)),
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            max_nodes: Limits::default().node_count_max,
            max_sessions: 64,
            memory_limit: 8 << 30,
            column_cache: 1 << 30,
            token: None,
            measure_at_start: false,
            real_time: false,
            stall_limit: Duration::from_secs(30),
            stage: StageWatch::default(),
        }
    }
}

impl ServerConfig {
    /// Checks the numbers.
    ///
    /// # Errors
    /// [`ConfigError`] names the option.
    pub fn check(&self) -> Result<(), ConfigError> {
        if self.threads == 0 {
            return Err(ConfigError::NoThreads);
        }
        if self.threads > THREADS_MAX {
            return Err(ConfigError::TooManyThreads { threads: self.threads, max: THREADS_MAX });
        }
        for (option, zero) in [
            ("--max-nodes", self.max_nodes == 0),
            ("--max-sessions", self.max_sessions == 0),
            ("--memory-limit", self.memory_limit == 0),
            ("--column-cache", self.column_cache == 0),
            ("the stall limit", self.stall_limit.is_zero()),
        ] {
            if zero {
                return Err(ConfigError::Zero { option });
            }
        }
        Ok(())
    }

    /// Limits on what is read from a client.
    pub fn limits(&self) -> Limits {
        let usual = Limits::default();
        let nodes = self.max_nodes.min(usual.node_count_max);
        Limits {
            node_count_max: nodes,
            tet_count_max: usual.tet_count_max.min(nodes.saturating_mul(8)),
            dof_count_max: nodes.saturating_mul(3),
            ..usual
        }
    }
}
