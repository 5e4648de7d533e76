//! Writes the report: ratio of the bound to the true error, by body and contacts.

use rayon::prelude::*;

use super::attack::{Amount, attack};
use super::grips::Kind;
use super::scenes::{self, Scene};
use super::tally::{LISTS, Tally, quantile};
use softgrasp_bench::report::{Options, Report, ReportError, progress};
use softgrasp_bench::table::{Cell, Table, three_digits};

/// Grips every scene and compares every bound with the true error.
///
/// # Errors
/// [`ReportError`] where a scene cannot be set up; bounds below the true error are faults of the
/// report, which is written all the same.
pub fn measure(options: &Options) -> Result<Report, ReportError> {
    let amount = match options.is_quick {
        true => Amount { sets: 1, grips: 4 },
        false => Amount { sets: 30, grips: 27 },
    };
    let title = "Bound: whether the proven error is ever below the true one, and how far above";
    let mut report = Report::begin("bound", title, "all; nothing is timed", options);
    let scenes = scenes::all()?;
    let of_scenes: Vec<Vec<(Kind, Tally)>> = scenes
        .par_iter()
        .enumerate()
        .map(|(at, scene)| {
            let tallies = attack(scene, at as u64, amount);
            progress("bound", &format!("{} ({})", scene.family, at + 1));
            tallies
        })
        .collect::<Result<_, ReportError>>()?;
    let mut all = Tally::default();
    of_scenes.iter().flatten().for_each(|(_, tally)| all.join(tally));
    report.text(INTRODUCTION);
    report.text(summary(&all));
    let by_family = families(&scenes, &of_scenes);
    report.table(table("bound", "By body", "family", &by_family));
    let by_kind: Vec<(String, Tally)> = Kind::ALL
        .into_iter()
        .map(|kind| (kind.name().to_owned(), of_kind(&of_scenes, kind)))
        .collect();
    report.table(table("bound-contacts", "By contacts", "contacts", &by_kind));
    report.table(reasons(&by_family));
    for (family, tally) in &by_family {
        for (error, bound) in &tally.below {
            report.fault(format!("{family}: true error {error:e} above the bound {bound:e}"));
        }
    }
    Ok(report)
}

fn families(scenes: &[Scene], tallies: &[Vec<(Kind, Tally)>]) -> Vec<(String, Tally)> {
    let mut found: Vec<(String, Tally)> = Vec::new();
    for (scene, tallies) in scenes.iter().zip(tallies) {
        let held =
            if scene.model.fixed().is_empty() { "held by contacts only" } else { "one end fixed" };
        let name = format!("{}, {held}", scene.family);
        if !found.iter().any(|(known, _)| *known == name) {
            found.push((name.clone(), Tally::default()));
        }
        if let Some((_, tally)) = found.iter_mut().find(|(known, _)| *known == name) {
            tallies.iter().for_each(|(_, other)| tally.join(other));
        }
    }
    found
}

fn of_kind(tallies: &[Vec<(Kind, Tally)>], kind: Kind) -> Tally {
    let mut tally = Tally::default();
    tallies.iter().flatten().filter(|(k, _)| *k == kind).for_each(|(_, t)| tally.join(t));
    tally
}

fn summary(all: &Tally) -> String {
    let of = |at: usize| {
        let ratios = &all.ratios[at];
        let digits = |share| three_digits(quantile(ratios, share));
        format!(
            "- {}: {} grips, median {} times the true error, 99 % below {}, worst {}, nearest {}.\n",
            LISTS[at],
            ratios.len(),
            digits(0.5),
            digits(0.99),
            digits(1.0),
            digits(0.0)
        )
    };
    let none = all.none.each_ref().map(|none| none.values().sum::<usize>());
    format!(
        "**{} grips; the bound was below the true error in {} of them.** No bound was given for {} \
         of the grips from residuals only, and for {} after a second solve. {} sets of contacts were \
         refused (they do not hold the body, or depend on each other), and for {} no right answer \
         could be found.\n\n{}",
        all.grips,
        all.below.len(),
        none[0],
        none[1],
        all.refused_sets,
        all.sets_without_reference,
        (0..LISTS.len()).map(of).collect::<String>()
    )
}

fn table(stem: &str, title: &str, first: &'static str, rows: &[(String, Tally)]) -> Table {
    let columns = [
        first,
        "answers",
        "grips",
        "error_median",
        "ratio_nearest",
        "ratio_median",
        "ratio_99_percent",
        "ratio_worst",
        "without_bound",
    ];
    let mut table = Table::new(stem, title, &columns);
    for (name, tally) in rows {
        for (list, ratios) in LISTS.iter().zip(&tally.ratios) {
            let number = |share| match ratios.is_empty() {
                true => Cell::Blank,
                false => Cell::Number(quantile(ratios, share)),
            };
            let none = &tally.none[usize::from(*list != LISTS[0])];
            table.push([
                Cell::from(name.clone()),
                Cell::from(*list),
                Cell::Count(ratios.len() as u64),
                Cell::Number(quantile(&tally.errors, 0.5)),
                number(0.0),
                number(0.5),
                number(0.99),
                number(1.0),
                Cell::Count(none.values().sum::<usize>() as u64),
            ]);
        }
    }
    table
}

fn reasons(rows: &[(String, Tally)]) -> Table {
    let columns = ["family", "answers", "reason", "grips", "of_grips"];
    let mut table = Table::new("bound-reasons", "Grips without a bound, and why", &columns);
    for (name, tally) in rows {
        for (list, none) in ["residuals only", "refined"].into_iter().zip(&tally.none) {
            for (why, count) in none {
                table.push([
                    Cell::from(name.clone()),
                    Cell::from(list),
                    Cell::from(*why),
                    Cell::Count(*count as u64),
                    Cell::Count(tally.grips as u64),
                ]);
            }
        }
    }
    table
}

const INTRODUCTION: &str = "\
Random grips of blocks, rods and sheets: random contacts of six kinds, random displacements of them, \
with one end fixed by the scene and without, in several units of length and modulus, up to a \
Poisson's ratio of 0.499. The right answer is solved densely and refined with residuals in twice the \
working precision until a step changes less than 1e-20; the stiffness is taken as it is stored. The \
error is the norm of the difference over all nodes, in the precision in which the nodes asked for \
are delivered, over the norm of the right answer. The derivation is in \
[docs/bound.md](../docs/bound.md).";
