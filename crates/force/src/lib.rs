//! The force of a grasp for the hand that grasps: rendered at 1 kHz between the answers of the server,
//! safely, to devices that take newtons or levels.
//!
//! The server answers at the rate of the hand, and late. A [`SmallSystem`] says how the forces of the
//! bodies that press depend on where these are; the [`LocalModel`] solves its contact problem anew each
//! millisecond. A virtual coupling ([`coupling`]) softens what a device cannot hold, [`energy`] sees to it
//! that no energy is created, [`safeguard`] that no hand is struck. [`Rendering`] is one tick of all that,
//! without clock and device; [`Renderer`] is the thread that plays it, and [`device`] has what the devices
//! say. The derivation and the limits are in `docs/force.md`.
//!
//! ```
//! use nalgebra::{DMatrix, Point3, Vector3};
//! use softgrasp_force::{LocalModel, SmallContact, SmallSystem};
//!
//! // A finger presses down on a spring of 200 N/m with one newton.
//! let contact = SmallContact {
//!     body: 0,
//!     port: Some(0),
//!     place_in_body: Point3::origin(),
//!     place: Point3::origin(),
//!     normal: -Vector3::z(),
//!     force: -Vector3::z(),
//!     friction: 0.5,
//! };
//! let system = SmallSystem::try_new(vec![contact], DMatrix::identity(3, 3) / 200.0)?;
//! let mut model = LocalModel::new(system, f64::INFINITY);
//! // A millimetre deeper it presses with 1.2 N.
//! let deeper = model.forces_at(&[Point3::new(0.0, 0.0, -1e-3)]);
//! assert!((deeper.forces[0].z + 1.2).abs() < 1e-9);
//! # Ok::<(), softgrasp_force::SystemError>(())
//! ```

pub mod coupling;
pub mod device;
pub mod energy;
pub mod limits;
mod local_model;
#[cfg(test)]
mod local_model_tests;
mod newest;
#[cfg(test)]
mod passivity_tests;
mod renderer;
pub mod rendering;
mod report;
pub mod safeguard;
mod small_system;
mod target;

pub use limits::DeviceLimits;
pub use local_model::{LocalForces, LocalModel};
pub use newest::{Held, Newest};
pub use renderer::{ForceError, Renderer};
pub use rendering::Rendering;
pub use report::{ForceReport, ReleaseReport};
pub use small_system::{CONTACTS_MAX, SmallContact, SmallSystem, SystemError};
pub use target::{HAPLY_URL, Target, TargetError};
