//! Magnets in rubber over magnetometers: from the file to forces and back.

use taxel::acquisition::{Delivery, Frame, Stimulus, Twin};
use taxel::estimation::{State, TouchSession};
use taxel::information::InformationOptions;
use taxel::predict::{Load, LoadValue};
use taxel::sensor::Sensor;
use taxel::stage::{Chain, Inverted};
use taxel::summary::Value;
use taxel_numerics::Noise;

fn shipped() -> &'static str {
    Sensor::shipped_text("magnet-over-four-hall").unwrap()
}

fn parse(text: &str) -> Sensor {
    Sensor::parse("magnet.toml", text).unwrap()
}

/// The shipped sensor with another part of its text.
fn with(pairs: &[(&str, &str)]) -> Sensor {
    let mut text = shipped().to_owned();
    for (from, to) in pairs {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    parse(&text)
}

/// As drawn, all that is made otherwise or warm left out.
fn exact() -> Sensor {
    let (head, rest) = shipped()
        .split_once("[element.magnetic_skin.fabrication]")
        .unwrap();
    let (_, electronics) = rest.split_once("[electronics]").unwrap();
    parse(&format!("{head}[electronics]{electronics}"))
}

/// What moves the readings beside the force: a uniform field, T, and the relative change of the
/// remanence.
#[derive(Clone, Copy, Default)]
struct Around {
    field: [f64; 3],
    warming: f64,
    /// What each channel reads without a field, T.
    offsets: [f64; 12],
}

/// A session after a capture at rest, with the frames of the skin `made`.
struct Bench<'a> {
    made: &'a Chain,
    session: TouchSession,
    noise: Noise,
    sequence: u64,
}

const REST_FRAMES: u64 = 50;

impl<'a> Bench<'a> {
    fn new(model: &Sensor, made: &'a Chain, around: Around, seed: u64) -> Self {
        let device = model.device().unwrap();
        let script = Stimulus::parse("push", Stimulus::shipped_text("push").unwrap()).unwrap();
        let stream = Twin::new(model, &script, 1).unwrap().stream();
        let mut bench = Self {
            made,
            session: device.session(&stream).unwrap(),
            noise: Noise::seeded(seed),
            sequence: 0,
        };
        bench.session.begin_rest_capture(REST_FRAMES as usize);
        for _ in 0..REST_FRAMES {
            bench.push(&vec![0.0; made.count()], around);
        }
        bench
    }

    fn signals(&self, loads: &[f64], around: Around) -> Vec<f64> {
        let signals = self.made.respond(loads).signals;
        let of = |(channel, signal): (usize, &f64)| {
            let offset = around.offsets.get(channel).copied().unwrap_or(0.0);
            (1.0 + around.warming) * signal + around.field[channel % 3] + offset
        };
        signals.iter().enumerate().map(of).collect()
    }

    fn push(&mut self, loads: &[f64], around: Around) {
        let signals = self.signals(loads, around);
        self.push_signals(&signals);
    }

    fn push_signals(&mut self, signals: &[f64]) {
        let sigma = self.made.last.noise();
        let noisy = signals
            .iter()
            .map(|signal| signal + sigma * self.noise.normal());
        let noisy: Vec<f64> = noisy.collect();
        self.push_exactly(&noisy);
    }

    fn push_exactly(&mut self, signals: &[f64]) {
        let frame = Frame {
            sequence: self.sequence,
            time_ns: 10_000_000 * self.sequence,
            values: signals.to_vec(),
            ..Frame::default()
        };
        self.sequence += 1;
        self.session.push(&frame).unwrap();
    }

    /// Force on the first taxel, its deviations and its state.
    fn found(&self) -> ([f64; 3], [f64; 3], State) {
        let taxel = &self.session.estimator().touch().taxels[0];
        (taxel.value, taxel.deviation(), taxel.state)
    }
}

/// The value of a fact in the unit in which people read it.
fn of_check(sensor: &Sensor, name: &str) -> f64 {
    let facts = sensor.device().unwrap().facts();
    let fact = facts.iter().find(|fact| fact.name == name);
    match &fact.unwrap_or_else(|| panic!("{name} is missing")).value {
        Value::Number { si, scale, .. } => si / scale,
        Value::Text(text) => panic!("{name}: {text}"),
    }
}

