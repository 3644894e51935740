//! The piezoelectric array from sensor file to touch.
#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;

use taxel::acquisition::{Delivery, Frame, Stimulus, Twin};
use taxel::device::{Device, Drive, PiezoelectricPredictor};
use taxel::estimation::{ArrayEstimator, ChargeOptions, ChargeReader, Event, State, Touch};
use taxel::mechanics::Profile;
use taxel::predict::{Load, LoadValue, Predictor};
use taxel::sensor::Sensor;

const SENSORS: [&str; 2] = ["piezo-1.5mm", "piezo-2.3mm"];

fn sensor() -> Sensor {
    Sensor::shipped("piezo-1.5mm").unwrap()
}

/// The shipped text with one piece replaced.
fn changed(from: &str, to: &str) -> Result<Sensor, taxel::InputError> {
    let text = Sensor::shipped_text("piezo-1.5mm").unwrap();
    assert!(text.contains(from), "{from}");
    Sensor::parse("changed.toml", &text.replace(from, to))
}

fn script(name: &str) -> Stimulus {
    Stimulus::parse(name, Stimulus::shipped_text(name).unwrap()).unwrap()
}

fn estimator(sensor: &Sensor, twin: &Twin) -> ArrayEstimator {
    ArrayEstimator::new(sensor.device().unwrap().reader(&twin.stream()).unwrap())
}

/// Without the search for positions.
fn plain(sensor: &Sensor) -> ArrayEstimator {
    let model = sensor.piezoelectric().unwrap().model();
    ArrayEstimator::new(Box::new(ChargeReader::new(model, ChargeOptions::default())))
}

/// Runs a script to its end; `seen` gets time, touch and true forces.
fn run(sensor: &Sensor, stimulus: &Stimulus, mut seen: impl FnMut(f64, &Touch, &[[f64; 3]])) {
    let mut twin = Twin::new(sensor, stimulus, 3).unwrap();
    let mut estimator = estimator(sensor, &twin);
    loop {
        let Delivery::Frame(frame) = twin.next_delivery() else {
            continue;
        };
        let time = frame.time_ns as f64 * 1e-9;
        if time >= stimulus.duration {
            return;
        }
        let truth = twin.true_forces(frame.time_ns);
        let (touch, _) = estimator.push(&frame).unwrap();
        seen(time, touch, &truth);
    }
}

#[test]
fn shipped_files_are_understood_as_printed() {
    for (name, thickness) in SENSORS.into_iter().zip([0.9975e-3, 1.0925e-3]) {
        let sensor = Sensor::shipped(name).unwrap();
        let array = sensor.piezoelectric().unwrap();
        let pressed = array.description.preloaded().unwrap();
        assert!((pressed.thickness - thickness).abs() < 1e-12);
        assert_eq!((array.board.step() * 1e4).round(), 12.0);
        assert_eq!(array.layout().taxels(), 8);
        assert!(sensor.three_axis().is_err());
    }
}

#[test]
fn broken_rules_say_what_to_do() {
    let message = |from: &str, to: &str| {
        let error = changed(from, to).unwrap_err();
        format!("{} | {} | {}", error.key, error.message, error.help)
    };
    let slow = message("frame_rate = \"1 kHz\"", "frame_rate = \"80 Hz\"");
    assert!(
        slow.contains("electronics.frame_rate") && slow.contains("86.82"),
        "{slow}"
    );
    let fast = message("frame_rate = \"1 kHz\"", "frame_rate = \"2 kHz\"");
    assert!(fast.contains("one scan takes"), "{fast}");
    let crushed = message("preload = \"2.68 N\"", "preload = \"8 N\"");
    assert!(
        crushed.contains("cover.preload") && crushed.contains("below 8 N"),
        "{crushed}"
    );
    let neo = Sensor::shipped_text("piezo-1.5mm")
        .unwrap()
        .replace("preload = \"2.68 N\"", "preload = \"8 N\"")
        .replace("law = \"linear\"", "law = \"neo_hookean\"");
    assert!(Sensor::parse("neo.toml", &neo).is_ok());
    let close = message("pitch = \"4 mm\"", "pitch = \"1.9 mm\"");
    assert!(close.contains("overlap"), "{close}");
    let settling = message("settling = \"10 us\"", "settling = \"50 us\"");
    assert!(
        settling.contains("13.53 %") && settling.contains("230.2"),
        "{settling}"
    );
    let scatter = message("gain_deviation = 0.02", "gain_deviation = 0.5");
    assert!(scatter.contains("at most 0.3"), "{scatter}");
    let rest = message("offset = \"0 V\"", "offset = \"3.5 V\"");
    assert!(rest.contains("at rest"), "{rest}");
    let damped = Sensor::shipped_text("piezo-1.5mm")
        .unwrap()
        .replace("damping_ratio = 1.0", "damping_ratio = 0.0")
        .replace("viscosity = \"10 Pa s\"", "viscosity = \"0 Pa s\"");
    let error = Sensor::parse("undamped.toml", &damped).unwrap_err();
    assert!(error.message.contains("damps"), "{error}");
    let unit = message("\"650 pC/N\"", "\"650 pF\"");
    assert!(unit.contains("a charge per force is needed"), "{unit}");
}

