//! One message of each kind.

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

/// Further messages of kinds that have more than one form, by the names of their golden files.
pub fn variants() -> Vec<(&'static str, Message)> {
    let Message::Request(_, Request::Ask(ask)) = sample(Kind::Ask) else { unreachable!() };
    let Message::Reply(_, Reply::Answer(answer)) = sample(Kind::Answer) else { unreachable!() };
    let held = Question { mask_displacements: vec![], masks: Masks::default(), ..question() };
    let of_model =
        Ask { newest_wins: true, report: ReportLevel::Short, ..Ask::new(hash(), question()) };
    let large = LargeAsk {
        deformation: Deformation::Auto,
        law: LawName::NeoHookeanLog,
        yield_stress: Some(1500.0),
        path: PathChoice::FromRest,
        pace: Pace::Timely,
    };
    let of_large = Ask { large: Some(large), ..Ask::new(hash(), held) };
    let values = |factor: f64| ask.question.known.iter().map(|k| factor * k.value).collect();
    let of_cases =
        Ask { cases: vec![values(2.0), values(-1.0)], without_estimate: true, ..*ask.clone() };
    let with_fields = Want { fields: asked_fields(), ..question().want };
    let of_fields = Ask::new(hash(), Question { want: with_fields, ..question() });
    let of_loads = Ask::new(hash(), Question { spread: spread(), ..question() });
    let of_quantity = Ask::new(hash(), Question { quantity: quantity(), ..question() });
    let case = CaseAnswer { displacements: vec![[1.0, -2.0, 0.25]; 3], reactions: vec![4.5] };
    let of_several = Answer {
        displacements: Displacements::F64(vec![[0.5, 0.0, 0.0]; 3]),
        mask_forces: vec![],
        cases: vec![case],
        ..*answer.clone()
    };
    let with_fields =
        Answer { fields: vec![field_values(1.0), field_values(-2.0)], ..of_several.clone() };
    let with_gradient = Answer { gradient: Some(gradient()), ..*answer.clone() };
    let contact = |frame| Message::Request(1, Request::ContactFrame(Box::new(frame)));
    let request = |ask| Message::Request(1, Request::Ask(Box::new(ask)));
    let reply = |answer| Message::Reply(1, Reply::Answer(Box::new(answer)));
    vec![
        ("Ask-model", request(of_model)),
        ("Ask-large", request(of_large)),
        ("Ask-cases", request(of_cases)),
        ("Ask-fields", request(of_fields)),
        ("Ask-loads", request(of_loads)),
        ("Ask-gradient", request(of_quantity)),
        ("UploadModel-mid-edge", Message::Request(1, Request::UploadModel(curved_model()))),
        ("Answer-large", reply(large_answer())),
        ("Answer-cases", reply(of_several)),
        ("Answer-untold", reply(Answer { report: SolveReport::untold(), ..*answer })),
        ("Answer-fields", reply(with_fields)),
        ("Answer-gradient", reply(with_gradient)),
        ("ContactFrame-rounded", contact(rounded(contact_frame()))),
        ("ContactFrame-small", contact(felt_frame())),
        ("ContactAnswer-small", Message::Reply(1, Reply::ContactAnswer(Box::new(felt_answer())))),
    ]
}

/// A model of two elements with mid-edge nodes and regions.
pub fn curved_model() -> UploadModel {
    let places = (0..14).map(|node| [f64::from(node), 0.5 * f64::from(node * node), -1.0]);
    UploadModel {
        mesh: MeshData {
            vertices: places.collect(),
            tets: vec![[0, 1, 2, 3], [1, 2, 3, 4]],
            regions: vec![7, 2],
            mid_edge: vec![[5, 6, 7, 8, 9, 10], [6, 10, 9, 11, 12, 13]],
        },
        materials: vec![Material { young: 20_000.0, poisson: 0.45 }; 2],
        element: ElementName::T10,
        fixed: vec![15],
    }
}

/// Set of some fields, of elements and of nodes.
fn asked_fields() -> FieldSet {
    [Field::ElementStress, Field::NodeVonMises, Field::ElementEnergy].into_iter().collect()
}

/// Values of [`asked_fields`] for two elements and three nodes.
fn field_values(factor: f64) -> FieldValues {
    let values = |len: u32| (1..=len).map(|i| factor * f64::from(i) / 4.0).collect();
    FieldValues {
        energy: 0.5 * factor * factor,
        error_rel: f64::NAN,
        arrays: vec![
            (Field::ElementStress, values(12)),
            (Field::NodeVonMises, values(3)),
            (Field::ElementEnergy, values(2)),
        ],
    }
}

