//! The report of a fit: one page with its figures inside.

use std::fmt::Write as _;

use taxel::figure::{Axis, Chart, Figure, Series, Style, escape};
use taxel_material::{
    Choice, Fit, Held, Law, Mode, Options, RelaxationFit, Specimen, Test, profile,
};

/// Points of a curve.
const STEPS: u32 = 120;

/// What a report is of.
pub(super) struct Report<'a> {
    pub(super) tests: &'a [Test],
    pub(super) held: Option<(&'a Held, &'a RelaxationFit)>,
    pub(super) specimens: &'a [Specimen],
    pub(super) choice: &'a Choice,
    pub(super) options: &'a Options,
    /// The answer of the command, as text.
    pub(super) answer: &'a str,
}

/// The name of a file without its folder.
fn short(name: &str) -> String {
    let path = std::path::Path::new(name).file_name();
    path.map_or_else(
        || name.to_owned(),
        |name| name.to_string_lossy().into_owned(),
    )
}

fn kpa(pascal: f64) -> f64 {
    pascal / 1e3
}

fn even([from, to]: [f64; 2]) -> impl Iterator<Item = f64> {
    (0..=STEPS).map(move |n| from + (to - from) * f64::from(n) / f64::from(STEPS))
}

fn curve(range: [f64; 2], value: impl Fn(f64) -> f64) -> Vec<[f64; 2]> {
    even(range).map(|x| [x, value(x)]).collect()
}

fn chart(title: &str, x: Axis, y: Axis, series: Vec<Series>) -> Chart {
    Chart {
        title: title.to_owned(),
        x,
        y,
        series,
    }
}

/// Upright lines at `ends`, as high as the points of `others`.
fn upright(name: &str, ends: [f64; 2], others: &[Series]) -> Series {
    let values = others
        .iter()
        .flat_map(|one| one.points.iter().map(|[_, y]| *y));
    let [low, high] = values
        .filter(|value| value.is_finite())
        .fold([0.0_f64, 0.0_f64], |[low, high], y| {
            [low.min(y), high.max(y)]
        });
    let points = ends
        .iter()
        .flat_map(|x| [[*x, low], [*x, high], [f64::NAN; 2]])
        .collect();
    Series::new(name, points, Style::Dashed)
}

