//! Strain, stress and an estimate of the mesh's error at every node, from the displacements.
//!
//! A linear tetrahedron has one strain, so the strain jumps from each element to the next. The
//! strain of a node is the average of the elements around it, weighted by volume; between the nodes
//! it is interpolated. This *recovered* field is smooth and nearer to the truth than that of the
//! elements, so the distance between the two estimates how far the elements are off.
//!
//! Strains are small: `ε = ½ (H + Hᵀ)` of the displacement gradient H, as in the answers of linear
//! elasticity. A rotation by φ looks like a strain of `1 − cos φ`.
//!
//! Stress enters by its deviator only, `s = 2μ e`. The von Mises stress needs no more, and it means
//! the same for `t4` and for `t4-anp`, whose pressure does not belong to the elements.
//!
//! Source: Zienkiewicz and Zhu, Int. J. Numer. Meth. Engng 24 (1987) 337.

use nalgebra::{Matrix3, Vector3, Vector6};

use super::Material;
use super::strain::principal_max;
use super::tet4::{self, Gradients};
use crate::mesh::TetMesh;

/// What recovery needs of one rest shape, worked out once, and the memory that it
/// works in. A node that no element uses has the value 0.
///
/// Shapes: N nodes, M elements. Units: m, Pa.
#[derive(Clone, Debug)]
pub struct StressRecovery {
    /// Shear modulus of the stiffest material, Pa.
    shear_modulus: f64,
    /// Shear modulus of each element over the largest; empty for a mesh of one material.
    share_of_stiffest: Vec<f64>,
    tets: Vec<[u32; 4]>,
    gradients: Vec<Gradients>,
    /// Volume of the elements around each node, m³.
    volume_around: Vec<f64>,
    /// Largest `|∇N|` of the mesh, 1/m.
    steepest: f64,
    /// Strain of each element.
    of_elements: Vec<Tensor>,
    /// Recovered strain of each node.
    of_nodes: Vec<Tensor>,
}

/// A symmetric tensor as `xx yy zz √2 yz √2 zx √2 xy`, so that its norm is that of the vector.
type Tensor = Vector6<f64>;

/// Displacements of another mesh.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{got} displacements were given for the {expected} nodes of the mesh")]
pub struct OtherNodeCount {
    /// Displacements that were given.
    pub got: usize,
    /// Nodes of the mesh.
    pub expected: usize,
}

impl StressRecovery {
    /// Prepares a rest shape. At the nodes between two materials the stress is the average across them.
    ///
    /// Shapes: `materials` one, or one per region number of the mesh. Units: mesh m.
    ///
    /// # Panics
    /// Without a material.
    pub fn new(mesh: &TetMesh, materials: &[Material]) -> Self {
        let of_region = |region: usize| materials[region.min(materials.len() - 1)].shear_modulus();
        let shear_modulus = materials.iter().map(Material::shear_modulus).fold(0.0, f64::max);
        let share_of_stiffest = match materials {
            [_] => Vec::new(),
            _ => mesh.regions().iter().map(|&r| of_region(r as usize) / shear_modulus).collect(),
        };
        let tets = mesh.tets().to_vec();
        let gradients: Vec<Gradients> =
            (0..tets.len()).map(|tet| tet4::gradients(&mesh.corners(tet))).collect();
        let norms = gradients.iter().flat_map(|g| &g.of_shape).map(Vector3::norm);
        let mut made = Self {
            shear_modulus,
            share_of_stiffest,
            steepest: norms.fold(0.0, f64::max),
            of_elements: vec![Tensor::zeros(); tets.len()],
            of_nodes: vec![Tensor::zeros(); mesh.node_count()],
            tets,
            gradients,
            volume_around: Vec::new(),
        };
        made.volume_around = made.volumes_around(None);
        made
    }

    /// Largest absolute principal strain of each node.
    ///
    /// Shapes: `displacement` one per node, m; `values` is overwritten with one per node, 1.
    ///
    /// # Errors
    /// [`OtherNodeCount`].
    pub fn principal_strain(
        &mut self,
        displacement: &[[f64; 3]],
        values: &mut Vec<f64>,
    ) -> Result<(), OtherNodeCount> {
        self.recover(displacement)?;
        values.clear();
        values.extend(self.of_nodes.iter().map(|strain| principal_max(&matrix(strain))));
        Ok(())
    }

