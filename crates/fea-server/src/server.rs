//! Listens for connections, accepts sessions, and stops them.

use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

use tokio::net::TcpListener;
use tokio::sync::watch;
use tokio::task::JoinSet;

use crate::attendance::{attend, make_ready};
use crate::config::{ConfigError, ServerConfig};
use crate::observed::observe_server;
use crate::pace::Pace;
use crate::resources::Resources;
use crate::server_handle::{ServerHandle, stopped};
use crate::status_pages::StatusPages;
use crate::workers::Workers;

/// Why a server could not start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// The settings are refused.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The address cannot be listened on.
    #[error(
        "cannot listen on {address}: {source}; is another server running there? (--listen HOST:PORT, port 0 picks a free one)"
    )]
    Listen {
        /// Address to listen on.
        address: SocketAddr,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The address of the status pages cannot be listened on.
    #[error("cannot listen on {address}: {source} (--metrics HOST:PORT, port 0 picks a free one)")]
    Metrics {
        /// Address of the status pages.
        address: SocketAddr,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The solving threads cannot be started.
    #[error("cannot start {threads} solving threads: {source}")]
    Threads {
        /// Number of threads asked for.
        threads: usize,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The runtime of the sockets cannot be started.
    #[error("cannot start the server's sockets: {0}")]
    Runtime(std::io::Error),
}

/// Time after a stop, after which sessions that are still at work are cut off.
const STOP_GRACE: Duration = Duration::from_secs(2);
/// Bounds on the time between two searches for unused models, which is a quarter of their time limit.
const FORGET_EVERY_MIN: Duration = Duration::from_millis(100);
const FORGET_EVERY_MAX: Duration = Duration::from_secs(60);
/// Pause after a failed accept, so that a process out of file descriptors does not spin.
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);

/// Addresses that a server listens on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Listening {
    /// Address for clients.
    pub address: SocketAddr,
    /// Address of the status pages, if there are any.
    pub metrics: Option<SocketAddr>,
}

/// Listens and serves until `stop` is true and the sessions have drained; calls `on_ready` with the
/// addresses once it listens.
///
/// # Errors
/// [`StartError`] if the server cannot start; once it listens it does not fail.
pub async fn serve(
    config: ServerConfig,
    on_ready: impl FnOnce(Listening),
    stop: watch::Receiver<bool>,
) -> Result<(), StartError> {
    config.check()?;
    let Listeners { clients, pages, listening } = Listeners::open(&config).await?;
    let (threads, queue, drain) = (config.threads, config.max_queue, config.drain);
    let workers =
        Workers::new(threads, queue).map_err(|source| StartError::Threads { threads, source })?;
    let (end_sessions, sessions_end) = watch::channel(false);
    let server = ServerHandle::new(config, workers, sessions_end);
    observe_server(&server);
    let is_stopping = Arc::new(AtomicBool::new(false));
    // Ends with this function.
    let mut beside = JoinSet::new();
    beside.spawn(forget_unused_models(Arc::clone(&server.resources)));
    if let Some(listener) = pages {
        let pages = StatusPages::new(server.clone(), Arc::clone(&is_stopping));
        beside.spawn(pages.serve(listener));
    }
    on_ready(listening);
    if server.resources.config.measure_at_start {
        let later = Arc::clone(&server.resources);
        server.resources.workers.in_background(move || {
            later.rates.get();
        });
    }
    let mut sessions = JoinSet::new();
    accept_until_stopped(&clients, &server, stop, &mut sessions).await;
    drop(clients);
    is_stopping.store(true, Ordering::Relaxed);
    tracing::info!(sessions = sessions.len(), drain_s = drain.as_secs_f64(), "stopping");
    if !all_end_within(&mut sessions, drain).await {
        let _ = end_sessions.send(true);
        if !all_end_within(&mut sessions, STOP_GRACE).await {
            tracing::warn!("sessions still at work are cut off");
            sessions.abort_all();
        }
    }
    Ok(())
}

/// Sockets that a server listens on, and their addresses.
struct Listeners {
    clients: TcpListener,
    pages: Option<TcpListener>,
    listening: Listening,
}

impl Listeners {
    async fn open(config: &ServerConfig) -> Result<Self, StartError> {
        let address = config.listen;
        let failed = |source| StartError::Listen { address, source };
        let clients = TcpListener::bind(address).await.map_err(failed)?;
        let address = clients.local_addr().map_err(failed)?;
        let Some(wanted) = config.metrics else {
            return Ok(Self {
                clients,
                pages: None,
                listening: Listening { address, metrics: None },
            });
        };
        let failed = |source| StartError::Metrics { address: wanted, source };
        let pages = TcpListener::bind(wanted).await.map_err(failed)?;
        let metrics = Some(pages.local_addr().map_err(failed)?);
        Ok(Self { clients, pages: Some(pages), listening: Listening { address, metrics } })
    }
}

