//! Every published number of the four papers beside ours: `taxel reproduce`.
//!
//! One file per paper fills a [`Ledger`]. An entry states what is printed; our
//! value is computed when the report is made, and the verdict follows from
//! both. What cannot be reproduced says why.

mod p1;
mod p2;
mod p3;
mod p4;
mod report;

use crate::figure::Figure;

pub use report::{html, json, text};

/// One of the four papers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Paper {
    /// In-plane capacitive sensor.
    P1,
    /// Three-axis capacitive array.
    P2,
    /// Piezoelectric array.
    P3,
    /// Liquid-metal array.
    P4,
}

impl Paper {
    /// All papers.
    pub const ALL: [Self; 4] = [Self::P1, Self::P2, Self::P3, Self::P4];

    /// Name, such as `P2`.
    pub fn name(self) -> &'static str {
        match self {
            Self::P1 => "P1",
            Self::P2 => "P2",
            Self::P3 => "P3",
            Self::P4 => "P4",
        }
    }

    /// Title of the paper.
    pub fn title(self) -> &'static str {
        match self {
            Self::P1 => "Predicting the Response of an All-Elastomer In-Plane MEMS Tactile Sensor",
            Self::P2 => {
                "Real-time measurement of the three-axis contact force distribution using a flexible capacitive polymer tactile sensor"
            }
            Self::P3 => {
                "Development and characterization of silicone embedded distributed piezoelectric sensors for contact detection"
            }
            Self::P4 => "Soft Tactile Sensor Arrays for Micromanipulation",
        }
    }

    /// The ledger of the paper.
    pub fn ledger(self) -> Ledger {
        let mut ledger = Ledger::new(self);
        match self {
            Self::P1 => p1::fill(&mut ledger),
            Self::P2 => p2::fill(&mut ledger),
            Self::P3 => p3::fill(&mut ledger),
            Self::P4 => p4::fill(&mut ledger),
        }
        ledger
    }
}

/// What became of a printed statement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Ours rounds to what is printed.
    Reproduced,
    /// It follows from other printed numbers, without any model.
    Follows,
    /// It contradicts another printed number.
    Contradicts,
    /// What is printed does not determine it.
    NotDetermined,
    /// It needs a field solution.
    AwaitsFieldSolver,
    /// Ours differs and no reason is known: a mistake, theirs or ours.
    Unexplained,
}

impl Verdict {
    /// All verdicts, as the report counts them.
    pub const ALL: [Self; 6] = [
        Self::Reproduced,
        Self::Follows,
        Self::Contradicts,
        Self::NotDetermined,
        Self::AwaitsFieldSolver,
        Self::Unexplained,
    ];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Reproduced => "reproduced within the printed digits",
            Self::Follows => "follows from other printed numbers",
            Self::Contradicts => "contradicts another printed number",
            Self::NotDetermined => "not determined by what is printed",
            Self::AwaitsFieldSolver => "awaits the field solver",
            Self::Unexplained => "unexplained",
        }
    }

    /// As a key.
    pub fn key(self) -> &'static str {
        match self {
            Self::Reproduced => "reproduced",
            Self::Follows => "follows",
            Self::Contradicts => "contradicts",
            Self::NotDetermined => "not_determined",
            Self::AwaitsFieldSolver => "awaits_field_solver",
            Self::Unexplained => "unexplained",
        }
    }
}

/// What our value rests on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Basis {
    /// Our model.
    Ours,
    /// The shipped sensor file took the printed number over: it agrees by
    /// construction, and is counted apart.
    Input,
    /// Arithmetic on other printed numbers only.
    Printed,
}

/// Why ours may differ from what is printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reason {
    Contradicts,
    NotDetermined,
    AwaitsFieldSolver,
}

/// One printed statement beside ours.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Where it stands, such as `Eq. 7` or `Table 1`.
    pub place: String,
    /// What it says, in words.
    pub what: String,
    /// What is printed, with its unit, as printed.
    pub printed: String,
    /// Ours in the same unit; `None` where there is no number.
    pub ours: Option<f64>,
    /// (ours - printed)/printed; `None` without two numbers or where zero is
    /// printed.
    pub difference: Option<f64>,
    /// What became of it.
    pub verdict: Verdict,
    /// Whether ours is an input taken over from the paper.
    pub input: bool,
    /// The reason, the other printed number, the assumption; may be empty.
    pub note: String,
}

