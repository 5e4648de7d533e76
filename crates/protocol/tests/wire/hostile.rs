//! Sound frames with payloads that lie: an error, no panic, and no memory beyond what is there.

use softgrasp_protocol::*;

use crate::allocation::counted;
use crate::raw::{Random, fuzz_plan, only_frame, part_of, raw_frame};
use crate::samples::{Message, conversation, variants};

fn decode(kind: u16, payload: &[u8]) -> Result<Message, DecodeError> {
    decode_within(kind, payload, &Limits::default())
}

/// Decodes and checks that no more memory was asked for than a few times what came and one part.
fn decode_within(kind: u16, payload: &[u8], limits: &Limits) -> Result<Message, DecodeError> {
    let frame = only_frame(&raw_frame(kind, 1, payload));
    let (result, asked) = counted(|| Message::decode(&frame, limits));
    // The part, and the blocks in it.
    let most = 8 * payload.len() + 3 * PART_LEN_MAX;
    assert!(asked <= most, "{asked} bytes of memory for a payload of {}", payload.len());
    result
}

fn samples() -> Vec<(u16, Vec<u8>)> {
    let payload = |message: &Message| only_frame(&message.encode()).payload.to_vec();
    let all = conversation().into_iter().chain(variants().into_iter().map(|(_, message)| message));
    all.map(|message| (message.kind().number(), payload(&message))).collect()
}

#[test]
fn no_count_takes_memory_that_its_bytes_do_not_cover() {
    for (kind, payload) in samples() {
        let good = decode(kind, &payload).unwrap();
        let mut refused = 0;
        for at in 0..payload.len() {
            for lie in [&[0xff; 4][..], &[0, 0, 6, 0], &[0xff; 8], &[0, 0, 1, 0, 0, 0, 0, 0]] {
                let mut hostile = payload.clone();
                let end = (at + lie.len()).min(payload.len());
                hostile[at..end].copy_from_slice(&lie[..end - at]);
                match decode(kind, &hostile) {
                    // Bytes of a number or a name may be anything.
                    Ok(message) => assert_eq!(message.kind(), good.kind()),
                    Err(_) => refused += 1,
                }
            }
        }
        assert!(refused > 0, "{}: {refused} lies were seen", good.kind());
    }
}

#[test]
fn every_shortened_or_lengthened_payload_is_refused() {
    for (kind, payload) in samples() {
        for cut in 0..payload.len() {
            let error = decode(kind, &payload[..cut]).expect_err("a cut payload must not pass");
            assert!(
                matches!(
                    error,
                    DecodeError::Part { .. }
                        | DecodeError::PartTooLong { .. }
                        | DecodeError::ArrayCut { .. }
                        | DecodeError::Padding { .. }
                ),
                "kind {kind:#06x} cut after {cut} bytes: {error}"
            );
        }
        for more in [1, 8] {
            let longer = [payload.as_slice(), &vec![0; more]].concat();
            let error = decode(kind, &longer).expect_err("left-over bytes must not pass");
            assert!(matches!(error, DecodeError::LeftOver { count } if count == more), "{error}");
        }
    }
}

#[test]
fn random_payloads_never_panic() {
    for seed in fuzz_plan(5, 3000) {
        let mut random = Random::new(seed);
        for (kind, payload) in samples() {
            let mut hostile = payload;
            for _ in 0..1 + random.below(6) {
                let at = random.below(hostile.len());
                hostile[at] = [0, 1, 2, 0xff, random.next().to_le_bytes()[3]][random.below(5)];
            }
            // Whatever is accepted can be said again.
            if let Ok(message) = decode(kind, &hostile) {
                message.encode();
            }
        }
    }
}

