//! The work on one request, on the rayon pool: which model, which method, which way to the answer.

use std::sync::Arc;

use nalgebra::Point3;
use softgrasp_core::fem::Material;
use softgrasp_core::mesh::{TetMesh, signed_volume};
use softgrasp_core::model::{Element, Model, ModelError};
use softgrasp_core::solve::Method;
use softgrasp_core::solve::memory::Way;
use softgrasp_protocol::{
    Answer, ElementName, FrameRequest, MeshData, ModelHash, ModelReady, Prefetch, Question,
    SolveOnce, UploadModel,
};

use crate::admission::{Asking, Ledger, Room};
use crate::approach::{Approach, is_auto};
use crate::clock::StageClock;
use crate::compute::Compute;
use crate::condensed::StrainOf;
use crate::config::ServerConfig;
use crate::direct::Asked;
use crate::planned::{add_locking, given_or_cheapest};
use crate::question::{check_wishes, checked_forces, pairs};
use crate::rates::MeasuredRates;
use crate::reject::Refusal;
use crate::store::{Allowed, ModelStore, StoredModel};
use crate::{condensed, direct};

/// What is the same for all requests of a server.
pub(crate) struct Desk {
    pub config: ServerConfig,
    pub store: ModelStore,
    pub ledger: Ledger,
    compute: Compute,
    pub rates: MeasuredRates,
}

/// Numbers multiplied for a frame that is done sooner than handed to another thread.
const QUICK_PRODUCTS: usize = 1 << 18;

impl Desk {
    pub fn new(config: ServerConfig, compute: Compute) -> Self {
        let store = ModelStore::new(config.memory_limit);
        let ledger = Ledger::new(config.memory_limit);
        Self { config, store, ledger, compute, rates: MeasuredRates::default() }
    }

    /// Mesh, known displacements and partition in one request (thesis 5.1.1).
    pub fn solve_once(&self, request: SolveOnce, clock: StageClock) -> Result<Answer, Refusal> {
        let SolveOnce { mesh, materials, element, question } = request;
        check_wishes(&question)?;
        self.check_node_count(&mesh)?;
        let asking = Asking::once(&mesh, question.known.len());
        let mut room = self.ledger.room();
        let plan = self.plan(&asking, &mut room, &materials, element, &question, &clock)?;
        let mut answer = match plan {
            Some(plan) => {
                self.solve_planned(&plan, &mut room, mesh, &materials, &question, clock)?
            }
            None => {
                let element = given_or_cheapest(element, &materials);
                self.solve_as_asked(
                    asking,
                    &mut room,
                    (mesh, element),
                    &materials,
                    &question,
                    clock,
                )?
            }
        };
        add_locking(element, &materials, &mut answer.report);
        Ok(answer)
    }

    /// A one-shot request that names its method, or leaves it to the server without a wish.
    fn solve_as_asked(
        &self,
        asking: Asking,
        room: &mut Room,
        (mesh, element): (MeshData, ElementName),
        materials: &[softgrasp_protocol::Material],
        question: &Question,
        mut clock: StageClock,
    ) -> Result<Answer, Refusal> {
        let approach = Approach::for_once(question)?;
        let ways = approach.ways(question);
        self.admit(room, &asking.predict(element_of(element), &ways), &asking)?;
        let model = self.model(mesh, materials, element, Vec::new(), &mut clock)?;
        let known = model.known(pairs(&question.known))?;
        let forces = checked_forces(&model, &known, question)?;
        match approach {
            Approach::Condensed { .. } => {
                let stored = Arc::new(self.stored(room, model, &mut clock));
                let watch = StrainOf::ThisAnswer { may_prove: self.may_prove(room, &stored) };
                condensed::answer(&stored, question, &known, &approach, watch, clock)
            }
            Approach::Direct { because, .. } => {
                let asking = Asking::about(&model, known.dofs.len(), None);
                let methods: Vec<Method> = ways.iter().filter_map(|way| way.method()).collect();
                let held = (&asking, model.bytes() as u64);
                let factored =
                    self.factor(room, &model, &known.dofs, &methods, held, &mut clock)?;
                let asked = Asked {
                    question,
                    known,
                    forces,
                    element: name_of(model.element()),
                    factor_reused: false,
                    chosen_because: because_of(because, &methods, factored.method()),
                };
                direct::answer(&model, &factored, asked, clock)
            }
        }
    }

