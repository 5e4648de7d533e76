//! Works out the fields of strain, stress, energy and contact that a question asks for.

use nalgebra::{Point3, Vector3};
use softgrasp_core::contact::SurfaceLoad;
use softgrasp_core::dynamics::HeldContact;
use softgrasp_core::fem::fields::{Fields, Tensor, von_mises};
use softgrasp_core::fem::hyperelastic::Elements;
use softgrasp_core::mesh::{Surface, TetMesh};
use softgrasp_core::model::Model;
use softgrasp_protocol::{
    Ask, Field, FieldPlace, FieldSet, FieldValues, Limits, NodeChoice, Subject, Want,
};

use crate::budget::Reservation;
use crate::refusal::Refusal;
use crate::resources::Resources;

/// Displacement of every node of the system, m, and the equations that it solves.
pub(super) enum Shape<'a> {
    /// Displacement by linear elasticity.
    Linear(&'a [f64]),
    /// Displacement at large deformation, by the law of these elements.
    Large(&'a Elements, &'a [f64]),
}

impl Shape<'_> {
    fn displacement(&self) -> &[f64] {
        match self {
            Shape::Linear(u) | Shape::Large(_, u) => u,
        }
    }
}

/// Bytes of one number in double precision.
const NUMBER: u64 = size_of::<f64>() as u64;
/// Numbers that strain and stress of one element take in memory while fields are computed, those of the
/// answer included.
const NUMBERS_PER_TET: u64 = 4 * 12 + 24;
const NUMBERS_PER_NODE: u64 = 48;

/// Wanted fields of elasticity for one displacement; empty if none are wanted.
pub(super) fn field_values(model: &Model, shape: &Shape<'_>, want: &Want) -> Vec<FieldValues> {
    match elastic(want.fields).is_empty() {
        true => Vec::new(),
        false => vec![elastic_values(model, shape, (want.fields, &want.nodes), None)],
    }
}

/// Wanted fields of a contact frame; `contacts` are those at the end of its step.
pub(super) fn contact_field_values(
    model: &Model,
    shape: &Shape<'_>,
    (wanted, nodes): (FieldSet, &NodeChoice),
    contacts: &[HeldContact],
) -> Vec<FieldValues> {
    if wanted.is_empty() {
        return Vec::new();
    }
    let has_load = wanted.iter().any(Field::is_of_contact);
    let load = has_load.then(|| surface_load(model.mesh(), shape.displacement(), contacts));
    vec![elastic_values(model, shape, (wanted, nodes), load.as_ref())]
}

/// The wanted fields that need no contact.
fn elastic(wanted: FieldSet) -> FieldSet {
    wanted.iter().filter(|field| !field.is_of_contact()).collect()
}

fn elastic_values(
    model: &Model,
    shape: &Shape<'_>,
    (wanted, nodes): (FieldSet, &NodeChoice),
    load: Option<&SurfaceLoad>,
) -> FieldValues {
    let is_judged = [Field::ElementStressError, Field::NodeStressError];
    let is_judged = is_judged.into_iter().any(|field| wanted.has(field));
    let fields = match (elastic(wanted).is_empty(), shape) {
        (true, _) => Fields::default(),
        (false, Shape::Linear(u)) => model.fields(u, is_judged),
        (false, Shape::Large(elements, u)) => model.large_fields(elements, u, is_judged),
    };
    let array = |field: Field| match field.place() {
        FieldPlace::Elements => of_elements(field, &fields),
        FieldPlace::Nodes => chosen(of_nodes(field, &fields, load), field.components(), nodes),
    };
    FieldValues {
        energy: fields.energy,
        error_rel: fields.error_rel.unwrap_or(f64::NAN),
        arrays: wanted.iter().map(|field| (field, array(field))).collect(),
    }
}

fn of_elements(field: Field, fields: &Fields) -> Vec<f64> {
    let of = &fields.elements;
    match field {
        Field::ElementStrain => flat(&of.strain),
        Field::ElementStress => flat(&of.stress),
        Field::ElementVonMises => of.stress.iter().map(von_mises).collect(),
        Field::ElementEnergy => of.energy.clone(),
        _ => of.stress_error.clone(),
    }
}

fn of_nodes(field: Field, fields: &Fields, load: Option<&SurfaceLoad>) -> Vec<f64> {
    let of = &fields.nodes;
    match (field, load) {
        (Field::NodeStrain, _) => flat(&of.strain),
        (Field::NodeStress, _) => flat(&of.stress),
        (Field::NodeVonMises, _) => of.stress.iter().map(von_mises).collect(),
        (Field::NodeEnergyDensity, _) => of.energy_density.clone(),
        (Field::ContactPressure, Some(load)) => load.pressure.clone(),
        (Field::ContactForce, Some(load)) => load.force.as_flattened().to_vec(),
        _ => of.stress_error.clone(),
    }
}

