//! Marks from a stream of the lab streaming layer, protocol 1.10: the stream is asked for by datagrams, comes
//! over TCP, and its times are corrected by comparing clocks (`LSL:timedata`).
//!
//! Whoever is on the network may answer: every length is bounded, and a time that is far from now is not
//! believed.

use std::io::{self, BufRead as _, BufReader, ErrorKind, Read, Write as _};
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpStream, UdpSocket};
use std::sync::Arc;
use std::sync::mpsc::SyncSender;
use std::time::{Duration, Instant};

use super::cut;
use crate::lsl::{GROUPS, PORT, RANGE, clock, moment};
use crate::pump::{Command, NewMark};
use crate::shared::Shared;

/// Answers to a question are awaited for so long.
const ANSWERS: Duration = Duration::from_millis(500);
/// Time from one question for a stream that is not there to the next, and longest wait for a connection.
const AGAIN: Duration = Duration::from_secs(2);
/// The end of the run is looked at so often.
const NAP: Duration = Duration::from_millis(100);
/// Questions of one comparison of the clocks: the fastest answer counts.
const QUESTIONS: u32 = 8;
/// Longest wait for such an answer.
const LATEST: Duration = Duration::from_millis(200);
/// Time from one comparison to the next.
const COMPARED: Duration = Duration::from_secs(5);
/// Comparisons without an answer after which the other side is taken for gone, where there was one.
const UNANSWERED: u32 = 4;
/// A time further from now is not believed: an outlet keeps samples for six minutes.
const FARTHEST: Duration = Duration::from_mins(6);
/// Longest head of an answer, bytes.
const LONGEST_HEAD: u64 = 16_384;
/// Most channels of a stream of marks; their texts make one mark.
const MOST_CHANNELS: usize = 64;
/// Bytes of a text that are kept; a mark is shorter.
const KEPT: u64 = 4096;
/// Marks in a second; a flood of them would stop the run.
const MOST_MARKS: u32 = 1000;

/// Hands the samples of the stream `name` on as marks, in a thread that ends with the run.
pub(super) fn listen(
    name: String,
    commands: SyncSender<Command>,
    shared: Arc<Shared>,
    told: fn(&str),
) {
    std::thread::spawn(move || {
        let mut inlet = Inlet {
            name,
            commands,
            shared,
            told,
            window: (Instant::now(), 0),
        };
        let mut missed = false;
        while !inlet.shared.stopped() {
            let Some(found) = find(&inlet.name) else {
                if !std::mem::replace(&mut missed, true) {
                    inlet.say("no stream of this name answers; it is looked for until it does");
                }
                inlet.rest(AGAIN);
                continue;
            };
            missed = false;
            match inlet.feed(&found) {
                Err(error) if !inlet.shared.stopped() => {
                    inlet.say(&format!(
                        "the stream of {} has ended ({error}); it is looked for",
                        found.host
                    ));
                    inlet.rest(AGAIN);
                }
                _ => return,
            }
        }
    });
}

/// Form of the values of a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    Text,
    Integer(usize),
    Float(usize),
}

impl Form {
    fn of(name: &str) -> Option<Self> {
        Some(match name {
            "string" => Self::Text,
            "int8" => Self::Integer(1),
            "int16" => Self::Integer(2),
            "int32" => Self::Integer(4),
            "int64" => Self::Integer(8),
            "float32" => Self::Float(4),
            "double64" => Self::Float(8),
            _ => return None,
        })
    }

