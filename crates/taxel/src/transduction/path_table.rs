//! The solved load path of an in-plane sensor as a table: found once by finite elements, read like a
//! closed form.
//!
//! Between nodes lie cubics that are monotone where the nodes are: contact of the side face makes
//! kinks that one polynomial over the whole path would carry everywhere.

use serde::{Deserialize, Serialize};

use crate::mechanics::{CompressedLayer, DeformedElectrodes, LARGEST_COMPRESSION};

/// Version of the format.
const FORMAT: u32 = 1;
/// Mean stress, Pa; gap, thickness and width of the electrodes, m; capacitance, F.
pub(super) const NUMBERS: usize = 5;
/// Places of these numbers.
const STRESS: usize = 0;
const CAPACITANCE: usize = 4;
/// Observed errors, as shares of full scale: that of the whole path. They are no bounds: for contact
/// at finite strain there is none that is proven.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableErrors {
    /// Of the force.
    pub force: f64,
    /// Of the change of capacitance.
    pub change: f64,
    /// Loads at which they were observed.
    pub loads: usize,
}

/// A solved state: its compression and its numbers.
pub(super) type State = (f64, [f64; NUMBERS]);

/// The solved load path of one drawing from rest on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PathTable {
    /// Version of this format: 1.
    pub taxel_table: u32,
    /// Program that made it, with its commit.
    pub program: String,
    /// All that it follows from, as `key = value`.
    pub drawing: Vec<String>,
    /// Differences at seven loads between each two nodes that were solved and not used, and from one
    /// of them to the next: a tenth above the largest, rounded up to two digits.
    pub interpolation: TableErrors,
    /// Differences of a finer mesh.
    pub mesh: TableErrors,
    /// Why the solution ended before a compression of 0.4.
    pub ended: Option<String>,
    /// Compressions of the nodes, from 0 on, rising.
    compressions: Vec<f64>,
    /// At each node: mean stress, Pa; gap, thickness and width of the electrodes, m; capacitance, F.
    values: Vec<[f64; NUMBERS]>,
    /// Their slopes against the compression.
    slopes: Vec<[f64; NUMBERS]>,
}

/// Why the text of a table is not that of a sensor.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WrongTable {
    /// It is none.
    #[error("it is no table of `taxel tabulate`: {0}")]
    Unreadable(String),
    /// It belongs to another drawing.
    #[error("it belongs to another drawing: there {there}, here {here}")]
    OtherDrawing {
        /// First line that differs, as the table has it.
        there: String,
        /// The same of this sensor.
        here: String,
    },
}

/// A table with the drawing that it belongs to.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnTable {
    /// The table.
    pub table: PathTable,
    /// Layer of the closed form, as drawn.
    closed: CompressedLayer,
}

impl PathTable {
    /// The text of a table's file (JSON).
    pub fn text(&self) -> String {
        // Numbers and texts: nothing that JSON has not.
        let mut text = serde_json::to_string_pretty(self).unwrap_or_default();
        text.push('\n');
        text
    }

    /// A table through solved states: their compressions and numbers; without errors yet.
    pub(super) fn through(states: &[State]) -> Self {
        let (compressions, values): (Vec<f64>, Vec<_>) = states.iter().copied().unzip();
        let none = TableErrors {
            force: 0.0,
            change: 0.0,
            loads: 0,
        };
        Self {
            taxel_table: FORMAT,
            program: String::new(),
            drawing: Vec::new(),
            interpolation: none,
            mesh: none,
            ended: None,
            slopes: slopes(&compressions, &values),
            compressions,
            values,
        }
    }

    /// Differences of force and of change from solved states, over full scale; their changes are
    /// from `rest`, F.
    pub(super) fn off(&self, states: &[State], rest: f64) -> Vec<[f64; 2]> {
        let own = self.values[0][CAPACITANCE];
        let full = self
            .values
            .iter()
            .fold([0.0_f64; 2], |[force, change], node| {
                [
                    force.max(node[STRESS]),
                    change.max((own - node[CAPACITANCE]).abs()),
                ]
            });
        let off = |(compression, solved): &State| {
            let here = self.at(*compression);
            let change = (own - here[CAPACITANCE]) - (rest - solved[CAPACITANCE]);
            [(here[STRESS] - solved[STRESS]) / full[0], change / full[1]]
        };
        states.iter().map(off).collect()
    }

    /// Capacitance at rest, F.
    pub fn rest_capacitance(&self) -> f64 {
        self.values[0][CAPACITANCE]
    }

    /// Largest compression that was solved.
    pub fn largest_compression(&self) -> f64 {
        self.compressions[self.compressions.len() - 1]
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.compressions.len()
    }

    /// Stress at the end of the path, Pa.
    fn largest_stress(&self) -> f64 {
        self.values[self.values.len() - 1][STRESS]
    }

