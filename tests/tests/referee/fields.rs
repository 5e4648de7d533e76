//! Stress, strain and energy of every element beside those that CalculiX prints at its points.

use std::path::Path;

use softgrasp_core::fem::Element;
use softgrasp_protocol::{
    Answer, Ask, Body, Deformation, DofValue, ElementChoice, Field, FieldSet, FieldValues,
    LargeAsk, Reply, Request, Want,
};
use softgrasp_tests::questions::mesh_data;

use crate::agreement::Comparison;
use crate::ccx::{Ccx, Printed};
use crate::deck::{self, System};
use crate::object::{self, Object};
use crate::question::{Question, large_questions, questions};
use crate::solved::Asked;

/// Largest difference at large deformation, relative to the largest number: CalculiX stops its iterations
/// at a residual of 1e-9 and sums its increments.
const LARGE_AGREE: f64 = 2e-5;

/// Values of every element, as means over its points.
struct ElementMeans {
    stress: Vec<[Printed; 6]>,
    strain: Vec<[Printed; 6]>,
    /// Stored energy for each unit of volume at rest, J/m³.
    density: Vec<Printed>,
}

/// The deck that also prints stress, strain and energy of the elements at the end of the step.
fn deck_with_fields(object: &Object, system: &System, question: &Question) -> String {
    let deck = deck::deck(object, system, question);
    let (before, end) = deck.rsplit_once("*END STEP").unwrap();
    format!("{before}*EL PRINT, ELSET=BODY, FREQUENCY=100000\nS, E, ENER\n*END STEP{end}")
}

/// Rows `element point numbers…` under a heading, as means over the points of each element.
fn read_means<const K: usize>(text: &str, title: &str, elements: usize) -> Vec<[Printed; K]> {
    let mut lines = text.lines().skip_while(|line| !line.trim_start().starts_with(title)).skip(1);
    let rows = lines.by_ref().map(|line| line.split_whitespace().collect::<Vec<_>>());
    let nothing = Printed { value: 0.0, half_unit: 0.0 };
    let (mut sums, mut counts) = (vec![[nothing; K]; elements], vec![0.0; elements]);
    for row in rows.skip_while(Vec::is_empty).take_while(|row| row.len() == K + 2) {
        let element = row[0].parse::<usize>().unwrap() - 1;
        counts[element] += 1.0;
        for (sum, text) in sums[element].iter_mut().zip(&row[2..]) {
            let number = Printed::parse(text).unwrap();
            sum.value += number.value;
            sum.half_unit += number.half_unit;
        }
    }
    let points = counts[0];
    assert!(points > 0.0 && counts.iter().all(|own| *own == points), "{title}: {points}");
    let mean = |number: Printed| Printed {
        value: number.value / points,
        half_unit: number.half_unit / points,
    };
    sums.into_iter().map(|sum| sum.map(mean)).collect()
}

impl ElementMeans {
    fn read(text: &str, elements: usize) -> Self {
        // CalculiX prints xx, yy, zz, xy, xz, yz.
        let in_order = |mut six: [Printed; 6]| {
            six.swap(4, 5);
            six
        };
        let tensors =
            |title| read_means::<6>(text, title, elements).into_iter().map(in_order).collect();
        Self {
            stress: tensors("stresses"),
            strain: tensors("strains"),
            density: read_means::<1>(text, "internal energy density", elements)
                .into_iter()
                .map(|[number]| number)
                .collect(),
        }
    }
}

