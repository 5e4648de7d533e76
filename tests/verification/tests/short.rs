//! Small forms of the reports: their files and rows are there, and errors are small.

#![allow(clippy::unwrap_used, reason = "a test that fails says where")]

use softgrasp_bench::quick::Quick;
use softgrasp_verification::{ReportName, measure};

fn quick(name: ReportName) -> Quick {
    Quick::make(|options| measure(name, options))
}

#[test]
fn bound_is_never_below_the_true_error_of_random_grips() {
    // A bound below the true error fails the report.
    let report = quick(ReportName::Bound);
    let of = |name| report.column("bound.csv", name);
    let ratios: Vec<f64> = of("ratio_nearest").iter().filter_map(|r| r.parse().ok()).collect();
    assert!(ratios.len() > 30 && ratios.iter().all(|&r| r >= 1.0), "{ratios:?}");
    let grips: f64 = report.numbers("bound.csv", "grips").iter().sum();
    assert!(grips > 300.0, "{grips}");
}

#[test]
fn every_element_comes_nearer_to_closed_forms_on_finer_meshes() {
    let report = quick(ReportName::Accuracy);
    let of = |name| report.column("accuracy.csv", name);
    let (cases, elements, orders) = (of("case"), of("element"), of("order"));
    let errors = report.numbers("accuracy.csv", "error_rel");
    for case in ["patch", "bar", "mirror"] {
        let of_case = cases.iter().zip(&errors).filter(|(c, _)| *c == case);
        let errors: Vec<f64> = of_case.map(|(_, e)| *e).collect();
        assert!(errors.len() >= 4 && errors.iter().all(|&e| e < 1e-11), "{case}: {errors:?}");
    }
    for case in ["cantilever", "membrane", "thick sphere", "indentation", "waves"] {
        for element in ["t4", "t10"] {
            let rows = cases.iter().zip(&elements).zip(&orders);
            let of_both = rows.filter(|((c, e), o)| *c == case && *e == element && !o.is_empty());
            let orders: Vec<f64> = of_both.map(|(_, o)| o.parse().unwrap()).collect();
            assert!(!orders.is_empty() && orders.iter().all(|&o| o > 0.0), "{case} {element}");
        }
    }
    for figure in ["accuracy-waves.svg", "accuracy-sphere.svg", "accuracy-cases.svg"] {
        assert!(report.has(figure), "{figure}");
    }
    large_deformation_is_beside_its_closed_forms(&report);
}

fn large_deformation_is_beside_its_closed_forms(report: &Quick) {
    let of = |name| report.column("accuracy-large.csv", name);
    let (cases, elements, errors) = (of("case"), of("element"), of("error_rel"));
    let errors_of = |case: &str, element: &str| -> Vec<f64> {
        let rows = cases.iter().zip(&elements).zip(&errors);
        let of_both = rows.filter(|((c, e), _)| *c == case && *e == element);
        of_both.map(|(_, error)| error.parse().unwrap()).collect()
    };
    for element in ["t4", "t4-anp", "t10"] {
        for (case, rows, error_max) in [
            ("uniaxial", 12, 1e-11),
            ("equibiaxial", 4, 1e-11),
            ("simple shear", 8, 1e-11),
            ("turned", 8, 1e-13),
        ] {
            let errors = errors_of(case, element);
            assert_eq!(errors.len(), rows, "{case} {element}");
            assert!(errors.iter().all(|&e| e < error_max), "{case} {element}: {errors:?}");
        }
    }
    for (case, error_max) in [
        ("torsion", 0.1),
        ("hollow sphere", 0.1),
        ("elastica", 1e-3),
        ("45° bend", 0.025),
        ("Cook's membrane", 0.25),
        ("compressed block", 0.25),
    ] {
        let errors = errors_of(case, "t10");
        assert!(!errors.is_empty() && errors.iter().all(|&e| e < error_max), "{case}: {errors:?}");
    }
    let orders = report.column("accuracy-large-torsion.csv", "order");
    let orders: Vec<f64> = orders.iter().filter_map(|o| o.parse().ok()).collect();
    assert!(orders.len() == 4 && orders.iter().all(|&o| o > 0.3), "{orders:?}");
    assert!(report.has("accuracy-large.svg"));
}
