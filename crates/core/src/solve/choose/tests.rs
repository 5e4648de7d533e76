//! Tests of the choice: a table of questions and the plans they get.

use super::*;

const NONE: Option<f64> = None;

/// Memory in which ten-node elements of the tables do not fit.
const MEMORY: u64 = 80_000_000;

fn question(deadline_ms: Option<f64>, max_error: Option<f64>) -> Question {
    let element = Some(Element::Tet4);
    Question { method: None, element, poisson_max: 0.3, deadline_ms, max_error }
}

/// Front 100 ms, refined single precision 60 ms, conjugate gradients 50 ms, a dense factor 900 ms.
fn table(question: &Question, element: Element, factor: f64) -> Vec<Plan> {
    let ms = [100.0, 60.0, 50.0, 900.0];
    let plans = COMPARED.iter().zip(ms).map(|(&method, ms)| Plan {
        cost: Some(Cost { ms: factor * ms, bytes: 1e6 * factor }),
        ..question.plan(element, method, "")
    });
    plans.collect()
}

#[test]
fn table_of_deadlines_and_budgets() {
    use GaveUp::{Both, Deadline, ErrorBudget};
    use Method::{Front, FrontMixed, Pcg};
    let cases = [
        // Without wishes the exact one that is fastest.
        (NONE, NONE, Front, None),
        // A budget: the fastest within it.
        (NONE, Some(1e-3), Pcg, None),
        (NONE, Some(1e-12), Pcg, None),
        (NONE, Some(2e-13), Front, None),
        (NONE, Some(1e-15), Front, Some(ErrorBudget)),
        // A deadline: the most exact that is in time with a margin.
        (Some(1000.0), NONE, Front, None),
        (Some(125.0), NONE, Front, None),
        (Some(124.0), NONE, FrontMixed, None),
        (Some(70.0), NONE, Pcg, None),
        (Some(10.0), NONE, Pcg, Some(Deadline)),
        (Some(-5.0), NONE, Pcg, Some(Deadline)),
        // Both: the fastest that meets both …
        (Some(1000.0), Some(1e-6), Pcg, None),
        (Some(1000.0), Some(5e-13), Front, None),
        // … a deadline that can be kept goes before the budget …
        (Some(80.0), Some(5e-13), Pcg, Some(ErrorBudget)),
        (Some(65.0), Some(1e-15), Pcg, Some(ErrorBudget)),
        // … and one that cannot be kept does not cost exactness.
        (Some(10.0), Some(5e-13), Front, Some(Deadline)),
        (Some(10.0), Some(1e-4), Pcg, Some(Deadline)),
        (Some(10.0), Some(1e-15), Pcg, Some(Both)),
    ];
    for (deadline_ms, max_error, method, gave_up) in cases {
        let question = question(deadline_ms, max_error);
        let plan = choose(&question, &table(&question, Element::Tet4, 1.0), MEMORY).unwrap();
        let found = (plan.method, plan.gave_up);
        assert_eq!(found, (method, gave_up), "{deadline_ms:?} {max_error:?}");
        assert_eq!(plan.locks, None);
        let told = plan.to_string();
        assert!(told.contains("predicted") && told.contains("given up") == gave_up.is_some());
    }
}

#[test]
fn error_budget_is_where_the_iteration_stops() {
    for (max_error, stops_at) in [(Some(1e-3), 1e-3), (None, 1e-6), (Some(1e-20), 1e-12)] {
        assert_eq!(question(None, max_error).error_of(Method::Pcg), stops_at);
    }
}

fn auto(poisson_max: f64, deadline_ms: Option<f64>) -> Question {
    Question { element: None, poisson_max, ..question(deadline_ms, None) }
}

/// Linear plans as in the table, with nodal pressure eight times, ten-node ones seventy times as
/// costly.
fn all_elements(question: &Question) -> Vec<Plan> {
    let of = |(element, factor)| table(question, element, factor);
    [(Element::Tet4, 1.0), (Element::Tet4Anp, 8.0), (Element::Tet10, 70.0)].map(of).concat()
}

#[test]
fn elements_that_do_not_lock_are_taken_where_time_and_memory_allow() {
    let size = MeshSize { nodes: 1500, tets: 6750 };
    let element_of = |question: &Question, memory_limit: u64| {
        let plans = candidates(question, size, &Rates::ASSUMED);
        choose(question, &plans, memory_limit).map(|plan| (plan.element, plan.locks)).unwrap()
    };
    assert_eq!(element_of(&auto(0.3, None), MEMORY), (Element::Tet4, None));
    let rubber = auto(0.49, None);
    assert_eq!(element_of(&rubber, 1 << 40), (Element::Tet10, None));
    assert_eq!(element_of(&rubber, MEMORY), (Element::Tet4Anp, None));
    assert_eq!(element_of(&rubber, 1 << 23), (Element::Tet4, Some(Locks::NoMemory)));

    let chosen = |deadline_ms, max_error| {
        let question = Question { max_error, ..auto(0.45, Some(deadline_ms)) };
        choose(&question, &all_elements(&question), MEMORY).unwrap()
    };
    let what = |plan: &Plan| (plan.element, plan.method);
    assert_eq!(what(&chosen(4500.0, None)), (Element::Tet10, Method::Pcg));
    assert_eq!(what(&chosen(1000.0, None)), (Element::Tet4Anp, Method::Front));
    let plan = chosen(300.0, None);
    assert_eq!(what(&plan), (Element::Tet4, Method::Front));
    assert_eq!((plan.gave_up, plan.locks), (None, Some(Locks::NoTime)));
    assert!(plan.locks.unwrap().to_string().contains("too late"));
    // What cannot be in time, or not exact, still does not lock.
    let plan = chosen(1.0, None);
    assert_eq!((plan.element, plan.gave_up), (Element::Tet4Anp, Some(GaveUp::Deadline)));
    let plan = chosen(1000.0, Some(1e-15));
    assert_eq!((plan.element, plan.gave_up), (Element::Tet4Anp, Some(GaveUp::ErrorBudget)));
}

#[test]
fn given_method_leaves_the_element_open() {
    let question = Question { method: Some(Method::SparseCholesky), ..auto(0.49, None) };
    let size = MeshSize { nodes: 30, tets: 60 };
    let plans = candidates(&question, size, &Rates::ASSUMED);
    let plan = choose(&question, &plans, MEMORY).unwrap();
    assert_eq!(plan.method, Method::SparseCholesky);
    assert_eq!(plan.element, Element::Tet10);
}

#[test]
fn after_the_order_only_methods_that_use_it_are_candidates() {
    let work = Work::estimate(MeshSize { nodes: 500, tets: 2000 }, Element::Tet10);
    let question = question(None, None);
    let plans = candidates_after_order(&question, Element::Tet10, &work, &Rates::ASSUMED);
    let methods: Vec<Method> = plans.iter().map(|p| p.method).collect();
    assert_eq!(methods, [Method::Front, Method::FrontMixed, Method::Pcg]);
    assert!(plans.iter().all(|p| p.element == Element::Tet10 && p.bytes() > 0.0));
}

#[test]
fn no_candidate_is_no_plan() {
    assert_eq!(choose(&question(None, None), &[], MEMORY), None);
}
