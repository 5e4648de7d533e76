//! The small form of `hard-cases`: every method keeps what was promised, and every kind of promise
//! occurs.

#![allow(clippy::unwrap_used, reason = "a test that fails says where")]

use softgrasp_bench::{Options, ReportName, run};

#[test]
fn every_way_through_every_hard_case_has_its_stated_outcome() {
    let folder = tempfile::tempdir().unwrap();
    let options = Options {
        is_quick: true,
        out: folder.path().to_owned(),
        command: "test".to_owned(),
        ..Options::default()
    };
    // A row that fails is an error that names it.
    run(ReportName::HardCases, &options).unwrap_or_else(|error| panic!("{error}"));
    let text = std::fs::read_to_string(folder.path().join("hard-cases.csv")).unwrap();
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes());
    let headers = reader.headers().unwrap().clone();
    let at = |name: &str| headers.iter().position(|h| h == name).unwrap();
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    let of = |name: &str| -> Vec<&str> { rows.iter().map(|row| &row[at(name)]).collect() };
    let count = |name: &str, value: &str| of(name).into_iter().filter(|v| *v == value).count();
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
    let is_refused = |row: &&csv::StringRecord| row[at("outcome")] == *"refused with reason";
    assert!(rows.iter().filter(is_refused).all(|row| row[at("note")].len() > 20));
    // Answers of `condensed` are below bounds that are proven.
    let bounds: Vec<f64> = of("error_bound_rel").iter().filter_map(|b| b.parse().ok()).collect();
    assert!(bounds.len() >= 20 && bounds.iter().all(|b| *b > 0.0));
    // 1, 2, 4 and 7 threads and a second time, but for the two hundred kept shapes.
    let runs = rows.iter().map(|row| (&row[at("family")] == "keep shape", &row[at("runs")]));
    assert!(runs.into_iter().all(|(is_long, runs)| runs == if is_long { "2" } else { "5" }));
}
