//! The work on one request, on the rayon pool: from messages to the core and back.

use std::sync::Arc;
use std::time::Instant;

use nalgebra::Point3;
use softgrasp_core::fem::{Material, summarise_strain};
use softgrasp_core::mesh::{TetMesh, signed_volume};
use softgrasp_core::model::{Known, Model};
use softgrasp_core::solve::{Factored, Loads, Method, Solution};
use softgrasp_protocol::{
    Answer, Displacements, DofValue, ElementName, FrameRequest, MeshData, ModelHash, ModelReady,
    NodeChoice, Question, SolveOnce, SolveReport, UploadModel, Want,
};

use crate::clock::{StageClock, ms_since, peak_rss_bytes};
use crate::config::ServerConfig;
use crate::reject::Refusal;
use crate::store::{ModelStore, StoredModel};

/// What is the same for all requests of a server.
pub(crate) struct Desk {
    pub config: ServerConfig,
    pub store: ModelStore,
}

impl Desk {
    pub fn new(config: ServerConfig) -> Self {
        let store = ModelStore::new(config.memory_limit);
        Self { config, store }
    }

    /// Mesh, known displacements and partition in one request (thesis 5.1.1).
    pub fn solve_once(&self, request: SolveOnce, mut clock: StageClock) -> Result<Answer, Refusal> {
        let SolveOnce { mesh, materials, element, question } = request;
        let model = self.model(mesh, &materials, element, Vec::new(), &mut clock)?;
        let known = model.known(pairs(&question.known))?;
        let method = self.method(&question, &known, &model)?;
        let factored = model.factor(&known.dofs, method, &mut |stage| clock.begin(stage))?;
        let asked = Asked { question: &question, known, element, factor_reused: false };
        answer(&model, &factored, asked, clock)
    }

    /// Prepares a model and keeps it.
    pub fn upload(
        &self,
        upload: UploadModel,
        mut clock: StageClock,
    ) -> Result<ModelReady, Refusal> {
        let hash = ModelHash::of(&upload);
        let found = self.store.find(hash);
        let reused = found.is_some();
        let stored = match found {
            Some(stored) => stored,
            None => {
                let UploadModel { mesh, materials, element, fixed } = upload;
                let model = self.model(mesh, &materials, element, fixed, &mut clock)?;
                let stored = Arc::new(StoredModel::new(model));
                self.store.keep(hash, Arc::clone(&stored));
                stored
            }
        };
        let fixed_dofs = stored.model.fixed().len() as u64;
        let unknown_dofs = stored.model.modelled_dofs() as u64 - fixed_dofs;
        Ok(ModelReady { model: hash, unknown_dofs, fixed_dofs, reused, stage_ms: clock.finish() })
    }

    /// One frame on a kept model.
    pub fn frame(&self, request: FrameRequest, mut clock: StageClock) -> Result<Answer, Refusal> {
        let FrameRequest { model: hash, question } = request;
        let stored = self.store.find(hash).ok_or(Refusal::UnknownModel(hash))?;
        let model = &stored.model;
        let known = model.known(pairs(&question.known))?;
        let method = self.method(&question, &known, model)?;
        let kept = stored.factor_for(&known.dofs, method);
        let factor_reused = kept.is_some();
        let factored = match kept {
            Some(factored) => factored,
            None => {
                let made = model.factor(&known.dofs, method, &mut |stage| clock.begin(stage))?;
                let made = Arc::new(made);
                stored.keep_factor(known.dofs.clone(), Arc::clone(&made));
                self.store.trim();
                made
            }
        };
        let asked = Asked { question: &question, known, element: ElementName::T4, factor_reused };
        answer(model, &factored, asked, clock)
    }

    fn model(
        &self,
        mesh: MeshData,
        materials: &[softgrasp_protocol::Material],
        element: ElementName,
        fixed: Vec<u32>,
        clock: &mut StageClock,
    ) -> Result<Model, Refusal> {
        if element != ElementName::T4 {
            return Err(Refusal::Element(element.as_str()));
        }
        let node_count = mesh.vertices.len();
        if node_count > self.config.max_nodes as usize {
            return Err(Refusal::TooManyNodes { node_count, max: self.config.max_nodes });
        }
        if materials.is_empty() {
            return Err(Refusal::NoMaterial);
        }
        let materials: Vec<Material> = materials
            .iter()
            .map(|m| Material::try_new(m.young, m.poisson))
            .collect::<Result<_, _>>()?;
        let vertices: Vec<_> = mesh.vertices.into_iter().map(Point3::from).collect();
        let tets = mesh.tets.into_iter().map(|tet| turned(&vertices, tet)).collect();
        let mesh = TetMesh::try_new(vertices, tets, mesh.regions)?;
        Ok(Model::try_new(mesh, &materials, fixed, &mut |stage| clock.begin(stage))?)
    }

    /// The method asked for, if its matrix fits into the memory limit.
    fn method(&self, question: &Question, known: &Known, model: &Model) -> Result<Method, Refusal> {
        let name = question.method.as_str();
        let method = if name == "auto" { Method::SparseCholesky } else { name.parse()? };
        let unknown_dofs = model.modelled_dofs().saturating_sub(known.dofs.len());
        let limit = self.config.memory_limit;
        match method.dense_bytes(unknown_dofs) {
            Some(needed) if needed > limit => {
                Err(Refusal::Memory { method: method.to_string(), unknown_dofs, needed, limit })
            }
            _ => Ok(method),
        }
    }
}

