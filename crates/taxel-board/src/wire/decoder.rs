//! Bytes to frames.

use std::collections::VecDeque;

use taxel_recording::{Frame, FrameFlags};

use super::assembly::{Assembly, Whole};
use super::candidate::{Around, Candidate};
use super::counting::FrameCounter;
use super::counts::Counts;
use super::cut::Cutter;
use super::numbering::{Numbered, Numbering, Placed};
use super::pace::Passed;
use super::packet::Reading;
use super::remarks::Remarks;
use super::steps::StepGuard;
use super::times::{Known, Times};
use crate::board::line::LineFormat;
use crate::board::{Board, Class, Format, SampleTimes, Stamped};

/// Lines that fit no template and are kept for the operator.
const KEPT_LINES: usize = 10;
/// Longest of them, characters.
const LONGEST_KEPT: usize = 200;

/// Numbers above this begin again: differences of two of them are whole numbers with sign.
const LARGEST_NUMBER: u64 = (1 << 62) - 1;

/// How a stream of bytes begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Begin {
    /// With a whole packet: a file, a pipe, a program.
    Whole,
    /// Anywhere: a board that was sending before it was opened.
    Cut,
}

/// Bytes to frames: looks again from the byte behind the start of whatever is no packet, so
/// that one damage costs one packet, and delivers nothing whose marks, length, check, status
/// or range do not hold.
///
/// It holds at most two packets of the longest length beside what was pushed last.
#[derive(Debug, Clone)]
pub struct Decoder {
    cutter: Cutter,
    lines: Option<LineFormat>,
    buffer: Vec<u8>,
    /// Bytes of the buffer that were looked at.
    start: usize,
    /// Bytes since the end of the last packet.
    since_packet: Option<u64>,
    /// Arrival of the bytes up to each count, ns.
    arrivals: VecDeque<(u64, u64)>,
    /// Bytes ever pushed, and those of them before the buffer.
    pushed: u64,
    dropped: u64,
    /// Passed-over bytes of the stretch that is being looked at.
    stretch: u64,
    begun: bool,
    discard_line: bool,
    /// Lines since a blank one; `None` where one is missing or damaged.
    row: Option<usize>,
    /// Bytes of the line under way in which no end was found.
    searched: usize,
    assembly: Assembly,
    frames: VecDeque<Frame>,
    counts: Counts,
    numbering: Option<Numbering<Box<Assembled>>>,
    counter: Option<FrameCounter>,
    placed: Vec<Placed<Box<Assembled>>>,
    number: u64,
    restarted: bool,
    times: Times,
    guard: Option<StepGuard>,
    flags: FrameFlags,
    wired: Vec<usize>,
    clock_step_ns: Option<f64>,
    clock_modulus: Option<f64>,
    samples: Option<SampleTimes>,
    period_ns: Option<f64>,
    last_host_ns: Option<u64>,
    other_lines: VecDeque<String>,
    remarks: Remarks,
    /// The board, if it says what its frames hold.
    said: Option<Board>,
    hello: Hello,
}

/// What is known of the hello of a board that says one.
#[derive(Debug, Clone, PartialEq)]
enum Hello {
    /// None has come: the frames hold what the board file says.
    NotHeard,
    /// It agrees.
    Agrees,
    /// It agreed before the board began anew: the board is asked again.
    Asked,
    /// It agreed before the board was connected again: no frame is read before it comes.
    Due,
    /// It says something else: no frame is read any more.
    Changed(String),
}

/// A frame before it has its number.
#[derive(Debug, Clone, PartialEq)]
struct Assembled {
    /// `None` for one whose status is not good.
    values: Option<Vec<f64>>,
    time: Option<f64>,
    host_ns: Option<u64>,
}

