//! The report: every case, element and Poisson's ratio on finer and finer meshes.

use softgrasp_core::fem::Element;

use super::outcome::Outcome;
use super::{
    ELEMENTS, bar, cantilever, clamped_block, indentation, large, membrane, mirror, order, patch,
    thick_sphere, waves,
};
use softgrasp_bench::axis::Scale;
use softgrasp_bench::plot::{Mark, Plot, PlotPoint, Series};
use softgrasp_bench::report::{Options, Report, ReportError, progress};
use softgrasp_bench::table::Table;
use softgrasp_bench::threads::processors;

/// A case for an element, a Poisson's ratio and a number of cells.
type Solved = fn(Element, f64, usize) -> Result<Outcome, ReportError>;

/// A case and the meshes it is solved on: for elements of second order, for those of third.
struct Case {
    solved: Solved,
    poisson: &'static [f64],
    second: &'static [usize],
    third: &'static [usize],
}

/// Every case; one of fixed material takes no notice of Poisson's ratio.
const CASES: [Case; 9] = [
    Case { solved: patch::constant_strain, poisson: &[0.3, 0.49], second: &[4], third: &[4] },
    Case { solved: bar::tension, poisson: &[0.3, 0.49], second: &[3], third: &[3] },
    Case { solved: mirror::symmetric, poisson: &[0.3, 0.49], second: &[4], third: &[4] },
    Case {
        solved: |element, _, cells| cantilever::end_load(element, cells),
        poisson: &[0.3],
        second: &[2, 4, 8, 16],
        third: &[1, 2, 4, 8],
    },
    Case {
        solved: |element, _, cells| membrane::sheared(element, cells),
        poisson: &[1.0 / 3.0],
        second: &[4, 8, 16, 32, 64],
        third: &[2, 4, 8, 16, 32],
    },
    Case {
        solved: thick_sphere::inflated,
        poisson: &[0.3, 0.49, 0.4999],
        second: &[4, 8, 16, 32],
        third: &[2, 4, 8, 16],
    },
    Case {
        solved: clamped_block::pushed,
        poisson: &[0.3, 0.49, 0.4999],
        second: &[4, 8, 12],
        third: &[2, 4],
    },
    Case {
        solved: |element, _, cells| indentation::pressed(element, cells),
        poisson: &[0.3],
        second: &[2, 4, 8],
        third: &[1, 2, 4],
    },
    Case {
        solved: waves::forced,
        poisson: &[0.3, 0.49],
        second: &[4, 8, 16, 32],
        third: &[2, 4, 8, 16],
    },
];

/// Measures the report.
///
/// # Errors
/// [`ReportError`].
pub fn measure(options: &Options) -> Result<Report, ReportError> {
    let title = "Accuracy: every element against closed forms and published values";
    let mut report = Report::begin("accuracy", title, &processors().to_string(), options);
    let mut outcomes: Vec<Outcome> = Vec::new();
    for case in CASES {
        for &element in ELEMENTS {
            for &poisson in case.poisson {
                let cells = if order(element) > 2.0 { case.third } else { case.second };
                // Two meshes show a direction.
                // The widest pattern of all: its finest mesh would take as long as all the rest.
                let is_long = element == Element::Tet4Anp && cells.len() > 3;
                let most = cells.len() - usize::from(is_long);
                let count = if options.is_quick { most.min(2) } else { most };
                for &cells in &cells[..count] {
                    let outcome = (case.solved)(element, poisson, cells)?;
                    progress("accuracy", &format!("{outcome:?}"));
                    outcomes.push(outcome);
                }
            }
        }
    }
    report.text(INTRODUCTION);
    report.table(table(&outcomes));
    for (stem, title, caption, cases) in FIGURES {
        report.figure(stem, caption, figure(title, &outcomes, cases)?);
    }
    large::add_to(&mut report, options)?;
    Ok(report)
}

fn table(outcomes: &[Outcome]) -> Table {
    let mut table = Table::new("accuracy", "Error on finer meshes", &COLUMNS);
    let mut before: Option<&Outcome> = None;
    for outcome in outcomes {
        let coarser = before.filter(|b| b.is_like(outcome));
        table.push([
            outcome.solved.case.into(),
            outcome.solved.element.name().into(),
            outcome.solved.poisson.into(),
            outcome.solved.cells.into(),
            outcome.solved.nodes.into(),
            outcome.solved.unknown.into(),
            outcome.quantity.into(),
            outcome.computed.into(),
            outcome.expected.into(),
            outcome.error_rel.into(),
            coarser.map(|coarser| outcome.order_from(coarser)).into(),
        ]);
        before = Some(outcome);
    }
    table
}

