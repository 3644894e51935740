//! Contacts over time: which contact of this frame is which of the last one.

use super::assignment::Assignment;
use super::motion::{Matrix, Motion};
use super::{Contact, MOST_CONTACTS};

/// Most tracks that live at a time: those of a frame and as many that are missing. Of more,
/// those that are missing longest end.
pub(super) const MOST_TRACKS: usize = 2 * MOST_CONTACTS;

/// Options of the tracker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackerOptions {
    /// Spacing of the taxels x, y, m: the position of a contact of unknown noise
    /// is known to a cell.
    pub pitch: [f64; 2],
    /// Freedom of velocities to change: density of a white acceleration, m²/s³; default
    /// 0.001, 1 cm/s in a tenth of a second.
    pub acceleration: f64,
    /// Standard deviation of the speed of a new contact, m/s; default 0.1.
    pub speed: f64,
    /// Square of the Mahalanobis distance within which a contact may be the
    /// same; default 18.4, which one in 10⁴ true ones exceeds.
    pub gate: f64,
    /// A contact may be missing for this time, s; default 0.05. After a longer
    /// pause without any frame a contact that still covers taxels of the one
    /// before is the same.
    pub longest_outage: f64,
    /// Two contacts may be one for this time and still be distinguished after,
    /// s; default 0.3.
    pub longest_crossing: f64,
}

impl TrackerOptions {
    /// The defaults for an array of this pitch x, y, m.
    pub fn new(pitch: [f64; 2]) -> Self {
        Self {
            pitch,
            acceleration: 1e-3,
            speed: 0.1,
            gate: 18.4,
            longest_outage: 0.05,
            longest_crossing: 0.3,
        }
    }
}

/// A contact that lasts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Track {
    /// Its number; never given again.
    pub id: u64,
    /// The track that it came off, if it did.
    pub parent: Option<u64>,
    /// Index of its contact in this frame; `None` while it is missing or
    /// inside another one.
    pub contact: Option<usize>,
    /// The track whose contact it shares, while the two are one.
    pub inside: Option<u64>,
    /// When it began, ns.
    pub since_ns: u64,
    /// When it last had a contact, ns.
    pub seen_ns: u64,
    motion: Motion,
}

/// End of a track.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// Lifted off.
    Released,
    /// One with another track.
    MergedInto(u64),
}

/// A track that ended, known in this frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndedTrack {
    /// The track as it was last.
    pub track: Track,
    /// End of the track.
    pub ending: Ending,
}

impl Track {
    /// Filtered centre on the developed surface, m.
    pub fn centre(&self) -> [f64; 2] {
        self.motion.position
    }

    /// Covariance of the centre, m².
    pub fn centre_covariance(&self) -> [[f64; 2]; 2] {
        self.motion.place_covariance
    }

    /// Velocity on the developed surface, m/s.
    pub fn velocity(&self) -> [f64; 2] {
        self.motion.velocity
    }

    /// Covariance of the velocity, m²/s².
    pub fn velocity_covariance(&self) -> [[f64; 2]; 2] {
        self.motion.velocity_covariance
    }
}

/// Follows contacts from frame to frame; the same contacts give the same
/// tracks.
///
/// Positions are predicted with constant velocity and assigned at the least sum
/// of Mahalanobis distances. Taxels that two frames share hold a track too. A
/// track that vanishes inside the contact of another one waits there, and both
/// go on as they moved: when the two part in time, each keeps its identity.
#[derive(Debug, Clone)]
pub struct Tracker {
    options: TrackerOptions,
    assignment: Assignment,
    tracks: Vec<Track>,
    ended: Vec<EndedTrack>,
    /// Track of each taxel in the last frame.
    owners: Vec<Option<u64>>,
    /// Tracks of the last frame and the contacts of this one that share a taxel, in order.
    shared: Vec<(u64, u32)>,
    /// Track of each contact in this frame.
    holders: Vec<Option<u64>>,
    last_time_ns: Option<u64>,
    next_id: u64,
}

