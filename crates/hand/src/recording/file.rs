//! The file of a recording: MCAP, JSON messages with their schemas.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use mcap::records::MessageHeader;
use mcap::{McapResult, WriteOptions, Writer};
use serde::Serialize;

use super::channels::Channel;

/// A recording's file that is being written.
pub struct RecordingFile {
    writer: Writer<BufWriter<File>>,
    /// Number of each channel in the file, in the order of [`Channel::ALL`].
    ids: Vec<u16>,
    sequence: u32,
}

/// Bytes of a device, as a message.
#[derive(Serialize, serde::Deserialize)]
pub struct DeviceBytes {
    /// Arrival of the first byte, s; `None` stands for the time of the tick.
    pub at_s: Option<f64>,
    /// Whether the bytes are one datagram.
    #[serde(default)]
    pub datagram: bool,
    /// The bytes, two hexadecimal digits each.
    pub hex: String,
}

impl RecordingFile {
    /// Begins a file of a run of one hand or of two; an older one of this name is replaced.
    ///
    /// # Errors
    /// The error of the operating system or of the MCAP library.
    pub fn create(path: &Path, has_second: bool) -> McapResult<Self> {
        let options = WriteOptions::new()
            .compression(None)
            .library(concat!("softgrasp glove-client ", env!("CARGO_PKG_VERSION")));
        let mut writer = options.create(BufWriter::new(File::create(path)?))?;
        let mut ids = Vec::with_capacity(Channel::ALL.len());
        let channels = Channel::ALL.into_iter();
        for channel in channels.filter(|channel| has_second || !channel.is_of_second()) {
            let schema = channel.schema().to_string();
            let schema =
                writer.add_schema(channel.schema_name(), "jsonschema", schema.as_bytes())?;
            ids.push(writer.add_channel(schema, channel.topic(), "json", &BTreeMap::new())?);
        }
        Ok(Self { writer, ids, sequence: 0 })
    }

    /// Writes a message to a channel.
    ///
    /// Units: `at_s` s on the client's clock.
    ///
    /// # Errors
    /// The error of the operating system.
    pub fn write(
        &mut self,
        channel: Channel,
        at_s: f64,
        message: &impl Serialize,
    ) -> McapResult<()> {
        let at = Channel::ALL.iter().position(|known| *known == channel);
        let Some(&channel_id) = at.and_then(|at| self.ids.get(at)) else { return Ok(()) };
        // Our messages are plain numbers and texts: they have a JSON form.
        let Ok(data) = serde_json::to_vec(message) else { return Ok(()) };
        let log_time = (at_s.max(0.0) * 1e9) as u64;
        let header =
            MessageHeader { channel_id, sequence: self.sequence, log_time, publish_time: log_time };
        self.sequence = self.sequence.wrapping_add(1);
        self.writer.write_to_known_channel(&header, &data)
    }

    /// Writes all messages so far to the file: a program that ends abnormally loses only what comes after
    /// them.
    ///
    /// # Errors
    /// The error of the operating system.
    pub fn flush(&mut self) -> McapResult<()> {
        self.writer.flush()
    }

    /// Ends the file with its index.
    ///
    /// # Errors
    /// The error of the operating system.
    pub fn finish(mut self) -> McapResult<()> {
        self.writer.finish().map(drop)
    }
}

/// Two hexadecimal digits for each byte.
pub fn hex_of(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 16] = b"0123456789abcdef";
    let digit = |value: u8| char::from(DIGITS[usize::from(value)]);
    bytes.iter().flat_map(|byte| [digit(byte >> 4), digit(byte & 15)]).collect()
}

/// The bytes of a text of two hexadecimal digits each; `None` for any other text.
pub fn bytes_of(hex: &str) -> Option<Vec<u8>> {
    let (pairs, rest) = hex.as_bytes().as_chunks::<2>();
    let digit = |c: u8| char::from(c).to_digit(16).map(|value| value as u8);
    let bytes = pairs.iter().map(|[high, low]| Some(digit(*high)? << 4 | digit(*low)?));
    rest.is_empty().then(|| bytes.collect()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_come_back_from_their_digits() {
        let all: Vec<u8> = (0..=255).collect();
        assert_eq!(bytes_of(&hex_of(&all)), Some(all));
        assert_eq!(hex_of(&[0, 0x4f, 0xff]), "004fff");
        for wrong in ["0", "0g", "+1", "é"] {
            assert_eq!(bytes_of(wrong), None, "{wrong}");
        }
    }
}
