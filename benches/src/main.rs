//! `softgrasp-bench REPORT`: measured figures, each with its error.

fn main() {}