    /// Reads a value as text.
    fn read(self, bytes: &mut impl Read) -> io::Result<String> {
        Ok(match self {
            Self::Text => {
                let size = usize::from(little(bytes, 1)?.cast_unsigned() as u8);
                if ![1, 2, 4, 8].contains(&size) {
                    return Err(wrong("a text without a length"));
                }
                let length = little(bytes, size)?.cast_unsigned();
                let mut kept = Vec::new();
                bytes.take(length.min(KEPT)).read_to_end(&mut kept)?;
                let rest = length.saturating_sub(KEPT);
                let passed = io::copy(&mut bytes.take(rest), &mut io::sink())?;
                if (kept.len() as u64) < length.min(KEPT) || passed < rest {
                    return Err(ErrorKind::UnexpectedEof.into());
                }
                String::from_utf8_lossy(&kept).into_owned()
            }
            Self::Integer(size) => {
                // Its sign is in the last byte.
                let unused = 64 - 8 * size as u32;
                (little(bytes, size)? << unused >> unused).to_string()
            }
            Self::Float(4) => f32::from_bits(little(bytes, 4)?.cast_unsigned() as u32).to_string(),
            Self::Float(size) => f64::from_bits(little(bytes, size)?.cast_unsigned()).to_string(),
        })
    }
}

/// A number of so many bytes, at most eight, the lowest first.
fn little(bytes: &mut impl Read, size: usize) -> io::Result<i64> {
    let mut number = [0; 8];
    bytes.read_exact(&mut number[..size])?;
    Ok(i64::from_le_bytes(number))
}

fn wrong(what: &str) -> io::Error {
    io::Error::new(ErrorKind::InvalidData, format!("it sends {what}"))
}

/// A stream that answered.
#[derive(Debug, Clone, PartialEq)]
struct Found {
    host: String,
    uid: String,
    form: Form,
    channels: usize,
    /// Time between samples that have no time of their own, s.
    period: f64,
    data: SocketAddr,
    service: SocketAddr,
}

/// Text of an element of an answer.
fn element(xml: &str, name: &str) -> Option<String> {
    let (_, rest) = xml.split_once(&format!("<{name}>"))?;
    let (text, _) = rest.split_once(&format!("</{name}>"))?;
    let signs = [
        ("&lt;", "<"),
        ("&gt;", ">"),
        ("&quot;", "\""),
        ("&apos;", "'"),
        // Last, so that nothing is unescaped twice.
        ("&amp;", "&"),
    ];
    let plain = signs.iter().fold(text.to_owned(), |text, (sign, plain)| {
        text.replace(sign, plain)
    });
    Some(plain)
}

impl Found {
    /// The stream of an answer, if it is one of marks with this name.
    fn of(xml: &str, name: &str, from: IpAddr) -> Option<Self> {
        let number = |name: &str| element(xml, name)?.trim().parse::<f64>().ok();
        let port = |name: &str| element(xml, name)?.trim().parse::<u16>().ok();
        let plain = |text: &String| {
            let sign = |c: char| c.is_ascii_alphanumeric() || "-_.{}".contains(c);
            !text.is_empty() && text.len() <= 64 && text.chars().all(sign)
        };
        let found = Self {
            host: element(xml, "hostname")?.chars().take(64).collect(),
            // It goes back to whoever sent it, in the head of a request.
            uid: element(xml, "uid").filter(plain)?,
            form: Form::of(&element(xml, "channel_format")?)?,
            channels: element(xml, "channel_count")?.trim().parse().ok()?,
            period: number("nominal_srate")
                .filter(|rate| *rate > 0.0)
                .map_or(0.0, f64::recip),
            data: SocketAddr::new(from, port("v4data_port")?),
            service: SocketAddr::new(from, port("v4service_port")?),
        };
        let same = element(xml, "name")? == name;
        (same && (1..=MOST_CHANNELS).contains(&found.channels)).then_some(found)
    }
}

/// The stream that answers to a name, the first of several.
fn find(name: &str) -> Option<Found> {
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).ok()?;
    let port = socket.local_addr().ok()?.port();
    // Answers that nobody asked for have another number.
    let mut number = [0; 8];
    getrandom::fill(&mut number).ok()?;
    let number = u64::from_le_bytes(number);
    let quote = if name.contains('\'') { '"' } else { '\'' };
    let question = format!("LSL:shortinfo\r\nname={quote}{name}{quote}\r\n{port} {number}\r\n");
    let groups = GROUPS.into_iter().map(|group| (group, PORT));
    // Where there is no network of groups, this machine alone.
    let here = std::iter::once(PORT).chain(RANGE);
    let here = here.map(|port| (Ipv4Addr::LOCALHOST, port));
    for to in groups.chain(here) {
        let _ = socket.send_to(question.as_bytes(), to);
    }
    let until = Instant::now() + ANSWERS;
    let mut buffer = vec![0; 1 << 16];
    loop {
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return None;
        }
        socket.set_read_timeout(Some(left)).ok()?;
        let Ok((length, from)) = socket.recv_from(&mut buffer) else {
            continue;
        };
        let text = String::from_utf8_lossy(&buffer[..length]);
        let answer = text
            .split_once("\r\n")
            .filter(|(to, _)| to.trim().parse() == Ok(number));
        if let Some(found) = answer.and_then(|(_, xml)| Found::of(xml, name, from.ip())) {
            return Some(found);
        }
    }
}

