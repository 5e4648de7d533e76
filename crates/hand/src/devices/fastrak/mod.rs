//! Polhemus FASTRAK: records, their world poses, and the parser of the tracker's byte stream.

mod decode;
mod encode;
mod fault;
mod flip;
mod parser;
mod record;

pub use encode::push_number;
pub use encode::{EncodeError, encode_record};
pub use fault::{FastrakFault, FastrakFaultKind};
pub use flip::{FlipWatch, HemisphereFlip};
pub use parser::{FastrakEvent, FastrakParser};
pub use record::{
    Attitude, Encoding, FastrakFormat, FastrakRecord, LengthUnit, OutputList, Station,
    StationError, world_from_transmitter,
};
