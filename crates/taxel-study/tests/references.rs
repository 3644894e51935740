//! Answers against numbers of other implementations: `reference/design_*.csv`, whose headers
//! say how they were made and how close to come.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a panic is how a test fails; figures are printed"
)]

mod common;

use std::path::Path;

use taxel_study::plans::sobol;
use taxel_study::run::Runner;
use taxel_study::study::Status;

use common::{near, number, reference, shipped, study_of};

#[test]
fn the_committed_schema_is_current() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("studies/study.schema.json");
    let committed = std::fs::read_to_string(path).unwrap();
    assert!(
        committed == taxel_study::file::StudyFile::json_schema(),
        "stale: run `cargo run -- schema study > crates/taxel-study/studies/study.schema.json`"
    );
}

#[test]
fn every_shipped_study_is_read() {
    for name in taxel_study::shipped_names() {
        assert!(!shipped(name).name.is_empty());
    }
}

#[test]
fn gap_and_thickness_of_p1_are_those_of_the_reference() {
    let study = shipped("p1-resolution");
    let rows = reference("design_p1_grid.csv");
    let points: Vec<Vec<f64>> = rows
        .iter()
        .map(|row| {
            vec![
                number(row, "gap_um") * 1e-6,
                number(row, "thickness_um") * 1e-6,
            ]
        })
        .collect();
    let found = Runner::new(&study).rows(&points).unwrap();
    let mut compared = 0;
    for (row, found) in rows.iter().zip(found.into_iter().flatten()) {
        let what = format!(
            "gap {} thickness {}",
            number(row, "gap_um"),
            number(row, "thickness_um")
        );
        assert_eq!(found.status, Status::Done, "{what}: {}", found.reason);
        let answer = |index: usize| found.answers[index].number().unwrap();
        // The slope is a difference over 2e-5 of compression: 1e-6 by the header.
        near(answer(0), number(row, "resolution_mn") * 1e-3, 1e-6, &what);
        near(answer(1), number(row, "range_n"), 1e-9, &what);
        near(
            answer(2),
            number(row, "rest_capacitance_ff") * 1e-15,
            1e-9,
            &what,
        );
        compared += 1;
    }
    assert_eq!(compared, rows.len());
}

#[test]
fn information_of_p2_is_that_of_the_reference() {
    for row in reference("design_p2_information.csv") {
        let (side, distance) = (
            number(&row, "electrode_um"),
            number(&row, "centre_distance_um"),
        );
        let (fx, fy, fz) = (
            number(&row, "fx_mn"),
            number(&row, "fy_mn"),
            number(&row, "fz_mn"),
        );
        let (air, insulation) = (number(&row, "air_gap_um"), number(&row, "insulation_um"));
        let stiffness = |torsion: f64| torsion / (700e-6 * distance * 1e-6);
        let element = "element.three_axis_capacitor";
        let mut text = format!(
            "schema = 2\nname = \"information\"\nsensor = \"three-axis-8x8\"\n[set]\n\
             \"{element}.plates.parallel_capacitance\" = \"0 fF\"\n\
             \"{element}.plates.electrode\" = [\"{side} um\", \"{side} um\"]\n\
             \"{element}.plates.air_gap\" = \"{air} um\"\n\"{element}.plates.insulation\" = \"{insulation} um\"\n\
             \"{element}.suspension.centre_distance\" = \"{distance} um\"\n\
             \"{element}.suspension.stiffness\" = [\"{} N/m\", \"{} N/m\", \"10.4 kN/m\"]\n\
             \"{element}.outline.unit_side\" = \"1900 um\"\n\"{element}.outline.wall_width\" = \"10 um\"\n",
            stiffness(4.7138e-3),
            stiffness(5.096e-3)
        );
        for quantity in [
            "deviation_x",
            "deviation_y",
            "deviation_z",
            "a_criterion",
            "d_criterion",
        ] {
            text = format!(
                "{text}[answers.{quantity}]\nof = \"estimate\"\nquantity = \"{quantity}\"\n\
                 load = \"fx={fx} mN, fy={fy} mN, fz={fz} mN\"\nnoise = \"0.1 fF\"\n"
            );
        }
        let found = study_of(&text).evaluate(&[]);
        let what = format!("{side} {distance}");
        assert_eq!(found.status, Status::Done, "{what}: {}", found.reason);
        let answer = |index: usize| found.answers[index].number().unwrap();
        for (index, name) in ["sigma_x_un", "sigma_y_un", "sigma_z_un"]
            .into_iter()
            .enumerate()
        {
            near(answer(index), number(&row, name) * 1e-6, 1e-5, &what);
        }
        near(answer(3), number(&row, "a_criterion"), 1e-4, &what);
        near(answer(4), number(&row, "d_criterion"), 1e-4, &what);
    }
}

