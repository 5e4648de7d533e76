//! What is decoded is what was encoded.

use proptest::prelude::*;
use softgrasp_protocol::*;

use crate::random_messages::any_message;
use crate::raw::{only_frame, raw_frame};
use crate::samples::{Message, conversation, curved_model, sample, variants};

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]

    #[test]
    fn decoded_message_is_the_encoded_one(message in any_message()) {
        let bytes = message.encode();
        prop_assert_eq!(bytes.len() % 8, 0);
        let frame = only_frame(&bytes);
        prop_assert_eq!(frame.kind(), Some(message.kind()));
        prop_assert_eq!(Message::decode(&frame, &Limits::default()).unwrap(), message);
    }

    #[test]
    fn frames_equal_those_written_from_the_document(message in any_message()) {
        let bytes = message.encode();
        let frame = only_frame(&bytes);
        let written = raw_frame(message.kind().number(), frame.request_id(), &frame.payload);
        prop_assert_eq!(written, bytes);
    }
}

#[test]
fn conversation_holds_every_kind_once() {
    let kinds: Vec<Kind> = conversation().iter().map(Message::kind).collect();
    assert_eq!(kinds, Kind::ALL);
}

#[test]
fn numbers_that_are_not_finite_keep_their_bits() {
    let odd = [f64::NAN, -f64::NAN, f64::from_bits(0x7ff0_0000_dead_beef), f64::INFINITY, -0.0];
    let known = odd.iter().map(|&value| DofValue { dof: 1, value }).collect();
    let question = Question {
        known,
        max_error: Some(f64::NAN),
        deadline_ms: Some(f64::NEG_INFINITY),
        ..Question::default()
    };
    let mesh = MeshData { vertices: odd.map(|x| [x; 3]).to_vec(), ..MeshData::default() };
    let body = Body { mesh, materials: vec![], element: ElementChoice::T4 };
    let mut bytes = Vec::new();
    let request = Request::Ask(Box::new(Ask::new(body, question)));
    request.encode_into(1, &Limits::default(), &mut bytes).unwrap();
    let back = Request::decode(&only_frame(&bytes), &Limits::default()).unwrap();
    let Request::Ask(ask) = back else { panic!("another kind: {back:?}") };
    let Subject::Mesh(body) = ask.subject else { panic!("another subject") };
    let known: Vec<u64> = ask.question.known.iter().map(|k| k.value.to_bits()).collect();
    assert_eq!(known, odd.map(f64::to_bits));
    let x: Vec<u64> = body.mesh.vertices.iter().map(|v| v[2].to_bits()).collect();
    assert_eq!(x, odd.map(f64::to_bits));
    assert!(ask.question.max_error.is_some_and(f64::is_nan));
}

#[test]
fn messages_are_appended_one_behind_the_other() {
    let mut bytes = vec![];
    let nonces = [1, 2, 3];
    for nonce in nonces {
        Request::Ping { nonce }.encode_into(nonce, &Limits::default(), &mut bytes).unwrap();
    }
    let mut buffer = FrameBuffer::new(Limits::default());
    buffer.feed(&bytes);
    for nonce in nonces {
        let frame = buffer.next_frame().unwrap().unwrap();
        assert_eq!(frame.request_id(), nonce);
        let request = Request::decode(&frame, &Limits::default()).unwrap();
        assert_eq!(request, Request::Ping { nonce });
    }
    assert_eq!(buffer.next_frame(), Ok(None));
}

#[test]
fn lists_that_do_not_fit_together_are_not_sent() {
    let mesh = MeshData { regions: vec![1], ..MeshData::default() };
    let upload = UploadModel { mesh, materials: vec![], element: ElementName::T4, fixed: vec![] };
    let mut out = vec![];
    let error = Request::UploadModel(upload).encode_into(1, &Limits::default(), &mut out);
    assert!(matches!(error, Err(EncodeError::CountMismatch { count: 1, expected: 0, .. })));
    let mesh = MeshData { mid_edge: vec![[0; 6]], ..curved_model().mesh };
    let upload = UploadModel { mesh, ..curved_model() };
    let error = Request::UploadModel(upload).encode_into(1, &Limits::default(), &mut out);
    assert!(matches!(error, Err(EncodeError::CountMismatch { count: 1, expected: 2, .. })));
    let answer = conversation().into_iter().find_map(|message| match message {
        Message::Reply(_, Reply::Answer(answer)) => Some(answer),
        _ => None,
    });
    let mut answer = answer.unwrap();
    answer.nodes = NodeChoice::Nodes(vec![1]);
    let error = Reply::Answer(answer).encode_into(1, &Limits::default(), &mut out);
    assert!(matches!(error, Err(EncodeError::CountMismatch { count: 1, expected: 3, .. })));
    assert!(out.is_empty(), "nothing is appended");
}

#[test]
fn cases_that_do_not_fit_the_first_are_not_sent() {
    let Message::Request(_, Request::Ask(mut ask)) = sample(Kind::Ask) else { unreachable!() };
    ask.cases = vec![vec![0.5]];
    let mut out = vec![];
    let error = Request::Ask(ask).encode_into(1, &Limits::default(), &mut out);
    assert!(matches!(error, Err(EncodeError::CountMismatch { count: 1, expected: 2, .. })));
    let Message::Reply(_, Reply::Answer(mut answer)) = sample(Kind::Answer) else { unreachable!() };
    answer.cases = vec![CaseAnswer { displacements: vec![[0.0; 3]; 3], reactions: vec![] }];
    let error = Reply::Answer(answer).encode_into(1, &Limits::default(), &mut out);
    assert!(matches!(error, Err(EncodeError::CountMismatch { count: 0, expected: 1, .. })));
    assert!(out.is_empty(), "nothing is appended");
}

#[test]
fn newest_wins_is_seen_without_the_arrays() {
    let variant = |name| variants().into_iter().find(|(known, _)| *known == name).unwrap().1;
    let seen = |message: Message| {
        let kept = Ask::kept_model(&only_frame(&message.encode()));
        kept.map(|(_, newest_wins)| newest_wins)
    };
    assert_eq!(seen(variant("Ask-model")), Some(true));
    assert_eq!(seen(variant("Ask-large")), Some(false), "older ones stay wanted");
    assert_eq!(seen(sample(Kind::Ask)), None, "a mesh has no newer one");
    assert_eq!(seen(sample(Kind::Ping)), None);
}
