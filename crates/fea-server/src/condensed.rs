//! An answer from cached columns of the compliance: what a frame costs once a contact is known.

use std::sync::Arc;
use std::time::Instant;

use softgrasp_core::model::{Known, ModelError};
use softgrasp_core::solve::Stage;
use softgrasp_core::solve::condensed::{
    Base, Certificate, Contact, ContactAnswer, ContactSet, Delivery, Touched,
};
use softgrasp_protocol::{
    Answer, Displacements, DofValue, NodeChoice, Precision, Prefetch, Question, SolveReport,
};

use crate::answer::name_of;
use crate::approach::Approach;
use crate::caution::{add_certainty, add_unmet_wishes, warnings};
use crate::clock::{StageClock, last_peak_rss_bytes, ms_since, peak_rss_bytes};
use crate::compute::{Compute, Rest};
use crate::question::{checked_masks, paired, pairs};
use crate::reject::Refusal;
use crate::store::{StoredModel, StrainWatch};

/// Above this condition of the small system the touched nodes hold the body weakly.
const CONDITION_WARNING: f64 = 1e9;
/// Nodes or masks prefetched between two looks at what else is waiting.
const PREFETCH_TOGETHER: usize = 2;

/// Bytes that sharpening a bound beside the frames may take for the moment: they are promised to
/// nobody.
const REFINED_BYTES_MAX: u64 = 256 << 20;

/// Which answer the reported strain and rotation belong to.
#[derive(Clone, Copy)]
pub(crate) enum StrainOf<'a> {
    /// The answer itself has to wait for it, and for the proof if there is memory for one.
    ThisAnswer {
        /// Whether there is.
        may_prove: bool,
    },
    /// Worked out beside the frames; no frame waits.
    NewestFrame(&'a Compute),
}

/// Answers one question on a kept model.
pub(crate) fn answer(
    stored: &Arc<StoredModel>,
    question: &Question,
    known: &Known,
    approach: &Approach,
    watch: StrainOf<'_>,
    mut clock: StageClock,
) -> Result<Answer, Refusal> {
    let base = stored.base()?;
    let (touched, q) = touched(stored, question, known, base.fixed())?;
    let nodes = match &question.want.nodes {
        NodeChoice::All => (0..stored.model.mesh().node_count() as u32).collect(),
        NodeChoice::Nodes(nodes) => nodes.clone(),
    };
    let kept = stored.set_for(&touched, &nodes);
    let factor_reused = kept.is_some();
    let set = match kept {
        Some(set) => set,
        None => {
            clock.begin(Stage::Factor);
            stored.model.check_held(&known.dofs, &touched.masks)?;
            let columns = &stored.columns;
            let mut set =
                ContactSet::try_new(&base, columns, &touched).map_err(ModelError::from)?;
            set.want(&base, &nodes);
            let set = Arc::new(set);
            stored.keep_set(nodes, Arc::clone(&set));
            set
        }
    };
    clock.begin(Stage::Solve);
    let solved = set.solve(&q).map_err(ModelError::from)?;
    let displacement = set.wanted_displacements(&solved);
    let is_one_request = matches!(watch, StrainOf::ThisAnswer { .. });
    if let StrainOf::ThisAnswer { may_prove: true } = watch {
        // One request has no later frames that a proof in the background could serve.
        base.estimate_condition();
        base.prove_eigenvalue_min();
        // Little, or less than the second factor that there was memory for.
        if set.refine_bytes(&base) <= base.proof_bytes().max(REFINED_BYTES_MAX) {
            set.refine(&base);
        }
    }
    let delivery = delivery(question.want.precision);
    let certificate = set.certify(&base, &q, &solved, &displacement, delivery);
    let mut stage_ms = clock.finish();
    let start = Instant::now();
    let (mut reactions, mut mask_forces) = (Vec::new(), Vec::new());
    if question.want.reactions {
        reactions = reactions_of(known, &base, &set, &solved);
        let (of_masks, _) = solved.lambda[set.dofs().len()..].as_chunks();
        mask_forces = of_masks.to_vec();
    }
    let displacements = Displacements::of(displacement, question.want.precision);
    stage_ms.encode = ms_since(start);
    if is_one_request {
        stored.strain().newest = stored.model.strain(&set.full_displacement(&base, &solved));
    }
    let mut report = report(stored, &set, known, &certificate, approach);
    report.stage_ms = stage_ms;
    report.factor_reused = factor_reused;
    report.peak_rss_bytes = match factor_reused {
        true => last_peak_rss_bytes(),
        false => peak_rss_bytes(),
    };
    if let Some(certainty) = set.certainty(&base) {
        add_certainty(certainty, question, &mut report)?;
    }
    add_unmet_wishes(question, &mut report);
    if let StrainOf::NewestFrame(compute) = watch {
        if factor_reused {
            sharpen(compute, &base, &set);
        }
        watch_strain(compute, stored, &base, set, solved);
    }
    let nodes = question.want.nodes.clone();
    Ok(Answer { report, nodes, displacements, reactions, mask_forces })
}

/// How displacements are rounded on the way.
fn delivery(precision: Precision) -> Delivery {
    match precision {
        Precision::F64 => Delivery::Double,
        Precision::F32Quantised => Delivery::Single,
    }
}

