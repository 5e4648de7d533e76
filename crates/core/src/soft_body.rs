//! A soft body in a few lines: a mesh and a material, what is prescribed and what pulls on it; back come
//! displacements, reactions, and how wrong they are.
//!
//! This is the short way through [`crate::model`] and [`crate::solve`]. Who has budgets of memory,
//! stages to report, masks or contact goes there.

mod frames;
mod load_case;

use std::sync::Arc;

pub use frames::Frames;
pub use load_case::{Answer, Axis, Inexactness, LargeAnswer, LoadCase, SoftBodyError};

use crate::fem::hyperelastic::Law;
use crate::fem::{Element, Material};
use crate::gradient::{Gradient, Quantity};
use crate::mesh::TetMesh;
use crate::model::{Known, Model, ModelError};
use crate::solve::choose::cheapest_element;
use crate::solve::equilibrium::{Equilibrium, Goal, Path, Wish};
use crate::solve::{Certainty, Factored, Loads, Method, Solution};

/// A soft body: mesh, material, elements and their stiffness.
///
/// Shapes: N nodes. Units: m, Pa, N. Frame: that of the mesh.
///
/// ```
/// use nalgebra::Vector3;
/// use softgrasp_core::mesh::{BuiltIn, generate};
/// use softgrasp_core::{LoadCase, Material, SoftBody};
///
/// let cube = generate(BuiltIn::Cube, 125)?;
/// let (low, high) = cube.bounds();
/// let nodes_at = |z: f64| {
///     let on = cube.vertices().iter().zip(0u32..).filter(move |(p, _)| (p.z - z).abs() < 1e-9);
///     on.map(|(_, node)| node).collect::<Vec<_>>()
/// };
/// // The bottom is held, the top is pressed down by a millimetre (Dirichlet values).
/// let mut press = LoadCase::new();
/// press.hold(nodes_at(low.z));
/// for node in nodes_at(high.z) {
///     press.prescribe(node, Vector3::new(0.0, 0.0, -1e-3));
/// }
/// let body = SoftBody::try_new(cube.clone(), Material::try_new(2.0e4, 0.3)?)?;
/// let answer = body.solve(&press)?;
/// assert_eq!(answer.displacements.len(), 125);
/// assert!(answer.residual_rel < 1e-12 && answer.inexactness.relative() < 1e-9);
/// // What the top needs to be pressed with, the bottom holds.
/// let force: f64 = nodes_at(high.z).iter().map(|node| answer.reactions[node].z).sum();
/// let held: f64 = nodes_at(low.z).iter().map(|node| answer.reactions[node].z).sum();
/// assert!(force < 0.0 && (force + held).abs() < 1e-9 * held);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct SoftBody {
    model: Model,
}

impl SoftBody {
    /// A body of one material, of linear tetrahedra; of those that do not lock from a Poisson's ratio of
    /// 0.45 on.
    ///
    /// # Errors
    /// [`ModelError`] where mesh and material make no stiffness.
    pub fn try_new(mesh: TetMesh, material: Material) -> Result<Self, ModelError> {
        Self::with_element(mesh, &[material], cheapest_element(material.poisson()))
    }

    /// A body of an element that was chosen, with one material or one for each region of the mesh.
    ///
    /// # Errors
    /// [`ModelError`] for regions without a material, and for too many mid-edge nodes.
    pub fn with_element(
        mesh: TetMesh,
        materials: &[Material],
        element: Element,
    ) -> Result<Self, ModelError> {
        Ok(Self { model: Model::try_new(mesh, element, materials, Vec::new(), &mut |_| {})? })
    }

    /// The finite element model of it.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Static displacements under a load case by linear elasticity: K₁₁ is factored over fronts, solved
    /// and refined.
    ///
    /// # Errors
    /// [`SoftBodyError`]: nodes that are not there, a body that can still move, no memory.
    ///
    /// Source: thesis (3.43).
    pub fn solve(&self, case: &LoadCase) -> Result<Answer, SoftBodyError> {
        let (factored, solution, certainty) = self.solution(case)?;
        Ok(self.answer(&factored, &solution, certainty))
    }

