//! Packets of taxel-wire-1: a type, a stream, a number, a time, the content, and a check.

use crate::check::CheckKind;

/// Bytes before the content of a packet: type, stream, sequence, time.
pub(crate) const HEADER: usize = 14;
/// Bytes of the check behind it.
const CHECK: usize = 4;
/// Type of a packet that is a hello, and of one that is text for people.
pub(crate) const HELLO: u8 = 2;
const TEXT: u8 = 3;

/// The content of a packet of this type, if its check holds.
pub(crate) fn content(packet: &[u8], kind: u8) -> Option<&[u8]> {
    let (body, check) = packet.split_at_checked(packet.len().checked_sub(CHECK)?)?;
    let right = CheckKind::Crc32IsoHdlc.of(body).to_le_bytes() == check;
    (right && body.first() == Some(&kind))
        .then(|| body.get(HEADER..))
        .flatten()
}

/// The text for people in a packet; `None` for another packet.
pub(super) fn text(packet: &[u8]) -> Option<String> {
    let text = content(packet, TEXT)?;
    Some(String::from_utf8_lossy(text).into_owned())
}

/// The JSON of a hello in a packet; `None` for another packet.
pub(super) fn hello(packet: &[u8]) -> Option<String> {
    let hello = content(packet, HELLO)?;
    Some(String::from_utf8_lossy(hello).into_owned())
}
