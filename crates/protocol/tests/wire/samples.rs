//! One message of each kind, and random ones.

use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use softgrasp_protocol::*;

/// A message of either direction, with its request id.
#[derive(Clone, Debug, PartialEq)]
pub enum Message {
    Request(u64, Request),
    Reply(u64, Reply),
}

impl Message {
    pub fn kind(&self) -> Kind {
        match self {
            Self::Request(_, request) => request.kind(),
            Self::Reply(_, reply) => reply.kind(),
        }
    }

    pub fn encode(&self) -> Vec<u8> {
        let mut out = Vec::new();
        match self {
            Self::Request(id, request) => request.encode_into(*id, &Limits::default(), &mut out),
            Self::Reply(id, reply) => reply.encode_into(*id, &Limits::default(), &mut out),
        }
        .unwrap();
        out
    }

    /// Decodes by the direction that the number of the kind tells.
    pub fn decode(frame: &Frame, limits: &Limits) -> Result<Self, DecodeError> {
        let id = frame.request_id();
        if frame.header.kind & 0x8000 == 0 {
            Request::decode(frame, limits).map(|request| Self::Request(id, request))
        } else {
            Reply::decode(frame, limits).map(|reply| Self::Reply(id, reply))
        }
    }
}

/// A conversation that holds each kind once, in the order of their numbers.
pub fn conversation() -> Vec<Message> {
    let mut messages = requests();
    messages.extend(replies());
    messages
}

fn requests() -> Vec<Message> {
    let mesh = MeshData {
        vertices: vec![[0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 0.01], [0.0; 3]],
        tets: vec![[0, 1, 2, 3]],
        regions: vec![7],
    };
    let materials = vec![Material { young: 20_000.0, poisson: 0.45 }];
    let question = Question {
        known: vec![DofValue { dof: 9, value: 0.0 }, DofValue { dof: 2, value: -0.001 }],
        forces: vec![DofValue { dof: 4, value: 0.5 }],
        masks: masks_of(&[&[(0, 0.25), (2, 0.75)], &[(1, 1.0)]]),
        mask_displacements: vec![[0.0, -0.001, 0.0], [0.0005, 0.0, 0.0]],
        method: MethodName::auto(),
        want: Want {
            nodes: NodeChoice::Nodes(vec![0, 2, 3]),
            reactions: true,
            precision: Precision::F32Quantised,
        },
        max_error: Some(0.01),
        deadline_ms: None,
    };
    let everything = Question {
        masks: Masks::default(),
        mask_displacements: vec![],
        method: "gauss-jordan".parse().unwrap(),
        want: Want::default(),
        max_error: None,
        deadline_ms: Some(16.5),
        ..question.clone()
    };
    let element = ElementChoice::T4;
    [
        Request::Hello(Hello { client: "sample 1".to_owned(), token: Some("secret".to_owned()) }),
        Request::SolveOnce(Box::new(SolveOnce {
            mesh: mesh.clone(),
            materials: materials.clone(),
            element,
            question: everything,
        })),
        Request::HaveModel(hash()),
        Request::UploadModel(UploadModel {
            mesh: MeshData { regions: vec![], ..mesh },
            materials,
            element: ElementName::T10,
            fixed: vec![9, 10, 11],
        }),
        Request::Frame(FrameRequest { model: hash(), question }),
        Request::Prefetch(Prefetch {
            model: hash(),
            nodes: vec![1, 3],
            masks: masks_of(&[&[(3, 1.0), (1, 2.0)]]),
        }),
        Request::Drop(hash()),
        Request::Ping { nonce: 0x0123_4567_89ab_cdef },
    ]
    .into_iter()
    .zip(1..)
    .map(|(request, id)| Message::Request(id, request))
    .collect()
}

fn replies() -> Vec<Message> {
    let stage_ms = StageMs { decode: 0.125, assemble: 1.5, factor: 2.25, ..StageMs::default() };
    let report = SolveReport {
        method: "sparse".to_owned(),
        element: ElementName::T4,
        unknown_dofs: 10,
        known_dofs: 2,
        stage_ms,
        residual_rel: 1e-15,
        error_bound_rel: Some(1e-12),
        error_bound_why: "residual and condition estimate".to_owned(),
        refinement_steps: 1,
        max_rotation_deg: 3.5,
        max_strain: 0.0625,
        precision: "f64".to_owned(),
        condition_estimate: None,
        error_estimate_rel: Some(1e-13),
        warning_level: WarningLevel::Caution,
        warnings: vec!["large rotation".to_owned(), String::new()],
        peak_rss_bytes: 1 << 24,
        factor_reused: false,
        chosen_because: "smallest predicted time".to_owned(),
    };
    let displacements = vec![[0.0, -0.001, 0.0005], [0.0; 3], [0.00025, 0.0, 0.0]];
    let answer = Answer {
        report,
        nodes: NodeChoice::Nodes(vec![0, 2, 3]),
        displacements: Displacements::of(displacements, Precision::F32Quantised),
        reactions: vec![DofValue { dof: 2, value: -1.25 }],
        mask_forces: vec![[0.0, -0.75, 0.125], [0.5, 0.0, 0.0]],
    };
    let ready =
        ModelReady { model: hash(), unknown_dofs: 9, fixed_dofs: 3, reused: false, stage_ms };
    let welcome = Welcome {
        server: "sample server".to_owned(),
        version: "0.1.0".to_owned(),
        threads: 4,
        limits: Limits::default(),
    };
    let rejected = Rejected {
        code: RejectCode::RigidMotionFree,
        text: "the body can turn about the z axis".to_owned(),
        detail: String::new(),
    };
    vec![
        Message::Reply(1, Reply::Welcome(welcome)),
        Message::Reply(2, Reply::Answer(Box::new(answer))),
        Message::Reply(3, Reply::ModelState { known: true }),
        Message::Reply(4, Reply::ModelReady(ready)),
        Message::Reply(5, Reply::Rejected(rejected)),
        Message::Reply(8, Reply::Pong { nonce: 0x0123_4567_89ab_cdef }),
    ]
}

