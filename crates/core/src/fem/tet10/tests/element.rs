//! Tests of one element: shape functions, quadrature, stiffness, rigid motions, flat elements,
//! large and small scales.

use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;

use super::exact_quadrature::POINTS;
use crate::fem::tet10::*;
use crate::mesh::signed_volume;

fn material(poisson: f64) -> Material {
    Material::try_new(1.0e5, poisson).unwrap()
}

fn unit_corners() -> [Point3<f64>; 4] {
    [
        Point3::new(1.0, 0.0, 0.0),
        Point3::new(0.0, 1.0, 0.0),
        Point3::new(0.0, 0.0, 1.0),
        Point3::origin(),
    ]
}

/// Positions of the ten nodes.
fn nodes(c: &[Point3<f64>; 4]) -> [Point3<f64>; 10] {
    let mut nodes = [Point3::origin(); 10];
    nodes[..4].copy_from_slice(c);
    for (node, [i, j]) in nodes[4..].iter_mut().zip(EDGES) {
        *node = nalgebra::center(&c[i], &c[j]);
    }
    nodes
}

/// Stiffness from nothing but the definition: shape functions are the ten monomials up to degree
/// two fitted to the nodes, the integral is a rule of degree nine.
fn element_stiffness_naive(c: &[Point3<f64>; 4], material: &Material) -> ElementStiffness {
    let monomials = |p: &Point3<f64>| {
        let (x, y, z) = (p.x, p.y, p.z);
        SVector::<f64, 10>::from([1.0, x, y, z, x * x, y * y, z * z, x * y, y * z, z * x])
    };
    let slopes = |p: &Point3<f64>| {
        let (x, y, z) = (p.x, p.y, p.z);
        let dx = [0.0, 1.0, 0.0, 0.0, 2.0 * x, 0.0, 0.0, y, 0.0, z];
        let dy = [0.0, 0.0, 1.0, 0.0, 0.0, 2.0 * y, 0.0, x, z, 0.0];
        let dz = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0 * z, 0.0, y, x];
        [dx, dy, dz].map(SVector::<f64, 10>::from)
    };
    let mut at_nodes = SMatrix::<f64, 10, 10>::zeros();
    for (row, node) in nodes(c).iter().enumerate() {
        at_nodes.set_row(row, &monomials(node).transpose());
    }
    let coefficients = at_nodes.try_inverse().unwrap();
    let mut k = ElementStiffness::zeros();
    for (l, weight) in POINTS.iter() {
        let p = c.iter().zip(l).fold(Point3::origin(), |p, (c, l)| p + c.coords * *l);
        let [dx, dy, dz] = slopes(&p).map(|s| coefficients.transpose() * s);
        let mut b = StrainDisplacement::zeros();
        for a in 0..10 {
            let rows = [(0, dx), (1, dy), (2, dz)];
            for (axis, d) in rows {
                b[(axis, 3 * a + axis)] = d[a];
            }
            // Shear rows yz, zx, xy.
            for (row, (u, du), (v, dv)) in
                [(3, (1, dy), (2, dz)), (4, (2, dz), (0, dx)), (5, (0, dx), (1, dy))]
            {
                b[(row, 3 * a + u)] = dv[a];
                b[(row, 3 * a + v)] = du[a];
            }
        }
        k += b.transpose() * (material.d() * b) * (*weight * signed_volume(c));
    }
    k
}

/// All rows of [`stiffness_row`] as one matrix.
fn stiffness_in_closed_form(c: &[Point3<f64>; 4], material: &Material) -> ElementStiffness {
    let g = tet4::gradients(c);
    let mut k = ElementStiffness::zeros();
    for a in 0..10 {
        let row = stiffness_row(&g, a, material.lame_lambda(), material.shear_modulus());
        for (b, block) in row.iter().enumerate() {
            for (entry, value) in block.iter().enumerate() {
                k[(3 * a + entry / 3, 3 * b + entry % 3)] = *value;
            }
        }
    }
    k
}

#[test]
fn each_shape_function_is_one_at_its_node_and_zero_at_the_others() {
    for a in 0..10 {
        let l = if a < 4 {
            std::array::from_fn(|i| if i == a { 1.0 } else { 0.0 })
        } else {
            std::array::from_fn(|i| if EDGES[a - 4].contains(&i) { 0.5 } else { 0.0 })
        };
        let expected: [f64; 10] = std::array::from_fn(|b| if a == b { 1.0 } else { 0.0 });
        assert_eq!(shape_functions(l), expected);
    }
}

