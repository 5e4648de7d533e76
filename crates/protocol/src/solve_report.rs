//! What every JSON report tells about one solve: the server's report and the client's measurements.

use serde::Serialize;

use crate::{Deformation, LargeReport, SolveReport, Warning};

/// Version of the JSON reports; it changes when a field changes its meaning or is removed.
pub const SCHEMA: u32 = 1;

/// Report of one solve, with the field names of the command contract.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SolveSummary {
    /// Report by the server.
    #[serde(flatten)]
    pub report: SolveReport,
    /// Time from sending the request to having the answer, measured by the client, ms.
    pub round_trip_ms: f64,
    /// Length of the request on the wire, bytes.
    pub request_bytes: u64,
    /// Length of the answer on the wire, bytes.
    pub answer_bytes: u64,
    /// `linear` or `large`: the equations that were solved.
    pub deformation: &'static str,
    /// Report of the equilibrium at large deformation; its fields are left out for a linear question.
    #[serde(flatten)]
    pub large: Option<LargeReport>,
}

impl SolveSummary {
    /// Summary of the server's reports and of the time that the client waited, ms.
    pub fn new(report: SolveReport, large: Option<LargeReport>, round_trip_ms: f64) -> Self {
        let deformation = large.map_or(Deformation::Linear, |large| large.deformation());
        Self {
            report,
            round_trip_ms,
            request_bytes: 0,
            answer_bytes: 0,
            deformation: deformation.as_str(),
            large,
        }
    }

    /// Adds a warning, if there is one, before all others.
    #[must_use]
    pub fn with_first_warning(mut self, warning: Option<Warning>) -> Self {
        self.report.warnings.splice(0..0, warning);
        self
    }

    /// Adds the lengths of request and answer on the wire, bytes.
    pub fn with_bytes(self, [request_bytes, answer_bytes]: [u64; 2]) -> Self {
        Self { request_bytes, answer_bytes, ..self }
    }
}
