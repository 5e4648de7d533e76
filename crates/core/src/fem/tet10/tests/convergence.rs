//! Order of convergence of both elements by a manufactured solution.

use nalgebra::{Point3, Vector3};

use super::exact_quadrature::POINTS;
use super::fixtures::{
    HALF, at, irregular_cube, material, on_cube_surface, solve, stiffness_four, stiffness_ten,
};
use crate::fem::{QuadraticMesh, Stiffness, tet4, tet10};
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
