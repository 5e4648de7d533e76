//! The `fea-server` program.

fn main() {}
