//! Forty minutes of ordinary touches, and an hour of one: the last minutes are as the first.
#![allow(clippy::unwrap_used)]

#[path = "common/hours.rs"]
#[allow(dead_code, reason = "creep is run by the benchmark")]
mod hours;

use hours::{Course, Drift, run};
use taxel::acquisition::{Delivery, Stimulus, Twin};
use taxel::sensor::Sensor;

/// Before this was so, the stated deviation grew fourfold in twenty minutes.
#[test]
fn the_last_minutes_of_touching_are_as_the_first() {
    let shipped = |name: &str| Sensor::shipped(name).unwrap();
    for (sensor, dead, forces, drift) in [
        (shipped("three-axis-unit"), None, [1e-3, 10e-3], Drift::None),
        (
            shipped("in-plane-50um"),
            None,
            [1.0, 4.0],
            Drift::Temperature(0.056),
        ),
        (
            shipped("liquid-metal-2x4"),
            None,
            [1e-3, 4e-3],
            Drift::Steady(0.056),
        ),
        // Of another size, with a dead channel.
        (
            other_array(),
            Some([9, 2]),
            [2e-3, 9e-3],
            Drift::Steady(0.056),
        ),
    ] {
        let course = Course {
            sensor,
            dead,
            forces,
            drift,
            pauses: [1.0, 10.0],
            length: 1800.0,
            interval: 300.0,
        };
        let name = &course.sensor.name;
        let intervals = run(&course, 1);
        let first = &intervals[0];
        for interval in &intervals {
            let what = format!("{name}, {drift:?}: {interval:?}, first {first:?}");
            let [touches, found] = interval.touches;
            assert_eq!(found, touches, "{what}");
            assert_eq!(interval.empty[1], 0, "{what}");
            let [touch, release, other] = interval.events;
            assert!(touch.abs_diff(touches) <= 1, "{what}");
            assert!(release.abs_diff(touches) <= 1, "{what}");
            assert_eq!(other, 0, "{what}");
            for (stated, first) in interval.stated.iter().zip(first.stated) {
                assert!((stated / first - 1.0).abs() < 0.1, "{what}");
            }
            assert!(interval.within.iter().all(|share| *share > 0.93), "{what}");
            assert!(interval.memory - first.memory < 1.0, "{what}");
        }
    }
}

/// Three rows of five units at another pitch and frame rate.
fn other_array() -> Sensor {
    let text = Sensor::shipped_text("three-axis-8x8").unwrap();
    let text = text
        .replace("rows = 8", "rows = 3")
        .replace("columns = 8", "columns = 5")
        .replace("frame_rate = \"60 Hz\"", "frame_rate = \"37 Hz\"");
    Sensor::parse("other.toml", &text).unwrap()
}

/// A finger that stays is not taken for drift.
#[test]
fn a_contact_held_for_an_hour_is_not_eaten() {
    for (name, force) in [
        ("three-axis-unit", 5e-3),
        ("in-plane-50um", 2.0),
        ("liquid-metal-2x4", 3e-3),
    ] {
        let sensor = Sensor::shipped(name).unwrap();
        let point = |time: f64, force: f64| {
            format!("{{ time = \"{time} s\", force = [\"0 N\", \"0 N\", \"{force} N\"] }},")
        };
        let path = [
            point(5.0, 0.0),
            point(5.1, force),
            point(3605.0, force),
            point(3605.1, 0.0),
        ];
        let script = format!(
            "schema = 1\nname = \"hold\"\nduration = \"3620 s\"\n[[probe]]\ntaxel = [0, 0]\npath = [{}]\n",
            path.concat()
        );
        let stimulus = Stimulus::parse("hold", &script).unwrap();
        let mut twin = Twin::new(&sensor, &stimulus, 4).unwrap();
        let device = sensor.device().unwrap();
        let mut session = device.session(&twin.stream()).unwrap();
        session.begin_rest_capture(50);
        let mut first: Option<[f64; 2]> = None;
        let mut last = [f64::NAN; 2];
        loop {
            let Delivery::Frame(frame) = twin.next_delivery() else {
                continue;
            };
            let time = frame.time_ns as f64 * 1e-9;
            let touch = session.push(&frame).unwrap().touch;
            let contact = touch.contacts.first();
            if (5.5..3604.5).contains(&time) {
                // Found in every frame, and the same one.
                let contact = contact.unwrap_or_else(|| panic!("{name}: none at {time} s"));
                assert_eq!(
                    (touch.contacts.len(), contact.id),
                    (1, 1),
                    "{name} at {time} s"
                );
                let taxel = touch.taxels[contact.peak_taxel];
                last = [taxel.pressed(), taxel.pressed_deviation()];
                first.get_or_insert(last);
            }
            if time > 3606.0 {
                assert!(contact.is_none(), "{name} at {time} s");
                break;
            }
        }
        let [[begins, _], [ends, deviation]] = [first.unwrap(), last];
        let what = format!("{name}: {begins} at first, {ends} +- {deviation} after an hour");
        // Two readings of independent noise, and what the hour may have hidden.
        assert!((ends - begins).abs() < 5.0 * deviation, "{what}");
        assert!((ends / begins - 1.0).abs() < 0.1, "{what}");
    }
}
