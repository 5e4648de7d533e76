//! Turns a decoded message into what the core takes, checked before anything costly is done.

mod checks;
mod contact;
mod loads;
mod model;
mod question;

pub(crate) use checks::{check_nodes, checked_masks, paired, pairs, scatter_forces};
pub(crate) use contact::{bodies_of, settings_of, state_message, state_of};
pub(crate) use loads::{check_frame, checked_forces, frame_loads};
pub(crate) use model::{
    check_node_count, element_given, element_of, mesh_of, model_of, name_of, poisson_max,
};
pub(crate) use question::question_of;
