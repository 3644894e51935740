//! The virtual device: frames through the encoder, the faults and the clock onto the wire.

use std::collections::VecDeque;
use std::io;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, TryRecvError};
use std::time::{Duration, Instant};

use taxel::acquisition::{Delivery, Frame, Twin};

use super::control::{self, Command, ControlPlace};
use super::damage::{Damage, Fate};
use super::error::DeviceError;
use super::faults::Faults;
use super::outlet::{self, DevicePlace, Outlet};
use super::timing::Timing;
use super::truth::{Done, Truth};
use crate::interrupt::Interrupt;
use crate::source::{Next, Source};

/// Makes the bytes of frames.
pub trait Encode: Send {
    /// Adds the packets of `frame` to `bytes`.
    fn encode(&mut self, frame: &Frame, bytes: &mut Vec<u8>);
}

/// What is played.
pub enum Player {
    /// A twin, for ever.
    Twin(Box<Twin>),
    /// Another source, such as a recording, until its end.
    Source(Box<dyn Source>),
}

/// How a device is played.
#[derive(Debug, Clone)]
pub struct DeviceOptions {
    /// Where the bytes go.
    pub place: DevicePlace,
    /// Frames a second.
    pub rate: f64,
    /// What goes wrong.
    pub faults: Faults,
    /// Seed of what goes wrong.
    pub seed: u64,
    /// File of what was done to each frame.
    pub truth: Option<PathBuf>,
    /// True if that file may be replaced.
    pub replace_files: bool,
    /// Where commands come from.
    pub control: Option<ControlPlace>,
    /// End after so many frames.
    pub frames: Option<u64>,
    /// Packet in which the board says what its frames hold.
    pub hello: Option<Vec<u8>>,
}

/// What was played.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct DeviceSummary {
    /// Frames taken.
    pub frames: u64,
    /// Frames put on the wire.
    pub sent: u64,
    /// Frames whose bytes were damaged.
    pub damaged: u64,
    /// Times that somebody connected.
    pub connects: u64,
}

/// Bytes on their way.
struct Packet {
    /// When they leave, s from the start.
    leaves: f64,
    bytes: Vec<u8>,
}

/// A virtual device.
pub struct Device {
    player: Player,
    encoder: Box<dyn Encode>,
    options: DeviceOptions,
    outlet: Box<dyn Outlet>,
    commands: Option<Receiver<Command>>,
    control_name: Option<String>,
    truth: Option<Truth>,
    damage: Damage,
    timing: Timing,
    waiting: VecDeque<Packet>,
    /// A frame that is sent after the next one.
    later: Option<(Frame, Done)>,
    summary: DeviceSummary,
    /// Begin of the play by the steady clock, s.
    begun_s: f64,
    /// Places in the list of times without the device.
    leaves: usize,
    away: bool,
    cut_next: bool,
    /// When the next hello is sent unasked, s; infinite once the computer has written.
    next_hello: f64,
}

/// Longest sleep before connections, commands and the end are looked at.
const NAP: f64 = 2e-3;
/// Time between looks for connections, s.
const LOOK: f64 = 5e-3;
/// Time between two hellos, s.
const HELLO: f64 = 1.0;
/// What a computer writes to ask for one.
const HELLO_ASKED: u8 = b'?';

impl Device {
    /// Opens the wire; the frames of `player` are encoded by `encoder`.
    ///
    /// # Errors
    /// [`DeviceError`] when the wire, the truth or the commands cannot be opened.
    pub fn open(
        player: Player,
        encoder: Box<dyn Encode>,
        options: DeviceOptions,
    ) -> Result<Self, DeviceError> {
        let outlet = outlet::open(&options.place)?;
        let control = options.control.as_ref().map(control::listen).transpose()?;
        let (commands, control_name) = control.unzip();
        let truth = options.truth.as_ref();
        let truth = truth.map(|path| Truth::create(path, options.replace_files));
        Ok(Self {
            damage: Damage::new(&options.faults, options.seed),
            timing: Timing::new(&options.faults, options.seed),
            truth: truth.transpose()?,
            player,
            encoder,
            outlet,
            commands,
            control_name,
            options,
            waiting: VecDeque::new(),
            later: None,
            summary: DeviceSummary::default(),
            begun_s: 0.0,
            leaves: 0,
            away: false,
            cut_next: false,
            next_hello: 0.0,
        })
    }

