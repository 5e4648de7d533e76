//! The trace of a request: what it costs, who reads it, and who passes over it.

use softgrasp_protocol::*;

use crate::raw::{Random, fuzz_plan, only_frame, part_of, raw_frame};
use crate::samples::{Message, conversation, variants};

const TRACE: TraceContext =
    TraceContext { trace_id: *b"the trace's name", span_id: *b"the span", is_sampled: true };

fn requests() -> impl Iterator<Item = (u64, Request)> {
    let all = conversation().into_iter().chain(variants().into_iter().map(|(_, message)| message));
    all.filter_map(|message| match message {
        Message::Request(id, request) => Some((id, request)),
        Message::Reply(..) => None,
    })
}

fn traced(id: u64, request: &Request, trace: Option<TraceContext>) -> Frame {
    let mut bytes = Vec::new();
    request.encode_traced_into(id, trace, &Limits::default(), &mut bytes).unwrap();
    only_frame(&bytes)
}

#[test]
fn trace_of_a_request_is_read_and_the_request_is_the_same() {
    let mut carried = 0;
    for (id, request) in requests() {
        let (plain, within) = (traced(id, &request, None), traced(id, &request, Some(TRACE)));
        assert_eq!(Request::trace(&plain), None);
        let more = within.payload.len() - plain.payload.len();
        match request {
            Request::Ask(_) | Request::UploadModel(_) | Request::ContactFrame(_) => {
                carried += 1;
                assert_eq!(Request::trace(&within), Some(TRACE));
                // An option, two identities and a boolean, up to the padding of the part.
                assert!((24..=32).contains(&more), "{more}");
            }
            _ => assert_eq!((more, Request::trace(&within)), (0, None)),
        }
        // A server that knows of no traces reads the part as far as this does.
        let read = Request::decode(&within, &Limits::default()).unwrap();
        assert_eq!(format!("{read:?}"), format!("{request:?}"));
    }
    assert!(carried > 5, "{carried} kinds");
}

#[test]
fn identities_of_zeros_and_other_bytes_are_no_trace() {
    for (id, request) in requests().filter(|(_, request)| matches!(request, Request::Ask(_))) {
        for nobody in
            [TraceContext { trace_id: [0; 16], ..TRACE }, TraceContext { span_id: [0; 8], ..TRACE }]
        {
            assert!(!nobody.is_valid());
            assert_eq!(Request::trace(&traced(id, &request, Some(nobody))), None);
        }
        let payload = traced(id, &request, None).payload;
        let len = u64::from_le_bytes(payload[..8].try_into().unwrap()) as usize;
        // A byte that is no option, and an option whose identities end too early.
        for (behind, expected) in [(&[7][..], false), (&[1, 3], false), (&[1; 26], true)] {
            let part = part_of(&[&payload[8..8 + len], behind].concat());
            let longer = [&part, &payload[(8 + len).next_multiple_of(8)..]].concat();
            let frame = only_frame(&raw_frame(Kind::Ask.number(), 1, &longer));
            assert_eq!(Request::trace(&frame).is_some(), expected, "{behind:?}");
            Request::decode(&frame, &Limits::default()).unwrap();
        }
    }
}

#[test]
fn random_payloads_give_a_trace_or_none() {
    for seed in fuzz_plan(7, 500) {
        let mut random = Random::new(seed);
        for (id, request) in requests() {
            let mut hostile = traced(id, &request, Some(TRACE)).payload.to_vec();
            for _ in 0..1 + random.below(6) {
                let at = random.below(hostile.len());
                hostile[at] = [0, 1, 2, 0xff, random.next().to_le_bytes()[3]][random.below(5)];
            }
            let frame = only_frame(&raw_frame(request.kind().number(), id, &hostile));
            if let Some(trace) = Request::trace(&frame) {
                assert!(trace.is_valid());
            }
        }
    }
}
