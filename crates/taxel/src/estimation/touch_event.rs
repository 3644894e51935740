//! Events of contacts: what began, changed and ended, and when.

use super::force_history::{Course, ForceHistory, HistoryOptions, Spread};
use super::motion::Matrix;
use super::tracking::MOST_TRACKS;
use super::{Certainty, Contact, Ending, State, Track, Tracker};

/// Kind of an event of a contact. The value of the event is in brackets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TouchEventKind {
    /// A contact began (its force, N).
    Touch,
    /// It lifted off (its last force, N).
    Release,
    /// It came off another one (its force, N).
    Split {
        /// The track it came off.
        parent: u64,
    },
    /// It became one with another one (its last force, N).
    Merged {
        /// The track that goes on.
        into: u64,
    },
    /// The force went from one held value to another (the change, N).
    Step,
    /// The force came and went (its peak, N).
    Impact {
        /// From 10 to 90 % of the peak, s.
        rise_time: f64,
    },
    /// The force comes and goes (the frequency, Hz).
    Cyclic {
        /// The smaller over the larger amplitude of coming and going; 1 for a
        /// load that returns to where it was.
        symmetry: f64,
    },
    /// It began to move (the speed over the first quarter of a second, m/s).
    Slip {
        /// Direction on the developed surface, a unit vector; of a slip along
        /// the rows, whose part across them is not known, along x.
        direction: [f64; 2],
        /// Correlation of the signals along the rows, at most 1, where that
        /// showed the slip ([`super::SlipEstimator`]).
        score: Option<f64>,
    },
    /// A reading is at the end of what can be read (the least force, N).
    Saturated,
    /// A gap or a channel has closed (the least force, N).
    Closed,
    /// The force has passed the full scale (the least force, N).
    Overload,
}

impl TouchEventKind {
    /// Name in messages and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Touch => "touch",
            Self::Release => "release",
            Self::Split { .. } => "split",
            Self::Merged { .. } => "merged",
            Self::Step => "step",
            Self::Impact { .. } => "impact",
            Self::Cyclic { .. } => "cyclic",
            Self::Slip { .. } => "slip",
            Self::Saturated => "saturated",
            Self::Closed => "closed",
            Self::Overload => "overload",
        }
    }
}

/// One event.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TouchEvent {
    /// Device time at which it is known, ns; of an end, when the contact was
    /// last observed.
    pub time_ns: u64,
    /// The track of the contact.
    pub contact: u64,
    /// Kind of the event.
    pub kind: TouchEventKind,
    /// Its value in the unit that the kind states.
    pub value: f64,
    /// Standard deviation of the value; `NaN` where the noise is not known.
    pub deviation: f64,
    /// How much the value says.
    pub certainty: Certainty,
}

/// Options of the events.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TouchEventOptions {
    /// Options of steps, impacts and cycles.
    pub history: HistoryOptions,
    /// True if steps, impacts and cycles are told; default yes.
    pub courses: bool,
    /// A contact slips above this many standard deviations of its speed;
    /// default 5.
    pub slip_deviations: f64,
    /// ... and above this speed, m/s; default 5 mm/s. Infinite where slip is
    /// observed by other means.
    pub slip_speed: f64,
    /// True if a reading at its end means a closed channel, as on crossing
    /// channels, rather than a board at its limit; default no.
    pub saturation_is_closure: bool,
}

impl Default for TouchEventOptions {
    fn default() -> Self {
        Self {
            history: HistoryOptions::default(),
            courses: true,
            slip_deviations: 5.0,
            slip_speed: 5e-3,
            saturation_is_closure: false,
        }
    }
}

/// Makes events of tracks; the same frames give the same events.
#[derive(Debug, Clone)]
pub struct TouchEvents {
    options: TouchEventOptions,
    watched: Vec<Watched>,
    /// Contacts that lifted off and may come back.
    left: Vec<Left>,
    events: Vec<TouchEvent>,
    last_ns: Option<u64>,
    /// True if frames are missing before this one: what was meanwhile is not known.
    paused: bool,
}

/// Memory of a track.
#[derive(Debug, Clone)]
struct Watched {
    id: u64,
    history: ForceHistory,
    force: [f64; 2],
    certainty: Certainty,
    spread: Spread,
    /// When the force was no more than a bound last, ns.
    bounded_ns: Option<u64>,
    anchor: Option<Anchor>,
    /// Movement that the last anchor showed.
    drag: Option<Moved>,
    slips: bool,
    /// A slip that has begun, and whose speed is not measured yet.
    begun: Option<Begun>,
    bound: Option<State>,
}

/// Where a contact was when it began to move, and half of [`DRAG_NS`] later.
#[derive(Debug, Clone, Copy)]
struct Begun {
    at: Anchor,
    middle: Option<Anchor>,
}

