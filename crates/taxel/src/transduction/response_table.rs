//! What a body answers over one to four parameters, as a table: solved once by finite elements, read
//! like a closed form.
//!
//! Over one parameter cubics lie between the points, monotone where these are, as in
//! [`super::path_table`]; over more it is kriging. The points are solved one by one from rest, so that
//! a table is the same in whatever order they were solved.

use serde::{Deserialize, Serialize};

use super::path_table::slopes;
use taxel_numerics::Kriging;

/// Version of the format.
const FORMAT: u32 = 1;
/// Most parameters of a table.
pub const MOST_PARAMETERS: usize = 4;

/// A parameter of a table with its range.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableParameter {
    /// Its name in the problem file.
    pub name: String,
    /// Its SI unit.
    pub unit: String,
    /// Least and largest value, SI.
    pub range: [f64; 2],
}

/// An output of a table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableOutput {
    /// Its name.
    pub name: String,
    /// Its SI unit.
    pub unit: String,
}

/// What fresh points that were solved and not used say of a table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Certificate {
    /// Tolerance, as a share of the range of each output.
    pub tolerance: f64,
    /// Points, drawn evenly over the box.
    pub points: usize,
    /// Seed of the draw.
    pub seed: u64,
    /// Largest error of each output, as a share of its range.
    pub worst: Vec<f64>,
    /// Where the largest of all is, SI.
    pub worst_at: Vec<f64>,
    /// Root of the mean square of the errors of each output, SI.
    pub deviations: Vec<f64>,
}

/// A part of the section of a plane body, for drawings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SketchPart {
    /// Name of an electrode; none of the body.
    pub electrode: Option<String>,
    /// Points of its outline, or of the line that it is, m.
    pub points: Vec<[f64; 2]>,
}

/// Numbers and words of a table, as its file has them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ResponseFile {
    /// Version of this format: 1.
    pub taxel_response_table: u32,
    /// Program that made it.
    pub program: String,
    /// All that it follows from, as `key = value`.
    pub drawing: Vec<String>,
    /// Parameters in the order in which they are applied.
    pub parameters: Vec<TableParameter>,
    /// Which of them presses.
    pub pressing: usize,
    /// The force, then the channels.
    pub outputs: Vec<TableOutput>,
    /// Why the box ends sooner than was asked for.
    pub ended: Option<String>,
    /// What fresh points say of it.
    pub certificate: Certificate,
    /// The section of a plane body at rest; empty of one in space.
    pub sketch: Vec<SketchPart>,
    /// Lengths of the kernel, over the sides of the box; none of a table over one parameter.
    pub lengths: Vec<f64>,
    /// Variance of its noise over that of the process.
    pub nugget: f64,
    /// Parameters of each point, SI; over one parameter rising.
    pub points: Vec<Vec<f64>>,
    /// Outputs at each point, SI.
    pub values: Vec<Vec<f64>>,
}

/// What lies between the points.
#[derive(Debug, Clone, PartialEq)]
enum Surface {
    /// Slopes at the points.
    Curve(Vec<Vec<f64>>),
    /// Over the unit cube.
    Kriging(Kriging),
}

/// A table that is read.
///
/// # Example
/// ```
/// let text = taxel::solutions::shipped_table("soft-dome.table").unwrap();
/// let table = taxel::transduction::ResponseTable::read(text).unwrap();
/// // Half a millimetre deep: the force, and the capacitance.
/// let answer = table.at(&[0.5e-3]);
/// assert!((0.3..0.4).contains(&answer[0].value));
/// assert!((300e-15..310e-15).contains(&answer[1].value));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct ResponseTable {
    file: ResponseFile,
    surface: Surface,
}

/// An output with its slopes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Response {
    /// Value, SI.
    pub value: f64,
    /// Slope by each parameter, SI; zero of those that the table has not.
    pub slopes: [f64; MOST_PARAMETERS],
}

impl ResponseFile {
    /// A file without points.
    pub fn new(
        drawing: Vec<String>,
        parameters: Vec<TableParameter>,
        pressing: usize,
        outputs: Vec<TableOutput>,
    ) -> Self {
        Self {
            taxel_response_table: FORMAT,
            program: String::new(),
            drawing,
            parameters,
            pressing,
            ended: None,
            certificate: Certificate {
                tolerance: 0.0,
                points: 0,
                seed: 0,
                worst: vec![0.0; outputs.len()],
                worst_at: Vec::new(),
                deviations: vec![0.0; outputs.len()],
            },
            outputs,
            sketch: Vec::new(),
            lengths: Vec::new(),
            nugget: 0.0,
            points: Vec::new(),
            values: Vec::new(),
        }
    }

