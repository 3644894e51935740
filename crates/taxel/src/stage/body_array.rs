//! Bodies between a probe and their channels: forces to signals through a table, and back.
//!
//! The unknowns of a body are the force on it and the other parameters of its load. The force stands
//! in the place of the depth that presses: near rest both vanish together with all that they change,
//! as powers of the depth, and signals are straight in the force.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use super::search::{Found, Model, misfit, search, weight};
use super::{CellQuantity, CellState, ChainPart, Inverted, Network, PartError, PartParameter};
use crate::drawing::{Label, Outline, Part, Shape, View};
use crate::electronics::NUMBER;
use crate::information::{Information, Unknown};
use crate::quantity::{
    self, CAPACITANCE, Checked, Dimension, FORCE, LENGTH, PositiveNumber, RESISTANCE,
};
use crate::transduction::{MOST_PARAMETERS, ResponseTable};
use taxel_ground::summary::{Fact, Value, fact, number, text};
use taxel_numerics::dense::cholesky_solve;
use taxel_numerics::roots::ridders;

/// χ² that 95 % of the draws with one to four degrees of freedom stay below.
const CHI_SQUARE_95: [f64; MOST_PARAMETERS] = [3.841, 5.991, 7.815, 9.488];
/// Standard deviations of the misfit at which a frame contradicts the table: 99.9 % of the frames of a
/// body stay below.
const CONTRADICTS: f64 = 3.090;
/// Points of a table around each one among which a search begins at the best: two along each side.
const AROUND: usize = 2;
/// Depths at which it is seen whether the force rises: as many as a table over one parameter rarely
/// has points.
const DEPTHS: usize = 64;
/// Width of an electrode in drawings, over the size of the body: two pixels of a picture of 200.
const LINE: f64 = 0.01;

/// What a made body has in the place of what was drawn.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct BodyMake {
    /// Force over the drawn one at the same displacement: that of a modulus. Default 1.
    #[serde(deserialize_with = "quantity::one::<PositiveNumber, _>")]
    #[schemars(with = "Checked<PositiveNumber>")]
    pub stiffness: f64,
    /// Signal over the drawn one: that of a permittivity or a resistivity. Default 1.
    #[serde(deserialize_with = "quantity::one::<PositiveNumber, _>")]
    #[schemars(with = "Checked<PositiveNumber>")]
    pub sensitivity: f64,
}

impl Default for BodyMake {
    fn default() -> Self {
        Self {
            stiffness: 1.0,
            sensitivity: 1.0,
        }
    }
}

impl BodyMake {
    /// Shows both numbers to `each`, which may change them.
    pub(super) fn shown(&mut self, each: &mut dyn FnMut(PartParameter, &mut f64)) {
        for (name, value) in [
            ("stiffness", &mut self.stiffness),
            ("sensitivity", &mut self.sensitivity),
        ] {
            let parameter = PartParameter {
                name,
                unit: "",
                // Rubber of one name differs by less between makers and batches.
                bounds: [0.1, 10.0],
                fitted: true,
                per_cell: true,
                absolute: false,
            };
            each(parameter, value);
        }
    }
}

/// A body on each taxel.
#[derive(Debug, Clone)]
pub struct BodyArray {
    table: Arc<Known>,
    /// What each taxel has in the place of what was drawn.
    pub bodies: Vec<BodyMake>,
    /// Signals of all channels without a load as captured, `NaN` where they were not; none before a
    /// capture.
    pub rest: Option<Vec<f64>>,
    /// Standard deviations of stiffness and sensitivity, over them.
    pub fabrication: [f64; 2],
    /// What is wrong with its description.
    pub problem: Option<PartError>,
}

/// A table with what follows from it.
#[derive(Debug)]
struct Known {
    table: ResponseTable,
    dimension: &'static Dimension,
    names: Vec<String>,
    /// Force at the end of the box, the other parameters in their middle, N.
    full_scale: f64,
    /// Force below which the table says nothing of its curves, N: its own error.
    least: f64,
    /// Of each point of the table the force over the full scale and the other parameters over their
    /// deviations, then the signals.
    points: Vec<(Vec<f64>, Vec<f64>)>,
    /// Points near each point.
    near: Vec<Vec<usize>>,
    signals_at_rest: Vec<f64>,
}

