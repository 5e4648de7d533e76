//! Answers a question from cached columns of the compliance.

use std::sync::Arc;
use std::time::Instant;

use softgrasp_core::fem::StrainSummary;
use softgrasp_core::model::{Known, ModelError};
use softgrasp_core::solve::condensed::{Base, Certificate, ContactSet, Delivery, Touched};
use softgrasp_core::solve::{Certainty, Method, Stage};
use softgrasp_protocol::{
    Answer, Displacements, DofValue, FieldValues, NodeChoice, Precision, Question, SolveReport,
    Warning, WarningCode,
};

use super::contact_solution::{PreparedSet, Solved};
use super::fields::{Shape, field_values};
use super::warnings::{add_certainty, add_unmet_wishes, strain_warnings};
use crate::clock::{StageClock, ms_since};
use crate::machine_memory::{last_peak_rss_bytes, peak_rss_bytes};
use crate::refusal::Refusal;
use crate::request::{checked_masks, frame_loads, name_of};
use crate::resources::Resources;
use crate::store::{Asked, StoredModel};
use crate::workers::{Rest, Workers};

/// Condition number of the small system above which the touched nodes hold the body only weakly.
const CONDITION_WARNING: f64 = 1e9;

/// Bytes that sharpening an error bound may take in any case.
const REFINED_BYTES_MIN: u64 = 16 << 20;

/// Answer that the reported strain and rotation belong to.
#[derive(Clone, Copy)]
pub(super) enum StrainOf<'a> {
    /// This answer, which waits for them, and for the proof of the error bound if `may_prove`.
    ThisAnswer {
        /// Whether there is memory for the proof of the error bound.
        may_prove: bool,
    },
    /// An earlier answer to the same question: strain is computed in the background, and no answer waits.
    Beside(&'a Resources),
}

/// Touched degrees of freedom, masks and loads of one question about a model that has a base.
pub(crate) struct Contacts {
    stored: Arc<StoredModel>,
    base: Arc<Base>,
    known: Known,
    /// Its displacements are those of every touched degree of freedom, then three for each mask, m.
    asked: Asked,
    /// Nodes whose displacements are wanted.
    nodes: Vec<u32>,
}

impl Contacts {
    /// Collects what the question touches, without the degrees of freedom that the model fixes.
    ///
    /// # Errors
    /// [`Refusal`] where the model has no base, or a mask or a load does not fit it.
    pub fn new(
        stored: Arc<StoredModel>,
        question: &Question,
        known: Known,
    ) -> Result<Self, Refusal> {
        let base = stored.base()?;
        let fixed = base.fixed();
        let (masks, of_masks) = checked_masks(&stored.model, question)?;
        let loads = frame_loads(&stored.model, &known, question)?;
        let pairs = known.dofs.iter().zip(&known.q_known);
        let free = pairs.filter(|(dof, _)| fixed.binary_search(dof).is_err());
        let (dofs, mut q): (Vec<u32>, Vec<f64>) = free.map(|(d, q)| (*d, *q)).unzip();
        q.extend(of_masks);
        let nodes = match &question.want.nodes {
            NodeChoice::All => (0..stored.model.mesh().node_count() as u32).collect(),
            NodeChoice::Nodes(nodes) => nodes.clone(),
        };
        let asked = Asked { touched: Touched { dofs, masks }, q, loads };
        Ok(Self { stored, base, known, asked, nodes })
    }

    /// Small system kept from an earlier question about the same contacts, loads and wanted nodes.
    pub fn kept_set(&self) -> Option<PreparedSet> {
        let set = self.stored.set_for(&self.asked.touched, &self.nodes)?;
        let loaded = match &self.asked.loads {
            Some(loads) => Some(self.stored.loaded_set_for(&set, &loads.units)?),
            None => None,
        };
        Some(PreparedSet { set, loaded, is_kept: true })
    }

    /// Whether reaction forces are wanted at nodes that the model fixes; they take a product with the
    /// whole stiffness matrix.
    pub fn has_large_product(&self, question: &Question) -> bool {
        question.want.reactions && !self.base.fixed().is_empty()
    }

    fn made_set(&self, clock: &mut StageClock) -> Result<PreparedSet, Refusal> {
        clock.begin(Stage::Factor);
        let Self { stored, base, asked, nodes, .. } = self;
        let set = match stored.set_for(&asked.touched, nodes) {
            Some(set) => set,
            None => self.made_contact_set()?,
        };
        let loaded = match &asked.loads {
            Some(loads) => Some(stored.make_loaded_set(base, &set, &loads.units)?),
            None => None,
        };
        Ok(PreparedSet { set, loaded, is_kept: false })
    }

