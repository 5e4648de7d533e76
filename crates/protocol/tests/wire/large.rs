//! A message for large deformation is the plain message with one structure more in its part.

use softgrasp_protocol::*;

use crate::raw::{only_frame, raw_frame};
use crate::samples::{Message, conversation};

/// Length of a [`LargeAsk`] without yield stress: five fields, the third one byte.
const ASK_LEN: usize = 17;
/// Length of the model's name, the field before the ask of a frame.
const HASH_LEN: usize = 32;
/// Length of a mesh's counts and the choice of an element, the fields before the ask of a solve.
const MESH_LEN: usize = 17;
/// Length of a [`LargeReport`] with an estimate.
const REPORT_LEN: usize = 55;

/// The message of a kind in the conversation.
fn sample(kind: Kind) -> Message {
    conversation().into_iter().find(|message| message.kind() == kind).unwrap()
}

fn payload_of(message: &Message) -> Vec<u8> {
    only_frame(&message.encode()).payload.to_vec()
}

/// `payload` with `more` behind the first `at` bytes of its part of `part_len` bytes.
fn with_field(payload: &[u8], at: usize, more: &[u8], part_len: usize) -> Vec<u8> {
    let mut part = [&payload[..at], more, &payload[at..part_len]].concat();
    part.resize(part.len().next_multiple_of(8), 0);
    [&part, &payload[part_len.next_multiple_of(8)..]].concat()
}

#[test]
fn a_large_solve_is_a_solve_with_an_ask_behind_the_element() {
    let Message::Request(id, Request::SolveOnce(solve)) = sample(Kind::SolveOnce) else {
        panic!("another kind")
    };
    let plain = payload_of(&Message::Request(id, Request::SolveOnce(solve.clone())));
    let SolveOnce { mesh, materials, element, question } = *solve;
    let large = LargeAsk::default();
    let request = SolveLarge { mesh, materials, element, large, question };
    let sent = payload_of(&Message::Request(id, Request::SolveLarge(Box::new(request))));
    // The part of the example of `docs/wire.md` has 72 bytes.
    assert_eq!(sent, with_field(&plain, MESH_LEN, &[0; ASK_LEN], 72));
}

#[test]
fn a_large_frame_is_a_frame_with_an_ask_behind_the_model() {
    let Message::Request(id, Request::Frame(frame)) = sample(Kind::Frame) else {
        panic!("another kind")
    };
    let plain = payload_of(&Message::Request(id, Request::Frame(frame.clone())));
    let FrameRequest { model, question } = frame;
    let request = LargeFrame { model, large: LargeAsk::default(), question };
    let sent = payload_of(&Message::Request(id, Request::LargeFrame(Box::new(request))));
    // Name, method, listed nodes, reactions, precision, one option of two, four counts.
    let part_len = HASH_LEN + (8 + 4) + 8 + 1 + 4 + (9 + 1) + 16;
    assert_eq!(sent, with_field(&plain, HASH_LEN, &[0; ASK_LEN], part_len));
}

#[test]
fn a_large_answer_is_an_answer_with_a_report_behind_its_part() {
    let Message::Reply(id, Reply::LargeAnswer(sent)) = sample(Kind::LargeAnswer) else {
        panic!("another kind")
    };
    let plain = payload_of(&Message::Reply(id, Reply::Answer(Box::new(sent.answer.clone()))));
    let payload = payload_of(&Message::Reply(id, Reply::LargeAnswer(sent)));
    let report = [
        [1_u32, 2, 3, 7, 1].map(u32::to_le_bytes).concat(),
        0.75_f64.to_le_bytes().to_vec(),
        vec![1],
        0.001_f64.to_le_bytes().to_vec(),
        1.5_f64.to_le_bytes().to_vec(),
        vec![0, 1],
        0.125_f64.to_le_bytes().to_vec(),
    ]
    .concat();
    assert_eq!(report.len(), REPORT_LEN);
    // The report of a large answer in `docs/wire.md` begins behind 228 bytes.
    assert_eq!(payload, with_field(&plain, 228, &report, 228));
}

#[test]
fn variants_that_do_not_exist_are_refused() {
    let payload = payload_of(&sample(Kind::LargeFrame));
    let decode = |payload: &[u8]| {
        let bytes = raw_frame(Kind::LargeFrame.number(), 1, payload);
        Request::decode(&only_frame(&bytes), &Limits::default())
    };
    assert!(decode(&payload).is_ok());
    // Deformation, law, whether there is a yield stress, path, pace.
    for at in [0, 4, 8, 17, 21] {
        let mut hostile = payload.clone();
        assert_eq!(hostile[HASH_LEN + at], 1);
        hostile[HASH_LEN + at] = 2;
        assert!(matches!(decode(&hostile), Err(DecodeError::Part { .. })), "byte {at} of the ask");
    }
}
