//! Compliance of a body that nothing holds about a deformed shape: what a small change of the forces
//! changes in the shape.
//!
//! With K the tangent at the shape, R the six rigid motions of the body at rest and M the lumped masses
//! the change z of the shape under a change r of the forces solves
//!
//! ```text
//! [ K      M R ] [z]   [r]
//! [ Rᵀ M    0  ] [a] = [0]
//! ```
//!
//! so z has no mean motion, and a is the acceleration that balances r. At rest that is inertia relief.
//! K is factored with a few degrees of freedom held, and what holds them is taken out again.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::{DMatrix, DVector, Dyn, LU};
use rayon::prelude::*;

use super::base::Base;
use super::columns::{Columns, ContactColumns};
use super::error::CondensedError;
use super::free_body::FreeBody;
use super::held_inverse::CONTACTS_TOGETHER;
use super::touched::Contact;
use crate::fem::Stiffness;
use crate::solve::front::FrontFactor;
use crate::solve::vectors::dot;

/// A factor of the tangent at one shape of a free body, and the columns that were asked for.
///
/// Shapes: 3N numbers for a field; z degrees of freedom held, six in three dimensions.
pub struct FreeTangent {
    factor: FrontFactor<f64>,
    /// How the free degrees of freedom follow each held one.
    following: Vec<Vec<f64>>,
    /// What the held body answers to the six columns of `M R`.
    answered: Vec<Vec<f64>>,
    /// Motion of the held degrees of freedom and acceleration, from what the held body misses.
    small: LU<f64, Dyn, Dyn>,
    /// Whether every motion of the free body but the rigid ones takes energy.
    takes_energy: bool,
    kept: Mutex<BTreeMap<u32, Arc<ContactColumns>>>,
    /// Bytes that columns may take.
    bound: usize,
}

impl FreeTangent {
    /// Factors a tangent on the pattern of the base; columns take no more than `bound` bytes.
    ///
    /// # Errors
    /// [`CondensedError::NotPositiveDefinite`] where it has no factor, [`CondensedError::OutOfMemory`],
    /// [`CondensedError::NoFactor`] where memory was too short for that of the base.
    pub fn try_new(
        base: &Base,
        body: &FreeBody,
        tangent: &Stiffness,
        bound: usize,
    ) -> Result<Self, CondensedError> {
        let of_base = base.inverse.factor().ok_or(CondensedError::NoFactor)?;
        let factor = FrontFactor::try_new(of_base.analysis(), tangent)
            .map_err(|error| CondensedError::of_factor(error, &base.partition))?;
        let loads = body.mean_loads();
        let pulls: Vec<Vec<f64>> = base.held.iter().map(|&dof| column(tangent, dof)).collect();
        let both: Vec<&[f64]> = loads.iter().chain(&pulls).map(Vec::as_slice).collect();
        let mut solved = held_answers(base, &factor, &both);
        let mut following = solved.split_off(loads.len());
        for (field, &dof) in following.iter_mut().zip(&base.held) {
            field.iter_mut().for_each(|x| *x = -*x);
            field[dof as usize] = 1.0;
        }
        let z = following.len();
        let mut small = DMatrix::zeros(z + 6, z + 6);
        for (j, field) in following.iter().enumerate() {
            let forces = tangent.mul(field);
            for (i, &dof) in base.held.iter().enumerate() {
                small[(i, j)] = forces[dof as usize];
            }
            let mean = body.mean_motion(field);
            for axis in 0..6 {
                small[(z + axis, j)] = mean[axis];
                small[(j, z + axis)] = mean[axis];
            }
        }
        for (j, field) in solved.iter().enumerate() {
            let mean = body.mean_motion(field);
            (0..6).for_each(|axis| small[(z + axis, z + j)] = -mean[axis]);
        }
        let takes_energy = negative_eigenvalues(&small) <= 6;
        let (answered, small) = (solved, small.lu());
        Ok(Self { factor, following, answered, small, takes_energy, kept: Mutex::default(), bound })
    }

    /// Whether every motion of the free body but the rigid ones takes energy, so that each node yields to a
    /// force along it. A pressed body may have a factor while it is held, and none of that free.
    pub fn takes_energy(&self) -> bool {
        self.takes_energy
    }

