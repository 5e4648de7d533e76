//! A load case: prescribed displacements (Dirichlet values) and forces, by node; and its answer:
//! displacements, reactions and their error, or why there are none.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use crate::gradient::{GradientOf, NoGradient, Quantity};
use crate::model::{Known, Model, ModelError};
use crate::solve::condensed::CondensedError;
use crate::solve::equilibrium::NoEquilibrium;

/// An axis of the mesh's frame.
///
/// ```
/// use softgrasp_core::{Axis, LoadCase};
///
/// // Node 5 is moved along x, stays where it is along y, and is free along z.
/// let mut sliding = LoadCase::new();
/// sliding.prescribe_along(5, Axis::X, 2e-3).prescribe_along(5, Axis::Y, 0.0);
/// assert_ne!(sliding, LoadCase::new());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// Displacements and forces along x.
    X,
    /// Displacements and forces along y.
    Y,
    /// Displacements and forces along z.
    Z,
}

/// Prescribed displacements and forces. What is not prescribed is free; what is named twice has the
/// later value.
///
/// Units: m, N. Frame: that of the mesh.
///
/// ```
/// use nalgebra::Vector3;
/// use softgrasp_core::mesh::{BuiltIn, generate};
/// use softgrasp_core::{Axis, LoadCase, Material, SoftBody};
///
/// let body = SoftBody::try_new(generate(BuiltIn::Cube, 64)?, Material::try_new(2.0e4, 0.3)?)?;
/// let mut case = LoadCase::new();
/// case.hold([0, 1, 4]).prescribe_along(63, Axis::Z, -1e-3);
/// case.force(60, Vector3::new(0.0, 0.0, -0.1));
/// let answer = body.solve(&case)?;
/// assert_eq!(answer.displacements[63].z, -1e-3);
/// // What is prescribed has a reaction, what is pulled at has none.
/// assert!(answer.reactions.contains_key(&63) && !answer.reactions.contains_key(&60));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadCase {
    prescribed: BTreeMap<u32, [Option<f64>; 3]>,
    forces: BTreeMap<u32, Vector3<f64>>,
    /// Densities, kg/m³, and acceleration, m/s².
    weight: Option<(Vec<f64>, Vector3<f64>)>,
    /// Triangles of the boundary and the pressure on them, Pa.
    pressures: Vec<(Vec<[u32; 3]>, f64)>,
}

impl LoadCase {
    /// Nothing is prescribed and nothing pulls.
    pub fn new() -> Self {
        Self::default()
    }

    /// Holds nodes (from 0) where they are.
    pub fn hold(&mut self, nodes: impl IntoIterator<Item = u32>) -> &mut Self {
        nodes.into_iter().fold(self, |case, node| case.prescribe(node, Vector3::zeros()))
    }

    /// Prescribes the displacement of a node (from 0) along all axes, m.
    pub fn prescribe(&mut self, node: u32, displacement: Vector3<f64>) -> &mut Self {
        self.prescribed.insert(node, <[f64; 3]>::from(displacement).map(Some));
        self
    }

    /// Prescribes the displacement of a node (from 0) along one axis, m; it stays free along the others.
    pub fn prescribe_along(&mut self, node: u32, axis: Axis, displacement: f64) -> &mut Self {
        self.prescribed.entry(node).or_default()[axis as usize] = Some(displacement);
        self
    }

    /// A force on a node (from 0), N.
    pub fn force(&mut self, node: u32, force: Vector3<f64>) -> &mut Self {
        self.forces.insert(node, force);
        self
    }

