//! The small form of `hard-cases`: every method keeps what was promised, and every kind of promise
//! occurs.

#![allow(clippy::unwrap_used, reason = "a test that fails says where")]

use softgrasp_bench::quick::Quick;
use softgrasp_verification::{ReportName, measure};

#[test]
fn every_way_through_every_hard_case_has_its_stated_outcome() {
    let report = Quick::make(|options| measure(ReportName::HardCases, options));
    let of = |name: &str| report.column("hard-cases.csv", name);
    let count = |name: &str, value: &str| of(name).into_iter().filter(|v| v == value).count();
    // Each kind of outcome, element, precision and reference is there to be seen.
    for (column, value, least) in [
        ("outcome", "exact", 300),
        ("outcome", "refused with reason", 100),
        ("outcome", "degraded as stated", 5),
        ("element", "t4-anp", 100),
        ("element", "t10", 100),
        ("way", "condensed", 50),
        ("way", "gauss-jordan-plain", 50),
        ("precision", "f32 factor, f64 residual", 100),
        ("against", "dense reference", 1),
        ("against", "reference and closed form", 10),
    ] {
        let count = count(column, value);
        assert!(count >= least, "{column} {value}: {count} rows, at least {least} expected");
    }
    let refused =
        of("outcome").into_iter().zip(of("note")).filter(|(o, _)| o == "refused with reason");
    assert!(refused.into_iter().all(|(_, note)| note.len() > 20));
    // Answers of `condensed` are below bounds that are proven.
    let bounds: Vec<f64> = of("error_bound_rel").iter().filter_map(|b| b.parse().ok()).collect();
    assert!(bounds.len() >= 20 && bounds.iter().all(|b| *b > 0.0));
    // 1, 2, 4 and 7 threads and a second time, but for the two hundred kept shapes.
    let mut runs = of("family").into_iter().zip(of("runs"));
    assert!(runs.all(|(family, runs)| runs == if family == "keep shape" { "2" } else { "5" }));
}
