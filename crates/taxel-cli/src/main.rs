//! The command `taxel`.
fn main() {}
