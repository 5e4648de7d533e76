//! Answers one step of a free object among rigid bodies: linear from cached columns of the compliance, or
//! at large deformation.

use std::sync::Arc;
use std::time::Instant;

use softgrasp_core::contact::coulomb::PointState;
use softgrasp_core::dynamics::{
    BodyContact, BodyLoad, Candidate, Carried, ContactStep, MovingBody, ObjectState, PointContact,
    SmallSystem, StepError, StepOutcome, StepSettings,
};
use softgrasp_core::fem::StrainSummary;
use softgrasp_core::fem::hyperelastic::LargeSummary;
use softgrasp_core::model::ModelError;
use softgrasp_core::solve::Stage;
use softgrasp_core::solve::condensed::{Contact, Elasticity};
use softgrasp_protocol::{
    Answer, BodyContact as ContactMessage, BodyLoad as LoadMessage, ContactAnswer, ContactAsk,
    ContactFrame, ContactPoint, ContactReport, Deformation, Displacements, FieldSet, FieldValues,
    ModelHash, NodeChoice, PathChoice, Precision, SmallSystem as SmallSystemMessage, SolveReport,
    Warning, WarningCode, WarningLevel,
};

use super::contact_large::{LargeWish, Made, PressedSeat};
use super::fields::{Shape, contact_field_values, reserve_contact_fields};
use super::large::law_of;
use super::large_once::promised_error;
use super::warnings::strain_warnings;
use crate::budget::Reservation;
use crate::clock::{StageClock, ms_since};
use crate::lock::Lock;
use crate::machine_memory::last_peak_rss_bytes;
use crate::plan::columns_ms;
use crate::refusal::Refusal;
use crate::request::{bodies_of, name_of, settings_of, state_message, state_of};
use crate::resources::Resources;
use crate::store::StoredModel;

/// What a session carries from one step of each of its objects to the next, the newest step last.
pub(crate) type CarriedSeat = Arc<Lock<Vec<(ModelHash, Carried)>>>;

/// Objects for which a session carries something, those of the newest steps: a megabyte each at most.
const CARRIED_MAX: usize = 8;

/// A contact frame that has been checked, with all data for its answer.
pub(crate) struct PosedContact {
    model: ModelHash,
    stored: Arc<StoredModel>,
    carried: CarriedSeat,
    state: ObjectState,
    bodies: Vec<MovingBody>,
    triangles: Vec<[u32; 3]>,
    candidates: Vec<Candidate>,
    /// Nodes of the triangles, ascending.
    near_nodes: Vec<u32>,
    settings: StepSettings,
    /// ms from the beginning of the request; `None` for none.
    deadline_ms: Option<f64>,
    nodes: NodeChoice,
    precision: Precision,
    fields: FieldSet,
    /// Wish for large deformation; `None` for linear elasticity.
    large: Option<LargeWish>,
}

impl PosedContact {
    /// Checks bodies, state, nodes and limits of a contact frame.
    ///
    /// # Errors
    /// [`Refusal`] that names the wrong part.
    pub fn new(
        resources: &Resources,
        frame: ContactFrame,
        (seat, carried): (PressedSeat, CarriedSeat),
    ) -> Result<Self, Refusal> {
        let ContactFrame {
            model,
            ask,
            state,
            bodies,
            triangles,
            triangle_bodies,
            nodes,
            precision,
            fields,
        } = frame;
        let stored = resources.models.find(model).ok_or(Refusal::UnknownModel(model))?;
        let node_count = stored.model.mesh().node_count();
        let is_there = |node: &&u32| stored.model.is_used(**node as usize);
        let check = |what: &'static str, nodes: &[u32]| match nodes
            .iter()
            .find(|node| **node as usize >= node_count || !is_there(node))
        {
            Some(&node) => Err(Refusal::NoSuchNode { what, node, node_count }),
            None => Ok(()),
        };
        check("a candidate triangle", triangles.as_flattened())?;
        if let NodeChoice::Nodes(nodes) = &nodes {
            check("the list of wanted nodes", nodes)?;
        }
        let state = state_of(state)?;
        let held = state.contacts.iter().flat_map(|contact| contact.nodes);
        let of_state: Vec<u32> = state.forces.iter().map(|(n, _)| *n).chain(held).collect();
        check("the state of the object", &of_state)?;
        let candidate = |(triangle, &body): (u32, &u32)| Candidate {
            triangle,
            body: u16::try_from(body).unwrap_or(u16::MAX),
        };
        let law = law_of(ask.law);
        let candidates = (0u32..).zip(&triangle_bodies).map(candidate).collect();
        Ok(Self {
            model,
            stored,
            carried,
            state,
            bodies: bodies_of(bodies)?,
            near_nodes: nodes_of(&triangles),
            triangles,
            candidates,
            settings: settings_of(&ask),
            deadline_ms: ask.deadline_ms,
            nodes,
            precision,
            fields,
            large: deformation_of(&ask).map(|deformation| LargeWish {
                model,
                deformation,
                law,
                yield_stress: ask.yield_stress,
                from_rest: ask.path == PathChoice::FromRest,
                seat,
            }),
        })
    }

