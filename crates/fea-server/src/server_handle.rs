//! What every session needs of its server.

use std::sync::Arc;

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
    /// Whether the sessions are to end.
    pub stop: watch::Receiver<bool>,
}

/// With more sessions, frames are shared out among the solving threads however small they are.
const QUIET_MAX: usize = 4;

impl ServerHandle {
    /// That of a server that has just started.
    pub fn new(config: ServerConfig, workers: Workers, stop: watch::Receiver<bool>) -> Self {
        let places = Places::new(config.max_sessions, config.max_sessions_per_address);
        let resources = Arc::new(Resources::new(config, workers));
        Self { resources, uploads: Uploads::default(), places, stop }
    }

    /// Whether so few sessions are there that one may use the sockets' thread for a moment.
    pub fn is_quiet(&self) -> bool {
        self.places.taken() <= QUIET_MAX
    }
}

/// Ends when something is to stop, or when nobody is left who could say so.
pub(crate) async fn stopped(stop: &mut watch::Receiver<bool>) {
    let _ = stop.wait_for(|stop| *stop).await;
}
