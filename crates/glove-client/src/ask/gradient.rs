//! A quantity of displacements and reactions as it is asked for, and tables of its derivatives.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use softgrasp_core::mesh::TetMesh;
use softgrasp_protocol::{DofValue, GradientValues, Quantity, QuantityTerm};

/// What a table calls a body of one material.
const WHOLE: &str = "all";

/// Tables of values by degree of freedom that tell a quantity J.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct QuantityTables {
    /// First derivatives by displacements, at zero displacement.
    pub by_displacements: Vec<DofValue>,
    /// Second derivatives by displacements, each by its own.
    pub by_squares: Vec<DofValue>,
    /// Derivatives by reactions, of known degrees of freedom.
    pub by_reactions: Vec<DofValue>,
}

impl QuantityTables {
    /// The quantity as it travels.
    pub fn quantity(&self, with_places: bool) -> Quantity {
        let mut terms: BTreeMap<u32, QuantityTerm> = BTreeMap::new();
        let mut term = |dof: u32, slope: f64, curvature: f64| {
            let own = terms.entry(dof).or_insert(QuantityTerm { dof, ..QuantityTerm::default() });
            own.slope += slope;
            own.curvature += curvature;
        };
        self.by_displacements.iter().for_each(|j| term(j.dof, j.value, 0.0));
        self.by_squares.iter().for_each(|j| term(j.dof, 0.0, j.value));
        let of_reaction =
            |j: &DofValue| QuantityTerm { dof: j.dof, slope: j.value, curvature: 0.0 };
        Quantity {
            of_displacements: terms.into_values().collect(),
            of_reactions: self.by_reactions.iter().map(of_reaction).collect(),
            with_places,
        }
    }
}

/// Table of the derivatives by every node: `fx,fy,fz` by a force on it where it is free, `ux,uy,uz` by its
/// displacement where that is prescribed; the other cells are empty.
pub fn table_of_nodes(gradient: &GradientValues) -> String {
    let known: BTreeMap<u32, f64> =
        gradient.by_known.iter().map(|known| (known.dof, known.value)).collect();
    let mut table = "node,fx,fy,fz,ux,uy,uz\n".to_owned();
    for (node, by_force) in (0u32..).zip(&gradient.by_forces) {
        let mut cells: [String; 6] = Default::default();
        for (axis, by_force) in (0..3).zip(by_force) {
            match known.get(&(3 * node + axis)) {
                None => cells[axis as usize] = format!("{by_force:e}"),
                Some(by_known) => cells[3 + axis as usize] = format!("{by_known:e}"),
            }
        }
        // Writing to a String cannot fail.
        let _ = writeln!(table, "{node},{}", cells.join(","));
    }
    table
}

/// Table of the derivatives by the place of every node at rest.
pub fn table_of_places(gradient: &GradientValues) -> String {
    let mut table = "node,x,y,z\n".to_owned();
    for (node, [x, y, z]) in gradient.by_places.iter().enumerate() {
        // Writing to a String cannot fail.
        let _ = writeln!(table, "{node},{x:e},{y:e},{z:e}");
    }
    table
}

/// Table of the derivatives by Young's modulus (per Pa) and Poisson's ratio of every region that has
/// elements, by its label, or of all of the body where it has one material.
pub fn table_of_materials(
    (mesh, labels): (&TetMesh, &[String]),
    gradient: &GradientValues,
) -> Vec<u8> {
    let regions: BTreeSet<u32> = match gradient.by_materials.len() {
        1 => BTreeSet::from([0]),
        _ => mesh.regions().iter().copied().collect(),
    };
    let mut table = csv::Writer::from_writer(Vec::new());
    // Writing to memory cannot fail.
    let _ = table.write_record(["region", "young", "poisson"]);
    for (region, slopes) in regions.iter().zip(&gradient.by_materials) {
        let [by_young, by_poisson] = slopes.map(|slope| format!("{slope:e}"));
        let number = region.to_string();
        let label = match gradient.by_materials.len() {
            1 => WHOLE,
            _ => labels.get(*region as usize).unwrap_or(&number),
        };
        let _ = table.write_record([label, &by_young, &by_poisson]);
    }
    table.into_inner().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use softgrasp_core::mesh::{BuiltIn, generate};

    use super::*;

    #[test]
    fn slopes_and_squares_of_one_displacement_are_one_term() {
        let value = |dof, value| DofValue { dof, value };
        let tables = QuantityTables {
            by_displacements: vec![value(4, 1.0), value(1, 2.0)],
            by_squares: vec![value(4, 3.0), value(7, 5.0)],
            by_reactions: vec![value(0, -1.0)],
        };
        let quantity = tables.quantity(true);
        let terms: Vec<(u32, f64, f64)> =
            quantity.of_displacements.iter().map(|t| (t.dof, t.slope, t.curvature)).collect();
        assert_eq!(terms, [(1, 2.0, 0.0), (4, 1.0, 3.0), (7, 0.0, 5.0)]);
        assert_eq!(quantity.of_reactions.len(), 1);
        assert!(quantity.with_places);
        assert!(QuantityTables::default().quantity(true).is_empty());
    }

    #[test]
    fn derivatives_stand_where_their_cause_is() {
        let gradient = GradientValues {
            by_forces: vec![[0.5, 0.0, -2.0], [1.0, 2.0, 3.0]],
            by_known: vec![DofValue { dof: 1, value: 8.0 }],
            by_places: vec![[1.0, 0.0, 0.5]],
            ..GradientValues::default()
        };
        let table = table_of_nodes(&gradient);
        assert_eq!(table, "node,fx,fy,fz,ux,uy,uz\n0,5e-1,,-2e0,,8e0,\n1,1e0,2e0,3e0,,,\n");
        assert_eq!(table_of_places(&gradient), "node,x,y,z\n0,1e0,0e0,5e-1\n");
    }

    #[test]
    fn materials_are_named_by_the_labels_of_their_regions() {
        let cube = generate(BuiltIn::Cube, 27).unwrap();
        let regions = (0..cube.tets().len() as u32).map(|tet| tet % 2).collect();
        let cube = TetMesh::try_new(cube.vertices().to_vec(), cube.tets().to_vec(), regions);
        let labels = ["stone, hard".to_owned(), "7".to_owned()];
        let of_two = vec![[1e-5, 0.5], [2e-5, -0.25]];
        let gradient = GradientValues { by_materials: of_two, ..GradientValues::default() };
        let table = table_of_materials((&cube.unwrap(), &labels), &gradient);
        let expected = "region,young,poisson\n\"stone, hard\",1e-5,5e-1\n7,2e-5,-2.5e-1\n";
        assert_eq!(String::from_utf8(table).unwrap(), expected);
    }
}
