//! Listens for connections, accepts sessions, and stops them.

use std::net::SocketAddr;
use std::sync::{Arc, mpsc};
use std::time::Duration;

use softgrasp_protocol::asynchronous::Connection;
use softgrasp_protocol::{Limits, RejectCode, Rejected, Reply};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::watch;
use tokio::task::JoinSet;

use crate::config::{ConfigError, ServerConfig};
use crate::places::{NoPlace, Places};
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
/// A silent peer is asked whether it is there after this long, and again so often; the system gives it
/// up after some questions without an answer.
const ALIVE_AFTER: Duration = Duration::from_secs(30);
const ALIVE_EVERY: Duration = Duration::from_secs(10);
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
    let places = Places::new(config.max_sessions, config.max_sessions_per_address);
    let measure_at_start = config.measure_at_start;
    let resources = Arc::new(Resources::new(config, workers));
    if measure_at_start {
        let later = Arc::clone(&resources);
        resources.workers.in_background(move || {
            later.rates.get();
        });
    }
    let server =
        ServerHandle { resources, uploads: Uploads::default(), places, stop: stop.clone() };
    let mut sessions = JoinSet::new();
    accept_until_stopped(&listener, &server, stop, &mut sessions).await;
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
            Ok((stream, peer)) => {
                if let Err(error) = make_ready(&stream) {
                    tracing::warn!(%peer, %error, "a connection could not be set up");
                }
                sessions.spawn(attend(stream, peer, server.clone()));
            }
            Err(error) => {
                tracing::error!(%error, "a connection could not be accepted");
                tokio::time::sleep(ACCEPT_PAUSE).await;
            }
        }
    }
}

/// A frame is sent at once, and a peer that is gone without a word is noticed.
fn make_ready(stream: &TcpStream) -> std::io::Result<()> {
    stream.set_nodelay(true)?;
    let alive = socket2::TcpKeepalive::new().with_time(ALIVE_AFTER).with_interval(ALIVE_EVERY);
    socket2::SockRef::from(stream).set_tcp_keepalive(&alive)
}

/// Serves a connection if there is a place for it, encrypted if the server is; else says why not.
async fn attend(stream: TcpStream, peer: SocketAddr, server: ServerHandle) {
    let place = server.places.take(peer.ip());
    let config = &server.resources.config;
    let Some(encryption) = &config.encryption else {
        return match place {
            Ok(_place) => session::serve(stream, peer, server).await,
            Err(why) => turn_away(stream, peer, why).await,
        };
    };
    // A handshake costs: whoever has no place does not get one.
    let _place = match place {
        Ok(place) => place,
        Err(why) => return tracing::warn!(%peer, %why, "turned away"),
    };
    let handshake = encryption.acceptor().accept(stream);
    let mut stop = server.stop.clone();
    let shaken = tokio::select! {
        shaken = tokio::time::timeout(config.greeting_limit, handshake) => shaken,
        () = session::stopped(&mut stop) => return,
    };
    match shaken {
        Ok(Ok(stream)) => session::serve(stream, peer, server).await,
        Ok(Err(error)) => tracing::warn!(%peer, %error, "TLS could not be agreed on"),
        Err(_) => tracing::warn!(%peer, "TLS was not agreed on in time"),
    }
}

/// Tells a client that there is no place, and closes.
async fn turn_away(stream: TcpStream, peer: SocketAddr, why: NoPlace) {
    tracing::warn!(%peer, %why, "turned away");
    let text = why.to_string();
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