/// The message of a kind in the conversation.
pub fn sample(kind: Kind) -> Message {
    conversation().into_iter().find(|message| message.kind() == kind).unwrap()
}

fn question() -> Question {
    Question {
        known: vec![DofValue { dof: 9, value: 0.0 }, DofValue { dof: 2, value: -0.001 }],
        forces: vec![DofValue { dof: 4, value: 0.5 }],
        masks: masks_of(&[&[(0, 0.25), (2, 0.75)], &[(1, 1.0)]]),
        mask_displacements: vec![[0.0, -0.001, 0.0], [0.0005, 0.0, 0.0]],
        method: MethodName::auto(),
        want: Want {
            nodes: NodeChoice::Nodes(vec![0, 2, 3]),
            reactions: true,
            precision: Precision::F32Quantised,
            fields: FieldSet::NONE,
        },
        max_error: Some(0.01),
        deadline_ms: None,
        spread: SpreadLoads::default(),
        quantity: Quantity::default(),
    }
}

/// A quantity of two displacements and a reaction.
pub fn quantity() -> Quantity {
    Quantity {
        of_displacements: vec![
            QuantityTerm { dof: 4, slope: 1.5, curvature: 0.0 },
            QuantityTerm { dof: 10, slope: -2.0, curvature: 300.0 },
        ],
        of_reactions: vec![QuantityTerm { dof: 2, slope: 0.25, curvature: -1.0 }],
        with_places: true,
    }
}

/// Derivatives for four nodes, a known displacement, two materials and a pressure.
pub fn gradient() -> GradientValues {
    let of_nodes = |scale: f64| (1..=4).map(|n| [scale * f64::from(n), 0.0, -scale]).collect();
    GradientValues {
        value: 0.125,
        by_forces: of_nodes(0.5),
        by_known: vec![DofValue { dof: 2, value: 8.0 }, DofValue { dof: 9, value: -0.5 }],
        by_materials: vec![[1e-5, 0.75], [-2e-6, 0.0]],
        by_acceleration: Some([0.0, 0.25, -1.0]),
        by_pressures: vec![4e-4],
        by_places: of_nodes(-3.0),
    }
}

/// Weight and two pressures.
fn spread() -> SpreadLoads {
    SpreadLoads {
        gravity: [0.0, -9.81, 0.5],
        densities: vec![1000.0],
        pressures: vec![
            SurfacePressure { pressure: 250.0, triangles: vec![[0, 1, 2], [3, 1, 0]] },
            SurfacePressure { pressure: -40.0, triangles: vec![[2, 3, 1]] },
        ],
    }
}

