//! Observer of what lasts over frames: tracks, events, slip and the health of channels,
//! from the touch of each frame, of any device.

use super::{
    Certainty, ChannelFacts, ChannelReading, HealthMonitor, HealthOptions, Slip, SlipEstimator,
    SlipOptions, State, Touch, TouchEvent, TouchEventKind, TouchEventOptions, TouchEvents, Track,
    Tracker, TrackerOptions,
};
use crate::acquisition::{Frame, Stream};
use crate::layout::Layout;

/// Which taxels a channel belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wiring {
    /// So many channels for each taxel, taxel by taxel.
    PerTaxel(usize),
    /// One channel for each row, then one for each column of taxels.
    Crossing {
        /// Rows of taxels.
        rows: usize,
        /// Columns of taxels.
        columns: usize,
    },
    /// Every channel reads what touches any of so many taxels.
    Shared {
        /// Taxels.
        taxels: usize,
    },
}

impl Wiring {
    /// The taxels of a channel, by index.
    pub fn taxels(self, channel: usize) -> impl Iterator<Item = usize> {
        let (first, step, count) = match self {
            Self::PerTaxel(channels) => (channel / channels.max(1), 1, 1),
            Self::Crossing { rows, columns } if channel < rows => (channel * columns, 1, columns),
            Self::Crossing { rows, columns } => (channel - rows, columns, rows),
            Self::Shared { taxels } => (0, 1, taxels),
        };
        (0..count).map(move |index| first + index * step)
    }

    /// Writes for each channel whether a contact is on any of its taxels;
    /// `regions` has the contact of each taxel.
    pub(super) fn mark_touched(self, regions: &[Option<u32>], touched: &mut [bool]) {
        if let Self::PerTaxel(channels) = self {
            for (touched, region) in touched.chunks_mut(channels.max(1)).zip(regions) {
                touched.fill(region.is_some());
            }
            return;
        }
        for (channel, touched) in touched.iter_mut().enumerate() {
            *touched = self
                .taxels(channel)
                .any(|taxel| regions.get(taxel).is_some_and(Option::is_some));
        }
    }
}

/// Options of an observer.
#[derive(Debug, Clone, PartialEq)]
pub struct ObserverOptions {
    /// Options of the tracker.
    pub tracker: TrackerOptions,
    /// Options of the events of contacts.
    pub events: TouchEventOptions,
    /// Options of the health of channels.
    pub health: HealthOptions,
    /// Options of the slip along rows, for a device whose signals show it; then the
    /// motion of contacts is not used.
    pub slip: Option<SlipOptions>,
}

/// Cells of unknown pitch are taken for this, m, where lengths count in cells.
const UNKNOWN_PITCH: f64 = 5e-3;
/// Periods of frames after which a pause counts as one.
const PAUSE_PERIODS: f64 = 2.5;

impl ObserverOptions {
    /// For frames as `stream` describes them. Without a pitch, lengths are in
    /// cells.
    pub fn new(stream: &Stream) -> Self {
        let mut events = TouchEventOptions::default();
        let history = &mut events.history;
        // Frames that are far apart are no pause.
        let pause = PAUSE_PERIODS * stream.period.unwrap_or(0.0);
        history.longest_pause = history.longest_pause.max(pause);
        let mut tracker = TrackerOptions::new(stream.pitch.map_or([1.0; 2], |[y, x]| [x, y]));
        tracker.longest_outage = tracker.longest_outage.max(pause);
        tracker.longest_crossing = tracker.longest_crossing.max(pause);
        if stream.pitch.is_none() {
            tracker.speed /= UNKNOWN_PITCH;
            tracker.acceleration /= UNKNOWN_PITCH * UNKNOWN_PITCH;
            events.slip_speed /= UNKNOWN_PITCH;
        }
        Self {
            tracker,
            events,
            health: HealthOptions::default(),
            slip: None,
        }
    }

