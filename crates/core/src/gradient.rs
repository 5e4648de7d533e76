//! Derivatives of a quantity of displacements and reactions by all that they depend on, by one more solve.
//!
//! A quantity J of displacements u and reactions `R = f_int(u) − f`. Its adjoint λ is −∂J/∂R where u is
//! known, and solves `K λ = ∂J/∂u` where u is free; K is the stiffness, or the tangent of the equilibrium.
//! Then `dJ/df = λ`, `dJ/du = ∂J/∂u − K λ` by a known displacement, and `dJ/dp = −λᵀ ∂(f_int − f)/∂p` by a
//! number p of a load, a material or the place of a node.

use nalgebra::Vector3;

use crate::fem::Material;
use crate::fem::hyperelastic::{Elements, ForcesOf, Law, MaterialSlope, ModuliWork, PlaceWork};
use crate::model::{Model, ModelError};
use crate::solve::equilibrium::{Adjoint, AdjointLoad, Equilibrium, NoAdjoint, Path};
use crate::solve::{Factored, Loads, Solution};

/// A term `a x + ½ b x²` of a quantity, x being a displacement or a reaction along one axis.
///
/// ```
/// use softgrasp_core::Term;
///
/// // Half the square of the displacement of node 7 along y from 2 mm: ½ (u − 0.002)², up to a constant.
/// let towards = Term { dof: 3 * 7 + 1, slope: -0.002, curvature: 1.0 };
/// assert_eq!(towards.slope_at(0.002), 0.0);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Term {
    /// Degree of freedom: `3 × node + axis`, from 0.
    pub dof: u32,
    /// a, per m or per N.
    pub slope: f64,
    /// b, per m² or per N².
    pub curvature: f64,
}

/// A quantity that is linear or quadratic in displacements and reactions: the sum of its terms.
///
/// ```
/// use softgrasp_core::{Quantity, Term};
///
/// // The force that holds node 0 along x.
/// let force = Term { dof: 0, slope: 1.0, curvature: 0.0 };
/// let held = Quantity { of_reactions: vec![force], ..Quantity::default() };
/// assert!(held.of_displacements.is_empty());
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Quantity {
    /// Terms of displacements.
    pub of_displacements: Vec<Term>,
    /// Terms of the forces that hold known degrees of freedom.
    pub of_reactions: Vec<Term>,
}

/// Derivatives of a quantity J, and J itself.
///
/// Shapes: N nodes of the system, mid-edge nodes that were made among them. Units: those of J per m, N,
/// Pa, m/s².
///
/// ```
/// use softgrasp_core::mesh::{BuiltIn, generate};
/// use softgrasp_core::{LoadCase, Material, Quantity, SoftBody, Term};
///
/// // How far a corner moves along x, by a force on any node.
/// let body = SoftBody::try_new(generate(BuiltIn::Cube, 64)?, Material::try_new(2.0e4, 0.3)?)?;
/// let mut held = LoadCase::new();
/// held.hold(0..16);
/// let corner = Term { dof: 3 * 63, slope: 1.0, curvature: 0.0 };
/// let moved = Quantity { of_displacements: vec![corner], ..Quantity::default() };
/// let (_, gradient) = body.gradient(&held, &moved)?;
/// // A force on the corner itself moves it most.
/// let most = gradient.by_forces.iter().fold(0.0, |most: f64, slope| most.max(slope.abs()));
/// assert!(gradient.by_forces[3 * 63] == most && most > 0.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Gradient {
    /// J.
    pub value: f64,
    /// By a force along each degree of freedom, 3N: the adjoint λ. Where the displacement is known, its
    /// support carries the force.
    pub by_forces: Vec<f64>,
    /// By each known displacement, in the order of the degrees of freedom.
    pub by_known: Vec<f64>,
    /// By Young's modulus and Poisson's ratio of each material, in the order of the materials.
    pub by_materials: Vec<MaterialSlope>,
    /// By the acceleration of the weight; `None` where there is no weight.
    pub by_acceleration: Option<Vector3<f64>>,
    /// By each pressure, in the order given.
    pub by_pressures: Vec<f64>,
    /// By the place at rest of each node of the mesh, three each; `None` where nobody asked.
    pub by_places: Option<Vec<f64>>,
}