    /// A model with its base, within the memory that others leave.
    fn stored(&self, room: &mut Room, model: Model, clock: &mut StageClock) -> StoredModel {
        let allowed = Allowed { bytes: room.free(), column_cache: self.config.column_cache };
        let stored = StoredModel::new(model, allowed, &mut |stage| clock.begin(stage));
        room.settle(stored.lasting_bytes());
        stored
    }

    /// Whether there is memory for the second factor that a proof takes.
    fn may_prove(&self, room: &mut Room, stored: &StoredModel) -> bool {
        let proof = stored.ready_base().map_or(0, |base| base.proof_bytes());
        let held = stored.lasting_bytes();
        let fits = room.take(held.saturating_add(proof), 0);
        if !fits {
            tracing::info!(proof, "no memory for the proof of the error bound");
        }
        fits
    }

    /// Prepares a model and keeps it; the base of the condensed engine is made with it, so that no
    /// frame has to wait for it.
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
                self.check_node_count(&mesh)?;
                let asking = Asking::once(&mesh, fixed.len());
                let mut room = self.ledger.room();
                let needs = asking.predict(element_of(element), &Way::SENSIBLE);
                self.admit(&mut room, &needs, &asking)?;
                let model = self.model(mesh, &materials, element, fixed, &mut clock)?;
                let stored = Arc::new(self.stored(&mut room, model, &mut clock));
                // A shape that cannot be condensed can still be solved by the other methods.
                if let Err(error) = stored.base() {
                    tracing::info!(%error, "this shape is not condensed");
                }
                self.store.keep(hash, Arc::clone(&stored));
                stored
            }
        };
        let fixed_dofs = stored.model.fixed().len() as u64;
        let unknown_dofs = stored.model.modelled_dofs() as u64 - fixed_dofs;
        Ok(ModelReady { model: hash, unknown_dofs, fixed_dofs, reused, stage_ms: clock.finish() })
    }

    /// Whether a frame is a small product with what is kept: known contacts, nothing to factor.
    pub fn is_quick(&self, request: &FrameRequest) -> bool {
        let FrameRequest { model, question } = request;
        let Some(stored) = self.store.find(*model) else { return false };
        condensed::products(&stored, question).is_some_and(|products| products <= QUICK_PRODUCTS)
    }

    /// One frame on a kept model.
    pub fn frame(&self, request: FrameRequest, mut clock: StageClock) -> Result<Answer, Refusal> {
        let FrameRequest { model: hash, question } = request;
        let stored = self.store.find(hash).ok_or(Refusal::UnknownModel(hash))?;
        let model = &stored.model;
        let known = model.known(pairs(&question.known))?;
        let forces = checked_forces(model, &known, &question)?;
        let (method, because) = match Approach::for_frame(&question, &stored, &known)? {
            approach @ Approach::Condensed { .. } => {
                let (watch, clock) = (StrainOf::NewestFrame(&self.compute), clock.clone());
                let answer = condensed::answer(&stored, &question, &known, &approach, watch, clock);
                self.store.trim();
                match answer {
                    // What the small system cannot do, a factor of its own may.
                    Err(Refusal::Model(ModelError::Condensed(error)))
                        if is_auto(&question) && question.masks.is_empty() =>
                    {
                        (Method::Front, format!("not condensed: {error}"))
                    }
                    answered => return answered,
                }
            }
            Approach::Direct { method, because } => (method, because),
        };
        let methods = match is_auto(&question) {
            true => vec![method, Method::FrontMixed],
            false => vec![method],
        };
        let kept = |method: &Method| {
            let is_way = *method == methods[0] || stored.single_only.is_set();
            is_way.then(|| stored.factor_for(&known.dofs, *method)).flatten()
        };
        let kept = methods.iter().find_map(kept);
        let factor_reused = kept.is_some();
        let factored = match kept {
            Some(factored) => factored,
            None => {
                let asking = Asking::about(model, known.dofs.len(), Some(hash));
                let mut room = self.ledger.room();
                let held = (&asking, stored.lasting_bytes());
                let made =
                    self.factor(&mut room, model, &known.dofs, &methods, held, &mut clock)?;
                let made = Arc::new(made);
                if made.method() != methods[0] {
                    stored.single_only.set();
                }
                stored.keep_factor(known.dofs.clone(), Arc::clone(&made));
                self.store.trim();
                made
            }
        };
        let because = because_of(because, &methods, factored.method());
        let asked = Asked {
            question: &question,
            known,
            forces,
            element: name_of(model.element()),
            factor_reused,
            chosen_because: because,
        };
        direct::answer(model, &factored, asked, clock)
    }

    /// Computes the columns of nodes that may soon be touched; a hint, so nothing is answered.
    pub fn prefetch(&self, hint: Prefetch) {
        let Some(stored) = self.store.find(hint.model) else { return };
        condensed::prefetch(&stored, &hint);
        self.store.trim();
    }

    /// Proves the eigenvalue bound of a model, from which every later frame's error bound follows.
    pub fn prove(&self, model: ModelHash) {
        let Some(stored) = self.store.find(model) else { return };
        let mut room = self.ledger.room();
        if let Ok(base) = stored.base()
            && base.eigenvalue_min().is_none()
            && room.take(base.proof_bytes(), stored.lasting_bytes())
        {
            base.estimate_condition();
            base.prove_eigenvalue_min();
        }
    }

    /// A model from what has been sent, with all that is checked of it.
    pub(crate) fn model(
        &self,
        mesh: MeshData,
        materials: &[softgrasp_protocol::Material],
        element: ElementName,
        fixed: Vec<u32>,
        clock: &mut StageClock,
    ) -> Result<Model, Refusal> {
        if materials.is_empty() {
            return Err(Refusal::NoMaterial);
        }
        let materials: Vec<Material> = materials
            .iter()
            .map(|m| Material::try_new(m.young, m.poisson))
            .collect::<Result<_, _>>()?;
        let regions = ranks(&mesh.regions, materials.len())?;
        let vertices: Vec<_> = mesh.vertices.into_iter().map(Point3::from).collect();
        let tets = mesh.tets.into_iter().map(|tet| turned(&vertices, tet)).collect();
        let mesh = TetMesh::try_new(vertices, tets, regions)?;
        let element = element_of(element);
        Ok(Model::try_new(mesh, element, &materials, fixed, &mut |stage| clock.begin(stage))?)
    }

    fn check_node_count(&self, mesh: &MeshData) -> Result<(), Refusal> {
        let (node_count, max) = (mesh.vertices.len(), self.config.max_nodes);
        match node_count > max as usize {
            true => Err(Refusal::TooManyNodes { node_count, max }),
            false => Ok(()),
        }
    }
}

