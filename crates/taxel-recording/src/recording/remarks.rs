//! What the comments of raw channels say of the channels.

use std::io::BufRead;

use super::lines::{Lines, number, quote};
use super::units;
use crate::frame::{Quantity, SignalUnit, Stream};
use taxel_ground::InputError;

/// What stood in comments such as `# pitch = 1.27 mm`.
#[derive(Debug, Clone, Default)]
pub(super) struct Remarks {
    /// Spacing of rows and of columns, m.
    pitch: Option<[f64; 2]>,
    /// What one raw unit is: a number and its unit.
    scale: Option<(f64, SignalUnit)>,
    quantity: Option<Quantity>,
    /// A number and its unit.
    threshold: Option<(f64, SignalUnit)>,
    /// True if a whole file has a mark at its end.
    pub(super) end_is_marked: bool,
}

/// Keys of a comment that says something, with what may stand behind them.
/// What one number of a file may be, Pa or N.
const UNIT: std::ops::RangeInclusive<f64> = 1e-9..=1e12;
const KEYS: [(&str, &str); 4] = [
    (
        "pitch",
        "a length above 0, up to 1 m, such as `1.27 mm`, or that of rows and of columns: `5 mm x 7 mm`",
    ),
    (
        "unit",
        "what one of the file's numbers is: a number and a unit of pressure or force, from 1 nPa or 1 nN to 1 TPa or 1 TN, such as `0.35 kPa`",
    ),
    (
        "quantity",
        "the quantity of the unit in the header: pressure, force, capacitance, counts or raw",
    ),
    (
        "threshold",
        "a number of 0 or more with a unit of the channels, such as `2 kPa`; readings up to it are noise",
    ),
];

impl Remarks {
    /// Reads a comment line; most say nothing to a program.
    pub(super) fn read<R: BufRead>(&mut self, lines: &Lines<R>) -> Result<(), InputError> {
        let line = lines.text();
        // A spreadsheet may have put quotes around it, and separators behind it.
        let text = line.trim().trim_matches('"').trim_start_matches('#');
        let text = text.trim_end_matches([',', ';', '\t']).trim_matches('"');
        let Some((key, value)) = text.split_once('=') else {
            return Ok(());
        };
        // Written by this program alone; others may mean something else by it.
        self.end_is_marked |= key.trim() == "end" && value.trim() == "marked";
        let Some((key, allowed)) = KEYS.iter().find(|(known, _)| *known == key.trim()) else {
            return Ok(());
        };
        let value = value.trim();
        if self.take(key, value).is_none() {
            let message = format!("{} is not allowed here; allowed is {allowed}", quote(value));
            return Err(lines.error_at(value, message).key(*key));
        }
        Ok(())
    }

    fn take(&mut self, key: &str, value: &str) -> Option<()> {
        match key {
            "pitch" => self.pitch = Some(pitch(value)?),
            "unit" => {
                let forces = |unit: &SignalUnit| {
                    matches!(unit.quantity, Quantity::Pressure | Quantity::Force)
                };
                let found = amount(value).filter(|(size, unit)| {
                    UNIT.contains(&(size * unit.si_per_unit)) && forces(unit)
                });
                self.scale = Some(found?);
            }
            "quantity" => self.quantity = Some(Quantity::named(value)?),
            _ => self.threshold = Some(amount(value).filter(|(size, _)| *size >= 0.0)?),
        }
        Some(())
    }

    /// Completes a stream of which the header is known, and returns the SI value of one of
    /// the file's numbers.
    pub(super) fn complete(&self, stream: &mut Stream) -> Result<f64, String> {
        stream.pitch = self.pitch;
        let mut si_per_number = stream.unit.si_per_unit;
        if let Some((size, unit)) = &self.scale {
            if !matches!(stream.unit.quantity, Quantity::Raw | Quantity::Counts) {
                return Err(format!(
                    "a comment says `unit =`, but the channels are in {} already; remove one of the two",
                    stream.unit.symbol
                ));
            }
            si_per_number = size * unit.si_per_unit;
            stream.unit = unit.clone();
        }
        let quantity = stream.unit.quantity;
        if let Some(said) = self.quantity.filter(|said| *said != quantity) {
            return Err(format!(
                "a comment says that the quantity is {}, but {} is a unit of {}",
                said.name(),
                stream.unit.symbol,
                quantity.name()
            ));
        }
        if let Some((size, unit)) = &self.threshold {
            if unit.quantity != quantity {
                return Err(format!(
                    "a comment gives a threshold in {}, but the channels are in {}",
                    unit.symbol, stream.unit.symbol
                ));
            }
            stream.threshold = Some(size * unit.si_per_unit);
        }
        Ok(si_per_number)
    }
}