/// Where a contact was some time ago.
#[derive(Debug, Clone, Copy)]
struct Anchor {
    time_ns: u64,
    position: [f64; 2],
    covariance: Matrix,
}

/// A velocity, m/s, and its covariance.
#[derive(Debug, Clone, Copy)]
struct Moved {
    velocity: [f64; 2],
    covariance: Matrix,
}

/// Memory of a contact that lifted off.
#[derive(Debug, Clone)]
struct Left {
    time_ns: u64,
    position: [f64; 2],
    history: ForceHistory,
}

/// A slow drag shows in how far a contact has come in this time, ns: its velocity
/// at one moment is known less well.
const DRAG_NS: u64 = 250_000_000;

impl TouchEvents {
    /// Without any contact.
    pub fn new(options: TouchEventOptions) -> Self {
        Self {
            options,
            watched: Vec::new(),
            left: Vec::new(),
            events: Vec::new(),
            last_ns: None,
            paused: false,
        }
    }

    /// Takes what the tracker made of the contacts of the frame at `time_ns`,
    /// and gives the events of this frame.
    pub fn push(&mut self, time_ns: u64, tracker: &Tracker, contacts: &[Contact]) -> &[TouchEvent] {
        self.events.clear();
        let last = self.last_ns.replace(time_ns).unwrap_or(time_ns);
        self.paused =
            time_ns.saturating_sub(last) as f64 * 1e-9 > self.options.history.longest_pause;
        if self.paused {
            self.left.clear();
        }
        let longest = self.options.history.longest_break;
        self.left
            .retain(|left| time_ns.saturating_sub(left.time_ns) as f64 * 1e-9 <= longest);
        for ended in tracker.ended() {
            self.end(&ended.track, ended.ending);
        }
        for track in tracker.tracks() {
            let contact = track.contact.and_then(|contact| contacts.get(contact));
            let Some(contact) = contact else { continue };
            // A force that two share belongs to neither.
            let shared = tracker
                .tracks()
                .iter()
                .any(|other| other.inside == Some(track.id));
            if shared {
                // Nor does their position.
                let watched = self.watched.iter_mut().find(|one| one.id == track.id);
                if let Some(watched) = watched {
                    (watched.anchor, watched.drag) = (None, None);
                }
            } else {
                self.observe(time_ns, track, contact);
            }
        }
        &self.events
    }

    /// Forgets all contacts.
    pub fn forget(&mut self) {
        self.watched.clear();
        self.left.clear();
        self.events.clear();
        self.last_ns = None;
    }

    fn end(&mut self, track: &Track, ending: Ending) {
        let Some(at) = self.watched.iter().position(|one| one.id == track.id) else {
            return;
        };
        let mut watched = self.watched.remove(at);
        let ([force, deviation], certainty) = (watched.force, watched.certainty);
        let seen = !self.paused && !force.is_nan();
        if ending == Ending::Released && self.options.courses && seen {
            // Gone: what came and went is an impact now.
            let courses = watched.history.push(track.seen_ns + 1, 0.0, watched.spread);
            let bounded = watched.is_bounded(track.seen_ns, &self.options);
            let events = courses.into_iter().flatten();
            self.events.extend(
                events.filter_map(|course| of_course(track.seen_ns, track.id, course, bounded)),
            );
            if self.left.len() == MOST_TRACKS {
                self.left.remove(0);
            }
            self.left.push(Left {
                time_ns: track.seen_ns,
                position: track.centre(),
                history: watched.history,
            });
        }
        let kind = match ending {
            Ending::Released => TouchEventKind::Release,
            Ending::MergedInto(into) => TouchEventKind::Merged { into },
        };
        self.note(track.seen_ns, track.id, kind, [force, deviation], certainty);
    }

    fn note(
        &mut self,
        time_ns: u64,
        contact: u64,
        kind: TouchEventKind,
        value: [f64; 2],
        certainty: Certainty,
    ) {
        self.events.push(TouchEvent {
            time_ns,
            contact,
            kind,
            value: value[0],
            deviation: value[1],
            certainty,
        });
    }

    /// The history of a contact that begins: that of the one that left its position.
    fn history(&mut self, time_ns: u64, contact: &Contact) -> ForceHistory {
        let near = (contact.area / contact.taxels as f64).sqrt();
        let [x, y] = contact.centre;
        let came_back = |left: &Left| (left.position[0] - x).hypot(left.position[1] - y) < near;
        match self.left.iter().rposition(came_back) {
            Some(at) => {
                let mut history = self.left.remove(at).history;
                history.resume(time_ns.saturating_sub(1));
                history
            }
            None if self.paused => {
                let force = contact.force[2];
                ForceHistory::after_pause(self.options.history, time_ns, force)
            }
            None => ForceHistory::new(self.options.history, time_ns),
        }
    }

