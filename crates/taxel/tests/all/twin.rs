//! The twin through the estimator: the estimated load is the applied one.
#![allow(clippy::unwrap_used)]

use taxel::acquisition::{Delivery, Frame, Quantity, Stimulus, Twin};
use taxel::calibration::ThreeAxisCalibration;
use taxel::device::Device;
use taxel::estimation::{
    ArrayEstimator, Certainty, ChannelState, RestRefused, State, ThreeAxisOptions, ThreeAxisReader,
    Touch, TouchEventKind, TouchSession,
};
use taxel::sensor::Sensor;

const REST_FRAMES: usize = 50;

struct Run {
    twin: Twin,
    estimator: ArrayEstimator,
}

fn estimator(calibration: ThreeAxisCalibration) -> ArrayEstimator {
    let options = ThreeAxisOptions::default();
    let reader = ThreeAxisReader::new(calibration, Quantity::Counts, options).unwrap();
    ArrayEstimator::new(Box::new(reader))
}

/// States of the capacitors of a taxel.
fn capacitors(touch: &Touch, taxel: usize) -> &[ChannelState] {
    &touch.channels.states[4 * taxel..4 * taxel + 4]
}

impl Run {
    fn new(sensor: &Sensor, script: &str) -> Self {
        let stimulus = Stimulus::parse("script", script).unwrap();
        let twin = Twin::new(sensor, &stimulus, 7).unwrap();
        let calibration = sensor.three_axis().unwrap().calibration();
        let mut estimator = estimator(calibration);
        estimator.begin_rest_capture(REST_FRAMES);
        Self { twin, estimator }
    }

    fn frame(&mut self) -> Frame {
        loop {
            if let Delivery::Frame(frame) = self.twin.next_delivery() {
                return frame;
            }
        }
    }

    /// Runs to the script time `time` and returns touch and true forces there.
    fn touch_at(&mut self, time: f64) -> (Touch, Vec<[f64; 3]>) {
        loop {
            let frame = self.frame();
            let (touch, captured) = self.estimator.push(&frame).unwrap();
            assert!(!matches!(captured, Some(Err(_))), "{captured:?}");
            if frame.time_ns as f64 * 1e-9 >= time {
                return (touch.clone(), self.twin.true_forces(frame.time_ns));
            }
        }
    }
}

fn array() -> Sensor {
    Sensor::shipped("three-axis-8x8").unwrap()
}

/// The array with two relaxing springs.
fn creeping() -> Sensor {
    let text = Sensor::shipped_text("three-axis-8x8").unwrap().replace(
        "relaxation = []",
        "relaxation = [{ ratio = 0.12, time = \"0.8 s\" }, { ratio = 0.05, time = \"4 s\" }]",
    );
    Sensor::parse("creeping.toml", &text).unwrap()
}

fn probe(force: &str) -> String {
    format!(
        "schema = 1\nname = \"probe\"\nduration = \"20 s\"\n[[probe]]\ntaxel = [2, 5]\npath = [\n\
         {{ time = \"1.5 s\", force = [\"0 mN\", \"0 mN\", \"0 mN\"] }},\n\
         {{ time = \"2 s\", force = {force} }},\n{{ time = \"19 s\", force = {force} }}]\n"
    )
}

#[test]
fn shipped_finger_script_is_estimated_within_its_own_error_bars() {
    let mut run = Run::new(&array(), Stimulus::shipped_text("finger").unwrap());
    let mut worst: f64 = 0.0;
    let (mut sum, mut count) = (0.0, 0.0);
    for time in [3.0, 3.5, 6.5, 9.5, 12.5, 16.0] {
        let (touch, truth) = run.touch_at(time);
        for (taxel, truth) in touch.taxels.iter().zip(&truth) {
            assert!(matches!(taxel.state, State::Ok), "{taxel:?}");
            for (axis, truth) in truth.iter().enumerate() {
                let off = (taxel.value[axis] - truth) / taxel.deviation()[axis];
                worst = worst.max(off.abs());
                sum += off * off;
                count += 1.0;
            }
        }
    }
    // 1152 draws of a standard normal: the largest stays below 5, and the
    // mean square within 15 % of one (4 standard deviations of it). The drag
    // at 12.5 s moves between the two electrode rows of a taxel by one row
    // time, which is well below the noise.
    assert!(worst < 5.5, "{worst}");
    assert!((sum / count - 1.0_f64).abs() < 0.15, "{}", sum / count);
}

