//! Each kind's bytes, as they were when they were written down.
//!
//! `UPDATE_GOLDEN=1 cargo test -p softgrasp-protocol golden` writes them anew; a difference in a
//! file that was published means a new protocol version.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use softgrasp_protocol::Limits;

use crate::raw::only_frame;
use crate::samples::{Message, conversation};

#[test]
fn every_kind_is_encoded_as_its_golden_bytes() {
    let folder = folder();
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        for message in conversation() {
            std::fs::write(path(&folder, &message), hex(&message.encode())).unwrap();
        }
    }
    for message in conversation() {
        let path = path(&folder, &message);
        let golden = std::fs::read_to_string(&path).unwrap();
        assert_eq!(hex(&message.encode()), golden, "{}", path.display());
    }
    let files = std::fs::read_dir(&folder).unwrap().count();
    assert_eq!(files, conversation().len(), "one file for each kind and no other");
}

#[test]
fn golden_bytes_are_decoded_to_their_messages() {
    for message in conversation() {
        let golden = std::fs::read_to_string(path(&folder(), &message)).unwrap();
        let frame = only_frame(&bytes_of_hex(&golden));
        assert_eq!(Message::decode(&frame, &Limits::default()).unwrap(), message);
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

fn path(folder: &Path, message: &Message) -> PathBuf {
    folder.join(format!("{}.hex", message.kind()))
}
