//! Parts of the server that every session needs.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

use tokio::sync::watch;

use crate::config::ServerConfig;
use crate::places::Places;
use crate::resources::Resources;
use crate::strangers::Strangers;
use crate::uploads::Uploads;
use crate::workers::Workers;

/// Parts of the server that a session needs.
#[derive(Clone)]
pub(crate) struct ServerHandle {
    pub resources: Arc<Resources>,
    pub uploads: Uploads,
    /// Places for sessions.
    pub places: Places,
    /// Room for connections that have not introduced themselves.
    pub strangers: Strangers,
    /// Number of connections so far.
    connections: Arc<AtomicU64>,
    /// Number of open sessions that have asked a frame question.
    grasping: Arc<AtomicUsize>,
    /// True once the sessions are to end.
    pub stop: watch::Receiver<bool>,
}

/// Counts one session that has asked a frame question, until it is dropped.
pub(crate) struct Grasping(Arc<AtomicUsize>);

/// Largest number of connections that have not introduced themselves. At the pace at which connections
/// are accepted, each of them has at least a fifth of a second, and longer if another address has more of
/// them.
const STRANGERS_MAX: usize = 256;
/// Number of sessions with frame questions above which all frame questions go to the solving threads,
/// however small they are.
const GRASPING_MAX: usize = 4;
/// Number of sessions above which one session must not keep the sockets' thread from the others.
const QUIET_MAX: usize = 4;

impl ServerHandle {
    /// Handle of a server that has just started.
    pub fn new(config: ServerConfig, workers: Workers, stop: watch::Receiver<bool>) -> Self {
        let places = Places::new(config.max_sessions, config.max_sessions_per_address);
        let resources = Arc::new(Resources::new(config, workers));
        let (strangers, connections) = (Strangers::new(STRANGERS_MAX), Arc::default());
        let (uploads, grasping) = (Uploads::default(), Arc::default());
        Self { resources, uploads, places, strangers, connections, grasping, stop }
    }

    /// Number of a new connection, different from all others of this server.
    pub fn next_connection(&self) -> u64 {
        self.connections.fetch_add(1, Ordering::Relaxed) + 1
    }

    /// Counts a session that asks its first frame question.
    pub fn grasping(&self) -> Grasping {
        self.grasping.fetch_add(1, Ordering::Relaxed);
        Grasping(Arc::clone(&self.grasping))
    }

    /// Whether so few sessions ask frame questions that one may be answered on the sockets' thread.
    pub fn has_few_frames(&self) -> bool {
        self.grasping.load(Ordering::Relaxed) <= GRASPING_MAX
    }

    /// Whether few sessions are open.
    pub fn is_quiet(&self) -> bool {
        self.places.taken() <= QUIET_MAX
    }
}

impl Drop for Grasping {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Ends when `stop` becomes true, or when its sender has gone.
pub(crate) async fn stopped(stop: &mut watch::Receiver<bool>) {
    let _ = stop.wait_for(|stop| *stop).await;
}
