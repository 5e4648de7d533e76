//! Figures of the 1998 system, as the thesis prints them, to set beside ours.

/// Time that the thesis gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThesisTime {
    /// Number of vertices of the object.
    pub nodes: usize,
    /// Number of processors.
    pub processors: usize,
    /// Time of the finite element analysis, s.
    pub seconds: f64,
    /// Name of the machine.
    pub machine: &'static str,
    /// Place in the thesis.
    pub source: &'static str,
}

/// Times of the analysis; the last one is an extrapolation of the thesis.
///
/// Source: thesis chapters 5 and 6.
pub const TIMES: [ThesisTime; 3] = [
    ThesisTime {
        nodes: 267,
        processors: 1,
        seconds: 280.0,
        machine: "Indigo2, one R4400",
        source: "chapter 5",
    },
    ThesisTime {
        nodes: 267,
        processors: 4,
        seconds: 13.0,
        machine: "ONYX, four R10000",
        source: "5.2.2",
    },
    ThesisTime {
        nodes: 216,
        processors: 27,
        seconds: 0.5,
        machine: "ONYX, extrapolated",
        source: "6.4",
    },
];

/// Exponents m of T = k Nᵐ (6.1) as (vertices, m).
///
/// The text of 6.4 prints 0.18, 1.5 and 0.9 without signs and calls m nearly zero for few vertices
/// and negative above 100; the first is taken as about zero, the others as negative.
///
/// Source: thesis 6.4, Figure 6.16.
pub const SLOPES: [(usize, f64); 3] = [(50, 0.0), (200, -1.5), (400, -0.9)];

/// Share of the matrix inverse in the analysis at 267 nodes (Figure 5.2).
pub const INVERSE_SHARE: f64 = 0.99;

/// Speed-up over the serial program for 200 to 300 nodes (7.1).
pub const SPEED_UP: f64 = 22.0;