    /// A point of the box over the unit cube.
    pub fn over_box(&self, point: &[f64]) -> Vec<f64> {
        let sides = point.iter().zip(&self.parameters);
        sides
            .map(|(x, parameter)| {
                let [low, high] = parameter.range;
                (x - low) / (high - low)
            })
            .collect()
    }

    /// A point of the unit cube in the box.
    pub fn in_box(&self, point: &[f64]) -> Vec<f64> {
        let sides = point.iter().zip(&self.parameters);
        sides
            .map(|(x, parameter)| {
                let [low, high] = parameter.range;
                low + x * (high - low)
            })
            .collect()
    }

    /// Least and largest value of an output at the points.
    pub fn span(&self, output: usize) -> [f64; 2] {
        let values = self.values.iter().map(|row| row[output]);
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
            [low.min(value), high.max(value)]
        })
    }

    /// True of numbers that make a table.
    fn is_sound(&self) -> bool {
        let (dimensions, outputs) = (self.parameters.len(), self.outputs.len());
        let finite = |rows: &[Vec<f64>], width: usize| {
            rows.iter()
                .all(|row| row.len() == width && row.iter().all(|value| value.is_finite()))
        };
        let known = &self.certificate;
        let ranges = self.parameters.iter().all(|one| {
            let [low, high] = one.range;
            low.is_finite() && high.is_finite() && low < high
        });
        self.taxel_response_table == FORMAT
            && (1..=MOST_PARAMETERS).contains(&dimensions)
            && self.pressing < dimensions
            && outputs >= 2
            && ranges
            && self.points.len() == self.values.len()
            && self.points.len() >= 2
            && finite(&self.points, dimensions)
            && finite(&self.values, outputs)
            && finite(&[known.worst.clone(), known.deviations.clone()], outputs)
            && known.deviations.iter().all(|one| *one >= 0.0)
            && self.parameters[self.pressing].range[0] == 0.0
            && (dimensions > 1 || self.points.windows(2).all(|pair| pair[0][0] < pair[1][0]))
            && (dimensions == 1 || self.lengths.len() == dimensions)
            && self.lengths.iter().all(|length| *length > 0.0)
    }
}

/// Why a text is no table.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("it is no table of `taxel tabulate`: {0}")]
pub struct NoResponseTable(String);

impl ResponseTable {
    /// The table of these points; `None` where nothing lies between them.
    pub fn new(file: ResponseFile) -> Option<Self> {
        if !file.is_sound() {
            return None;
        }
        let surface = if file.parameters.len() == 1 {
            let nodes: Vec<f64> = file.points.iter().map(|point| point[0]).collect();
            Surface::Curve(slopes(&nodes, &file.values))
        } else {
            let points: Vec<_> = file.points.iter().map(|x| file.over_box(x)).collect();
            let lengths = file.lengths.clone();
            Surface::Kriging(Kriging::with(&points, &file.values, lengths, file.nugget)?)
        };
        Some(Self { file, surface })
    }

    /// Reads the text of a table.
    ///
    /// # Errors
    /// [`NoResponseTable`].
    pub fn read(text: &str) -> Result<Self, NoResponseTable> {
        let file: ResponseFile =
            serde_json::from_str(text).map_err(|error| NoResponseTable(error.to_string()))?;
        Self::new(file).ok_or_else(|| NoResponseTable("its numbers are no surface".into()))
    }

    /// The text of its file (JSON).
    pub fn text(&self) -> String {
        // Numbers and texts: nothing that JSON has not.
        let mut text = serde_json::to_string_pretty(&self.file).unwrap_or_default();
        text.push('\n');
        text
    }

    /// Its numbers and words.
    pub fn file(&self) -> &ResponseFile {
        &self.file
    }

    /// Outputs with their slopes at a point of the box, SI; beyond it as the surface goes on.
    pub fn at(&self, point: &[f64]) -> Vec<Response> {
        self.first(point, self.file.outputs.len())
    }

    /// The force with its slopes alone.
    pub fn force(&self, point: &[f64]) -> Response {
        self.first(point, 1)[0]
    }