/// Name of an element on the wire.
pub(crate) fn name_of(element: Element) -> ElementName {
    match element {
        Element::Tet4 => ElementName::T4,
        Element::Tet10 => ElementName::T10,
        Element::Tet4Anp => ElementName::T4Anp,
    }
}

/// The element behind a name on the wire.
fn element_of(name: ElementName) -> Element {
    match name {
        ElementName::T4 => Element::Tet4,
        ElementName::T10 => Element::Tet10,
        ElementName::T4Anp => Element::Tet4Anp,
    }
}

/// Why a method was taken, where its like in double precision was larger than allowed.
fn because_of(because: String, methods: &[Method], taken: Method) -> String {
    match methods.first() {
        Some(first) if *first != taken => format!(
            "{because}; {taken}, because the factor of {first} is larger than the memory allowed"
        ),
        _ => because,
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

/// Region labels as positions in the list of materials, which stands in ascending order of the
/// labels; empty when one material is for the whole body. Labels are any numbers: nothing may be
/// as large as they are.
fn ranks(labels: &[u32], materials: usize) -> Result<Vec<u32>, Refusal> {
    if materials == 1 {
        return Ok(Vec::new());
    }
    let mut known = labels.to_vec();
    known.sort_unstable();
    known.dedup();
    // Without labels all elements belong to one region.
    if known.len().max(1) != materials {
        return Err(Refusal::Regions { labels: known.len(), materials });
    }
    Ok(labels.iter().map(|label| known.partition_point(|k| k < label) as u32).collect())
}
