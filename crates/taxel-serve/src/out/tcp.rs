//! Lines at a TCP port: each program that connects gets them from then on.

use std::io::{self, Write};
use std::net::{TcpListener, TcpStream};

use super::lines::Lines;

/// Bytes that a reader may be behind before it loses lines: a second of the largest lines, of 256
/// channels at 1 kHz, some 5 kB each.
const MOST_BEHIND: usize = 5 << 20;

/// The port, and who is connected.
pub(super) struct TcpLines {
    listener: TcpListener,
    /// The line that each gets first.
    head: String,
    clients: Vec<Client>,
    dropped: u64,
}

struct Client {
    stream: TcpStream,
    /// What it has not taken yet.
    waiting: Vec<u8>,
}

impl TcpLines {
    pub(super) fn open(address: &str, head: String) -> io::Result<Self> {
        let listener = TcpListener::bind(address)?;
        listener.set_nonblocking(true)?;
        Ok(Self {
            listener,
            head,
            clients: Vec::new(),
            dropped: 0,
        })
    }

    fn accept(&mut self) {
        while let Ok((stream, _)) = self.listener.accept() {
            // A reader that cannot be served so is none.
            if stream.set_nonblocking(true).is_ok() && stream.set_nodelay(true).is_ok() {
                self.clients.push(Client {
                    stream,
                    waiting: self.head.clone().into_bytes(),
                });
            }
        }
    }
}

impl Client {
    /// Sends what it takes now; false when it has gone.
    fn send(&mut self) -> bool {
        while !self.waiting.is_empty() {
            match self.stream.write(&self.waiting) {
                Ok(0) => return false,
                Ok(sent) => drop(self.waiting.drain(..sent)),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return true,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(_) => return false,
            }
        }
        true
    }
}

impl Write for TcpLines {
    /// Takes whole lines, as the buffer before it has gathered them.
    fn write(&mut self, lines: &[u8]) -> io::Result<usize> {
        self.accept();
        for client in &mut self.clients {
            if client.waiting.len() + lines.len() > MOST_BEHIND {
                let lost = lines.split(|byte| *byte == b'\n').count() - 1;
                self.dropped += lost as u64;
            } else {
                client.waiting.extend_from_slice(lines);
            }
        }
        self.clients.retain_mut(Client::send);
        Ok(lines.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.accept();
        self.clients.retain_mut(Client::send);
        Ok(())
    }
}

impl Lines for TcpLines {
    fn dropped(&self) -> u64 {
        self.dropped
    }

    fn has_own_head(&self) -> bool {
        true
    }
}
