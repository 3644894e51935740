//! Fits of tests that are generated here: Gent's law of 100 kPa and a limit of 40 to a strain of
//! one, with what goes wrong in laboratories.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::f64::consts::TAU;
use std::fmt::Write as _;

use taxel_material::{
    Choice, Cycle, Fit, Form, Law, Measure, Mode, Options, Slack, Steps, Weights, choose, fits,
    prepare, read, with_interval,
};
use taxel_numerics::Noise;

const SHEAR: f64 = 100e3;
const AREA: f64 = 18e-6;
const HEAD: &str = "# gauge_length = \"33 mm\"\n# width = \"6 mm\"\n# thickness = \"3 mm\"\n";
/// The limits of the search are refined to the root of the rounding, and files have 12 digits.
const EXACT: f64 = 1e-5;

fn gent(shear: f64) -> Law {
    Law::Gent { shear, limit: 40.0 }
}

fn pull(l: f64) -> f64 {
    gent(SHEAR).nominal_stress(Mode::Uniaxial, l)
}

/// Strains of a pull to one.
fn strains() -> impl Iterator<Item = f64> {
    (0..=60).map(|n| f64::from(n) / 60.0)
}

/// A file of extension in mm and force in N, from strains and stresses.
fn machine(head: &str, points: impl Iterator<Item = (f64, f64)>) -> String {
    let mut text = format!("{head}extension [mm],force [N]\n");
    for (e, p) in points {
        writeln!(text, "{:.12},{:.15}", 33.0 * e, p * AREA).unwrap();
    }
    text
}

fn fitted(text: &str, form: Form, steps: &Steps, slack: Slack) -> (Fit, Vec<String>) {
    let test = read("pull.csv", text, None).unwrap();
    let (tests, notes) = prepare(&[test], steps).unwrap();
    let fit = fits(
        &tests,
        form,
        slack,
        Weights::Relative,
        Measure::Stretch,
        false,
    )
    .unwrap()
    .remove(0);
    let fit = with_interval(&tests, fit, Weights::Relative, Measure::Stretch, false);
    (fit, notes)
}

fn by_default(text: &str, steps: &Steps) -> (Fit, Vec<String>) {
    fitted(text, Form::Gent, steps, Slack::WhereItMatters)
}

#[track_caller]
fn is_the_law(fit: &Fit) {
    let shear = fit.shear_modulus / SHEAR - 1.0;
    assert!(shear.abs() < EXACT, "{fit:?}");
    assert!((fit.limit.unwrap() / 40.0 - 1.0).abs() < EXACT, "{fit:?}");
}

#[test]
fn a_clean_pull_is_found_whatever_it_ends_with() {
    let clean = machine(HEAD, strains().map(|e| (e, pull(1.0 + e))));
    let (fit, _) = by_default(&clean, &Steps::default());
    is_the_law(&fit);
    assert_eq!(fit.slack, 0.0);
    let tail = (1..=8).map(|n| (1.0 + 0.0015 * f64::from(n), pull(2.0) * 0.6_f64.powi(n)));
    let broken = machine(HEAD, strains().map(|e| (e, pull(1.0 + e))).chain(tail));
    let (fit, notes) = by_default(&broken, &Steps::default());
    is_the_law(&fit);
    assert!(
        notes.iter().any(|note| note.contains("break: 8 points")),
        "{notes:?}"
    );
}

#[test]
fn slack_is_found_and_decides_the_law() {
    // The specimen hangs loose for the first 2.5 % of its length.
    let loose = |e: f64| {
        if e < 0.025 {
            0.0
        } else {
            pull((1.0 + e) / 1.025)
        }
    };
    let text = machine(
        HEAD,
        (0..=70)
            .map(|n| 1.05 * f64::from(n) / 70.0)
            .map(|e| (e, loose(e))),
    );
    let (fit, _) = by_default(&text, &Steps::default());
    is_the_law(&fit);
    assert!((fit.slack - 0.025).abs() < EXACT);
    // Kept, the slack softens the law by a fifth.
    let (kept, _) = fitted(&text, Form::Gent, &Steps::default(), Slack::Given(0.0));
    assert!(
        kept.shear_modulus < 0.85 * SHEAR && kept.rms() > 0.1,
        "{kept:?}"
    );
    let test = read("pull.csv", &text, None).unwrap();
    let (tests, _) = prepare(&[test], &Steps::default()).unwrap();
    let options = Options {
        forms: Some(vec![Form::MooneyRivlin]),
        slack: Slack::Given(0.0),
        ..Options::default()
    };
    let choice = choose(&tests, &options).unwrap();
    assert_eq!(choice.candidates[0].refused.as_deref(), Some("c01 < 0"));
}

