//! A quantity whose derivatives are wanted, and the derivatives that an answer has.

use wincode::{SchemaRead, SchemaWrite};

use super::dof_value::DofValue;
use crate::block::Block;
use crate::limits::check_count;
use crate::payload::{PayloadReader, PayloadWriter, count_of};
use crate::{DecodeError, EncodeError, Limits};

/// One term `a x + ½ b x²` of a quantity, x being a displacement or a reaction along one axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct QuantityTerm {
    /// Number of the degree of freedom: `3 · node + axis`, axis 0 to 2.
    pub dof: u32,
    /// a, for each m or N.
    pub slope: f64,
    /// b, for each m² or N².
    pub curvature: f64,
}

/// A quantity J of displacements and reactions whose derivatives are wanted: the sum of its terms.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Quantity {
    /// Terms of displacements.
    pub of_displacements: Vec<QuantityTerm>,
    /// Terms of the forces that hold known degrees of freedom.
    pub of_reactions: Vec<QuantityTerm>,
    /// Whether derivatives by the places of nodes are wanted too.
    pub with_places: bool,
}

/// Derivatives of a quantity J by what the answer depends on.
///
/// Units: those of J for each N, m, Pa, m/s². Frame: that of the mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GradientValues {
    /// J at the answer.
    pub value: f64,
    /// By a force on each node of the mesh, in its order; where a displacement is known, its support
    /// carries the force.
    pub by_forces: Vec<[f64; 3]>,
    /// By each known displacement, in the order of the degrees of freedom.
    pub by_known: Vec<DofValue>,
    /// By Young's modulus and Poisson's ratio of each material, in the order of the materials.
    pub by_materials: Vec<[f64; 2]>,
    /// By the acceleration of the weight; `None` where there is no weight.
    pub by_acceleration: Option<[f64; 3]>,
    /// By each pressure, in the order of the question.
    pub by_pressures: Vec<f64>,
    /// By the place at rest of each node of the mesh; empty where nobody asked.
    pub by_places: Vec<[f64; 3]>,
}

/// Announces the arrays of a [`Quantity`].
#[derive(Clone, Copy, Debug, Default, SchemaRead, SchemaWrite)]
pub(super) struct QuantityPart {
    displacement_count: u32,
    reaction_count: u32,
    with_places: bool,
}

/// Announces the arrays of [`GradientValues`].
#[derive(Clone, Copy, Debug, SchemaRead, SchemaWrite)]
pub(super) struct GradientPart {
    value: f64,
    node_count: u32,
    known_count: u32,
    material_count: u32,
    pressure_count: u32,
    place_count: u32,
    by_acceleration: Option<[f64; 3]>,
}

const OF_DISPLACEMENTS: &str = "terms of displacements";
const OF_REACTIONS: &str = "terms of reactions";
const BY_FORCES: &str = "derivatives by forces";
const BY_KNOWN: &str = "derivatives by known displacements";
const BY_MATERIALS: &str = "derivatives by materials";
const BY_PRESSURES: &str = "derivatives by pressures";
const BY_PLACES: &str = "derivatives by places";

impl Quantity {
    /// Whether it has no term; then no derivatives are wanted, and nothing of it travels.
    pub fn is_empty(&self) -> bool {
        self.of_displacements.is_empty() && self.of_reactions.is_empty()
    }

    pub(super) fn part(&self) -> Result<QuantityPart, EncodeError> {
        Ok(QuantityPart {
            displacement_count: count_of(OF_DISPLACEMENTS, self.of_displacements.len())?,
            reaction_count: count_of(OF_REACTIONS, self.of_reactions.len())?,
            with_places: self.with_places,
        })
    }

    /// Writes the arrays: of the terms of displacements, then of those of reactions, degrees of freedom,
    /// slopes and curvatures.
    pub(super) fn write_arrays(&self, writer: &mut PayloadWriter<'_>) {
        for terms in [&self.of_displacements, &self.of_reactions] {
            writer.array(&terms.iter().map(|term| term.dof).collect::<Vec<u32>>());
            writer.array(&terms.iter().map(|term| term.slope).collect::<Vec<f64>>());
            writer.array(&terms.iter().map(|term| term.curvature).collect::<Vec<f64>>());
        }
    }

