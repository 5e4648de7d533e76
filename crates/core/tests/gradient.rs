//! Gradients against central differences, a closed form, and each other; and what has none.

#![allow(clippy::unwrap_used, reason = "a test that fails says where")]

use nalgebra::{Point3, Vector3};

use softgrasp_core::fem::QuadraticMesh;
use softgrasp_core::gradient::NoGradient;
use softgrasp_core::mesh::{BuiltIn, Surface, generate, signed_volume};
use softgrasp_core::solve::equilibrium::NoAdjoint;
use softgrasp_core::{
    Axis, Element, Gradient, Law, LoadCase, Material, Quantity, SoftBody, SoftBodyError, Term,
    TetMesh,
};

/// Equations whose answers have derivatives.
#[derive(Clone, Copy, Debug)]
enum Equations {
    Linear,
    Large(Law),
}

/// Everything that a quantity of a pressed cube of two materials depends on.
#[derive(Clone)]
struct Pressed {
    places: Vec<Point3<f64>>,
    tets: Vec<[u32; 4]>,
    middles: Vec<[u32; 6]>,
    element: Element,
    materials: [(f64, f64); 2],
    /// By degree of freedom.
    known: Vec<(u32, f64)>,
    /// A node that is free.
    at: u32,
    force: Vector3<f64>,
    acceleration: Vector3<f64>,
    pressure: f64,
    quantity: Quantity,
}

const DENSITIES: [f64; 2] = [900.0, 2500.0];

fn wave(i: usize, seed: f64) -> f64 {
    (1.7 * i as f64 + seed).sin()
}

impl Pressed {
    /// A cube of 27 nodes of 4 cm with its nodes moved about; with mid-edge nodes of its own if `is_curved`.
    fn new(element: Element, is_curved: bool) -> Self {
        let cube = generate(BuiltIn::Cube, 27).unwrap();
        let (low, high) = cube.bounds();
        let size = high.z - low.z;
        let (mut known, mut at) = (Vec::new(), 0);
        for (n, p) in (0u32..).zip(cube.vertices()) {
            if p.z < low.z + 1e-9 {
                known.extend((0..3).map(|axis| (3 * n + axis, 0.0)));
            } else if p.z > high.z - 1e-9 {
                known.extend([(3 * n, 0.04 * size), (3 * n + 2, -0.12 * size)]);
            } else {
                at = n;
            }
        }
        let moved = |(n, p): (usize, &Point3<f64>)| {
            p + Vector3::from_fn(|axis, _| 0.04 * size * wave(3 * n + axis, 0.5))
        };
        let mut places: Vec<_> = cube.vertices().iter().enumerate().map(moved).collect();
        let mut middles = Vec::new();
        if is_curved {
            let straight = TetMesh::try_new(places, cube.tets().to_vec(), vec![]).unwrap();
            let straight = QuadraticMesh::try_new(&straight).unwrap();
            let bent = |(n, p): (usize, &Point3<f64>)| match n < 27 {
                true => *p,
                false => p + Vector3::from_fn(|axis, _| 0.01 * size * wave(3 * n + axis, 2.0)),
            };
            places = straight.vertices().iter().enumerate().map(bent).collect();
            let of_tet = |tet: &[u32; 10]| std::array::from_fn(|i| tet[4 + i]);
            middles = straight.tets().iter().map(of_tet).collect();
        }
        let dofs = 3 * places.len();
        let term = |dof: usize, size: f64| Term {
            dof: dof as u32,
            slope: size * wave(dof, 0.0),
            curvature: 30.0 * size * wave(dof, 1.0),
        };
        let quantity = Quantity {
            of_displacements: (0..dofs).map(|dof| term(dof, 1.0)).collect(),
            of_reactions: known.iter().map(|(dof, _)| term(*dof as usize, 1e-3)).collect(),
        };
        Self {
            places,
            tets: cube.tets().to_vec(),
            middles,
            element,
            materials: [(2e4, 0.3), (6e4, 0.4)],
            known,
            at,
            force: Vector3::new(0.3, 0.2, -0.1),
            acceleration: Vector3::new(20.0, -5.0, -30.0),
            pressure: 400.0,
            quantity,
        }
    }

