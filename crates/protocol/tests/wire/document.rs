//! `docs/wire.md` says what the code does.

use softgrasp_protocol::*;

use crate::golden::{bytes_of_hex, hex};
use crate::samples::conversation;

const DOCUMENT: &str = include_str!("../../../../docs/wire.md");

/// Cells of the table under the heading `## title`, without its head.
fn table(title: &str) -> Vec<Vec<String>> {
    let rows = DOCUMENT
        .lines()
        .skip_while(|line| *line != format!("## {title}"))
        .skip(1)
        .take_while(|line| !line.starts_with('#'))
        .filter(|line| line.starts_with('|'))
        .skip(2)
        .map(|line| line.trim_matches('|').split('|').map(|c| c.trim().to_owned()).collect());
    rows.collect()
}

#[test]
fn the_document_lists_every_kind() {
    let written: Vec<String> =
        table("Messages").iter().map(|row| format!("{} {}", row[0], row[1])).collect();
    let known: Vec<String> =
        Kind::ALL.iter().map(|kind| format!("{:#06x} `{kind}`", kind.number())).collect();
    assert_eq!(written, known);
}

#[test]
fn the_document_lists_every_reject_code() {
    let written: Vec<String> =
        table("Reject codes").iter().map(|row| format!("{} {}", row[0], row[1])).collect();
    let known: Vec<String> =
        RejectCode::ALL.iter().map(|code| format!("{} `{code}`", code.number())).collect();
    assert_eq!(written, known);
}

#[test]
fn the_document_lists_the_default_limits() {
    let limits = Limits::default();
    let known = [
        ("payload_len_max", limits.payload_len_max as usize),
        ("node_count_max", limits.node_count_max as usize),
        ("tet_count_max", limits.tet_count_max as usize),
        ("dof_count_max", limits.dof_count_max as usize),
        ("material_count_max", limits.material_count_max as usize),
        ("text_len_max", limits.text_len_max as usize),
        ("PART_LEN_MAX", PART_LEN_MAX),
    ];
    let known: Vec<String> = known.iter().map(|(name, n)| format!("`{name}` {n}")).collect();
    let written: Vec<String> =
        table("Limits").iter().map(|row| format!("{} {}", row[0], row[1])).collect();
    assert_eq!(written, known);
}

#[test]
fn the_examples_of_the_document_are_real_frames() {
    let blocks = DOCUMENT.split("```hex\n").skip(1).map(|rest| rest.split("```").next().unwrap());
    let shown: Vec<String> =
        blocks.map(|block| hex(&bytes_of_hex(&without_notes(block)))).collect();
    let frames = |kind: Kind| {
        let message = conversation().into_iter().find(|message| message.kind() == kind).unwrap();
        hex(&message.encode())
    };
    assert_eq!(shown, [frames(Kind::Ping), frames(Kind::SolveOnce)]);
}

/// The bytes of a block whose lines may end in `; a note`.
fn without_notes(block: &str) -> String {
    block
        .lines()
        .map(|line| line.split(';').next().unwrap_or_default())
        .collect::<Vec<_>>()
        .join(" ")
}
