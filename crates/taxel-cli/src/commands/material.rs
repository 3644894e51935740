//! `taxel material`: laws of rubber from tests, from a library and from a hardness.

mod report;

use std::fmt::Write as _;
use std::path::Path;

use serde_json::{Value, json};
use taxel_files::sha256;
use taxel_ground::quantity::{FORCE, LENGTH};
use taxel_material as material;
use taxel_material::{
    Choice, Cycle, Form, Law, Mode, RelaxationFit, Slack, Specimen, Steps, Test, Tested,
};

use crate::arguments::{Format, Material, MaterialCheck, MaterialFit, MaterialShow};
use crate::{Done, Stop, files, outputs};

pub(crate) fn run(arguments: &Material) -> Result<Done, Stop> {
    match arguments {
        Material::Fit(arguments) => fit(arguments),
        Material::Check(arguments) => check(arguments),
        Material::List(arguments) => answer(arguments.format, &list(), || {
            material::all().fold(String::new(), |mut text, entry| {
                let _ = writeln!(text, "{:24}{}", entry.name, entry.law);
                text
            })
        }),
        Material::Show(arguments) => show(arguments),
        Material::Hardness(arguments) => hardness(arguments),
    }
}

fn wrong(message: impl Into<String>) -> Stop {
    Stop::WrongInput(message.into())
}

fn answer(format: Format, json: &Value, text: impl FnOnce() -> String) -> Result<Done, Stop> {
    match format {
        Format::Json => outputs::print(&taxel::table::json(json)),
        _ => outputs::print(&text()),
    }
}

fn list() -> Value {
    Value::Array(material::all().map(|entry| entry.json()).collect())
}

fn modes(material: &material::Material) -> String {
    let modes: Vec<_> = material.modes.iter().map(|mode| mode.name()).collect();
    modes.join(", ")
}

/// A law by its name in the library, of a law file, or as it is written.
fn law_of(text: &str) -> Result<(Law, Option<material::Material>), Stop> {
    let path = Path::new(text);
    if path.extension().is_some_and(|ending| ending == "toml") {
        let material = files::law_file(path, &files::text(path)?)?;
        return Ok((material.law.clone(), Some(material)));
    }
    if let Some(entry) = material::named(text) {
        return Ok((entry.law.clone(), Some(entry)));
    }
    if text.split_whitespace().count() > 1 {
        return Law::parse(text)
            .map(|law| (law, None))
            .map_err(|error| wrong(error.to_string()));
    }
    let near = material::near(text).join(", ");
    Err(wrong(format!(
        "no material is called \"{text}\"; near names: {near}"
    )))
}

fn show(arguments: &MaterialShow) -> Result<Done, Stop> {
    let (law, entry) = law_of(&arguments.name)?;
    let Some(entry) = entry else {
        return Err(wrong(format!(
            "\"{law}\" is a law, not a name; taxel material check has what follows from it"
        )));
    };
    answer(arguments.format, &entry.json(), || {
        let mut text = format!("{}\nlaw: {law}\n", entry.name);
        let _ = writeln!(
            text,
            "E at small strain: {}",
            pressure(law.youngs_modulus())
        );
        if let Some(interval) = entry.interval {
            let _ = writeln!(
                text,
                "shear modulus: {}, 95 % {}",
                pressure(law.shear_modulus()),
                between(interval)
            );
        }
        let range = entry
            .stretch
            .map_or("not given".into(), |[low, high]| format!("{low} to {high}"));
        let _ = writeln!(
            text,
            "stretch: {range}, {}\nsource: {}",
            modes(&entry),
            entry.source
        );
        if !entry.note.is_empty() {
            let _ = writeln!(text, "note: {}", entry.note);
        }
        text
    })
}

fn pressure(pascal: f64) -> String {
    if pascal.abs() < 1e6 {
        format!("{:.5} kPa", Significant(pascal / 1e3))
    } else {
        format!("{:.5} MPa", Significant(pascal / 1e6))
    }
}

/// A number with as many significant digits as the precision says.
struct Significant(f64);

impl std::fmt::Display for Significant {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let digits = i32::try_from(f.precision().unwrap_or(6)).unwrap_or(6);
        if self.0 == 0.0 || !self.0.is_finite() {
            return write!(f, "{}", self.0);
        }
        let decimals = (digits - 1 - self.0.abs().log10().floor() as i32).max(0);
        write!(f, "{:.*}", decimals as usize, self.0)
    }
}