#[test]
fn pressing_pushing_and_two_fingers_look_like_the_paper() {
    let mut run = Run::new(&array(), Stimulus::shipped_text("finger").unwrap());
    let (press, _) = run.touch_at(3.0);
    let force = press.total.force;
    // Of 90 mN the array carries what is not beside it: all of it here.
    assert!((force[2] - 90e-3).abs() < 1e-3, "{force:?}");
    assert!(force[0].abs() < 2e-3 && force[1].abs() < 2e-3, "{force:?}");
    let (x, _) = run.touch_at(6.5);
    assert!(
        (x.total.force[0] - 60e-3).abs() < 2e-3 && x.total.force[2] > 50e-3,
        "{:?}",
        x.total
    );
    let (y, _) = run.touch_at(9.5);
    assert!(
        (y.total.force[1] - 60e-3).abs() < 2e-3 && y.total.force[2] > 50e-3,
        "{:?}",
        y.total
    );
    let (two, _) = run.touch_at(16.0);
    assert_eq!(two.contacts.len(), 2);
    let sides: Vec<_> = two
        .contacts
        .iter()
        .map(|c| c.force[0].signum() * c.centre[0].signum())
        .collect();
    assert_eq!(sides, [-1.0, -1.0], "{:?}", two.contacts);
}

#[test]
fn same_seed_gives_the_same_frames_and_touches() {
    let (mut a, mut b) = (
        Run::new(&array(), &probe("[\"3 mN\", \"0 mN\", \"5 mN\"]")),
        Run::new(&array(), &probe("[\"3 mN\", \"0 mN\", \"5 mN\"]")),
    );
    for _ in 0..200 {
        let (frame_a, frame_b) = (a.frame(), b.frame());
        assert_eq!(frame_a, frame_b);
        let touch_a = format!("{:?}", a.estimator.push(&frame_a).unwrap());
        assert_eq!(
            touch_a,
            format!("{:?}", b.estimator.push(&frame_b).unwrap())
        );
    }
}

#[test]
fn closing_a_gap_is_contact_and_never_a_bare_number() {
    for force in [
        "[\"0 mN\", \"0 mN\", \"80 mN\"]",
        "[\"0 mN\", \"0 mN\", \"500 mN\"]",
        "[\"80 mN\", \"0 mN\", \"0 mN\"]",
    ] {
        let mut run = Run::new(&array(), &probe(force));
        let (touch, _) = run.touch_at(3.0);
        let taxel = &touch.taxels[2 * 8 + 5];
        assert_eq!(taxel.state, State::Closed, "{force}: {taxel:?}");
        let closed = capacitors(&touch, 2 * 8 + 5).contains(&ChannelState::Closed);
        assert!(closed, "{force}: {taxel:?}");
        assert_eq!(touch.taxels[0].state, State::Ok);
    }
}

/// One tile stands while the others go on: the four readings contradict the
/// rigid plane, and the force is not out of range but wrong.
#[test]
fn one_tile_that_stands_is_inconsistent() {
    let calibration = array().three_axis().unwrap().calibration();
    let unit = calibration.units[0];
    let force = [30e-3, -30e-3, 40e-3];
    let standing = unit.predict(force).1;
    assert_eq!(standing.closed(), [false, false, false, true]);
    // The same unit with room under that tile.
    let mut deep = unit;
    deep.plates.air_gap[3] = 30e-6;
    let mut readings = deep.predict(force).1.capacitance();
    readings[3] = standing.capacitance()[3];
    let taxels = std::iter::once(readings).chain(std::iter::repeat_n(unit.rest(), 63));
    let frame = Frame {
        sequence: 0,
        time_ns: 0,
        values: taxels.flatten().collect(),
        ..Frame::default()
    };
    let options = ThreeAxisOptions::default();
    let reader = ThreeAxisReader::new(calibration, Quantity::Capacitance, options).unwrap();
    let mut estimator = ArrayEstimator::new(Box::new(reader));
    let touch = estimator.push(&frame).unwrap().0;
    assert_eq!(touch.taxels[0].state, State::Inconsistent);
    assert_eq!(touch.left_out, 1);
}

