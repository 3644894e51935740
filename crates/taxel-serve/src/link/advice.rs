//! What bytes that are no packets look like. No I/O.

use super::wire::Decode;

/// One line for the operator about bytes that do not decode.
pub(crate) fn garbled(sample: &[u8], decoder: &dyn Decode, baud: Option<u32>) -> String {
    if !decoder.question().is_empty() {
        return "the board was connected again and has not said its hello since: its frames are not read before".into();
    }
    if let Some(remark) = decoder.remark() {
        return remark;
    }
    let others = decoder.others(sample);
    if !others.is_empty() {
        let names = others.join(" or ");
        return format!(
            "bytes, but no packet of this board; they fit the board {names}: give --board {names}"
        );
    }
    let share = |is: &dyn Fn(u8) -> bool| {
        sample.iter().filter(|byte| is(**byte)).count() as f64 / sample.len().max(1) as f64
    };
    let text = share(&|byte| matches!(byte, b' '..=b'~' | b'\r' | b'\n' | b'\t'));
    if text > 0.95 && !decoder.expects_text() {
        let line = String::from_utf8_lossy(sample);
        let line = line.lines().rev().nth(1).unwrap_or_default();
        let shown: String = line.chars().filter(|c| !c.is_control()).take(60).collect();
        return format!("text arrives where the board file describes binary packets: \"{shown}\"");
    }
    // A wrong rate merges bits into long runs of one level, and into invalid stop bits.
    let levels = share(&|byte| matches!(byte, 0x00 | 0xff | 0x80 | 0xf8 | 0xe0 | 0xfe | 0xc0));
    let high = share(&|byte| byte >= 0x80);
    let wrong_rate = if decoder.expects_text() {
        high > 0.2
    } else {
        levels > 0.4
    };
    if let (Some(baud), true) = (baud, wrong_rate) {
        return format!(
            "bytes, but no packet; they look like a wrong baud rate: the board file says {baud} baud; compare with the firmware"
        );
    }
    if decoder.expects_text() && text < 0.7 {
        return "binary bytes arrive where the board file describes lines of text".into();
    }
    "bytes, but no packet: compare length, marks and check of the board file with the firmware"
        .into()
}

#[cfg(test)]
mod tests {
    use taxel::acquisition::Frame;

    use super::*;
    use crate::link::WireCounts;

    struct Nothing {
        text: bool,
    }

    impl Decode for Nothing {
        fn push(&mut self, _: &[u8], _: u64) {}
        fn next(&mut self) -> Option<Frame> {
            None
        }
        fn reconnected(&mut self) {}
        fn counts(&self) -> WireCounts {
            WireCounts::default()
        }
        fn board(&self) -> String {
            "test".into()
        }
        fn wire_class(&self) -> char {
            'A'
        }
        fn expects_text(&self) -> bool {
            self.text
        }
        fn others(&self, sample: &[u8]) -> Vec<String> {
            let known = sample.starts_with(b"U");
            known.then(|| "other".into()).into_iter().collect()
        }
    }

    #[test]
    fn the_advice_says_what_the_bytes_look_like() {
        let advice = |sample: &[u8], text, baud| garbled(sample, &Nothing { text }, baud);
        assert!(advice(b"U123", false, None).contains("--board other"));
        let text = advice(b"c1 12.5\r\nc2 13.5\r\nc", false, None);
        assert!(text.contains("\"c2 13.5\""), "{text}");
        let wrong = advice(&[0x00, 0xff, 0xf8, 0x00, 0x12], false, Some(9600));
        assert!(wrong.contains("9600 baud"), "{wrong}");
        assert!(advice(&[1, 2, 3, 4, 5], true, None).contains("lines of text"));
        assert!(advice(&[1, 2, 3, 4, 5], false, Some(9600)).contains("length, marks"));
    }
}
