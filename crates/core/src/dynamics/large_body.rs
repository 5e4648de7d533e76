//! An object at large deformation between two steps: its shape, and the newest factor of a tangent.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use super::settings::StepError;
use super::state::spread;
use crate::fem::StiffnessPattern;
use crate::fem::hyperelastic::{Curvature, Elements, LargeSummary};
use crate::solve::condensed::{Base, CondensedError, Elasticity, FreeBody, FreeTangent, NodeForce};
use crate::solve::vectors::norm;

/// Elements of an object, the shape that forces of a state have given it, and a factor near it.
///
/// The shape follows from the forces, so a body made anew finds it; one that is kept has it, and the
/// factor, already. A body that yields is another matter: what has flowed is known to it alone.
///
/// Shapes: 3N. Units: m.
#[derive(Clone)]
pub struct LargeBody {
    pattern: Arc<StiffnessPattern>,
    shape: Shape,
    tangent: Option<Arc<FreeTangent>>,
    factors: usize,
    /// Size that the imbalance of a yielding body without forces is told relative to, N: its yield stress
    /// times the area of [`area_of`]; 0 for a body that does not yield.
    unloaded: f64,
}

/// A shape, the forces that it answers, and the plastic flow before it.
#[derive(Clone)]
pub(super) struct Shape {
    pub elements: Arc<Elements>,
    pub displacement: Vec<f64>,
    pub forces: Vec<NodeForce>,
}

/// How well a shape answers forces.
pub(super) struct Balance {
    /// Forces that hold the shape, 3N, N.
    pub holding: Vec<f64>,
    /// Norm of the forces out of balance over that of the forces; infinite where an element is inside
    /// out.
    pub residual_rel: f64,
}

/// Springs that are tried, as multiples of what the forces are bent on.
const SPRINGS: [f64; 3] = [0.5, 2.0, 8.0];
/// How far from the tangent to its positive part a factor is looked for then.
const POSITIVE_SHARES: [f64; 3] = [0.1, 0.35, 1.0];
/// Largest change of a deformation gradient in one step of Newton's method.
pub(super) const GRADIENT_STEP: f64 = 0.3;
/// Steps of Newton's method to the shape under some forces.
const SHAPE_STEPS: usize = 40;
/// Residual with which the shape under some forces is found.
const SHAPE_RESIDUAL: f64 = 1e-12;
/// Pieces in which forces are put on one after the other, where they cannot be put on at once.
const LOAD_PIECES: [usize; 3] = [1, 6, 30];

impl LargeBody {
    /// A body at rest.
    ///
    /// Shapes: `pattern` that of the elements' stiffness.
    pub fn at_rest(elements: Arc<Elements>, pattern: Arc<StiffnessPattern>) -> Self {
        let displacement = vec![0.0; 3 * elements.node_count()];
        let unloaded = elements.yield_stress().map_or(0.0, |stress| stress * area_of(&pattern));
        let shape = Shape { elements, displacement, forces: Vec::new() };
        Self { pattern, shape, tangent: None, factors: 0, unloaded }
    }

    /// Displacement of every node from rest, 3N, m, in the object's frame.
    pub fn displacement(&self) -> &[f64] {
        &self.shape.displacement
    }

    /// Factors that were made so far.
    pub fn factors(&self) -> usize {
        self.factors
    }

    /// Bytes held, the elements and their pattern apart.
    pub fn bytes(&self, base: &Base) -> usize {
        let tangent = self.tangent.as_ref().map_or(0, |tangent| tangent.bytes(base));
        tangent + size_of_val(self.shape.displacement.as_slice())
    }

    /// Rotation and stretches of the elements.
    pub fn summary(&self) -> LargeSummary {
        self.elements().summary(&self.shape.displacement)
    }

    /// Rotation and stretches of the elements under another displacement field.
    ///
    /// Shapes: `displacement` 3N.
    pub fn summary_of(&self, displacement: &[f64]) -> LargeSummary {
        self.elements().summary(displacement)
    }

    /// Its elements, with their law and what has flowed.
    pub fn elements(&self) -> &Arc<Elements> {
        &self.shape.elements
    }

