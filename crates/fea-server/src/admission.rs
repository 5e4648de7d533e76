//! What a request may hold in memory: predicted from the size of its mesh before anything is made,
//! counted before a factor is.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use softgrasp_core::fem::Element;
use softgrasp_core::model::{Model, ModelError};
use softgrasp_core::solve::memory::{Bytes, Need, Problem, Way, nodes_that_fit};
use softgrasp_core::solve::work::MeshSize;
use softgrasp_core::solve::{Analysed, Factored, FrontMethod, Method, SolveError};
use softgrasp_protocol::{MeshData, ModelHash};

use crate::answer::{Desk, name_of};
use crate::clock::StageClock;
use crate::memory::available_bytes;
use crate::reject::Refusal;

/// Memory promised to requests under way.
#[derive(Clone)]
pub(crate) struct Ledger {
    limit: u64,
    promised: Arc<Mutex<u64>>,
}

/// What one request has been promised; given back when dropped.
pub(crate) struct Room {
    ledger: Ledger,
    own: u64,
}

/// A need that does not fit, with all the numbers.
#[derive(Debug)]
pub(crate) struct Shortage {
    /// Ways that were looked at; none fits.
    asked: Vec<Need>,
    /// Ways that would fit.
    instead: Vec<Need>,
    problem: Problem,
    unknown_dofs: usize,
    limit: u64,
    /// Promised to other requests.
    promised: u64,
    /// What the machine has to spare, where that is what is too little.
    available: Option<u64>,
}

/// A question about memory.
#[derive(Clone, Copy)]
pub(crate) struct Asking {
    pub problem: Problem,
    pub unknown_dofs: usize,
    /// A kept model that must not be dropped to make room, its bytes being those of the need.
    pub keep: Option<ModelHash>,
}

impl Ledger {
    pub fn new(limit: u64) -> Self {
        Self { limit, promised: Arc::default() }
    }

    /// Room for one request, empty at first.
    pub fn room(&self) -> Room {
        Room { ledger: self.clone(), own: 0 }
    }

    fn promised(&self) -> MutexGuard<'_, u64> {
        self.promised.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn promised_total(&self) -> u64 {
        *self.promised()
    }
}

impl Room {
    /// Bytes that are not promised to others.
    pub fn free(&self) -> u64 {
        let others = self.ledger.promised().saturating_sub(self.own);
        self.ledger.limit.saturating_sub(others)
    }

    /// What was promised becomes what is held.
    pub fn settle(&mut self, bytes: u64) {
        let mut promised = self.ledger.promised();
        *promised = promised.saturating_sub(self.own).saturating_add(bytes);
        drop(promised);
        self.own = bytes;
    }

    /// Asks for `own` bytes in place of what was promised before, `beside` being held already.
    pub fn take(&mut self, own: u64, beside: u64) -> bool {
        let mut promised = self.ledger.promised();
        let others = promised.saturating_sub(self.own);
        let fits = others.saturating_add(own).saturating_add(beside) <= self.ledger.limit;
        if fits {
            *promised = others + own;
            drop(promised);
            self.own = own;
        }
        fits
    }
}

impl Drop for Room {
    fn drop(&mut self) {
        let own = self.own;
        let mut promised = self.ledger.promised();
        *promised = promised.saturating_sub(own);
    }
}

impl Asking {
    /// A request that brings its own mesh.
    pub fn once(mesh: &MeshData, known_dofs: usize) -> Self {
        let problem = Problem { size: size_of(mesh), known_dofs };
        Self { problem, unknown_dofs: unknown_dofs(problem), keep: None }
    }

    /// A model that is there.
    pub fn about(model: &Model, known_dofs: usize, keep: Option<ModelHash>) -> Self {
        let nodes = model.mesh().used_nodes().iter().filter(|used| **used).count();
        let size = MeshSize { nodes, tets: model.mesh().tets().len() };
        let unknown_dofs = model.modelled_dofs().saturating_sub(known_dofs);
        Self { problem: Problem { size, known_dofs }, unknown_dofs, keep }
    }

    /// Predictions of some ways.
    pub fn predict(&self, element: Element, ways: &[Way]) -> Vec<Need> {
        ways.iter().map(|&way| Need::predicted(self.problem, element, way)).collect()
    }
}