fn between([low, high]: [f64; 2]) -> String {
    format!("[{}, {}]", pressure(low), pressure(high))
}

fn hardness(arguments: &MaterialShow) -> Result<Done, Stop> {
    let hardness =
        material::Hardness::parse(&arguments.name).map_err(|error| wrong(error.to_string()))?;
    let modulus = hardness.modulus();
    let formula = hardness.formula();
    let by_logarithm = (hardness.scale == material::Scale::A).then(|| hardness.logarithmic());
    answer(arguments.format, &hardness.json(), || {
        let mut text = String::new();
        if modulus.within {
            let [low, high] = modulus.interval.map(|end| Significant(end / 1e6));
            let _ = writeln!(
                text,
                "E = {:.2} MPa, 95 % of the next silicone [{low:.2}, {high:.3}] MPa",
                Significant(modulus.value / 1e6)
            );
        } else {
            let [low, high] = modulus.range;
            let _ = writeln!(
                text,
                "out of the range of the relation, {low} to {high}: only the formula"
            );
        }
        let name = match hardness.scale {
            material::Scale::A => "Gent",
            material::Scale::DoubleZero => "Hertz",
        };
        let _ = writeln!(
            text,
            "formula of {name}: {:.4} MPa",
            Significant(formula / 1e6)
        );
        if let Some(other) = by_logarithm {
            let _ = writeln!(
                text,
                "log10 E = 0.0235 S - 0.6403: {:.4} MPa",
                Significant(other / 1e6)
            );
        }
        text
    })
}

fn check(arguments: &MaterialCheck) -> Result<Done, Stop> {
    let (law, entry) = law_of(&arguments.law)?;
    let named = entry
        .as_ref()
        .and_then(|entry| entry.stretch)
        .map_or(1.5, |stretch| stretch[1]);
    let [low, high] = range(arguments.service.as_deref(), "--service")?.unwrap_or([0.5, named]);
    if !(0.05..=1.0).contains(&low) || !(1.0..=20.0).contains(&high) {
        return Err(wrong(
            "--service: the smallest stretch is 0.05 to 1 and the largest 1 to 20",
        ));
    }
    let loss = material::first_loss(&law, low, high);
    let ratio = material::equibiaxial_ratio(&law);
    let sane = material::SANE.contains(&ratio);
    let stresses: Vec<Value> = [0.6, 1.1, 1.5, 2.0]
        .map(|l| {
            let of = |mode: Mode| law.nominal_stress(mode, l);
            json!({ "stretch": l, "uniaxial_pa": of(Mode::Uniaxial), "planar_pa": of(Mode::Planar), "equibiaxial_pa": of(Mode::Equibiaxial) })
        })
        .into();
    let value = json!({
        "law": law.to_string(),
        "shear_modulus_pa": law.shear_modulus(),
        "youngs_modulus_pa": law.youngs_modulus(),
        "service": [low, high],
        "stable": loss.is_none(),
        "loss": loss.map(|loss| json!({ "mode": loss.mode.name(), "stretch": loss.stretch, "criterion": loss.criterion })),
        "equibiaxial_ratio": ratio,
        "equibiaxial_ratio_sane": sane,
        "stresses": stresses,
    });
    answer(arguments.format, &value, || {
        let mut text = format!("law: {law}\n");
        let _ = writeln!(
            text,
            "E at small strain: {}",
            pressure(law.youngs_modulus())
        );
        match loss {
            None => _ = writeln!(text, "stable from a stretch of {low} to {high}"),
            Some(loss) => _ = writeln!(text, "not stable: {loss}"),
        }
        let verdict = if sane {
            "sane"
        } else {
            "refused, unless equibiaxial tension was tested"
        };
        let _ = writeln!(
            text,
            "equibiaxial over uniaxial stress, neo-Hookean 1: {ratio:.3}, {verdict} ({} to {})",
            material::SANE.start(),
            material::SANE.end()
        );
        text
    })?;
    if loss.is_none() && sane {
        Ok(Done::Complete)
    } else {
        Err(Stop::Failed("the law does not stand: see above".into()))
    }
}

