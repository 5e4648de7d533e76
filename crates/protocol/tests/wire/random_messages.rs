//! Random messages of every kind.

use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use softgrasp_protocol::*;

use crate::random_contact::{contact_answer, contact_frame};
use crate::samples::{Message, masks_of};

/// Strategy that draws any message; without NaN, so that equality can be tested.
pub fn any_message() -> impl Strategy<Value = Message> {
    let request = (any::<u64>(), any_request()).prop_map(|(id, m)| Message::Request(id, m));
    let reply = (any::<u64>(), any_reply()).prop_map(|(id, m)| Message::Reply(id, m));
    prop_oneof![request, reply]
}

fn any_request() -> impl Strategy<Value = Request> {
    let hello = (text(), option::of(text()), vec(text(), 0..3), any::<u32>()).prop_map(
        |(client, token, capabilities, alive_every_ms)| Hello {
            capabilities,
            alive_every_ms,
            ..Hello::new(client, token)
        },
    );
    let model = || any::<[u8; 32]>().prop_map(ModelHash);
    let materials = || {
        let one = (number(), number()).prop_map(|(young, poisson)| Material { young, poisson });
        vec(one, 0..4)
    };
    let body = (mesh(), materials(), element_choice())
        .prop_map(|(mesh, materials, element)| Body { mesh, materials, element }.into());
    let subject = prop_oneof![body, model().prop_map(Subject::Model)];
    let level =
        prop::sample::select(vec![ReportLevel::Full, ReportLevel::Short, ReportLevel::None]);
    let choices = (any::<[bool; 2]>(), level);
    let ask = (subject, question(), option::of(large_ask()), 0..4_usize, choices).prop_map(
        |(subject, question, large, count, ([without_estimate, newest_wins], report))| {
            let count = if question.known.is_empty() { 0 } else { count };
            let case = |k: usize| {
                let sign = if k.is_multiple_of(2) { 1.0 } else { -1.0 };
                question.known.iter().map(|known| sign * known.value).collect()
            };
            let cases = (0..count).map(case).collect();
            Box::new(Ask { subject, question, large, cases, without_estimate, newest_wins, report })
        },
    );
    let upload = (mesh(), materials(), element(), vec(any::<u32>(), 0..9)).prop_map(
        |(mesh, materials, element, fixed)| UploadModel { mesh, materials, element, fixed },
    );
    let prefetch = (model(), vec(any::<u32>(), 0..9), masks())
        .prop_map(|(model, nodes, masks)| Request::Prefetch(Prefetch { model, nodes, masks }));
    prop_oneof![
        hello.prop_map(Request::Hello),
        ask.prop_map(Request::Ask),
        model().prop_map(Request::HaveModel),
        upload.prop_map(Request::UploadModel),
        any::<u64>().prop_map(|request_id| Request::Cancel { request_id }),
        prefetch,
        model().prop_map(Request::Drop),
        any::<u64>().prop_map(|nonce| Request::Ping { nonce }),
        contact_frame().prop_map(|frame| Request::ContactFrame(Box::new(frame))),
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
    let numbers = (any::<u32>(), any::<u16>(), any::<u64>());
    let welcome = (text(), text(), numbers, limits, vec(text(), 0..4)).prop_map(
        |(server, version, (threads, wire, idle_ms), limits, capabilities)| Welcome {
            server,
            version,
            threads,
            limits,
            wire,
            capabilities,
            idle_ms,
        },
    );
    let ready = (any::<[u8; 32]>(), any::<[u64; 2]>(), any::<bool>(), stage_ms()).prop_map(
        |(model, [unknown_dofs, fixed_dofs], reused, stage_ms)| ModelReady {
            model: ModelHash(model),
            unknown_dofs,
            fixed_dofs,
            reused,
            stage_ms,
        },
    );
    let rejected = (any::<u16>(), text(), text(), any::<u32>()).prop_map(
        |(number, text, detail, retry_after_ms)| {
            let code = RejectCode::from_number(number);
            Rejected { code, text, detail, retry_after_ms }
        },
    );
    prop_oneof![
        welcome.prop_map(Reply::Welcome),
        answer().prop_map(|answer| Reply::Answer(Box::new(answer))),
        any::<bool>().prop_map(|known| Reply::ModelState { known }),
        ready.prop_map(Reply::ModelReady),
        rejected.prop_map(Reply::Rejected),
        any::<u64>().prop_map(|nonce| Reply::Pong { nonce }),
        Just(Reply::Alive),
        contact_answer().prop_map(|answer| Reply::ContactAnswer(Box::new(answer))),
    ]
}

pub fn answer() -> impl Strategy<Value = Answer> {
    let double = vec(point(), 0..9).prop_map(Displacements::F64);
    let single =
        (number(), vec(prop::array::uniform3(any::<i32>()), 0..9)).prop_map(|(scale, v)| {
            let values = v.iter().map(|u| u.map(|c| c as f32 / 2_f32.powi(31))).collect();
            Displacements::F32Quantised { scale, values }
        });
    let displacements = prop_oneof![double, single];
    let forces = (dof_values(), vec(point(), 0..4));
    let reports = (report(), option::of(large_report()));
    let parts = (reports, displacements, any::<[bool; 3]>(), forces, 0..4_usize);
    parts.prop_map(
        |((report, large), displacements, [all, has_fields, has_gradient], forces, cases)| {
            let (reactions, mask_forces) = forces;
            let count = u32::try_from(displacements.node_count()).unwrap();
            let nodes = if all {
                NodeChoice::All
            } else {
                NodeChoice::Nodes((0..count).map(|node| node.wrapping_mul(0x9e37_79b9)).collect())
            };
            let case = |k: usize| CaseAnswer {
                displacements: vec![[k as f64, -0.5, 0.0]; displacements.node_count()],
                reactions: vec![0.25 * k as f64; reactions.len()],
            };
            let cases = if displacements.node_count() + reactions.len() == 0 { 0 } else { cases };
            let cases: Vec<CaseAnswer> = (0..cases).map(case).collect();
            let fields = fields(has_fields, displacements.node_count(), 1 + cases.len());
            let gradient = has_gradient.then(|| gradient(displacements.node_count()));
            Answer {
                report,
                large,
                nodes,
                displacements,
                reactions,
                mask_forces,
                cases,
                fields,
                gradient,
            }
        },
    )
}

/// Derivatives for `nodes` nodes, with and without some of them.
fn gradient(nodes: usize) -> GradientValues {
    let of_nodes = vec![[1.5, nodes as f64, -0.25]; nodes];
    GradientValues {
        value: nodes as f64,
        by_known: vec![DofValue { dof: 7, value: -0.5 }; nodes / 2],
        by_materials: vec![[0.5, 2.0]; nodes % 3],
        by_acceleration: nodes.is_multiple_of(2).then_some([0.0, 1.0, -2.0]),
        by_pressures: vec![0.125; nodes % 4],
        by_places: if nodes.is_multiple_of(5) { vec![] } else { of_nodes.clone() },
        by_forces: of_nodes,
    }
}

/// Fields of `cases` cases, each with values for `nodes` nodes and one element more.
fn fields(are_there: bool, nodes: usize, cases: usize) -> Vec<FieldValues> {
    if !are_there {
        return Vec::new();
    }
    let count = |field: Field| match field.place() {
        FieldPlace::Elements => nodes + 1,
        FieldPlace::Nodes => nodes,
    };
    let wanted = |field: &Field| !(field.bit() as usize + nodes).is_multiple_of(3);
    let array = |field: Field| {
        (field, vec![0.5 * f64::from(field.bit()); field.components() * count(field)])
    };
    let case = |case: usize| FieldValues {
        energy: case as f64,
        error_rel: 0.25,
        arrays: Field::ALL.into_iter().filter(wanted).map(array).collect(),
    };
    (0..cases).map(case).collect()
}

fn report() -> impl Strategy<Value = SolveReport> {
    let texts = (text(), option::of(text()), text(), text(), vec((any::<u16>(), text()), 0..4));
    let numbers = (prop::array::uniform3(number()), option::of(number()), option::of(number()));
    let counts = (any::<[u64; 3]>(), any::<u32>(), any::<bool>());
    (texts, numbers, counts, element(), stage_ms()).prop_map(
        |(texts, numbers, counts, element, stage_ms)| {
            let (method, error_bound_why, precision, chosen_because, warnings) = texts;
            let ([residual_rel, max_rotation_deg, max_strain], bound, condition) = numbers;
            let ([unknown_dofs, known_dofs, peak_rss_bytes], steps, factor_reused) = counts;
            let warnings = warnings.into_iter();
            let warnings = warnings.map(|(code, text)| Warning::new(WarningCode(code), text));
            let warnings = warnings.collect();
            SolveReport {
                method,
                element: element.into(),
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
                warning_level: [WarningLevel::NONE, WarningLevel::SERIOUS][steps as usize % 2],
                warnings,
                peak_rss_bytes,
                factor_reused,
                chosen_because,
            }
        },
    )
}

fn large_ask() -> impl Strategy<Value = LargeAsk> {
    let deformation = prop::sample::select(vec![Deformation::Large, Deformation::Auto]);
    let law = prop::sample::select(vec![LawName::NeoHookean, LawName::NeoHookeanLog]);
    let path = prop::sample::select(vec![PathChoice::Continue, PathChoice::FromRest]);
    let pace = prop::sample::select(vec![Pace::Repeatable, Pace::Timely]);
    (deformation, law, option::of(number()), path, pace).prop_map(
        |(deformation, law, yield_stress, path, pace)| LargeAsk {
            deformation,
            law,
            yield_stress,
            path,
            pace,
        },
    )
}

fn large_report() -> impl Strategy<Value = LargeReport> {
    let counts = any::<[u32; 4]>();
    let numbers = (prop::array::uniform3(number()), option::of(number()));
    (counts, numbers, any::<[bool; 3]>()).prop_map(
        |(counts, numbers, [jumped, settled, is_linear])| {
            let [newton_steps, linear_solves, factor_age, substeps] = counts;
            let ([min_jacobian, max_stretch, plastic_strain], energy_error_rel) = numbers;
            LargeReport {
                is_linear,
                newton_steps,
                linear_solves,
                factor_age,
                substeps,
                min_jacobian,
                energy_error_rel,
                max_stretch,
                jumped,
                settled,
                plastic_strain,
            }
        },
    )
}

fn mesh() -> impl Strategy<Value = MeshData> {
    let parts =
        (vec(point(), 0..9), vec(any::<[u32; 4]>(), 0..9), any::<bool>(), any::<Option<u32>>());
    parts.prop_map(|(vertices, tets, labelled, middle)| {
        let regions = tets.iter().filter(|_| labelled).map(|corners| corners[0] % 5).collect();
        let mid_edge = tets.iter().filter_map(|&[a, b, c, d]| Some([a, b, c, d, middle?, 7]));
        MeshData { mid_edge: mid_edge.collect(), vertices, tets, regions }
    })
}

fn question() -> impl Strategy<Value = Question> {
    let nodes =
        prop_oneof![Just(NodeChoice::All), vec(any::<u32>(), 0..9).prop_map(NodeChoice::Nodes),];
    let precision = prop::sample::select(vec![Precision::F64, Precision::F32Quantised]);
    let fields = any::<u32>().prop_map(FieldSet::from_bits);
    let want = (nodes, any::<bool>(), precision, fields).prop_map(
        |(nodes, reactions, precision, fields)| Want { nodes, reactions, precision, fields },
    );
    let method = prop::sample::select(vec!["auto", "gauss-jordan", "pcg", "a_b-9"])
        .prop_map(|name| name.parse().unwrap());
    let bounds = (option::of(number()), option::of(number()));
    (dof_values(), dof_values(), masks(), method, want, bounds, spread(), quantity()).prop_map(
        |(known, forces, masks, method, want, (max_error, deadline_ms), spread, quantity)| {
            Question {
                known,
                forces,
                mask_displacements: (0..masks.len()).map(|i| [i as f64, -0.5, 1e-3]).collect(),
                masks,
                method,
                want,
                max_error,
                deadline_ms,
                spread,
                quantity,
            }
        },
    )
}

fn quantity() -> impl Strategy<Value = Quantity> {
    let terms = || {
        let term = (any::<u32>(), number(), number());
        vec(term.prop_map(|(dof, slope, curvature)| QuantityTerm { dof, slope, curvature }), 0..4)
    };
    let some = (terms(), terms(), any::<bool>()).prop_map(
        |(of_displacements, of_reactions, with_places)| {
            // What has no term does not travel.
            let is_there = !of_displacements.is_empty() || !of_reactions.is_empty();
            Quantity { of_displacements, of_reactions, with_places: with_places && is_there }
        },
    );
    prop_oneof![Just(Quantity::default()), some]
}

fn spread() -> impl Strategy<Value = SpreadLoads> {
    let pressure = (number(), vec(any::<[u32; 3]>(), 0..4))
        .prop_map(|(pressure, triangles)| SurfacePressure { pressure, triangles });
    let some = (point(), vec(number(), 0..4), vec(pressure, 0..4)).prop_map(
        |(gravity, densities, pressures)| SpreadLoads {
            // What draws nothing does not travel.
            gravity: match densities.is_empty() && pressures.is_empty() {
                true => [0.0; 3],
                false => gravity,
            },
            densities,
            pressures,
        },
    );
    prop_oneof![Just(SpreadLoads::default()), some]
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

pub fn point() -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(number())
}

/// Strategy that draws every kind of double except NaN.
pub fn number() -> impl Strategy<Value = f64> {
    use prop::num::f64::{INFINITE, NEGATIVE, NORMAL, POSITIVE, SUBNORMAL, ZERO};
    POSITIVE | NEGATIVE | NORMAL | SUBNORMAL | ZERO | INFINITE
}

fn text() -> impl Strategy<Value = String> {
    vec(any::<char>(), 0..12).prop_map(|chars| chars.into_iter().collect())
}
