//! Patch tests of the ten-node tetrahedron on irregular meshes, and the order of convergence of both elements
//! by a manufactured solution.

use nalgebra::{Matrix3, Point3, Vector3};
use proptest::prelude::*;

use super::exact_quadrature::POINTS;
use super::fixtures::{
    HALF, at, irregular_cube, material, on_cube_surface, solve, stiffness_four, stiffness_ten,
};
use crate::fem::{QuadraticMesh, Stiffness, summarise_strain_quadratic, tet4, tet10};
use crate::mesh::TetMesh;
use crate::solve::Method;

const POISSON: f64 = 0.3;

/// Wave vectors of the solution, 1/m, and phases: `uᵢ = sin(kᵢ · x + φᵢ)`, about half a wave over
/// the cube.
fn waves() -> [(Vector3<f64>, f64); 3] {
    [
        (Vector3::new(1.5, -1.0, 0.7) / HALF, 0.3),
        (Vector3::new(0.8, 1.6, -0.9) / HALF, -0.8),
        (Vector3::new(-1.1, 0.6, 1.4) / HALF, 1.2),
    ]
}

fn exact(p: &Point3<f64>) -> Vector3<f64> {
    Vector3::from(waves().map(|(k, phase)| (k.dot(&p.coords) + phase).sin()))
}

/// `bᵢ = −(λ + μ) ∂ᵢ div u − μ Δuᵢ = (λ + μ) Σⱼ kⱼᵢ kⱼⱼ uⱼ + μ |kᵢ|² uᵢ`.
fn body_force(p: &Point3<f64>) -> Vector3<f64> {
    let (u, waves) = (exact(p), waves());
    let (lambda, mu) = (material(POISSON).lame_lambda(), material(POISSON).shear_modulus());
    Vector3::from_fn(|i, _| {
        let divergence: f64 = (0..3).map(|j| waves[j].0[i] * waves[j].0[j] * u[j]).sum();
        (lambda + mu) * divergence + mu * waves[i].0.norm_squared() * u[i]
    })
}

/// One discretisation: K nodes per element and their shape functions.
struct Discrete<'a, const K: usize> {
    vertices: &'a [Point3<f64>],
    tets: &'a [[u32; K]],
    stiffness: Stiffness,
    shape_functions: fn([f64; 4]) -> [f64; K],
}

impl<const K: usize> Discrete<'_, K> {
    /// Calls `visit(tet, N at the point, position, weight in m³)` for every quadrature point.
    fn integrate(&self, mut visit: impl FnMut(&[u32; K], [f64; K], Point3<f64>, f64)) {
        for nodes in self.tets {
            let corners: [Point3<f64>; 4] =
                std::array::from_fn(|i| self.vertices[nodes[i] as usize]);
            let volume = tet4::gradients(&corners).volume;
            for (l, weight) in POINTS.iter() {
                let p = corners.iter().zip(l).fold(Point3::origin(), |p, (c, l)| p + c.coords * *l);
                visit(nodes, (self.shape_functions)(*l), p, weight * volume);
            }
        }
    }

    /// `(∫ |u_h − u|² dV / ∫ |u|² dV)^½` with the exact displacement on the surface.
    fn error(&self) -> f64 {
        let on_surface: Vec<bool> = self.vertices.iter().map(on_cube_surface).collect();
        let mut forces = vec![0.0; 3 * self.vertices.len()];
        self.integrate(|nodes, shape, p, weight| {
            let b = body_force(&p) * weight;
            for (&n, shape) in nodes.iter().zip(shape).filter(|(n, _)| !on_surface[**n as usize]) {
                for axis in 0..3 {
                    forces[3 * n as usize + axis] += shape * b[axis];
                }
            }
        });
        let known: Vec<(usize, Vector3<f64>)> = (0..self.vertices.len())
            .filter(|&n| on_surface[n])
            .map(|n| (n, exact(&self.vertices[n])))
            .collect();
        let used = vec![true; self.vertices.len()];
        let u = solve(&self.stiffness, &used, &known, &forces, Method::SparseCholesky).displacement;
        let (mut error, mut whole) = (0.0, 0.0);
        self.integrate(|nodes, shape, p, weight| {
            let u_h: Vector3<f64> =
                nodes.iter().zip(shape).map(|(&n, shape)| at(&u, n as usize) * shape).sum();
            error += (u_h - exact(&p)).norm_squared() * weight;
            whole += exact(&p).norm_squared() * weight;
        });
        (error / whole).sqrt()
    }
}