fn range(text: Option<&str>, option: &str) -> Result<Option<[f64; 2]>, Stop> {
    let Some(text) = text else {
        return Ok(None);
    };
    let ends = text
        .split_once("..")
        .and_then(|(low, high)| Some([low.trim().parse::<f64>().ok()?, high.trim().parse().ok()?]));
    let ends = ends.filter(|[low, high]| low < high && high.is_finite());
    ends.map(Some)
        .ok_or_else(|| wrong(format!("{option}: \"{text}\" is no range; write 0..1")))
}

fn steps(arguments: &MaterialFit) -> Result<Steps, Stop> {
    let quantity =
        |text: Option<&str>, option: &str, read: &dyn Fn(&str) -> Result<f64, String>| {
            text.map_or(Ok(0.0), |text| {
                read(text).map_err(|message| wrong(format!("{option}: {message}")))
            })
        };
    let compliance = |text: &str| {
        let plain = text.trim();
        let (length, force) = plain.split_once('/').ok_or("write \"0.02 mm/N\"")?;
        Ok(LENGTH.parse(length)? / FORCE.parse(&format!("1 {force}"))?)
    };
    Ok(Steps {
        compliance: quantity(arguments.compliance.as_deref(), "--compliance", &compliance)?,
        force_offset: quantity(
            arguments.force_offset.as_deref(),
            "--force-offset",
            &|text| FORCE.parse(text),
        )?,
        cycle: match arguments.cycle.as_deref() {
            None | Some("last") => Cycle::Last,
            Some("first") => Cycle::Number(1),
            Some(number) => Cycle::Number(
                number
                    .parse()
                    .map_err(|_| wrong("--cycle is first, last or a number"))?,
            ),
        },
        strain_range: range(arguments.strain_range.as_deref(), "--strain-range")?,
    })
}

fn form(name: &str) -> Result<Vec<Form>, Stop> {
    Form::labelled(name).ok_or_else(|| {
        let names: Vec<_> = Form::all().into_iter().map(Form::label).collect();
        wrong(format!(
            "--law: \"{name}\" is no law to fit; one of: {}, all",
            names.join(", ")
        ))
    })
}

/// The slack that is asked for; a length is one of the gauge length of the tests.
fn slack(text: Option<&str>, tests: &[Test]) -> Result<Slack, Stop> {
    let Some(text) = text else {
        return Ok(Slack::WhereItMatters);
    };
    if text == "fit" {
        return Ok(Slack::Fitted);
    }
    let strain = if let Ok(strain) = text.parse::<f64>() {
        strain
    } else {
        let slack = LENGTH
            .parse(text)
            .map_err(|message| wrong(format!("--slack is fit, a strain or a length: {message}")))?;
        let mut lengths = tests
            .iter()
            .filter(|test| test.held.is_none())
            .map(|test| test.length);
        let first = lengths.next().flatten().ok_or_else(|| {
                wrong("--slack: a length needs the gauge length\nhelp: write `# gauge_length = \"33 mm\"` above the header")
            })?;
        if lengths.any(|other| other != Some(first)) {
            return Err(wrong(
                "--slack: the tests have different gauge lengths\nhelp: give a strain",
            ));
        }
        slack / first
    };
    if (0.0..=0.1).contains(&strain) {
        Ok(Slack::Given(strain))
    } else {
        Err(wrong(format!(
            "--slack: a strain of {strain} is outside 0 to 0.1"
        )))
    }
}

fn options(arguments: &MaterialFit, tests: &[Test]) -> Result<material::Options, Stop> {
    let slack = slack(arguments.slack.as_deref(), tests)?;
    let service = range(arguments.service.as_deref(), "--service")?;
    Ok(material::Options {
        forms: arguments.law.as_deref().map(form).transpose()?,
        slack,
        weights: if arguments.weight == "absolute" {
            material::Weights::Absolute
        } else {
            material::Weights::Relative
        },
        measure: if arguments.measure == "points" {
            material::Measure::Points
        } else {
            material::Measure::Stretch
        },
        pooled: arguments.pool,
        service: service.map_or((0.5, None), |[low, high]| (low, Some(high))),
    })
}