    fn first(&self, point: &[f64], count: usize) -> Vec<Response> {
        match &self.surface {
            Surface::Curve(slopes) => self.on_curve(slopes, point[0], count),
            Surface::Kriging(kriging) => {
                let mut answers = vec![[0.0; 1 + MOST_PARAMETERS]; count];
                kriging.at(&self.file.over_box(point), &mut answers);
                let sides = self.file.parameters.iter();
                let sides: Vec<f64> = sides.map(|one| one.range[1] - one.range[0]).collect();
                let of = |answer: &[f64; 1 + MOST_PARAMETERS]| {
                    let mut response = Response {
                        value: answer[0],
                        ..Response::default()
                    };
                    for (along, side) in sides.iter().enumerate() {
                        response.slopes[along] = answer[1 + along] / side;
                    }
                    response
                };
                answers.iter().map(of).collect()
            }
        }
    }

    /// Hermite's cubics; beyond the ends their tangents.
    fn on_curve(&self, slopes: &[Vec<f64>], x: f64, count: usize) -> Vec<Response> {
        let (points, values) = (&self.file.points, &self.file.values);
        let last = points.len() - 1;
        let low = points.partition_point(|point| point[0] <= x).clamp(1, last) - 1;
        let response = |value: f64, slope: f64| Response {
            value,
            slopes: [slope, 0.0, 0.0, 0.0],
        };
        if x < points[0][0] || x > points[last][0] {
            let end = if x < points[0][0] { 0 } else { last };
            let beyond = x - points[end][0];
            let tangent =
                |k: usize| response(values[end][k] + slopes[end][k] * beyond, slopes[end][k]);
            return (0..count).map(tangent).collect();
        }
        let step = points[low + 1][0] - points[low][0];
        let right = (x - points[low][0]) / step;
        let left = 1.0 - right;
        let cubic = |k: usize| {
            let [y0, y1] = [values[low][k], values[low + 1][k]];
            let [s0, s1] = [slopes[low][k], slopes[low + 1][k]];
            response(
                left * left * (1.0 + 2.0 * right) * y0
                    + right * right * (1.0 + 2.0 * left) * y1
                    + step * left * right * (left * s0 - right * s1),
                6.0 * left * right * (y1 - y0) / step
                    + left * (left - 2.0 * right) * s0
                    + right * (right - 2.0 * left) * s1,
            )
        };
        (0..count).map(cubic).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameter(name: &str, high: f64) -> TableParameter {
        TableParameter {
            name: name.into(),
            unit: "m".into(),
            range: [0.0, high],
        }
    }

    fn outputs() -> Vec<TableOutput> {
        let output = |name: &str, unit: &str| TableOutput {
            name: name.into(),
            unit: unit.into(),
        };
        vec![output("force", "N"), output("one", "F")]
    }

    fn curve(count: usize) -> ResponseTable {
        let mut file = ResponseFile::new(Vec::new(), vec![parameter("travel", 2.0)], 0, outputs());
        for node in 0..count {
            let x = 2.0 * node as f64 / (count - 1) as f64;
            file.points.push(vec![x]);
            file.values.push(vec![x.powi(3) + x, (2.0 * x).sin()]);
        }
        ResponseTable::new(file).unwrap()
    }

    #[test]
    fn slopes_are_those_of_the_values_and_the_ends_go_on_straight() {
        let table = curve(17);
        for step in -20..=220 {
            let x = f64::from(step) / 100.0 + 1e-3;
            let answer = table.at(&[x]);
            let [low, high] = [-1e-6, 1e-6].map(|off| table.at(&[x + off]));
            for output in 0..2 {
                let by_difference = (high[output].value - low[output].value) / 2e-6;
                // Central differences of cubics: round-off of 1e-16 times 10 over the step.
                assert!(
                    (answer[output].slopes[0] - by_difference).abs() < 1e-7,
                    "{x}"
                );
            }
        }
        let [end, beyond] = [2.0, 2.1].map(|x| table.force(&[x]));
        assert!((beyond.value - end.value - 0.1 * end.slopes[0]).abs() < 1e-12);
    }

    #[test]
    fn a_file_comes_back_from_its_text_and_a_broken_one_does_not() {
        let table = curve(9);
        assert_eq!(ResponseTable::read(&table.text()), Ok(table.clone()));
        let broken: [fn(&mut ResponseFile); 7] = [
            |file| file.taxel_response_table = 9,
            |file| file.points[3] = file.points[2].clone(),
            |file| file.values[4].truncate(1),
            |file| file.values[4][1] = f64::NAN,
            |file| file.pressing = 1,
            |file| file.parameters[0].range = [1.0, 1.0],
            |file| file.certificate.deviations[1] = -1.0,
        ];
        for (number, spoil) in broken.iter().enumerate() {
            let mut file = table.file().clone();
            spoil(&mut file);
            assert_eq!(ResponseTable::new(file), None, "{number}");
        }
    }
}
