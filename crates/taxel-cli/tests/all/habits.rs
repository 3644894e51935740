//! What a command of the shell does: completes, has manual pages, and colours its errors.

use std::fs;
use std::process::Command;

use crate::common::{Folder, done, refused, refused_with};

/// Standard error of a wrong command with these variables set.
fn error_with(variables: &[(&str, &str)]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_taxel"))
        .args(["check", "no-such-sensor"])
        .env_remove("NO_COLOR")
        .env_remove("CLICOLOR_FORCE")
        .envs(variables.iter().copied())
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(2));
    String::from_utf8(output.stderr).unwrap()
}

#[test]
fn errors_have_colour_where_it_is_wanted_and_never_else() {
    let plain = error_with(&[]);
    assert!(
        plain.starts_with("error: ") && !plain.contains('\u{1b}'),
        "{plain:?}"
    );
    let forced = error_with(&[("CLICOLOR_FORCE", "1")]);
    assert!(
        forced.starts_with("\u{1b}[1m\u{1b}[31merror:\u{1b}[0m "),
        "{forced:?}"
    );
    assert!(forced.contains("\u{1b}[32mhelp:\u{1b}[0m "), "{forced:?}");
    // The wish for none is stronger.
    let none = error_with(&[("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")]);
    assert_eq!(none, plain);
}

#[test]
fn every_shell_completes_every_command() {
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = done(&["completions", shell]);
        for command in ["fabricate", "predict", "tolerance", "completions"] {
            assert!(script.contains(command), "{shell}: {command}");
        }
    }
    refused_with(&["completions", "dos"], &["bash", "zsh"]);
}

#[test]
fn every_command_has_a_manual_page() {
    let folder = Folder::new("man");
    let pages = folder.path("man1");
    done(&["man", "-o", &pages]);
    for name in [
        "taxel",
        "taxel-predict",
        "taxel-recording",
        "taxel-recording-cut",
    ] {
        let page = fs::read_to_string(format!("{pages}/{name}.1")).unwrap();
        assert!(
            page.contains(".SH NAME") && page.contains(".SH SYNOPSIS"),
            "{name}: {page}"
        );
    }
    assert!(refused(&["man", "-o", &pages]).contains("--force"));
}
