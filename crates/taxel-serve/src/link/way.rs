//! Which link leads to an address.

use std::sync::Arc;

use super::address::LinkAddress;
use super::exec::{Program, Tell};
use super::port::Link;
use super::serial::{Serial, SerialSettings};
use super::socket::{Tcp, Udp};
use super::stream::{Pipe, StandardInput};
use super::web_socket::WebSocketServer;

/// The way to the bytes at an address.
pub(super) fn link(address: LinkAddress, serial: SerialSettings, tell: &Tell) -> Box<dyn Link> {
    match address {
        LinkAddress::Serial(name) => Box::new(Serial::new(name, serial)),
        LinkAddress::Tcp(host) => Box::new(Tcp(host)),
        LinkAddress::WebSocket { host, path } => Box::new(WebSocketServer { host, path }),
        LinkAddress::Udp {
            port,
            group,
            sender,
        } => Box::new(Udp {
            port,
            group,
            sender,
        }),
        LinkAddress::StandardInput => Box::new(StandardInput),
        LinkAddress::Pipe(path) => Box::new(Pipe(path)),
        LinkAddress::Program(words) => Box::new(Program::new(words, Arc::clone(tell))),
    }
}
