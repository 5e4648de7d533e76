//! An equilibrium and what is known of it, or why there is none.

/// What was found.
///
/// Units: N, 1.
#[derive(Clone, Debug)]
pub struct Equilibrium {
    /// Forces that hold the body at the known degrees of freedom, in their order, N.
    pub reactions: Vec<f64>,
    /// Force of each mask on the body, three each, N.
    pub mask_forces: Vec<f64>,
    /// Norm of the forces that are out of balance over that of the forces that hold the body.
    pub residual_rel: f64,
    /// Estimated error of a displacement over the largest displacement.
    pub error_estimate_rel: f64,
    /// Estimated error in the energy norm over the energy norm of the displacement.
    pub energy_error_rel: f64,
    /// Stored energy, J; the elastic one where elements yield, with what a step dissipates as long
    /// as time cuts it short.
    pub energy: f64,
    /// Smallest volume ratio of an element.
    pub jacobian_min: f64,
    /// Steps that were taken with a tangent or a correction of one.
    pub newton_steps: u32,
    /// Solves with a factor.
    pub linear_solves: u32,
    /// Factors made while this was waited for.
    pub factors: u32,
    /// Frames since the shape that the newest factor belongs to.
    pub factor_age: u32,
    /// Pieces that the motion of the known displacements was cut into.
    pub substeps: u32,
    /// The equilibrium lies further from where the tangent led than the tangent led: a snap-through.
    pub jumped: bool,
    /// The residual is rounding, or below 1e-8.
    pub settled: bool,
    /// Largest accumulated plastic strain of an element's point; 0 without a yield stress.
    pub plastic_strain: f64,
}

/// Why no equilibrium was found; the shape stays what it was.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoEquilibrium {
    /// However small the pieces of the motion are, an element would turn inside out.
    #[error(
        "no equilibrium found: after {:.0} % of the motion an element would turn inside out; move \
         less, or use a finer mesh there", 100.0 * share
    )]
    InsideOut {
        /// Share of the motion that was followed.
        share: f64,
    },
    /// The branch of equilibria that the motion leads along ends, and no other was found.
    #[error(
        "no equilibrium found: after {:.0} % of the motion the branch of equilibria ends, and no other \
         stable shape was found downhill of it (forces out of balance by {residual_rel:.1e} of those \
         that hold the body); move or load it less, or by another way", 100.0 * share
    )]
    BranchEnded {
        /// Share of the motion that was followed.
        share: f64,
        /// Imbalance that was left, relative to the forces that hold the body.
        residual_rel: f64,
    },
    /// The surface creases: an element is pressed further than any smooth surface can be.
    #[error(
        "no equilibrium found: after {:.0} % of the motion an element is pressed to {:.0} % of its \
         length; surfaces crease from about 60 % on, and no mesh follows them there; press less deep, \
         or over a larger patch", 100.0 * share, 100.0 * stretch
    )]
    Creased {
        /// Share of the motion that was followed.
        share: f64,
        /// Smallest principal stretch.
        stretch: f64,
    },
    /// The material can hardly change its volume, and the elements cannot follow without.
    #[error(
        "no equilibrium found: after {:.0} % of the motion the elements cannot go on without a change \
         of volume, which a Poisson's ratio of {poisson} hardly allows; ask for elements that do not \
         lock (t4-anp), lower Poisson's ratio, or move less", 100.0 * share
    )]
    Incompressible {
        /// Share of the motion that was followed.
        share: f64,
        /// Largest Poisson's ratio.
        poisson: f64,
    },
    /// Forces pull the body out without end.
    #[error(
        "no equilibrium found: at {:.0} % of the motion the forces draw the body to {stretch:.1} times \
         its length and still are not held; use smaller forces, or a stiffer material", 100.0 * share
    )]
    Overloaded {
        /// Share of the motion that was followed.
        share: f64,
        /// Largest principal stretch.
        stretch: f64,
    },
    /// Neither the tangent nor its positive part has a factor.
    #[error(
        "no equilibrium found: the tangent stiffness is singular, something can move without any \
         force; hold more nodes, or nodes further apart"
    )]
    Singular,
    /// Young's modulus or size beyond what energies can be worked out for.
    #[error(
        "no equilibrium found: the stiffness of an element is {stiffness:.0e} N/m, and energies at \
         large deformation are numbers from 1e-100 to 1e100 N/m only; use other units for Young's \
         modulus or the size"
    )]
    OutOfRange {
        /// Largest entry of the stiffness' diagonal at rest, N/m.
        stiffness: f64,
    },
    /// Forces did not come into balance.
    #[error(
        "no equilibrium found: after {:.0} % of the motion and {solves} solves the forces are out of \
         balance by {residual_rel:.1e} of those that hold the body", 100.0 * share
    )]
    NotConverged {
        /// Share of the motion that was followed.
        share: f64,
        /// Solves with a factor that were made.
        solves: u32,
        /// Imbalance that was left, relative to the forces that hold the body.
        residual_rel: f64,
    },
    /// The tangent has no factor.
    #[error("no equilibrium found: {0}")]
    Factor(#[from] super::FactorError),
    /// Displacements or forces are too large for double precision.
    #[error("no equilibrium found: displacements or forces are not finite numbers")]
    NotFinite,
}
