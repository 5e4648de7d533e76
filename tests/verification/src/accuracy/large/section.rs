//! Section of the report `accuracy` on large deformation: cases, tables and text.

use softgrasp_core::fem::Element::{self, Tet4, Tet4Anp, Tet10};

use super::homogeneous::{Stretched, stretched};
use super::row::{Cost, Row};
use super::{bend, compressed_block, cooks_membrane, elastica, shear, sphere, torsion, turned};
use crate::accuracy::elements::ELEMENTS;
use softgrasp_bench::axis::Scale;
use softgrasp_bench::plot::{Mark, Plot, PlotPoint, Series};
use softgrasp_bench::report::{Options, Report, ReportError, progress};
use softgrasp_bench::table::{Cell, Table};

/// A case for an element, a Poisson's ratio and a number of cells.
type Followed = fn(Element, f64, usize) -> Result<Vec<Row>, ReportError>;

/// A case, and the elements, materials and meshes it is solved with.
struct Case {
    followed: Followed,
    elements: &'static [Element],
    poisson: &'static [f64],
    cells: &'static [usize],
}

/// Every case, one entry for each list of meshes; cases of a fixed material ignore Poisson's ratio.
const CASES: &[Case] = &[
    Case {
        followed: |element, nu, cells| stretched(Stretched::Uniaxial, element, nu, cells),
        elements: ELEMENTS,
        poisson: &[0.3, 0.49],
        cells: &[3],
    },
    Case {
        followed: |element, nu, cells| stretched(Stretched::Equibiaxial, element, nu, cells),
        elements: ELEMENTS,
        poisson: &[0.3, 0.49],
        cells: &[3],
    },
    Case { followed: shear::sheared, elements: ELEMENTS, poisson: &[0.3, 0.49], cells: &[3] },
    Case { followed: turned::given, elements: ELEMENTS, poisson: &[0.3, 0.49], cells: &[3] },
    Case { followed: turned::led, elements: ELEMENTS, poisson: &[0.3], cells: &[3] },
    Case { followed: torsion::twisted, elements: &[Tet4], poisson: &[0.499], cells: &[2, 4, 6] },
    Case {
        followed: torsion::twisted,
        elements: &[Tet4Anp],
        poisson: &[0.499],
        cells: &[2, 3, 4, 6, 8],
    },
    Case { followed: torsion::twisted, elements: &[Tet10], poisson: &[0.499], cells: &[2, 3, 4] },
    Case {
        followed: sphere::widened,
        elements: &[Tet4],
        poisson: &[0.49, 0.4999],
        cells: &[2, 4, 8],
    },
    Case {
        followed: sphere::widened,
        elements: &[Tet4Anp],
        poisson: &[0.4999],
        cells: &[2, 3, 4, 6, 8, 12],
    },
    Case {
        followed: sphere::widened,
        elements: &[Tet10],
        poisson: &[0.4999],
        cells: &[2, 3, 4, 6, 8],
    },
    Case {
        followed: |element, _, cells| elastica::bent(element, cells),
        elements: &[Tet4, Tet4Anp],
        poisson: &[0.0],
        cells: &[1, 2, 4],
    },
    Case {
        followed: |element, _, cells| elastica::bent(element, cells),
        elements: &[Tet10],
        poisson: &[0.0],
        cells: &[1, 2],
    },
    Case {
        followed: |element, _, cells| bend::pushed(element, cells),
        elements: &[Tet10],
        poisson: &[0.0],
        cells: &[16, 32, 48],
    },
    Case {
        followed: |element, _, cells| bend::pushed_at_once(element, cells),
        elements: &[Tet10],
        poisson: &[0.0],
        cells: &[16, 32, 64],
    },
    Case {
        followed: |element, _, cells| cooks_membrane::sheared(element, cells),
        elements: &[Tet4, Tet4Anp],
        poisson: &[0.4999],
        cells: &[4, 8, 16, 32],
    },
    Case {
        followed: |element, _, cells| cooks_membrane::sheared(element, cells),
        elements: &[Tet10],
        poisson: &[0.4999],
        cells: &[2, 4, 8, 16],
    },
    Case {
        followed: |element, _, cells| compressed_block::compressed(element, cells),
        elements: &[Tet4],
        poisson: &[0.4999],
        cells: &[4, 8],
    },
    Case {
        followed: |element, _, cells| compressed_block::compressed(element, cells),
        elements: &[Tet4Anp],
        poisson: &[0.4999],
        cells: &[4, 8, 12],
    },
    Case {
        followed: |element, _, cells| compressed_block::compressed(element, cells),
        elements: &[Tet10],
        poisson: &[0.4999],
        cells: &[2, 4, 8],
    },
];