impl Known {
    fn new(table: &ResponseTable, dimension: &'static Dimension, names: Vec<String>) -> Self {
        let mut known = Self {
            table: table.clone(),
            dimension,
            names,
            full_scale: 1.0,
            least: 0.0,
            points: Vec::new(),
            near: Vec::new(),
            signals_at_rest: Vec::new(),
        };
        let file = table.file();
        let middle = vec![0.0; known.others()];
        known.full_scale = known.force(known.end(), &middle);
        let error = file.certificate.worst[0] * (file.span(0)[1] - file.span(0)[0]);
        // Cubics keep to seven digits where fresh points found no error at all.
        let full = known.full_scale.abs().max(f64::MIN_POSITIVE);
        known.least = error.clamp(1e-7 * full, 0.1 * full);
        known.signals_at_rest = known.signals(0.0, &middle).signals;
        let over_box: Vec<Vec<f64>> = file.points.iter().map(|x| file.over_box(x)).collect();
        known.near = neighbours(&over_box);
        known.points = file
            .points
            .iter()
            .map(|point| {
                let others = known.over_deviations(point);
                let force = known.force(point[file.pressing], &others);
                let mut unknowns = vec![force / known.full_scale];
                unknowns.extend(&others);
                let signals = known.table.at(point);
                let signals = signals[1..].iter().map(|one| one.value).collect();
                (unknowns, signals)
            })
            .collect();
        known
    }

    /// A depth at which the force falls, the other parameters in the middle or at a corner; none where
    /// it rises all the way.
    fn falls_at(&self) -> Option<f64> {
        let corner = |which: usize| -> Vec<f64> {
            let side = |bit: usize| 3.0_f64.sqrt() * if which >> bit & 1 == 1 { 1.0 } else { -1.0 };
            (0..self.others()).map(side).collect()
        };
        let corners = (0..1_usize << self.others()).map(corner);
        let mut places = corners.chain([vec![0.0; self.others()]]);
        places.find_map(|others| {
            let depth = |step: usize| self.end() * step as f64 / DEPTHS as f64;
            let forces = (0..=DEPTHS).map(|step| self.force(depth(step), &others));
            let forces: Vec<f64> = forces.collect();
            let mut pairs = forces.windows(2);
            let falls = pairs.position(|pair| pair[1] < pair[0] - self.least)?;
            Some(depth(falls))
        })
    }

    /// Number of parameters beside the one that presses.
    fn others(&self) -> usize {
        self.table.file().parameters.len() - 1
    }

    /// The largest depth.
    fn end(&self) -> f64 {
        let file = self.table.file();
        file.parameters[file.pressing].range[1]
    }

    /// Middle and deviation of each parameter that does not press: that of a value which may be
    /// anywhere in its range.
    fn priors(&self) -> impl Iterator<Item = [f64; 2]> {
        let file = self.table.file();
        let others = file.parameters.iter().enumerate();
        others
            .filter(|(index, _)| *index != file.pressing)
            .map(|(_, one)| {
                let [low, high] = one.range;
                [0.5 * (low + high), (high - low) / 12.0_f64.sqrt()]
            })
    }

    /// The parameters beside the one that presses, from their middles over their deviations.
    fn over_deviations(&self, point: &[f64]) -> Vec<f64> {
        let pressing = self.table.file().pressing;
        let others = point.iter().enumerate();
        let others = others.filter(|(index, _)| *index != pressing);
        others
            .zip(self.priors())
            .map(|((_, value), [middle, deviation])| (value - middle) / deviation)
            .collect()
    }

    /// The point of the box at a depth; other parameters stay inside.
    fn point(&self, depth: f64, others: &[f64]) -> Vec<f64> {
        let file = self.table.file();
        let mut values = others.iter().zip(self.priors());
        let each = file.parameters.iter().enumerate();
        each.map(|(index, parameter)| {
            if index == file.pressing {
                return depth;
            }
            let [low, high] = parameter.range;
            // As many as there are parameters beside the one that presses.
            values.next().map_or(low, |(value, [middle, deviation])| {
                (middle + deviation * value).clamp(low, high)
            })
        })
        .collect()
    }