/// Any polynomial of degree two is a combination of the products of two barycentric coordinates;
/// their means are (1 + δᵢⱼ) / 20.
#[test]
fn four_points_integrate_every_quadratic_exactly() {
    for i in 0..4 {
        for j in 0..4 {
            let mean: f64 = QUADRATURE.iter().map(|l| 0.25 * l[i] * l[j]).sum();
            let exact = if i == j { 0.1 } else { 0.05 };
            assert!((mean - exact).abs() < 1e-16, "{i} {j}");
        }
    }
    assert!((NEAR - (5.0 + 3.0 * 5f64.sqrt()) / 20.0).abs() < 2e-16);
    assert!((FAR - (5.0 - 5f64.sqrt()) / 20.0).abs() < 1e-16);
}

/// Unit tetrahedron, E = 1, ν = 0, hence D = diag(1, 1, 1, ½, ½, ½) and V = 1/6. The middle of the
/// edge from (1, 0, 0) to (0, 1, 0) has N = 4xy; moved along x it strains by ε_x = 4y, γ_xy = 4x,
/// so that kᵉ = ∫ 16 y² + ½ · 16 x² dV = V (1.6 + 0.8) = 0.4.
#[test]
fn stiffness_of_unit_tetrahedron_equals_hand_calculation() {
    let k = element_stiffness(&unit_corners(), &Material::try_new(1.0, 0.0).unwrap());
    assert!((k[(12, 12)] - 0.4).abs() < 1e-15);
    // Node 1 along x: N = x (2x − 1), ∫ (4x − 1)² dV = (1.6 − 1) / 6 = 0.1.
    assert!((k[(0, 0)] - 0.1).abs() < 1e-16);
}

#[test]
fn mirrored_node_list_is_the_same_element_with_the_other_orientation() {
    let c = [[0.9, 0.1, 0.2], [0.1, 1.2, 0.0], [0.2, 0.0, 0.8], [0.0; 3]].map(Point3::from);
    let mirrored: [Point3<f64>; 4] = std::array::from_fn(|i| c[MIRRORED[i]]);
    assert!((signed_volume(&mirrored) + signed_volume(&c)).abs() < 1e-16);
    assert_eq!(nodes(&mirrored), MIRRORED.map(|i| nodes(&c)[i]));
    assert_eq!(MIRRORED.map(|i| MIRRORED[i]), [0, 1, 2, 3, 4, 5, 6, 7, 8, 9]);
}

/// Corners 1 … 3 in a plane, corner 4 ever closer to it.
#[test]
fn slivers_keep_rigid_motions_free_of_force_and_both_forms_equal() {
    for height in [1e-2, 1e-4, 1e-8] {
        let mut c = unit_corners();
        c[3] = Point3::new((1.0 - height) / 3.0, (1.0 - height) / 3.0, (1.0 - height) / 3.0);
        for poisson in [0.0, 0.3, 0.4999] {
            let k = element_stiffness(&c, &material(poisson));
            let closed = stiffness_in_closed_form(&c, &material(poisson));
            assert!((k - closed).amax() <= 1e-14 * k.amax(), "height {height:e}");
            let turned = rigid(&c, Vector3::zeros(), Vector3::new(0.3, -0.5, 0.8));
            assert!((closed * turned).amax() <= 1e-14 * k.amax(), "height {height:e}");
        }
    }
}

#[test]
fn stiffness_scales_with_length_from_micrometres_to_thousands_of_kilometres() {
    let c = [[0.9, 0.1, 0.2], [0.1, 1.2, 0.0], [0.2, 0.0, 0.8], [0.0; 3]].map(Point3::from);
    let k = stiffness_in_closed_form(&c, &material(0.3));
    for scale in [1e-6, 1e-3, 1e6] {
        let scaled = stiffness_in_closed_form(&c.map(|p| p * scale), &material(0.3));
        assert!((scaled / scale - k).amax() <= 1e-14 * k.amax(), "scale {scale:e}");
    }
}

/// Nodal displacements of a small rigid motion.
fn rigid(c: &[Point3<f64>; 4], t: Vector3<f64>, w: Vector3<f64>) -> SVector<f64, 30> {
    let mut q = SVector::<f64, 30>::zeros();
    for (a, node) in nodes(c).iter().enumerate() {
        q.fixed_rows_mut::<3>(3 * a).copy_from(&(t + w.cross(&node.coords)));
    }
    q
}

fn corners() -> impl Strategy<Value = [Point3<f64>; 4]> {
    prop::array::uniform4(prop::array::uniform3(-1.0..1.0f64))
        .prop_map(|c| c.map(Point3::from))
        .prop_filter("too flat", |c| signed_volume(c) > 1e-3)
}

/// Elements whose softest way to deform is well above rounding.
fn compact() -> impl Strategy<Value = [Point3<f64>; 4]> {
    corners().prop_filter("too flat for its size", |c| {
        let longest = EDGES.map(|[i, j]| (c[i] - c[j]).norm()).into_iter().fold(0.0, f64::max);
        signed_volume(c) > 0.01 * longest.powi(3)
    })
}

