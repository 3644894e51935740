//! A solved load path as a table: found once by finite elements, read like a closed form.
//!
//! Between nodes lie cubics that are monotone where the nodes are: contact makes kinks that one
//! polynomial over the whole path would carry everywhere. What a table holds of one kind of device
//! stands beside that device, in [`Contents`].

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Version of the format.
const FORMAT: u32 = 2;
/// Quantities whose errors a table states.
pub const ERRORS: usize = 2;

/// What tables of one kind of device hold.
#[derive(Debug)]
pub struct Contents {
    /// Key of the element in a sensor file.
    pub device: &'static str,
    /// What rises from node to node.
    pub variable: PathVariable,
    /// Its largest value.
    pub largest: f64,
    /// The numbers of a node.
    pub numbers: &'static [(&'static str, Course)],
    /// Quantities whose errors are stated, as shares of full scale.
    pub errors: [&'static str; ERRORS],
}

/// What a load path is followed by.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PathVariable {
    /// Its name.
    pub name: &'static str,
    /// Its unit in tables for people.
    pub unit: &'static str,
    /// One of that unit in SI.
    pub scale: f64,
    /// SI unit in keys.
    pub key: &'static str,
}

/// How a number of a node goes on along the path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Course {
    /// Rising.
    Rising,
    /// Positive and falling.
    Falling,
    /// Positive.
    Positive,
    /// Anything finite.
    Any,
}

/// Observed errors, as shares of full scale: that of the whole path. They are no bounds: for contact
/// at finite strain there is none that is proven.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableErrors {
    /// Of each quantity: `force` and `change` of capacitance of an in-plane capacitor, `row_change`
    /// and `column_change` of the resistance of microchannels.
    pub of_full_scale: BTreeMap<String, f64>,
    /// Loads at which they were observed.
    pub loads: usize,
}

/// A solved state: its load and its numbers.
pub type PathState = (f64, Vec<f64>);

/// The solved load path of one drawing from rest on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PathTable {
    /// Version of this format: 2.
    pub taxel_table: u32,
    /// Key of the element that it is of.
    pub device: String,
    /// Program that made it, with its commit.
    pub program: String,
    /// All that it follows from, as `key = value`.
    pub drawing: Vec<String>,
    /// Differences at seven loads between each two nodes that were solved and not used, and from one
    /// of them to the next: a tenth above the largest, rounded up to two digits.
    pub interpolation: TableErrors,
    /// Differences of a finer mesh.
    pub mesh: TableErrors,
    /// Why the solution ended before the end of the path.
    pub ended: Option<String>,
    /// What rises from node to node ...
    #[serde(skip)]
    followed: PathVariable,
    /// ... and its name.
    variable: String,
    /// Names of the numbers of a node, SI.
    numbers: Vec<String>,
    /// The variable at the nodes, from 0 on, rising.
    nodes: Vec<f64>,
    /// The numbers at each node.
    values: Vec<Vec<f64>>,
    /// Their slopes against the variable.
    slopes: Vec<Vec<f64>>,
}

/// Why the text of a table is not that of a sensor.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WrongTable {
    /// It is none.
    #[error("it is no table of `taxel tabulate`: {0}")]
    Unreadable(String),
    /// It belongs to another kind of device.
    #[error("it belongs to another kind of device: there {there}, here {here}")]
    OtherDevice {
        /// Key of its element.
        there: String,
        /// Key of the element of this sensor.
        here: &'static str,
    },
    /// It belongs to another drawing.
    #[error("it belongs to another drawing: there {there}, here {here}")]
    OtherDrawing {
        /// First line that differs, as the table has it.
        there: String,
        /// The same of this sensor.
        here: String,
    },
}

impl TableErrors {
    /// Errors of the quantities of `contents`.
    pub fn new(contents: &Contents, shares: [f64; ERRORS], loads: usize) -> Self {
        let names = contents.errors.iter().map(|name| String::from(*name));
        Self {
            of_full_scale: names.zip(shares).collect(),
            loads,
        }
    }

