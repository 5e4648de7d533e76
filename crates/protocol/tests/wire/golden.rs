//! Each message's bytes, as they were when they were written down.
//!
//! `UPDATE_GOLDEN=1 cargo test -p softgrasp-protocol golden` writes them anew; a difference in a
//! file that was published means a new protocol version.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use softgrasp_protocol::Limits;

use crate::raw::only_frame;
use crate::samples::{Message, conversation, variants};

/// All messages that have a file, by its name.
fn recorded() -> Vec<(String, Message)> {
    let plain = conversation().into_iter().map(|message| (message.kind().to_string(), message));
    let variants = variants().into_iter().map(|(name, message)| (name.to_owned(), message));
    plain.chain(variants).collect()
}

#[test]
fn every_message_is_encoded_as_its_golden_bytes() {
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        for (name, message) in recorded() {
            std::fs::write(path(&name), hex(&message.encode())).unwrap();
        }
    }
    for (name, message) in recorded() {
        let golden = std::fs::read_to_string(path(&name)).unwrap();
        assert_eq!(hex(&message.encode()), golden, "{name}");
    }
    let files = std::fs::read_dir(folder()).unwrap().count();
    assert_eq!(files, recorded().len(), "one file for each message and no other");
}

#[test]
fn golden_bytes_are_decoded_to_their_messages() {
    for (name, message) in recorded() {
        let golden = std::fs::read_to_string(path(&name)).unwrap();
        let frame = only_frame(&bytes_of_hex(&golden));
        let decoded = Message::decode(&frame, &Limits::default()).unwrap();
        // NaN is not equal to itself.
        assert_eq!(format!("{decoded:?}"), format!("{message:?}"), "{name}");
    }
}

/// Hexadecimal text, sixteen bytes a line.
pub fn hex(bytes: &[u8]) -> String {
    let mut text = String::new();
    for line in bytes.chunks(16) {
        let digits: Vec<String> = line.iter().map(|byte| format!("{byte:02x}")).collect();
        writeln!(text, "{}", digits.join(" ")).unwrap();
    }
    text
}

/// The bytes that [`hex`] shows.
pub fn bytes_of_hex(text: &str) -> Vec<u8> {
    text.split_whitespace().map(|pair| u8::from_str_radix(pair, 16).unwrap()).collect()
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden")
}

fn path(name: &str) -> PathBuf {
    folder().join(format!("{name}.hex"))
}
