//! XDF, as LabRecorder writes it: streams of the lab streaming layer with the offsets of their
//! clocks.

use super::bytes::Bytes;
use super::definition::Number;
use super::{Channel, Container, Fault, Part, Rows, Series, Times};
use crate::frame::SignalUnit;

/// Bytes before the first chunk.
const MAGIC: u64 = 4;

/// Numbers of chunks by their content.
const STREAM_HEAD: u16 = 2;
const SAMPLES: u16 = 3;
const CLOCK_OFFSET: u16 = 4;

#[derive(Debug)]
struct XdfFile {
    bytes: Bytes,
    streams: Vec<Stream>,
    parts: Vec<Part>,
    cut: Option<String>,
}

#[derive(Debug, Default)]
struct Stream {
    number: u32,
    channels: usize,
    format: Option<Number>,
    rate: f64,
    labels: Vec<(String, String)>,
    /// Time of this stream's clock and what is to be added to it, s, with their place in the file.
    offsets: Vec<(u64, [f64; 2])>,
    /// Offset and length of the samples of each chunk.
    chunks: Vec<(u64, u64)>,
}

/// A number of 1, 4 or 8 bytes behind the byte that says so; and their number.
fn length(bytes: &[u8]) -> Option<(u64, u64)> {
    let size = usize::from(*bytes.first()?);
    if ![1, 4, 8].contains(&size) {
        return None;
    }
    let mut whole = [0; 8];
    whole[..size].copy_from_slice(bytes.get(1..=size)?);
    Some((u64::from_le_bytes(whole), 1 + size as u64))
}

/// The text of the first element of this name.
fn element<'a>(xml: &'a str, name: &str) -> Option<&'a str> {
    let (_, rest) = xml.split_once(&format!("<{name}>"))?;
    rest.split_once(&format!("</{name}>"))
        .map(|(text, _)| text.trim())
}

pub(super) fn open(mut bytes: Bytes) -> Result<Box<dyn Container>, Fault> {
    let mut streams: Vec<Stream> = Vec::new();
    let mut parts: Vec<Part> = Vec::new();
    let (mut at, mut cut) = (MAGIC, None);
    while at < bytes.length() {
        let ends = || Some("the file ends inside a chunk: it was cut or not finished".to_owned());
        let head = bytes.get(at, 9.min(bytes.length() - at))?.and_then(length);
        let Some((size, head)) = head else {
            cut = ends();
            break;
        };
        let begin = at + head;
        let end = begin
            .checked_add(size)
            .filter(|end| *end <= bytes.length() && size >= 2);
        let (Some(end), Some(tag)) = (end, bytes.array::<2>(begin)?) else {
            cut = ends();
            break;
        };
        at = end;
        let content = begin + 2;
        let tag = u16::from_le_bytes(tag);
        if ![STREAM_HEAD, SAMPLES, CLOCK_OFFSET].contains(&tag) || size < 6 {
            continue;
        }
        let Some(number) = bytes.array::<4>(content)?.map(u32::from_le_bytes) else {
            continue;
        };
        let known = streams.iter().position(|stream| stream.number == number);
        match (tag, known) {
            (STREAM_HEAD, None) => {
                let xml = bytes.get(content + 4, size - 6)?.unwrap_or_default();
                let (stream, part) = stream(number, &String::from_utf8_lossy(xml));
                streams.push(stream);
                parts.push(part);
            }
            (SAMPLES, Some(known)) => {
                let room = 9.min(end - content - 4);
                let count = bytes.get(content + 4, room)?.and_then(length);
                if let Some((count, head)) = count {
                    parts[known].count += count;
                    let samples = content + 4 + head;
                    streams[known].chunks.push((samples, end - samples));
                }
            }
            (CLOCK_OFFSET, Some(known)) => {
                if let (Some(time), Some(offset)) = (
                    bytes.array::<8>(content + 4)?,
                    bytes.array::<8>(content + 12)?,
                ) {
                    let pair = [time, offset].map(f64::from_le_bytes);
                    if pair.iter().all(|number| number.is_finite()) {
                        streams[known].offsets.push((content, pair));
                    }
                }
            }
            _ => {}
        }
    }
    let mut names = std::collections::HashSet::new();
    for (part, stream) in parts.iter_mut().zip(&streams) {
        if !names.insert(part.name.clone()) {
            part.name = format!("{} {}", part.name, stream.number);
        }
    }
    Ok(Box::new(XdfFile {
        bytes,
        streams,
        parts,
        cut,
    }))
}