impl Tracker {
    /// A tracker that knows of no contact.
    pub fn new(options: TrackerOptions) -> Self {
        Self {
            options,
            assignment: Assignment::default(),
            tracks: Vec::new(),
            ended: Vec::new(),
            owners: Vec::new(),
            shared: Vec::new(),
            holders: Vec::new(),
            last_time_ns: None,
            next_id: 1,
        }
    }

    /// Tracks that live, the oldest first.
    pub fn tracks(&self) -> &[Track] {
        &self.tracks
    }

    /// Tracks that ended with the last frame.
    pub fn ended(&self) -> &[EndedTrack] {
        &self.ended
    }

    /// Takes the contacts of a frame; `regions` is the index of the contact of
    /// each taxel. A frame that is not newer than the last one changes nothing.
    pub fn push(&mut self, time_ns: u64, contacts: &[Contact], regions: &[Option<u32>]) {
        self.ended.clear();
        let last = self.last_time_ns.unwrap_or(time_ns);
        if time_ns < last || (time_ns == last && self.last_time_ns.is_some()) {
            return;
        }
        self.last_time_ns = Some(time_ns);
        self.owners.resize(regions.len(), None);
        let dt = (time_ns - last) as f64 * 1e-9;
        for track in &mut self.tracks {
            track.motion.predict(dt, self.options.acceleration);
        }
        let paused = dt > self.options.longest_outage;
        self.find_shared(regions);
        // What was missing for too long is not what comes now.
        self.end_late(time_ns, last);
        self.end_most();
        self.assign(contacts, paused);
        self.enter(contacts, regions);
        self.update(time_ns, contacts, paused);
        self.begin(time_ns, contacts, regions);
        for (owner, region) in self.owners.iter_mut().zip(regions) {
            *owner = region.and_then(|region| self.holders.get(region as usize).copied().flatten());
        }
    }

    /// Ends all tracks, as after a pause of unknown length.
    pub fn forget(&mut self) {
        self.tracks.clear();
        self.ended.clear();
        self.owners.fill(None);
        self.last_time_ns = None;
    }

    fn find_shared(&mut self, regions: &[Option<u32>]) {
        self.shared.clear();
        let pairs = self.owners.iter().zip(regions);
        self.shared
            .extend(pairs.filter_map(|(owner, region)| Some(((*owner)?, (*region)?))));
        self.shared.sort_unstable();
        self.shared.dedup();
    }

    fn end_late(&mut self, time_ns: u64, last_ns: u64) {
        let Self {
            tracks,
            ended,
            options,
            shared,
            ..
        } = self;
        // Nobody saw a contact lift off that is where it was in the last frame.
        let goes_on = |track: &Track| {
            let at = shared.partition_point(|(owner, _)| *owner < track.id);
            let covers = shared.get(at).is_some_and(|(owner, _)| *owner == track.id);
            track.seen_ns == last_ns && covers
        };
        tracks.retain(|track| {
            let missing = time_ns.saturating_sub(track.seen_ns) as f64 * 1e-9;
            let (longest, ending) = match track.inside {
                Some(other) => (options.longest_crossing, Ending::MergedInto(other)),
                None => (options.longest_outage, Ending::Released),
            };
            let late = missing > longest && !goes_on(track);
            if late {
                ended.push(EndedTrack {
                    track: *track,
                    ending,
                });
            }
            !late
        });
    }

    /// Ends what is missing longest where more are missing than a frame has contacts.
    fn end_most(&mut self) {
        while self.tracks.len() > MOST_CONTACTS {
            let longest = (0..self.tracks.len()).min_by_key(|at| self.tracks[*at].seen_ns);
            let track = self.tracks.remove(longest.unwrap_or(0));
            let ending = track.inside.map_or(Ending::Released, Ending::MergedInto);
            self.ended.push(EndedTrack { track, ending });
        }
    }

