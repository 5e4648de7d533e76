//! The models that one session holds: no other session's `Drop` removes them.

use std::collections::BTreeSet;
use std::sync::Arc;

use softgrasp_protocol::ModelHash;

use crate::resources::Resources;

/// Models that a session holds; all are released when it ends.
pub(crate) struct HeldModels {
    resources: Arc<Resources>,
    held: BTreeSet<ModelHash>,
}

impl HeldModels {
    /// No model held yet.
    pub fn new(resources: Arc<Resources>) -> Self {
        Self { resources, held: BTreeSet::new() }
    }

    /// Holds a model if the server keeps it; returns whether it does.
    pub fn hold(&mut self, model: ModelHash) -> bool {
        let Resources { models, meshes, .. } = &*self.resources;
        match self.held.contains(&model) {
            true => models.find(model).is_some() || meshes.find(model).is_some(),
            false => {
                let is_kept = models.hold(model) || meshes.hold(model);
                if is_kept {
                    self.held.insert(model);
                }
                is_kept
            }
        }
    }

    /// Releases a model that this session holds; the server forgets it unless another session holds it.
    pub fn drop_model(&mut self, model: ModelHash) {
        if self.held.remove(&model) {
            let Resources { models, meshes, .. } = &*self.resources;
            models.release(model);
            meshes.release(model);
            models.forget(model);
            meshes.forget(model);
        }
    }
}

impl Drop for HeldModels {
    fn drop(&mut self) {
        for model in &self.held {
            self.resources.models.release(*model);
            self.resources.meshes.release(*model);
        }
    }
}