    /// The change of the shape under a change of the forces at all nodes.
    ///
    /// Shapes: 3N. Units: N, m.
    pub fn apply(&self, base: &Base, body: &FreeBody, forces: &[f64]) -> Vec<f64> {
        let mut fields = held_answers(base, &self.factor, &[forces]);
        let mut field = fields.pop().unwrap_or_default();
        let pulled = self.following.iter().map(|follow| dot(follow, forces)).collect();
        self.free(body, &mut field, pulled);
        field
    }

    /// Takes out of the answer of the held body what holds it: `pulled` is the work of the forces along
    /// each way of following.
    fn free(&self, body: &FreeBody, field: &mut [f64], mut pulled: Vec<f64>) {
        pulled.extend(body.mean_motion(field).iter().map(|mean| -mean));
        let Some(found) = self.small.solve(&DVector::from_vec(pulled)) else {
            field.fill(f64::NAN);
            return;
        };
        let z = self.following.len();
        for (follow, &way) in self.following.iter().zip(found.iter()) {
            field.iter_mut().zip(follow).for_each(|(x, f)| *x += way * f);
        }
        for (answer, &pull) in self.answered.iter().zip(found.iter().skip(z)) {
            field.iter_mut().zip(answer).for_each(|(x, f)| *x -= pull * f);
        }
    }

    /// Columns of the compliance at some nodes, kept or computed now.
    ///
    /// # Errors
    /// [`CondensedError::CacheTooSmall`] if they alone are larger than the bound.
    pub(super) fn columns(
        &self,
        base: &Base,
        body: &FreeBody,
        nodes: &[u32],
    ) -> Result<Vec<Arc<ContactColumns>>, CondensedError> {
        let (each, bound) = (Columns::bytes_per_contact(base), self.bound);
        if nodes.len() * each > bound {
            let (contacts, needed) = (nodes.len(), nodes.len() * each);
            return Err(CondensedError::CacheTooSmall { contacts, needed, bound });
        }
        let missing: Vec<u32> = {
            let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
            nodes.iter().copied().filter(|node| !kept.contains_key(node)).collect()
        };
        let made = missing.chunks(CONTACTS_TOGETHER).flat_map(|some| self.made(base, body, some));
        let made: Vec<(u32, Arc<ContactColumns>)> =
            made.map(|(node, columns)| (node, Arc::new(columns))).collect();
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.extend(made);
        let found = nodes.iter().filter_map(|node| kept.get(node).cloned()).collect();
        // Those that a step holds live on with it.
        if kept.len() * each > bound {
            kept.clear();
        }
        Ok(found)
    }

    /// Bytes of the factor and the columns.
    pub fn bytes(&self, base: &Base) -> usize {
        let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner).len();
        let fields = self.following.len() + self.answered.len();
        self.factor.bytes()
            + kept * Columns::bytes_per_contact(base)
            + fields * 8 * base.dof_count()
    }

    fn made(&self, base: &Base, body: &FreeBody, nodes: &[u32]) -> Vec<(u32, ContactColumns)> {
        let unknown = base.partition.unknown();
        let rows: Vec<usize> = (0..unknown.len()).collect();
        let dofs =
            || nodes.iter().flat_map(|node| (0..3).map(move |axis| 3 * *node as usize + axis));
        let mut loads: Vec<Vec<(usize, f64)>> = dofs()
            .map(|dof| base.partition.row_of(dof).map(|row| (row, 1.0)).into_iter().collect())
            .collect();
        // As many as ever: the kernels sum in another order for another number of columns.
        loads.resize_with(3 * CONTACTS_TOGETHER, Vec::new);
        let solved = self.factor.solve_partial(&loads, &rows);
        let of_column = |(column, dof): (usize, usize)| {
            let mut field = vec![0.0; base.dof_count()];
            for (row, &unknown) in unknown.iter().enumerate() {
                field[unknown as usize] = solved[(row, column)];
            }
            let pulled = self.following.iter().map(|follow| follow[dof]).collect();
            self.free(body, &mut field, pulled);
            field
        };
        let columns: Vec<(usize, usize)> = dofs().enumerate().collect();
        let fields: Vec<Vec<f64>> = columns.into_par_iter().map(of_column).collect();
        let mut fields = fields.into_iter();
        let mut next = || fields.next().unwrap_or_default();
        nodes
            .iter()
            .map(|&node| {
                let fields = [next(), next(), next()];
                (node, ContactColumns::of_fields(Contact::Node(node), fields))
            })
            .collect()
    }
}