    /// Von Mises stress of each node, `√(3/2 s:s)`.
    ///
    /// Shapes: `displacement` one per node, m; `values` is overwritten with one per node, Pa.
    ///
    /// # Errors
    /// [`OtherNodeCount`].
    pub fn von_mises(
        &mut self,
        displacement: &[[f64; 3]],
        values: &mut Vec<f64>,
    ) -> Result<(), OtherNodeCount> {
        self.recover(displacement)?;
        self.weigh_by_stiffness();
        let factor = 2.0 * self.shear_modulus * 1.5f64.sqrt();
        values.clear();
        values.extend(self.of_nodes.iter().map(|strain| factor * deviator(strain).norm()));
        Ok(())
    }

    /// Estimated error of the stress at each node, as a fraction of the largest recovered stress of
    /// the object: root mean square of `s* − s_h` over each element, averaged over the elements
    /// around the node by volume. Also the estimated error of the whole in the energy norm,
    /// `‖s* − s_h‖ / √(‖s_h‖² + ‖s* − s_h‖²)`, by the deviators; it is what is returned.
    ///
    /// An estimate, not a bound: it sees what a finer mesh would change nearby, not an error that
    /// was carried there from elsewhere, and not the pressure. A motion without strain has none.
    ///
    /// Shapes: `displacement` one per node, m; `values` is overwritten with one per node, 1.
    ///
    /// # Errors
    /// [`OtherNodeCount`].
    ///
    /// Source: Zienkiewicz and Zhu 1987, see the module.
    pub fn error(
        &mut self,
        displacement: &[[f64; 3]],
        values: &mut Vec<f64>,
    ) -> Result<f64, OtherNodeCount> {
        self.recover(displacement)?;
        // The largest shear modulus cancels, so strains, weighed by their share of it, do for stresses.
        self.weigh_by_stiffness();
        self.of_elements.iter_mut().chain(&mut self.of_nodes).for_each(|t| *t = deviator(t));
        values.clear();
        values.resize(self.of_nodes.len(), 0.0);
        let (mut of_error, mut of_answer, mut largest) = (0.0, 0.0, 0.0f64);
        for material in self.materials_apart() {
            // The true stress jumps between two materials, so each is smoothed by itself.
            if material.is_some() {
                self.average_at_nodes(material);
            }
            largest = self.of_nodes.iter().map(Tensor::norm).fold(largest, f64::max);
            for (tet, nodes) in
                self.tets.iter().enumerate().filter(|(tet, _)| self.is_of(*tet, material))
            {
                let (volume, own) = (self.gradients[tet].volume, &self.of_elements[tet]);
                let square = mean_square(&nodes.map(|node| self.of_nodes[node as usize] - own));
                of_error += volume * square;
                of_answer += volume * own.norm_squared();
                let rms = square.sqrt();
                nodes.iter().for_each(|&node| values[node as usize] += volume * rms);
            }
        }
        if largest <= self.rounding(displacement) {
            values.fill(0.0);
            return Ok(0.0);
        }
        for (value, volume) in values.iter_mut().zip(&self.volume_around) {
            if *volume > 0.0 {
                *value /= volume * largest;
            }
        }
        Ok((of_error / (of_answer + of_error)).sqrt())
    }

    /// Strain of every element and of every node.
    fn recover(&mut self, displacement: &[[f64; 3]]) -> Result<(), OtherNodeCount> {
        let (got, expected) = (displacement.len(), self.of_nodes.len());
        if got != expected {
            return Err(OtherNodeCount { got, expected });
        }
        let elements = self.tets.iter().zip(&self.gradients).zip(&mut self.of_elements);
        for ((nodes, g), strain) in elements {
            *strain = strain_of(g, &nodes.map(|node| Vector3::from(displacement[node as usize])));
        }
        self.average_at_nodes(None);
        Ok(())
    }

