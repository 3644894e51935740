//! An outlet of the lab streaming layer, protocol 1.10, spoken here: whoever asks on the local network gets
//! forces, readings, values and events as streams.
//!
//! Requests come by datagram (`LSL:shortinfo` to find streams, `LSL:timedata` to compare clocks) and over
//! TCP (`LSL:fullinfo`, `LSL:streamfeed`).

use std::fmt::Write as _;
use std::io::{self, BufRead as _, BufReader, Read as _, Write as _};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use socket2::{Domain, Protocol, Socket, Type};
use taxel::acquisition::Stream;
use taxel::estimation::Meaning;

use super::frame::FrameMessage;
use super::lsl_query::holds;
use super::sink::Sink;
use crate::events::EventRecord;
use crate::lsl::{GROUPS, PORT, RANGE, clock, stamp};
use crate::outgoing::Outgoing;

/// Longest request, bytes; the library takes as much.
const LONGEST: u64 = 16_384;
/// Samples that an inlet may be behind before it loses new ones: two seconds at 1 kHz.
const MOST_BEHIND: usize = 2000;
/// Wait between looks at the end of the run.
const NAP: Duration = Duration::from_millis(50);
/// Longest wait for a request, and for an inlet that takes nothing: what is sent at the end is lost to it.
const PATIENCE: Duration = Duration::from_secs(1);
/// Connections at once, of all streams together: each has a thread. A recorder takes one for each stream, and a
/// second for its description.
const MOST_CONNECTIONS: usize = 64;

/// Format of the samples of a stream.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Format {
    Float32,
    Text,
}

/// A channel of a stream.
struct Channel {
    label: String,
    unit: String,
    /// What it is.
    kind: &'static str,
    /// Where its taxels are on average, m; none where that is not known, or it is of the whole array.
    at: Option<[f64; 3]>,
}

/// What a stream is.
struct Description {
    /// Of the device, which other programs of this machine may not have.
    device: String,
    name: String,
    kind: &'static str,
    format: Format,
    channels: Vec<Channel>,
    rate: f64,
    uid: String,
    host: String,
    created: f64,
    tcp: u16,
    udp: u16,
}

/// A text within XML.
fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;");
    text.replace('>', "&gt;").replace('\0', "")
}

impl Description {
    /// A field of the stream, as queries name it.
    fn field(&self, name: &str) -> Option<String> {
        Some(match name {
            "name" => self.name.clone(),
            "type" => self.kind.into(),
            "channel_count" => self.channels.len().to_string(),
            "channel_format" => match self.format {
                Format::Float32 => "float32".into(),
                Format::Text => "string".into(),
            },
            // An inlet that lost its outlet looks for this: the same device of the next run.
            "source_id" => format!("taxel:{}:{}:{}", self.host, self.device, self.name),
            "nominal_srate" => self.rate.to_string(),
            "version" => "1.1".into(),
            "created_at" => self.created.to_string(),
            "uid" => self.uid.clone(),
            "session_id" => "default".into(),
            "hostname" => self.host.clone(),
            "v4data_port" => self.tcp.to_string(),
            "v4service_port" => self.udp.to_string(),
            "v6data_port" | "v6service_port" => "0".into(),
            "v4address" | "v6address" => String::new(),
            _ => return None,
        })
    }

    /// The stream as XML, with the channels if `full`.
    fn xml(&self, full: bool) -> String {
        let mut xml = "<?xml version=\"1.0\"?>\n<info>".to_owned();
        for name in [
            "name",
            "type",
            "channel_count",
            "channel_format",
            "source_id",
            "nominal_srate",
            "version",
            "created_at",
            "uid",
            "session_id",
            "hostname",
            "v4address",
            "v4data_port",
            "v4service_port",
            "v6address",
            "v6data_port",
            "v6service_port",
        ] {
            let value = escaped(&self.field(name).unwrap_or_default());
            let _ = write!(xml, "<{name}>{value}</{name}>");
        }
        xml.push_str("<desc>");
        if full {
            let program = env!("CARGO_PKG_VERSION");
            let _ = write!(
                xml,
                "<acquisition><manufacturer>taxel</manufacturer><version>{program}</version></acquisition><channels>"
            );
            for channel in &self.channels {
                let [label, unit] = [&channel.label, &channel.unit].map(|text| escaped(text));
                let kind = channel.kind;
                let _ = write!(
                    xml,
                    "<channel><label>{label}</label><unit>{unit}</unit><type>{kind}</type>"
                );
                if let Some(at) = channel.at {
                    // Millimetres, as the metadata of the layer have it.
                    let [x, y, z] = at.map(|metres| 1e3 * metres);
                    let _ = write!(xml, "<location><X>{x}</X><Y>{y}</Y><Z>{z}</Z></location>");
                }
                xml.push_str("</channel>");
            }
            xml.push_str("</channels>");
        }
        xml.push_str("</desc></info>\n");
        xml
    }

