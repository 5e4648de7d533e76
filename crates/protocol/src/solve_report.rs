//! What every JSON report tells about one solve: the server's report and what the client measured.

use serde::Serialize;

use crate::{Deformation, LargeReport, SolveReport, Warning};

/// Version of the JSON reports; changes when a field changes its meaning or goes.
pub const SCHEMA: u32 = 1;

/// One solve, in the names of the command contract.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SolveSummary {
    /// What the server reported.
    #[serde(flatten)]
    pub report: SolveReport,
    /// Milliseconds from sending the request to having the answer, on the client.
    pub round_trip_ms: f64,
    /// Bytes of the request on the wire.
    pub request_bytes: u64,
    /// Bytes of the answer on the wire.
    pub answer_bytes: u64,
    /// `linear` or `large`: the equations that were solved.
    pub deformation: &'static str,
    /// What is known of an equilibrium at large deformation; its fields are left out for a linear
    /// question.
    #[serde(flatten)]
    pub large: Option<LargeReport>,
}

impl SolveSummary {
    /// From the server's reports and the time the client waited.
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

    /// Adds a warning, the first of all.
    #[must_use]
    pub fn with_first_warning(mut self, warning: Option<Warning>) -> Self {
        self.report.warnings.splice(0..0, warning);
        self
    }

    /// Adds the bytes of request and answer on the wire.
    pub fn with_bytes(self, [request_bytes, answer_bytes]: [u64; 2]) -> Self {
        Self { request_bytes, answer_bytes, ..self }
    }
}