    /// Force beyond that at rest, N.
    fn force(&self, depth: f64, others: &[f64]) -> f64 {
        let at = |depth| self.table.force(&self.point(depth, others)).value;
        at(depth) - at(0.0)
    }

    /// The depth of a force from zero to beyond the end of the box, where it goes on straight.
    fn depth(&self, force: f64, others: &[f64]) -> f64 {
        let at_rest = self.table.force(&self.point(0.0, others)).value;
        let end = self.table.force(&self.point(self.end(), others));
        let largest = end.value - at_rest;
        if force >= largest {
            let slope = end.slopes[self.table.file().pressing];
            let slope = slope.max(largest / self.end());
            return self.end() + (force - largest) / slope;
        }
        ridders([0.0, self.end()], |depth| {
            self.table.force(&self.point(depth, others)).value - at_rest - force
        })
    }

    /// Signals as drawn of a force of either sign, N, and their slopes by it, per N, and by the other
    /// parameters over their deviations.
    fn signals(&self, force: f64, others: &[f64]) -> Model {
        let (size, side) = (force.abs(), force.signum());
        let pressing = self.table.file().pressing;
        let depth = self.depth(size.max(self.least), others);
        let end = self.end();
        let (at_rest, there) = (
            self.table.at(&self.point(0.0, others)),
            self.table.at(&self.point(depth.min(end), others)),
        );
        // Beyond the box signals go on straight, as the force does.
        let beyond = (depth - end).max(0.0);
        let inner: Vec<(f64, usize)> = self
            .priors()
            .map(|[_, deviation]| deviation)
            .zip((0..=self.others()).filter(|index| *index != pressing))
            .zip(others)
            .map(|((deviation, index), value)| {
                // Beyond its range a parameter moves nothing.
                let within = if value.abs() <= 3.0_f64.sqrt() {
                    deviation
                } else {
                    0.0
                };
                (within, index)
            })
            .collect();
        let stiff = there[0].slopes[pressing];
        let secant = (there[0].value - at_rest[0].value) / depth.min(end);
        // A surface through few points may lie flat where the force begins.
        let stiff = if stiff > 1e-3 * secant { stiff } else { secant };
        let near = (size / self.least).min(1.0);
        let mut model = Model {
            signals: Vec::new(),
            slopes: Vec::new(),
        };
        for (rest, here) in at_rest[1..].iter().zip(&there[1..]) {
            let slope = here.slopes[pressing];
            let value = here.value + slope * beyond;
            let change = near * (value - rest.value);
            let by_force = if size < self.least {
                (value - rest.value) / self.least
            } else {
                slope / stiff
            };
            let mut row = vec![by_force];
            for (deviation, index) in &inner {
                // At the same force the depth yields.
                let same = here.slopes[*index]
                    - slope * (there[0].slopes[*index] - at_rest[0].slopes[*index]) / stiff;
                let change = near * (same - rest.slopes[*index]);
                row.push(deviation * (rest.slopes[*index] + side * change));
            }
            model.signals.push(rest.value + side * change);
            model.slopes.push(row);
        }
        model
    }
}

/// Points near each point of a table over the unit cube: over one parameter those before and after it.
fn neighbours(points: &[Vec<f64>]) -> Vec<Vec<usize>> {
    let of = |own: usize| -> Vec<usize> {
        let x = &points[own];
        if x.len() == 1 {
            let beside = [own.checked_sub(1), Some(own + 1)];
            let inside = |at: &usize| *at < points.len();
            return beside.into_iter().flatten().filter(inside).collect();
        }
        let distance = |other: &usize| -> f64 {
            let sides = x.iter().zip(&points[*other]);
            sides.map(|(a, b)| (a - b) * (a - b)).sum()
        };
        let mut others: Vec<usize> = (0..points.len()).filter(|other| *other != own).collect();
        others.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        others.truncate(AROUND * x.len());
        others
    };
    (0..points.len()).map(of).collect()
}

