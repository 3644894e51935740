//! `taxel completions` and `taxel man`: what shells and `man` know of the command.

use std::fs;
use std::io::Write as _;
use std::path::Path;

use clap::CommandFactory as _;
use clap_mangen::Man;

use crate::arguments::{Arguments, Completions, ManPages};
use crate::outputs::{self, Existing};
use crate::{Done, Stop};

pub(crate) fn run(arguments: &Completions) -> Result<Done, Stop> {
    let mut script = Vec::new();
    clap_complete::generate(
        arguments.shell,
        &mut Arguments::command(),
        "taxel",
        &mut script,
    );
    outputs::print(&String::from_utf8_lossy(&script))
}

/// Writes a page for the command and one for each of its commands.
pub(crate) fn man(arguments: &ManPages) -> Result<Done, Stop> {
    let mut command = Arguments::command();
    // Names and usage of the commands of commands.
    command.build();
    let mut pages = Vec::new();
    pages_of(&command, &mut pages)?;
    let folder = &arguments.output;
    let existing = arguments.overwrite.existing();
    let paths: Vec<_> = pages.iter().map(|(name, _)| folder.join(name)).collect();
    if folder.exists() {
        let targets: Vec<_> = paths.iter().map(|path| ("--output", Some(path))).collect();
        outputs::check(&targets, &[], existing)?;
    }
    fs::create_dir_all(folder).map_err(|error| outputs::cannot_write(folder, &error))?;
    for (path, (_, page)) in paths.iter().zip(&pages) {
        write(path, existing, page)?;
    }
    outputs::print(&format!(
        "{} pages in {}\n",
        pages.len(),
        taxel::shown::path(folder)
    ))
}

/// The page of a command, and those of the commands below it.
fn pages_of(command: &clap::Command, pages: &mut Vec<(String, Vec<u8>)>) -> Result<(), Stop> {
    let name = Man::new(command.clone()).get_filename();
    let mut page = Vec::new();
    Man::new(command.clone())
        .render(&mut page)
        .map_err(|error| Stop::Failed(format!("the page {name}: {error}")))?;
    pages.push((name, page));
    for inner in command.get_subcommands() {
        if inner.get_name() != "help" && !inner.is_hide_set() {
            pages_of(inner, pages)?;
        }
    }
    Ok(())
}

fn write(path: &Path, existing: Existing, page: &[u8]) -> Result<(), Stop> {
    outputs::write_file(path, existing, |file| {
        file.write_all(page)
            .map_err(|error| outputs::cannot_write(path, &error))
    })
}
