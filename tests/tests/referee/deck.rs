//! The system that CalculiX solves for one question, and its input.

use glove_client::ask::calculix_deck::CalculixDeck;
use nalgebra::Point3;
use softgrasp_core::fem::{Element, QuadraticMesh};
use softgrasp_core::mesh::TetMesh;
use softgrasp_protocol::{DofValue, LawName};

use crate::object::Object;
use crate::question::Question;

/// Nodes of a system: corners, then mid-edge nodes.
pub struct System {
    pub element: Element,
    pub vertices: Vec<Point3<f64>>,
    /// For each node, whether an element uses it.
    pub used: Vec<bool>,
    mesh: TetMesh,
}

impl System {
    /// System of a mesh and an element.
    ///
    /// # Panics
    /// For an element that CalculiX does not have.
    pub fn new(mesh: &TetMesh, element: Element) -> Self {
        let (vertices, used) = match element {
            Element::Tet4 => (mesh.vertices().to_vec(), mesh.used_nodes()),
            Element::Tet10 => {
                let quadratic = QuadraticMesh::try_new(mesh).unwrap();
                (quadratic.vertices().to_vec(), quadratic.used_nodes())
            }
            Element::Tet4Anp => panic!("CalculiX has no element like {element:?}"),
        };
        Self { element, vertices, used, mesh: mesh.clone() }
    }
}

/// The deck that `glove-client solve --export-deck` writes for the question.
pub fn deck(object: &Object, system: &System, question: &Question) -> String {
    let values = |pairs: &[(u32, f64)]| -> Vec<DofValue> {
        pairs.iter().map(|&(dof, value)| DofValue { dof, value }).collect()
    };
    let deck = CalculixDeck {
        mesh: &system.mesh,
        element: system.element,
        materials: &object.materials(question.young, question.poisson),
        law: question.is_large.then_some(LawName::NeoHookean),
        known: &values(&question.known),
        forces: &values(&question.forces),
    };
    deck.text().unwrap()
}