impl BodyArray {
    /// No body yet, of this table; its channels are of a dimension and have these names.
    pub fn new(table: &ResponseTable, dimension: &'static Dimension, names: Vec<String>) -> Self {
        Self {
            table: Arc::new(Known::new(table, dimension, names)),
            bodies: Vec::new(),
            rest: None,
            fabrication: [0.0; 2],
            problem: None,
        }
    }

    /// What is wrong with the force of the table.
    pub(super) fn wrong_force(&self) -> Option<PartError> {
        let (message, help) = if self.table.full_scale <= 0.0 {
            let message = format!(
                "it is {:.4} N where the body is pressed most: a pressing force is positive",
                self.table.full_scale
            );
            (message, "change sign, or the axis")
        } else {
            let depth = self.table.falls_at()?;
            let unit = &self.table.table.file().parameters[self.table.table.file().pressing].unit;
            let message =
                format!("it falls beyond {depth:.4e} {unit}: one force belongs to several depths");
            (message, "let the range of load end before that")
        };
        Some(PartError {
            key: "force".into(),
            message,
            help: help.into(),
        })
    }

    /// Force at the end of the box, N.
    pub fn full_scale(&self) -> f64 {
        self.table.full_scale
    }

    fn count(&self) -> usize {
        self.table.names.len()
    }

    /// Signals of a body and their slopes by its force over the full scale and its other parameters.
    fn model(&self, taxel: usize, unknowns: &[f64]) -> Model {
        let (known, made) = (&self.table, self.bodies[taxel]);
        let force = unknowns[0] * known.full_scale;
        let mut model = known.signals(force / made.stiffness, &unknowns[1..]);
        for row in &mut model.slopes {
            row[0] *= known.full_scale / made.stiffness;
            for slope in row {
                *slope *= made.sensitivity;
            }
        }
        for (channel, signal) in model.signals.iter_mut().enumerate() {
            *signal = *signal * made.sensitivity + self.offset(taxel, channel);
        }
        model
    }

    /// What a channel read without a load beyond what it has by the table.
    fn offset(&self, taxel: usize, channel: usize) -> f64 {
        let drawn = self.bodies[taxel].sensitivity * self.table.signals_at_rest[channel];
        let rest = self
            .rest
            .as_ref()
            .map(|rest| rest[taxel * self.count() + channel]);
        rest.filter(|rest| rest.is_finite())
            .map_or(0.0, |rest| rest - drawn)
    }

    /// Weights of the readings of a body: noise, and what the table itself is off by.
    fn weights(&self, signals: &[f64], noise: &[f64]) -> Vec<f64> {
        let own = &self.table.table.file().certificate.deviations[1..];
        let each = noise.iter().zip(own).zip(signals);
        each.map(|((noise, own), signal)| weight((&noise.hypot(*own), signal)))
            .collect()
    }

    /// Minima of the misfit, the best first: a search from each point of the table that is better than
    /// its neighbours.
    fn minima(&self, taxel: usize, signals: &[f64], weights: &[f64]) -> Vec<Found> {
        let known = &self.table;
        let made = self.bodies[taxel];
        let offsets: Vec<f64> = (0..self.count()).map(|at| self.offset(taxel, at)).collect();
        let square = |(unknowns, drawn): &(Vec<f64>, Vec<f64>)| -> f64 {
            let each = signals.iter().zip(drawn).zip(weights.iter().zip(&offsets));
            let off = each.filter(|(_, (weight, _))| **weight > 0.0);
            let off = off.map(|((signal, drawn), (weight, offset))| {
                (weight * (signal - made.sensitivity * drawn - offset)).powi(2)
            });
            off.chain(unknowns[1..].iter().map(|one| one * one)).sum()
        };
        let squares: Vec<f64> = known.points.iter().map(square).collect();
        let best = |index: &usize| {
            let near = &known.near[*index];
            near.iter().all(|other| squares[*index] <= squares[*other])
        };
        let model = |unknowns: &[f64]| self.model(taxel, unknowns);
        let starts = (0..squares.len()).filter(best);
        let mut found: Vec<Found> = starts
            .filter_map(|index| {
                let start = known.points[index].0.clone();
                search(model, start, signals, weights, 1)
            })
            .collect();
        found.sort_by(|a, b| a.square.total_cmp(&b.square));
        found
    }

