//! How much memory a method holds at once: predicted from the size of a mesh, then counted.

use std::fmt;
use std::str::FromStr;

use super::work::{MeshSize, Work};
use super::{FrontAnalysis, Method};
use crate::fem::{AXES, Element};

/// Memory that one method holds at once, at most.
///
/// Units: bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Need {
    /// Finite element of the model.
    pub element: Element,
    /// Method. That of [`Method::Condensed`] is its base, without the columns, which have a bound of
    /// their own.
    pub method: Method,
    /// Mesh, pattern and stiffness.
    pub model_bytes: u64,
    /// Factor or inverse with all that waits while it is made.
    pub factor_bytes: u64,
    /// Least that the factor can take where it is predicted; the same where it is counted.
    pub factor_bytes_min: u64,
}

/// What is known before anything is made.
///
/// Units: counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Nodes that elements use, and elements.
    pub size: MeshSize,
    /// Degrees of freedom whose displacement is known.
    pub known_dofs: usize,
}

/// A factor over fronts takes at most so many times what is predicted from the size of the mesh;
/// counted on the shapes of `examples/work_law.rs`.
pub const MOST_OVER_PREDICTED: f64 = 2.0;
/// A factor over fronts takes at least the predicted memory over this. The number is larger than was counted
/// on those shapes: a slender body takes the less the more slender it is, and a request that is refused by
/// the prediction is never counted.
pub const PREDICTED_OVER_LEAST: f64 = 3.0;

/// Bytes of a node of a model: coordinates, marks, starts of rows.
const BYTES_PER_NODE: usize = 40;
/// Bytes of a 3 × 3 block of the stiffness with its column.
pub const BYTES_PER_BLOCK: usize = 76;
/// Bytes of order and analysis for each block, while the factor is there.
const ORDER_BYTES_PER_BLOCK: f64 = 8.0;
/// Vectors of all degrees of freedom that are held at once while the answer is refined.
const VECTORS: f64 = 10.0;

/// Bytes of mesh, pattern and stiffness, roughly.
///
/// Shapes: `nodes` corners; `blocks` 3 × 3 blocks of the stiffness.
pub fn model_bytes(element: Element, nodes: usize, tets: usize, blocks: usize) -> usize {
    // Corners; and for each node of an element the row it adds to, with a place per node.
    let per_tet = match element {
        Element::Tet4 | Element::Tet4Anp => 16 + 4 * (8 + 4 * 4),
        Element::Tet10 => 16 + 40 + 10 * (8 + 4 * 10),
    };
    BYTES_PER_NODE * nodes + per_tet * tets + BYTES_PER_BLOCK * blocks
}

/// The methods that are worth a look where none is asked for, best first.
pub const SENSIBLE: [Method; 4] =
    [Method::Front, Method::FrontMixed, Method::Condensed, Method::Multigrid];

/// Bytes of a hierarchy for each block of the stiffness: its copy in single precision with its column,
/// and what is held while the next coarser matrix is made. Measured by `examples/multigrid_times.rs`.
const HIERARCHY_PER_BLOCK: usize = 130;
/// Bytes of a hierarchy and of the vectors of conjugate gradients for each node.
const HIERARCHY_PER_NODE: usize = 2200;

/// Bytes of a hierarchy of [`Method::Multigrid`] with all that is held while it is made and worked
/// with, roughly.
///
/// Shapes: `nodes` of the system; `blocks` 3 × 3 blocks of the stiffness.
pub fn hierarchy_bytes(nodes: usize, blocks: usize) -> usize {
    HIERARCHY_PER_NODE * nodes + HIERARCHY_PER_BLOCK * blocks
}

/// Bytes of a number of a method's factor.
fn number_bytes(method: Method) -> f64 {
    match method {
        Method::FrontMixed | Method::Pcg => 4.0,
        _ => 8.0,
    }
}

impl Need {
    /// Prediction from the size of a mesh alone, before anything is made.
    ///
    /// Dense methods are exact; a factor over fronts is between [`Need::factor_bytes_min`] and
    /// [`Need::factor_bytes_max`].
    pub fn predicted(problem: Problem, element: Element, method: Method) -> Self {
        let whole = Work::estimate(problem.size, element);
        let unknown = (whole.unknown_dofs - problem.known_dofs as f64).max(0.0);
        let nodes = (whole.unknown_dofs / AXES as f64) as usize;
        let model_bytes =
            model_bytes(element, nodes, problem.size.tets, whole.blocks as usize) as u64;
        let around = Self::around(&whole);
        let (factor, least) = match method.dense_bytes(unknown as usize) {
            _ if method == Method::Multigrid => {
                let bytes = hierarchy_bytes(nodes, whole.blocks as usize) as f64;
                (bytes, bytes)
            }
            Some(bytes) => (bytes as f64, bytes as f64),
            None => {
                let share = unknown / whole.unknown_dofs.max(1.0);
                let entries = whole.peak_entries * share.powf(4.0 / 3.0);
                let factor = number_bytes(method) * entries;
                (factor + around, factor / PREDICTED_OVER_LEAST)
            }
        };
        Self {
            element,
            method,
            model_bytes,
            factor_bytes: factor as u64,
            factor_bytes_min: least as u64,
        }
    }