    fn made_contact_set(&self) -> Result<Arc<ContactSet>, Refusal> {
        let Self { stored, base, known, asked: Asked { touched, .. }, nodes } = self;
        stored.model.check_held(&known.dofs, &touched.masks)?;
        let mut set =
            ContactSet::try_new(base, &stored.columns, touched).map_err(ModelError::from)?;
        set.want(base, nodes);
        let set = Arc::new(set);
        stored.keep_set(nodes.clone(), Arc::clone(&set));
        Ok(set)
    }

    /// Answers the question by a kept small system, or by one made now.
    ///
    /// # Errors
    /// [`Refusal`] if the request cannot be answered.
    pub fn answer(
        &self,
        question: &Question,
        why: &str,
        strain: StrainOf<'_>,
        mut clock: StageClock,
    ) -> Result<Answer, Refusal> {
        let prepared = match self.kept_set() {
            Some(kept) => kept,
            None => self.made_set(&mut clock)?,
        };
        self.answer_with(&prepared, question, why, strain, clock)
    }

    /// Answers the question by the given small system.
    ///
    /// # Errors
    /// [`Refusal`] if the request cannot be answered.
    pub fn answer_with(
        &self,
        prepared: &PreparedSet,
        question: &Question,
        why: &str,
        strain: StrainOf<'_>,
        mut clock: StageClock,
    ) -> Result<Answer, Refusal> {
        let (Self { stored, base, known, asked, .. }, set) = (self, &prepared.set);
        clock.begin(Stage::Solve);
        let solved = prepared.solve(asked).map_err(ModelError::from)?;
        let displacement = solved.wanted_displacements(set);
        if let StrainOf::ThisAnswer { may_prove: true } = strain {
            // One request has no later frames that a proof in the background could serve.
            base.estimate_condition();
            base.prove_eigenvalue_min();
            // It takes no more than the second factor that there was memory for.
            if set.refine_bytes(base) <= base.proof_bytes().max(REFINED_BYTES_MIN) {
                set.refine(base);
            }
        }
        let delivery = delivery(question.want.precision);
        let certificate = solved.certify((base, set), &asked.q, &displacement, delivery);
        let mut stage_ms = clock.finish();
        let start = Instant::now();
        let (mut reactions, mut mask_forces) = (Vec::new(), Vec::new());
        if question.want.reactions {
            reactions = reactions_of(known, base, set, &solved);
            let (of_masks, _) = solved.lambda()[set.dofs().len()..].as_chunks();
            mask_forces = of_masks.to_vec();
        }
        let displacements = Displacements::of(displacement, question.want.precision);
        let has_fields = !question.want.fields.is_empty();
        let all = has_fields.then(|| solved.full_displacement(base, set));
        let fields = all.as_ref().map_or_else(Vec::new, |all| {
            field_values(&stored.model, &Shape::Linear(all), &question.want)
        });
        stage_ms.encode = ms_since(start);
        let its_strain = match strain {
            StrainOf::ThisAnswer { .. } => {
                let all = all.unwrap_or_else(|| solved.full_displacement(base, set));
                Some(stored.model.strain(&all, &mut || {}))
            }
            StrainOf::Beside(_) => stored.strain_of(asked),
        };
        let mut report = self.report(set, &certificate, (why, its_strain));
        report.stage_ms = stage_ms;
        report.factor_reused = prepared.is_kept;
        report.peak_rss_bytes = match prepared.is_kept {
            true => last_peak_rss_bytes(),
            false => peak_rss_bytes(),
        };
        if let Some(certainty) = set.certainty(base) {
            let of_columns = certificate.error_estimate_rel.unwrap_or(0.0);
            let error_rel = certainty.error_rel.max(of_columns);
            add_certainty(Certainty { error_rel, ..certainty }, question, &mut report)?;
        }
        add_unmet_wishes(question, &mut report);
        if let StrainOf::Beside(resources) = strain {
            // A second solve sharpens no bound of an answer with loads.
            if prepared.is_kept && prepared.loaded.is_none() {
                self.sharpen(resources, set);
            }
            if its_strain.is_none() {
                self.watch_strain(&resources.workers, Arc::clone(set), solved);
            }
        }
        let nodes = question.want.nodes.clone();
        let forces = (reactions, mask_forces);
        Ok(gathered(report, (nodes, displacements), forces, fields))
    }