fn fit(arguments: &MaterialFit) -> Result<Done, Stop> {
    let written = [
        ("--output", arguments.output.as_ref()),
        ("--report", arguments.report.as_ref()),
    ];
    let inputs: Vec<_> = arguments.tests.iter().collect();
    outputs::check(&written, &inputs, arguments.overwrite.existing())?;
    let steps = steps(arguments)?;
    let (mut tests, mut hashes) = (Vec::new(), Vec::new());
    for path in &arguments.tests {
        let text = files::text(path)?;
        let name = taxel_ground::shown::path(path);
        tests.push(material::read(&name, &text, arguments.mode.as_deref())?);
        hashes.push(sha256(text.as_bytes()));
    }
    let options = options(arguments, &tests)?;
    let held = held(&tests)?;
    if tests.iter().all(|test| test.held.is_some()) {
        return relaxation_alone(arguments, &tests, held.as_ref());
    }
    let of_held = tests.iter().find_map(|test| test.held.clone());
    let loading: Vec<_> = tests.iter().map(|test| test.held.is_none()).collect();
    let mut of_loading = loading.iter();
    hashes.retain(|_| *of_loading.next().unwrap_or(&true));
    tests.retain(|test| test.held.is_none());
    let (mut specimens, notes) = material::prepare(&tests, &steps)?;
    if arguments.friction == "none" {
        for one in &mut specimens {
            one.bonded = 1.0;
        }
    }
    let choice =
        material::choose(&specimens, &options).map_err(|error| wrong(error.to_string()))?;
    let cycles = cycles(&tests, &steps, &options, choice.chosen());
    let same = specimens.len() > 2
        && specimens.iter().all(|one| {
            one.mode == specimens[0].mode && one.compression == specimens[0].compression
        });
    let each: Option<Vec<f64>> = same
        .then(|| {
            let chosen = choice.chosen()?;
            let alone = material::Options {
                forms: Some(vec![chosen.form]),
                ..options.clone()
            };
            let of = |one: &Specimen| {
                let choice = material::choose(std::slice::from_ref(one), &alone).ok()?;
                choice
                    .candidates
                    .first()
                    .map(|candidate| candidate.fit.shear_modulus)
            };
            specimens.iter().map(of).collect()
        })
        .flatten();
    let answered = Answered {
        specimens: &specimens,
        notes: &notes,
        choice: &choice,
        each,
        cycles,
        stable_to: stable_to(&specimens, &options, &choice),
        held: held.as_ref(),
        to_sudden: held
            .as_ref()
            .map_or(1.0, |held| to_sudden(&held.terms, &tests)),
    };
    if let (Some(path), Some(text)) = (
        &arguments.output,
        answered.law_file(&hashes, &arguments.weight),
    ) {
        outputs::write(Some(path), arguments.overwrite.existing(), &text)?;
    }
    let text = answered.text();
    if let Some(path) = &arguments.report {
        let page = report::Report {
            tests: &tests,
            held: of_held.as_ref().zip(held.as_ref()),
            specimens: &specimens,
            choice: &choice,
            options: &options,
            answer: &text,
        };
        outputs::write(Some(path), arguments.overwrite.existing(), &page.html())?;
    }
    answer(arguments.format, &answered.json(), || text)?;
    if choice.index.is_some() {
        Ok(Done::Complete)
    } else {
        Err(Stop::Failed("no law stands for these tests: see above; try --strain-range, or a test of another mode".into()))
    }
}

struct Answered<'a> {
    specimens: &'a [Specimen],
    notes: &'a [String],
    choice: &'a Choice,
    /// Shear modulus of each of three or more specimens alone.
    each: Option<Vec<f64>>,
    /// Shear moduli of the first loading and of the last one, Pa, where there are several and nobody
    /// says which.
    cycles: Option<[f64; 2]>,
    /// Largest strain up to which some law stands, where none does.
    stable_to: Option<f64>,
    /// What relaxes.
    held: Option<&'a RelaxationFit>,
    /// Stress of a sudden load over that of the tests.
    to_sudden: f64,
}

/// Shear moduli of the first loading and of the last, by the chosen law.
fn cycles(
    tests: &[Test],
    steps: &Steps,
    options: &material::Options,
    chosen: Option<&material::Fit>,
) -> Option<[f64; 2]> {
    let fit = chosen.filter(|_| steps.cycle == Cycle::Last)?;
    let of = |cycle: Cycle| {
        let steps = Steps {
            cycle,
            ..steps.clone()
        };
        material::prepare(tests, &steps)
            .ok()
            .map(|(specimens, _)| specimens)
    };
    let (first, last) = (of(Cycle::Number(1))?, of(Cycle::Last)?);
    if first == last {
        return None;
    }
    let alone = material::Options {
        forms: Some(vec![fit.form]),
        ..options.clone()
    };
    let choice = material::choose(&first, &alone).ok()?;
    Some([
        choice.candidates.first()?.fit.shear_modulus,
        fit.shear_modulus,
    ])
}