    /// Whether the step takes only a small contact problem, or at most the factor of a shape.
    pub fn is_prepared(&self) -> bool {
        let is_there = match &self.large {
            Some(wish) => wish.goes_on(),
            None => self.missing() == 0,
        };
        self.stored.has_free_body() && is_there
    }

    /// Predicted time to compute the columns that the step may need.
    ///
    /// Units: ms.
    pub fn predicted_ms(&self, resources: &Resources) -> f64 {
        let Ok(base) = self.stored.base() else { return 0.0 };
        columns_ms(&base, self.missing(), &resources.rates.known())
    }

    /// Number of nodes near bodies whose columns are not cached.
    fn missing(&self) -> usize {
        self.stored.columns.missing(self.near_nodes.iter().copied().map(Contact::Node))
    }

    /// Answers the contact frame: makes the step. `Err` with the frame where the step would take longer than
    /// `slice_ms`, counted from here: nothing has changed then, and it can be begun anew.
    ///
    /// # Errors
    /// The inner [`Refusal`] if the request cannot be answered.
    pub fn answer_within(
        self,
        resources: &Resources,
        clock: StageClock,
        slice_ms: f64,
    ) -> Result<Result<ContactAnswer, Refusal>, Box<Self>> {
        let begun = Instant::now();
        let is_too_long = || ms_since(begun) > slice_ms;
        match self.made(resources, clock, &is_too_long) {
            Ok(Some((made, clock, computed))) => Ok(Ok(self.answer_of(made, clock, computed))),
            Ok(None) => Err(Box::new(self)),
            Err(refusal) => Ok(Err(refusal)),
        }
    }

    /// The step, the clock and the number of columns that were computed; `None` where it ended because it was
    /// too long, and is taken back.
    fn made(
        &self,
        resources: &Resources,
        mut clock: StageClock,
        is_too_long: &(dyn Fn() -> bool + Sync),
    ) -> Result<Option<(Made, StageClock, u64)>, Refusal> {
        clock.begin(Stage::Solve);
        let base = self.stored.base()?;
        let body = self.stored.free_body(&base).map_err(ModelError::Condensed)?;
        let columns = &self.stored.columns;
        let computed = columns.computed();
        let elasticity = Elasticity { base: &base, body: &body, columns };
        let mesh = self.stored.model.mesh();
        let (running, deadline_ms) = (clock.clone(), self.deadline_ms);
        let (points_max, _of_points) = self.points_max(resources);
        let step = ContactStep {
            vertices: mesh.vertices(),
            triangles: &self.triangles,
            elasticity,
            bodies: &self.bodies,
            candidates: &self.candidates,
            settings: StepSettings { points_max, ..self.settings },
            is_late: &|| running.is_late(deadline_ms) || is_too_long(),
        };
        let _of_fields =
            reserve_contact_fields(resources, &self.stored.model, (self.fields, &self.nodes))?;
        let wanted = match &self.nodes {
            // Fields need the displacements of all nodes.
            _ if !self.fields.is_empty() => (0..mesh.node_count() as u32).collect(),
            NodeChoice::All => (0..mesh.node_count() as u32).collect(),
            NodeChoice::Nodes(nodes) => nodes.clone(),
        };
        // What was looked for when the time was over may be other than what would have been found: only a
        // linear step that has met the law is certainly the same.
        let is_cut_short = || is_too_long() && !running.is_late(deadline_ms);
        let made = match &self.large {
            Some(wish) => {
                let is_given_up = || running.is_abandoned() || is_cut_short();
                let object = (&*self.stored, &self.state);
                wish.advance(resources, object, &step, &wanted, &is_given_up)
            }
            None => self.advance_linear(&step, &wanted).map_err(Refusal::from).map(|outcome| {
                let is_given_up = !outcome.is_converged && is_cut_short();
                Some(Made::linear(outcome)).filter(|_| !is_given_up)
            }),
        };
        let made = match made {
            Err(_) if is_cut_short() => None,
            made => made?,
        };
        clock.go_on();
        let computed = columns.computed().saturating_sub(computed);
        resources.models.trim();
        Ok(made.map(|made| (made, clock, computed)))
    }

