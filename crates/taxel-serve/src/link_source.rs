//! The frames of a link as a source.

use std::time::{Duration, Instant};

use taxel::acquisition::{Frame, Stream};

use crate::link::{Decode, Item, LinkAddress, LinkError, LinkHandle, LinkOptions, Running};
use crate::source::{Next, Source, SourceError};

/// Longest wait for a frame before commands are looked at.
const NAP: Duration = Duration::from_millis(20);

/// Frames decoded from the bytes of a link.
#[derive(Debug)]
pub struct LinkSource {
    stream: Stream,
    link: Running,
    newest_ns: u64,
}

impl LinkSource {
    /// Starts the thread of a link whose frames mean what `stream` says.
    ///
    /// # Errors
    /// [`LinkError::Thread`].
    pub fn start(
        address: LinkAddress,
        stream: Stream,
        decoder: Box<dyn Decode>,
        options: LinkOptions,
    ) -> Result<Self, LinkError> {
        let stale_after = crate::stale_after(&stream);
        Ok(Self {
            link: Running::start(address, stale_after, decoder, options)?,
            stream,
            newest_ns: 0,
        })
    }

    /// The status of the link.
    pub fn status(&self) -> LinkHandle {
        self.link.status()
    }
}

impl Source for LinkSource {
    fn stream(&self) -> &Stream {
        &self.stream
    }

    fn next(&mut self) -> Result<Next, SourceError> {
        match self.link.receive(NAP) {
            Some(Item::Frame(frame)) => {
                self.newest_ns = frame.time_ns;
                Ok(Next::Frame(frame))
            }
            Some(Item::Reconnected) => Ok(Next::Reconnected),
            Some(Item::End(None)) => Ok(Next::End),
            Some(Item::End(Some(error))) => Err(error.into()),
            None => Ok(Next::Nothing(self.newest_ns)),
        }
    }

    fn arrival(&self, frame: &Frame) -> Option<Instant> {
        let since = Duration::from_nanos(frame.host_ns?);
        self.link.origin().checked_add(since)
    }

    fn link(&self) -> Option<LinkHandle> {
        Some(self.status())
    }
}