#[test]
fn check_prints_the_deviations_of_the_reference() {
    let sensor = exact();
    // Fisher information of the cylinder by differences of magpylib 6.3, which leave eight digits.
    for (name, expected) in [
        ("x", 0.15128545),
        ("y", 0.15128545),
        ("z", 0.05412288),
        ("tilt_x", 0.10213515),
        ("tilt_y", 0.10213515),
    ] {
        let found = of_check(&sensor, &format!("deviation_of_the_magnet_{name}"));
        assert!((found / expected - 1.0).abs() < 1e-7, "{name}: {found}");
    }
    // The deviations of the reference table own_magnet.csv are those of the dipole.
    let diameter = (1.5 * 9.0_f64).cbrt();
    let ball = format!("sphere = {{ diameter = \"{diameter} mm\" }}");
    let dipole = with(&[(
        "cylinder = { diameter = \"3 mm\", height = \"1 mm\" }",
        &ball,
    )]);
    for (name, expected) in [
        ("x", 0.181019336),
        ("y", 0.181019336),
        ("z", 0.05174093334),
        ("tilt_x", 0.1066666667),
        ("tilt_y", 0.1066666667),
    ] {
        let found = of_check(&dipole, &format!("deviation_of_the_magnet_{name}"));
        // The table has ten digits, the diameter of the ball sixteen.
        assert!((found / expected - 1.0).abs() < 1e-8, "{name}: {found}");
    }
}

/// Figures of docs/book/magnetic-skin.md: four chips that lie alike do not tell force, uniform field and
/// temperature apart, whatever their noise.
#[test]
fn a_fifth_chip_tells_a_pressing_force_from_warmth_and_less_noise_does_not() {
    let of = |pairs: &[(&str, &str)]| of_check(&with(pairs), "deviation_of_force_z_at_rest");
    for (pairs, expected) in [
        ([("0.5 uT", "0.5 uT")], 15.704),
        ([("\"0.5 uT\"", "\"0.05 uT\"")], 15.704),
        ([("\"5 K\"", "\"1 K\"")], 3.2490),
        (
            [("sensors = [[", "sensors = [[\"0 mm\", \"0 mm\"], [")],
            0.32093,
        ),
    ] {
        let found = of(&pairs);
        // As many digits as are printed; a tenth of the noise is worth a hundredth of 1 %.
        assert!((found / expected - 1.0).abs() < 1e-4, "{pairs:?}: {found}");
    }
}

/// Loads of up to 0.8 of the full scale on all axes, pressing.
fn random_load(noise: &mut Noise, count: usize) -> Vec<f64> {
    let axis = |index: usize, normal: f64| match index % 3 {
        2 => (0.4 * normal.abs()).min(0.8),
        _ => (0.2 * normal).clamp(-0.8, 0.8),
    };
    (0..count)
        .map(|index| axis(index, noise.normal()))
        .collect()
}

#[test]
fn forces_come_back_through_the_exact_network() {
    let arrays = [
        exact(),
        with(&[("rows = 1", "rows = 2"), ("columns = 1", "columns = 3")]),
    ];
    let mut noise = Noise::seeded(4);
    for sensor in arrays {
        let device = sensor.cells().unwrap();
        let drawn = device.chain();
        let chain = drawn.at_rest(&drawn.rest()).unwrap();
        for _ in 0..10 {
            let loads = random_load(&mut noise, chain.count());
            let signals = chain.respond(&loads).signals;
            let mut found = Inverted {
                values: vec![0.0; loads.len()],
                ..Inverted::default()
            };
            chain
                .network
                .invert(&signals, &vec![0.5e-6; signals.len()], &mut found);
            assert!(found.converged);
            for (found, load) in found.values.iter().zip(&loads) {
                // The search ends within 1e-4 deviations, which are below 10 mN.
                assert!((found - load).abs() < 1e-6, "{found} {load}");
            }
        }
    }
}

