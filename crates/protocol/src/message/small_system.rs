//! The small system of a step: the bodies that press, and the compliance between them.

use crate::limits::check_count;
use crate::payload::{PayloadReader, PayloadWriter, count_of};
use crate::{DecodeError, EncodeError};

/// How the forces of the bodies that press follow from where these bodies are, to first order about the
/// end of a step: a change δF of the forces moves the places that stick to the bodies by `C δF`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SmallSystem {
    /// One contact for each body that presses.
    pub contacts: Vec<BodyContact>,
    /// Compliance C, row by row, m/N, in the world frame: three rows and columns for each contact.
    pub compliance: Vec<f64>,
}

/// A body that presses on the object, as one force at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyContact {
    /// Position of the body in the request's list.
    pub body: u32,
    /// Position at which the force acts, m, in the world frame.
    pub place: [f64; 3],
    /// Unit normal out of the body, in the world frame.
    pub normal: [f64; 3],
    /// Force on the object, N, in the world frame.
    pub force: [f64; 3],
    /// Coefficient of friction.
    pub friction: f64,
}

/// Most contacts of a small system: what a hand and a table need thrice over.
const CONTACTS_MAX: u32 = 64;
/// Numbers that a contact takes in its array.
const CONTACT_NUMBERS: usize = 10;
const CONTACTS: &str = "bodies of the small system";
const COMPLIANCE: &str = "compliance of the small system";

impl SmallSystem {
    /// Number of contacts as it travels.
    ///
    /// # Errors
    /// [`EncodeError::CountMismatch`] if the compliance has another size.
    pub(super) fn count(&self) -> Result<u32, EncodeError> {
        let contacts = self.contacts.len();
        let (count, expected) = (self.compliance.len(), 9 * contacts * contacts);
        match count == expected {
            true => count_of(CONTACTS, contacts),
            false => Err(EncodeError::CountMismatch { what: COMPLIANCE, count, expected }),
        }
    }

    /// Writes names, numbers and compliance; nothing where nothing presses.
    pub(super) fn write_arrays(&self, writer: &mut PayloadWriter<'_>) {
        if self.contacts.is_empty() {
            return;
        }
        let bodies: Vec<u32> = self.contacts.iter().map(|contact| contact.body).collect();
        writer.array(&bodies);
        let numbers: Vec<f64> = self
            .contacts
            .iter()
            .flat_map(|c| [c.place, c.normal, c.force].into_iter().flatten().chain([c.friction]))
            .collect();
        writer.array(&numbers);
        writer.array(&self.compliance);
    }

    /// Reads what [`write_arrays`](Self::write_arrays) wrote.
    pub(super) fn read_arrays(
        reader: &mut PayloadReader<'_>,
        count: u32,
    ) -> Result<Self, DecodeError> {
        let count = check_count(CONTACTS, count, CONTACTS_MAX)?;
        if count == 0 {
            return Ok(Self::default());
        }
        let bodies: Vec<u32> = reader.array(CONTACTS, count)?;
        let numbers: Vec<f64> = reader.array(CONTACTS, CONTACT_NUMBERS * count)?;
        let compliance: Vec<f64> = reader.array(COMPLIANCE, 9 * count * count)?;
        let contacts = bodies.iter().zip(numbers.as_chunks::<CONTACT_NUMBERS>().0);
        let contacts = contacts.map(|(&body, n)| BodyContact {
            body,
            place: [n[0], n[1], n[2]],
            normal: [n[3], n[4], n[5]],
            force: [n[6], n[7], n[8]],
            friction: n[9],
        });
        Ok(Self { contacts: contacts.collect(), compliance })
    }
}
