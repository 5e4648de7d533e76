//! The input of CalculiX for one question.

use std::fmt::Write as _;

use nalgebra::Point3;
use softgrasp_core::fem::{Element, QuadraticMesh, tet10};
use softgrasp_core::mesh::TetMesh;

use crate::question::Question;

/// Nodes and elements of a system, mid-edge nodes behind the corners.
pub struct System {
    pub element: Element,
    pub vertices: Vec<Point3<f64>>,
    /// Nodes of every element in CalculiX's order, from 0.
    tets: Vec<Vec<u32>>,
    /// Whether an element uses a node.
    pub used: Vec<bool>,
}

impl System {
    /// # Panics
    /// For an element that CalculiX has not.
    pub fn new(mesh: &TetMesh, element: Element) -> Self {
        match element {
            Element::Tet4 => Self {
                element,
                vertices: mesh.vertices().to_vec(),
                tets: mesh.tets().iter().map(|&[a, b, c, d]| vec![a, b, d, c]).collect(),
                used: mesh.used_nodes(),
            },
            Element::Tet10 => {
                let quadratic = QuadraticMesh::try_new(mesh).unwrap();
                let turned = |t: &[u32; 10]| tet10::MIRRORED.map(|local| t[local]).to_vec();
                Self {
                    element,
                    vertices: quadratic.vertices().to_vec(),
                    tets: quadratic.tets().iter().map(turned).collect(),
                    used: quadratic.used_nodes(),
                }
            }
            #[allow(unreachable_patterns, reason = "elements that CalculiX has not may follow")]
            other => panic!("CalculiX has no element like {other:?}"),
        }
    }

    fn calculix_name(&self) -> &'static str {
        match self.tets.first().map(Vec::len) {
            Some(10) => "C3D10",
            _ => "C3D4",
        }
    }
}

/// The deck: nodes count from 1, mid-edge nodes are free as in ours.
pub fn deck(system: &System, question: &Question) -> String {
    let mut text = String::from("*NODE, NSET=ALL\n");
    let used = system.vertices.iter().zip(1..).zip(&system.used).filter(|(_, used)| **used);
    for ((p, node), _) in used {
        let [x, y, z] = [p.x, p.y, p.z].map(card);
        writeln!(text, "{node},{x},{y},{z}").unwrap();
    }
    writeln!(text, "*ELEMENT, TYPE={}, ELSET=BODY", system.calculix_name()).unwrap();
    for (element, nodes) in system.tets.iter().enumerate() {
        write!(text, "{}", element + 1).unwrap();
        nodes.iter().for_each(|n| write!(text, ",{}", n + 1).unwrap());
        text.push('\n');
    }
    let (young, poisson) = (card(question.young), card(question.poisson));
    writeln!(text, "*MATERIAL, NAME=SOFT\n*ELASTIC\n{young},{poisson}").unwrap();
    text.push_str("*SOLID SECTION, ELSET=BODY, MATERIAL=SOFT\n*STEP\n*STATIC\n*BOUNDARY\n");
    for (dof, value) in &question.known {
        let (node, axis) = (dof / 3 + 1, dof % 3 + 1);
        writeln!(text, "{node},{axis},{axis},{}", card(*value)).unwrap();
    }
    if !question.forces.is_empty() {
        text.push_str("*CLOAD\n");
    }
    for (dof, value) in &question.forces {
        writeln!(text, "{},{},{}", dof / 3 + 1, dof % 3 + 1, card(*value)).unwrap();
    }
    text.push_str("*NODE PRINT, NSET=ALL\nU, RF\n*END STEP\n");
    text
}

/// A number as exactly as the twenty characters of a card hold it: fourteen digits at least (below 1e100).
fn card(x: f64) -> String {
    let exact = format!("{x:e}");
    if exact.len() <= CARD {
        return exact;
    }
    let mut rounded = (0..17).rev().map(|decimals| format!("{x:.decimals$e}"));
    rounded.find(|text| text.len() <= CARD).expect("one digit fits")
}

/// Characters of a number that CalculiX reads; further ones it leaves out without a word.
const CARD: usize = 20;

#[test]
fn numbers_fit_their_cards_with_fourteen_digits() {
    for x in [0.0, 1.0, -1.0 / 3.0, 2e5 / 3.0, -1e-98 / 3.0, 1e7 / 7.0] {
        let text = card(x);
        assert!(text.len() <= CARD, "{text}");
        let back: f64 = text.parse().unwrap();
        assert!((back - x).abs() <= 5e-14 * x.abs(), "{x:e} became {text}");
    }
}