#[test]
fn what_the_machine_adds_is_taken_out() {
    let offset = machine(HEAD, strains().map(|e| (e, pull(1.0 + e) + 0.05 / AREA)));
    let steps = Steps {
        force_offset: 0.05,
        ..Steps::default()
    };
    is_the_law(&by_default(&offset, &steps).0);
    assert!(by_default(&offset, &Steps::default()).0.shear_modulus > 1.05 * SHEAR);
    // 0.02 mm/N of a machine, in a test of a disc that is pressed.
    let disc = "# mode = \"compression\"\n# diameter = \"20 mm\"\n# height = \"10 mm\"\n";
    let area = std::f64::consts::PI * 1e-4;
    let pressed = |compliance: f64| {
        let mut text = format!("{disc}compression [mm],force [N]\n");
        for n in 0..=40 {
            let e = f64::from(n) / 100.0;
            let force = -pull(1.0 - e) * area;
            writeln!(text, "{:.12},{force:.12}", 10.0 * e + compliance * force).unwrap();
        }
        text
    };
    let (fit, notes) = by_default(&pressed(0.0), &Steps::default());
    is_the_law(&fit);
    for said in ["their sign is turned", "1.500 times as stiff", "lubricate"] {
        assert!(
            notes.iter().any(|note| note.contains(said)),
            "{said}: {notes:?}"
        );
    }
    let steps = Steps {
        compliance: 0.02e-3,
        ..Steps::default()
    };
    is_the_law(&by_default(&pressed(0.02), &steps).0);
    assert!(
        by_default(&pressed(0.02), &Steps::default())
            .0
            .shear_modulus
            < 0.75 * SHEAR
    );
}

#[test]
fn cycles_and_a_preload_are_followed() {
    // Each cycle after the first has four fifths of the stress.
    let half = || (0..60).map(|n| f64::from(n) / 60.0);
    let mut points: Vec<(f64, f64)> = Vec::new();
    for share in [1.0, 0.8, 0.8] {
        points.extend(half().map(|e| (e, share * pull(1.0 + e))));
        points.push((1.0, share * pull(2.0)));
        points.extend(
            half()
                .map(|e| 1.0 - e)
                .map(|e| (e, 0.7 * share * pull(1.0 + e))),
        );
    }
    let text = machine(HEAD, points.into_iter());
    let first = Steps {
        cycle: Cycle::Number(1),
        ..Steps::default()
    };
    is_the_law(&by_default(&text, &first).0);
    let (last, notes) = by_default(&text, &Steps::default());
    assert!(
        (last.shear_modulus / (0.8 * SHEAR) - 1.0).abs() < EXACT,
        "{last:?}"
    );
    assert!(
        notes.iter().any(|note| note.contains("3 loadings")),
        "{notes:?}"
    );

    let start = 1.038438;
    let preload = pull(start) * AREA;
    let head = format!("{HEAD}# preload = \"{preload} N\"\n");
    let text = machine(&head, strains().map(|e| (e, pull(start + e))));
    let (fit, _) = by_default(&text, &Steps::default());
    is_the_law(&fit);
    assert!((fit.preload_stretch - start).abs() < 1e-6, "{fit:?}");
}

fn of_two_constants(modes: &[Mode]) -> Choice {
    let law = Law::MooneyRivlin {
        c10: 90e3,
        c01: 20e3,
    };
    let tests: Vec<_> = modes
        .iter()
        .map(|mode| {
            let mut text = format!("# mode = \"{}\"\nstretch [1],stress [kPa]\n", mode.name());
            for n in 0..46 {
                let l = 1.05 + 0.95 * f64::from(n) / 45.0;
                writeln!(text, "{l},{}", law.nominal_stress(*mode, l) / 1e3).unwrap();
            }
            read("test.csv", &text, None).unwrap()
        })
        .collect();
    let (tests, _) = prepare(&tests, &Steps::default()).unwrap();
    let options = Options {
        slack: Slack::Given(0.0),
        forms: (modes.len() == 1).then(|| vec![Form::MooneyRivlin]),
        ..Options::default()
    };
    choose(&tests, &options).unwrap()
}

#[test]
fn two_modes_tell_two_constants_and_a_planar_test_only_their_sum() {
    let choice = of_two_constants(&[Mode::Uniaxial, Mode::Equibiaxial]);
    let chosen = choice.chosen().unwrap();
    assert_eq!(chosen.form, Form::MooneyRivlin);
    // Linear least squares of exact data.
    assert!((chosen.moduli[0] / 90e3 - 1.0).abs() < 1e-9);
    assert!((chosen.moduli[1] / 20e3 - 1.0).abs() < 1e-9);
    let choice = of_two_constants(&[Mode::Planar]);
    assert!(choice.candidates.is_empty());
    assert!(
        choice.failed[0]
            .1
            .to_string()
            .contains("only the sum of c10 and c01")
    );
}

