//! Reliability of error estimates: random squeezes of real and generated objects, with every error
//! budget.

use glove_client::object::mesh_file::read_mesh_file;
use softgrasp_core::mesh::TetMesh;

use super::estimates::{Judged, Reference, judge};
use super::trial::{Trial, drawn_object};
use crate::report::{Options, ReportError, progress};
use crate::table::{Cell, Table};

/// Files of other authors, also with slivers and thin limbs.
const FILES: [&str; 9] = [
    "armadillo_4k.node",
    "banana.vtk",
    "bunny.wrong-extension.vtk",
    "cube.appended.vtu",
    "cylinder.medit.mesh",
    "hammer.v41.msh",
    "liver.msh1.msh",
    "shark.binary22.msh",
    "turtle.veg",
];
/// Budgets of the estimated error.
const BUDGETS: [f64; 4] = [1e-2, 2e-3, 1e-6, 1e-8];
/// Approximate numbers of nodes of the generated objects.
const DRAWN: [usize; 5] = [700, 400, 700, 400, 700];
/// Number of squeezes of each object.
const ROUNDS: u64 = 2;

const COLUMNS: [&str; 14] = [
    "budget",
    "squeezes",
    "frames",
    "snaps",
    "refused",
    "judged",
    "above",
    "above_share",
    "over_twice",
    "error_over_estimate_p50",
    "error_over_estimate_p99",
    "error_over_estimate_max",
    "solves_a_frame",
    "factors_waited_for",
];

/// Table of all error budgets, and a line for each file that is not available.
///
/// # Errors
/// [`ReportError`] for generated objects only.
pub(super) fn table(options: &Options) -> Result<(Table, Vec<String>), ReportError> {
    let (objects, left_out) = objects(options)?;
    let budgets: &[f64] = if options.is_quick { &BUDGETS[1..2] } else { &BUDGETS };
    let rounds = if options.is_quick { 1 } else { ROUNDS };
    let mut all = vec![Judged::default(); budgets.len()];
    let mut squeezes = 0;
    for round in 1..=rounds {
        for (at, (name, mesh)) in (0u64..).zip(&objects) {
            let seed = 1000 * round + at;
            progress("large", &format!("random squeeze of {name}, seed {seed}"));
            let trial = Trial::draw(mesh.clone(), seed)?;
            let Ok(reference) = Reference::follow(&trial) else { continue };
            squeezes += 1;
            for (budget, all) in budgets.iter().zip(&mut all) {
                all.append(judge(&trial, &reference, *budget)?);
            }
        }
    }
    let title = "Estimates of random squeezes beside their true errors";
    let mut table = Table::new("large-estimates", title, &COLUMNS);
    for (budget, judged) in budgets.iter().zip(all) {
        table.push(row(*budget, squeezes, judged));
    }
    Ok((table, left_out))
}

fn row(budget: f64, squeezes: u64, mut judged: Judged) -> [Cell; 14] {
    judged.ratios.sort_by(f64::total_cmp);
    let count = judged.ratios.len();
    let at = |share: f64| {
        let place = (share * count.saturating_sub(1) as f64) as usize;
        Cell::Number(judged.ratios.get(place).copied().unwrap_or(0.0))
    };
    [
        Cell::Number(budget),
        Cell::Count(squeezes),
        Cell::Count(judged.frames as u64),
        Cell::Count(judged.snaps as u64),
        Cell::Count(judged.refused as u64),
        Cell::Count(count as u64),
        Cell::Count(judged.above as u64),
        Cell::Number(judged.above as f64 / count.max(1) as f64),
        Cell::Count(judged.above_twice as u64),
        at(0.5),
        at(0.99),
        at(1.0),
        Cell::Number(judged.solves as f64 / judged.frames.max(1) as f64),
        Cell::Count(judged.factors as u64),
    ]
}

/// Names and meshes of objects.
type Objects = Vec<(String, TetMesh)>;

fn objects(options: &Options) -> Result<(Objects, Vec<String>), ReportError> {
    let (mut objects, mut left_out) = (Vec::new(), Vec::new());
    let files = if options.is_quick { &FILES[4..5] } else { &FILES[..] };
    for file in files {
        match read_mesh_file(&options.meshes.join(file)) {
            Ok(read) => objects.push(((*file).to_owned(), read.mesh)),
            Err(why) => left_out.push(format!("{file} is left out: {why}")),
        }
    }
    let drawn = if options.is_quick { &DRAWN[..1] } else { &DRAWN[..] };
    for (seed, &nodes) in (1..).zip(drawn) {
        objects.push(drawn_object(seed, nodes)?);
    }
    Ok((objects, left_out))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn true_errors_of_random_squeezes_are_below_their_estimates() {
        let mut judged = Judged::default();
        for seed in [1006, 1007, 2006, 2009] {
            let (name, mesh) = drawn_object(seed, 200).unwrap();
            let trial = Trial::draw(mesh, seed).unwrap();
            println!("{name}, seed {seed}, {} frames", trial.frames);
            let reference = Reference::follow(&trial).unwrap();
            for budget in [1e-2, 2e-3, 1e-6] {
                judged.append(judge(&trial, &reference, budget).unwrap());
            }
        }
        let count = judged.ratios.len();
        assert!(count > 150, "{count} frames are judged");
        assert!(judged.above * 100 <= count, "{} of {count} above", judged.above);
        assert_eq!(judged.above_twice, 0, "of {count} above twice");
        assert_eq!(judged.over_budget, 0, "above the budget");
    }

    /// Near its end a branch is soft, and one short correction among long ones was taken for the last:
    /// errors were 1.2 and 2.5 times the estimates.
    #[test]
    fn a_correction_that_is_short_by_chance_near_the_end_of_a_branch_is_not_taken_for_the_last() {
        let (_, mesh) = drawn_object(2, 400).unwrap();
        let trial = Trial::draw(mesh, 27_010).unwrap();
        let reference = Reference::follow(&trial).unwrap();
        assert_eq!(reference.len(), trial.frames);
        for budget in [1e-2, 1e-6] {
            let judged = judge(&trial, &reference, budget).unwrap();
            assert_eq!(judged.above, 0, "budget {budget}: {:?}", judged.ratios);
        }
    }
}
