//! What `glove-client solve` says at its end.

use std::path::PathBuf;

use softgrasp_core::mesh_io::MeshFile;
use softgrasp_protocol::Deformation;
use softgrasp_protocol::solve_report::SolveSummary;

use crate::ask::discretisation::DiscretisationEstimate;

/// Sentence on the estimate of the mesh's error.
pub(super) fn describe_discretisation(estimate: &DiscretisationEstimate) -> String {
    match estimate.rel {
        Some(rel) => format!(
            "discretisation: about {:.2} % between linear and ten-node elements (an estimate, not \
             a bound)\n",
            100.0 * rel
        ),
        None => format!("discretisation: no estimate: {}\n", estimate.why),
    }
}

/// Sentences on the answer and the mesh.
pub(super) fn describe(file: &MeshFile, summary: &SolveSummary, outs: &[PathBuf]) -> String {
    let mut text = format!(
        "{}: {} nodes, {} tetrahedra\n{} on {}: {} unknown and {} prescribed degrees of freedom, \
         {:.1} ms, residual {:.1e}\n",
        file.format,
        file.mesh.node_count(),
        file.mesh.tets().len(),
        summary.report.method,
        summary.report.element,
        summary.report.unknown_dofs,
        summary.report.known_dofs,
        summary.round_trip_ms,
        summary.report.residual_rel,
    );
    if summary.report.max_rotation_deg.is_finite() {
        text.push_str(&format!(
            "largest element rotation {:.2} degrees, strain {:.2} %\n",
            summary.report.max_rotation_deg,
            100.0 * summary.report.max_strain,
        ));
    }
    text.push_str(&describe_large(summary));
    let findings = &file.findings;
    for (count, what) in [
        (findings.flipped.len(), "inverted tetrahedra were turned"),
        (findings.degenerate.len(), "tetrahedra without volume were dropped"),
        (findings.repeated.len(), "tetrahedra that repeat an earlier one were dropped"),
        (findings.orphans, "nodes belong to no tetrahedron and stay where they are"),
    ] {
        if count > 0 {
            text.push_str(&format!("{count} {what}\n"));
        }
    }
    for out in outs {
        text.push_str(&format!("displacements written to {}\n", out.display()));
    }
    text
}

/// Sentences on the equilibrium at large deformation.
fn describe_large(summary: &SolveSummary) -> String {
    let Some(large) = &summary.large else { return String::new() };
    if summary.deformation == Deformation::Linear.as_str() {
        return format!("linear, because {}\n", summary.report.chosen_because);
    }
    format!(
        "large deformation: {} pieces, {} steps, {} solves; estimated error {:.1e}; stretch up to \
         {:.2}, volumes down to {:.2} of those at rest\n",
        large.substeps,
        large.newton_steps,
        large.linear_solves,
        summary.report.error_estimate_rel.unwrap_or(0.0),
        large.max_stretch,
        large.min_jacobian,
    )
}