#[test]
fn an_undamped_plate_in_viscous_silicone_is_a_device() {
    assert!(changed("damping_ratio = 1.0", "damping_ratio = 0.0").is_ok());
}

#[test]
fn predicted_peaks_are_those_of_the_reference_chain() {
    // The sensor file with the leak and the thickness of the reference set.
    let text = Sensor::shipped_text("piezo-1.5mm")
        .unwrap()
        .replace("276 Mohm", "280 Mohm")
        .replace("preload = \"2.68 N\"", "preload = \"0 N\"")
        .replace("thickness = \"1.5 mm\"", "thickness = \"1 mm\"");
    let sensor = Sensor::parse("b10.toml", &text).unwrap();
    let predictor = PiezoelectricPredictor::new(&sensor.piezoelectric().unwrap());
    let near = |found: f64, expected: f64| {
        // The reference is printed with 13 digits.
        assert!((found / expected - 1.0).abs() < 1e-11, "{found} {expected}");
    };
    let drive = Drive::Displacement(2.315e-5);
    let step = predictor
        .test(&Profile::Step { ramp: 0.01 }, drive)
        .unwrap();
    near(step.first, 2.120312675118e-02);
    assert_eq!((step.event, step.clipped), (Event::Step, false));
    let impact = Profile::Impact {
        ramp: 0.01,
        dwell: 0.2,
    };
    let impact = predictor.test(&impact, drive).unwrap();
    near(impact.second, 1.167199326697e-02);
    assert_eq!(impact.event, Event::Impact);
    let cyclic = Profile::Cyclic {
        ramp: 0.01,
        period: 0.35,
        cycles: 12,
    };
    let cyclic = predictor.test(&cyclic, drive).unwrap();
    near(cyclic.first, 1.378337722832e-02);
    near(cyclic.second, 1.378337560149e-02);
    assert_eq!(cyclic.event, Event::Cyclic);
}

#[test]
fn per_force_the_thickness_does_not_matter_per_displacement_it_does() {
    let [thin, thick] = SENSORS.map(|name| Sensor::shipped(name).unwrap());
    let answer = |sensor: &Sensor, drive| {
        let predictor = PiezoelectricPredictor::new(&sensor.piezoelectric().unwrap());
        let step = Profile::Step { ramp: 0.01 };
        predictor.test(&step, drive).unwrap().first
    };
    let force = Drive::Force(0.01);
    // Two equal chains.
    assert_eq!(answer(&thin, force), answer(&thick, force));
    let way = Drive::Displacement(46.3e-6);
    // Linear preload: 1.0925/0.9975; k_s/k_p is 2e-7.
    let ratio = answer(&thin, way) / answer(&thick, way);
    assert!((ratio - 1.0925 / 0.9975).abs() < 1e-6, "{ratio}");
}

