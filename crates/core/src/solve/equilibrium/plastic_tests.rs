//! Tests of paths of bodies that yield: what stays when they are let go.

use std::sync::Arc;

use nalgebra::Point3;

use super::*;
use crate::fem::hyperelastic::Law;
use crate::fem::{Element, Material};
use crate::mesh::{BuiltIn, TetMesh, generate};
use crate::model::Model;

const YOUNG: f64 = 1.0e4;
const POISSON: f64 = 0.3;

fn model(mesh: TetMesh, element: Element) -> Model {
    let material = Material::try_new(YOUNG, POISSON).unwrap();
    Model::try_new(mesh, element, &[material], vec![], &mut |_| {}).unwrap()
}

fn hold(model: &Model, dofs: &[u32]) -> Arc<Hold> {
    Arc::new(model.hold(dofs, vec![], None).unwrap())
}

fn path(model: &Model, dofs: &[u32], stress_pa: f64) -> Path {
    let elements = model.hyperelastic(Law::NeoHookean).unwrap().with_yield(stress_pa).unwrap();
    let rest = vec![0.0; 3 * elements.node_count()];
    Path::new(Arc::new(elements), model.stiffness(), hold(model, dofs), rest, false)
}

fn goal(q_known: &[f64]) -> Goal<'_> {
    Goal { q_known, mask_q: &[], forces: &[] }
}

/// Edge of the element that is stretched, m.
const EDGE: f64 = 0.1;

/// One element along the axes, stretched along x and free across.
struct Bar {
    model: Model,
    path: Path,
}

impl Bar {
    /// Three nodes hold it; the last of them along x, if it is stretched.
    const HELD: [u32; 6] = [0, 1, 2, 4, 5, 8];
    const STRETCHED: [u32; 7] = [0, 1, 2, 3, 4, 5, 8];
    /// At a strain of 0.02.
    const YIELD: f64 = 0.02 * YOUNG;

    fn new() -> Self {
        let corners = [[0.0; 3], [EDGE, 0.0, 0.0], [0.0, EDGE, 0.0], [0.0, 0.0, EDGE]];
        let mesh = TetMesh::try_new(corners.map(Point3::from).to_vec(), vec![[0, 2, 1, 3]], vec![]);
        let model = model(mesh.unwrap(), Element::Tet4);
        let path = path(&model, &Self::STRETCHED, Self::YIELD);
        Self { model, path }
    }

    /// Stretches to a logarithmic strain; gives Kirchhoff's stress.
    fn stretch(&mut self, strain: f64) -> f64 {
        self.path.hold_by(hold(&self.model, &Self::STRETCHED));
        let mut q_known = [0.0; 7];
        q_known[3] = EDGE * strain.exp_m1();
        let found = self.path.advance(&goal(&q_known), &Wish::EXACT).unwrap();
        // A force P a²/6 at the node, and τ = P λ.
        found.reactions[3] * 6.0 / EDGE.powi(2) * strain.exp()
    }

    fn let_go(&mut self) {
        self.path.hold_by(hold(&self.model, &Self::HELD));
        let found = self.path.advance(&goal(&[0.0; 6]), &Wish::EXACT).unwrap();
        assert!(found.energy < 1e-20 * YOUNG * EDGE.powi(3));
    }

    /// Logarithmic strains along and across.
    fn strains(&self) -> [f64; 3] {
        let q = self.path.displacement();
        [q[3], q[7], q[11]].map(|q| (q / EDGE).ln_1p())
    }

    fn assert_strains(&self, along: f64, across: f64) {
        let strains = self.strains();
        for (strain, expected) in strains.into_iter().zip([along, across, across]) {
            assert!((strain - expected).abs() < 1e-10, "{strains:?}, {along} {across}");
        }
    }
}

/// Beyond the yield stress τ stays; let go, the bar springs back by σ_y/E of logarithmic strain.
#[test]
fn stretched_bars_yield_and_spring_back_as_derived() {
    let mut bar = Bar::new();
    let elastic = bar.stretch(0.01);
    assert!((elastic - 0.01 * YOUNG).abs() < 1e-10 * YOUNG, "{elastic}");
    bar.assert_strains(0.01, -POISSON * 0.01);
    assert_eq!(bar.path.elements().plastic_strain_max(), 0.0);
    for strain in [0.05, 0.3, 0.8] {
        let stress = bar.stretch(strain);
        assert!((stress - Bar::YIELD).abs() < 1e-10 * YOUNG, "{strain}: {stress}");
        bar.assert_strains(strain, -POISSON * 0.02 - 0.5 * (strain - 0.02));
        assert!((bar.path.elements().plastic_strain_max() - (strain - 0.02)).abs() < 1e-10);
    }
    bar.let_go();
    bar.assert_strains(0.78, -0.39);
    // The same again, from the permanent stretch on.
    let stress = bar.stretch(0.79);
    assert!((stress - 0.01 * YOUNG).abs() < 1e-10 * YOUNG, "{stress}");
    let stress = bar.stretch(0.7);
    assert!((stress + Bar::YIELD).abs() < 1e-10 * YOUNG, "{stress}");
    bar.let_go();
    bar.assert_strains(0.72, -0.36);
    assert!((bar.path.elements().plastic_strain_max() - 0.78 - 0.06).abs() < 1e-10);
}

/// A cube of 27 nodes that stands on a plate and is squeezed by another.
struct Block {
    model: Model,
    squeezed: Vec<u32>,
    /// Of the upper plate, by degree of freedom: 0 or 1.
    is_upper: Vec<f64>,
    size: f64,
}

