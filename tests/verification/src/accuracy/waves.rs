//! A solution made up of waves, with the body force it needs: order of convergence.

use nalgebra::{Point3, Vector3};
use softgrasp_core::fem::{Element, Material};

use super::block::{block, shaken};
use super::discrete::Discrete;
use super::outcome::Outcome;
use softgrasp_bench::report::ReportError;

/// Wave vectors, 1/m, and phases: `uᵢ = sin(kᵢ · x + φᵢ)`, about half a wave over the unit cube.
fn waves() -> [(Vector3<f64>, f64); 3] {
    [
        (Vector3::new(2.9, -1.8, 1.1), 0.4),
        (Vector3::new(-1.4, 3.0, 1.6), -0.7),
        (Vector3::new(1.7, 1.3, -2.7), 1.1),
    ]
}

fn exact(p: &Point3<f64>) -> Vector3<f64> {
    Vector3::from(waves().map(|(k, phase)| (k.dot(&p.coords) + phase).sin()))
}

/// `bᵢ = −(λ + μ) ∂ᵢ div u − μ Δuᵢ = (λ + μ) Σⱼ kⱼᵢ kⱼⱼ uⱼ + μ |kᵢ|² uᵢ`.
fn body_force(p: &Point3<f64>, material: &Material) -> Vector3<f64> {
    let (u, waves) = (exact(p), waves());
    let (lambda, mu) = (material.lame_lambda(), material.shear_modulus());
    Vector3::from_fn(|i, _| {
        let divergence: f64 = (0..3).map(|j| waves[j].0[i] * waves[j].0[j] * u[j]).sum();
        (lambda + mu) * divergence + mu * waves[i].0.norm_squared() * u[i]
    })
}

/// Error of the displacement over the volume of a cube with an irregular inside and `cells` boxes
/// along an edge, all of its surface known, mid-edge nodes among it.
///
/// # Errors
/// [`ReportError`].
pub fn forced(element: Element, poisson: f64, cells: usize) -> Result<Outcome, ReportError> {
    let mesh = shaken(&block([cells; 3], Point3::from)?, 0.1 / cells as f64)?;
    let discrete = Discrete::new(&mesh, element, 1.0, poisson)?;
    let material = Material::try_new(1.0, poisson)?;
    let forces = discrete.body_force(|p| body_force(p, &material));
    let answer = discrete.solve(discrete.give_field(&discrete.on_surface(), exact), forces)?;
    let solved = discrete.solved("waves", poisson, cells, &answer);
    Ok(solved.with_error("displacement, mean square", discrete.error(answer.displacement(), exact)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::{ELEMENTS, order};

    /// Nearly the order of theory: 1.9 of 2 and 2.8 of 3, because meshes this coarse still show terms of
    /// higher order.
    #[test]
    fn displacements_converge_with_their_order() {
        for &element in ELEMENTS {
            let expected = order(element);
            let cells = if expected > 2.0 { [4, 8] } else { [8, 16] };
            let [coarse, fine] = cells.map(|cells| forced(element, 0.3, cells).unwrap());
            let order = fine.order_from(&coarse);
            println!("{coarse:?}\n{fine:?}\norder {order:.3}");
            assert!(order > if expected > 2.0 { 2.8 } else { 1.9 }, "{element:?}: {order}");
        }
    }
}
