//! The question that every way is asked: a cube that stands on its lowest face and is pressed from above.

use glove_client::ask::model_upload::mesh_data;
use nalgebra::Point3;
use softgrasp_core::fem::Material;
use softgrasp_core::mesh::{BuiltIn, TetMesh, generate};
use softgrasp_core::model::{Element, Model};
use softgrasp_protocol::{
    Ask, Body, DofValue, ElementChoice, MethodName, NodeChoice, Question, Want,
};

use crate::balance::imbalance;
use crate::report::ReportError;
use crate::scene::rubber;

/// Cube of one size, and the known displacements of some of its nodes.
pub(super) struct Cube {
    mesh: TetMesh,
    material: Material,
    /// Known displacements by degree of freedom, m, ascending.
    known: Vec<(u32, f64)>,
}

/// Number of nodes that are pressed, those nearest to the middle of the uppermost face.
const PRESSED: usize = 10;
/// How far they are pressed, over the edge.
const DEPTH: f64 = 0.05;
/// How far they are pushed aside, over the edge.
const ASIDE: f64 = 0.01;

impl Cube {
    /// Cube of `nodes` nodes.
    ///
    /// # Errors
    /// [`ReportError::Generate`] for a number of nodes that objects are not made with.
    pub fn try_new(nodes: usize) -> Result<Self, ReportError> {
        let mesh = generate(BuiltIn::Cube, nodes)?;
        let known = known(&mesh);
        Ok(Self { mesh, material: rubber()?, known })
    }

    pub fn node_count(&self) -> usize {
        self.mesh.node_count()
    }

    /// The question in a method's name, for the displacements of all nodes.
    pub fn ask(&self, method: &str) -> Ask {
        let mesh = mesh_data(&self.mesh);
        let (young, poisson) = (self.material.young(), self.material.poisson());
        let materials = vec![softgrasp_protocol::Material { young, poisson }];
        let known = self.known.iter().map(|&(dof, value)| DofValue { dof, value });
        let question = Question {
            known: known.collect(),
            method: MethodName::try_new(method).expect("the names of all methods can be sent"),
            want: Want { nodes: NodeChoice::All, reactions: false, ..Want::default() },
            ..Question::default()
        };
        Ask::new(Body { mesh, materials, element: ElementChoice::T4 }, question)
    }

    /// Largest force on a free node over the largest on a held one, for each of the answers, by a stiffness
    /// that is assembled here and dropped again.
    ///
    /// Shapes: each of `answers` 3N.
    ///
    /// # Errors
    /// [`ReportError::Model`] if the cube makes no model.
    pub fn imbalances(&self, answers: &[&[f64]]) -> Result<Vec<f64>, ReportError> {
        let mesh = self.mesh.clone();
        let materials = [self.material];
        let model = Model::try_new(mesh, Element::Tet4, &materials, Vec::new(), &mut |_| {})?;
        Ok(answers.iter().map(|answer| imbalance(&model, &self.known, answer)).collect())
    }
}

/// Known displacements: none of the lowest nodes moves, and some of the uppermost move alike.
///
/// Units: m.
fn known(mesh: &TetMesh) -> Vec<(u32, f64)> {
    let (low, high) = mesh.bounds();
    let edge = high.y - low.y;
    let places = mesh.vertices();
    let nodes = || 0..places.len() as u32;
    let is_at = |node: u32, y: f64| (places[node as usize].y - y).abs() < 1e-9 * edge;
    let middle = Point3::new(0.5 * (low.x + high.x), high.y, 0.5 * (low.z + high.z));
    let distance = |node: u32| (places[node as usize] - middle).norm_squared();
    let mut upper: Vec<u32> = nodes().filter(|&node| is_at(node, high.y)).collect();
    // Nodes at the same distance come in the order of their numbers.
    upper.sort_by(|&a, &b| distance(a).total_cmp(&distance(b)).then(a.cmp(&b)));
    upper.truncate(PRESSED);
    let held = nodes().filter(|&node| is_at(node, low.y)).map(|node| (node, [0.0; 3]));
    let push = [ASIDE * edge, -DEPTH * edge, 0.0];
    let all = held.chain(upper.into_iter().map(|node| (node, push)));
    let mut known: Vec<(u32, f64)> = all
        .flat_map(|(node, u)| (0..3).map(move |axis| (3 * node + axis, u[axis as usize])))
        .collect();
    known.sort_by_key(|&(dof, _)| dof);
    known
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lowest_face_is_held_and_ten_nodes_of_the_uppermost_are_pressed() {
        let cube = Cube::try_new(1000).unwrap();
        assert_eq!(cube.known.len(), 3 * (100 + PRESSED));
        assert!(cube.known.windows(2).all(|pair| pair[0].0 < pair[1].0));
        let pressed = cube.known.iter().filter(|(dof, u)| dof % 3 == 1 && *u < 0.0);
        let size = cube.mesh.bounds().1.y - cube.mesh.bounds().0.y;
        assert!(pressed.clone().all(|(_, u)| (u + DEPTH * size).abs() < 1e-12));
        assert_eq!(pressed.count(), PRESSED);
    }

    #[test]
    fn an_answer_that_rests_where_it_is_pressed_is_out_of_balance() {
        let cube = Cube::try_new(27).unwrap();
        let mut answer = vec![0.0; 81];
        assert_eq!(cube.imbalances(&[&answer]).unwrap(), [f64::INFINITY]);
        cube.known.iter().for_each(|&(dof, u)| answer[dof as usize] = u);
        assert!(cube.imbalances(&[&answer]).unwrap()[0] > 0.1);
    }
}
