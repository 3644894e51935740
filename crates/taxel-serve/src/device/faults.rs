//! Faults of a virtual device, as its file describes them.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
use taxel::quantity::{
    self, FREQUENCY, Fraction, NonNegativeTime, PositiveTime, Ratio, RelativeError,
};
use taxel::{InputError, toml_input};

/// Faults of a virtual device; without any it is faultless.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Faults {
    pub(super) wire: WireFaults,
    pub(super) frames: FrameFaults,
    pub(super) time: TimeFaults,
    pub(super) link: LinkFaults,
}

/// Faults of bytes.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct WireFaults {
    /// Probability that one bit of a byte is wrong.
    #[serde(deserialize_with = "quantity::one::<Fraction, _>")]
    pub(super) flip: f64,
    /// Probability that a byte is missing.
    #[serde(deserialize_with = "quantity::one::<Fraction, _>")]
    pub(super) drop: f64,
    /// Probability that a random byte follows a byte.
    #[serde(deserialize_with = "quantity::one::<Fraction, _>")]
    pub(super) insert: f64,
    /// Stretches of random bytes.
    pub(super) burst: Option<Burst>,
}

/// A stretch of random bytes.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Burst {
    /// How often, Hz.
    #[serde(deserialize_with = "occurrences")]
    pub(super) rate: f64,
    /// How long.
    #[serde(deserialize_with = "some_bytes")]
    pub(super) bytes: usize,
}

/// Faults of frames, as probabilities.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct FrameFaults {
    /// It is not sent.
    #[serde(deserialize_with = "quantity::one::<Fraction, _>")]
    pub(super) lose: f64,
    /// It is sent twice.
    #[serde(deserialize_with = "quantity::one::<Fraction, _>")]
    pub(super) repeat: f64,
    /// It is sent after the next one.
    #[serde(deserialize_with = "quantity::one::<Fraction, _>")]
    pub(super) swap: f64,
    /// Its number is wrong.
    #[serde(deserialize_with = "quantity::one::<Fraction, _>")]
    pub(super) bad_counter: f64,
}

/// Faults of times.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct TimeFaults {
    /// The clock of the device runs fast by this share.
    #[serde(deserialize_with = "quantity::one::<RelativeError, _>")]
    pub(super) rate_error: f64,
    /// Standard deviation of the change of that share in one second.
    #[serde(deserialize_with = "quantity::one::<Ratio, _>")]
    pub(super) wander: f64,
    /// Delay of packets on their way.
    pub(super) jitter: Option<Jitter>,
    /// Times in which nothing is sent, and what was held back then comes at once.
    pub(super) pause: Option<Pause>,
    /// Most bytes of one write.
    #[serde(deserialize_with = "some_bytes_or_none")]
    pub(super) chunks: Option<usize>,
}

/// Delay of packets on their way.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum Jitter {
    /// Sent with the next frame of the bus, which come in this distance, s.
    Usb(#[serde(deserialize_with = "quantity::one::<PositiveTime, _>")] f64),
    /// Held back until this time has passed or 62 bytes are there, s.
    Ftdi(#[serde(deserialize_with = "quantity::one::<PositiveTime, _>")] f64),
    /// Exponential of this mean, and one packet in fifty ten times as long, s.
    Wifi(#[serde(deserialize_with = "quantity::one::<PositiveTime, _>")] f64),
    /// Exponential of this mean, s.
    Exponential(#[serde(deserialize_with = "quantity::one::<PositiveTime, _>")] f64),
}

/// Times in which nothing is sent.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Pause {
    /// How often, Hz.
    #[serde(deserialize_with = "occurrences")]
    pub(super) rate: f64,
    /// Shortest and longest, s.
    #[serde(deserialize_with = "quantity::list::<2, NonNegativeTime, _>")]
    pub(super) of: [f64; 2],
}

/// Faults of the connection.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct LinkFaults {
    /// Times in which it is unplugged.
    pub(super) leave: Vec<Leave>,
    /// Text that is sent after each connect.
    pub(super) banner: String,
    /// Whether the first packet after each connect is cut.
    pub(super) half_packet_first: bool,
    /// Whether the bytes are those of a wrong baud rate.
    pub(super) wrong_baud: bool,
    /// From when on the device hangs: the port is there, and nothing comes.
    pub(super) stuck: Option<Stuck>,
}

/// A time without the device.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Leave {
    /// When it is unplugged, s from the start.
    #[serde(deserialize_with = "quantity::one::<NonNegativeTime, _>")]
    pub(super) at: f64,
    /// For how long, s.
    #[serde(rename = "for", deserialize_with = "quantity::one::<PositiveTime, _>")]
    pub(super) duration: f64,
}

/// When the device hangs.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Stuck {
    /// From when on, s from the start.
    #[serde(deserialize_with = "quantity::one::<NonNegativeTime, _>")]
    pub(super) at: f64,
}

/// Most bytes of a burst and of a write.
const MOST_BYTES: u64 = 1 << 20;
/// Longest text after a connect, bytes.
const LONGEST_BANNER: usize = 4096;

impl Faults {
    /// Reads a file of faults; `file` is its name for messages.
    ///
    /// # Errors
    /// The first mistake with its place.
    pub fn parse(file: &str, text: &str) -> Result<Self, InputError> {
        let faults: Self = toml_input::parse_up_to(toml_input::LARGEST, file, text)?;
        match faults.mistake() {
            None => Ok(faults),
            Some((path, message, help)) => {
                let path: Vec<&str> = path.split('.').collect();
                Err(toml_input::at_key(file, text, &path, &message, help))
            }
        }
    }

