//! The command `taxel`: from the drawing of a soft tactile sensor to live touch.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(taxel_cli::run(std::env::args_os()))
}
