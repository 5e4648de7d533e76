//! Fields of strain, stress, energy and contact: which are wanted, and their arrays in an answer.

use std::fmt;

use wincode::{SchemaRead, SchemaWrite};

use crate::block::Block;
use crate::limits::check_count;
use crate::payload::{PayloadReader, PayloadWriter, count_of};
use crate::{DecodeError, EncodeError, Limits};

/// One field of an answer. A symmetric tensor has six components, `xx yy zz xy yz zx`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Field {
    /// Strain, mean over each element, relative.
    ElementStrain,
    /// Strain of each node, relative.
    NodeStrain,
    /// Cauchy's stress, mean over each element, Pa.
    ElementStress,
    /// Cauchy's stress of each node, Pa.
    NodeStress,
    /// Von Mises stress of each element, Pa.
    ElementVonMises,
    /// Von Mises stress of each node, Pa.
    NodeVonMises,
    /// Stored energy of each element, J.
    ElementEnergy,
    /// Stored energy at each node for each unit of volume at rest, J/m³.
    NodeEnergyDensity,
    /// Estimated error of the stress of each element, Pa.
    ElementStressError,
    /// Estimated error of the stress of each node, Pa.
    NodeStressError,
    /// Pressure of contact at each node, Pa.
    ContactPressure,
    /// Force of contact at each node, N.
    ContactForce,
}

/// Kind of entity that a field has a value for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldPlace {
    /// All elements of the mesh, in their order.
    Elements,
    /// The nodes that the answer is about, in its order.
    Nodes,
}

impl Field {
    /// All fields, in the order of their bits.
    pub const ALL: [Self; 12] = [
        Self::ElementStrain,
        Self::NodeStrain,
        Self::ElementStress,
        Self::NodeStress,
        Self::ElementVonMises,
        Self::NodeVonMises,
        Self::ElementEnergy,
        Self::NodeEnergyDensity,
        Self::ElementStressError,
        Self::NodeStressError,
        Self::ContactPressure,
        Self::ContactForce,
    ];

    /// Position of the field's bit in a [`FieldSet`].
    pub const fn bit(self) -> u32 {
        self as u32
    }

    /// Name of the field in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::ElementStrain | Self::NodeStrain => "strain",
            Self::ElementStress | Self::NodeStress => "stress",
            Self::ElementVonMises | Self::NodeVonMises => "von_mises",
            Self::ElementEnergy => "energy",
            Self::NodeEnergyDensity => "energy_density",
            Self::ElementStressError | Self::NodeStressError => "stress_error",
            Self::ContactPressure => "contact_pressure",
            Self::ContactForce => "contact_force",
        }
    }

    /// Unit of the field's values.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::ElementStrain | Self::NodeStrain => "1",
            Self::ElementEnergy => "J",
            Self::NodeEnergyDensity => "J/m³",
            Self::ContactForce => "N",
            _ => "Pa",
        }
    }

    /// Whether the field has values for elements or for nodes.
    pub const fn place(self) -> FieldPlace {
        match self {
            Self::ElementStrain
            | Self::ElementStress
            | Self::ElementVonMises
            | Self::ElementEnergy
            | Self::ElementStressError => FieldPlace::Elements,
            _ => FieldPlace::Nodes,
        }
    }

    /// Number of components of one value: 6 for a tensor, 3 for a vector, 1 for a scalar.
    pub const fn components(self) -> usize {
        match self {
            Self::ElementStrain | Self::NodeStrain | Self::ElementStress | Self::NodeStress => 6,
            Self::ContactForce => 3,
            _ => 1,
        }
    }

    /// Whether the field exists in answers to contact frames only.
    pub const fn is_of_contact(self) -> bool {
        matches!(self, Self::ContactPressure | Self::ContactForce)
    }
}

impl fmt::Display for Field {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let place = match self.place() {
            FieldPlace::Elements => "elements",
            FieldPlace::Nodes => "nodes",
        };
        write!(f, "{} of {place}", self.name())
    }
}

/// Set of fields, one bit for each; bits of fields that only a later version has are kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, SchemaRead, SchemaWrite)]
pub struct FieldSet(u32);

impl FieldSet {
    /// The set without a field.
    pub const NONE: Self = Self(0);

    /// Set with these bits; bits of unknown fields are kept.
    pub const fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    /// The bits of the set.
    pub const fn bits(self) -> u32 {
        self.0
    }

    /// Whether the set contains no field that this version knows.
    pub fn is_empty(self) -> bool {
        self.iter().next().is_none()
    }

    /// Whether the set contains a field.
    pub const fn has(self, field: Field) -> bool {
        self.0 & (1 << field.bit()) != 0
    }

    /// The set with one field added.
    #[must_use]
    pub const fn with(self, field: Field) -> Self {
        Self(self.0 | (1 << field.bit()))
    }

    /// Union of both sets.
    #[must_use]
    pub const fn joined(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// The fields of the set that this version knows, in the order of their bits.
    pub fn iter(self) -> impl Iterator<Item = Field> {
        Field::ALL.into_iter().filter(move |field| self.has(*field))
    }
}

impl FromIterator<Field> for FieldSet {
    fn from_iter<I: IntoIterator<Item = Field>>(fields: I) -> Self {
        fields.into_iter().fold(Self::NONE, Self::with)
    }
}

/// Values of the fields of one case.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldValues {
    /// Stored energy of the whole body, J.
    pub energy: f64,
    /// Estimated error of the stress in the energy norm, relative; NaN where no field of the error was
    /// asked for.
    pub error_rel: f64,
    /// Fields in the order of their bits, each with its values: the components of one element or node
    /// stand side by side.
    pub arrays: Vec<(Field, Vec<f64>)>,
}

