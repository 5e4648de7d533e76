//! Elements with curved edges: one element against a naive one, patches, a sphere and its closed form.

use nalgebra::{Matrix3, Point3, SMatrix, Vector3};
use proptest::prelude::*;

use super::curved_fixtures::{bent, bent_along, hollow_sphere, on_sphere, with_middles};
use super::fixtures::{at, irregular_cube, material, solve, stiffness_ten};
use crate::fem::tet10::{EDGES, shape_functions};
use crate::fem::tet10_points::{Points, jacobians};
use crate::fem::{Element, MidEdgeFault, QuadraticMesh, QuadraticMeshError, tet10};
use crate::mesh::{BuiltIn, Surface, TetMesh, generate};
use crate::model::Model;
use crate::solve::{Loads, Method};

/// Corners of an element that is neither regular nor small, counted positive as in (3.23).
const CORNERS: [[f64; 3]; 4] = [[1.0, 0.1, 0.0], [0.2, 1.1, 0.1], [0.0, 0.3, 1.2], [0.0; 3]];

fn element(off: &[[f64; 3]; 6]) -> [Point3<f64>; 10] {
    let corners = CORNERS.map(Point3::from);
    std::array::from_fn(|i| match i {
        0..4 => corners[i],
        _ => {
            let [a, b] = EDGES[i - 4];
            nalgebra::center(&corners[a], &corners[b]) + Vector3::from(off[i - 4])
        }
    })
}

/// Slope of a function of the barycentric coordinates by each of the first three, the fourth being one
/// less their sum, by central differences: exact for shape functions, which are of second degree.
fn slopes<const N: usize>(of: impl Fn([f64; 4]) -> [f64; N], l: [f64; 4]) -> [[f64; 3]; N] {
    let h = 0.125;
    let mut slopes = [[0.0; 3]; N];
    for i in 0..3 {
        let moved = |by: f64| {
            let mut l = l;
            l[i] += by;
            l[3] -= by;
            of(l)
        };
        let (before, after) = (moved(-h), moved(h));
        for n in 0..N {
            slopes[n][i] = (after[n] - before[n]) / (2.0 * h);
        }
    }
    slopes
}

/// `Σ w B_qᵀ D B_q` with everything differentiated by differences and inverted by nalgebra.
fn naive_stiffness(nodes: &[Point3<f64>; 10], poisson: f64) -> SMatrix<f64, 30, 30> {
    let mut k = SMatrix::<f64, 30, 30>::zeros();
    for l in tet10::QUADRATURE {
        let by_l = slopes(shape_functions, l);
        // Row i: the place by L_i.
        let j = Matrix3::from_fn(|i, axis| (0..10).map(|n| by_l[n][i] * nodes[n][axis]).sum());
        let inverse = j.try_inverse().unwrap();
        let mut b = SMatrix::<f64, 6, 30>::zeros();
        for (n, by_l) in by_l.iter().enumerate() {
            let g = inverse * Vector3::from(*by_l);
            for (row, axis, slope) in [
                (0, 0, g.x),
                (1, 1, g.y),
                (2, 2, g.z),
                (3, 1, g.z),
                (3, 2, g.y),
                (4, 0, g.z),
                (4, 2, g.x),
                (5, 0, g.y),
                (5, 1, g.x),
            ] {
                b[(row, 3 * n + axis)] = slope;
            }
        }
        k += b.transpose() * material(poisson).d() * b * (j.determinant() / 24.0);
    }
    k
}

fn stiffness(points: &Points, poisson: f64) -> SMatrix<f64, 30, 30> {
    let (lambda, mu) = (material(poisson).lame_lambda(), material(poisson).shear_modulus());
    let rows: Vec<[[f64; 9]; 10]> = (0..10).map(|a| points.stiffness_row(a, lambda, mu)).collect();
    SMatrix::from_fn(|i, j| rows[i / 3][j / 3][3 * (i % 3) + j % 3])
}

