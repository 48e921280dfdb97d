//! The `atlasfit` program.
fn main() {}