/// Under the twin's own overload the plane stops as a whole, and the force is
/// a bound.
#[test]
fn an_oblique_overload_is_a_bound_and_ends_with_its_release() {
    let text = Sensor::shipped_text("three-axis-8x8").unwrap();
    let text = text.replace(
        "air_gap_deviation = \"0.2 um\"",
        "air_gap_deviation = \"0 um\"",
    );
    let sensor = Sensor::parse("even.toml", &text).unwrap();
    let device = sensor.three_axis().unwrap();
    let unit = device.calibration().units[0];
    for force in [
        [-0.119, -0.161, 1.516],
        [0.08, -0.086, 0.102],
        [1.9, 0.3, 0.4],
        [0.03, -0.03, 0.04],
    ] {
        let newtons = force.map(|part: f64| format!("\"{part} N\"")).join(", ");
        let script = format!(
            "schema = 1\nname = \"press\"\nduration = \"6 s\"\n[[probe]]\ntaxel = [2, 5]\npath = [\n\
             {{ time = \"1.5 s\", force = [\"0 N\", \"0 N\", \"0 N\"] }},\n\
             {{ time = \"2.5 s\", force = [{newtons}] }},\n{{ time = \"4 s\", force = [{newtons}] }},\n\
             {{ time = \"5 s\", force = [\"0 N\", \"0 N\", \"0 N\"] }}]\n"
        );
        let stimulus = Stimulus::parse("script", &script).unwrap();
        let mut twin = Twin::new(&sensor, &stimulus, 7).unwrap();
        let stream = twin.stream().clone();
        let reader = device.reader(&stream).unwrap();
        let mut session = TouchSession::new(reader, device.observed(&stream));
        session.begin_rest_capture(REST_FRAMES);
        let mut released = None;
        loop {
            let Delivery::Frame(frame) = twin.next_delivery() else {
                continue;
            };
            let observed = session.push(&frame).unwrap();
            let time = frame.time_ns as f64 * 1e-9;
            let taxel = observed.touch.taxels[2 * 8 + 5];
            if (2.6..3.9).contains(&time) {
                assert_eq!(taxel.state, State::Closed, "{force:?} {time}: {taxel:?}");
                let bound = unit.open_share(force) * force[2];
                let slack = 6.0 * taxel.pressed_deviation();
                assert!(taxel.pressed() > bound - slack, "{force:?}: {taxel:?}");
            }
            let mut kinds = observed.events.iter().map(|event| event.kind);
            if kinds.any(|kind| kind == TouchEventKind::Release) {
                released = released.or(Some(time));
            }
            if time > 5.5 {
                break;
            }
        }
        assert!(
            released.is_some_and(|time| time > 4.5),
            "{force:?}: {released:?}"
        );
    }
}