fn requests() -> Vec<Message> {
    let mesh = MeshData {
        vertices: vec![[0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 0.01], [0.0; 3]],
        tets: vec![[0, 1, 2, 3]],
        regions: vec![7],
        mid_edge: vec![],
    };
    let materials = vec![Material { young: 20_000.0, poisson: 0.45 }];
    let everything = Question {
        masks: Masks::default(),
        mask_displacements: vec![],
        method: "gauss-jordan".parse().unwrap(),
        want: Want::default(),
        max_error: None,
        deadline_ms: Some(16.5),
        ..question()
    };
    let body =
        Body { mesh: mesh.clone(), materials: materials.clone(), element: ElementChoice::T4 };
    [
        Request::Hello(Hello {
            capabilities: vec!["haptics".to_owned()],
            alive_every_ms: 2000,
            ..Hello::new("sample 1", Some("secret".to_owned()))
        }),
        Request::Ask(Box::new(Ask::new(body, everything))),
        Request::HaveModel(hash()),
        Request::UploadModel(UploadModel {
            mesh: MeshData { regions: vec![], ..mesh },
            materials,
            element: ElementName::T10,
            fixed: vec![9, 10, 11],
        }),
        Request::Cancel { request_id: 2 },
        Request::Prefetch(Prefetch {
            model: hash(),
            nodes: vec![1, 3],
            masks: masks_of(&[&[(3, 1.0), (1, 2.0)]]),
        }),
        Request::Drop(hash()),
        Request::Ping { nonce: 0x0123_4567_89ab_cdef },
        Request::ContactFrame(Box::new(contact_frame())),
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
        element: ElementName::T4.into(),
        unknown_dofs: 10,
        known_dofs: 2,
        stage_ms,
        residual_rel: 1e-15,
        error_bound_rel: Some(1e-12),
        error_bound_why: None,
        refinement_steps: 1,
        max_rotation_deg: 3.5,
        max_strain: 0.0625,
        precision: "f64".to_owned(),
        condition_estimate: None,
        error_estimate_rel: Some(1e-13),
        warning_level: WarningLevel::CAUTION,
        warnings: vec![Warning::new(WarningCode::ROTATION, "large rotation"), Warning::default()],
        peak_rss_bytes: 1 << 24,
        factor_reused: false,
        chosen_because: "smallest predicted time".to_owned(),
    };
    let displacements = vec![[0.0, -0.001, 0.0005], [0.0; 3], [0.00025, 0.0, 0.0]];
    let answer = Answer {
        report,
        large: None,
        nodes: NodeChoice::Nodes(vec![0, 2, 3]),
        displacements: Displacements::of(displacements, Precision::F32Quantised),
        reactions: vec![DofValue { dof: 2, value: -1.25 }],
        mask_forces: vec![[0.0, -0.75, 0.125], [0.5, 0.0, 0.0]],
        cases: vec![],
        fields: vec![],
        gradient: None,
    };
    let ready =
        ModelReady { model: hash(), unknown_dofs: 9, fixed_dofs: 3, reused: false, stage_ms };
    let welcome = Welcome {
        server: "sample server".to_owned(),
        version: "0.1.0".to_owned(),
        threads: 4,
        limits: Limits::default(),
        wire: VERSION,
        capabilities: vec!["cancel".to_owned(), "contact".to_owned()],
        idle_ms: 600_000,
    };
    let rejected = Rejected {
        code: RejectCode::RigidMotionFree,
        text: "the body can turn about the z axis".to_owned(),
        detail: String::new(),
        retry_after_ms: 250,
    };
    vec![
        Message::Reply(1, Reply::Welcome(welcome)),
        Message::Reply(2, Reply::Answer(Box::new(answer))),
        Message::Reply(3, Reply::ModelState { known: true }),
        Message::Reply(4, Reply::ModelReady(ready)),
        Message::Reply(5, Reply::Rejected(rejected)),
        Message::Reply(0, Reply::Alive),
        Message::Reply(8, Reply::Pong { nonce: 0x0123_4567_89ab_cdef }),
        Message::Reply(9, Reply::ContactAnswer(Box::new(contact_answer()))),
    ]
}

fn large_answer() -> Answer {
    let stage_ms = StageMs { decode: 0.125, factor: 2.5, solve: 4.0, ..StageMs::default() };
    let report = SolveReport {
        method: "newton".to_owned(),
        element: ElementName::T4Anp.into(),
        unknown_dofs: 10,
        known_dofs: 2,
        stage_ms,
        residual_rel: 1e-12,
        error_bound_why: Some("large deformation".to_owned()),
        max_rotation_deg: 40.0,
        max_strain: 0.5,
        precision: "f64".to_owned(),
        error_estimate_rel: Some(1e-4),
        peak_rss_bytes: 1 << 24,
        factor_reused: true,
        chosen_because: "asked for".to_owned(),
        ..SolveReport::default()
    };
    let large = LargeReport {
        is_linear: false,
        newton_steps: 2,
        linear_solves: 3,
        factor_age: 7,
        substeps: 1,
        min_jacobian: 0.75,
        energy_error_rel: Some(0.001),
        max_stretch: 1.5,
        jumped: false,
        settled: true,
        plastic_strain: 0.125,
    };
    Answer {
        report,
        large: Some(large),
        nodes: NodeChoice::Nodes(vec![1]),
        displacements: Displacements::F64(vec![[0.0, -0.005, 0.0005]]),
        reactions: vec![],
        mask_forces: vec![],
        cases: vec![],
        fields: vec![],
        gradient: None,
    }
}

/// Masks with these nodes and weights.
pub fn masks_of(lists: &[&[(u32, f64)]]) -> Masks {
    let mut masks = Masks::default();
    lists.iter().for_each(|list| masks.push(list));
    masks
}

fn hash() -> ModelHash {
    ModelHash(std::array::from_fn(|i| 0xa0 ^ u8::try_from(i).unwrap()))
}

