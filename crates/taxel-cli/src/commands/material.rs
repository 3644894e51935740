//! `taxel material`: laws of rubber from tests, from a library and from a hardness.

use std::fmt::Write as _;

use serde_json::{Value, json};
use taxel_files::sha256;
use taxel_ground::quantity::{FORCE, LENGTH};
use taxel_material as material;
use taxel_material::{Choice, Cycle, Form, Law, Mode, Slack, Specimen, Steps};

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
    Value::Array(material::all().map(|entry| described(&entry)).collect())
}

fn described(entry: &material::Entry) -> Value {
    json!({
        "name": entry.name,
        "law": entry.law.to_string(),
        "shear_modulus_pa": entry.law.shear_modulus(),
        "youngs_modulus_pa": entry.law.youngs_modulus(),
        "shear_modulus_interval_pa": entry.interval,
        "stretch": entry.stretch,
        "mode": entry.mode.name(),
        "source": entry.source,
        "note": entry.note,
    })
}

/// A law by its name in the library, or as it is written.
fn law_of(text: &str) -> Result<(Law, Option<material::Entry>), Stop> {
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
    answer(arguments.format, &described(&entry), || {
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
            entry.mode.name(),
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
    let value = json!({
        "youngs_modulus_pa": modulus.within.then_some(modulus.value),
        "interval_pa": modulus.within.then_some(modulus.interval),
        "formula_pa": formula,
        "logarithmic_formula_pa": by_logarithm,
        "range_shore": modulus.range,
        "within_range": modulus.within,
    });
    answer(arguments.format, &value, || {
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
    let all = vec![Form::NeoHookean, Form::MooneyRivlin, Form::Gent, Form::Yeoh];
    if name == "all" {
        return Ok(all);
    }
    let found = all.iter().copied().find(|form| form.name() == name);
    let names: Vec<_> = all.iter().map(|form| form.name()).collect();
    let message = format!(
        "--law: \"{name}\" is no law to fit; one of: {}, all",
        names.join(", ")
    );
    found.map(|form| vec![form]).ok_or_else(|| wrong(message))
}

fn options(arguments: &MaterialFit) -> Result<material::Options, Stop> {
    let slack = match arguments.slack.as_deref() {
        None => Slack::WhereItMatters,
        Some("fit") => Slack::Fitted,
        Some(number) => {
            let strain = number
                .parse()
                .ok()
                .filter(|strain| (0.0..=0.1).contains(strain));
            Slack::Given(strain.ok_or_else(|| wrong("--slack is fit or a strain from 0 to 0.1"))?)
        }
    };
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
    let written = [("--output", arguments.output.as_ref())];
    let inputs: Vec<_> = arguments.tests.iter().collect();
    outputs::check(&written, &inputs, arguments.overwrite.existing())?;
    let (steps, options) = (steps(arguments)?, options(arguments)?);
    let (mut tests, mut hashes) = (Vec::new(), Vec::new());
    for path in &arguments.tests {
        let text = files::text(path)?;
        let name = taxel_ground::shown::path(path);
        tests.push(material::read(&name, &text, arguments.mode.as_deref())?);
        hashes.push(sha256(text.as_bytes()));
    }
    let (mut specimens, notes) = material::prepare(&tests, &steps)?;
    if arguments.friction == "none" {
        for one in &mut specimens {
            one.bonded = 1.0;
        }
    }
    let choice =
        material::choose(&specimens, &options).map_err(|error| wrong(error.to_string()))?;
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
    };
    if let (Some(path), Some(text)) = (&arguments.output, answered.law_file(&hashes)) {
        outputs::write(Some(path), arguments.overwrite.existing(), &text)?;
    }
    answer(arguments.format, &answered.json(), || answered.text())?;
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

    fn text(&self) -> String {
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
        let Some(index) = self.choice.index else {
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
        let candidates: Vec<Value> = self
            .choice
            .candidates
            .iter()
            .map(|candidate| {
                let fit = &candidate.fit;
                json!({
                    "law": candidate.law.to_string(),
                    "moduli_pa": fit.moduli,
                    "limit": fit.limit,
                    "shear_modulus_pa": fit.shear_modulus,
                    "interval_pa": fit.interval,
                    "standard_errors": fit.standard_errors,
                    "slack": fit.slack,
                    "preload_stretch": fit.preload_stretch,
                    "rms": fit.rms(),
                    "effective_points": fit.effective,
                    "refused": candidate.refused,
                })
            })
            .collect();
        let of_specimens = self.each.as_deref().and_then(material::specimens);
        json!({
            "notes": self.notes,
            "points": self.specimens.iter().map(|one| one.points.len()).collect::<Vec<_>>(),
            "candidates": candidates,
            "failed": self.choice.failed.iter().map(|(_, why)| why.to_string()).collect::<Vec<_>>(),
            "chosen": self.choice.index,
            "interval_pa": self.interval().map(|(interval, _)| interval),
            "basis": self.interval().map(|(_, basis)| basis),
            "each_pa": self.each,
            "next_specimen_pa": of_specimens.map(|found| found.of_next),
            "second_invariant": self.choice.shares.iter().map(|share| json!({
                "share": share[0], "shear_modulus_pa": share[1], "limit": share[2], "rms": share[3],
                "uniaxial_0_6_pa": share[4], "planar_0_6_pa": share[5],
            })).collect::<Vec<_>>(),
        })
    }

    /// The law as a file.
    fn law_file(&self, hashes: &[String]) -> Option<String> {
        let candidate = &self.choice.candidates[self.choice.index?];
        let stress = |pascal: f64| format!("\"{pascal} Pa\"");
        let law = match &candidate.law {
            Law::NeoHookean { shear } => format!(
                "{{ neo_hookean = {{ shear_modulus = {} }} }}",
                stress(*shear)
            ),
            Law::MooneyRivlin { c10, c01 } => format!(
                "{{ mooney_rivlin = {{ c10 = {}, c01 = {} }} }}",
                stress(*c10),
                stress(*c01)
            ),
            Law::Yeoh { factors: [a, b, c] } => format!(
                "{{ yeoh = {{ c10 = {}, c20 = {}, c30 = {} }} }}",
                stress(*a),
                stress(*b),
                stress(*c)
            ),
            Law::Gent { shear, limit } => format!(
                "{{ gent = {{ shear_modulus = {}, limit = {limit} }} }}",
                stress(*shear)
            ),
            Law::Ogden { .. } => return None,
        };
        let strains = self
            .specimens
            .iter()
            .flat_map(|one| one.points.iter().map(|[e, _]| 1.0 + e));
        let (low, high) = strains.fold((1.0_f64, 1.0_f64), |(low, high), l| {
            (low.min(l), high.max(l))
        });
        let mut modes: Vec<&str> = self
            .specimens
            .iter()
            .map(|one| {
                if one.compression {
                    "compression"
                } else {
                    one.mode.name()
                }
            })
            .collect();
        modes.dedup();
        let name = self.specimens.first().map_or("", |one| one.name.as_str());
        let mut text = format!(
            "schema = 1\nname = {}\nlaw = {law}\ncompressibility = \"incompressible\"\n",
            taxel_ground::shown::toml(name)
        );
        let _ = writeln!(
            text,
            "\n[valid]\nstretch = [{low}, {high}]\nmodes = {modes:?}"
        );
        if let Some(([low, high], basis)) = self.interval() {
            let _ = writeln!(
                text,
                "\n[uncertainty]\nbasis = {basis:?}\nshear_modulus = [{}, {}]",
                stress(low),
                stress(high)
            );
            if let (Some(first), Some(last)) =
                (self.choice.shares.first(), self.choice.shares.last())
            {
                let _ = writeln!(
                    text,
                    "i2_share = {{ uniaxial_0_6 = [{}, {}] }}",
                    stress(last[4]),
                    stress(first[4])
                );
            }
        }
        text.push_str("\n[made]\ntests = [\n");
        for (one, hash) in self.specimens.iter().zip(hashes) {
            let _ = writeln!(
                text,
                "    {{ file = {}, sha256 = \"{hash}\", mode = {:?}, points = {}, slack = {} }},",
                taxel_ground::shown::toml(&one.name),
                one.mode.name(),
                one.points.len(),
                candidate.fit.slack
            );
        }
        text.push_str("]\n");
        Some(text)
    }
}