/// What a gradient is asked of: a quantity, and the loads that are spread over the body.
///
/// Units: kg/m³, m/s², Pa.
#[derive(Clone, Debug)]
pub struct GradientOf<'a> {
    /// The quantity.
    pub quantity: &'a Quantity,
    /// Densities and acceleration of the weight, if there is one.
    pub weight: Option<(&'a [f64], Vector3<f64>)>,
    /// Triangles of the boundary and the pressure on them.
    pub pressures: Vec<(&'a [[u32; 3]], f64)>,
    /// Whether derivatives by the places of nodes are wanted.
    pub with_places: bool,
}

/// Why there are no derivatives.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoGradient {
    /// A term of a node that is not there.
    #[error("a quantity depends on node {node}, but the mesh has {node_count} nodes (0-based)")]
    NoSuchNode {
        /// Node, from 0.
        node: u32,
        /// Nodes of the mesh.
        node_count: usize,
    },
    /// A term of a reaction where no displacement is prescribed.
    #[error(
        "a quantity depends on the reaction of node {node} along axis {axis}, but no displacement is \
         prescribed there (0-based)"
    )]
    NoReaction {
        /// Node, from 0.
        node: u32,
        /// Axis: 0, 1 or 2.
        axis: u32,
    },
    /// A term that is no number.
    #[error("a quantity depends on node {node} by {value}, which is not a finite number")]
    NotFinite {
        /// Node, from 0.
        node: u32,
        /// The slope or the curvature.
        value: f64,
    },
    /// The equilibrium has no derivatives.
    #[error(transparent)]
    Adjoint(#[from] NoAdjoint),
    /// The adjoint cannot be solved for.
    #[error(transparent)]
    Model(#[from] ModelError),
}

/// An answer and a quantity at it.
struct At<'a> {
    model: &'a Model,
    /// Known degrees of freedom, ascending.
    known: &'a [u32],
    u: &'a [f64],
    reactions: &'a [f64],
}

/// A quantity and its own derivatives at an answer.
struct Slopes {
    value: f64,
    /// ∂J/∂u, 3N of the system.
    by_displacements: Vec<f64>,
    /// ∂J/∂R of the known degrees of freedom.
    by_reactions: Vec<f64>,
}

impl Term {
    /// Derivative of the term at x.
    pub fn slope_at(&self, x: f64) -> f64 {
        self.slope + self.curvature * x
    }

    /// The term at x.
    pub fn value_at(&self, x: f64) -> f64 {
        (self.slope + 0.5 * self.curvature * x) * x
    }
}

impl Quantity {
    /// Whether it has no term.
    pub fn is_empty(&self) -> bool {
        self.of_displacements.is_empty() && self.of_reactions.is_empty()
    }

    /// Whether its terms are numbers and belong to nodes and reactions that are there.
    ///
    /// Shapes: `known` degrees of freedom, ascending.
    ///
    /// # Errors
    /// [`NoGradient`] that names the node.
    pub fn check(&self, node_count: usize, known: &[u32]) -> Result<(), NoGradient> {
        for &Term { dof, slope, curvature } in
            self.of_displacements.iter().chain(&self.of_reactions)
        {
            let node = dof / 3;
            if node as usize >= node_count {
                return Err(NoGradient::NoSuchNode { node, node_count });
            }
            if let Some(value) = [slope, curvature].into_iter().find(|value| !value.is_finite()) {
                return Err(NoGradient::NotFinite { node, value });
            }
        }
        let mut dofs = self.of_reactions.iter().map(|term| term.dof);
        match dofs.find(|dof| known.binary_search(dof).is_err()) {
            Some(dof) => Err(NoGradient::NoReaction { node: dof / 3, axis: dof % 3 }),
            None => Ok(()),
        }
    }

    fn slopes(&self, at: &At<'_>) -> Result<Slopes, NoGradient> {
        self.check(at.model.mesh().node_count(), at.known)?;
        let mut slopes = Slopes {
            value: 0.0,
            by_displacements: vec![0.0; at.u.len()],
            by_reactions: vec![0.0; at.known.len()],
        };
        for term in &self.of_displacements {
            let dof = term.dof as usize;
            slopes.value += term.value_at(at.u[dof]);
            slopes.by_displacements[dof] += term.slope_at(at.u[dof]);
        }
        for term in &self.of_reactions {
            // It is there, or the check would have failed.
            if let Ok(place) = at.known.binary_search(&term.dof) {
                slopes.value += term.value_at(at.reactions[place]);
                slopes.by_reactions[place] += term.slope_at(at.reactions[place]);
            }
        }
        Ok(slopes)
    }
}

