//! Forty minutes of ordinary touches, and an hour of one: the last minutes are as the first.
#![allow(clippy::unwrap_used)]

#[path = "common/hours.rs"]
#[allow(dead_code, reason = "creep is run by the benchmark")]
mod hours;

use std::sync::{PoisonError, RwLock};

use hours::{Course, Drift, run};
use taxel::acquisition::{Delivery, Stimulus, Twin};
use taxel::estimation::{SearchOptions, estimate_unit};
use taxel::sensor::{Element, Sensor};

/// The memory of the process is that of one test where it runs alone.
static MEMORY: RwLock<()> = RwLock::new(());

/// Before this was so, the stated deviation grew fourfold in twenty minutes.
#[test]
fn the_last_minutes_of_touching_are_as_the_first() {
    let _alone = MEMORY.write().unwrap_or_else(PoisonError::into_inner);
    let shipped = |name: &str| Sensor::shipped(name).unwrap();
    for (sensor, dead, forces, drift, [minutes, interval]) in [
        (
            shipped("three-axis-unit"),
            None,
            [1e-3, 10e-3],
            Drift::None,
            [30.0, 5.0],
        ),
        (
            shipped("in-plane-50um"),
            None,
            [1.0, 4.0],
            Drift::Temperature(0.056),
            [30.0, 5.0],
        ),
        // The deviation of a force follows the force: the script, which repeats every twenty minutes, has
        // the same forces in each interval.
        (
            shipped("liquid-metal-2x4"),
            None,
            [1e-3, 4e-3],
            Drift::Steady(0.056),
            [60.0, 20.0],
        ),
        // A thousand frames a second. Its intervals held 52 to 64 %.
        (
            shipped("piezo-1.5mm"),
            None,
            [0.1, 1.0],
            Drift::Steady(0.056),
            [6.0, 1.0],
        ),
        // Of another size, with a dead channel.
        (
            other_array(),
            Some([9, 2]),
            [2e-3, 9e-3],
            Drift::Steady(0.056),
            [30.0, 5.0],
        ),
    ] {
        let course = Course {
            sensor,
            dead,
            overload: None,
            forces,
            drift,
            pauses: [1.0, 10.0],
            length: 60.0 * minutes,
            interval: 60.0 * interval,
        };
        let name = &course.sensor.name;
        let fades = matches!(course.sensor.element, Element::Piezoelectric(_));
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
            // The gains of elements are part of the deviation of their forces.
            let alike = if fades { 0.5 } else { 0.1 };
            for (stated, first) in interval.stated.iter().zip(first.stated) {
                assert!((stated / first - 1.0).abs() < alike, "{what}");
            }
            assert!(interval.within.iter().all(|share| *share > 0.93), "{what}");
            // Readings that toggle between two numbers: the intervals hold nearly all of the errors,
            // whose size is that of the stated deviations all the same.
            if fades {
                let sized = |ratio: &f64| (0.85..1.1).contains(ratio);
                assert!(interval.ratio.iter().all(sized), "{what}");
            }
            assert!(interval.memory - first.memory < 1.0, "{what}");
        }
    }
}

/// A unit alone has no neighbours that drift beside it. Before, its steps of temperature
/// were touches: one step without an end if nothing had touched it for a while, some for a
/// few frames between touches.
#[test]
fn a_step_of_temperature_is_no_touch_of_a_unit_alone() {
    let _beside = MEMORY.read().unwrap_or_else(PoisonError::into_inner);
    for (pauses, length) in [([500.0, 550.0], 1800.0), ([1.0, 25.0], 3.0 * 3600.0)] {
        let course = Course {
            sensor: Sensor::shipped("three-axis-unit").unwrap(),
            dead: None,
            overload: None,
            forces: [1e-3, 10e-3],
            drift: Drift::Temperature(0.056),
            pauses,
            length,
            interval: length,
        };
        let interval = &run(&course, 1)[0];
        let what = format!("{pauses:?}: {interval:?}");
        let [touches, found] = interval.touches;
        assert_eq!(found, touches, "{what}");
        assert_eq!(interval.empty[1], 0, "{what}");
        assert_eq!(interval.events, [touches, touches, 0], "{what}");
        let at_rest = interval.within[0];
        assert!((0.93..0.97).contains(&at_rest), "{what}");
    }
}

/// Warmth that raises four capacitances alike is a normal force to the model of a unit:
/// the misfit says nothing, and only the rate tells the two apart.
#[test]
fn what_four_capacitors_drift_together_reads_as_a_normal_force_without_misfit() {
    let _beside = MEMORY.read().unwrap_or_else(PoisonError::into_inner);
    let sensor = Sensor::shipped("three-axis-unit").unwrap();
    let unit = sensor.three_axis().unwrap().unit_model();
    let rest = unit.rest();
    let read = |change: [f64; 4]| {
        let readings = std::array::from_fn(|i| rest[i] + change[i]);
        estimate_unit(
            &unit,
            readings,
            [1e-16; 4],
            [true; 4],
            &SearchOptions::default(),
        )
    };
    let together = read([0.4e-15; 4]);
    println!(
        "0.4 fF on all four: {:?} N, misfit {:.2} deviations",
        together.force, together.signed_residual
    );
    assert!(
        (0.18e-3..0.22e-3).contains(&together.force[2]),
        "{together:?}"
    );
    assert!(together.signed_residual.abs() < 0.5, "{together:?}");
    // One capacitor alone would be a contradiction of the same size.
    let alone = read([0.4e-15, 0.0, 0.0, 0.0]);
    println!(
        "0.4 fF on one: misfit {:.2} deviations",
        alone.signed_residual
    );
    assert!(alone.signed_residual.abs() > 1.5, "{alone:?}");
}

/// From the side, closed tiles and all: what comes after is as without it.
#[test]
fn overloads_change_nothing_of_the_touches_after_them() {
    let _beside = MEMORY.read().unwrap_or_else(PoisonError::into_inner);
    for name in ["three-axis-unit", "three-axis-8x8"] {
        let course = Course {
            sensor: Sensor::shipped(name).unwrap(),
            dead: None,
            overload: Some([-0.119, -0.161, 1.516]),
            forces: [2e-3, 10e-3],
            drift: Drift::None,
            pauses: [1.0, 10.0],
            length: 1200.0,
            interval: 600.0,
        };
        for interval in run(&course, 1) {
            let what = format!("{name}: {interval:?}");
            let [touches, found] = interval.touches;
            assert_eq!(found, touches, "{what}");
            let [overloads, bounds] = interval.overloads;
            assert!(overloads >= 3, "{what}");
            assert_eq!(bounds, overloads, "{what}");
            assert_eq!(interval.empty[1], 0, "{what}");
            let [touch, release, other] = interval.events;
            assert!(touch.abs_diff(touches) <= 1, "{what}");
            assert!(release.abs_diff(touches) <= 1, "{what}");
            // Each says once that its plates touch each other.
            assert_eq!(other, overloads, "{what}");
            let held = |share: &f64| (0.93..0.97).contains(share);
            assert!(interval.within.iter().all(held), "{what}");
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
    let _beside = MEMORY.read().unwrap_or_else(PoisonError::into_inner);
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
