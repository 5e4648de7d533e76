//! Compliance of a body that nothing holds: what is left of a load once inertia has balanced it.
//!
//! A free body under forces f accelerates as a rigid body; the elastic part feels f less mass times
//! that acceleration, which is in balance (inertia relief). With R the six rigid motions about the
//! centre of mass, M the lumped masses and A = (Rᵀ M R)⁻¹ the balanced load is P f = f − M R A Rᵀ f,
//! and of all displacements that answer it the one without a mean motion is Pᵀ K⁻ P f, where K⁻ may be
//! the inverse of any stiffness that holds the body at as many degrees of freedom as it has motions.

use std::ops::AddAssign;

use nalgebra::{Matrix3, Matrix3x6, Matrix6, Matrix6x3, Point3, Vector3, Vector6};
use rayon::prelude::*;

use super::base::Base;
#[cfg(test)]
use super::columns::ContactColumns;
use super::error::CondensedError;
use crate::fem::SpreadLoads;

/// Rigid motions, masses and the response of the held body to them, made once for a shape.
///
/// Shapes: N nodes; rigid motions are three translations, then three rotations about the centre of
/// mass. Units: masses at a density of one, so m³ and m⁵. Frame: the object's.
///
/// Source: inertia relief, for example Cook et al., Concepts and Applications of Finite Element
/// Analysis (2002), 11.
pub struct FreeBody {
    vertices: Vec<Point3<f64>>,
    /// Volume that each node stands for, m³.
    volumes: Vec<f64>,
    volume: f64,
    centre: Point3<f64>,
    /// Moments of inertia about the centre at a density of one, m⁵.
    inertia: Matrix3<f64>,
    /// Inverse of the moments A of the rigid motions.
    inverse: Matrix6<f64>,
    /// `K⁻ M R`, by node.
    response: Vec<Matrix3x6<f64>>,
    /// `Rᵀ M K⁻ M R`.
    own: Matrix6<f64>,
    /// Norms of what the solves for `M R` leave, as computed.
    residuals: [f64; 6],
}

impl FreeBody {
    /// Six solves of the held body.
    ///
    /// # Errors
    /// [`CondensedError::NotFree`] where the scene holds the body, or it has several parts that move
    /// on their own; [`CondensedError::NotConverged`] where the base has no factor.
    pub fn try_new(body: SpreadLoads<'_>, base: &Base) -> Result<Self, CondensedError> {
        let motions = base.modes.len();
        if motions != 6 || !base.fixed.is_empty() {
            return Err(CondensedError::NotFree { motions });
        }
        let (volumes, vertices) = (body.nodal_volumes(), body.vertices());
        let volume: f64 = volumes.iter().sum();
        let moment = |f: &dyn Fn(&Point3<f64>) -> f64| -> f64 {
            volumes.iter().zip(vertices).map(|(v, p)| v * f(p)).sum()
        };
        let centre = Point3::new(
            moment(&|p| p.x) / volume,
            moment(&|p| p.y) / volume,
            moment(&|p| p.z) / volume,
        );
        let mut inertia = Matrix3::zeros();
        for (v, p) in volumes.iter().zip(vertices) {
            let r = p - centre;
            inertia += *v * (r.norm_squared() * Matrix3::identity() - r * r.transpose());
        }
        let mut inverse = Matrix6::zeros();
        for axis in 0..3 {
            inverse[(axis, axis)] = 1.0 / volume;
        }
        let turning = inertia.try_inverse().ok_or(CondensedError::NotFree { motions })?;
        inverse.fixed_view_mut::<3, 3>(3, 3).copy_from(&turning);
        let mut body = Self {
            vertices: vertices.to_vec(),
            volumes,
            volume,
            centre,
            inertia,
            inverse,
            response: Vec::new(),
            own: Matrix6::zeros(),
            residuals: [0.0; 6],
        };
        body.respond(base)?;
        Ok(body)
    }

