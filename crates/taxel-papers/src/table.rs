//! Table of one paper: the printed statements, their kind and their verdict.

use std::collections::BTreeMap;

use serde::Deserialize;

/// Printed statements of one paper and results of long runs, from `papers/pN.toml`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// Title of the paper.
    pub title: String,
    /// Who wrote it, and where it stands, as far as known.
    #[serde(default)]
    pub source: String,
    /// Its digital object identifier; empty if none is known.
    #[serde(default)]
    pub doi: String,
    /// Statements in the order of the report.
    #[serde(rename = "row")]
    pub rows: Vec<Row>,
    /// Results of runs that are too long to repeat for each report.
    #[serde(default, rename = "run")]
    pub runs: Vec<Run>,
}

/// One printed statement.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// Name of the row in this table.
    pub id: String,
    /// Place in the paper, such as `Eq. 7` or `Table 1`.
    pub place: String,
    /// Quantity or statement, in words.
    pub what: String,
    /// Printed value with its digits and unit, or the printed words.
    pub printed: String,
    /// Origin of our value.
    pub kind: Kind,
    /// Verdict. The report derives it from the values; a test compares the two.
    pub verdict: Verdict,
    /// Of a predicted number: how far ours may be from the printed one, in percent.
    #[serde(default)]
    pub within_percent: f64,
    /// The reason, the other printed number, the assumption. `{name:.2}` stands for a value
    /// that is computed with ours, `{run.name}` for one of a long run.
    #[serde(default)]
    pub words: String,
    /// Function that computes ours.
    #[serde(default)]
    pub function: String,
    /// Key of the sensor file that holds ours.
    #[serde(default)]
    pub key: String,
    /// Test that repeats it.
    #[serde(default)]
    pub test: String,
    /// Remark for the page in `docs/papers` alone.
    #[serde(default)]
    pub remark: String,
}

/// Origin of our value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// A model of ours.
    Computed,
    /// A model with a constant that was chosen on this number.
    Fitted,
    /// One number restated: what goes in comes out.
    Identity,
    /// The printed number itself, taken over by the shipped sensor file. It agrees by
    /// construction and is counted apart.
    Input,
    /// Arithmetic on other printed numbers only.
    Arithmetic,
    /// There is nothing to compute.
    None,
}

impl Kind {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Computed => "computed",
            Self::Fitted => "fitted",
            Self::Identity => "identity",
            Self::Input => "input",
            Self::Arithmetic => "arithmetic",
            Self::None => "–",
        }
    }
}

/// Result of the comparison of a printed statement with ours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// A measured number that follows from the drawing and tabulated data of materials: ours
    /// is within the percentage of the row, and the interval of the choices that are not
    /// printed has the printed number in it.
    Predicted,
    /// It has the right mechanism and size for a value of a named input that is not printed,
    /// inside its usual range.
    Follows,
    /// A model of ours agrees with what is printed, within its digits.
    Reproduced,
    /// The printed number itself, typed into a sensor file, or one number restated.
    Input,
    /// A constant of the model was chosen on this number.
    Fitted,
    /// It follows from other printed numbers without any model, within their digits.
    Arithmetic,
    /// It contradicts another printed number, or a law, by more than their digits.
    Contradicts,
    /// The printed data do not determine it.
    NotDetermined,
    /// Ours differs and no reason is known: a mistake, theirs or ours.
    Unexplained,
}

impl Verdict {
    /// All verdicts, as the report counts them.
    pub const ALL: [Self; 9] = [
        Self::Predicted,
        Self::Follows,
        Self::Reproduced,
        Self::Input,
        Self::Fitted,
        Self::Arithmetic,
        Self::Contradicts,
        Self::NotDetermined,
        Self::Unexplained,
    ];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Predicted => "predicted from the drawing",
            Self::Follows => "follows for a named input that is not printed",
            Self::Reproduced => "reproduced within the printed digits",
            Self::Input => "an input",
            Self::Fitted => "fitted",
            Self::Arithmetic => "arithmetic on other printed numbers",
            Self::Contradicts => "contradicts another printed number or a law",
            Self::NotDetermined => "not determined by what is printed",
            Self::Unexplained => "not reproduced (unexplained)",
        }
    }

    /// A number of statements with this verdict, in words.
    pub fn counted(self, count: usize) -> String {
        let one = count == 1;
        let words = match self {
            Self::Predicted if one => "measured number predicted from the drawing",
            Self::Predicted => "measured numbers predicted from the drawing",
            Self::Follows if !one => "follow for a named input that is not printed",
            Self::Input if one => "input",
            Self::Input => "inputs",
            Self::Contradicts if !one => "contradict another printed number or a law",
            _ => self.name(),
        };
        format!("{count} {words}")
    }

    /// As a key, the same in the tables and in the report.
    pub fn key(self) -> &'static str {
        match self {
            Self::Predicted => "predicted",
            Self::Follows => "follows",
            Self::Reproduced => "reproduced",
            Self::Input => "input",
            Self::Fitted => "fitted",
            Self::Arithmetic => "arithmetic",
            Self::Contradicts => "contradicts",
            Self::NotDetermined => "not_determined",
            Self::Unexplained => "unexplained",
        }
    }
}

