//! Which law stands for the tests, and what they do not tell.

use taxel_ground::work::Parts;

use crate::fit::{
    Fit, FitError, Form, MOST_SLACK, MOST_TERMS, Measure, Slack, Weights, fits, with_interval,
};
use crate::law::{Law, Mode};
use crate::stability::{SANE, equibiaxial_ratio, first_loss};
use crate::steps::Specimen;

/// What is asked of the choice.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Laws to fit; by default those that the modes of the tests can tell.
    pub forms: Option<Vec<Form>>,
    /// Zero of the strain.
    pub slack: Slack,
    /// What a residual is measured by.
    pub weights: Weights,
    /// What a point counts.
    pub measure: Measure,
    /// True if every point counts alike, whatever its test; else every test does.
    pub pooled: bool,
    /// Stretches that a law must be stable at, beside those of the tests; the largest is that
    /// of the tests where it is not given.
    pub service: (f64, Option<f64>),
}

impl Default for Options {
    fn default() -> Self {
        Self {
            forms: None,
            slack: Slack::default(),
            weights: Weights::default(),
            measure: Measure::default(),
            pooled: false,
            service: (0.5, None),
        }
    }
}

/// A law with what is wrong with it.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The fit.
    pub fit: Fit,
    /// The law.
    pub law: Law,
    /// Why it does not stand for the material; none where it may.
    pub refused: Option<String>,
    /// True if a constant has a standard error above itself, and nothing else is wrong.
    pub weak: bool,
}

/// Laws of one set of tests.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// Laws that were fitted.
    pub candidates: Vec<Candidate>,
    /// Laws that could not be fitted, and why.
    pub failed: Vec<(Form, FitError)>,
    /// The chosen one of the candidates.
    pub index: Option<usize>,
    /// 95 % of the shear modulus, Pa: the union over all laws that are as good.
    pub interval: Option<[f64; 2]>,
    /// Shares of the second invariant that fit as well: share, shear modulus in Pa, limit,
    /// relative rms, stress in Pa at 40 % uniaxial and planar compression.
    pub shares: Vec<[f64; 6]>,
}

impl Choice {
    /// Fit of the chosen law.
    pub fn chosen(&self) -> Option<&Fit> {
        self.index.map(|index| &self.candidates[index].fit)
    }
}

/// As good as the best: 2 %, or one and a half times its misfit.
fn good_enough(best: f64) -> f64 {
    (1.5 * best).max(0.02)
}

/// Shares of the second invariant that are tried. Up to 0.3 stands for rubber; that rests on
/// natural rubber.
const SHARES: [f64; 4] = [0.0, 0.1, 0.2, 0.3];

/// Fits the laws and takes, among those that hold, the one of fewest constants that is as good
/// as the best.
///
/// # Errors
/// [`FitError::NoTest`]
pub fn choose(tests: &[Specimen], options: &Options) -> Result<Choice, FitError> {
    if tests.is_empty() {
        return Err(FitError::NoTest);
    }
    let tested = |mode: Mode, pressed: bool| {
        tests
            .iter()
            .any(|test| test.mode == mode && test.compression == pressed)
    };
    let ways = Mode::ALL
        .into_iter()
        .filter(|mode| tested(*mode, false))
        .count()
        + usize::from(tested(Mode::Uniaxial, true));
    let mut forms = vec![Form::NeoHookean, Form::Gent, Form::Yeoh];
    if ways > 1 {
        forms.push(Form::MooneyRivlin);
        forms.extend((1..=MOST_TERMS).map(Form::Ogden));
    }
    let forms = options.forms.clone().unwrap_or(forms);
    let fitted = |form: Form| {
        fits(
            tests,
            form,
            options.slack,
            options.weights,
            options.measure,
            options.pooled,
        )
    };
    let strains = tests
        .iter()
        .flat_map(|test| test.points.iter().map(|[e, _]| 1.0 + e));
    let (low, high) = strains.fold((1.0_f64, 1.0_f64), |(low, high), l| {
        (low.min(l), high.max(l))
    });
    let range = [
        options.service.0.min(low),
        options.service.1.unwrap_or(high).max(high),
    ];
    let biaxial = tested(Mode::Equibiaxial, false);
    let (mut candidates, mut failed) = (Vec::new(), Vec::new());
    let laws = Parts::new("fitting the laws", forms.len() as u64);
    for form in forms {
        match fitted(form) {
            Ok(fits) => {
                let minima = fits.into_iter().map(|fit| judged(fit, range, biaxial));
                candidates.extend(least_and_standing(minima).into_iter().map(|candidate| {
                    let (weights, measure) = (options.weights, options.measure);
                    let fit = candidate.fit;
                    Candidate {
                        fit: with_interval(tests, fit, weights, measure, options.pooled),
                        ..candidate
                    }
                }));
            }
            Err(error) => failed.push((form, error)),
        }
        laws.done(1);
    }
    drop(laws);
    let standing = |candidate: &Candidate| candidate.refused.is_none();
    let rms = |candidate: &Candidate| candidate.fit.rms();
    let best = candidates
        .iter()
        .filter(|c| standing(c))
        .map(rms)
        .fold(f64::INFINITY, f64::min);
    let index = candidates
        .iter()
        .enumerate()
        .filter(|(_, c)| standing(c) && rms(c) <= good_enough(best))
        .min_by(|(_, a), (_, b)| {
            let few = a.fit.form.constants().cmp(&b.fit.form.constants());
            few.then(rms(a).total_cmp(&rms(b)))
        })
        .map(|(index, _)| index);
    // The choice among laws that are as good is not data: the interval spans all of them.
    let as_good = candidates
        .iter()
        .filter(|c| (standing(c) || c.weak) && rms(c) <= good_enough(best));
    let interval = as_good
        .filter_map(|c| c.fit.interval)
        .reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
    let pull_alone = ways == 1 && tested(Mode::Uniaxial, false);
    let shares = if index.is_some() && pull_alone {
        shares(|share| fitted(Form::GentShare(share)))
    } else {
        Vec::new()
    };
    Ok(Choice {
        candidates,
        failed,
        index,
        interval: index.and(interval),
        shares,
    })
}