    /// Makes the plastic flow of the present shape permanent.
    pub(super) fn flow(&mut self) {
        let Shape { elements, displacement, .. } = &mut self.shape;
        if elements.is_plastic() {
            Arc::make_mut(elements).commit(displacement);
        }
    }

    pub(super) fn shape(&self) -> &Shape {
        &self.shape
    }

    /// Puts the body into another shape; gives the one that it had.
    pub(super) fn put(&mut self, shape: Shape) -> Shape {
        std::mem::replace(&mut self.shape, shape)
    }

    /// The newest factor, if there is one.
    pub(super) fn tangent(&self) -> Option<Arc<FreeTangent>> {
        self.tangent.clone()
    }

    /// Factors the tangent at a shape, with as little added to it as it takes; for a steady one, until every
    /// motion of the free body takes energy.
    ///
    /// A pressed body that a few nodes hold would rather turn about them than be pressed: that alone
    /// leaves most tangents without a factor. Springs at all nodes, in proportion to their masses, hold
    /// it; on shapes without a mean motion they do little, so the factor is nearly as good.
    pub(super) fn factor_at(
        &mut self,
        elasticity: Elasticity<'_>,
        displacement: &[f64],
        is_steady: bool,
    ) -> Result<Arc<FreeTangent>, CondensedError> {
        let Elasticity { base, body, columns } = elasticity;
        let of = |curvature| self.elements().tangent(&self.pattern, displacement, curvature);
        let tangent = of(Curvature::AsItIs);
        let turning = self.turning_stiffness(body, displacement);
        let sprung = |share: f64| {
            let mut sprung = tangent.clone();
            sprung.add_springs(&springs(body, share * turning));
            sprung
        };
        let bound = columns.bound();
        let is_refused = |made: &Result<FreeTangent, CondensedError>| match made {
            Ok(made) => is_steady && !made.takes_energy(),
            Err(error) => matches!(error, CondensedError::NotPositiveDefinite { .. }),
        };
        let mut made = FreeTangent::try_new(base, body, &tangent, bound);
        for share in SPRINGS {
            if is_refused(&made) {
                made = FreeTangent::try_new(base, body, &sprung(share), bound);
            }
        }
        if is_refused(&made) {
            let positive = of(Curvature::PositivePart);
            for share in POSITIVE_SHARES {
                if is_refused(&made) {
                    let mut blended = tangent.clone();
                    blended.blend(&positive, share);
                    made = FreeTangent::try_new(base, body, &blended, bound);
                }
            }
        }
        let made = Arc::new(made?);
        self.factors += 1;
        self.tangent = Some(Arc::clone(&made));
        Ok(made)
    }

    /// Springs at a density of one that are as stiff against turning as the forces of a shape are bent on
    /// it, N/m⁴.
    fn turning_stiffness(&self, body: &FreeBody, displacement: &[f64]) -> f64 {
        let forces = self.elements().evaluate(displacement).forces;
        let mut moments = Matrix3::zeros();
        for ((f, u), rest) in
            forces.chunks_exact(3).zip(displacement.chunks_exact(3)).zip(self.pattern.places())
        {
            let place = rest - body.centre() + Vector3::from_column_slice(u);
            moments += Vector3::from_column_slice(f) * place.transpose();
        }
        let inertia = body.inertia_of(displacement).symmetric_eigenvalues().min();
        if inertia > 0.0 { moments.norm() / inertia } else { 0.0 }
    }

    /// How well a shape answers forces, relative to them or to what the step began with.
    pub(super) fn balance(
        &self,
        elasticity: Elasticity<'_>,
        displacement: &[f64],
        forces: &[NodeForce],
    ) -> Balance {
        let evaluated = self.elements().evaluate(displacement);
        let mut left = spread(forces, displacement.len());
        let size = norm(&left);
        elasticity.body.balanced(&mut left, displacement);
        left.iter_mut().zip(&evaluated.forces).for_each(|(left, holding)| *left -= holding);
        let off = norm(&left);
        let residual_rel = match (evaluated.energy.is_finite() && off.is_finite(), size > 0.0) {
            (false, _) => f64::INFINITY,
            (true, true) => off / size,
            // What has flowed holds itself in a shape that is not that of rest.
            (true, false) if self.unloaded > 0.0 => off / self.unloaded,
            // Without forces nothing but rest is in balance.
            (true, false) if off == 0.0 => 0.0,
            (true, false) => f64::INFINITY,
        };
        Balance { holding: evaluated.forces, residual_rel }
    }