#[test]
fn counts_over_a_limit_are_named() {
    let limits = Limits { node_count_max: 3, ..Limits::default() };
    let (kind, payload) = &samples()[1];
    let error = decode_within(*kind, payload, &limits).unwrap_err();
    let expected = "4 vertices are announced, the limit is 3";
    assert_eq!(error.to_string(), expected);
    let limits = Limits { dof_count_max: 1, ..Limits::default() };
    let error = decode_within(*kind, payload, &limits).unwrap_err();
    assert_eq!(error.to_string(), "2 known displacements are announced, the limit is 1");
    for (kind, payload) in samples() {
        let tight = Limits {
            payload_len_max: u32::MAX,
            node_count_max: 0,
            tet_count_max: 0,
            dof_count_max: 0,
            material_count_max: 0,
            text_len_max: 0,
        };
        let result = decode_within(kind, &payload, &tight);
        let without_lists = matches!(kind, 3 | 5 | 7 | 8 | 0x8003 | 0x8004 | 0x8006 | 0x8008);
        assert_eq!(result.is_ok(), without_lists, "kind {kind:#06x}");
    }
}

#[test]
fn masks_that_say_other_lengths_than_they_have_are_refused() {
    let (kind, payload) = samples().swap_remove(5);
    // Prefetch: length, part of 44 bytes, two nodes, then the length of the one mask.
    let at = (8_usize + 44).next_multiple_of(8) + 8;
    assert_eq!(payload[at..at + 4], 2_u32.to_le_bytes());
    for lie in [0, 1, 3, u32::MAX] {
        let mut hostile = payload.clone();
        hostile[at..at + 4].copy_from_slice(&u32::to_le_bytes(lie));
        let error = decode(kind, &hostile).unwrap_err();
        let expected = DecodeError::MaskLengths { lens_sum: u64::from(lie), entry_count: 2 };
        assert_eq!(error.to_string(), expected.to_string());
    }
}

#[test]
fn displacements_that_do_not_fit_the_masks_are_not_sent() {
    let question = Question { mask_displacements: vec![[0.0; 3]], ..Question::default() };
    let ask = Request::Ask(Box::new(Ask::new(ModelHash([7; 32]), question)));
    let mut out = vec![9];
    let error = ask.encode_into(1, &Limits::default(), &mut out).unwrap_err();
    assert!(matches!(error, EncodeError::CountMismatch { count: 1, expected: 0, .. }));
    assert_eq!(out, [9]);
}

#[test]
fn a_long_list_of_empty_texts_takes_no_more_than_a_part() {
    let mut report = vec![];
    report.extend(0_u64.to_le_bytes()); // method
    report.extend([0; 4 + 16 + 56 + 8 + 1 + 1 + 4 + 16 + 8 + 1 + 1 + 4]); // up to warning_level
    for count in [u64::MAX, 1 << 40, 65_536, 2730] {
        let mut hostile = report.clone();
        hostile.extend(count.to_le_bytes());
        hostile.resize(20_000, 0);
        let block = [&(hostile.len() as u64).to_le_bytes()[..], &hostile].concat();
        let answer = decode(Kind::Answer.number(), &part_of(&block));
        assert!(matches!(answer, Err(DecodeError::Part { .. })), "{answer:?}");
    }
}

#[test]
fn values_that_do_not_exist_are_refused() {
    let state = |known: u8| decode(Kind::ModelState.number(), &part_of(&[known]));
    assert!(state(1).is_ok());
    assert!(matches!(state(2), Err(DecodeError::Part { .. })));
    let mut hello = 2_u64.to_le_bytes().to_vec();
    hello.extend([0xc3, 0x28]);
    let error = decode(Kind::Hello.number(), &part_of(&hello));
    assert!(matches!(error, Err(DecodeError::Part { .. })), "text that is not UTF-8");
    // Subject of an ask: a third one.
    let error = decode(Kind::Ask.number(), &part_of(&[2, 0, 0, 0]));
    assert!(matches!(error, Err(DecodeError::Part { .. })), "{error:?}");
    let endless = u64::MAX.to_le_bytes();
    let error = decode(Kind::Hello.number(), &endless);
    assert!(matches!(error, Err(DecodeError::PartTooLong { len: u64::MAX })), "{error:?}");
}

