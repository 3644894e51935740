//! A wire for the tests: mark, number, time, values as f32, sum of the bytes.
#![allow(
    clippy::unwrap_used,
    dead_code,
    reason = "a panic is how a test fails, and not every test needs all"
)]

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use taxel::acquisition::{Frame, Stream};
use taxel_serve::device::{
    Device, DeviceOptions, DevicePlace, DeviceSummary, Encode, Faults, Player,
};
use taxel_serve::link::{
    Decode, LinkAddress, LinkObserver, LinkOptions, LinkState, LinkStatus, WireCounts,
};
use taxel_serve::{Interrupt, LinkSource, Next, Source, SourceError};

const MARK: [u8; 4] = [0xa5, 0x5a, 0x0f, 0xf0];

pub(crate) fn stream(channels: usize, period: f64) -> Stream {
    Stream::of_counts([1, channels], [1e-3; 2], 1, period)
}

/// Values of a frame follow from its number.
pub(crate) fn frame(sequence: u64, channels: usize) -> Frame {
    Frame {
        sequence,
        values: (0..channels)
            .map(|channel| ((sequence * 7 + channel as u64) % 4096) as f64)
            .collect(),
        ..Frame::default()
    }
}

pub(crate) struct Encoder;

impl Encode for Encoder {
    fn encode(&mut self, frame: &Frame, bytes: &mut Vec<u8>) {
        let begin = bytes.len();
        bytes.extend(MARK);
        bytes.extend(frame.sequence.to_le_bytes());
        bytes.extend(frame.time_ns.to_le_bytes());
        for value in &frame.values {
            bytes.extend((*value as f32).to_le_bytes());
        }
        let sum = sum(&bytes[begin..]);
        bytes.extend(sum.to_le_bytes());
    }
}

fn sum(bytes: &[u8]) -> u32 {
    bytes.iter().fold(7_u32, |sum, byte| {
        sum.wrapping_mul(31).wrapping_add(u32::from(*byte))
    })
}

pub(crate) struct Decoder {
    channels: usize,
    bytes: VecDeque<u8>,
    host_ns: u64,
    counts: WireCounts,
}

impl Decoder {
    pub(crate) fn new(channels: usize) -> Self {
        Self {
            channels,
            bytes: VecDeque::new(),
            host_ns: 0,
            counts: WireCounts::default(),
        }
    }
}

impl Decode for Decoder {
    fn push(&mut self, bytes: &[u8], host_ns: u64) {
        self.bytes.extend(bytes);
        self.host_ns = host_ns;
    }

    fn next(&mut self) -> Option<Frame> {
        let length = 24 + 4 * self.channels;
        while self.bytes.len() >= length {
            let packet = &self.bytes.make_contiguous()[..length];
            let (whole, check) = packet.split_at(length - 4);
            if whole.starts_with(&MARK) && sum(whole).to_le_bytes() == check {
                let u64_at = |at: usize| u64::from_le_bytes(whole[at..at + 8].try_into().unwrap());
                let frame = Frame {
                    sequence: u64_at(4),
                    time_ns: u64_at(12),
                    values: whole[20..]
                        .chunks(4)
                        .map(|value| f32::from_le_bytes(value.try_into().unwrap()).into())
                        .collect(),
                    host_ns: Some(self.host_ns),
                    ..Frame::default()
                };
                self.bytes.drain(..length);
                self.counts.delivered += 1;
                return Some(frame);
            }
            self.bytes.pop_front();
            self.counts.passed_over_bytes += 1;
        }
        None
    }

    fn reconnected(&mut self) {
        self.bytes.clear();
    }

    fn counts(&self) -> WireCounts {
        self.counts
    }

    fn board(&self) -> String {
        "test".into()
    }

    fn wire_class(&self) -> char {
        'A'
    }

    fn expects_text(&self) -> bool {
        false
    }

    fn others(&self, _: &[u8]) -> Vec<String> {
        Vec::new()
    }
}

/// Frames without an end.
pub(crate) struct Endless {
    pub(crate) stream: Stream,
    pub(crate) next: u64,
}

