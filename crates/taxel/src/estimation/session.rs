//! Estimator and observer of one device: frames to touch, contacts over time and events.

use super::array::{ArrayEstimator, Captured, FrameError};
use super::map::{MapOptions, MapReader};
use super::observer::{Observer, ObserverOptions};
use super::reader::{Meaning, Reader};
use super::rest::{Rest, RestRefused};
use super::touch::Touch;
use super::touch_event::TouchEvent;
use crate::acquisition::{Frame, Stream};

/// Estimates and observes the frames of one device, live or recorded.
pub struct TouchSession {
    estimator: ArrayEstimator,
    observer: Observer,
}

/// Result of one frame.
pub struct Observed<'a> {
    /// Touch on the array; contacts have their identity.
    pub touch: &'a Touch,
    /// Events of contacts.
    pub events: &'a [TouchEvent],
    /// End of a rest capture.
    pub captured: Captured,
}

impl TouchSession {
    /// The session of a device that `reader` reads; `options` say what is known
    /// of contacts and events on it.
    pub fn new(reader: Box<dyn Reader>, options: ObserverOptions) -> Self {
        let estimator = ArrayEstimator::new(reader);
        let (channels, wiring) = (estimator.channels().to_vec(), estimator.meaning().wiring);
        Self {
            observer: Observer::new(options, channels, wiring),
            estimator,
        }
    }

    /// A map that describes itself.
    pub fn map(stream: &Stream, options: &MapOptions) -> Self {
        let mut observed = ObserverOptions::new(stream);
        if !options.all_events {
            observed.events.courses = false;
            observed.events.slip_speed = f64::INFINITY;
        }
        let reader = MapReader::of_kinds(stream, &options.noise, &options.kinds);
        let reader = reader.named(&options.names).falling(options.falls);
        let mut session = Self::new(Box::new(reader), observed);
        session.set_steps(&options.steps);
        session
    }

    /// Says by which steps the wire gives the channels, in the unit of a frame: 0 for none, `NaN`
    /// where it is not known. A touch is more than two of them.
    pub fn set_steps(&mut self, steps: &[f64]) {
        self.estimator.set_steps(steps);
        self.observer.set_facts(self.estimator.channels());
    }

    /// Estimates and observes one frame. No contact is reported while a
    /// rest capture runs, and nothing is a force before the first one that the
    /// device needs has come to its end.
    ///
    /// # Errors
    /// [`FrameError`] for a frame of another device.
    pub fn push(&mut self, frame: &Frame) -> Result<Observed<'_>, FrameError> {
        let capturing = self.estimator.capturing();
        let (_, captured) = self.estimator.push(frame)?;
        if captured == Some(Ok(())) {
            self.observer.set_facts(self.estimator.channels());
        }
        // Training looks at the estimates of a rest capture; whoever else does, sees no force.
        if !self.estimator.touch().zero_known {
            self.estimator.touch_mut().say_nothing();
        }
        if capturing {
            self.observer.push_at_rest(frame);
        } else {
            self.observer.push(frame, self.estimator.touch());
        }
        for (index, contact) in self.estimator.touch_mut().contacts.iter_mut().enumerate() {
            if let Some(track) = self.observer.track_of(index) {
                (contact.id, contact.velocity) = (track.id, track.velocity());
            }
        }
        Ok(Observed {
            touch: self.estimator.touch(),
            events: self.observer.events(),
            captured,
        })
    }

    /// True if a frame with a new number is the last one sent again, and must
    /// not be used.
    pub fn repeats(&self, frame: &Frame) -> bool {
        self.observer.repeats(frame)
    }

    /// Meaning of readings and values.
    pub fn meaning(&self) -> &Meaning {
        self.estimator.meaning()
    }

    /// The estimator.
    pub fn estimator(&self) -> &ArrayEstimator {
        &self.estimator
    }

    /// Observer with all tracks and events so far.
    pub fn observer(&self) -> &Observer {
        &self.observer
    }

    /// Begins a rest capture over the next `frames` frames, whatever presses.
    pub fn begin_rest_capture(&mut self, frames: usize) {
        self.estimator.begin_rest_capture(frames);
    }

    /// Begins one that nobody asked for: it is refused if a taxel stands out from the others,
    /// and may be pressed.
    pub fn begin_unasked_rest_capture(&mut self, frames: usize) {
        self.estimator.begin_unasked_rest_capture(frames);
    }

    /// Why a rest capture would now declare a contact to be nothing; none where nothing
    /// presses, or before the first capture: beside the rest values of the drawing a piece
    /// of its fabrication may look touched.
    pub fn pressed(&self) -> Option<RestRefused> {
        if !self.estimator.is_tared() {
            return None;
        }
        let touch = self.estimator.touch();
        let contact = touch
            .contacts
            .iter()
            .max_by(|a, b| a.peak.total_cmp(&b.peak))?;
        let meaning = self.meaning();
        let columns = meaning.layout.columns;
        let force = match contact.force[2] {
            _ if meaning.newtons.is_none() => String::new(),
            force if force.is_nan() => String::new(),
            force if force < 1.0 => format!(" with {:.3} mN", 1e3 * force),
            force => format!(" with {force:.3} N"),
        };
        Some(RestRefused::Touched {
            contact: contact.id,
            row: contact.peak_taxel / columns,
            column: contact.peak_taxel % columns,
            force,
        })
    }

    /// True if the device needs a rest capture, and none is in force.
    pub fn needs_zero(&self) -> bool {
        self.estimator.needs_zero()
    }

    /// True if a rest capture is under way.
    pub fn capturing(&self) -> bool {
        self.estimator.capturing()
    }

    /// The rest values in force.
    pub fn rest(&self) -> Rest {
        self.estimator.rest()
    }

    /// Returns to the rest values of the calibration.
    pub fn clear_rest(&mut self) {
        self.estimator.clear_rest();
        self.observer.forget();
    }

    /// Puts back rest values of this device, bit for bit.
    pub fn restore_rest(&mut self, rest: &Rest) {
        self.estimator.restore_rest(rest);
        self.observer.forget();
    }
}
