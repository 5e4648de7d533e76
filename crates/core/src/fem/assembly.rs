//! The global stiffness matrix `kᵍ = Σ kᵉ` (thesis 3.36–3.39, 3.44–3.47).

use std::sync::Arc;

use rayon::prelude::*;

use super::{Material, NodalPatches, QuadraticMesh, StiffnessPattern, dof, tet4, tet10};
use crate::mesh::TetMesh;

/// Global stiffness `kᵍ` as 3 × 3 blocks on a [`StiffnessPattern`]; both triangles are stored.
///
/// Shapes: 3N × 3N. Units: N/m.
///
/// Source: thesis (3.39), (3.47).
#[derive(Clone, Debug)]
pub struct Stiffness {
    pattern: Arc<StiffnessPattern>,
    blocks: Vec<[f64; 9]>,
}

/// Materials that do not fit the mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum AssemblyError {
    /// A region label without a material.
    #[error("element {tet} has region {region}, but {materials} materials were given")]
    NoMaterial {
        /// Index of the element, from 0.
        tet: usize,
        /// Its region label.
        region: u32,
        /// Number of materials.
        materials: usize,
    },
}

/// Assembles the stiffness of a mesh into a prepared pattern; rows in parallel, same bits always.
///
/// Shapes: `pattern` that of the mesh; `materials` one for the whole mesh, or one per region label.
/// Units: mesh m, materials Pa, result N/m.
///
/// # Errors
/// [`AssemblyError::NoMaterial`] if a region label has none.
///
/// Source: thesis (3.39), section 3.5.2.
pub fn assemble(
    pattern: &Arc<StiffnessPattern>,
    mesh: &TetMesh,
    materials: &[Material],
) -> Result<Stiffness, AssemblyError> {
    let lame = LameByRegion::try_new(mesh.regions(), mesh.tets().len(), materials)?;
    let gradients = tet4::gradients_of(mesh.tets().len(), |t| mesh.corners(t));
    let blocks = assemble_rows(pattern, |tet, corner| {
        let (lambda, mu) = lame.of(tet);
        let block = |c| tet4::stiffness_block(&gradients[tet], corner, c, lambda, mu);
        [block(0), block(1), block(2), block(3)]
    });
    Ok(Stiffness { pattern: Arc::clone(pattern), blocks })
}

/// [`assemble`] for ten-node tetrahedra, on the pattern of [`StiffnessPattern::quadratic`]; curved ones by
/// four points.
///
/// Shapes: 3 for each node of `mesh`, square. Units: as there.
///
/// # Errors
/// [`AssemblyError::NoMaterial`] if a region label has no material.
///
/// Source: thesis (3.39), section 3.5.2; element stiffness of [`tet10`].
pub fn assemble_quadratic(
    pattern: &Arc<StiffnessPattern>,
    mesh: &QuadraticMesh,
    materials: &[Material],
) -> Result<Stiffness, AssemblyError> {
    let lame = LameByRegion::try_new(mesh.regions(), mesh.tets().len(), materials)?;
    if mesh.is_curved() {
        // The points of an element are worked out for each of its rows: kept, they would take more
        // memory than the stiffness.
        let blocks = assemble_rows(pattern, |tet, local| {
            let (lambda, mu) = lame.of(tet);
            mesh.points(tet).stiffness_row(local, lambda, mu)
        });
        return Ok(Stiffness { pattern: Arc::clone(pattern), blocks });
    }
    let gradients = tet4::gradients_of(mesh.tets().len(), |t| mesh.corners(t));
    let blocks = assemble_rows(pattern, |tet, local| {
        let (lambda, mu) = lame.of(tet);
        tet10::stiffness_row(&gradients[tet], local, lambda, mu)
    });
    Ok(Stiffness { pattern: Arc::clone(pattern), blocks })
}

