//! Datagrams to one address.

use std::io;
use std::net::UdpSocket;

/// A socket that sends to one address.
pub(super) struct Datagrams(UdpSocket);

impl Datagrams {
    pub(super) fn open(address: &str) -> io::Result<Self> {
        let mut last = io::Error::other("the host has no address");
        for address in std::net::ToSocketAddrs::to_socket_addrs(address)? {
            let own = if address.is_ipv4() {
                "0.0.0.0:0"
            } else {
                "[::]:0"
            };
            let socket = UdpSocket::bind(own)?;
            match socket.connect(address) {
                Ok(()) => return Ok(Self(socket)),
                Err(error) => last = error,
            }
        }
        Err(last)
    }

    /// Sends one; that nobody listens yet, or that the system has no room for it, is no failure of the run.
    pub(super) fn send(&self, bytes: &[u8]) -> io::Result<()> {
        match self.0.send(bytes) {
            Err(error)
                if !matches!(
                    error.kind(),
                    io::ErrorKind::ConnectionRefused | io::ErrorKind::WouldBlock
                ) =>
            {
                Err(error)
            }
            _ => Ok(()),
        }
    }
}
