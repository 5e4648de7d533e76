//! CalculiX as referee: the same mesh, the same known displacements, the same element.
//!
//! Without `ccx` on the PATH the comparisons skip themselves in one line. `SOFTGRASP_REFEREE=full`
//! asks for larger objects, every file and every question; `tests/referee/run.sh full` sets it.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "helpers of tests fail and speak like tests"
)]

mod agreement;
mod ccx;
mod contact;
mod contact_deck;
mod deck;
mod fields;
mod object;
mod question;
mod solved;
mod table;

use std::path::Path;

use crate::agreement::Agreement;
use crate::ccx::{Ccx, Results};
use crate::deck::System;
use crate::object::{Object, is_full};
use crate::question::{Question, questions};
use crate::solved::Asked;
use crate::table::Table;

/// Number of nodes above which only the questions of the short form are asked: CalculiX takes half a
/// minute and more for each.
const LARGE: usize = 8000;

/// Asks both programs, compares their answers, and adds a row to the table.
fn compare(ccx: &Ccx, folder: &Path, asked: &Asked, objects: &[Object]) {
    let mut table = Table::default();
    for object in objects {
        for &element in object.elements() {
            let system = System::new(&object.mesh, element);
            let mut of_object = Agreement::default();
            for question in questions(object, &system) {
                let is_large = system.vertices.len() > LARGE;
                if !question.is_short && (is_large || !is_full()) {
                    continue;
                }
                let printed = ccx.run(folder, &deck::deck(object, &system, &question), &system);
                let found = asked.answer(object, &system, &question, folder);
                let agreement = Agreement::of(&printed, &found, &question);
                assert!(
                    agreement.holds(),
                    "{}, {element:?}, {}: {agreement}",
                    object.name,
                    question.name
                );
                of_object.add(&agreement);
            }
            table.push(object, &system, &of_object);
        }
    }
    println!("{table}");
}

#[test]
fn built_in_objects_agree_to_the_digits_that_calculix_prints() {
    let Some(ccx) = Ccx::find() else { return };
    let folder = tempfile::tempdir().unwrap();
    let nodes = if is_full() { 1000 } else { 120 };
    let objects = object::built_in(folder.path(), nodes);
    assert_eq!(objects.len(), 4);
    compare(&ccx, folder.path(), &Asked::new(), &objects);
}

#[test]
fn regions_of_two_materials_agree_to_the_digits_that_calculix_prints() {
    let Some(ccx) = Ccx::find() else { return };
    let folder = tempfile::tempdir().unwrap();
    let nodes = if is_full() { 2000 } else { 300 };
    let objects = [object::sphere_with_stone(folder.path(), nodes)];
    compare(&ccx, folder.path(), &Asked::new(), &objects);
}

#[test]
fn curved_elements_agree_to_the_digits_that_calculix_prints() {
    let Some(ccx) = Ccx::find() else { return };
    let folder = tempfile::tempdir().unwrap();
    let objects = [object::round(folder.path(), if is_full() { 500 } else { 80 })];
    compare(&ccx, folder.path(), &Asked::new(), &objects);
}

#[test]
fn files_of_others_agree_to_the_digits_that_calculix_prints() {
    let Some(ccx) = Ccx::find() else { return };
    let Some(objects) = object::files() else { return };
    let folder = tempfile::tempdir().unwrap();
    compare(&ccx, folder.path(), &Asked::new(), &objects);
}

/// Largest difference of answers at large deformation, relative to the largest number. CalculiX stops its
/// iterations at a residual of 1e-9 and sums its increments.
const LARGE_AGREE: f64 = 1e-5;

/// Number of halvings of a motion until CalculiX must have followed it.
const HALVINGS: usize = 2;

/// The question with the largest of its motion, its half and its quarter that CalculiX follows to
/// the end, and what it printed. On some meshes its iterations do not converge for the whole of it,
/// however small it makes its increments.
fn followed(
    ccx: &Ccx,
    folder: &Path,
    object: &Object,
    system: &System,
    asked: Question,
) -> (Question, Results) {
    let mut question = asked;
    for _ in 0..HALVINGS {
        match ccx.try_run(folder, &deck::deck(object, system, &question), system) {
            Ok(printed) => return (question, printed),
            Err(said) => {
                let why = said.lines().filter(|line| line.contains("*ERROR")).collect::<String>();
                println!("Poisson {}: half the motion, since ccx gave up:{why}", question.poisson);
            }
        }
        question = question.halved();
    }
    let printed = ccx.run(folder, &deck::deck(object, system, &question), system);
    (question, printed)
}

/// Both at large deformation: NLGEOM on one side, `--deformation large` on the other, curved edges among them.
#[test]
fn large_deformation_agrees_with_calculix() {
    let Some(ccx) = Ccx::find() else { return };
    let folder = tempfile::tempdir().unwrap();
    let asked = Asked::new();
    let nodes = if is_full() { 400 } else { 100 };
    let mut objects = object::built_in(folder.path(), nodes);
    let small = |object: &Object| object.mesh.node_count() < 400;
    objects.extend(object::files().unwrap_or_default().into_iter().filter(small).take(3));
    objects.push(object::sphere_with_stone(folder.path(), nodes));
    objects.push(object::round(folder.path(), nodes / 2));
    let mut table = Table::default();
    for object in &objects {
        for &element in object.elements() {
            let system = System::new(&object.mesh, element);
            let mut of_object = Agreement::default();
            for question in question::large_questions(object) {
                let (question, printed) = followed(&ccx, folder.path(), object, &system, question);
                let found = asked.answer(object, &system, &question, folder.path());
                let agreement = Agreement::of(&printed, &found, &question);
                let worst =
                    agreement.displacement.difference_rel.max(agreement.force.difference_rel);
                assert!(
                    worst < LARGE_AGREE,
                    "{}, {element:?}, Poisson {}: {agreement}",
                    object.name,
                    question.poisson
                );
                of_object.add(&agreement);
            }
            table.push(object, &system, &of_object);
        }
    }
    println!("{table}");
}

/// The comparison is worth something only if it notices a difference that is small.
#[test]
fn another_poissons_ratio_is_noticed() {
    let Some(ccx) = Ccx::find() else { return };
    let folder = tempfile::tempdir().unwrap();
    let asked = Asked::new();
    let objects = object::built_in(folder.path(), 60);
    for &element in objects[0].elements() {
        let system = System::new(&objects[0].mesh, element);
        for question in questions(&objects[0], &system) {
            let found = asked.answer(&objects[0], &system, &question, folder.path());
            let other = Question { poisson: question.poisson + 1e-5, ..question.clone() };
            let printed =
                ccx.run(folder.path(), &deck::deck(&objects[0], &system, &other), &system);
            let agreement = Agreement::of(&printed, &found, &question);
            assert!(!agreement.holds(), "{element:?}, {}: {agreement}", question.name);
        }
    }
}