/// Follows every case and adds the section to the report.
///
/// # Errors
/// [`ReportError`]; a shape that is not found becomes a row that says so.
pub fn add_to(report: &mut Report, options: &Options) -> Result<(), ReportError> {
    let mut rows: Vec<Row> = Vec::new();
    for case in CASES {
        let count = if options.is_quick { case.cells.len().min(2) } else { case.cells.len() };
        for &element in case.elements {
            for &poisson in case.poisson {
                for &cells in &case.cells[..count] {
                    let of_mesh = (case.followed)(element, poisson, cells)?;
                    of_mesh.iter().for_each(|row| progress("accuracy", &format!("{row:?}")));
                    rows.extend(of_mesh);
                }
            }
        }
    }
    report.text(INTRODUCTION);
    report.table(table(&rows));
    report.figure("accuracy-large", CAPTION, figure(&rows)?);
    let cells = if options.is_quick { 2 } else { 4 };
    report.table(torsion::nearly_incompressible(Tet10, cells)?);
    Ok(())
}

fn table(rows: &[Row]) -> Table {
    let mut table = Table::new("accuracy-large", "Large deformation on finer meshes", &COLUMNS);
    for (i, row) in rows.iter().enumerate() {
        let coarser = rows[..i].iter().rev().find(|before| before.is_like(row));
        let order = coarser.map(|coarser| row.order_from(coarser)).filter(|o| o.is_finite());
        let (outcome, cost) = (&row.outcome, row.end.cost());
        let count = |of: fn(&Cost) -> usize| cost.map_or(Cell::Blank, |cost| of(cost).into());
        table.push([
            outcome.solved.case.into(),
            outcome.solved.element.name().into(),
            format!("{:.4}", outcome.solved.poisson).into(),
            outcome.solved.cells.into(),
            outcome.solved.unknown.into(),
            row.load.into(),
            outcome.quantity.into(),
            outcome.computed.into(),
            outcome.expected.into(),
            Some(outcome.error_rel).filter(|e| !e.is_nan()).into(),
            order.into(),
            count(|cost| cost.steps),
            count(|cost| cost.pieces),
            count(|cost| cost.solves),
            count(|cost| cost.factors),
            cost.map(|cost| cost.residual_rel).into(),
            row.end.words().into(),
        ]);
    }
    table
}

const COLUMNS: [&str; 17] = [
    "case",
    "element",
    "poisson",
    "cells",
    "unknown_dofs",
    "load",
    "quantity",
    "computed",
    "expected",
    "error_rel",
    "order",
    "steps",
    "pieces",
    "solves",
    "factors",
    "residual_rel",
    "shape",
];

/// Cases and loads that the figure shows.
const FIGURE: [(&str, f64); 3] =
    [("hollow sphere", 2.0), ("Cook's membrane", 100.0), ("compressed block", 80.0)];

const CAPTION: &str = "\
Error of one number each, nearly incompressible (ν = 0.4999), at large deformation. Where a line \
levels off or turns up, the published value is no more exact than that.";