    /// Reads one body.
    fn read_back(&self, taxel: usize, signals: &[f64], noise: &[f64]) -> Option<OneBody> {
        let known = &self.table;
        let weights = self.weights(signals, noise);
        let used = weights.iter().filter(|weight| **weight > 0.0).count();
        if used == 0 {
            return Some(OneBody {
                force: 0.0,
                deviation: f64::NAN,
                by_noise: f64::NAN,
                state: CellState::Ambiguous,
                misfit: 0.0,
            });
        }
        let minima = self.minima(taxel, signals, &weights);
        let best = minima.first()?;
        let unit: Vec<f64> = (0..best.unknowns.len())
            .map(|row| f64::from(u8::from(row == 0)))
            .collect();
        let covariance = cholesky_solve(&best.factor, &unit);
        let made = self.by_make(taxel, best, &weights, &covariance);
        let of_table = known.table.file().certificate.deviations[0];
        let force = best.unknowns[0] * known.full_scale;
        let by_noise = best.by_noise(&covariance, &weights, noise) * known.full_scale;
        let by_readings = covariance[0].sqrt() * known.full_scale;
        let deviation = by_readings
            .hypot(made)
            .hypot(of_table * self.bodies[taxel].stiffness);
        let freedom = used as f64 - 1.0;
        let misfit = misfit(best.square, freedom);
        let dimensions = best.unknowns.len().min(used);
        // A search from elsewhere that came to another force explains the frame as well.
        let apart = |other: &&Found| {
            let off = (other.unknowns[0] - best.unknowns[0]) * known.full_scale;
            off.abs() > 2.0 * deviation
        };
        let rival = minima[1..].iter().find(apart);
        let ambiguous =
            rival.is_some_and(|other| other.square < best.square + CHI_SQUARE_95[dimensions - 1]);
        let depth = known.depth(
            force.abs() / self.bodies[taxel].stiffness,
            &best.unknowns[1..],
        );
        // Half of the range is √3 deviations of a value that may be anywhere in it.
        let outside = |value: &f64| value.abs() > 3.0_f64.sqrt();
        let state = if misfit > CONTRADICTS {
            CellState::Inconsistent
        } else if ambiguous || by_readings > known.full_scale {
            CellState::Ambiguous
        } else if depth > known.end() || best.unknowns[1..].iter().any(outside) {
            CellState::Beyond
        } else {
            CellState::Ok
        };
        Some(OneBody {
            force,
            deviation,
            by_noise,
            state,
            misfit,
        })
    }

    /// Standard deviation of a force by what is made otherwise than drawn, N.
    fn by_make(&self, taxel: usize, at: &Found, weights: &[f64], row: &[f64]) -> f64 {
        let known = &self.table;
        let force = at.unknowns[0] * known.full_scale;
        let [stiffness, sensitivity] = self.fabrication;
        if sensitivity == 0.0 {
            return stiffness * force;
        }
        let model = self.model(taxel, &at.unknowns);
        let rest = known.signals(0.0, &at.unknowns[1..]).signals;
        let made = self.bodies[taxel].sensitivity;
        let captured = self.rest.is_some();
        let mut off = 0.0;
        for (channel, weight) in weights.iter().enumerate() {
            let drawn = model.signals[channel] - self.offset(taxel, channel);
            // What a capture at rest took is gone.
            let moved = if captured {
                drawn - made * rest[channel]
            } else {
                drawn
            };
            let slopes = model.slopes[channel].iter().zip(row);
            off += weight * weight * moved * slopes.map(|(slope, part)| slope * part).sum::<f64>();
        }
        (stiffness * force).hypot(sensitivity * off * known.full_scale)
    }
}

/// What a frame says of one body.
struct OneBody {
    force: f64,
    deviation: f64,
    /// The part of it by the noise of the readings of the frame.
    by_noise: f64,
    state: CellState,
    misfit: f64,
}

impl ChainPart for BodyArray {
    fn parameters(&mut self, each: &mut dyn FnMut(PartParameter, &mut f64)) {
        for body in &mut self.bodies {
            body.shown(each);
        }
    }