impl Decoder {
    /// A decoder of the packets of `board`.
    pub fn new(board: &Board, begin: Begin) -> Self {
        let class = board.detection().class;
        let clock = board.clock();
        let counter = board.counter();
        let numbering = counter.map(|counter| Numbering::new(counter.frames(), board.rate));
        let wired = board.wired();
        let guard = (class >= Class::C || board.step_limit.is_some()).then(|| {
            let units: Vec<f64> = wired
                .iter()
                .map(|place| board.values[*place].unit.si_per_unit)
                .collect();
            // A step that is not known limits nothing.
            let steps = board
                .steps()
                .into_iter()
                .map(|step| step.max(0.0))
                .collect();
            StepGuard::new(board.step_limit, &units, steps)
        });
        Self {
            cutter: Cutter::new(board),
            lines: match &board.format {
                Format::Lines(lines) => Some(lines.clone()),
                _ => None,
            },
            buffer: Vec::new(),
            start: 0,
            since_packet: (begin == Begin::Whole).then_some(0),
            arrivals: VecDeque::new(),
            pushed: 0,
            dropped: 0,
            stretch: 0,
            begun: begin == Begin::Whole,
            discard_line: begin == Begin::Cut,
            row: (begin == Begin::Whole).then_some(0),
            searched: 0,
            assembly: Assembly::new(board, begin == Begin::Cut),
            frames: VecDeque::new(),
            counts: Counts {
                lost: numbering.as_ref().map(|_| 0),
                missing_estimate: (numbering.is_some() || board.rate.is_some()).then_some(0),
                ..Counts::default()
            },
            numbering,
            counter: counter.map(FrameCounter::new),
            placed: Vec::new(),
            number: 0,
            restarted: false,
            times: Times::new(clock, board.rate),
            guard,
            flags: if class.is_unchecked() {
                FrameFlags::UNCHECKED_WIRE
            } else {
                FrameFlags::NONE
            },
            wired,
            clock_step_ns: clock.map(|clock| clock.step_ns),
            clock_modulus: clock
                .and_then(|clock| clock.modulus)
                .map(|modulus| modulus as f64),
            samples: board.samples,
            period_ns: board.rate.map(|rate| 1e9 / rate),
            last_host_ns: None,
            other_lines: VecDeque::new(),
            remarks: Remarks::new(board),
            said: board.says_hello().then(|| board.clone()),
            hello: Hello::NotHeard,
        }
    }

    /// Takes bytes that arrived at `host_ns` (of any steady clock), or at a time that is not
    /// known.
    pub fn push(&mut self, bytes: &[u8], host_ns: Option<u64>) {
        self.buffer.extend_from_slice(bytes);
        self.pushed += bytes.len() as u64;
        if let Some(host_ns) = host_ns {
            self.arrivals.push_back((self.pushed, host_ns));
        }
        self.look(false);
    }

    /// Says that no more bytes come: what waited for them is decided.
    pub fn finish(&mut self) {
        self.look(true);
        if let Some(numbering) = &mut self.numbering {
            numbering.finish(&mut self.placed);
        }
        self.deliver_placed();
        self.times.finish();
        // Nothing will confirm a step that is held.
        if let Some(guard) = &mut self.guard {
            guard.reset();
        }
    }