/// A bump that sinks adds c|F_x|, and noise alone makes |F_x|: an untouched
/// array must not read a pull.
#[test]
fn a_sinking_bump_does_not_pull_at_rest() {
    for sinking in ["0.05", "0.1", "0.3"] {
        let text = Sensor::shipped_text("three-axis-8x8")
            .unwrap()
            .replace("bump_sinking = 0.0", &format!("bump_sinking = {sinking}"));
        assert!(text.contains(sinking));
        let sensor = Sensor::parse("sinking.toml", &text).unwrap();
        let mut run = Run::new(
            &sensor,
            "schema = 1\nname = \"rest\"\nduration = \"100 s\"\n",
        );
        run.touch_at(1.5);
        let (mut sum, mut covered, mut count) = (0.0, 0, 0);
        for _ in 0..3000 {
            let frame = run.frame();
            let (touch, _) = run.estimator.push(&frame).unwrap();
            let [force, deviation] = touch.pressing_force().unwrap();
            sum += force;
            covered += u32::from(force.abs() < 1.96 * deviation);
            count += 1;
        }
        let coverage = f64::from(covered) / f64::from(count);
        let mean = sum / f64::from(count);
        println!("{sinking}: {:.4} mN, {coverage:.4}", 1e3 * mean);
        assert!((0.93..=0.97).contains(&coverage), "{sinking}: {coverage}");
        assert!(mean.abs() < 0.1e-3, "{sinking}: {mean}");
    }
}

#[test]
fn heavy_but_open_is_out_of_range_and_not_contact() {
    let mut run = Run::new(&array(), &probe("[\"0 mN\", \"0 mN\", \"40 mN\"]"));
    let (touch, truth) = run.touch_at(3.0);
    let taxel = &touch.taxels[2 * 8 + 5];
    assert_eq!(taxel.state, State::OutOfRange, "{taxel:?}");
    assert!((taxel.value[2] - truth[2 * 8 + 5][2]).abs() < 5.0 * taxel.deviation()[2]);
}

#[test]
fn dead_and_stuck_capacitors_are_flagged() {
    let faults = "[[fault]]\nchannel = { taxel = [1, 1], capacitor = \"21\" }\nreads = \"dead\"\nfrom = \"0 s\"\nto = \"20 s\"\n\
                  [[fault]]\nchannel = { taxel = [6, 6], capacitor = \"12\" }\nreads = { stuck = { at = \"150 fF\" } }\nfrom = \"2 s\"\nto = \"20 s\"\n";
    let mut run = Run::new(
        &array(),
        &(probe("[\"0 mN\", \"0 mN\", \"5 mN\"]") + faults),
    );
    let (touch, truth) = run.touch_at(4.0);
    let dead = &touch.taxels[9];
    assert_eq!(dead.state, State::Faulty);
    let (ok, faulty) = (ChannelState::Ok, ChannelState::Faulty);
    assert_eq!(capacitors(&touch, 9), [ok, ok, faulty, ok]);
    // Three capacitors still give the force.
    assert!((dead.value[2] - truth[9][2]).abs() < 6.0 * dead.deviation()[2]);
    // One that stands still is recognised within a second or two.
    let stuck = &touch.taxels[6 * 8 + 6];
    assert_eq!(stuck.state, State::Faulty);
    assert_eq!(capacitors(&touch, 6 * 8 + 6), [ok, faulty, ok, ok]);
    assert!((stuck.value[2] - truth[6 * 8 + 6][2]).abs() < 6.0 * stuck.deviation()[2]);
    assert_eq!(touch.clipped, 1);
}

#[test]
fn a_moving_device_refuses_the_rest_capture_and_keeps_its_calibration() {
    let script = Stimulus::shipped_text("finger").unwrap();
    let mut run = Run::new(&array(), script);
    run.touch_at(2.2);
    let calibration = |run: &Run| {
        let reader: &ThreeAxisReader = run.estimator.reader().unwrap();
        reader.calibration().clone()
    };
    let before = calibration(&run);
    run.estimator.begin_rest_capture(REST_FRAMES);
    let refused = (0..REST_FRAMES).find_map(|_| {
        let frame = run.frame();
        run.estimator.push(&frame).unwrap().1
    });
    assert!(
        matches!(refused, Some(Err(RestRefused::Moving { .. }))),
        "{refused:?}"
    );
    assert_eq!(calibration(&run), before);
}

