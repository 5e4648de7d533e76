//! Either side may learn a field, a warning, a refusal or a capability without the other.

use softgrasp_protocol::*;

use crate::raw::{only_frame, part_of, raw_frame};
use crate::samples::{Message, conversation, curved_model, quantity, sample, variants};

fn decode(kind: Kind, payload: &[u8]) -> Result<Message, DecodeError> {
    Message::decode(&only_frame(&raw_frame(kind.number(), 1, payload)), &Limits::default())
}

/// The payload with `more` behind the fields of its part.
fn with_more_fields(payload: &[u8], more: &[u8]) -> Vec<u8> {
    let len = u64::from_le_bytes(payload[..8].try_into().unwrap()) as usize;
    let longer = part_of(&[&payload[8..8 + len], more].concat());
    [&longer, &payload[(8 + len).next_multiple_of(8)..]].concat()
}

#[test]
fn fields_that_a_later_version_adds_are_skipped_in_every_message() {
    let all = conversation().into_iter().chain(variants().into_iter().map(|(_, message)| message));
    for message in all {
        let payload = only_frame(&message.encode()).payload;
        // What this version leaves out where there is none, a later one writes before its own.
        let left_out: &[u8] = match &message {
            Message::Reply(_, Reply::Answer(answer)) if answer.gradient.is_none() => &[0],
            _ => &[],
        };
        for more in [&[7][..], &[1; 8], &[0xff; 100]] {
            let longer = with_more_fields(&payload, &[left_out, more].concat());
            let read = decode(message.kind(), &longer).unwrap();
            let (read, sent) = match (read, &message) {
                (Message::Request(_, read), Message::Request(_, sent)) => {
                    (format!("{read:?}"), format!("{sent:?}"))
                }
                (Message::Reply(_, read), Message::Reply(_, sent)) => {
                    (format!("{read:?}"), format!("{sent:?}"))
                }
                other => panic!("another direction: {other:?}"),
            };
            assert_eq!(read, sent);
        }
    }
}

#[test]
fn fields_that_an_earlier_version_does_not_send_are_zero() {
    let Message::Reply(_, Reply::Welcome(welcome)) = sample(Kind::Welcome) else { unreachable!() };
    let payload = only_frame(&sample(Kind::Welcome).encode()).payload;
    // Up to the limits, which are a block of six u32: nothing of what follows them.
    let at = payload.len() - 8 - 2 - 8 - (8 + 6) - (8 + 7);
    let fields: Vec<u8> = payload[8..].iter().copied().take(at).collect();
    let shorter = (0..fields.len()).rev().find_map(|len| {
        match decode(Kind::Welcome, &part_of(&fields[..len])) {
            Ok(Message::Reply(_, Reply::Welcome(read))) if read.wire == 0 => Some(read),
            _ => None,
        }
    });
    let shorter = shorter.unwrap();
    let bare = Welcome { wire: 0, capabilities: vec![], idle_ms: 0, ..welcome };
    assert_eq!(shorter, bare);
    // A client that says only its name.
    let mut name = 2_u64.to_le_bytes().to_vec();
    name.extend(b"me");
    let read = decode(Kind::Hello, &part_of(&name)).unwrap();
    let Message::Request(_, Request::Hello(hello)) = read else { unreachable!() };
    assert_eq!((hello.client.as_str(), hello.token, hello.alive_every_ms), ("me", None, 0));
}

#[test]
fn refusals_warnings_and_elements_of_a_later_version_are_read() {
    let mut fields = 900_u16.to_le_bytes().to_vec();
    fields.extend([0; 20]);
    let read = decode(Kind::Rejected, &part_of(&fields)).unwrap();
    let Message::Reply(_, Reply::Rejected(rejected)) = read else { unreachable!() };
    assert_eq!(rejected.code, RejectCode::Other(900));
    let Message::Reply(_, Reply::Answer(mut answer)) = sample(Kind::Answer) else { unreachable!() };
    answer.report.warnings = vec![Warning::new(WarningCode(4711), "from the future")];
    let bytes = Message::Reply(1, Reply::Answer(answer.clone())).encode();
    let read = Reply::decode(&only_frame(&bytes), &Limits::default()).unwrap();
    assert_eq!(read, Reply::Answer(answer));
}

#[test]
fn report_of_another_level_is_shorter_and_says_what_it_leaves_out() {
    let Message::Reply(_, Reply::Answer(answer)) = sample(Kind::Answer) else { unreachable!() };
    let len = |level: ReportLevel| {
        let report = answer.report.clone().at_level(level);
        let answer = Answer { report, ..*answer.clone() };
        Message::Reply(1, Reply::Answer(Box::new(answer))).encode().len()
    };
    assert!(len(ReportLevel::None) < len(ReportLevel::Short));
    assert!(len(ReportLevel::Short) < len(ReportLevel::Full));
    let short = answer.report.clone().at_level(ReportLevel::Short);
    assert_eq!(short.residual_rel, answer.report.residual_rel);
    assert!(short.method.is_empty() && short.warnings.is_empty());
    let none = answer.report.clone().at_level(ReportLevel::None);
    assert!(none.is_untold() && none.max_strain.is_nan() && none.error_bound_rel.is_none());
}