    /// The next frame.
    #[expect(
        clippy::should_implement_trait,
        reason = "a decoder gives more frames after more bytes"
    )]
    pub fn next(&mut self) -> Option<Frame> {
        self.frames.pop_front()
    }

    /// A new connection: what is left of the old one is given up; number and time begin a new
    /// segment behind the last.
    pub fn reconnect(&mut self, begin: Begin) {
        self.counts.passed_over += (self.buffer.len() - self.start) as u64 + self.stretch;
        self.counts.reconnects += 1;
        self.buffer.clear();
        self.start = 0;
        self.searched = 0;
        self.stretch = 0;
        self.dropped = self.pushed;
        self.arrivals.clear();
        self.since_packet = (begin == Begin::Whole).then_some(0);
        self.begun = begin == Begin::Whole;
        self.discard_line = begin == Begin::Cut;
        self.row = (begin == Begin::Whole).then_some(0);
        self.assembly.reconnect(begin == Begin::Cut);
        self.cutter.reset();
        if let Some(numbering) = &mut self.numbering {
            numbering.reconnect();
        }
        if let Some(counter) = &mut self.counter {
            counter.reconnect();
        }
        if let Some(guard) = &mut self.guard {
            guard.reset();
        }
        self.times.finish();
        self.remarks.reconnect();
        self.restarted = true;
        self.last_host_ns = None;
        if matches!(self.hello, Hello::Agrees | Hello::Asked) {
            self.hello = Hello::Due;
        }
    }

    /// What the board says now that its frames hold, where that is not what they are read as:
    /// nothing is read any more.
    pub fn changed(&self) -> Option<&str> {
        match &self.hello {
            Hello::Changed(difference) => Some(difference),
            _ => None,
        }
    }

    /// True if the board should be asked for its hello ([`crate::HELLO_QUESTION`]): after a new
    /// connection, where no frame is read before it has come, and after a restart of the board.
    pub fn awaits_hello(&self) -> bool {
        matches!(self.hello, Hello::Asked | Hello::Due)
    }

    fn take_hello(&mut self, hello: &str) {
        let Some(board) = &self.said else { return };
        self.hello = match board.differs_from(hello) {
            Ok(None) => Hello::Agrees,
            Ok(Some(difference)) => Hello::Changed(difference),
            // Another board has packets of this type, too.
            Err(_) => return,
        };
    }

    /// What came and what did not, so far.
    pub fn counts(&self) -> Counts {
        let mut counts = self.counts;
        // A stretch longer than any packet is no packet, whatever comes behind it.
        if self.stretch > self.cutter.longest() as u64 {
            counts.passed_over += self.stretch;
        }
        if let Some(numbering) = &self.numbering {
            let numbers = numbering.counts();
            counts.lost = Some(numbers.lost);
            counts.ambiguous = numbers.ambiguous;
            counts.wrong_number = numbers.wrong;
            counts.late = numbers.late;
            counts.duplicate = numbers.duplicate;
            counts.restarts += numbers.restarts;
        }
        counts.wrong_time = self.times.wrong();
        counts.incomplete = self.assembly.incomplete;
        counts.unconfirmed = self.guard.as_ref().map_or(0, |guard| guard.unconfirmed);
        counts
    }

    /// What the operator should change in the board file, by what came so far: one line.
    pub fn remark(&self) -> Option<String> {
        let counter = self.counter.as_ref().and_then(FrameCounter::remark);
        let reason = self.assembly.reason();
        reason
            .or_else(|| self.remarks.of(self.counts.delivered))
            .or(counter)
    }

    /// The last ten lines that fit no template.
    pub fn other_lines(&self) -> impl Iterator<Item = &str> {
        self.other_lines.iter().map(String::as_str)
    }

    /// Bytes that wait for more.
    pub fn waiting(&self) -> usize {
        self.buffer.len() - self.start
    }

    fn look(&mut self, last: bool) {
        if let Some(lines) = self.lines.take() {
            self.look_for_lines(&lines, last);
            self.lines = Some(lines);
        } else {
            self.look_for_packets(last);
        }
        // What was looked at goes, but for what the next packet looks back on.
        let kept = self.cutter.looks_back().min(self.start);
        let gone = self.start - kept;
        self.buffer.drain(..gone);
        self.start = kept;
        self.dropped += gone as u64;
        let position = self.dropped + self.start as u64;
        while self.arrivals.len() > 1 && self.arrivals[0].0 <= position {
            self.arrivals.pop_front();
        }
    }

    fn look_for_packets(&mut self, last: bool) {
        while self.changed().is_none() {
            let (before, bytes) = self.buffer.split_at(self.start);
            let around = Around {
                bytes,
                before,
                since_packet: self.since_packet,
                last,
            };
            match self.cutter.candidate(around) {
                Candidate::More if last && !bytes.is_empty() => self.pass_over(1),
                Candidate::More => return,
                Candidate::None(bytes) => self.pass_over(bytes.max(1)),
                Candidate::Damaged(bytes) => {
                    self.pass_over(bytes);
                    self.end_stretch();
                }
                Candidate::Blank(bytes) => self.start += bytes,
                Candidate::Other(length) => {
                    self.end_stretch();
                    self.counts.other += 1;
                    let bytes = &self.buffer[self.start..][..length];
                    let text = self.cutter.text(bytes);
                    if let Some(hello) = self.cutter.hello() {
                        self.take_hello(&hello);
                    }
                    let bytes = &self.buffer[self.start..][..length];
                    self.remarks.other_length(self.cutter.other_length(bytes));
                    if let Some(text) = text {
                        self.keep(&text);
                    }
                    self.start += length;
                    self.since_packet = Some(0);
                }
                Candidate::Reading(bytes, reading) => {
                    self.end_stretch();
                    self.start += bytes;
                    self.since_packet = Some(0);
                    if self.hello == Hello::Due {
                        // It may hold something else since.
                        self.counts.other += 1;
                        continue;
                    }
                    let host_ns = self.arrival();
                    self.assemble(&reading, host_ns);
                }
            }
        }
    }

    /// Arrival of the byte before the place that is looked at.
    fn arrival(&self) -> Option<u64> {
        let position = self.dropped + self.start as u64;
        let arrived = self.arrivals.iter().find(|(end, _)| *end >= position);
        arrived.map(|(_, host_ns)| *host_ns)
    }

    fn pass_over(&mut self, bytes: usize) {
        self.start += bytes;
        self.stretch += bytes as u64;
        if let Some(since) = &mut self.since_packet {
            *since += bytes as u64;
        }
    }

    /// A packet stands behind a stretch of bytes that was none.
    fn end_stretch(&mut self) {
        let stretch = std::mem::take(&mut self.stretch);
        self.counts.passed_over += stretch;
        // What comes before the first packet may be the rest of one.
        if stretch > 0 && self.begun {
            let length = self.cutter.longest().max(1) as u64;
            let several = match self.cutter.fixed_length() {
                Some(_) => (stretch + length / 2) / length,
                None => 1,
            };
            self.counts.damaged += several.max(1);
        }
        self.begun = true;
    }

    fn look_for_lines(&mut self, lines: &LineFormat, last: bool) {
        loop {
            let bytes = &self.buffer[self.start..];
            let searched = std::mem::take(&mut self.searched);
            let (length, ended) = match lines.line_end(bytes, searched) {
                Some(end) => end,
                None if last && !bytes.is_empty() => (bytes.len(), bytes.len()),
                None if bytes.len() > lines.longest => {
                    // The rest of it is no line either.
                    let length = bytes.len();
                    self.start += length;
                    self.counts.passed_over += length as u64;
                    self.counts.damaged += u64::from(!self.discard_line);
                    self.discard_line = true;
                    return;
                }
                None => {
                    self.searched = bytes.len();
                    return;
                }
            };
            let line = String::from_utf8_lossy(&bytes[..length.min(lines.longest)]).into_owned();
            let too_long = length > lines.longest;
            self.start += ended;
            let discarded = std::mem::take(&mut self.discard_line);
            if too_long || (discarded && lines.may_begin_cut()) {
                self.counts.passed_over += ended as u64;
                self.counts.damaged += u64::from(too_long);
                continue;
            }
            let host_ns = self.arrival();
            self.line(lines, &line, host_ns);
        }
    }

    /// Keeps a line that holds no reading.
    fn keep(&mut self, line: &str) {
        if self.other_lines.len() == KEPT_LINES {
            self.other_lines.pop_front();
        }
        let kept = line.trim_end().chars().take(LONGEST_KEPT).collect();
        self.other_lines.push_back(kept);
    }

    fn line(&mut self, lines: &LineFormat, line: &str, host_ns: Option<u64>) {
        if line.trim().is_empty() {
            self.row = Some(0);
            return;
        }
        let mut read = lines.read(line);
        if lines.by_blank_lines {
            let row = self.row.take().filter(|row| *row < self.assembly.places());
            self.row = read.as_ref().and(row).map(|row| row + 1);
            read = read.filter(|_| row.is_some());
            if let Some(read) = &mut read {
                read.slot = row;
            }
        }
        let Some(read) = read else {
            self.counts.other += 1;
            self.keep(line);
            return;
        };
        if read.out_of_range {
            self.counts.damaged += 1;
            self.assembly.clear();
            return;
        }
        if let Some(slot) = read.slot {
            let own = lines.values_of_line();
            let mut reading = Reading {
                values: vec![f64::NAN; own],
                sequence: read.sequence,
                time: read.time,
                slot,
                first: slot * own,
                bad_status: read.bad_status,
                ..Reading::default()
            };
            for (place, value) in read.values {
                reading.values[place] = value;
            }
            self.assemble(&reading, host_ns);
            return;
        }
        for (place, value) in read.values {
            self.assembly.put(place, value);
        }
        if read.completes {
            let values = self.assembly.take();
            self.assembled(
                read.sequence,
                Assembled {
                    values: (!read.bad_status).then_some(values),
                    time: read.time,
                    host_ns,
                },
            );
        }
    }

    /// Takes the frames of a packet or message: one, or several of which the last arrived now.
    fn assemble(&mut self, reading: &Reading, host_ns: Option<u64>) {
        let Some(samples) = self.samples else {
            self.assemble_one(reading, host_ns);
            return;
        };
        let own = self.assembly.values();
        let count = reading.values.len() / own.max(1);
        for (n, values) in reading.values.chunks_exact(own.max(1)).enumerate() {
            let before = (count - 1 - n) as f64 * samples.every_ns;
            let from_stamp = match samples.stamp {
                Stamped::First => n as f64 * samples.every_ns,
                Stamped::Last => -before,
            };
            let (sequence, time) = reading.each.get(n).copied().unwrap_or_default();
            let steps = self
                .clock_step_ns
                .map_or(0.0, |step_ns| from_stamp / step_ns);
            let stamp = reading.time.map(|time| match self.clock_modulus {
                Some(modulus) => (time + steps).rem_euclid(modulus),
                None => time + steps,
            });
            let one = Reading {
                values: values.to_vec(),
                sequence: sequence.or(reading.sequence),
                time: time.or(stamp),
                bad_status: reading.bad_status,
                ..Reading::default()
            };
            let arrived = host_ns.map(|host_ns| host_ns.saturating_sub(before as u64));
            self.assemble_one(&one, arrived);
        }
    }

    fn assemble_one(&mut self, reading: &Reading, host_ns: Option<u64>) {
        let Some(Whole {
            values,
            sequence,
            time,
            bad_status,
        }) = self.assembly.packet(reading, host_ns)
        else {
            return;
        };
        self.assembled(
            sequence,
            Assembled {
                values: (!bad_status).then_some(values),
                time,
                host_ns,
            },
        );
    }

    /// A whole frame, with its number on the wire.
    fn assembled(&mut self, sequence: Option<u64>, frame: Assembled) {
        if frame.values.is_none() {
            self.counts.bad_status += 1;
        }
        let number = sequence.zip(self.counter.as_mut());
        let number = number.map(|(raw, counter)| counter.frame(raw & LARGEST_NUMBER));
        if let (Some(numbering), Some(number)) = (&mut self.numbering, number) {
            // A clock that wraps would break the rate; the arrival stands in where it is known.
            let arrival = frame.host_ns.map(|host_ns| host_ns as f64);
            let device = || Some(frame.time? * self.clock_step_ns?);
            let time = arrival.or_else(device).map(|time_ns| time_ns * 1e-9);
            let numbered = Numbered {
                number,
                time,
                fingerprint: fingerprint(frame.values.as_deref()),
                frame: Box::new(frame),
            };
            numbering.push(numbered, &mut self.placed);
            self.deliver_placed();
        } else {
            self.estimate_missing(frame.host_ns);
            self.number += 1;
            let restarted = std::mem::take(&mut self.restarted);
            self.deliver(self.number - 1, restarted, frame);
        }
    }

    /// Without a counter: frames that rate and silence say are missing.
    fn estimate_missing(&mut self, host_ns: Option<u64>) {
        if let (Some(now), Some(then), Some(period)) = (host_ns, self.last_host_ns, self.period_ns)
        {
            let frames = now.saturating_sub(then) as f64 / period;
            // Shorter pauses are those of the link.
            if frames > 8.0 && now.saturating_sub(then) > 200_000_000 {
                let missing = self.counts.missing_estimate.get_or_insert(0);
                *missing += frames.round() as u64 - 1;
            }
        }
        self.last_host_ns = host_ns;
    }

    fn deliver_placed(&mut self) {
        for placed in std::mem::take(&mut self.placed) {
            let restarted = placed.restarted | std::mem::take(&mut self.restarted);
            self.deliver(placed.number, restarted, *placed.frame);
        }
    }

    fn deliver(&mut self, number: u64, restarted: bool, frame: Assembled) {
        let unseen = match self.numbering {
            Some(_) => 0,
            None => self.counts.damaged + self.assembly.incomplete,
        };
        let board_ns = frame.time.zip(self.clock_step_ns);
        self.remarks.push(Passed {
            frames: number + unseen,
            board_ns: board_ns.map(|(raw, step_ns)| raw * step_ns),
            host_ns: frame.host_ns,
        });
        let timed = self.times.time(Known {
            raw: frame.time,
            number,
            counted: self.numbering.is_some(),
            host_ns: frame.host_ns,
            restarted,
        });
        if timed.restarted && !restarted {
            self.counts.restarts += 1;
        }
        if (timed.restarted || restarted) && self.hello == Hello::Agrees {
            self.hello = Hello::Asked;
        }
        let Some(values) = frame.values else {
            return;
        };
        let flags = if timed.inferred {
            self.flags.with(FrameFlags::INFERRED_TIME)
        } else {
            self.flags
        };
        let frame = Frame {
            sequence: number,
            time_ns: timed.time_ns,
            values: self.wired.iter().map(|place| values[*place]).collect(),
            host_ns: frame.host_ns,
            flags,
        };
        let Self {
            frames,
            counts,
            guard,
            ..
        } = self;
        let mut give = |frame| {
            counts.delivered += 1;
            frames.push_back(frame);
        };
        match guard {
            Some(guard) => guard.push(frame, &mut give),
            None => give(frame),
        }
    }
}

/// A number that tells values apart (FNV-1a).
fn fingerprint(values: Option<&[f64]>) -> u64 {
    let values = values.unwrap_or(&[]).iter();
    values.fold(0xcbf2_9ce4_8422_2325, |hash, value| {
        (hash ^ value.to_bits()).wrapping_mul(0x0100_0000_01b3)
    })
}
