//! How a step in time is made: its length, weight, viscosity, and how exactly it is solved; and why a
//! step cannot be made.

use nalgebra::Vector3;

use crate::contact::coulomb::ProblemError;
use crate::solve::condensed::CondensedError;

/// How a step is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepSettings {
    /// Length of the step, s.
    pub seconds: f64,
    /// Acceleration of free fall, m/s², world.
    pub gravity: Vector3<f64>,
    /// Density of the object, kg/m³.
    pub density: f64,
    /// Time in which the shape forgets a force (Kelvin and Voigt), s.
    pub viscosity: f64,
    /// Penetration that is small enough, as a share of the object's size.
    pub penetration_rel: f64,
    /// Residual of the contact law that is small enough, as a share of the largest force.
    pub residual_rel: f64,
    /// Most times that the contact problem is made anew.
    pub rounds_max: usize,
    /// Steps of Newton's method after which no further round is begun.
    pub newton_max: usize,
    /// Most points of one contact problem: its memory grows with the square of their number
    /// ([`StepSettings::bytes_of_points`]), its time with the cube.
    pub points_max: usize,
    /// Whether the small system of the step is wanted.
    pub small_system: bool,
}

impl StepSettings {
    /// Points that fit a problem which nobody has reserved memory for.
    pub const POINTS_USUAL: usize = 600;
    /// Points of the largest problem that is taken on.
    pub const POINTS_MOST: usize = 2000;

    /// Bytes of the matrices of a problem with so many points, at most.
    pub fn bytes_of_points(points: usize) -> u64 {
        // The compliance, those of the points that press and of a proximal step, a factor, three of a splitting.
        7 * 9 * size_of::<f64>() as u64 * (points as u64).pow(2)
    }
}

impl Default for StepSettings {
    fn default() -> Self {
        Self {
            seconds: 0.01,
            gravity: Vector3::new(0.0, 0.0, -9.81),
            density: 1000.0,
            viscosity: 0.0,
            penetration_rel: 1e-6,
            residual_rel: 1e-9,
            rounds_max: 16,
            newton_max: 400,
            points_max: Self::POINTS_MOST,
            small_system: false,
        }
    }
}

/// Why a step cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StepError {
    /// A setting is out of its range.
    #[error("{what} is {value}; it must be {expected}")]
    Setting {
        /// Name of the setting.
        what: &'static str,
        /// Value of the setting.
        value: f64,
        /// Range of the setting, in words.
        expected: &'static str,
    },
    /// A candidate that names what is not there.
    #[error(
        "candidate {candidate} names triangle {triangle} of {triangles} and body {body} of {bodies}"
    )]
    Candidate {
        /// Position in the list of candidates.
        candidate: usize,
        /// Triangle that the candidate names.
        triangle: u32,
        /// Number of triangles.
        triangles: usize,
        /// Body that the candidate names.
        body: u16,
        /// Number of bodies.
        bodies: usize,
    },
    /// A node of the state that is not there.
    #[error("the state names node {node}, but the mesh has {node_count} nodes (0-based)")]
    Node {
        /// The node, from 0.
        node: u32,
        /// Nodes of the mesh.
        node_count: usize,
    },
    /// More points touch than one problem takes.
    #[error(
        "{points} points of the surface touch at once, at most {max} can; take a coarser mesh, or \
         bodies that cover less of it"
    )]
    TooManyPoints {
        /// Points of the surface that touch.
        points: usize,
        /// Points that one problem takes.
        max: usize,
    },
    /// State or pose that is not finite.
    #[error("a number of the object's state or of a body's pose is not finite")]
    NotFinite,
    /// No shape at large deformation answers the forces of the state.
    #[error(
        "no shape was found that the forces of the object's state hold (what is left is \
         {residual_rel:.1e} of them); begin from rest"
    )]
    NoShape {
        /// Residual that was left, over the forces.
        residual_rel: f64,
    },
    /// Wherever contact leads, an element would turn inside out.
    #[error(
        "an element would turn inside out wherever the bodies press the object to; move them less in \
         a step, or use a finer mesh there"
    )]
    InsideOut,
    /// The elastic part failed.
    #[error(transparent)]
    Elastic(#[from] CondensedError),
    /// The contact problem could not be made.
    #[error(transparent)]
    Problem(#[from] ProblemError),
}