/// Fields of the elements in the server's answer.
fn answered(asked: &Asked, object: &Object, system: &System, question: &Question) -> FieldValues {
    let value = |&(dof, value): &(u32, f64)| DofValue { dof, value };
    let wanted = [Field::ElementStrain, Field::ElementStress, Field::ElementEnergy];
    let (young, poisson) = (question.young, question.poisson);
    let body = Body {
        mesh: mesh_data(&object.mesh),
        materials: object.materials(young, poisson),
        element: if system.element == Element::Tet4 {
            ElementChoice::T4
        } else {
            ElementChoice::T10
        },
    };
    let message = softgrasp_protocol::Question {
        known: question.known.iter().map(value).collect(),
        forces: question.forces.iter().map(value).collect(),
        want: Want { fields: FieldSet::from_iter(wanted), ..Want::default() },
        ..softgrasp_protocol::Question::default()
    };
    let large = LargeAsk { deformation: Deformation::Large, ..LargeAsk::default() };
    let ask = Ask { large: question.is_large.then_some(large), ..Ask::new(body, message) };
    let reply = asked.connection().ask(&Request::from(ask));
    let Ok(Reply::Answer(answer)) = reply else { panic!("{}: {reply:?}", object.name) };
    let Answer { mut fields, .. } = *answer;
    fields.remove(0)
}

/// Compares stress, strain and energy of every element.
fn compare(ccx: &Ccx, folder: &Path, asked: &Asked, object: &Object, of: (Element, Question)) {
    let (element, question) = of;
    let system = System::new(&object.mesh, element);
    let text = ccx.printed(folder, &deck_with_fields(object, &system, &question)).unwrap();
    let printed = ElementMeans::read(&text, object.mesh.tets().len());
    let fields = answered(asked, object, &system, &question);
    let pairs = |printed: &[[Printed; 6]], field: Field| -> Vec<(Printed, f64)> {
        let own = fields.get(field).unwrap();
        printed.as_flattened().iter().copied().zip(own.iter().copied()).collect()
    };
    let energy = fields.get(Field::ElementEnergy).unwrap();
    let of_energy = |(tet, printed): (usize, &Printed)| {
        (*printed, energy[tet] / object.mesh.signed_volume(tet))
    };
    let compared = [
        ("stress", pairs(&printed.stress, Field::ElementStress)),
        ("strain", pairs(&printed.strain, Field::ElementStrain)),
        ("energy density", printed.density.iter().enumerate().map(of_energy).collect()),
    ];
    for (name, pairs) in compared {
        // Of hyperelastic materials CalculiX prints another energy than that of the law, and the points of
        // a curved element stand for different volumes, which it does not print.
        let is_curved = !object.mesh.mid_edge_nodes().is_empty();
        if (question.is_large || is_curved) && name == "energy density" {
            continue;
        }
        let comparison = Comparison::of(&pairs);
        let case = format!("{}, {element:?}, Poisson {}, {name}", object.name, question.poisson);
        println!(
            "{case}: {} numbers, differ by {:.1e} of the largest, {:.1e} beyond printed digits",
            comparison.count, comparison.difference_rel, comparison.beyond_digits_rel
        );
        match question.is_large {
            false => assert!(comparison.holds(), "{case}: {comparison:?}"),
            true => assert!(comparison.difference_rel < LARGE_AGREE, "{case}: {comparison:?}"),
        }
    }
}

#[test]
fn stress_strain_and_energy_of_elements_agree_with_calculix() {
    let Some(ccx) = Ccx::find() else { return };
    let folder = tempfile::tempdir().unwrap();
    let asked = Asked::new();
    let objects = object::built_in(folder.path(), if object::is_full() { 600 } else { 100 });
    // Linear: prescribed displacements with either element, and forces; two of large deformation.
    for (object, element) in objects.iter().zip([Element::Tet4, Element::Tet10].iter().cycle()) {
        let system = System::new(&object.mesh, *element);
        for question in questions(object, &system).into_iter().filter(|q| q.is_short) {
            compare(&ccx, folder.path(), &asked, object, (*element, question));
        }
    }
    let round = object::round(folder.path(), 80);
    let system = System::new(&round.mesh, Element::Tet10);
    for question in questions(&round, &system).into_iter().filter(|q| q.is_short) {
        compare(&ccx, folder.path(), &asked, &round, (Element::Tet10, question));
    }
    for (object, element) in objects.iter().zip([Element::Tet4, Element::Tet10]) {
        let question = large_questions(object).remove(0).halved();
        compare(&ccx, folder.path(), &asked, object, (element, question));
    }
}
