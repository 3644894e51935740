//! Figures of merit of the estimators on simulated devices.

use std::error::Error;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use taxel::acquisition::{Delivery, Finger, FingerPoint, Link, Slider, Stimulus, Twin};
use taxel::estimation::{
    ArrayEstimator, Centroid, ChargeOptions, ChargeReader, ContactPosition, ELLIPSE_95, Localiser,
    ProfileFit, SearchOptions, SlipEstimator, SlipOptions, TaxelTouch, estimate_unit,
};
use taxel::mechanics::{EndCondition, GivenFactor};
use taxel::sensor::{Element, Sensor};
use taxel::transduction::CapacitanceLaw;
use taxel_calibrate::{CalibrateOptions, NamedSensor, ReadingTable, SyntheticOptions, calibrator};
use taxel_numerics::least_squares::Status;

/// Prints all figures.
pub(crate) fn all() -> Result<(), Box<dyn Error>> {
    in_plane()?;
    three_axis()?;
    let sensor = Sensor::shipped("piezo-1.5mm").ok_or("no such sensor")?;
    position(&sensor)?;
    position(&Sensor::shipped("piezo-2.3mm").ok_or("no such sensor")?)?;
    pairs(&sensor)?;
    slip(&sensor)
}

/// Synthetic benches whose intervals are counted.
const BENCHES: u64 = 40;

/// Table 1 of the in-plane sensors, fitted to three gaps with 1 % of noise.
fn in_plane() -> Result<(), Box<dyn Error>> {
    const NAMES: [&str; 3] = ["in-plane-20um", "in-plane-50um", "in-plane-100um"];
    // Of the layer and the end condition below.
    let mut truth = vec![1.2e6, 1.0];
    let mut sensors = Vec::new();
    for name in NAMES {
        let mut sensor = Sensor::shipped(name).ok_or("no such sensor")?;
        let Element::InPlaneCapacitor(element) = &mut sensor.element else {
            return Err("no in-plane sensor".into());
        };
        element.law = CapacitanceLaw::Published;
        element.layer.end_condition = EndCondition::Given(GivenFactor { chi: 0.909 });
        let model = sensor.in_plane()?.model();
        let table = model.published_fit.ok_or("no published fit")?;
        truth.extend([
            model.rest_capacitance(),
            table.fringe.scale,
            table.fringe.exponent,
            table.thinning.least_thickness,
            table.thinning.rate,
        ]);
        sensors.push(sensor);
    }
    let named: Vec<NamedSensor<'_>> = NAMES
        .iter()
        .zip(&sensors)
        .map(|(name, sensor)| NamedSensor {
            name,
            text: "",
            sensor,
        })
        .collect();
    let calibrator = calibrator(&named)?;
    println!("in-plane sensors, three gaps, 1 % of noise: Table 1 in 95 % intervals");
    let (mut inside, mut first) = (0, None);
    for seed in 1..=BENCHES {
        let options = SyntheticOptions {
            seed,
            ..SyntheticOptions::default()
        };
        let text = calibrator.synthetic(&options);
        let bench =
            ReadingTable::parse("bench.csv", &text, calibrator.columns(), calibrator.group())?;
        let found = calibrator.calibrate(&bench, &CalibrateOptions::default())?;
        let intervals = found.parameters.iter().map(|(_, one)| one.interval);
        let covered = intervals.zip(&truth);
        inside += covered
            .filter(|([low, high], truth)| (low..=high).contains(truth))
            .count();
        first.get_or_insert(found);
    }
    let Some(found) = first else { return Ok(()) };
    for ((parameter, estimate), truth) in found.parameters.iter().zip(&truth) {
        let [low, high] = estimate.interval;
        println!(
            "  {:28} {:11.4e} is {truth:11.4e}, {low:11.4e} to {high:11.4e}{}",
            parameter.name,
            estimate.value,
            if estimate.status == Status::Identified {
                ""
            } else {
                ", not identifiable"
            }
        );
    }
    println!(
        "  inside over {BENCHES} benches: {:.1} %",
        100.0 * inside as f64 / (BENCHES as usize * truth.len()) as f64
    );
    for open in &found.open {
        println!("  open: {open}");
    }
    Ok(())
}

