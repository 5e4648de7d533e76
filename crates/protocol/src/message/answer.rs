//! The answer to a request: displacements and forces of one case or several, and their report.

use wincode::{SchemaRead, SchemaWrite};

use super::dof_value::DofValue;
use super::fields::{FieldValues, FieldsPart, write_fields};
use super::gradient::{GradientPart, GradientValues};
use super::large::LargeReport;
use super::question::{NodeChoice, Precision};
use super::report::SolveReport;
use crate::block::Block;
use crate::limits::check_count;
use crate::payload::{PayloadReader, PayloadWriter, count_of};
use crate::{DecodeError, EncodeError, Limits};

/// Displacements of the nodes asked for, three components each, m, in the frame of the mesh.
#[derive(Clone, Debug, PartialEq)]
pub enum Displacements {
    /// Components in double precision, as computed, m.
    F64(Vec<[f64; 3]>),
    /// Components divided by `scale` and rounded to single precision.
    F32Quantised {
        /// Largest component in magnitude, m.
        scale: f64,
        /// Components divided by `scale`, within ±1.
        values: Vec<[f32; 3]>,
    },
}

/// Answer to an `Ask`: the first case, the report of all, and the further cases.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// Times of the stages, residual and error bound; with several cases the largest errors of all.
    pub report: SolveReport,
    /// Report of the equilibrium at large deformation; `None` where linear elasticity was asked for.
    pub large: Option<LargeReport>,
    /// Nodes that `displacements` belong to, in the same order.
    pub nodes: NodeChoice,
    /// Displacements of the first case, m.
    pub displacements: Displacements,
    /// Reaction forces at the known degrees of freedom, first case, N; empty if not asked for.
    pub reactions: Vec<DofValue>,
    /// Force on each mask, N, in the order of the question; empty if not asked for.
    pub mask_forces: Vec<[f64; 3]>,
    /// Answers of the further cases, in the order of the request.
    pub cases: Vec<CaseAnswer>,
    /// Fields of the first case and of each further one; empty if none were asked for.
    pub fields: Vec<FieldValues>,
    /// Derivatives of the quantity of the question; `None` where there was none, and in a contact frame.
    pub gradient: Option<GradientValues>,
}

/// Displacements and forces of one further case, always in double precision.
#[derive(Clone, Debug, PartialEq)]
pub struct CaseAnswer {
    /// Displacements of the same nodes as those of the first case, m.
    pub displacements: Vec<[f64; 3]>,
    /// Reaction forces at the same degrees of freedom as those of the first case, N.
    pub reactions: Vec<f64>,
}

/// Part of an [`Answer`], which announces its arrays.
#[derive(Clone, Debug, SchemaRead, SchemaWrite)]
pub(super) struct AnswerPart {
    report: Block,
    large: Option<Block>,
    listed: bool,
    precision: Precision,
    scale: f64,
    node_count: u32,
    reaction_count: u32,
    mask_force_count: u32,
    case_count: u32,
    fields: Option<Block>,
}

/// Fields of an [`Answer`] that came later; they are left out where there are no derivatives.
#[derive(Clone, Debug, Default, SchemaRead, SchemaWrite)]
struct LaterPart {
    gradient: Option<Block>,
}

/// All fields of an [`Answer`].
#[derive(Clone, Debug, SchemaRead, SchemaWrite)]
struct WholePart {
    answer: AnswerPart,
    later: LaterPart,
}

impl Displacements {
    /// Displacements in the form in which they travel, by the precision asked for.
    ///
    /// Units: m. With [`Precision::F32Quantised`] each component is off by at most 2⁻²⁴ of the
    /// largest one, since `|u / scale| ≤ 1` and single precision rounds to half of 2⁻²³. Where the
    /// largest is not a finite number or its inverse is not, nothing is divided that would only
    /// hide this: the values travel as they are.
    pub fn of(displacements: Vec<[f64; 3]>, precision: Precision) -> Self {
        if precision == Precision::F64 {
            return Self::F64(displacements);
        }
        let scale = displacements.iter().flatten().fold(0.0, |most: f64, u| most.max(u.abs()));
        let finite = displacements.iter().flatten().all(|u| u.is_finite());
        if !finite || (scale != 0.0 && !scale.recip().is_finite()) {
            return Self::F64(displacements);
        }
        let divisor = if scale == 0.0 { 1.0 } else { scale };
        let values = displacements.iter().map(|u| u.map(|c| (c / divisor) as f32));
        Self::F32Quantised { scale, values: values.collect() }
    }