/// Parts of the range of strain that are tried.
const PARTS: u32 = 20;

/// The largest strain up to which some law stands for the tests, where none does for all of them.
fn stable_to(specimens: &[Specimen], options: &material::Options, choice: &Choice) -> Option<f64> {
    if choice.index.is_some() {
        return None;
    }
    let strains = specimens
        .iter()
        .flat_map(|one| one.points.iter().map(|[e, _]| *e));
    let most = strains.fold(0.0, f64::max);
    (1..PARTS)
        .rev()
        .map(|part| most * f64::from(part) / f64::from(PARTS))
        .find(|most| {
            let mut shorter = specimens.to_vec();
            for one in &mut shorter {
                one.points.retain(|[e, _]| e <= most);
            }
            let enough = shorter
                .iter()
                .all(|one| one.points.len() >= material::FEWEST);
            enough && material::choose(&shorter, options).is_ok_and(|choice| choice.index.is_some())
        })
}

/// The series of the one test that was held.
fn held(tests: &[Test]) -> Result<Option<RelaxationFit>, Stop> {
    let mut held = tests
        .iter()
        .filter_map(|test| Some((&test.name, test.held.as_ref()?)));
    let Some((name, first)) = held.next() else {
        return Ok(None);
    };
    if let Some((other, _)) = held.next() {
        return Err(wrong(format!(
            "{name} and {other} are two tests that were held\nhelp: give one of them: series of two specimens are not joined"
        )));
    }
    let fit = material::relaxed(first).map_err(|error| {
        wrong(format!(
            "{name}: {error}\nhelp: record from the end of the ramp until nothing changes"
        ))
    })?;
    Ok(Some(fit))
}

/// Stress of a sudden load over that of the loading tests: by the times of their points, or, without
/// times, of a test so slow that all has relaxed.
fn to_sudden(terms: &[material::Relaxation], tests: &[Test]) -> f64 {
    let shares = tests.iter().flat_map(|test| {
        let begin = test.rows.first().map_or(0.0, |row| row[0]);
        let timed = test.timed;
        test.rows.iter().map(move |row| {
            let time = if timed { row[0] - begin } else { f64::INFINITY };
            material::constant_rate(terms, time)
        })
    });
    let (sum, count) = shares.fold((0.0, 0.0), |(sum, count), share| (sum + share, count + 1.0));
    if count > 0.0 { count / sum } else { 1.0 }
}

fn relaxation_alone(
    arguments: &MaterialFit,
    tests: &[Test],
    fit: Option<&RelaxationFit>,
) -> Result<Done, Stop> {
    if arguments.output.is_some() || arguments.report.is_some() {
        return Err(wrong(
            "--output, --report: a test that was held gives no law\nhelp: give a loading test of the same material beside it",
        ));
    }
    let Some(fit) = fit else {
        return Err(wrong("there is no test"));
    };
    let notes: Vec<_> = tests.iter().flat_map(|test| &test.notes).collect();
    let creeps = tests
        .iter()
        .any(|test| test.held.as_ref().is_some_and(|held| held.creeps));
    let value = json!({ "notes": notes, "relaxation": fit.json() });
    answer(arguments.format, &value, || {
        let notes = notes
            .iter()
            .fold(String::new(), |text, note| text + note + "\n");
        notes + &relaxation_text(fit, creeps)
    })
}