/// A figure of the paper, drawn from our model.
#[derive(Debug, Clone, PartialEq)]
pub struct PaperFigure {
    /// Such as `Figure 5`.
    pub place: String,
    /// The figure; its caption says what is assumed.
    pub figure: Figure,
}

/// All statements of one paper.
#[derive(Debug, Clone, PartialEq)]
pub struct Ledger {
    /// The paper.
    pub paper: Paper,
    /// Statements in the order of the paper.
    pub entries: Vec<Entry>,
    /// Figures.
    pub figures: Vec<PaperFigure>,
}

impl Ledger {
    /// An empty ledger.
    pub fn new(paper: Paper) -> Self {
        Self {
            paper,
            entries: Vec::new(),
            figures: Vec::new(),
        }
    }

    /// A printed number, such as `"0.732 V"`, beside `ours` in the same unit.
    ///
    /// Ours agrees when it lies within half a unit of the last printed digit;
    /// the verdict is then [`Verdict::Reproduced`], or [`Verdict::Follows`]
    /// for arithmetic on printed numbers. Otherwise it is
    /// [`Verdict::Unexplained`] until the entry is given a reason:
    ///
    /// ```
    /// use taxel::reproduce::{Basis, Ledger, Paper, Verdict};
    /// let mut ledger = Ledger::new(Paper::P4);
    /// ledger
    ///     .number("Fig. 13", "resistance at 0.505 V", "3.67 ohm", 3.378, Basis::Printed)
    ///     .contradicts("0.505 V, V_S = 2.0 V and R_ref = 10 ohm give 3.378 ohm");
    /// assert_eq!(ledger.entries[0].verdict, Verdict::Contradicts);
    /// ```
    pub fn number(
        &mut self,
        place: &str,
        what: &str,
        printed: &str,
        ours: f64,
        basis: Basis,
    ) -> Explain<'_> {
        let number = Printed::parse(printed);
        let verdict = match (number.is_some_and(|number| number.agrees(ours)), basis) {
            (true, Basis::Ours | Basis::Input) => Verdict::Reproduced,
            (true, Basis::Printed) => Verdict::Follows,
            (false, _) => Verdict::Unexplained,
        };
        let input = basis == Basis::Input && verdict == Verdict::Reproduced;
        let difference = number
            .filter(|number| number.value != 0.0)
            .map(|number| ours / number.value - 1.0);
        let explain = self.push(place, what, printed, Some(ours), difference, verdict);
        explain.0.input = input;
        explain
    }

    /// An equation or a statement in words: `holds` is computed.
    pub fn statement(
        &mut self,
        place: &str,
        what: &str,
        printed: &str,
        holds: bool,
        basis: Basis,
    ) -> Explain<'_> {
        let verdict = match (holds, basis) {
            (true, Basis::Ours | Basis::Input) => Verdict::Reproduced,
            (true, Basis::Printed) => Verdict::Follows,
            (false, _) => Verdict::Unexplained,
        };
        self.push(place, what, printed, None, None, verdict)
    }

    /// Something printed for which there is nothing to compute.
    pub fn open(&mut self, place: &str, what: &str, printed: &str) -> Explain<'_> {
        self.push(place, what, printed, None, None, Verdict::Unexplained)
    }

    /// A figure, drawn from our model.
    pub fn figure(&mut self, place: &str, figure: Figure) {
        self.figures.push(PaperFigure {
            place: place.to_owned(),
            figure,
        });
    }

    /// How many reproduced entries are inputs taken over from the paper.
    pub fn inputs(&self) -> usize {
        self.entries.iter().filter(|entry| entry.input).count()
    }

    /// How many entries have each verdict, in the order of [`Verdict::ALL`].
    pub fn counts(&self) -> [usize; Verdict::ALL.len()] {
        Verdict::ALL.map(|verdict| {
            let entries = self.entries.iter();
            entries.filter(|entry| entry.verdict == verdict).count()
        })
    }

    fn push(
        &mut self,
        place: &str,
        what: &str,
        printed: &str,
        ours: Option<f64>,
        difference: Option<f64>,
        verdict: Verdict,
    ) -> Explain<'_> {
        let index = self.entries.len();
        self.entries.push(Entry {
            place: place.to_owned(),
            what: what.to_owned(),
            printed: printed.to_owned(),
            ours,
            difference,
            verdict,
            input: false,
            note: String::new(),
        });
        Explain(&mut self.entries[index])
    }
}

