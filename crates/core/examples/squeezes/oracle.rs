//! The oracle: Newton with the positive part of the tangent at every one of many small load steps.

use std::sync::Arc;

use softgrasp_core::fem::hyperelastic::Curvature;
use softgrasp_core::solve::{FrontAnalysis, FrontFactor, Partition};

use crate::squeeze::Squeeze;

/// Load steps.
const STEPS: u32 = 40;
/// Newton steps at a load step.
const NEWTON_MAX: u32 = 80;

/// A stable equilibrium, if it finds one.
pub fn solve(squeeze: &Squeeze) -> Option<Vec<f64>> {
    let Squeeze { model, elements, known, forces, .. } = squeeze;
    let used: Vec<bool> = (0..model.system_node_count()).map(|n| model.is_used(n)).collect();
    let partition = Partition::try_new(&used, &known.dofs).ok()?;
    let analysis = Arc::new(FrontAnalysis::new(model.stiffness(), &partition));
    let pattern = Arc::clone(model.stiffness().pattern());
    let mut q = vec![0.0; forces.len()];
    let factor_of = |q: &[f64], curvature| {
        let tangent = elements.tangent(&pattern, q, curvature);
        FrontFactor::<f64>::try_new(&analysis, &tangent).ok().map(|factor| (factor, tangent))
    };
    let mut done = 0.0f64;
    let mut step_size = 1.0 / f64::from(STEPS);
    while done < 1.0 {
        let to = (done + step_size).min(1.0);
        // Known displacements and what the positive part leads the rest to.
        let (factor, tangent) = factor_of(&q, Curvature::PositivePart)?;
        let mut step = vec![0.0; q.len()];
        for (&dof, wanted) in known.dofs.iter().zip(&known.q_known) {
            step[dof as usize] = to * wanted - q[dof as usize];
        }
        let coupled = tangent.mul(&step);
        let mut right: Vec<f64> =
            partition.unknown().iter().map(|&d| -coupled[d as usize]).collect();
        factor.solve_in_place(&mut right, 1);
        for (&dof, moved) in partition.unknown().iter().zip(right) {
            step[dof as usize] = moved;
        }
        if elements.step_limit(&q, &step) < 1.0 {
            step_size *= 0.5;
            if step_size < 1e-5 {
                return None;
            }
            continue;
        }
        q.iter_mut().zip(&step).for_each(|(q, d)| *q += d);
        let loads: Vec<f64> = forces.iter().map(|f| to * f).collect();
        newton(squeeze, (&partition, &factor_of), &loads, &mut q)?;
        (done, step_size) = (to, (1.5 * step_size).min(1.0 / f64::from(STEPS)));
    }
    factor_of(&q, Curvature::AsItIs).map(|_| q)
}

type Factored = (FrontFactor<f64>, softgrasp_core::fem::Stiffness);

/// The factor of a tangent at a shape, if it has one.
type FactorOf<'a> = dyn Fn(&[f64], Curvature) -> Option<Factored> + 'a;

fn newton(
    squeeze: &Squeeze,
    (partition, factor_of): (&Partition, &FactorOf<'_>),
    loads: &[f64],
    q: &mut Vec<f64>,
) -> Option<()> {
    let elements = &squeeze.elements;
    let potential = |q: &[f64]| {
        let evaluated = elements.evaluate(q);
        let work: f64 = loads.iter().zip(q).map(|(f, u)| f * u).sum();
        (evaluated.energy - work, evaluated.forces)
    };
    for _ in 0..NEWTON_MAX {
        let (energy, held) = potential(q);
        let mut step: Vec<f64> =
            partition.unknown().iter().map(|&d| loads[d as usize] - held[d as usize]).collect();
        let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let (out, all) = (norm(&step), norm(&held));
        if out <= 1e-9 * all || all == 0.0 {
            return Some(());
        }
        let residual = step.clone();
        let (factor, _) =
            factor_of(q, Curvature::AsItIs).or_else(|| factor_of(q, Curvature::PositivePart))?;
        factor.solve_in_place(&mut step, 1);
        let slope: f64 = -residual.iter().zip(&step).map(|(a, b)| a * b).sum::<f64>();
        let mut full = vec![0.0; q.len()];
        for (&dof, moved) in partition.unknown().iter().zip(&step) {
            full[dof as usize] = *moved;
        }
        let mut share = elements.step_limit(q, &full);
        loop {
            let moved: Vec<f64> = q.iter().zip(&full).map(|(q, d)| q + share * d).collect();
            let (after, _) = potential(&moved);
            if after <= energy + 1e-4 * share * slope + 1e-12 * energy.abs() {
                *q = moved;
                break;
            }
            share *= 0.5;
            if share < 1e-8 {
                return (out <= 1e-6 * all).then_some(());
            }
        }
    }
    None
}
