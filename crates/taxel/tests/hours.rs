//! Forty minutes of ordinary touches: the last minutes are as the first.
#![allow(clippy::unwrap_used)]

#[path = "common/hours.rs"]
#[allow(dead_code, reason = "creep is run by the benchmark")]
mod hours;

use hours::{Course, Drift, run};
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