/// [`assemble`] with the pressure averaged around each node, on the pattern of
/// [`StiffnessPattern::nodal_pressure`]: the change of shape by elements, then
/// `V_a κ gᵢ gⱼᵀ` of every patch.
///
/// Shapes and units: as there; `patches` those of the mesh.
///
/// # Errors
/// [`AssemblyError::NoMaterial`] if a region label has no material.
///
/// Source: [`NodalPatches`].
pub fn assemble_nodal_pressure(
    pattern: &Arc<StiffnessPattern>,
    mesh: &TetMesh,
    patches: &NodalPatches,
    materials: &[Material],
) -> Result<Stiffness, AssemblyError> {
    let lame = LameByRegion::try_new(mesh.regions(), mesh.tets().len(), materials)?;
    let gradients = tet4::gradients_of(mesh.tets().len(), |t| mesh.corners(t));
    let mut blocks = assemble_rows(pattern, |tet, corner| {
        // The deviator's energy is that of λ = −2μ/3.
        let (_, mu) = lame.of(tet);
        let block = |c| tet4::stiffness_block(&gradients[tet], corner, c, -2.0 / 3.0 * mu, mu);
        [block(0), block(1), block(2), block(3)]
    });
    for_each_row(pattern, &mut blocks, |node, row| {
        let columns = pattern.columns(node);
        for patch in patches.of_node(node) {
            let (lambda, mu) = lame.of(patch.tet);
            let bulk = lambda + 2.0 / 3.0 * mu;
            let own = patch.nodes.partition_point(|&n| (n as usize) < node);
            let of_own = patch.gradients[own] * (bulk * patch.volume);
            for (other, gradient) in patch.nodes.iter().zip(patch.gradients) {
                let block = &mut row[columns.partition_point(|c| c < other)];
                for (entry, (r, c)) in block.iter_mut().zip(ROWS_AND_COLUMNS) {
                    *entry += of_own[r] * gradient[c];
                }
            }
        }
    });
    Ok(Stiffness { pattern: Arc::clone(pattern), blocks })
}

/// Row and column of the nine entries of a block.
pub(super) const ROWS_AND_COLUMNS: [(usize, usize); 9] =
    [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (2, 0), (2, 1), (2, 2)];

/// Sums every block row over the elements around its node, in element order.
///
/// `element_row(tet, local)` gives the blocks of one row of an element's stiffness.
pub(super) fn assemble_rows<const K: usize>(
    pattern: &StiffnessPattern,
    element_row: impl Fn(usize, usize) -> [[f64; 9]; K] + Sync,
) -> Vec<[f64; 9]> {
    assert_eq!(pattern.nodes_per_tet(), K, "the pattern is that of another element");
    let mut blocks = vec![[0.0; 9]; pattern.block_count()];
    for_each_row(pattern, &mut blocks, |node, row| {
        for c in pattern.around::<K>(node) {
            for (&slot, added) in c.slots.iter().zip(element_row(c.tet, c.local)) {
                for (entry, term) in row[slot as usize].iter_mut().zip(added) {
                    *entry += term;
                }
            }
        }
    });
    blocks
}

/// Calls `fill(node, blocks of its row)` for every row, rows in parallel.
pub(super) fn for_each_row(
    pattern: &StiffnessPattern,
    blocks: &mut [[f64; 9]],
    fill: impl Fn(usize, &mut [[f64; 9]]) + Sync,
) {
    let mut rows = Vec::with_capacity(pattern.node_count());
    let mut rest = blocks;
    for node in 0..pattern.node_count() {
        let (row, tail) = rest.split_at_mut(pattern.row(node).len());
        rows.push(row);
        rest = tail;
    }
    rows.into_par_iter().enumerate().with_min_len(64).for_each(|(node, row)| fill(node, row));
}

/// `(λ, μ)` of every element; one material serves every label.
pub(super) struct LameByRegion<'a> {
    regions: &'a [u32],
    lame: Vec<(f64, f64)>,
}

impl<'a> LameByRegion<'a> {
    /// Makes sure that every region has a material.
    pub fn try_new(
        regions: &'a [u32],
        tet_count: usize,
        materials: &[Material],
    ) -> Result<Self, AssemblyError> {
        if materials.len() != 1 {
            let region = |tet: usize| regions.get(tet).copied().unwrap_or(0);
            if let Some(tet) = (0..tet_count).find(|&t| region(t) as usize >= materials.len()) {
                let materials = materials.len();
                return Err(AssemblyError::NoMaterial { tet, region: region(tet), materials });
            }
        }
        let lame = materials.iter().map(|m| (m.lame_lambda(), m.shear_modulus())).collect();
        Ok(Self { regions, lame })
    }

