//! WebSocket servers that send readings.

use std::io;
use std::net::TcpStream;
use std::time::Duration;

use tungstenite::client::client_with_config;
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Error, Message, WebSocket};

use super::error::LinkError;
use super::port::{Link, Port, Received, is_wait};
use super::socket;

/// Longest message, bytes.
const LONGEST: usize = 1 << 20;
/// Longest wait for the greeting of the server.
const GREETING: Duration = Duration::from_secs(2);

/// A WebSocket server: its messages are the bytes, each text with a line feed behind it.
pub(crate) struct WebSocketServer {
    /// Host and port.
    pub(crate) host: String,
    /// Path, with the stroke that it begins with.
    pub(crate) path: String,
}

impl Link for WebSocketServer {
    fn name(&self) -> String {
        format!("ws:{}{}", self.host, self.path)
    }

    fn open(&mut self) -> Result<Box<dyn Port>, LinkError> {
        let refuse = |reason: String| LinkError::Open {
            name: self.name(),
            reason,
        };
        let stream = socket::connect(&self.host).map_err(refuse)?;
        stream
            .set_read_timeout(Some(GREETING))
            .map_err(|error| refuse(error.to_string()))?;
        let limits = WebSocketConfig::default()
            .max_message_size(Some(LONGEST))
            .max_frame_size(Some(LONGEST));
        let address = format!("ws://{}{}", self.host, self.path);
        let (socket, _) = client_with_config(address, stream, Some(limits))
            .map_err(|error| refuse(format!("is no WebSocket: {error}")))?;
        Ok(Box::new(OpenWebSocket {
            socket,
            left: Vec::new(),
            given: 0,
            patience: None,
        }))
    }
}

struct OpenWebSocket {
    socket: WebSocket<TcpStream>,
    /// The last message, and how much of it was given.
    left: Vec<u8>,
    given: usize,
    patience: Option<Duration>,
}

impl OpenWebSocket {
    fn give(&mut self, buffer: &mut [u8]) -> Received {
        let left = &self.left[self.given..];
        let count = left.len().min(buffer.len());
        buffer[..count].copy_from_slice(&left[..count]);
        self.given += count;
        Received::Bytes(count)
    }
}

impl Port for OpenWebSocket {
    fn read(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<Received> {
        if self.given < self.left.len() {
            return Ok(self.give(buffer));
        }
        if self.patience != Some(patience) {
            self.socket.get_ref().set_read_timeout(Some(patience))?;
            self.patience = Some(patience);
        }
        (self.left, self.given) = match self.socket.read() {
            Ok(Message::Text(text)) => {
                let mut line = text.as_bytes().to_vec();
                line.push(b'\n');
                (line, 0)
            }
            Ok(Message::Binary(bytes)) if !bytes.is_empty() => (bytes.to_vec(), 0),
            // Questions whether we are there are answered with the next read.
            Ok(_) => return Ok(Received::Nothing),
            Err(Error::Io(error)) if is_wait(&error) => return Ok(Received::Nothing),
            Err(Error::ConnectionClosed | Error::AlreadyClosed) => return Ok(Received::End),
            Err(Error::Io(error)) => return Err(error),
            Err(error) => return Err(io::Error::other(error)),
        };
        Ok(self.give(buffer))
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        if bytes.is_empty() {
            return Ok(());
        }
        let message = match std::str::from_utf8(bytes) {
            Ok(text) => Message::text(text),
            Err(_) => Message::binary(bytes.to_vec()),
        };
        self.socket.send(message).map_err(|error| match error {
            Error::Io(error) => error,
            error => io::Error::other(error),
        })
    }
}