/// Forces on one unit at 0.1 fF of noise against the Cramér-Rao bound.
fn three_axis() -> Result<(), Box<dyn Error>> {
    let sensor = Sensor::shipped("three-axis-8x8").ok_or("no such sensor")?;
    let unit = sensor.three_axis()?.unit_model();
    let sigma = [1e-16; 4];
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let (mut squares, mut bounds) = ([0.0; 3], [0.0; 3]);
    let trials = 20_000;
    let options = SearchOptions::default();
    for _ in 0..trials {
        let mut shear = || random.random_range(-2e-3..2e-3);
        let force = [shear(), shear(), random.random_range(3e-3..10e-3)];
        let exact = unit.predict(force).1.capacitance();
        let bound = estimate_unit(&unit, exact, sigma, [true; 4], &options);
        let noisy = exact.map(|value| value + 1e-16 * random.sample::<f64, _>(StandardNormal));
        let found = estimate_unit(&unit, noisy, sigma, [true; 4], &options);
        for axis in 0..3 {
            squares[axis] += (found.force[axis] - force[axis]).powi(2);
            bounds[axis] += bound.covariance[axis][axis];
        }
    }
    println!("three-axis unit, 0.1 fF, {trials} forces");
    for (axis, name) in ["x", "y", "z"].iter().enumerate() {
        let [error, bound] =
            [squares[axis], bounds[axis]].map(|sum| (sum / f64::from(trials)).sqrt());
        println!(
            "  {name}: rms error {:.3} uN, bound {:.3} uN, ratio {:.4}",
            error * 1e6,
            bound * 1e6,
            error / bound
        );
    }
    Ok(())
}

fn stimulus(duration: f64) -> Stimulus {
    Stimulus {
        schema: 1,
        name: "figure of merit".into(),
        duration,
        finger: Vec::new(),
        probe: Vec::new(),
        slider: Vec::new(),
        fault: Vec::new(),
        outage: Vec::new(),
        link: Link::default(),
    }
}

/// Time of one press, s.
const PRESS: f64 = 0.3;
const PRESSES: u32 = 100;

/// Places of presses whose radius the fit does not know.
fn position(sensor: &Sensor) -> Result<(), Box<dyn Error>> {
    let array = sensor.piezoelectric()?;
    let layout = array.layout();
    let fit = ProfileFit::new(array.profile_model()).ok_or("no profile of this array")?;
    let centroid = Centroid {
        positions: (0..layout.taxels())
            .map(|i| layout.flat_position(i))
            .collect(),
        pitch: layout.pitch,
    };
    println!(
        "{}, {PRESSES} presses of 1 N, rms error of the place",
        sensor.name
    );
    for radius in [1.5e-3, 2.3e-3, 2.9e-3, 3.6e-3, 5e-3] {
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let places: Vec<[f64; 2]> = (0..PRESSES)
            .map(|_| {
                [
                    random.random_range(-6e-3..6e-3),
                    random.random_range(-2e-3..2e-3),
                ]
            })
            .collect();
        let presses: Vec<Press> = places.iter().map(|at| vec![(*at, 1.0)]).collect();
        let profiles = profiles(sensor, radius, &presses)?;
        let rms = |localiser: &dyn Localiser| {
            let (mut squares, mut found, mut covered) = (0.0, 0, 0);
            for (place, [forces, deviations]) in places.iter().zip(&profiles) {
                if let Some(at) = localiser.position(forces, deviations) {
                    let [x, y] = [at.centre[0] - place[0], at.centre[1] - place[1]];
                    found += 1;
                    covered += u32::from(at.distance(*place) < ELLIPSE_95);
                    squares += x * x + y * y;
                }
            }
            (1e3 * (squares / f64::from(found)).sqrt(), found, covered)
        };
        let noise: Vec<f64> = profiles
            .iter()
            .map(|[forces, deviations]| forces.iter().copied().fold(0.0, f64::max) / deviations[0])
            .collect();
        let noise = noise.iter().sum::<f64>() / noise.len() as f64;
        let ((fitted, found, covered), (centre, ..)) = (rms(&fit), rms(&centroid));
        println!(
            "  radius {:.1} mm: profile {fitted:.3} mm ({found} located, {covered} in the ellipse of 95 %), centroid {centre:.3} mm, signal over noise {noise:.0}",
            radius * 1e3
        );
    }
    Ok(())
}