/// The shares of the second invariant that fit as well, as [`Choice::shares`] has them.
fn shares(fitted: impl Fn(f64) -> Result<Vec<Fit>, FitError>) -> Vec<[f64; 6]> {
    let of = |share: f64| {
        let fit = fitted(share).ok()?.into_iter().next()?;
        Some([
            share,
            fit.shear_modulus,
            fit.limit.unwrap_or(f64::INFINITY),
            fit.rms(),
            fit.nominal_stress(Mode::Uniaxial, 0.6),
            fit.nominal_stress(Mode::Planar, 0.6),
        ])
    };
    let mut shares: Vec<[f64; 6]> = SHARES.into_iter().filter_map(of).collect();
    let best = shares
        .iter()
        .map(|share| share[3])
        .fold(f64::INFINITY, f64::min);
    shares.retain(|share| share[3] <= good_enough(best));
    shares
}

/// The least minimum of a law and, where that is refused, the least of those that stand.
fn least_and_standing(mut minima: impl Iterator<Item = Candidate>) -> Vec<Candidate> {
    let mut found: Vec<Candidate> = minima.next().into_iter().collect();
    if found.iter().any(|least| least.refused.is_some()) {
        found.extend(minima.find(|other| other.refused.is_none()));
    }
    found
}

/// Exponents of Ogden's law closer than this are one term, and beyond this size they are none of
/// rubber.
const CLOSEST_EXPONENTS: f64 = 0.05;
const LARGEST_EXPONENT: f64 = 30.0;

/// What is wrong with the exponents of Ogden's law.
fn exponents(fit: &Fit) -> Option<String> {
    let large = fit.exponents.iter().find(|a| a.abs() > LARGEST_EXPONENT);
    let mut sorted = fit.exponents.clone();
    sorted.sort_by(f64::total_cmp);
    let close = sorted
        .windows(2)
        .find(|pair| pair[1] - pair[0] < CLOSEST_EXPONENTS);
    large
        .map(|a| format!("an exponent of {a:.4}: beyond {LARGEST_EXPONENT} it is none of rubber"))
        .or_else(|| {
            close.map(|pair| {
                format!(
                    "the exponents {:.4} and {:.4} are one term",
                    pair[0], pair[1]
                )
            })
        })
}

fn judged(fit: Fit, range: [f64; 2], biaxial: bool) -> Candidate {
    let law = fit.law();
    let mut weak = false;
    let ratio = equibiaxial_ratio(&law);
    let negative = matches!(law, Law::MooneyRivlin { c01, .. } if c01 < 0.0);
    let refused = if fit.shear_modulus <= 0.0 {
        Some(
            "its shear modulus is not positive: look at the sign, or say --mode compression".into(),
        )
    } else if fit.slack_fitted && fit.slack > MOST_SLACK * (1.0 - 1e-6) {
        Some("its slack is at the bound of 0.1: no slack, check the gauge length".into())
    } else if negative {
        Some("c01 < 0".into())
    } else if let Some(why) = exponents(&fit) {
        Some(why)
    } else if let Some(loss) = first_loss(&law, range[0], range[1]) {
        Some(loss.to_string())
    } else if !biaxial && !SANE.contains(&ratio) {
        Some(format!(
            "in equibiaxial tension, which was not tested, it says {ratio:.2} times a neo-Hookean law \
             ({} to {} is sane)",
            SANE.start(),
            SANE.end()
        ))
    } else {
        let outer = fit.limit.iter().chain(&fit.exponents);
        let constants = fit.moduli.iter().chain(outer).copied();
        let errors = fit.standard_errors.iter().flatten();
        // Yeoh's second and third factor may be anything about zero, and a limit that no test sees is
        // no constant of the law.
        let count = if fit.form == Form::Yeoh || matches!(law, Law::NeoHookean { .. }) {
            1
        } else {
            usize::MAX
        };
        weak = constants
            .zip(errors)
            .take(count)
            .any(|(c, error)| *error > c.abs());
        weak.then(|| "a constant has a standard error above itself".into())
    };
    Candidate {
        fit,
        law,
        refused,
        weak,
    }
}