/// Barycentric coordinates of a point inside.
fn inside() -> impl Strategy<Value = [f64; 4]> {
    prop::array::uniform4(0.01..1.0f64).prop_map(|l| {
        let sum: f64 = l.iter().sum();
        l.map(|x| x / sum)
    })
}

fn vector() -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-1.0..1.0f64).prop_map(Vector3::from)
}

proptest! {
    #[test]
    fn shape_functions_sum_to_one_and_their_gradients_to_zero(c in corners(), l in inside()) {
        prop_assert!((shape_functions(l).iter().sum::<f64>() - 1.0).abs() < 1e-14);
        let gradients = shape_gradients(&tet4::gradients(&c), l);
        let largest = gradients.iter().map(|g| g.amax()).fold(0.0, f64::max);
        prop_assert!(gradients.iter().sum::<Vector3<f64>>().amax() <= 1e-14 * largest);
    }

    #[test]
    fn gradients_equal_central_differences(c in corners(), l in inside()) {
        let g = tet4::gradients(&c);
        let gradients = shape_gradients(&g, l);
        // Central differences of a quadratic are exact: any step will do.
        let step = 0.01;
        for axis in 0..3 {
            let moved = |s: f64| shape_functions(std::array::from_fn(|i| {
                l[i] + s * g.of_shape[i][axis]
            }));
            let (ahead, behind) = (moved(step), moved(-step));
            for a in 0..10 {
                let difference = (ahead[a] - behind[a]) / (2.0 * step);
                prop_assert!((gradients[a][axis] - difference).abs()
                    <= 1e-11 * (1.0 + gradients[a].amax()).powi(2));
            }
        }
    }

    #[test]
    fn displacement_gradient_of_a_quadratic_field_is_exact(
        c in corners(), l in inside(), q in vector(), a in vector(),
    ) {
        // u = a (q · x)², ∇u = 2 a (q · x) qᵀ.
        let u = nodes(&c).map(|p| a * q.dot(&p.coords).powi(2));
        let p = c.iter().zip(l).fold(Vector3::zeros(), |p, (c, l)| p + c.coords * l);
        let exact = a * q.transpose() * (2.0 * q.dot(&p));
        let g = tet4::gradients(&c);
        let steepest = g.of_shape.iter().map(|g| g.norm()).fold(0.0, f64::max);
        let h = displacement_gradient(&g, &u, l);
        prop_assert!((h - exact).amax() <= 1e-13 * (1.0 + steepest));
    }

    #[test]
    fn stiffness_equals_brute_force(c in corners(), nu in -0.5..0.49f64) {
        let k = element_stiffness(&c, &material(nu));
        let naive = element_stiffness_naive(&c, &material(nu));
        prop_assert!((k - naive).amax() <= 1e-10 * k.amax());
        let closed = stiffness_in_closed_form(&c, &material(nu));
        prop_assert!((k - closed).amax() <= 1e-14 * k.amax());
        prop_assert!((closed - closed.transpose()).amax() <= 1e-15 * k.amax());
    }

    #[test]
    fn rigid_motion_gives_zero_force(c in corners(), t in vector(), w in vector()) {
        let k = stiffness_in_closed_form(&c, &material(0.3));
        prop_assert!((k * rigid(&c, t, w)).amax() <= 1e-13 * k.amax());
    }

    #[test]
    fn element_stiffness_has_exactly_six_zero_eigenvalues(c in compact(), nu in 0.0..0.49f64) {
        let k = stiffness_in_closed_form(&c, &material(nu));
        let k = (k + k.transpose()) * 0.5;
        let mut values: Vec<f64> = k.symmetric_eigenvalues().iter().copied().collect();
        values.sort_by(f64::total_cmp);
        let largest = values[29];
        prop_assert!(values[..6].iter().all(|v| v.abs() <= 1e-12 * largest));
        prop_assert!(values[6] > 1e-6 * largest);
    }

    /// A field linear inside the element is known by its corners, and then both elements agree.
    #[test]
    fn restricted_to_linear_fields_it_is_the_linear_tetrahedron(c in corners(), nu in 0.0..0.49f64) {
        let mut from_corners = SMatrix::<f64, 30, 12>::zeros();
        for axis in 0..3 {
            for i in 0..4 {
                from_corners[(3 * i + axis, 3 * i + axis)] = 1.0;
            }
            for (e, [i, j]) in EDGES.into_iter().enumerate() {
                from_corners[(12 + 3 * e + axis, 3 * i + axis)] = 0.5;
                from_corners[(12 + 3 * e + axis, 3 * j + axis)] = 0.5;
            }
        }
        let ten = stiffness_in_closed_form(&c, &material(nu));
        let four = tet4::element_stiffness(&c, &material(nu));
        let restricted = from_corners.transpose() * (ten * from_corners);
        prop_assert!((restricted - four).amax() <= 1e-13 * ten.amax());
    }
}
