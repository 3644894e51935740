//! Hours of ordinary touches on each device: the figures of every hour beside those of
//! the first.
//!
//!     cargo run --release --bin hours [HOURS] [SENSOR] [CASE]
//!     cargo run --release --bin hours HOURS FILE LEAST_FORCE LARGEST_FORCE [CHANNEL TAXEL] [CASE]
//!
//! Forces are those of the touches, N. CHANNEL, which TAXEL reads, is dead. CASE is one
//! drift, or `overload`: every twentieth touch presses from the side beyond first contact,
//! without a drift; on three-axis units only.

#[path = "../../../crates/taxel/tests/common/hours.rs"]
mod hours;

use hours::{Course, Drift, run};
use taxel::sensor::Sensor;

/// Shipped sensor, forces of the touches, N.
const DEVICES: [(&str, [f64; 2]); 4] = [
    ("three-axis-8x8", [1e-3, 10e-3]),
    ("three-axis-unit", [1e-3, 10e-3]),
    ("in-plane-50um", [1.0, 4.0]),
    ("liquid-metal-2x4", [1e-3, 4e-3]),
];
/// Rates in deviations of a reading per second: on a three-axis unit the fastest is
/// 20 fF an hour.
const DRIFTS: [(&str, Drift); 4] = [
    ("none", Drift::None),
    ("steady", Drift::Steady(0.056)),
    ("temperature", Drift::Temperature(0.056)),
    ("creep", Drift::Creep(0.01)),
];
const OVERLOAD: &str = "overload";
/// Force of an overload, N.
const OVERLOAD_FORCE: [f64; 3] = [-0.119, -0.161, 1.516];

fn main() {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let cases = DRIFTS.map(|(name, _)| name);
    let case = arguments.pop_if(|last| *last == OVERLOAD || cases.contains(&last.as_str()));
    let number = |index: usize| -> Option<f64> {
        let text = arguments.get(index)?;
        Some(text.parse().expect("a number"))
    };
    let hours = number(0).unwrap_or(8.0);
    println!(
        "{:16} {:11} {:>4} {:>8} {:>6} {:>6} {:>9} {:>7} {:>6} {:>9} {:>9} {:>7} {:>7} {:>9} {:>7} {:>7}",
        "device",
        "drift",
        "hour",
        "touches",
        "found",
        "false",
        "touch",
        "release",
        "other",
        "sd rest",
        "sd held",
        "95% rest",
        "held",
        "rms/sd r.",
        "held",
        "MB"
    );
    if let (Some(low), Some(high)) = (number(2), number(3)) {
        let text = std::fs::read_to_string(&arguments[1]).expect("a sensor file");
        let sensor = Sensor::parse(&arguments[1], &text).expect("a sensor file");
        let dead = number(4).zip(number(5));
        let dead = dead.map(|(channel, taxel)| [channel as usize, taxel as usize]);
        return device(&sensor, [low, high], dead, hours, case.as_deref());
    }
    for (name, forces) in DEVICES {
        if arguments.get(1).is_none_or(|only| only == name) {
            let sensor = Sensor::shipped(name).expect("a shipped sensor");
            device(&sensor, forces, None, hours, case.as_deref());
        }
    }
}

fn device(
    sensor: &Sensor,
    forces: [f64; 2],
    dead: Option<[usize; 2]>,
    hours: f64,
    case: Option<&str>,
) {
    let device: String = sensor.name.chars().take(16).collect();
    let beyond = sensor
        .three_axis()
        .is_ok()
        .then_some((OVERLOAD, Drift::None));
    let cases = DRIFTS.into_iter().chain(beyond);
    for (name, drift) in cases.filter(|(name, _)| case.is_none_or(|only| only == *name)) {
        let course = Course {
            sensor: sensor.clone(),
            dead,
            overload: (name == OVERLOAD).then_some(OVERLOAD_FORCE),
            forces,
            pauses: [1.0, 25.0],
            drift,
            length: 3600.0 * hours,
            interval: 3600.0_f64.min(3600.0 * hours),
        };
        for (hour, interval) in (1..).zip(run(&course, 1)) {
            let [touches, found] = interval.touches;
            let [touch, release, other] = interval.events;
            print!(
                "{device:16} {name:11} {hour:>4} {touches:>8} {found:>6} {:>6} {touch:>9} {release:>7} {other:>6} {:>9.3} {:>9.3} {:>7.1} {:>7.1} {:>9.3} {:>7.3} {:>7.1}",
                interval.empty[1],
                1e3 * interval.stated[0],
                1e3 * interval.stated[1],
                100.0 * interval.within[0],
                100.0 * interval.within[1],
                interval.ratio[0],
                interval.ratio[1],
                interval.memory
            );
            match interval.overloads {
                [0, _] => println!(),
                [overloads, bounds] => println!("  {bounds} of {overloads} overloads are bounds"),
            }
        }
    }
}