proptest! {
    #[test]
    fn stiffness_of_a_curved_element_is_the_naive_one_and_rigid_motions_need_no_force(
        off in prop::array::uniform6(prop::array::uniform3(-0.08..0.08f64)),
        poisson in 0.0..0.49f64,
    ) {
        let nodes = element(&off);
        prop_assert!(jacobians(&nodes).iter().all(|j| *j > 0.0));
        let k = stiffness(&Points::curved(&nodes), poisson);
        let naive = naive_stiffness(&nodes, poisson);
        prop_assert!((k - naive).amax() < 1e-12 * naive.amax(), "{}", (k - naive).amax());
        prop_assert!((k - k.transpose()).amax() < 1e-14 * k.amax());
        let spin = Vector3::new(0.3, -1.0, 0.7);
        for motion in [|_: &Point3<f64>, spin: Vector3<f64>| spin,
                       |p: &Point3<f64>, spin: Vector3<f64>| spin.cross(&p.coords)] {
            let u = SMatrix::<f64, 30, 1>::from_fn(|i, _| motion(&nodes[i / 3], spin)[i % 3]);
            prop_assert!((k * u).amax() < 1e-13 * k.amax());
        }
    }
}

#[test]
fn mid_edge_nodes_in_the_middles_give_the_straight_element() {
    let mesh = irregular_cube(2);
    let own = with_middles(&mesh, nalgebra::center);
    let (straight, curved) =
        (QuadraticMesh::try_new(&mesh).unwrap(), QuadraticMesh::try_new(&own).unwrap());
    assert!(curved.is_curved() && !straight.is_curved());
    for tet in 0..mesh.tets().len() {
        let (a, b) = (straight.points(tet), curved.points(tet));
        assert!((a.volume - b.volume).abs() < 1e-13 * a.volume);
        let (a, b) = (stiffness(&a, 0.3), stiffness(&b, 0.3));
        assert!((a - b).amax() < 1e-12 * a.amax());
    }
    for ([low, high], e) in straight.edges().iter().zip(0u32..) {
        assert_eq!(straight.middle(*high, *low), Some(mesh.node_count() as u32 + e));
        let last = own.node_count() as u32 - 1;
        let made = straight.middle(*low, *high).unwrap();
        assert_eq!(curved.middle(last - low, last - high), Some(last - made));
    }
    assert_eq!(curved.middle(0, 0), None);
}

/// Largest error of a linear field in a cube whose surface is given, relative to the field.
fn patch_error(mesh: &TetMesh) -> f64 {
    let quadratic = QuadraticMesh::try_new(mesh).unwrap();
    let h = Matrix3::new(0.02, -0.01, 0.03, 0.005, -0.03, 0.01, -0.02, 0.015, 0.01);
    let of_boundary = boundary(mesh, &quadratic);
    let field = |n: usize| h * mesh.vertices()[n].coords;
    let known: Vec<(usize, Vector3<f64>)> =
        (0..mesh.node_count()).filter(|n| of_boundary[*n]).map(|n| (n, field(n))).collect();
    assert!(known.len() < mesh.node_count());
    let k = stiffness_ten(&quadratic, 0.3);
    let u = solve(&k, &quadratic.used_nodes(), &known, &[], Method::SparseCholesky).displacement;
    let off = (0..mesh.node_count()).map(|n| (at(&u, n) - field(n)).norm());
    let largest = (0..mesh.node_count()).map(|n| field(n).norm()).fold(0.0, f64::max);
    off.fold(0.0, f64::max) / largest
}

/// For every node whether it is on the boundary.
fn boundary(mesh: &TetMesh, quadratic: &QuadraticMesh) -> Vec<bool> {
    let mut is_on = vec![false; mesh.node_count()];
    for [a, b, c] in Surface::from_mesh(mesh).triangles {
        let middles = [[a, b], [b, c], [c, a]].map(|[a, b]| quadratic.middle(a, b).unwrap());
        [a, b, c].into_iter().chain(middles).for_each(|n| is_on[n as usize] = true);
    }
    is_on
}

