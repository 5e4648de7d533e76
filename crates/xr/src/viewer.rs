//! One open page: it gets the newest picture whenever it has drawn the ones before.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use axum::extract::ws::{CloseFrame, Message, WebSocket, close_code};
use tokio::time::timeout;

use crate::from_page::{Ask, FromPage, FromPageError};
use crate::picture::Picture;
use crate::site::Site;
use crate::to_page::picture_message;

/// Largest number of pictures that are sent and not drawn: one being drawn, one on the way.
const ON_THE_WAY_MAX: u32 = 2;
/// Time after which a page that takes no bytes is given up.
const SEND_MAX: Duration = Duration::from_secs(10);
/// Time between two signs of life asked from a page, and the silence after which it is given up.
const BEAT: Duration = Duration::from_secs(5);
const SILENCE_MAX: Duration = Duration::from_secs(20);

/// An open page and the pictures it has drawn.
struct Viewer {
    socket: WebSocket,
    site: Arc<Site>,
    number: u64,
    last: Option<Arc<Picture>>,
    /// Number of the newest picture that was sent, and of the newest that was drawn.
    sent: u32,
    drawn: u32,
    stamp_ms: f64,
    status: Option<Arc<str>>,
    /// Versions of the hands that the page has.
    hand_versions: [u32; 2],
    heard: Instant,
}

/// Why the connection to a page ends.
enum Left {
    /// The page has gone, or takes no bytes.
    Gone,
    /// The page sent bytes that are no message.
    Wrong(FromPageError),
    /// The run is over.
    Over,
}

/// Counts an open page until it is dropped.
struct Present(Arc<AtomicUsize>);

impl Present {
    fn new(viewers: &Arc<AtomicUsize>) -> Self {
        viewers.fetch_add(1, Ordering::Relaxed);
        Self(Arc::clone(viewers))
    }
}

impl Drop for Present {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Serves a page until it goes or the run is over.
pub async fn attend(socket: WebSocket, site: Arc<Site>, number: u64) {
    let _present = Present::new(&site.viewers);
    let mut viewer = Viewer {
        socket,
        number,
        last: None,
        sent: 0,
        drawn: 0,
        stamp_ms: f64::NAN,
        status: None,
        hand_versions: [0; 2],
        heard: Instant::now(),
        site: Arc::clone(&site),
    };
    let left = viewer.attend().await;
    site.headset.gone(number);
    let (code, reason) = match &left {
        Left::Gone => return,
        Left::Wrong(error) => (close_code::INVALID, error.to_string()),
        Left::Over => (close_code::AWAY, "the run is over".to_owned()),
    };
    tracing::debug!(reason, "page left");
    // A reason has at most 123 bytes.
    let reason: String = reason.chars().take(100).collect();
    let close = Message::Close(Some(CloseFrame { code, reason: reason.into() }));
    let _ = timeout(Duration::from_secs(1), viewer.socket.send(close)).await;
}

impl Viewer {
    async fn attend(&mut self) -> Left {
        let mut pictures = self.site.pictures.subscribe();
        let mut over = self.site.over.subscribe();
        let hello = Message::text(self.site.hello.clone());
        if self.send(hello).await.is_err() {
            return Left::Gone;
        }
        pictures.mark_changed();
        let mut beat = tokio::time::interval(BEAT);
        loop {
            let may_send = self.sent.wrapping_sub(self.drawn) < ON_THE_WAY_MAX;
            let done = tokio::select! {
                message = self.socket.recv() => self.take(message),
                changed = pictures.changed(), if may_send => {
                    let newest = pictures.borrow_and_update().clone();
                    match (changed, newest) {
                        (Ok(()), Some(picture)) => self.show(picture).await,
                        (Ok(()), None) => Ok(()),
                        (Err(_), _) => Err(Left::Over),
                    }
                }
                _ = beat.tick() => self.beat().await,
                _ = over.changed() => Err(Left::Over),
            };
            if let Err(left) = done {
                return left;
            }
        }
    }

    async fn send(&mut self, message: Message) -> Result<(), Left> {
        match timeout(SEND_MAX, self.socket.send(message)).await {
            Ok(Ok(())) => Ok(()),
            Ok(Err(_)) | Err(_) => Err(Left::Gone),
        }
    }

    async fn beat(&mut self) -> Result<(), Left> {
        if self.heard.elapsed() > SILENCE_MAX {
            return Err(Left::Gone);
        }
        self.send(Message::Ping(Vec::new().into())).await
    }

    /// Sends the parts of a picture that the page has not drawn yet.
    async fn show(&mut self, picture: Arc<Picture>) -> Result<(), Left> {
        let before = self.last.take();
        if before.as_ref().is_none_or(|before| before.object.version != picture.object.version) {
            self.send(Message::binary(picture.object.message.clone())).await?;
        }
        for (which, hand) in picture.hands.iter().enumerate() {
            if let Some((hand, _)) = hand
                && hand.version != self.hand_versions[which]
            {
                self.hand_versions[which] = hand.version;
                self.send(Message::binary(hand.message.clone())).await?;
            }
        }
        if self.status.as_ref().is_none_or(|told| !Arc::ptr_eq(told, &picture.status)) {
            self.status = Some(Arc::clone(&picture.status));
            self.send(Message::text(picture.status.to_string())).await?;
        }
        self.sent = self.sent.wrapping_add(1);
        let message = picture_message(&picture, before.as_deref(), self.sent, self.stamp_ms);
        self.last = Some(picture);
        self.send(Message::binary(message)).await
    }

    fn take(&mut self, message: Option<Result<Message, axum::Error>>) -> Result<(), Left> {
        let Some(Ok(message)) = message else { return Err(Left::Gone) };
        let now = Instant::now();
        self.heard = now;
        match message {
            Message::Binary(bytes) => match FromPage::read(&bytes).map_err(Left::Wrong)? {
                FromPage::Ack(ack) => {
                    // Only a picture that is on its way can have been drawn.
                    let is_newer = ack.number.wrapping_sub(self.drawn);
                    if (1..=self.sent.wrapping_sub(self.drawn)).contains(&is_newer) {
                        self.drawn = ack.number;
                    }
                    self.stamp_ms = ack.stamp_ms;
                    if let Some(ms) = ack.hand_to_picture_ms {
                        self.site.headset.took(ms);
                    }
                }
                FromPage::Joints(record) => {
                    if self.site.takes_hands {
                        self.site.headset.take(self.number, &record, now);
                    }
                }
            },
            Message::Text(text) => {
                let ask = Ask::read(&text).map_err(Left::Wrong)?;
                // Who asks for more than the run can do is not heard.
                let _ = self.site.asks.try_send(ask);
            }
            Message::Ping(_) | Message::Pong(_) => {}
            Message::Close(_) => return Err(Left::Gone),
        }
        Ok(())
    }
}