    /// A sample of numbers.
    fn numbers(stamp: f64, values: impl Iterator<Item = f32>) -> Vec<u8> {
        let mut sample = Self::begun(stamp);
        values.for_each(|value| sample.extend(value.to_le_bytes()));
        sample
    }

    /// A sample of texts.
    fn texts(stamp: f64, texts: impl Iterator<Item = String>) -> Vec<u8> {
        let mut sample = Self::begun(stamp);
        for text in texts {
            if let Ok(length) = u8::try_from(text.len()) {
                sample.extend([1, length]);
            } else {
                sample.push(4);
                sample.extend((text.len() as u32).to_le_bytes());
            }
            sample.extend(text.as_bytes());
        }
        sample
    }

    /// A sample with a stamp of its own.
    fn begun(stamp: f64) -> Vec<u8> {
        let mut sample = vec![2];
        sample.extend(stamp.to_le_bytes());
        sample
    }

    /// The sample by which an inlet finds out whether it understands the numbers.
    fn pattern(&self, offset: i32) -> Vec<u8> {
        let stamp = 123_456.789;
        let places = 0..i32::try_from(self.channels.len()).unwrap_or(i32::MAX);
        let signed = |number: i32, place: i32| if place % 2 == 0 { number } else { -number };
        match self.format {
            Format::Float32 => Self::numbers(stamp, places.map(|k| signed(k + offset, k) as f32)),
            Format::Text => Self::texts(stamp, places.map(|k| signed(k + 10, k).to_string())),
        }
    }
}

/// A stream and who takes it.
struct Outlet {
    description: Description,
    inlets: Mutex<Vec<mpsc::SyncSender<Arc<[u8]>>>>,
    dropped: AtomicU64,
}

impl Outlet {
    fn push(&self, sample: Vec<u8>) {
        let sample: Arc<[u8]> = sample.into();
        let mut inlets = self.inlets.lock().unwrap_or_else(PoisonError::into_inner);
        inlets.retain(|inlet| match inlet.try_send(Arc::clone(&sample)) {
            Ok(()) => true,
            Err(mpsc::TrySendError::Full(_)) => {
                self.dropped.fetch_add(1, Ordering::Relaxed);
                true
            }
            Err(mpsc::TrySendError::Disconnected(_)) => false,
        });
    }
}

/// The streams of a run.
pub(super) struct Lsl {
    /// Forces, readings, values, events.
    outlets: [Arc<Outlet>; 4],
    /// Stamp of the newest frame, s.
    newest: f64,
    stop: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
    feeds: Arc<Mutex<Vec<JoinHandle<()>>>>,
}

fn tcp_listener() -> io::Result<TcpListener> {
    let mut free = RANGE.filter_map(|port| TcpListener::bind((Ipv4Addr::UNSPECIFIED, port)).ok());
    free.next()
        .map_or_else(|| TcpListener::bind((Ipv4Addr::UNSPECIFIED, 0)), Ok)
}

fn udp_socket() -> io::Result<UdpSocket> {
    let mut free = RANGE.filter_map(|port| UdpSocket::bind((Ipv4Addr::UNSPECIFIED, port)).ok());
    free.next()
        .map_or_else(|| UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)), Ok)
}

/// The port of the questions of all, which outlets of other programs have as well.
fn common_port() -> io::Result<UdpSocket> {
    let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
    socket.set_reuse_address(true)?;
    socket.bind(&SocketAddr::from((Ipv4Addr::UNSPECIFIED, PORT)).into())?;
    for group in GROUPS {
        for interface in [Ipv4Addr::LOCALHOST, Ipv4Addr::UNSPECIFIED] {
            // A machine without a network still has itself.
            let _ = socket.join_multicast_v4(&group, &interface);
        }
    }
    Ok(socket.into())
}