impl Report<'_> {
    fn chosen(&self) -> Option<(&Fit, &Law)> {
        let candidate = &self.choice.candidates[self.choice.index?];
        Some((&candidate.fit, &candidate.law))
    }

    /// Least and greatest stretch of the points that were fitted.
    fn range(&self) -> [f64; 2] {
        let points = self.specimens.iter().flat_map(|one| &one.points);
        points.fold([1.0, 1.0], |[low, high]: [f64; 2], [e, _]| {
            [low.min(1.0 + e), high.max(1.0 + e)]
        })
    }

    /// The page.
    pub(super) fn html(&self) -> String {
        let names: Vec<String> = self.tests.iter().map(|test| short(&test.name)).collect();
        let title = format!("Material of {}", names.join(", "));
        let mut figures = vec![self.data()];
        figures.extend(self.residuals());
        figures.extend(self.mooney());
        figures.extend(self.predicted());
        figures.extend(self.profile());
        figures.extend(self.relaxation());
        let figures =
            figures
                .into_iter()
                .fold(String::new(), |mut text, (title, chart, caption)| {
                    let svg = Figure::of(title, chart, "").svg();
                    let _ = writeln!(
                        text,
                        "<figure>{svg}<figcaption>{}</figcaption></figure>",
                        escape(caption)
                    );
                    text
                });
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<title>{title}</title>\n\
             <style>body{{font-family:system-ui,sans-serif;max-width:760px;margin:2rem auto;padding:0 1rem}}\
             h1{{overflow-wrap:anywhere}}svg{{max-width:100%;height:auto}}figure{{margin:2rem 0}}pre{{white-space:pre-wrap;overflow-wrap:anywhere}}\
             table{{border-collapse:collapse}}td,th{{border-bottom:1px solid #ccc;padding:.3rem .6rem;text-align:left;\
             vertical-align:top}}.chosen{{font-weight:600}}</style>\n<h1>{title}</h1>\n<pre>{answer}</pre>\n{table}{figures}</html>\n",
            title = escape(&title),
            answer = escape(self.answer),
            table = self.table(),
        )
    }

    /// Laws with their constants and what is wrong with them.
    fn table(&self) -> String {
        let mut text = String::from(
            "<table>\n<tr><th>law</th><th>rms</th><th>slack</th><th>points count as</th><th></th></tr>\n",
        );
        for (place, candidate) in self.choice.candidates.iter().enumerate() {
            let fit = &candidate.fit;
            let chosen = self.choice.index == Some(place);
            let verdict = match &candidate.refused {
                Some(why) => format!("refused: {why}"),
                None if chosen => "chosen".to_owned(),
                None => "holds".to_owned(),
            };
            let class = if chosen { " class=\"chosen\"" } else { "" };
            let _ = writeln!(
                text,
                "<tr{class}><td>{}</td><td>{:.2} %</td><td>{:.2} %</td><td>{:.1}</td><td>{}</td></tr>",
                escape(&candidate.law.to_string()),
                100.0 * fit.rms(),
                100.0 * fit.slack,
                fit.effective,
                escape(&verdict)
            );
        }
        for (_, why) in &self.choice.failed {
            let _ = writeln!(
                text,
                "<tr><td colspan=\"5\">{}</td></tr>",
                escape(&why.to_string())
            );
        }
        text + "</table>\n"
    }

    /// (a) Points, used and left out, with the laws.
    fn data(&self) -> (&'static str, Chart, &'static str) {
        let mut series = Vec::new();
        let all = self.tests.iter().flat_map(|test| {
            let sign = if test.compression { -1.0 } else { 1.0 };
            test.rows.iter().map(move |[_, e, p]| {
                // In compression both signs are found in files.
                if test.compression {
                    [sign * e.abs(), sign * kpa(p.abs())]
                } else {
                    [*e, kpa(*p)]
                }
            })
        });
        // What lies far beyond the fitted range would leave that no room.
        let [low, high] = self.range().map(|l| l - 1.0);
        let room = 0.5 * (high - low);
        let near = |[e, _]: &[f64; 2]| (low - room..=high + room).contains(e);
        series.push(Series::new(
            "in the files",
            all.filter(near).collect(),
            Style::Marks,
        ));
        let used = self.specimens.iter().flat_map(|one| &one.points);
        let used = used.map(|[e, p]| [*e, kpa(*p)]).collect();
        series.push(Series::new("used", used, Style::Marks));
        for (place, candidate) in self.choice.candidates.iter().enumerate() {
            let chosen = self.choice.index == Some(place);
            let mut points = Vec::new();
            for one in self.specimens {
                let ends = [one.points.first(), one.points.last()]
                    .map(|end| end.map_or(0.0, |end| end[0]));
                points.extend(curve(ends, |e| {
                    let l = candidate.fit.stretch(one.compression, e);
                    kpa(candidate.fit.nominal_stress(one.mode, l))
                }));
                points.push([f64::NAN; 2]);
            }
            let style = if chosen { Style::Line } else { Style::Dashed };
            let chosen = if chosen { " (chosen)" } else { "" };
            let name = format!("{}{chosen}", candidate.law.name());
            series.push(Series::new(name, points, style));
        }
        let chart = chart(
            "",
            Axis::new("strain", "1"),
            Axis::new("nominal stress", "kPa"),
            series,
        );
        (
            "Data and laws",
            chart,
            "Strains as the files have them; a mark of the first colour alone was left out. Of points beyond the fitted range only those \
             within half of its width are drawn.",
        )
    }

    /// (b) Residuals of the chosen law.
    fn residuals(&self) -> Option<(&'static str, Chart, &'static str)> {
        let (fit, _) = self.chosen()?;
        let series = self.specimens.iter().map(|one| {
            let largest = one
                .points
                .iter()
                .fold(0.0_f64, |most, [_, p]| most.max(p.abs()));
            let points = one.points.iter().map(|[e, p]| {
                let l = fit.stretch(one.compression, *e);
                // As the fit weights them: of the stress, but at least of a twentieth of the largest.
                let size = p.abs().max(0.05 * largest);
                [l, 100.0 * (p - fit.nominal_stress(one.mode, l)) / size]
            });
            Series::new(short(&one.name), points.collect(), Style::Marks)
        });
        let title = format!("as independent as {:.1} points", fit.effective);
        let chart = chart(
            &title,
            Axis::new("stretch", "1"),
            Axis::new("residual", "%"),
            series.collect(),
        );
        Some((
            "What the chosen law leaves",
            chart,
            "Waves are misfit of the law and not noise: neighbours then count as one.",
        ))
    }

    /// (c) Mooney's plot of the pulls.
    fn mooney(&self) -> Option<(&'static str, Chart, &'static str)> {
        let (fit, _) = self.chosen()?;
        let pulls = || {
            self.specimens
                .iter()
                .filter(|one| one.mode == Mode::Uniaxial)
        };
        pulls().next()?;
        let reduced = |stretch: &dyn Fn(&Specimen, f64) -> f64| -> Vec<[f64; 2]> {
            let of = |one: &Specimen| -> Vec<[f64; 2]> {
                let points = one.points.iter().map(|[e, p]| {
                    let l = stretch(one, *e);
                    [1.0 / l, kpa(p / (2.0 * (l - l.powi(-2))))]
                });
                // Near the undeformed state both parts of the quotient vanish.
                points.filter(|[x, _]| (x - 1.0).abs() > 0.02).collect()
            };
            pulls().flat_map(of).collect()
        };
        let raw = reduced(&|_, e| 1.0 + e);
        let mut series = vec![Series::new("as in the file", raw, Style::Marks)];
        if fit.slack > 0.0 {
            let clean = reduced(&|one, e| fit.stretch(one.compression, e));
            series.push(Series::new("without slack", clean, Style::Marks));
        }
        let model = pulls().flat_map(|one| {
            let ends =
                [one.points.first(), one.points.last()].map(|end| end.map_or(0.0, |end| end[0]));
            even(ends).map(|e| {
                let l = fit.stretch(one.compression, e);
                let stress = fit.nominal_stress(one.mode, l);
                [1.0 / l, kpa(stress / (2.0 * (l - l.powi(-2))))]
            })
        });
        let model = model.filter(|[x, _]| (x - 1.0).abs() > 0.02).collect();
        series.push(Series::new("chosen law", model, Style::Line));
        let chart = chart(
            "",
            Axis::new("1 / stretch", "1"),
            Axis::new("P / (2 (l - 1/l^2))", "kPa"),
            series,
        );
        Some((
            "Mooney's plot",
            chart,
            "A curve that turns down at the right is slack, not a law.",
        ))
    }

    /// (d) What the law says in all modes, with the spread of the second invariant.
    fn predicted(&self) -> Option<(&'static str, Chart, &'static str)> {
        let (_, law) = self.chosen()?;
        let [low, high] = self.range();
        let ends = [low.min(0.5), high];
        let mut series: Vec<Series> = Mode::ALL
            .into_iter()
            .map(|mode| {
                // An equibiaxial pressure to a half is a pull to four: none of a sensor.
                let ends = if mode == Mode::Equibiaxial {
                    [0.7, high]
                } else {
                    ends
                };
                let points = curve(ends, |l| kpa(law.nominal_stress(mode, l)));
                Series::new(mode.name(), points, Style::Line)
            })
            .collect();
        if let Some([share, shear, limit, ..]) = self.choice.shares.last() {
            let first = Law::Gent {
                shear: shear * (1.0 - share),
                limit: *limit,
            };
            let second = Law::MooneyRivlin {
                c10: 0.0,
                c01: shear * share / 2.0,
            };
            for mode in [Mode::Uniaxial, Mode::Planar] {
                let points = curve(ends, |l| {
                    kpa(first.nominal_stress(mode, l) + second.nominal_stress(mode, l))
                });
                let name = format!("{}, {:.0} % of I2", mode.name(), 100.0 * share);
                series.push(Series::new(name, points, Style::Dashed));
            }
        }
        let tested = upright("ends of the data", [low, high], &series);
        series.push(tested);
        let chart = chart(
            "",
            Axis::new("stretch", "1"),
            Axis::new("nominal stress", "kPa"),
            series,
        );
        Some((
            "What the law says in other loadings",
            chart,
            "Between line and dashes lies what fits the data as well; outside of the upright lines nothing was tested.",
        ))
    }

    /// (e) Profile of the shear modulus.
    fn profile(&self) -> Option<(&'static str, Chart, &'static str)> {
        let (fit, _) = self.chosen()?;
        let points = profile(self.specimens, fit, self.options);
        if points.is_empty() {
            return None;
        }
        let points = points
            .into_iter()
            .map(|[shear, rms]| [kpa(shear), 100.0 * rms]);
        let mut series = vec![Series::new(
            "best other constants",
            points.collect(),
            Style::Line,
        )];
        let ends = fit.interval.unwrap_or([fit.shear_modulus; 2]).map(kpa);
        let tops: Vec<f64> = series[0].points.iter().map(|[_, rms]| *rms).collect();
        let [low, high] = tops
            .iter()
            .fold([f64::INFINITY, 0.0_f64], |[low, high], rms| {
                [low.min(*rms), high.max(*rms)]
            });
        let bounds = ends
            .iter()
            .flat_map(|x| [[*x, low], [*x, high], [f64::NAN; 2]]);
        series.push(Series::new(
            "95 % of this law",
            bounds.collect(),
            Style::Dashed,
        ));
        let chart = chart(
            "",
            Axis::new("shear modulus", "kPa"),
            Axis::new("rms", "%"),
            series,
        );
        Some((
            "How well the modulus is known",
            chart,
            "The least misfit at each modulus, all other constants fitted again.",
        ))
    }

    /// (g) Relaxation over the logarithm of time.
    fn relaxation(&self) -> Option<(&'static str, Chart, &'static str)> {
        let (held, fit) = self.held?;
        let whole = fit.sudden.unwrap_or(if held.creeps {
            fit.long
        } else {
            held.points.first()?[1]
        });
        let points: Vec<[f64; 2]> = held.points.iter().map(|[t, p]| [*t, p / whole]).collect();
        let times = points
            .iter()
            .map(|[time, _]| *time)
            .filter(|time| *time > 0.0);
        let [first, last] = times.fold([f64::INFINITY, 0.0_f64], |[low, high], t| {
            [low.min(t), high.max(t)]
        });
        let mut series = vec![Series::new("measured", points, Style::Marks)];
        if !held.creeps && fit.sudden.is_some() && last > first {
            let points = even([first.ln(), last.ln()]).map(f64::exp).map(|time| {
                let lost: f64 = fit
                    .terms
                    .iter()
                    .map(|one| one.fraction * -(-time / one.time).exp_m1())
                    .sum();
                [time, 1.0 - lost]
            });
            series.push(Series::new(
                "after a sudden load",
                points.collect(),
                Style::Line,
            ));
        }
        let chart = chart(
            "",
            Axis::logarithmic("time", "s"),
            Axis::new("share of the sudden value", "1"),
            series,
        );
        Some((
            "What relaxes",
            chart,
            "The ramp is part of what is measured, and not of the line.",
        ))
    }
}
