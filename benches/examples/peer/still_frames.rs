//! Frames by `condensed` from what is kept of a shape, beside the time steps of others.

use softgrasp_bench::reference::error_rel;
use softgrasp_bench::sample::{Spread, timed_ms};
use softgrasp_core::solve::condensed::{Columns, ContactSet, Touched};

use crate::problem::Problem;

/// Warm frames of one call.
const FRAMES: usize = 30;
/// More than any problem here needs.
const COLUMN_BYTES: usize = 1 << 30;

/// Time of a shape's base, of the first frame of a grip, and the median of warm frames, for surface
/// nodes and for all; the worst error of all of them.
pub fn run(problem: &Problem) -> anyhow::Result<serde_json::Value> {
    let (base_ms, base) = timed_ms(|| problem.model.condense(None, &mut |_| {}));
    let base = base?;
    let columns = Columns::new(COLUMN_BYTES);
    let (known, right) = (&problem.known, &problem.reference[0].displacement);
    let (grip_ms, contact) = timed_ms(|| {
        ContactSet::try_new(&base, &columns, &Touched::of_dofs(&known.dofs)).map(|mut contact| {
            contact.want(&base, &problem.surface.nodes);
            contact
        })
    });
    let contact = contact?;
    let (mut surface_ms, mut all_ms, mut error) = (Vec::new(), Vec::new(), 0.0f64);
    for frame in 0..FRAMES {
        let scale = 1.0 + frame as f64 / FRAMES as f64;
        let q: Vec<f64> = known.q_known.iter().map(|u| scale * u).collect();
        let (ms, u) = timed_ms(|| contact.solve(&q).map(|a| contact.wanted_displacements(&a)));
        surface_ms.push(ms);
        let nodes = problem.surface.nodes.iter();
        let places = nodes.flat_map(|&node| (0..3).map(move |axis| 3 * node as usize + axis));
        let expected = places.map(|dof| scale * right[dof]);
        error = error.max(error_rel(u?.into_iter().flatten().zip(expected)));
        let (ms, u) = timed_ms(|| contact.solve(&q).map(|a| contact.full_displacement(&base, &a)));
        all_ms.push(ms);
        error = error.max(problem.reference[0].error_of(u?.into_iter(), scale));
    }
    let median = |ms: Vec<f64>| Spread::of(ms).median;
    Ok(serde_json::json!({
        "base_ms": base_ms,
        "grip_ms": grip_ms,
        "surface_ms": median(surface_ms),
        "all_ms": median(all_ms),
        "surface_nodes": problem.surface.nodes.len(),
        "error_rel": error,
    }))
}