/// A number that no other stream has, as programs write them.
fn uid() -> io::Result<String> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes).map_err(|error| io::Error::other(error.to_string()))?;
    let digits = bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    });
    let parts = [0..8, 8..12, 12..16, 16..20, 20..32].map(|part| &digits[part]);
    Ok(parts.join("-"))
}

fn host() -> String {
    let name = std::fs::read_to_string("/etc/hostname").unwrap_or_default();
    let name = Some(name.trim().to_owned()).filter(|name| !name.is_empty());
    name.or_else(|| std::env::var("COMPUTERNAME").ok())
        .unwrap_or_else(|| "localhost".into())
}

/// Channels of the stream of totals.
fn of_totals(meaning: &Meaning) -> Vec<Channel> {
    let length = meaning.length_unit();
    let sum = super::frame::unit(&meaning.value.quantity).1;
    [
        ("force_x", "N"),
        ("force_y", "N"),
        ("force_z", "N"),
        ("force_x_deviation", "N"),
        ("force_y_deviation", "N"),
        ("force_z_deviation", "N"),
        ("moment_x", "N m"),
        ("moment_y", "N m"),
        ("moment_z", "N m"),
        ("centre_x", length),
        ("centre_y", length),
        ("sum", sum),
        ("contacts", "1"),
        ("total_certainty", "1"),
        ("lost", "1"),
    ]
    .map(|(label, unit)| Channel {
        label: label.into(),
        unit: unit.into(),
        kind: "Force",
        at: None,
    })
    .into()
}

/// Where taxels are on average, m.
fn centre_of(meaning: &Meaning, taxels: impl Iterator<Item = usize>) -> Option<[f64; 3]> {
    let (mut sum, mut count) = ([0.0; 3], 0);
    for frame in taxels.filter_map(|taxel| meaning.layout.frames.get(taxel)) {
        sum = [0, 1, 2].map(|axis| sum[axis] + frame.position[axis]);
        count += 1;
    }
    (meaning.in_metres && count > 0).then(|| sum.map(|part| part / f64::from(count)))
}

/// Channels of the stream of readings.
fn of_readings(meaning: &Meaning) -> Vec<Channel> {
    let unit = super::frame::unit(&meaning.reading.quantity).1;
    let channels = meaning.channels.iter().enumerate();
    channels
        .map(|(channel, name)| Channel {
            label: name.clone(),
            unit: unit.to_owned(),
            kind: "Raw",
            at: centre_of(meaning, meaning.wiring.taxels(channel)),
        })
        .collect()
}

/// Channels of the stream of values: value, deviation and state of each taxel.
fn of_taxels(meaning: &Meaning) -> Vec<Channel> {
    let layout = &meaning.layout;
    let unit = super::frame::unit(&meaning.value.quantity).1;
    let axes = &["x", "y", "z"][3 - meaning.components..];
    let name = |index: usize| format!("r{}c{}", index / layout.columns, index % layout.columns);
    let channel = |taxel: usize, end: String, unit: &str, kind| Channel {
        label: name(taxel) + &end,
        unit: unit.to_owned(),
        kind,
        at: centre_of(meaning, std::iter::once(taxel)),
    };
    let taxels = 0..layout.taxels();
    let mut channels = Vec::new();
    for end in ["", "_deviation"] {
        for taxel in taxels.clone() {
            let of_axis = |axis| channel(taxel, format!(".{axis}{end}"), unit, "Touch");
            channels.extend(axes.iter().map(of_axis));
        }
    }
    channels.extend(taxels.map(|taxel| channel(taxel, ".state".into(), "1", "State")));
    channels
}

