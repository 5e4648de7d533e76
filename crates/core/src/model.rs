//! The finite element model of a body: mesh, stiffness, connected parts, fixed degrees of freedom.

mod error;

use std::sync::Arc;

pub use error::ModelError;

use crate::contact::{Mask, MaskError};
pub use crate::fem::Element;
use crate::fem::fields::{
    Fields, Materials, Recovery, states_of_averaged, states_of_tet4, states_of_tet10,
};
use crate::fem::hyperelastic::{Elements, Law};
use crate::fem::{
    Material, NodalPatches, QuadraticMesh, SpreadLoads, Stiffness, StiffnessPattern, StrainSummary,
    assemble, assemble_nodal_pressure, assemble_quadratic, summarise_strain,
    summarise_strain_quadratic,
};
use crate::mesh::{Bodies, TetMesh};
use crate::solve::condensed::{Base, BaseOf};
use crate::solve::equilibrium::{Hold, HoldOf, TangentsBy};
use crate::solve::memory::model_bytes;
use crate::solve::{
    Analysed, Factored, KnownDisplacements, Partition, RigidBodies, Stage, Within, find_free_motion,
};

/// Everything about a shape that does not depend on which nodes are touched.
///
/// Shapes: N nodes, stiffness 3N × 3N. Units: m, Pa, N/m.
///
/// Source: thesis chapter 3 up to (3.39).
pub struct Model {
    mesh: TetMesh,
    element: Element,
    /// Mesh of ten-node elements.
    quadratic: Option<QuadraticMesh>,
    materials: Vec<Material>,
    bodies: Bodies,
    rigid: RigidBodies,
    /// For every node of the system (corners first), whether an element uses it.
    used: Vec<bool>,
    used_count: usize,
    stiffness: Arc<Stiffness>,
    fixed: Vec<u32>,
}

/// A partition and the known displacements in its order.
#[derive(Clone, Debug, PartialEq)]
pub struct Known {
    /// All known degrees of freedom, those fixed by the scene among them, ascending.
    pub dofs: Vec<u32>,
    /// Prescribed displacements (Dirichlet values) `Q_k`, m.
    pub q_known: Vec<f64>,
}

impl Model {
    /// Assembles the stiffness of a mesh with one of the elements; linear ones leave mid-edge nodes of the
    /// mesh unused.
    ///
    /// Shapes: `materials` one, or one per region; `fixed` degrees of freedom held at zero, in any
    /// order. Units: m, Pa.
    ///
    /// # Errors
    /// [`ModelError`] for regions without material, for fixed nodes that are not there, and for mid-edge
    /// nodes that no ten-node elements can have.
    pub fn try_new(
        mesh: TetMesh,
        element: Element,
        materials: &[Material],
        mut fixed: Vec<u32>,
        on_stage: &mut dyn FnMut(Stage),
    ) -> Result<Self, ModelError> {
        on_stage(Stage::Assemble);
        let mesh = match element {
            Element::Tet10 => mesh,
            Element::Tet4 | Element::Tet4Anp => mesh.without_mid_edge_nodes(),
        };
        fixed.sort_unstable();
        fixed.dedup();
        Partition::try_new(&mesh.used_nodes(), &fixed)?;
        // Neither needs the other, and each is sequential in part.
        let (system, (bodies, rigid)) = rayon::join(
            || system(&mesh, element, materials),
            || {
                let bodies = Bodies::from_mesh(&mesh);
                let rigid = RigidBodies::new(&mesh, &bodies);
                (bodies, rigid)
            },
        );
        let (quadratic, used, stiffness) = system?;
        let stiffness = Arc::new(stiffness);
        let used_count = used.iter().filter(|used| **used).count();
        let materials = materials.to_vec();
        Ok(Self {
            mesh,
            element,
            quadratic,
            materials,
            bodies,
            rigid,
            used,
            used_count,
            stiffness,
            fixed,
        })
    }

    /// The element it is made of.
    pub fn element(&self) -> Element {
        self.element
    }

    /// Number of nodes of the system, mid-edge nodes included.
    pub fn system_node_count(&self) -> usize {
        self.used.len()
    }

    /// Largest rotation and strain of a displacement field of the system, with a call of `pause`
    /// every 50 µs or so.
    ///
    /// Shapes: `displacement` 3 per node of the system.
    pub fn strain(&self, displacement: &[f64], pause: &mut dyn FnMut()) -> StrainSummary {
        match &self.quadratic {
            None => summarise_strain(&self.mesh, displacement, pause),
            Some(quadratic) => summarise_strain_quadratic(quadratic, displacement, pause),
        }
    }

    /// The mesh that the model was made of.
    pub fn mesh(&self) -> &TetMesh {
        &self.mesh
    }