/// Shares of the 95 % intervals that hold the truth, along x, y and z, over made skins, loads, fields of
/// the earth that turn after the capture at rest, and temperatures.
fn coverage(frames: u32) -> [f64; 3] {
    let sensor = parse(shipped());
    let device = sensor.cells().unwrap();
    let mut noise = Noise::seeded(52);
    let mut held = [0_u32; 3];
    for seed in 0..u64::from(frames) {
        let made = device.scattered(&mut || noise.normal());
        let mut field = || {
            [(); 3]
                .map(|()| noise.normal())
                .map(|normal| 65e-6 * normal)
        };
        let rest = Around::default();
        let mut bench = Bench::new(&sensor, &made, rest, seed);
        let around = Around {
            field: field(),
            warming: -0.0012 * 5.0 * noise.normal(),
            ..rest
        };
        let loads = random_load(&mut noise, 3);
        bench.push(&loads, around);
        let (force, deviation, state) = bench.found();
        assert_ne!(state, State::Inconsistent, "{seed}");
        for axis in 0..3 {
            let off = (force[axis] - loads[axis]).abs();
            held[axis] += u32::from(off <= 1.959964 * deviation[axis]);
        }
    }
    held.map(|held| f64::from(held) / f64::from(frames))
}

#[test]
fn intervals_of_forces_hold_the_truth() {
    let frames = 600;
    let shares = coverage(frames);
    println!("{shares:?} of {frames}");
    // Three standard errors of 95 % of 600.
    for share in shares {
        assert!(
            (share - 0.95).abs() < 3.0 * (0.95 * 0.05 / f64::from(frames)).sqrt(),
            "{shares:?}"
        );
    }
}

/// `cargo test --release -p taxel --test all magnetic_skin::intervals_of_many -- --ignored --nocapture`
#[test]
#[ignore = "half a minute"]
fn intervals_of_many_forces_hold_the_truth() {
    let shares = coverage(20_000);
    println!("{shares:?}");
    assert!(
        shares.iter().all(|share| (0.93..0.97).contains(share)),
        "{shares:?}"
    );
}

#[test]
fn an_estimator_of_the_same_shape_has_no_bias() {
    let sensor = exact();
    let device = sensor.cells().unwrap();
    let mut noise = Noise::seeded(9);
    for _ in 0..20 {
        let loads = random_load(&mut noise, 3);
        let (mut sum, mut deviation) = ([0.0; 3], [0.0; 3]);
        let frames = 20_u32;
        for seed in 0..u64::from(frames) {
            let mut bench = Bench::new(&sensor, device.chain(), Around::default(), seed);
            bench.push(&loads, Around::default());
            let (force, of, state) = bench.found();
            assert_eq!(state, State::Ok);
            deviation = of;
            for axis in 0..3 {
                sum[axis] += force[axis] - loads[axis];
            }
        }
        for axis in 0..3 {
            // The mean of twenty frames is known to 0.22 deviations: a bias of one would show.
            assert!(
                (sum[axis] / f64::from(frames)).abs() < deviation[axis],
                "{sum:?} {deviation:?}"
            );
        }
    }
}

#[test]
fn a_dipole_fitted_to_a_disc_is_flagged() {
    let (disc, made) = (exact(), exact());
    let diameter = (1.5 * 9.0_f64).cbrt();
    let ball = format!("sphere = {{ diameter = \"{diameter} mm\" }}");
    let text = shipped().replace(
        "cylinder = { diameter = \"3 mm\", height = \"1 mm\" }",
        &ball,
    );
    let (head, rest) = text
        .split_once("[element.magnetic_skin.fabrication]")
        .unwrap();
    let (_, electronics) = rest.split_once("[electronics]").unwrap();
    let dipole = parse(&format!("{head}[electronics]{electronics}"));
    let device = made.cells().unwrap();
    for (model, expected) in [(&disc, State::Ok), (&dipole, State::Inconsistent)] {
        for loads in [[0.0, 0.0, 0.5], [0.2, 0.0, 0.3], [0.1, -0.2, 0.6]] {
            let mut bench = Bench::new(model, device.chain(), Around::default(), 3);
            bench.push(&loads, Around::default());
            let (force, _, state) = bench.found();
            assert_eq!(state, expected, "{loads:?} {force:?}");
        }
    }
}