#[test]
fn loads_without_meaning_are_refused_at_their_column() {
    let sensor = sensor();
    let predictor = PiezoelectricPredictor::new(&sensor.piezoelectric().unwrap());
    let number = |value| Some(LoadValue::Number(value));
    let refused = |values: [Option<LoadValue>; 7]| {
        let error = predictor.answer(&Load::of(&values), &mut Vec::new());
        predictor.load_columns()[error.unwrap_err().column].name
    };
    let step = Some(LoadValue::Word(0));
    let x = number(1e-5);
    let (ramp, none) = (number(0.01), None);
    assert_eq!(refused([step, x, none, none, none, none, none]), "ramp");
    assert_eq!(refused([step, x, x, ramp, none, none, none]), "force_z");
    assert_eq!(
        refused([step, none, none, ramp, none, none, none]),
        "displacement"
    );
    let impact = Some(LoadValue::Word(1));
    assert_eq!(refused([impact, x, none, ramp, none, none, none]), "dwell");
    let cyclic = Some(LoadValue::Word(2));
    let period = number(0.2);
    assert_eq!(
        refused([cyclic, x, none, number(0.11), none, period, number(3.0)]),
        "ramp"
    );
    assert_eq!(
        refused([cyclic, x, none, ramp, none, period, number(2.5)]),
        "cycles"
    );
    let mut row = Vec::new();
    let good = [cyclic, none, number(5.0), ramp, none, period, number(3.0)];
    predictor.answer(&Load::of(&good), &mut row).unwrap();
    assert_eq!(row.len(), predictor.columns().len());
    // 5 N would give far more than 3 V.
    assert!(format!("{:?}", row.last().unwrap()).contains("clipped"));
    let figure = predictor.history(&Load::of(&good)).unwrap();
    assert_eq!(figure.charts.len(), 2);
    for point in figure.charts[1]
        .series
        .iter()
        .flat_map(|series| &series.points)
    {
        assert!(point.iter().all(|value| value.is_finite()));
    }
}

#[test]
fn the_force_of_a_press_comes_back() {
    let text = Sensor::shipped_text("piezo-1.5mm")
        .unwrap()
        .replace("gain_deviation = 0.02", "gain_deviation = 0.0");
    let sensor = Sensor::parse("even.toml", &text).unwrap();
    let array = sensor.piezoelectric().unwrap();
    let deviation = ChargeReader::new(array.model(), ChargeOptions::default()).deviation();
    let mut held = 0;
    let mut largest = 0.0_f64;
    run(&sensor, &script("piezo-press"), |time, touch, truth| {
        for (taxel, true_force) in touch.taxels.iter().zip(truth) {
            assert_eq!(taxel.state, State::Ok);
            largest = largest.max(true_force[2]);
            // Before, and 100 ms after each ramp, when the smoothing is over.
            let quiet = time < 1.0 || (1.2..3.1).contains(&time);
            if quiet {
                // The drift guard lets a held force fade with 5 s.
                let faded = if time > 1.0 {
                    true_force[2] * f64::exp(-(time - 1.05) / 5.0)
                } else {
                    true_force[2]
                };
                let allowed = 6.0 * deviation + 0.002 * true_force[2];
                assert!(
                    (taxel.pressed() - faded).abs() < allowed,
                    "{time}: {taxel:?} {true_force:?}"
                );
                held += 1;
            }
        }
    });
    assert!(held > 10_000);
    // The finger is 2 mm from the centres of 2 and 3.
    assert!(largest > 0.02, "{largest}");
}

#[test]
fn noise_of_the_force_is_what_the_estimator_states() {
    let quiet = Stimulus::parse("q", "schema = 1\nname = \"q\"\nduration = \"60 s\"\n").unwrap();
    // A converter that rounds to 1.2 mV with 0.3 mV of noise is not white:
    // a finer one shows the noise of the estimator.
    let fine = changed("bits = 14", "bits = 20").unwrap();
    let stated = ChargeReader::new(
        fine.piezoelectric().unwrap().model(),
        ChargeOptions::default(),
    )
    .deviation();
    let (mut sum, mut count) = (0.0, 0.0);
    run(&fine, &quiet, |time, touch, _| {
        if time > 20.0 {
            for taxel in &touch.taxels {
                sum += taxel.pressed() * taxel.pressed();
                count += 1.0;
            }
        }
    });
    let measured = f64::sqrt(sum / count);
    // 8 x 40 s of a noise that the guard of 5 s lets wander: about 100
    // independent values of the slow part, a third of the whole.
    assert!(
        (measured / stated - 1.0).abs() < 0.15,
        "{measured} {stated}"
    );
}

