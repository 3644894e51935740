//! A material: its law with where it comes from and how well it is known, as a law file has it.

use std::fmt::Write as _;

use schemars::JsonSchema;
use serde::Deserialize;
use taxel_ground::quantity::{
    self, AnyNumber, AnyStress, Checked, PositiveFraction, PositiveNumber, PositiveStress,
    PositiveTime,
};
use taxel_ground::{InputError, shown, toml_input};
use taxel_numerics::least_squares::NORMAL_95;

use crate::law::Law;

/// A law with what is known of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Name.
    pub name: String,
    /// The law.
    pub law: Law,
    /// 95 % of the shear modulus, Pa, as source and basis say; none where they have none.
    pub interval: Option<[f64; 2]>,
    /// What the interval rests on, such as "one specimen"; may be empty.
    pub basis: String,
    /// Stretches that were tested; none where nobody says.
    pub stretch: Option<[f64; 2]>,
    /// Loadings that were tested.
    pub modes: Vec<Tested>,
    /// Source, with its year; of a law file its name.
    pub source: String,
    /// What a user must know; may be empty.
    pub note: String,
    /// Parts that relax; where there are some, the law is the answer to a sudden load.
    pub relaxation: Vec<Relaxation>,
    /// Files of the tests that it was fitted to, with their SHA-256.
    pub tests: Vec<Part>,
}

/// A loading that was tested.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Tested {
    /// A pull along one axis.
    Uniaxial,
    /// A disc that was pressed.
    Compression,
    /// A wide strip.
    Planar,
    /// Along two axes.
    Equibiaxial,
}

impl Tested {
    /// Name, as files have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Uniaxial => "uniaxial",
            Self::Compression => "compression",
            Self::Planar => "planar",
            Self::Equibiaxial => "equibiaxial",
        }
    }
}

/// A part of the sudden stress that relaxes.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Relaxation {
    /// Share of the sudden stress.
    #[serde(deserialize_with = "quantity::one::<PositiveFraction, _>")]
    #[schemars(with = "Checked<PositiveFraction>")]
    pub fraction: f64,
    /// Relaxation time, s.
    #[serde(deserialize_with = "quantity::one::<PositiveTime, _>")]
    #[schemars(with = "Checked<PositiveTime>")]
    pub time: f64,
}

/// A test that a law was fitted to.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Part {
    /// File, from the folder of the law file.
    pub file: String,
    /// SHA-256 of its text.
    pub sha256: String,
    /// Loading.
    pub mode: Option<Tested>,
    /// Points that were fitted.
    pub points: Option<u32>,
    /// Slack that was taken out, a strain.
    pub slack: Option<f64>,
    /// What residuals were measured by.
    pub weights: Option<String>,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct LawFile {
    schema: u32,
    name: String,
    law: WrittenLaw,
    #[serde(default, rename = "compressibility")]
    _compressibility: Volume,
    #[serde(default)]
    source: String,
    #[serde(default)]
    note: String,
    #[serde(default)]
    valid: Valid,
    #[serde(default)]
    uncertainty: Uncertainty,
    #[serde(default)]
    relaxation: Terms,
    #[serde(default)]
    made: Made,
}

#[derive(Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
enum Volume {
    #[default]
    Incompressible,
}