    /// Solves for the loads `M R`.
    fn respond(&mut self, base: &Base) -> Result<(), CondensedError> {
        let (n, unknown) = (self.vertices.len(), base.partition.unknown());
        let mut loads = vec![0.0; 6 * unknown.len()];
        for (motion, load) in loads.chunks_exact_mut(unknown.len()).enumerate() {
            for (load, &dof) in load.iter_mut().zip(unknown) {
                let (node, axis) = (dof as usize / 3, dof as usize % 3);
                *load = self.volumes[node] * self.motions(node)[(axis, motion)];
            }
        }
        let answers = base.inverse.solve(base.held_system(), loads.clone())?;
        let asked = loads.chunks_exact(unknown.len());
        for ((residual, answer), asked) in self.residuals.iter_mut().zip(&answers).zip(asked) {
            let forces = base.stiffness.mul(&answer.field);
            let left = unknown.iter().zip(asked);
            *residual =
                left.map(|(&dof, load)| (load - forces[dof as usize]).powi(2)).sum::<f64>().sqrt();
        }
        let mut response = vec![Matrix3x6::zeros(); n];
        for (motion, answer) in answers.iter().enumerate() {
            for (response, u) in response.iter_mut().zip(answer.field.as_chunks::<3>().0) {
                (0..3).for_each(|axis| response[(axis, motion)] = u[axis]);
            }
        }
        self.own = Matrix6::zeros();
        for (node, response) in response.iter().enumerate() {
            self.own += self.volumes[node] * self.motions(node).transpose() * response;
        }
        self.response = response;
        Ok(())
    }

    /// Volume at rest, m³.
    pub fn volume(&self) -> f64 {
        self.volume
    }

    /// Volume that each node stands for, m³.
    pub fn volumes(&self) -> &[f64] {
        &self.volumes
    }

    /// Centre of mass at rest.
    pub fn centre(&self) -> Point3<f64> {
        self.centre
    }

    /// Moments of inertia about the centre at a density of one, m⁵.
    pub fn inertia(&self) -> &Matrix3<f64> {
        &self.inertia
    }

    /// Moments of inertia about the centre in a deformed shape, at a density of one, m⁵.
    ///
    /// Shapes: `displacement` 3N.
    pub fn inertia_of(&self, displacement: &[f64]) -> Matrix3<f64> {
        let mut inertia = Matrix3::zeros();
        for ((v, rest), u) in
            self.volumes.iter().zip(&self.vertices).zip(displacement.chunks_exact(3))
        {
            let r = rest - self.centre + Vector3::from_column_slice(u);
            inertia += *v * (r.norm_squared() * Matrix3::identity() - r * r.transpose());
        }
        inertia
    }

    /// `Rᵀ M u`: the mean motion of a displacement field, mass by mass at a density of one.
    ///
    /// Shapes: `displacement` 3N.
    pub fn mean_motion(&self, displacement: &[f64]) -> Vector6<f64> {
        let mut mean = Vector6::zeros();
        for ((node, v), u) in self.volumes.iter().enumerate().zip(displacement.chunks_exact(3)) {
            let u = Vector3::from_column_slice(u);
            let turned = (self.vertices[node] - self.centre).cross(&u);
            mean.fixed_rows_mut::<3>(0).add_assign(*v * u);
            mean.fixed_rows_mut::<3>(3).add_assign(*v * turned);
        }
        mean
    }

    /// The columns of `M R`: loads that accelerate the body as a rigid one, 3N each.
    pub fn mean_loads(&self) -> Vec<Vec<f64>> {
        let load = |motion: usize| {
            let of_node = |(node, v): (usize, &f64)| {
                let along = self.motions(node).column(motion) * *v;
                [along[0], along[1], along[2]]
            };
            self.volumes.iter().enumerate().flat_map(of_node).collect()
        };
        (0..6).map(load).collect()
    }