/// A length, or that of rows and of columns, m.
fn pitch(text: &str) -> Option<[f64; 2]> {
    let mut sides = text.split(['x', '×']).map(str::trim);
    let [first, second] = [sides.next(), sides.next()];
    let length = |text: &str| {
        let (size, unit) = parted(text)?;
        super::spacing(size, units::length(unit)?)
    };
    let first = length(first?)?;
    let second = second.map_or(Some(first), length)?;
    sides.next().is_none().then_some([first, second])
}

fn amount(text: &str) -> Option<(f64, SignalUnit)> {
    let (size, unit) = parted(text)?;
    let unit = units::find(unit)?;
    (size * unit.si_per_unit)
        .is_finite()
        .then_some((size, unit))
}

/// Number and unit of `1.27 mm`.
fn parted(text: &str) -> Option<(f64, &str)> {
    let (size, unit) = text.split_once(char::is_whitespace)?;
    Some((number(&size.replace(',', "."))?, unit.trim()))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a panic is how a test fails")]
mod tests {
    use super::super::{ChannelWriter, Recording};
    use crate::frame::{Quantity, Stream};

    fn stream(comments: &str, unit: &str) -> Result<(Stream, f64), String> {
        let text = format!("{comments}\ntime [s],r0c0 [{unit}],r0c1 [{unit}]\n0,2,3\n");
        let mut recording =
            Recording::open("map.csv", text.as_bytes()).map_err(|error| error.to_string())?;
        let stream = recording.stream().clone();
        let frame = recording.next().unwrap().unwrap();
        Ok((stream, frame.values[0]))
    }

    #[test]
    fn comments_say_what_the_channels_are() {
        let (map, value) = stream("# pitch = 1.27 mm\n# threshold = 2 kPa", "kPa").unwrap();
        assert_eq!(map.pitch, Some([1.27e-3, 1.27e-3]));
        assert_eq!((map.threshold, value), (Some(2e3), 2e3));
        let (map, value) = stream(
            "\"# pitch = 5,08 mm x 0.762 cm\",,\n# unit = 0.35 kPa,,",
            "raw",
        )
        .unwrap();
        assert_eq!(map.pitch, Some([5.08e-3, 7.62e-3]));
        assert_eq!((map.unit.quantity, value), (Quantity::Pressure, 700.0));
        let (map, value) = stream("# quantity = force\n# by hand = yes\n# pitch 3", "mN").unwrap();
        assert_eq!((map.unit.quantity, value), (Quantity::Force, 2e-3));
        assert_eq!(map.pitch, None);
    }

    #[test]
    fn a_comment_that_cannot_be_meant_is_named() {
        for (comments, unit, part) in [
            ("# pitch = 5", "kPa", "map.csv:1:"),
            ("# pitch = 5 mm x 5 mm x 5 mm", "kPa", "1.27 mm"),
            ("# pitch = -5 mm", "kPa", "above 0"),
            ("# pitch = 2 m", "kPa", "up to 1 m"),
            ("# unit = 0 kPa", "raw", "from 1 nPa"),
            ("# unit = 1e-320 kPa", "raw", "from 1 nPa"),
            ("# unit = 1e300 kPa", "raw", "to 1 TPa"),
            ("# unit = 3 pF", "raw", "pressure or force"),
            ("# unit = 3 kPa", "kPa", "in kPa already"),
            ("# quantity = warmth", "kPa", "capacitance"),
            ("# quantity = force", "kPa", "a unit of pressure"),
            ("# threshold = -1 kPa", "kPa", "0 or more"),
            ("# threshold = 1 mN", "kPa", "in mN"),
        ] {
            let error = stream(comments, unit).unwrap_err();
            assert!(error.contains(part), "{comments}: {error}");
        }
    }

    #[test]
    fn a_written_stream_keeps_its_pitch_and_threshold() {
        let (map, _) = stream(
            "# pitch = 5 mm x 7.1 mm\n# unit = 0.35 psi\n# threshold = 2 kPa",
            "raw",
        )
        .unwrap();
        let writer = ChannelWriter::new(Vec::new(), &map, &[]).unwrap();
        let written = writer.into_inner();
        let again = Recording::open("map.csv", written.as_slice()).unwrap();
        assert_eq!(again.stream(), &map);
    }
}
