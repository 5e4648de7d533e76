//! Predicts memory and time of one answer on a mesh, for each element and method.

use std::fmt;

use serde::Serialize;
use softgrasp_core::fem::Element;
use softgrasp_core::solve::Method;
use softgrasp_core::solve::memory::{Bytes, Need, Problem, nodes_that_fit};
use softgrasp_core::solve::rates::Rates;
use softgrasp_core::solve::work::Work;

use crate::ask::connection::OwnMachine;

/// Costs of one answer by every sensible element and method, compared with a limit and this machine.
#[derive(Debug, Serialize)]
pub struct Forecast {
    /// Forecasts, best first; linear elements come before ten-node ones.
    pub ways: Vec<WayForecast>,
    /// Memory that a server with this `--memory-limit` may take, bytes.
    pub memory_limit_bytes: u64,
    /// Free memory of this machine, bytes; `None` where the system does not tell.
    pub memory_available_bytes: Option<u64>,
    /// Whether times come from rates measured on this machine, or typical ones.
    pub rates: &'static str,
    /// Number of threads that the rates were measured with.
    pub threads: usize,
    #[serde(skip)]
    problem: Problem,
}

/// Cost of one answer by one element and method.
#[derive(Debug, Serialize)]
pub struct WayForecast {
    /// Name of the element.
    pub element: &'static str,
    /// Name of the method.
    pub method: &'static str,
    /// Memory of mesh, pattern and stiffness, bytes.
    pub model_bytes: u64,
    /// Memory of the factor while it is made, bytes.
    pub factor_bytes: u64,
    /// Memory of all together as predicted, bytes.
    pub bytes: u64,
    /// Least memory of all together that is possible, bytes.
    pub bytes_min: u64,
    /// Largest memory of all together that is possible, bytes.
    pub bytes_max: u64,
    /// Predicted time of one answer, ms.
    pub predicted_ms: f64,
    /// Whether the memory is within the server's limit.
    pub within_limit: Fit,
    /// Whether the memory is within what the machine has free.
    pub within_machine: Fit,
    #[serde(skip)]
    need: Need,
}

/// Whether a prediction with its uncertainty is within a bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Fit {
    /// Even the largest possible value is within the bound.
    Yes,
    /// The bound lies within the uncertainty; the count before the factor decides.
    Perhaps,
    /// Even the least possible value is above the bound.
    No,
}

/// Elements and methods that may answer, best first for each element; `condensed` has linear ones only.
const WAYS: [(Element, Method); 6] = [
    (Element::Tet4, Method::Front),
    (Element::Tet4, Method::FrontMixed),
    (Element::Tet4, Method::Condensed),
    (Element::Tet4Anp, Method::Front),
    (Element::Tet10, Method::Front),
    (Element::Tet10, Method::FrontMixed),
];
/// Relative error that a refined answer is predicted for.
const ERROR_REL: f64 = 1e-12;

impl Fit {
    fn of(need: &Need, bound: Option<u64>) -> Self {
        match bound {
            None => Self::Perhaps,
            Some(bound) if need.bytes_max() <= bound => Self::Yes,
            Some(bound) if need.bytes_min() <= bound => Self::Perhaps,
            Some(_) => Self::No,
        }
    }
}

impl Forecast {
    /// Forecast for a mesh of this size.
    ///
    /// Units: `memory_limit_bytes` bytes; `None` takes a server's default.
    pub fn new(problem: Problem, memory_limit_bytes: Option<u64>, machine: &OwnMachine) -> Self {
        let limit = memory_limit_bytes.unwrap_or(machine.usual_limit_bytes);
        let rates = machine.rates.unwrap_or(Rates::ASSUMED);
        let ways = WAYS.iter().map(|&(element, method)| {
            let need = Need::predicted(problem, element, method);
            let work = Work::estimate(problem.size, element);
            let predicted_ms = rates.preparation_ms(&work, method)
                + rates.factor_and_solve_ms(&work, method, ERROR_REL);
            WayForecast {
                element: element.name(),
                method: method.name(),
                model_bytes: need.model_bytes,
                factor_bytes: need.factor_bytes,
                bytes: need.bytes(),
                bytes_min: need.bytes_min(),
                bytes_max: need.bytes_max(),
                predicted_ms,
                within_limit: Fit::of(&need, Some(limit)),
                within_machine: Fit::of(&need, machine.available_bytes),
                need,
            }
        });
        Self {
            ways: ways.collect(),
            memory_limit_bytes: limit,
            memory_available_bytes: machine.available_bytes,
            rates: if machine.rates.is_some() { "measured" } else { "typical" },
            threads: machine.threads,
            problem,
        }
    }

    /// First way that is predicted to fit limit and machine, or else the first that may fit.
    pub fn recommended(&self) -> Option<&WayForecast> {
        let there = self.memory_available_bytes.unwrap_or(u64::MAX).min(self.memory_limit_bytes);
        let may = |fit| fit != Fit::No;
        let is_possible = |way: &&WayForecast| may(way.within_limit) && may(way.within_machine);
        let fits = self.ways.iter().find(|way| way.bytes <= there);
        fits.or_else(|| self.ways.iter().find(is_possible))
    }