/// Contacts at one time: centre, m, and force, N.
type Press = Vec<([f64; 2], f64)>;

/// Places of two contacts at a time, 0.5 and 1 N, so far apart.
fn pairs(sensor: &Sensor) -> Result<(), Box<dyn Error>> {
    let fit = ProfileFit::new(sensor.piezoelectric()?.profile_model());
    let fit = fit.ok_or("no profile of this array")?;
    println!("{}, {PRESSES} pairs of 0.5 and 1 N", sensor.name);
    for (radius, distance) in [2.3e-3, 3.6e-3]
        .into_iter()
        .flat_map(|radius| [6e-3, 9e-3, 12e-3].map(|distance| (radius, distance)))
    {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut presses: Vec<Press> = Vec::new();
        while presses.len() < PRESSES as usize {
            let turn: f64 = random.random_range(0.0..std::f64::consts::TAU);
            let one: [f64; 2] = [
                random.random_range(-6e-3..6e-3),
                random.random_range(-2e-3..2e-3),
            ];
            let other = [
                one[0] + distance * turn.cos(),
                one[1] + distance * turn.sin(),
            ];
            if other[0].abs() < 6e-3 && other[1].abs() < 2e-3 {
                presses.push(vec![(one, 0.5), (other, 1.0)]);
            }
        }
        let (mut two, mut errors, mut covered) = (0, Vec::new(), 0);
        for (press, [forces, deviations]) in presses.iter().zip(profiles(sensor, radius, &presses)?)
        {
            let found = fit.positions(&forces, &deviations);
            if found.len() != 2 {
                continue;
            }
            two += 1;
            let positions: Vec<ContactPosition> =
                found.iter().filter_map(|one| one.position).collect();
            for (error, position, truth) in paired(&positions, press) {
                errors.push(error);
                covered += usize::from(position.distance(truth) < ELLIPSE_95);
            }
        }
        errors.sort_by(f64::total_cmp);
        println!(
            "  radius {:.1} mm, {:2.0} mm apart: {two} found as two, median error {:.3} mm, {covered} of {} in the ellipse of 95 %",
            radius * 1e3,
            distance * 1e3,
            errors.get(errors.len() / 2).copied().unwrap_or(f64::NAN) * 1e3,
            errors.len()
        );
    }
    Ok(())
}

/// Positions, up to two, with their contacts by the least sum of distances.
fn paired(positions: &[ContactPosition], press: &Press) -> Vec<(f64, ContactPosition, [f64; 2])> {
    let order = |first: usize| -> Vec<(f64, ContactPosition, [f64; 2])> {
        let pairs = positions.iter().enumerate();
        let pair = |(k, position): (usize, &ContactPosition)| {
            let truth = press[(first + k) % 2].0;
            let [x, y] = [0, 1].map(|axis| position.centre[axis] - truth[axis]);
            (x.hypot(y), *position, truth)
        };
        pairs.map(pair).collect()
    };
    let sum = |one: &[(f64, ContactPosition, [f64; 2])]| one.iter().map(|pair| pair.0).sum::<f64>();
    let [straight, crossed] = [order(0), order(1)];
    if sum(&straight) <= sum(&crossed) {
        straight
    } else {
        crossed
    }
}