#[test]
fn taps_are_found_where_they_are() {
    // Figures 18 to 20: sensel 1, then 2; 2 and 6; 3 and 4 above 7 and 8.
    let sensor = sensor();
    let mut peaks = [[0.0_f64; 8]; 4];
    run(&sensor, &script("piezo-tap"), |time, touch, _| {
        let tap = ((time - 1.0) / 2.0).floor();
        if (0.0..4.0).contains(&tap) && time < 1.0 + 2.0 * tap + 0.3 {
            for (peak, taxel) in peaks[tap as usize].iter_mut().zip(&touch.taxels) {
                *peak = peak.max(taxel.pressed());
            }
        }
    });
    let order = |peaks: &[f64; 8]| {
        let mut order: Vec<usize> = (1..=8).collect();
        order.sort_by(|a, b| peaks[b - 1].total_cmp(&peaks[a - 1]));
        order
    };
    assert_eq!(order(&peaks[0])[0], 1);
    // Only the first sensel is active: the next one gives less than a tenth.
    assert!(peaks[0][1..].iter().all(|peak| *peak < 0.1 * peaks[0][0]));
    assert_eq!(order(&peaks[1])[0], 2);
    let mut gap = order(&peaks[2])[..2].to_vec();
    gap.sort_unstable();
    assert_eq!(gap, [2, 6]);
    // Two gains scattered by 2 % and at most 3 deviations of each.
    assert!((peaks[2][1] / peaks[2][5] - 1.0).abs() < 0.13);
    let mut four = order(&peaks[3])[..4].to_vec();
    let mut near = four[..2].to_vec();
    near.sort_unstable();
    four.sort_unstable();
    assert_eq!((near, four), (vec![3, 4], vec![3, 4, 7, 8]));
}

#[test]
fn a_slider_activates_the_columns_in_order() {
    // Figure 21: from column 1/5 to column 4/8.
    for name in SENSORS {
        let sensor = Sensor::shipped(name).unwrap();
        let mut peaks = [(0.0_f64, 0.0_f64); 8];
        run(&sensor, &script("piezo-slide"), |time, touch, _| {
            for (peak, taxel) in peaks.iter_mut().zip(&touch.taxels) {
                if taxel.pressed() > peak.0 {
                    *peak = (taxel.pressed(), time);
                }
            }
        });
        for row in peaks.chunks(4) {
            assert!(row.windows(2).all(|pair| pair[0].1 < pair[1].1), "{row:?}");
            // 12 mm at 20 mm/s; the guard moves peaks by some milliseconds.
            assert!((row[3].1 - row[0].1 - 0.6).abs() < 0.02, "{row:?}");
        }
    }
}

/// From nothing at 0.1 s to 0.5 N at 0.2 s.
const RAMP: &str = "{ time = \"0.1 s\", force = [\"0 N\", \"0 N\", \"0 N\"] }, \
                    { time = \"0.2 s\", force = [\"0 N\", \"0 N\", \"0.5 N\"] }";

#[test]
fn channels_are_sampled_one_after_the_other() {
    // All elements under one wide press: the later ones are 0.1 ms further.
    let mut text = String::from("schema = 1\nname = \"r\"\nduration = \"1 s\"\n");
    for taxel in 0..8 {
        let (row, column) = (taxel / 4, taxel % 4);
        write!(
            text,
            "[[probe]]\ntaxel = [{row}, {column}]\npath = [{RAMP}]\n"
        )
        .unwrap();
    }
    let stimulus = Stimulus::parse("r", &text).unwrap();
    let even = changed("gain_deviation = 0.02", "gain_deviation = 0.0").unwrap();
    let array = even.piezoelectric().unwrap();
    let chain = taxel_numerics::linear_chain::Chain::new(&array.output_per_force()).unwrap();
    let mut twin = Twin::new(&even, &stimulus, 1).unwrap();
    let knots = [[0.1, 0.0], [0.2, 0.5]];
    for _ in 0..195 {
        let Delivery::Frame(Frame {
            time_ns, values, ..
        }) = twin.next_delivery()
        else {
            panic!("no link is down")
        };
        for (taxel, counts) in values.iter().enumerate() {
            let time = time_ns as f64 * 1e-9 + 1e-4 * taxel as f64;
            let expected = chain.respond(&knots, &[time])[0];
            let off = array.board.reading(*counts) - expected;
            // Half a step, five deviations of the noise, and what a frame of
            // 1 ms makes of the corner at 0.1 s: 5 N/s for 1 ms.
            assert!(
                off.abs() < 0.61e-3 + 1.5e-3 + 0.1e-3,
                "{time} {taxel}: {off}"
            );
        }
    }
}

