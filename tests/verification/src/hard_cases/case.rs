//! A hard case: the question, and the promise about its answer, made before it was measured.

use nalgebra::{Point3, Vector3};
use softgrasp_core::fem::Material;
use softgrasp_core::mesh::TetMesh;
use softgrasp_core::solve::ERROR_UNREMARKABLE;

use super::refusal::Reason;
use super::shapes::{nearest, nodes_where};
use softgrasp_bench::report::ReportError;

/// Numbers of threads of the pools that must give the same bits; the first is asked again at the end.
pub(super) const THREADS: [usize; 5] = [2, 1, 4, 7, 2];

/// Question about an object: its support and its known displacements.
///
/// Units: m, Pa.
#[derive(Clone, Debug)]
pub(super) struct Question {
    pub mesh: TetMesh,
    pub materials: Vec<Material>,
    /// Degrees of freedom that the model fixes at zero.
    pub fixed: Vec<u32>,
    /// Known displacements as a request names them, m: in any order, perhaps twice.
    pub pairs: Vec<(u32, f64)>,
}

/// Kinds of outcomes that a case allows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Allowed {
    pub exact: bool,
    pub degraded: bool,
    pub refused: bool,
}

/// Set of ways that a case is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reach {
    /// All ways, dense methods included.
    All,
    /// One method of each kind, for a question that is asked two hundred times.
    OfEachKind,
    /// Ways that `auto` may choose for a mesh too large for the others: linear elements.
    Large,
}

/// Number of repetitions, each with the shape that the answer before left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Repeats {
    Once,
    /// So many repetitions; every second one is pushed backwards.
    ToAndFro(usize),
    Onwards(usize),
}

/// Question, and the promise about its answer.
#[derive(Clone, Debug)]
pub(super) struct Case {
    pub name: String,
    pub question: Question,
    /// Right reason for a refusal.
    pub reason: Reason,
    /// Outcomes allowed for ways with a factor in double precision.
    pub double: Allowed,
    /// Outcomes allowed for ways with a factor in single precision.
    pub single: Allowed,
    /// Exact displacement of every node, m, if it is known without solving.
    pub field: Option<Vec<f64>>,
    pub reach: Reach,
    pub repeats: Repeats,
    /// Number of runs, each with another number of threads; at most as many as [`THREADS`].
    pub runs: usize,
}

/// Cases of one kind, the reason for their thresholds, and advice for users.
#[derive(Clone, Debug)]
pub(super) struct Family {
    pub name: &'static str,
    /// Reason for the thresholds.
    pub reasoning: &'static str,
    pub advice: &'static str,
    pub cases: Vec<Case>,
}

/// Size of the report.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Form {
    pub is_quick: bool,
    /// Number of cells along an edge of the block that most cases use.
    pub cells: usize,
}

/// Relative error of a well supported block of ν = 0.3: Skeel's condition number of some thousands times
/// the rounding of a double, and a margin of about ten for the sums over rows.
const WELL_POSED: f64 = 1e-11;
/// Approximate condition number of the same block.
const WELL_POSED_CONDITION: f64 = 1e3;
/// Growth of the condition at which no digit is certain: the condition times the rounding is a tenth.
const DOUBLE_GROWTH_MAX: f64 = 0.1 / (WELL_POSED_CONDITION * f64::EPSILON);
/// Share of that growth from which on an estimate may refuse already, since it is wrong by some factor.
const REFUSAL_MARGIN: f64 = 1e-3;

impl Allowed {
    pub const EXACT: Self = Self { exact: true, degraded: false, refused: false };
    pub const ANSWERED: Self = Self { exact: true, degraded: true, refused: false };
    pub const CAUTIOUS: Self = Self { exact: false, degraded: true, refused: true };
    pub const EXACT_OR_REFUSED: Self = Self { exact: true, degraded: false, refused: true };
    pub const REFUSED: Self = Self { exact: false, degraded: false, refused: true };
    pub const ANY: Self = Self { exact: true, degraded: true, refused: true };

    pub fn text(self) -> String {
        let words = [(self.exact, "exact"), (self.degraded, "degraded"), (self.refused, "refused")];
        let words: Vec<&str> = words.iter().filter(|w| w.0).map(|w| w.1).collect();
        words.join(" or ")
    }
}

impl Case {
    /// A case whose condition is `growth` times that of a well supported block, by theory.
    ///
    /// If theory predicts a larger error, the answer may be degraded, as it states; it may be refused if
    /// no digit can be certain.
    pub fn new(name: impl Into<String>, question: Question, growth: f64) -> Self {
        let double = if growth >= REFUSAL_MARGIN * DOUBLE_GROWTH_MAX {
            Allowed::ANY
        } else if WELL_POSED * growth >= ERROR_UNREMARKABLE {
            Allowed::ANSWERED
        } else {
            Allowed::EXACT
        };
        // Single precision falls back to double, so it promises as much.
        let single = double;
        Self {
            name: name.into(),
            question,
            reason: Reason::Weak,
            double,
            single,
            field: None,
            reach: Reach::All,
            repeats: Repeats::Once,
            runs: THREADS.len(),
        }
    }

    /// Sets the right reason for a refusal.
    pub fn because(self, reason: Reason) -> Self {
        Self { reason, ..self }
    }