    fn check(&self) -> Result<(), PartError> {
        self.problem.clone().map_or(Ok(()), Err)
    }

    fn facts(&self) -> Vec<Fact> {
        let (known, file) = (&self.table, self.table.table.file());
        let share = |of: f64| number(of, "share", "%", 1e-2);
        let source = "table of the body";
        let mut facts = vec![
            fact(
                "mechanics",
                "solved_points",
                text(&file.points.len()),
                source,
            ),
            fact(
                "mechanics",
                "fresh_points",
                text(&file.certificate.points),
                source,
            ),
        ];
        let errors = file.outputs.iter().zip(&file.certificate.worst);
        facts.extend(errors.map(|(output, worst)| {
            let name = format!("largest_error_of_{}", output.name);
            fact(
                "mechanics",
                name,
                share(*worst),
                "fresh points, over its range",
            )
        }));
        for parameter in &file.parameters {
            let value = in_unit(parameter.range[1], &parameter.unit);
            let name = format!("largest_{}", parameter.name);
            facts.push(fact("mechanics", name, value, source));
        }
        if let Some(reason) = &file.ended {
            facts.push(fact("mechanics", "box_ends_because", text(reason), source));
        }
        let middle = vec![0.0; known.others()];
        let pressed = known.signals(known.full_scale, &middle).signals;
        let quantity = self.signal();
        let (unit, scale, key) = quantity.unit;
        for (channel, name) in known.names.iter().enumerate() {
            let ends = [known.signals_at_rest[channel], pressed[channel]];
            for (at, value) in ["rest", "full_scale"].into_iter().zip(ends) {
                let name = format!("{name}_at_{at}");
                facts.push(fact(
                    "transduction",
                    name,
                    number(value, key, unit, scale),
                    source,
                ));
            }
        }
        let names = text(&"stiffness, sensitivity");
        let source = "for fabrication and calibration";
        facts.push(fact("transduction", "numbers_of_the_parts", names, source));
        facts
    }

    fn views(&self) -> Vec<View> {
        let sketch = &self.table.table.file().sketch;
        let points = sketch.iter().flat_map(|part| &part.points);
        let size = points.flatten().fold(0.0_f64, |size, x| size.max(x.abs()));
        if size == 0.0 {
            return Vec::new();
        }
        let mut view = View {
            title: "section of the body at rest; electrodes are drawn thicker".into(),
            ..View::default()
        };
        for part in sketch {
            let mut points = part.points.clone();
            if let Some(name) = &part.electrode {
                // A line has no width; this one can be seen.
                let width = LINE * size;
                points.extend(part.points.iter().rev().map(|[x, y]| [*x, y - width]));
                let [x, y] = part.points[part.points.len() / 2];
                view.labels.push(Label {
                    at: [x, y + 3.0 * width],
                    text: name.clone(),
                });
            }
            view.shapes.push(Shape {
                part: if part.electrode.is_some() {
                    Part::Electrode
                } else {
                    Part::Elastomer
                },
                outline: Outline::Polygon(points),
            });
        }
        vec![view]
    }
}

/// A value of a parameter in the unit that people read.
fn in_unit(value: f64, si: &str) -> Value {
    match si {
        "m" => number(value, "m", "mm", 1e-3),
        "Pa" => number(value, "pa", "kPa", 1e3),
        "N" => number(value, "n", "N", 1.0),
        "rad" => number(value, "rad", "mrad", 1e-3),
        _ => text(&value),
    }
}

impl BodyArray {
    /// What the signals are.
    fn signal(&self) -> CellQuantity {
        let dimension = self.table.dimension;
        let (name, unit) = if *dimension == CAPACITANCE {
            ("capacitance", ("fF", 1e-15, "f"))
        } else if *dimension == RESISTANCE {
            ("resistance", ("ohm", 1.0, "ohm"))
        } else if *dimension == LENGTH {
            ("displacement", ("mm", 1e-3, "m"))
        } else {
            ("reaction", ("N", 1.0, "n"))
        };
        CellQuantity {
            name,
            dimension: Some(dimension),
            unit,
        }
    }
}

impl Network for BodyArray {
    fn boxed(&self) -> Box<dyn Network> {
        Box::new(self.clone())
    }

