//! The refusal of a request that needs too much memory: all numbers, and what would fit.

use std::fmt;

use softgrasp_core::fem::Element;
use softgrasp_core::solve::Method;
use softgrasp_core::solve::memory::{Bytes, Need, Problem, SENSIBLE, nodes_that_fit};

/// Memory needs that do not fit, with limit, reservations and what would fit.
#[derive(Debug)]
pub(crate) struct Shortage {
    /// Needs of the methods that were asked for; none fits.
    asked: Vec<Need>,
    /// Needs of methods that would fit.
    instead: Vec<Need>,
    problem: Problem,
    unknown_dofs: usize,
    limit: u64,
    /// Memory reserved for other requests, bytes.
    reserved: u64,
    /// Free memory of the machine, bytes, if that is what does not suffice.
    available: Option<u64>,
}

impl Shortage {
    /// Shortage of memory when none of the needs fits.
    ///
    /// Units: `limit`, `reserved` (for other requests) and `available` (on the machine, where that is
    /// what is too little) bytes.
    pub fn new(
        asked: &[Need],
        problem: Problem,
        unknown_dofs: usize,
        (limit, reserved): (u64, u64),
        available: Option<u64>,
    ) -> Self {
        let free = limit.saturating_sub(reserved).min(available.unwrap_or(u64::MAX));
        let elements = match asked.first().map(|need| need.element) {
            Some(element) if element != Element::Tet4 => vec![element, Element::Tet4],
            _ => vec![Element::Tet4],
        };
        let others = elements
            .into_iter()
            .flat_map(|element| SENSIBLE.map(|method| Need::predicted(problem, element, method)));
        let is_new = |need: &Need| {
            asked.iter().all(|asked| (asked.element, asked.method) != (need.element, need.method))
        };
        let instead = others.filter(|need| is_new(need) && need.bytes() <= free).collect();
        Self { asked: asked.to_vec(), instead, problem, unknown_dofs, limit, reserved, available }
    }
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
            write!(f, "{comma}{}", InWords(need))?;
        }
        match self.available {
            Some(available) => {
                write!(f, "; this machine has {} to spare", Bytes(available))?;
            }
            None => write!(f, "; the server's --memory-limit is {}", Bytes(self.limit))?,
        }
        if self.reserved > 0 {
            write!(f, ", of which other requests have {} now", Bytes(self.reserved))?;
        }
        f.write_str("; ")?;
        for need in &self.instead {
            let name = need.element.name();
            write!(
                f,
                "use {} on {name}, which needs about {}, or ",
                need.method,
                Bytes(need.bytes())
            )?;
        }
        let limit = self.available.unwrap_or(self.limit).saturating_sub(self.reserved);
        let smallest = self.asked.iter().min_by_key(|need| need.bytes());
        let Some(need) = smallest else { return Ok(()) };
        let nodes = nodes_that_fit(self.problem, need.element, need.method, limit);
        let room = need.bytes().saturating_add(self.reserved);
        write!(f, "use fewer nodes (about {nodes} fit) or allow {} or more", Bytes(room))
    }
}

/// Writes a need in words.
struct InWords<'a>(&'a Need);

impl fmt::Display for InWords<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(need) = self;
        let element = need.element.name();
        let verb = if need.is_predicted() { "is predicted to need" } else { "needs" };
        write!(
            f,
            "{} on {element} {verb} {} ({} for mesh and stiffness, {} for the {}",
            need.method,
            Bytes(need.bytes()),
            Bytes(need.model_bytes),
            Bytes(need.factor_bytes),
            if need.method == Method::Multigrid { "hierarchy" } else { "factor" }
        )?;
        match need.is_predicted() {
            true => write!(f, "; {} at the least)", Bytes(need.bytes_min())),
            false => write!(f, ")"),
        }
    }
}

impl Shortage {
    /// The shortage in plain numbers, for the log and for programs.
    pub fn detail(&self) -> String {
        let limit = format!("limit_bytes={} reserved_bytes={}", self.limit, self.reserved);
        self.asked.iter().fold(limit, |detail, need| {
            format!(
                "{detail}; {}/{}: model_bytes={} factor_bytes={} factor_bytes_min={}",
                need.element.name(),
                need.method,
                need.model_bytes,
                need.factor_bytes,
                need.factor_bytes_min
            )
        })
    }
}
