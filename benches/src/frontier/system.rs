//! One system of equations: an object, its element, and the exact answer.

use softgrasp_core::mesh::TetMesh;
use softgrasp_core::model::{Element, Known, Model, ModelError};
use softgrasp_core::solve::{Factored, FrontAnalysis, KnownDisplacements, Loads, Method};

use super::pads::PaddedMesh;
use crate::reference::Reference;
use crate::report::ReportError;
use crate::scene::rubber;

/// Mesh and element of an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Discretisation {
    /// Linear elements of the mesh.
    T4,
    /// Linear elements of the mesh with averaged nodal pressure.
    T4Anp,
    /// Linear elements of the mesh refined once.
    T4Refined,
    /// Ten-node elements of the mesh.
    T10,
}

impl Discretisation {
    pub const ALL: [Self; 4] = [Self::T4, Self::T4Anp, Self::T4Refined, Self::T10];

    pub const fn name(self) -> &'static str {
        match self {
            Self::T4 => "t4",
            Self::T4Anp => "t4-anp",
            Self::T4Refined => "t4, refined",
            Self::T10 => "t10",
        }
    }

    pub const fn element(self) -> Element {
        match self {
            Self::T4 | Self::T4Refined => Element::Tet4,
            Self::T4Anp => Element::Tet4Anp,
            Self::T10 => Element::Tet10,
        }
    }
}

/// Model with known patches, and its answer to the last bits.
pub(super) struct System {
    pub discretisation: Discretisation,
    pub model: Model,
    pub known: Known,
    /// Nodes whose displacements are compared.
    pub watched: Vec<u32>,
    /// Displacements of the watched nodes in the exact answer, 3 for each node, m.
    pub right: Vec<f64>,
}

/// Displacements of some nodes, from those of all.
pub(super) fn at_nodes(displacement: &[f64], nodes: &[u32]) -> Vec<f64> {
    let first = |&n: &u32| 3 * n as usize;
    nodes.iter().flat_map(|n| &displacement[first(n)..first(n) + 3]).copied().collect()
}

/// Root mean square of the difference of two fields, relative to that of the second.
pub(super) fn rms_rel(answer: &[f64], right: &[f64]) -> f64 {
    let squares: f64 = answer.iter().zip(right).map(|(a, b)| (a - b).powi(2)).sum();
    let size: f64 = right.iter().map(|b| b * b).sum();
    (squares / size).sqrt()
}

impl System {
    /// Assembles the system, and solves it to the last bits.
    ///
    /// # Errors
    /// [`ReportError::Model`] also where the patches do not hold the body.
    pub fn try_new(
        padded: &PaddedMesh,
        discretisation: Discretisation,
    ) -> Result<Self, ReportError> {
        let model = assembled(padded.mesh.clone(), discretisation.element())?;
        let known = known(&model, padded, Held::Whole)?;
        let reference = Reference::of(&model, &known)?;
        let watched = padded.watched.clone();
        let right = at_nodes(&reference.displacement, &watched);
        Ok(Self { discretisation, model, known, watched, right })
    }

    pub fn unknown_dofs(&self) -> usize {
        self.model.modelled_dofs() - self.known.dofs.len()
    }
}

pub(super) fn assembled(mesh: TetMesh, element: Element) -> Result<Model, ReportError> {
    Ok(Model::try_new(mesh, element, &[rubber()?], Vec::new(), &mut |_| {})?)
}

/// Nodes of the patches that are held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Held {
    /// Nodes of the mesh, as a request can name them.
    Corners,
    /// Also the mid-edge nodes of the patches: the patch moves as a whole.
    Whole,
}

/// Partition and known displacements of the patches.
fn known(model: &Model, padded: &PaddedMesh, held: Held) -> Result<Known, ReportError> {
    match (held, model.element()) {
        (Held::Corners, _) | (_, Element::Tet4 | Element::Tet4Anp) => {
            Ok(model.known(padded.corner_pairs())?)
        }
        (Held::Whole, Element::Tet10) => {
            let known =
                KnownDisplacements::try_new(padded.whole_pairs()?).map_err(ModelError::from)?;
            Ok(Known { dofs: known.dofs().to_vec(), q_known: known.values().to_vec() })
        }
    }
}

/// Displacements of the watched nodes by ten-node elements, 3 for each node, m; if that takes more than
/// `bytes_max` bytes, the number of bytes that it takes.
///
/// # Errors
/// [`ReportError::Model`], [`ReportError::Solve`].
pub(super) fn quadratic_answer(
    padded: &PaddedMesh,
    held: Held,
    bytes_max: usize,
) -> Result<Result<Vec<f64>, usize>, ReportError> {
    let model = assembled(padded.mesh.clone(), Element::Tet10)?;
    let known = known(&model, padded, held)?;
    let stiffness = model.stiffness();
    let partition = model.held_partition(&known.dofs)?;
    let bytes = FrontAnalysis::new(stiffness, &partition).peak_bytes::<f64>();
    if bytes > bytes_max {
        return Ok(Err(bytes));
    }
    let factored = Factored::try_new(stiffness, partition, Method::Front, &mut |_| {})?;
    let loads = Loads { q_known: &known.q_known, ..Loads::default() };
    let displacement = factored.solve(stiffness, loads, &mut |_| {})?.displacement;
    Ok(Ok(at_nodes(&displacement, &padded.watched)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use softgrasp_core::mesh::{BuiltIn, generate};

    #[test]
    fn answers_come_nearer_to_the_finest_as_mesh_and_element_do() {
        let rough = PaddedMesh::new(generate(BuiltIn::Cube, 64).unwrap());
        let refined = rough.refined().unwrap();
        let answer = |padded, held| quadratic_answer(padded, held, usize::MAX).unwrap().unwrap();
        let finest = answer(&refined, Held::Whole);
        let error = |padded, discretisation| {
            rms_rel(&System::try_new(padded, discretisation).unwrap().right, &finest)
        };
        let t4 = error(&rough, Discretisation::T4);
        let t4_refined = error(&refined, Discretisation::T4Refined);
        let t10 = error(&rough, Discretisation::T10);
        assert!(t4 > 1.5 * t4_refined && t4_refined > 1.5 * t10, "{t4} {t4_refined} {t10}");
        // The same system by another way.
        let same = rms_rel(&answer(&rough, Held::Whole), &finest);
        assert!((same / t10 - 1.0).abs() < 1e-6);
        // Patches that are held at their corners only give way between them.
        assert!(rms_rel(&answer(&rough, Held::Corners), &finest) > 2.0 * t10);
    }

    #[test]
    fn a_factor_that_is_too_large_is_not_made() {
        let padded = PaddedMesh::new(generate(BuiltIn::Sphere, 100).unwrap());
        let bytes = quadratic_answer(&padded, Held::Whole, 1000).unwrap().unwrap_err();
        assert!(bytes > 1000);
    }

    #[test]
    fn equal_fields_have_no_difference_and_double_ones_differ_by_one() {
        assert_eq!(rms_rel(&[1.0, -2.0], &[1.0, -2.0]), 0.0);
        assert_eq!(rms_rel(&[2.0, -4.0], &[1.0, -2.0]), 1.0);
        assert_eq!(at_nodes(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0], &[1]), [3.0, 4.0, 5.0]);
    }
}
