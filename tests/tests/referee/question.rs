//! Questions about an object: several sets of known displacements, and external forces.

use softgrasp_core::fem::{Element, Material, dof};
use softgrasp_core::model::Model;

use crate::deck::System;
use crate::object::Object;
use crate::solved::Way;

/// Known displacements and forces of one question, by degree of freedom of the mesh's nodes.
#[derive(Clone)]
pub struct Question {
    pub name: &'static str,
    /// Way of the product that answers the question.
    pub way: Way,
    /// Whether the short form asks it too.
    pub is_short: bool,
    pub young: f64,
    pub poisson: f64,
    /// Known displacements, ascending by degree of freedom, m.
    pub known: Vec<(u32, f64)>,
    /// Forces on degrees of freedom that are not known, N.
    pub forces: Vec<(u32, f64)>,
    /// Whether the question is about large deformation.
    pub is_large: bool,
}

/// Largest displacement of a set, relative to the size of the object.
const PART: f64 = 0.01;

/// Number of held nodes beyond those that just hold: with the fewest the hold can be so weak that
/// CalculiX does not repeat all of its seven digits when the nodes are numbered otherwise.
const SPARE: usize = 2;

/// Four questions, each answered in another way; which one, depends on the element.
pub fn questions(object: &Object, system: &System) -> Vec<Question> {
    let is_linear = system.element == Element::Tet4;
    let corners = Corners::new(object);
    let few = Question {
        name: "few whole nodes",
        way: Way::Core,
        is_short: true,
        young: 1e5,
        poisson: 0.3,
        known: corners.few(|_, _| true),
        forces: Vec::new(),
        is_large: false,
    };
    let one_axis = Question {
        name: "every second node along one axis only",
        way: if is_linear { Way::Socket } else { Way::Program },
        is_short: !is_linear,
        young: 3e3,
        poisson: 0.49,
        known: corners.few(|place, axis| place % 2 == 0 || axis == place / 2 % 3),
        forces: Vec::new(),
        is_large: false,
    };
    let pushed = Question {
        name: "low nodes held, high ones pushed",
        way: if is_linear { Way::Core } else { Way::Socket },
        poisson: 0.49,
        known: corners.held_and_pushed(true),
        ..few.clone()
    };
    let held = corners.held_and_pushed(false);
    let forces = corners.forces(&held, 1e5);
    let pulled = Question {
        name: "low nodes held, forces",
        way: if is_linear { Way::Program } else { Way::Core },
        is_short: is_linear,
        known: held,
        forces,
        ..few.clone()
    };
    let all = [few, one_axis, pushed, pulled].into_iter();
    // Where every node is held no force moves anything.
    all.filter(|q| q.known.iter().chain(&q.forces).any(|(_, value)| *value != 0.0)).collect()
}

/// Questions with low nodes held and high ones pushed by several per cent of the size: the object bends
/// and is compressed far beyond the range of linear elasticity.
pub fn large_questions(object: &Object) -> Vec<Question> {
    let pushed = |poisson: f64| {
        let mut known = Corners::new(object).held_and_pushed(true);
        known.iter_mut().for_each(|(_, value)| *value *= LARGE_OVER_SMALL);
        Question {
            name: "low nodes held, high ones pushed far",
            way: Way::Program,
            is_short: true,
            young: 2e4,
            poisson,
            known,
            forces: Vec::new(),
            is_large: true,
        }
    };
    let all = [0.3, 0.45].map(pushed).into_iter();
    all.filter(|q| q.known.iter().any(|(_, value)| *value != 0.0)).collect()
}

/// Ratio of the motion of a question about large deformation to that of the others.
const LARGE_OVER_SMALL: f64 = 8.0;

impl Question {
    /// The question with half the motion.
    pub fn halved(mut self) -> Self {
        self.known.iter_mut().for_each(|(_, value)| *value /= 2.0);
        self
    }
}

/// Nodes of an object that elements use: corners, and mid-edge nodes that the mesh brings along.
struct Corners<'a> {
    object: &'a Object,
    nodes: Vec<usize>,
    model: Model,
}

impl<'a> Corners<'a> {
    fn new(object: &'a Object) -> Self {
        let used = object.mesh.used_nodes();
        let nodes = (0..used.len()).filter(|&n| used[n]).collect();
        let material = Material::try_new(1.0, 0.3).unwrap();
        let (mesh, element) = (object.mesh.clone(), object.elements()[0]);
        let model = Model::try_new(mesh, element, &[material], vec![], &mut |_| {}).unwrap();
        Self { object, nodes, model }
    }

    fn holds(&self, known: &[(u32, f64)]) -> bool {
        let dofs: Vec<u32> = known.iter().map(|k| k.0).collect();
        self.model.check_held(&dofs, &[]).is_ok()
    }

    /// As few nodes as hold every body, and [`SPARE`] more, spread over the object and displaced at
    /// random; `takes(place, axis)` tells which axes of the node at a position in the list are known.
    fn few(&self, takes: impl Fn(usize, usize) -> bool) -> Vec<(u32, f64)> {
        let size = self.object.mesh.size();
        let last = self.nodes.len() - 1;
        let known_of = |count: usize| {
            let mut known = Vec::new();
            for place in 0..count {
                let node = self.nodes[place * last / (count - 1)];
                let axes = (0..3).filter(|&axis| takes(place, axis));
                known.extend(axes.map(|axis| {
                    let dof = dof(node, axis);
                    (dof as u32, PART * size * (1.7 * dof as f64 + 0.3).sin())
                }));
            }
            known.sort_by_key(|k| k.0);
            known
        };
        let mut counts = 3..=last + 1;
        let fewest = counts.find(|&count| self.holds(&known_of(count)));
        let fewest = fewest.expect("all nodes together hold every body");
        known_of((fewest + SPARE).min(last + 1))
    }

    /// The lowest tenth held, or more if that does not hold every body; with `is_pushed` also the highest
    /// tenth pushed down and aside.
    fn held_and_pushed(&self, is_pushed: bool) -> Vec<(u32, f64)> {
        let (mesh, size) = (&self.object.mesh, self.object.mesh.size());
        let (low, high) = mesh.bounds();
        let push = [0.3 * PART * size, -PART * size, 0.0];
        for tenths in 1..=10 {
            let mut known = Vec::new();
            for &node in &self.nodes {
                let part = (mesh.vertices()[node].y - low.y) / (high.y - low.y);
                let moved = match part {
                    p if p >= 0.9 && is_pushed => push,
                    p if p <= 0.1 * f64::from(tenths) => [0.0; 3],
                    _ => continue,
                };
                known.extend((0..3).map(|axis| (dof(node, axis) as u32, moved[axis])));
            }
            if self.holds(&known) {
                return known;
            }
        }
        panic!("{}: all nodes together do not hold it", self.object.name);
    }

    /// Forces on at most five nodes that are not held.
    fn forces(&self, known: &[(u32, f64)], young: f64) -> Vec<(u32, f64)> {
        let is_free = |n: &usize| known.binary_search_by_key(&(3 * *n as u32), |k| k.0).is_err();
        let free: Vec<usize> = self.nodes.iter().copied().filter(is_free).collect();
        let force = 1e-4 * young * self.object.mesh.size().powi(2);
        let nodes = free.iter().step_by(free.len().div_ceil(5).max(1));
        let dofs = nodes.flat_map(|&n| (0..3).map(move |axis| dof(n, axis)));
        dofs.map(|dof| (dof as u32, force * (0.9 * dof as f64 + 0.1).cos())).collect()
    }
}
