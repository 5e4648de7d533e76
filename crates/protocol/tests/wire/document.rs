//! `docs/wire.md` says what the code does.

use softgrasp_protocol::*;

use crate::golden::{bytes_of_hex, hex};
use crate::samples::{Message, sample, variants};

const DOCUMENT: &str = include_str!("../../../../docs/wire.md");

/// Cells of the tables under the heading `title`, without the first head.
fn table(title: &str) -> Vec<Vec<String>> {
    let rows = DOCUMENT
        .lines()
        .skip_while(|line| !line.starts_with('#') || line.trim_start_matches('#').trim() != title)
        .skip(1)
        .take_while(|line| !line.starts_with('#'))
        .filter(|line| line.starts_with('|'))
        .skip(2)
        .map(|line| line.trim_matches('|').split('|').map(|c| c.trim().to_owned()).collect());
    rows.collect()
}

#[test]
fn the_document_is_about_this_version() {
    assert!(DOCUMENT.contains(&format!("| 4 | u16 | protocol version, {VERSION} |")));
    assert!(DOCUMENT.contains(&format!("\nVERSION = {VERSION}\n")), "the Python example");
    assert!(!DOCUMENT.contains("magic, version 3"), "notes of the examples");
}

/// Names of a structure's fields, from its `{:#?}`, which has them in the order of the wire.
fn fields(debug: &str) -> Vec<String> {
    let lines = debug.lines().filter(|line| line.starts_with("    ") && !line.starts_with("     "));
    lines.filter_map(|line| Some(line.trim().split_once(": ")?.0.to_owned())).collect()
}

/// First cells of the rows under the heading `title`.
fn first_cells(title: &str) -> Vec<String> {
    table(title).iter().map(|row| row[0].trim_matches('`').to_owned()).collect()
}

#[test]
fn the_document_lists_every_field_of_the_report_in_order() {
    let known = fields(&format!("{:#?}", SolveReport::default()));
    let stages = fields(&format!("{:#?}", StageMs::default()));
    assert!(!known.is_empty() && !stages.is_empty());
    // The second table of the section, with its head, is that of the stages.
    let head = ["Field".to_owned(), "---".to_owned()];
    assert_eq!(first_cells("SolveReport"), [known, head.to_vec(), stages].concat());
}

#[test]
fn the_document_lists_every_field_of_ask_and_report_of_large_deformation() {
    let ask = fields(&format!("{:#?}", LargeAsk::default()));
    let report = fields(&format!("{:#?}", LargeReport::default()));
    assert_eq!((ask.len(), report.len()), (5, 11));
    assert_eq!(first_cells("LargeAsk"), ask);
    assert_eq!(first_cells("LargeReport"), report);
}

#[test]
fn the_document_lists_every_field_of_ask_and_report_of_contact() {
    let Message::Request(_, Request::ContactFrame(frame)) = sample(Kind::ContactFrame) else {
        panic!("another message")
    };
    assert_eq!(first_cells("ContactAsk"), fields(&format!("{:#?}", frame.ask)));
    let report = fields(&format!("{:#?}", ContactReport::default()));
    assert_eq!(first_cells("ContactReport"), report);
}

/// Variants as the document writes them: number on the wire and name, separated by commas.
fn numbered<T>(variants: &[T]) -> String
where
    T: std::fmt::Debug + wincode::Serialize<Src = T>,
{
    let text = |variant: &T| {
        let bytes = wincode::serialize(variant).unwrap();
        format!("{} {variant:?}", u32::from_le_bytes(bytes.try_into().unwrap()))
    };
    variants.iter().map(text).collect::<Vec<_>>().join(", ")
}

#[test]
fn the_document_numbers_the_choices_of_large_deformation() {
    let known = [
        ("LargeAsk", 0, numbered(&[Deformation::Large, Deformation::Auto, Deformation::Linear])),
        ("LargeAsk", 1, numbered(&[LawName::NeoHookean, LawName::NeoHookeanLog])),
        ("LargeAsk", 3, numbered(&[PathChoice::Continue, PathChoice::FromRest])),
        ("LargeAsk", 4, numbered(&[Pace::Repeatable, Pace::Timely])),
        ("ContactAsk", 9, numbered(&[LawName::NeoHookean, LawName::NeoHookeanLog])),
    ];
    for (title, row, variants) in known {
        assert_eq!(table(title)[row][1], format!("enum: {variants}"));
    }
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
fn the_document_numbers_the_warnings() {
    let known = [
        ("ROTATION", WarningCode::ROTATION),
        ("STRAIN", WarningCode::STRAIN),
        ("DIGITS", WarningCode::DIGITS),
        ("LATE", WarningCode::LATE),
        ("ERROR", WarningCode::ERROR),
        ("CHOICE", WarningCode::CHOICE),
        ("LOCKING", WarningCode::LOCKING),
        ("HOLD", WarningCode::HOLD),
        ("SNAP", WarningCode::SNAP),
        ("CREASE", WarningCode::CREASE),
        ("PREPARING", WarningCode::PREPARING),
    ];
    let known: Vec<String> =
        known.iter().map(|(name, WarningCode(n))| format!("{n} {name}")).collect();
    let written: Vec<String> =
        table("Warnings").iter().map(|row| format!("{} {}", row[0], row[1])).collect();
    assert_eq!(written, known);
}

#[test]
fn the_document_lists_every_field() {
    let known: Vec<Vec<String>> = Field::ALL
        .iter()
        .map(|field| {
            let place = match field.place() {
                FieldPlace::Elements => "elements",
                FieldPlace::Nodes => "nodes",
            };
            let name = format!("`{}`", field.name());
            let numbers = field.components().to_string();
            let cells = [&field.bit().to_string(), &name, place, &numbers, field.unit()];
            cells.map(str::to_owned).to_vec()
        })
        .collect();
    let written: Vec<Vec<String>> =
        table("Fields").iter().take(known.len()).map(|row| row[..5].to_vec()).collect();
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
    let variant = |name| variants().into_iter().find(|(known, _)| *known == name).unwrap().1;
    let messages = [
        sample(Kind::Ping),
        sample(Kind::Ask),
        variant("Ask-large"),
        variant("Answer-large"),
        sample(Kind::Answer),
    ];
    assert_eq!(shown, messages.map(|message| hex(&message.encode())));
}

/// The bytes of a block whose lines may end in `; a note`.
fn without_notes(block: &str) -> String {
    block
        .lines()
        .map(|line| line.split(';').next().unwrap_or_default())
        .collect::<Vec<_>>()
        .join(" ")
}