    /// Number of nodes that have a displacement here.
    pub fn node_count(&self) -> usize {
        match self {
            Self::F64(values) => values.len(),
            Self::F32Quantised { values, .. } => values.len(),
        }
    }

    /// Displacements in double precision, m, multiplied by the scale where they were quantised.
    pub fn into_f64(self) -> Vec<[f64; 3]> {
        match self {
            Self::F64(values) => values,
            Self::F32Quantised { scale, values } => {
                values.iter().map(|u| u.map(|c| f64::from(c) * scale)).collect()
            }
        }
    }
}

impl Answer {
    pub(super) fn part(&self) -> Result<AnswerPart, EncodeError> {
        let expected = self.displacements.node_count();
        let listed = match &self.nodes {
            NodeChoice::All => false,
            NodeChoice::Nodes(nodes) if nodes.len() == expected => true,
            NodeChoice::Nodes(nodes) => {
                let count = nodes.len();
                return Err(EncodeError::CountMismatch { what: "answered nodes", count, expected });
            }
        };
        let (precision, scale) = match self.displacements {
            Displacements::F64(_) => (Precision::F64, 1.0),
            Displacements::F32Quantised { scale, .. } => (Precision::F32Quantised, scale),
        };
        let of_first = (expected, self.reactions.len());
        if let Some((what, count, expected)) =
            self.cases.iter().find_map(|case| case.mismatch(of_first))
        {
            return Err(EncodeError::CountMismatch { what, count, expected });
        }
        Ok(AnswerPart {
            report: self.report.block()?,
            large: self.large.as_ref().map(Block::of).transpose()?,
            listed,
            precision,
            scale,
            node_count: count_of("displacements", expected)?,
            reaction_count: count_of(REACTIONS, self.reactions.len())?,
            mask_force_count: count_of(MASK_FORCES, self.mask_forces.len())?,
            case_count: count_of(CASES, self.cases.len())?,
            fields: FieldsPart::of(&self.fields, expected, 1 + self.cases.len())?,
        })
    }

    /// Writes the arrays: nodes if listed, displacements, reactions, forces of masks, the cases one by
    /// one, the fields case by case.
    pub(super) fn write_arrays(&self, writer: &mut PayloadWriter<'_>) {
        if let NodeChoice::Nodes(nodes) = &self.nodes {
            writer.array(nodes);
        }
        match &self.displacements {
            Displacements::F64(values) => writer.array(values),
            Displacements::F32Quantised { values, .. } => writer.array(values),
        }
        writer.dof_values(&self.reactions);
        writer.array(&self.mask_forces);
        for case in &self.cases {
            writer.array(&case.displacements);
            writer.array(&case.reactions);
        }
        write_fields(writer, &self.fields);
    }

    /// Reads the arrays that [`write_arrays`](Self::write_arrays) wrote; the counts have been checked.
    pub(super) fn read_arrays(
        reader: &mut PayloadReader<'_>,
        part: AnswerPart,
        limits: &Limits,
    ) -> Result<Self, DecodeError> {
        let report = SolveReport::read(&part.report, limits)?;
        let large = part.large.map(|block| block.read()).transpose()?;
        let announced: Option<FieldsPart> = part.fields.map(|block| block.read()).transpose()?;
        announced.iter().try_for_each(|fields| fields.check(limits))?;
        let count = part.node_count as usize;
        let nodes = if part.listed {
            NodeChoice::Nodes(reader.array("answered nodes", count)?)
        } else {
            NodeChoice::All
        };
        let displacements = match part.precision {
            Precision::F64 => Displacements::F64(reader.array("displacements", count)?),
            Precision::F32Quantised => {
                let values = reader.array("displacements", count)?;
                Displacements::F32Quantised { scale: part.scale, values }
            }
        };
        let reactions = reader.dof_values(REACTIONS, part.reaction_count as usize)?;
        let mask_forces = reader.array(MASK_FORCES, part.mask_force_count as usize)?;
        let numbers_per_case = count + reactions.len();
        if part.case_count > 0 && numbers_per_case == 0 {
            // Cases without a number take no bytes, so that any count of them would pass.
            let count = part.case_count;
            return Err(DecodeError::TooMany { what: CASES, count, count_max: 0 });
        }
        let mut cases = Vec::new();
        for _ in 0..part.case_count {
            cases.push(CaseAnswer {
                displacements: reader.array("displacements of a case", count)?,
                reactions: reader.array("reactions of a case", reactions.len())?,
            });
        }
        let fields = match announced {
            Some(fields) => fields.read_arrays(reader, count, 1 + cases.len())?,
            None => Vec::new(),
        };
        let gradient = None;
        Ok(Self {
            report,
            large,
            nodes,
            displacements,
            reactions,
            mask_forces,
            cases,
            fields,
            gradient,
        })
    }