    /// The body as loads are spread over it.
    pub fn spread_loads(&self) -> SpreadLoads<'_> {
        SpreadLoads::new(&self.mesh, self.quadratic.as_ref())
    }

    /// The stiffness `kᵍ`.
    pub fn stiffness(&self) -> &Stiffness {
        &self.stiffness
    }

    /// Connected bodies and pieces.
    pub fn bodies(&self) -> &Bodies {
        &self.bodies
    }

    /// One material for the whole body, or one for each region.
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// Derivatives by the places of the mesh's nodes, from those by the places of all nodes of the system:
    /// mid-edge nodes that were made lie in the middle of their corners.
    ///
    /// Shapes: three for each node of the system; three for each node of the mesh.
    pub fn by_nodes_of_mesh(&self, mut slopes: Vec<f64>) -> Vec<f64> {
        let made = slopes.split_off((3 * self.mesh.node_count()).min(slopes.len()));
        let edges = self.quadratic.iter().flat_map(|quadratic| quadratic.edges());
        for (slope, edge) in made.as_chunks::<3>().0.iter().zip(edges) {
            for &corner in edge {
                let own = &mut slopes[3 * corner as usize..3 * corner as usize + 3];
                own.iter_mut().zip(slope).for_each(|(sum, slope)| *sum += 0.5 * slope);
            }
        }
        slopes
    }

    /// Degrees of freedom the scene holds at zero, ascending.
    pub fn fixed(&self) -> &[u32] {
        &self.fixed
    }

    /// Whether an element uses a node.
    pub fn is_used(&self, node: usize) -> bool {
        self.used.get(node).copied().unwrap_or(false)
    }

    /// Degrees of freedom of nodes that elements use.
    pub fn modelled_dofs(&self) -> usize {
        3 * self.used_count
    }

    /// Bytes held by mesh and stiffness, roughly.
    pub fn bytes(&self) -> usize {
        let blocks = self.stiffness.pattern().block_count();
        model_bytes(self.element(), self.used.len(), self.mesh.tets().len(), blocks)
    }

    /// Joins the known displacements of one question with the fixed degrees of freedom; where both
    /// name one, the question's value holds.
    ///
    /// Units: m.
    ///
    /// # Errors
    /// [`ModelError::Known`] for contradictions and values that are not numbers.
    pub fn known(&self, pairs: Vec<(u32, f64)>) -> Result<Known, ModelError> {
        let node_count = self.mesh.node_count();
        if let Some((dof, _)) = pairs.iter().find(|(dof, _)| *dof as usize >= 3 * node_count) {
            return Err(ModelError::NoSuchNode { node: *dof as usize / 3, node_count });
        }
        let mut dofs_given: Vec<u32> = pairs.iter().map(|p| p.0).collect();
        dofs_given.sort_unstable();
        let mut all = pairs;
        let fixed_only = self.fixed.iter().filter(|d| dofs_given.binary_search(d).is_err());
        all.extend(fixed_only.map(|&d| (d, 0.0)));
        let known = KnownDisplacements::try_new(all)?;
        Ok(Known { dofs: known.dofs().to_vec(), q_known: known.values().to_vec() })
    }

    /// Masks of `(node, weight)` lists, once their nodes are seen to be there and each on one body.
    ///
    /// # Errors
    /// [`ModelError::Mask`] naming the mask and what is wrong with it.
    pub fn masks(
        &self,
        entries: impl IntoIterator<Item = Vec<(u32, f64)>>,
    ) -> Result<Vec<Mask>, ModelError> {
        let made = |(mask, entries): (usize, Vec<(u32, f64)>)| {
            let checked =
                Mask::try_new(entries).and_then(|made| self.check_mask(&made).map(|()| made));
            checked.map_err(|reason| ModelError::Mask { mask, reason })
        };
        entries.into_iter().enumerate().map(made).collect()
    }

    fn check_mask(&self, mask: &Mask) -> Result<(), MaskError> {
        let node_count = self.mesh.node_count();
        let mut on: Option<(u32, u32)> = None;
        for &(node, _) in mask.entries() {
            let Some(body) = self.bodies.of_node.get(node as usize) else {
                return Err(MaskError::NoSuchNode { node, node_count });
            };
            let body = body.ok_or(MaskError::Orphan { node })?;
            let (first, first_body) = *on.get_or_insert((node, body));
            if first_body != body {
                return Err(MaskError::SeveralBodies { first, second: node });
            }
        }
        Ok(())
    }

    /// Makes sure that known degrees of freedom exist and, with the masks, hold every body.
    ///
    /// Shapes: `dofs` ascending; `masks` of this model.
    ///
    /// # Errors
    /// [`ModelError::Partition`], [`ModelError::Free`] naming the body and its motion.
    pub fn check_held(&self, dofs: &[u32], masks: &[Mask]) -> Result<(), ModelError> {
        Partition::check(&self.used, dofs)?;
        match find_free_motion(&self.mesh, &self.bodies, &self.rigid, dofs, masks) {
            Some(free) => Err(ModelError::Free(free)),
            None => Ok(()),
        }
    }

    /// Partition by Dirichlet values alone, once they are seen to hold every body against rigid motions.
    ///
    /// # Errors
    /// As [`Model::check_held`].
    pub fn held_partition(&self, dofs: &[u32]) -> Result<Partition, ModelError> {
        self.check_held(dofs, &[])?;
        Ok(Partition::try_new(&self.used, dofs)?)
    }

    /// Base of the condensed engine for this shape; with a limit, its factor or hierarchy may take so much
    /// memory only.
    ///
    /// Units: `limit` bytes.
    ///
    /// # Errors
    /// [`ModelError::Condensed`], [`ModelError::QuadraticCondensed`].
    pub fn condense(
        &self,
        limit: Option<u64>,
        on_stage: &mut dyn FnMut(Stage),
    ) -> Result<Base, ModelError> {
        Ok(Base::try_new(self.base_of()?, &self.fixed, limit, on_stage)?)
    }

    /// Base of the condensed engine whose columns come from conjugate gradients with multigrid: a fraction of a
    /// factor's memory, more time for each contact, and an estimate of the error instead of a bound.
    ///
    /// # Errors
    /// [`ModelError::Condensed`], [`ModelError::QuadraticCondensed`].
    pub fn condense_without_factor(&self) -> Result<Base, ModelError> {
        Ok(Base::without_factor(self.base_of()?, &self.fixed)?)
    }

    fn base_of(&self) -> Result<BaseOf<'_>, ModelError> {
        let Self { mesh, bodies, rigid, stiffness, quadratic, .. } = self;
        match quadratic {
            // Nodes that were made have no number by which a contact could name them.
            Some(quadratic) if !quadratic.is_curved() => Err(ModelError::QuadraticCondensed),
            _ => Ok(BaseOf { mesh, bodies, rigid, stiffness }),
        }
    }

    /// Orders and analyses `K11` for a set of known degrees of freedom, after making sure that it
    /// holds every body; what a factor will cost is known then, and none is made yet.
    ///
    /// # Errors
    /// [`ModelError::Partition`], [`ModelError::Free`].
    pub fn analyse(
        &self,
        dofs: &[u32],
        on_stage: &mut dyn FnMut(Stage),
    ) -> Result<Analysed, ModelError> {
        let partition = self.held_partition(dofs)?;
        Ok(Analysed::new(&self.stiffness, partition, on_stage))
    }

    /// Inverts or factors `K11` for a set of known degrees of freedom, after making sure that it
    /// holds every body; by a [`Method`](crate::solve::Method), or by a method [`Within`] a memory
    /// limit.
    ///
    /// # Errors
    /// [`ModelError::Partition`], [`ModelError::Free`] naming the body and its motion,
    /// [`ModelError::Solve`].
    ///
    /// Source: thesis (3.41)–(3.43).
    pub fn factor(
        &self,
        dofs: &[u32],
        how: impl Into<Within>,
        on_stage: &mut dyn FnMut(Stage),
    ) -> Result<Factored, ModelError> {
        let partition = self.held_partition(dofs)?;
        Ok(Factored::try_new(&self.stiffness, partition, how, on_stage)?)
    }

    /// The elements of the model with a law for large deformation; they take the moduli from the
    /// materials of the model.
    ///
    /// # Errors
    /// None that making the model did not have.
    pub fn hyperelastic(&self, law: Law) -> Result<Elements, ModelError> {
        let quadratic = self.quadratic.as_ref();
        Ok(Elements::try_new(&self.mesh, self.element, quadratic, law, &self.materials)?)
    }

    /// Hyperelastic elements with a yield stress above which they flow and stay deformed, if there is one.
    ///
    /// Units: Pa.
    ///
    /// # Errors
    /// [`ModelError::Yield`] for a stress that is none, and for elements that cannot.
    pub fn yielding(&self, law: Law, yield_stress: Option<f64>) -> Result<Elements, ModelError> {
        let elements = self.hyperelastic(law)?;
        Ok(match yield_stress {
            Some(stress) => elements.with_yield(stress)?,
            None => elements,
        })
    }

    /// Largest Poisson's ratio of its materials.
    pub fn poisson_max(&self) -> f64 {
        self.materials.iter().map(Material::poisson).fold(-1.0, f64::max)
    }

    /// Known degrees of freedom and masks as a hold for equilibria, whose tangents are factored; `before`
    /// lends its order if it is by the same degrees of freedom.
    ///
    /// Shapes: `dofs` ascending, fixed ones among them; `masks` of this model.
    ///
    /// # Errors
    /// As [`Model::hold_by`].
    pub fn hold(
        &self,
        dofs: &[u32],
        masks: Vec<Mask>,
        before: Option<&Hold>,
    ) -> Result<Hold, ModelError> {
        self.hold_by(dofs, masks, TangentsBy::Factors, before)
    }

    /// Known degrees of freedom and masks as a hold for equilibria; `before` lends its order if it
    /// is by the same degrees of freedom and means.
    ///
    /// Shapes: `dofs` ascending, fixed ones among them; `masks` of this model.
    ///
    /// # Errors
    /// [`ModelError::Partition`], [`ModelError::Free`], [`ModelError::Dependent`].
    pub fn hold_by(
        &self,
        dofs: &[u32],
        masks: Vec<Mask>,
        by: TangentsBy,
        before: Option<&Hold>,
    ) -> Result<Hold, ModelError> {
        self.check_held(dofs, &masks)?;
        let partition = Partition::try_new(&self.used, dofs)?;
        let Self { mesh, bodies, rigid, stiffness, .. } = self;
        let body = HoldOf { mesh, bodies, rigid, stiffness };
        Ok(Hold::try_new(body, partition, masks, by, before)?)
    }

    /// Strain, stress and energy by linear elasticity, with the estimate of the error if `is_judged`,
    /// in parallel, the same bits for any number of threads.
    ///
    /// Shapes: `displacement` 3 per node of the system. Units: m.
    ///
    /// # Panics
    /// If `displacement` does not hold three numbers per node of the system.
    ///
    /// Source: thesis (3.12), (3.28); Zienkiewicz and Zhu 1987 for the estimate.
    pub fn fields(&self, displacement: &[f64], is_judged: bool) -> Fields {
        assert_eq!(
            displacement.len(),
            3 * self.system_node_count(),
            "displacements do not fit the body"
        );
        let mesh = &self.mesh;
        let materials = Materials { by_region: &self.materials, regions: mesh.regions() };
        let largest = displacement.iter().fold(0.0, |most: f64, u| most.max(u.abs()));
        match (self.element, &self.quadratic) {
            (Element::Tet10, Some(quadratic)) => {
                let states = states_of_tet10(quadratic, materials, displacement);
                Recovery { mesh, states, largest }.fields(is_judged)
            }
            (Element::Tet4Anp, _) => {
                let states = states_of_averaged(mesh, materials, displacement);
                Recovery { mesh, states, largest }.fields(is_judged)
            }
            _ => {
                let states = states_of_tet4(mesh, materials, displacement);
                Recovery { mesh, states, largest }.fields(is_judged)
            }
        }
    }

    /// Strain, stress and energy at large deformation, by the law of `elements`, which are those of this
    /// model.
    ///
    /// Shapes: `displacement` 3 per node of the system. Units: m.
    ///
    /// # Panics
    /// If `displacement` does not hold three numbers per node of the system.
    pub fn large_fields(
        &self,
        elements: &Elements,
        displacement: &[f64],
        is_judged: bool,
    ) -> Fields {
        elements.fields(&self.mesh, displacement, is_judged)
    }
}