#[derive(Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
enum WrittenLaw {
    NeoHookean(Shear),
    MooneyRivlin(MooneyRivlin),
    Yeoh(Yeoh),
    Gent(Gent),
    Ogden(Vec<OgdenTerm>),
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Shear {
    #[serde(deserialize_with = "quantity::one::<PositiveStress, _>")]
    #[schemars(with = "Checked<PositiveStress>")]
    shear_modulus: f64,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct MooneyRivlin {
    #[serde(deserialize_with = "quantity::one::<AnyStress, _>")]
    #[schemars(with = "Checked<AnyStress>")]
    c10: f64,
    #[serde(deserialize_with = "quantity::one::<AnyStress, _>")]
    #[schemars(with = "Checked<AnyStress>")]
    c01: f64,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Yeoh {
    #[serde(deserialize_with = "quantity::one::<PositiveStress, _>")]
    #[schemars(with = "Checked<PositiveStress>")]
    c10: f64,
    #[serde(deserialize_with = "quantity::one::<AnyStress, _>")]
    #[schemars(with = "Checked<AnyStress>")]
    c20: f64,
    #[serde(deserialize_with = "quantity::one::<AnyStress, _>")]
    #[schemars(with = "Checked<AnyStress>")]
    c30: f64,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Gent {
    #[serde(deserialize_with = "quantity::one::<PositiveStress, _>")]
    #[schemars(with = "Checked<PositiveStress>")]
    shear_modulus: f64,
    #[serde(deserialize_with = "quantity::one::<PositiveNumber, _>")]
    #[schemars(with = "Checked<PositiveNumber>")]
    limit: f64,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct OgdenTerm {
    #[serde(deserialize_with = "quantity::one::<AnyStress, _>")]
    #[schemars(with = "Checked<AnyStress>")]
    modulus: f64,
    #[serde(deserialize_with = "quantity::one::<AnyNumber, _>")]
    #[schemars(with = "Checked<AnyNumber>")]
    exponent: f64,
}

#[derive(Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Valid {
    stretch: Option<[f64; 2]>,
    #[serde(default)]
    modes: Vec<Tested>,
}

#[derive(Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Uncertainty {
    #[serde(default)]
    basis: String,
    shear_modulus: Option<[Checked<PositiveStress>; 2]>,
    /// Stresses at 40 % compression by the shares of the second invariant that fit as well; for
    /// people.
    #[serde(rename = "i2_share")]
    _i2_share: Option<Shares>,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Shares {
    #[serde(rename = "uniaxial_0_6")]
    _uniaxial: [Checked<AnyStress>; 2],
}

#[derive(Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Terms {
    #[serde(default)]
    terms: Vec<Relaxation>,
}

#[derive(Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Made {
    #[serde(default)]
    tests: Vec<Part>,
}

impl From<WrittenLaw> for Law {
    fn from(law: WrittenLaw) -> Self {
        match law {
            WrittenLaw::NeoHookean(Shear { shear_modulus }) => Self::NeoHookean {
                shear: shear_modulus,
            },
            WrittenLaw::MooneyRivlin(MooneyRivlin { c10, c01 }) => Self::MooneyRivlin { c10, c01 },
            WrittenLaw::Yeoh(Yeoh { c10, c20, c30 }) => Self::Yeoh {
                factors: [c10, c20, c30],
            },
            WrittenLaw::Gent(Gent {
                shear_modulus,
                limit,
            }) => Self::Gent {
                shear: shear_modulus,
                limit,
            },
            WrittenLaw::Ogden(terms) => Self::Ogden {
                terms: terms
                    .iter()
                    .map(|term| [term.modulus, term.exponent])
                    .collect(),
            },
        }
    }
}

/// Most that the relaxing parts may take of the sudden stress.
pub(crate) const MOST_RELAXED: f64 = 0.9;

impl Material {
    /// Reads a law file; `file` is its name for messages, and the source of the law.
    ///
    /// # Errors
    /// The first mistake, at its place.
    ///
    /// # Example
    /// ```
    /// use taxel_material::Material;
    ///
    /// let text = "schema = 1\nname = \"pour 7\"\nlaw = { neo_hookean = { shear_modulus = \"17 kPa\" } }\n";
    /// let pour = Material::parse("pour.toml", text)?;
    /// assert_eq!(pour.law.youngs_modulus(), 51e3);
    /// # Ok::<(), taxel_ground::InputError>(())
    /// ```
    pub fn parse(file: &str, text: &str) -> Result<Self, InputError> {
        let read: LawFile = toml_input::parse(file, text)?;
        let wrong = |path: &[&str], message: String, help: &str| {
            Err(toml_input::at_key(file, text, path, &message, help))
        };
        if read.schema != 1 {
            let message = format!("schema {} is not known", read.schema);
            return wrong(&["schema"], message, "write schema = 1");
        }
        let law = Law::from(read.law);
        let shear = law.shear_modulus();
        if !(shear > 0.0 && shear.is_finite()) {
            let message = format!("its shear modulus is {shear:.4} Pa and must be greater than 0");
            return wrong(&["law"], message, "look at the signs");
        }
        if let Law::Ogden { terms } = &law
            && terms.iter().any(|[_, exponent]| *exponent == 0.0)
        {
            let help = "take the term out: it carries nothing";
            return wrong(&["law", "ogden"], "an exponent is 0".into(), help);
        }
        let interval = read
            .uncertainty
            .shear_modulus
            .map(|ends| ends.map(|end| end.0));
        if let Some([low, high]) = interval
            && !(low <= shear && shear <= high)
        {
            let message = format!("the shear modulus of the law, {shear} Pa, is not within it");
            let help = "write [lowest, highest] of the shear modulus of this law";
            return wrong(&["uncertainty", "shear_modulus"], message, help);
        }
        if let Some([low, high]) = read.valid.stretch
            && !(0.0 < low && low <= 1.0 && 1.0 <= high && high.is_finite())
        {
            let message = format!("[{low}, {high}] is no range of stretches about 1");
            return wrong(&["valid", "stretch"], message, "such as [1.0, 2.0]");
        }
        let relaxed: f64 = read.relaxation.terms.iter().map(|one| one.fraction).sum();
        if relaxed > MOST_RELAXED {
            let message =
                format!("the fractions sum up to {relaxed}; at most {MOST_RELAXED} may relax");
            let help = "give the fractions of the sudden stress";
            return wrong(&["relaxation", "terms"], message, help);
        }
        Ok(Self {
            name: read.name,
            law,
            interval,
            basis: read.uncertainty.basis,
            stretch: read.valid.stretch,
            modes: read.valid.modes,
            source: if read.source.is_empty() {
                file.to_owned()
            } else {
                read.source
            },
            note: read.note,
            relaxation: read.relaxation.terms,
            tests: read.made.tests,
        })
    }

    /// The law file, with the stresses at 40 % uniaxial compression by the shares of the second
    /// invariant that fit as well, if there are some.
    pub fn toml(&self, shares: Option<[f64; 2]>) -> String {
        let stresses = |[low, high]: [f64; 2]| format!("[\"{low} Pa\", \"{high} Pa\"]");
        let mut text = format!(
            "schema = 1\nname = {}\nlaw = {}\ncompressibility = \"incompressible\"\n",
            shown::toml(&self.name),
            self.law.toml()
        );
        for (key, value) in [("source", &self.source), ("note", &self.note)] {
            if !value.is_empty() {
                let _ = writeln!(text, "{key} = {}", shown::toml(value));
            }
        }
        text.push_str("\n[valid]\n");
        if let Some([low, high]) = self.stretch {
            let _ = writeln!(text, "stretch = [{low:?}, {high:?}]");
        }
        let modes: Vec<_> = self.modes.iter().map(|mode| mode.name()).collect();
        let _ = writeln!(text, "modes = {modes:?}");
        if let Some(interval) = self.interval {
            let basis = shown::toml(&self.basis);
            let interval = stresses(interval);
            let _ = writeln!(
                text,
                "\n[uncertainty]\nbasis = {basis}\nshear_modulus = {interval}"
            );
            if let Some(shares) = shares {
                let _ = writeln!(text, "i2_share = {{ uniaxial_0_6 = {} }}", stresses(shares));
            }
        }
        if !self.relaxation.is_empty() {
            let _ = writeln!(text, "\n[relaxation]\nterms = {}", self.relaxation_toml());
        }
        if !self.tests.is_empty() {
            text.push_str("\n[made]\ntests = [\n");
            for test in &self.tests {
                let _ = write!(
                    text,
                    "    {{ file = {}, sha256 = \"{}\"",
                    shown::toml(&test.file),
                    test.sha256
                );
                if let Some(mode) = test.mode {
                    let _ = write!(text, ", mode = \"{}\"", mode.name());
                }
                if let Some(points) = test.points {
                    let _ = write!(text, ", points = {points}");
                }
                if let Some(slack) = test.slack {
                    let _ = write!(text, ", slack = {slack:?}");
                }
                if let Some(weights) = &test.weights {
                    let _ = write!(text, ", weights = {}", shown::toml(weights));
                }
                text.push_str(" },\n");
            }
            text.push_str("]\n");
        }
        text
    }

    /// The terms that relax, in the words of files.
    pub(crate) fn relaxation_toml(&self) -> String {
        let term = |Relaxation { fraction, time }: &Relaxation| {
            format!("{{ fraction = {fraction:?}, time = \"{time} s\" }}")
        };
        let terms: Vec<_> = self.relaxation.iter().map(term).collect();
        format!("[{}]", terms.join(", "))
    }

    /// Logarithms of the modulus over that of the law at the median and, as a standard deviation, the width of
    /// the distribution that has the ends of the interval as its 95 %; none without an interval.
    pub fn scatter(&self) -> Option<[f64; 2]> {
        let [low, high] = self.interval?.map(f64::ln);
        let median = f64::midpoint(low, high) - self.law.shear_modulus().ln();
        Some([median, (high - low) / (2.0 * NORMAL_95)])
    }

    /// What is outside of the tests at the least and the greatest stretch of a load, where these are known;
    /// `pressed` if it is one that only a test of compression has.
    pub fn beyond(&self, stretch: Option<[f64; 2]>, pressed: bool) -> Option<String> {
        if pressed && !self.modes.contains(&Tested::Compression) {
            let modes: Vec<_> = self.modes.iter().map(|mode| mode.name()).collect();
            let far = stretch.map_or_else(
                || ", how far is not computed".into(),
                |[low, _]| format!(" to a stretch of {low:.2}"),
            );
            let tested = if modes.is_empty() {
                "its source does not say how the law was tested".to_owned()
            } else {
                format!("the law was tested in {} only", modes.join(", "))
            };
            return Some(format!("the material is pressed{far}; {tested}"));
        }
        let ([low, high], [least, most]) = (stretch?, self.stretch?);
        (low < least || high > most).then(|| {
            format!("stretches of {low:.2} to {high:.2}; the law was tested from {least} to {most}")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "schema = 1\nname = \"pour 7\"\nlaw = { gent = { shear_modulus = \"191.33 kPa\", limit = 6.9465 } }\n\
        [valid]\nstretch = [1.0, 2.0]\nmodes = [\"uniaxial\"]\n\
        [uncertainty]\nbasis = \"one specimen\"\nshear_modulus = [\"179.1 kPa\", \"203.8 kPa\"]\n\
        [relaxation]\nterms = [{ fraction = 0.08, time = \"0.4 s\" }]\n\
        [made]\ntests = [{ file = \"a.csv\", sha256 = \"00\", mode = \"uniaxial\", points = 42, slack = 0.0134 }]\n";

    #[test]
    fn a_law_file_that_is_written_is_read_as_it_was() {
        let read = Material::parse("pour.toml", TEXT).unwrap();
        assert_eq!(read.source, "pour.toml");
        let again = Material::parse("pour.toml", &read.toml(Some([-600e3, -463e3]))).unwrap();
        assert_eq!(again, read);
        for law in [
            "neo_hookean 17 kPa",
            "mooney_rivlin 1 2 kPa",
            "yeoh 3 -0.1 0.01 kPa",
            "ogden 1 2 -3 -4 kPa",
        ] {
            let law = Law::parse(law).unwrap();
            let material = Material {
                law: law.clone(),
                interval: None,
                ..read.clone()
            };
            let again = Material::parse("pour.toml", &material.toml(None)).unwrap();
            assert_eq!(again.law, law);
        }
    }

    #[test]
    fn mistakes_of_a_law_file_are_marked() {
        for (from, to, key) in [
            ("schema = 1", "schema = 2", "schema"),
            (
                "\"179.1 kPa\"",
                "\"199.1 kPa\"",
                "uncertainty.shear_modulus",
            ),
            ("[1.0, 2.0]", "[1.5, 2.0]", "valid.stretch"),
            ("[\"uniaxial\"]", "[\"bulge\"]", "valid.modes.0"),
            (
                "0.08, time = \"0.4 s\"",
                "0.95, time = \"0.4 s\"",
                "relaxation.terms",
            ),
            (
                "gent = { shear_modulus",
                "gemt = { shear_modulus",
                "law.gemt",
            ),
            ("limit = 6.9465", "limit = -1", "law.gent.limit"),
        ] {
            assert!(TEXT.contains(from), "{from}");
            let error = Material::parse("pour.toml", &TEXT.replace(from, to)).unwrap_err();
            assert_eq!(error.key, key, "{error}");
        }
    }
}
