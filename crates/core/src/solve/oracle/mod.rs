//! Reference methods: slow, plain ways to the same answers, which tests and reports compare with.
//!
//! They are named like any method (`--method gauss-jordan`), and no plan takes them by itself.

pub(super) mod gauss_jordan;
pub(super) mod sparse;
