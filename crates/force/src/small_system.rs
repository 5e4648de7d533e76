//! The newest small system of a grasp: how the places of a few contacts follow from their forces.

use nalgebra::{Cholesky, DMatrix, DVector, Isometry3, Point3, Vector3};

/// One rigid body that presses on the object: a resultant force at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmallContact {
    /// Position of the body among those of the step.
    pub body: u32,
    /// Port of the device that feels the contact; `None` for a body that no device moves.
    pub port: Option<usize>,
    /// Where the force acts, fixed to the body, m, in the body's frame.
    pub place_in_body: Point3<f64>,
    /// Where that was when the step ended, m, world.
    pub place: Point3<f64>,
    /// Unit normal out of the body, world.
    pub normal: Vector3<f64>,
    /// Force of the body on the object, N, world.
    pub force: Vector3<f64>,
    /// Coefficient of friction.
    pub friction: f64,
}

impl SmallContact {
    /// Where the contact is on a body that has moved, m, world.
    pub fn place_at(&self, world_from_body: &Isometry3<f64>) -> Point3<f64> {
        world_from_body * self.place_in_body
    }
}

/// The bodies that press, and the compliance between them: a small change of their forces F moves the
/// places that stick to them by `C δF`.
///
/// Shapes: m contacts; `C` 3m × 3m, symmetric, positive definite. Units: m/N. Frame: world.
#[derive(Clone, Debug, PartialEq)]
pub struct SmallSystem {
    contacts: Vec<SmallContact>,
    compliance: DMatrix<f64>,
}

/// Most contacts of a small system: the table, fifteen segments of fingers and the palm are 17.
pub const CONTACTS_MAX: usize = 32;

/// Why numbers make no small system.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SystemError {
    /// Sizes that do not fit each other.
    #[error("{contacts} contacts need {expected} rows, but the compliance has {rows}")]
    Sizes {
        /// Number of contacts.
        contacts: usize,
        /// Rows that the contacts need: three each.
        expected: usize,
        /// Rows of the compliance.
        rows: usize,
    },
    /// More contacts than a tick of a millisecond solves for.
    #[error("{contacts} bodies press at once, at most {max} can be felt")]
    TooMany {
        /// Number of contacts.
        contacts: usize,
        /// Largest number of contacts.
        max: usize,
    },
    /// A number that is not finite, a normal that is no unit vector, or a negative friction.
    #[error(
        "contact {contact} of the small system has a number that is not finite or out of range"
    )]
    Contact {
        /// Position of the contact, from 0.
        contact: usize,
    },
    /// A compliance that is not symmetric and positive definite.
    #[error("the compliance of the small system is not symmetric and positive definite")]
    Indefinite,
}

/// Share of its largest entry by which a compliance may be unsymmetric.
const ASYMMETRY_MAX: f64 = 1e-9;

impl SmallSystem {
    /// Shapes, units and frame as in [`SmallSystem`].
    ///
    /// # Errors
    /// [`SystemError`].
    pub fn try_new(
        contacts: Vec<SmallContact>,
        compliance: DMatrix<f64>,
    ) -> Result<Self, SystemError> {
        let (count, rows) = (contacts.len(), compliance.nrows());
        if count > CONTACTS_MAX {
            return Err(SystemError::TooMany { contacts: count, max: CONTACTS_MAX });
        }
        if rows != 3 * count || compliance.ncols() != rows {
            return Err(SystemError::Sizes { contacts: count, expected: 3 * count, rows });
        }
        if let Some(contact) = contacts.iter().position(|contact| !is_sound(contact)) {
            return Err(SystemError::Contact { contact });
        }
        let largest = compliance.iter().fold(0.0, |most: f64, c| most.max(c.abs()));
        let skew =
            (&compliance - compliance.transpose()).iter().fold(0.0, |m: f64, c| m.max(c.abs()));
        let is_symmetric = skew <= ASYMMETRY_MAX * largest && largest.is_finite();
        if !is_symmetric {
            return Err(SystemError::Indefinite);
        }
        let compliance = 0.5 * (&compliance + compliance.transpose());
        if Cholesky::new(compliance.clone()).is_none() {
            return Err(SystemError::Indefinite);
        }
        Ok(Self { contacts, compliance })
    }

    /// A system in which nothing presses.
    pub fn empty() -> Self {
        Self { contacts: Vec::new(), compliance: DMatrix::zeros(0, 0) }
    }

    /// The contacts, in the order of the compliance's rows.
    pub fn contacts(&self) -> &[SmallContact] {
        &self.contacts
    }

    /// Compliance C, 3m × 3m, m/N.
    pub fn compliance(&self) -> &DMatrix<f64> {
        &self.compliance
    }

    /// Forces of the contacts on the object one after the other, 3m, N.
    pub fn forces(&self) -> DVector<f64> {
        let forces = self.contacts.iter().flat_map(|contact| <[f64; 3]>::from(contact.force));
        DVector::from_iterator(3 * self.contacts.len(), forces)
    }

    /// Whether nothing presses.
    pub fn is_empty(&self) -> bool {
        self.contacts.is_empty()
    }
}

fn is_sound(contact: &SmallContact) -> bool {
    let numbers = [contact.place_in_body.coords, contact.place.coords, contact.force];
    let is_finite = numbers.iter().all(|v| v.iter().all(|x| x.is_finite()));
    // Written so that a NaN is refused too.
    let is_unit = (contact.normal.norm() - 1.0).abs() < 1e-6;
    is_finite && is_unit && contact.friction >= 0.0 && contact.friction.is_finite()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn contact() -> SmallContact {
        SmallContact {
            body: 1,
            port: Some(0),
            place_in_body: Point3::origin(),
            place: Point3::new(0.0, 0.0, 0.01),
            normal: -Vector3::z(),
            force: Vector3::new(0.0, 0.0, -1.0),
            friction: 0.5,
        }
    }

    #[test]
    fn numbers_that_make_no_system_are_refused() {
        let soft = DMatrix::identity(3, 3) * 1e-3;
        assert!(SmallSystem::try_new(vec![contact()], soft.clone()).is_ok());
        let refused = SmallSystem::try_new(vec![contact(); 2], soft.clone());
        assert!(matches!(refused, Err(SystemError::Sizes { rows: 3, expected: 6, .. })));
        for (name, broken) in [
            ("force", SmallContact { force: Vector3::repeat(f64::NAN), ..contact() }),
            ("normal", SmallContact { normal: Vector3::repeat(1.0), ..contact() }),
            ("friction", SmallContact { friction: -0.1, ..contact() }),
        ] {
            let refused = SmallSystem::try_new(vec![broken], soft.clone());
            assert_eq!(refused, Err(SystemError::Contact { contact: 0 }), "{name}");
        }
        for (name, matrix) in [
            ("negative", -soft.clone()),
            ("not finite", soft.map(|c| if c > 0.0 { f64::NAN } else { c })),
            ("unsymmetric", &soft + DMatrix::from_fn(3, 3, |r, c| if r < c { 1e-4 } else { 0.0 })),
        ] {
            let refused = SmallSystem::try_new(vec![contact()], matrix);
            assert_eq!(refused, Err(SystemError::Indefinite), "{name}");
        }
        let many = vec![contact(); CONTACTS_MAX + 1];
        let refused = SmallSystem::try_new(many, DMatrix::identity(99, 99));
        assert!(matches!(refused, Err(SystemError::TooMany { .. })));
    }
}