#[test]
fn places_of_p3_against_the_pitch_are_those_of_the_reference() {
    // Every seventh row: each depth and radius.
    pitches(7);
}

#[test]
#[ignore = "a minute: cargo test -p taxel-study --test references -- --ignored"]
fn all_places_of_p3_against_the_pitch_are_those_of_the_reference() {
    pitches(1);
}

fn pitches(every: usize) {
    let rows = reference("design_p3_pitch.csv");
    // The header says that a pitch of less than the side of an element is impossible.
    for row in rows.iter().step_by(every) {
        let (depth, radius) = (number(row, "depth_mm"), number(row, "contact_radius_mm"));
        let text = taxel_study::shipped_text("p3-pitch").unwrap();
        let text = text
            .replace("radius=3.6 mm", &format!("radius={radius} mm"))
            .replace(
                "range = [\"2.6 mm\", \"5 mm\"]",
                "range = [\"2.1 mm\", \"5 mm\"]",
            );
        let share = depth / 1.5;
        let text =
            format!("{text}\n[set]\n\"element.piezoelectric.cover.share_above\" = {share}\n");
        let found = study_of(&text).evaluate(&[number(row, "pitch_mm") * 1e-3]);
        let what = format!(
            "depth {depth} radius {radius} pitch {}",
            number(row, "pitch_mm")
        );
        assert_eq!(found.status, Status::Done, "{what}: {}", found.reason);
        let answer = |index: usize| found.answers[index].number().unwrap();
        near(answer(0), number(row, "place_rms_mm") * 1e-3, 1e-5, &what);
        near(answer(1), number(row, "place_worst_mm") * 1e-3, 1e-5, &what);
    }
}

#[test]
fn points_of_sobol_are_those_of_scipy() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference/sobol_points.csv");
    let text = std::fs::read_to_string(path).unwrap();
    let rows: Vec<Vec<f64>> = text
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| {
            line.split(',')
                .map(|field| field.parse().unwrap())
                .collect()
        })
        .collect();
    assert_eq!(sobol(rows[0].len(), rows.len(), None), rows);
}

/// Standard deviation of values.
fn deviation(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let square: f64 = values
        .iter()
        .map(|value| (value - mean) * (value - mean))
        .sum();
    (square / (count - 1.0)).sqrt()
}

#[test]
fn estimates_of_noisy_readings_spread_as_information_says() {
    use taxel::estimation::{SearchOptions, estimate_unit};
    use taxel::sensor::Sensor;
    // 10^4 estimates know their deviation to 0.7 %: 3 % are four standard errors.
    const ESTIMATES: usize = 10_000;
    let noise = 0.1e-15;
    let mut random = taxel_numerics::Noise::seeded(5);
    let sensor = Sensor::shipped("three-axis-8x8").unwrap();
    let array = sensor.three_axis().unwrap();
    let unit = array.unit_model();
    for force in [[0.0, 0.0, 0.0], [3e-3, -2e-3, 8e-3], [-5e-3, 4e-3, 14e-3]] {
        let information = array.information_at(force, Some(noise)).unwrap();
        let exact = unit.predict(force).1.capacitance();
        let options = SearchOptions::default();
        let found: Vec<[f64; 3]> = (0..ESTIMATES)
            .map(|_| {
                let readings = exact.map(|reading| reading + noise * random.normal());
                estimate_unit(&unit, readings, [noise; 4], [true; 4], &options).force
            })
            .collect();
        for (axis, name) in ["force_x", "force_y", "force_z"].into_iter().enumerate() {
            let values: Vec<f64> = found.iter().map(|force| force[axis]).collect();
            near(
                deviation(&values),
                information.deviation(name).unwrap(),
                0.03,
                name,
            );
        }
    }
    let sensor = Sensor::shipped("in-plane-50um").unwrap();
    let array = sensor.in_plane().unwrap();
    let inverse = array.model().inverse().unwrap();
    for compression in [0.02, 0.08, 0.15] {
        let information = array.information_at(compression, Some(noise)).unwrap();
        let change = array.model().respond(compression).unwrap().change;
        let values: Vec<f64> = (0..ESTIMATES)
            .map(|_| inverse.force_from_change(change + noise * random.normal()))
            .collect();
        near(
            deviation(&values),
            information.deviation("force_z").unwrap(),
            0.03,
            "in plane",
        );
    }
}

