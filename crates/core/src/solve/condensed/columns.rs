//! Columns of the compliance: computed when first needed, kept in a cache of bounded size.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;

use super::base::{Base, Block, SurfaceNodes};
use super::error::CondensedError;
use super::held_inverse::{CONTACTS_TOGETHER, HeldAnswer, Load};
use super::rounding::{rounding_of_product, settled};
use super::touched::Contact;
use crate::solve::vectors::norm;
use crate::solve::worked_out::WorkedOut;

/// Responses of the held shape to unit forces at one contact: on one node, or spread by a mask.
///
/// Units: m/N; residuals 1.
pub struct ContactColumns {
    /// The node or mask.
    pub contact: Contact,
    /// Displacement of every degree of freedom under a unit force along x, y, z; 3 × 3N.
    pub(super) fields: [Vec<f64>; 3],
    /// Displacements at the nodes of the surface, once a step of contact has asked for them.
    surface: WorkedOut<Vec<Block>>,
    pub(super) norms: [f64; 3],
    /// Norms of `e − K_B g` over the free degrees of freedom, as computed.
    pub(super) residuals: [f64; 3],
    /// Bounds on the same norms, rounding of the computation included.
    pub(super) residual_bounds: [f64; 3],
    /// Estimated norms of the errors that conjugate gradients left; zero by a factor.
    pub(super) errors: [f64; 3],
}

impl ContactColumns {
    /// Columns of another matrix than the base's, about whose errors nothing is kept.
    pub(super) fn of_fields(contact: Contact, fields: [Vec<f64>; 3]) -> Self {
        let norms = fields.each_ref().map(|field| norm(field));
        Self {
            contact,
            fields,
            surface: WorkedOut::default(),
            norms,
            residuals: [f64::NAN; 3],
            residual_bounds: [f64::NAN; 3],
            errors: [f64::NAN; 3],
        }
    }

    /// Displacements at the nodes of the surface, node by node; put together for the first who asks.
    ///
    /// Units: m/N.
    pub(super) fn surface(&self, nodes: &SurfaceNodes) -> &[Block] {
        self.surface.get_ref_or(|| nodes.blocks(self.fields.each_ref().map(Vec::as_slice)))
    }
}

/// Cache of columns under a memory bound, least recently used out first.
pub struct Columns {
    bound: usize,
    kept: Mutex<Kept>,
}

#[derive(Default)]
struct Kept {
    columns: BTreeMap<Contact, (u64, Arc<ContactColumns>)>,
    uses: u64,
    computed: u64,
}

impl Columns {
    /// An empty cache.
    ///
    /// Units: `bound` bytes.
    pub fn new(bound: usize) -> Self {
        Self { bound, kept: Mutex::default() }
    }

    /// Bytes that columns may take.
    pub fn bound(&self) -> usize {
        self.bound
    }

    /// Bytes the columns of one contact take at most.
    pub fn bytes_per_contact(base: &Base) -> usize {
        3 * 8 * base.dof_count() + base.surface.block_bytes()
    }

    /// Bytes held now.
    pub fn bytes(&self, base: &Base) -> usize {
        bytes_of(base, self.lock().columns.keys())
    }

    /// Drops all columns; they are computed again when they are asked for.
    pub fn clear(&self) {
        self.lock().columns.clear();
    }

    /// Contacts whose columns have been computed so far, repetitions counted.
    pub fn computed(&self) -> u64 {
        self.lock().computed
    }

    /// How many of some contacts have no column in the cache.
    pub fn missing(&self, contacts: impl IntoIterator<Item = Contact>) -> usize {
        let kept = self.lock();
        contacts.into_iter().filter(|contact| !kept.columns.contains_key(contact)).count()
    }

    /// Columns of some nodes or masks, from the cache or computed now on the current rayon pool.
    ///
    /// # Errors
    /// [`CondensedError::CacheTooSmall`] if they alone are larger than the bound.
    pub fn of_contacts(
        &self,
        base: &Base,
        contacts: &[Contact],
    ) -> Result<Vec<Arc<ContactColumns>>, CondensedError> {
        let needed = bytes_of(base, contacts);
        if needed > self.bound {
            let (contacts, bound) = (contacts.len(), self.bound);
            return Err(CondensedError::CacheTooSmall { contacts, needed, bound });
        }
        let missing: Vec<Contact> = {
            let kept = self.lock();
            contacts.iter().filter(|c| !kept.columns.contains_key(c)).cloned().collect()
        };
        // Computed without the lock: others may answer from the cache meanwhile.
        let made = compute(base, &missing)?;
        let mut kept = self.lock();
        kept.computed += missing.len() as u64;
        for columns in made {
            kept.columns.insert(columns.contact.clone(), (0, Arc::new(columns)));
        }
        kept.uses += 1;
        let now = kept.uses;
        let mut found = Vec::with_capacity(contacts.len());
        for contact in contacts {
            if let Some((used, columns)) = kept.columns.get_mut(contact) {
                *used = now;
                found.push(Arc::clone(columns));
            }
        }
        trim(&mut kept, base, self.bound);
        drop(kept);
        // Another thread may have trimmed what this one counted on; then it is computed again.
        if found.len() < contacts.len() {
            return Ok(compute(base, contacts)?.into_iter().map(Arc::new).collect());
        }
        Ok(found)
    }

