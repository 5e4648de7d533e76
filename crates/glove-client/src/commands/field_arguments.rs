//! `--fields`: which fields of strain, stress, energy and contact a VTU file holds.

use std::path::{Path, PathBuf};

use anyhow::bail;
use clap::Args;
use softgrasp_core::mesh::TetMesh;
use softgrasp_protocol::{Field, FieldPlace, FieldSet};

/// What `--fields` names.
#[derive(Args, Clone, Debug, Default)]
pub struct FieldArguments {
    /// Fields in .vtu files, of elements and of nodes: stress, von_mises, strain, energy, error (estimated
    /// error of the stress), pressure and force (of contact), all, or none; several separated by
    /// commas [default: all].
    #[arg(long, value_name = "NAMES", value_parser = parse)]
    fields: Option<Chosen>,
}

/// Set of the named fields.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Chosen(FieldSet);

/// Largest number of values of fields that are written unasked; for a larger mesh only fields with one
/// number at each node or element are.
const VALUES_BY_DEFAULT: usize = 16 << 20;

/// Fields with one number at each node or element.
const SMALL: [Field; 5] = [
    Field::ElementVonMises,
    Field::NodeVonMises,
    Field::ElementEnergy,
    Field::ContactPressure,
    Field::ContactForce,
];

fn parse(text: &str) -> Result<Chosen, String> {
    let mut chosen = FieldSet::NONE;
    for name in text.split(',').map(str::trim) {
        let of_name: &[Field] = match name {
            "none" => &[],
            "all" => &Field::ALL,
            "stress" => &[Field::ElementStress, Field::NodeStress],
            "von_mises" | "von-mises" => &[Field::ElementVonMises, Field::NodeVonMises],
            "strain" => &[Field::ElementStrain, Field::NodeStrain],
            "energy" => &[Field::ElementEnergy, Field::NodeEnergyDensity],
            "error" => &[Field::ElementStressError, Field::NodeStressError],
            "pressure" => &[Field::ContactPressure],
            "force" => &[Field::ContactForce],
            _ => {
                return Err(format!(
                    "there is no field {name:?}; there are stress, von_mises, strain, energy, error, \
                     pressure, force, all and none"
                ));
            }
        };
        chosen = chosen.joined(of_name.iter().copied().collect());
    }
    Ok(Chosen(chosen))
}

/// Whether a file can contain fields.
pub fn is_vtu(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "vtu")
}

impl FieldArguments {
    /// Fields of an answer without contact, if one of the files can contain them.
    ///
    /// # Errors
    /// One line for named fields that no file can contain, or that only contact has.
    pub fn of_answer(&self, mesh: &TetMesh, outs: &[PathBuf]) -> anyhow::Result<FieldSet> {
        let elastic = |set: FieldSet| set.iter().filter(|field| !field.is_of_contact()).collect();
        self.check_files(outs.iter().any(|path| is_vtu(path)))?;
        Ok(match self.fields {
            _ if !outs.iter().any(|path| is_vtu(path)) => FieldSet::NONE,
            None => elastic(by_default(mesh)),
            Some(Chosen(set)) => {
                let of_contact: FieldSet = set.iter().filter(|f| f.is_of_contact()).collect();
                if !of_contact.is_empty() && set != all() {
                    bail!(
                        "--fields pressure and force are of contact; press has them, and --reactions \
                         are the forces that hold the body"
                    );
                }
                elastic(set)
            }
        })
    }

    /// Fields of a contact frame; `has_file`: whether a file can contain them.
    ///
    /// # Errors
    /// One line for named fields that no file can contain.
    pub fn of_contact(&self, mesh: &TetMesh, has_file: bool) -> anyhow::Result<FieldSet> {
        self.check_files(has_file)?;
        Ok(match self.fields {
            _ if !has_file => FieldSet::NONE,
            None => by_default(mesh),
            Some(Chosen(set)) => set,
        })
    }

    /// Whether an answer without contact should have fields.
    ///
    /// # Errors
    /// The same as those of [`FieldArguments::of_answer`].
    pub fn are_wanted(&self, mesh: &TetMesh, outs: &[PathBuf]) -> anyhow::Result<bool> {
        Ok(!self.of_answer(mesh, outs)?.is_empty())
    }

    fn check_files(&self, has_file: bool) -> anyhow::Result<()> {
        match self.fields {
            Some(Chosen(set)) if !set.is_empty() && !has_file => {
                bail!("--fields are written into .vtu files; name one with --out")
            }
            _ => Ok(()),
        }
    }
}

fn all() -> FieldSet {
    Field::ALL.into_iter().collect()
}

/// Fields that are written unasked: all, or on a large mesh those with one number.
fn by_default(mesh: &TetMesh) -> FieldSet {
    let values = |field: Field| match field.place() {
        FieldPlace::Elements => field.components() * mesh.tets().len(),
        FieldPlace::Nodes => field.components() * mesh.node_count(),
    };
    match Field::ALL.into_iter().map(values).sum::<usize>() <= VALUES_BY_DEFAULT {
        true => all(),
        false => SMALL.into_iter().collect(),
    }
}

#[cfg(test)]
mod tests {
    use softgrasp_core::mesh::{BuiltIn, generate};

    use super::*;

    fn arguments(text: &str) -> FieldArguments {
        FieldArguments { fields: Some(parse(text).unwrap()) }
    }

    #[test]
    fn names_are_both_of_elements_and_of_nodes() {
        let Chosen(set) = parse("stress, energy").unwrap();
        let fields: Vec<Field> = set.iter().collect();
        let known = [
            Field::ElementStress,
            Field::NodeStress,
            Field::ElementEnergy,
            Field::NodeEnergyDensity,
        ];
        assert_eq!(fields, known);
        assert_eq!(parse("none").unwrap(), Chosen(FieldSet::NONE));
        assert!(parse("stres").unwrap_err().contains("no field \"stres\""));
    }

    #[test]
    fn only_files_that_hold_fields_get_them() {
        let mesh = generate(BuiltIn::Cube, 27).unwrap();
        let of = |fields: FieldArguments, out: &str| {
            fields.of_answer(&mesh, &[PathBuf::from(out)]).map(FieldSet::bits)
        };
        assert_eq!(of(FieldArguments::default(), "U.csv").unwrap(), 0);
        assert_eq!(of(FieldArguments::default(), "U.vtu").unwrap(), (1 << 10) - 1);
        assert_eq!(of(arguments("none"), "U.csv").unwrap(), 0);
        assert!(of(arguments("stress"), "U.csv").is_err());
        assert!(of(arguments("pressure"), "U.vtu").is_err());
        assert_eq!(of(arguments("all"), "U.vtu").unwrap(), (1 << 10) - 1);
        let pressed = arguments("pressure").of_contact(&mesh, true).unwrap();
        assert_eq!(pressed.iter().collect::<Vec<_>>(), [Field::ContactPressure]);
    }
}