    /// Name of the port, for those who want to connect.
    pub fn name(&self) -> String {
        self.outlet.name()
    }

    /// Where commands are taken.
    pub fn control_name(&self) -> Option<&str> {
        self.control_name.as_deref()
    }

    /// Plays from the first connection on until the source ends, `frames` are done, nobody reads the standard output any
    /// more, or `interrupt`.
    ///
    /// # Errors
    /// [`DeviceError`] when the wire, the truth or the source fails.
    pub fn run(mut self, interrupt: &Interrupt) -> Result<DeviceSummary, DeviceError> {
        let played = self.play(interrupt);
        if let Some(truth) = &mut self.truth {
            truth.flush()?;
        }
        played.map(|()| self.summary)
    }

    fn play(&mut self, interrupt: &Interrupt) -> Result<(), DeviceError> {
        // What is played begins when somebody is there: a script begins untouched, and a rest
        // capture needs that.
        while !self.outlet.connected() && !interrupt.asked() {
            self.look(0.0)?;
            std::thread::sleep(Duration::from_secs_f64(LOOK));
        }
        let start = Instant::now();
        self.begun_s = crate::lsl::stamp(start);
        let now = || start.elapsed().as_secs_f64();
        let period = self.options.rate.recip();
        let mut next_look = 0.0;
        let mut taken = 0_u64;
        let mut ended = false;
        while !(interrupt.asked() || ended && self.waiting.is_empty()) {
            let time = now();
            if time >= next_look {
                next_look = time + LOOK;
                self.look(time)?;
            }
            while !ended && taken as f64 * period <= now() {
                ended = self.options.frames.is_some_and(|frames| taken >= frames)
                    || !self.take(taken, period)?;
                taken += 1;
            }
            if !self.send(now())? {
                return Ok(());
            }
            let due = self
                .waiting
                .front()
                .map_or(f64::INFINITY, |packet| packet.leaves);
            let frame = if ended {
                f64::INFINITY
            } else {
                taken as f64 * period
            };
            let wait = (due.min(frame) - now()).min(NAP);
            if wait > 0.0 {
                std::thread::sleep(Duration::from_secs_f64(wait));
            }
        }
        Ok(())
    }

    /// Looks after connections, commands and times without the device.
    fn look(&mut self, time: f64) -> Result<(), DeviceError> {
        let wire = |name: String| move |cause| DeviceError::Wire { name, cause };
        let leave = self.options.faults.link.leave.get(self.leaves).copied();
        if let Some(leave) = leave {
            if !self.away && time >= leave.at {
                self.outlet.leave();
                self.away = true;
            } else if self.away && time >= leave.at + leave.duration {
                let name = self.outlet.name();
                self.outlet.come_back().map_err(wire(name))?;
                self.away = false;
                self.leaves += 1;
            }
        }
        let name = self.outlet.name();
        let new = self.outlet.connections().map_err(wire(name))?;
        if new > 0 {
            self.summary.connects += new as u64;
            self.cut_next = self.options.faults.link.half_packet_first;
            let banner = self.options.faults.link.banner.clone();
            self.put(banner.as_bytes())?;
            self.next_hello = time;
        }
        self.greet(time)?;
        self.obey();
        Ok(())
    }

    /// Says hello once a second until the computer writes, and when it asks.
    fn greet(&mut self, time: f64) -> Result<(), DeviceError> {
        let heard = self.outlet.heard();
        if !heard.is_empty() {
            self.next_hello = f64::INFINITY;
        }
        let due = time >= self.next_hello && self.outlet.connected();
        if due {
            self.next_hello = time + HELLO;
        }
        match self.options.hello.clone() {
            Some(hello) if due || heard.contains(&HELLO_ASKED) => self.put(&hello).map(drop),
            _ => Ok(()),
        }
    }

    fn obey(&mut self) {
        let Some(commands) = &self.commands else {
            return;
        };
        loop {
            match commands.try_recv() {
                Ok(command) => match &mut self.player {
                    Player::Twin(twin) => {
                        twin.press(&command.press);
                        command.done(twin.next_sequence());
                    }
                    Player::Source(_) => command.refused("a recording cannot be moved"),
                },
                Err(TryRecvError::Empty) => return,
                Err(TryRecvError::Disconnected) => {
                    self.commands = None;
                    return;
                }
            }
        }
    }

