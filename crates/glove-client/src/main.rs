//! The `glove-client` program.

fn main() {}
