//! What all pages of a run share.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize};
use std::sync::mpsc::SyncSender;

use tokio::sync::watch;

use crate::from_page::Ask;
use crate::headset::Headset;
use crate::picture::Picture;
use crate::textures::Textures;
use crate::token::Token;

/// What all pages share.
pub struct Site {
    /// Who does not know it is refused.
    pub token: Token,
    /// What a page is told first.
    pub hello: String,
    /// Whether the run follows a headset's hand.
    pub takes_hands: bool,
    /// The newest picture.
    pub pictures: watch::Sender<Option<Arc<Picture>>>,
    /// Changes when the run is over.
    pub over: watch::Sender<bool>,
    /// Wishes on their way to the painter.
    pub asks: SyncSender<Ask>,
    /// The hand of a headset.
    pub headset: Headset,
    /// Pictures of surfaces.
    pub textures: Textures,
    /// How many pages look.
    pub viewers: Arc<AtomicUsize>,
    /// Pages so far.
    pub numbers: AtomicU64,
}