#[test]
fn bad_readings_are_states_and_never_numbers() {
    let sensor = changed(
        "[element.piezoelectric]\n",
        "[[mask]]\ntaxel = [1, 3]\n\n[element.piezoelectric]\n",
    )
    .unwrap();
    let array = sensor.piezoelectric().unwrap();
    let mut estimator = plain(&sensor);
    let rest = array.board.read(0.0, 0.0).number;
    let top = array.board.read(9.0, 0.0).number;
    let mut frame = Frame {
        sequence: 0,
        time_ns: 0,
        values: vec![rest; 8],
        ..Frame::default()
    };
    estimator.push(&frame).unwrap();
    frame.values[0] = f64::NAN;
    frame.values[1] = top;
    frame.time_ns = 1_000_000;
    let (touch, _) = estimator.push(&frame).unwrap();
    let states: Vec<State> = touch.taxels.iter().map(|taxel| taxel.state).collect();
    assert_eq!(states[0], State::Faulty);
    assert_eq!(states[1], State::Saturated);
    assert_eq!(states[2], State::Ok);
    assert_eq!(states[7], State::Masked);
    assert_eq!(touch.clipped, 1);
    assert!(touch.taxels[0].pressed().is_nan() && touch.taxels[7].pressed().is_nan());
    frame.values = vec![rest; 8];
    frame.time_ns = 2_000_000;
    let (touch, _) = estimator.push(&frame).unwrap();
    // What was cut is missing in the force until the guard has let it fade.
    assert_eq!(touch.taxels[1].state, State::Unchecked);
    assert_eq!(touch.taxels[0].state, State::Ok);
    assert!(
        touch.taxels[..7]
            .iter()
            .all(|taxel| taxel.pressed().is_finite())
    );
    // A late frame changes nothing.
    frame.time_ns = 1_500_000;
    assert_eq!(estimator.push(&frame).unwrap().0.time_ns, 2_000_000);
    let at = |estimator: &mut ArrayEstimator, frame: &mut Frame, time_ns| {
        frame.time_ns = time_ns;
        // A reading without any noise is one that stands still.
        frame.values = vec![rest + (time_ns / 1_000_000 % 2) as f64; 8];
        estimator.push(frame).unwrap().0.taxels[1].state
    };
    // A pause of a second: the signal in it is missing too.
    assert_eq!(
        at(&mut estimator, &mut frame, 1_000_000_000),
        State::Unchecked
    );
    for millisecond in 1_001..6_000 {
        assert_eq!(
            at(&mut estimator, &mut frame, millisecond * 1_000_000),
            State::Unchecked
        );
    }
    assert_eq!(at(&mut estimator, &mut frame, 6_000_000_000), State::Ok);
    frame.values.pop();
    assert!(estimator.push(&frame).is_err());
}

#[test]
fn a_rest_capture_takes_the_offset_and_refuses_a_moving_device() {
    let sensor = sensor();
    let array = sensor.piezoelectric().unwrap();
    let mut estimator = plain(&sensor);
    let counts = |volts: f64| array.board.read(volts, 0.0).number;
    let mut frame = Frame {
        sequence: 0,
        time_ns: 0,
        values: vec![counts(0.05); 8],
        ..Frame::default()
    };
    let mut capture = |estimator: &mut ArrayEstimator, slope: f64| {
        estimator.begin_rest_capture(50);
        for i in 0..50 {
            frame.time_ns += 1_000_000;
            frame.values[3] = counts(0.05 + slope * f64::from(i));
            if let (_, Some(end)) = estimator.push(&frame).unwrap() {
                assert_eq!(i, 49);
                return end;
            }
        }
        panic!("the capture did not end")
    };
    let refused = capture(&mut estimator, 1e-3).unwrap_err().to_string();
    assert!(refused.contains("sensel 4"), "{refused}");
    capture(&mut estimator, 0.0).unwrap();
    let (touch, _) = estimator
        .push(&Frame {
            sequence: 1,
            time_ns: 1_000_000_000,
            values: vec![counts(0.05); 8],
            ..Frame::default()
        })
        .unwrap();
    assert!(
        touch
            .channels
            .rest
            .iter()
            .all(|rest| (rest - 0.05).abs() < 0.7e-3)
    );
    assert!(
        touch
            .taxels
            .iter()
            .all(|taxel| taxel.pressed().abs() < 1e-12)
    );
}

#[test]
fn facts_and_drawing_are_there() {
    for name in SENSORS {
        let sensor = Sensor::shipped(name).unwrap();
        let array = sensor.piezoelectric().unwrap();
        let facts = array.facts();
        for wanted in [
            "preloaded_thickness",
            "sensitivity_per_force",
            "sensitivity_per_displacement",
            "resolution_force",
            "leak_time_constant",
            "low_pass_corner",
            "rest_voltage",
        ] {
            assert!(facts.iter().any(|fact| fact.name == wanted), "{wanted}");
        }
        let drawing = array.drawing();
        assert_eq!(drawing.views.len(), 2);
        assert!(drawing.svg().contains("pitch 4 mm"));
    }
}