    /// Sets the outcomes that are allowed, whatever the factor.
    pub fn allowing(self, allowed: Allowed) -> Self {
        Self { double: allowed, single: allowed, ..self }
    }

    /// Sets the exact answer, known without solving: `u = u(x)`.
    pub fn with_field(mut self, field: impl Fn(&Point3<f64>) -> Vector3<f64>) -> Self {
        let vertices = self.question.mesh.vertices();
        self.field = Some(vertices.iter().flat_map(|p| <[f64; 3]>::from(field(p))).collect());
        self
    }
}

impl Question {
    /// Object that is fixed at its lower end along an axis, and whose other end two contacts move by a
    /// hundredth of its size.
    pub fn clamped(mesh: TetMesh, materials: Vec<Material>, axis: usize) -> Self {
        let (low, high) = mesh.bounds();
        let end = nodes_where(&mesh, |p| p[axis] - low[axis] <= 1e-9 * (high - low)[axis]);
        let fixed = all_axes(&end);
        let mut second = high;
        second[(axis + 1) % 3] = low[(axis + 1) % 3];
        let size = mesh.size();
        let mut pairs = moved(nearest(&mesh, &high), [0.3, -0.2, -1.0], 0.01 * size);
        pairs.extend(moved(nearest(&mesh, &second), [-0.1, 0.4, 0.2], 0.01 * size));
        Self { mesh, materials, fixed, pairs }
    }

    /// Object that only contacts at five corners hold, which move by a hundredth of its size.
    pub fn held(mesh: TetMesh, materials: Vec<Material>) -> Self {
        let (low, high) = mesh.bounds();
        let size = mesh.size();
        let corner = |x: usize, y: usize, z: usize| {
            let at = [x, y, z];
            let place = Point3::from([0, 1, 2].map(|a| if at[a] == 1 { high[a] } else { low[a] }));
            nearest(&mesh, &place)
        };
        let push = |node: u32, by: [f64; 3]| moved(node, by, 0.01 * size);
        let pairs = [
            push(corner(0, 0, 0), [0.0; 3]),
            push(corner(1, 0, 0), [-0.2, 0.0, 0.1]),
            push(corner(0, 1, 0), [0.0, -0.1, 0.0]),
            push(corner(1, 1, 1), [0.3, -0.2, -1.0]),
            push(corner(0, 0, 1), [0.1, 0.1, -0.5]),
        ]
        .concat();
        Self { mesh, materials, fixed: Vec::new(), pairs }
    }

    /// The question with all known displacements multiplied by `by`.
    pub fn scaled(&self, by: f64) -> Self {
        let pairs = self.pairs.iter().map(|&(dof, value)| (dof, by * value)).collect();
        Self { pairs, ..self.clone() }
    }
}

/// Degrees of freedom of all axes of some nodes.
pub(super) fn all_axes(nodes: &[u32]) -> Vec<u32> {
    nodes.iter().flat_map(|n| 3 * n..3 * n + 3).collect()
}

/// Known displacement of a node: a multiple of a vector.
pub(super) fn moved(node: u32, by: [f64; 3], times: f64) -> Vec<(u32, f64)> {
    (3 * node..3 * node + 3).zip(by).map(|(dof, value)| (dof, times * value)).collect()
}

/// Rubber with ν = 0.3.
///
/// # Errors
/// None in practice: the constants describe a material.
pub(super) fn plain() -> Result<Vec<Material>, ReportError> {
    Ok(vec![Material::try_new(1.0e5, 0.3)?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hard_cases::shapes::block;

    #[test]
    fn promises_follow_from_the_growth_of_the_condition() {
        let question = Question::held(block([1; 3], [1.0; 3]).unwrap(), plain().unwrap());
        let case = |growth| Case::new("", question.clone(), growth);
        assert_eq!((case(1.0).reason, case(1.0).double), (Reason::Weak, Allowed::EXACT));
        assert_eq!(case(1.0).single, Allowed::EXACT);
        // Beyond a hundred an answer may be off by more than goes without saying: it says so.
        assert_eq!(case(1e6).double, Allowed::ANSWERED);
        // Single precision falls back to double: it may refuse no more than that.
        assert_eq!(case(1e6).single, Allowed::ANSWERED);
        assert_eq!(case(1e12).double, Allowed::ANY);
        assert_eq!(Allowed::ANY.text(), "exact or degraded or refused");
    }

    #[test]
    fn clamped_and_held_objects_have_their_contacts_where_they_should() {
        let mesh = block([2; 3], [1.0; 3]).unwrap();
        let clamped = Question::clamped(mesh.clone(), plain().unwrap(), 2);
        assert_eq!((clamped.fixed.len(), clamped.pairs.len()), (27, 6));
        assert!(clamped.pairs.iter().all(|(dof, _)| !clamped.fixed.contains(dof)));
        let held = Question::held(mesh, plain().unwrap());
        let mut nodes: Vec<u32> = held.pairs.iter().map(|p| p.0 / 3).collect();
        nodes.dedup();
        assert_eq!(nodes, [0, 2, 6, 26, 18]);
        assert_eq!(held.scaled(2.0).pairs[11], (80, -0.02));
    }
}