/// Result of a long run.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// Name of the run in this table.
    pub id: String,
    /// Command that repeats it.
    pub command: String,
    /// Test that repeats part of it.
    pub test: String,
    /// Single values by name.
    #[serde(default)]
    pub values: BTreeMap<String, f64>,
    /// Names of the columns of `rows`.
    #[serde(default)]
    pub columns: Vec<String>,
    /// Values in rows.
    #[serde(default)]
    pub rows: Vec<Vec<f64>>,
}

impl Table {
    /// Reads the text of a table.
    ///
    /// # Errors
    /// The message of the TOML parser, with its place.
    pub fn parse(text: &str) -> Result<Self, String> {
        toml::from_str(text).map_err(|error| error.to_string())
    }

    /// The row `id`.
    pub fn row(&self, id: &str) -> Option<&Row> {
        self.rows.iter().find(|row| row.id == id)
    }

    /// The run `id`.
    pub fn run(&self, id: &str) -> Option<&Run> {
        self.runs.iter().find(|run| run.id == id)
    }

    /// Printed number of the row `id` times 10 to `power`: in its printed unit for 0, in SI
    /// for the power of the unit's prefix. Not a number if there is none.
    ///
    /// ```
    /// use taxel_papers::Paper;
    /// let table = Paper::P4.table();
    /// assert_eq!(table.number("rest_voltage", 0), 0.505);
    /// assert_eq!(table.number("c10", 3), 75.5e3);
    /// ```
    pub fn number(&self, id: &str, power: i32) -> f64 {
        let printed = self.row(id).and_then(|row| Printed::parse(&row.printed));
        printed.map_or(f64::NAN, |printed| printed.times_ten_to(power))
    }
}

/// A printed number with its precision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Printed<'a> {
    pub(crate) value: f64,
    /// Half a unit of the last printed digit.
    pub(crate) half: f64,
    mantissa: &'a str,
    exponent: i32,
}

impl<'a> Printed<'a> {
    /// Reads the number at the start of a text such as `"172 fF"`, `"~1.2e-3"`.
    pub(crate) fn parse(text: &'a str) -> Option<Self> {
        let text = text.trim_start_matches(['~', '<', '>', '+', ' ']).trim();
        let end = text
            .char_indices()
            .find(|(at, c)| {
                let exponent = matches!(c, 'e' | 'E')
                    && text[at + 1..]
                        .trim_start_matches(['-', '+'])
                        .starts_with(|next: char| next.is_ascii_digit());
                let sign_of_exponent =
                    matches!(c, '-' | '+') && (*at == 0 || text[..*at].ends_with(['e', 'E']));
                !(c.is_ascii_digit() || matches!(c, '.') || exponent || sign_of_exponent)
            })
            .map_or(text.len(), |(at, _)| at);
        let number = &text[..end];
        let value: f64 = number.parse().ok()?;
        let (mantissa, exponent) = number.split_once(['e', 'E']).unwrap_or((number, "0"));
        let decimals = mantissa.split_once('.').map_or("", |(_, part)| part);
        let exponent: i32 = exponent.parse().ok()?;
        Some(Self {
            value,
            half: 0.5 * 10.0_f64.powi(exponent - i32::try_from(decimals.len()).ok()?),
            mantissa,
            exponent,
        })
    }

    /// True if `ours` rounds to the printed digits, or is cut off to them; a value just between two
    /// counts for both.
    pub(crate) fn agrees(&self, ours: f64) -> bool {
        let cut_off = ours.abs() - self.value.abs();
        let rounded = (ours - self.value).abs() <= self.half * (1.0 + 1e-9);
        rounded || (ours * self.value > 0.0 && (0.0..2.0 * self.half).contains(&cut_off))
    }

    /// The number times 10 to `power`, rounded once: `4.63 um` is the same number as 4.63e-6.
    fn times_ten_to(&self, power: i32) -> f64 {
        let text = format!("{}e{}", self.mantissa, self.exponent + power);
        text.parse().unwrap_or(f64::NAN)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn printed_digits_decide() {
        let printed = |text| Printed::parse(text).unwrap();
        let close = printed("172 fF");
        assert_eq!((close.value, close.half), (172.0, 0.5));
        assert!(printed("0.505 V").agrees(0.50459) && !printed("0.505 V").agrees(0.5044));
        // Rounded or cut off.
        assert!(printed("0.505 V").agrees(0.50599) && !printed("0.505 V").agrees(0.5061));
        assert!(printed("-38.2 %").agrees(-38.29) && !printed("-38.2 %").agrees(-38.31));
        assert!(!printed("-38.2 %").agrees(38.2));
        assert!(printed("~45 %").agrees(44.95));
        assert_eq!(printed("8.67e3 Hz").half, 5.0);
        assert_eq!(printed("1.2e-3").value, 1.2e-3);
        assert_eq!((printed("5e").value, printed("5e").half), (5.0, 0.5));
        assert_eq!(Printed::parse("linear"), None);
    }

    #[test]
    fn a_prefix_rounds_once() {
        assert_eq!(Printed::parse("4.63 um").unwrap().times_ten_to(-6), 4.63e-6);
        assert_eq!(Printed::parse("1.2e-3").unwrap().times_ten_to(3), 1.2);
    }
}