/// Solves once more for a grip that lasts, in the background: its bounds get sharper.
fn sharpen(compute: &Compute, base: &Arc<Base>, set: &Arc<ContactSet>) {
    let is_small = set.refine_bytes(base) <= REFINED_BYTES_MAX;
    if is_small && base.eigenvalue_min().is_some() && set.begin_refining() {
        let (base, set) = (Arc::clone(base), Arc::clone(set));
        compute.in_background(move || set.refine(&base));
    }
}

/// Numbers multiplied for an answer from a kept contact set; `None` where something has to be made.
pub(crate) fn products(stored: &StoredModel, question: &Question) -> Option<usize> {
    let base = stored.ready_base()?;
    let NodeChoice::Nodes(nodes) = &question.want.nodes else { return None };
    let is_condensed = matches!(question.method.as_str(), "auto" | "condensed");
    // Forces at nodes that the scene fixes take a product with the whole stiffness.
    let has_large_product = question.want.reactions && !base.fixed().is_empty();
    if !is_condensed || !question.forces.is_empty() || has_large_product {
        return None;
    }
    let known = stored.model.known(pairs(&question.known)).ok()?;
    let (touched, _) = touched(stored, question, &known, base.fixed()).ok()?;
    stored.set_for(&touched, nodes).map(|set| set.products())
}

/// What is touched in this frame, without the degrees of freedom the scene fixes, and the values.
fn touched(
    stored: &StoredModel,
    question: &Question,
    known: &Known,
    fixed: &[u32],
) -> Result<(Touched, Vec<f64>), Refusal> {
    let (masks, of_masks) = checked_masks(&stored.model, question)?;
    let pairs = known.dofs.iter().zip(&known.q_known);
    let free = pairs.filter(|(dof, _)| fixed.binary_search(dof).is_err());
    let (dofs, mut q): (Vec<u32>, Vec<f64>) = free.map(|(d, q)| (*d, *q)).unzip();
    q.extend(of_masks);
    Ok((Touched { dofs, masks }, q))
}

fn report(
    stored: &StoredModel,
    set: &ContactSet,
    known: &Known,
    certificate: &Certificate,
    approach: &Approach,
) -> SolveReport {
    // Worked out beside the frames: it belongs to the newest frame it is known for.
    let strain = stored.strain().newest;
    let mut warnings = warnings(strain);
    if set.condition() > CONDITION_WARNING {
        warnings.push(format!(
            "the touched nodes hold the body weakly (condition {:.0e}); spread them",
            set.condition()
        ));
    }
    // The mean of a mask is one equation along each axis, as a known degree of freedom is.
    let known_dofs = known.dofs.len() + 3 * set.touched().masks.len();
    SolveReport {
        method: "condensed".to_owned(),
        element: name_of(stored.model.element()),
        unknown_dofs: (stored.model.modelled_dofs() - known_dofs) as u64,
        known_dofs: known_dofs as u64,
        residual_rel: certificate.residual_rel,
        error_bound_rel: certificate.error_bound_rel.ok(),
        error_bound_why: certificate.error_bound_rel.err().unwrap_or_default().to_owned(),
        max_rotation_deg: strain.rotation_max.to_degrees(),
        max_strain: strain.strain_max,
        precision: "f64".to_owned(),
        condition_estimate: Some(set.condition()),
        warnings,
        chosen_because: approach.because().to_owned(),
        ..SolveReport::default()
    }
}

/// Forces at all known degrees of freedom (3.43b): λ where touched, `K u` where the scene fixes.
fn reactions_of(
    known: &Known,
    base: &Base,
    set: &ContactSet,
    solved: &ContactAnswer,
) -> Vec<DofValue> {
    let fixed = base.fixed();
    let mut at_fixed = match fixed.is_empty() {
        true => Vec::new(),
        false => base.forces_of(&set.full_displacement(base, solved)),
    };
    // What a mask presses onto a fixed node is not the support's force.
    if !at_fixed.is_empty() {
        let (of_masks, _) = solved.lambda[set.dofs().len()..].as_chunks::<3>();
        for (mask, force) in set.touched().masks.iter().zip(of_masks) {
            for &(node, weight) in mask.entries() {
                for (axis, force) in force.iter().enumerate() {
                    at_fixed[3 * node as usize + axis] -= weight * force;
                }
            }
        }
    }
    let force = |dof: &u32| match set.dofs().binary_search(dof) {
        Ok(at) => solved.lambda[at],
        Err(_) => at_fixed.get(*dof as usize).copied().unwrap_or(0.0),
    };
    known.dofs.iter().map(|dof| DofValue { dof: *dof, value: force(dof) }).collect()
}

/// Works out rotation and strain of a frame beside the frames that follow, one at a time, resting
/// for nine tenths of the time.
fn watch_strain(
    compute: &Compute,
    stored: &Arc<StoredModel>,
    base: &Arc<Base>,
    set: Arc<ContactSet>,
    solved: ContactAnswer,
) {
    if std::mem::replace(&mut stored.strain().running, true) {
        return;
    }
    let (stored, base) = (Arc::clone(stored), Arc::clone(base));
    compute.beside(move || {
        let mut rest = Rest::new();
        let displacement = set.full_displacement(&base, &solved);
        let newest = stored.model.strain_with_pauses(&displacement, &mut || rest.rest());
        *stored.strain() = StrainWatch { newest, running: false };
    });
}

/// Computes the columns of nodes and masks that may be touched soon, a few at a time, letting frames
/// pass; what does not fit the model is passed over.
pub(crate) fn prefetch(stored: &StoredModel, hint: &Prefetch) {
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
            return;
        }
        rayon::yield_now();
    }
}