    fn of(&self, tet: usize) -> (f64, f64) {
        match self.lame.as_slice() {
            [only] => *only,
            several => several[self.regions.get(tet).map_or(0, |&r| r as usize)],
        }
    }
}

impl Stiffness {
    /// A matrix of blocks on their pattern.
    pub(super) fn of_blocks(pattern: &Arc<StiffnessPattern>, blocks: Vec<[f64; 9]>) -> Self {
        assert_eq!(blocks.len(), pattern.block_count(), "the blocks are those of another pattern");
        Self { pattern: Arc::clone(pattern), blocks }
    }

    /// Goes a share of the way to another stiffness.
    ///
    /// # Panics
    /// If it is of another pattern.
    pub fn blend(&mut self, other: &Self, share: f64) {
        assert_eq!(self.blocks.len(), other.blocks.len(), "blocks of one pattern");
        for (block, other) in self.blocks.iter_mut().zip(&other.blocks) {
            block.iter_mut().zip(other).for_each(|(a, b)| *a += share * (b - *a));
        }
    }

    /// Adds springs to the ground: `(degree of freedom, N/m)`.
    ///
    /// # Panics
    /// If a degree of freedom belongs to no element.
    pub fn add_springs(&mut self, springs: &[(u32, f64)]) {
        for &(dof, spring) in springs {
            let (node, axis) = (dof as usize / 3, dof as usize % 3);
            let columns = self.pattern.columns(node);
            let place =
                self.pattern.row(node).start + columns.partition_point(|&c| (c as usize) < node);
            self.blocks[place][4 * axis] += spring;
        }
    }

    /// The diagonal, 3N, N/m; zero for nodes that no element uses.
    pub fn diagonal(&self) -> Vec<f64> {
        let mut diagonal = vec![0.0; 3 * self.node_count()];
        for node in 0..self.node_count() {
            for (column, block) in self.row(node).filter(|(column, _)| *column == node) {
                (0..3).for_each(|axis| diagonal[3 * column + axis] = block[4 * axis]);
            }
        }
        diagonal
    }

    /// The pattern this matrix lives on.
    pub fn pattern(&self) -> &Arc<StiffnessPattern> {
        &self.pattern
    }

    /// Number of nodes, orphans included.
    pub fn node_count(&self) -> usize {
        self.pattern.node_count()
    }

    /// Blocks of one row: column node and 3 × 3 entries, row-major.
    pub fn row(&self, node: usize) -> impl Iterator<Item = (usize, &[f64; 9])> {
        let columns = self.pattern.columns(node).iter().map(|&c| c as usize);
        columns.zip(&self.blocks[self.pattern.row(node)])
    }

    /// Nodal forces `f = kᵍ q` (3.36).
    ///
    /// Shapes: `q` and the result 3N. Units: m, N.
    pub fn mul(&self, q: &[f64]) -> Vec<f64> {
        let mut f = vec![0.0; q.len()];
        self.mul_into(q, &mut f);
        f
    }

    /// [`Stiffness::mul`] into the caller's buffer; `q` and `f` must both hold 3N numbers.
    pub fn mul_into(&self, q: &[f64], f: &mut [f64]) {
        assert_eq!(q.len(), 3 * self.node_count(), "displacements do not fit the matrix");
        f.par_chunks_exact_mut(3).enumerate().with_min_len(256).for_each(|(node, f_node)| {
            let mut sum = [0.0; 3];
            for (column, b) in self.row(node) {
                let x = &q[dof(column, 0)..dof(column, 0) + 3];
                for (r, s) in sum.iter_mut().enumerate() {
                    *s += b[3 * r] * x[0] + b[3 * r + 1] * x[1] + b[3 * r + 2] * x[2];
                }
            }
            f_node.copy_from_slice(&sum);
        });
    }

