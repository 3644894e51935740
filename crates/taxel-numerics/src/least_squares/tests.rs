use super::*;
use crate::Noise;

/// Straight line through readings of unit noise, or any linear model.
struct Linear {
    design: Vec<Vec<f64>>,
    readings: Vec<f64>,
}

impl Problem for Linear {
    fn readings(&self) -> usize {
        self.readings.len()
    }

    fn residuals(&self, at: &[f64], residuals: &mut [f64]) -> bool {
        for (i, residual) in residuals.iter_mut().enumerate() {
            let model: f64 = self.design[i].iter().zip(at).map(|(x, c)| x * c).sum();
            *residual = self.readings[i] - model;
        }
        true
    }

    fn slopes(&self, _: &[Parameter], _: &[f64], columns: &mut [Vec<f64>]) -> bool {
        for (j, column) in columns.iter_mut().enumerate() {
            for (slope, row) in column.iter_mut().zip(&self.design) {
                *slope = -row[j];
            }
        }
        true
    }

    fn remedy(&self, together: &[usize]) -> String {
        format!("measure {}", together[0])
    }
}

fn line(readings: &[f64]) -> Linear {
    Linear {
        design: (0..readings.len()).map(|i| vec![1.0, i as f64]).collect(),
        readings: readings.to_vec(),
    }
}

fn two(prior: Option<Prior>) -> [Parameter; 2] {
    let slope = Parameter {
        prior,
        ..Parameter::new("slope", 0.5)
    };
    [Parameter::new("offset", 0.0), slope]
}

const READINGS: [f64; 6] = [1.2, 2.7, 5.1, 7.3, 8.8, 11.4];

fn given() -> FitOptions {
    FitOptions::default()
}

fn close(found: f64, expected: f64, tolerance: f64) {
    assert!(
        (found - expected).abs() <= tolerance * expected.abs().max(1.0),
        "{found} is not {expected}"
    );
}

#[test]
fn linear_fit_has_its_textbook_covariance() {
    let found = fit(&line(&READINGS), &two(None), &given()).unwrap();
    // Σ(x−x̄)² = 17.5, n = 6, x̄ = 2.5.
    close(found.covariance[1][1], 1.0 / 17.5, 1e-12);
    close(found.covariance[0][0], 1.0 / 6.0 + 6.25 / 17.5, 1e-12);
    close(found.covariance[0][1], -2.5 / 17.5, 1e-12);
    let mean = READINGS.iter().sum::<f64>() / 6.0;
    let moment: f64 = READINGS
        .iter()
        .enumerate()
        .map(|(i, y)| (i as f64 - 2.5) * y)
        .sum();
    close(found.estimates[1].value, moment / 17.5, 1e-12);
    close(found.estimates[0].value, mean - 2.5 * moment / 17.5, 1e-12);
    // The hat values of a line are 1/n + (x−x̄)²/Σ, and sum to the unknowns.
    close(found.leverage[0], 1.0 / 6.0 + 6.25 / 17.5, 1e-12);
    close(found.leverage.iter().sum(), 2.0, 1e-12);
}

#[test]
fn leaving_out_by_leverage_is_leaving_out() {
    let problem = line(&READINGS);
    let found = fit(&problem, &two(None), &given()).unwrap();
    let groups: Vec<usize> = (0..6).collect();
    let exact = leave_groups_out(&problem, &two(None), &given(), &groups).unwrap();
    for (quick, exact) in found.left_out_residuals().iter().zip(exact) {
        close(*quick, exact, 1e-11);
    }
}

#[test]
fn profile_is_the_covariance_of_a_linear_model() {
    let problem = line(&READINGS);
    for noise in [NoiseSize::Given, NoiseSize::Estimated] {
        let options = FitOptions { noise, ..given() };
        let found = fit(&problem, &two(None), &options).unwrap();
        for index in [0, 1] {
            let ends = profile_interval(&problem, &two(None), &options, &found, index).unwrap();
            for (end, expected) in ends.iter().zip(found.estimates[index].interval) {
                close(*end, expected, 1e-6);
            }
        }
    }
}