    pub(super) fn write(&self, writer: &mut PayloadWriter<'_>) -> Result<(), EncodeError> {
        let answer = self.part()?;
        match &self.gradient {
            None => writer.part(&answer)?,
            Some(gradient) => {
                let later = LaterPart { gradient: Some(gradient.block()?) };
                writer.part(&WholePart { answer, later })?;
            }
        }
        self.write_arrays(writer);
        self.gradient.iter().for_each(|gradient| gradient.write_arrays(writer));
        Ok(())
    }

    pub(super) fn read(
        reader: &mut PayloadReader<'_>,
        limits: &Limits,
    ) -> Result<Self, DecodeError> {
        let (part, later): (AnswerPart, LaterPart) = reader.part_and_later()?;
        part.check(limits)?;
        let announced: Option<GradientPart> =
            later.gradient.map(|block| block.read()).transpose()?;
        announced.iter().try_for_each(|gradient| gradient.check(limits))?;
        let answer = Self::read_arrays(reader, part, limits)?;
        let gradient = announced.map(|gradient| gradient.read_arrays(reader)).transpose()?;
        Ok(Self { gradient, ..answer })
    }
}

impl AnswerPart {
    pub(super) fn check(&self, limits: &Limits) -> Result<(), DecodeError> {
        check_count("displacements", self.node_count, limits.node_count_max)?;
        check_count(REACTIONS, self.reaction_count, limits.dof_count_max)?;
        check_count(MASK_FORCES, self.mask_force_count, limits.dof_count_max)?;
        check_count(CASES, self.case_count, limits.dof_count_max)?;
        Ok(())
    }
}

impl CaseAnswer {
    /// Name of a list that differs in length from that of the first case, its length and the expected
    /// one.
    fn mismatch(&self, (nodes, reactions): (usize, usize)) -> Option<(&'static str, usize, usize)> {
        let lists = [
            ("displacements of a case", self.displacements.len(), nodes),
            ("reactions of a case", self.reactions.len(), reactions),
        ];
        lists.into_iter().find(|(_, count, expected)| count != expected)
    }
}

const CASES: &str = "cases";
const REACTIONS: &str = "reaction forces";
const MASK_FORCES: &str = "forces of masks";

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn quantised_displacements_are_off_by_at_most_a_part_in_2_pow_24(
            values in prop::collection::vec(prop::array::uniform3(-1e3..1e3_f64), 0..40),
            exponent in -290..290_i32,
        ) {
            let factor = 10_f64.powi(exponent);
            let exact: Vec<_> = values.iter().map(|u| u.map(|c| c * factor)).collect();
            let most = exact.iter().flatten().fold(0.0, |most: f64, c| most.max(c.abs()));
            let back = Displacements::of(exact.clone(), Precision::F32Quantised).into_f64();
            prop_assert_eq!(back.len(), exact.len());
            for (back, exact) in back.iter().flatten().zip(exact.iter().flatten()) {
                // One more rounding of double precision is made on each way.
                prop_assert!((back - exact).abs() <= most * (0.5_f64.powi(24) + 1e-15));
            }
        }
    }

    #[test]
    fn zero_displacements_stay_zero() {
        let quantised = Displacements::of(vec![[0.0; 3]; 2], Precision::F32Quantised);
        assert!(matches!(quantised, Displacements::F32Quantised { scale: 0.0, .. }));
        assert_eq!(quantised.into_f64(), [[0.0; 3]; 2]);
    }

    #[test]
    fn values_that_cannot_be_scaled_travel_as_they_are() {
        for odd in [f64::INFINITY, f64::MIN_POSITIVE / 16.0] {
            let sent = Displacements::of(vec![[odd, 0.0, -0.0]], Precision::F32Quantised);
            assert_eq!(sent, Displacements::F64(vec![[odd, 0.0, -0.0]]));
        }
        let sent = Displacements::of(vec![[f64::NAN, 1.0, 0.0]], Precision::F32Quantised);
        assert!(matches!(sent, Displacements::F64(values) if values[0][0].is_nan()));
    }
}