    fn channels(&self, cells: usize) -> usize {
        cells * self.count()
    }

    fn channel_name(&self, of_taxel: usize) -> Option<&str> {
        self.table.names.get(of_taxel).map(String::as_str)
    }

    fn at_rest(&self, signals: &[f64]) -> Option<Box<dyn Network>> {
        Some(Box::new(Self {
            rest: Some(signals.to_vec()),
            ..self.clone()
        }))
    }

    fn knows_its_make(&self) -> bool {
        true
    }

    fn information(&self, values: &[f64], taxel: usize, noise: &[f64]) -> Option<Information> {
        let known = &self.table;
        let mut unknowns = vec![values[taxel] / known.full_scale];
        unknowns.resize(1 + known.others(), 0.0);
        let model = self.model(taxel, &unknowns);
        let own = self.count() * taxel..self.count() * (taxel + 1);
        let weights = self.weights(&model.signals, &noise[own]);
        let used = || {
            let each = weights.iter().enumerate();
            each.filter(|(_, weight)| **weight > 0.0)
        };
        let force = Unknown {
            name: "force_z",
            dimension: &FORCE,
            full_scale: known.full_scale,
            beside: false,
        };
        let other = Unknown {
            name: "other_parameter",
            dimension: &NUMBER,
            full_scale: 1.0,
            beside: true,
        };
        let others = known.others();
        let row = |index: usize| -> Vec<f64> {
            let mut row = model.slopes[index].clone();
            row[0] /= known.full_scale;
            row
        };
        Some(Information {
            unknowns: std::iter::once(force)
                .chain((0..others).map(|_| other))
                .collect(),
            jacobian: used().map(|(index, _)| row(index)).collect(),
            noise: used().map(|(_, weight)| 1.0 / weight).collect(),
            prior: std::iter::once(0.0)
                .chain((0..others).map(|_| 1.0))
                .collect(),
        })
    }

    fn between(&self, taxel: usize, values: &[f64]) -> Vec<(CellQuantity, f64)> {
        let known = &self.table;
        let file = known.table.file();
        if file.parameters[file.pressing].unit != LENGTH.si {
            return Vec::new();
        }
        let middle = vec![0.0; known.others()];
        let force = values[taxel] / self.bodies[taxel].stiffness;
        let depth = CellQuantity {
            name: "depth",
            dimension: Some(&LENGTH),
            unit: ("mm", 1e-3, "m"),
        };
        vec![(depth, known.depth(force.max(0.0), &middle))]
    }

    fn takes(&self, of_cell: CellQuantity) -> bool {
        of_cell.name == "force"
    }

    fn quantity(&self, _of_cell: CellQuantity) -> CellQuantity {
        self.signal()
    }

    fn read(&self, values: &[f64], signals: &mut [f64]) {
        let mut unknowns = vec![0.0; 1 + self.table.others()];
        for (taxel, force) in values.iter().enumerate() {
            unknowns[0] = force / self.table.full_scale;
            let own = self.count() * taxel..self.count() * (taxel + 1);
            signals[own].copy_from_slice(&self.model(taxel, &unknowns).signals);
        }
    }

    fn invert(&self, signals: &[f64], noise: &[f64], found: &mut Inverted) {
        let each = signals.chunks(self.count()).zip(noise.chunks(self.count()));
        let bodies = each
            .enumerate()
            .map(|(taxel, (signals, noise))| self.read_back(taxel, signals, noise));
        let none = OneBody {
            force: f64::NAN,
            deviation: f64::NAN,
            by_noise: f64::NAN,
            state: CellState::Inconsistent,
            misfit: 0.0,
        };
        let bodies: Vec<OneBody> = bodies
            .map(|body| body.unwrap_or(OneBody { ..none }))
            .collect();
        found.converged = true;
        found.values = bodies.iter().map(|body| body.force).collect();
        found.deviations = bodies.iter().map(|body| body.deviation).collect();
        found.by_noise = bodies.iter().map(|body| body.by_noise).collect();
        found.states = bodies.iter().map(|body| body.state).collect();
        found.misfits = bodies.iter().map(|body| body.misfit).collect();
    }
}