    /// Static displacements by linear elasticity, as [`SoftBody::solve`], and the derivatives of a quantity
    /// of displacements and reactions by all that they depend on: one more solve with the same factor.
    ///
    /// # Errors
    /// [`SoftBodyError`]: those of [`SoftBody::solve`], and [`SoftBodyError::Gradient`] for a quantity of
    /// nodes or reactions that are not there.
    pub fn gradient(
        &self,
        case: &LoadCase,
        quantity: &Quantity,
    ) -> Result<(Answer, Gradient), SoftBodyError> {
        let (factored, solution, certainty) = self.solution(case)?;
        let asked = case.gradient_of(quantity);
        let gradient = asked.at_solution(&self.model, (&factored, &solution))?;
        Ok((self.answer(&factored, &solution, certainty), gradient))
    }

    fn solution(&self, case: &LoadCase) -> Result<(Factored, Solution, Certainty), SoftBodyError> {
        let (known, forces) = case.of(&self.model)?;
        let factored = self.model.factor(&known.dofs, Method::Front, &mut |_| {})?;
        let loads = Loads { q_known: &known.q_known, forces: &forces, residual_rel: 0.0 };
        let found = factored.solve_for_certain(self.model.stiffness(), loads, &mut |_| {});
        let (solution, certainty) = found.map_err(ModelError::from)?;
        Ok((factored, solution, certainty))
    }

    fn answer(&self, factored: &Factored, solution: &Solution, certainty: Certainty) -> Answer {
        Answer {
            displacements: load_case::by_node(&self.model, &solution.displacement),
            reactions: load_case::reactions(factored.partition().known(), &solution.reaction),
            residual_rel: solution.residual_rel,
            inexactness: Inexactness::Estimated(certainty.error_rel),
        }
    }