    fn assign(&mut self, contacts: &[Contact], paused: bool) {
        let gate = self.options.gate;
        let (tracks, shared, options) = (&self.tracks, &self.shared, &self.options);
        let cost = |row: usize, column: usize| {
            let (track, contact) = (&tracks[row], &contacts[column]);
            let distance = track
                .motion
                .distance(contact.centre, noise(contact, options));
            // A contact that jumped but still covers the same taxels. After a pause
            // a track may be anywhere, and only its taxels identify it.
            let shares = (paused || distance > gate)
                && shared.binary_search(&(track.id, column as u32)).is_ok();
            match (shares, paused) {
                (true, _) => distance.min(gate),
                (false, true) => f64::INFINITY,
                (false, false) => distance,
            }
        };
        let found = self
            .assignment
            .solve(tracks.len(), contacts.len(), gate, cost);
        self.holders.clear();
        self.holders.resize(contacts.len(), None);
        for (track, contact) in self.tracks.iter_mut().zip(found) {
            track.contact = *contact;
            if let Some(contact) = contact {
                track.inside = None;
                self.holders[*contact] = Some(track.id);
            }
        }
    }

    /// Lets a track without a contact wait in the one that took its taxels.
    fn enter(&mut self, contacts: &[Contact], regions: &[Option<u32>]) {
        for index in 0..self.tracks.len() {
            let track = &self.tracks[index];
            if track.contact.is_some() {
                continue;
            }
            let holds = |other: u64| self.holders.contains(&Some(other));
            let stays = track.inside.filter(|other| holds(*other));
            let taken = || {
                let id = Some(track.id);
                let mut shared = self
                    .owners
                    .iter()
                    .zip(regions)
                    .filter(|(owner, _)| **owner == id)
                    .filter_map(|(_, region)| *region);
                let region = shared.next()? as usize;
                (region < contacts.len())
                    .then(|| self.holders[region])
                    .flatten()
            };
            self.tracks[index].inside = stays.or_else(taken);
        }
    }

    fn update(&mut self, time_ns: u64, contacts: &[Contact], paused: bool) {
        let options = self.options;
        for index in 0..self.tracks.len() {
            let track = &self.tracks[index];
            let Some(contact) = track.contact.and_then(|contact| contacts.get(contact)) else {
                continue;
            };
            let id = Some(track.id);
            self.tracks[index].seen_ns = time_ns;
            // The centre of two contacts is that of neither.
            if self.tracks.iter().any(|other| other.inside == id) {
                continue;
            }
            let alone_again = self.ended.iter().any(
                |ended| matches!(ended.ending, Ending::MergedInto(other) if Some(other) == id),
            );
            let track = &mut self.tracks[index];
            let noise = noise(contact, &options);
            if alone_again || paused {
                track.motion = Motion::begin(contact.centre, noise, options.speed);
            } else {
                track.motion.update(contact.centre, noise);
            }
        }
    }

    fn begin(&mut self, time_ns: u64, contacts: &[Contact], regions: &[Option<u32>]) {
        for (index, contact) in contacts.iter().enumerate() {
            if self.holders[index].is_some() {
                continue;
            }
            let noise = noise(contact, &self.options);
            self.tracks.push(Track {
                id: self.next_id,
                parent: self.parent(index, regions),
                contact: Some(index),
                inside: None,
                since_ns: time_ns,
                seen_ns: time_ns,
                motion: Motion::begin(contact.centre, noise, self.options.speed),
            });
            self.holders[index] = Some(self.next_id);
            self.next_id += 1;
        }
    }

    /// The live track that had a taxel of this contact.
    fn parent(&self, contact: usize, regions: &[Option<u32>]) -> Option<u64> {
        self.owners
            .iter()
            .zip(regions)
            .filter(|(_, region)| **region == Some(contact as u32))
            .find_map(|(owner, _)| *owner)
            .filter(|owner| self.tracks.iter().any(|track| track.id == *owner))
    }
}

/// Covariance of the position of a contact.
fn noise(contact: &Contact, options: &TrackerOptions) -> Matrix {
    let [xx, xy, yy] = contact.covariance;
    let determinant = xx * yy - xy * xy;
    if determinant > 0.0 && determinant.is_finite() {
        [[xx, xy], [xy, yy]]
    } else {
        let [x, y] = options.pitch.map(|pitch| pitch * pitch / 12.0);
        [[x, 0.0], [0.0, y]]
    }
}

#[cfg(test)]
mod tests;
