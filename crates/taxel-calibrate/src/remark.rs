//! Remarks of a calibration on its readings.

use std::fmt;

/// A remark, at a line of the readings or about all of them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remark {
    /// Line, from 1; 0 for the file as a whole.
    pub line: usize,
    /// Finding and action.
    pub message: String,
}

impl Remark {
    /// A remark at a line.
    pub fn at(line: usize, message: &str) -> Self {
        Self {
            line,
            message: message.to_owned(),
        }
    }

    /// Remark that so many readings, from these lines on, are of some kind; none without any.
    pub(crate) fn from_here_on(lines: &[usize], what: &str) -> Option<Self> {
        let message = format!("{} {what}, from here on", lines.len());
        lines.first().map(|line| Self::at(*line, &message))
    }

    /// One remark of what holds for several subjects alike, with the list of them; none without any.
    pub(crate) fn of_each(what: &str, subjects: &[String]) -> Option<Self> {
        let listed = || Self::whole(format!("{what}: {}", subjects.join(", ")));
        (!subjects.is_empty()).then(listed)
    }

    /// The same remarks, each said once: what several name alike before a colon is one remark, with
    /// their names in the place of the first.
    pub(crate) fn gathered(remarks: Vec<Self>) -> Vec<Self> {
        let mut gathered: Vec<(Vec<String>, Self)> = Vec::new();
        for remark in remarks {
            let named = remark.message.split_once(": ");
            let named = named.filter(|(name, _)| remark.line == 0 && !name.contains(' '));
            let (names, message) = match named {
                Some((name, message)) => (vec![name.to_owned()], message.to_owned()),
                None => (Vec::new(), remark.message),
            };
            let remark = Self { message, ..remark };
            let alike = |(others, other): &&mut (Vec<String>, Self)| {
                *other == remark && others.is_empty() == names.is_empty()
            };
            match gathered.iter_mut().find(alike) {
                Some((others, _)) => others.extend(names),
                None => gathered.push((names, remark)),
            }
        }
        let said = |(names, remark): (Vec<String>, Self)| match &names[..] {
            [] => remark,
            names => Self::whole(format!("{}: {}", names.join(", "), remark.message)),
        };
        gathered.into_iter().map(said).collect()
    }

    /// A remark about all readings.
    pub fn whole(message: impl Into<String>) -> Self {
        Self {
            line: 0,
            message: message.into(),
        }
    }
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            0 => f.write_str(&self.message),
            line => write!(f, "line {line}: {}", self.message),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_several_channels_share_is_said_once() {
        let remarks = [
            "channel_0: 4 readings are left out",
            "the last fifth is held out",
            "channel_1: 4 readings are left out",
            "channel_2: 5 readings are left out",
            "the last fifth is held out",
            "a remark of one: and two",
        ];
        let mut remarks: Vec<Remark> = remarks.map(Remark::whole).into();
        remarks.push(Remark::at(3, "channel_0: 4 readings are left out"));
        let said: Vec<String> = Remark::gathered(remarks)
            .iter()
            .map(ToString::to_string)
            .collect();
        assert_eq!(
            said,
            [
                "channel_0, channel_1: 4 readings are left out",
                "the last fifth is held out",
                "channel_2: 5 readings are left out",
                "a remark of one: and two",
                "line 3: channel_0: 4 readings are left out",
            ]
        );
    }
}
