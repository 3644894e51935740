//! The command `taxel`.
//!
//! # Example: the command, called by a program
//! ```
//! let arguments = ["taxel", "check", "in-plane-50um"].map(std::ffi::OsString::from);
//! assert_eq!(taxel_cli::run(arguments), 0);
//! ```

// Printing is what a command line is for.
#![allow(clippy::print_stdout, clippy::print_stderr)]

/// `note!`, as in the crates that open files.
#[macro_use]
extern crate taxel_files;

mod arguments;
mod boards;
mod commands;
mod hello;
mod interrupt;
mod outputs;
mod run_files;

use std::ffi::OsString;

use clap::Parser;

use arguments::{Arguments, Command};
use taxel_files::Progress;
pub(crate) use taxel_files::{self as files, Stop};

/// End of a command; the exit codes are part of the contract.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Done {
    /// 0: done.
    Complete,
    /// 3: done, but data was lost or clipped.
    WithLosses,
}

/// Runs the command with its arguments, the name of the program first; the exit code.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let arguments = match Arguments::try_parse_from(arguments) {
        Ok(arguments) => arguments,
        Err(error) => {
            // clap's own codes are ours: 0 for help, 2 for wrong usage. A
            // closed pipe is no reason to panic.
            let _ = error.print();
            return u8::from(error.use_stderr()) * 2;
        }
    };
    let working = working(&arguments.command);
    let result = match &arguments.command {
        Command::Check(check) => commands::check::run(check),
        Command::Predict(predict) => commands::predict::run(predict),
        Command::Sweep(sweep) => commands::sweep::run(sweep),
        Command::Solve(solve) => commands::solve::run(solve),
        Command::Optimize(optimize) => commands::optimize::run(optimize),
        Command::Tolerance(tolerance) => commands::tolerance::run(tolerance),
        Command::Fabricate(fabricate) => commands::fabricate::run(fabricate),
        Command::Tabulate(tabulate) => commands::tabulate::run(tabulate),
        Command::Export(export) => commands::export::run(export),
        Command::Calibrate(calibrate) => commands::calibrate::run(calibrate),
        Command::Twin(twin) => commands::twin::run(twin),
        Command::Material(material) => commands::material::run(material),
        Command::Reproduce(reproduce) => commands::reproduce::run(reproduce),
        Command::Verify(verify) => commands::verify::run(verify),
        Command::Estimate(estimate) => commands::estimate::run(estimate),
        Command::Live(live) => commands::live::run(live),
        Command::Recording(recording) => commands::recording::run(recording),
        Command::Device(device) => commands::device::run(device),
        Command::Devices(devices) => commands::devices::run(devices),
        Command::Listen(listen) => commands::listen::run(listen),
        Command::Schema(schema) => commands::schema::run(schema),
        Command::Completions(completions) => commands::completions::run(completions),
        Command::Man(pages) => commands::completions::man(pages),
    };
    drop(working);
    match result {
        Ok(Done::Complete) => 0,
        Ok(Done::WithLosses) => 3,
        Err(Stop::WrongInput(message)) => report(&message, 2),
        Err(Stop::Failed(message)) => report(&message, 1),
    }
}

/// Commands say that they work where nothing else says it; but for those that show or send
/// what comes until they are ended, which say so of their beginning.
fn working(command: &Command) -> Option<Progress> {
    let endless = matches!(
        command,
        Command::Live(_) | Command::Device(_) | Command::Listen(_)
    );
    (!endless).then(|| Progress::new("working"))
}

fn report(message: &str, code: u8) -> u8 {
    note!("error: {message}");
    code
}
