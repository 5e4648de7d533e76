//! One factor of one problem on some threads, and the residual of its answer.

use std::sync::Arc;

use softgrasp_core::fem::{Material, Stiffness};
use softgrasp_core::mesh::{BuiltIn, generate};
use softgrasp_core::model::{Element, Model};
use softgrasp_core::solve::{FrontAnalysis, FrontFactor, FrontPrecision, Partition};

use super::product::product_rate;
use crate::report::{ReportError, check};
use crate::sample::timed_ms;

/// Cube with five known nodes, and all that its factor needs.
pub struct Problem {
    pub nodes: usize,
    pub model: Model,
    pub partition: Partition,
    pub b: Vec<f64>,
    /// Nodes whose displacements are known.
    pub held: [usize; 5],
}

impl Problem {
    /// Cube of about `nodes` nodes.
    ///
    /// # Errors
    /// [`ReportError`] of mesh, model or partition.
    pub fn try_new(nodes: usize) -> Result<Self, ReportError> {
        let mesh = generate(BuiltIn::Cube, nodes)?;
        let nodes = mesh.node_count();
        let side = (nodes as f64).cbrt().round() as usize;
        let top = side * side * (side - 1);
        let held = [side * side / 2, top, top + side - 1, top + side * side - side, nodes - 1];
        let material = Material::try_new(1.0e5, 0.3)?;
        let model = Model::try_new(mesh, Element::Tet4, &[material], vec![], &mut |_| {})?;
        let known: Vec<u32> = held
            .iter()
            .flat_map(|&node| (0..3).map(move |axis| (3 * node + axis) as u32))
            .collect();
        let used: Vec<bool> = (0..model.system_node_count()).map(|n| model.is_used(n)).collect();
        let partition = Partition::try_new(&used, &known)?;
        let b = (0..partition.unknown().len()).map(|i| (0.37 * i as f64).sin()).collect();
        Ok(Self { nodes, model, partition, b, held })
    }

    fn stiffness(&self) -> &Stiffness {
        self.model.stiffness()
    }

    /// Relative residual `‖K11 x − b‖ / ‖b‖`.
    fn residual(&self, x: &[f64]) -> f64 {
        let mut q = vec![0.0; self.partition.dof_count()];
        for (&dof, &x) in self.partition.unknown().iter().zip(x) {
            q[dof as usize] = x;
        }
        let f = self.stiffness().mul(&q);
        let rows = self.partition.unknown().iter().zip(&self.b);
        let off = rows.map(|(&dof, b)| (f[dof as usize] - b).powi(2)).sum::<f64>();
        (off / self.b.iter().map(|b| b * b).sum::<f64>()).sqrt()
    }
}

/// Times of one round, ms, and the rate of the product just before it, GFlop/s.
pub struct Round {
    pub product: f64,
    pub order: f64,
    pub first: f64,
    pub again: f64,
    pub solve: f64,
    pub residual: f64,
    pub analysis: FrontAnalysis,
}

impl Round {
    /// Measures on the current rayon pool of `threads` threads.
    ///
    /// # Errors
    /// [`ReportError`] if there is no factor, or its answer is wrong.
    pub fn take<T: FrontPrecision + faer::traits::RealField + From<f32>>(
        problem: &Problem,
        threads: usize,
        residual_allowed: f64,
    ) -> Result<Self, ReportError> {
        let stiffness = problem.stiffness();
        let product = product_rate::<T>(threads);
        let (order, analysis) =
            timed_ms(|| Arc::new(FrontAnalysis::new(stiffness, &problem.partition)));
        let (first, factor) = timed_ms(|| FrontFactor::<T>::try_new(&analysis, stiffness));
        let mut factor = factor?;
        let (again, done) = timed_ms(|| factor.refactor(stiffness));
        done?;
        let mut x = problem.b.clone();
        let (solve, ()) = timed_ms(|| factor.solve_in_place(&mut x, 1));
        let residual = problem.residual(&x);
        check(|| format!("factor of {} nodes", problem.nodes), residual, residual_allowed)?;
        drop(factor);
        let analysis = Arc::into_inner(analysis).expect("the factor is gone");
        Ok(Self { product, order, first, again, solve, residual, analysis })
    }
}
