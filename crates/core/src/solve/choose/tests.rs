//! The table of wishes and what they get.

use super::*;

const NONE: Option<f64> = None;

fn wish(deadline_ms: Option<f64>, max_error: Option<f64>) -> Wish {
    let element = ElementWish::Given(Element::Tet4);
    Wish { method: None, element, deadline_ms, max_error }
}

/// Front 100 ms, refined single precision 60 ms, conjugate gradients 50 ms, a dense factor 900 ms.
fn table(wish: &Wish, element: Element, factor: f64) -> Vec<Offer> {
    let ms = [100.0, 60.0, 50.0, 900.0];
    let offers = COMPARED.iter().zip(ms).map(|(&method, ms)| Offer {
        element,
        method,
        predicted_ms: factor * ms,
        bytes: 1e6 * factor,
        error_rel: wish.error_of(method),
    });
    offers.collect()
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
        let wish = wish(deadline_ms, max_error);
        let choice = choose(&wish, &table(&wish, Element::Tet4, 1.0)).unwrap();
        let found = (choice.offer.method, choice.gave_up);
        assert_eq!(found, (method, gave_up), "{deadline_ms:?} {max_error:?}");
        assert_eq!(choice.locks, None);
        let told = choice.to_string();
        assert!(told.contains("predicted") && told.contains("given up") == gave_up.is_some());
    }
}

#[test]
fn error_budget_is_where_the_iteration_stops() {
    for (max_error, stops_at) in [(Some(1e-3), 1e-3), (None, 1e-6), (Some(1e-20), 1e-12)] {
        assert_eq!(wish(None, max_error).error_of(Method::Pcg), stops_at);
    }
}

fn auto(poisson_max: f64, deadline_ms: Option<f64>) -> Wish {
    let element = ElementWish::Auto { poisson_max, memory_limit: 80_000_000 };
    Wish { element, ..wish(deadline_ms, None) }
}

/// Linear offers as in the table, with nodal pressure eight times, ten-node ones seventy times as
/// costly.
fn all_elements(wish: &Wish) -> Vec<Offer> {
    let of = |(element, factor)| table(wish, element, factor);
    [(Element::Tet4, 1.0), (Element::Tet4Anp, 8.0), (Element::Tet10, 70.0)].map(of).concat()
}

#[test]
fn elements_that_do_not_lock_are_taken_where_time_and_memory_allow() {
    let size = MeshSize { nodes: 1500, tets: 6750 };
    let element_of = |wish: &Wish| {
        let offers = offers(wish, size, &Rates::ASSUMED);
        choose(wish, &offers).map(|choice| (choice.offer.element, choice.locks)).unwrap()
    };
    assert_eq!(element_of(&auto(0.3, None)), (Element::Tet4, None));
    let roomy = ElementWish::Auto { poisson_max: 0.49, memory_limit: 1 << 40 };
    assert_eq!(element_of(&Wish { element: roomy, ..auto(0.49, None) }), (Element::Tet10, None));
    assert_eq!(element_of(&auto(0.49, None)), (Element::Tet4Anp, None));
    let tight = ElementWish::Auto { poisson_max: 0.49, memory_limit: 1 << 23 };
    let tight = Wish { element: tight, ..auto(0.49, None) };
    assert_eq!(element_of(&tight), (Element::Tet4, Some(Locks::NoMemory)));

    let chosen = |deadline_ms, max_error| {
        let wish = Wish { max_error, ..auto(0.45, Some(deadline_ms)) };
        choose(&wish, &all_elements(&wish)).unwrap()
    };
    let what = |choice: &Choice| (choice.offer.element, choice.offer.method);
    assert_eq!(what(&chosen(4500.0, None)), (Element::Tet10, Method::Pcg));
    assert_eq!(what(&chosen(1000.0, None)), (Element::Tet4Anp, Method::Front));
    let choice = chosen(300.0, None);
    assert_eq!(what(&choice), (Element::Tet4, Method::Front));
    assert_eq!((choice.gave_up, choice.locks), (None, Some(Locks::NoTime)));
    assert!(choice.locks.unwrap().to_string().contains("too late"));
    // What cannot be in time, or not exact, still does not lock.
    let choice = chosen(1.0, None);
    assert_eq!((choice.offer.element, choice.gave_up), (Element::Tet4Anp, Some(GaveUp::Deadline)));
    let choice = chosen(1000.0, Some(1e-15));
    assert_eq!(
        (choice.offer.element, choice.gave_up),
        (Element::Tet4Anp, Some(GaveUp::ErrorBudget))
    );
}

#[test]
fn given_method_leaves_the_element_open() {
    let wish = Wish { method: Some(Method::SparseCholesky), ..auto(0.49, None) };
    let size = MeshSize { nodes: 30, tets: 60 };
    let offers = offers(&wish, size, &Rates::ASSUMED);
    let choice = choose(&wish, &offers).unwrap();
    assert_eq!(choice.offer.method, Method::SparseCholesky);
    assert_eq!(choice.offer.element, Element::Tet10);
}

#[test]
fn after_the_order_only_methods_that_use_it_are_offered() {
    let work = Work::estimate(MeshSize { nodes: 500, tets: 2000 }, Element::Tet10);
    let offers = offers_after_order(&wish(None, None), Element::Tet10, &work, &Rates::ASSUMED);
    let methods: Vec<Method> = offers.iter().map(|o| o.method).collect();
    assert_eq!(methods, [Method::Front, Method::FrontMixed, Method::Pcg]);
    assert!(offers.iter().all(|o| o.element == Element::Tet10 && o.bytes > 0.0));
}

#[test]
fn nothing_offered_is_nothing_chosen() {
    assert_eq!(choose(&wish(None, None), &[]), None);
}
