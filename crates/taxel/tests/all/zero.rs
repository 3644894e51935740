//! A tare under a finger is refused, on any device; one that was forced is told from the
//! values below zero that follow.
#![allow(clippy::unwrap_used)]

use taxel::acquisition::{Delivery, Stimulus, Twin};
use taxel::estimation::{RestRefused, State, TouchSession};
use taxel::sensor::{Element, Sensor};

/// The session of a device at `until` s, whose taxel in row 0, column 0 is pressed from
/// 2 s to 6 s.
fn at(name: &str, force: &str, until: f64) -> TouchSession {
    tared_at(name, force, None, until)
}

/// The same with a second tare at a time, s, whatever presses.
fn tared_at(name: &str, force: &str, mut tare: Option<f64>, until: f64) -> TouchSession {
    let sensor = Sensor::shipped(name).unwrap();
    let point = |time: &str, force: &str| {
        format!("{{ time = \"{time} s\", force = [\"0 N\", \"0 N\", \"{force}\"] }},")
    };
    let path = [
        point("2", "0 N"),
        point("2.02", force),
        point("6", force),
        point("6.02", "0 N"),
    ];
    let script = format!(
        "schema = 1\nname = \"press\"\nduration = \"20 s\"\n[[probe]]\ntaxel = [0, 0]\npath = [{}]\n",
        path.concat()
    );
    let stimulus = Stimulus::parse("press", &script).unwrap();
    let mut twin = Twin::new(&sensor, &stimulus, 3).unwrap();
    let device = sensor.device().unwrap();
    let mut session = device.session(&twin.stream()).unwrap();
    session.begin_rest_capture(50);
    loop {
        if let Delivery::Frame(frame) = twin.next_delivery() {
            session.push(&frame).unwrap();
            let time = frame.time_ns as f64 * 1e-9;
            if tare.take_if(|tare| time > *tare).is_some() {
                session.begin_rest_capture(50);
            }
            if time > until {
                return session;
            }
        }
    }
}

#[test]
fn what_is_pressed_is_not_declared_empty() {
    for (name, force) in [
        ("three-axis-8x8", "5 mN"),
        ("in-plane-50um", "2 N"),
        ("piezo-1.5mm", "0.2 N"),
        ("liquid-metal-2x4", "3 mN"),
    ] {
        assert_eq!(at(name, force, 1.5).pressed(), None, "{name}");
        let refused = at(name, force, 5.0).pressed();
        let Some(RestRefused::Touched { row, column, .. }) = refused else {
            panic!("{name}: {refused:?}");
        };
        assert_eq!([row, column], [0, 0], "{name}");
        assert_eq!(at(name, force, 9.0).pressed(), None, "{name}");
    }
}

#[test]
fn a_zero_taken_under_load_shows_below_zero() {
    // The piezoelectric array shows tension too.
    for (name, force) in [
        ("three-axis-8x8", "5 mN"),
        ("in-plane-50um", "2 N"),
        ("liquid-metal-2x4", "3 mN"),
    ] {
        let session = tared_at(name, force, Some(4.0), 15.0);
        let touch = session.estimator().touch();
        assert_eq!(touch.taxels[0].state, State::BelowZero, "{name}");
        let below = touch.state_counts()[State::BelowZero as usize];
        assert_eq!(below, 1, "{name}");
        let health = session.observer().health().channels();
        let accused = health.iter().find(|channel| channel.condition.wrong());
        assert!(accused.is_none(), "{name}: {accused:?}");
    }
}

/// Taxels that read below zero in half a minute of a device's own script.
#[test]
fn ordinary_touch_is_never_below_zero() {
    for name in Sensor::shipped_names() {
        let sensor = Sensor::shipped(name).unwrap();
        if matches!(sensor.element, Element::Trained(_)) {
            continue;
        }
        let script = Stimulus::shipped_text(sensor.element.usual_script()).unwrap();
        let stimulus = Stimulus::parse("usual", script).unwrap();
        let mut twin = Twin::new(&sensor, &stimulus, 5).unwrap();
        let device = sensor.device().unwrap();
        let mut session = device.session(&twin.stream()).unwrap();
        session.begin_rest_capture(50);
        let (mut below, mut frames) = (0, 0);
        loop {
            if let Delivery::Frame(frame) = twin.next_delivery() {
                let observed = session.push(&frame).unwrap();
                if frame.time_ns > 30_000_000_000 {
                    break;
                }
                if observed.captured.is_none() && !session.capturing() {
                    let touch = session.estimator().touch();
                    below += touch.state_counts()[State::BelowZero as usize];
                    frames += touch.taxels.len();
                }
            }
        }
        assert!(frames > 0);
        assert!(
            below as f64 <= 1e-4 * frames as f64,
            "{name}: {below} of {frames}"
        );
    }
}

#[test]
fn at_the_start_a_taxel_that_stands_out_is_not_declared_empty() {
    let sensor = Sensor::shipped("three-axis-8x8").unwrap();
    for (force, refused) in [("20 mN", true), ("0 N", false)] {
        let script = format!(
            "schema = 1\nname = \"press\"\nduration = \"20 s\"\n[[probe]]\ntaxel = [2, 5]\npath = [\
             {{ time = \"0 s\", force = [\"0 N\", \"0 N\", \"{force}\"] }},\
             {{ time = \"19 s\", force = [\"0 N\", \"0 N\", \"{force}\"] }}]\n"
        );
        let stimulus = Stimulus::parse("press", &script).unwrap();
        let mut twin = Twin::new(&sensor, &stimulus, 3).unwrap();
        let device = sensor.device().unwrap();
        let mut session = device.session(&twin.stream()).unwrap();
        session.begin_unasked_rest_capture(50);
        let captured = loop {
            if let Delivery::Frame(frame) = twin.next_delivery()
                && let Some(captured) = session.push(&frame).unwrap().captured
            {
                break captured;
            }
        };
        match captured {
            Err(RestRefused::StandsOut { row, column, .. }) if refused => {
                assert_eq!([row, column], [2, 5]);
            }
            captured => assert!(!refused && captured.is_ok(), "{force}: {captured:?}"),
        }
    }
}