    fn mesh(&self) -> TetMesh {
        let regions = (0..self.tets.len() as u32).map(|tet| tet % 2).collect();
        let mesh = TetMesh::try_new(self.places.clone(), self.tets.clone(), regions).unwrap();
        match self.middles.is_empty() {
            true => mesh,
            false => mesh.with_mid_edge_nodes(self.middles.clone()).unwrap(),
        }
    }

    fn gradient(&self, equations: Equations) -> Gradient {
        let mesh = self.mesh();
        // Two faces of the side, that is free.
        let free = |n: &u32| !self.known.iter().any(|(dof, _)| dof / 3 == *n);
        let side = Surface::from_mesh(&mesh).triangles.into_iter();
        let side: Vec<[u32; 3]> = side.filter(|corners| corners.iter().any(free)).take(5).collect();
        let materials = self.materials.map(|(e, nu)| Material::try_new(e, nu).unwrap());
        let body = SoftBody::with_element(mesh, &materials, self.element).unwrap();
        let mut case = LoadCase::new();
        for &(dof, value) in &self.known {
            let axis = [Axis::X, Axis::Y, Axis::Z][dof as usize % 3];
            case.prescribe_along(dof / 3, axis, value);
        }
        case.force(self.at, self.force).weight(&DENSITIES, self.acceleration);
        case.pressure(&side[..2], 100.0).pressure(&side[2..], self.pressure);
        match equations {
            Equations::Linear => body.gradient(&case, &self.quantity).unwrap().1,
            Equations::Large(law) => {
                body.equilibrium_gradient(&case, law, &self.quantity).unwrap().1
            }
        }
    }

    /// Central difference of the quantity by what `change` changes.
    fn difference(&self, equations: Equations, step: f64, change: impl Fn(&mut Self, f64)) -> f64 {
        let [up, down] = [step, -step].map(|step| {
            let mut changed = self.clone();
            change(&mut changed, step);
            changed.gradient(equations).value
        });
        (up - down) / (2.0 * step)
    }

    /// Holds a gradient against central differences.
    fn check(&self, equations: Equations) {
        let found = self.gradient(equations);
        let compare = |what: &str, found: f64, expected: f64, scale: f64| {
            let off = (found - expected).abs();
            assert!(
                off < 1e-6 * scale,
                "{what} of {:?} {equations:?}: {found} for {expected}",
                self.element
            );
        };
        for axis in 0..3 {
            let by_force = self.difference(equations, 1e-3, |p, step| p.force[axis] += step);
            compare(
                "force",
                found.by_forces[3 * self.at as usize + axis],
                by_force,
                by_force.abs(),
            );
            let by_weight =
                self.difference(equations, 1e-2, |p, step| p.acceleration[axis] += step);
            let own = found.by_acceleration.unwrap();
            compare("acceleration", own[axis], by_weight, own.amax());
        }
        for k in [0, 7, self.known.len() - 1] {
            let by_known = self.difference(equations, 1e-6, |p, step| p.known[k].1 += step);
            let mut order: Vec<u32> = self.known.iter().map(|(dof, _)| *dof).collect();
            order.sort_unstable();
            let place = order.binary_search(&self.known[k].0).unwrap();
            compare("displacement", found.by_known[place], by_known, by_known.abs());
        }
        for region in 0..2 {
            let by_young = self.difference(equations, 5.0, |p, step| p.materials[region].0 += step);
            let by_poisson =
                self.difference(equations, 1e-5, |p, step| p.materials[region].1 += step);
            let own = found.by_materials[region];
            compare("Young's modulus", own.young, by_young, by_young.abs());
            compare("Poisson's ratio", own.poisson, by_poisson, by_poisson.abs());
        }
        let by_pressure = self.difference(equations, 1.0, |p, step| p.pressure += step);
        compare("pressure", found.by_pressures[1], by_pressure, by_pressure.abs());
        let by_places = found.by_places.unwrap();
        assert_eq!(by_places.len(), 3 * self.places.len());
        let largest = by_places.iter().fold(0.0, |most: f64, slope| most.max(slope.abs()));
        for n in [0, 12, self.at as usize, 26, self.places.len() - 2] {
            for axis in 0..3 {
                let by_place =
                    self.difference(equations, 1e-6, |p, step| p.places[n][axis] += step);
                compare("place", by_places[3 * n + axis], by_place, largest);
            }
        }
    }
}

#[test]
fn linear_gradients_are_central_differences() {
    for element in Element::ALL {
        Pressed::new(element, false).check(Equations::Linear);
    }
    Pressed::new(Element::Tet10, true).check(Equations::Linear);
}