    /// Forces at all nodes less the columns of `M R` that leave a deformed shape without a resultant
    /// force and torque.
    ///
    /// Shapes: `forces` and `displacement` 3N. Units: N, m.
    pub fn balanced(&self, forces: &mut [f64], displacement: &[f64]) {
        let (mut sum, mut carried) = (Vector6::zeros(), Matrix6::zeros());
        for (node, (f, u)) in forces.chunks_exact(3).zip(displacement.chunks_exact(3)).enumerate() {
            let r = self.vertices[node] - self.centre + Vector3::from_column_slice(u);
            let mut here = Matrix3x6::zeros();
            here.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
            here.fixed_view_mut::<3, 3>(0, 3).copy_from(&-r.cross_matrix());
            sum += here.transpose() * Vector3::from_column_slice(f);
            carried += self.volumes[node] * here.transpose() * self.motions(node);
        }
        let Some(acceleration) = carried.lu().solve(&sum) else { return };
        for (node, f) in forces.chunks_exact_mut(3).enumerate() {
            let inertia = self.volumes[node] * self.motions(node) * acceleration;
            f.iter_mut().zip(inertia.iter()).for_each(|(f, i)| *f -= i);
        }
    }

    /// Bytes of the responses.
    pub fn bytes(&self) -> usize {
        self.vertices.len() * (size_of::<Matrix3x6<f64>>() + size_of::<Point3<f64>>() + 8)
    }

    /// Rigid motions at a node: three translations, three rotations about the centre of mass.
    fn motions(&self, node: usize) -> Matrix3x6<f64> {
        let r = self.vertices[node] - self.centre;
        let mut motions = Matrix3x6::zeros();
        motions.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
        motions.fixed_view_mut::<3, 3>(0, 3).copy_from(&-r.cross_matrix());
        motions
    }

    /// Acceleration of the body per force at a node, at a density of one.
    fn acceleration(&self, node: usize) -> Matrix6x3<f64> {
        self.inverse * self.motions(node).transpose()
    }

    /// Norm of what the response to inertia leaves of the balance under some forces, N.
    pub(super) fn residual(&self, forces: &[(u32, Vector3<f64>)]) -> f64 {
        let mut acceleration = Vector6::zeros();
        for (node, force) in forces {
            acceleration += self.acceleration(*node as usize) * force;
        }
        acceleration.iter().zip(&self.residuals).map(|(a, r)| a.abs() * r).sum()
    }

    /// What inertia takes from the held compliance between points of the body: for a point the sum
    /// over its nodes, weighted, of accelerations and responses.
    ///
    /// Shapes: `nodes` and `weights` of a point. Frame: the object's.
    pub fn relief_of(&self, nodes: &[u32; 3], weights: &[f64; 3]) -> Relief {
        let mut relief = Relief {
            acceleration: Matrix6x3::zeros(),
            response: Matrix3x6::zeros(),
            left: Matrix6x3::zeros(),
        };
        for (&node, &weight) in nodes.iter().zip(weights) {
            if weight != 0.0 {
                relief.acceleration += weight * self.acceleration(node as usize);
                relief.response += weight * self.response[node as usize];
            }
        }
        relief.left = self.own * relief.acceleration - relief.response.transpose();
        relief
    }

    /// The change of the compliance between two points by inertia: what is added to the held one.
    ///
    /// Units: m/N. Shapes: rows displacement at `a`, columns force at `b`.
    pub fn relieved(a: &Relief, b: &Relief) -> Matrix3<f64> {
        let ([a_first, a_second], [b_first, b_second]) = (a.rows(), b.columns());
        a_first * b_first + a_second * b_second
    }

    /// Displacement of node `a` under a unit force along each axis at the node of some columns.
    ///
    /// Units: m/N. Frame: the object's.
    #[cfg(test)]
    fn compliance(&self, a: usize, columns: &ContactColumns, b: usize) -> Matrix3<f64> {
        let held = Matrix3::from_fn(|r, c| columns.fields[c][3 * a + r]);
        let (of_a, of_b) = (self.acceleration(a), self.acceleration(b));
        held - self.response[a] * of_b - of_a.transpose() * self.response[b].transpose()
            + of_a.transpose() * self.own * of_b
    }

