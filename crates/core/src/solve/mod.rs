//! Known and unknown degrees of freedom, and the methods that solve for the unknown (thesis 3.4).

mod certainty;
pub mod choose;
pub mod condensed;
mod direct;
pub mod equilibrium;
mod front;
mod k11;
pub mod memory;
mod method;
mod mobility;
mod multigrid;
mod oracle;
mod ordering;
mod partition;
mod pcg;
pub mod rates;
mod tiles;
pub(crate) mod vectors;
pub mod work;
mod worked_out;
mod zero_energy;

pub use certainty::{Certainty, ERROR_REFUSED, ERROR_SERIOUS, ERROR_UNREMARKABLE};
pub use direct::{Analysed, Factored, Fallback, Loads, Solution, SolveError};
pub use front::{FrontAnalysis, FrontError, FrontFactor, FrontPrecision};
pub use method::Stage;
pub use method::{Method, UnknownMethod, Within};
pub use mobility::{FreeMotion, Motion, find_free_motion};
pub use partition::{KnownDisplacements, KnownError, Partition, PartitionError};
pub use zero_energy::RigidBodies;
