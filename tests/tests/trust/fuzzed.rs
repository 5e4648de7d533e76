//! Everything that takes bytes from outside, on damaged versions of real input: `fuzz/` does the same
//! without end, and what it found stays in `fuzz/found`.

use std::path::{Path, PathBuf};
use std::time::Duration;

use softgrasp_tests::parsers::Parser;
use softgrasp_tests::random::Random;
use softgrasp_tests::watchdog::within;

/// Number of damaged inputs for each parser, unless `FUZZ_ROUNDS` says another.
const ROUNDS: usize = 4000;
const LIMIT: Duration = Duration::from_secs(3600);

fn folder(name: &str, parser: Parser) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz").join(name).join(parser.name())
}

/// Contents of all files of a folder in the order of their names; empty if there is no folder.
fn files(folder: &Path) -> Vec<Vec<u8>> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.iter().map(|path| std::fs::read(path).unwrap()).collect()
}

/// Bytes that look like a number which a program might trust.
const TRAPS: [&[u8]; 10] = [
    b"\xff\xff\xff\xff",
    b"\x00\x00\x00\x80",
    b"4294967295",
    b"-1",
    b"1e999",
    b"nan",
    b"99999999999999999999",
    b"\n",
    b"\0",
    b"\x00\x00\x00\x00\x00\x00\xf8\x7f",
];

/// Damaged version of one of some inputs.
fn damaged(random: &mut Random, inputs: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = inputs[random.below(inputs.len())].clone();
    for _ in 0..1 + random.below(4) {
        let at = random.below(bytes.len() + 1);
        let end = (at + 1 + random.below(40)).min(bytes.len());
        match random.below(7) {
            0 if at < bytes.len() => bytes[at] ^= 1 << random.below(8),
            1 => bytes.truncate(at),
            2 => drop(bytes.drain(at..end)),
            3 => {
                let piece = bytes[at..end].to_vec();
                bytes.splice(at..at, piece);
            }
            4 => {
                let trap = TRAPS[random.below(TRAPS.len())];
                let end = (at + trap.len()).min(bytes.len());
                bytes.splice(at..end, trap.iter().copied());
            }
            5 => {
                let len = random.below(20);
                bytes.splice(at..at, random.bytes(len));
            }
            _ => {
                let other = &inputs[random.below(inputs.len())];
                let from = random.below(other.len() + 1);
                bytes.truncate(at);
                bytes.extend_from_slice(&other[from..]);
            }
        }
    }
    bytes
}

#[test]
fn real_input_found_input_and_damaged_input_never_break_a_parser() {
    let rounds = std::env::var("FUZZ_ROUNDS").ok().map(|text| text.parse().expect("a number"));
    let mut random = Random::from_environment("damaged input");
    within(LIMIT, "damaged input", move || {
        for parser in Parser::ALL {
            let seeds = files(&folder("seeds", parser));
            assert!(!seeds.is_empty(), "{} has no seeds", parser.name());
            for bytes in seeds.iter().chain(&files(&folder("found", parser))) {
                parser.take(bytes);
            }
            for round in 0..rounds.unwrap_or(ROUNDS) {
                let bytes = damaged(&mut random, &seeds);
                let taken = std::panic::catch_unwind(|| parser.take(&bytes));
                if taken.is_err() {
                    let path = std::env::temp_dir().join(format!("{}-{round}", parser.name()));
                    std::fs::write(&path, &bytes).unwrap();
                    panic!("{} breaks on {}", parser.name(), path.display());
                }
            }
        }
    });
}
