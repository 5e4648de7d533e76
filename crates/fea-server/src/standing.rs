//! What a connection is to the server: a stranger that may have to go, or a session with a place.

use std::time::Duration;

use tokio::time::{Instant, sleep_until};

use crate::client_connection::SessionError;
use crate::places::Place;
use crate::strangers::Guest;
use crate::tokens::BearerPlace;

/// What a connection is to the server.
pub(crate) enum Standing {
    /// It has not introduced itself.
    Stranger(Greeting),
    /// It has, and has a session's place.
    Known { _place: Place, _of_token: Option<BearerPlace> },
}

/// The time and the room that a connection has to introduce itself.
pub(crate) struct Greeting {
    /// Its room.
    pub guest: Guest,
    /// The end of its time.
    pub until: Instant,
    /// How long it was.
    pub limit: Duration,
}

impl Greeting {
    /// Ends when the time is over or somebody else needs the room: why the connection is closed. May be
    /// dropped at any await.
    pub async fn ends(&self) -> SessionError {
        tokio::select! {
            () = sleep_until(self.until) => SessionError::Stranger(self.limit),
            () = self.guest.is_to_go() => SessionError::SentAway,
        }
    }
}

impl Standing {
    /// Whether it has not introduced itself.
    pub fn is_stranger(&self) -> bool {
        matches!(self, Self::Stranger(_))
    }
}
