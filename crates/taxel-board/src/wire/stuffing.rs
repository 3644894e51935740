//! Packets in stuffed bytes: consistent overhead byte stuffing, and SLIP (RFC 1055).

/// End of a packet in SLIP, and its escape.
pub(super) const SLIP_END: u8 = 0xc0;
const SLIP_ESCAPE: u8 = 0xdb;
const SLIP_ESCAPED_END: u8 = 0xdc;
const SLIP_ESCAPED_ESCAPE: u8 = 0xdd;

/// Undoes consistent overhead byte stuffing; `None` for bytes that are none.
pub(crate) fn from_cobs(stuffed: &[u8], packet: &mut Vec<u8>) -> Option<()> {
    packet.clear();
    let mut at = 0;
    while at < stuffed.len() {
        let code = usize::from(stuffed[at]);
        if code == 0 {
            return None;
        }
        packet.extend_from_slice(stuffed.get(at + 1..at + code)?);
        at += code;
        if code < 255 && at < stuffed.len() {
            packet.push(0);
        }
    }
    Some(())
}

/// Stuffs a packet, with its end.
pub(crate) fn to_cobs(packet: &[u8], out: &mut Vec<u8>) {
    let mut code_at = out.len();
    out.push(1);
    for byte in packet {
        if *byte != 0 {
            out.push(*byte);
            out[code_at] += 1;
        }
        if *byte == 0 || out[code_at] == 255 {
            code_at = out.len();
            out.push(1);
        }
    }
    out.push(0);
}

/// Undoes SLIP; `None` for an escape of nothing.
pub(crate) fn from_slip(stuffed: &[u8], packet: &mut Vec<u8>) -> Option<()> {
    packet.clear();
    let mut bytes = stuffed.iter();
    while let Some(byte) = bytes.next() {
        packet.push(match *byte {
            SLIP_ESCAPE => match *bytes.next()? {
                SLIP_ESCAPED_END => SLIP_END,
                SLIP_ESCAPED_ESCAPE => SLIP_ESCAPE,
                _ => return None,
            },
            byte => byte,
        });
    }
    Some(())
}

/// Writes a packet in SLIP, with an end before and behind it.
pub(super) fn to_slip(packet: &[u8], out: &mut Vec<u8>) {
    out.push(SLIP_END);
    for byte in packet {
        match *byte {
            SLIP_END => out.extend_from_slice(&[SLIP_ESCAPE, SLIP_ESCAPED_END]),
            SLIP_ESCAPE => out.extend_from_slice(&[SLIP_ESCAPE, SLIP_ESCAPED_ESCAPE]),
            byte => out.push(byte),
        }
    }
    out.push(SLIP_END);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn stuffing_is_undone(packet in prop::collection::vec(any::<u8>(), 0..700)) {
            let (mut wire, mut back) = (Vec::new(), Vec::new());
            to_cobs(&packet, &mut wire);
            prop_assert!(!wire[..wire.len() - 1].contains(&0));
            prop_assert!(from_cobs(&wire[..wire.len() - 1], &mut back).is_some());
            prop_assert_eq!(&back, &packet);
            wire.clear();
            to_slip(&packet, &mut wire);
            prop_assert!(from_slip(&wire[1..wire.len() - 1], &mut back).is_some());
            prop_assert_eq!(&back, &packet);
        }

        #[test]
        fn any_bytes_are_refused_or_read(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            let mut packet = Vec::new();
            let _ = from_cobs(&bytes, &mut packet);
            prop_assert!(packet.len() <= bytes.len());
            let _ = from_slip(&bytes, &mut packet);
            prop_assert!(packet.len() <= bytes.len());
        }
    }
}