fn flat(tensors: &[Tensor]) -> Vec<f64> {
    tensors.as_flattened().to_vec()
}

/// Values of the nodes that the answer is about.
fn chosen(of_all: Vec<f64>, components: usize, nodes: &NodeChoice) -> Vec<f64> {
    match nodes {
        NodeChoice::All => of_all,
        NodeChoice::Nodes(nodes) => {
            let of_node = |&node: &u32| &of_all[components * node as usize..][..components];
            nodes.iter().flat_map(of_node).copied().collect()
        }
    }
}

/// Forces and pressure that contacts put on the deformed surface, in the object's frame.
fn surface_load(mesh: &TetMesh, u: &[f64], contacts: &[HeldContact]) -> SurfaceLoad {
    let moved = |(place, u): (&Point3<f64>, &[f64; 3])| place + Vector3::from(*u);
    let places: Vec<Point3<f64>> =
        mesh.vertices().iter().zip(u.as_chunks::<3>().0).map(moved).collect();
    let forces = contacts.iter().flat_map(|contact| {
        let parts = contact.nodes.into_iter().zip(contact.weights);
        parts.map(|(node, weight)| (node, weight * contact.force))
    });
    SurfaceLoad::new(&places, &Surface::with_mid_edge_nodes(mesh).triangles, forces)
}

/// Checks that the wanted fields exist for the question, and reserves the memory that they take.
///
/// # Errors
/// [`Refusal::ContactFields`], [`Refusal::FieldsMemory`], [`Refusal::FieldsTooLarge`].
pub(crate) fn reserve_fields(
    resources: &Resources,
    ask: &Ask,
) -> Result<Option<Reservation>, Refusal> {
    let Want { nodes, fields, .. } = &ask.question.want;
    if fields.is_empty() {
        return Ok(None);
    }
    if let Some(field) = fields.iter().find(|field| field.is_of_contact()) {
        return Err(Refusal::ContactFields { field });
    }
    let (all, tets) = match &ask.subject {
        Subject::Mesh(body) => (body.mesh.vertices.len(), body.mesh.tets.len()),
        Subject::Model(model) => match resources.models.find(*model) {
            Some(stored) => (stored.model.mesh().node_count(), stored.model.mesh().tets().len()),
            // It is refused where its model is looked for.
            None => return Ok(None),
        },
    };
    reserve(resources, (*fields, nodes), (all as u64, tets as u64), 1 + ask.cases.len() as u64)
        .map(Some)
}

/// Reserves the memory that the fields of one contact frame take.
///
/// # Errors
/// [`Refusal::FieldsMemory`], [`Refusal::FieldsTooLarge`].
pub(super) fn reserve_contact_fields(
    resources: &Resources,
    model: &Model,
    (wanted, nodes): (FieldSet, &NodeChoice),
) -> Result<Option<Reservation>, Refusal> {
    if wanted.is_empty() {
        return Ok(None);
    }
    let counts = (model.mesh().node_count() as u64, model.mesh().tets().len() as u64);
    reserve(resources, (wanted, nodes), counts, 1).map(Some)
}

fn reserve(
    resources: &Resources,
    (wanted, nodes): (FieldSet, &NodeChoice),
    (all, tets): (u64, u64),
    cases: u64,
) -> Result<Reservation, Refusal> {
    let answered = match nodes {
        NodeChoice::All => all,
        NodeChoice::Nodes(nodes) => nodes.len() as u64,
    };
    let of_field = |field: Field| {
        let places = match field.place() {
            FieldPlace::Elements => tets,
            FieldPlace::Nodes => answered,
        };
        NUMBER * field.components() as u64 * places
    };
    let sent = cases.saturating_mul(wanted.iter().map(of_field).sum());
    let most = u64::from(Limits::default().payload_len_max) / 2;
    if sent > most {
        return Err(Refusal::FieldsTooLarge { bytes: sent, most });
    }
    let working = NUMBER * (NUMBERS_PER_TET * tets + NUMBERS_PER_NODE * all);
    // The arrays, and the frame that they are written into.
    let bytes = working + 2 * sent;
    let reservation = resources.budget.reservation();
    if !reservation.reserve(bytes, 0) {
        return Err(Refusal::FieldsMemory { bytes, free: reservation.free() });
    }
    resources.models.make_room(None);
    Ok(reservation)
}
