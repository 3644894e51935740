//! Marks that come from beside the clients.

mod lines;
mod lsl;

use std::fmt;
use std::sync::Arc;
use std::sync::mpsc::SyncSender;

use crate::pump::Command;
use crate::shared::Shared;

/// Longest mark, characters; what follows is cut.
pub(crate) const LONGEST_MARK: usize = 500;

/// Where marks come from beside the clients.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Marks {
    /// From lines of the standard input.
    StandardInput,
    /// From a stream of the lab streaming layer, by its name.
    Lsl(String),
}

/// The text names no source of marks.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "--marks \"{text}\" is no source of marks; use - for lines of the standard input, or lsl:NAME for a stream of the lab streaming layer"
)]
pub struct MarksError {
    /// The text.
    pub text: String,
}

impl Marks {
    /// Reads the name of a source of marks.
    ///
    /// # Errors
    /// [`MarksError`].
    pub fn parse(text: &str) -> Result<Self, MarksError> {
        // The name stands between quotes in the question for the stream.
        let sound = |name: &&str| {
            let quoted = name.contains('\'') && name.contains('"');
            !name.is_empty() && !quoted && !name.contains(char::is_control)
        };
        match text.strip_prefix("lsl:").filter(sound) {
            Some(name) => Ok(Self::Lsl(name.to_owned())),
            None if text == "-" => Ok(Self::StandardInput),
            None => Err(MarksError { text: text.into() }),
        }
    }

    /// Hands marks on as they come, in a thread of its own; `told` hears of the other side.
    pub(crate) fn listen(
        &self,
        commands: &SyncSender<Command>,
        shared: &Arc<Shared>,
        told: fn(&str),
    ) {
        match self {
            Self::StandardInput => {
                let input = std::io::BufReader::new(std::io::stdin());
                lines::listen(input, commands.clone());
            }
            Self::Lsl(name) => {
                lsl::listen(name.clone(), commands.clone(), Arc::clone(shared), told);
            }
        }
    }
}

impl fmt::Display for Marks {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::StandardInput => f.write_str("-"),
            Self::Lsl(name) => write!(f, "lsl:{name}"),
        }
    }
}

/// A mark of a text from outside.
fn cut(text: &str) -> String {
    text.trim().chars().take(LONGEST_MARK).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_of_marks_are_read() {
        for text in ["-", "lsl:my markers", "lsl:it's", "lsl:a:b"] {
            assert_eq!(Marks::parse(text).unwrap().to_string(), text);
        }
        for text in ["", "lsl", "lsl:", "lsl:'\"", "lsl:a\nb", "markers", "--"] {
            let message = Marks::parse(text).unwrap_err().to_string();
            assert!(message.contains("lsl:NAME"), "{message}");
        }
    }
}