#[test]
fn prior_and_readings_have_their_common_posterior() {
    let prior = Prior {
        value: 1.5,
        deviation: 0.2,
    };
    let found = fit(&line(&READINGS), &two(Some(prior)), &given()).unwrap();
    // Normal equations with the precision 25 of the prior added.
    let (a, b, d) = (6.0, 15.0, 55.0 + 25.0);
    let determinant = a * d - b * b;
    let sums = [
        READINGS.iter().sum::<f64>(),
        READINGS
            .iter()
            .enumerate()
            .map(|(i, y)| i as f64 * y)
            .sum::<f64>()
            + 25.0 * 1.5,
    ];
    let expected = [
        (d * sums[0] - b * sums[1]) / determinant,
        (a * sums[1] - b * sums[0]) / determinant,
    ];
    for (estimate, expected) in found.estimates.iter().zip(expected) {
        close(estimate.value, expected, 1e-10);
    }
    close(found.covariance[1][1], a / determinant, 1e-10);
    close(found.covariance[0][1], -b / determinant, 1e-10);
}

#[test]
fn a_bound_that_holds_a_value_leaves_a_shorter_interval_on_one_side() {
    let readings = [1.0, 1.2, 0.8, 1.1, 0.9];
    let problem = Linear {
        design: vec![vec![1.0]; 5],
        readings: readings.to_vec(),
    };
    let parameter = |low: f64| Parameter {
        bounds: [low, 5.0],
        ..Parameter::new("mean", 3.0)
    };
    let found = fit(&problem, &[parameter(1.5)], &given()).unwrap();
    let estimate = found.estimates[0];
    assert_eq!((estimate.status, estimate.value), (Status::AtBound, 1.5));
    // 5 (x − 1)² less that at 1.5 is 1.96².
    let end = 1.0 + (0.25 + 1.959963985_f64.powi(2) / 5.0).sqrt();
    close(estimate.interval[0], 1.5, 1e-12);
    close(estimate.interval[1], end, 1e-8);
}

struct Rosenbrock;

impl Problem for Rosenbrock {
    fn readings(&self) -> usize {
        2
    }

    fn residuals(&self, at: &[f64], residuals: &mut [f64]) -> bool {
        residuals[0] = 10.0 * (at[1] - at[0] * at[0]);
        residuals[1] = 1.0 - at[0];
        true
    }
}

#[test]
fn the_valley_of_rosenbrock_ends_at_one_one_or_at_a_bound() {
    // Two readings leave no freedom; the priors, far too wide to matter, do.
    let wide = Some(Prior {
        value: 1.0,
        deviation: 1e9,
    });
    let mut parameters = [-1.2, 1.0].map(|start| Parameter {
        prior: wide,
        ..Parameter::new("x", start)
    });
    let found = fit(&Rosenbrock, &parameters, &given()).unwrap();
    for estimate in &found.estimates {
        close(estimate.value, 1.0, 1e-9);
    }
    // With y ≤ 1/4 the slope along x vanishes: 200x³ − 50x + x − 1 = 0.
    parameters[1].bounds[1] = 0.25;
    parameters[1].start = 0.0;
    let found = fit(&Rosenbrock, &parameters, &given()).unwrap();
    assert_eq!(found.estimates[1].value, 0.25);
    let x = found.estimates[0].value;
    close(200.0 * x.powi(3) - 49.0 * x - 1.0, 0.0, 1e-6);
    assert!(found.stop.converged());
}

#[test]
fn what_is_not_identifiable_gets_no_number() {
    // Only the sum of the first two columns is seen.
    let design = (0..8).map(|i| vec![1.0, 1.0, f64::from(i)]).collect();
    let readings = (0..8).map(|i| 3.0 + 0.5 * f64::from(i)).collect();
    let problem = Linear { design, readings };
    let mut parameters = ["a", "b", "c"].map(|name| Parameter::new(name, 1.0));
    parameters[1].bounds = [0.0, 5.0];
    let found = fit(&problem, &parameters, &given()).unwrap();
    let [a, b, c] = [0, 1, 2].map(|i| found.estimates[i]);
    assert_eq!(a.status, Status::NotIdentifiable);
    assert_eq!(
        (b.status, b.interval),
        (Status::NotIdentifiable, [0.0, 5.0])
    );
    assert_eq!(c.status, Status::Identified);
    close(c.value, 0.5, 1e-9);
    assert_eq!(found.directions.len(), 1);
    let direction = &found.directions[0];
    assert_eq!(direction.members.len(), 2);
    close(
        direction.members[0].share,
        -direction.members[1].share,
        1e-9,
    );
    assert!(direction.deviation > 1e5);
    assert!(direction.remedy.starts_with("measure"));
    // With a prior on one of them both are known, one by its prior alone.
    parameters[1].prior = Some(Prior {
        value: 1.0,
        deviation: 0.1,
    });
    let found = fit(&problem, &parameters, &given()).unwrap();
    assert_eq!(found.estimates[1].status, Status::PriorOnly);
    close(found.estimates[0].value, 2.0, 1e-9);
}