    /// `|K| |q|` with absolute values of all entries: what rounding in a product is measured by.
    ///
    /// Shapes: `q` and the result 3N.
    pub fn mul_abs(&self, q: &[f64]) -> Vec<f64> {
        assert_eq!(q.len(), 3 * self.node_count(), "displacements do not fit the matrix");
        let mut f = vec![0.0; q.len()];
        f.par_chunks_exact_mut(3).enumerate().with_min_len(256).for_each(|(node, f_node)| {
            for (column, b) in self.row(node) {
                let x = &q[dof(column, 0)..dof(column, 0) + 3];
                for (r, s) in f_node.iter_mut().enumerate() {
                    *s += (0..3).map(|c| (b[3 * r + c] * x[c]).abs()).sum::<f64>();
                }
            }
        });
        f
    }

    /// This stiffness with `shift` added to every diagonal entry, N/m.
    pub fn shifted(&self, shift: f64) -> Self {
        let mut shifted = self.clone();
        for node in 0..self.node_count() {
            let row = self.pattern.row(node);
            for (at, &column) in row.zip(self.pattern.columns(node)) {
                if column as usize == node {
                    (0..3).for_each(|axis| shifted.blocks[at][4 * axis] += shift);
                }
            }
        }
        shifted
    }

    /// Sum of the diagonal entries, N/m.
    pub fn trace(&self) -> f64 {
        let own = |node: usize| self.row(node).find(move |(column, _)| *column == node);
        (0..self.node_count()).filter_map(own).map(|(_, b)| b[0] + b[4] + b[8]).sum()
    }

    /// Largest sum of absolute values in a row, N/m: a bound of the largest eigenvalue.
    pub fn row_sum_max(&self) -> f64 {
        let sum_of_row = |(node, r): (usize, usize)| -> f64 {
            self.row(node).map(|(_, b)| (0..3).map(|c| b[3 * r + c].abs()).sum::<f64>()).sum()
        };
        let rows = (0..self.node_count()).flat_map(|n| (0..3).map(move |r| (n, r)));
        rows.map(sum_of_row).fold(0.0, f64::max)
    }

    /// Largest absolute entry, N/m.
    pub fn amax(&self) -> f64 {
        self.blocks.iter().flatten().fold(0.0, |m, v| m.max(v.abs()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    fn two_tets() -> TetMesh {
        let vertices =
            [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.1, 0.2, 1.0], [0.2, 0.1, -1.1]];
        let vertices = vertices.map(Point3::from).to_vec();
        TetMesh::try_new(vertices, vec![[1, 2, 3, 0], [2, 1, 4, 0]], vec![0, 1]).unwrap()
    }

    /// The naive sum of (3.46): 12 × 12 matrices added entry by entry.
    fn assemble_naive(mesh: &TetMesh, materials: &[Material]) -> Vec<Vec<f64>> {
        let n = 3 * mesh.node_count();
        let mut k = vec![vec![0.0; n]; n];
        for (t, corners) in mesh.tets().iter().enumerate() {
            let ke =
                tet4::element_stiffness(&mesh.corners(t), &materials[mesh.regions()[t] as usize]);
            for i in 0..12 {
                for j in 0..12 {
                    let row = dof(corners[i / 3] as usize, i % 3);
                    k[row][dof(corners[j / 3] as usize, j % 3)] += ke[(i, j)];
                }
            }
        }
        k
    }

    #[test]
    fn assembly_by_rows_equals_the_sum_over_elements() {
        let mesh = two_tets();
        let materials =
            [Material::try_new(1.0, 0.3).unwrap(), Material::try_new(7.0, 0.45).unwrap()];
        let pattern = Arc::new(StiffnessPattern::new(&mesh));
        let stiffness = assemble(&pattern, &mesh, &materials).unwrap();
        let naive = assemble_naive(&mesh, &materials);
        for column in 0..15 {
            let mut unit = vec![0.0; 15];
            unit[column] = 1.0;
            for (row, value) in stiffness.mul(&unit).into_iter().enumerate() {
                assert!((value - naive[row][column]).abs() <= 1e-13 * stiffness.amax());
            }
        }
    }

    #[test]
    fn region_without_material_is_named() {
        let mesh = two_tets();
        let pattern = Arc::new(StiffnessPattern::new(&mesh));
        let error = assemble(&pattern, &mesh, &[]).unwrap_err();
        assert_eq!(error, AssemblyError::NoMaterial { tet: 0, region: 0, materials: 0 });
    }
}