    /// The numbers at a compression; beyond the ends on the last cubic's tangent.
    fn at(&self, compression: f64) -> [f64; NUMBERS] {
        let last = self.compressions.len() - 1;
        let end = self.compressions[last];
        if compression >= end {
            let beyond = compression - end;
            return std::array::from_fn(|k| self.values[last][k] + self.slopes[last][k] * beyond);
        }
        let node = self
            .compressions
            .partition_point(|node| *node <= compression);
        let low = node.clamp(1, last) - 1;
        let step = self.compressions[low + 1] - self.compressions[low];
        let place = (compression - self.compressions[low]) / step;
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
    fn is_sound(&self) -> bool {
        let count = self.compressions.len();
        let finite =
            |rows: &[[f64; NUMBERS]]| rows.iter().flatten().all(|number| number.is_finite());
        let errors = [self.interpolation, self.mesh];
        count >= 2
            && self.values.len() == count
            && self.slopes.len() == count
            && finite(&self.values)
            && finite(&self.slopes)
            && self.compressions[0] == 0.0
            && self.compressions.windows(2).all(|pair| pair[0] < pair[1])
            && self.largest_compression() <= LARGEST_COMPRESSION * (1.0 + 1e-9)
            && self
                .values
                .iter()
                .all(|node| node[1..].iter().all(|number| *number > 0.0))
            && self
                .values
                .windows(2)
                .all(|pair| pair[0][STRESS] < pair[1][STRESS])
            && errors
                .iter()
                .all(|error| error.force >= 0.0 && error.change >= 0.0)
    }
}

impl DrawnTable {
    /// Reads the text of a table for a drawing, its lines, whose closed form has the layer `closed`.
    ///
    /// # Errors
    /// [`WrongTable`].
    pub(super) fn read(
        text: &str,
        here: &[String],
        closed: CompressedLayer,
    ) -> Result<Self, WrongTable> {
        let table: PathTable = serde_json::from_str(text)
            .map_err(|error| WrongTable::Unreadable(error.to_string()))?;
        if table.taxel_table != FORMAT {
            let message = format!(
                "format {} is not known; this program reads {FORMAT}",
                table.taxel_table
            );
            return Err(WrongTable::Unreadable(message));
        }
        if !table.is_sound() {
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
        Ok(Self { table, closed })
    }

    /// Largest compression that was solved.
    pub(super) fn largest_compression(&self) -> f64 {
        self.table.largest_compression()
    }

    /// Mean stress of a layer at a compression, Pa, whose closed form gives `closed`: a calibrated
    /// layer differs from the drawn one as their closed forms do.
    pub(super) fn stress(&self, compression: f64, closed: f64) -> f64 {
        let drawn = self
            .closed
            .compress(compression)
            .map_or(0.0, |layer| layer.mean_stress);
        let ratio = if drawn > 0.0 { closed / drawn } else { 1.0 };
        ratio * self.table.at(compression)[STRESS]
    }

    /// Gap, thickness and width at a compression for those at rest: a made gap opens as the drawn
    /// one does.
    pub(super) fn deform(&self, rest: &DeformedElectrodes, compression: f64) -> DeformedElectrodes {
        let [_, gap, thickness, width, _] = self.table.at(compression);
        let [_, drawn_gap, drawn_thickness, drawn_width, _] = self.table.values[0];
        DeformedElectrodes {
            gap: rest.gap * gap / drawn_gap,
            thickness: rest.thickness * thickness / drawn_thickness,
            width: rest.width * width / drawn_width,
        }
    }

    /// The drawn electrodes at a compression.
    pub(super) fn drawn(&self, compression: f64) -> DeformedElectrodes {
        let [_, gap, thickness, width, _] = self.table.at(compression);
        DeformedElectrodes {
            gap,
            thickness,
            width,
        }
    }

    /// Capacitance of the drawn electrodes at a compression, F.
    pub(super) fn capacitance(&self, compression: f64) -> f64 {
        self.table.at(compression)[CAPACITANCE]
    }

    /// Larger of the known errors of the force at a compression, as a share of it.
    pub(super) fn force_error(&self, compression: f64) -> Option<f64> {
        let error = self.table.interpolation.force.max(self.table.mesh.force);
        let stress = self.table.at(compression)[STRESS];
        (stress > 0.0).then(|| error * self.table.largest_stress() / stress)
    }
}

/// Slopes at the nodes: those of the polynomial through the five nearest, cut so that the cubics
/// are monotone where the nodes are (de Boor and Swartz 1977: at most three times the smaller
/// slope beside).
fn slopes(nodes: &[f64], values: &[[f64; NUMBERS]]) -> Vec<[f64; NUMBERS]> {
    let count = nodes.len();
    let wide = count.min(5);
    let of_node = |node: usize| {
        let first = node.saturating_sub(wide / 2).min(count - wide);
        let shares = slope_shares(&nodes[first..first + wide], node - first);
        std::array::from_fn(|k| {
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
        })
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

    fn state(compression: f64, value: f64) -> State {
        let numbers = [
            value,
            1.0 + value,
            40.0 - value,
            1.0 + 0.5 * value,
            30.0 - value,
        ];
        (compression, numbers)
    }

    fn table(count: usize, value: impl Fn(f64) -> f64) -> PathTable {
        let states: Vec<_> = (0..count)
            .map(|node| 0.4 * node as f64 / (count - 1) as f64)
            .map(|e| state(e, value(e)))
            .collect();
        PathTable::through(&states)
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
            assert!((met.at(e)[STRESS] - cubic(e)).abs() < 1e-12, "{e}");
            let here = kinked.at(e);
            assert!(
                here[STRESS] >= before[0] && -here[CAPACITANCE] >= before[1],
                "{e}"
            );
            before = [here[STRESS], -here[CAPACITANCE]];
        }
        assert!(met.is_sound() && kinked.is_sound());
    }

    #[test]
    fn numbers_that_are_no_curve_are_not_sound() {
        let sound = table(9, |e| e);
        let broken: [fn(&mut PathTable); 6] = [
            |table| table.compressions[0] = 0.1,
            |table| table.compressions[3] = table.compressions[2],
            |table| table.values[2][CAPACITANCE] = f64::NAN,
            |table| table.values[2][1] = 0.0,
            |table| table.slopes.truncate(8),
            |table| table.values[4][STRESS] = table.values[3][STRESS],
        ];
        for (number, spoil) in broken.iter().enumerate() {
            let mut table = sound.clone();
            spoil(&mut table);
            assert!(!table.is_sound(), "{number}");
        }
    }
}