#[test]
fn creep_is_undone_also_across_lost_frames() {
    let script = probe("[\"2 mN\", \"-3 mN\", \"8 mN\"]") + "[link]\nlose_every = 7\n";
    let mut run = Run::new(&creeping(), &script);
    for time in [2.5, 4.0, 9.0, 15.0] {
        let (touch, truth) = run.touch_at(time);
        let (taxel, truth) = (&touch.taxels[2 * 8 + 5], truth[2 * 8 + 5]);
        for (axis, truth) in truth.iter().enumerate() {
            let off = (taxel.value[axis] - truth).abs();
            // The memory averages noise, so the covariance bounds it.
            assert!(
                off < 5.0 * taxel.deviation()[axis],
                "{time} {axis}: {off:e}"
            );
        }
    }
}

#[test]
fn a_multiplexer_skews_what_it_reads() {
    let text = Sensor::shipped_text("three-axis-8x8").unwrap();
    let parallel = Sensor::parse("p.toml", text).unwrap();
    let text = text
        .replace(
            "{ row_parallel = { row_time = \"1 ms\" } }",
            "{ multiplexed = { channel_time = \"651 us\" } }",
        )
        .replace("frame_rate = \"60 Hz\"", "frame_rate = \"6 Hz\"")
        .replace("noise = \"0.1 mV\" ", "noise = \"1 nV\" ");
    let multiplexed = Sensor::parse("m.toml", &text).unwrap();
    assert_eq!(
        multiplexed.three_axis().unwrap().board.delay(63, 3),
        255.0 * 651e-6
    );
    assert_eq!(parallel.three_axis().unwrap().board.delay(63, 3), 15e-3);
    // A ramp of 4 mN/s in z looks like shear: C21, C22 are read 16 slots later.
    let ramp = "schema = 1\nname = \"ramp\"\nduration = \"10 s\"\n[[probe]]\ntaxel = [0, 0]\npath = [\n\
        { time = \"4 s\", force = [\"0 mN\", \"0 mN\", \"0 mN\"] },\n{ time = \"6 s\", force = [\"0 mN\", \"0 mN\", \"8 mN\"] }]\n";
    let stimulus = Stimulus::parse("ramp", ramp).unwrap();
    let mut twin = Twin::new(&multiplexed, &stimulus, 1).unwrap();
    let mut estimator = estimator(ThreeAxisCalibration {
        units: multiplexed.three_axis().unwrap().made(),
        ..multiplexed.three_axis().unwrap().calibration()
    });
    let mut shear: f64 = 0.0;
    for _ in 0..33 {
        if let Delivery::Frame(frame) = twin.next_delivery() {
            shear = estimator.push(&frame).unwrap().0.taxels[0].value[1];
        }
    }
    // d_y = -(16 slots x 651 us) x 4 mN/s / k_z, F_y = k_y d_y: -41.7 uN; one
    // count is 0.015 fF or 7 uN.
    assert!((shear + 16.0 * 651e-6 * 4e-3).abs() < 1e-5, "{shear:e}");
}

/// Figure 12: the array on a cylinder of 4 mm radius.
#[test]
fn on_a_cylinder_taxels_feel_in_their_own_frame_and_sums_in_the_sensors() {
    let text = Sensor::shipped_text("three-axis-8x8").unwrap();
    let bent = "mount = { cylinder = { radius = \"4 mm\" } }";
    let sensor = Sensor::parse("bent.toml", &text.replace("mount = \"flat\"", bent)).unwrap();
    let mut run = Run::new(&sensor, Stimulus::shipped_text("finger").unwrap());
    let (touch, _) = run.touch_at(16.0);
    assert_eq!(touch.contacts.len(), 2);
    // The fingers stand at arcs of -5 and 5 mm, 71.6 degrees to either side,
    // press 45 mN to the axis and push 35 mN up the surface to the middle: the
    // push outweighs what is left of the pressing.
    let (sin, cos) = (5.0_f64 / 4.0).sin_cos();
    let pressing = 2.0 * (45e-3 * cos - 35e-3 * sin);
    // Each patch reaches 37 degrees to either side of its centre, which takes
    // a share of a rigid sum; the twin's own forces give the exact one.
    let truth = run.twin.true_forces(touch.time_ns);
    let layout = sensor.layout();
    let mut sum = taxel::layout::Wrench::default();
    truth
        .iter()
        .enumerate()
        .for_each(|(index, force)| sum.add(&layout.wrench(index, *force)));
    for axis in 0..3 {
        let deviation = touch.total_covariance[axis][axis].sqrt();
        assert!((touch.total.force[axis] - sum.force[axis]).abs() < 5.0 * deviation);
    }
    assert!(
        (touch.total.force[2] / pressing - 1.0).abs() < 0.1,
        "{:?} {pressing}",
        touch.total
    );
    assert!(touch.total.force[0].abs() < 3e-3);
}