impl Source for Endless {
    fn stream(&self) -> &Stream {
        &self.stream
    }

    fn next(&mut self) -> Result<Next, SourceError> {
        let sequence = self.next;
        self.next += 1;
        Ok(Next::Frame(frame(sequence, self.stream.channels())))
    }
}

/// A device that plays in a thread of its own.
pub(crate) struct Playing {
    pub(crate) name: String,
    interrupt: Interrupt,
    thread: std::thread::JoinHandle<DeviceSummary>,
}

impl Playing {
    pub(crate) fn start(
        place: DevicePlace,
        channels: usize,
        rate: f64,
        faults: &str,
        frames: Option<u64>,
        truth: Option<PathBuf>,
    ) -> Self {
        let options = DeviceOptions {
            place,
            rate,
            faults: Faults::parse("faults.toml", faults).unwrap(),
            seed: 5,
            truth,
            replace_files: true,
            control: None,
            frames,
            hello: None,
        };
        let interrupt = Interrupt::default();
        let (sender, name) = std::sync::mpsc::channel();
        let stop = interrupt.clone();
        let thread = std::thread::spawn(move || {
            let source = Endless {
                stream: stream(channels, rate.recip()),
                next: 0,
            };
            let player = Player::Source(Box::new(source));
            let device = Device::open(player, Box::new(Encoder), options).unwrap();
            sender.send(device.name()).unwrap();
            device.run(&stop).unwrap()
        });
        Self {
            name: name.recv().unwrap(),
            interrupt,
            thread,
        }
    }

    pub(crate) fn stop(self) -> DeviceSummary {
        self.interrupt.ask();
        self.thread.join().unwrap()
    }
}

/// Remembers the states of a link.
#[derive(Clone, Default)]
pub(crate) struct States(Arc<Mutex<Vec<LinkStatus>>>);

impl States {
    pub(crate) fn all(&self) -> Vec<LinkStatus> {
        self.0.lock().unwrap().clone()
    }

    pub(crate) fn names(&self) -> Vec<LinkState> {
        self.all().iter().map(|status| status.state).collect()
    }
}

impl LinkObserver for States {
    fn wire(&mut self, _: u64, _: &[u8]) {}

    fn link(&mut self, status: &LinkStatus) {
        self.0.lock().unwrap().push(status.clone());
    }
}

pub(crate) fn link(address: &str, channels: usize, rate: f64, options: LinkOptions) -> LinkSource {
    let address = LinkAddress::parse(address).unwrap();
    let decoder = Box::new(Decoder::new(channels));
    LinkSource::start(address, stream(channels, rate.recip()), decoder, options).unwrap()
}

/// Options, and the states that the link will go through.
pub(crate) fn observed() -> (LinkOptions, States) {
    let states = States::default();
    let options = LinkOptions {
        observers: vec![Box::new(states.clone())],
        ..LinkOptions::default()
    };
    (options, states)
}

/// Numbers of the frames that come until `enough`, or for 20 s.
pub(crate) fn numbers(source: &mut LinkSource, mut enough: impl FnMut(&[u64]) -> bool) -> Vec<u64> {
    let deadline = Instant::now() + Duration::from_secs(20);
    let mut numbers = Vec::new();
    while !enough(&numbers) && Instant::now() < deadline {
        match source.next().unwrap() {
            Next::Frame(found) => {
                assert_eq!(
                    found.values,
                    frame(found.sequence, found.values.len()).values
                );
                numbers.push(found.sequence);
            }
            Next::End => break,
            _ => {}
        }
    }
    numbers
}

/// Numbers that are missing between the first and the last.
pub(crate) fn missing(numbers: &[u64]) -> u64 {
    numbers.windows(2).map(|pair| pair[1] - pair[0] - 1).sum()
}

/// A name in the temporary folder that nobody has.
pub(crate) fn temporary(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("taxel-{name}-{}", std::process::id()));
    let _ = std::fs::remove_file(&path);
    path
}
