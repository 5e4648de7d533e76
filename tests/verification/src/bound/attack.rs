//! Tries to break the error bound in one scene: random grips, every bound compared with the true error.

use softgrasp_core::model::ModelError;
use softgrasp_core::solve::condensed::{Base, Columns, ContactSet, Delivery, Touched};

use super::exact::Exact;
use super::grips::{Kind, contacts, pushes};
use super::scenes::Scene;
use super::tally::{Bound, Tally};
use softgrasp_bench::random::Random;
use softgrasp_bench::report::ReportError;

/// Number of contact sets and of grips.
#[derive(Clone, Copy)]
pub(super) struct Amount {
    /// Number of contact sets for each scene and kind.
    pub sets: usize,
    /// Number of grips for each contact set.
    pub grips: usize,
}

/// Grips a scene by every kind of contacts; one tally for each kind.
///
/// # Errors
/// [`ReportError`] if no base can be made.
pub(super) fn attack(
    scene: &Scene,
    seed: u64,
    amount: Amount,
) -> Result<Vec<(Kind, Tally)>, ReportError> {
    let base = scene.model.condense(None, &mut |_| {})?;
    // Kept by the base, and `certify` finds it there.
    let _ = base.prove_eigenvalue_min();
    let columns = Columns::new(1 << 28);
    let mut random = Random(seed);
    let of_kind = |kind| {
        let mut tally = Tally::default();
        for _ in 0..amount.sets {
            let touched = contacts(scene, kind, &mut random);
            grip(scene, &base, &columns, &touched, amount.grips, &mut random, &mut tally)
                .map_err(ModelError::from)?;
        }
        Ok((kind, tally))
    };
    Kind::ALL.into_iter().map(of_kind).collect()
}

/// Many grips of one contact set.
fn grip(
    scene: &Scene,
    base: &Base,
    columns: &Columns,
    touched: &Touched,
    grips: usize,
    random: &mut Random,
    tally: &mut Tally,
) -> Result<(), softgrasp_core::solve::condensed::CondensedError> {
    let Ok(mut set) = ContactSet::try_new(base, columns, touched) else {
        tally.refused_sets += 1;
        return Ok(());
    };
    let Some(exact) = Exact::of(scene.model.stiffness(), scene.model.fixed(), touched) else {
        tally.sets_without_reference += 1;
        return Ok(());
    };
    let nodes = wanted(scene, random);
    set.want(base, &nodes);
    let mut plain: Vec<Bound> = Vec::with_capacity(grips);
    let mut asked = Vec::with_capacity(grips);
    for at in 0..grips {
        let q = pushes(scene, touched, random);
        let answer = set.solve(&q)?;
        let delivered = set.wanted_displacements(&answer);
        let delivery = if at % 2 == 0 { Delivery::Double } else { Delivery::Single };
        plain.push(set.certify(base, &q, &answer, &delivered, delivery).error_bound_rel);
        asked.push((q, answer, delivered, delivery));
    }
    set.refine(base);
    for ((q, answer, delivered, delivery), plain) in asked.into_iter().zip(plain) {
        let refined = set.certify(base, &q, &answer, &delivered, delivery).error_bound_rel;
        let whole = set.full_displacement(base, &answer);
        let right = exact.displacement(&q);
        let error = error_rel(whole, &nodes, &delivered, delivery, &right);
        tally.add(delivery, error, plain, refined);
    }
    Ok(())
}

/// Wanted nodes: all, or some, or few of them many times.
fn wanted(scene: &Scene, random: &mut Random) -> Vec<u32> {
    let count = scene.model.mesh().node_count();
    match random.below(3) {
        0 => (0..count as u32).collect(),
        1 => (0..20).map(|_| random.below(count) as u32).collect(),
        _ => vec![random.below(count) as u32; 200],
    }
}

/// Norm of the error over that of the exact answer, all nodes; delivered ones with the rounding of the
/// wire.
fn error_rel(
    mut whole: Vec<f64>,
    nodes: &[u32],
    delivered: &[[f64; 3]],
    delivery: Delivery,
    right: &[(f64, f64)],
) -> f64 {
    let largest = delivered.iter().flatten().fold(0.0f64, |m, u| m.max(u.abs()));
    let arrived = |u: f64| match delivery {
        Delivery::Single if largest > 0.0 => f64::from((u / largest) as f32) * largest,
        _ => u,
    };
    for (node, u) in nodes.iter().zip(delivered) {
        (0..3).for_each(|axis| whole[3 * *node as usize + axis] = arrived(u[axis]));
    }
    let scale = right.iter().fold(f64::MIN_POSITIVE, |m, u| m.max(u.0.abs()));
    let square = |x: f64| (x / scale) * (x / scale);
    let pairs = whole.iter().zip(right);
    let off: f64 = pairs.map(|(a, u)| square((a - u.0) - u.1)).sum();
    let size: f64 = right.iter().map(|u| square(u.0)).sum();
    (off / size).sqrt()
}