    /// The weight of the body: its density (kg/m³), or one for each region of the mesh, in an even field of
    /// acceleration, m/s².
    ///
    /// ```
    /// use nalgebra::Vector3;
    /// use softgrasp_core::mesh::{BuiltIn, generate};
    /// use softgrasp_core::{LoadCase, Material, SoftBody};
    ///
    /// // A cube of 64 nodes stands on its lowest 16 and carries its own weight.
    /// let cube = generate(BuiltIn::Cube, 64)?;
    /// let volume: f64 = (0..cube.tets().len()).map(|tet| cube.signed_volume(tet).abs()).sum();
    /// let body = SoftBody::try_new(cube, Material::try_new(2.0e4, 0.3)?)?;
    /// let mut standing = LoadCase::new();
    /// standing.hold(0..16).weight(&[1000.0], Vector3::new(0.0, 0.0, -9.81));
    /// let answer = body.solve(&standing)?;
    /// let held = answer.reactions.values().map(|force| force.z).sum::<f64>();
    /// assert!((held - 9810.0 * volume).abs() < 1e-9 * held);
    /// assert!(answer.displacements[63].z < 0.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn weight(&mut self, densities: &[f64], acceleration: Vector3<f64>) -> &mut Self {
        self.weight = Some((densities.to_vec(), acceleration));
        self
    }

    /// An even pressure (Pa) on triangles of the boundary, against their outward normal at rest. Several add
    /// up.
    pub fn pressure(&mut self, triangles: &[[u32; 3]], pressure: f64) -> &mut Self {
        self.pressures.push((triangles.to_vec(), pressure));
        self
    }

    /// What the gradient of a quantity under this load case is asked of, places of nodes among it.
    pub(super) fn gradient_of<'a>(&'a self, quantity: &'a Quantity) -> GradientOf<'a> {
        let weight = self.weight.as_ref();
        GradientOf {
            quantity,
            weight: weight.map(|(densities, acceleration)| (densities.as_slice(), *acceleration)),
            pressures: self.pressures.iter().map(|(on, value)| (on.as_slice(), *value)).collect(),
            with_places: true,
        }
    }

    /// Known degrees of freedom with their values, and forces on all degrees of freedom of a model.
    ///
    /// # Errors
    /// [`SoftBodyError`] for nodes that are not there and for contradictions.
    pub(super) fn of(&self, model: &Model) -> Result<(Known, Vec<f64>), SoftBodyError> {
        let pairs = self.prescribed.iter().flat_map(|(node, values)| {
            let dof = |axis: u32| node.saturating_mul(3).saturating_add(axis);
            let named = (0..3u32).zip(values);
            named.filter_map(move |(axis, value)| value.map(|value| (dof(axis), value)))
        });
        let known = model.known(pairs.collect())?;
        Ok((known, self.forces_on(model)?))
    }

    fn forces_on(&self, model: &Model) -> Result<Vec<f64>, SoftBodyError> {
        if self.forces.is_empty() && self.weight.is_none() && self.pressures.is_empty() {
            return Ok(Vec::new());
        }
        let body = model.spread_loads();
        let mut forces = match &self.weight {
            Some((densities, acceleration)) => {
                body.weight(densities, *acceleration).map_err(ModelError::from)?
            }
            None => vec![0.0; 3 * model.system_node_count()],
        };
        for (triangles, pressure) in &self.pressures {
            let pressed = body.pressure(triangles, *pressure).map_err(ModelError::from)?;
            forces.iter_mut().zip(pressed).for_each(|(sum, f)| *sum += f);
        }
        for (&node, force) in &self.forces {
            let at = node as usize;
            if at >= model.mesh().node_count() || !model.is_used(at) {
                return Err(SoftBodyError::LooseForce { node });
            }
            let values = self.prescribed.get(&node).copied().unwrap_or_default();
            if values.iter().zip(force.iter()).any(|(value, f)| value.is_some() && *f != 0.0) {
                return Err(SoftBodyError::ForceOnPrescribed { node });
            }
            forces[3 * at..3 * at + 3].iter_mut().zip(force.iter()).for_each(|(sum, f)| *sum += f);
        }
        Ok(forces)
    }
}

/// Displacements under a load case.
///
/// Shapes: N nodes of the mesh. Units: m, N. Frame: that of the mesh.
///
/// ```
/// use nalgebra::Vector3;
/// use softgrasp_core::mesh::{BuiltIn, generate};
/// use softgrasp_core::{LoadCase, Material, SoftBody};
///
/// let body = SoftBody::try_new(generate(BuiltIn::Cube, 64)?, Material::try_new(2.0e4, 0.3)?)?;
/// let mut pull = LoadCase::new();
/// pull.hold([0, 1, 4]).force(63, Vector3::new(0.2, 0.0, 0.0));
/// let answer = body.solve(&pull)?;
/// // The body hangs in its three nodes: they carry what pulls at it.
/// let held = answer.reactions.values().fold(Vector3::zeros(), |sum, force| sum + force);
/// assert!((held + Vector3::new(0.2, 0.0, 0.0)).norm() < 1e-9);
/// assert!(answer.displacements[63].x > 0.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// Displacement of every node; zero where no element uses the node.
    pub displacements: Vec<Vector3<f64>>,
    /// Force that holds each node with prescribed displacements, along the prescribed axes.
    pub reactions: BTreeMap<u32, Vector3<f64>>,
    /// Norm of the forces that are out of balance over that of the forces that act.
    pub residual_rel: f64,
    /// How far the displacements may be from the exact solution of the discrete equations.
    pub inexactness: Inexactness,
}