    fn answer_of(self, mut made: Made, clock: StageClock, computed: u64) -> ContactAnswer {
        let mut stage_ms = clock.finish();
        let start = Instant::now();
        let fields = self.field_values(&mut made);
        let mut answer = self.answered(made, fields, computed);
        stage_ms.encode = ms_since(start);
        answer.answer.report.stage_ms = stage_ms;
        answer
    }

    /// Most points of the contact problem: more than usual where so many nodes are near, and memory for them
    /// could be reserved.
    fn points_max(&self, resources: &Resources) -> (usize, Reservation) {
        let reservation = resources.budget.reservation();
        // Some lie between nodes.
        let points = (self.near_nodes.len() * 3 / 2).min(StepSettings::POINTS_MOST);
        let is_usual = points <= StepSettings::POINTS_USUAL;
        if is_usual || !reservation.reserve(StepSettings::bytes_of_points(points), 0) {
            return (StepSettings::POINTS_USUAL, reservation);
        }
        resources.models.make_room(None);
        (points, reservation)
    }

    /// Makes the step by linear elasticity, from what the session has carried if it goes on from there: the
    /// same answer, to the bit.
    fn advance_linear(
        &self,
        step: &ContactStep<'_>,
        wanted: &[u32],
    ) -> Result<StepOutcome, StepError> {
        let taken = self.carried.with(|all| {
            let place = all.iter().position(|(model, _)| *model == self.model)?;
            Some(all.remove(place).1)
        });
        let mut carried = taken.unwrap_or_default();
        let made = step.advance_from(&self.state, wanted, &mut carried)?;
        self.carried.with(|all| {
            if all.len() >= CARRIED_MAX {
                all.remove(0);
            }
            all.push((self.model, carried));
        });
        Ok(made)
    }

    /// Fields that are wanted for a step. `made` then has the displacements of all nodes, which are
    /// reduced to those of the wanted nodes.
    fn field_values(&self, made: &mut Made) -> Vec<FieldValues> {
        if self.fields.is_empty() {
            return Vec::new();
        }
        let (outcome, wanted) = (&mut made.outcome, (self.fields, &self.nodes));
        let u = outcome.displacements.as_flattened();
        let elements = self.large.as_ref().filter(|_| made.is_large).and_then(LargeWish::elements);
        let shape = match &elements {
            Some(elements) => Shape::Large(elements, u),
            None => Shape::Linear(u),
        };
        let contacts = &outcome.state.contacts;
        let values = contact_field_values(&self.stored.model, &shape, wanted, contacts);
        if let NodeChoice::Nodes(nodes) = &self.nodes {
            let of_node = |&node: &u32| outcome.displacements[node as usize];
            outcome.displacements = nodes.iter().map(of_node).collect();
        }
        values
    }

