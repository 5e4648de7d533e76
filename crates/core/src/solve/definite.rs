//! Which degrees of freedom to hold so that a stiffness that leaves motions free has a factor.

use super::zero_energy::{BodyMotions, RigidBodies, dofs_by_body};
use crate::mesh::{Bodies, TetMesh};

/// Fields of all motions without energy that leave the fixed degrees of freedom in place.
pub(super) fn motions(
    mesh: &TetMesh,
    bodies: &Bodies,
    rigid: &RigidBodies,
    fixed: &[u32],
) -> Result<Vec<Vec<f64>>, usize> {
    let mut fields = Vec::new();
    for (body, held) in dofs_by_body(bodies, fixed).into_iter().enumerate() {
        let motions = BodyMotions::of_body(mesh, rigid, body, &held, &[]).ok_or(body)?;
        for motion in &motions.basis {
            let mut field = vec![0.0; 3 * mesh.node_count()];
            motions.add_field(motion, &mut field);
            for &dof in fixed {
                field[dof as usize] = 0.0;
            }
            fields.push(field);
        }
    }
    Ok(fields)
}

/// As many degrees of freedom as there are motions, so that none is left: the one that moves most,
/// then the one that moves most in what is left, and so on (pivoted orthogonalisation of rows).
pub(super) fn hold(fields: &[Vec<f64>], fixed: &[u32]) -> Vec<u32> {
    let z = fields.len();
    let Some(dofs) = fields.first().map(Vec::len) else { return Vec::new() };
    let mut rows: Vec<f64> = (0..dofs).flat_map(|d| fields.iter().map(move |f| f[d])).collect();
    for &dof in fixed {
        rows[dof as usize * z..(dof as usize + 1) * z].fill(0.0);
    }
    let mut held = Vec::with_capacity(z);
    for _ in 0..z {
        let size = |d: usize| rows[d * z..(d + 1) * z].iter().map(|x| x * x).sum::<f64>();
        // The first of equals, so that the choice does not depend on rounding of equal sums.
        let most = (0..dofs).map(size).fold(0.0, f64::max);
        let Some(dof) = (0..dofs).find(|&d| size(d) >= most * (1.0 - 1e-9)) else { break };
        let direction: Vec<f64> =
            rows[dof * z..(dof + 1) * z].iter().map(|x| x / most.sqrt()).collect();
        for row in rows.chunks_exact_mut(z) {
            let along: f64 = row.iter().zip(&direction).map(|(r, d)| r * d).sum();
            row.iter_mut().zip(&direction).for_each(|(r, d)| *r -= along * d);
        }
        held.push(dof as u32);
    }
    held.sort_unstable();
    held
}

/// Degrees of freedom to hold besides the known ones; none where a body has too many hinged parts to
/// say.
///
/// Shapes: `known` ascending; result ascending.
pub(super) fn held_for_definiteness(
    mesh: &TetMesh,
    bodies: &Bodies,
    rigid: &RigidBodies,
    known: &[u32],
) -> Vec<u32> {
    motions(mesh, bodies, rigid, known).map_or_else(|_| Vec::new(), |fields| hold(&fields, known))
}