/// The error of displacements against the exact solution of the discrete equations, relative. That of
/// the mesh is not in it.
///
/// ```
/// use softgrasp_core::Inexactness;
///
/// assert_eq!(Inexactness::Proven(1e-9).relative(), 1e-9);
/// assert_eq!(Inexactness::Unknown("nothing has been proven").relative(), f64::INFINITY);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Inexactness {
    /// Proven: the Euclidean norm of the error over that of the displacements is no larger
    /// (`docs/bound.md`).
    Proven(f64),
    /// Estimated: the largest error of a displacement over the largest displacement.
    Estimated(f64),
    /// Not known, and why.
    Unknown(&'static str),
}

/// An equilibrium at large deformation.
///
/// Units: J, 1.
///
/// ```
/// use nalgebra::Vector3;
/// use softgrasp_core::mesh::{BuiltIn, generate};
/// use softgrasp_core::{Law, LoadCase, Material, SoftBody};
///
/// // A corner of a cube is pulled out by a third of the cube's edge.
/// let cube = generate(BuiltIn::Cube, 64)?;
/// let edge = cube.bounds().1.x - cube.bounds().0.x;
/// let mut pull = LoadCase::new();
/// pull.hold(0..16).prescribe(63, Vector3::new(0.0, 0.0, edge / 3.0));
/// let body = SoftBody::try_new(cube, Material::try_new(2.0e4, 0.3)?)?;
/// let pulled = body.equilibrium(&pull, Law::NeoHookean)?;
/// assert!(pulled.energy > 0.0 && pulled.volume_ratio_min > 0.0 && !pulled.jumped);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct LargeAnswer {
    /// Displacements from the shape at rest, reactions, residual and error.
    pub answer: Answer,
    /// Stored elastic energy.
    pub energy: f64,
    /// Smallest ratio of an element's volume to that at rest.
    pub volume_ratio_min: f64,
    /// Whether the shape is not on the branch of equilibria that begins at rest, or not known to be.
    pub jumped: bool,
}

/// Why there is no answer.
///
/// ```
/// use nalgebra::Vector3;
/// use softgrasp_core::mesh::{BuiltIn, generate};
/// use softgrasp_core::{LoadCase, Material, SoftBody, SoftBodyError};
///
/// let body = SoftBody::try_new(generate(BuiltIn::Cube, 64)?, Material::try_new(2.0e4, 0.3)?)?;
/// // One node does not hold a body against rigid rotations.
/// let mut hanging = LoadCase::new();
/// hanging.hold([0]);
/// assert!(matches!(body.solve(&hanging), Err(SoftBodyError::Model(_))));
/// let mut twice = LoadCase::new();
/// twice.hold([0, 1, 4]).force(4, Vector3::new(1.0, 0.0, 0.0));
/// assert_eq!(body.solve(&twice), Err(SoftBodyError::ForceOnPrescribed { node: 4 }));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SoftBodyError {
    /// The model cannot be asked that.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The columns of the compliance give no answer.
    #[error(transparent)]
    Condensed(#[from] CondensedError),
    /// No equilibrium at large deformation.
    #[error(transparent)]
    Equilibrium(#[from] NoEquilibrium),
    /// No derivatives.
    #[error(transparent)]
    Gradient(#[from] NoGradient),
    /// A force on a node that nothing holds on to.
    #[error("a force acts on node {node}, which no element uses (0-based)")]
    LooseForce {
        /// Node, from 0.
        node: u32,
    },
    /// Force and displacement of one degree of freedom.
    #[error(
        "node {node} (0-based) has a force along an axis along which its displacement is prescribed; \
         one of both is unknown"
    )]
    ForceOnPrescribed {
        /// Node, from 0.
        node: u32,
    },
}

impl Inexactness {
    /// The number, whichever way it was found; infinity where it is not known.
    pub fn relative(&self) -> f64 {
        match self {
            Self::Proven(error) | Self::Estimated(error) => *error,
            Self::Unknown(_) => f64::INFINITY,
        }
    }
}

/// Displacements of the nodes of the mesh; those of mid-edge nodes come behind them.
pub(super) fn by_node(model: &Model, displacement: &[f64]) -> Vec<Vector3<f64>> {
    let nodes = displacement.as_chunks::<3>().0.iter().take(model.mesh().node_count());
    nodes.map(|u| Vector3::from(*u)).collect()
}

/// Reactions by node; zero along axes that are not prescribed.
pub(super) fn reactions(dofs: &[u32], forces: &[f64]) -> BTreeMap<u32, Vector3<f64>> {
    let mut reactions = BTreeMap::new();
    for (dof, force) in dofs.iter().zip(forces) {
        reactions.entry(dof / 3).or_insert_with(Vector3::zeros)[(dof % 3) as usize] = *force;
    }
    reactions
}
