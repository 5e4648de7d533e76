//! Makes and keeps a model, proves its eigenvalue bound, and prefetches columns for its frames.

use std::sync::Arc;

use softgrasp_core::model::Model;
use softgrasp_core::solve::condensed::{CONTACTS_TOGETHER, Contact};
use softgrasp_core::solve::memory::SENSIBLE;
use softgrasp_protocol::{ModelHash, ModelReady, Prefetch, UploadModel};

use crate::budget::Reservation;
use crate::clock::StageClock;
use crate::plan::{PlanError, Subject, admit};
use crate::refusal::Refusal;
use crate::request::{check_node_count, element_of, model_of, paired};
use crate::resources::Resources;
use crate::store::{Allowed, StoredModel};

/// Nodes or masks prefetched before other waiting work is looked for: as many as one solve takes.
const PREFETCH_TOGETHER: usize = CONTACTS_TOGETHER;

/// Makes a model and keeps it. The base for `condensed` is made with it, so that no frame question has to
/// wait for it.
///
/// # Errors
/// [`Refusal`] if the request cannot be answered.
pub(crate) fn upload(
    resources: &Resources,
    hash: ModelHash,
    upload: UploadModel,
    reservation: Reservation,
    mut clock: StageClock,
) -> Result<ModelReady, Refusal> {
    let found = resources.models.find(hash);
    let reused = found.is_some();
    let stored = match found {
        Some(stored) => stored,
        None => {
            let UploadModel { mesh, materials, element, fixed } = upload;
            check_node_count(&mesh, resources.config.max_nodes)?;
            let element = element_of(element);
            let subject = Subject::once(&mesh, fixed.len());
            let needs = subject.predict(element, &SENSIBLE);
            admit(&resources.models, &reservation, &needs, &subject).map_err(PlanError::Memory)?;
            let model = model_of(mesh, &materials, element, fixed, &mut clock)?;
            let stored = Arc::new(stored(resources, &reservation, model, &mut clock));
            // A shape that cannot be condensed can still be solved by the other methods.
            if let Err(error) = stored.base() {
                tracing::info!(%error, "this shape is not condensed");
            }
            resources.models.keep(hash, Arc::clone(&stored), reservation);
            stored
        }
    };
    let fixed_dofs = stored.model.fixed().len() as u64;
    let unknown_dofs = stored.model.modelled_dofs() as u64 - fixed_dofs;
    Ok(ModelReady { model: hash, unknown_dofs, fixed_dofs, reused, stage_ms: clock.finish() })
}

/// A model with its base, within the memory that other reservations leave.
pub(super) fn stored(
    resources: &Resources,
    reservation: &Reservation,
    model: Model,
    clock: &mut StageClock,
) -> StoredModel {
    let column_cache = resources.config.column_cache;
    let allowed = Allowed { bytes: reservation.free(), column_cache };
    let stored = StoredModel::new(model, allowed, &mut |stage| clock.begin(stage));
    reservation.settle(stored.lasting_bytes());
    stored
}

/// Whether there is memory for the second factor that a proof takes, beside a model that only this
/// request holds.
pub(super) fn may_prove(reservation: &Reservation, stored: &StoredModel) -> bool {
    let proof = stored.base().map_or(0, |base| base.proof_bytes());
    let fits = reservation.reserve(stored.lasting_bytes().saturating_add(proof), 0);
    if !fits {
        tracing::info!(proof, "no memory for the proof of the error bound");
    }
    fits
}

/// Proves a lower bound on the smallest eigenvalue of a kept model, from which later error bounds follow.
/// Returns at once if another thread proves it already.
pub(crate) fn prove(resources: &Resources, model: ModelHash) {
    let Some(stored) = resources.models.find(model) else { return };
    let Some(_claimed) = stored.proof_under_way.take() else { return };
    let reservation = resources.budget.reservation();
    if let Ok(base) = stored.base()
        && base.eigenvalue_min().is_none()
        && reservation.reserve(base.proof_bytes(), stored.lasting_bytes())
    {
        resources.models.make_room(Some(model));
        base.estimate_condition();
        base.prove_eigenvalue_min();
    }
}

/// Computes the columns of nodes and masks that may be touched soon, a few at a time, so that frame
/// questions come first. Skips nodes and masks that do not fit the model; nothing is answered.
pub(crate) fn prefetch(resources: &Resources, hint: &Prefetch) {
    let Some(stored) = resources.models.find(hint.model) else { return };
    let Ok(base) = stored.base() else { return };
    let node_count = stored.model.mesh().node_count();
    let used = |n: &&u32| (**n as usize) < node_count && stored.model.is_used(**n as usize);
    let nodes = hint.nodes.iter().filter(used).map(|&n| Contact::Node(n));
    let masks = hint.masks.iter().filter_map(|mask| {
        let made = stored.model.masks([paired(mask)]).ok()?;
        made.into_iter().next().map(Contact::Mask)
    });
    let contacts: Vec<Contact> = nodes.chain(masks).collect();
    for some in contacts.chunks(PREFETCH_TOGETHER) {
        if let Err(error) = stored.columns.of_contacts(&base, some) {
            tracing::debug!(%error, "prefetch ends");
            break;
        }
        rayon::yield_now();
    }
    resources.models.trim();
}