/// Place and force by least squares on the shares of the cover, from what the elements read.
fn placed(
    share: &dyn Fn([f64; 2]) -> Vec<f64>,
    readings: &[f64],
    start: [f64; 3],
    slopes: &[[f64; 3]],
) -> [f64; 3] {
    let normal: Vec<Vec<f64>> = (0..3)
        .map(|i| {
            let row = |j: usize| slopes.iter().map(|row| row[i] * row[j]).sum();
            (0..3).map(row).collect()
        })
        .collect();
    // Unknowns of very different sizes: scaled to a unit diagonal.
    let scale: [f64; 3] = std::array::from_fn(|i| normal[i][i].sqrt());
    let scaled = (0..3).map(|i| {
        (0..3)
            .map(|j| normal[i][j] / (scale[i] * scale[j]))
            .collect()
    });
    let factor = taxel_numerics::dense::cholesky(scaled.collect()).unwrap();
    let mut at = start;
    // With the slopes of the true place each round leaves some per cent of the way.
    for _ in 0..12 {
        let expected = share([at[0], at[1]]);
        let left = readings.iter().zip(&expected).map(|(f, s)| f - at[2] * s);
        let left: Vec<f64> = left.collect();
        let sum = |i: usize| -> f64 { slopes.iter().zip(&left).map(|(row, f)| row[i] * f).sum() };
        let side: Vec<f64> = (0..3).map(|i| sum(i) / scale[i]).collect();
        let step = taxel_numerics::dense::cholesky_solve(&factor, &side);
        for ((at, step), scale) in at.iter_mut().zip(step).zip(scale) {
            *at += step / scale;
        }
    }
    at
}

#[test]
fn places_by_noisy_elements_spread_as_information_says() {
    use taxel::device::{PlaceInformation, PlacedContact};
    use taxel::information::RadiusKnowledge;
    use taxel::mechanics::{Base, ContactPressure, SoftCover};
    use taxel::sensor::Sensor;
    // As for the other devices: 3 % are four standard errors of 10^4 estimates.
    const ESTIMATES: usize = 10_000;
    let (radius, noise) = (3.6e-3, 0.05e-3);
    let mut random = taxel_numerics::Noise::seeded(9);
    let sensor = Sensor::shipped("piezo-1.5mm").unwrap();
    let array = sensor.piezoelectric().unwrap();
    let (places, side) = (array.places(), array.description.ceramic.side);
    let cover = SoftCover {
        thickness: array.description.depth(),
        base: Base::Rigid,
        contact: ContactPressure::Uniform(radius),
    };
    let table = cover.table();
    let share = |[x, y]: [f64; 2]| -> Vec<f64> {
        let one = |place: &[f64; 2]| table.share([place[0] - x, place[1] - y], side);
        places.iter().map(one).collect()
    };
    let tables = PlaceInformation::new(&array, radius, 20e-3, noise, RadiusKnowledge::Known);
    // Between elements, near one, and off the middle of four.
    for (place, force) in [
        ([0.7e-3, 0.4e-3], 0.1),
        ([3.5e-3, -1.1e-3], 0.2),
        ([-2.8e-3, 1.2e-3], 0.05),
    ] {
        let information = tables.at(&places, &PlacedContact { place, force });
        let exact = share(place);
        let slopes: Vec<[f64; 3]> = {
            // Central differences over 2 um: an error of 1e-6.
            let step = 1e-6;
            let by = |axis: usize| {
                let to = |sign: f64| {
                    let mut at = place;
                    at[axis] += sign * step;
                    share(at)
                };
                let pairs = to(1.0).into_iter().zip(to(-1.0));
                pairs
                    .map(|(up, down)| force * (up - down) / (2.0 * step))
                    .collect::<Vec<_>>()
            };
            let (x, y) = (by(0), by(1));
            (0..exact.len()).map(|i| [x[i], y[i], exact[i]]).collect()
        };
        let found: Vec<[f64; 3]> = (0..ESTIMATES)
            .map(|_| {
                let readings: Vec<f64> = exact
                    .iter()
                    .map(|share| force * share + noise * random.normal())
                    .collect();
                placed(&share, &readings, [place[0], place[1], force], &slopes)
            })
            .collect();
        for (index, name) in ["x", "y", "force_z"].into_iter().enumerate() {
            let values: Vec<f64> = found.iter().map(|one| one[index]).collect();
            let stated = information.deviation(name).unwrap();
            println!(
                "{place:?} {name}: {:.5} of what information says",
                deviation(&values) / stated
            );
            near(deviation(&values), stated, 0.03, name);
        }
        let both = |axis: usize| deviation(&found.iter().map(|one| one[axis]).collect::<Vec<_>>());
        let stated = information.place_deviation().unwrap();
        near(both(0).hypot(both(1)), stated, 0.03, "place");
    }
}