fn stream(number: u32, xml: &str) -> (Stream, Part) {
    let text = |name: &str| element(xml, name).unwrap_or_default();
    let format = text("channel_format");
    let channels = text("channel_count").parse().unwrap_or(0);
    let rate = text("nominal_srate")
        .parse::<f64>()
        .ok()
        .filter(|rate| rate.is_finite() && *rate > 0.0);
    let number_of = match format {
        "int8" => Some(Number::Signed(1)),
        "int16" => Some(Number::Signed(2)),
        "int32" => Some(Number::Signed(4)),
        "int64" => Some(Number::Signed(8)),
        "float32" => Some(Number::Float(4)),
        "double64" => Some(Number::Float(8)),
        _ => None,
    };
    let mut labels = Vec::new();
    let mut rest = element(xml, "channels").unwrap_or_default();
    while let Some((_, after)) = rest.split_once("<channel>") {
        let (channel, next) = after.split_once("</channel>").unwrap_or((after, ""));
        let part = |name: &str| element(channel, name).unwrap_or_default().to_owned();
        labels.push((part("label"), part("unit")));
        rest = next;
    }
    let part = Part {
        name: match text("name") {
            "" => format!("stream {number}"),
            name => name.to_owned(),
        },
        kind: format!("{} {format} x {channels}", text("type"))
            .trim()
            .to_owned(),
        count: 0,
        rate,
        unread: match (number_of, channels) {
            (None, _) => Some(format!("its samples are {format}, no numbers")),
            (_, 0) => Some("it has no channels".into()),
            _ => None,
        },
    };
    let stream = Stream {
        number,
        channels,
        format: number_of,
        rate: rate.unwrap_or(0.0),
        labels,
        ..Stream::default()
    };
    (stream, part)
}

/// A stretch in which the clock of the sender ran on: the line by least squares through its
/// offsets.
#[derive(Debug, Clone, PartialEq)]
struct Segment {
    /// Where its first offset stands in the file.
    at: u64,
    /// First and last time of its offsets, s.
    range: [f64; 2],
    /// Mean time, offset there and slope.
    line: [f64; 3],
}

impl Segment {
    /// The segments of offsets. A clock was reset where its time goes back, or where the offset
    /// changes by more than the time that passed.
    fn all(offsets: &[(u64, [f64; 2])]) -> Vec<Self> {
        let runs_on = |one: &(u64, [f64; 2]), next: &(u64, [f64; 2])| {
            let [time, offset] = [0, 1].map(|of| next.1[of] - one.1[of]);
            time >= 0.0 && offset.abs() <= time.abs()
        };
        offsets.chunk_by(runs_on).map(Self::of).collect()
    }

    fn of(offsets: &[(u64, [f64; 2])]) -> Self {
        let mean = |of: usize| {
            offsets.iter().map(|(_, pair)| pair[of]).sum::<f64>() / offsets.len() as f64
        };
        let means = [mean(0), mean(1)];
        let sum = |of: usize| {
            let terms = offsets
                .iter()
                .map(|(_, pair)| (pair[0] - means[0]) * (pair[of] - means[of]));
            terms.sum::<f64>()
        };
        let spread = sum(0);
        Self {
            at: offsets[0].0,
            range: [offsets[0].1[0], offsets[offsets.len() - 1].1[0]],
            line: [
                means[0],
                means[1],
                if spread > 0.0 { sum(1) / spread } else { 0.0 },
            ],
        }
    }

    /// How far a time lies out of the segment, s.
    fn distance(&self, time: f64) -> f64 {
        (self.range[0] - time).max(time - self.range[1]).max(0.0)
    }

    fn corrected(&self, time: f64) -> f64 {
        let [origin, offset, slope] = self.line;
        time + offset + slope * (time - origin)
    }
}

/// The time of a sample that stands at a place in the file, in the clock of the recorder: by the
/// segment that its time is in or nearest to, of the last one before that place and its
/// neighbours, as an offset may be measured some seconds after a reset.
fn corrected(segments: &[Segment], at: u64, time: f64) -> f64 {
    let last = segments
        .partition_point(|segment| segment.at <= at)
        .saturating_sub(1);
    let near = segments
        .iter()
        .skip(last.saturating_sub(1))
        .take(if last == 0 { 2 } else { 3 });
    let nearest = near.min_by(|a, b| a.distance(time).total_cmp(&b.distance(time)));
    nearest.map_or(time, |segment| segment.corrected(time))
}

impl Container for XdfFile {
    fn parts(&self) -> &[Part] {
        &self.parts
    }

    fn cut(&self) -> Option<String> {
        self.cut.clone()
    }