#[test]
fn a_frame_without_a_small_system_is_what_it_was_before_there_were_any() {
    let of = |name: &str| {
        let found = variants().into_iter().find(|(known, _)| *known == name);
        only_frame(&found.unwrap().1.encode()).payload.len()
    };
    let plain = |kind: Kind| only_frame(&sample(kind).encode()).payload.len();
    // The part is padded, so that a field of one byte may cost nothing.
    assert!((0..=8).contains(&(of("ContactFrame-small") - plain(Kind::ContactFrame))));
    let arrays = 8 + 8 * 10 + 8 * 9;
    let more = of("ContactAnswer-small") - plain(Kind::ContactAnswer);
    assert!((arrays..=arrays + 8).contains(&more), "{more}");
}

#[test]
fn a_small_system_without_its_compliance_is_not_sent() {
    let Message::Reply(_, Reply::ContactAnswer(answer)) = sample(Kind::ContactAnswer) else {
        unreachable!()
    };
    let body =
        BodyContact { body: 0, place: [0.0; 3], normal: [0.0; 3], force: [0.0; 3], friction: 0.0 };
    let small_system = SmallSystem { contacts: vec![body], compliance: vec![1.0] };
    let reply = Reply::ContactAnswer(Box::new(ContactAnswer { small_system, ..*answer }));
    let encoded = reply.encode_into(1, &Limits::default(), &mut Vec::new());
    assert!(matches!(encoded, Err(EncodeError::CountMismatch { count: 1, expected: 9, .. })));
}

#[test]
fn loads_cost_nothing_where_there_are_none_and_an_older_server_refuses_them() {
    let payload = |ask: Ask| {
        let mut bytes = Vec::new();
        Request::from(ask).encode_into(1, &Limits::default(), &mut bytes).unwrap();
        only_frame(&bytes).payload
    };
    let loads = SpreadLoads { densities: vec![1.0], ..SpreadLoads::default() };
    let ask = |spread: SpreadLoads| {
        Ask::new(ModelHash([7; 32]), Question { spread, ..Question::default() })
    };
    let (plain, loaded) = (payload(ask(SpreadLoads::default())), payload(ask(loads)));
    // Three doubles, three counts and one density, up to the padding of the part.
    let more = loaded.len() - plain.len();
    assert!((32 + 8..=40 + 8).contains(&more), "{more}");
    // Who skips the fields finds the bytes of the arrays behind the last one that it knows.
    let seen = [&plain[..], &1.0_f64.to_le_bytes()].concat();
    assert!(decode(Kind::Ask, &plain).is_ok());
    let error = decode(Kind::Ask, &seen).unwrap_err();
    assert!(!matches!(error, DecodeError::TooMany { .. }), "{error}");
}

#[test]
fn derivatives_cost_nothing_where_nobody_wants_them_and_an_older_server_refuses_them() {
    let asked = |quantity: Quantity| {
        let mut bytes = Vec::new();
        let question = Question { quantity, ..Question::default() };
        let ask = Request::from(Ask::new(ModelHash([7; 32]), question));
        ask.encode_into(1, &Limits::default(), &mut bytes).unwrap();
        only_frame(&bytes).payload
    };
    let (plain, wanted) = (asked(Quantity::default()), asked(quantity()));
    // Three doubles and three counts of loads, two counts and a boolean; three terms of 20 bytes; padding.
    let more = wanted.len() - plain.len();
    assert!(more.abs_diff(36 + 9 + 60) <= 3 * 8, "{more}");
    // Who skips the fields finds the bytes of the arrays behind the last one that it knows.
    let seen = [&plain[..], &[0; 72]].concat();
    assert!(decode(Kind::Ask, &plain).is_ok() && decode(Kind::Ask, &seen).is_err());
    let Message::Reply(_, Reply::Answer(answer)) = sample(Kind::Answer) else { unreachable!() };
    let answered = |gradient: Option<GradientValues>| {
        let mut bytes = Vec::new();
        let reply = Reply::Answer(Box::new(Answer { gradient, ..*answer.clone() }));
        reply.encode_into(1, &Limits::default(), &mut bytes).unwrap();
        bytes.len()
    };
    let empty = GradientValues { value: 1.0, ..GradientValues::default() };
    // A byte for the option, the length of the block, a double, five counts and an option; padding.
    let more = answered(Some(empty)) - answered(None);
    assert!(more.abs_diff(1 + 8 + 8 + 20 + 1) < 8, "{more}");
}

#[test]
fn mid_edge_nodes_cost_their_bytes_and_an_older_server_refuses_them() {
    let payload = |mesh: MeshData| {
        let mut bytes = Vec::new();
        let upload = Request::UploadModel(UploadModel { mesh, ..curved_model() });
        upload.encode_into(1, &Limits::default(), &mut bytes).unwrap();
        only_frame(&bytes).payload
    };
    let curved = curved_model().mesh;
    let plain = payload(MeshData { mid_edge: vec![], ..curved.clone() });
    let curved = payload(curved);
    assert_eq!(curved.len(), plain.len() + 2 * 6 * 4);
    // Behind the length of the part and two counts: a byte that was the boolean of region labels.
    assert_eq!((plain[16], curved[16]), (1, 3));
    for bits in [4, 7, 255] {
        let mut hostile = curved.to_vec();
        hostile[16] = bits;
        let error = decode(Kind::UploadModel, &hostile).unwrap_err();
        assert!(matches!(error, DecodeError::UnknownArrays { bits: known } if known == bits));
    }
    let mut without = curved.to_vec();
    without[16] = 1;
    assert!(decode(Kind::UploadModel, &without).is_err(), "the arrays are left over");
    let cut = &curved[..curved.len() - 24];
    assert!(matches!(decode(Kind::UploadModel, cut), Err(DecodeError::ArrayCut { .. })));
}