#[test]
fn a_linear_field_comes_back_from_curved_elements() {
    let cube = irregular_cube(3);
    // With edges bent along one direction cof J is linear in the element, and four points are exact.
    let one_way = patch_error(&bent_along(&cube, Vector3::new(0.5, -0.7, 0.4), 0.05));
    assert!(one_way < 1e-12, "{one_way:e}");
    // Bent anywhere four points miss what is of third degree: the square of how far edges are bent.
    let [little, much] = [0.01, 0.02].map(|share| patch_error(&bent(&cube, share)));
    println!("bent anywhere: {little:e} {much:e}");
    assert!(much < 2e-3 && little < 0.35 * much, "{little:e} {much:e}");
}

#[test]
fn volume_of_a_sphere_converges_with_order_four() {
    let exact = 4.0 / 3.0 * std::f64::consts::PI * (1.0 - 0.5f64.powi(3));
    let errors = [1, 2, 3].map(|times| {
        let linear = hollow_sphere((0.5, 1.0), times, 2);
        [linear.clone(), with_middles(&linear, on_sphere)].map(|mesh| {
            let mesh = QuadraticMesh::try_new(&mesh).unwrap();
            let volume: f64 = (0..mesh.tets().len()).map(|tet| mesh.points(tet).volume).sum();
            (volume / exact - 1.0).abs()
        })
    });
    let order = |i: usize, curved: usize| (errors[i][curved] / errors[i + 1][curved]).log2();
    println!("volume: {errors:?}, orders {:.2} {:.2}", order(1, 0), order(1, 1));
    assert!((1.9..2.1).contains(&order(1, 0)), "{errors:?}");
    assert!(order(1, 1) > 3.8, "{errors:?}");
}

const INNER: f64 = 1.0;
const OUTER: f64 = 1.5;
const PRESSURE: f64 = 1000.0;

/// Lamé's displacement of a sphere under pressure inside.
///
/// Source: Timoshenko and Goodier, Theory of Elasticity, article 136.
fn lame(p: &Point3<f64>, poisson: f64) -> Vector3<f64> {
    let (a, b, r) = (INNER.powi(3), OUTER.powi(3), p.coords.norm());
    let of_radius = 1.0 - 2.0 * poisson + (1.0 + poisson) * b / (2.0 * r.powi(3));
    p.coords * (PRESSURE * a / (material(poisson).young() * (b - a)) * of_radius)
}

/// Error of the displacement of the corners of a sphere under pressure inside, mean square, relative.
fn inflated_error(mesh: TetMesh) -> f64 {
    let poisson = 0.3;
    let model =
        Model::try_new(mesh, Element::Tet10, &[material(poisson)], vec![], &mut |_| {}).unwrap();
    let mesh = model.mesh();
    let is_inside = |n: &u32| mesh.vertices()[*n as usize].coords.norm() < INNER * 1.000_001;
    let triangles: Vec<[u32; 3]> = Surface::from_mesh(mesh)
        .triangles
        .into_iter()
        .filter(|triangle| triangle.iter().all(is_inside))
        .collect();
    let forces = model.spread_loads().pressure(&triangles, PRESSURE).unwrap();
    // Each of three nodes on the axes stays on its own: nothing else is held.
    let on_axis = |axis: usize| {
        let is_it = |p: &Point3<f64>| (p[axis] - OUTER).abs() < 1e-9;
        mesh.vertices().iter().position(is_it).unwrap() as u32
    };
    let known: Vec<(u32, f64)> = (0..3)
        .flat_map(|axis| [(axis + 1) % 3, (axis + 2) % 3].map(|held| (axis, held as u32)))
        .map(|(axis, held)| (3 * on_axis(axis) + held, 0.0))
        .collect();
    let known = model.known(known).unwrap();
    let factored = model.factor(&known.dofs, Method::Front, &mut |_| {}).unwrap();
    let loads = Loads { q_known: &known.q_known, forces: &forces, residual_rel: 0.0 };
    let u = factored.solve(model.stiffness(), loads, &mut |_| {}).unwrap().displacement;
    let is_corner = mesh.is_corner();
    let (mut error, mut whole) = (0.0, 0.0);
    for (n, p) in mesh.vertices().iter().enumerate().filter(|(n, _)| is_corner[*n]) {
        let exact = lame(p, poisson);
        error += (at(&u, n) - exact).norm_squared();
        whole += exact.norm_squared();
    }
    (error / whole).sqrt()
}