/// The history of a creeping device holds forces: those of gaps that a rest
/// capture has corrected must not live on.
#[test]
fn a_rest_capture_begins_the_history_anew() {
    let mut run = Run::new(&creeping(), &probe("[\"0 mN\", \"0 mN\", \"5 mN\"]"));
    let (touch, _) = run.touch_at(1.0);
    for (force, deviation) in touch
        .total
        .force
        .iter()
        .zip((0..3).map(|axis| touch.total_covariance[axis][axis].sqrt()))
    {
        assert!(force.abs() < 5.0 * deviation, "{:?}", touch.total);
    }
    assert!(touch.contacts.is_empty());
}

#[test]
fn a_taxel_that_was_dead_for_a_while_relaxes_all_the_same() {
    let dead =
        "[[fault]]\nchannel = { taxel = [2, 5] }\nreads = \"dead\"\nfrom = \"3 s\"\nto = \"8 s\"\n";
    let mut run = Run::new(
        &creeping(),
        &(probe("[\"0 mN\", \"0 mN\", \"10 mN\"]") + dead),
    );
    let (touch, _) = run.touch_at(5.0);
    assert!(touch.taxels[21].value[0].is_nan());
    assert_eq!(touch.taxels[21].state, State::Faulty);
    let (touch, truth) = run.touch_at(8.1);
    let off = (touch.taxels[21].value[2] - truth[21][2]).abs();
    // Creep during the fault is joined by a straight line: 1 % of the force.
    assert!(off < 0.1e-3, "{off:e}");
}

#[test]
fn what_is_known_to_be_wrong_is_left_out_of_the_totals() {
    let stuck = "[[fault]]\nchannel = { taxel = [6, 6], capacitor = \"12\" }\nreads = { stuck = { at = \"150 fF\" } }\nfrom = \"1.2 s\"\nto = \"20 s\"\n";
    let mut run = Run::new(&array(), &(probe("[\"0 mN\", \"0 mN\", \"5 mN\"]") + stuck));
    // Before it is recognised as one that stands still.
    let (touch, _) = run.touch_at(2.1);
    assert_eq!(touch.left_out, 1);
    assert_eq!(touch.contacts.len(), 1);
    // What may press on the taxel that is left out makes a bound of the total, and leaves no shear.
    assert_eq!(
        (touch.total_certainty, touch.total_reason),
        (Certainty::AtLeast, Some(State::Inconsistent))
    );
    let [x, _, z] = touch.total.force;
    assert!(
        x.is_nan() && (z - 5e-3).abs() < 5.0 * touch.total_deviation()[2],
        "{:?}",
        touch.total
    );
}

#[test]
fn a_masked_dead_capacitor_is_no_loss() {
    let mask = "\n[[mask]]\ntaxel = [1, 1]\ncapacitor = \"21\"\n";
    let text = Sensor::shipped_text("three-axis-8x8").unwrap().to_owned() + mask;
    let sensor = Sensor::parse("masked.toml", &text).unwrap();
    let dead = "[[fault]]\nchannel = { taxel = [1, 1], capacitor = \"21\" }\nreads = \"dead\"\nfrom = \"0 s\"\nto = \"20 s\"\n";
    let mut run = Run::new(&sensor, &(probe("[\"0 mN\", \"0 mN\", \"5 mN\"]") + dead));
    let (touch, _) = run.touch_at(3.0);
    assert_eq!(
        (touch.clipped, touch.taxels[9].state),
        (0, State::Unchecked)
    );
}
