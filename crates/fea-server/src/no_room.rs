//! Why a request is not received.

/// The server has no memory to receive a request.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum NoRoom {
    #[error(
        "the request has {bytes} bytes; to receive and read it takes twice as much, and this server \
         has {limit} in all (--memory-limit)"
    )]
    Never { bytes: u64, limit: u64 },
    #[error(
        "the request has {bytes} bytes, and of the {limit} bytes of this server {taken} are taken \
         (--memory-limit); send it again later"
    )]
    Now { bytes: u64, limit: u64, taken: u64 },
}