#[test]
fn gradients_at_large_deformation_are_central_differences() {
    for element in Element::ALL {
        for law in [Law::NeoHookean, Law::NeoHookeanLog] {
            Pressed::new(element, false).check(Equations::Large(law));
        }
    }
    Pressed::new(Element::Tet10, true).check(Equations::Large(Law::NeoHookean));
}

#[test]
fn small_loads_have_the_linear_gradient() {
    let mut pressed = Pressed::new(Element::Tet4, false);
    let scale = 1e-6;
    pressed.known.iter_mut().for_each(|(_, value)| *value *= scale);
    pressed.force *= scale;
    pressed.acceleration *= scale;
    pressed.pressure *= scale;
    let [linear, large] = [Equations::Linear, Equations::Large(Law::NeoHookeanLog)]
        .map(|equations| pressed.gradient(equations));
    let compare = |what: &str, linear: &[f64], large: &[f64]| {
        let size = linear.iter().fold(0.0, |most: f64, slope| most.max(slope.abs()));
        for (linear, large) in linear.iter().zip(large) {
            assert!((linear - large).abs() < 1e-2 * size, "{what}: {linear} {large}");
        }
    };
    compare("forces", &linear.by_forces, &large.by_forces);
    compare("displacements", &linear.by_known, &large.by_known);
    let places = [&linear, &large].map(|gradient| gradient.by_places.clone().unwrap());
    compare("places", &places[0], &places[1]);
}

/// A block along z of cubes of some edge, of six tetrahedra each, with its lowest layer of nodes first.
fn block(cells: [usize; 3], edge: f64) -> TetMesh {
    let [nx, ny, nz] = cells.map(|count| count + 1);
    let at = |i: usize, j: usize, k: usize| ((k * ny + j) * nx + i) as u32;
    let mut places = Vec::new();
    for (k, j, i) in
        (0..nz).flat_map(|k| (0..ny).flat_map(move |j| (0..nx).map(move |i| (k, j, i))))
    {
        places.push(Point3::new(i as f64 * edge, j as f64 * edge, k as f64 * edge));
    }
    let mut tets = Vec::new();
    for (k, j, i) in (0..cells[2])
        .flat_map(|k| (0..cells[1]).flat_map(move |j| (0..cells[0]).map(move |i| (k, j, i))))
    {
        let corner = |c: usize| at(i + (c & 1), j + ((c >> 1) & 1), k + ((c >> 2) & 1));
        for [a, b] in [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]] {
            let [o, a, b, e] = [0, a, b, 7].map(corner);
            let is_positive = signed_volume(&[o, a, b, e].map(|n| places[n as usize])) > 0.0;
            tets.push(if is_positive { [o, a, b, e] } else { [o, a, e, b] });
        }
    }
    TetMesh::try_new(places, tets, vec![]).unwrap()
}

/// With λ = 0 a block that is stretched to s times its length keeps its width, and is pulled by
/// `A E/2 (s − 1/s)`; what Poisson's ratio adds to that is `A E (ln s / s − (s − 1/s)/2) ν`.
#[test]
fn stretched_block_has_the_gradient_of_the_closed_form() {
    let (edge, young, stretch) = (0.01, 2e4, 1.6);
    let mesh = block([2, 2, 3], edge);
    let (area, length) = (4.0 * edge * edge, 3.0 * edge);
    let top = mesh.node_count() as u32 - 9..mesh.node_count() as u32;
    for element in [Element::Tet4, Element::Tet4Anp] {
        let material = Material::try_new(young, 0.0).unwrap();
        let body = SoftBody::with_element(mesh.clone(), &[material], element).unwrap();
        let mut pull = LoadCase::new();
        pull.hold(0..9);
        let mut force = Quantity::default();
        for node in top.clone() {
            pull.prescribe(node, Vector3::new(0.0, 0.0, (stretch - 1.0) * length));
            force.of_reactions.push(Term { dof: 3 * node + 2, slope: 1.0, curvature: 0.0 });
        }
        let law = Law::NeoHookeanLog;
        let (_, gradient) = body.equilibrium_gradient(&pull, law, &force).unwrap();
        let strained = stretch - 1.0 / stretch;
        let stiffness: f64 = gradient.by_known[27..].iter().skip(2).step_by(3).sum();
        let found = [
            (gradient.value, area * young / 2.0 * strained),
            (gradient.by_materials[0].young, area / 2.0 * strained),
            (
                gradient.by_materials[0].poisson,
                area * young * (stretch.ln() / stretch - strained / 2.0),
            ),
            (stiffness, area * young / 2.0 * (1.0 + 1.0 / (stretch * stretch)) / length),
        ];
        for (found, expected) in found {
            assert!(
                (found - expected).abs() < 1e-8 * expected.abs(),
                "{element:?}: {found} {expected}"
            );
        }
        // A block that is longer at rest is strained less by the same way.
        let by_places = gradient.by_places.unwrap();
        let drawn_out: f64 = by_places[3 * top.start as usize..].iter().skip(2).step_by(3).sum();
        let slope = area * young / 2.0 * (1.0 + 1.0 / (stretch * stretch));
        let expected = -slope * (stretch - 1.0) / length;
        assert!((drawn_out - expected).abs() < 1e-8 * expected.abs(), "{drawn_out} {expected}");
    }
}