    /// The first rule between keys that is broken: its key, the message and what to do.
    fn mistake(&self) -> Option<(String, String, &'static str)> {
        if let Some([from, to]) = self.time.pause.map(|pause| pause.of)
            && from > to
        {
            let message =
                format!("the shortest pause, {from} s, is longer than the longest, {to} s");
            return Some((
                "time.pause.of".into(),
                message,
                "give the shorter one first",
            ));
        }
        if self.link.banner.len() > LONGEST_BANNER {
            let message = format!(
                "the text has {} bytes; at most {LONGEST_BANNER} are sent",
                self.link.banner.len()
            );
            return Some(("link.banner".into(), message, "give a shorter text"));
        }
        let wire = &self.wire;
        if wire.flip + wire.drop > 1.0 {
            let message = "flip and drop together are above 1".into();
            return Some(("wire.drop".into(), message, "make one of them smaller"));
        }
        let mut end = 0.0;
        for (i, leave) in self.link.leave.iter().enumerate() {
            if leave.at < end {
                let message = format!(
                    "it is unplugged at {} s, before it is back from the time before at {end} s",
                    leave.at
                );
                let path = format!("link.leave.{i}.at");
                return Some((path, message, "order the times, without overlap"));
            }
            end = leave.at + leave.duration;
        }
        None
    }
}

/// How often something happens: `"0.1 Hz"`, or as a fraction `"1/30 Hz"`.
fn occurrences<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    let text = String::deserialize(deserializer)?;
    let rate = match text.split_once('/') {
        None => FREQUENCY.parse(&text),
        Some((above, below)) => fraction(above, below).ok_or_else(|| {
            format!("\"{text}\" is no frequency; write one such as \"0.1 Hz\" or \"1/30 Hz\"")
        }),
    };
    match rate {
        Ok(rate) if (1e-6..=1e6).contains(&rate) => Ok(rate),
        Ok(_) => Err(D::Error::custom(format!(
            "\"{text}\" is out of range: must be from 1e-6 Hz to 1 MHz"
        ))),
        Err(message) => Err(D::Error::custom(message)),
    }
}

fn fraction(above: &str, below: &str) -> Option<f64> {
    let below = below.trim();
    let (number, unit) = below.split_once(' ')?;
    let (above, below): (f64, f64) = (above.trim().parse().ok()?, number.parse().ok()?);
    let rate = above / below * FREQUENCY.unit(unit.trim())?;
    rate.is_finite().then_some(rate)
}

fn some_bytes<'de, D: Deserializer<'de>>(deserializer: D) -> Result<usize, D::Error> {
    match u64::deserialize(deserializer)? {
        bytes @ 1..=MOST_BYTES => Ok(bytes as usize),
        bytes => Err(D::Error::custom(format!(
            "{bytes} is out of range: must be from 1 to {MOST_BYTES} bytes"
        ))),
    }
}

fn some_bytes_or_none<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<usize>, D::Error> {
    some_bytes(deserializer).map(Some)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: &str = r#"
[wire]
flip = 1e-4
drop = 1e-5
insert = 1e-5
burst = { rate = "0.1 Hz", bytes = 200 }
[frames]
lose = 1e-3
repeat = 1e-4
swap = 1e-4
bad_counter = 1e-4
[time]
rate_error = 60e-6
wander = 1e-8
jitter = { usb = "1 ms" }
pause = { rate = "1/30 Hz", of = ["50 ms", "500 ms"] }
chunks = 62
[link]
leave = [{ at = "10 s", for = "3 s" }]
banner = "Ready\r\n"
half_packet_first = true
wrong_baud = false
stuck = { at = "20 s" }
"#;

    #[test]
    fn every_fault_can_be_described() {
        let faults = Faults::parse("faults.toml", ALL).unwrap();
        assert_eq!(faults.time.pause.unwrap().rate, 1.0 / 30.0);
        assert_eq!(faults.time.jitter, Some(Jitter::Usb(1e-3)));
        assert_eq!(faults.link.leave[0].duration, 3.0);
        assert_eq!(Faults::parse("none.toml", "").unwrap(), Faults::default());
    }

    #[test]
    fn mistakes_are_shown_under_their_word() {
        for (from, to, expected) in [
            ("flip = 1e-4", "flip = 2.0", "at most 1"),
            ("flip = 1e-4", "flop = 2.0", "flop"),
            ("\"1/30 Hz\"", "\"1/30\"", "1/30 Hz"),
            ("\"0.1 Hz\"", "\"0.1 s\"", "frequency"),
            (
                "[\"50 ms\", \"500 ms\"]",
                "[\"5 s\", \"500 ms\"]",
                "shorter one first",
            ),
            ("chunks = 62", "chunks = 0", "1 to 1048576"),
            ("{ usb = \"1 ms\" }", "{ bus = \"1 ms\" }", "usb"),
        ] {
            let text = ALL.replace(from, to);
            let message = Faults::parse("faults.toml", &text).unwrap_err().to_string();
            assert!(
                message.contains(expected) && message.contains('^'),
                "{message}"
            );
        }
    }
}