    fn observe(&mut self, time_ns: u64, track: &Track, contact: &Contact) {
        let force = [contact.force[2], contact.force_covariance[2][2].sqrt()];
        // Of an unknown noise the shares decide.
        let known = |deviation: f64| if deviation.is_nan() { 0.0 } else { deviation };
        let spread = Spread {
            whole: known(force[1]),
            noise: known(contact.noise),
        };
        let known = self.watched.iter().position(|one| one.id == track.id);
        let at = known.unwrap_or_else(|| {
            let kind = match track.parent {
                Some(parent) => TouchEventKind::Split { parent },
                None => TouchEventKind::Touch,
            };
            self.note(time_ns, track.id, kind, force, contact.certainty);
            let history = self.history(time_ns, contact);
            self.watched.push(Watched {
                id: track.id,
                history,
                force,
                certainty: contact.certainty,
                spread,
                bounded_ns: None,
                anchor: None,
                drag: None,
                slips: false,
                begun: None,
                bound: None,
            });
            self.watched.len() - 1
        });
        let options = self.options;
        let watched = &mut self.watched[at];
        (watched.force, watched.certainty, watched.spread) = (force, contact.certainty, spread);
        if contact.certainty != Certainty::Exact {
            watched.bounded_ns = Some(time_ns);
        }
        let courses = if options.courses && !force[0].is_nan() {
            watched.history.push(time_ns, force[0], spread)
        } else {
            [None; 2]
        };
        let slip = watched.slip(time_ns, track, contact, &options);
        let bound = watched.bound(contact, &options);
        let bounded = watched.is_bounded(time_ns, &options);
        let events = courses.into_iter().flatten();
        self.events
            .extend(events.filter_map(|course| of_course(time_ns, track.id, course, bounded)));
        if let Some((kind, value)) = slip {
            self.note(time_ns, track.id, kind, value, Certainty::Exact);
        }
        if let Some(kind) = bound {
            self.note(time_ns, track.id, kind, force, contact.certainty);
        }
    }
}

impl Watched {
    /// True if a course that is known now is of forces some of which were no more than bounds.
    fn is_bounded(&self, time_ns: u64, options: &TouchEventOptions) -> bool {
        let long = options.history.longest_impact.max(options.history.dwell);
        let since = |bounded: u64| time_ns.saturating_sub(bounded) as f64 * 1e-9 <= long;
        self.bounded_ns.is_some_and(since)
    }

    /// The slip of a contact that has begun to move, which shows in its velocity now, or in how far it
    /// has come; its speed is that of the quarter of a second after.
    fn slip(
        &mut self,
        time_ns: u64,
        track: &Track,
        contact: &Contact,
        options: &TouchEventOptions,
    ) -> Option<(TouchEventKind, [f64; 2])> {
        self.follow_anchor(time_ns, track);
        let now = Moved {
            velocity: track.velocity(),
            covariance: track.velocity_covariance(),
        };
        // It ends at half the speed, so that it does not flicker.
        let share = if self.slips { 0.5 } else { 1.0 };
        let found = [Some(now), self.drag]
            .into_iter()
            .flatten()
            .filter_map(|moved| moved.along())
            .find(|(_, [speed, deviation])| {
                *speed > share * options.slip_speed.max(options.slip_deviations * deviation)
            });
        let began = found.is_some() && !self.slips;
        self.slips = found.is_some();
        let here = Anchor::of(time_ns, contact);
        if began {
            self.begun = Some(Begun {
                at: here,
                middle: None,
            });
            return None;
        }
        let begun = self.begun.as_mut()?;
        let elapsed = time_ns.saturating_sub(begun.at.time_ns);
        if elapsed < DRAG_NS && self.slips {
            if elapsed >= DRAG_NS / 2 {
                begun.middle.get_or_insert(here);
            }
            return None;
        }
        let Begun { at, middle } = self.begun.take()?;
        let (direction, [speed, deviation]) = at.moved_to(&here)?.along()?;
        // A speed that changes meanwhile is not known better than it changes.
        let change = middle.and_then(|middle| at.change(&middle, &here, direction));
        let deviation = (deviation * deviation + change.unwrap_or(speed * speed)).sqrt();
        let kind = TouchEventKind::Slip {
            direction,
            score: None,
        };
        Some((kind, [speed, deviation]))
    }

    fn follow_anchor(&mut self, time_ns: u64, track: &Track) {
        let here = Anchor {
            time_ns,
            position: track.centre(),
            covariance: track.centre_covariance(),
        };
        let anchor = self.anchor.get_or_insert(here);
        let elapsed = time_ns.saturating_sub(anchor.time_ns);
        if elapsed >= DRAG_NS {
            self.drag = anchor.moved_to(&here);
            self.anchor = Some(here);
        }
    }