    /// What inertia adds to the displacement of some nodes under the sum of forces.
    ///
    /// Shapes: `forces` node and force; `nodes` and `displacement` in one order, `displacement` holds
    /// that of the held body. Units: N, m.
    pub(super) fn relieve(
        &self,
        forces: &[(u32, Vector3<f64>)],
        nodes: &[u32],
        displacement: &mut [[f64; 3]],
    ) {
        let mut acceleration = Vector6::zeros();
        let mut answered = Vector6::zeros();
        for (node, force) in forces {
            acceleration += self.acceleration(*node as usize) * force;
            answered += self.response[*node as usize].transpose() * force;
        }
        let mean = self.inverse * (answered - self.own * acceleration);
        let relieve = |(u, &node): (&mut [f64; 3], &u32)| {
            let node = node as usize;
            let change = self.response[node] * acceleration + self.motions(node) * mean;
            (0..3).for_each(|axis| u[axis] -= change[axis]);
        };
        // Other threads are asked only where that costs less than the work.
        match nodes.len() > NODES_ALONE {
            true => displacement.par_iter_mut().zip(nodes).for_each(relieve),
            false => displacement.iter_mut().zip(nodes).for_each(relieve),
        }
    }
}

/// Nodes that one thread relieves by itself.
const NODES_ALONE: usize = 1024;

impl Relief {
    /// That of a compliance which is the free body's already.
    pub fn none() -> Self {
        Self {
            acceleration: Matrix6x3::zeros(),
            response: Matrix3x6::zeros(),
            left: Matrix6x3::zeros(),
        }
    }
}

impl Relief {
    /// Displacement of the point by what inertia takes from the compliance, as the product of two factors:
    /// those of the row.
    pub fn rows(&self) -> [Matrix3x6<f64>; 2] {
        [self.acceleration.transpose(), -self.response]
    }

    /// Those of the column, for a force at the point.
    pub fn columns(&self) -> [Matrix6x3<f64>; 2] {
        [self.left, self.acceleration]
    }
}

/// How inertia answers a force at a point, and how the held body answers inertia there.
#[derive(Clone, Copy, Debug)]
pub struct Relief {
    /// Acceleration of the rigid body per force, at a density of one.
    acceleration: Matrix6x3<f64>,
    /// Displacement of the point under `M R`, held.
    response: Matrix3x6<f64>,
    /// What the mean of the displacements leaves of both: `Rᵀ M K⁻ M R` times the acceleration, less the
    /// response.
    left: Matrix6x3<f64>,
}

#[cfg(test)]
mod tests {
    use super::super::{Columns, Contact};
    use super::*;
    use crate::fem::{Element, Material};
    use crate::mesh::{BuiltIn, generate};
    use crate::model::Model;

    fn sphere() -> (Model, Base) {
        let mesh = generate(BuiltIn::Sphere, 200).unwrap();
        let material = Material::try_new(2.0e4, 0.4).unwrap();
        let model = Model::try_new(mesh, Element::Tet4, &[material], vec![], &mut |_| {}).unwrap();
        let base = model.condense(None, &mut |_| {}).unwrap();
        (model, base)
    }

    /// The whole field under some forces, by the free body and its columns.
    fn field(body: &FreeBody, base: &Base, forces: &[(u32, Vector3<f64>)]) -> Vec<[f64; 3]> {
        let contacts: Vec<Contact> = forces.iter().map(|(n, _)| Contact::Node(*n)).collect();
        let columns = Columns::new(usize::MAX).of_contacts(base, &contacts).unwrap();
        let nodes: Vec<u32> = (0..base.dof_count() as u32 / 3).collect();
        let mut u = vec![[0.0; 3]; nodes.len()];
        for (columns, (_, force)) in columns.iter().zip(forces) {
            for (node, u) in u.iter_mut().enumerate() {
                for axis in 0..3 {
                    u[axis] +=
                        (0..3).map(|c| force[c] * columns.fields[c][3 * node + axis]).sum::<f64>();
                }
            }
        }
        body.relieve(forces, &nodes, &mut u);
        u
    }