/// How far the clock of another machine is ahead of ours, s, by the fastest of some answers; `None` without any.
fn ahead(socket: &UdpSocket) -> Option<f64> {
    let mut best: Option<[f64; 2]> = None;
    for question in 0..QUESTIONS {
        let sent = clock();
        socket
            .send(format!("LSL:timedata\r\n{question} {sent}\r\n").as_bytes())
            .ok()?;
        let mut buffer = [0; 256];
        let until = Instant::now() + LATEST;
        // Answers to earlier questions may come late.
        let answer = loop {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                break None;
            }
            socket.set_read_timeout(Some(left)).ok()?;
            let Ok(length) = socket.recv(&mut buffer) else {
                continue;
            };
            let text = String::from_utf8_lossy(&buffer[..length]);
            let numbers: Vec<f64> = text
                .split_whitespace()
                .filter_map(|word| word.parse().ok())
                .collect();
            match numbers[..] {
                [number, _, arrived, left] if number == f64::from(question) => {
                    break Some([arrived, left]);
                }
                _ => {}
            }
        };
        let back = clock();
        let Some([arrived, left]) = answer else {
            break;
        };
        let round = (back - sent) - (left - arrived);
        let offset = 0.5 * ((arrived - sent) + (left - back));
        if offset.is_finite() && best.is_none_or(|[fastest, _]| round < fastest) {
            best = Some([round, offset]);
        }
    }
    best.map(|[_, offset]| offset)
}

struct Inlet {
    name: String,
    commands: SyncSender<Command>,
    shared: Arc<Shared>,
    told: fn(&str),
    /// Begin of a second, and marks in it.
    window: (Instant, u32),
}

/// Comparisons of the clocks.
struct Comparison {
    socket: UdpSocket,
    last: Option<Instant>,
    ahead: Option<f64>,
    unanswered: u32,
}

impl Comparison {
    /// Compares the clocks when it is time.
    fn look(&mut self) -> io::Result<()> {
        if self.last.is_some_and(|last| last.elapsed() < COMPARED) {
            return Ok(());
        }
        let found = ahead(&self.socket);
        self.last = Some(Instant::now());
        match found {
            Some(_) => (self.ahead, self.unanswered) = (found, 0),
            None => self.unanswered += 1,
        }
        if self.ahead.is_some() && self.unanswered >= UNANSWERED {
            return Err(io::Error::other("it no longer answers"));
        }
        Ok(())
    }
}

/// The bytes of the stream; while none come, the clocks are compared.
struct Bytes<'a> {
    stream: TcpStream,
    shared: &'a Shared,
    clocks: Comparison,
}

impl Read for Bytes<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            self.clocks.look()?;
            match self.stream.read(buffer) {
                Err(error)
                    if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut)
                        && !self.shared.stopped() => {}
                other => return other,
            }
        }
    }
}

impl Inlet {
    fn say(&self, what: &str) {
        (self.told)(&format!("--marks lsl:{}: {what}", self.name));
    }

    /// Waits, with an eye on the end of the run.
    fn rest(&self, time: Duration) {
        let until = Instant::now() + time;
        while Instant::now() < until && !self.shared.stopped() {
            std::thread::sleep(NAP);
        }
    }

