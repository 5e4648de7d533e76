//! Standing of a connection: not introduced yet, or a session with a place.

use std::time::Duration;

use tokio::time::{Instant, sleep_until};

use crate::client_connection::SessionError;
use crate::places::Place;
use crate::strangers::Guest;
use crate::tokens::BearerPlace;

/// Standing of a connection.
pub(crate) enum Standing {
    /// The client has not introduced itself.
    Stranger(Greeting),
    /// The client has introduced itself and has a session's place.
    Known { _place: Place, _of_token: Option<BearerPlace> },
}

/// Time and room that a connection has to introduce itself.
pub(crate) struct Greeting {
    /// Room among the connections that have not introduced themselves.
    pub guest: Guest,
    /// End of the time.
    pub until: Instant,
    /// Length of the time.
    pub limit: Duration,
}

impl Greeting {
    /// Ends when the time is over or another connection needs the room; returns why the connection is
    /// closed. May be dropped at any await.
    pub async fn ends(&self) -> SessionError {
        tokio::select! {
            () = sleep_until(self.until) => SessionError::Stranger(self.limit),
            () = self.guest.is_to_go() => SessionError::SentAway,
        }
    }
}

impl Standing {
    /// Whether the client has not introduced itself.
    pub fn is_stranger(&self) -> bool {
        matches!(self, Self::Stranger(_))
    }
}