    #[test]
    fn displacement_balances_the_load_less_inertia_and_has_no_mean_motion() {
        let (model, base) = sphere();
        let body = FreeBody::try_new(model.spread_loads(), &base).unwrap();
        let forces = [(7, Vector3::new(0.3, -1.0, 0.2)), (100, Vector3::new(0.1, 0.5, -0.7))];
        let u = field(&body, &base, &forces);
        let flat: Vec<f64> = u.iter().flatten().copied().collect();
        let elastic = base.forces_of(&flat);
        // Mass times the acceleration of the rigid body under the same forces.
        let total: Vector3<f64> = forces.iter().map(|(_, f)| f).sum();
        let arm = |node: usize| model.mesh().vertices()[node] - body.centre();
        let torque: Vector3<f64> = forces.iter().map(|(n, f)| arm(*n as usize).cross(f)).sum();
        let turning = body.inertia().try_inverse().unwrap() * torque;
        let volumes = model.spread_loads().nodal_volumes();
        let (mut mean, mut turned) = (Vector3::zeros(), Vector3::zeros());
        for node in 0..u.len() {
            let acceleration = total / body.volume() + turning.cross(&arm(node));
            let applied: Vector3<f64> =
                forces.iter().filter(|(n, _)| *n as usize == node).map(|(_, f)| f).sum();
            let balance = applied - volumes[node] * acceleration;
            for axis in 0..3 {
                assert!((elastic[3 * node + axis] - balance[axis]).abs() < 1e-10);
            }
            mean += volumes[node] * Vector3::from(u[node]);
            turned += volumes[node] * arm(node).cross(&Vector3::from(u[node]));
        }
        let size = u.iter().map(|u| Vector3::from(*u).norm()).fold(0.0, f64::max);
        assert!(mean.norm() < 1e-10 * size * body.volume(), "{mean}");
        assert!(turned.norm() < 1e-10 * size * body.volume(), "{turned}");
    }

    #[test]
    fn compliance_of_two_nodes_is_the_field_there_and_symmetric() {
        let (model, base) = sphere();
        let body = FreeBody::try_new(model.spread_loads(), &base).unwrap();
        let columns = Columns::new(usize::MAX);
        let contacts = [Contact::Node(3), Contact::Node(90)];
        let columns = columns.of_contacts(&base, &contacts).unwrap();
        let ab = body.compliance(3, &columns[1], 90);
        let ba = body.compliance(90, &columns[0], 3);
        assert!((ab - ba.transpose()).norm() < 1e-10 * ab.norm());
        let force = Vector3::new(0.2, 0.5, -0.3);
        let u = field(&body, &base, &[(90, force)]);
        assert!((ab * force - Vector3::from(u[3])).norm() < 1e-12 * force.norm() * ab.norm());
    }

    #[test]
    fn body_that_the_scene_holds_is_not_free() {
        let mesh = generate(BuiltIn::Cube, 27).unwrap();
        let material = Material::try_new(1.0e5, 0.3).unwrap();
        let fixed = [0, 1, 2, 15, 16, 17, 24, 25, 26].to_vec();
        let model = Model::try_new(mesh, Element::Tet4, &[material], fixed, &mut |_| {}).unwrap();
        let base = model.condense(None, &mut |_| {}).unwrap();
        let refused = FreeBody::try_new(model.spread_loads(), &base).err();
        assert_eq!(refused, Some(CondensedError::NotFree { motions: 0 }));
    }
}