#[test]
fn the_field_of_the_earth_turned_round_is_no_force() {
    let sensor = parse(shipped());
    let device = sensor.cells().unwrap();
    for axis in 0..3 {
        let mut field = [0.0; 3];
        field[axis] = 65e-6;
        let ahead = Around {
            field,
            ..Around::default()
        };
        let back = Around {
            field: field.map(|b| -b),
            ..Around::default()
        };
        for loads in [[0.0; 3], [0.1, 0.2, 0.5]] {
            let mut bench = Bench::new(&sensor, device.chain(), ahead, 17);
            // Without noise: what is asked is what the field alone does.
            let [ahead, back] = [ahead, back].map(|around| bench.signals(&loads, around));
            bench.push_exactly(&ahead);
            let (before, deviation, _) = bench.found();
            bench.push_exactly(&back);
            let (after, _, state) = bench.found();
            assert_eq!(state, State::Ok);
            for (of, deviation) in before
                .iter()
                .zip(after)
                .map(|(a, b)| (a - b).abs())
                .zip(deviation)
            {
                assert!(
                    of < 2.0 * deviation,
                    "{axis}: {before:?} {after:?} {deviation:?}"
                );
            }
        }
    }
}

/// A second magnet beside the skin, as iron nearby would be, is no uniform field.
#[test]
fn a_magnet_nearby_is_a_disturbance() {
    use taxel::transduction::{MagnetPose, MagnetShape, SphereMagnet};
    let sensor = parse(shipped());
    let device = sensor.cells().unwrap();
    let mut bench = Bench::new(&sensor, device.chain(), Around::default(), 2);
    let loads = [0.0, 0.1, 0.4];
    let mut signals = bench.signals(&loads, Around::default());
    let ball = MagnetShape::Sphere(SphereMagnet { diameter: 5e-3 });
    let pose = MagnetPose {
        position: [25e-3, 6e-3, 2e-3],
        tilt: [0.4, 1.0],
    };
    for (sensor, [x, y]) in [[2e-3, 2e-3], [-2e-3, 2e-3], [-2e-3, -2e-3], [2e-3, -2e-3]]
        .into_iter()
        .enumerate()
    {
        let of = ball.field(1.2, &pose, [x, y, 0.0]).field;
        (0..3).for_each(|axis| signals[3 * sensor + axis] += of[axis]);
    }
    bench.push_signals(&signals);
    let (force, _, state) = bench.found();
    assert_eq!(state, State::Inconsistent, "{force:?}");
    assert!(bench.session.estimator().touch().taxels[0].residual > 6.0);
}

#[test]
fn warmth_is_in_the_interval_and_not_in_the_state() {
    let sensor = parse(shipped());
    let device = sensor.cells().unwrap();
    let mut bench = Bench::new(&sensor, device.chain(), Around::default(), 2);
    let loads = [0.1, 0.0, 0.4];
    for kelvin in [-8.0, 4.0, 8.0] {
        let around = Around {
            warming: -0.0012 * kelvin,
            ..Around::default()
        };
        bench.push(&loads, around);
        let (force, deviation, state) = bench.found();
        assert_eq!(state, State::Ok);
        for axis in 0..3 {
            // 8 K are 1.6 of the deviations that the file states.
            assert!(
                (force[axis] - loads[axis]).abs() < 3.0 * deviation[axis],
                "{kelvin} K: {force:?}"
            );
        }
    }
}