/// The entry just made, to add what is known of it.
#[derive(Debug)]
pub struct Explain<'a>(&'a mut Entry);

impl Explain<'_> {
    /// Ours differs because another printed number says otherwise: name it.
    pub fn contradicts(self, other: impl Into<String>) {
        self.because(Reason::Contradicts, other.into());
    }

    /// Ours differs, or there is none, because the paper does not print
    /// enough: name what is missing.
    pub fn not_determined(self, missing: impl Into<String>) {
        self.because(Reason::NotDetermined, missing.into());
    }

    /// It needs a solution of a field.
    pub fn awaits_field_solver(self, why: impl Into<String>) {
        self.because(Reason::AwaitsFieldSolver, why.into());
    }

    /// A remark that changes no verdict: an assumption, a source.
    pub fn note(self, note: impl Into<String>) {
        self.0.note = note.into();
    }

    /// A reason only counts where ours does not agree: what agrees needs none.
    fn because(self, reason: Reason, note: String) {
        if self.0.verdict == Verdict::Unexplained {
            self.0.verdict = match reason {
                Reason::Contradicts => Verdict::Contradicts,
                Reason::NotDetermined => Verdict::NotDetermined,
                Reason::AwaitsFieldSolver => Verdict::AwaitsFieldSolver,
            };
        }
        self.0.note = note;
    }
}

/// A printed number with its precision.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Printed {
    value: f64,
    /// Half a unit of the last printed digit.
    half: f64,
}

impl Printed {
    /// Reads the number at the start of a text such as `"172 fF"`, `"~1.2e-3"`.
    fn parse(text: &str) -> Option<Self> {
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
        let power: i32 = exponent.parse().ok()?;
        Some(Self {
            value,
            half: 0.5 * 10.0_f64.powi(power - i32::try_from(decimals.len()).ok()?),
        })
    }

    /// Whether `ours` rounds to the printed digits; a value just between two
    /// counts for both.
    fn agrees(&self, ours: f64) -> bool {
        (ours - self.value).abs() <= self.half * (1.0 + 1e-9)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Verdict::{Contradicts, Follows, NotDetermined, Reproduced, Unexplained};

    #[test]
    fn printed_digits_decide() {
        let printed = |text| Printed::parse(text).unwrap();
        assert_eq!(
            printed("172 fF"),
            Printed {
                value: 172.0,
                half: 0.5
            }
        );
        assert!(printed("0.505 V").agrees(0.50549) && !printed("0.505 V").agrees(0.5056));
        assert!(printed("-38.2 %").agrees(-38.24));
        assert!(printed("~45 %").agrees(44.95));
        assert_eq!(printed("8.67e3 Hz").half, 5.0);
        assert_eq!(printed("1.2e-3").value, 1.2e-3);
        assert_eq!(
            printed("5e"),
            Printed {
                value: 5.0,
                half: 0.5
            }
        );
        assert_eq!(Printed::parse("linear"), None);
    }

    #[test]
    fn a_reason_counts_only_where_ours_differs() {
        let mut ledger = Ledger::new(Paper::P1);
        ledger
            .number("a", "", "1.0", 1.04, Basis::Ours)
            .contradicts("x");
        ledger
            .number("b", "", "1.0", 1.06, Basis::Ours)
            .contradicts("x");
        ledger.number("c", "", "1.0", 1.06, Basis::Ours);
        ledger.statement("d", "", "", true, Basis::Printed);
        ledger.open("e", "", "").not_determined("y");
        let verdicts: Vec<_> = ledger.entries.iter().map(|entry| entry.verdict).collect();
        assert_eq!(
            verdicts,
            [Reproduced, Contradicts, Unexplained, Follows, NotDetermined]
        );
        assert_eq!(ledger.counts(), [1, 1, 1, 1, 0, 1]);
    }
}