    /// Hands the marks of a stream on until it ends, which is an error, or the run does.
    fn feed(&mut self, found: &Found) -> io::Result<()> {
        let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
        socket.connect(found.service)?;
        let mut stream = TcpStream::connect_timeout(&found.data, AGAIN)?;
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(NAP))?;
        stream.set_write_timeout(Some(AGAIN))?;
        let request = format!(
            "LSL:streamfeed/110 {}\r\nNative-Byte-Order: 1234\r\nEndian-Performance: 0\r\nHas-IEEE754-Floats: 1\r\n\
             Supports-Subnormals: 1\r\nValue-Size: {}\r\nMax-Buffer-Length: 360\r\nMax-Chunk-Length: 0\r\n\
             Hostname: taxel\r\nSource-Id: \r\nSession-Id: default\r\n\r\n",
            found.uid,
            match found.form {
                Form::Text => 0,
                Form::Integer(size) | Form::Float(size) => size,
            }
        );
        stream.write_all(request.as_bytes())?;
        let shared = Arc::clone(&self.shared);
        let mut bytes = BufReader::new(Bytes {
            stream,
            shared: &shared,
            clocks: Comparison {
                socket,
                last: None,
                ahead: None,
                unanswered: 0,
            },
        });
        head(&mut bytes)?;
        let mut stamp = 0.0;
        // The patterns by which a reader finds out whether it understands the numbers.
        for _ in 0..2 {
            sample(&mut bytes, found, &mut stamp)?;
        }
        self.say(&match bytes.get_ref().clocks.ahead {
            Some(ahead) => format!(
                "connected to {}; its clock is ahead by {ahead:.6} s",
                found.host
            ),
            None => format!(
                "connected to {}; it does not compare clocks: marks have the time of their arrival",
                found.host
            ),
        });
        loop {
            let text = sample(&mut bytes, found, &mut stamp)?;
            let arrived = Instant::now();
            let at = bytes.get_ref().clocks.ahead;
            let at = at.and_then(|ahead| moment(stamp - ahead, FARTHEST));
            let mark = NewMark {
                text: cut(&text),
                by: format!("lsl:{}", self.name),
                at: Some(at.unwrap_or(arrived)),
            };
            if mark.text.is_empty() || !self.has_room(arrived) {
                continue;
            }
            if self.commands.send(Command::Mark(mark)).is_err() {
                return Ok(());
            }
        }
    }

    /// Counts a mark; false for one too many in a second, which is said once in each.
    fn has_room(&mut self, now: Instant) -> bool {
        let (begin, count) = &mut self.window;
        if now.duration_since(*begin) >= Duration::from_secs(1) {
            (*begin, *count) = (now, 0);
        }
        *count += 1;
        let count = *count;
        if count == MOST_MARKS + 1 {
            self.say(&format!(
                "more than {MOST_MARKS} marks in a second; the others of it are left out"
            ));
        }
        count <= MOST_MARKS
    }
}

/// Reads the head of the answer to a request for samples.
fn head(bytes: &mut impl io::BufRead) -> io::Result<()> {
    let mut lines = bytes.take(LONGEST_HEAD);
    let mut line = String::new();
    lines.read_line(&mut line)?;
    if line.split_whitespace().nth(1) != Some("200") {
        return Err(wrong(&format!(
            "the answer \"{}\"",
            line.trim().escape_debug()
        )));
    }
    let mut version = None;
    while line != "\r\n" {
        line.clear();
        if lines.read_line(&mut line)? == 0 {
            return Err(wrong("no samples"));
        }
        let (name, value) = line.split_once(':').unwrap_or_default();
        match name.to_ascii_lowercase().as_str() {
            "data-protocol-version" => version = value.trim().parse::<u32>().ok(),
            "byte-order" if value.trim() != "1234" => {
                return Err(wrong("numbers in another order of bytes"));
            }
            _ => {}
        }
    }
    if version != Some(110) {
        return Err(wrong("samples of another version than 1.10"));
    }
    Ok(())
}

