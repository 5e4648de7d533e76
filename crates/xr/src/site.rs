//! State that all pages of a run share.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize};
use std::sync::mpsc::SyncSender;

use tokio::sync::watch;

use crate::from_page::Ask;
use crate::headset::Headset;
use crate::picture::Picture;
use crate::textures::Textures;
use crate::token::Token;

/// State that all pages of a run share.
pub struct Site {
    /// Token that a request must show.
    pub token: Token,
    /// First message to a page.
    pub hello: String,
    /// Whether the run follows a headset's hand.
    pub takes_hands: bool,
    /// Newest picture.
    pub pictures: watch::Sender<Option<Arc<Picture>>>,
    /// True once the run is over.
    pub over: watch::Sender<bool>,
    /// Channel for wishes to the painter.
    pub asks: SyncSender<Ask>,
    /// The hand of a headset.
    pub headset: Headset,
    /// Textures of object and hand.
    pub textures: Textures,
    /// Number of open pages.
    pub viewers: Arc<AtomicUsize>,
    /// Number of pages that were ever opened, from which each gets its own number.
    pub numbers: AtomicU64,
}
