//! What every session needs of its server.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use tokio::sync::watch;

use crate::config::ServerConfig;
use crate::places::Places;
use crate::resources::Resources;
use crate::uploads::Uploads;
use crate::workers::Workers;

/// What a session needs of its server.
#[derive(Clone)]
pub(crate) struct ServerHandle {
    pub resources: Arc<Resources>,
    pub uploads: Uploads,
    /// Places for sessions.
    pub places: Places,
    /// Sessions that have asked for a frame.
    grasping: Arc<AtomicUsize>,
    /// Whether the sessions are to end.
    pub stop: watch::Receiver<bool>,
}

/// A session that has asked for a frame; counted until it is dropped.
pub(crate) struct Grasping(Arc<AtomicUsize>);

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
        let (uploads, grasping) = (Uploads::default(), Arc::default());
        Self { resources, uploads, places, grasping, stop }
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
