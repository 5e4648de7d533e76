//! The rows of the stiffness that a rank owns, with the bits that one machine gives them.

use std::sync::Arc;

use softgrasp_core::Material;
use softgrasp_core::TetMesh;
use softgrasp_core::fem::{
    Element, NodalPatches, Stiffness, StiffnessPattern, assemble, assemble_nodal_pressure,
};

use crate::part::Part;

/// Rows of a rank's own nodes, in the order of their numbers.
///
/// Shapes: row r has the blocks `start[r] .. start[r + 1]`; columns are positions in the part. Units: N/m.
pub struct Rows {
    /// First block of each row, and one more.
    pub start: Vec<u64>,
    /// Column of each block.
    pub columns: Vec<u32>,
    /// The blocks, 3 × 3, row by row.
    pub blocks: Vec<[f64; 9]>,
    /// Position in the part of each row's node.
    pub nodes: Vec<u32>,
}

/// A part that no mesh can be made of; rank 0 has checked the whole, so it was damaged on the way.
#[derive(Debug, thiserror::Error)]
#[error("the part of this rank cannot be assembled: {0}")]
pub struct DamagedPart(String);

impl Rows {
    /// Assembles a part; its mesh comes back too, and is `None` where the rank has nothing to do.
    ///
    /// # Errors
    /// [`DamagedPart`].
    pub fn assemble(part: &Part) -> Result<(Self, Option<TetMesh>), DamagedPart> {
        let damaged = |error: &dyn std::fmt::Display| DamagedPart(error.to_string());
        if part.tets.is_empty() {
            let (start, nodes) = (vec![0], Vec::new());
            return Ok((Self { start, columns: Vec::new(), blocks: Vec::new(), nodes }, None));
        }
        let mesh = TetMesh::try_new(part.points(), part.tets.clone(), part.regions.clone())
            .map_err(|error| damaged(&error))?;
        let materials: Vec<Material> = part
            .materials
            .iter()
            .map(|&[young, poisson]| Material::try_new(young, poisson))
            .collect::<Result<_, _>>()
            .map_err(|error| damaged(&error))?;
        let stiffness = match part.element() {
            Element::Tet4Anp => {
                let patches = NodalPatches::new(&mesh);
                let pattern = Arc::new(StiffnessPattern::nodal_pressure(&mesh, &patches));
                assemble_nodal_pressure(&pattern, &mesh, &patches, &materials)
            }
            _ => assemble(&Arc::new(StiffnessPattern::new(&mesh)), &mesh, &materials),
        }
        .map_err(|error| damaged(&error))?;
        Ok((Self::own(part, &stiffness), Some(mesh)))
    }

    fn own(part: &Part, stiffness: &Stiffness) -> Self {
        let mut rows =
            Self { start: vec![0], columns: Vec::new(), blocks: Vec::new(), nodes: Vec::new() };
        for at in part.own_positions() {
            for (column, block) in stiffness.row(at) {
                rows.columns.push(column as u32);
                rows.blocks.push(*block);
            }
            rows.start.push(rows.columns.len() as u64);
            rows.nodes.push(at as u32);
        }
        rows
    }

    /// `f − K q` on the rows, summed with what rounding loses.
    ///
    /// Shapes: `q` and `f` 3 for each node of the part, `f` also empty; the result 3 for each row.
    pub fn residual(&self, q: &[f64], f: &[f64]) -> Vec<f64> {
        let mut residual = Vec::with_capacity(3 * self.nodes.len());
        for (row, &node) in self.nodes.iter().enumerate() {
            let mut sums = [Sum::default(); 3];
            for (axis, sum) in sums.iter_mut().enumerate() {
                sum.add(f.get(3 * node as usize + axis).copied().unwrap_or(0.0));
            }
            for at in self.start[row] as usize..self.start[row + 1] as usize {
                let x = &q[3 * self.columns[at] as usize..][..3];
                for (r, sum) in sums.iter_mut().enumerate() {
                    (0..3).for_each(|c| sum.subtract_product(self.blocks[at][3 * r + c], x[c]));
                }
            }
            residual.extend(sums.map(|sum| sum.value + sum.lost));
        }
        residual
    }

    /// Sum of the diagonal entries.
    pub fn trace(&self) -> f64 {
        let own = |row: usize| {
            let range = self.start[row] as usize..self.start[row + 1] as usize;
            range.filter(move |&at| self.columns[at] == self.nodes[row])
        };
        let diagonal = (0..self.nodes.len()).flat_map(own);
        diagonal.map(|at| [0, 4, 8].map(|i| self.blocks[at][i]).iter().sum::<f64>()).sum()
    }

    /// A number that all bits of the rows and their places in the whole matrix decide; those of all ranks,
    /// joined by exclusive or, do not depend on who owns which row.
    pub fn digest(&self, part: &Part) -> u64 {
        let mut digest = 0;
        for (row, &node) in self.nodes.iter().enumerate() {
            let mut of_row = mixed(0x9e37_79b9_7f4a_7c15, u64::from(part.nodes[node as usize]));
            for at in self.start[row] as usize..self.start[row + 1] as usize {
                of_row = mixed(of_row, u64::from(part.nodes[self.columns[at] as usize]));
                of_row =
                    self.blocks[at].iter().fold(of_row, |sum, entry| mixed(sum, entry.to_bits()));
            }
            digest ^= of_row;
        }
        digest
    }
}

