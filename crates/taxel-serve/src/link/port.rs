//! The one small interface of all links.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use serde::Serialize;

use super::error::LinkError;

/// What a read gave.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Received {
    /// So many bytes.
    Bytes(usize),
    /// None in the time given.
    Nothing,
    /// The other side has closed.
    End,
    /// The other side has ended of its own will: there is no more.
    Done,
}

/// An open way to bytes.
pub(crate) trait Port: Send {
    /// Reads what is there, and waits for it no longer than `patience`.
    fn read(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<Received>;

    /// Writes all of `bytes`.
    fn write(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// The bytes read last gave a frame: who sent them is the board, until it has given none
    /// for longer than `patience`.
    fn gave_frame(&mut self, _patience: Duration) {}

    /// Others than the board that send to it, of which nothing is read.
    fn others(&self) -> Others {
        Others::default()
    }
}

/// Who else sends to a link that reads one board.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Others {
    /// Datagrams passed over.
    pub datagrams: u64,
    /// Their senders: the first of them.
    pub senders: Vec<SocketAddr>,
}

/// A way to bytes that can be opened, again and again.
pub(crate) trait Link: Send {
    /// Name for people.
    fn name(&self) -> String;

    /// Opens it.
    fn open(&mut self) -> Result<Box<dyn Port>, LinkError>;

    /// True if the other side waits while nobody reads, so that nothing need be dropped.
    fn waits(&self) -> bool {
        false
    }

    /// True if something suggests that it can be opened now and could not before.
    fn appeared(&mut self) -> bool {
        false
    }

    /// What the operator should know of the open port, one sentence each.
    fn remarks(&self) -> Vec<String> {
        Vec::new()
    }
}

/// What a timeout, an interruption and an end look like.
pub(crate) fn received(read: io::Result<usize>) -> io::Result<Received> {
    match read {
        Ok(0) => Ok(Received::End),
        Ok(bytes) => Ok(Received::Bytes(bytes)),
        Err(error) if is_wait(&error) => Ok(Received::Nothing),
        Err(error) => Err(error),
    }
}

/// True if there was only nothing yet.
pub(crate) fn is_wait(error: &io::Error) -> bool {
    use io::ErrorKind::{Interrupted, TimedOut, WouldBlock};
    matches!(error.kind(), Interrupted | TimedOut | WouldBlock)
}