    /// Takes the frame of place `taken`; false at the end.
    fn take(&mut self, taken: u64, period: f64) -> Result<bool, DeviceError> {
        // A command is in force from the next frame on.
        self.obey();
        let frame = match &mut self.player {
            Player::Twin(twin) => match twin.next_delivery() {
                Delivery::Frame(frame) => Some(frame),
                Delivery::Nothing(_) => None,
            },
            Player::Source(source) => loop {
                match source.next()? {
                    Next::Frame(frame) => break Some(frame),
                    Next::Nothing(_) => break None,
                    // They lie between two frames.
                    Next::Reconnected | Next::Rest(_) => {}
                    Next::End => return Ok(false),
                }
            },
        };
        let time = taken as f64 * period;
        let device_time_ns = self.timing.device_time_ns(time);
        let Some(mut frame) = frame else {
            return Ok(true);
        };
        self.summary.frames += 1;
        let mut done = Done {
            sequence: frame.sequence,
            time_s: time,
            steady_s: self.begun_s + time,
            device_time_ns,
            ..Done::default()
        };
        frame.time_ns = device_time_ns;
        if let Some(counter) = self.damage.counter(frame.sequence) {
            done.counter = Some(counter);
            frame.sequence = counter;
        }
        match self.damage.fate() {
            Fate::Lost => {
                done.lost = true;
                self.note(&done)?;
                return Ok(true);
            }
            Fate::Swapped if self.later.is_none() => {
                done.swapped = true;
                self.later = Some((frame, done));
                return Ok(true);
            }
            Fate::Repeated => {
                done.repeated = true;
                self.encode(&frame, done.clone(), time, period)?;
                self.encode(&frame, done, time, period)?;
            }
            Fate::Sent | Fate::Swapped => self.encode(&frame, done, time, period)?,
        }
        if let Some((frame, done)) = self.later.take() {
            self.encode(&frame, done, time, period)?;
        }
        Ok(true)
    }

    /// Puts a frame on its way.
    fn encode(
        &mut self,
        frame: &Frame,
        mut done: Done,
        time: f64,
        period: f64,
    ) -> Result<(), DeviceError> {
        let stuck = self
            .options
            .faults
            .link
            .stuck
            .is_some_and(|stuck| time >= stuck.at);
        if stuck || self.away || !self.outlet.connected() {
            done.unsent = true;
            return self.note(&done);
        }
        let mut bytes = Vec::new();
        self.encoder.encode(frame, &mut bytes);
        if std::mem::take(&mut self.cut_next) {
            bytes.drain(..bytes.len() / 2);
            done.cut = true;
        }
        self.damage.bytes(&mut bytes, self.options.rate, &mut done);
        let leaves = self.timing.leaves(time, period, bytes.len());
        done.sent_s = Some(leaves);
        self.summary.sent += 1;
        self.summary.damaged += u64::from(done.damaged());
        self.waiting.push_back(Packet { leaves, bytes });
        self.note(&done)
    }

    fn note(&mut self, done: &Done) -> Result<(), DeviceError> {
        match &mut self.truth {
            Some(truth) => truth.write(done),
            None => Ok(()),
        }
    }

    /// Sends what is due; false if nobody reads the standard output any more.
    fn send(&mut self, time: f64) -> Result<bool, DeviceError> {
        while self
            .waiting
            .front()
            .is_some_and(|packet| packet.leaves <= time)
        {
            let Some(packet) = self.waiting.pop_front() else {
                break;
            };
            if !self.put(&packet.bytes)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn put(&mut self, bytes: &[u8]) -> Result<bool, DeviceError> {
        let size = self.options.faults.time.chunks.unwrap_or(usize::MAX);
        for chunk in bytes.chunks(size) {
            match self.outlet.send(chunk) {
                Ok(()) => {}
                Err(error) if error.kind() == io::ErrorKind::BrokenPipe => return Ok(false),
                Err(cause) => {
                    let name = self.outlet.name();
                    return Err(DeviceError::Wire { name, cause });
                }
            }
        }
        Ok(true)
    }
}
