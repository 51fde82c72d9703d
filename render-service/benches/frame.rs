//! "How long is one picture?" By size, alone and eight together.
fn main() {}