/// Error against unknowns, a line for each case and element.
fn figure(rows: &[Row]) -> Result<String, ReportError> {
    let is_shown = |row: &&Row| {
        let is_of =
            |(case, load): &(&str, f64)| row.outcome.solved.case == *case && row.load == *load;
        FIGURE.iter().any(is_of) && row.outcome.solved.poisson > 0.499 && row.end.has_shape()
    };
    let shown: Vec<&Row> = rows.iter().filter(is_shown).collect();
    let point = |row: &&Row| PlotPoint {
        x: row.outcome.solved.unknown as f64,
        y: row.outcome.error_rel,
        spread: None,
    };
    let of_one = shown.chunk_by(|a, b| a.is_like(b)).map(|of_one| Series {
        label: format!(
            "{}, {}",
            of_one[0].outcome.solved.case,
            of_one[0].outcome.solved.element.name()
        ),
        mark: Mark::Line,
        points: of_one.iter().map(point).collect(),
    });
    let plot = Plot {
        title: "Large deformation".to_owned(),
        x_label: "unknowns".to_owned(),
        y_label: "relative error".to_owned(),
        x_scale: Scale::Log,
        y_scale: Scale::Log,
        series: of_one.collect(),
    };
    Ok(plot.svg()?)
}

const INTRODUCTION: &str = "\
## Large deformation

Shapes far from rest, beside closed forms and published values. Law `neo-hookean-log` with E = 1 \
unless said. A load is given in `steps`, each followed by the engine from the shape before it in \
`pieces` of its own choice, until the residual is rounding; `solves` and `factors` are those since \
the load before. `shape` says how it ended, with the sentence of the engine where there is none. \
`order` is that from the same figure on the next coarser mesh.

| case | what it is, and its load | expected | why the error may not go to zero |
|---|---|---|---|
| `uniaxial`, `equibiaxial` | an eighth of a cube with an irregular inside, stretched along one or two axes to the load, other faces free | `P = μ (F − F⁻ᵀ) + λ ln J F⁻ᵀ` with no stress on the free faces | rounding only |
| `simple shear` | a cube with an irregular inside, its surface given; the load is the shear γ | Cauchy stresses μ γ and μ γ² | rounding only |
| `turned` | a cube turned by the load in rad: the largest force at a node over E and the area of a face | none | rounding only |
| `led by a face` | the same turn given on one face alone | the rest follows without force | rounding only |
| `torsion` | a cylinder of radius and length 1, its ends turned by the load in rad and kept apart, `cells` rings and layers | Rivlin's torque π μ τ a⁴/2 and push −π μ τ² a⁴/4, incompressible | ν = 0.499 is not 0.5: the second table, where `order` is the power of 0.5 − ν |
| `hollow sphere` | radii 1 and 2, the inner one stretched to the load, an eighth, `cells` along each quarter circle and through the wall; pressure from the work of the reactions on the deformed inner area | incompressible: g(λ_b) − g(λ_a), g = 2/λ + 1/(2 λ⁴) | edges are straight: second order at best |
| `elastica` | a cantilever 50 times as long as high, ν = 0, dead end force; the load is P L²/E I; `cells` over the height | shortening and deflection over the length (Bisshopp and Drucker 1945) | shear and stretch of the beam, of the order of (height/length)² = 4e-4 |
| `45° bend` | radius 100, section 1 × 1, clamped at one end, 600 out of its plane at the other, E = 1e7, ν = 0, `cells` along the beam and a sixteenth of that over each edge of the section | NAFEMS 3DNLG-5 | the published values are those of beams, and scatter by 2 % in print |
| `45° bend, at once` | the same in one step and with one box over the section, which is too stiff in torsion | the same | see `shape` |
| `Cook's membrane` | κ = 400942, μ = 80.1938, law `neo-hookean`, plane strain, 100 on the right edge, `cells` × `cells` boxes | 6.93 at the upper corner, within 0.1 | published values scatter by that; the clamped corner is singular |
| `compressed block` | a quarter of a block, its upper face moves vertically only and a quarter of it is pressed by the load × 4; μ = 80.194, ν = 0.4999, law `neo-hookean`, `cells` along each edge | compression of the middle over the height (Reese and Wriggers, as in deal.II's step 44) | published values have three digits; the edge of the load is singular |

Without a change of volume in the law (ν = 0), `t4-anp` is `t4`. `t4` is in the nearly \
incompressible cases to show how it locks; in some a locked mesh gives way in a jump.

`led by a face` and `45° bend, at once` have a shape: the turn itself, and that of the force in steps. \
Rows of these that have none are faults of the engine, and its sentence need not name the cause.";
