//! All families of hard cases.

use super::case::{Family, Form};
use super::{contacts, keep_shape, large, materials, pieces, scales, slender, slivers, supports};
use softgrasp_bench::report::ReportError;

/// Every family with its cases, the cheap ones first.
///
/// # Errors
/// [`ReportError`] where a case cannot be set up.
pub(super) fn all(form: Form) -> Result<Vec<Family>, ReportError> {
    Ok(vec![
        materials::incompressible(form)?,
        materials::contrast(form)?,
        slivers::family(form)?,
        scales::units(form)?,
        scales::displacements(form)?,
        slender::family(form)?,
        supports::weak(form)?,
        supports::free(form)?,
        pieces::family(form)?,
        contacts::family(form)?,
        keep_shape::family(form)?,
        large::family(form)?,
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_case_has_a_name_of_its_own_and_a_promise() {
        for form in [Form { is_quick: true, cells: 2 }, Form { is_quick: false, cells: 2 }] {
            let families = all(form).unwrap();
            let cases = families.iter().flat_map(|f| f.cases.iter().map(move |c| (f, c)));
            let mut names: Vec<String> =
                cases.clone().map(|(f, c)| format!("{}: {}", f.name, c.name)).collect();
            let count = names.len();
            names.sort();
            names.dedup();
            assert_eq!(names.len(), count);
            for family in &families {
                assert!(family.reasoning.len() > 40 && family.advice.len() > 20);
            }
        }
    }
}
