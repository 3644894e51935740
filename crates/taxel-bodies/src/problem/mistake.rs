//! A mistake at a key of a problem file.

use taxel_ground::{InputError, toml_input};

/// A mistake at a key of the problem file: its path, the message, what to do.
pub(super) struct Wrong {
    path: String,
    message: String,
    help: String,
}

pub(super) fn wrong(path: impl Into<String>, message: impl Into<String>, help: &str) -> Wrong {
    Wrong {
        path: path.into(),
        message: message.into(),
        help: help.to_owned(),
    }
}

impl Wrong {
    /// The mistake under the word.
    pub(super) fn at(&self, file: &str, text: &str) -> InputError {
        let path: Vec<&str> = self.path.split('.').collect();
        toml_input::at_key(file, text, &path, &self.message, &self.help)
    }
}