fn error_four(mesh: &TetMesh) -> f64 {
    let shape_functions = |l| l;
    let stiffness = stiffness_four(mesh, POISSON);
    Discrete { vertices: mesh.vertices(), tets: mesh.tets(), stiffness, shape_functions }.error()
}

fn error_ten(mesh: &TetMesh) -> f64 {
    let mesh = QuadraticMesh::try_new(mesh).unwrap();
    let shape_functions = tet10::shape_functions;
    let stiffness = stiffness_ten(&mesh, POISSON);
    Discrete { vertices: mesh.vertices(), tets: mesh.tets(), stiffness, shape_functions }.error()
}

#[test]
fn four_nodes_converge_with_order_two() {
    let errors = [4, 8, 16].map(|cells| error_four(&irregular_cube(cells)));
    let orders = [(errors[0] / errors[1]).log2(), (errors[1] / errors[2]).log2()];
    println!("t4: errors {errors:?}, orders {orders:.3?}");
    assert!(orders[1] >= 1.9, "errors {errors:?}, orders {orders:?}");
}

#[test]
fn ten_nodes_converge_with_order_three() {
    let errors = [2, 4, 8].map(|cells| error_ten(&irregular_cube(cells)));
    let orders = [(errors[0] / errors[1]).log2(), (errors[1] / errors[2]).log2()];
    println!("t10: errors {errors:?}, orders {orders:.3?}");
    assert!(orders[1] >= 2.8, "errors {errors:?}, orders {orders:?}");
}

/// At the same number of unknowns, not only on the same mesh.
#[test]
fn ten_nodes_on_half_the_boxes_beat_four_nodes() {
    let (four, ten) = (error_four(&irregular_cube(8)), error_ten(&irregular_cube(4)));
    assert!(ten < 0.2 * four, "t10 {ten:e}, t4 {four:e}");
}

/// Largest error at any node, relative to the largest displacement, when the field is given on the
/// whole surface, mid-edge nodes among it, together with the nodal forces of its body force.
fn error_of(
    mesh: &QuadraticMesh,
    poisson: f64,
    body_force: Vector3<f64>,
    field: impl Fn(&Point3<f64>) -> Vector3<f64>,
) -> f64 {
    let known: Vec<(usize, Vector3<f64>)> = mesh
        .vertices()
        .iter()
        .enumerate()
        .filter(|(_, p)| on_cube_surface(p))
        .map(|(n, p)| (n, field(p)))
        .collect();
    assert!(known.len() < mesh.node_count() * 3 / 4, "hardly anything is left to solve for");
    let mut forces = vec![0.0; 3 * mesh.node_count()];
    for (t, nodes) in mesh.tets().iter().enumerate() {
        let volume = tet4::gradients(&mesh.corners(t)).volume;
        for (a, &n) in nodes.iter().enumerate() {
            // ∫ N dV is −V/20 at corners and V/5 on edges.
            let share = body_force * if a < 4 { -volume / 20.0 } else { volume / 5.0 };
            for axis in 0..3 {
                forces[3 * n as usize + axis] += share[axis];
            }
        }
    }
    for (n, _) in &known {
        forces[3 * n..3 * n + 3].fill(0.0);
    }
    let stiffness = stiffness_ten(mesh, poisson);
    let solution = solve(&stiffness, &mesh.used_nodes(), &known, &forces, Method::SparseCholesky);
    let largest = mesh.vertices().iter().map(|p| field(p).amax()).fold(0.0, f64::max);
    let error = |(n, p)| (at(&solution.displacement, n) - field(p)).amax();
    mesh.vertices().iter().enumerate().map(error).fold(0.0, f64::max) / largest
}

