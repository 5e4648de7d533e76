//! Tests: predicted memory against counted memory, and numbers of bytes as text.

use proptest::prelude::*;

use super::*;
use crate::fem::Material;
use crate::mesh::{BuiltIn, generate};
use crate::model::Model;
use crate::solve::Analysed;

fn problem(size: MeshSize) -> Problem {
    Problem { size, known_dofs: 9 }
}

/// The law is the counts' average: no shape may leave it by more than the factor it promises.
#[test]
fn predicted_bytes_are_within_the_stated_factor_of_the_counted() {
    for shape in [BuiltIn::Cube, BuiltIn::Sphere, BuiltIn::Strawberry, BuiltIn::Toothpaste] {
        for (nodes, element) in [(400, Element::Tet4), (4000, Element::Tet4), (400, Element::Tet10)]
        {
            let mesh = generate(shape, nodes).unwrap();
            let size = MeshSize { nodes: mesh.node_count(), tets: mesh.tets().len() };
            let material = Material::try_new(1.0, 0.3).unwrap();
            let model = Model::try_new(mesh, element, &[material], vec![], &mut |_| {}).unwrap();
            let nodes = [0, size.nodes as u32 / 2, size.nodes as u32 - 1];
            let known: Vec<u32> = nodes.into_iter().flat_map(|n| 3 * n..3 * n + 3).collect();
            let analysed: Analysed = model.analyse(&known, &mut |_| {}).unwrap();
            let blocks = model.stiffness().pattern().block_count();
            for method in [Method::Front, Method::FrontMixed, Method::Pcg] {
                let predicted = Need::predicted(problem(size), element, method);
                let held = model.bytes() as u64;
                let counted = Need::counted(element, method, held, blocks, analysed.analysis());
                let told = format!("{shape:?} {element:?} {method}: {predicted:?} {counted:?}");
                let (low, high) = (predicted.factor_bytes_min, predicted.factor_bytes_max());
                assert!(low <= counted.factor_bytes && counted.factor_bytes <= high, "{told}");
                let model_rel = predicted.model_bytes as f64 / counted.model_bytes as f64;
                assert!((0.75..1.35).contains(&model_rel), "{told}");
            }
        }
    }
}

#[test]
fn dense_needs_are_exact_and_single_precision_halves_a_factor() {
    let size = MeshSize { nodes: 1000, tets: 4500 };
    let need = |method| Need::predicted(problem(size), Element::Tet4, method);
    let unknown = 3000 - 9;
    for method in [Method::GaussJordan, Method::DenseInverse, Method::DenseCholesky] {
        let dense = need(method);
        assert_eq!(Some(dense.factor_bytes), method.dense_bytes(unknown));
        assert!(!dense.is_predicted());
    }
    let (double, single) = (need(Method::Front), need(Method::FrontMixed));
    assert_eq!(double.model_bytes, single.model_bytes);
    let ratio = double.factor_bytes_min as f64 / single.factor_bytes_min as f64;
    assert!((ratio - 2.0).abs() < 1e-3);
}

#[test]
fn nodes_that_fit_do_fit_and_more_do_not() {
    let size = MeshSize { nodes: 160_000, tets: 900_000 };
    let method = Method::Front;
    let fit = nodes_that_fit(problem(size), Element::Tet4, method, 1 << 30);
    let bytes = |nodes: usize| {
        let tets = (5.625 * nodes as f64) as usize;
        let scaled = Problem { size: MeshSize { nodes, tets }, known_dofs: 0 };
        Need::predicted(scaled, Element::Tet4, method).bytes()
    };
    assert!(bytes(fit) <= 1 << 30 && bytes(fit + fit / 50) > 1 << 30, "{fit}");
    assert_eq!(nodes_that_fit(problem(size), Element::Tet4, method, 10), 0);
}

#[test]
fn bytes_are_read_with_and_without_a_unit() {
    let read = |text: &str| text.parse::<Bytes>().map(|bytes| bytes.0);
    for (text, bytes) in [
        ("40000", 40_000),
        ("8GiB", 8 << 30),
        ("1 gib", 1 << 30),
        ("512MiB", 512 << 20),
        ("512M", 512 << 20),
        ("8g", 8 << 30),
        ("1.5GiB", 3 << 29),
        ("2GB", 2_000_000_000),
        ("10kB", 10_000),
        ("7B", 7),
        ("18446744073709551615", u64::MAX),
    ] {
        assert_eq!(read(text), Ok(bytes), "{text}");
    }
    for text in ["", "GiB", "8 potatoes", "-1", "1.5", "1e9", "99999999TiB", "1.2.3MiB", "."] {
        let error = read(text).unwrap_err().to_string();
        assert!(error.contains(text) && error.contains("8GiB"), "{error}");
    }
}

proptest! {
    #[test]
    fn any_whole_number_is_itself(bytes: u64) {
        prop_assert_eq!(bytes.to_string().parse::<Bytes>(), Ok(Bytes(bytes)));
    }
}
