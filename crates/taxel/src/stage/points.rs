//! A cell that nobody has a law for: readings at known pressures.

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use serde::de::{self, Deserializer, SeqAccess, Visitor};

use super::{
    CellEstimate, CellLaw, CellQuantity, CellState, ChainPart, PartError, PartParameter, image,
};
use crate::electronics::{NUMBER, Stated};
use crate::quantity::{self, Checked, Dimension, NonNegativeStress, VALUE};
use taxel_numerics::least_squares::NORMAL_95;
use taxel_numerics::{MonotoneCurve, OnCurve};

/// One measured point of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Pressure on the cell, Pa; zero of the first point.
    pub pressure: f64,
    /// What the board reads there.
    pub reading: PointReading,
}

/// A point as a sensor file has it: of all cells, or of each.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Point")]
struct PointOfCells {
    /// Pressure on the cell, Pa; zero of the first point.
    #[serde(deserialize_with = "quantity::one::<NonNegativeStress, _>")]
    #[schemars(with = "Checked<NonNegativeStress>")]
    pressure: f64,
    /// What the board reads there; a list has the reading of each cell, row by row.
    reading: Readings,
}

/// A reading: a plain number of a board that gives counts, a quantity of one that gives its unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointReading {
    /// SI, or the plain number.
    pub value: f64,
    /// Its dimension.
    pub dimension: &'static Dimension,
    /// The unit in which it is stated.
    pub symbol: &'static str,
}

struct ReadingVisitor;

impl Visitor<'_> for ReadingVisitor {
    type Value = PointReading;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number of counts, or a quantity in quotes, such as \"1.5 pF\"")
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<PointReading, E> {
        let (stated, symbol) = Stated::with_unit(text).map_err(E::custom)?;
        Ok(PointReading {
            value: stated.value,
            dimension: stated.dimension,
            symbol,
        })
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> Result<PointReading, E> {
        if !value.is_finite() {
            return Err(E::custom(format!("{value} is not a finite number")));
        }
        let (symbol, _) = NUMBER.units[0];
        Ok(PointReading {
            value,
            dimension: &NUMBER,
            symbol,
        })
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<PointReading, E> {
        self.visit_f64(value as f64)
    }
}

impl<'de> Deserialize<'de> for PointReading {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ReadingVisitor)
    }
}

/// The reading of all cells at a point, or that of each, row by row.
#[derive(Debug, Clone)]
enum Readings {
    OfAll(PointReading),
    OfEach(Vec<PointReading>),
}

struct ReadingsVisitor;

impl<'de> Visitor<'de> for ReadingsVisitor {
    type Value = Readings;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        ReadingVisitor.expecting(f)?;
        f.write_str(", or a list of them, one for each cell, row by row")
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<Readings, E> {
        ReadingVisitor.visit_str(text).map(Readings::OfAll)
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> Result<Readings, E> {
        ReadingVisitor.visit_f64(value).map(Readings::OfAll)
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<Readings, E> {
        ReadingVisitor.visit_i64(value).map(Readings::OfAll)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut members: A) -> Result<Readings, A::Error> {
        let mut readings = Vec::new();
        while let Some(reading) = members.next_element()? {
            readings.push(reading);
        }
        Ok(Readings::OfEach(readings))
    }
}

impl<'de> Deserialize<'de> for Readings {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ReadingsVisitor)
    }
}

impl JsonSchema for Readings {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Readings".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let stated = Stated::json_schema(generator);
        let value = "a number of counts, or a quantity of the kind that the board gives; or a list of them, one for each cell";
        let of_each = json_schema!({"type": "array", "items": {"oneOf": [{"type": "number"}, stated]}, "minItems": 1});
        json_schema!({"oneOf": [{"type": "number"}, stated, of_each], VALUE: value})
    }
}

/// The SI unit of readings; empty of plain numbers.
fn si_unit(dimension: &Dimension) -> &'static str {
    if *dimension == NUMBER {
        ""
    } else {
        dimension.si
    }
}

