//! Events of contacts: what began, changed and ended, and when.

use super::force_history::{Course, ForceHistory, HistoryOptions};
use super::{Contact, Ending, State, Track, Tracker};

/// What happened to a contact. The value of the event is in brackets.
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
    /// It began to move (the speed, m/s).
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
    Collapsed,
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
            Self::Collapsed => "collapsed",
        }
    }
}

/// One event.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TouchEvent {
    /// Device time at which it is known, ns; of an end, when the contact was
    /// last felt.
    pub time_ns: u64,
    /// The track of the contact.
    pub contact: u64,
    /// What happened.
    pub kind: TouchEventKind,
    /// Its value in the unit that the kind states.
    pub value: f64,
    /// Standard deviation of the value; `NaN` where the noise is not known.
    pub deviation: f64,
}

/// Options of the events.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TouchEventOptions {
    /// Of steps, impacts and cycles.
    pub history: HistoryOptions,
    /// A contact slips above this many standard deviations of its speed;
    /// default 5.
    pub slip_deviations: f64,
    /// ... and above this speed, m/s; default 5 mm/s. Infinite where slip is
    /// told by other means.
    pub slip_speed: f64,
    /// Whether a reading at its end means a closed channel, as on crossing
    /// channels, rather than a board at its limit; default no.
    pub saturation_is_closure: bool,
}

impl Default for TouchEventOptions {
    fn default() -> Self {
        Self {
            history: HistoryOptions::default(),
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
    events: Vec<TouchEvent>,
}

/// What is remembered of a track.
#[derive(Debug, Clone)]
struct Watched {
    id: u64,
    history: ForceHistory,
    force: [f64; 2],
    slips: bool,
    bound: Option<State>,
}

impl TouchEvents {
    /// Without any contact.
    pub fn new(options: TouchEventOptions) -> Self {
        Self {
            options,
            watched: Vec::new(),
            events: Vec::new(),
        }
    }

    /// Takes what the tracker made of the contacts of the frame at `time_ns`,
    /// and gives the events of this frame.
    pub fn push(&mut self, time_ns: u64, tracker: &Tracker, contacts: &[Contact]) -> &[TouchEvent] {
        self.events.clear();
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
            if !shared {
                self.feel(time_ns, track, contact);
            }
        }
        &self.events
    }

    /// Forgets all contacts.
    pub fn forget(&mut self) {
        self.watched.clear();
        self.events.clear();
    }

    fn end(&mut self, track: &Track, ending: Ending) {
        let Some(at) = self.watched.iter().position(|one| one.id == track.id) else {
            return;
        };
        let mut watched = self.watched.remove(at);
        let [force, deviation] = watched.force;
        if ending == Ending::Released {
            // Gone: what came and went is an impact now.
            let courses = watched.history.push(track.seen_ns + 1, 0.0, deviation);
            for course in courses.into_iter().flatten() {
                self.events.push(of_course(track.seen_ns, track.id, course));
            }
        }
        let kind = match ending {
            Ending::Released => TouchEventKind::Release,
            Ending::MergedInto(into) => TouchEventKind::Merged { into },
        };
        self.note(track.seen_ns, track.id, kind, [force, deviation]);
    }

    fn note(&mut self, time_ns: u64, contact: u64, kind: TouchEventKind, value: [f64; 2]) {
        self.events.push(TouchEvent {
            time_ns,
            contact,
            kind,
            value: value[0],
            deviation: value[1],
        });
    }

    fn feel(&mut self, time_ns: u64, track: &Track, contact: &Contact) {
        let force = [contact.force[2], contact.force_covariance[2][2].sqrt()];
        let known = self.watched.iter().position(|one| one.id == track.id);
        let at = known.unwrap_or_else(|| {
            let kind = match track.parent {
                Some(parent) => TouchEventKind::Split { parent },
                None => TouchEventKind::Touch,
            };
            self.note(time_ns, track.id, kind, force);
            self.watched.push(Watched {
                id: track.id,
                history: ForceHistory::new(self.options.history, time_ns),
                force,
                slips: false,
                bound: None,
            });
            self.watched.len() - 1
        });
        let options = self.options;
        let watched = &mut self.watched[at];
        watched.force = force;
        // Of an unknown noise the shares decide.
        let noise = if force[1].is_nan() { 0.0 } else { force[1] };
        let courses = watched.history.push(time_ns, force[0], noise);
        let slip = watched.slip(track, &options);
        let bound = watched.bound(contact, &options);
        for course in courses.into_iter().flatten() {
            self.events.push(of_course(time_ns, track.id, course));
        }
        if let Some((kind, value)) = slip {
            self.note(time_ns, track.id, kind, value);
        }
        if let Some(kind) = bound {
            self.note(time_ns, track.id, kind, force);
        }
    }
}

impl Watched {
    /// Whether the contact begins to move.
    fn slip(
        &mut self,
        track: &Track,
        options: &TouchEventOptions,
    ) -> Option<(TouchEventKind, [f64; 2])> {
        let [x, y] = track.velocity();
        let speed = x.hypot(y);
        if speed == 0.0 {
            self.slips = false;
            return None;
        }
        let direction = [x / speed, y / speed];
        let covariance = track.velocity_covariance();
        let variance: f64 = (0..2)
            .flat_map(|i| (0..2).map(move |j| (i, j)))
            .map(|(i, j)| direction[i] * covariance[i][j] * direction[j])
            .sum();
        let deviation = variance.sqrt();
        let least = options.slip_speed.max(options.slip_deviations * deviation);
        // It ends at half the speed, so that it does not flicker.
        let began = !self.slips && speed > least;
        self.slips = speed > if self.slips { 0.5 * least } else { least };
        let kind = TouchEventKind::Slip {
            direction,
            score: None,
        };
        began.then_some((kind, [speed, deviation]))
    }

