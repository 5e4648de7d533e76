//! Measures how linear elements lock as Poisson's ratio nears one half.

use softgrasp_core::fem::{Material, QuadraticMesh, dof};
use softgrasp_core::model::{Element, Model, ModelError};
use softgrasp_core::solve::{Factored, Loads, Method, Partition};

use super::case::Form;
use super::shapes::block;
use softgrasp_bench::axis::Scale;
use softgrasp_bench::plot::{Mark, Plot, PlotError, PlotPoint, Series};
use softgrasp_bench::report::ReportError;
use softgrasp_bench::table::Table;

/// Displacement over force of a pushed block by one element, relative to the reference.
pub(super) struct Softness {
    element: Element,
    nu: f64,
    cells: usize,
    compliance: f64,
    compliance_rel: f64,
}

const YOUNG: f64 = 1.0e5;
/// Height of the block, m; it is a metre wide.
const HEIGHT: f64 = 2.0;
const COLUMNS: [&str; 5] =
    ["element", "poisson", "cells_per_m", "displacement_per_force_m_per_N", "over_reference"];

/// Softness of every element at every ν, beside ten-node elements of a finer mesh.
///
/// # Errors
/// [`ReportError`].
pub(super) fn measure(form: Form) -> Result<Vec<Softness>, ReportError> {
    let (cells, fine) = if form.is_quick { (3, 4) } else { (5, 8) };
    let mut all = Vec::new();
    for nu in [0.3, 0.45, 0.49, 0.499, 0.4999, 0.49999] {
        let (reference, _) = compliance(Element::Tet10, fine, nu)?;
        for element in Element::ALL {
            let (compliance, _) = compliance(element, cells, nu)?;
            let compliance_rel = compliance / reference;
            all.push(Softness { element, nu, cells, compliance, compliance_rel });
        }
    }
    Ok(all)
}

/// A block clamped below and pushed sideways at its top: displacement over force, m/N. All nodes of
/// both faces are held or pushed, those in the middle of edges too. Beside it the numbers of nodes
/// and of known degrees of freedom.
///
/// # Errors
/// [`ReportError`].
pub(crate) fn compliance(
    element: Element,
    cells: usize,
    nu: f64,
) -> Result<(f64, [usize; 2]), ReportError> {
    let mesh = block([cells, cells, 2 * cells], [1.0, 1.0, HEIGHT])?;
    let vertices = match element {
        Element::Tet10 => {
            QuadraticMesh::try_new(&mesh).map_err(ModelError::from)?.vertices().to_vec()
        }
        Element::Tet4 | Element::Tet4Anp => mesh.vertices().to_vec(),
    };
    let materials = [Material::try_new(YOUNG, nu)?];
    let model = Model::try_new(mesh, element, &materials, Vec::new(), &mut |_| {})?;
    let (mut dofs, mut q_known) = (Vec::new(), Vec::new());
    for (node, p) in vertices.iter().enumerate() {
        let (below, above) = (p.z < 1e-9, p.z > HEIGHT - 1e-9);
        for axis in (0..3).filter(|&axis| below || (above && axis == 0)) {
            dofs.push(dof(node, axis) as u32);
            q_known.push(if above { 1.0 } else { 0.0 });
        }
    }
    let used = vec![true; vertices.len()];
    let partition = Partition::try_new(&used, &dofs).map_err(ModelError::from)?;
    let stiffness = model.stiffness();
    let factored = Factored::try_new(stiffness, partition, Method::Front, &mut |_| {})?;
    let loads = Loads { q_known: &q_known, ..Loads::default() };
    let solution = factored.solve(stiffness, loads, &mut |_| {})?;
    let work = solution.reaction.iter().zip(&q_known).map(|(f, q)| f * q).sum::<f64>();
    Ok((1.0 / work, [vertices.len(), dofs.len()]))
}

/// Table of the numbers.
pub(super) fn table(all: &[Softness]) -> Table {
    let title = "Locking: a clamped block pushed sideways";
    let mut table = Table::new("hard-cases-locking", title, &COLUMNS);
    for s in all {
        table.push([
            s.element.name().into(),
            s.nu.to_string().into(),
            s.cells.into(),
            s.compliance.into(),
            s.compliance_rel.into(),
        ]);
    }
    table
}

/// Figure of the displacement, relative to the reference, against 1 − 2ν.
///
/// # Errors
/// [`PlotError`].
pub(super) fn figure(all: &[Softness]) -> Result<String, PlotError> {
    let series = Element::ALL.map(|element| {
        let of = all.iter().filter(|s| s.element == element);
        let point =
            |s: &Softness| PlotPoint { x: 1.0 - 2.0 * s.nu, y: s.compliance_rel, spread: None };
        let label = element.name().to_owned();
        Series { label, mark: Mark::Line, points: of.map(point).collect() }
    });
    let plot = Plot {
        title: "Displacement of a pushed block over that of the reference".to_owned(),
        x_label: "1 − 2ν".to_owned(),
        y_label: "over reference".to_owned(),
        x_scale: Scale::Log,
        y_scale: Scale::Linear,
        series: series.into(),
    };
    plot.svg()
}