/// Ten-node mesh if the element needs one, nodes of the system that are used, and the stiffness.
type System = (Option<QuadraticMesh>, Vec<bool>, Stiffness);

/// Pattern and stiffness of a mesh with one of the elements.
fn system(mesh: &TetMesh, element: Element, materials: &[Material]) -> Result<System, ModelError> {
    Ok(match element {
        Element::Tet4 => {
            let pattern = Arc::new(StiffnessPattern::new(mesh));
            (None, mesh.used_nodes(), assemble(&pattern, mesh, materials)?)
        }
        Element::Tet4Anp => {
            let patches = NodalPatches::new(mesh);
            let pattern = Arc::new(StiffnessPattern::nodal_pressure(mesh, &patches));
            let stiffness = assemble_nodal_pressure(&pattern, mesh, &patches, materials)?;
            (None, mesh.used_nodes(), stiffness)
        }
        Element::Tet10 => {
            let quadratic = QuadraticMesh::try_new(mesh)?;
            let pattern = Arc::new(StiffnessPattern::quadratic(&quadratic));
            let stiffness = assemble_quadratic(&pattern, &quadratic, materials)?;
            let used = quadratic.used_nodes();
            (Some(quadratic), used, stiffness)
        }
    })
}

#[cfg(test)]
mod tests;
