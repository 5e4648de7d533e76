//! Derivatives that a server answers: of frames, of requests with a mesh, linear and large, and refusals.

use softgrasp_protocol::RejectCode::{BadRequest, Uncertain};
use softgrasp_protocol::{
    Answer, Ask, Deformation, ElementChoice, ElementName, GradientValues, LargeAsk, Pace,
    PathChoice, Quantity, QuantityTerm, Question, Reply, Request, UploadModel,
};
use softgrasp_tests::questions::{Once, cube, once, question, squeeze, upload};

use crate::start::{answer, client, refusal, server};

/// A quantity of all displacements and of some reactions.
fn quantity(nodes: usize, held: &[u32]) -> Quantity {
    let term = |dof: u32, size: f64| QuantityTerm {
        dof,
        slope: size * (1.3 * f64::from(dof)).sin(),
        curvature: 50.0 * size * (0.7 * f64::from(dof)).cos(),
    };
    Quantity {
        of_displacements: (0..3 * nodes as u32).map(|dof| term(dof, 1.0)).collect(),
        of_reactions: held.iter().map(|&dof| term(dof, 1e-3)).collect(),
        with_places: true,
    }
}

/// J of an answer to a question about all nodes, with reactions.
fn value(quantity: &Quantity, answer: &Answer) -> f64 {
    let of = |term: &QuantityTerm, x: f64| (term.slope + 0.5 * term.curvature * x) * x;
    let u = answer.displacements.clone().into_f64();
    let u = u.as_flattened();
    let displaced: f64 = quantity.of_displacements.iter().map(|t| of(t, u[t.dof as usize])).sum();
    let held = quantity.of_reactions.iter().map(|term| {
        let own = answer.reactions.iter().find(|reaction| reaction.dof == term.dof).unwrap();
        of(term, own.value)
    });
    displaced + held.sum::<f64>()
}

fn gradient(answer: &Answer) -> &GradientValues {
    answer.gradient.as_ref().unwrap()
}

#[test]
fn derivatives_are_central_differences_of_what_the_server_answers() {
    let server = server(2);
    let mut connection = client(&server);
    let mesh = cube(125);
    let known = squeeze(&mesh, 0.3);
    let held: Vec<u32> = known.iter().step_by(5).map(|known| known.dof).collect();
    let quantity = quantity(mesh.node_count(), &held);
    let from_rest = LargeAsk { path: PathChoice::FromRest, ..LargeAsk::default() };
    for large in [None, Some(from_rest)] {
        for (element, choice) in [
            (ElementName::T4, ElementChoice::T4),
            (ElementName::T4Anp, ElementChoice::T4Anp),
            (ElementName::T10, ElementChoice::T10),
        ] {
            let asked = Question { quantity: quantity.clone(), ..question(known.clone(), "auto") };
            let whole = Once { element: choice, question: asked.clone(), ..once(&mesh, "auto") };
            let whole = Ask { large, ..Ask::from(whole) };
            let found = answer(&mut connection, &whole.clone().into());
            let of_whole = gradient(&found).clone();
            let expected = value(&quantity, &found);
            assert!((of_whole.value - expected).abs() < 1e-9 * expected.abs(), "{expected}");
            for k in [0, known.len() / 2, known.len() - 1] {
                let step = 1e-6;
                let [up, down] = [step, -step].map(|step| {
                    let mut moved = whole.clone();
                    moved.question.quantity = Quantity::default();
                    moved.question.known[k].value += step;
                    let moved = answer(&mut connection, &moved.into());
                    assert!(moved.gradient.is_none());
                    value(&quantity, &moved)
                });
                let expected = (up - down) / (2.0 * step);
                let own = of_whole.by_known.iter().find(|own| own.dof == known[k].dof).unwrap();
                let off = (own.value - expected).abs();
                assert!(off < 1e-6 * expected.abs(), "{choice:?}: {own:?} for {expected}");
            }
            let model = UploadModel { element, ..upload(&mesh) };
            let Ok(Reply::ModelReady(ready)) = connection.ask(&Request::UploadModel(model)) else {
                panic!("no model")
            };
            let frame = Ask { large, ..Ask::new(ready.model, asked) };
            for _ in 0..2 {
                let frame = answer(&mut connection, &frame.clone().into());
                let size = of_whole.by_forces.as_flattened().iter();
                let size = size.fold(0.0f64, |most, slope| most.max(slope.abs()));
                let pairs = gradient(&frame).by_forces.as_flattened().iter();
                let pairs = pairs.zip(of_whole.by_forces.as_flattened());
                assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-7 * size));
                assert_eq!(gradient(&frame).by_materials.len(), 1);
                assert_eq!(gradient(&frame).by_places.len(), mesh.node_count());
            }
        }
    }
}

#[test]
fn what_has_no_derivatives_is_refused_and_the_session_lives() {
    let server = server(2);
    let mut connection = client(&server);
    let mesh = cube(64);
    let known = squeeze(&mesh, 0.3);
    let free = (0..3 * mesh.node_count() as u32).find(|dof| known.iter().all(|k| k.dof != *dof));
    let of = |quantity: Quantity| Question { quantity, ..question(known.clone(), "auto") };
    let ask = |question: Question| Ask::from(Once { question, ..once(&mesh, "auto") });
    let mut refused = |ask: Ask| refusal(&mut connection, &ask.into());
    let all = || quantity(mesh.node_count(), &[]);
    let term = |dof: u32| QuantityTerm { dof, slope: 1.0, curvature: 0.0 };
    let far = Quantity { of_displacements: vec![term(u32::MAX)], ..Quantity::default() };
    let unheld = Quantity { of_reactions: vec![term(free.unwrap())], ..Quantity::default() };
    let endless = QuantityTerm { curvature: f64::NAN, ..term(0) };
    let endless = Quantity { of_displacements: vec![endless], ..Quantity::default() };
    for (quantity, word) in [(far, "nodes"), (unheld, "reaction"), (endless, "NaN")] {
        for large in [None, Some(LargeAsk::default())] {
            let (code, text) = refused(Ask { large, ..ask(of(quantity.clone())) });
            assert_eq!(code, BadRequest, "{}", text);
            assert!(text.contains(word), "{}", text);
        }
    }
    let condensed = Question { method: "condensed".parse().unwrap(), ..of(all()) };
    let (code, text) = refused(ask(condensed));
    assert_eq!(code, BadRequest);
    assert!(text.contains("factor"), "{}", text);
    let values: Vec<f64> = known.iter().map(|known| 2.0 * known.value).collect();
    let (code, text) = refused(Ask { cases: vec![values], ..ask(of(all())) });
    assert_eq!(code, BadRequest);
    assert!(text.contains("one case"), "{}", text);
    let flowing = LargeAsk { yield_stress: Some(100.0), ..LargeAsk::default() };
    let (code, text) = refused(Ask { large: Some(flowing), ..ask(of(all())) });
    assert_eq!(code, BadRequest);
    assert!(text.contains("yield stress"), "{}", text);
    let loose = Question { max_error: Some(0.1), ..of(all()) };
    let at_large = LargeAsk { deformation: Deformation::Large, pace: Pace::Repeatable, ..flowing };
    let at_large = LargeAsk { yield_stress: None, ..at_large };
    let (code, text) = refused(Ask { large: Some(at_large), ..ask(loose) });
    assert_eq!(code, Uncertain);
    assert!(text.contains("converged"), "{}", text);
    let without = Ask { without_estimate: true, ..ask(of(all())) };
    assert!(answer(&mut connection, &without.into()).gradient.is_some());
}