    /// Error of a quantity, as a share of full scale; 0 of one that the table has not.
    pub fn of(&self, quantity: &str) -> f64 {
        self.of_full_scale.get(quantity).copied().unwrap_or(0.0)
    }

    /// The largest of all quantities.
    pub fn largest(&self) -> f64 {
        self.of_full_scale.values().copied().fold(0.0, f64::max)
    }
}

impl PathTable {
    /// The text of a table's file (JSON).
    pub fn text(&self) -> String {
        // Numbers and texts: nothing that JSON has not.
        let mut text = serde_json::to_string_pretty(self).unwrap_or_default();
        text.push('\n');
        text
    }

    /// A table through solved states; without errors yet.
    pub fn through(contents: &Contents, states: &[PathState]) -> Self {
        let (nodes, values): (Vec<f64>, Vec<_>) = states.iter().cloned().unzip();
        let none = TableErrors::new(contents, [0.0; ERRORS], 0);
        let names = contents.numbers.iter().map(|(name, _)| (*name).into());
        Self {
            taxel_table: FORMAT,
            device: contents.device.into(),
            program: String::new(),
            drawing: Vec::new(),
            interpolation: none.clone(),
            mesh: none,
            ended: None,
            followed: contents.variable,
            variable: contents.variable.name.into(),
            numbers: names.collect(),
            slopes: slopes(&nodes, &values),
            nodes,
            values,
        }
    }

    /// Reads the text of a table for a drawing, its lines.
    ///
    /// # Errors
    /// [`WrongTable`].
    pub(super) fn read(
        text: &str,
        contents: &Contents,
        here: &[String],
    ) -> Result<Self, WrongTable> {
        /// What tables of all formats have.
        #[derive(Deserialize)]
        struct Head {
            taxel_table: u32,
        }
        let unreadable = |error: serde_json::Error| WrongTable::Unreadable(error.to_string());
        let head: Head = serde_json::from_str(text).map_err(unreadable)?;
        if head.taxel_table != FORMAT {
            let message = format!(
                "format {} is not known; this program reads {FORMAT}",
                head.taxel_table
            );
            return Err(WrongTable::Unreadable(message));
        }
        let mut table: Self = serde_json::from_str(text).map_err(unreadable)?;
        table.followed = contents.variable;
        if table.device != contents.device {
            return Err(WrongTable::OtherDevice {
                there: table.device,
                here: contents.device,
            });
        }
        if !table.is_sound(contents) {
            return Err(WrongTable::Unreadable("its numbers are no curve".into()));
        }
        let none = || String::from("nothing");
        for line in 0..here.len().max(table.drawing.len()) {
            let (there, here) = (table.drawing.get(line), here.get(line));
            if there != here {
                return Err(WrongTable::OtherDrawing {
                    there: there.cloned().unwrap_or_else(none),
                    here: here.cloned().unwrap_or_else(none),
                });
            }
        }
        Ok(table)
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.nodes.len()
    }

    /// What the path is followed by.
    pub fn variable(&self) -> PathVariable {
        self.followed
    }

    /// The variable at the last node, SI.
    pub fn end(&self) -> f64 {
        self.nodes[self.nodes.len() - 1]
    }

    /// The numbers at the first node, and at the last one.
    pub fn ends(&self) -> [&[f64]; 2] {
        [&self.values[0], &self.values[self.values.len() - 1]]
    }

    /// Number `y` against number `x` at the nodes, with its slope there.
    pub(super) fn against(&self, x: usize, y: usize) -> (Vec<[f64; 2]>, Vec<f64>) {
        let points = self.values.iter().map(|node| [node[x], node[y]]);
        let slopes = self.slopes.iter().map(|node| node[y] / node[x]);
        (points.collect(), slopes.collect())
    }