/// Forces and deviations at the top of each press.
fn profiles(
    sensor: &Sensor,
    radius: f64,
    presses: &[Press],
) -> Result<Vec<[Vec<f64>; 2]>, Box<dyn Error>> {
    let mut script = stimulus(PRESS * f64::from(PRESSES));
    let contacts = presses.iter().enumerate();
    for (index, (at, most)) in contacts.flat_map(|(k, one)| one.iter().map(move |c| (k, c))) {
        let start = PRESS * index as f64;
        let point = |time: f64, force: f64| FingerPoint {
            time: start + time,
            at: *at,
            force: [0.0, 0.0, force],
        };
        let path = vec![
            point(0.05, 0.0),
            point(0.07, *most),
            point(0.15, *most),
            point(0.17, 0.0),
        ];
        script.finger.push(Finger { radius, path });
    }
    let mut twin = Twin::new(sensor, &script, 3)?;
    let model = sensor.piezoelectric()?.model();
    let reader = ChargeReader::new(model, ChargeOptions::default());
    let stated = reader.deviation();
    let mut estimator = ArrayEstimator::new(Box::new(reader));
    let taxels = estimator.meaning().layout.taxels();
    // Over 40 ms of the hold; the smoothing of 5 ms leaves eight independent
    // readings in it.
    // What earlier presses left is taken off: the profile is a change.
    let mut before = vec![0.0; taxels];
    let mut sums = vec![0.0; taxels];
    let mut count = 0.0;
    let mut found = Vec::new();
    while found.len() < presses.len() {
        let Delivery::Frame(frame) = twin.next_delivery() else {
            continue;
        };
        let (touch, _) = estimator.push(&frame)?;
        let time = frame.time_ns as f64 * 1e-9 - PRESS * found.len() as f64;
        if time < 0.045 {
            before.clear();
            before.extend(touch.taxels.iter().map(TaxelTouch::pressed));
        }
        if time < 0.09 {
            continue;
        }
        for (sum, taxel) in sums.iter_mut().zip(&touch.taxels) {
            *sum += taxel.pressed();
        }
        count += 1.0;
        if time >= 0.13 {
            let deviation = stated / 8f64.sqrt();
            let forces: Vec<f64> = sums
                .iter()
                .zip(&before)
                .map(|(sum, before)| sum / count - before)
                .collect();
            found.push([forces, vec![deviation; sums.len()]]);
            sums.fill(0.0);
            count = 0.0;
        }
    }
    Ok(found)
}

/// Speed of ridges that slide along the rows.
fn slip(sensor: &Sensor) -> Result<(), Box<dyn Error>> {
    println!("piezoelectric array, slip along the rows");
    let array = sensor.piezoelectric()?;
    let layout = array.layout();
    let (mut errors, mut wrong, mut missed) = (Vec::new(), 0, 0);
    for speed in [20e-3, 50e-3, 100e-3, 150e-3] {
        for (direction, wavelength) in [(1.0, 40e-3), (-1.0, 40e-3), (1.0, 9e-3), (-1.0, 9e-3)] {
            let way = 28e-3 / speed;
            let mut script = stimulus(0.2 + way);
            script.slider.push(Slider {
                wavelength,
                speed,
                amplitude: 0.8,
                radius: 2.5e-3,
                start: 0.1,
                from: [-14e-3 * direction, 0.0],
                to: [14e-3 * direction, 0.0],
            });
            let mut twin = Twin::new(sensor, &script, 4)?;
            let reader = ChargeReader::new(array.model(), ChargeOptions::default());
            let mut estimator = ArrayEstimator::new(Box::new(reader));
            let mut slip = SlipEstimator::new(SlipOptions {
                rows: layout.rows,
                columns: layout.columns,
                pitch: layout.pitch[0],
                delays: (0..layout.taxels()).map(|i| array.board.delay(i)).collect(),
                window: way,
                speeds: [10e-3, 400e-3],
                least_score: 0.5,
                longest_pause: 0.05,
            });
            let end = 0.1 + way;
            loop {
                let Delivery::Frame(frame) = twin.next_delivery() else {
                    continue;
                };
                let (touch, _) = estimator.push(&frame)?;
                let values: Vec<f64> = touch.taxels.iter().map(TaxelTouch::pressed).collect();
                slip.push(frame.time_ns, &values);
                if frame.time_ns as f64 * 1e-9 >= end {
                    break;
                }
            }
            let Some(found) = slip.estimate() else {
                missed += 1;
                continue;
            };
            let velocity = direction * speed;
            wrong += u32::from(found.velocity * velocity < 0.0);
            errors.push((found.velocity / velocity - 1.0).abs());
            println!(
                "  {:7.1} mm/s, ridges every {:.0} mm: {:7.2} +- {:.2} mm/s, score {:.3}",
                velocity * 1e3,
                wavelength * 1e3,
                found.velocity * 1e3,
                found.deviation * 1e3,
                found.score
            );
        }
    }
    errors.sort_by(f64::total_cmp);
    let median = errors.get(errors.len() / 2).copied().unwrap_or(f64::NAN);
    println!(
        "  median error {:.2} %, wrong sign {wrong}, not found {missed} of {}",
        100.0 * median,
        errors.len() + missed
    );
    Ok(())
}
