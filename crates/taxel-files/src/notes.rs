//! Notes for the user: to the standard error, or to a listener.

use std::io::Write as _;
use std::sync::OnceLock;

use anstyle::{AnsiColor, Style};
use taxel::shown;

/// Writes a line to the standard error, which may be closed, or gives it to who listens; what
/// files bring in is made visible.
#[macro_export]
macro_rules! note {
    ($($part:tt)*) => {
        $crate::notes::tell(&format!($($part)*))
    };
}

/// Who hears notes in the place of the standard error; true if it was heard.
static LISTENER: OnceLock<fn(&str) -> bool> = OnceLock::new();

/// From now on `listener` hears the notes; where it answers false they go to the standard error.
/// The first listener stays.
pub fn listen(listener: fn(&str) -> bool) {
    // A second module of the same process has the same listener.
    let _ = LISTENER.set(listener);
}

/// Gives `message` to who listens, or writes it to the standard error, with the words that begin
/// its lines in colour where a terminal shows it and NO_COLOR is not set.
pub fn tell(message: &str) {
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
pub fn visible(text: &str) -> String {
    let lines: Vec<_> = text.split('\n').map(shown::text).collect();
    lines.join("\n")
}