#[test]
fn a_chip_that_fails_widens_the_intervals_and_all_of_them_end_the_force() {
    let sensor = parse(shipped());
    let device = sensor.cells().unwrap();
    let loads = [0.1, 0.0, 0.4];
    let deviations = [0, 3, 12].map(|dead: usize| {
        let mut bench = Bench::new(&sensor, device.chain(), Around::default(), 2);
        let mut signals = bench.signals(&loads, Around::default());
        signals[..dead].fill(f64::NAN);
        bench.push_signals(&signals);
        let (force, deviation, state) = bench.found();
        if dead == 12 {
            assert_eq!(state, State::Faulty);
        } else {
            assert_eq!(state, State::Ok);
            // Four deviations: once in 10⁴ along one axis.
            for axis in 0..3 {
                assert!(
                    (force[axis] - loads[axis]).abs() < 4.0 * deviation[axis],
                    "{force:?}"
                );
            }
        }
        deviation[0]
    });
    assert!(deviations[1] > deviations[0], "{deviations:?}");
}

#[test]
fn one_chip_cannot_give_five_numbers_and_check_says_which() {
    let four = "sensors = [[\"2 mm\", \"2 mm\"], [\"-2 mm\", \"2 mm\"], [\"-2 mm\", \"-2 mm\"], [\"2 mm\", \"-2 mm\"]]";
    let one = with(&[(four, "sensors = [[\"0 mm\", \"0 mm\"]]")]);
    let facts = one.device().unwrap().facts();
    let fact = facts
        .iter()
        .find(|fact| fact.name == "not_observable")
        .unwrap();
    let Value::Text(words) = &fact.value else {
        panic!("{fact:?}");
    };
    // On the axis a shift along x and a tilt about y are the same, and so along y.
    assert!(
        words.starts_with("x, y, tilt_x, tilt_y: 3 readings"),
        "{words}"
    );
    let device = one.device().unwrap();
    let load = [None, None, Some(LoadValue::Number(0.3)), None, None];
    let options = InformationOptions::default();
    let found = device.information(&Load::of(&load), &options).unwrap();
    let four = parse(shipped());
    let four = four
        .device()
        .unwrap()
        .information(&Load::of(&load), &options)
        .unwrap();
    // Neither a uniform field nor a force of one chip is known apart from the other.
    for name in ["force_x", "force_y"] {
        let ratio = found.deviation(name).unwrap() / four.deviation(name).unwrap();
        assert!(ratio > 2.0, "{name}: {ratio}");
    }
}

#[test]
fn a_force_beyond_the_suspension_is_out_of_range() {
    let sensor = exact();
    let device = sensor.cells().unwrap();
    let mut bench = Bench::new(&sensor, device.chain(), Around::default(), 2);
    bench.push(&[0.0, 0.0, 1.2], Around::default());
    assert_eq!(bench.found().2, State::OutOfRange);
    // The magnet, 0.5 mm of it below its middle, reaches 3.9 mm at 0.16 N.
    let low = with(&[(
        "full_scale = \"1 N\" ",
        "least_height = \"3.9 mm\"\nfull_scale = \"1 N\" ",
    )]);
    let device = low.cells().unwrap();
    let mut bench = Bench::new(&low, device.chain(), Around::default(), 2);
    bench.push(&[0.0, 0.0, 0.3], Around::default());
    assert_eq!(bench.found().2, State::OutOfRange);
}

#[test]
fn the_twin_pushes_and_the_reader_follows() {
    let sensor = parse(shipped());
    let script = Stimulus::parse("push", Stimulus::shipped_text("push").unwrap()).unwrap();
    let mut twin = Twin::new(&sensor, &script, 1).unwrap();
    let mut session = sensor.device().unwrap().session(&twin.stream()).unwrap();
    session.begin_rest_capture(50);
    let mut seen = 0;
    for _ in 0..800 {
        let Delivery::Frame(frame) = twin.next_delivery() else {
            continue;
        };
        session.push(&frame).unwrap();
        let touch = session.estimator().touch();
        // Between 4.1 s and 4.9 s 0.2 N along x and 0.5 N press.
        if (4_100_000_000..4_900_000_000).contains(&frame.time_ns) {
            seen += 1;
            let (force, deviation) = (touch.total.force, touch.total_deviation());
            for (axis, truth) in [0.2, 0.0, 0.5].into_iter().enumerate() {
                // One piece of fabrication: its softness is off by the same in all frames, and four
                // deviations of it are as rare as of any.
                assert!(
                    (force[axis] - truth).abs() < 4.0 * deviation[axis],
                    "{force:?} {deviation:?}"
                );
            }
            assert_eq!(touch.contacts.len(), 1);
        }
    }
    assert!(seen > 70, "{seen}");
}

