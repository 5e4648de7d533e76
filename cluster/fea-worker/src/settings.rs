//! How a job is set up, and how a question is answered with that: method, memory, preparations.

use fea_server::engine::{ClusterMethod, Equations, Task};
use softgrasp_core::fem::Element;
use softgrasp_core::solve::memory::Bytes;
use softgrasp_protocol::{RejectCode, Rejected};

use crate::memory::{Shortage, Size};
use crate::order::{Order, Preparation};

/// Settings of a job.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Memory that each rank may take.
    pub memory_per_rank: Bytes,
    /// Whether answers shall have the same bits each time, on the same number of ranks.
    pub is_repeatable: bool,
    /// Whether the digest of each matrix is worked out and logged.
    pub has_digest: bool,
}

/// What a question is answered by.
#[derive(Clone, Debug)]
pub struct Choice {
    /// Method in the report.
    pub method: ClusterMethod,
    /// Why this method.
    pub why: String,
    /// What all ranks are told.
    pub order: Order,
}

impl Settings {
    /// Chooses the method of a question, within the memory there is.
    ///
    /// # Errors
    /// A refusal in the words of the wire.
    pub fn choose(
        &self,
        task: &Task,
        equations: &Equations,
        ranks: usize,
    ) -> Result<Choice, Rejected> {
        if equations.element == Element::Tet10 {
            let text = "a cluster has linear elements only: ask for t4 or t4-anp";
            return Err(Rejected::new(RejectCode::BadRequest, text));
        }
        let nodes = equations.used.iter().filter(|used| **used).count();
        let cases = 1 + equations.cases.len();
        let size = Size { nodes, element: equations.element, cases, ranks };
        let named = match task.question.method.as_str() {
            "auto" => None,
            name => Some(ClusterMethod::named(name).ok_or_else(|| unknown(name))?),
        };
        let (method, why) = self.method(named, &size)?;
        let preparations = match (method, self.is_repeatable) {
            (ClusterMethod::Factor, _) => vec![Preparation::Mumps],
            (ClusterMethod::Cg, true) => vec![Preparation::Hypre],
            (ClusterMethod::Cg, false) => vec![Preparation::Gamg, Preparation::Hypre],
        };
        let order = Order {
            preparations,
            has_estimate: !task.without_estimate,
            has_digest: self.has_digest,
            memory_per_rank: self.memory_per_rank,
        };
        Ok(Choice { method, why, order })
    }

    fn method(
        &self,
        named: Option<ClusterMethod>,
        size: &Size,
    ) -> Result<(ClusterMethod, String), Rejected> {
        let limit = self.memory_per_rank.0.saturating_mul(size.ranks as u64);
        let need = |method| match method {
            ClusterMethod::Cg => size.multigrid_bytes(),
            ClusterMethod::Factor => size.factor_bytes(),
        };
        let checked = |method: ClusterMethod, why: String| match need(method) {
            needed if needed > limit => Err(self.shortage(method, needed, size)),
            _ => Ok((method, why)),
        };
        if let Some(method) = named {
            return checked(method, "asked for".to_owned());
        }
        let (cases, pays) = (size.cases, size.cases_that_pay());
        let fits = need(ClusterMethod::Factor) <= limit;
        let sides =
            if cases == 1 { "1 right-hand side" } else { &format!("{cases} right-hand sides") };
        match cases >= pays {
            true if fits => {
                let why = format!("{sides}; a factor pays from {pays} on");
                checked(ClusterMethod::Factor, why)
            }
            true => {
                let why =
                    format!("{sides}; a factor would pay but does not fit into the ranks' memory");
                checked(ClusterMethod::Cg, why)
            }
            false => {
                checked(ClusterMethod::Cg, format!("{sides}; a factor pays from {pays} on only"))
            }
        }
    }

    fn shortage(&self, method: ClusterMethod, needed: u64, size: &Size) -> Rejected {
        let Size { nodes, cases, ranks, .. } = *size;
        let per_rank = self.memory_per_rank.0;
        let shortage = Shortage { nodes, cases, method: method.name(), ranks, needed, per_rank };
        let rejected = Rejected::new(RejectCode::MemoryLimit, shortage.to_string());
        Rejected { detail: shortage.detail(), ..rejected }
    }
}

fn unknown(name: &str) -> Rejected {
    let [cg, factor] = ClusterMethod::ALL;
    let text = format!("a cluster has no method {name}; it has {cg}, {factor} and auto");
    Rejected::new(RejectCode::UnknownMethod, text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(memory_per_rank: u64) -> Settings {
        Settings {
            memory_per_rank: Bytes(memory_per_rank),
            is_repeatable: false,
            has_digest: false,
        }
    }

    fn size(nodes: usize, cases: usize) -> Size {
        Size { nodes, element: Element::Tet4, cases, ranks: 2 }
    }

    #[test]
    fn many_right_hand_sides_get_a_factor_if_it_fits_and_few_do_not() {
        let plenty = settings(1 << 40);
        let method = |settings: &Settings, nodes, cases| settings.method(None, &size(nodes, cases));
        assert_eq!(method(&plenty, 100_000, 1).unwrap().0, ClusterMethod::Cg);
        assert_eq!(method(&plenty, 100_000, 40).unwrap().0, ClusterMethod::Factor);
        let little = settings(2 << 30);
        let (method, why) = method(&little, 100_000, 40).unwrap();
        assert_eq!(method, ClusterMethod::Cg);
        assert!(why.contains("does not fit"), "{why}");
    }

    #[test]
    fn what_does_not_fit_is_refused_with_the_numbers() {
        let refused = settings(10 << 20).method(None, &size(100_000, 1)).unwrap_err();
        assert_eq!(refused.code, RejectCode::MemoryLimit);
        assert!(refused.text.contains("100000 nodes"), "{}", refused.text);
        assert!(refused.detail.contains("limit_bytes=20971520"), "{}", refused.detail);
        let named = Some(ClusterMethod::Factor);
        let refused = settings(1 << 30).method(named, &size(1_000_000, 1)).unwrap_err();
        assert!(refused.text.contains("cluster-factor"), "{}", refused.text);
    }
}