/// A shallow arch of two bars, held at its ends and loaded in the middle. Units: N.
fn arch(load: f64) -> Result<Gradient, SoftBodyError> {
    let straight = block([2, 1, 16], 0.0025);
    let raise = |p: &Point3<f64>| {
        let along = 1.0 - (p.z / 0.02 - 1.0).abs();
        Point3::new(0.4 * p.x + 0.004 * along, p.y, p.z)
    };
    let places = straight.vertices().iter().map(raise).collect();
    let mesh = TetMesh::try_new(places, straight.tets().to_vec(), vec![]).unwrap();
    let last = mesh.node_count() as u32;
    let mut case = LoadCase::new();
    case.hold(0..6).hold(last - 6..last);
    for node in MIDDLE..MIDDLE + 6 {
        case.force(node, Vector3::new(-load / 6.0, 0.0, 0.0));
    }
    let sunk = Term { dof: 3 * MIDDLE, slope: 1.0, curvature: 0.0 };
    let quantity = Quantity { of_displacements: vec![sunk], ..Quantity::default() };
    let body =
        SoftBody::with_element(mesh, &[Material::try_new(1e6, 0.3).unwrap()], Element::Tet10);
    let law = Law::NeoHookean;
    Ok(body.unwrap().equilibrium_gradient(&case, law, &quantity)?.1)
}

#[test]
fn arch_that_has_snapped_through_has_no_gradient_and_one_that_has_not_has() {
    let standing = arch(0.01).unwrap();
    let step = 1e-6;
    let [up, down] = [0.01 + step, 0.01 - step].map(|load| arch(load).unwrap().value);
    let middle = 3 * MIDDLE as usize..3 * (MIDDLE + 6) as usize;
    let by_load: f64 = standing.by_forces[middle].iter().step_by(3).sum();
    let expected = (up - down) / (2.0 * step);
    assert!((-by_load / 6.0 - expected).abs() < 1e-5 * expected.abs(), "{by_load} {expected}");
    let refused = arch(0.04).unwrap_err();
    let expected = SoftBodyError::Gradient(NoGradient::Adjoint(NoAdjoint::Snapped));
    assert_eq!(refused, expected, "{refused}");
}

/// First of the six nodes in the middle of the arch.
const MIDDLE: u32 = 6 * 8;

#[test]
fn quantities_that_do_not_fit_the_body_are_named() {
    let check = |of_displacements: Vec<Term>, of_reactions: Vec<Term>| {
        Quantity { of_displacements, of_reactions }.check(27, &[0, 4])
    };
    let term = |dof: u32| Term { dof, slope: 1.0, curvature: 0.0 };
    assert_eq!(check(vec![term(80)], vec![term(0), term(4)]), Ok(()));
    let nowhere = NoGradient::NoSuchNode { node: 27, node_count: 27 };
    assert_eq!(check(vec![term(81)], vec![]), Err(nowhere));
    let free = NoGradient::NoReaction { node: 1, axis: 0 };
    assert_eq!(check(vec![], vec![term(3)]), Err(free));
    let endless = Term { curvature: f64::INFINITY, ..term(7) };
    let refused = check(vec![endless], vec![]).unwrap_err();
    assert!(refused.to_string().contains("node 2"), "{refused}");
}