    /// Reads the arrays that [`write_arrays`](Self::write_arrays) wrote; the counts have been checked.
    pub(super) fn read_arrays(
        reader: &mut PayloadReader<'_>,
        part: QuantityPart,
    ) -> Result<Self, DecodeError> {
        let QuantityPart { displacement_count, reaction_count, with_places } = part;
        let of_displacements = read_terms(reader, OF_DISPLACEMENTS, displacement_count)?;
        let of_reactions = read_terms(reader, OF_REACTIONS, reaction_count)?;
        Ok(Self { of_displacements, of_reactions, with_places })
    }
}

fn read_terms(
    reader: &mut PayloadReader<'_>,
    what: &'static str,
    count: u32,
) -> Result<Vec<QuantityTerm>, DecodeError> {
    let count = count as usize;
    let dofs: Vec<u32> = reader.array(what, count)?;
    let slopes: Vec<f64> = reader.array(what, count)?;
    let curvatures: Vec<f64> = reader.array(what, count)?;
    let terms = dofs.into_iter().zip(slopes).zip(curvatures);
    Ok(terms.map(|((dof, slope), curvature)| QuantityTerm { dof, slope, curvature }).collect())
}

impl QuantityPart {
    pub(super) fn check(&self, limits: &Limits) -> Result<(), DecodeError> {
        check_count(OF_DISPLACEMENTS, self.displacement_count, limits.dof_count_max)?;
        check_count(OF_REACTIONS, self.reaction_count, limits.dof_count_max)?;
        Ok(())
    }
}

impl GradientValues {
    /// Whether all of them are finite numbers.
    pub fn is_finite(&self) -> bool {
        let Self { by_forces, by_materials, by_acceleration, by_pressures, by_places, .. } = self;
        let threes = by_forces.iter().chain(by_acceleration).chain(by_places);
        let known = self.by_known.iter().map(|known| &known.value);
        let others = by_materials.iter().flatten().chain(by_pressures).chain(known);
        self.value.is_finite() && threes.flatten().chain(others).all(|slope| slope.is_finite())
    }

    pub(super) fn block(&self) -> Result<Block, EncodeError> {
        Block::of(&GradientPart {
            value: self.value,
            node_count: count_of(BY_FORCES, self.by_forces.len())?,
            known_count: count_of(BY_KNOWN, self.by_known.len())?,
            material_count: count_of(BY_MATERIALS, self.by_materials.len())?,
            pressure_count: count_of(BY_PRESSURES, self.by_pressures.len())?,
            place_count: count_of(BY_PLACES, self.by_places.len())?,
            by_acceleration: self.by_acceleration,
        })
    }

    /// Writes the arrays: by forces, known displacements, materials, pressures, places.
    pub(super) fn write_arrays(&self, writer: &mut PayloadWriter<'_>) {
        writer.array(&self.by_forces);
        writer.dof_values(&self.by_known);
        writer.array(&self.by_materials);
        writer.array(&self.by_pressures);
        writer.array(&self.by_places);
    }
}

impl GradientPart {
    pub(super) fn check(&self, limits: &Limits) -> Result<(), DecodeError> {
        check_count(BY_FORCES, self.node_count, limits.node_count_max)?;
        check_count(BY_KNOWN, self.known_count, limits.dof_count_max)?;
        check_count(BY_MATERIALS, self.material_count, limits.material_count_max)?;
        check_count(BY_PRESSURES, self.pressure_count, limits.node_count_max)?;
        check_count(BY_PLACES, self.place_count, limits.node_count_max)?;
        Ok(())
    }

    /// Reads the arrays that [`GradientValues::write_arrays`] wrote; the counts have been checked.
    pub(super) fn read_arrays(
        self,
        reader: &mut PayloadReader<'_>,
    ) -> Result<GradientValues, DecodeError> {
        Ok(GradientValues {
            value: self.value,
            by_forces: reader.array(BY_FORCES, self.node_count as usize)?,
            by_known: reader.dof_values(BY_KNOWN, self.known_count as usize)?,
            by_materials: reader.array(BY_MATERIALS, self.material_count as usize)?,
            by_acceleration: self.by_acceleration,
            by_pressures: reader.array(BY_PRESSURES, self.pressure_count as usize)?,
            by_places: reader.array(BY_PLACES, self.place_count as usize)?,
        })
    }
}
