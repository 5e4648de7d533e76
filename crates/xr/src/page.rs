//! The page of a run: opened before the run, begun with it, closed after it.

use std::io;
use std::net::{IpAddr, SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

use softgrasp_hand::joints::JointsFeed;
use softgrasp_window::view::colour_map::ColourMap;
use softgrasp_window::view::outlet::{Outlet, outlet};
use tokio::sync::watch;
use tokio_rustls::TlsAcceptor;

use crate::from_page::Ask;
use crate::headset::{HandToPicture, Headset};
use crate::listening::serve;
use crate::painter::{Easel, Painter, ShownRun};
use crate::routes::routes;
use crate::site::Site;
use crate::status::Hello;
use crate::textures::Textures;
use crate::token::{NoRandomNumbers, Token};

/// Time between two frames that are offered to the painter.
const FRAMES_EVERY: Duration = Duration::from_millis(8);
/// Largest number of wishes that wait.
const ASKS_MAX: usize = 16;
/// Longest time for telling the pages that the run is over.
const GOODBYE: Duration = Duration::from_millis(300);

/// Settings of a page.
pub struct PageOptions {
    /// Address that the page is served at.
    pub address: SocketAddr,
    /// Acceptor of TLS connections; `None`: no encryption. Browsers give hand tracking only to encrypted
    /// pages, and to those of their own machine.
    pub encryption: Option<TlsAcceptor>,
    /// Whether the run follows the hand of a headset.
    pub takes_hands: bool,
}

/// Why a page cannot be served.
#[derive(Debug, thiserror::Error)]
pub enum PageError {
    /// The port cannot be opened.
    #[error("cannot serve the page at {address}")]
    Listen {
        /// Address as it was given.
        address: SocketAddr,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The page's threads cannot be started.
    #[error("cannot start a thread for the page")]
    Thread(#[source] io::Error),
    /// No random token can be made.
    #[error(transparent)]
    Token(#[from] NoRandomNumbers),
}

/// A page that is served on threads of its own until it is dropped.
///
/// To be opened before its owner asks for real-time priority, which new threads would inherit.
pub struct Page {
    site: Arc<Site>,
    address: String,
    asked: Option<Receiver<Ask>>,
    server: Option<JoinHandle<()>>,
    painter: Option<JoinHandle<()>>,
    stop: Arc<AtomicBool>,
}

impl Page {
    /// Serves the page; a run is shown only after [`Page::begin`].
    ///
    /// # Errors
    /// [`PageError`], above all for a port that is taken.
    pub fn open(options: PageOptions) -> Result<Self, PageError> {
        let PageOptions { address, encryption, takes_hands } = options;
        let listen = |source| PageError::Listen { address, source };
        let listener = std::net::TcpListener::bind(address).map_err(listen)?;
        listener.set_nonblocking(true).map_err(listen)?;
        let bound = listener.local_addr().map_err(listen)?;
        let (asks, asked) = sync_channel(ASKS_MAX);
        let ramp = ColourMap::new().table().as_flattened().to_vec();
        let site = Arc::new(Site {
            token: Token::random()?,
            hello: Hello::new(ramp, takes_hands).text(),
            takes_hands,
            pictures: watch::channel(None).0,
            over: watch::channel(false).0,
            asks,
            headset: Headset::default(),
            textures: Textures::default(),
            viewers: Arc::new(AtomicUsize::new(0)),
            numbers: AtomicU64::new(0),
        });
        let scheme = if encryption.is_some() { "https" } else { "http" };
        let host = SocketAddr::new(reachable(bound.ip()), bound.port());
        let address = format!("{scheme}://{host}/{}/", site.token.as_str());
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        let runtime = runtime.map_err(PageError::Thread)?;
        let listener = {
            let _inside = runtime.enter();
            tokio::net::TcpListener::from_std(listener).map_err(listen)?
        };
        let (routes, over) = (routes(Arc::clone(&site)), site.over.subscribe());
        let server = std::thread::Builder::new().name("page".to_owned()).spawn(move || {
            runtime.block_on(async {
                serve(listener, encryption, routes, over).await;
                tokio::time::sleep(GOODBYE).await;
            });
            runtime.shutdown_background();
        });
        Ok(Self {
            site,
            address,
            asked: Some(asked),
            server: Some(server.map_err(PageError::Thread)?),
            painter: None,
            stop: Arc::new(AtomicBool::new(false)),
        })
    }

    /// The address for a browser, with its token.
    pub fn address(&self) -> &str {
        &self.address
    }

    /// Feed of the joints of a headset's hand.
    pub fn joints(&self) -> JointsFeed {
        self.site.headset.feed()
    }

    /// Times from tracked hands to pictures; `None` if no headset sent a hand.
    pub fn hand_to_picture(&self) -> Option<HandToPicture> {
        self.site.headset.hand_to_picture()
    }

    /// Shows a run from now on; the ticks offer their frames to the returned outlet.
    ///
    /// # Errors
    /// Error of the operating system if it starts no thread, or if a run has begun already.
    pub fn begin(&mut self, run: ShownRun) -> io::Result<Outlet> {
        let Some(asked) = self.asked.take() else {
            return Err(io::Error::other("the page shows a run already"));
        };
        let (out, inlet) = outlet(FRAMES_EVERY);
        let easel = Easel {
            pictures: self.site.pictures.clone(),
            asked,
            viewers: Arc::clone(&self.site.viewers),
            textures: self.site.textures.clone(),
            stop: Arc::clone(&self.stop),
        };
        let painter = Painter::new(run, easel, inlet);
        let thread = std::thread::Builder::new().name("painter".to_owned());
        self.painter = Some(thread.spawn(move || painter.work())?);
        Ok(out)
    }

    #[cfg(test)]
    pub(crate) fn site(&self) -> &Arc<Site> {
        &self.site
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.site.over.send_replace(true);
        for thread in [self.painter.take(), self.server.take()].into_iter().flatten() {
            if thread.join().is_err() {
                tracing::error!("a thread of the page ended abnormally");
            }
        }
    }
}

/// Address by which other machines reach a page that listens on all addresses of this one.
fn reachable(ip: IpAddr) -> IpAddr {
    if !ip.is_unspecified() {
        return ip;
    }
    // Nothing is sent: the system only says from where it would be.
    let (from, to) = match ip {
        IpAddr::V4(_) => ("0.0.0.0:0", "192.0.2.1:9"),
        IpAddr::V6(_) => ("[::]:0", "[2001:db8::1]:9"),
    };
    let asked = UdpSocket::bind(from).and_then(|socket| {
        socket.connect(to)?;
        socket.local_addr()
    });
    let local = if ip.is_ipv4() {
        IpAddr::from([127, 0, 0, 1])
    } else {
        IpAddr::from([0, 0, 0, 0, 0, 0, 0, 1])
    };
    asked.map_or(local, |address| address.ip())
}

#[cfg(test)]
#[path = "page_tests.rs"]
mod tests;
