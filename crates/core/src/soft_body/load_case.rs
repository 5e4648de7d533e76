//! A load case: prescribed displacements (Dirichlet values) and forces, by node.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::answer::SoftBodyError;
use crate::model::{Known, Model};

/// An axis of the mesh's frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// x.
    X,
    /// y.
    Y,
    /// z.
    Z,
}

/// Prescribed displacements and forces. What is not prescribed is free; what is named twice has the
/// later value.
///
/// Units: m, N. Frame: that of the mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadCase {
    prescribed: BTreeMap<u32, [Option<f64>; 3]>,
    forces: BTreeMap<u32, Vector3<f64>>,
}

impl LoadCase {
    /// Nothing is prescribed and nothing pulls.
    pub fn new() -> Self {
        Self::default()
    }

    /// Holds nodes (from 0) where they are.
    pub fn hold(&mut self, nodes: impl IntoIterator<Item = u32>) -> &mut Self {
        nodes.into_iter().fold(self, |case, node| case.prescribe(node, Vector3::zeros()))
    }

    /// Prescribes the displacement of a node (from 0) along all axes, m.
    pub fn prescribe(&mut self, node: u32, displacement: Vector3<f64>) -> &mut Self {
        self.prescribed.insert(node, <[f64; 3]>::from(displacement).map(Some));
        self
    }

    /// Prescribes the displacement of a node (from 0) along one axis, m; it stays free along the others.
    pub fn prescribe_along(&mut self, node: u32, axis: Axis, displacement: f64) -> &mut Self {
        self.prescribed.entry(node).or_default()[axis as usize] = Some(displacement);
        self
    }

    /// A force on a node (from 0), N.
    pub fn force(&mut self, node: u32, force: Vector3<f64>) -> &mut Self {
        self.forces.insert(node, force);
        self
    }

    /// Whether forces act.
    pub(super) fn has_forces(&self) -> bool {
        !self.forces.is_empty()
    }

    /// Known degrees of freedom with their values, and forces on all degrees of freedom of a model.
    ///
    /// # Errors
    /// [`SoftBodyError`] for nodes that are not there and for contradictions.
    pub(super) fn of(&self, model: &Model) -> Result<(Known, Vec<f64>), SoftBodyError> {
        let pairs = self.prescribed.iter().flat_map(|(node, values)| {
            let dof = |axis: u32| node.saturating_mul(3).saturating_add(axis);
            let named = (0..3u32).zip(values);
            named.filter_map(move |(axis, value)| value.map(|value| (dof(axis), value)))
        });
        let known = model.known(pairs.collect())?;
        Ok((known, self.forces_on(model)?))
    }

    fn forces_on(&self, model: &Model) -> Result<Vec<f64>, SoftBodyError> {
        if self.forces.is_empty() {
            return Ok(Vec::new());
        }
        let mut forces = vec![0.0; 3 * model.system_node_count()];
        for (&node, force) in &self.forces {
            let at = node as usize;
            if at >= model.mesh().node_count() || !model.is_used(at) {
                return Err(SoftBodyError::LooseForce { node });
            }
            let values = self.prescribed.get(&node).copied().unwrap_or_default();
            if values.iter().zip(force.iter()).any(|(value, f)| value.is_some() && *f != 0.0) {
                return Err(SoftBodyError::ForceOnPrescribed { node });
            }
            forces[3 * at..3 * at + 3].copy_from_slice(force.as_slice());
        }
        Ok(forces)
    }
}