fn masks_of(lists: &[&[(u32, f64)]]) -> Masks {
    let mut masks = Masks::default();
    lists.iter().for_each(|list| masks.push(list));
    masks
}

fn hash() -> ModelHash {
    ModelHash(std::array::from_fn(|i| 0xa0 ^ u8::try_from(i).unwrap()))
}

/// Any message; no NaN, so that equality can be asked for.
pub fn any_message() -> impl Strategy<Value = Message> {
    let request = (any::<u64>(), any_request()).prop_map(|(id, m)| Message::Request(id, m));
    let reply = (any::<u64>(), any_reply()).prop_map(|(id, m)| Message::Reply(id, m));
    prop_oneof![request, reply]
}

fn any_request() -> impl Strategy<Value = Request> {
    let hello = (text(), option::of(text())).prop_map(|(client, token)| Hello { client, token });
    let model = || any::<[u8; 32]>().prop_map(ModelHash);
    let materials = || {
        let one = (number(), number()).prop_map(|(young, poisson)| Material { young, poisson });
        vec(one, 0..4)
    };
    let solve = (mesh(), materials(), element_choice(), question()).prop_map(
        |(mesh, materials, element, question)| {
            Box::new(SolveOnce { mesh, materials, element, question })
        },
    );
    let upload = (mesh(), materials(), element(), vec(any::<u32>(), 0..9)).prop_map(
        |(mesh, materials, element, fixed)| UploadModel { mesh, materials, element, fixed },
    );
    let frame =
        (model(), question()).prop_map(|(model, question)| FrameRequest { model, question });
    let prefetch = (model(), vec(any::<u32>(), 0..9), masks())
        .prop_map(|(model, nodes, masks)| Request::Prefetch(Prefetch { model, nodes, masks }));
    prop_oneof![
        hello.prop_map(Request::Hello),
        solve.prop_map(Request::SolveOnce),
        model().prop_map(Request::HaveModel),
        upload.prop_map(Request::UploadModel),
        frame.prop_map(Request::Frame),
        prefetch,
        model().prop_map(Request::Drop),
        any::<u64>().prop_map(|nonce| Request::Ping { nonce }),
    ]
}

fn any_reply() -> impl Strategy<Value = Reply> {
    let limits = any::<[u32; 6]>().prop_map(|n| Limits {
        payload_len_max: n[0],
        node_count_max: n[1],
        tet_count_max: n[2],
        dof_count_max: n[3],
        material_count_max: n[4],
        text_len_max: n[5],
    });
    let welcome =
        (text(), text(), any::<u32>(), limits).prop_map(|(server, version, threads, limits)| {
            Welcome { server, version, threads, limits }
        });
    let ready = (any::<[u8; 32]>(), any::<[u64; 2]>(), any::<bool>(), stage_ms()).prop_map(
        |(model, [unknown_dofs, fixed_dofs], reused, stage_ms)| ModelReady {
            model: ModelHash(model),
            unknown_dofs,
            fixed_dofs,
            reused,
            stage_ms,
        },
    );
    let code = prop::sample::select(RejectCode::ALL.to_vec());
    let rejected =
        (code, text(), text()).prop_map(|(code, text, detail)| Rejected { code, text, detail });
    prop_oneof![
        welcome.prop_map(Reply::Welcome),
        answer().prop_map(|answer| Reply::Answer(Box::new(answer))),
        any::<bool>().prop_map(|known| Reply::ModelState { known }),
        ready.prop_map(Reply::ModelReady),
        rejected.prop_map(Reply::Rejected),
        any::<u64>().prop_map(|nonce| Reply::Pong { nonce }),
    ]
}