#[test]
fn what_its_prior_says_better_is_prior_only() {
    // Eight readings of deviation one say a mean to within 8^-1/2 = 0.354.
    let design = vec![vec![1.0]; 8];
    let problem = Linear {
        design,
        readings: vec![2.0; 8],
    };
    for (deviation, status) in [(0.34, Status::PriorOnly), (0.37, Status::Identified)] {
        let prior = Some(Prior {
            value: 2.0,
            deviation,
        });
        let parameter = Parameter {
            prior,
            ..Parameter::new("mean", 1.0)
        };
        let found = fit(&problem, &[parameter], &given()).unwrap();
        assert_eq!(found.estimates[0].status, status);
    }
}

#[test]
fn too_little_and_wrong_starts_are_refused() {
    let error = fit(&line(&[1.0, 2.0]), &two(None), &given()).unwrap_err();
    assert!(error.to_string().contains("at least 3"), "{error}");
    let fixed = two(None).map(|p| Parameter {
        bounds: [p.start; 2],
        ..p
    });
    let found = fit(&line(&READINGS), &fixed, &given()).unwrap();
    assert_eq!(found.estimates[1].status, Status::Fixed);
    let wrong = two(None).map(|p| Parameter {
        start: f64::NAN,
        ..p
    });
    assert!(matches!(
        fit(&line(&READINGS), &wrong, &given()),
        Err(FitError::NoStart { .. })
    ));
}

#[test]
fn robust_losses_forget_a_wrong_reading() {
    let mut noise = Noise::seeded(5);
    let mut readings: Vec<f64> = (0..60)
        .map(|i| 2.0 + 0.3 * f64::from(i) + 0.1 * noise.normal())
        .collect();
    for i in [45, 50, 55] {
        readings[i] += 20.0;
    }
    let problem = line(&readings);
    let slope = |loss: Loss| {
        let options = FitOptions {
            noise: NoiseSize::Estimated,
            loss,
            ..given()
        };
        fit(&problem, &two(None), &options).unwrap().estimates[1].value
    };
    // The deviation of the slope by noise alone is 0.0007.
    assert!((slope(Loss::Square) - 0.3).abs() > 0.01);
    for loss in [Loss::Huber, Loss::SoftL1, Loss::Cauchy] {
        assert!(
            (slope(loss) - 0.3).abs() < 0.004,
            "{loss:?} {}",
            slope(loss)
        );
    }
}

#[test]
fn intervals_cover_the_truth() {
    // 8 readings of an exponential: curved, with few degrees of freedom.
    struct Decay(Vec<f64>);
    impl Problem for Decay {
        fn readings(&self) -> usize {
            self.0.len()
        }
        fn residuals(&self, at: &[f64], residuals: &mut [f64]) -> bool {
            for (i, residual) in residuals.iter_mut().enumerate() {
                *residual = self.0[i] - at[0] * (-at[1] * i as f64).exp();
            }
            true
        }
    }
    let mut noise = Noise::seeded(11);
    let parameters = [Parameter::new("size", 1.0), Parameter::new("rate", 0.5)];
    for size in [NoiseSize::Given, NoiseSize::Estimated] {
        let options = FitOptions {
            noise: size,
            ..given()
        };
        let mut covered = [0; 2];
        for _ in 0..1000 {
            // In units of the noise: 100 of it.
            let truth = |i: i32| 100.0 * (-0.4 * f64::from(i)).exp();
            let problem = Decay((0..8).map(|i| truth(i) + noise.normal()).collect());
            let scaled = [
                Parameter::new("size", 80.0),
                Parameter::new("rate", parameters[1].start),
            ];
            let found = fit(&problem, &scaled, &options).unwrap();
            for (count, (estimate, truth)) in covered
                .iter_mut()
                .zip(found.estimates.iter().zip([100.0, 0.4]))
            {
                let [low, high] = estimate.interval;
                *count += usize::from((low..=high).contains(&truth));
            }
        }
        // 95 % of 1000, and three deviations of that count.
        for count in covered {
            assert!((930..=970).contains(&count), "{size:?} {covered:?}");
        }
    }
}
