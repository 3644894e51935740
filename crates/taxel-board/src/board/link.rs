//! How a board is connected.

use schemars::JsonSchema;
use serde::Deserialize;
use taxel_ground::quantity::{self, FrameRate, NonNegativeTime, PositiveTime};

use crate::pattern::Sent;

/// How a board is connected. The port itself is given on the command line: it differs from
/// machine to machine.
#[derive(Debug, Clone, PartialEq, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Link {
    /// A serial port.
    pub serial: Option<Serial>,
    /// TCP, UDP, a pipe or a program.
    pub network: Option<Network>,
    /// Smallest and largest time from a reading to the arrival of its last byte that the path
    /// has at least; stamps that go one way cannot show it. Default: not known.
    #[serde(deserialize_with = "delay")]
    #[schemars(with = "Option<[quantity::Checked<NonNegativeTime>; 2]>")]
    pub delay: Option<[f64; 2]>,
}

/// A serial port.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "keys of a file, each with its own name"
)]
pub struct Serial {
    /// Bits per second: 8 data bits, no parity, 1 stop bit.
    #[serde(deserialize_with = "baud")]
    pub baud: u32,
    /// Whether the port is USB itself, so that the bits per second mean nothing.
    #[serde(default)]
    pub native_usb: bool,
    /// USB devices that this board may be; `--source serial:auto` looks for them.
    #[serde(default)]
    pub usb: Vec<Usb>,
    /// Sent after each connect.
    #[serde(default)]
    pub start: Option<Sent>,
    /// Sent at the end.
    #[serde(default)]
    pub stop: Option<Sent>,
    /// What a board that must be asked is sent.
    #[serde(default)]
    pub poll: Option<Poll>,
    /// State of the line DTR; default set.
    #[serde(default = "set")]
    pub dtr: bool,
    /// State of the line RTS; default set.
    #[serde(default = "set")]
    pub rts: bool,
    /// Whether opening the port restarts the board.
    #[serde(default)]
    pub reset_on_open: bool,
}

/// TCP, UDP, a pipe or a program.
#[derive(Debug, Clone, PartialEq, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Network {
    /// Sent after each connect.
    pub start: Option<Sent>,
    /// Sent at the end.
    pub stop: Option<Sent>,
    /// What a board that must be asked is sent.
    pub poll: Option<Poll>,
}

/// One USB device; each key that is given must fit.
#[derive(Debug, Clone, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Usb {
    /// Vendor: its name, or its number such as `0x2341`.
    pub vendor: Option<UsbName>,
    /// Product: its name, or its number.
    pub product: Option<UsbName>,
    /// Serial number.
    pub serial: Option<String>,
}

/// Name or number of a USB vendor or product.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(from = "NameOrNumber")]
#[schemars(with = "NameOrNumber")]
pub enum UsbName {
    /// Text that the device gives.
    Name(String),
    /// 16-bit number.
    Number(u16),
}

#[derive(Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "a name is needed here, or a number from 0 to 0xffff such as \"0x2341\""
)]
enum NameOrNumber {
    Number(u16),
    Name(String),
}

impl From<NameOrNumber> for UsbName {
    fn from(given: NameOrNumber) -> Self {
        match given {
            NameOrNumber::Number(number) => Self::Number(number),
            NameOrNumber::Name(name) => {
                let digits = name.strip_prefix("0x");
                match digits.and_then(|digits| u16::from_str_radix(digits, 16).ok()) {
                    Some(number) => Self::Number(number),
                    None => Self::Name(name),
                }
            }
        }
    }
}

/// Bytes that a board is sent again and again.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Poll {
    /// The bytes.
    pub send: Sent,
    /// Time between two.
    #[serde(deserialize_with = "quantity::one::<PositiveTime, _>")]
    #[schemars(with = "quantity::Checked<PositiveTime>")]
    pub every: f64,
}

fn set() -> bool {
    true
}

fn baud<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    let baud = u32::deserialize(deserializer)?;
    if (50..=50_000_000).contains(&baud) {
        Ok(baud)
    } else {
        let message = format!("{baud} is out of range: must be at least 50 and at most 50000000");
        Err(serde::de::Error::custom(message))
    }
}

fn delay<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Option<[f64; 2]>, D::Error> {
    let [least, most] = quantity::list::<2, NonNegativeTime, D>(deserializer)?;
    if least <= most {
        Ok(Some([least, most]))
    } else {
        let message = "the smallest delay comes first and is at most the largest";
        Err(serde::de::Error::custom(message))
    }
}

/// Nominal rate of frames, Hz.
pub(super) fn rate<'de, D: serde::Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<f64>, D::Error> {
    quantity::one::<FrameRate, D>(deserializer).map(Some)
}
