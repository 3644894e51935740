//! Our values beside the rows of a table, and the verdict that follows from both.

use std::collections::BTreeMap;

use taxel::figure::Figure;

use crate::paper::Paper;
use crate::table::{Kind, Printed, Row, Run, Table, Verdict};

/// One printed statement beside ours.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Row of the table.
    pub row: &'static Row,
    /// Ours in the printed unit; `None` where there is no number.
    pub ours: Option<f64>,
    /// (ours - printed)/printed; `None` without two numbers or where zero is printed.
    pub difference: Option<f64>,
    /// Least and greatest value of ours by the choices that are not printed, in the printed
    /// unit.
    pub interval: Option<[f64; 2]>,
    /// Verdict, derived from the values.
    pub verdict: Verdict,
    /// The words of the row with their values; may be empty.
    pub note: String,
}

/// A figure of the paper, drawn from our model.
#[derive(Debug, Clone, PartialEq)]
pub struct PaperFigure {
    /// Such as `Figure 5`.
    pub place: String,
    /// The figure; its caption says what is assumed.
    pub figure: Figure,
    /// Pictures of a field below it, each an SVG document with its title.
    pub pictures: Vec<(String, String)>,
}

/// All statements of one paper beside ours.
#[derive(Debug, Clone, PartialEq)]
pub struct Ledger {
    /// The paper.
    pub paper: Paper,
    /// Statements in the order of the table.
    pub entries: Vec<Entry>,
    /// Figures.
    pub figures: Vec<PaperFigure>,
}

impl Ledger {
    /// The ledger of `paper` with the values of `ours`.
    pub(crate) fn new(paper: Paper, ours: Ours) -> Self {
        let table = ours.table;
        let entries = table.rows.iter().map(|row| {
            let answer = ours.answers.get(&row.id);
            entry(row, answer.unwrap_or(&Answer::default()), &table.runs)
        });
        Self {
            paper,
            entries: entries.collect(),
            figures: ours.figures,
        }
    }

    /// The entry of the row `id`.
    pub fn entry(&self, id: &str) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.row.id == id)
    }

    /// Number of entries with each verdict, in the order of [`Verdict::ALL`].
    pub fn counts(&self) -> [usize; Verdict::ALL.len()] {
        Verdict::ALL.map(|verdict| {
            let entries = self.entries.iter();
            entries.filter(|entry| entry.verdict == verdict).count()
        })
    }
}

/// Values of ours for the rows of one table, by their id.
#[derive(Debug)]
pub(crate) struct Ours {
    pub(crate) table: &'static Table,
    answers: BTreeMap<String, Answer>,
    figures: Vec<PaperFigure>,
}

/// Our value for one row, and the values that its words name.
#[derive(Debug, Clone, Default)]
pub(crate) struct Answer {
    number: Option<f64>,
    holds: Option<bool>,
    interval: Option<[f64; 2]>,
    /// Least and greatest value by the digits of the printed numbers that ours follows from.
    digits: Option<[f64; 2]>,
    words: Vec<(&'static str, f64)>,
}

impl Answer {
    /// `value` stands for `{name}` in the words of the row.
    pub(crate) fn with(&mut self, name: &'static str, value: f64) -> &mut Self {
        self.words.push((name, value));
        self
    }

    /// Least and greatest value by the choices that are not printed; `{least}` and
    /// `{greatest}` in the words of the row.
    pub(crate) fn between(&mut self, interval: [f64; 2]) -> &mut Self {
        self.interval = Some(interval);
        self.with("least", interval[0])
            .with("greatest", interval[1])
    }
}

impl Ours {
    pub(crate) fn new(table: &'static Table) -> Self {
        Self {
            table,
            answers: BTreeMap::new(),
            figures: Vec::new(),
        }
    }

    /// Ours of a printed number, in the printed unit.
    pub(crate) fn number(&mut self, id: &str, ours: f64) -> &mut Answer {
        let answer = self.words(id);
        answer.number = Some(ours);
        answer
    }

