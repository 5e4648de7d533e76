//! Bodies that are gripped: blocks, rods and sheets, in several units and materials.

use nalgebra::Point3;
use softgrasp_core::fem::Material;
use softgrasp_core::mesh::TetMesh;
use softgrasp_core::model::{Element, Model};

use softgrasp_bench::report::ReportError;

use crate::bricks::{bricks, number};

/// Body, and the rows of the report that its grips belong to.
pub(super) struct Scene {
    pub family: &'static str,
    pub model: Model,
    /// Unit of length, m, by which contacts are pushed.
    pub length: f64,
}

/// Data of a scene: family, cells, size in units of length, that unit in m, Young's modulus in Pa,
/// Poisson's ratio, element, whether one end is fixed.
type Plan = (&'static str, [usize; 3], [f64; 3], f64, f64, f64, Element, bool);

const BLOCK: [f64; 3] = [1.0, 0.8, 0.9];
const LONG: [usize; 3] = [24, 1, 1];
const FLAT: [usize; 3] = [7, 7, 1];

const PLANS: [Plan; 22] = [
    ("block", [4, 4, 3], BLOCK, 1.0, 1e5, 0.3, Element::Tet4, false),
    ("block", [4, 4, 3], BLOCK, 1.0, 1e5, 0.3, Element::Tet4, true),
    ("block", [6, 5, 4], BLOCK, 0.07, 3e4, 0.45, Element::Tet4, false),
    ("other units", [4, 4, 3], BLOCK, 1e6, 1e5, 0.3, Element::Tet4, false),
    ("other units", [4, 4, 3], BLOCK, 1e-6, 1e12, 0.3, Element::Tet4, false),
    ("other units", [4, 4, 3], BLOCK, 3e3, 1e-3, 0.3, Element::Tet4, true),
    ("nearly incompressible", [4, 4, 3], BLOCK, 0.1, 1e5, 0.49, Element::Tet4, false),
    ("nearly incompressible", [4, 4, 3], BLOCK, 0.1, 1e5, 0.499, Element::Tet4, false),
    ("nearly incompressible", [4, 4, 3], BLOCK, 0.1, 1e5, 0.499, Element::Tet4Anp, false),
    ("nearly incompressible", [4, 4, 3], BLOCK, 0.1, 1e5, 0.499, Element::Tet4, true),
    ("rod 10:1", LONG, [1.0, 0.1, 0.1], 1.0, 1e5, 0.3, Element::Tet4, false),
    ("rod 10:1", LONG, [1.0, 0.1, 0.1], 1.0, 1e5, 0.3, Element::Tet4, true),
    ("rod 100:1", LONG, [1.0, 0.01, 0.01], 1.0, 1e5, 0.3, Element::Tet4, false),
    ("rod 100:1", LONG, [1.0, 0.01, 0.01], 0.2, 1e9, 0.3, Element::Tet4, true),
    ("rod 1000:1", LONG, [1.0, 0.001, 0.001], 1.0, 1e5, 0.3, Element::Tet4, false),
    ("rod 1000:1", LONG, [1.0, 0.001, 0.001], 1.0, 1e5, 0.3, Element::Tet4, true),
    ("rod 1000:1", LONG, [1.0, 0.001, 0.001], 1.0, 1e5, 0.499, Element::Tet4, false),
    ("sheet 100:1", FLAT, [1.0, 1.0, 0.01], 1.0, 1e5, 0.3, Element::Tet4, false),
    ("sheet 100:1", FLAT, [1.0, 1.0, 0.01], 0.3, 1e6, 0.3, Element::Tet4, true),
    ("sheet 1000:1", FLAT, [1.0, 1.0, 0.001], 1.0, 1e5, 0.3, Element::Tet4, false),
    ("sheet 1000:1", FLAT, [1.0, 1.0, 0.001], 1.0, 1e5, 0.3, Element::Tet4, true),
    ("sheet 1000:1", FLAT, [1.0, 1.0, 0.001], 1.0, 1e5, 0.499, Element::Tet4, false),
];

/// All scenes.
///
/// # Errors
/// [`ReportError`] if a scene cannot be set up.
pub(super) fn all() -> Result<Vec<Scene>, ReportError> {
    PLANS.iter().map(scene).collect()
}

fn scene(plan: &Plan) -> Result<Scene, ReportError> {
    let &(family, cells, size, length, young, poisson, element, is_fixed) = plan;
    let mesh = block(cells, size.map(|s| s * length))?;
    let at_end = (0u32..).zip(mesh.vertices()).filter(|(_, p)| is_fixed && p.x <= 0.0);
    let fixed = at_end.flat_map(|(node, _)| 3 * node..3 * node + 3).collect();
    let material = Material::try_new(young, poisson)?;
    let model = Model::try_new(mesh, element, &[material], fixed, &mut |_| {})?;
    Ok(Scene { family, model, length })
}

/// Box of cells of six tetrahedra each, its inner nodes moved a little so that no two rows of the
/// stiffness are equal.
fn block(cells: [usize; 3], size: [f64; 3]) -> Result<TetMesh, ReportError> {
    let place = |place: [usize; 3]| {
        let moved = |axis: usize| {
            let step = place[axis] as f64;
            let is_inner = place[axis] > 0 && place[axis] < cells[axis];
            let seed = (3 * number(cells, place) as usize + axis) as f64;
            let shift = if is_inner { 0.2 * (2.3 * seed).sin() } else { 0.0 };
            size[axis] * (step + shift) / cells[axis] as f64
        };
        Point3::new(moved(0), moved(1), moved(2))
    };
    Ok(bricks(cells, place)?)
}
