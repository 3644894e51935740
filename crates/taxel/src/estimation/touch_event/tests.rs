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
        certainty: Certainty::Exact,
        noise: 1e-3,
    };
    gathering.add(0, &cell);
    gathering.settle();
    gathering.finish([1e-3; 2])
}

/// Events of one contact, given by position and force each millisecond; no
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
fn a_slow_drag_slips_too_and_a_contact_at_rest_does_not() {
    // 8 mm/s: within five deviations of the velocity at any one moment.
    let drag = events(1500, |t| (0.008 * (t - 0.5).max(0.0), 0.3, State::Ok));
    assert_eq!(names(&drag), ["touch", "step", "slip"], "{drag:?}");
    assert!(drag[2].time_ns > 500_000_000 && drag[2].time_ns < 1_100_000_000);
    let rest = events(3000, |_| (0.0, 0.3, State::Ok));
    assert_eq!(names(&rest), ["touch", "step"], "{rest:?}");
}

#[test]
fn a_load_that_lifts_off_again_and_again_is_cyclic() {
    let force = |t: f64| 0.3 * (std::f64::consts::TAU * t / 0.4).sin();
    let found = events(3000, |t| (0.0, force(t), State::Ok));
    let cyclic: Vec<_> = found
        .iter()
        .filter(|event| event.kind.name() == "cyclic")
        .collect();
    assert_eq!(cyclic.len(), 1, "{found:?}");
    // Steps of 1 ms in a period of 400 ms.
    assert!((cyclic[0].value * 0.4 - 1.0).abs() < 3e-3);
    let after = found
        .iter()
        .filter(|event| event.time_ns > cyclic[0].time_ns);
    assert!(after.clone().any(|event| event.kind.name() == "touch"));
    assert!(after.clone().all(|event| event.kind.name() != "impact"));
}

#[test]
fn bounds_are_reported_once() {
    let state = |t: f64| if t > 0.1 { State::Closed } else { State::Ok };
    let found = events(300, |t| (0.0, 0.3, state(t)));
    let count = names(&found)
        .iter()
        .filter(|name| **name == "closed")
        .count();
    assert_eq!(count, 1);
}

/// Contacts that begin to slide at a speed, each frame's position with the noise that the contact
/// states: 95 % of the intervals hold the speed, give or take three deviations of such a count.
#[test]
fn intervals_of_slips_hold_the_speed() {
    let mut random = taxel_numerics::Noise::seeded(11);
    let noise = 30e-6;
    for speed in [8e-3, 20e-3, 60e-3] {
        let (mut held, mut all) = (0_u32, 0_u32);
        for run in 0..300 {
            let mut tracker = Tracker::new(TrackerOptions::new([1e-3; 2]));
            let mut events = TouchEvents::new(TouchEventOptions::default());
            let begin = 0.2 + 1e-3 * f64::from(run % 50);
            for time in 0..900_u64 {
                let seconds = time as f64 * 1e-3;
                let x = speed * (seconds - begin).max(0.0) + noise * random.normal();
                let mut one = contact(x, 0.3, State::Ok);
                one.centre[1] = noise * random.normal();
                one.covariance = [noise * noise, 0.0, noise * noise];
                let contacts = [one];
                tracker.push(time * 1_000_000, &contacts, &[Some(0)]);
                for event in events.push(time * 1_000_000, &tracker, &contacts) {
                    if event.kind.name() == "slip" {
                        all += 1;
                        held += u32::from((event.value - speed).abs() <= 1.96 * event.deviation);
                    }
                }
            }
        }
        println!("slip at {speed} m/s: {held} of {all}");
        let share = f64::from(held) / f64::from(all);
        let error = 3.0 * (0.95 * 0.05 / f64::from(all)).sqrt();
        assert!(share > 0.93 - error, "{speed}: {held} of {all}");
    }
}
