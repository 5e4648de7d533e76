//! Writes the page: each object with its finest mesh and its rows.

use super::contest::contest;
use super::figure::{Time, figure};
use super::object::{Object, objects};
use super::pads::PaddedMesh;
use super::row::{self, Row};
use super::system::{Discretisation, Held, System, quadratic_answer, rms_rel};
use crate::report::{Options, Report, ReportError, progress};
use crate::table::{Cell, Table};
use crate::threads::{pool, processors};

/// Size in bytes of a factor above which the reference is made on the mesh itself.
const BYTES_MAX: usize = 9 << 30;

/// Measures time against error on all objects.
///
/// # Errors
/// [`ReportError`].
pub fn measure(options: &Options) -> Result<Report, ReportError> {
    let threads = processors();
    let title = "Frontier: time against error of every method, precision and element";
    let mut report = Report::begin("frontier", title, &threads.to_string(), options);
    let pool = pool(threads)?;
    let (objects, left_out) = objects(options)?;
    let mut rows = Vec::new();
    let mut meshes = Table::new("frontier-meshes", "How exact the meshes are", &MESH_COLUMNS);
    for object in &objects {
        rows.extend(pool.install(|| one_object(object, options.is_quick, &mut meshes))?);
    }
    report.text(INTRODUCTION);
    left_out.iter().for_each(|line| report.text(line.as_str()));
    report.figure("frontier", CAPTION, figure(&rows, Time::Warm)?);
    report.figure("frontier-cold", CAPTION, figure(&rows, Time::Cold)?);
    report.table(meshes);
    report.table(row::table(&rows));
    Ok(report)
}

/// Measures all rows of one object and marks them; adds its line to the table of meshes.
fn one_object(
    object: &Object,
    is_quick: bool,
    meshes: &mut Table,
) -> Result<Vec<Row>, ReportError> {
    let Object { name, padded } = object;
    progress("frontier", &format!("{name}, the finest mesh"));
    let refined = padded.refined()?;
    let finest = Finest::of(padded, &refined)?;
    let mut rows = Vec::new();
    let mut by_element = Vec::new();
    for discretisation in Discretisation::ALL {
        let mesh = match discretisation {
            Discretisation::T4Refined => &refined,
            _ => padded,
        };
        let system = System::try_new(mesh, discretisation)?;
        by_element.push(rms_rel(&system.right, &finest.displacement));
        for outcome in contest(name, &system, &finest.displacement, is_quick)? {
            rows.push(Row {
                object: name.clone(),
                discretisation,
                system_nodes: system.model.system_node_count(),
                unknown_dofs: system.unknown_dofs(),
                outcome,
                best: row::Best::default(),
            });
        }
    }
    row::mark(&mut rows);
    let mut cells: Vec<Cell> = vec![
        name.as_str().into(),
        padded.mesh.node_count().into(),
        padded.mesh.tets().len().into(),
        (padded.corner_pairs().len() / 3).into(),
        finest.name.into(),
    ];
    cells.extend(by_element.into_iter().map(Cell::from));
    cells.push(finest.at_corners.into());
    meshes.push(cells);
    Ok(rows)
}

/// Answer on the finest mesh, against which the total error is measured.
struct Finest {
    name: String,
    /// Displacements of the watched nodes, m.
    displacement: Vec<f64>,
    /// Error of ten-node elements whose patches are held at their corners only.
    at_corners: Option<f64>,
}

impl Finest {
    fn of(padded: &PaddedMesh, refined: &PaddedMesh) -> Result<Self, ReportError> {
        let gib = |bytes: usize| bytes as f64 / (1u64 << 30) as f64;
        let (name, displacement) = match quadratic_answer(refined, Held::Whole, BYTES_MAX)? {
            Ok(displacement) => ("t10, mesh refined once".to_owned(), displacement),
            Err(bytes) => {
                let name = format!("t10, same mesh; refined it takes {:.1} GiB", gib(bytes));
                let same = quadratic_answer(padded, Held::Whole, usize::MAX)?;
                (name, same.unwrap_or_default())
            }
        };
        let at_corners = quadratic_answer(padded, Held::Corners, BYTES_MAX)?
            .ok()
            .map(|answer| rms_rel(&answer, &displacement));
        Ok(Self { name, displacement, at_corners })
    }
}

const MESH_COLUMNS: [&str; 10] = [
    "object",
    "nodes",
    "tets",
    "held_nodes",
    "finest",
    "t4_error_rel",
    "t4_anp_error_rel",
    "t4_refined_error_rel",
    "t10_error_rel",
    "t10_corners_held_error_rel",
];

const CAPTION: &str = "Medians. A line joins the points that no other one beats; faint points are \
beaten. At the left every element is compared with the exact answer of its own system, at the right \
all with the finest mesh.";

const INTRODUCTION: &str = "\
Every object is held and pushed by five patches of its surface. A patch is a union of triangles of \
the mesh that moves as a whole: a single displaced node would be a point load, whose displacements \
do not converge as the mesh is refined, while a patch is the same piece of surface in every uniform \
refinement (each element cut into eight, each triangle of a patch into four, new nodes in the middle \
of straight edges). So all meshes and elements answer one question about one body, that of the \
first mesh with its flat faces; how well these faces fit a smooth shape is not looked at.\n\n\
Two errors. `algebraic_error_rel` compares an answer with the answer of the same system, refined \
with residuals in twice the working precision: largest difference over largest displacement. \
`total_error_rel` compares it with ten-node elements on the mesh refined once (where their factor \
would take too much memory, on the mesh itself; the table of meshes says which): root mean square of \
the difference over that of the displacements. Both are taken at the surface nodes of the first \
mesh, those on the patches included, and are the worst of all answers. The total error holds mesh, \
element and arithmetic together. The finest mesh is not exact either: at the rim of a patch the \
stress is singular, so errors fall slowly, and its own error is a good part of that of `t10` in the \
table of meshes. Differences between elements smaller than that say nothing.\n\n\
A warm frame is one answer more with other displacements of the same patches, its residual (and for \
`condensed` its certificate) with it. A cold start is everything from the mesh in memory to the \
first answer: assembly, check of free motions, order, factor or inverse (for `condensed` base, \
columns, small system), solve. Both without the wire, which `latency` measures. All ways \
take turns on one pool of as many threads as there are processors. Direct methods compute all nodes, \
`condensed` those of the surface. `tolerance` is the residual at which `pcg` may stop; its first step \
with a factor in single precision already goes below the coarse ones. Dense matrices above 512 MiB \
are left out, and `gauss-jordan` above 3500 unknowns.\n\n\
`t4-anp` averages the pressure around each node, for nearly incompressible material; the rubber here \
has a Poisson's ratio of 0.3, where it is only softer and its stiffness has more entries. What it is \
for is in [accuracy.md](accuracy.md).\n\n\
With ten-node elements the nodes in the middle of a patch's edges move with the patch. A request can \
name corners only; the last column of the table of meshes says what that costs.\n\n\
A row is best by an error if no other row of the object is faster and as exact: algebraic errors \
among equal systems (a factor of ten counts as equal: it is rounding), total errors among all (one \
per cent).";