    /// The `N` numbers at a value of the variable; beyond the ends on the last cubic's tangent.
    pub fn at<const N: usize>(&self, variable: f64) -> [f64; N] {
        let last = self.nodes.len() - 1;
        let end = self.nodes[last];
        if variable >= end {
            let beyond = variable - end;
            return std::array::from_fn(|k| self.values[last][k] + self.slopes[last][k] * beyond);
        }
        let node = self.nodes.partition_point(|node| *node <= variable);
        let low = node.clamp(1, last) - 1;
        let step = self.nodes[low + 1] - self.nodes[low];
        let place = (variable - self.nodes[low]) / step;
        // Hermite's cubic.
        let (left, right) = (1.0 - place, place);
        let ends = [
            left * left * (1.0 + 2.0 * right),
            right * right * (1.0 + 2.0 * left),
        ];
        let tangents = [step * right * left * left, -step * left * right * right];
        std::array::from_fn(|k| {
            ends[0] * self.values[low][k]
                + ends[1] * self.values[low + 1][k]
                + tangents[0] * self.slopes[low][k]
                + tangents[1] * self.slopes[low + 1][k]
        })
    }

    /// True of numbers that make a model.
    pub(super) fn is_sound(&self, contents: &Contents) -> bool {
        let (count, width) = (self.nodes.len(), contents.numbers.len());
        let rows = |rows: &[Vec<f64>]| {
            rows.len() == count
                && rows.iter().all(|row| row.len() == width)
                && rows.iter().flatten().all(|number| number.is_finite())
        };
        let errors = |errors: &TableErrors| {
            errors.of_full_scale.len() == ERRORS
                && contents.errors.iter().all(|name| {
                    let share = errors.of_full_scale.get(*name);
                    share.is_some_and(|share| *share >= 0.0 && share.is_finite())
                })
        };
        let follows = |(k, (_, course)): (usize, &(&str, Course))| {
            let mut pairs = self.values.windows(2).map(|pair| [pair[0][k], pair[1][k]]);
            let positive = || self.values.iter().all(|node| node[k] > 0.0);
            match course {
                Course::Rising => pairs.all(|[a, b]| a < b),
                Course::Falling => positive() && pairs.all(|[a, b]| a > b),
                Course::Positive => positive(),
                Course::Any => true,
            }
        };
        let named = self.numbers.iter().zip(contents.numbers);
        count >= 2
            && rows(&self.values)
            && rows(&self.slopes)
            && self.variable == contents.variable.name
            && self.numbers.len() == width
            && { named }.all(|(own, (name, _))| own == name)
            && self.nodes[0] == 0.0
            && self.nodes.windows(2).all(|pair| pair[0] < pair[1])
            && self.end().is_finite()
            && self.end() <= contents.largest * (1.0 + 1e-9)
            && contents.numbers.iter().enumerate().all(follows)
            && errors(&self.interpolation)
            && errors(&self.mesh)
    }
}

/// Slopes at the nodes: those of the polynomial through the five nearest, cut so that the cubics
/// are monotone where the nodes are (de Boor and Swartz 1977: at most three times the smaller
/// slope beside).
pub(super) fn slopes(nodes: &[f64], values: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let count = nodes.len();
    let width = values.first().map_or(0, Vec::len);
    let wide = count.min(5);
    let of_node = |node: usize| {
        let first = node.saturating_sub(wide / 2).min(count - wide);
        let shares = slope_shares(&nodes[first..first + wide], node - first);
        let slope_of = |k: usize| {
            let slope: f64 = shares
                .iter()
                .zip(&values[first..])
                .map(|(share, value)| share * value[k])
                .sum();
            let secant =
                |low: usize| (values[low + 1][k] - values[low][k]) / (nodes[low + 1] - nodes[low]);
            let beside = [node.checked_sub(1), (node + 1 < count).then_some(node)];
            let mut beside = beside.into_iter().flatten().map(secant);
            let first = beside.next().unwrap_or(slope);
            let second = beside.next().unwrap_or(first);
            if first * second <= 0.0 || slope * first <= 0.0 {
                return 0.0;
            }
            let most = 3.0 * first.abs().min(second.abs());
            slope.clamp(-most, most)
        };
        (0..width).map(slope_of).collect()
    };
    (0..count).map(of_node).collect()
}

