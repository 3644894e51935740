use super::*;
use crate::estimation::Certainty;
use crate::estimation::Division;
use crate::estimation::State;
use crate::estimation::contact::{Cell, normal_only};
use crate::estimation::segmentation::Segmentation;

const COLUMNS: usize = 16;
const ROWS: usize = 9;

/// Pressures of soft balls on a grid of 1 mm, frame by frame.
struct Bench {
    tracker: Tracker,
    segmentation: Segmentation,
    contacts: Vec<Contact>,
    time_ns: u64,
}

impl Bench {
    fn new() -> Self {
        let pitch = [1e-3; 2];
        Self {
            tracker: Tracker::new(TrackerOptions::new(pitch)),
            segmentation: Segmentation::new(ROWS, COLUMNS, pitch, Division::Peaks),
            contacts: Vec::new(),
            time_ns: 0,
        }
    }

    /// A frame `milliseconds` later with balls at x, y in mm.
    fn frame(&mut self, milliseconds: u64, balls: &[[f64; 2]]) -> Vec<Track> {
        self.time_ns += milliseconds * 1_000_000;
        let cell = |index: usize| {
            let position = [(index % COLUMNS) as f64, (index / COLUMNS) as f64];
            let weight = balls
                .iter()
                .map(|ball| (position[0] - ball[0]).powi(2) + (position[1] - ball[1]).powi(2))
                .map(|square| (-square / 2.0).exp())
                .sum();
            Cell {
                position: position.map(|position| position * 1e-3),
                weight,
                deviation: 1e-3,
                threshold: 0.05,
                force: [0.0, 0.0, weight],
                force_covariance: normal_only(1e-3),
                certainty: Certainty::Exact,
                noise: 1e-3,
                state: State::Ok,
            }
        };
        let mut cells = (0..ROWS * COLUMNS).map(cell).collect();
        self.segmentation.run(&mut cells, &mut self.contacts);
        let mut regions = Vec::new();
        self.segmentation.label(&mut regions);
        self.tracker.push(self.time_ns, &self.contacts, &regions);
        self.tracker.tracks().to_vec()
    }
}

fn ids(tracks: &[Track]) -> Vec<u64> {
    tracks.iter().map(|track| track.id).collect()
}

#[test]
fn two_that_cross_keep_their_identity() {
    // Past each other at 1.5 mm and straight through each other.
    for apart in [1.5, 0.0] {
        let mut bench = Bench::new();
        let mut last = Vec::new();
        for step in 0..=240 {
            // 60 mm/s against 40 mm/s, a frame each millisecond.
            let t = f64::from(step) * 1e-3;
            let balls = [[1.0 + 60.0 * t, 4.0], [13.0 - 40.0 * t, 4.0 + apart]];
            last = bench.frame(1, &balls);
        }
        assert_eq!(ids(&last), [1, 2], "{apart}");
        assert!(last[0].velocity()[0] > 0.0 && last[1].velocity()[0] < 0.0);
        assert!(last[0].centre()[0] > last[1].centre()[0]);
    }
}

#[test]
fn a_child_has_its_parent_and_what_merges_says_into_what() {
    let mut bench = Bench::new();
    let mut position = 0.0;
    let mut moves = |bench: &mut Bench, by: f64| {
        position += by;
        bench.frame(20, &[[7.0 - position, 4.0], [7.0 + position, 4.0]])
    };
    assert_eq!(ids(&moves(&mut bench, 0.0)), [1]);
    let mut tracks = Vec::new();
    for _ in 0..40 {
        tracks = moves(&mut bench, 0.1);
    }
    assert_eq!(ids(&tracks), [1, 2]);
    assert_eq!(tracks[1].parent, Some(1));
    let mut ended = Vec::new();
    for _ in 0..40 {
        tracks = moves(&mut bench, -0.1);
        ended.extend_from_slice(bench.tracker.ended());
    }
    for _ in 0..20 {
        tracks = moves(&mut bench, 0.0);
        ended.extend_from_slice(bench.tracker.ended());
    }
    assert_eq!(tracks.len(), 1);
    assert_eq!(ended.len(), 1);
    let survivor = tracks[0].id;
    assert_eq!(ended[0].ending, Ending::MergedInto(survivor));
    assert!((tracks[0].centre()[0] - 7e-3).abs() < 0.1e-3);
}

#[test]
fn an_outage_is_bridged_if_it_is_short_or_the_contact_is_still_there() {
    let mut bench = Bench::new();
    let run = |bench: &mut Bench, from: f64| {
        let mut tracks = Vec::new();
        for step in 0..30 {
            tracks = bench.frame(1, &[[from + 0.05 * f64::from(step), 4.0]]);
        }
        tracks
    };
    assert_eq!(ids(&run(&mut bench, 2.0)), [1]);
    // 40 ms without a frame: it went on by 2 mm.
    bench.time_ns += 40_000_000;
    assert_eq!(ids(&run(&mut bench, 5.55)), [1]);
    // Frames without a contact for 30 ms.
    for _ in 0..30 {
        assert_eq!(bench.frame(1, &[])[0].contact, None);
    }
    assert_eq!(ids(&run(&mut bench, 8.6)), [1]);
    // 5 s without a frame: still on the same taxels, then elsewhere.
    bench.time_ns += 5_000_000_000;
    assert_eq!(ids(&bench.frame(1, &[[9.5, 4.0]])), [1]);
    assert!(bench.tracker.ended().is_empty());
    bench.time_ns += 5_000_000_000;
    bench.frame(1, &[[3.0, 4.0]]);
    assert_eq!(bench.tracker.ended()[0].ending, Ending::Released);
    assert_eq!(ids(bench.tracker.tracks()), [2]);
}

#[test]
fn velocity_is_found_within_its_stated_deviation_whatever_the_steps() {
    let mut bench = Bench::new();
    let mut x: f64 = 3.0;
    let mut tracks = Vec::new();
    for step in 0..60_u64 {
        // Steps of 1, 2 and 3 ms at 50 mm/s.
        let dt = 1 + step % 3;
        x += 0.05 * dt as f64;
        tracks = bench.frame(dt, &[[x, 4.0]]);
    }
    let deviation = tracks[0].velocity_covariance()[0][0].sqrt();
    assert!((tracks[0].velocity()[0] - 50e-3).abs() < 3.0 * deviation);
    assert!(deviation < 25e-3, "{deviation}");
}

#[test]
fn an_old_or_doubled_frame_changes_nothing() {
    let mut bench = Bench::new();
    bench.frame(1, &[[3.0, 4.0]]);
    let before = bench.frame(1, &[[3.0, 4.0]]);
    assert_eq!(bench.frame(0, &[[9.0, 4.0]]), before);
    bench.time_ns -= 1_000_000;
    assert_eq!(bench.frame(0, &[]), before);
}
