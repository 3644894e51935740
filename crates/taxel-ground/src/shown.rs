//! Texts and names of files as a message, a table or a terminal may show them.

use std::fmt::Write as _;
use std::path::Path;

use crate::quantity;

/// `text` with its control characters and the marks that turn a line written out: names and
/// cells of files must neither steer a terminal nor break a line.
///
/// ```
/// assert_eq!(taxel_ground::shown::text("a\nb"), "a\\nb");
/// ```
pub fn text(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        if c.is_control() || turns_the_line(c) {
            shown.extend(c.escape_default());
        } else {
            shown.push(c);
        }
    }
    shown
}

/// The name of a file as [`text`]; what is no text in it is shown as `U+FFFD`.
pub fn path(path: &Path) -> String {
    text(&path.to_string_lossy())
}

/// A text of a figure with its units as people write them; files have `um` and `kohm`, which every
/// keyboard has.
///
/// ```
/// use taxel_ground::shown::units;
/// assert_eq!(units("gap [um], 3 kohm and 2 fF/um"), "gap [µm], 3 kΩ and 2 fF/µm");
/// assert_eq!(units("an um of a summit"), "an µm of a summit");
/// ```
pub fn units(text: &str) -> String {
    let apart = |c: char| c.is_whitespace() || "[](),;:/".contains(c);
    let shown = |part: &str| {
        let word = part.trim_end_matches(apart);
        let known =
            || quantity::dimensions().any(|one| one.units.iter().any(|(name, _)| *name == word));
        if !word.is_empty() && known() {
            let behind = &part[word.len()..];
            let word = word
                .replace("ohm", "Ω")
                .replace("m2", "m²")
                .replace("m3", "m³");
            let micro = word.strip_prefix('u').map(|rest| format!("µ{rest}"));
            micro.unwrap_or(word) + behind
        } else {
            part.to_owned()
        }
    };
    text.split_inclusive(apart).map(shown).collect()
}

/// `text` as a basic string of TOML, with its quotes.
///
/// ```
/// assert_eq!(taxel_ground::shown::toml("3 \"mm\"\u{7f}"), "\"3 \\\"mm\\\"\\u007f\"");
/// ```
pub fn toml(text: &str) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if c.is_control() => {
                let _ = write!(quoted, "\\u{:04x}", u32::from(c));
            }
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}

/// Marks that change the direction of a line.
fn turns_the_line(c: char) -> bool {
    matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}