/// Reads a sample: its texts as one, and its time by the clock of the other side in `stamp`, s.
fn sample(bytes: &mut impl Read, found: &Found, stamp: &mut f64) -> io::Result<String> {
    *stamp = match little(bytes, 1)? {
        1 => *stamp + found.period,
        2 => f64::from_bits(little(bytes, 8)?.cast_unsigned()),
        _ => return Err(wrong("something that is no sample")),
    };
    let texts = (0..found.channels).map(|_| found.form.read(bytes));
    Ok(texts.collect::<io::Result<Vec<_>>>()?.join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;

    const XML: &str = "<info><name>a&amp;b</name><type>Markers</type><channel_count>1</channel_count>\
        <channel_format>string</channel_format><nominal_srate>0</nominal_srate><uid>a-1</uid><hostname>here</hostname>\
        <v4data_port>16572</v4data_port><v4service_port>16573</v4service_port></info>";

    fn found(xml: &str) -> Option<Found> {
        Found::of(xml, "a&b", Ipv4Addr::LOCALHOST.into())
    }

    #[test]
    fn only_streams_of_marks_with_the_name_are_found() {
        let stream = found(XML).unwrap();
        assert_eq!((stream.form, stream.channels), (Form::Text, 1));
        assert_eq!((stream.data.port(), stream.service.port()), (16572, 16573));
        for (from, to) in [
            ("a&amp;b", "another"),
            ("<channel_count>1<", "<channel_count>4000000000<"),
            ("<channel_count>1<", "<channel_count>0<"),
            (">string<", ">undefined<"),
            ("<uid>a-1<", "<uid>a\r\nHost: b<"),
            (">16572<", ">165720<"),
            ("</uid>", ""),
        ] {
            assert_eq!(found(&XML.replace(from, to)), None, "{to}");
        }
    }

    #[test]
    fn samples_of_each_form_are_read_and_no_length_is_believed() {
        let read = |form, bytes: &[u8]| {
            let stream = Found {
                form,
                channels: 2,
                period: 0.5,
                ..found(XML).unwrap()
            };
            let mut stamp = 1.0;
            let text = sample(&mut &*bytes, &stream, &mut stamp).ok()?;
            Some((stamp, text))
        };
        let of = |stamp, text: &str| Some((stamp, text.to_owned()));
        assert_eq!(
            read(Form::Text, b"\x01\x01\x02on\x02\x03\0off"),
            of(1.5, "on off")
        );
        let at = [&[2][..], &7.0_f64.to_le_bytes(), &[255, 7]].concat();
        assert_eq!(read(Form::Integer(1), &at), of(7.0, "-1 7"));
        let numbers = [&[1][..], &1.5_f32.to_le_bytes(), &(-2.0_f32).to_le_bytes()].concat();
        assert_eq!(read(Form::Float(4), &numbers), of(1.5, "1.5 -2"));
        // A length of 2^64 - 1, another that is no length, no sample, and none at all.
        let endless = [&[1, 8][..], &[255; 8], &[b'x'; 100]].concat();
        for bytes in [&endless[..], b"\x01\x03abc", b"\x09", b""] {
            assert_eq!(read(Form::Text, bytes), None, "{bytes:?}");
        }
        let long = [
            &[1, 4][..],
            &5000_u32.to_le_bytes(),
            &[b'x'; 5000],
            b"\x01\x01y",
        ]
        .concat();
        let (_, text) = read(Form::Text, &long).unwrap();
        assert_eq!(text.len() as u64, KEPT + 2);
    }

    #[test]
    fn answers_of_another_version_are_refused() {
        let read = |text: &str| head(&mut text.as_bytes());
        let begin = "LSL/110 200 OK\r\nUID: a\r\nByte-Order: 1234\r\n";
        read(&format!("{begin}Data-Protocol-Version: 110\r\n\r\n")).unwrap();
        for text in [
            format!("{begin}Data-Protocol-Version: 100\r\n\r\n"),
            format!("{begin}\r\n"),
            begin.to_owned(),
            begin.replace("1234", "4321"),
            "LSL/110 404 Not found\r\n\r\n".to_owned(),
            "x".repeat(100_000),
        ] {
            read(&text).unwrap_err();
        }
    }
}