    /// Whether the contact comes to a bound.
    fn bound(&mut self, contact: &Contact, options: &TouchEventOptions) -> Option<TouchEventKind> {
        if std::mem::replace(&mut self.bound, contact.bound) == contact.bound {
            return None;
        }
        match contact.bound? {
            State::Contact => Some(TouchEventKind::Collapsed),
            State::Saturated if options.saturation_is_closure => Some(TouchEventKind::Collapsed),
            State::Saturated => Some(TouchEventKind::Saturated),
            _ => None,
        }
    }
}

fn of_course(time_ns: u64, contact: u64, course: Course) -> TouchEvent {
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
    TouchEvent {
        time_ns,
        contact,
        kind,
        value,
        deviation,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimation::TrackerOptions;
    use crate::estimation::contact::{Cell, Gathering, normal_only};

    fn contact(x: f64, force: f64, state: State) -> Contact {
        let mut gathering = Gathering::default();
        let cell = Cell {
            position: [x, 0.0],
            weight: force,
            deviation: 1e-3,
            threshold: 6e-3,
            force: [0.0, 0.0, force],
            force_covariance: normal_only(1e-3),
            state,
        };
        gathering.add(0, &cell);
        gathering.settle();
        gathering.finish([1e-3; 2])
    }

    /// Events of one contact, given by place and force each millisecond; no
    /// contact where the force is zero.
    fn events(milliseconds: u64, at: impl Fn(f64) -> (f64, f64, State)) -> Vec<TouchEvent> {
        let mut tracker = Tracker::new(TrackerOptions::new([1e-3; 2]));
        let mut events = TouchEvents::new(TouchEventOptions::default());
        let mut all = Vec::new();
        for time in 0..milliseconds {
            let (x, force, state) = at(time as f64 * 1e-3);
            let contacts: Vec<_> = (force > 0.0)
                .then(|| contact(x, force, state))
                .into_iter()
                .collect();
            let regions = [(!contacts.is_empty()).then_some(0)];
            tracker.push(time * 1_000_000, &contacts, &regions);
            all.extend_from_slice(events.push(time * 1_000_000, &tracker, &contacts));
        }
        all
    }

    fn names(events: &[TouchEvent]) -> Vec<&'static str> {
        events.iter().map(|event| event.kind.name()).collect()
    }

    #[test]
    fn a_press_is_touch_step_and_release_with_their_times() {
        let found = events(1500, |t| {
            (
                0.0,
                if (0.1..1.0).contains(&t) { 0.3 } else { 0.0 },
                State::Ok,
            )
        });
        assert_eq!(names(&found), ["touch", "step", "release"]);
        assert_eq!(found[0].time_ns, 100_000_000);
        assert_eq!(found[2].time_ns, 999_000_000);
        assert!((found[1].value - 0.3).abs() < 1e-12);
    }

    #[test]
    fn a_tap_is_an_impact() {
        let force = |t: f64| 0.3 * (1.0 - ((t - 0.2) / 0.1).powi(2)).max(0.0);
        let found = events(600, |t| (0.0, force(t), State::Ok));
        assert!(names(&found).contains(&"impact"), "{found:?}");
        assert!(!names(&found).contains(&"step"), "{found:?}");
    }

    #[test]
    fn a_moving_contact_slips_once_with_its_speed_and_direction() {
        let found = events(500, |t| (0.05 * (t - 0.2).max(0.0), 0.3, State::Ok));
        let slips: Vec<_> = found
            .iter()
            .filter(|event| event.kind.name() == "slip")
            .collect();
        assert_eq!(slips.len(), 1, "{found:?}");
        let TouchEventKind::Slip { direction, .. } = slips[0].kind else {
            panic!()
        };
        assert!(direction[0] > 0.9 && slips[0].time_ns > 200_000_000);
    }

    #[test]
    fn bounds_are_told_once() {
        let state = |t: f64| if t > 0.1 { State::Contact } else { State::Ok };
        let found = events(300, |t| (0.0, 0.3, state(t)));
        let count = names(&found)
            .iter()
            .filter(|name| **name == "collapsed")
            .count();
        assert_eq!(count, 1);
    }
}