fn relaxation_text(fit: &RelaxationFit, creeps: bool) -> String {
    let mut text = String::new();
    for term in &fit.terms {
        let _ = writeln!(
            text,
            "relaxes: {:.4} of the sudden stress in {:.4} s",
            term.fraction,
            Significant(term.time)
        );
    }
    let value = |value: f64| {
        if creeps {
            format!("a strain of {value:.5}")
        } else {
            pressure(value)
        }
    };
    match fit.sudden {
        Some(sudden) => {
            let _ = writeln!(text, "sudden: {}", value(sudden));
        }
        None => text.push_str(
            "the ramp is not known (`# ramp = \"0.5 s\"`): no sudden value, and the fast fractions are too small\n",
        ),
    }
    let _ = writeln!(
        text,
        "after a long time: {}, rms {:.3} %",
        value(fit.long),
        100.0 * fit.rms
    );
    let (long, terms) = material::creep(&fit.terms);
    let _ = write!(
        text,
        "creep under a held load: {long:.6} times the sudden strain in the end"
    );
    for term in terms {
        let _ = write!(
            text,
            ", {:.4} of it in {:.6} s",
            term.fraction,
            Significant(term.time)
        );
    }
    text.push('\n');
    let sum: f64 = fit.terms.iter().map(|term| term.fraction).sum();
    let _ = writeln!(
        text,
        "sensor files that count springs beside the long-time stiffness: ratios times {:.6}",
        1.0 / (1.0 - sum)
    );
    text
}