    fn report(
        &self,
        set: &ContactSet,
        certificate: &Certificate,
        (why, strain): (&str, Option<StrainSummary>),
    ) -> SolveReport {
        let mut warnings = strain.map(strain_warnings).unwrap_or_default();
        if set.condition() > CONDITION_WARNING {
            let text = format!(
                "the touched nodes hold the body weakly (condition {:.0e}); spread them",
                set.condition()
            );
            warnings.push(Warning::new(WarningCode::HOLD, text));
        }
        // The average under a mask is one equation along each axis, as a known degree of freedom is.
        let known_dofs = self.known.dofs.len() + 3 * set.touched().masks.len();
        let model = &self.stored.model;
        SolveReport {
            method: Method::Condensed.to_string(),
            element: name_of(model.element()).into(),
            unknown_dofs: (model.modelled_dofs() - known_dofs) as u64,
            known_dofs: known_dofs as u64,
            residual_rel: certificate.residual_rel,
            error_bound_rel: certificate.error_bound_rel.ok(),
            error_bound_why: certificate.error_bound_rel.err().map(str::to_owned),
            max_rotation_deg: strain.map_or(f64::NAN, |strain| strain.rotation_max.to_degrees()),
            max_strain: strain.map_or(f64::NAN, |strain| strain.strain_max),
            precision: "f64".to_owned(),
            condition_estimate: Some(set.condition()),
            error_estimate_rel: certificate.error_estimate_rel,
            warnings,
            chosen_because: why.to_owned(),
            ..SolveReport::default()
        }
    }

    /// Starts the second solve in the background, which sharpens the error bounds of these contacts, if
    /// there is memory for it.
    fn sharpen(&self, resources: &Resources, set: &Arc<ContactSet>) {
        if self.base.eigenvalue_min().is_none() || !set.begin_refining() {
            return;
        }
        let reservation = resources.budget.reservation();
        if !reservation.reserve(set.refine_bytes(&self.base), self.stored.lasting_bytes()) {
            return;
        }
        resources.models.trim();
        let (base, set) = (Arc::clone(&self.base), Arc::clone(set));
        resources.workers.in_background(move || {
            set.refine(&base);
            drop(reservation);
        });
    }

    /// Computes rotation and strain of an answer in the background, one answer at a time, on a thread
    /// that rests for nine tenths of the time.
    fn watch_strain(&self, workers: &Workers, set: Arc<ContactSet>, solved: Solved) {
        let Some(claimed) = self.stored.strain_under_way.take() else { return };
        let (stored, base) = (Arc::clone(&self.stored), Arc::clone(&self.base));
        let asked = self.asked.clone();
        workers.beside(move || {
            let mut rest = Rest::new();
            let displacement = solved.full_displacement(&base, &set);
            let strain = stored.model.strain(&displacement, &mut || rest.rest());
            stored.keep_strain(asked, strain);
            drop(claimed);
        });
    }
}

/// An answer of linear elasticity, of one case.
fn gathered(
    report: SolveReport,
    (nodes, displacements): (NodeChoice, Displacements),
    (reactions, mask_forces): (Vec<DofValue>, Vec<[f64; 3]>),
    fields: Vec<FieldValues>,
) -> Answer {
    Answer {
        report,
        large: None,
        nodes,
        displacements,
        reactions,
        mask_forces,
        cases: Vec::new(),
        fields,
        gradient: None,
    }
}

/// Rounding of displacements that travel in this precision.
fn delivery(precision: Precision) -> Delivery {
    match precision {
        Precision::F64 => Delivery::Double,
        Precision::F32Quantised => Delivery::Single,
    }
}

/// Reaction forces at all known degrees of freedom (3.43b): λ where touched, `K u` less the loads where the
/// model fixes.
fn reactions_of(known: &Known, base: &Base, set: &ContactSet, solved: &Solved) -> Vec<DofValue> {
    let fixed = base.fixed();
    let mut at_fixed = match fixed.is_empty() {
        true => Vec::new(),
        false => base.forces_of(&solved.full_displacement(base, set)),
    };
    // What loads and masks press onto a fixed node is not the support's force.
    if !at_fixed.is_empty() {
        solved.subtract_loads(&mut at_fixed);
        let (of_masks, _) = solved.lambda()[set.dofs().len()..].as_chunks::<3>();
        for (mask, force) in set.touched().masks.iter().zip(of_masks) {
            for &(node, weight) in mask.entries() {
                for (axis, force) in force.iter().enumerate() {
                    at_fixed[3 * node as usize + axis] -= weight * force;
                }
            }
        }
    }
    let force = |dof: &u32| match set.dofs().binary_search(dof) {
        Ok(at) => solved.lambda()[at],
        Err(_) => at_fixed.get(*dof as usize).copied().unwrap_or(0.0),
    };
    known.dofs.iter().map(|dof| DofValue { dof: *dof, value: force(dof) }).collect()
}