#[test]
fn a_sphere_under_pressure_converges_faster_with_curved_edges() {
    let errors = [2, 3].map(|times| {
        let linear = hollow_sphere((INNER, OUTER), times, 2 * (times - 1));
        [inflated_error(linear.clone()), inflated_error(with_middles(&linear, on_sphere))]
    });
    let order = |curved: usize| (errors[0][curved] / errors[1][curved]).log2();
    println!("sphere: straight, curved {errors:?}, orders {:.2} {:.2}", order(0), order(1));
    assert!(order(1) > order(0) + 0.7, "{errors:?}");
    assert!(errors[1][1] < 0.1 * errors[1][0], "{errors:?}");
}

#[test]
fn even_pressure_on_a_curved_body_balances_and_presses_it_evenly() {
    let linear = generate(BuiltIn::Sphere, 200).unwrap();
    let radius = linear.vertices().iter().map(|p| p.coords.norm()).fold(0.0, f64::max);
    let is_outside = |p: &Point3<f64>| p.coords.norm() > radius * (1.0 - 1e-9);
    let mesh = with_middles(&linear, |a, b| match is_outside(a) && is_outside(b) {
        true => on_sphere(a, b),
        false => nalgebra::center(a, b),
    });
    let model =
        Model::try_new(mesh, Element::Tet10, &[material(0.3)], vec![], &mut |_| {}).unwrap();
    let (mesh, body) = (model.mesh(), model.spread_loads());
    let triangles = Surface::from_mesh(mesh).triangles;
    let forces = body.pressure(&triangles, 500.0).unwrap();
    let work = |of: &dyn Fn(&Point3<f64>) -> Vector3<f64>| -> f64 {
        mesh.vertices().iter().enumerate().map(|(n, p)| at(&forces, n).dot(&of(p))).sum()
    };
    let volume = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
    assert!((work(&|p| p.coords) / (-1500.0 * volume) - 1.0).abs() < 1e-3);
    for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
        let size = 500.0 * volume;
        assert!(work(&|_| axis * radius).abs() < 1e-12 * size);
        assert!(work(&|p| axis.cross(&p.coords)).abs() < 1e-12 * size);
    }
    // u = −p (1 − 2ν) / E x, up to the four points of the stiffness.
    let nodes = boundary(mesh, &QuadraticMesh::try_new(mesh).unwrap());
    let shrink = -500.0 * 0.4 / material(0.3).young();
    let u: Vec<f64> =
        mesh.vertices().iter().flat_map(|p| [p.x, p.y, p.z]).map(|x| shrink * x).collect();
    let left = model.stiffness().mul(&u);
    let largest = forces.iter().fold(0.0, |most: f64, f| most.max(f.abs()));
    let off = left.iter().zip(&forces).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    println!("even pressure: {:e} of the largest force", off / largest);
    assert!(off < 0.02 * largest && nodes.iter().any(|on| !on));
    let weight = body.weight(&[1000.0], Vector3::new(0.0, -9.81, 0.0)).unwrap();
    let sum: f64 = weight.as_chunks::<3>().0.iter().map(|f| f[1]).sum();
    assert!((sum / (-9810.0 * volume) - 1.0).abs() < 1e-3, "{sum}");
}

