//! A link that was heard before its frames are read: a board that says itself what they hold.

use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::address::LinkAddress;
use super::error::LinkError;
use super::port::{Link, Others, Port, Received};
use super::serial::SerialSettings;
use super::way;

/// Most bytes that are kept while it is heard.
const MOST_KEPT: usize = 4 << 20;
/// Longest wait for bytes at once.
const NAP: Duration = Duration::from_millis(50);

/// An open link and what came over it, so that nothing is lost and nothing is opened twice.
pub struct Heard {
    link: Box<dyn Link>,
    port: Option<HeardPort>,
}

/// An open port that gives first what was heard.
struct HeardPort {
    port: Box<dyn Port>,
    bytes: Vec<u8>,
    given: usize,
}

impl Heard {
    /// Opens the link at `address`, writes `question`, and listens until `found` says so of the
    /// bytes that came, there is no more, or `patience` has passed.
    ///
    /// # Errors
    /// [`LinkError`] when it cannot be opened, or is lost.
    pub fn listen(
        address: LinkAddress,
        serial: SerialSettings,
        tell: &Arc<dyn Fn(&str) + Send + Sync>,
        question: &[u8],
        patience: Duration,
        found: &mut dyn FnMut(&[u8]) -> bool,
    ) -> Result<Self, LinkError> {
        let mut link = way::link(address, serial, tell);
        let mut port = link.open()?;
        let lost = |error: io::Error| LinkError::Open {
            name: link.name(),
            reason: error.to_string(),
        };
        port.write(question).map_err(lost)?;
        let deadline = Instant::now() + patience;
        let mut bytes = Vec::new();
        let mut buffer = vec![0; 4096];
        while Instant::now() < deadline && bytes.len() < MOST_KEPT {
            match port.read(&mut buffer, NAP).map_err(lost)? {
                Received::Bytes(count) => {
                    bytes.extend_from_slice(&buffer[..count]);
                    if found(&buffer[..count]) {
                        break;
                    }
                }
                Received::Nothing => {}
                Received::End | Received::Done => break,
            }
        }
        Ok(Self {
            link,
            port: Some(HeardPort {
                port,
                bytes,
                given: 0,
            }),
        })
    }
}

impl Link for Heard {
    fn name(&self) -> String {
        self.link.name()
    }

    fn open(&mut self) -> Result<Box<dyn Port>, LinkError> {
        match self.port.take() {
            Some(port) => Ok(Box::new(port)),
            None => self.link.open(),
        }
    }

    fn waits(&self) -> bool {
        self.link.waits()
    }

    fn appeared(&mut self) -> bool {
        self.link.appeared()
    }

    fn remarks(&self) -> Vec<String> {
        self.link.remarks()
    }
}

impl Port for HeardPort {
    fn read(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<Received> {
        let left = &self.bytes[self.given..];
        if left.is_empty() {
            return self.port.read(buffer, patience);
        }
        let count = left.len().min(buffer.len());
        buffer[..count].copy_from_slice(&left[..count]);
        self.given += count;
        if self.given == self.bytes.len() {
            (self.bytes, self.given) = (Vec::new(), 0);
        }
        Ok(Received::Bytes(count))
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.port.write(bytes)
    }

    fn gave_frame(&mut self, patience: Duration) {
        self.port.gave_frame(patience);
    }

    fn others(&self) -> Others {
        self.port.others()
    }
}