impl Lsl {
    pub(super) fn open(meaning: &Meaning, stream: &Stream) -> io::Result<Self> {
        let rate = stream.period.map_or(0.0, f64::recip);
        let events = vec![Channel {
            label: "event".into(),
            unit: "json".into(),
            kind: "Event",
            at: None,
        }];
        let udp = udp_socket()?;
        let port = udp.local_addr()?.port();
        let (stop, feeds) = (Arc::new(AtomicBool::new(false)), Arc::default());
        let mut threads = Vec::new();
        let mut outlet = |name: &str, kind, format, channels, rate| {
            let listener = tcp_listener()?;
            listener.set_nonblocking(true)?;
            let outlet = Arc::new(Outlet {
                description: Description {
                    device: stream.name.clone(),
                    name: format!("taxel {name}"),
                    kind,
                    format,
                    channels,
                    rate,
                    uid: uid()?,
                    host: host(),
                    created: clock(),
                    tcp: listener.local_addr()?.port(),
                    udp: port,
                },
                inlets: Mutex::default(),
                dropped: AtomicU64::new(0),
            });
            let (stop, feeds, own) = (Arc::clone(&stop), Arc::clone(&feeds), Arc::clone(&outlet));
            threads.push(std::thread::spawn(move || {
                accept(&listener, &own, &stop, &feeds);
            }));
            io::Result::Ok(outlet)
        };
        let outlets = [
            outlet("force", "Force", Format::Float32, of_totals(meaning), rate)?,
            outlet(
                "readings",
                "Raw",
                Format::Float32,
                of_readings(meaning),
                rate,
            )?,
            outlet("values", "Touch", Format::Float32, of_taxels(meaning), rate)?,
            outlet("events", "Markers", Format::Text, events, 0.0)?,
        ];
        // Without a network of groups an inlet can still name this machine in its configuration.
        for socket in [Some(udp), common_port().ok()].into_iter().flatten() {
            socket.set_read_timeout(Some(NAP))?;
            let (stop, outlets) = (Arc::clone(&stop), outlets.clone());
            threads.push(std::thread::spawn(move || answer(&socket, &outlets, &stop)));
        }
        Ok(Self {
            outlets,
            newest: f64::MIN,
            stop,
            threads,
            feeds,
        })
    }
}

/// Answers datagrams.
fn answer(socket: &UdpSocket, outlets: &[Arc<Outlet>], stop: &AtomicBool) {
    let mut buffer = [0; 2048];
    while !stop.load(Ordering::Relaxed) {
        let Ok((length, from)) = socket.recv_from(&mut buffer) else {
            continue;
        };
        let arrived = clock();
        let text = String::from_utf8_lossy(&buffer[..length]);
        let mut lines = text.split("\r\n");
        let (method, first) = (
            lines.next().unwrap_or_default(),
            lines.next().unwrap_or_default(),
        );
        let mut words = lines.next().unwrap_or_default().split_whitespace();
        match method.trim() {
            "LSL:shortinfo" => {
                let port = words.next().and_then(|port| port.parse::<u16>().ok());
                let (Some(port), Some(id)) = (port, words.next()) else {
                    continue;
                };
                let to = SocketAddr::new(from.ip(), port);
                let asked = |outlet: &&Arc<Outlet>| {
                    holds(first, &|name| outlet.description.field(name)) == Some(true)
                };
                for outlet in outlets.iter().filter(asked) {
                    let reply = format!("{id}\r\n{}", outlet.description.xml(false));
                    let _ = socket.send_to(reply.as_bytes(), to);
                }
            }
            "LSL:timedata" => {
                let mut words = first.split_whitespace();
                if let (Some(wave), Some(sent)) = (words.next(), words.next()) {
                    let reply = format!(" {wave} {sent} {arrived:.9} {:.9}", clock());
                    let _ = socket.send_to(reply.as_bytes(), from);
                }
            }
            _ => {}
        }
    }
}

/// Takes connections until the end, each on a thread of its own.
fn accept(
    listener: &TcpListener,
    outlet: &Arc<Outlet>,
    stop: &Arc<AtomicBool>,
    feeds: &Mutex<Vec<JoinHandle<()>>>,
) {
    while !stop.load(Ordering::Relaxed) {
        let Ok((stream, _)) = listener.accept() else {
            std::thread::sleep(NAP);
            continue;
        };
        let mut feeds = feeds.lock().unwrap_or_else(PoisonError::into_inner);
        feeds.retain(|feed| !feed.is_finished());
        if feeds.len() >= MOST_CONNECTIONS {
            // Closed at once: whoever asks comes again.
            continue;
        }
        let outlet = Arc::clone(outlet);
        feeds.push(std::thread::spawn(move || {
            // An inlet that goes is no matter of the run.
            let _ = serve(stream, &outlet);
        }));
    }
}