/// Sum in double precision with what its roundings lose.
#[derive(Clone, Copy, Default)]
struct Sum {
    value: f64,
    lost: f64,
}

impl Sum {
    fn add(&mut self, term: f64) {
        let sum = self.value + term;
        let of_term = sum - self.value;
        self.lost += (self.value - (sum - of_term)) + (term - of_term);
        self.value = sum;
    }

    fn subtract_product(&mut self, a: f64, b: f64) {
        let product = a * b;
        self.add(-product);
        self.lost -= a.mul_add(b, -product);
    }
}

/// A step of a hash.
fn mixed(state: u64, word: u64) -> u64 {
    let mixed = (state ^ word).wrapping_mul(0xff51_afd7_ed55_8ccd);
    mixed ^ (mixed >> 32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::part::Whole;
    use crate::partition::Numbering;
    use softgrasp_core::mesh::{BuiltIn, generate};
    use softgrasp_core::model::{Known, Model};

    fn parts(element: Element, ranks: usize) -> (Model, Vec<Part>) {
        let mesh = generate(BuiltIn::Strawberry, 600).unwrap();
        let regions: Vec<u32> = (0..mesh.tets().len() as u32).map(|tet| tet % 2).collect();
        let mesh =
            TetMesh::try_new(mesh.vertices().to_vec(), mesh.tets().to_vec(), regions).unwrap();
        let materials =
            [Material::try_new(1e4, 0.3).unwrap(), Material::try_new(3e4, 0.45).unwrap()];
        let known = Known { dofs: vec![], q_known: vec![] };
        let numbering = Numbering::new(mesh.vertices(), &mesh.used_nodes(), ranks);
        let whole =
            Whole { mesh: &mesh, element, materials: &materials, known: vec![&known], forces: &[] };
        let parts = (0..ranks).map(|rank| Part::cut(&whole, &numbering, rank)).collect();
        (Model::try_new(mesh.clone(), element, &materials, vec![], &mut |_| {}).unwrap(), parts)
    }

    #[test]
    fn rows_have_the_bits_of_one_machine_for_any_number_of_ranks() {
        for element in [Element::Tet4, Element::Tet4Anp] {
            for ranks in [1, 2, 4] {
                let (model, parts) = parts(element, ranks);
                let mut count = 0;
                for part in &parts {
                    let (rows, _) = Rows::assemble(part).unwrap();
                    for (row, &at) in rows.nodes.iter().enumerate() {
                        let node = part.nodes[at as usize] as usize;
                        let range = rows.start[row] as usize..rows.start[row + 1] as usize;
                        let blocks = range
                            .map(|at| (part.nodes[rows.columns[at] as usize], rows.blocks[at]));
                        let whole = model.stiffness().row(node);
                        let whole = whole.map(|(column, block)| (column as u32, *block));
                        assert!(blocks.eq(whole), "{element:?} on {ranks}: row {node}");
                        count += 1;
                    }
                }
                assert_eq!(count, model.modelled_dofs() / 3);
            }
        }
    }

    #[test]
    fn digest_does_not_depend_on_the_ranks_but_on_every_bit() {
        let digest = |ranks| {
            let (_, parts) = parts(Element::Tet4, ranks);
            parts.iter().fold(0, |sum, part| sum ^ Rows::assemble(part).unwrap().0.digest(part))
        };
        assert_eq!(digest(1), digest(3));
        let (_, parts) = parts(Element::Tet4, 1);
        let (mut rows, _) = Rows::assemble(&parts[0]).unwrap();
        rows.blocks[7][3] = f64::from_bits(rows.blocks[7][3].to_bits() ^ 1);
        assert_ne!(rows.digest(&parts[0]), digest(1));
    }

    #[test]
    fn residual_is_that_of_the_whole_matrix() {
        let (model, parts) = parts(Element::Tet4, 2);
        let q: Vec<f64> = (0..3 * model.mesh().node_count()).map(|i| (i as f64).sin()).collect();
        let whole = model.stiffness().mul(&q);
        let most = whole.iter().fold(0.0_f64, |most, f| most.max(f.abs()));
        for part in &parts {
            let (rows, _) = Rows::assemble(part).unwrap();
            let of = |v: &[f64]| -> Vec<f64> {
                part.nodes.iter().flat_map(|&n| v[3 * n as usize..][..3].to_vec()).collect()
            };
            let residual = rows.residual(&of(&q), &of(&whole));
            assert!(residual.iter().all(|r| r.abs() < 1e-13 * most));
            assert!(rows.trace() > 0.0);
        }
    }

    #[test]
    fn what_rounding_loses_is_kept() {
        let mut sum = Sum::default();
        sum.add(1e16);
        sum.add(1.0);
        sum.subtract_product(1e8, 1e8);
        assert_eq!(sum.value + sum.lost, 1.0);
    }
}