impl Desk {
    /// Promises memory to the first of some needs that fits, and drops what is kept and unused for
    /// longest to make room for it. A prediction is refused only if the least it can be is too much.
    pub(crate) fn admit(
        &self,
        room: &mut Room,
        needs: &[Need],
        asking: &Asking,
    ) -> Result<Need, Refusal> {
        let available = available_bytes();
        let is_there = |need: &Need| available.is_none_or(|there| need.factor_bytes_min <= there);
        let mut is_machine = false;
        for need in needs {
            let (own, beside) = match asking.keep {
                None => (need.bytes_min(), 0),
                Some(_) => (need.factor_bytes_min, need.model_bytes),
            };
            if !is_there(need) {
                is_machine = true;
            } else if room.take(own, beside) {
                self.store.make_room(room.ledger.promised_total(), asking.keep);
                return Ok(*need);
            }
        }
        let available = available.filter(|_| is_machine);
        Err(Refusal::Memory(Box::new(self.shortage(room, needs, asking, available))))
    }

    fn shortage(
        &self,
        room: &Room,
        asked: &[Need],
        asking: &Asking,
        available: Option<u64>,
    ) -> Shortage {
        let free = room.free().min(available.unwrap_or(u64::MAX));
        let elements = match asked.first().map(|need| need.element) {
            Some(element) if element != Element::Tet4 => vec![element, Element::Tet4],
            _ => vec![Element::Tet4],
        };
        let others = elements.into_iter().flat_map(|element| {
            Way::SENSIBLE.map(|way| Need::predicted(asking.problem, element, way))
        });
        let is_new = |need: &Need| {
            asked.iter().all(|asked| (asked.element, asked.way) != (need.element, need.way))
        };
        Shortage {
            asked: asked.to_vec(),
            instead: others.filter(|need| is_new(need) && need.bytes() <= free).collect(),
            problem: asking.problem,
            unknown_dofs: asking.unknown_dofs,
            limit: self.config.memory_limit,
            promised: room.ledger.promised().saturating_sub(room.own),
            available,
        }
    }

    /// Factors `K11` by the first of some methods whose factor fits.
    pub(crate) fn factor(
        &self,
        room: &mut Room,
        model: &Model,
        dofs: &[u32],
        methods: &[Method],
        (asking, held): (&Asking, u64),
        clock: &mut StageClock,
    ) -> Result<Factored, Refusal> {
        let fronts: Vec<FrontMethod> =
            methods.iter().copied().filter_map(FrontMethod::of).collect();
        if let [method] = *methods
            && fronts.is_empty()
        {
            return self.factor_otherwise(room, model, dofs, method, (asking, held), clock);
        }
        let analysed = model.analyse(dofs, &mut |stage| clock.begin(stage))?;
        clock.end();
        let counted = |&front: &FrontMethod| counted(model, held, &analysed, front);
        let needs: Vec<Need> = fronts.iter().map(counted).collect();
        let admitted = self.admit(room, &needs, asking)?;
        let front = fronts.into_iter().find(|&f| Way::Direct(f.into()) == admitted.way);
        let front = front.unwrap_or(FrontMethod::Double);
        match analysed.factor(model.stiffness(), front, &mut |stage| clock.begin(stage)) {
            // Too hard for single precision, which was taken for its size: what is short is memory.
            Err(SolveError::NotPositiveDefinite { .. }) if Some(&admitted) != needs.first() => {
                let shortage = self.shortage(room, &needs[..1], asking, None);
                Err(Refusal::Memory(Box::new(shortage)))
            }
            factored => factored.map_err(|error| Refusal::Model(error.into())),
        }
    }