/// Names of the steps from point to point: a curve has one fewer than points.
const STEPS: [&str; 15] = [
    "reading_step_1",
    "reading_step_2",
    "reading_step_3",
    "reading_step_4",
    "reading_step_5",
    "reading_step_6",
    "reading_step_7",
    "reading_step_8",
    "reading_step_9",
    "reading_step_10",
    "reading_step_11",
    "reading_step_12",
    "reading_step_13",
    "reading_step_14",
    "reading_step_15",
];

/// A cell with a measured curve: readings that rise all the way, or fall all the way. Of cells that
/// were measured one by one it is the first of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Points {
    measured: Vec<Point>,
    /// Where each cell has a curve of its own, those of the cells after this one.
    others: Vec<Points>,
    /// True where the curve is this cell's own: readings of an array tell its gain alone.
    own: bool,
    /// Change of the reading over that of the points, from cell to cell.
    gain: f64,
    /// Pressure, Pa, to reading, SI; none where the points make no curve.
    curve: Option<MonotoneCurve>,
}

impl<'de> Deserialize<'de> for Points {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let points = Vec::<PointOfCells>::deserialize(deserializer)?;
        let count = points.iter().find_map(|point| match &point.reading {
            Readings::OfEach(readings) => Some(readings.len()),
            Readings::OfAll(_) => None,
        });
        let of_cell = |cell: usize| {
            let at = |point: &PointOfCells| {
                let reading = match &point.reading {
                    Readings::OfAll(reading) => Some(reading),
                    Readings::OfEach(readings) if Some(readings.len()) == count => {
                        readings.get(cell)
                    }
                    Readings::OfEach(_) => None,
                };
                let reading = *reading.ok_or_else(|| {
                    <D::Error as de::Error>::custom(
                        "the points have lists of different lengths: give the reading of each cell, row by row, in each",
                    )
                })?;
                let pressure = point.pressure;
                Ok(Point { pressure, reading })
            };
            points
                .iter()
                .map(at)
                .collect::<Result<_, _>>()
                .map(Self::new)
        };
        let mut first = of_cell(0)?;
        if let Some(count) = count {
            first.own = true;
            for cell in 1..count {
                let own = true;
                let other = of_cell(cell)?;
                first.others.push(Self { own, ..other });
            }
        }
        Ok(first)
    }
}

impl JsonSchema for Points {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Points".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let point = generator.subschema_for::<PointOfCells>();
        json_schema!({"type": "array", "items": point, "minItems": 2, "maxItems": STEPS.len() + 1})
    }
}

impl Points {
    /// The cell with these points, in the order of their pressures; [`ChainPart::check`] says what is
    /// wrong with them.
    pub fn new(points: Vec<Point>) -> Self {
        let mut cell = Self {
            measured: points,
            others: Vec::new(),
            own: false,
            gain: 1.0,
            curve: None,
        };
        cell.settle();
        cell
    }

    fn settle(&mut self) {
        let of_point = |point: &Point| [point.pressure, point.reading.value];
        let points = self.measured.iter().map(of_point).collect();
        self.curve = MonotoneCurve::new(points, None).ok();
    }

    fn first(&self) -> Option<PointReading> {
        self.measured.first().map(|point| point.reading)
    }
}

impl ChainPart for Points {
    fn parameters(&mut self, each: &mut dyn FnMut(PartParameter, &mut f64)) {
        let Some(first) = self.first() else {
            return;
        };
        let unit = si_unit(first.dimension);
        let readings: Vec<f64> = self.measured.iter().map(|at| at.reading.value).collect();
        let span = (readings[readings.len() - 1] - readings[0]).abs();
        let part = |name, bounds| PartParameter {
            name,
            unit,
            bounds,
            fitted: true,
            per_cell: true,
            absolute: false,
        };
        let gain = PartParameter {
            unit: "",
            fitted: self.own,
            ..part("gain", [0.1, 10.0])
        };
        if self.own {
            each(gain, &mut self.gain);
            for other in &mut self.others {
                other.gain = self.gain;
            }
            return;
        }
        let mut reading = readings[0];
        let around = [reading - span, reading + span];
        each(part("rest_reading", around), &mut reading);
        self.measured[0].reading.value = reading;
        // Steps keep their sign, so that no value of theirs turns the curve back.
        for (index, name) in (1..readings.len()).zip(STEPS) {
            let mut step = readings[index] - readings[index - 1];
            let mut bounds = [1e-2 * step, 1e2 * step];
            bounds.sort_by(f64::total_cmp);
            each(part(name, bounds), &mut step);
            reading += step;
            self.measured[index].reading.value = reading;
        }
        each(gain, &mut self.gain);
        self.settle();
    }

