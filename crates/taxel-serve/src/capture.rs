//! The bytes of a board that were captured in a file, as a source.

use std::fs::File;
use std::io::{BufRead as _, BufReader, ErrorKind};
use std::path::{Path, PathBuf};
use std::time::Instant;

use taxel::acquisition::Stream;
use taxel::shown;
use taxel_board::{Begin, Board, Decoder};

use crate::board::wire_counts;
use crate::clock::Epoch;
use crate::link::{LinkError, LinkHandle, LinkState};
use crate::source::{Next, Source, SourceError, reader};

/// Bytes that are decoded at a time: the counts of the wire are hardly ahead of the frame that
/// is played.
const PIECE: usize = 256;

/// Frames decoded from captured bytes. Their times are those of the board's clock, or follow
/// from its counter and rate: nobody has written down when the bytes arrived.
#[derive(Debug)]
pub struct CaptureSource {
    path: PathBuf,
    bytes: BufReader<File>,
    decoder: Decoder,
    stream: Stream,
    status: LinkHandle,
    origin: Instant,
    read: bool,
}

impl CaptureSource {
    /// Opens a file of bytes as `board` sends them, whose frames mean what `stream` says.
    ///
    /// # Errors
    /// [`SourceError::Open`] when it cannot be opened or is no ordinary file.
    pub fn open(path: &Path, board: &Board, stream: Stream) -> Result<Self, SourceError> {
        let class = board.detection().class.letter();
        let status = LinkHandle::new(shown::path(path), board.name.clone(), class);
        let decoder = Decoder::new(board, Begin::Whole);
        status.lock().connects = 1;
        status.lock().wire = wire_counts(&decoder.counts());
        Ok(Self {
            bytes: reader(path)?,
            path: path.to_owned(),
            decoder,
            stream,
            status,
            origin: Epoch::of_process().at,
            read: false,
        })
    }

    /// Decodes a piece of the file; at its end, what waited for more.
    fn decode(&mut self) -> Result<(), SourceError> {
        let piece = loop {
            match self.bytes.fill_buf() {
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(cause) => {
                    let path = self.path.clone();
                    return Err(SourceError::Read { path, cause });
                }
                Ok(bytes) => break &bytes[..bytes.len().min(PIECE)],
            }
        };
        let length = piece.len();
        if piece.is_empty() {
            self.decoder.finish();
            self.read = true;
        } else {
            self.decoder.push(piece, None);
            self.bytes.consume(length);
        }
        let mut status = self.status.lock();
        status.bytes += length as u64;
        status.wire = wire_counts(&self.decoder.counts());
        status.remarked(self.decoder.remark());
        Ok(())
    }

    fn change(&self, state: LinkState, reason: &str) {
        let mut status = self.status.lock();
        if status.state != state {
            let now = self.origin.elapsed().as_nanos() as u64;
            status.change(state, reason.into(), now);
        }
    }
}

impl Source for CaptureSource {
    fn stream(&self) -> &Stream {
        &self.stream
    }

    fn next(&mut self) -> Result<Next, SourceError> {
        loop {
            if let Some(frame) = self.decoder.next() {
                self.change(LinkState::InStep, "");
                return Ok(Next::Frame(frame));
            }
            if let Some(difference) = self.decoder.changed() {
                return Err(LinkError::Changed {
                    name: shown::path(&self.path),
                    difference: difference.to_owned(),
                }
                .into());
            }
            if self.read {
                self.change(LinkState::Ended, "the file is over");
                return Ok(Next::End);
            }
            self.decode()?;
        }
    }

    fn link(&self) -> Option<LinkHandle> {
        Some(self.status.clone())
    }
}
