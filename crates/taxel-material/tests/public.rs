//! Public tests, which are not part of the repository: the folder that TAXEL_MATERIALS names has
//! the curves of Marechal et al. 2020 (doi 10.1089/soro.2019.0115, github
//! LucMarechal/Soft-Robotics-Materials-Database, Tensile-Tests-Data) as `mat_srmd_NAME.csv`:
//! `TAXEL_MATERIALS=FOLDER cargo test -p taxel-material --test public -- --nocapture`.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test that shows its numbers"
)]

use std::path::Path;

use taxel_material::{Choice, Form, Options, Steps, choose, prepare, read};

fn chosen(folder: &Path, name: &str, thinned: usize) -> Choice {
    let text = std::fs::read_to_string(folder.join(name)).unwrap();
    let mut test = read(name, &text, None).unwrap();
    test.rows = test.rows.into_iter().step_by(thinned).collect();
    let steps = Steps {
        strain_range: Some([0.0, 1.0]),
        ..Steps::default()
    };
    let (tests, _) = prepare(&[test], &steps).unwrap();
    let choice = choose(&tests, &Options::default()).unwrap();
    for candidate in &choice.candidates {
        let fit = &candidate.fit;
        println!(
            "{name} /{thinned}: {} slack {:.6} rms {:.5} n_eff {:.3} {:?} {:?}",
            candidate.law,
            fit.slack,
            fit.rms(),
            fit.effective,
            fit.interval,
            candidate.refused
        );
    }
    println!("{name}: {:?} {:?}", choice.interval, choice.shares);
    choice
}

#[test]
fn three_silicones_have_their_laws_and_intervals() {
    let Some(folder) = std::env::var_os("TAXEL_MATERIALS") else {
        return;
    };
    let folder = Path::new(&folder);
    for (name, form, shear, slack, interval) in [
        (
            "mat_srmd_ecoflex_00-30.csv",
            Form::NeoHookean,
            17.11695e3,
            0.031621,
            [16.34e3, 18.15e3],
        ),
        (
            "mat_srmd_dragon_skin_30.csv",
            Form::Gent,
            191.3336e3,
            0.013403,
            [179.1e3, 203.8e3],
        ),
        (
            "mat_srmd_rtv615.csv",
            Form::Gent,
            345.0319e3,
            0.008186,
            [342.9e3, 350.5e3],
        ),
    ] {
        let choice = chosen(folder, name, 1);
        let fit = choice.chosen().unwrap();
        assert_eq!(fit.form, form);
        // The modulus to its printed digits, the slack to one of the last, the ends to 2 %.
        assert!(
            (fit.shear_modulus / shear - 1.0).abs() < 1e-4,
            "{name} {fit:?}"
        );
        assert!((fit.slack - slack).abs() < 1e-6, "{name} {fit:?}");
        let ends = choice.interval.unwrap();
        for (end, known) in ends.into_iter().zip(interval) {
            assert!((end / known - 1.0).abs() < 0.02, "{name} {ends:?}");
        }
        for step in [2, 5] {
            let thinned = chosen(folder, name, step);
            let moved = thinned.chosen().unwrap().shear_modulus / fit.shear_modulus - 1.0;
            // Half of what the choice among laws leaves open.
            assert!(moved.abs() < 0.01, "{name} {step} {moved}");
        }
    }
}