impl GradientOf<'_> {
    /// Derivatives at an equilibrium at large deformation, by the tangent there.
    ///
    /// `path` is that of the model, and `equilibrium` what it found last.
    ///
    /// # Errors
    /// [`NoGradient`], [`NoAdjoint`] where the equilibrium has no derivatives.
    pub fn at_equilibrium(
        &self,
        model: &Model,
        (path, equilibrium): (&Path, &Equilibrium),
    ) -> Result<Gradient, NoGradient> {
        let known = path.hold().dofs();
        let (u, reactions) = (path.displacement(), equilibrium.reactions.as_slice());
        let at = At { model, known, u, reactions };
        let slopes = self.quantity.slopes(&at)?;
        let of_known: Vec<f64> = slopes.by_reactions.iter().map(|slope| -slope).collect();
        let load = AdjointLoad { slopes: &slopes.by_displacements, known: &of_known };
        let adjoint = path.adjoint(equilibrium, &load)?;
        self.collected(&at, slopes, adjoint, (path.elements(), ForcesOf::TheLaw))
    }

    /// Derivatives at an answer by linear elasticity, with the factor that has given it.
    ///
    /// # Errors
    /// [`NoGradient`].
    pub fn at_solution(
        &self,
        model: &Model,
        (factored, solution): (&Factored, &Solution),
    ) -> Result<Gradient, NoGradient> {
        let known = factored.partition().known();
        let (u, reactions) = (solution.displacement.as_slice(), solution.reaction.as_slice());
        let at = At { model, known, u, reactions };
        let slopes = self.quantity.slopes(&at)?;
        let of_known: Vec<f64> = slopes.by_reactions.iter().map(|slope| -slope).collect();
        let mut forces = slopes.by_displacements.clone();
        known.iter().for_each(|&dof| forces[dof as usize] = 0.0);
        let loads = Loads { q_known: &of_known, forces: &forces, residual_rel: 0.0 };
        let solved = factored.solve(model.stiffness(), loads, &mut |_| {});
        let Solution { displacement: field, reaction: reactions, .. } =
            solved.map_err(ModelError::from)?;
        // Of small strains every law makes the same.
        let elements = model.hyperelastic(Law::NeoHookean)?;
        let adjoint = Adjoint { field, reactions };
        self.collected(&at, slopes, adjoint, (&elements, ForcesOf::LinearElasticity))
    }

    fn collected(
        &self,
        at: &At<'_>,
        slopes: Slopes,
        adjoint: Adjoint,
        (elements, forces): (&Elements, ForcesOf),
    ) -> Result<Gradient, NoGradient> {
        let Adjoint { field, reactions } = adjoint;
        let by_known = at.known.iter().zip(&reactions);
        let by_known =
            by_known.map(|(&dof, held)| slopes.by_displacements[dof as usize] - held).collect();
        let works = elements.material_work(at.u, &field, forces);
        let of_material = |(work, material): (&ModuliWork, &Material)| {
            let MaterialSlope { young, poisson } = work.by_material(elements.law(), material);
            MaterialSlope { young: -young, poisson: -poisson }
        };
        let by_materials = works.iter().zip(at.model.materials()).map(of_material).collect();
        let by_places = match self.with_places {
            true => Some(self.by_places(at, &field, (elements, forces))?),
            false => None,
        };
        Ok(Gradient {
            value: slopes.value,
            by_known,
            by_materials,
            by_acceleration: self.by_acceleration(at.model, &field)?,
            by_pressures: self.by_pressures(at.model, &field)?,
            by_places,
            by_forces: field,
        })
    }

    /// Work of the weight of unit accelerations in the adjoint.
    fn by_acceleration(
        &self,
        model: &Model,
        adjoint: &[f64],
    ) -> Result<Option<Vector3<f64>>, NoGradient> {
        let Some((densities, _)) = self.weight else { return Ok(None) };
        let mut slopes = Vector3::zeros();
        for axis in 0..3 {
            let along = Vector3::from_fn(|i, _| if i == axis { 1.0 } else { 0.0 });
            let weight = model.spread_loads().weight(densities, along).map_err(ModelError::from)?;
            slopes[axis] = work(&weight, adjoint);
        }
        Ok(Some(slopes))
    }

    /// Work of unit pressures in the adjoint.
    fn by_pressures(&self, model: &Model, adjoint: &[f64]) -> Result<Vec<f64>, NoGradient> {
        let of_one = |(triangles, _): &(&[[u32; 3]], f64)| -> Result<f64, NoGradient> {
            let forces = model.spread_loads().pressure(triangles, 1.0).map_err(ModelError::from)?;
            Ok(work(&forces, adjoint))
        };
        self.pressures.iter().map(of_one).collect()
    }

    fn by_places(
        &self,
        at: &At<'_>,
        adjoint: &[f64],
        (elements, forces): (&Elements, ForcesOf),
    ) -> Result<Vec<f64>, NoGradient> {
        let mesh = at.model.mesh();
        let (densities, acceleration) = match self.weight {
            None => (Vec::new(), Vector3::zeros()),
            Some((given, acceleration)) => {
                let of_tet = |tet: usize| {
                    let region = mesh.regions().get(tet).map_or(0, |region| *region as usize);
                    given.get(region).or(given.first()).copied().unwrap_or(0.0)
                };
                ((0..mesh.tets().len()).map(of_tet).collect::<Vec<_>>(), acceleration)
            }
        };
        let work = PlaceWork { u: at.u, v: adjoint, forces, densities: &densities, acceleration };
        let of_elements = elements.place_work(work);
        let mut slopes: Vec<f64> = of_elements.into_iter().map(|slope| -slope).collect();
        for (triangles, pressure) in &self.pressures {
            let loads = at.model.spread_loads();
            let of_load = loads.pressure_by_places(triangles, *pressure, adjoint);
            let of_load = of_load.map_err(ModelError::from)?;
            slopes.iter_mut().zip(of_load).for_each(|(slope, own)| *slope += own);
        }
        Ok(at.model.by_nodes_of_mesh(slopes))
    }
}

/// Work of forces in a displacement.
fn work(forces: &[f64], along: &[f64]) -> f64 {
    forces.iter().zip(along).map(|(f, u)| f * u).sum()
}
