//! What every session needs of its server.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

use tokio::sync::watch;

use crate::config::ServerConfig;
use crate::places::Places;
use crate::resources::Resources;
use crate::strangers::Strangers;
use crate::uploads::Uploads;
use crate::workers::Workers;

/// What a session needs of its server.
#[derive(Clone)]
pub(crate) struct ServerHandle {
    pub resources: Arc<Resources>,
    pub uploads: Uploads,
    /// Places for sessions.
    pub places: Places,
    /// Room for connections that have not introduced themselves.
    pub strangers: Strangers,
    /// Connections so far.
    connections: Arc<AtomicU64>,
    /// Sessions that have asked for a frame.
    grasping: Arc<AtomicUsize>,
    /// Whether the sessions are to end.
    pub stop: watch::Receiver<bool>,
}

/// A session that has asked for a frame; counted until it is dropped.
pub(crate) struct Grasping(Arc<AtomicUsize>);

/// Connections that may be there without having introduced themselves. At the pace at which connections
/// are accepted each of them has a fifth of a second, however large the crowd, and longer if another
/// address has more of them.
const STRANGERS_MAX: usize = 256;
/// With more sessions that ask for frames, these are shared out among the solving threads however small
/// they are.
const GRASPING_MAX: usize = 4;
/// With more sessions, one must not keep the sockets' thread from the others.
const QUIET_MAX: usize = 4;

impl ServerHandle {
    /// That of a server that has just started.
    pub fn new(config: ServerConfig, workers: Workers, stop: watch::Receiver<bool>) -> Self {
        let places = Places::new(config.max_sessions, config.max_sessions_per_address);
        let resources = Arc::new(Resources::new(config, workers));
        let (strangers, connections) = (Strangers::new(STRANGERS_MAX), Arc::default());
        let (uploads, grasping) = (Uploads::default(), Arc::default());
        Self { resources, uploads, places, strangers, connections, grasping, stop }
    }

    /// A number that no other connection of this server has.
    pub fn next_connection(&self) -> u64 {
        self.connections.fetch_add(1, Ordering::Relaxed) + 1
    }

    /// Counts a session that asks for its first frame.
    pub fn grasping(&self) -> Grasping {
        self.grasping.fetch_add(1, Ordering::Relaxed);
        Grasping(Arc::clone(&self.grasping))
    }

    /// Whether so few sessions ask for frames that one may use the sockets' thread for a moment.
    pub fn has_few_frames(&self) -> bool {
        self.grasping.load(Ordering::Relaxed) <= GRASPING_MAX
    }

    /// Whether few sessions are there.
    pub fn is_quiet(&self) -> bool {
        self.places.taken() <= QUIET_MAX
    }
}

impl Drop for Grasping {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Ends when something is to stop, or when nobody is left who could say so.
pub(crate) async fn stopped(stop: &mut watch::Receiver<bool>) {
    let _ = stop.wait_for(|stop| *stop).await;
}
