//! Slip of ridges over the piezoelectric array: the estimated speed, and whether its
//! interval holds the truth.
#![allow(clippy::unwrap_used)]

use rayon::prelude::*;
use taxel::acquisition::{Delivery, Stimulus, Twin};
use taxel::estimation::{Slip, SlipEstimator};
use taxel::sensor::Sensor;

/// The first slip that two looks in a row agree on, as it is reported live.
fn reported(sensor: &Sensor, stimulus: &Stimulus, seed: u64) -> Option<Slip> {
    let mut twin = Twin::new(sensor, stimulus, seed).unwrap();
    let options = sensor.device().unwrap().observed(&twin.stream()).slip?;
    let look_ns = (options.window * 1e9 / 8.0) as u64;
    let mut estimator = SlipEstimator::new(options);
    let (mut next_ns, mut before) = (0, None::<Slip>);
    loop {
        let Delivery::Frame(frame) = twin.next_delivery() else {
            continue;
        };
        if frame.time_ns as f64 * 1e-9 >= stimulus.duration {
            return None;
        }
        estimator.push(frame.time_ns, &frame.values);
        if frame.time_ns < next_ns {
            continue;
        }
        next_ns = frame.time_ns + look_ns;
        let slip = estimator.estimate();
        if let (Some(slip), Some(before)) = (slip, before)
            && (slip.velocity / before.velocity - 1.0).abs() < 0.05
        {
            return Some(slip);
        }
        before = slip;
    }
}

/// A ridged part that is pulled along the rows at `speed` mm/s.
fn pulled(speed: f64, radius: f64, wavelength: f64, y: f64, forward: bool) -> Stimulus {
    let [from, to] = if forward {
        [-14.0, 14.0]
    } else {
        [14.0, -14.0]
    };
    let duration = 0.5 + 28.0 / speed + 0.1;
    let text = format!(
        "schema = 1\nname = \"slide\"\nduration = \"{duration} s\"\n[[slider]]\nwavelength = \"{wavelength} mm\"\n\
         speed = \"{speed} mm/s\"\namplitude = \"0.8 N\"\nradius = \"{radius} mm\"\nstart = \"0.4 s\"\n\
         from = [\"{from} mm\", \"{y} mm\"]\nto = [\"{to} mm\", \"{y} mm\"]\n"
    );
    Stimulus::parse("slide.toml", &text).unwrap()
}

#[test]
fn ninety_five_per_cent_intervals_hold_the_speed_of_two_hundred_ridges() {
    let sensor = Sensor::shipped("piezo-1.5mm").unwrap();
    let slips: Vec<[f64; 3]> = (0..200_u64)
        .into_par_iter()
        .filter_map(|seed| {
            let part = |step: f64| (seed as f64 * step).fract();
            let speed = 18.0 * 4.0_f64.powf(part(0.618_034));
            let (radius, wavelength) = (1.5 + 2.0 * part(0.754_878), 9.0 + 40.0 * part(0.569_840));
            let (y, forward) = (4.0 * part(0.671_044) - 2.0, seed % 2 == 0);
            let slip = reported(
                &sensor,
                &pulled(speed, radius, wavelength, y, forward),
                seed,
            )?;
            let truth = if forward { speed } else { -speed } * 1e-3;
            Some([truth, slip.velocity, slip.deviation])
        })
        .collect();
    let held = slips
        .iter()
        .filter(|[truth, found, deviation]| (found - truth).abs() < 1.96 * deviation)
        .count() as f64;
    let share = held / slips.len() as f64;
    assert!(slips.len() > 150, "{} reported", slips.len());
    assert!((0.90..=0.99).contains(&share), "{share} {slips:?}");
}