/// The corners in the order of (3.23). Gmsh and VTK count them the other way round, and the
/// stiffness does not depend on it, so clients may send either.
fn turned(vertices: &[Point3<f64>], tet: [u32; 4]) -> [u32; 4] {
    let corner = |i: usize| vertices.get(tet[i] as usize).copied();
    match (corner(0), corner(1), corner(2), corner(3)) {
        (Some(a), Some(b), Some(c), Some(d)) if signed_volume(&[a, b, c, d]) < 0.0 => {
            [tet[0], tet[1], tet[3], tet[2]]
        }
        // Indices out of range are refused with the mesh.
        _ => tet,
    }
}

struct Asked<'a> {
    question: &'a Question,
    known: Known,
    element: ElementName,
    factor_reused: bool,
}

fn pairs(known: &[DofValue]) -> Vec<(u32, f64)> {
    known.iter().map(|k| (k.dof, k.value)).collect()
}

/// Solves and gathers what was asked for.
fn answer(
    model: &Model,
    factored: &Factored,
    asked: Asked<'_>,
    mut clock: StageClock,
) -> Result<Answer, Refusal> {
    let Asked { question, known, element, factor_reused } = asked;
    check_nodes(&question.want, model)?;
    let forces = scatter_forces(model, &known, &question.forces)?;
    let residual_rel = question.max_error.unwrap_or(0.0);
    let loads = Loads { q_known: &known.q_known, forces: &forces, residual_rel };
    let solution = factored
        .solve(model.stiffness(), loads, &mut |stage| clock.begin(stage))
        .map_err(|error| Refusal::Model(error.into()))?;
    let strain = summarise_strain(model.mesh(), &solution.displacement);
    let mut stage_ms = clock.finish();
    let start = Instant::now();
    let displacements = gather(&solution, &question.want);
    let reactions = match question.want.reactions {
        true => reactions(&known, &solution),
        false => Vec::new(),
    };
    stage_ms.encode = ms_since(start);
    let report = SolveReport {
        method: factored.method().to_string(),
        element,
        unknown_dofs: factored.partition().unknown().len() as u64,
        known_dofs: known.dofs.len() as u64,
        stage_ms,
        residual_rel: solution.residual_rel,
        error_bound_rel: None,
        error_bound_why: "no lower bound of the stiffness's smallest eigenvalue is computed yet"
            .to_owned(),
        refinement_steps: solution.refinement_steps,
        max_rotation_deg: strain.rotation_max.to_degrees(),
        max_strain: strain.strain_max,
        precision: factored.method().precision().to_owned(),
        condition_estimate: None,
        warnings: warnings(strain.rotation_max.to_degrees(), strain.strain_max),
        peak_rss_bytes: peak_rss_bytes(),
        factor_reused,
        chosen_because: match question.method.as_str() {
            "auto" => "the fastest exact method here for any size".to_owned(),
            _ => "asked for".to_owned(),
        },
    };
    Ok(Answer { report, nodes: question.want.nodes.clone(), displacements, reactions })
}

fn check_nodes(want: &Want, model: &Model) -> Result<(), Refusal> {
    let node_count = model.mesh().node_count();
    let NodeChoice::Nodes(nodes) = &want.nodes else { return Ok(()) };
    match nodes.iter().find(|&&n| n as usize >= node_count) {
        Some(&node) => {
            Err(Refusal::NoSuchNode { what: "the list of wanted nodes", node, node_count })
        }
        None => Ok(()),
    }
}

/// Forces by degree of freedom; empty when there are none.
fn scatter_forces(model: &Model, known: &Known, forces: &[DofValue]) -> Result<Vec<f64>, Refusal> {
    if forces.is_empty() {
        return Ok(Vec::new());
    }
    let node_count = model.mesh().node_count();
    let mut scattered = vec![0.0; 3 * node_count];
    for &DofValue { dof, value } in forces {
        let node = dof / 3;
        if !value.is_finite() {
            return Err(Refusal::ForceNotFinite { node, value });
        }
        if value != 0.0 && known.dofs.binary_search(&dof).is_ok() {
            return Err(Refusal::ForceOnKnown { node });
        }
        match scattered.get_mut(dof as usize) {
            Some(force) => *force += value,
            None => {
                return Err(Refusal::NoSuchNode { what: "the list of forces", node, node_count });
            }
        }
    }
    Ok(scattered)
}

fn gather(solution: &Solution, want: &Want) -> Displacements {
    let of = |n: usize| {
        let u = &solution.displacement[3 * n..3 * n + 3];
        [u[0], u[1], u[2]]
    };
    let rows = match &want.nodes {
        NodeChoice::All => (0..solution.displacement.len() / 3).map(of).collect(),
        NodeChoice::Nodes(nodes) => nodes.iter().map(|&n| of(n as usize)).collect(),
    };
    Displacements::of(rows, want.precision)
}

fn reactions(known: &Known, solution: &Solution) -> Vec<DofValue> {
    let pairs = known.dofs.iter().zip(&solution.reaction);
    pairs.map(|(&dof, &value)| DofValue { dof, value }).collect()
}

/// Linear elasticity errs by the square of the rotation: 1.5 % at 10°.
const ROTATION_WARNING_DEG: f64 = 10.0;
/// Above this the small-strain measure itself is off by several per cent.
const STRAIN_WARNING: f64 = 0.1;

fn warnings(rotation_deg: f64, strain: f64) -> Vec<String> {
    let mut warnings = Vec::new();
    if rotation_deg > ROTATION_WARNING_DEG {
        warnings.push(format!(
            "an element turns by {rotation_deg:.1} degrees; linear elasticity is off by about \
             {:.0} % there",
            50.0 * rotation_deg.to_radians().powi(2)
        ));
    }
    if strain > STRAIN_WARNING {
        warnings.push(format!(
            "an element is strained by {:.0} %; linear elasticity is meant for small strains",
            100.0 * strain
        ));
    }
    warnings
}