    /// True if the contact comes to a bound.
    fn bound(&mut self, contact: &Contact, options: &TouchEventOptions) -> Option<TouchEventKind> {
        if std::mem::replace(&mut self.bound, contact.bound) == contact.bound {
            return None;
        }
        match contact.bound? {
            State::Closed => Some(TouchEventKind::Closed),
            State::Saturated if options.saturation_is_closure => Some(TouchEventKind::Closed),
            State::Saturated => Some(TouchEventKind::Saturated),
            State::OutOfRange if contact.certainty == Certainty::AtLeast => {
                Some(TouchEventKind::Overload)
            }
            _ => None,
        }
    }
}

impl Anchor {
    /// The position of a contact; where its noise is not known, it may be anywhere in a cell.
    fn of(time_ns: u64, contact: &Contact) -> Self {
        let [xx, xy, yy] = contact.covariance;
        let cell = contact.area / contact.taxels.max(1) as f64 / 12.0;
        let known = xx.is_finite() && xy.is_finite() && yy.is_finite();
        Self {
            time_ns,
            position: contact.centre,
            covariance: if known {
                [[xx, xy], [xy, yy]]
            } else {
                [[cell, 0.0], [0.0, cell]]
            },
        }
    }

    /// By how much the speed along `direction` changes on the way over `middle` to `end`, as the variance of
    /// a speed that grows evenly, (m/s)²: less that of the positions, which alone make one.
    fn change(&self, middle: &Self, end: &Self, direction: [f64; 2]) -> Option<f64> {
        let [early, late] = [self.moved_to(middle)?, middle.moved_to(end)?];
        let [from, to] = [early, late]
            .map(|moved| moved.velocity[0] * direction[0] + moved.velocity[1] * direction[1]);
        let times = [(self, middle), (middle, end)]
            .map(|(from, to)| to.time_ns.saturating_sub(from.time_ns) as f64 * 1e-9);
        let of = |covariance: &Matrix| along(direction, covariance);
        // The middle is in both.
        let shared = of(&middle.covariance) / (times[0] * times[1]);
        let by_positions = of(&early.covariance) + of(&late.covariance) + 2.0 * shared;
        Some((((to - from).powi(2) - by_positions) / 12.0).max(0.0))
    }

    /// The movement from here to a later position; none without a time between.
    fn moved_to(&self, later: &Self) -> Option<Moved> {
        let seconds = later.time_ns.saturating_sub(self.time_ns) as f64 * 1e-9;
        (seconds > 0.0).then(|| Moved {
            velocity: std::array::from_fn(|i| (later.position[i] - self.position[i]) / seconds),
            covariance: std::array::from_fn(|i| {
                std::array::from_fn(|j| {
                    (later.covariance[i][j] + self.covariance[i][j]) / (seconds * seconds)
                })
            }),
        })
    }
}

impl Moved {
    /// Direction, a unit vector, and speed with its deviation; none at rest.
    fn along(&self) -> Option<([f64; 2], [f64; 2])> {
        let [x, y] = self.velocity;
        let speed = x.hypot(y);
        if speed == 0.0 {
            return None;
        }
        let direction = [x / speed, y / speed];
        let variance = along(direction, &self.covariance);
        Some((direction, [speed, variance.sqrt()]))
    }
}

/// Variance along a direction.
fn along(direction: [f64; 2], covariance: &Matrix) -> f64 {
    (0..2)
        .flat_map(|i| (0..2).map(move |j| (i, j)))
        .map(|(i, j)| direction[i] * covariance[i][j] * direction[j])
        .sum()
}

/// The event of a course of forces some of which may be bounds: a peak is then a least one, and the
/// change from one force to another is not known.
fn of_course(time_ns: u64, contact: u64, course: Course, bounded: bool) -> Option<TouchEvent> {
    let certainty = match course {
        Course::Step { .. } if bounded => return None,
        Course::Impact { .. } if bounded => Certainty::AtLeast,
        _ => Certainty::Exact,
    };
    let (kind, value, deviation) = match course {
        Course::Step { change, deviation } => (TouchEventKind::Step, change, deviation),
        Course::Impact {
            rise_time,
            peak,
            deviation,
        } => (TouchEventKind::Impact { rise_time }, peak, deviation),
        Course::Cyclic {
            frequency,
            deviation,
            symmetry,
        } => (TouchEventKind::Cyclic { symmetry }, frequency, deviation),
    };
    Some(TouchEvent {
        time_ns,
        contact,
        kind,
        value,
        deviation,
        certainty,
    })
}

#[cfg(test)]
mod tests;