#[test]
fn a_taxel_with_too_few_readings_has_no_value() {
    let sensor = parse(shipped());
    let script = Stimulus::parse("push", Stimulus::shipped_text("push").unwrap()).unwrap();
    let mut twin = Twin::new(&sensor, &script, 1).unwrap();
    let mut session = sensor.device().unwrap().session(&twin.stream()).unwrap();
    session.begin_rest_capture(50);
    for number in 0..200 {
        let Delivery::Frame(mut frame) = twin.next_delivery() else {
            continue;
        };
        if number > 100 {
            // Two readings for three forces.
            frame.values[2..].fill(f64::NAN);
        }
        session.push(&frame).unwrap();
    }
    let taxel = &session.estimator().touch().taxels[0];
    assert_eq!(taxel.state, State::Faulty);
    assert!(
        taxel.value.iter().all(|force| force.is_nan()),
        "{:?}",
        taxel.value
    );
}

#[test]
fn a_compliance_says_the_same_as_springs() {
    let (head, rest) = shipped().split_once("stiffness = [").unwrap();
    let (_, rest) = rest
        .split_once("[element.magnetic_skin.fabrication]")
        .unwrap();
    let whole = "compliance = { displacement = [[\"2.5 mm/N\", \"0 mm/N\", \"0 mm/N\"], [\"0 mm/N\", \"2.5 mm/N\", \"0 mm/N\"], [\"0 mm/N\", \"0 mm/N\", \"-0.625 mm/N\"]], tilt = [[\"0 mrad/N\", \"-30 mrad/N\", \"0 mrad/N\"], [\"30 mrad/N\", \"0 mrad/N\", \"0 mrad/N\"]] }";
    let text = format!("{head}{whole}\n[element.magnetic_skin.fabrication]{rest}");
    let [springs, whole] = [shipped(), &text].map(parse);
    let signals = |sensor: &Sensor| {
        let device = sensor.cells().unwrap();
        device.chain().respond(&[0.2, -0.1, 0.5]).signals
    };
    for (a, b) in signals(&springs).iter().zip(signals(&whole)) {
        // Reciprocals of the stiffness are rounded.
        assert!((a - b).abs() < 1e-15, "{a} {b}");
    }
}

#[test]
fn mistakes_are_shown_at_their_keys() {
    for (from, to, key) in [
        (
            "remanence = \"1.2 T\" ",
            "remanence = \"0 T\" ",
            "element.magnetic_skin.magnet.remanence",
        ),
        (
            "\"4 mm\"]",
            "\"0.4 mm\"]",
            "element.magnetic_skin.magnet.rest",
        ),
        (
            "[electronics.readout.magnetometer] ",
            "[electronics.readout.pressure_chip] ",
            "electronics.readout.pressure_chip.noise",
        ),
        ("stiffness = [", "# [", "element.magnetic_skin.suspension"),
        (
            "range = [\"-50 mT\", \"50 mT\"]",
            "range = [\"-5 mT\", \"5 mT\"]",
            "electronics.readout.magnetometer.range",
        ),
        (
            "mount = \"flat\"",
            "mount = { cylinder = { radius = \"20 mm\" } }",
            "element.magnetic_skin.magnet",
        ),
    ] {
        assert!(shipped().contains(from), "{from}");
        let text = shipped().replace(from, to);
        let error = Sensor::parse("wrong.toml", &text).unwrap_err();
        assert_eq!(error.key, key, "{error}");
    }
    // Nothing else has three-axis chips.
    let mat = Sensor::shipped_text("pressure-chips-1x8").unwrap();
    let (head, _) = mat.split_once("[electronics.readout").unwrap();
    let (_, chips) = shipped()
        .split_once("[electronics.readout.magnetometer]")
        .unwrap();
    let text = format!("{head}[electronics.readout.magnetometer]{chips}");
    let error = Sensor::parse("wrong.toml", &text).unwrap_err();
    assert_eq!(error.key, "electronics.readout");
}
