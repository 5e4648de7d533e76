//! The settings of a server, checked before it starts.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use softgrasp_protocol::Limits;

use crate::clock::StageWatch;
use crate::encryption::Encryption;
use crate::engine::Engine;
use crate::tokens::Tokens;

/// Settings of one server.
#[derive(Clone, Debug)]
pub struct ServerConfig {
    /// Address to listen on; port 0 picks a free one.
    pub listen: SocketAddr,
    /// Number of threads that solve.
    pub threads: usize,
    /// Largest number of nodes of a mesh.
    pub max_nodes: u32,
    /// Largest number of elements of a mesh.
    pub max_elements: u32,
    /// Length of the largest message, bytes.
    pub max_frame: u32,
    /// Largest number of sessions at the same time; further clients are turned away.
    pub max_sessions: usize,
    /// Largest number of sessions at the same time from one address other than this machine's own.
    pub max_sessions_per_address: usize,
    /// Largest number of requests of all sessions that wait or are worked on; others wait unread.
    pub max_queue: usize,
    /// Memory for all kept models and all requests under way, bytes.
    pub memory_limit: u64,
    /// Time after which a model that no session holds and no request has used is forgotten.
    pub model_idle_limit: Duration,
    /// Memory for the compliance columns kept for each model, bytes.
    pub column_cache: u64,
    /// Tokens of which a client must show one; `None`: no token is required.
    pub tokens: Option<Tokens>,
    /// Certificate and key that sessions are encrypted with; `None`: no encryption.
    pub encryption: Option<Encryption>,
    /// Whether other machines may reach the server without token and encryption.
    pub is_insecure: bool,
    /// Whether the machine's rates are measured at the start, beside the first requests, and not by the
    /// first request that needs them.
    pub measure_at_start: bool,
    /// Whether the thread of the sockets asks for real-time scheduling, so that frame questions need not
    /// wait for other work on the machine.
    pub real_time: bool,
    /// Longest time between two bytes inside a message, before the client is given up.
    pub stall_limit: Duration,
    /// Longest time for a handshake, a first request or a header, before the client is given up.
    pub greeting_limit: Duration,
    /// Longest silence of a client between two messages, before it is given up; `None`: no limit.
    pub idle_limit: Option<Duration>,
    /// Longest time for a client to take its reply, and one second more for every 64 KiB of it, before it
    /// is given up.
    pub reply_limit: Duration,
    /// Time for which sessions may go on after the server was asked to stop.
    pub drain: Duration,
    /// Address of the pages about the server's state; port 0 picks a free one; `None`: no pages.
    pub metrics: Option<SocketAddr>,
    /// Stage of the newest request, for the program that started the server.
    pub stage: StageWatch,
    /// Answers what this server cannot, or everything; `None`: there is no other.
    pub engine: Option<Arc<dyn Engine>>,
}

/// Why settings are refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ConfigError {
    /// The number of solving threads is 0.
    #[error("--threads is 0; at least one thread must solve")]
    NoThreads,
    /// More threads than are accepted.
    #[error("--threads is {threads}; more than {max} is surely a slip")]
    TooManyThreads {
        /// Number of threads asked for.
        threads: usize,
        /// Largest number that is accepted.
        max: usize,
    },
    /// A limit is 0, so that nothing could be served.
    #[error("{option} is 0; nothing could be served")]
    Zero {
        /// Name of the option on the command line.
        option: &'static str,
    },
    /// The address can be reached from other machines, and neither token nor encryption protects it.
    #[error(
        "{address} can be reached from other machines: give --token-file and --tls-cert with --tls-key \
         (--make-certificate makes a pair), or say --insecure if everybody there is trusted"
    )]
    Open {
        /// Address to listen on.
        address: SocketAddr,
    },
    /// The address of the status pages can be reached from other machines.
    #[error(
        "--metrics {address} can be reached from other machines, and its pages are neither encrypted \
         nor guarded: take a loopback address, or say --insecure if everybody there is trusted"
    )]
    OpenMetrics {
        /// Address of the status pages.
        address: SocketAddr,
    },
}

const THREADS_MAX: usize = 1024;
/// Bytes that a client may send in one frame before it has shown the token; without a token, a longer
/// frame takes a session's place once its header has come.
pub(crate) const STRANGER_PAYLOAD_MAX: u32 = 64 * 1024;

impl Default for ServerConfig {
    fn default() -> Self {
        Self {
            listen: SocketAddr::from(([127, 0, 0, 1], 7878)),
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            max_nodes: Limits::default().node_count_max,
            max_elements: Limits::default().tet_count_max,
            max_frame: Limits::default().payload_len_max,
            max_sessions: 64,
            max_sessions_per_address: 32,
            max_queue: 32,
            memory_limit: 8 << 30,
            model_idle_limit: Duration::from_secs(600),
            column_cache: 1 << 30,
            tokens: None,
            encryption: None,
            is_insecure: false,
            measure_at_start: false,
            real_time: false,
            stall_limit: Duration::from_secs(30),
            greeting_limit: Duration::from_secs(10),
            idle_limit: None,
            reply_limit: Duration::from_secs(60),
            drain: Duration::ZERO,
            metrics: None,
            stage: StageWatch::default(),
            engine: None,
        }
    }
}