fn answer() -> impl Strategy<Value = Answer> {
    let double = vec(point(), 0..9).prop_map(Displacements::F64);
    let single =
        (number(), vec(prop::array::uniform3(any::<i32>()), 0..9)).prop_map(|(scale, v)| {
            let values = v.iter().map(|u| u.map(|c| c as f32 / 2_f32.powi(31))).collect();
            Displacements::F32Quantised { scale, values }
        });
    let displacements = prop_oneof![double, single];
    let parts = (report(), displacements, any::<bool>(), dof_values(), vec(point(), 0..4));
    parts.prop_map(|(report, displacements, all, reactions, mask_forces)| {
        let count = u32::try_from(displacements.node_count()).unwrap();
        let nodes = if all {
            NodeChoice::All
        } else {
            NodeChoice::Nodes((0..count).map(|node| node.wrapping_mul(0x9e37_79b9)).collect())
        };
        Answer { report, nodes, displacements, reactions, mask_forces }
    })
}

fn report() -> impl Strategy<Value = SolveReport> {
    let texts = (text(), text(), text(), text(), vec(text(), 0..4));
    let numbers = (prop::array::uniform3(number()), option::of(number()), option::of(number()));
    let counts = (any::<[u64; 3]>(), any::<u32>(), any::<bool>());
    (texts, numbers, counts, element(), stage_ms()).prop_map(
        |(texts, numbers, counts, element, stage_ms)| {
            let (method, error_bound_why, precision, chosen_because, warnings) = texts;
            let ([residual_rel, max_rotation_deg, max_strain], bound, condition) = numbers;
            let ([unknown_dofs, known_dofs, peak_rss_bytes], steps, factor_reused) = counts;
            SolveReport {
                method,
                element,
                unknown_dofs,
                known_dofs,
                stage_ms,
                residual_rel,
                error_bound_rel: bound,
                error_bound_why,
                refinement_steps: steps,
                max_rotation_deg,
                max_strain,
                precision,
                condition_estimate: condition,
                error_estimate_rel: condition.map(|c| 1e-16 * c),
                warning_level: [WarningLevel::None, WarningLevel::Serious][steps as usize % 2],
                warnings,
                peak_rss_bytes,
                factor_reused,
                chosen_because,
            }
        },
    )
}

fn mesh() -> impl Strategy<Value = MeshData> {
    (vec(point(), 0..9), vec(any::<[u32; 4]>(), 0..9), any::<bool>()).prop_map(
        |(vertices, tets, labelled)| {
            let regions = tets.iter().filter(|_| labelled).map(|corners| corners[0] % 5).collect();
            MeshData { vertices, tets, regions }
        },
    )
}

fn question() -> impl Strategy<Value = Question> {
    let nodes =
        prop_oneof![Just(NodeChoice::All), vec(any::<u32>(), 0..9).prop_map(NodeChoice::Nodes),];
    let precision = prop::sample::select(vec![Precision::F64, Precision::F32Quantised]);
    let want = (nodes, any::<bool>(), precision).prop_map(|(nodes, reactions, precision)| Want {
        nodes,
        reactions,
        precision,
    });
    let method = prop::sample::select(vec!["auto", "gauss-jordan", "pcg", "a_b-9"])
        .prop_map(|name| name.parse().unwrap());
    let bounds = (option::of(number()), option::of(number()));
    (dof_values(), dof_values(), masks(), method, want, bounds).prop_map(
        |(known, forces, masks, method, want, (max_error, deadline_ms))| Question {
            known,
            forces,
            mask_displacements: (0..masks.len()).map(|i| [i as f64, -0.5, 1e-3]).collect(),
            masks,
            method,
            want,
            max_error,
            deadline_ms,
        },
    )
}

fn masks() -> impl Strategy<Value = Masks> {
    vec(vec((any::<u32>(), number()), 0..5), 0..4)
        .prop_map(|lists| masks_of(&lists.iter().map(Vec::as_slice).collect::<Vec<_>>()))
}

fn dof_values() -> impl Strategy<Value = Vec<DofValue>> {
    vec((any::<u32>(), number()).prop_map(|(dof, value)| DofValue { dof, value }), 0..9)
}

fn stage_ms() -> impl Strategy<Value = StageMs> {
    prop::array::uniform7(number()).prop_map(
        |[decode, assemble, order, factor, solve, encode, queue]| StageMs {
            decode,
            assemble,
            order,
            factor,
            solve,
            encode,
            queue,
        },
    )
}

fn element() -> impl Strategy<Value = ElementName> {
    prop::sample::select(vec![ElementName::T4, ElementName::T10, ElementName::T4Anp])
}

fn element_choice() -> impl Strategy<Value = ElementChoice> {
    prop::sample::select(vec![ElementChoice::T4, ElementChoice::T10, ElementChoice::Auto])
}

fn point() -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(number())
}

/// Every sort of double except NaN.
fn number() -> impl Strategy<Value = f64> {
    use prop::num::f64::{INFINITE, NEGATIVE, NORMAL, POSITIVE, SUBNORMAL, ZERO};
    POSITIVE | NEGATIVE | NORMAL | SUBNORMAL | ZERO | INFINITE
}

fn text() -> impl Strategy<Value = String> {
    vec(any::<char>(), 0..12).prop_map(|chars| chars.into_iter().collect())
}