fn cube() -> QuadraticMesh {
    QuadraticMesh::try_new(&irregular_cube(4)).unwrap()
}

#[test]
fn constant_strain_is_exact() {
    let gradient = Matrix3::new(0.01, 0.02, -0.03, 0.005, -0.015, 0.01, 0.02, 0.0, 0.03);
    for poisson in [0.0, 0.3, 0.49] {
        let error = error_of(&cube(), poisson, Vector3::zeros(), |p| gradient * p.coords);
        assert!(error < 1e-12, "ν = {poisson}: {error:e}");
    }
}

/// Bending to curvature κ by σ_x = E κ y alone:
/// `u = κ (x y, −(x² + ν (y² − z²)) / 2, −ν y z)`.
#[test]
fn pure_bending_is_exact() {
    for poisson in [0.0, 0.3, 0.49] {
        let curvature = 2.0;
        let bent = |p: &Point3<f64>| {
            let (x, y, z) = (p.x, p.y, p.z);
            let deflection = -0.5 * (x * x + poisson * (y * y - z * z));
            Vector3::new(x * y, deflection, -poisson * y * z) * curvature
        };
        let error = error_of(&cube(), poisson, Vector3::zeros(), bent);
        assert!(error < 1e-12, "ν = {poisson}: {error:e}");
    }
}

/// Strain and rotation grow to κ · 0.03 at the surface; quadrature points lie a little inside.
#[test]
fn pure_bending_has_its_strain_and_rotation() {
    let mesh = cube();
    let u: Vec<f64> =
        mesh.vertices().iter().flat_map(|p| [p.x * p.y * 2.0, -p.x * p.x, 0.0]).collect();
    let summary = summarise_strain_quadratic(&mesh, &u, &mut || {});
    // ν = 0: ε_x = 2 y and no other strain, rotation 2 x about z; both at most 2 · 0.03.
    assert!((0.9..1.0).contains(&(summary.strain_max / 0.06)), "{summary:?}");
    assert!((0.9..1.0).contains(&(summary.rotation_max / 0.06)), "{summary:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    /// Every quadratic field is a solution under its own, constant, body force
    /// `b = −div σ`, `bᵢ = −(λ + μ) ∂ᵢ div u − μ Δuᵢ`.
    #[test]
    fn any_quadratic_field_under_its_body_force_is_exact(
        second in prop::array::uniform3(prop::array::uniform9(-1.0..1.0f64)),
        first in prop::array::uniform9(-0.1..0.1f64),
        poisson in 0.0..0.49f64,
    ) {
        // uᵢ = ½ x · Qᵢ x + (A x)ᵢ with symmetric Qᵢ.
        let second = second.map(|q| {
            let q = Matrix3::from_row_slice(&q);
            (q + q.transpose()) * 0.5
        });
        let first = Matrix3::from_row_slice(&first);
        let field = |p: &Point3<f64>| {
            let x = p.coords;
            first * x + Vector3::from(second.map(|q| 0.5 * x.dot(&(q * x))))
        };
        let m = material(poisson);
        let (lambda, mu) = (m.lame_lambda(), m.shear_modulus());
        let body_force = Vector3::from_fn(|i, _| {
            let slope_of_divergence: f64 = (0..3).map(|k| second[k][(k, i)]).sum();
            -(lambda + mu) * slope_of_divergence - mu * second[i].trace()
        });
        let mesh = QuadraticMesh::try_new(&irregular_cube(3)).unwrap();
        let error = error_of(&mesh, poisson, body_force, field);
        prop_assert!(error < 1e-12, "{error:e}");
    }
}