impl ServerConfig {
    /// Checks the settings.
    ///
    /// # Errors
    /// [`ConfigError`] that names the option.
    pub fn check(&self) -> Result<(), ConfigError> {
        if self.threads == 0 {
            return Err(ConfigError::NoThreads);
        }
        if self.threads > THREADS_MAX {
            return Err(ConfigError::TooManyThreads { threads: self.threads, max: THREADS_MAX });
        }
        for (option, zero) in [
            ("--max-nodes", self.max_nodes == 0),
            ("--max-elements", self.max_elements == 0),
            ("--max-frame", self.max_frame == 0),
            ("--max-queue", self.max_queue == 0),
            ("--max-sessions", self.max_sessions == 0),
            ("--max-sessions-per-address", self.max_sessions_per_address == 0),
            ("--memory-limit", self.memory_limit == 0),
            ("--column-cache", self.column_cache == 0),
            ("--stall-limit", self.stall_limit.is_zero()),
            ("--greeting-limit", self.greeting_limit.is_zero()),
            ("--idle-limit", self.idle_limit.is_some_and(|limit| limit.is_zero())),
            ("--reply-limit", self.reply_limit.is_zero()),
            ("--model-idle-limit", self.model_idle_limit.is_zero()),
        ] {
            if zero {
                return Err(ConfigError::Zero { option });
            }
        }
        let is_guarded = self.tokens.is_some() && self.encryption.is_some();
        if !self.listen.ip().is_loopback() && !is_guarded && !self.is_insecure {
            return Err(ConfigError::Open { address: self.listen });
        }
        match self.metrics {
            Some(address) if !address.ip().is_loopback() && !self.is_insecure => {
                Err(ConfigError::OpenMetrics { address })
            }
            _ => Ok(()),
        }
    }

    /// Limits on what is read from a client that has not introduced itself yet.
    pub fn limits_of_strangers(&self) -> Limits {
        let limits = self.limits();
        Limits { payload_len_max: limits.payload_len_max.min(STRANGER_PAYLOAD_MAX), ..limits }
    }

    /// Limits on what is read from a client.
    pub fn limits(&self) -> Limits {
        let largest = Limits::LARGEST;
        let nodes = self.max_nodes.min(largest.node_count_max);
        let elements = self.max_elements.min(largest.tet_count_max);
        Limits {
            payload_len_max: self.max_frame.min(largest.payload_len_max),
            node_count_max: nodes,
            tet_count_max: elements.min(nodes.saturating_mul(8)),
            dof_count_max: nodes.saturating_mul(3),
            ..largest
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_server_can_be_told_to_read_as_much_as_one_message_holds() {
        assert_eq!(ServerConfig::default().limits(), Limits::default());
        let (max_nodes, max_elements, max_frame) = (u32::MAX, u32::MAX, u32::MAX);
        let most = ServerConfig { max_nodes, max_elements, max_frame, ..ServerConfig::default() };
        assert_eq!(most.limits(), Limits::LARGEST);
        let Limits { node_count_max, tet_count_max, payload_len_max, .. } = Limits::LARGEST;
        let bytes = 24 * u64::from(node_count_max) + 16 * u64::from(tet_count_max);
        assert!(bytes < u64::from(payload_len_max));
    }

    #[test]
    fn an_address_that_others_can_reach_wants_token_and_encryption_or_a_word() {
        let folder = tempfile::tempdir().unwrap();
        let (certificate, key) = (folder.path().join("certificate"), folder.path().join("key"));
        crate::make_certificate(&["lab".to_owned()], 1, &certificate, &key).unwrap();
        let encryption = Some(Encryption::read(&certificate, &key).unwrap());
        let tokens = Some(Tokens::of("secret"));
        let open: SocketAddr = ([0, 0, 0, 0], 7878).into();
        let config = ServerConfig { listen: open, ..ServerConfig::default() };
        let refused = Err(ConfigError::Open { address: open });
        assert_eq!(config.check(), refused);
        assert_eq!(ServerConfig { tokens: tokens.clone(), ..config.clone() }.check(), refused);
        assert_eq!(
            ServerConfig { encryption: encryption.clone(), ..config.clone() }.check(),
            refused
        );
        assert_eq!(ServerConfig { tokens, encryption, ..config.clone() }.check(), Ok(()));
        assert_eq!(ServerConfig { is_insecure: true, ..config }.check(), Ok(()));
        assert_eq!(ServerConfig::default().check(), Ok(()));
        let pages = ServerConfig { metrics: Some(open), ..ServerConfig::default() };
        assert_eq!(pages.check(), Err(ConfigError::OpenMetrics { address: open }));
        assert_eq!(ServerConfig { is_insecure: true, ..pages }.check(), Ok(()));
        let six = ServerConfig { listen: "[::1]:0".parse().unwrap(), ..ServerConfig::default() };
        assert_eq!(six.check(), Ok(()));
    }
}