    /// The same for a dense method, or for the sparse one whose count is its own.
    fn factor_otherwise(
        &self,
        room: &mut Room,
        model: &Model,
        dofs: &[u32],
        method: Method,
        (asking, held): (&Asking, u64),
        clock: &mut StageClock,
    ) -> Result<Factored, Refusal> {
        let way = Way::Direct(method);
        let exact = |bytes| Need::exact(model.element(), way, held, bytes);
        let limit = match method.dense_bytes(asking.unknown_dofs) {
            Some(bytes) => {
                model.check_held(dofs, &[])?;
                self.admit(room, &[exact(bytes)], asking)?.factor_bytes
            }
            None => room.free().saturating_sub(held),
        };
        match model.factor_within(dofs, method, limit, &mut |stage| clock.begin(stage)) {
            Err(ModelError::Solve(SolveError::OverLimit { needed, .. })) => {
                let shortage = self.shortage(room, &[exact(needed)], asking, None);
                Err(Refusal::Memory(Box::new(shortage)))
            }
            factored => Ok(factored?),
        }
    }
}

/// Need of a factor over fronts whose pattern is analysed, `held` being what the model holds.
pub(crate) fn counted(model: &Model, held: u64, analysed: &Analysed, front: FrontMethod) -> Need {
    let blocks = model.stiffness().pattern().block_count();
    let way = Way::Direct(front.into());
    Need::counted(model.element(), way, held, blocks, analysed.analysis())
}

/// Nodes that elements use, and elements; indices out of range are refused elsewhere.
pub(crate) fn size_of(mesh: &MeshData) -> MeshSize {
    let mut used = vec![false; mesh.vertices.len()];
    for &node in mesh.tets.iter().flatten() {
        if let Some(used) = used.get_mut(node as usize) {
            *used = true;
        }
    }
    MeshSize { nodes: used.iter().filter(|used| **used).count(), tets: mesh.tets.len() }
}

fn unknown_dofs(problem: Problem) -> usize {
    (3 * problem.size.nodes).saturating_sub(problem.known_dofs)
}

impl fmt::Display for Shortage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Problem { size, .. } = self.problem;
        write!(
            f,
            "{} nodes, {} tetrahedra, {} unknowns: ",
            size.nodes, size.tets, self.unknown_dofs
        )?;
        for (i, need) in self.asked.iter().enumerate() {
            let comma = if i > 0 { ", " } else { "" };
            write!(f, "{comma}{}", Told(need))?;
        }
        match self.available {
            Some(available) => {
                write!(f, "; this machine has {} to spare", Bytes(available))?;
            }
            None => write!(f, "; the server's --memory-limit is {}", Bytes(self.limit))?,
        }
        if self.promised > 0 {
            write!(f, ", of which other requests have {} now", Bytes(self.promised))?;
        }
        f.write_str("; ")?;
        for need in &self.instead {
            let name = name_of(need.element).as_str();
            write!(
                f,
                "use {} on {name}, which needs about {}, or ",
                need.way,
                Bytes(need.bytes())
            )?;
        }
        let limit = self.available.unwrap_or(self.limit).saturating_sub(self.promised);
        let smallest = self.asked.iter().min_by_key(|need| need.bytes());
        let Some(need) = smallest else { return Ok(()) };
        let nodes = nodes_that_fit(self.problem, need.element, need.way, limit);
        let room = need.bytes().saturating_add(self.promised);
        write!(f, "use fewer nodes (about {nodes} fit) or allow {} or more", Bytes(room))
    }
}

/// A need in words.
struct Told<'a>(&'a Need);

impl fmt::Display for Told<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(need) = self;
        let element = name_of(need.element).as_str();
        let verb = if need.is_predicted() { "is predicted to need" } else { "needs" };
        write!(
            f,
            "{} on {element} {verb} {} ({} for mesh and stiffness, {} for the factor",
            need.way,
            Bytes(need.bytes()),
            Bytes(need.model_bytes),
            Bytes(need.factor_bytes)
        )?;
        match need.is_predicted() {
            true => write!(f, "; {} at the least)", Bytes(need.bytes_min())),
            false => write!(f, ")"),
        }
    }
}

impl Shortage {
    /// The same in bare numbers, for the log and for programs.
    pub fn detail(&self) -> String {
        let limit = format!("limit_bytes={} promised_bytes={}", self.limit, self.promised);
        self.asked.iter().fold(limit, |detail, need| {
            format!(
                "{detail}; {}/{}: model_bytes={} factor_bytes={} factor_bytes_min={}",
                name_of(need.element).as_str(),
                need.way,
                need.model_bytes,
                need.factor_bytes,
                need.factor_bytes_min
            )
        })
    }
}