    /// Ours of a printed number that follows from the printed numbers of other rows, in their
    /// units: known to their digits alone.
    pub(crate) fn derived<const N: usize>(
        &mut self,
        id: &str,
        rows: [&str; N],
        of: impl Fn([f64; N]) -> f64,
    ) -> &mut Answer {
        let given = rows.map(|row| {
            self.table
                .row(row)
                .and_then(|row| Printed::parse(&row.printed))
        });
        let at = |corner: usize| {
            of(std::array::from_fn(|place| {
                given[place].map_or(f64::NAN, |printed| {
                    match corner / 3_usize.pow(place as u32) % 3 {
                        0 => printed.value,
                        1 => printed.value - printed.half,
                        _ => printed.value + printed.half,
                    }
                })
            }))
        };
        let corners = (0..3_usize.pow(N as u32)).map(at);
        let ends = corners.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| {
            [low.min(at), high.max(at)]
        });
        let answer = self.number(id, at(0));
        answer.digits = Some(ends);
        answer.with("from", ends[0]).with("to", ends[1])
    }

    /// Result of the check of an equation or a statement in words.
    pub(crate) fn holds(&mut self, id: &str, holds: bool) -> &mut Answer {
        let answer = self.words(id);
        answer.holds = Some(holds);
        answer
    }

    /// A row for which there is nothing to compute but values of its words.
    pub(crate) fn words(&mut self, id: &str) -> &mut Answer {
        self.answers.entry(id.to_owned()).or_default()
    }

    /// A figure, drawn from our model.
    pub(crate) fn figure(&mut self, place: &str, figure: Figure) {
        self.figure_with(place, figure, Vec::new());
    }

    /// The same with pictures of a field.
    pub(crate) fn figure_with(
        &mut self,
        place: &str,
        figure: Figure,
        pictures: Vec<(String, String)>,
    ) {
        self.figures.push(PaperFigure {
            place: place.to_owned(),
            figure,
            pictures,
        });
    }

    /// Printed number of the row `id` times 10 to `power`, as [`Table::number`].
    pub(crate) fn printed(&self, id: &str, power: i32) -> f64 {
        self.table.number(id, power)
    }
}

fn entry(row: &'static Row, answer: &Answer, runs: &[Run]) -> Entry {
    let printed = Printed::parse(&row.printed);
    let agrees = |ours: f64| {
        printed.is_some_and(|printed| {
            let overlaps = |[least, greatest]: [f64; 2]| {
                least <= printed.value + printed.half && printed.value - printed.half <= greatest
            };
            printed.agrees(ours) || answer.digits.is_some_and(overlaps)
        })
    };
    let holds = answer.number.map(agrees).or(answer.holds);
    let inside = printed
        .zip(answer.interval)
        .is_some_and(|(printed, [least, greatest])| {
            least <= printed.value && printed.value <= greatest
        });
    let difference = answer
        .number
        .zip(printed.filter(|printed| printed.value != 0.0))
        .map(|(ours, printed)| ours / printed.value - 1.0);
    // A predicted number is near and its interval has the printed one; what follows for a
    // named input has it in the interval of the input; a statement in words is checked.
    let holds = match row.verdict {
        Verdict::Predicted => {
            let near = |off: f64| off.abs() <= 0.01 * row.within_percent;
            inside && difference.is_some_and(near)
        }
        Verdict::Follows => inside || answer.holds == Some(true),
        _ => holds == Some(true),
    };
    Entry {
        row,
        ours: answer.number,
        difference,
        interval: answer.interval,
        verdict: verdict(row, holds),
        note: fill(&row.words, |name| value(name, answer, runs)),
    }
}

/// A statement that holds is called by the kind of ours. For one that does not, the row must name a
/// reason; a reason counts only there.
fn verdict(row: &Row, holds: bool) -> Verdict {
    match (row.verdict, row.kind) {
        (Verdict::Predicted | Verdict::Follows, _) if holds => row.verdict,
        (_, Kind::Arithmetic) if holds => Verdict::Arithmetic,
        (_, Kind::Input | Kind::Identity) if holds => Verdict::Input,
        (_, Kind::Fitted) if holds => Verdict::Fitted,
        _ if holds => Verdict::Reproduced,
        (reason @ (Verdict::Contradicts | Verdict::NotDetermined), _) => reason,
        _ => Verdict::Unexplained,
    }
}