/// Answers one connection, and feeds it to its end.
fn serve(mut stream: TcpStream, outlet: &Outlet) -> io::Result<()> {
    stream.set_nonblocking(false)?;
    stream.set_nodelay(true)?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let description = &outlet.description;
    let request = Timed {
        stream: stream.try_clone()?,
        until: Instant::now() + PATIENCE,
    };
    let mut request = BufReader::new(request.take(LONGEST));
    let mut line = String::new();
    request.read_line(&mut line)?;
    let mut words = line.split_whitespace();
    match words.next() {
        Some("LSL:fullinfo") => return stream.write_all(description.xml(true).as_bytes()),
        Some("LSL:shortinfo") => {
            let mut query = String::new();
            request.read_line(&mut query)?;
            if holds(&query, &|name| description.field(name)) == Some(true) {
                stream.write_all(description.xml(false).as_bytes())?;
            }
            return Ok(());
        }
        Some("LSL:streamfeed/110") => {}
        _ => return stream.write_all(b"LSL/110 505 Version not supported\r\n\r\n"),
    }
    if words.next().is_some_and(|uid| uid != description.uid) {
        return stream.write_all(b"LSL/110 404 Not found\r\n\r\n");
    }
    let mut header = String::new();
    while header != "\r\n" {
        header.clear();
        if request.read_line(&mut header)? == 0 {
            return Ok(());
        }
    }
    let head = format!(
        "LSL/110 200 OK\r\nUID: {}\r\nByte-Order: 1234\r\nSuppress-Subnormals: 0\r\nData-Protocol-Version: 110\r\n\r\n",
        description.uid
    );
    let mut begin = head.into_bytes();
    begin.extend(description.pattern(4));
    begin.extend(description.pattern(2));
    stream.write_all(&begin)?;
    let (sender, samples) = mpsc::sync_channel(MOST_BEHIND);
    {
        let mut inlets = outlet.inlets.lock().unwrap_or_else(PoisonError::into_inner);
        inlets.push(sender);
    }
    while let Ok(sample) = samples.recv() {
        if let Err(error) = stream.write_all(&sample) {
            // This one, and those that wait behind it.
            let lost = 1 + samples.try_iter().count() as u64;
            outlet.dropped.fetch_add(lost, Ordering::Relaxed);
            return Err(error);
        }
    }
    Ok(())
}

/// What a connection sends until a moment: a request that comes in drops ends there.
struct Timed {
    stream: TcpStream,
    until: Instant,
}

impl io::Read for Timed {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let left = self.until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(io::ErrorKind::TimedOut.into());
        }
        self.stream.set_read_timeout(Some(left))?;
        self.stream.read(buffer)
    }
}

impl Sink for Lsl {
    fn frame(&mut self, outgoing: &Outgoing) -> io::Result<()> {
        // While the relation of the clocks settles a time may go back, which readers of the layer do not expect.
        let stamp = stamp(outgoing.taken).max(self.newest);
        self.newest = stamp;
        let [totals, readings, values, _] = &self.outlets;
        let frame = FrameMessage(&outgoing.bytes);
        let lost = frame.lost().map_or(f64::NAN, |lost| lost as f64);
        let numbers = (frame.force().into_iter())
            .chain(frame.force_deviation())
            .chain(frame.moment())
            .chain(frame.centre())
            .chain([frame.sum(), frame.contacts().count() as f64])
            .chain([f64::from(frame.certainty_code()), lost]);
        totals.push(Description::numbers(
            stamp,
            numbers.map(|value| value as f32),
        ));
        readings.push(Description::numbers(stamp, frame.readings()));
        let states = frame.states().map(f32::from);
        let of_taxels = frame.values().chain(frame.deviations()).chain(states);
        values.push(Description::numbers(stamp, of_taxels));
        Ok(())
    }

    fn event(&mut self, event: &EventRecord, outgoing: Option<&Outgoing>) -> io::Result<()> {
        let at = outgoing.map_or_else(Instant::now, |outgoing| outgoing.taken);
        let text = std::iter::once(event.json());
        self.outlets[3].push(Description::texts(stamp(at), text));
        Ok(())
    }

    fn dropped(&self) -> u64 {
        let each = self.outlets.iter();
        let each = each.map(|outlet| outlet.dropped.load(Ordering::Relaxed));
        each.max().unwrap_or(0)
    }

    /// Waits until the inlets have what was sent.
    fn end(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
        for outlet in &self.outlets {
            let mut inlets = outlet.inlets.lock().unwrap_or_else(PoisonError::into_inner);
            inlets.clear();
        }
        let mut feeds = self.feeds.lock().unwrap_or_else(PoisonError::into_inner);
        for feed in feeds.drain(..) {
            let _ = feed.join();
        }
    }
}
