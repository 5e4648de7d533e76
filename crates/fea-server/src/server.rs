//! Listens for connections, accepts sessions, and stops them.

use std::net::SocketAddr;
use std::sync::{Arc, mpsc};
use std::time::Duration;

use softgrasp_protocol::asynchronous::Connection;
use softgrasp_protocol::{Limits, RejectCode, Rejected, Reply};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, watch};
use tokio::task::JoinSet;

use crate::config::{ConfigError, ServerConfig};
use crate::resources::Resources;
use crate::session::{self, ServerHandle};
use crate::uploads::Uploads;
use crate::workers::Workers;

/// Why a server did not start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// Settings make no sense.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The address cannot be listened on.
    #[error(
        "cannot listen on {address}: {source}; is another server running there? (--listen HOST:PORT, port 0 picks a free one)"
    )]
    Listen {
        /// The address.
        address: SocketAddr,
        /// The system's reason.
        source: std::io::Error,
    },
    /// No threads.
    #[error("cannot start {threads} solving threads: {source}")]
    Threads {
        /// Threads asked for.
        threads: usize,
        /// The system's reason.
        source: std::io::Error,
    },
    /// No runtime.
    #[error("cannot start the server's sockets: {0}")]
    Runtime(std::io::Error),
}

/// Sessions that are still at work this long after a stop are cut off.
const STOP_GRACE: Duration = Duration::from_secs(2);
/// Pause after a failed accept, so that a process out of file descriptors does not spin.
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);

/// Listens and serves until `stop` holds true; `on_ready` hears the address listened on.
///
/// # Errors
/// [`StartError`] if it cannot start; once it listens it does not fail.
pub async fn serve(
    config: ServerConfig,
    on_ready: impl FnOnce(SocketAddr),
    stop: watch::Receiver<bool>,
) -> Result<(), StartError> {
    config.check()?;
    let address = config.listen;
    let listen_error = |source| StartError::Listen { address, source };
    let listener = TcpListener::bind(address).await.map_err(listen_error)?;
    let threads = config.threads;
    let workers =
        Workers::new(threads).map_err(|source| StartError::Threads { threads, source })?;
    on_ready(listener.local_addr().map_err(listen_error)?);
    let places = Arc::new(Semaphore::new(config.max_sessions));
    let measure_at_start = config.measure_at_start;
    let resources = Arc::new(Resources::new(config, workers));
    if measure_at_start {
        let later = Arc::clone(&resources);
        resources.workers.in_background(move || {
            later.rates.get();
        });
    }
    let server = ServerHandle {
        resources,
        uploads: Uploads::default(),
        places: Arc::clone(&places),
        stop: stop.clone(),
    };
    let mut sessions = JoinSet::new();
    accept_until_stopped(&listener, &server, &places, stop, &mut sessions).await;
    drop(listener);
    tracing::info!(sessions = sessions.len(), "stopping");
    let all_done = async { while sessions.join_next().await.is_some() {} };
    if tokio::time::timeout(STOP_GRACE, all_done).await.is_err() {
        tracing::warn!("sessions still at work are cut off");
        sessions.abort_all();
    }
    Ok(())
}

async fn accept_until_stopped(
    listener: &TcpListener,
    server: &ServerHandle,
    places: &Arc<Semaphore>,
    mut stop: watch::Receiver<bool>,
    sessions: &mut JoinSet<()>,
) {
    loop {
        let accepted = tokio::select! {
            accepted = listener.accept() => accepted,
            () = session::stopped(&mut stop) => return,
            Some(_) = sessions.join_next(), if !sessions.is_empty() => continue,
        };
        match accepted {
            Ok((stream, peer)) => match Arc::clone(places).try_acquire_owned() {
                Ok(place) => {
                    let server = server.clone();
                    sessions.spawn(async move {
                        session::serve(stream, peer, server).await;
                        drop(place);
                    });
                }
                Err(_) => {
                    tracing::warn!(%peer, "turned away: all sessions are taken");
                    sessions.spawn(turn_away(stream));
                }
            },
            Err(error) => {
                tracing::error!(%error, "a connection could not be accepted");
                tokio::time::sleep(ACCEPT_PAUSE).await;
            }
        }
    }
}

/// Tells a client that there is no place, and closes.
async fn turn_away(stream: TcpStream) {
    let text = "all sessions of this server are taken (--max-sessions); try again later".to_owned();
    let reply = Reply::Rejected(Rejected { code: RejectCode::Busy, text, detail: String::new() });
    let mut bytes = Vec::new();
    if reply.encode_into(0, &Limits::default(), &mut bytes).is_ok() {
        let mut connection = Connection::new(stream, Limits::default());
        let _ = tokio::time::timeout(STOP_GRACE, connection.write_bytes(&bytes)).await;
    }
}

/// The runtime a server's sockets live on: one thread, which rests unless there is something to
/// read, write or answer at once, and then is not to wait for the threads that solve.
///
/// # Errors
/// The system's, when it gives no thread.
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
    address: SocketAddr,
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
            let served = runtime.block_on(serve(config, |address| say(Ok(address)), stopped));
            // Whatever the threads are at, a stop does not wait for them.
            runtime.shutdown_background();
            if let Err(error) = served {
                say(Err(error));
            }
        })
        .map_err(StartError::Runtime)?;
    match is_ready.recv() {
        Ok(Ok(address)) => Ok(RunningServer { address, stop, thread: Some(thread) }),
        Ok(Err(error)) => Err(error),
        Err(_) => Err(StartError::Runtime(std::io::Error::other("the server's thread ended"))),
    }
}

impl RunningServer {
    /// Address it listens on.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Stops it and waits until its sessions have ended.
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