/// A value that words name: computed with ours, or `run.name` of a long run.
fn value(name: &str, answer: &Answer, runs: &[Run]) -> Option<f64> {
    if let Some((run, name)) = name.split_once('.') {
        let run = runs.iter().find(|candidate| candidate.id == run)?;
        return run.values.get(name).copied();
    }
    let known = answer.words.iter().find(|(known, _)| *known == name);
    known.map(|(_, value)| *value)
}

/// `words` with its values in the place of `{name}`, `{name:.2}` and `{name:.0e}`. What names
/// no value stays as it is.
fn fill(words: &str, value: impl Fn(&str) -> Option<f64>) -> String {
    let mut text = String::new();
    let mut rest = words;
    while let Some((before, after)) = rest.split_once('{') {
        text += before;
        let filled = after.split_once('}').and_then(|(inside, behind)| {
            let (name, form) = inside.split_once(':').unwrap_or((inside, ""));
            Some((formatted(value(name)?, form), behind))
        });
        if let Some((number, behind)) = filled {
            text += &number;
            rest = behind;
        } else {
            text.push('{');
            rest = after;
        }
    }
    text + rest
}

/// A number with the digits that `form` asks for: `.2`, `.0e`, or nothing.
fn formatted(value: f64, form: &str) -> String {
    let (digits, exponent) = match form.strip_suffix('e') {
        Some(digits) => (digits, true),
        None => (form, false),
    };
    let digits = digits
        .strip_prefix('.')
        .and_then(|digits| digits.parse().ok());
    match (digits, exponent) {
        (Some(digits), true) => format!("{value:.digits$e}"),
        (Some(digits), false) => format!("{value:.digits$}"),
        (None, _) => value.to_string(),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn words_take_their_values() {
        let value = |name: &str| match name {
            "gap" => Some(4.7564),
            "error" => Some(0.00083),
            _ => None,
        };
        assert_eq!(
            fill(
                "{gap:.2} um, {error:.0e}, {gap}, mount = { cylinder }, {other}",
                value
            ),
            "4.76 um, 8e-4, 4.7564, mount = { cylinder }, {other}"
        );
    }

    /// Near is not enough without the interval, nor the interval without being near.
    #[test]
    fn a_prediction_is_near_and_has_the_number_in_its_interval() {
        let text = "id = 'a'\nplace = ''\nwhat = ''\nprinted = '203 fF'\nkind = 'computed'\n\
                    verdict = 'predicted'\nwithin_percent = 1.0";
        let row: &'static Row = Box::leak(Box::new(toml::from_str(text).unwrap()));
        let verdict = |ours: f64, interval: [f64; 2]| {
            let mut answer = Answer {
                number: Some(ours),
                ..Answer::default()
            };
            answer.between(interval);
            entry(row, &answer, &[]).verdict
        };
        assert_eq!(verdict(204.0, [199.6, 213.6]), Verdict::Predicted);
        assert_eq!(verdict(206.0, [199.6, 213.6]), Verdict::Unexplained);
        assert_eq!(verdict(204.0, [203.5, 213.6]), Verdict::Unexplained);
    }

    #[test]
    fn a_reason_counts_only_where_ours_differs() {
        let row = |kind: &str, verdict: &str| -> Row {
            let text = format!(
                "id = 'a'\nplace = ''\nwhat = ''\nprinted = '1.0'\nkind = '{kind}'\nverdict = '{verdict}'"
            );
            toml::from_str(&text).unwrap()
        };
        for (kind, stated, holds, expected) in [
            ("computed", "contradicts", true, Verdict::Reproduced),
            ("computed", "contradicts", false, Verdict::Contradicts),
            ("computed", "reproduced", false, Verdict::Unexplained),
            ("arithmetic", "arithmetic", true, Verdict::Arithmetic),
            ("arithmetic", "contradicts", true, Verdict::Arithmetic),
            ("input", "reproduced", true, Verdict::Input),
            ("identity", "input", true, Verdict::Input),
            ("fitted", "reproduced", true, Verdict::Fitted),
            ("input", "input", false, Verdict::Unexplained),
            ("none", "not_determined", false, Verdict::NotDetermined),
            ("computed", "predicted", true, Verdict::Predicted),
            ("computed", "predicted", false, Verdict::Unexplained),
            ("computed", "follows", false, Verdict::Unexplained),
        ] {
            assert_eq!(
                verdict(&row(kind, stated), holds),
                expected,
                "{kind} {stated}"
            );
        }
    }
}
