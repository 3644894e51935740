//! The simulated twin: stimulus -> device -> front end -> frames. An ordinary
//! source of frames.

use super::stimulus::{Finger, FingerPoint, Script};
use super::{Frame, Stimulus, Stream};
use crate::layout::Layout;
use crate::sensor::NoModel;
use crate::sensor::Sensor;
use taxel_numerics::Noise;

/// One piece of fabrication of a device, with whatever it remembers of its
/// loads.
pub trait Simulated: Send {
    /// Meaning of its frames; the twin fills in the name.
    fn stream(&self) -> Stream;

    /// Codes of all channels of the frame that starts at `start`, s, in the
    /// order of a frame. Times of calls only grow.
    fn scan(&mut self, script: &Script<'_>, start: f64, noise: &mut Noise) -> Vec<f64>;

    /// True force x, y, pressing on each taxel in the frame that starts at
    /// `start`, s, N.
    fn true_forces(&self, script: &Script<'_>, start: f64) -> Vec<[f64; 3]>;
}

/// A simulated device under a stimulus; the same seed gives the same frames.
pub struct Twin {
    piece: Box<dyn Simulated>,
    stream: Stream,
    period: f64,
    layout: Layout,
    stimulus: Stimulus,
    noise: Noise,
    sequence: u64,
    doubled: Option<Frame>,
}

/// Next delivery of the twin.
#[derive(Debug, Clone, PartialEq)]
pub enum Delivery {
    /// A frame arrives.
    Frame(Frame),
    /// A frame was taken, at this device time in ns, but does not arrive.
    Nothing(u64),
}

/// The truth behind a frame, for tests and for learning: force on each taxel
/// x, y, pressing, N.
pub type TrueForces = Vec<[f64; 3]>;

/// Something round that presses on the twin from now on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Press {
    /// Centre on the developed surface, m.
    pub at: [f64; 2],
    /// Total force x, y, pressing, N.
    pub force: [f64; 3],
    /// Radius of the patch, m.
    pub radius: f64,
}

impl Twin {
    /// The device that `sensor` describes, as one piece of its fabrication,
    /// under `stimulus`. `seed` is the seed of the noise.
    ///
    /// # Errors
    /// A sentence for people when the script does not fit the device.
    pub fn new(sensor: &Sensor, stimulus: &Stimulus, seed: u64) -> Result<Self, String> {
        let piece = sensor
            .device()
            .map_err(|unreadable| unreadable.to_string())?
            .simulated()
            .ok_or_else(|| {
                let element = sensor.element.key();
                NoModel { element }.to_string()
            })?;
        Self::of_piece(piece, sensor, stimulus, seed)
    }

    /// The same with this piece of the fabrication of `sensor`.
    ///
    /// # Errors
    /// A sentence for people when the script does not fit the device.
    pub fn of_piece(
        piece: Box<dyn Simulated>,
        sensor: &Sensor,
        stimulus: &Stimulus,
        seed: u64,
    ) -> Result<Self, String> {
        let layout = sensor.layout();
        stimulus.fits(&layout)?;
        Ok(Self {
            stream: Stream {
                name: sensor.name.clone(),
                ..piece.stream()
            },
            period: sensor.electronics.period(),
            piece,
            layout,
            stimulus: stimulus.clone(),
            noise: Noise::seeded(seed),
            sequence: 0,
            doubled: None,
        })
    }

    /// Meaning of the frames.
    pub fn stream(&self) -> Stream {
        self.stream.clone()
    }

    /// True force on each taxel in the frame that starts at `time_ns`, N.
    pub fn true_forces(&self, time_ns: u64) -> TrueForces {
        let script = Script::new(&self.stimulus, &self.layout);
        self.piece.true_forces(&script, time_ns as f64 * 1e-9)
    }

    /// Number of the next frame.
    pub fn next_sequence(&self) -> u64 {
        self.sequence
    }

    /// From the next frame on `press` is in force, and nothing else, until the next one.
    pub fn press(&mut self, press: &Press) {
        self.stimulus.probe.clear();
        self.stimulus.slider.clear();
        let point = |time: f64| FingerPoint {
            time,
            at: press.at,
            force: press.force,
        };
        self.stimulus.finger = vec![Finger {
            radius: press.radius,
            path: vec![point(0.0), point(self.stimulus.duration)],
        }];
    }

    /// Takes the next frame.
    pub fn next_delivery(&mut self) -> Delivery {
        if let Some(frame) = self.doubled.take() {
            return Delivery::Frame(frame);
        }
        let sequence = self.sequence;
        self.sequence += 1;
        let start = sequence as f64 * self.period;
        let time_ns = (start * 1e9).round() as u64;
        let script = Script::new(&self.stimulus, &self.layout);
        let values = self.piece.scan(&script, start, &mut self.noise);
        let nth = |every: u64| every > 0 && (sequence + 1).is_multiple_of(every);
        let link = self.stimulus.link;
        if script.silent(start) || nth(link.lose_every) {
            return Delivery::Nothing(time_ns);
        }
        let frame = Frame {
            sequence,
            time_ns,
            values,
            ..Frame::default()
        };
        if nth(link.double_every) {
            self.doubled = Some(frame.clone());
        }
        Delivery::Frame(frame)
    }
}
