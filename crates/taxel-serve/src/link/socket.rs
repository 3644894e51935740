//! TCP clients and UDP ports.

use std::io::{self, Read as _, Write as _};
use std::net::{Ipv4Addr, SocketAddr, TcpStream, ToSocketAddrs as _, UdpSocket};
use std::time::{Duration, Instant};

use super::error::LinkError;
use super::port::{Link, Others, Port, Received, received};
use super::tracker::GARBLED_AFTER;

/// Longest wait for the answer of a host.
const CONNECT: Duration = Duration::from_secs(2);

/// A TCP server that sends bytes.
pub(crate) struct Tcp(pub(crate) String);

impl Link for Tcp {
    fn name(&self) -> String {
        format!("tcp:{}", self.0)
    }

    fn open(&mut self) -> Result<Box<dyn Port>, LinkError> {
        let stream = connect(&self.0).map_err(|reason| LinkError::Open {
            name: self.name(),
            reason,
        })?;
        Ok(Box::new(OpenTcp {
            stream,
            patience: None,
        }))
    }
}

/// A connection to `HOST:PORT`.
///
/// # Errors
/// Why there is none, for people.
pub(super) fn connect(host: &str) -> Result<TcpStream, String> {
    let addresses: Vec<SocketAddr> = host
        .to_socket_addrs()
        .map_err(|error| format!("the name of the host is not known: {error}"))?
        .collect();
    let mut last = "the host has no address".to_owned();
    for address in addresses {
        match TcpStream::connect_timeout(&address, CONNECT) {
            Ok(stream) => {
                // A question to the board must not wait for more to send.
                let _ = stream.set_nodelay(true);
                return Ok(stream);
            }
            Err(error) => last = format!("nobody answers: {error}"),
        }
    }
    Err(last)
}

struct OpenTcp {
    stream: TcpStream,
    patience: Option<Duration>,
}

impl Port for OpenTcp {
    fn read(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<Received> {
        if self.patience != Some(patience) {
            self.stream.set_read_timeout(Some(patience))?;
            self.patience = Some(patience);
        }
        received(self.stream.read(buffer))
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.stream.write_all(bytes)
    }
}

/// A UDP port of this machine.
pub(crate) struct Udp {
    pub(crate) port: u16,
    pub(crate) group: Option<Ipv4Addr>,
    /// The board, of others that send to the port.
    pub(crate) sender: Option<Ipv4Addr>,
}

impl Link for Udp {
    fn name(&self) -> String {
        match self.group.or(self.sender) {
            Some(address) => format!("udp:{}@{address}", self.port),
            None => format!("udp:{}", self.port),
        }
    }

    fn open(&mut self) -> Result<Box<dyn Port>, LinkError> {
        let refuse = |error: io::Error| LinkError::Open {
            name: self.name(),
            reason: format!("cannot be listened on: {error}"),
        };
        let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, self.port)).map_err(refuse)?;
        if let Some(group) = &self.group {
            let joined = socket.join_multicast_v4(group, &Ipv4Addr::UNSPECIFIED);
            joined.map_err(refuse)?;
        }
        Ok(Box::new(OpenUdp {
            socket,
            only: self.sender,
            board: None,
            others: Others::default(),
            patience: None,
        }))
    }
}

/// A port that reads one board: the first that sends. Another takes its turn once the first has
/// given no frame for a while.
struct OpenUdp {
    socket: UdpSocket,
    /// The address that alone is read, if one is.
    only: Option<Ipv4Addr>,
    board: Option<Sender>,
    others: Others,
    patience: Option<Duration>,
}

/// Who sends what is read; questions go there.
struct Sender {
    address: SocketAddr,
    /// Its last frame, or its first datagram.
    since: Instant,
    /// After this time without a frame it may be no board, or gone.
    patience: Duration,
}

/// Other senders that are named.
const NAMED: usize = 8;

impl OpenUdp {
    /// True if what `sender` sends is read.
    fn takes(&mut self, sender: SocketAddr) -> io::Result<bool> {
        if self.only.is_some_and(|only| sender.ip() != only) {
            self.pass_over(sender);
            return Ok(false);
        }
        let board = self.board.get_or_insert_with(|| Sender {
            address: sender,
            since: Instant::now(),
            patience: Duration::from_nanos(GARBLED_AFTER),
        });
        if board.address == sender {
            return Ok(true);
        }
        if board.since.elapsed() > board.patience {
            return Err(io::Error::other(format!(
                "{} has given no frame for {:.1} s, and {sender} sends now",
                board.address,
                board.since.elapsed().as_secs_f64()
            )));
        }
        self.pass_over(sender);
        Ok(false)
    }

    fn pass_over(&mut self, sender: SocketAddr) {
        self.others.datagrams += 1;
        let senders = &mut self.others.senders;
        if senders.len() < NAMED && !senders.contains(&sender) {
            senders.push(sender);
        }
    }
}

impl Port for OpenUdp {
    fn read(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<Received> {
        if self.patience != Some(patience) {
            self.socket.set_read_timeout(Some(patience))?;
            self.patience = Some(patience);
        }
        match self.socket.recv_from(buffer) {
            // An empty datagram is no end.
            Ok((0, _)) => Ok(Received::Nothing),
            Ok((bytes, sender)) => Ok(if self.takes(sender)? {
                Received::Bytes(bytes)
            } else {
                Received::Nothing
            }),
            Err(error) => received(Err(error)),
        }
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        match &self.board {
            Some(board) => self.socket.send_to(bytes, board.address).map(drop),
            None => Ok(()),
        }
    }

    fn gave_frame(&mut self, patience: Duration) {
        if let Some(board) = &mut self.board {
            board.since = Instant::now();
            board.patience = patience.max(Duration::from_nanos(GARBLED_AFTER));
        }
    }

    fn others(&self) -> Others {
        self.others.clone()
    }
}