/// Negative eigenvalues of a symmetric matrix. By Sylvester's law of inertia those of the small system are six
/// where the tangent is positive definite on motions without a mean: the six accelerations.
fn negative_eigenvalues(matrix: &DMatrix<f64>) -> usize {
    // Metres and radians beside newtons: equal scales keep the signs of small ones.
    let size = matrix.diagonal().map(|x| x.abs().sqrt().max(f64::MIN_POSITIVE));
    let scaled = matrix.map_with_location(|i, j, x| x / (size[i] * size[j]));
    // What is no number has no sign, and no eigenvalues that a search for them ends at.
    match scaled.iter().all(|x| x.is_finite()) {
        true => scaled.symmetric_eigenvalues().iter().filter(|x| **x < 0.0).count(),
        false => scaled.nrows(),
    }
}

/// One column of a stiffness.
fn column(stiffness: &Stiffness, dof: u32) -> Vec<f64> {
    let mut unit = vec![0.0; 3 * stiffness.node_count()];
    unit[dof as usize] = 1.0;
    stiffness.mul(&unit)
}

/// What the held body answers to forces at all nodes, zero where it is held.
fn held_answers(base: &Base, factor: &FrontFactor<f64>, forces: &[&[f64]]) -> Vec<Vec<f64>> {
    let unknown = base.partition.unknown();
    let rows = forces.iter().flat_map(|f| unknown.iter().map(|&dof| f[dof as usize]));
    let mut solved: Vec<f64> = rows.collect();
    factor.solve_in_place(&mut solved, forces.len());
    let field = |solved: &[f64]| {
        let mut field = vec![0.0; base.dof_count()];
        base.partition.scatter_unknown(solved, &mut field);
        field
    };
    solved.chunks_exact(unknown.len().max(1)).map(field).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::hyperelastic::{Curvature, Law};
    use crate::fem::{Element, Material};
    use crate::mesh::{BuiltIn, generate};
    use crate::model::Model;

    #[test]
    fn change_of_a_deformed_shape_balances_the_change_of_forces_and_has_no_mean_motion() {
        let mesh = generate(BuiltIn::Sphere, 150).unwrap();
        let size = mesh.size();
        let material = Material::try_new(2.0e4, 0.4).unwrap();
        let model = Model::try_new(mesh, Element::Tet4, &[material], vec![], &mut |_| {}).unwrap();
        let base = model.condense(None, &mut |_| {}).unwrap();
        let body = FreeBody::try_new(model.spread_loads(), &base).unwrap();
        let elements = model.hyperelastic(Law::NeoHookean).unwrap();
        // Pressed by a hundredth, and bent.
        let u: Vec<f64> = model
            .mesh()
            .vertices()
            .iter()
            .flat_map(|p| [0.004 * p.x + p.z * p.z / size * 0.02, 0.004 * p.y, -0.01 * p.z])
            .collect();
        let pattern = model.stiffness().pattern();
        let tangent = elements.tangent(pattern, &u, Curvature::AsItIs);
        let free = FreeTangent::try_new(&base, &body, &tangent, usize::MAX).unwrap();
        let mut forces = vec![0.0; u.len()];
        (forces[21], forces[300], forces[301]) = (0.4, -1.0, 0.3);
        let z = free.apply(&base, &body, &forces);
        assert!(body.mean_motion(&z).amax() < 1e-12 * dot(&z, &z).sqrt());
        // What is left of the balance is a sum of the six columns of M R.
        let held = tangent.mul(&z);
        let left: Vec<f64> = forces.iter().zip(&held).map(|(f, k)| f - k).collect();
        let loads = DMatrix::from_columns(
            &body.mean_loads().into_iter().map(DVector::from_vec).collect::<Vec<_>>(),
        );
        let left = DVector::from_vec(left);
        let along = loads.clone().svd(true, true).solve(&left, 1e-14).unwrap();
        let off = (&left - &loads * along).norm();
        assert!(off < 1e-10, "{off:e} N of 1.1 N");
        // A column is the answer to one unit force.
        let columns = free.columns(&base, &body, &[7, 100]).unwrap();
        let sum: f64 = (0..u.len())
            .map(|dof| {
                let of_forces = 0.4 * columns[0].fields[0][dof] - columns[1].fields[0][dof]
                    + 0.3 * columns[1].fields[1][dof];
                (of_forces - z[dof]).powi(2)
            })
            .sum();
        assert!(sum.sqrt() < 1e-12 * dot(&z, &z).sqrt());
    }
}