/// Shares of the values at `nodes` in the slope of the polynomial through them at one of them.
fn slope_shares(nodes: &[f64], at: usize) -> Vec<f64> {
    let count = nodes.len();
    let others = |but: [usize; 2]| (0..count).filter(move |other| !but.contains(other));
    let share = |own: usize| -> f64 {
        if own == at {
            return others([own, own])
                .map(|other| 1.0 / (nodes[own] - nodes[other]))
                .sum();
        }
        let upper: f64 = others([own, at])
            .map(|other| nodes[at] - nodes[other])
            .product();
        let lower: f64 = others([own, own])
            .map(|other| nodes[own] - nodes[other])
            .product();
        upper / lower
    };
    (0..count).map(share).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A number that rises and one that falls over a variable.
    const CONTENTS: Contents = Contents {
        device: "device",
        variable: PathVariable {
            name: "variable",
            unit: "",
            scale: 1.0,
            key: "",
        },
        largest: 0.4,
        numbers: &[("rising", Course::Rising), ("falling", Course::Falling)],
        errors: ["one", "other"],
    };

    fn table(count: usize, value: impl Fn(f64) -> f64) -> PathTable {
        let states: Vec<_> = (0..count)
            .map(|node| 0.4 * node as f64 / (count - 1) as f64)
            .map(|e| (e, vec![value(e), 30.0 - value(e)]))
            .collect();
        PathTable::through(&CONTENTS, &states)
    }

    #[test]
    fn a_steep_cubic_is_met_and_a_kink_stays_monotone() {
        let cubic = |e: f64| e + 4.0 * e * e + 10.0 * e.powi(3);
        let met = table(9, cubic);
        let kink = |e: f64| {
            if e < 0.171 {
                e
            } else {
                0.171 + 40.0 * (e - 0.171)
            }
        };
        let kinked = table(9, kink);
        let mut before = [f64::NEG_INFINITY; 2];
        for step in 0..=4000 {
            let e = 0.4 * f64::from(step) / 4000.0;
            // A cubic through five points is itself: round-off.
            assert!((met.at::<2>(e)[0] - cubic(e)).abs() < 1e-12, "{e}");
            let [rising, falling] = kinked.at(e);
            assert!(rising >= before[0] && -falling >= before[1], "{e}");
            before = [rising, -falling];
        }
        assert!(met.is_sound(&CONTENTS) && kinked.is_sound(&CONTENTS));
    }

    #[test]
    fn numbers_that_are_no_curve_are_not_sound() {
        let sound = table(9, |e| e);
        let read = |table: &PathTable| PathTable::read(&table.text(), &CONTENTS, &[]);
        // A number that is read may be off by its last digit.
        assert_eq!(read(&sound).unwrap().nodes.len(), sound.nodes.len());
        let broken: [fn(&mut PathTable); 11] = [
            |table| table.nodes[0] = 0.1,
            |table| table.nodes[3] = table.nodes[2],
            |table| table.nodes[8] = 0.5,
            |table| table.values[2][1] = 0.0,
            |table| table.slopes.truncate(8),
            |table| table.slopes[3].truncate(1),
            |table| table.values[4][0] = table.values[3][0],
            |table| table.values[4][1] = table.values[3][1],
            |table| table.numbers[1] = "rising".into(),
            |table| table.variable = "other".into(),
            |table| table.mesh.of_full_scale.clear(),
        ];
        for (number, spoil) in broken.iter().enumerate() {
            let mut table = sound.clone();
            spoil(&mut table);
            assert!(!table.is_sound(&CONTENTS), "{number}");
            assert!(
                matches!(read(&table), Err(WrongTable::Unreadable(_))),
                "{number}"
            );
        }
        let mut other = sound.clone();
        other.device = "another".into();
        assert!(matches!(read(&other), Err(WrongTable::OtherDevice { .. })));
    }
}