    /// Averages the tensors of the elements, of all of them or of one material, at the nodes, weighed by volume.
    fn average_at_nodes(&mut self, material: Option<f64>) {
        self.of_nodes.fill(Tensor::zeros());
        for (tet, (nodes, g)) in self.tets.iter().zip(&self.gradients).enumerate() {
            if self.is_of(tet, material) {
                let weighted = self.of_elements[tet] * g.volume;
                nodes.iter().for_each(|&node| self.of_nodes[node as usize] += weighted);
            }
        }
        let of_material;
        let volumes = match material {
            None => &self.volume_around,
            Some(_) => {
                of_material = self.volumes_around(material);
                &of_material
            }
        };
        for (tensor, volume) in self.of_nodes.iter_mut().zip(volumes) {
            if *volume > 0.0 {
                *tensor /= *volume;
            }
        }
    }

    /// Volume of the elements around each node, of all of them or of one material, m³.
    fn volumes_around(&self, material: Option<f64>) -> Vec<f64> {
        let mut volumes = vec![0.0; self.of_nodes.len()];
        let elements = self.tets.iter().zip(&self.gradients).enumerate();
        for (_, (nodes, g)) in elements.filter(|(tet, _)| self.is_of(*tet, material)) {
            nodes.iter().for_each(|&node| volumes[node as usize] += g.volume);
        }
        volumes
    }

    /// Makes strains of elements and nodes into stresses over twice the largest shear modulus (their deviators are
    /// meant), where there are several materials.
    fn weigh_by_stiffness(&mut self) {
        if self.share_of_stiffest.is_empty() {
            return;
        }
        self.of_elements
            .iter_mut()
            .zip(&self.share_of_stiffest)
            .for_each(|(t, share)| *t *= *share);
        self.average_at_nodes(None);
    }

    /// Shares of the largest shear modulus, one for each material, where there are several; else `None` for all.
    fn materials_apart(&self) -> Vec<Option<f64>> {
        let mut shares = self.share_of_stiffest.clone();
        shares.sort_by(f64::total_cmp);
        shares.dedup();
        if shares.is_empty() { vec![None] } else { shares.into_iter().map(Some).collect() }
    }

    /// Whether an element is of a material; every one is of `None`.
    fn is_of(&self, tet: usize, material: Option<f64>) -> bool {
        material.is_none_or(|share| self.share_of_stiffest[tet] == share)
    }

    /// The strain that rounding alone can make of these displacements.
    fn rounding(&self, displacement: &[[f64; 3]]) -> f64 {
        let largest = displacement.iter().flatten().fold(0.0, |most: f64, u| most.max(u.abs()));
        ROUNDINGS * f64::EPSILON * largest * self.steepest
    }
}

/// Roundings of a strain, of four terms of three components each, and to spare.
const ROUNDINGS: f64 = 64.0;

/// Strain of a linear element.
fn strain_of(g: &Gradients, u: &[Vector3<f64>; 4]) -> Tensor {
    // The gradients add up to zero: differences to one corner lose nothing to a common motion.
    let h = |a: usize| (u[a] - u[3], g.of_shape[a]);
    let mut strain = Tensor::zeros();
    for (u, n) in [h(0), h(1), h(2)] {
        strain += Tensor::new(
            u.x * n.x,
            u.y * n.y,
            u.z * n.z,
            SQRT_HALF * (u.y * n.z + u.z * n.y),
            SQRT_HALF * (u.z * n.x + u.x * n.z),
            SQRT_HALF * (u.x * n.y + u.y * n.x),
        );
    }
    strain
}

/// √2 · ½: a shear strain is half a sum, and stands in a [`Tensor`] times √2.
const SQRT_HALF: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// What is left of a tensor without its mean.
fn deviator(tensor: &Tensor) -> Tensor {
    let mean = (tensor[0] + tensor[1] + tensor[2]) / 3.0;
    tensor - Tensor::new(mean, mean, mean, 0.0, 0.0, 0.0)
}

fn matrix(t: &Tensor) -> Matrix3<f64> {
    let [yz, zx, xy] = [t[3], t[4], t[5]].map(|shear| SQRT_HALF * shear);
    Matrix3::new(t[0], xy, zx, xy, t[1], yz, zx, yz, t[2])
}

/// Mean over a tetrahedron of the square of a field that is linear between its corners:
/// `∫ N_a N_b dV = V (1 + δ_ab) / 20`.
fn mean_square(at_corners: &[Tensor; 4]) -> f64 {
    let sum: Tensor = at_corners.iter().sum();
    let squares: f64 = at_corners.iter().map(Tensor::norm_squared).sum();
    (squares + sum.norm_squared()) / 20.0
}

#[cfg(test)]
mod tests;
