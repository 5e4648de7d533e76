//! A body whose shape is followed from load to load.

use std::sync::Arc;

use nalgebra::{Matrix3, Point3, Vector3};
use softgrasp_core::fem::dof;
use softgrasp_core::fem::hyperelastic::{Elements, Law};
use softgrasp_core::model::ModelError;
use softgrasp_core::solve::KnownDisplacements;
use softgrasp_core::solve::equilibrium::{Equilibrium, Goal, NoEquilibrium, Path, Wish};

use super::row::{Cost, End, Row};
use crate::accuracy::discrete::{Discrete, Given};
use crate::accuracy::outcome::{Outcome, Solved};
use softgrasp_bench::report::ReportError;

/// Body with a law, its known degrees of freedom, and its present shape.
pub struct Followed<'a> {
    discrete: &'a Discrete,
    solved: Solved,
    elements: Arc<Elements>,
    known: Vec<u32>,
    path: Path,
}

/// Load of a body: known displacements, and forces, three for each node or none.
pub type Push = (Vec<Given>, Vec<f64>);

/// Figure of a shape: its name, computed and expected value.
pub type Figure = (&'static str, f64, f64);

impl<'a> Followed<'a> {
    /// Body at rest, held at the degrees of freedom of `given`.
    ///
    /// # Errors
    /// [`ReportError::Model`].
    pub fn new(
        discrete: &'a Discrete,
        law: Law,
        given: &[Given],
        (case, poisson, cells): (&'static str, f64, usize),
    ) -> Result<Self, ReportError> {
        let known = KnownDisplacements::try_new(given.to_vec()).map_err(ModelError::from)?;
        let known = known.dofs().to_vec();
        let model = discrete.model();
        let elements = Arc::new(model.hyperelastic(law)?);
        let hold = Arc::new(model.hold(&known, Vec::new(), None)?);
        let nodes = discrete.nodes().len();
        let rest = vec![0.0; 3 * nodes];
        let path = Path::new(Arc::clone(&elements), model.stiffness(), hold, rest, false);
        let (element, unknown) = (discrete.element(), 3 * nodes - known.len());
        let solved = Solved { case, element, poisson, cells, nodes, unknown };
        Ok(Self { discrete, solved, elements, known, path })
    }

    /// Goes to a load in equal steps; `push` gives the load at each share of the way.
    ///
    /// # Errors
    /// [`ReportError::Model`]; without an equilibrium the shape of the last step stays.
    pub fn follow(&mut self, steps: usize, push: impl Fn(f64) -> Push) -> Result<End, ReportError> {
        let mut cost = Cost::default();
        for step in 1..=steps {
            match self.go_to(push(step as f64 / steps as f64))? {
                Ok(found) => cost.add(&found),
                Err(why) => return Ok(End::Lost { step, steps, why }),
            }
        }
        Ok(End::Found(cost))
    }

    fn go_to(
        &mut self,
        (given, mut forces): Push,
    ) -> Result<Result<Equilibrium, NoEquilibrium>, ReportError> {
        let given = KnownDisplacements::try_new(given).map_err(ModelError::from)?;
        if !forces.is_empty() {
            // Those at known degrees of freedom go into the support.
            self.known.iter().for_each(|&d| forces[d as usize] = 0.0);
        }
        let goal = Goal { q_known: given.values(), mask_q: &[], forces: &forces };
        Ok(self.path.advance(&goal, &Wish::EXACT))
    }

    /// Rows for the figures of the shape under a load; without a shape, rows with the expected values.
    pub fn rows(&self, load: f64, end: &End, figures: &[Figure]) -> Vec<Row> {
        let row = |&(quantity, computed, expected): &Figure| {
            let solved = self.solved.clone();
            let outcome = match end.has_shape() {
                true => solved.with_number(quantity, computed, expected),
                false => {
                    Outcome { expected: Some(expected), ..solved.with_error(quantity, f64::NAN) }
                }
            };
            Row { outcome, load, end: end.clone() }
        };
        figures.iter().map(row).collect()
    }

    /// Case, element and size of the body.
    pub fn solved(&self) -> &Solved {
        &self.solved
    }

    /// Displacement of a node, m.
    pub fn at(&self, node: usize) -> Vector3<f64> {
        of_node(self.path.displacement(), node)
    }

    /// Mean displacement of the nodes, each weighted by its force along an axis.
    pub fn mean(&self, forces: &[f64], axis: usize) -> Vector3<f64> {
        let nodes = 0..self.discrete.nodes().len();
        let whole: f64 = nodes.clone().map(|n| forces[dof(n, axis)]).sum();
        nodes.map(|n| self.at(n) * forces[dof(n, axis)]).sum::<Vector3<f64>>() / whole
    }

    /// Forces `∂W/∂u` that hold the shape, three at every node, N.
    pub fn forces(&self) -> Vec<f64> {
        self.forces_at(self.path.displacement())
    }

    /// Forces that hold another shape, N.
    pub fn forces_at(&self, displacement: &[f64]) -> Vec<f64> {
        self.elements.evaluate(displacement).forces
    }

    /// Force on the nodes that `is_meant` picks by their places at rest, N.
    pub fn force_on(&self, is_meant: impl Fn(&Point3<f64>) -> bool) -> Vector3<f64> {
        let forces = self.forces();
        let nodes = self.discrete.nodes().iter().enumerate().filter(|(_, p)| is_meant(p));
        nodes.map(|(n, _)| of_node(&forces, n)).sum()
    }

    /// Sum `Σ f ⊗ X`: the nominal stress of a body in balance, integrated over its volume at rest, N m.
    pub fn stress_sum(&self) -> Matrix3<f64> {
        let forces = self.forces();
        let nodes = self.discrete.nodes().iter().enumerate();
        nodes.map(|(n, p)| of_node(&forces, n) * p.coords.transpose()).sum()
    }
}

/// Three components at a node.
pub fn of_node(of_dofs: &[f64], node: usize) -> Vector3<f64> {
    Vector3::new(of_dofs[dof(node, 0)], of_dofs[dof(node, 1)], of_dofs[dof(node, 2)])
}

/// Number of the node nearest to a position at rest.
pub fn nearest(nodes: &[Point3<f64>], place: &Point3<f64>) -> usize {
    let away = |p: &Point3<f64>| (p - place).norm_squared();
    let nodes = nodes.iter().enumerate();
    nodes.min_by(|a, b| away(a.1).total_cmp(&away(b.1))).map_or(0, |(n, _)| n)
}