    fn check(&self) -> Result<(), PartError> {
        let broken = |message: String, help: &str| {
            Err(PartError {
                key: "cell.points".into(),
                message,
                help: help.into(),
            })
        };
        let most = STEPS.len() + 1;
        let (Some(first), 2..) = (self.measured.first(), self.measured.len()) else {
            return broken(
                format!("a curve needs 2 points; there are {}", self.measured.len()),
                "give what the cell reads at rest and under known pressures",
            );
        };
        if self.measured.len() > most {
            return broken(
                format!("there are {} points, more than {most}", self.measured.len()),
                "leave out points that lie on the line between their neighbours",
            );
        }
        if first.pressure != 0.0 {
            return broken(
                format!("the first point is at {} kPa", first.pressure / 1e3),
                "begin with what the cell reads at \"0 kPa\"",
            );
        }
        let is_other = |at: &&Point| at.reading.dimension != first.reading.dimension;
        if let Some(other) = self.measured.iter().find(is_other) {
            let [one, other] = [first, other].map(|at| at.reading.dimension.noun());
            return broken(
                format!("one reading is a {one}, another a {other}"),
                "give all readings as the board gives them",
            );
        }
        let points = self.measured.iter();
        let points = points.map(|at| [at.pressure, at.reading.value]);
        if let Err(error) = MonotoneCurve::new(points.collect(), None) {
            return broken(
                error.to_string(),
                "order the points by pressure; a reading that turns back belongs to two pressures",
            );
        }
        for (cell, other) in (1..).zip(&self.others) {
            other.check().map_err(|error| PartError {
                message: format!("reading {} of the lists: {}", cell + 1, error.message),
                ..error
            })?;
        }
        Ok(())
    }
}

impl CellLaw for Points {
    fn boxed(&self) -> Box<dyn CellLaw> {
        Box::new(self.clone())
    }

    fn each(&self) -> Vec<Box<dyn CellLaw>> {
        let cells = std::iter::once(self).chain(&self.others);
        cells.map(CellLaw::boxed).collect()
    }

    fn quantity(&self) -> CellQuantity {
        let reading = self.first().map(|at| (at.dimension, at.symbol));
        let (dimension, symbol) = reading.unwrap_or((&NUMBER, NUMBER.units[0].0));
        let key = si_unit(dimension);
        CellQuantity {
            name: "reading",
            dimension: Some(dimension),
            unit: (symbol, dimension.unit(symbol).unwrap_or(1.0), key),
        }
    }

    fn area(&self) -> Option<[f64; 2]> {
        None
    }

    /// Beyond the last point the curve goes on as it ends.
    fn value(&self, load: f64) -> f64 {
        let Some(curve) = &self.curve else {
            return f64::NAN;
        };
        let rest = curve.points()[0][1];
        let change = match curve.at(load.abs()) {
            OnCurve::Inside { value, .. } => value - rest,
            OnCurve::Above([last, value]) => value - rest + curve.end_slope() * (load.abs() - last),
            OnCurve::Below(_) => return f64::NAN,
        };
        rest + self.gain * change * load.signum()
    }

    fn largest(&self) -> f64 {
        self.measured.last().map_or(0.0, |last| last.pressure)
    }

    /// A value whose interval reaches the end of the curve may be that of any greater pressure: boards
    /// stop at their largest number.
    fn estimate(&self, value: f64, deviation: f64, largest: f64) -> CellEstimate {
        let found = image(self, value, deviation, largest);
        let outward = deviation.copysign(self.value(largest) - self.value(0.0));
        if found.state == CellState::Ok
            && self.inverse(value + NORMAL_95 * outward, largest).is_nan()
        {
            let least = self.inverse(value - NORMAL_95 * outward, largest);
            return CellEstimate::bound(least, CellState::Beyond);
        }
        found
    }

    fn caveat(&self) -> Option<&'static str> {
        Some("loading, if the points were taken so")
    }
}