    /// Prepares frames: one factor, then answers for other prescribed displacements in a fraction of a
    /// millisecond.
    ///
    /// # Errors
    /// [`SoftBodyError`]: ten-node elements, no memory.
    pub fn frames(&self) -> Result<Frames<'_>, SoftBodyError> {
        Frames::try_new(&self.model)
    }

    /// Prepares frames without a factor, for bodies whose factor is too large: a node that is touched for the
    /// first time costs three solves by multigrid, and the error is estimated instead of proven.
    ///
    /// # Errors
    /// [`SoftBodyError`]: ten-node elements.
    pub fn frames_without_factor(&self) -> Result<Frames<'_>, SoftBodyError> {
        Frames::without_factor(&self.model)
    }

    /// Equilibrium at large deformation under a load case: forces keep their directions, the residual
    /// is that of the deformed body.
    ///
    /// ```
    /// use nalgebra::{Rotation3, Vector3};
    /// use softgrasp_core::mesh::{BuiltIn, generate};
    /// use softgrasp_core::{Law, LoadCase, Material, SoftBody};
    ///
    /// // The bottom of a cube is held, the top is turned by 40 degrees.
    /// let cube = generate(BuiltIn::Cube, 64)?;
    /// let (low, high) = cube.bounds();
    /// let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), 40f64.to_radians());
    /// let mut twist = LoadCase::new();
    /// for (place, node) in cube.vertices().iter().zip(0..) {
    ///     if place.z > high.z - 1e-9 {
    ///         twist.prescribe(node, turn * place.coords - place.coords);
    ///     } else if place.z < low.z + 1e-9 {
    ///         twist.hold([node]);
    ///     }
    /// }
    /// let body = SoftBody::try_new(cube, Material::try_new(2.0e4, 0.3)?)?;
    /// let twisted = body.equilibrium(&twist, Law::NeoHookean)?;
    /// assert!(twisted.answer.residual_rel < 1e-8 && twisted.volume_ratio_min > 0.5);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`SoftBodyError`]: those of [`SoftBody::solve`], and where no stable equilibrium is found, with
    /// the cause.
    pub fn equilibrium(&self, case: &LoadCase, law: Law) -> Result<LargeAnswer, SoftBodyError> {
        let (known, path, found) = self.path(case, law)?;
        Ok(self.large_answer(&known, &path, &found))
    }

    /// Equilibrium at large deformation, as [`SoftBody::equilibrium`], and the derivatives of a quantity of
    /// displacements and reactions by all that they depend on: one more solve, with the tangent there.
    ///
    /// ```
    /// use nalgebra::Vector3;
    /// use softgrasp_core::mesh::{BuiltIn, generate};
    /// use softgrasp_core::{Law, LoadCase, Material, Quantity, SoftBody, Term};
    ///
    /// // A cube is pulled to 1.3 times its length; with a material twice as stiff, twice the force pulls.
    /// let cube = generate(BuiltIn::Cube, 64)?;
    /// let (low, high) = cube.bounds();
    /// let mut pull = LoadCase::new();
    /// let mut force = Quantity::default();
    /// for (place, node) in cube.vertices().iter().zip(0..) {
    ///     if place.z < low.z + 1e-9 {
    ///         pull.hold([node]);
    ///     } else if place.z > high.z - 1e-9 {
    ///         pull.prescribe(node, Vector3::new(0.0, 0.0, 0.3 * (high.z - low.z)));
    ///         force.of_reactions.push(Term { dof: 3 * node + 2, slope: 1.0, curvature: 0.0 });
    ///     }
    /// }
    /// let body = SoftBody::try_new(cube, Material::try_new(2.0e4, 0.3)?)?;
    /// let (_, gradient) = body.equilibrium_gradient(&pull, Law::NeoHookean, &force)?;
    /// let by_young = gradient.by_materials[0].young;
    /// assert!((by_young * 2.0e4 - gradient.value).abs() < 1e-9 * gradient.value);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`SoftBodyError`]: those of [`SoftBody::equilibrium`], and [`SoftBodyError::Gradient`] where the
    /// equilibrium has no derivatives: about to snap or buckle, or reached across a snap.
    pub fn equilibrium_gradient(
        &self,
        case: &LoadCase,
        law: Law,
        quantity: &Quantity,
    ) -> Result<(LargeAnswer, Gradient), SoftBodyError> {
        let (known, path, found) = self.path(case, law)?;
        let gradient = case.gradient_of(quantity).at_equilibrium(&self.model, (&path, &found))?;
        Ok((self.large_answer(&known, &path, &found), gradient))
    }

    fn path(&self, case: &LoadCase, law: Law) -> Result<(Known, Path, Equilibrium), SoftBodyError> {
        let (known, forces) = case.of(&self.model)?;
        let hold = Arc::new(self.model.hold(&known.dofs, Vec::new(), None)?);
        let elements = Arc::new(self.model.hyperelastic(law)?);
        let rest = vec![0.0; 3 * self.model.system_node_count()];
        let mut path = Path::new(elements, self.model.stiffness(), hold, rest, false);
        let goal = Goal { q_known: &known.q_known, mask_q: &[], forces: &forces };
        let found = path.find(&goal, &Wish::EXACT)?;
        Ok((known, path, found))
    }

    fn large_answer(&self, known: &Known, path: &Path, found: &Equilibrium) -> LargeAnswer {
        LargeAnswer {
            answer: Answer {
                displacements: load_case::by_node(&self.model, path.displacement()),
                reactions: load_case::reactions(&known.dofs, &found.reactions),
                residual_rel: found.residual_rel,
                inexactness: Inexactness::Estimated(found.error_estimate_rel),
            },
            energy: found.energy,
            volume_ratio_min: found.jacobian_min,
            jumped: found.jumped,
        }
    }
}