#[test]
fn a_mid_edge_node_of_the_mesh_is_prescribed_and_holds() {
    let mesh = bent(&irregular_cube(2), 0.03);
    let quadratic = QuadraticMesh::try_new(&mesh).unwrap();
    let corner = mesh.is_corner();
    let middles: Vec<u32> =
        (0..mesh.node_count() as u32).filter(|n| !corner[*n as usize]).collect();
    assert_eq!(middles.len(), quadratic.edges().len());
    let model =
        Model::try_new(mesh, Element::Tet10, &[material(0.3)], vec![], &mut |_| {}).unwrap();
    assert_eq!(model.system_node_count(), model.mesh().node_count());
    // Mid-edge nodes alone hold it: a small turn comes back.
    let spin = Vector3::new(0.1, -0.2, 0.3);
    let exact = |n: u32| spin.cross(&model.mesh().vertices()[n as usize].coords);
    let given: Vec<(u32, f64)> = middles
        .iter()
        .step_by(middles.len() / 4)
        .flat_map(|&n| (0..3).map(move |axis| (3 * n + axis, exact(n)[axis as usize])))
        .collect();
    let known = model.known(given).unwrap();
    let factored = model.factor(&known.dofs, Method::Front, &mut |_| {}).unwrap();
    let loads = Loads { q_known: &known.q_known, forces: &[], residual_rel: 0.0 };
    let u = factored.solve(model.stiffness(), loads, &mut |_| {}).unwrap().displacement;
    for n in 0..model.mesh().node_count() {
        assert!((at(&u, n) - exact(n as u32)).norm() < 1e-11, "{n}");
    }
    for (dof, value) in known.dofs.iter().zip(&known.q_known) {
        assert_eq!(u[*dof as usize], *value);
    }
}

#[test]
fn mid_edge_nodes_that_do_not_fit_are_named() {
    let linear = irregular_cube(2);
    let good = with_middles(&linear, nalgebra::center);
    let fault = |spoil: &dyn Fn(&mut Vec<[u32; 6]>)| {
        let mut middles = good.mid_edge_nodes().to_vec();
        spoil(&mut middles);
        let mesh = good.clone().with_mid_edge_nodes(middles).unwrap();
        match QuadraticMesh::try_new(&mesh) {
            Err(QuadraticMeshError::MidEdge(fault)) => fault,
            other => panic!("{other:?}"),
        }
    };
    let tets = good.tets();
    // The same edge in two elements.
    let edge = |tet: usize, e: usize| {
        let [a, b] = EDGES[e].map(|i| tets[tet][i]);
        [a.min(b), a.max(b)]
    };
    let other = (0..6).find_map(|e| {
        let other = (1..tets.len()).find(|&t| (0..6).any(|f| edge(t, f) == edge(0, e)))?;
        Some((e, other))
    });
    let (e, _) = other.unwrap();
    let unused = good.mid_edge_nodes()[0][(e + 1) % 6];
    let of = fault(&|middles| middles[0][e] = unused);
    assert!(matches!(of, MidEdgeFault::TwoMiddles { edge: at, .. } if at == edge(0, e)), "{of}");
    let corner = tets[0][0];
    let of = fault(&|middles| {
        let old = middles[0][0];
        middles.iter_mut().flatten().filter(|n| **n == old).for_each(|n| *n = corner);
    });
    assert_eq!(of, MidEdgeFault::Corner { node: corner, tet: 0, edge: edge(0, 0) });
    let of = fault(&|middles| {
        let [first, second, ..] = middles[0];
        middles.iter_mut().flatten().filter(|n| **n == second).for_each(|n| *n = first);
    });
    assert!(matches!(of, MidEdgeFault::TwoEdges { .. }), "{of}");
    assert!(of.to_string().contains(&format!("node {}", good.mid_edge_nodes()[0][0])), "{of}");
}

#[test]
fn an_element_that_is_curved_too_much_is_named() {
    let linear = irregular_cube(2);
    let mesh = with_middles(&linear, |a, b| nalgebra::center(a, b) + (b - a) * 0.03);
    assert!(QuadraticMesh::try_new(&mesh).is_ok());
    let folded = bent(&linear, 1.5);
    let error = QuadraticMesh::try_new(&folded).unwrap_err();
    let QuadraticMeshError::MidEdge(MidEdgeFault::Folded { tet, determinant }) = error else {
        panic!("{error}")
    };
    assert!(determinant <= 0.0 && error.to_string().contains(&format!("tetrahedron {tet} ")));
    // Linear elements do not look at them.
    assert!(Model::try_new(folded, Element::Tet4, &[material(0.3)], vec![], &mut |_| {}).is_ok());
}