    fn open(mut self: Box<Self>, at: usize) -> Result<Series, Fault> {
        let stream = self.streams.swap_remove(at);
        let no_numbers = || Fault::Wrong("its samples are no numbers".into());
        let channels = (0..stream.channels).map(|at| {
            let (label, unit) = stream.labels.get(at).cloned().unwrap_or_default();
            Channel {
                name: if label.is_empty() {
                    format!("channel_{}", at + 1)
                } else {
                    label
                },
                unit: SignalUnit::named(&unit),
            }
        });
        let segments = Segment::all(&stream.offsets);
        let count = stream.offsets.len();
        let clock = match segments.len() {
            0 => "the stamps of the samples, in the clock of the sender: the file has no clock offsets".to_owned(),
            1 => format!("the stamps of the samples, with the line through {count} clock offsets"),
            resets => format!(
                "the stamps of the samples, with the lines through {count} clock offsets between {} resets of the clock",
                resets - 1
            ),
        };
        Ok(Series {
            channels: channels.collect(),
            shape: None,
            times: Times::Own(clock),
            rows: Box::new(Samples {
                segments,
                format: stream.format.ok_or_else(no_numbers)?,
                step: if stream.rate > 0.0 {
                    stream.rate.recip()
                } else {
                    0.0
                },
                channels: stream.channels,
                chunks: stream.chunks.into_iter(),
                bytes: self.bytes,
                left: (0, 0),
                last: 0.0,
            }),
        })
    }
}

/// The samples of a stream as rows.
#[derive(Debug)]
struct Samples {
    bytes: Bytes,
    chunks: std::vec::IntoIter<(u64, u64)>,
    /// Offset and length of what is left of a chunk.
    left: (u64, u64),
    format: Number,
    channels: usize,
    /// Time between samples without a stamp, s.
    step: f64,
    last: f64,
    segments: Vec<Segment>,
}

impl Rows for Samples {
    fn next(&mut self, values: &mut Vec<f64>) -> Result<Option<i128>, Fault> {
        while self.left.1 == 0 {
            match self.chunks.next() {
                Some(next) => self.left = next,
                None => return Ok(None),
            }
        }
        let (at, left) = self.left;
        let cut = || Fault::Wrong("a chunk ends inside a sample".into());
        let stamped = self.bytes.array::<1>(at)?.ok_or_else(cut)?[0];
        let head: u64 = match stamped {
            0 => 1,
            8 => 9,
            _ => {
                return Err(Fault::Wrong(
                    "a stamp has another length than 8 bytes".into(),
                ));
            }
        };
        let size = self.channels as u64 * self.format.size() as u64;
        if head + size > left {
            return Err(cut());
        }
        self.last = match stamped {
            0 => self.last + self.step,
            _ => f64::from_le_bytes(self.bytes.array::<8>(at + 1)?.ok_or_else(cut)?),
        };
        let sample = self.bytes.get(at + head, size)?.ok_or_else(cut)?;
        let numbers = sample.chunks_exact(self.format.size());
        values.extend(numbers.map(|number| self.format.value(number, false)));
        self.left = (at + head + size, left - head - size);
        let time = corrected(&self.segments, at, self.last);
        if !time.is_finite() {
            return Err(Fault::Wrong("the time of a sample is no number".into()));
        }
        Ok(Some((time * 1e9).round() as i128))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A clock that runs on, and one that begins anew after 100 s: each sample has the line of its
    /// own stretch, also one that comes before the first offset behind the reset.
    #[test]
    fn a_clock_that_was_reset_has_a_line_before_and_behind() {
        let run = |from: u32, to: u32, at: u64, offset: f64| {
            let times = (from..=to).step_by(5).map(f64::from);
            let offsets = times
                .enumerate()
                .map(move |(step, time)| (at + step as u64, [time, offset + 1e-4 * time]));
            offsets.collect::<Vec<_>>()
        };
        let steady = Segment::all(&run(0, 100, 0, 7.0));
        let reset = Segment::all(&[run(1000, 1100, 0, 7.0), run(5, 60, 1000, 1107.0)].concat());
        assert_eq!([steady.len(), reset.len()], [1, 2]);
        // Sums of some tens of numbers up to 1e5, each rounded to 1e-16 of it.
        let is = |found: f64, expected: f64| {
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        };
        is(corrected(&steady, 50, 42.0), 42.0 + 7.0 + 42e-4);
        is(corrected(&reset, 10, 1042.0), 1042.0 + 7.0 + 1042e-4);
        is(corrected(&reset, 1005, 42.0), 42.0 + 1107.0 + 42e-4);
        is(corrected(&reset, 999, 2.0), 2.0 + 1107.0 + 2e-4);
        is(corrected(&[], 0, 2.0), 2.0);
    }
}
