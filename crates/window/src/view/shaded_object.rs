//! The values at the nodes of an object that its colour shows.

use std::sync::Arc;

use nalgebra::Vector3;
use softgrasp_core::fem::{Material, OtherNodeCount, StressRecovery};
use softgrasp_grasp::object::RestShape;

use super::shading::Shading;

/// An object with one rest shape, ready to be shaded; a kept shape is another one.
///
/// Only what a shading needs is made: stress recovery with the first that shows strain or stress.
/// Shapes: N nodes. Units: SI (m, 1, Pa, 1); [`Shading::unit`] has those that are read.
pub struct ShadedObject {
    rest: Arc<RestShape>,
    material: Material,
    recovery: Option<StressRecovery>,
    values: Vec<f64>,
    /// Estimated error of the whole object, where the last shading was that of the error.
    error_of_whole: Option<f64>,
}

impl ShadedObject {
    /// An object with this rest shape, whose body is of a material.
    pub fn new(rest: Arc<RestShape>, material: Material) -> Self {
        Self { rest, material, recovery: None, values: Vec::new(), error_of_whole: None }
    }

    /// Works out what a shading shows of every node; nothing for [`Shading::Plain`].
    ///
    /// Where [`Shading::needs_inside`], the displacement has to be that of an answer for every node
    /// (`Subscription::Whole`, `SoftObject::is_whole`): an inside that stayed behind looks strained.
    ///
    /// Shapes: `displacement` one per node, m.
    ///
    /// # Errors
    /// [`OtherNodeCount`]; there are no values then.
    pub fn shade(
        &mut self,
        shading: Shading,
        displacement: &[[f64; 3]],
    ) -> Result<(), OtherNodeCount> {
        self.values.clear();
        self.error_of_whole = None;
        match shading {
            Shading::Plain => Ok(()),
            Shading::Displacement => self.take_sizes(displacement),
            Shading::Strain => self.recover(|r, values| r.principal_strain(displacement, values)),
            Shading::VonMises => self.recover(|r, values| r.von_mises(displacement, values)),
            Shading::Error => {
                let of_whole = self.recover(|r, values| r.error(displacement, values))?;
                self.error_of_whole = Some(of_whole);
                Ok(())
            }
        }
    }

    fn take_sizes(&mut self, displacement: &[[f64; 3]]) -> Result<(), OtherNodeCount> {
        let (got, expected) = (displacement.len(), self.rest.mesh().node_count());
        if got != expected {
            return Err(OtherNodeCount { got, expected });
        }
        self.values.extend(displacement.iter().map(|u| Vector3::from(*u).norm()));
        Ok(())
    }

    fn recover<T>(&mut self, work: impl FnOnce(&mut StressRecovery, &mut Vec<f64>) -> T) -> T {
        let Self { rest, material, recovery, values, .. } = self;
        let made = || StressRecovery::new(rest.mesh(), &rest.regions().materials(*material));
        work(recovery.get_or_insert_with(made), values)
    }

    /// Values of the last shading, one per node.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The largest value that is seen, that is, of the surface; 0 without values.
    pub fn largest_seen(&self) -> f64 {
        self.seen().fold(0.0, f64::max)
    }

    /// The value that so large a share of the surface's nodes does not exceed; 0 without values.
    ///
    /// Strain and stress are highest at few nodes under a fingertip, and higher the finer the mesh
    /// is: a range up to the largest would leave the rest without colour.
    pub fn seen_by_share(&self, share: f64) -> f64 {
        let mut seen: Vec<f64> = self.seen().collect();
        let Some(last) = seen.len().checked_sub(1) else { return 0.0 };
        let at = ((share * last as f64).round() as usize).min(last);
        *seen.select_nth_unstable_by(at, f64::total_cmp).1
    }

    fn seen(&self) -> impl Iterator<Item = f64> {
        let seen = self.rest.surface().nodes.iter();
        seen.filter_map(|&node| self.values.get(node as usize)).copied()
    }

    /// Estimated error of the stress of the whole object in the energy norm, relative; `None`
    /// unless the last shading was [`Shading::Error`]. An estimate, not a bound.
    pub fn error_of_whole(&self) -> Option<f64> {
        self.error_of_whole
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;
    use softgrasp_core::mesh::{BuiltIn, generate};

    const STRETCH: f64 = 0.02;

    fn sphere() -> (ShadedObject, Vec<[f64; 3]>) {
        let mesh = generate(BuiltIn::Sphere, 500).unwrap();
        let stretched = |p: &Point3<f64>| STRETCH * Vector3::new(p.x, -0.4 * p.y, -0.4 * p.z);
        let u = mesh.vertices().iter().map(|p| stretched(p).into()).collect();
        let rest = Arc::new(RestShape::try_new(mesh).unwrap());
        (ShadedObject::new(rest, Material::try_new(1.0e4, 0.4).unwrap()), u)
    }

    #[test]
    fn each_shading_shows_its_quantity_of_a_stretched_sphere() {
        let (mut object, u) = sphere();
        let radius = object.rest.mesh().size() / 2.0;
        for (shading, expected) in [
            (Shading::Displacement, STRETCH * radius),
            (Shading::Strain, STRETCH),
            (Shading::VonMises, STRETCH * 1.0e4),
            (Shading::Error, 0.0),
        ] {
            object.shade(shading, &u).unwrap();
            assert_eq!(object.values().len(), u.len(), "{shading}");
            let seen = object.largest_seen();
            assert!((seen - expected).abs() <= 0.02 * expected + 1e-9, "{shading}: {seen}");
            assert_eq!(object.error_of_whole().is_some(), shading == Shading::Error);
            assert_eq!(object.seen_by_share(1.0), seen, "{shading}");
            let half = object.seen_by_share(0.5);
            let not_above = object.seen().filter(|value| *value <= half).count();
            let below = object.seen().filter(|value| *value < half).count();
            let all = object.seen().count();
            assert!(2 * not_above >= all && 2 * below <= all, "{shading}: {below}, {not_above}");
        }
        object.shade(Shading::Plain, &u).unwrap();
        assert!(object.values().is_empty() && object.largest_seen() == 0.0);
    }

    #[test]
    fn displacements_of_another_mesh_leave_no_values() {
        let (mut object, u) = sphere();
        for shading in Shading::ALL {
            let shaded = object.shade(shading, &u[1..]);
            assert_eq!(shaded.is_err(), shading != Shading::Plain, "{shading}");
            assert!(object.values().is_empty());
        }
    }
}
