//! The command `taxel`, and what the Python package shares with it: files by their names, the
//! folder of solutions, sensors with a calibration.
//!
//! # Example: the command, called by a program
//! ```
//! let arguments = ["taxel", "check", "in-plane-50um"].map(std::ffi::OsString::from);
//! assert_eq!(taxel_cli::run(arguments), 0);
//! ```

// Printing is what a command line is for.
#![allow(clippy::print_stdout, clippy::print_stderr)]

/// Writes a line to the standard error, which may be closed; what files bring in is made
/// visible.
macro_rules! note {
    ($($part:tt)*) => {
        $crate::tell(&format!($($part)*))
    };
}

mod arguments;
mod boards;
mod commands;
mod files;
mod hash;
mod hello;
mod interrupt;
mod outputs;
mod progress;
mod run_files;
mod solutions;

use std::ffi::OsString;
use std::io::Write as _;
use std::sync::OnceLock;

use anstyle::{AnsiColor, Style};
use clap::Parser;

use arguments::{Arguments, Command};
use taxel::shown;

/// End of a command; the exit codes are part of the contract.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Done {
    /// 0: done.
    Complete,
    /// 3: done, but data was lost or clipped.
    WithLosses,
}

/// What the Python package shares with the command.
pub mod shared {
    pub use crate::arguments::{COMMIT, VERSION};
    pub use crate::commands::calibrate::{applied_text, propagated_text, today};
    pub use crate::commands::study::{
        StudyText, sensor_text as study_sensor_text, slow, text as study_text,
    };
    pub use crate::files::{NamedSensor, recordings, sensor_of_text, sensor_text, sha256, text};
    pub use crate::outputs::replace as write;
    pub use crate::solutions::Folder;
}

/// Why a command did nothing or stopped.
#[derive(Debug)]
pub enum Stop {
    /// 2: the input is wrong; nothing was written.
    WrongInput(String),
    /// 1: it failed.
    Failed(String),
}

impl std::fmt::Display for Stop {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (Self::WrongInput(message) | Self::Failed(message)) = self;
        formatter.write_str(message)
    }
}

impl From<taxel::InputError> for Stop {
    fn from(error: taxel::InputError) -> Self {
        Self::WrongInput(error.to_string())
    }
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
        Command::Reproduce(reproduce) => commands::reproduce::run(reproduce),
        Command::Verify(verify) => commands::verify::run(verify),
        Command::Estimate(estimate) => commands::estimate::run(estimate),
        Command::Live(live) => commands::live::run(live),
        Command::Recording(recording) => commands::recording::run(recording),
        Command::Device(device) => commands::device::run(device),
        Command::Devices(devices) => commands::devices::run(devices),
        Command::Schema(schema) => commands::schema::run(schema),
        Command::Completions(completions) => commands::completions::run(completions),
        Command::Man(pages) => commands::completions::man(pages),
    };
    match result {
        Ok(Done::Complete) => 0,
        Ok(Done::WithLosses) => 3,
        Err(Stop::WrongInput(message)) => report(&message, 2),
        Err(Stop::Failed(message)) => report(&message, 1),
    }
}

fn report(message: &str, code: u8) -> u8 {
    note!("error: {message}");
    code
}

/// Who hears notes in the place of the standard error; true if it was heard.
static LISTENER: OnceLock<fn(&str) -> bool> = OnceLock::new();

/// From now on `listener` hears the notes; where it answers false they go to the standard error.
/// The first listener stays.
pub fn listen_to_notes(listener: fn(&str) -> bool) {
    // A second module of the same process has the same listener.
    let _ = LISTENER.set(listener);
}

/// Gives `message` to who listens, or writes it to the standard error, with the words that begin
/// its lines in colour where a terminal shows it and NO_COLOR is not set.
fn tell(message: &str) {
    if LISTENER.get().is_some_and(|listener| listener(message)) {
        return;
    }
    // Nobody may be there to read it.
    let _ = writeln!(anstream::stderr(), "{}", painted(&visible(message)));
}

/// Words that begin lines, with their colours: those that clap gives its own messages.
const PAINTED: [(&str, Style); 3] = [
    ("error:", AnsiColor::Red.on_default().bold()),
    ("help:", AnsiColor::Green.on_default()),
    ("note:", AnsiColor::Cyan.on_default()),
];

/// `message` with the word that begins each line in its colour.
fn painted(message: &str) -> String {
    let line = |line: &str| {
        let word = PAINTED.iter().find(|(word, _)| line.starts_with(word));
        match word {
            Some((word, style)) => format!("{style}{word}{style:#}{}", &line[word.len()..]),
            None => line.to_owned(),
        }
    };
    message.split('\n').map(line).collect::<Vec<_>>().join("\n")
}

/// A message of several lines as a terminal may show it: what it quotes of files and names must
/// not steer it.
pub(crate) fn visible(text: &str) -> String {
    let lines: Vec<_> = text.split('\n').map(shown::text).collect();
    lines.join("\n")
}