/// Waits for all sessions to end, for at most `limit`; returns whether they have.
async fn all_end_within(sessions: &mut JoinSet<()>, limit: Duration) -> bool {
    let all_end = async { while sessions.join_next().await.is_some() {} };
    tokio::time::timeout(limit, all_end).await.is_ok()
}

/// Forgets, at intervals, the models that no session holds.
async fn forget_unused_models(resources: Arc<Resources>) {
    let limit = resources.config.model_idle_limit;
    loop {
        tokio::time::sleep((limit / 4).clamp(FORGET_EVERY_MIN, FORGET_EVERY_MAX)).await;
        if let Some(then) = Instant::now().checked_sub(limit) {
            resources.models.forget_unused_since(then);
            resources.meshes.forget_unused_since(then);
        }
    }
}

async fn accept_until_stopped(
    listener: &TcpListener,
    server: &ServerHandle,
    mut stop: watch::Receiver<bool>,
    sessions: &mut JoinSet<()>,
) {
    let mut pace = Pace::of_connections(Instant::now());
    loop {
        let next = async {
            tokio::time::sleep_until(pace.next().into()).await;
            listener.accept().await
        };
        let accepted = tokio::select! {
            accepted = next => accepted,
            () = stopped(&mut stop) => return,
            Some(_) = sessions.join_next(), if !sessions.is_empty() => continue,
        };
        match accepted {
            Ok((stream, peer)) => {
                pace.came(Instant::now());
                if let Err(error) = make_ready(&stream) {
                    tracing::warn!(%peer, %error, "a connection could not be set up");
                }
                sessions.spawn(attend(stream, peer, server.clone()));
            }
            Err(error) => {
                // For want of descriptors, most likely: a stranger's comes free.
                let sent_away = server.strangers.send_one_away();
                tracing::error!(%error, sent_away, "a connection could not be accepted");
                tokio::time::sleep(ACCEPT_PAUSE).await;
            }
        }
    }
}

/// Runtime of a server's sockets: one thread, which sleeps unless there is something to read, write or
/// answer at once, and then must not wait for the solving threads.
///
/// # Errors
/// Error of the operating system if it starts no thread.
pub fn sockets_runtime(config: &ServerConfig) -> std::io::Result<tokio::runtime::Runtime> {
    let real_time = config.real_time;
    tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .thread_name("sockets")
        .on_thread_start(move || {
            if real_time && let Err(error) = softgrasp_os::be_urgent() {
                tracing::info!(%error, "frames wait for other work on this machine");
            }
        })
        .enable_all()
        .build()
}

/// A server on a thread of this process; dropping it stops it.
#[derive(Debug)]
pub struct RunningServer {
    listening: Listening,
    stop: watch::Sender<bool>,
    thread: Option<std::thread::JoinHandle<()>>,
}

/// Starts a server on a thread of its own and returns once it listens.
///
/// # Errors
/// [`StartError`].
pub fn start(config: ServerConfig) -> Result<RunningServer, StartError> {
    let (stop, stopped) = watch::channel(false);
    let (ready, is_ready) = mpsc::channel();
    let runtime = sockets_runtime(&config).map_err(StartError::Runtime)?;
    let thread = std::thread::Builder::new().name("server".to_owned());
    let thread = thread
        .spawn(move || {
            // The first word counts; nobody listens for a second one.
            let say = |outcome| drop(ready.send(outcome));
            let served = runtime.block_on(serve(config, |listening| say(Ok(listening)), stopped));
            // Whatever the threads are at, a stop does not wait for them.
            runtime.shutdown_background();
            if let Err(error) = served {
                say(Err(error));
            }
        })
        .map_err(StartError::Runtime)?;
    match is_ready.recv() {
        Ok(Ok(listening)) => Ok(RunningServer { listening, stop, thread: Some(thread) }),
        Ok(Err(error)) => Err(error),
        Err(_) => Err(StartError::Runtime(std::io::Error::other("the server's thread ended"))),
    }
}

impl RunningServer {
    /// Address that the server listens on.
    pub fn address(&self) -> SocketAddr {
        self.listening.address
    }

    /// Address of the status pages, if there are any.
    pub fn metrics(&self) -> Option<SocketAddr> {
        self.listening.metrics
    }

    /// Stops the server and waits until its sessions have ended.
    pub fn stop(mut self) {
        self.stop_and_join();
    }

    fn stop_and_join(&mut self) {
        let _ = self.stop.send(true);
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            tracing::error!("the server's thread ended abnormally");
        }
    }
}

impl Drop for RunningServer {
    fn drop(&mut self) {
        self.stop_and_join();
    }
}