fn object_state() -> ObjectState {
    ObjectState {
        pose: [0.5, 0.25, -0.125, 1.0, 0.0, 0.0, 0.0],
        velocity: [0.0, 0.0, -0.5],
        angular_velocity: [0.25, 0.0, 0.0],
        force_nodes: vec![2],
        forces: vec![[0.0, 0.5, 1.0]],
        contacts: vec![HeldContact {
            body: 1,
            nodes: [0, 2, 3],
            weights: [0.5, 0.25, 0.25],
            force: [0.0, 0.0, 1.5],
        }],
    }
}

fn contact_frame() -> ContactFrame {
    let still = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
    let body =
        |shape| BodyMotion { shape, start: still, end: still, friction: 0.5, compliance: 0.0 };
    let vertices = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let triangles = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    ContactFrame {
        model: hash(),
        ask: ContactAsk {
            seconds: 0.01,
            gravity: [0.0, 0.0, -9.81],
            density: 1000.0,
            viscosity: 0.005,
            penetration_rel: 1e-6,
            residual_rel: 1e-9,
            rounds_max: 16,
            newton_max: 400,
            deformation: Some(Deformation::Auto),
            law: LawName::NeoHookeanLog,
            yield_stress: Some(750.0),
            path: PathChoice::FromRest,
            ..ContactAsk::default()
        },
        state: object_state(),
        bodies: vec![
            body(BodyShape::Plane { normal: [0.0, 0.0, 1.0] }),
            body(BodyShape::Capsule { radius: 0.008, length: 0.03 }),
            body(BodyShape::Mesh { vertices, triangles }),
            body(BodyShape::Sphere { radius: 0.5 }),
            body(BodyShape::Box { half: [0.5, 0.25, 0.125] }),
        ],
        triangles: vec![[0, 2, 3], [1, 2, 0]],
        triangle_bodies: vec![1, 0],
        nodes: NodeChoice::Nodes(vec![0, 3]),
        precision: Precision::F64,
        fields: FieldSet::NONE,
    }
}

/// The frame with box and mesh rounded.
fn rounded(mut frame: ContactFrame) -> ContactFrame {
    for BodyMotion { shape, .. } in &mut frame.bodies {
        if let BodyShape::Mesh { vertices, triangles } = shape.clone() {
            *shape = BodyShape::RoundedMesh { vertices, triangles, radius: 0.25 };
        } else if let BodyShape::Box { half } = *shape {
            *shape = BodyShape::RoundedBox { half, radius: 0.0625 };
        }
    }
    frame
}

fn contact_answer() -> ContactAnswer {
    let answer = Answer { large: None, ..large_answer() };
    let point = ContactPoint {
        body: 1,
        slips: true,
        place: [0.25, 0.5, 0.0],
        normal: [0.0, 0.0, 1.0],
        force: [0.5, 0.0, 1.0],
        slip: [-0.001, 0.0, 0.0],
    };
    let load = BodyLoad {
        force: [0.5, 0.0, 1.0],
        torque: [0.0, 0.25, 0.0],
        normal_force: 1.0,
        contacts: 1,
    };
    ContactAnswer {
        answer,
        contact: ContactReport {
            penetration_max: 1e-9,
            slip_max: 0.001,
            residual: 1e-10,
            residual_rel: 1e-10,
            cone_violation: 0.0,
            is_converged: true,
            rounds: 3,
            sweeps: 6,
            newton_steps: 5,
            columns_computed: 2,
            is_large: true,
            shapes: 4,
            factors: 1,
            plastic_strain: 0.125,
            ..ContactReport::default()
        },
        state: object_state(),
        points: vec![point],
        loads: vec![BodyLoad::default(), load],
        small_system: SmallSystem::default(),
    }
}

/// A frame that asks for the small system of its step.
fn felt_frame() -> ContactFrame {
    let frame = contact_frame();
    ContactFrame { ask: ContactAsk { small_system: true, ..frame.ask }, ..frame }
}

/// An answer with a small system of one body.
fn felt_answer() -> ContactAnswer {
    let answer = contact_answer();
    let contact = BodyContact {
        body: 1,
        place: [0.25, 0.5, 0.0],
        normal: [0.0, 0.0, 1.0],
        force: [0.5, 0.0, 1.0],
        friction: 0.5,
    };
    let compliance = vec![0.004, 0.0, 0.0, 0.0, 0.004, 0.0, 0.0, 0.0, 0.002];
    ContactAnswer {
        contact: ContactReport { small_contacts: 1, ..answer.contact },
        small_system: SmallSystem { contacts: vec![contact], compliance },
        ..answer
    }
}