#[test]
fn a_method_name_with_a_capital_is_a_bad_request() {
    let (name, ask) = variants().swap_remove(0);
    assert_eq!(name, "Ask-model");
    let (kind, mut payload) = (ask.kind().number(), only_frame(&ask.encode()).payload.to_vec());
    let at = payload.windows(4).position(|four| four == b"auto").unwrap();
    payload[at] = b'A';
    assert!(matches!(decode(kind, &payload), Err(DecodeError::MethodName(_))));
}

#[test]
fn unknown_kinds_and_wrong_directions_leave_the_stream_sound() {
    let unknown = only_frame(&raw_frame(0x7777, 5, b"from the future"));
    assert_eq!(unknown.kind(), None);
    let limits = Limits::default();
    let expected = "unknown message kind 0x7777";
    assert_eq!(Request::decode(&unknown, &limits).unwrap_err().to_string(), expected);
    assert_eq!(Reply::decode(&unknown, &limits).unwrap_err().to_string(), expected);
    for message in conversation() {
        let frame = only_frame(&message.encode());
        let wrong = match message {
            Message::Request(..) => Reply::decode(&frame, &limits).map(|_| ()),
            Message::Reply(..) => Request::decode(&frame, &limits).map(|_| ()),
        };
        let kind_sent = message.kind();
        assert_eq!(kind_sent.is_reply(), matches!(message, Message::Reply(..)));
        assert!(matches!(wrong, Err(DecodeError::WrongDirection { kind }) if kind == kind_sent));
    }
}

#[test]
fn large_arrays_are_copied_once_each_way() {
    let vertices = vec![[1.0, 2.0, 3.0]; 100_000];
    let tets = vec![[0, 1, 2, 3]; 400_000];
    let array_len = 24 * vertices.len() + 16 * tets.len();
    let upload = UploadModel {
        mesh: MeshData { vertices, tets, ..MeshData::default() },
        materials: vec![],
        element: ElementName::T4,
        fixed: vec![],
    };
    let request = Request::UploadModel(upload);
    let mut out = Vec::with_capacity(array_len + 4096);
    let (result, asked) = counted(|| request.encode_into(1, &Limits::default(), &mut out));
    result.unwrap();
    assert!(asked < 4096, "{asked} bytes of memory beside the buffer");
    let frame = only_frame(&out);
    let (decoded, asked) = counted(|| Request::decode(&frame, &Limits::default()).unwrap());
    assert!(asked < array_len + 4096, "{asked} bytes of memory for {array_len}");
    assert_eq!(decoded, request);
}

#[test]
fn pressures_that_say_other_numbers_of_triangles_than_they_have_are_refused() {
    let on = SurfacePressure { pressure: 1.0, triangles: vec![[0, 1, 2], [1, 2, 3]] };
    let spread = SpreadLoads { pressures: vec![on], ..SpreadLoads::default() };
    let question = Question { spread, ..Question::default() };
    let mut bytes = Vec::new();
    let ask = Request::from(Ask::new(ModelHash([7; 32]), question));
    ask.encode_into(1, &Limits::default(), &mut bytes).unwrap();
    let payload = only_frame(&bytes).payload.to_vec();
    // The last arrays: one number with its padding, two triangles.
    let at = payload.len() - 24 - 8;
    assert_eq!(payload[at..at + 4], 2_u32.to_le_bytes());
    for lie in [0, 1, 3, u32::MAX] {
        let mut hostile = payload.clone();
        hostile[at..at + 4].copy_from_slice(&u32::to_le_bytes(lie));
        let error = decode(Kind::Ask.number(), &hostile).unwrap_err();
        let expected = DecodeError::PressureLengths { lens_sum: u64::from(lie), triangle_count: 2 };
        assert_eq!(error.to_string(), expected.to_string());
    }
}