impl FieldValues {
    /// Values of one field, if it was asked for.
    pub fn get(&self, field: Field) -> Option<&[f64]> {
        self.arrays.iter().find(|(own, _)| *own == field).map(|(_, values)| values.as_slice())
    }

    fn set(&self) -> FieldSet {
        self.arrays.iter().map(|(field, _)| *field).collect()
    }

    /// Number of elements that the fields have values for; 0 if there is no field of elements.
    fn element_count(&self) -> usize {
        let of_elements = |(field, _): &&(Field, Vec<f64>)| field.place() == FieldPlace::Elements;
        let first = self.arrays.iter().find(of_elements);
        first.map_or(0, |(field, values)| values.len() / field.components())
    }
}

/// Announces the arrays of the fields of an answer.
#[derive(Clone, Copy, Debug, SchemaRead, SchemaWrite)]
pub(super) struct FieldsPart {
    sent: FieldSet,
    element_count: u32,
}

const FIELDS: &str = "values of a field";
const FIELD_ELEMENTS: &str = "elements of fields";
/// Numbers that stand before the fields of each case: energy and relative error.
const TOTALS: usize = 2;

impl FieldsPart {
    /// Announcement for the fields of all cases; `None` if there are no fields.
    ///
    /// Shapes: `node_count` nodes that the answer is about, `case_count` cases, the first one among them.
    pub(super) fn of(
        fields: &[FieldValues],
        node_count: usize,
        case_count: usize,
    ) -> Result<Option<Block>, EncodeError> {
        let Some(first) = fields.first() else { return Ok(None) };
        let mismatch = |what, count, expected| EncodeError::CountMismatch { what, count, expected };
        if fields.len() != case_count {
            return Err(mismatch("fields of cases", fields.len(), case_count));
        }
        let (sent, element_count) = (first.set(), first.element_count());
        for (field, values) in fields.iter().flat_map(|case| &case.arrays) {
            let expected = field.components() * count_at(*field, node_count, element_count);
            if values.len() != expected {
                return Err(mismatch(FIELDS, values.len(), expected));
            }
        }
        for case in fields {
            let is_in_order = case.arrays.iter().map(|(field, _)| *field).eq(sent.iter());
            if !is_in_order {
                return Err(mismatch("fields of a case", case.arrays.len(), first.arrays.len()));
            }
        }
        let element_count = count_of(FIELD_ELEMENTS, element_count)?;
        Block::of(&Self { sent, element_count }).map(Some)
    }

    pub(super) fn check(&self, limits: &Limits) -> Result<(), DecodeError> {
        check_count(FIELD_ELEMENTS, self.element_count, limits.tet_count_max)?;
        let known: FieldSet = self.sent.iter().collect();
        match known == self.sent {
            true => Ok(()),
            false => Err(DecodeError::UnknownFields { bits: self.sent.bits() }),
        }
    }

    /// Reads the arrays that [`write_fields`] wrote; the counts have been checked.
    pub(super) fn read_arrays(
        self,
        reader: &mut PayloadReader<'_>,
        node_count: usize,
        case_count: usize,
    ) -> Result<Vec<FieldValues>, DecodeError> {
        let mut cases = Vec::new();
        for _ in 0..case_count {
            let totals: Vec<f64> = reader.array(FIELDS, TOTALS)?;
            let mut arrays = Vec::new();
            for field in self.sent.iter() {
                let count = count_at(field, node_count, self.element_count as usize);
                arrays.push((field, reader.array(FIELDS, field.components() * count)?));
            }
            cases.push(FieldValues { energy: totals[0], error_rel: totals[1], arrays });
        }
        Ok(cases)
    }
}

/// Writes for each case energy and relative error, then its fields in the order of their bits.
pub(super) fn write_fields(writer: &mut PayloadWriter<'_>, fields: &[FieldValues]) {
    for case in fields {
        writer.array(&[case.energy, case.error_rel]);
        for (_, values) in &case.arrays {
            writer.array(values);
        }
    }
}

/// Number of values of a field: that of the elements or of the nodes.
fn count_at(field: Field, node_count: usize, element_count: usize) -> usize {
    match field.place() {
        FieldPlace::Elements => element_count,
        FieldPlace::Nodes => node_count,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_count_up_and_sets_keep_what_they_do_not_know() {
        for (bit, field) in (0..).zip(Field::ALL) {
            assert_eq!(field.bit(), bit);
        }
        let set = FieldSet::from_bits(1 << 31 | 1 << 3);
        assert_eq!(set.iter().collect::<Vec<_>>(), [Field::NodeStress]);
        assert_eq!(set.bits(), 1 << 31 | 1 << 3);
        assert!(FieldSet::from_bits(1 << 31).is_empty());
    }

    #[test]
    fn arrays_of_another_length_are_not_sent() {
        let values = |len: usize| FieldValues {
            energy: 1.0,
            error_rel: f64::NAN,
            arrays: vec![
                (Field::ElementEnergy, vec![1.0; 5]),
                (Field::ContactForce, vec![2.0; len]),
            ],
        };
        assert!(FieldsPart::of(&[values(9)], 3, 1).unwrap().is_some());
        assert!(FieldsPart::of(&[values(8)], 3, 1).is_err());
        assert!(FieldsPart::of(&[values(9)], 3, 2).is_err(), "fields of one case of two");
        let mut other = values(9);
        other.arrays.pop();
        assert!(FieldsPart::of(&[values(9), other], 3, 2).is_err());
    }
}
