//! What is grasped and what grasps it: object, sphere tree, hand, and the rules of the grasp.
//!
//! [`object`] is a mesh at rest and as it is deformed, [`sphere_tree`] finds which of its surface
//! vertices a shape touches, [`hand`] turns joint angles into the poses of finger segments and their
//! colliders, and [`grasp`] is the state machine that decides what the fingertips hold (thesis
//! chapter 4). Like `softgrasp-core` it does no I/O and has no clock and no threads of its own; the
//! server does not need it.
//!
//! ```
//! use nalgebra::{Isometry3, Vector3};
//! use softgrasp_core::mesh::{BuiltIn, generate};
//! use softgrasp_grasp::grasp::{Grasp, sense};
//! use softgrasp_grasp::hand::{HandColliders, HandDimensions, JointAngles, pose};
//! use softgrasp_grasp::object::SoftObject;
//!
//! let object = SoftObject::try_new(generate(BuiltIn::Cube, 512)?)?;
//! let dimensions = HandDimensions::default();
//! let palm = Isometry3::from_parts(Vector3::new(0.0, 0.3, 0.0).into(), Default::default());
//! let hand = pose(&dimensions, &JointAngles::flat(), palm);
//! let fingers = sense(
//!     object.tree(),
//!     object.normals(),
//!     &HandColliders::new(&dimensions, &hand),
//!     &Isometry3::identity(),
//!     0.002,
//! );
//! assert!(fingers.iter().all(|finger| finger.tip_hits[0].is_none()), "30 cm away");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod grasp;
pub mod hand;
pub mod object;
pub mod shape;
pub mod sphere_tree;