    fn answered(self, made: Made, fields: Vec<FieldValues>, computed: u64) -> ContactAnswer {
        let Made { outcome, is_large, factors, plastic_strain, summary, is_beyond_linear } = made;
        let (method, factor_reused) = match is_large {
            false => ("condensed", computed == 0),
            true => ("newton", factors == 0),
        };
        let model = &self.stored.model;
        let known = 3 * outcome.contacts.len() as u64;
        let LargeSummary { rotation_max, strain_max, .. } = summary;
        let (warning_level, warnings) = beyond_linear(is_beyond_linear, rotation_max, strain_max);
        let report = SolveReport {
            method: method.to_owned(),
            element: name_of(model.element()).into(),
            unknown_dofs: model.modelled_dofs() as u64 - known.min(model.modelled_dofs() as u64),
            known_dofs: known,
            residual_rel: outcome.residual_rel,
            error_bound_why: Some(
                "a contact frame has the residuals of both parts and no proven bound".to_owned(),
            ),
            max_rotation_deg: rotation_max.to_degrees(),
            max_strain: strain_max,
            warning_level,
            warnings,
            precision: "f64".to_owned(),
            peak_rss_bytes: last_peak_rss_bytes(),
            factor_reused,
            chosen_because: "contact with friction".to_owned(),
            ..SolveReport::default()
        };
        let small_system = outcome.small_system.as_ref().map(small_message).unwrap_or_default();
        let contact = ContactReport {
            penetration_max: outcome.penetration_max,
            slip_max: outcome.slip_max,
            residual: outcome.contact_residual,
            residual_rel: outcome.contact_residual_rel,
            cone_violation: outcome.cone_violation,
            is_converged: outcome.is_converged,
            rounds: outcome.rounds as u32,
            sweeps: outcome.sweeps as u32,
            newton_steps: outcome.newton_steps as u32,
            columns_computed: u32::try_from(computed).unwrap_or(u32::MAX),
            is_large,
            shapes: outcome.shapes as u32,
            factors: factors as u32,
            plastic_strain,
            small_contacts: small_system.contacts.len() as u32,
            is_late: outcome.is_late,
        };
        let displacements = Displacements::of(outcome.displacements, self.precision);
        ContactAnswer {
            answer: Answer {
                report,
                large: None,
                nodes: self.nodes,
                displacements,
                reactions: Vec::new(),
                mask_forces: Vec::new(),
                cases: Vec::new(),
                fields,
                gradient: None,
            },
            contact,
            state: state_message(&outcome.state),
            points: outcome.contacts.iter().map(point_message).collect(),
            loads: outcome.loads.iter().map(load_message).collect(),
            small_system,
        }
    }
}

/// Nodes of some triangles, ascending.
fn nodes_of(triangles: &[[u32; 3]]) -> Vec<u32> {
    let mut nodes = triangles.as_flattened().to_vec();
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}

/// Warnings of a step by linear elasticity that large deformation was open to, where memory is too short for
/// it; none where that is not so.
///
/// Units: rad, 1.
fn beyond_linear(is_so: bool, rotation_max: f64, strain_max: f64) -> (WarningLevel, Vec<Warning>) {
    if !is_so {
        return (WarningLevel::default(), Vec::new());
    }
    let promised = promised_error(rotation_max, strain_max);
    let text = format!(
        "linear elasticity answers, which may be off by {promised:.1e} of the largest displacement: memory \
         is too short for a factor, which contact at large deformation takes"
    );
    let own = Warning::new(WarningCode::CHOICE, text);
    let of_strain = strain_warnings(StrainSummary { rotation_max, strain_max });
    (WarningLevel::CAUTION, [own].into_iter().chain(of_strain).collect())
}

/// Equations of a step; `None` for linear elasticity, which has no yield stress.
fn deformation_of(ask: &ContactAsk) -> Option<Deformation> {
    match ask.yield_stress {
        Some(_) => Some(Deformation::Large),
        None => ask.deformation.filter(|deformation| *deformation != Deformation::Linear),
    }
}

fn point_message(point: &PointContact) -> ContactPoint {
    ContactPoint {
        body: u32::from(point.body),
        slips: point.state == PointState::Slipping,
        place: point.place.into(),
        normal: point.normal.into(),
        force: point.force.into(),
        slip: point.slip.into(),
    }
}

fn small_message(system: &SmallSystem) -> SmallSystemMessage {
    let contact = |contact: &BodyContact| ContactMessage {
        body: u32::from(contact.body),
        place: contact.place.into(),
        normal: contact.normal.into(),
        force: contact.force.into(),
        friction: contact.friction,
    };
    SmallSystemMessage {
        contacts: system.contacts.iter().map(contact).collect(),
        // Symmetric: its columns are its rows.
        compliance: system.compliance.as_slice().to_vec(),
    }
}

fn load_message(load: &BodyLoad) -> LoadMessage {
    LoadMessage {
        force: load.force.into(),
        torque: load.torque.into(),
        normal_force: load.normal_force,
        contacts: load.contacts as u32,
    }
}