    /// The same for taxels as `layout` places them.
    #[must_use]
    pub fn on(mut self, layout: &Layout) -> Self {
        self.tracker.pitch = layout.pitch;
        self
    }
}

/// Follows contacts and channels of one device over time; the same frames give
/// the same tracks, events and conditions.
#[derive(Debug, Clone)]
pub struct Observer {
    wiring: Wiring,
    tracker: Tracker,
    contacts: TouchEvents,
    rows: Option<RowSlip>,
    health: HealthMonitor,
    events: Vec<TouchEvent>,
    last_time_ns: Option<u64>,
}

impl Observer {
    /// Knows of no contact, and of nothing against any channel.
    /// `channels` says what is known of each, in the order and unit of a frame.
    pub fn new(options: ObserverOptions, channels: Vec<ChannelFacts>, wiring: Wiring) -> Self {
        let mut events = options.events;
        if options.slip.is_some() {
            events.slip_speed = f64::INFINITY;
        }
        Self {
            wiring,
            tracker: Tracker::new(options.tracker),
            contacts: TouchEvents::new(events),
            rows: options.slip.map(RowSlip::new),
            health: HealthMonitor::new(channels, options.health),
            events: Vec::new(),
            last_time_ns: None,
        }
    }

    /// True if a frame with a new number is the last one sent again, and must
    /// not be estimated ([`HealthMonitor::repeats`]).
    pub fn repeats(&self, frame: &Frame) -> bool {
        self.health.repeats(&frame.values)
    }

    /// Takes a frame and its touch, and gives its events.
    ///
    /// A time before that of the last frame is that of a device which began
    /// anew: its contacts are new ones.
    pub fn push(&mut self, frame: &Frame, touch: &Touch) -> &[TouchEvent] {
        let time_ns = frame.time_ns;
        let last = self.last_time_ns.replace(time_ns);
        if last.is_some_and(|last| time_ns < last) {
            self.forget();
        }
        self.tracker.push(time_ns, &touch.contacts, &touch.regions);
        self.events.clear();
        let of_contacts = self.contacts.push(time_ns, &self.tracker, &touch.contacts);
        self.events.extend_from_slice(of_contacts);
        if let Some(rows) = &mut self.rows {
            let event = rows.push(frame, &self.tracker);
            self.events.extend(event);
        }
        let occupied = |taxel: usize| {
            // Where the value is not known there may be a contact.
            let certain = |state| matches!(state, State::Ok | State::Unchecked);
            let taxels = touch.taxels.get(taxel);
            touch.regions.get(taxel).is_some_and(Option::is_some)
                || !taxels.is_some_and(|taxel| certain(taxel.state))
        };
        let wiring = self.wiring;
        let residual = |channel: usize| match wiring {
            Wiring::PerTaxel(channels) => touch
                .taxels
                .get(channel / channels.max(1))
                .map_or(f64::NAN, |taxel| taxel.residual),
            Wiring::Shared { .. } => {
                let residuals = &touch.channels.residuals;
                residuals.get(channel).copied().unwrap_or(f64::NAN)
            }
            Wiring::Crossing { .. } => f64::NAN,
        };
        self.health.push(time_ns, |channel| ChannelReading {
            value: frame.values.get(channel).copied().unwrap_or(f64::NAN),
            residual: residual(channel),
            occupied: wiring.taxels(channel).any(occupied),
        });
        &self.events
    }

    /// Takes a frame of a rest capture: nothing touches the device, and its
    /// rest values are not yet those that say whether readings agree.
    pub fn push_at_rest(&mut self, frame: &Frame) {
        self.forget();
        self.last_time_ns = Some(frame.time_ns);
        self.health.push(frame.time_ns, |channel| ChannelReading {
            value: frame.values.get(channel).copied().unwrap_or(f64::NAN),
            residual: f64::NAN,
            occupied: false,
        });
    }