/// Error against unknowns of some cases, a line for each element and Poisson's ratio.
fn figure(title: &str, outcomes: &[Outcome], cases: &[&str]) -> Result<String, ReportError> {
    let mut series = Vec::new();
    for of_one in outcomes.chunk_by(Outcome::is_like).filter(|o| cases.contains(&o[0].solved.case))
    {
        let first = &of_one[0];
        let point =
            |o: &Outcome| PlotPoint { x: o.solved.unknown as f64, y: o.error_rel, spread: None };
        series.push(Series {
            label: format!(
                "{}, {}, ν = {:.4}",
                first.solved.case,
                first.solved.element.name(),
                first.solved.poisson
            ),
            mark: Mark::Line,
            points: of_one.iter().map(point).collect(),
        });
    }
    let plot = Plot {
        title: title.to_owned(),
        x_label: "unknowns".to_owned(),
        y_label: "relative error".to_owned(),
        x_scale: Scale::Log,
        y_scale: Scale::Log,
        series,
    };
    Ok(plot.svg()?)
}

const COLUMNS: [&str; 11] = [
    "case",
    "element",
    "poisson",
    "cells",
    "nodes",
    "unknown_dofs",
    "quantity",
    "computed",
    "expected",
    "error_rel",
    "order",
];

/// Name of the file, title, caption, and cases of a figure.
const FIGURES: [(&str, &str, &str, &[&str]); 4] = [
    (
        "accuracy-waves",
        "Waves in a cube",
        "Error of the displacement, mean square over the volume, for a solution made up of waves.",
        &["waves"],
    ),
    (
        "accuracy-sphere",
        "Thick sphere under pressure",
        "Error of the displacement, mean square over the volume, nearer and nearer to \
         incompressible: an element that locks needs many more unknowns.",
        &["thick sphere"],
    ),
    (
        "accuracy-block",
        "Clamped block, pushed sideways",
        "Error of displacement over force, nearer and nearer to incompressible: linear elements lock, \
         those with averaged nodal pressure do not.",
        &["clamped block"],
    ),
    (
        "accuracy-cases",
        "Cantilever, Cook's membrane, indentation",
        "Error of one number each. Where a line levels off, the closed form and the body that is \
         solved for differ by so much.",
        &["cantilever", "membrane", "indentation"],
    ),
];

const INTRODUCTION: &str = "\
How far the solution of each element is from the truth, not from the solution of its own equations: \
the error is that of mesh and element. All bodies are made of boxes cut into six tetrahedra each, \
neighbours mirrored, or of layers around a sphere; `cells` counts boxes along the length named \
below. `order` is the power of the size of an element with which the error has fallen from the row \
above.

| case | what it is | expected | why the error may not go to zero |
|---|---|---|---|
| `patch` | constant strain given on the surface of an irregular cube | the same inside | rounding only |
| `bar` | tension, an irregular inside, free to become thinner | Hooke's law | rounding only |
| `mirror` | a symmetric block pressed symmetrically | mirrored displacements, bit for bit but for rounding | rounding only |
| `cantilever` | length 10 × height, square section, `cells` over the height, shear force at the end | Timoshenko's beam with Cowper's shear coefficient | the clamped end cannot become wider, which the beam does not know: 3 ν² height/length = 2.7 % at most |
| `membrane` | Cook's tapered panel (48; 44, 16; thickness 1, E = 1, ν = 1/3, force 1, plane stress), `cells` × `cells` boxes | 23.96 at the middle of the loaded edge (Bergan and Felippa 1985) | published values scatter from 23.9 to 23.97 |
| `thick sphere` | radii 1 and 2, pressure inside, an eighth, `cells` along each quarter circle and through the wall | Lamé | goes to zero by the second power: edges are straight, for ten nodes too |
| `clamped block` | width 1, height 2, clamped below, the upper face pushed sideways, `cells` over the width | CalculiX, ten-node tetrahedra (C3D10), limit of three meshes crowded towards the edges (`benches/peers/clamped_block.py`) | goes to zero, slowly: stresses are singular at the clamped edges |
| `indentation` | a rigid sphere pressed 0.1 a into a block of 8 a without friction, `cells` per contact radius a, nodes within a known as under `patch` | force of Hertz | 0.2 % from the size of the block, whose sides have the displacement of a point load; the edge of the contact lies between nodes. Boxes get thinner far from the contact too as `cells` goes up: where they did not, the error of `t4-anp` rose from 0.2 to 1.05 %, because that of the far boxes stayed and that of the near ones, of the other sign, went |
| `waves` | a cube with an irregular inside under the body force of a solution made up of waves, its surface known | that solution | goes to zero, by order 2 for linear, 3 for ten-node elements |";