    fn lock(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn bytes_of<'a>(base: &Base, contacts: impl IntoIterator<Item = &'a Contact>) -> usize {
    let each = Columns::bytes_per_contact(base);
    contacts.into_iter().map(|contact| each + contact.bytes()).sum()
}

/// Drops the columns unused for longest until no more than `bound` bytes are left.
fn trim(kept: &mut Kept, base: &Base, bound: usize) {
    let mut bytes = bytes_of(base, kept.columns.keys());
    if bytes <= bound {
        return;
    }
    let mut order: Vec<(u64, Contact)> =
        kept.columns.iter().map(|(contact, &(used, _))| (used, contact.clone())).collect();
    order.sort_unstable();
    for (_, contact) in order {
        if bytes <= bound {
            return;
        }
        kept.columns.remove(&contact);
        bytes -= bytes_of(base, [&contact]);
    }
}

fn compute(base: &Base, contacts: &[Contact]) -> Result<Vec<ContactColumns>, CondensedError> {
    let mut made = Vec::with_capacity(contacts.len());
    for some in contacts.chunks(CONTACTS_TOGETHER) {
        made.extend(compute_together(base, some)?);
    }
    Ok(made)
}

fn compute_together(
    base: &Base,
    contacts: &[Contact],
) -> Result<Vec<ContactColumns>, CondensedError> {
    let loads: Vec<Load> = contacts.iter().flat_map(|c| unit_loads(base, c)).collect();
    let solved = base.inverse.solve_contacts(base.held_system(), loads.clone())?;
    // Not refined: as they come, all columns are those of one matrix very near to K_B, so their
    // errors cancel in an answer; refined one by one they would be errors of their own, up to a
    // hundred times as large (docs/decisions.md).
    let fields: Vec<Field> = loads
        .par_iter()
        .zip(solved)
        .map(|(load, answer)| Field::check(base, load, answer))
        .collect();
    let mut fields = fields.into_iter();
    let of_contact = |contact: &Contact| {
        let [x, y, z] = [fields.next()?, fields.next()?, fields.next()?];
        Some(ContactColumns {
            contact: contact.clone(),
            surface: WorkedOut::default(),
            norms: [x.norm, y.norm, z.norm],
            residuals: [x.residual, y.residual, z.residual],
            residual_bounds: [x.residual_bound, y.residual_bound, z.residual_bound],
            errors: [x.error, y.error, z.error],
            fields: [x.field, y.field, z.field],
        })
    };
    Ok(contacts.iter().filter_map(of_contact).collect())
}

/// Unit forces at a contact along x, y and z. What acts on a degree of freedom of the base itself
/// moves nothing: it has no row.
fn unit_loads(base: &Base, contact: &Contact) -> [Load; 3] {
    let entries = contact.entries();
    [0, 1, 2].map(|axis| {
        let row = |node: u32| base.partition.row_of(3 * node as usize + axis);
        entries.iter().filter_map(|&(node, w)| row(node).map(|row| (row, w))).collect()
    })
}

/// One column and how well it solves its equations.
pub(super) struct Field {
    /// Displacement of every degree of freedom, 3N.
    pub field: Vec<f64>,
    pub norm: f64,
    /// Norm of `f − K_B g` over the free degrees of freedom, as computed.
    pub residual: f64,
    /// Bound on the same norm, rounding of the computation included.
    pub residual_bound: f64,
    /// Estimated norm of the error that conjugate gradients left; zero by a factor.
    pub error: f64,
}

impl Field {
    /// Shapes: `load` rows of `K_B` and forces, each row once; `answer` to it 3N.
    pub fn check(base: &Base, load: &[(usize, f64)], answer: HeldAnswer) -> Self {
        let HeldAnswer { field, error } = answer;
        let f = base.stiffness.mul(&field);
        let unknown = base.partition.unknown();
        let mut residual: Vec<f64> = unknown.iter().map(|&d| -f[d as usize]).collect();
        for &(row, weight) in load {
            residual[row] += weight;
        }
        let residual = norm(&residual);
        let residual_bound = settled(residual, rounding_of_product(&base.stiffness, &field));
        Self { norm: norm(&field), field, residual, residual_bound, error }
    }
}