    /// Forgets contacts, as after new rest values. Those that remain are new ones.
    pub fn forget(&mut self) {
        self.tracker.forget();
        self.contacts.forget();
        self.events.clear();
        if let Some(rows) = &mut self.rows {
            rows.forget();
        }
    }

    /// Tracks that live, the oldest first.
    pub fn tracks(&self) -> &[Track] {
        self.tracker.tracks()
    }

    /// The track of a contact of the last frame.
    pub fn track_of(&self, contact: usize) -> Option<&Track> {
        let holds = |track: &&Track| track.contact == Some(contact);
        self.tracks().iter().find(holds)
    }

    /// Events of the last frame.
    pub fn events(&self) -> &[TouchEvent] {
        &self.events
    }

    /// Takes what is known of the channels now.
    pub(super) fn set_facts(&mut self, facts: &[ChannelFacts]) {
        self.health.set_facts(facts);
    }

    /// Condition of each channel.
    pub fn health(&self) -> &HealthMonitor {
        &self.health
    }

    /// Which taxels the channels belong to.
    pub fn wiring(&self) -> Wiring {
        self.wiring
    }
}

/// Slip along rows as an event: reported when it begins or turns round.
#[derive(Debug, Clone)]
struct RowSlip {
    estimator: SlipEstimator,
    window_ns: u64,
    next_ns: u64,
    /// When a contact was there last, ns.
    touched_ns: Option<u64>,
    /// Velocity that the last look found, m/s.
    found: Option<f64>,
    /// Sign of the velocity of the slip that goes on.
    sign: Option<f64>,
}

/// The slip is looked for so many times in a window ...
const LOOKS: u64 = 8;
/// ... and reported when two looks in a row agree within this share.
const AGREES: f64 = 0.05;

impl RowSlip {
    fn new(options: SlipOptions) -> Self {
        Self {
            window_ns: (options.window * 1e9) as u64,
            estimator: SlipEstimator::new(options),
            next_ns: 0,
            touched_ns: None,
            found: None,
            sign: None,
        }
    }

    fn forget(&mut self) {
        self.estimator.forget();
        (self.next_ns, self.touched_ns) = (0, None);
        (self.found, self.sign) = (None, None);
    }

    fn push(&mut self, frame: &Frame, tracker: &Tracker) -> Option<TouchEvent> {
        let time_ns = frame.time_ns;
        self.estimator.push(time_ns, &frame.values);
        let track = tracker.tracks().first();
        if track.is_some() {
            self.touched_ns = Some(time_ns);
        }
        if time_ns < self.next_ns {
            return None;
        }
        self.next_ns = time_ns + self.window_ns / LOOKS;
        // Without a contact in the window there is nothing but noise.
        let touched = self.touched_ns?;
        let slip = (time_ns - touched < self.window_ns)
            .then(|| self.estimator.estimate())
            .flatten();
        let before = std::mem::replace(&mut self.found, slip.map(|slip| slip.velocity));
        let Some(slip) = slip else {
            self.sign = None;
            return None;
        };
        // What has only just entered the window may still look faster or slower.
        let agrees = before.is_some_and(|before| (slip.velocity / before - 1.0).abs() < AGREES);
        let sign = Some(slip.velocity.signum());
        let begins = agrees && self.sign != sign;
        if begins {
            self.sign = sign;
        }
        begins.then(|| event(time_ns, track, &slip))
    }
}

/// The slip of a row belongs to the oldest contact; zero is none.
fn event(time_ns: u64, track: Option<&Track>, slip: &Slip) -> TouchEvent {
    TouchEvent {
        time_ns,
        contact: track.map_or(0, |track| track.id),
        kind: TouchEventKind::Slip {
            direction: [slip.velocity.signum(), 0.0],
            score: Some(slip.score),
        },
        value: slip.velocity.abs(),
        deviation: slip.deviation,
        certainty: Certainty::Exact,
    }
}