    /// Share of a step that leaves every element its volume and turns none too far.
    pub(super) fn share_of_step(&self, from: &[f64], step: &[f64]) -> f64 {
        let change = self.elements().gradient_change_max(step);
        match change.is_finite() {
            true => self.elements().step_limit(from, step).min(GRADIENT_STEP / change.max(1e-300)),
            false => f64::NAN,
        }
    }

    /// Takes the shape that some forces give the body, from rest on, unless it has it already. A body that
    /// has flowed begins at the shape that it has.
    ///
    /// # Errors
    /// [`StepError::NoShape`] where none is found.
    pub(super) fn take_shape_of(
        &mut self,
        elasticity: Elasticity<'_>,
        forces: &[NodeForce],
    ) -> Result<(), StepError> {
        if self.shape.forces == forces {
            return Ok(());
        }
        let rest = match self.elements().is_plastic() {
            true => self.shape.displacement.clone(),
            false => vec![0.0; self.shape.displacement.len()],
        };
        let mut left = f64::INFINITY;
        for pieces in LOAD_PIECES {
            let mut displacement = rest.clone();
            for piece in 1..=pieces {
                let share = piece as f64 / pieces as f64;
                let part: Vec<NodeForce> = forces.iter().map(|(n, f)| (*n, share * f)).collect();
                left = self.settle(elasticity, &mut displacement, &part)?;
                if left > SHAPE_RESIDUAL.sqrt() || left.is_nan() {
                    break;
                }
            }
            if left <= SHAPE_RESIDUAL.sqrt() {
                (self.shape.displacement, self.shape.forces) = (displacement, forces.to_vec());
                return Ok(());
            }
        }
        Err(StepError::NoShape { residual_rel: left })
    }

    /// Brings a shape into balance with forces; the residual that is left, relative to them.
    fn settle(
        &mut self,
        elasticity: Elasticity<'_>,
        displacement: &mut [f64],
        forces: &[NodeForce],
    ) -> Result<f64, CondensedError> {
        if forces.is_empty() && !self.elements().is_plastic() {
            displacement.fill(0.0);
            return Ok(0.0);
        }
        let applied = spread(forces, displacement.len());
        let mut left = f64::INFINITY;
        for _ in 0..SHAPE_STEPS {
            let balance = self.balance(elasticity, displacement, forces);
            let before = std::mem::replace(&mut left, balance.residual_rel);
            // Rounding is reached where a small residual falls no more.
            let is_rounding = left < SHAPE_RESIDUAL.sqrt() && left > 0.5 * before;
            if left <= SHAPE_RESIDUAL || is_rounding || !left.is_finite() {
                break;
            }
            let tangent = self.factor_at(elasticity, displacement, false)?;
            let off: Vec<f64> =
                applied.iter().zip(&balance.holding).map(|(f, holding)| f - holding).collect();
            let step = tangent.apply(elasticity.base, elasticity.body, &off);
            let share = self.share_of_step(displacement, &step);
            if share.is_nan() {
                return Ok(f64::INFINITY);
            }
            let share = share.min(1.0);
            displacement.iter_mut().zip(&step).for_each(|(u, d)| *u += share * d);
        }
        Ok(left)
    }
}

/// Area of a face of the cube that has the volume of the box around some nodes, m².
fn area_of(pattern: &StiffnessPattern) -> f64 {
    let far = Vector3::repeat(f64::INFINITY);
    let ends = pattern
        .places()
        .iter()
        .fold((far, -far), |(low, high), place| (low.inf(&place.coords), high.sup(&place.coords)));
    (ends.1 - ends.0).product().abs().powf(2.0 / 3.0)
}

/// A spring for every degree of freedom that has a mass.
fn springs(body: &FreeBody, stiffness: f64) -> Vec<(u32, f64)> {
    let massive = (0u32..).zip(body.volumes()).filter(|(_, volume)| **volume > 0.0);
    massive
        .flat_map(|(node, volume)| (0..3).map(move |axis| (3 * node + axis, stiffness * volume)))
        .collect()
}