#[test]
fn too_little_and_a_falling_stress_are_refused() {
    let refused = |text: &str| {
        let test = read("pull.csv", text, None).unwrap();
        prepare(&[test], &Steps::default()).unwrap_err()
    };
    let few = "strain [1],stress [kPa]\n0.1,1\n0.2,2\n0.3,3\n";
    assert!(
        refused(few)
            .message
            .contains("3 points over a strain of 0.200")
    );
    let table = |stress: &dyn Fn(f64) -> f64| {
        let rows = (1..=20).map(|n| f64::from(n) / 20.0);
        rows.fold("strain [1],stress [kPa]\n".to_owned(), |mut text, e| {
            writeln!(text, "{e},{}", stress(e)).unwrap();
            text
        })
    };
    assert!(
        refused(&table(&|e| -10.0 * e))
            .help
            .contains("--mode compression")
    );
    let none = refused("strain [1],stress [kPa]\n");
    assert!(none.message.contains("no rows"), "{none}");
    let beyond = refused("strain [1],stress [kPa]\n0.1,1\n-1.5,2\n");
    assert!(beyond.message.contains("stretch of -0.5"), "{beyond}");
    let huge = refused("strain [1],stress [kPa]\n0.1,1e300\n");
    assert!(huge.help.contains("unit"), "{huge}");
    // It falls by less than the fifth of a break.
    assert!(
        refused(&table(&|e| 10.0 + (e - 0.1).min(0.0) - 1.5 * e))
            .help
            .contains("--cycle")
    );
}

/// A law of Yeoh's of three constants, pulled to a strain of one with noise of 1 % of each stress whose neighbours
/// are correlated, and with so many waves of random phase over the pull, of 2 % of each stress: how many of `sets`
/// intervals of the shear modulus hold it.
fn held(points: u32, correlation: f64, waves: f64, sets: u32) -> f64 {
    let law = Law::Yeoh {
        factors: [50e3, 2e3, 0.1e3],
    };
    let mut noise = Noise::seeded(u64::from(points));
    let mut held = 0;
    for _ in 0..sets {
        let mut last = noise.normal();
        let wave = if waves > 0.0 { 0.02 } else { 0.0 };
        // Two normal numbers have a direction of no preference.
        let phase = f64::atan2(noise.normal(), noise.normal());
        let rows = (1..=points).map(|n| {
            let e = f64::from(n) / f64::from(points);
            last = correlation * last + (1.0 - correlation * correlation).sqrt() * noise.normal();
            (
                e,
                law.nominal_stress(Mode::Uniaxial, 1.0 + e)
                    * (1.0 + 0.01 * last + wave * (TAU * waves * e + phase).sin()),
            )
        });
        let text = rows.fold("strain [1],stress [Pa]\n".to_owned(), |mut text, (e, p)| {
            writeln!(text, "{e},{p}").unwrap();
            text
        });
        let (fit, _) = fitted(&text, Form::Yeoh, &Steps::default(), Slack::Given(0.0));
        let [low, high] = fit.interval.unwrap_or([0.0, f64::INFINITY]);
        held += u32::from((low..=high).contains(&law.shear_modulus()));
    }
    f64::from(held) / f64::from(sets)
}

/// The interval counts what neighbours say of each other: of white noise 95 % hold the truth; of correlated noise fewer,
/// but many more than where every point counts (32 % at a correlation of 0.9), as the guide says.
#[test]
#[allow(
    clippy::print_stdout,
    reason = "`--nocapture` shows the table of the guide"
)]
fn intervals_hold_the_modulus() {
    for (points, correlation, waves, least, most) in [
        (60, 0.0, 0.0, 0.93, 0.97),
        (600, 0.0, 0.0, 0.93, 0.97),
        (120, 0.9, 0.0, 0.7, 1.0),
        (120, 0.97, 0.0, 0.0, 1.0),
        (1200, 0.99, 0.0, 0.0, 1.0),
        // Within one wave the law itself follows it, and nothing is left to judge by.
        (60, 0.0, 1.0, 0.0, 1.0),
        (60, 0.0, 2.0, 0.93, 1.0),
        (600, 0.0, 2.0, 0.93, 1.0),
    ] {
        let share = held(points, correlation, waves, 1000);
        println!(
            "{points} points, neighbours correlated by {correlation}, {waves} waves: {:.1} % held",
            100.0 * share
        );
        assert!(
            (least..=most).contains(&share),
            "{points} {correlation} {waves}: {share}"
        );
    }
}