impl Answered<'_> {
    fn interval(&self) -> Option<([f64; 2], String)> {
        let of_specimens = self.each.as_deref().and_then(material::specimens);
        if let Some(found) = of_specimens {
            let basis = format!("{} specimens", self.specimens.len());
            return Some((found.of_mean, basis));
        }
        // Friction can only stiffen: the interval of a pressed disc grows downwards.
        let bonded = self
            .specimens
            .iter()
            .map(|one| one.bonded)
            .fold(1.0, f64::max);
        let basis = if self.specimens.len() == 1 {
            "one specimen"
        } else {
            "one specimen of each mode"
        };
        let widened = |[low, high]: [f64; 2]| ([low / bonded, high], basis.to_owned());
        self.choice.interval.map(widened)
    }

    /// What was guessed and left out, and a line for each law.
    fn laws(&self) -> String {
        let mut text = String::new();
        for note in self.notes {
            let _ = writeln!(text, "{note}");
        }
        for candidate in &self.choice.candidates {
            let fit = &candidate.fit;
            let slack = if fit.slack > 0.0 {
                format!(", slack {:.2} %", fit.slack * 100.0)
            } else {
                String::new()
            };
            let preload = if fit.preload_stretch > 1.0 {
                format!(", preload at a stretch of {:.6}", fit.preload_stretch)
            } else {
                String::new()
            };
            let verdict = candidate
                .refused
                .as_deref()
                .map_or("holds".into(), |why| format!("refused: {why}"));
            let _ = writeln!(
                text,
                "{}: rms {:.2} %{slack}{preload}; {verdict}",
                candidate.law,
                fit.rms() * 100.0
            );
        }
        for (_, why) in &self.choice.failed {
            let _ = writeln!(text, "{why}");
        }
        text
    }

    fn text(&self) -> String {
        let mut text = self.laws();
        let Some(index) = self.choice.index else {
            if let Some(most) = self.stable_to {
                let _ = writeln!(
                    text,
                    "a law stands up to a strain of {most:.4}: --strain-range 0..{most:.4}"
                );
            }
            return text;
        };
        let candidate = &self.choice.candidates[index];
        let shear = candidate.fit.shear_modulus;
        let _ = writeln!(
            text,
            "chosen: {}\nshear modulus {}, E {}",
            candidate.law,
            pressure(shear),
            pressure(3.0 * shear)
        );
        if let Some(with) = candidate.fit.modulus_with_slack {
            let _ = writeln!(
                text,
                "a slack of {:.2} % is taken out; left in, the shear modulus is {}",
                candidate.fit.slack * 100.0,
                pressure(with)
            );
        }
        if let Some(held) = self.held {
            text.push_str(&relaxation_text(held, false));
            let _ = writeln!(
                text,
                "the tests measured {:.4} of the stress of a sudden load: the law that is written is the sudden one, {}",
                1.0 / self.to_sudden,
                candidate.law.scaled(self.to_sudden)
            );
        }
        match self.interval() {
            Some((interval, basis)) => {
                let _ = writeln!(
                    text,
                    "95 % of the shear modulus: {} ({basis})",
                    between(interval)
                );
            }
            None => text.push_str("the misfit is systematic: no interval\n"),
        }
        if let Some([first, last]) = self.cycles {
            let _ = writeln!(
                text,
                "first loading {}, last {}: a sensor lives on cycled rubber (--cycle)",
                pressure(first),
                pressure(last)
            );
        }
        let points: usize = self.specimens.iter().map(|one| one.points.len()).sum();
        let _ = writeln!(
            text,
            "its {points} points count as {:.0}: the misfit of neighbours is alike",
            candidate.fit.effective
        );
        match self.each.as_deref().and_then(material::specimens) {
            Some(found) => {
                let _ = writeln!(
                    text,
                    "mean {}, next specimen {}",
                    pressure(found.mean),
                    between(found.of_next)
                );
            }
            None => text.push_str("one specimen: says nothing about the next casting\n"),
        }
        for stretch in [1.1, 1.5, 2.0] {
            let stress = candidate.law.nominal_stress(Mode::Uniaxial, stretch);
            let _ = writeln!(
                text,
                "stress at {:.0} %: {}",
                (stretch - 1.0) * 100.0,
                pressure(stress)
            );
        }
        if let (Some(first), Some(last)) = (self.choice.shares.first(), self.choice.shares.last()) {
            let _ = writeln!(
                text,
                "not known: the share of the second invariant; {:.0} to {:.0} % of it fit as well, and at 40 % \
                 compression they say {} to {} uniaxial, {} to {} planar: test compression",
                first[0] * 100.0,
                last[0] * 100.0,
                pressure(first[4]),
                pressure(last[4]),
                pressure(first[5]),
                pressure(last[5])
            );
        }
        text
    }

    fn json(&self) -> Value {
        let of_specimens = self.each.as_deref().and_then(material::specimens);
        let (interval, basis) = self.interval().unzip();
        let points: Vec<usize> = self.specimens.iter().map(|one| one.points.len()).collect();
        let mut whole = serde_json::Map::new();
        whole.insert("notes".into(), json!(self.notes));
        whole.insert("points".into(), json!(points));
        whole.extend(self.choice.json());
        for (key, value) in [
            ("interval_pa", json!(interval)),
            ("basis", json!(basis)),
            ("each_pa", json!(self.each)),
            (
                "next_specimen_pa",
                json!(of_specimens.map(|found| found.of_next)),
            ),
            ("cycles_pa", json!(self.cycles)),
            ("stable_to_strain", json!(self.stable_to)),
            ("relaxation", json!(self.held.map(RelaxationFit::json))),
            ("to_sudden", json!(self.to_sudden)),
        ] {
            whole.insert(key.into(), value);
        }
        Value::Object(whole)
    }

    /// The law as a file.
    fn law_file(&self, hashes: &[String], weights: &str) -> Option<String> {
        let candidate = &self.choice.candidates[self.choice.index?];
        let strains = self
            .specimens
            .iter()
            .flat_map(|one| one.points.iter().map(|[e, _]| 1.0 + e));
        let (low, high) = strains.fold((1.0_f64, 1.0_f64), |(low, high), l| {
            (low.min(l), high.max(l))
        });
        let mut modes: Vec<Tested> = self.specimens.iter().map(Specimen::tested).collect();
        modes.dedup();
        let name = |one: &Specimen| {
            let path = Path::new(&one.name).file_name();
            path.map_or_else(
                || one.name.clone(),
                |name| name.to_string_lossy().into_owned(),
            )
        };
        let tests = self
            .specimens
            .iter()
            .zip(hashes)
            .map(|(one, hash)| material::Part {
                file: name(one),
                sha256: hash.clone(),
                mode: Some(one.tested()),
                points: u32::try_from(one.points.len()).ok(),
                slack: Some(candidate.fit.slack),
                weights: Some(weights.to_owned()),
            });
        let (interval, basis) = self.interval().unzip();
        let of_i2 = self.choice.shares.first().zip(self.choice.shares.last());
        let material = material::Material {
            name: self.specimens.first().map(name).unwrap_or_default(),
            law: candidate.law.scaled(self.to_sudden),
            interval: interval.map(|ends| ends.map(|end| end * self.to_sudden)),
            basis: basis.unwrap_or_default(),
            stretch: Some([low, high]),
            modes,
            source: String::new(),
            note: String::new(),
            relaxation: self.held.map_or_else(Vec::new, |held| held.terms.clone()),
            tests: tests.collect(),
        };
        Some(material.toml(
            of_i2.map(|(first, last)| [last[4], first[4]].map(|stress| stress * self.to_sudden)),
        ))
    }
}