    /// Reason for which a server with this limit would refuse the mesh, if it would.
    pub fn refusal(&self) -> Option<String> {
        if self.ways.iter().any(|way| way.within_limit != Fit::No) {
            return None;
        }
        let least = self.ways.iter().min_by_key(|way| way.bytes_min)?;
        let nodes = nodes_that_fit(
            self.problem,
            least.need.element,
            least.need.method,
            self.memory_limit_bytes,
        );
        Some(format!(
            "{} on {} elements, which needs least, is predicted to need {} ({} at the least) for {} \
             nodes, and the memory limit is {}; use fewer nodes (about {nodes} fit) or allow {} or \
             more (--memory-limit)",
            least.method,
            least.element,
            Bytes(least.bytes),
            Bytes(least.bytes_min),
            self.problem.size.nodes,
            Bytes(self.memory_limit_bytes),
            Bytes(least.bytes),
        ))
    }
}

impl fmt::Display for Forecast {
    /// Writes one line for each way.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for way in &self.ways {
            let fits = match way.within_limit {
                Fit::Yes => "within",
                Fit::Perhaps => "perhaps within",
                Fit::No => "over",
            };
            let machine = match (way.within_machine, self.memory_available_bytes) {
                (_, None) => String::new(),
                (Fit::Yes, _) => ", fits this machine".to_owned(),
                (Fit::Perhaps, _) => ", perhaps fits this machine".to_owned(),
                (Fit::No, Some(there)) => {
                    format!(", more than the {} this machine has to spare", Bytes(there))
                }
            };
            writeln!(
                f,
                "  {:<6} {:<11} about {} ({} to {}), {}; {fits} the limit of {}{machine}",
                way.element,
                way.method,
                Bytes(way.bytes),
                Bytes(way.bytes_min),
                Bytes(way.bytes_max),
                duration(way.predicted_ms),
                Bytes(self.memory_limit_bytes),
            )?;
        }
        let threads = self.threads;
        match self.rates {
            "measured" => writeln!(
                f,
                "  times         for one answer, within a factor of about 3, by the speed measured \
                 on this machine ({threads} threads)"
            ),
            _ => writeln!(
                f,
                "  times         for one answer, by the speed of one core of about 2020: this \
                 machine could not be measured"
            ),
        }
    }
}

/// Time in ms as text for people.
fn duration(ms: f64) -> String {
    match ms {
        ms if ms < 1e3 => format!("{ms:.0} ms"),
        ms if ms < 120e3 => format!("{:.1} s", ms / 1e3),
        ms if ms < 7200e3 => format!("{:.0} min", ms / 60e3),
        ms => format!("{:.1} h", ms / 3600e3),
    }
}

#[cfg(test)]
mod tests {
    use softgrasp_core::solve::work::MeshSize;

    use super::*;

    fn machine() -> OwnMachine {
        OwnMachine {
            rates: None,
            threads: 2,
            available_bytes: Some(16 << 30),
            usual_limit_bytes: 8 << 30,
        }
    }

    fn forecast(nodes: usize, limit: Option<u64>) -> Forecast {
        let size = MeshSize { nodes, tets: 9 * nodes / 2 };
        Forecast::new(Problem { size, known_dofs: 0 }, limit, &machine())
    }

    #[test]
    fn small_mesh_fits_by_every_way_and_front_is_recommended() {
        let forecast = forecast(500, None);
        assert!(forecast.ways.iter().all(|way| way.within_limit == Fit::Yes));
        assert!(forecast.ways.iter().all(|way| way.within_machine == Fit::Yes));
        let recommended = forecast.recommended().unwrap();
        assert_eq!((recommended.element, recommended.method), ("t4", "front"));
        assert_eq!(forecast.refusal(), None);
    }

    #[test]
    fn mesh_over_the_limit_is_refused_with_the_numbers() {
        let forecast = forecast(160_000, Some(1 << 30));
        assert!(forecast.recommended().is_none());
        let refusal = forecast.refusal().unwrap();
        for part in ["front-mixed", "160000", "1.0 GiB", "about", "--memory-limit"] {
            assert!(refusal.contains(part), "'{part}' is missing in: {refusal}");
        }
        let text = forecast.to_string();
        assert_eq!(text.matches("over the limit of 1.0 GiB").count(), WAYS.len(), "{text}");
    }

    #[test]
    fn what_only_single_precision_fits_is_recommended_in_single_precision() {
        let whole = forecast(20_000, None);
        let between = (whole.ways[0].bytes + whole.ways[1].bytes) / 2;
        let forecast = forecast(20_000, Some(between));
        assert_eq!(forecast.recommended().unwrap().method, "front-mixed");
    }

    #[test]
    fn times_are_told_in_units_a_person_reads() {
        let told = [12.0, 1500.0, 600e3, 36000e3].map(duration);
        assert_eq!(told, ["12 ms", "1.5 s", "10 min", "10.0 h"]);
    }
}