impl Block {
    /// Degrees of freedom that just hold it: three corners.
    fn held(&self) -> Vec<u32> {
        let places = self.model.mesh().vertices();
        let at = |x: f64, y: f64| {
            let corner = Point3::new(x, y, -1.0) * (0.5 * self.size);
            let off = |p: &Point3<f64>| (p - corner).norm();
            (0..places.len()).min_by(|&a, &b| off(&places[a]).total_cmp(&off(&places[b]))).unwrap()
        };
        let [a, b, c] = [at(-1.0, -1.0), at(1.0, -1.0), at(-1.0, 1.0)].map(|n| 3 * n as u32);
        let mut dofs = vec![a, a + 1, a + 2, b + 1, b + 2, c + 2];
        dofs.sort_unstable();
        dofs
    }

    fn new(element: Element) -> Self {
        let mesh = generate(BuiltIn::Cube, 27).unwrap();
        let top = mesh.vertices().iter().map(|p| p.z).fold(0.0, f64::max);
        let (mut squeezed, mut is_upper) = (Vec::new(), Vec::new());
        for (n, p) in mesh.vertices().iter().enumerate().filter(|(_, p)| p.z.abs() > 0.9 * top) {
            squeezed.extend((0..3).map(|axis| 3 * n as u32 + axis));
            is_upper.extend([0.0, 0.0, if p.z > 0.0 { 1.0 } else { 0.0 }]);
        }
        Self { model: model(mesh, element), squeezed, is_upper, size: 2.0 * top }
    }

    fn path(&self) -> Path {
        path(&self.model, &self.squeezed, 0.02 * YOUNG)
    }

    /// Squeezes by a share of the height.
    fn squeeze(
        &self,
        path: &mut Path,
        share: f64,
        wish: &Wish<'_>,
    ) -> Result<Equilibrium, NoEquilibrium> {
        let q: Vec<f64> = self.is_upper.iter().map(|upper| -upper * share * self.size).collect();
        path.advance(&goal(&q), wish)
    }

    fn let_go(&self, path: &mut Path) -> Equilibrium {
        path.hold_by(hold(&self.model, &self.held()));
        path.advance(&goal(&[0.0; 6]), &Wish::EXACT).unwrap()
    }
}

fn amax(v: &[f64]) -> f64 {
    v.iter().fold(0.0, |most: f64, x| most.max(x.abs()))
}

#[test]
fn squeezed_blocks_stay_dented() {
    for element in [Element::Tet4, Element::Tet10] {
        let block = Block::new(element);
        let mut path = block.path();
        let squeezed = block.squeeze(&mut path, 0.2, &Wish::EXACT).unwrap();
        assert!(squeezed.settled && squeezed.plastic_strain > 0.1, "{element:?} {squeezed:?}");
        let free = block.let_go(&mut path);
        assert!(free.settled && free.plastic_strain >= squeezed.plastic_strain, "{free:?}");
        assert!(free.energy < 0.5 * squeezed.energy, "{element:?} {free:?}");
        assert!(free.energy > 0.0 && amax(&free.reactions) < 1e-10 * amax(&squeezed.reactions));
        let dented = path.displacement();
        let lowered = block
            .is_upper
            .iter()
            .zip(&block.squeezed)
            .map(|(upper, &dof)| upper * dented[dof as usize] / block.size);
        let lowest = lowered.fold(0.0, f64::min);
        assert!(lowest < -0.1 && lowest > -0.25, "{element:?} {lowest}");
        // Nothing moves any more.
        let before = dented.to_vec();
        path.advance(&goal(&[0.0; 6]), &Wish::EXACT).unwrap();
        let moved: Vec<f64> = before.iter().zip(path.displacement()).map(|(a, b)| a - b).collect();
        assert!(amax(&moved) < 1e-9 * block.size);
    }
}

#[test]
fn blocks_squeezed_below_the_yield_stress_come_back() {
    for element in [Element::Tet4, Element::Tet10] {
        let block = Block::new(element);
        let mut path = block.path();
        let squeezed = block.squeeze(&mut path, 0.005, &Wish::EXACT).unwrap();
        assert_eq!(squeezed.plastic_strain, 0.0);
        let free = block.let_go(&mut path);
        assert_eq!(free.plastic_strain, 0.0);
        assert!(free.energy < 1e-15 * squeezed.energy, "{element:?} {}", free.energy);
        assert!(amax(path.displacement()) < 1e-10 * block.size);
    }
}

#[test]
fn motions_that_fail_leave_the_state_as_it_was() {
    let block = Block::new(Element::Tet4);
    let mut path = block.path();
    let reached = block.squeeze(&mut path, 0.1, &Wish::EXACT).unwrap();
    let (q, elements) = (path.displacement().to_vec(), Arc::clone(path.elements()));
    block.squeeze(&mut path, 1.2, &Wish::EXACT).unwrap_err();
    assert_eq!(path.displacement(), q);
    assert!(Arc::ptr_eq(path.elements(), &elements));
    assert_eq!(path.elements().plastic_strain_max(), reached.plastic_strain);
}

#[test]
fn shapes_that_time_cut_short_leave_no_plastic_strain() {
    let block = Block::new(Element::Tet4);
    let mut path = block.path();
    let late = Wish { is_late: &|| true, ..Wish::EXACT };
    let cut_short = block.squeeze(&mut path, 0.05, &late).unwrap();
    assert!(!cut_short.settled && cut_short.plastic_strain == 0.0, "{cut_short:?}");
    let found = block.squeeze(&mut path, 0.05, &Wish::EXACT).unwrap();
    let mut direct = block.path();
    let expected = block.squeeze(&mut direct, 0.05, &Wish::EXACT).unwrap();
    assert!((found.energy - expected.energy).abs() < 1e-8 * expected.energy);
    assert!(found.plastic_strain > 0.0);
}
