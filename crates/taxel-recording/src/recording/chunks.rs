//! Frames of a recording of [`crate::mcap`], and the changes of the rest values between them.

use std::collections::VecDeque;
use std::io::BufRead;

use super::description::described_stream;
use super::{MOST_TAXELS, RecordingError};
use crate::frame::{Frame, Stream};
use crate::mcap::{
    Findings, FrameMessage, LinkMessage, MAGIC, McapReader, Message, RECONNECTED, RestMessage,
    Topic,
};
use taxel_ground::InputError;

/// What to do with a file that is not whole.
const REPAIR: &str = "taxel recording repair FILE -o NEW makes a recording of what is whole";
/// What to do with one that was not finished.
pub(super) const SALVAGE: &str =
    "its frames are whole; taxel recording repair FILE -o NEW makes a finished recording of them";

/// What came between the frames of a run, as far as it changes their meaning.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Change {
    /// The rest values changed.
    Rest(Box<RestMessage>),
    /// The link was lost and is open again: numbers and times begin anew.
    Reconnected,
}

/// The frames of a recording in chunks.
#[derive(Debug)]
pub(super) struct Chunks<R> {
    file: String,
    reader: McapReader<R>,
    stream: Stream,
    /// The first frame, which was read to find the description.
    first: Option<Frame>,
    changes: VecDeque<Change>,
}

/// True if a file begins as one, or as one whose first bytes are damaged.
pub(super) fn recognises(begin: &[u8]) -> bool {
    begin.first() == Some(&MAGIC[0]) || begin.get(1..5) == Some(&MAGIC[1..5])
}

impl<R: BufRead> Chunks<R> {
    pub(super) fn open(file: &str, reader: R) -> Result<Self, RecordingError> {
        let mut this = Self {
            file: file.to_owned(),
            reader: McapReader::new(reader),
            stream: Stream::of_counts([1, 1], [1e-3; 2], 1, 1.0),
            first: None,
            changes: VecDeque::new(),
        };
        this.first = this.next_frame()?;
        let findings = this.reader.findings();
        if let Some(description) = &findings.description {
            this.stream = described_stream(file, description)?;
        } else if let Some(foreign) = &findings.foreign {
            let message = format!("this is an MCAP file, but no recording of taxel: {foreign}");
            return Err(InputError::whole(file, message).into());
        } else if this.first.is_some() {
            let message = "what the channels of the recording are is not preserved";
            return Err(InputError::whole(file, message)
                .help("taxel recording export still gives the readings")
                .into());
        } else {
            return Err(this.end().err().unwrap_or_else(|| {
                let message = "this is an MCAP file without a frame of taxel";
                InputError::whole(file, message).into()
            }));
        }
        if this.stream.channels() > 4 * MOST_TAXELS as usize {
            let message = format!("{} channels are too many", this.stream.channels());
            return Err(InputError::whole(file, message).into());
        }
        Ok(this)
    }

    pub(super) fn stream(&self) -> &Stream {
        &self.stream
    }

    pub(super) fn findings(&self) -> &Findings {
        self.reader.findings()
    }

    pub(super) fn take_changes(&mut self) -> VecDeque<Change> {
        std::mem::take(&mut self.changes)
    }

    pub(super) fn read(&mut self) -> Result<Option<Frame>, RecordingError> {
        let frame = match self.first.take() {
            Some(first) => Some(first),
            None => self.next_frame()?,
        };
        let Some(frame) = frame else {
            return self.end().map(|()| None);
        };
        if frame.values.len() != self.stream.channels() {
            let message = format!(
                "frame {} has {} channels, the recording has {}",
                frame.sequence,
                frame.values.len(),
                self.stream.channels()
            );
            return Err(InputError::whole(&self.file, message).into());
        }
        Ok(Some(frame))
    }

    /// The next frame as it stands; changes of the rest values before it are kept.
    fn next_frame(&mut self) -> Result<Option<Frame>, RecordingError> {
        while let Some(entry) = self.reader.next()? {
            match entry.topic {
                Topic::Raw => {
                    let message = FrameMessage::decode(entry.bytes);
                    let number = entry.sequence;
                    self.check()?;
                    let message = message.ok_or_else(|| self.unknown("frame", number))?;
                    return Ok(Some(message.frame));
                }
                Topic::Rest => {
                    let number = entry.sequence;
                    let change = RestMessage::decode(entry.bytes);
                    let change =
                        change.ok_or_else(|| self.unknown("change of the rest values", number))?;
                    self.changes.push_back(Change::Rest(Box::new(change)));
                }
                Topic::Link => {
                    // The pump writes it in its place between the frames.
                    let link = LinkMessage::decode(entry.bytes);
                    if link.is_some_and(|link| link.state == RECONNECTED) {
                        self.changes.push_back(Change::Reconnected);
                    }
                }
                _ => {}
            }
        }
        Ok(None)
    }

    fn unknown(&self, what: &str, number: u32) -> RecordingError {
        let message = format!("{what} {number} is not written as this version of taxel reads it");
        InputError::whole(&self.file, message).into()
    }

    /// Refuses a file that is damaged before this place. Frames that a repaired file lacks are
    /// lost like any others: their numbers say so.
    fn check(&self) -> Result<(), RecordingError> {
        let findings = self.reader.findings();
        let message = if let Some(damage) = findings.damages.first() {
            let bytes = damage.to - damage.from;
            format!("{bytes} bytes from byte {} on are damaged", damage.from)
        } else if findings.late_chunks + findings.foreign_chunks > 0 {
            "parts of the file are not in their order".to_owned()
        } else if let Some(at) = findings.second {
            format!("another recording begins at byte {at}")
        } else {
            return Ok(());
        };
        Err(InputError::whole(&self.file, message).help(REPAIR).into())
    }

    /// What is said at the end of the file.
    fn end(&self) -> Result<(), RecordingError> {
        let findings = self.reader.findings();
        if findings.finished || findings.torn_tail().is_none() {
            self.check()?;
        }
        if findings.finished {
            return Ok(());
        }
        let message = match findings.torn_tail() {
            Some(tail) => format!(
                "the file ends inside a chunk that begins at byte {}",
                tail.from
            ),
            None => "the recording was not finished".to_owned(),
        };
        Err(RecordingError::Truncated {
            error: InputError::whole(&self.file, message).help(SALVAGE),
            complete_frames: 0,
        })
    }
}
