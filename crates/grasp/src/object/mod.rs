//! The object in the hand: which one it is, its shape at rest, and its shape as it is now.

mod choice;
mod contact_model;
mod regions;
mod rest_shape;
mod resting;
mod soft_object;

pub use choice::ObjectChoice;
pub use contact_model::{ContactModel, UnknownContact};
pub use regions::Regions;
pub use rest_shape::{ObjectError, RestShape};
pub use resting::{centre_of_mass, lying, resting_turn};
pub use soft_object::SoftObject;
