//! Models kept between requests, with what has been made for them, under the memory budget.

mod kept_loads;
mod mesh_store;
mod model_store;
mod recent;
mod stored_model;

pub(crate) use kept_loads::{FrameLoads, UnitKey};
pub(crate) use mesh_store::MeshStore;
pub(crate) use model_store::ModelStore;
pub(crate) use stored_model::{Allowed, Asked, StoredModel};