    /// What a factor over fronts takes, once its pattern is analysed.
    ///
    /// Units: `model_bytes` bytes.
    pub fn counted(
        element: Element,
        method: Method,
        model_bytes: u64,
        blocks: usize,
        analysis: &FrontAnalysis,
    ) -> Self {
        let numbers = analysis.peak_bytes_of(method) as f64;
        let vectors = VECTORS * (size_of::<f64>() * analysis.row_count()) as f64;
        let factor_bytes = numbers + ORDER_BYTES_PER_BLOCK * blocks as f64 + vectors;
        Self::exact(element, method, model_bytes, factor_bytes as u64)
    }

    /// A need that is known.
    ///
    /// Units: bytes.
    pub fn exact(element: Element, method: Method, model_bytes: u64, factor_bytes: u64) -> Self {
        Self { element, method, model_bytes, factor_bytes, factor_bytes_min: factor_bytes }
    }

    /// Order, analysis and vectors of an estimate.
    fn around(work: &Work) -> f64 {
        ORDER_BYTES_PER_BLOCK * work.blocks + VECTORS * size_of::<f64>() as f64 * work.unknown_dofs
    }

    /// All of it.
    pub fn bytes(&self) -> u64 {
        self.model_bytes.saturating_add(self.factor_bytes)
    }

    /// The least that all of it can be.
    pub fn bytes_min(&self) -> u64 {
        self.model_bytes.saturating_add(self.factor_bytes_min)
    }

    /// Most that the factor can take.
    pub fn factor_bytes_max(&self) -> u64 {
        match self.is_predicted() {
            true => (self.factor_bytes as f64 * MOST_OVER_PREDICTED) as u64,
            false => self.factor_bytes,
        }
    }

    /// The most that all of it can be.
    pub fn bytes_max(&self) -> u64 {
        self.model_bytes.saturating_add(self.factor_bytes_max())
    }

    /// Whether it is a prediction, with the uncertainty of one.
    pub fn is_predicted(&self) -> bool {
        self.factor_bytes_min < self.factor_bytes
    }
}

/// About as many nodes as fit a limit by one method, with as many elements per node.
///
/// Units: `limit` bytes; the result nodes, 0 where nothing fits.
pub fn nodes_that_fit(problem: Problem, element: Element, method: Method, limit: u64) -> usize {
    let nodes = problem.size.nodes.max(1);
    let fits = |n: usize| {
        let tets = (problem.size.tets as f64 * n as f64 / nodes as f64) as usize;
        let scaled = Problem { size: MeshSize { nodes: n, tets }, known_dofs: 0 };
        Need::predicted(scaled, element, method).bytes() <= limit
    };
    let (mut low, mut high) = (0, nodes);
    while low + 1 < high {
        let middle = low.midpoint(high);
        match fits(middle) {
            true => low = middle,
            false => high = middle,
        }
    }
    low
}

/// A number of bytes as a person reads and writes it: `8GiB`, `512MiB`, `40000`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Bytes(pub u64);

/// A text that is no number of bytes.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{text}' is no number of bytes; write 8GiB, 512MiB, 2GB, or the bytes themselves")]
pub struct NoBytes {
    /// The text as it was given.
    pub text: String,
}

/// Units of bytes by name, in lower case; single letters are binary, as with containers.
const UNITS: [(&str, u64); 14] = [
    ("", 1),
    ("b", 1),
    ("k", 1 << 10),
    ("kib", 1 << 10),
    ("m", 1 << 20),
    ("mib", 1 << 20),
    ("g", 1 << 30),
    ("gib", 1 << 30),
    ("t", 1 << 40),
    ("tib", 1 << 40),
    ("kb", 1_000),
    ("mb", 1_000_000),
    ("gb", 1_000_000_000),
    ("tb", 1_000_000_000_000),
];

impl fmt::Display for Bytes {
    /// Whole below a mebibyte, else mebibytes or gibibytes.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mebibytes = self.0 as f64 / (1u64 << 20) as f64;
        match self.0 {
            0..0x10_0000 => write!(f, "{} bytes", self.0),
            0x10_0000..0x4000_0000 => write!(f, "{mebibytes:.1} MiB"),
            _ => write!(f, "{:.1} GiB", mebibytes / 1024.0),
        }
    }
}

impl FromStr for Bytes {
    type Err = NoBytes;

    fn from_str(text: &str) -> Result<Self, NoBytes> {
        let refuse = || NoBytes { text: text.to_owned() };
        let end = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
        let (number, unit) = text.split_at(end);
        let unit = unit.trim_start().to_ascii_lowercase();
        let (_, unit) = UNITS.iter().find(|(name, _)| *name == unit).ok_or_else(refuse)?;
        if let Ok(whole) = number.parse::<u64>() {
            return whole.checked_mul(*unit).map(Self).ok_or_else(refuse);
        }
        let real: f64 = number.parse().map_err(|_| refuse())?;
        let bytes = real * *unit as f64;
        // 2⁶³ and more is surely a slip; a part of a byte is none.
        match *unit > 1 && bytes < (1u64 << 63) as f64 {
            true => Ok(Self(bytes as u64)),
            false => Err(refuse()),
        }
    }
}

#[cfg(test)]
mod tests;
