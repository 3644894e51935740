//! Meaning of frames as text, for recordings whose frames are not text themselves: the head
//! of the file of raw channels that has the same frames.

use std::io::Result;

use super::lines::number;
use super::writer::ChannelWriter;
use super::{Recording, RecordingError};
use crate::frame::Stream;

/// Longest name that is written, characters.
const NAME: usize = 1000;

/// The meaning of frames as text: the lines before the first frame of a file of raw channels,
/// and comments with what has no place there.
///
/// # Errors
/// As [`ChannelWriter::new`].
pub fn description_of(stream: &Stream) -> Result<String> {
    let visible = |c: &char| !c.is_control();
    let name: String = stream.name.chars().filter(visible).take(NAME).collect();
    let mut comments = vec![format!("name = {name}")];
    if let Some(period) = stream.period {
        comments.push(format!("period = {period:e} s"));
    }
    let absent = stream.present.iter().enumerate();
    let absent = absent.filter(|(_, present)| !**present);
    let absent: Vec<_> = absent.map(|(at, _)| at.to_string()).collect();
    if !absent.is_empty() {
        comments.push(format!("absent = {}", absent.join(" ")));
    }
    let writer = ChannelWriter::new(Vec::new(), stream, &comments)?;
    Ok(String::from_utf8_lossy(&writer.into_inner()).into_owned())
}

/// The meaning of frames that [`description_of`] has written.
///
/// # Errors
/// Those of [`Recording::open`] for `file`, by which messages call the recording.
pub fn described_stream(
    file: &str,
    description: &str,
) -> std::result::Result<Stream, RecordingError> {
    let recording = Recording::open_channels(file, description.as_bytes())?;
    let mut stream = recording.stream().clone();
    for line in description.lines() {
        let Some((key, value)) = line
            .strip_prefix("# ")
            .and_then(|line| line.split_once(" = "))
        else {
            continue;
        };
        match key {
            "name" => value.clone_into(&mut stream.name),
            "period" => {
                let period = value.strip_suffix(" s").and_then(number);
                stream.period = period.filter(|period| *period > 0.0);
            }
            "absent" => {
                for at in value.split(' ').filter_map(|at| at.parse::<usize>().ok()) {
                    if let Some(present) = stream.present.get_mut(at) {
                        *present = false;
                    }
                }
            }
            _ => {}
        }
    }
    Ok(stream)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a panic is how a test fails")]
mod tests {
    use super::*;

    #[test]
    fn a_stream_comes_back() {
        let mut stream = Stream::of_counts([2, 3], [2e-3, 1.27e-3], 1, 1.0 / 60.0);
        stream.name = "a = b, \"c\"".into();
        stream.threshold = Some(3.0);
        stream.present[4] = false;
        let text = description_of(&stream).unwrap();
        assert_eq!(described_stream("x.mcap", &text).unwrap(), stream);
    }
}
