//! Magnets on springs over magnetometers: forces to fields, and back.
//!
//! The way back is one least-squares problem for the whole array. Its unknowns are the three forces
//! of each taxel and what else moves the readings: a uniform field, the temperature of the magnets, and all
//! in which a made skin differs from its drawing, each with what is known of it beforehand. The intervals
//! have all of them in it, and what none of them explains is a disturbance.

use super::search::{Found, Model, misfit, search, weight};
use super::{CellQuantity, CellState, ChainPart, Inverted, Network, PartError, PartParameter};
use crate::drawing::{DimensionLine, Label, Part, Shape, View};
use crate::electronics::NUMBER;
use crate::information::{Information, Unknown};
use crate::quantity::{ANGLE, FLUX_DENSITY, FORCE, LENGTH};
use crate::transduction::{MagnetPose, MagnetShape, VACUUM_PERMEABILITY};
use taxel_ground::summary::{Fact, fact, number, text};
use taxel_numerics::dense::{cholesky, cholesky_solve};

/// A magnet and what a force does to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SuspendedMagnet {
    /// Its shape.
    pub shape: MagnetShape,
    /// Its remanence, T.
    pub remanence: f64,
    /// Position of its middle without a load, from the middle of its taxel, m.
    pub rest: [f64; 3],
    /// Its tilt without a load, rad.
    pub tilt: [f64; 2],
    /// Displacement along x, y and z upwards, m/N, and tilt, rad/N, by the forces along x and y and
    /// the pressing one.
    pub compliance: [[f64; 3]; 5],
    /// Factor of what each force does.
    pub softness: [f64; 3],
}

impl SuspendedMagnet {
    /// Shows each of its numbers to `each`, which may change it.
    pub(super) fn shown(&mut self, each: &mut dyn FnMut(PartParameter, &mut f64)) {
        let mut show = |index: usize, unit, fitted, value: &mut f64| {
            let bounds = if *value == 0.0 {
                [-1.0, 1.0]
            } else {
                let ends = [0.5 * *value, 2.0 * *value];
                [ends[0].min(ends[1]), ends[0].max(ends[1])]
            };
            let parameter = PartParameter {
                name: MagnetMake::NAMES[index],
                unit,
                bounds,
                fitted,
                per_cell: true,
                absolute: index < REMANENCE,
            };
            each(parameter, value);
        };
        let [x, y, z] = &mut self.rest;
        show(0, "m", false, x);
        show(1, "m", false, y);
        show(2, "m", true, z);
        let [x, y] = &mut self.tilt;
        show(3, "rad", false, x);
        show(4, "rad", false, y);
        show(REMANENCE, "T", true, &mut self.remanence);
        for (axis, softness) in self.softness.iter_mut().enumerate() {
            show(SOFTNESS + axis, "", true, softness);
        }
    }
}

/// What a made skin differs in from its drawing.
#[derive(Debug, Clone, Copy)]
pub struct MagnetMake;

impl MagnetMake {
    /// How many numbers of a magnet there are.
    pub const COUNT: usize = 9;
    /// Their names in sensor file, calibration and reports.
    pub const NAMES: [&'static str; Self::COUNT] = [
        "magnet_x",
        "magnet_y",
        "magnet_height",
        "magnet_tilt_x",
        "magnet_tilt_y",
        "remanence",
        "softness_x",
        "softness_y",
        "softness_z",
    ];
}

/// Index of the remanence among [`MagnetMake::NAMES`], and of the first softness.
const REMANENCE: usize = 5;
const SOFTNESS: usize = 6;

/// A magnet above the magnetometers of each taxel; all magnets are read by all of them.
#[derive(Debug, Clone)]
pub struct MagnetArray {
    /// The magnet of each taxel.
    pub magnets: Vec<SuspendedMagnet>,
    /// Middle of each taxel, m.
    pub places: Vec<[f64; 2]>,
    /// Magnetometers of a taxel, from its middle, m.
    pub sensors: Vec<[f64; 2]>,
    /// Least height of the middle of a magnet, m.
    pub least_height: f64,
    /// Force up to which the suspension is linear, N.
    pub full_scale: f64,
    /// Noise of a reading along x, y and z, T, for `check`.
    pub noise: [f64; 3],
    /// Standard deviation of what an axis reads without any field, T.
    pub offset: f64,
    /// Standard deviation of each component of a uniform field, T.
    pub uniform_field: f64,
    /// Standard deviation of the relative change of all remanences by temperature.
    pub warming: f64,
    /// Standard deviation of each of [`MagnetMake::NAMES`].
    pub fabrication: [f64; MagnetMake::COUNT],
    /// Readings of all channels without a load, T, `NaN` where they were not captured; none before a
    /// capture.
    pub rest: Option<Vec<f64>>,
    /// What is wrong with its description.
    pub problem: Option<PartError>,
}

/// Standard deviations of the misfit at which readings contradict the model: noise alone gets there
/// once in 10⁹ frames.
const DISTURBED: f64 = 6.0;
/// A frame tells an unknown if it leaves less than this share of a deviation as large as the sensor.
const TOLD: f64 = 1e-2;

const AXES: [&str; 3] = ["x", "y", "z"];

/// Where an unknown that all taxels share is among them.
struct Shared {
    field: Option<usize>,
    /// The uniform field of the capture at rest.
    field_at_rest: Option<usize>,
    warming: Option<usize>,
    /// Number of all unknowns.
    count: usize,
}

impl MagnetArray {
    fn forces(&self) -> usize {
        3 * self.magnets.len()
    }

    /// The numbers of a magnet that are made otherwise than drawn, with their deviations.
    fn made(&self) -> impl Iterator<Item = (usize, f64)> {
        let each = self.fabrication.into_iter().enumerate();
        each.filter(|(_, deviation)| *deviation > 0.0)
    }

    /// Unknowns: forces, what is made otherwise, and these.
    fn shared(&self) -> Shared {
        let mut count = self.forces() + self.magnets.len() * self.made().count();
        let mut take = |wanted: bool, numbers: usize| {
            wanted.then(|| {
                count += numbers;
                count - numbers
            })
        };
        let with_field = self.uniform_field > 0.0;
        Shared {
            field: take(with_field, 3),
            field_at_rest: take(with_field && self.rest.is_some(), 3),
            warming: take(self.warming != 0.0, 1),
            count,
        }
    }

    /// A magnet with these numbers off.
    fn off(&self, magnet: usize, off: &[f64; MagnetMake::COUNT]) -> SuspendedMagnet {
        let mut made = self.magnets[magnet];
        for axis in 0..3 {
            made.rest[axis] += off[axis];
            made.softness[axis] *= 1.0 + off[SOFTNESS + axis];
        }
        made.tilt[0] += off[3];
        made.tilt[1] += off[4];
        made.remanence *= 1.0 + off[REMANENCE];
        made
    }

    fn pose(&self, magnet: usize, made: &SuspendedMagnet, force: [f64; 3]) -> MagnetPose {
        let moved = |row: usize| -> f64 {
            let each =
                (0..3).map(|axis| made.compliance[row][axis] * made.softness[axis] * force[axis]);
            each.sum()
        };
        let [x, y] = self.places[magnet];
        MagnetPose {
            position: [
                x + made.rest[0] + moved(0),
                y + made.rest[1] + moved(1),
                made.rest[2] + moved(2),
            ],
            tilt: [made.tilt[0] + moved(3), made.tilt[1] + moved(4)],
        }
    }

    /// Every magnetometer, taxel by taxel, m.
    fn points(&self) -> impl Iterator<Item = [f64; 3]> {
        let of = |[x, y]: &[f64; 2]| {
            let sensors = self.sensors.iter();
            let at = sensors.map(|[dx, dy]| [x + dx, y + dy, 0.0]);
            at.collect::<Vec<_>>()
        };
        self.places.iter().flat_map(of)
    }

    /// Fields of all magnets as they are at these forces, T.
    fn fields(&self, forces: &[f64]) -> Vec<f64> {
        let mut fields = vec![0.0; 3 * self.sensors.len() * self.places.len()];
        for (index, magnet) in self.magnets.iter().enumerate() {
            let force = std::array::from_fn(|axis| forces[3 * index + axis]);
            let pose = self.pose(index, magnet, force);
            for (point, field) in self.points().zip(fields.chunks_mut(3)) {
                let of = magnet.shape.field(magnet.remanence, &pose, point).field;
                field
                    .iter_mut()
                    .zip(of)
                    .for_each(|(sum, part)| *sum += part);
            }
        }
        fields
    }

    /// Readings and slopes where the unknowns, each over its deviation and forces over the full scale,
    /// have these values: a row for each channel of the frame, and one for each of the capture at rest
    /// if there was one. What was captured at rest is that of the skin as it was made: a frame is
    /// counted from it, and it says itself how that was.
    fn model(&self, unknowns: &[f64]) -> Model {
        let channels = 3 * self.sensors.len() * self.places.len();
        let made: Vec<(usize, f64)> = self.made().collect();
        let shared = self.shared();
        let rows = if self.rest.is_some() {
            2 * channels
        } else {
            channels
        };
        let mut model = Model {
            signals: vec![0.0; rows],
            slopes: vec![vec![0.0; shared.count]; rows],
        };
        let warmer = shared.warming.map_or(0.0, |at| self.warming * unknowns[at]);
        for index in 0..self.magnets.len() {
            let force: [f64; 3] =
                std::array::from_fn(|axis| self.full_scale * unknowns[3 * index + axis]);
            let first = self.forces() + index * made.len();
            let mut off = [0.0; MagnetMake::COUNT];
            for (slot, (what, deviation)) in made.iter().enumerate() {
                off[*what] = deviation * unknowns[first + slot];
            }
            let magnet = self.off(index, &off);
            let [loaded, unloaded] =
                [force, [0.0; 3]].map(|force| self.pose(index, &magnet, force));
            for (sensor, point) in self.points().enumerate() {
                let of = |pose: &MagnetPose| magnet.shape.field(magnet.remanence, pose, point);
                let (now, before) = (of(&loaded), self.rest.as_ref().map(|_| of(&unloaded)));
                for axis in 0..3 {
                    let channel = 3 * sensor + axis;
                    let by_pose = now.by_pose[axis].map(|slope| (1.0 + warmer) * slope);
                    let field = (1.0 + warmer) * now.field[axis];
                    let at_rest = before.map(|before| (before.field[axis], before.by_pose[axis]));
                    let of_make = |field: f64, by_pose: &[f64; 5], what: usize| match what {
                        pose if pose < REMANENCE => by_pose[pose],
                        REMANENCE => field / (1.0 + off[REMANENCE]),
                        _ => 0.0,
                    };
                    let by_force = |along: usize| -> f64 {
                        let rows = by_pose.iter().zip(&magnet.compliance);
                        magnet.softness[along]
                            * rows.map(|(slope, row)| slope * row[along]).sum::<f64>()
                    };
                    let row = &mut model.slopes[channel];
                    model.signals[channel] += field;
                    for along in 0..3 {
                        row[3 * index + along] = self.full_scale * by_force(along);
                    }
                    for (slot, (what, deviation)) in made.iter().enumerate() {
                        let slope = match what.checked_sub(SOFTNESS) {
                            Some(along) => by_force(along) * force[along] / (1.0 + off[*what]),
                            None => of_make(field, &by_pose, *what),
                        };
                        row[first + slot] = deviation * slope;
                    }
                    if let Some(at) = shared.warming {
                        row[at] += self.warming * now.field[axis];
                    }
                    let Some((field, by_pose)) = at_rest else {
                        continue;
                    };
                    model.signals[channels + channel] += field;
                    let row = &mut model.slopes[channels + channel];
                    for (slot, (what, deviation)) in made.iter().enumerate() {
                        row[first + slot] = deviation * of_make(field, &by_pose, *what);
                    }
                }
            }
        }
        for (start, at) in [(0, shared.field), (channels, shared.field_at_rest)] {
            let Some(at) = at else { continue };
            for channel in 0..channels {
                model.slopes[start + channel][at + channel % 3] = self.uniform_field;
                model.signals[start + channel] += self.uniform_field * unknowns[at + channel % 3];
            }
        }
        self.count_from_rest(&mut model, channels);
        model
    }

    /// Takes the readings of the frame as changes from those at rest, where these were captured: what
    /// an axis reads without a field is in both.
    fn count_from_rest(&self, model: &mut Model, channels: usize) {
        let Some(rest) = &self.rest else {
            return;
        };
        for (channel, rest) in rest.iter().enumerate().filter(|(_, rest)| rest.is_finite()) {
            model.signals[channel] += rest - model.signals[channels + channel];
            let (frame, at_rest) = model.slopes.split_at_mut(channels);
            for (slope, before) in frame[channel].iter_mut().zip(&at_rest[channel]) {
                *slope -= before;
            }
        }
    }

    /// Readings as [`Self::model`] has them, and the weight of each.
    fn readings(&self, signals: &[f64], noise: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let mut readings = signals.to_vec();
        let mut weights: Vec<f64> = noise.iter().zip(signals).map(weight).collect();
        for (channel, rest) in self.rest.iter().flatten().enumerate() {
            readings.push(*rest);
            weights.push(weight((&self.noise[channel % 3].hypot(self.offset), rest)));
        }
        (readings, weights)
    }

    /// Information of the readings about the five numbers of one magnet at rest, by noise alone.
    fn of_a_magnet(&self) -> Option<Information> {
        let magnet = self.magnets.first()?;
        let pose = self.pose(0, magnet, [0.0; 3]);
        let mut information = Information {
            unknowns: Vec::new(),
            jacobian: Vec::new(),
            noise: Vec::new(),
            prior: vec![0.0; 5],
        };
        for (name, dimension) in [
            ("x", &LENGTH),
            ("y", &LENGTH),
            ("z", &LENGTH),
            ("tilt_x", &ANGLE),
            ("tilt_y", &ANGLE),
        ] {
            let is_tilt = *dimension == ANGLE;
            information.unknowns.push(Unknown {
                name,
                dimension,
                full_scale: if is_tilt { 1.0 } else { magnet.rest[2] },
                beside: false,
            });
        }
        for point in self.points().take(self.sensors.len()) {
            let field = magnet.shape.field(magnet.remanence, &pose, point);
            for (row, noise) in field.by_pose.iter().zip(self.noise) {
                information.jacobian.push(row.to_vec());
                information.noise.push(noise);
            }
        }
        Some(information)
    }

    /// The state of the forces of a taxel.
    fn state(&self, taxel: usize, misfit: f64, found: &Inverted) -> CellState {
        let cells = 3 * taxel..3 * taxel + 3;
        let force = std::array::from_fn(|axis| found.values[3 * taxel + axis]);
        let height = self.pose(taxel, &self.magnets[taxel], force).position[2];
        if misfit > DISTURBED {
            CellState::Inconsistent
        } else if found.deviations[cells]
            .iter()
            .any(|deviation| *deviation > self.full_scale)
        {
            CellState::Ambiguous
        } else if height < self.least_height || force.iter().any(|f| f.abs() > self.full_scale) {
            CellState::Beyond
        } else {
            CellState::Ok
        }
    }

    /// Covariance of the forces at the end of a search, and with it all that is said of them; `noise` is that of
    /// the readings of the frame.
    fn judge(
        &self,
        ended: &Found,
        (weights, noise): (&[f64], &[f64]),
        squares: &[[f64; 2]],
        found: &mut Inverted,
    ) {
        let count = self.forces();
        let unknowns = &ended.unknowns;
        found.by_noise.clear();
        let covariance: Vec<Vec<f64>> = (0..count)
            .map(|column| {
                let unit: Vec<f64> = (0..unknowns.len())
                    .map(|row| if row == column { self.full_scale } else { 0.0 })
                    .collect();
                let solved = cholesky_solve(&ended.factor, &unit);
                found.by_noise.push(ended.by_noise(&solved, weights, noise));
                solved[..count]
                    .iter()
                    .map(|value| value * self.full_scale)
                    .collect()
            })
            .collect();
        found.values = unknowns[..count]
            .iter()
            .map(|f| f * self.full_scale)
            .collect();
        found.deviations = (0..count).map(|i| covariance[i][i].sqrt()).collect();
        found.spread = cholesky(covariance).unwrap_or_default();
        for (row, parts) in found.spread.iter_mut().enumerate() {
            parts[row + 1..].fill(0.0);
        }
        found.misfits = squares
            .iter()
            .map(|[sum, freedom]| misfit(*sum, *freedom))
            .collect();
        found.states.clear();
        for taxel in 0..self.magnets.len() {
            let state = self.state(taxel, found.misfits[taxel], found);
            found.states.extend([state; 3]);
        }
    }

    /// Squares of the residuals of each taxel, with those of what is its own or shared, and how many
    /// more readings it has than forces.
    fn squares(&self, unknowns: &[f64], residuals: &[f64], weights: &[f64]) -> Vec<[f64; 2]> {
        let (per_taxel, made) = (3 * self.sensors.len(), self.made().count());
        let channels = per_taxel * self.magnets.len();
        let square = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>();
        let (first, end) = (self.forces(), self.forces() + made * self.magnets.len());
        let of_taxel = |taxel: usize| {
            let own = first + made * taxel..first + made * (taxel + 1);
            let mut sum = square(&unknowns[own]) + square(&unknowns[end..]);
            let mut freedom = -3.0;
            for start in (0..residuals.len()).step_by(channels) {
                let rows = start + per_taxel * taxel..start + per_taxel * (taxel + 1);
                sum += square(&residuals[rows.clone()]);
                freedom += weights[rows].iter().filter(|weight| **weight > 0.0).count() as f64;
            }
            [sum, freedom]
        };
        (0..self.magnets.len()).map(of_taxel).collect()
    }
}

impl ChainPart for MagnetArray {
    fn parameters(&mut self, each: &mut dyn FnMut(PartParameter, &mut f64)) {
        for magnet in &mut self.magnets {
            magnet.shown(each);
        }
    }

    fn facts(&self) -> Vec<Fact> {
        let Some(magnet) = self.magnets.first() else {
            return Vec::new();
        };
        let mut facts = Vec::new();
        let source = "element.magnetic_skin.suspension";
        for (axis, name) in AXES.into_iter().enumerate() {
            let moved = magnet.compliance[axis][axis].abs();
            let value = number(moved, "m_per_n", "mm/N", 1e-3);
            facts.push(fact(
                "mechanics",
                format!("displacement_{name}_per_force"),
                value,
                source,
            ));
        }
        let source = "element.magnetic_skin.magnet";
        let moment = magnet.remanence * magnet.shape.volume() / VACUUM_PERMEABILITY;
        let value = number(moment, "a_m2", "mA m2", 1e-3);
        facts.push(fact("transduction", "magnetic_moment", value, source));
        let rest = self.fields(&vec![0.0; self.forces()]);
        let largest = rest
            .iter()
            .fold(0.0_f64, |largest, field| largest.max(field.abs()));
        let value = number(largest, "t", "uT", 1e-6);
        facts.push(fact("transduction", "largest_field_at_rest", value, source));
        facts.extend(self.observability());
        let names = text(&MagnetMake::NAMES.join(", "));
        let source = "for fabrication and calibration";
        facts.push(fact("transduction", "numbers_of_the_parts", names, source));
        facts
    }

    fn check(&self) -> Result<(), PartError> {
        self.problem.clone().map_or(Ok(()), Err)
    }

    fn views(&self) -> Vec<View> {
        self.magnets
            .first()
            .map_or_else(Vec::new, |magnet| self.drawn(magnet))
    }
}

impl MagnetArray {
    /// Deviations of the five numbers of a magnet by noise alone, and which of them one frame does not
    /// tell.
    fn observability(&self) -> Vec<Fact> {
        let Some(mut information) = self.of_a_magnet() else {
            return Vec::new();
        };
        let source = "Cramer-Rao bound of five unknowns at rest, noise alone";
        let exact = information.covariance();
        // With nothing known, that each may be anywhere in the sensor.
        let sizes: Vec<f64> = information
            .unknowns
            .iter()
            .map(|one| one.full_scale)
            .collect();
        information.prior = sizes.iter().map(|size| size.powi(-2)).collect();
        let known = information.covariance();
        let deviations = |covariance: Vec<Vec<f64>>| -> Vec<f64> {
            (0..5)
                .map(|index| covariance[index][index].sqrt())
                .collect()
        };
        let (exact, known) = (exact.map(deviations), known.map(deviations));
        let unknowns = || information.unknowns.iter().zip(&sizes).enumerate();
        if let Some(exact) = &exact {
            return unknowns()
                .map(|(index, (unknown, _))| {
                    let value = if *unknown.dimension == ANGLE {
                        number(exact[index], "rad", "mrad", 1e-3)
                    } else {
                        number(exact[index], "m", "um", 1e-6)
                    };
                    let name = format!("deviation_of_the_magnet_{}", unknown.name);
                    fact("estimation", name, value, source)
                })
                .collect();
        }
        let left =
            |index: usize, size: f64| known.as_ref().is_none_or(|of| of[index] > TOLD * size);
        let names: Vec<&str> = unknowns()
            .filter(|(index, (_, size))| left(*index, **size))
            .map(|(_, (unknown, _))| unknown.name)
            .collect();
        let words = format!(
            "{}: {} readings cannot give five numbers; forces follow where the suspension ties them",
            names.join(", "),
            3 * self.sensors.len()
        );
        vec![fact("estimation", "not_observable", text(&words), source)]
    }

    /// The magnet above its magnetometers, from above and from the side.
    fn drawn(&self, magnet: &SuspendedMagnet) -> Vec<View> {
        let [width, height] = magnet.shape.outline();
        let [x, _, z] = magnet.rest;
        let reach = self
            .sensors
            .iter()
            .flatten()
            .fold(width, |reach, at| reach.max(at.abs()));
        let (half, chip) = (1.4 * reach, 0.12 * reach);
        let mut above = View {
            title: "the magnet of a taxel over its magnetometers, from above".into(),
            ..View::default()
        };
        let mut side = View {
            title: "from the side".into(),
            ..View::default()
        };
        side.shapes.push(Shape::rectangle(
            Part::Base,
            [-half, -2.0 * chip],
            [half, -chip],
        ));
        side.shapes.push(Shape::rectangle(
            Part::Elastomer,
            [-half, 0.0],
            [half, z + height],
        ));
        above.shapes.push(match &magnet.shape {
            MagnetShape::Cuboid(block) => {
                let [a, b, _] = block.sides.map(|side| 0.5 * side);
                let [x, y, _] = magnet.rest;
                Shape::rectangle(Part::Magnet, [x - a, y - b], [x + a, y + b])
            }
            _ => Shape::circle(Part::Magnet, [magnet.rest[0], magnet.rest[1]], 0.5 * width),
        });
        side.shapes.push(match &magnet.shape {
            MagnetShape::Sphere(_) => Shape::circle(Part::Magnet, [x, z], 0.5 * width),
            _ => Shape::rectangle(
                Part::Magnet,
                [x - 0.5 * width, z - 0.5 * height],
                [x + 0.5 * width, z + 0.5 * height],
            ),
        });
        for (index, [x, y]) in self.sensors.iter().enumerate() {
            let around = |at: [f64; 2]| {
                let low = [at[0] - chip, at[1] - chip];
                Shape::rectangle(Part::Chip, low, [at[0] + chip, at[1] + chip])
            };
            above.shapes.push(around([*x, *y]));
            above.labels.push(Label {
                at: [*x, y + 2.0 * chip],
                text: format!("s{index}"),
            });
            side.shapes.push(Shape::rectangle(
                Part::Chip,
                [x - chip, -chip],
                [x + chip, 0.0],
            ));
        }
        let low = [x - 0.5 * width, z + 0.5 * height];
        side.dimensions.push(DimensionLine::new(
            low,
            [x + 0.5 * width, low[1]],
            14.0,
            "magnet",
        ));
        side.dimensions
            .push(DimensionLine::new([half, 0.0], [half, z], 14.0, "z"));
        vec![above, side]
    }
}

impl Network for MagnetArray {
    fn boxed(&self) -> Box<dyn Network> {
        Box::new(self.clone())
    }

    fn channels(&self, cells: usize) -> usize {
        cells * self.sensors.len()
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
        let mut at: Vec<f64> = values.iter().map(|force| force / self.full_scale).collect();
        let shared = self.shared();
        at.resize(shared.count, 0.0);
        let model = self.model(&at);
        let (_, weights) = self.readings(&vec![0.0; noise.len()], noise);
        let used = || {
            weights
                .iter()
                .enumerate()
                .filter(|(_, weight)| **weight > 0.0)
        };
        let force = |axis: usize, beside| Unknown {
            name: ["force_x", "force_y", "force_z"][axis],
            dimension: &FORCE,
            full_scale: self.full_scale,
            beside,
        };
        let forces = (0..self.forces()).map(|index| force(index % 3, index / 3 != taxel));
        let made = self.made().map(|(what, deviation)| Unknown {
            name: MagnetMake::NAMES[what],
            dimension: match what {
                0..=2 => &LENGTH,
                3 | 4 => &ANGLE,
                _ => &NUMBER,
            },
            full_scale: deviation,
            beside: true,
        });
        let made: Vec<Unknown> = made.collect();
        let of_all = made
            .iter()
            .cycle()
            .take(made.len() * self.magnets.len())
            .copied();
        let of_field = |names: [&'static str; 3]| {
            names.map(|name| Unknown {
                name,
                dimension: &FLUX_DENSITY,
                full_scale: self.uniform_field,
                beside: true,
            })
        };
        let field = of_field(["uniform_field_x", "uniform_field_y", "uniform_field_z"]);
        let at_rest = of_field(["rest_field_x", "rest_field_y", "rest_field_z"]);
        let warming = Unknown {
            name: "warming",
            dimension: &NUMBER,
            full_scale: self.warming.abs(),
            beside: true,
        };
        let mut unknowns: Vec<Unknown> = forces.chain(of_all).collect();
        unknowns.extend(shared.field.into_iter().flat_map(|_| field));
        unknowns.extend(shared.field_at_rest.into_iter().flat_map(|_| at_rest));
        unknowns.extend(shared.warming.map(|_| warming));
        let sizes: Vec<f64> = unknowns.iter().map(|one| one.full_scale).collect();
        let row = |index: usize| -> Vec<f64> {
            let slopes = model.slopes[index].iter().zip(&sizes);
            slopes.map(|(slope, size)| slope / size).collect()
        };
        Some(Information {
            jacobian: used().map(|(index, _)| row(index)).collect(),
            noise: used().map(|(_, weight)| 1.0 / weight).collect(),
            prior: (0..sizes.len())
                .map(|index| {
                    if index < self.forces() {
                        0.0
                    } else {
                        sizes[index].powi(-2)
                    }
                })
                .collect(),
            unknowns,
        })
    }

    fn between(&self, taxel: usize, values: &[f64]) -> Vec<(CellQuantity, f64)> {
        let magnet = &self.magnets[taxel];
        let force = std::array::from_fn(|axis| values[3 * taxel + axis]);
        let pose = self.pose(taxel, magnet, force);
        let [x, y] = self.places[taxel];
        let [px, py, pz] = pose.position;
        let length = |name| CellQuantity {
            name,
            dimension: Some(&LENGTH),
            unit: ("mm", 1e-3, "m"),
        };
        let angle = |name| CellQuantity {
            name,
            dimension: Some(&ANGLE),
            unit: ("mrad", 1e-3, "rad"),
        };
        vec![
            (length("magnet_x"), px - x),
            (length("magnet_y"), py - y),
            (length("magnet_z"), pz),
            (angle("magnet_tilt_x"), pose.tilt[0]),
            (angle("magnet_tilt_y"), pose.tilt[1]),
        ]
    }

    fn takes(&self, of_cell: CellQuantity) -> bool {
        of_cell.name == "force"
    }

    fn quantity(&self, _of_cell: CellQuantity) -> CellQuantity {
        CellQuantity {
            name: "flux_density",
            dimension: Some(&FLUX_DENSITY),
            unit: ("uT", 1e-6, "t"),
        }
    }

    fn read(&self, values: &[f64], signals: &mut [f64]) {
        signals.copy_from_slice(&self.fields(values));
        let Some(rest) = &self.rest else {
            return;
        };
        let drawn = self.fields(&vec![0.0; self.forces()]);
        for (signal, (rest, drawn)) in signals.iter_mut().zip(rest.iter().zip(drawn)) {
            if rest.is_finite() {
                *signal += rest - drawn;
            }
        }
    }

    fn invert(&self, signals: &[f64], noise: &[f64], found: &mut Inverted) {
        let (readings, weights) = self.readings(signals, noise);
        let over_full_scale = |force: &f64| {
            if force.is_finite() {
                force / self.full_scale
            } else {
                0.0
            }
        };
        let mut start: Vec<f64> = found.values.iter().map(over_full_scale).collect();
        start.resize(self.shared().count, 0.0);
        let model = |unknowns: &[f64]| self.model(unknowns);
        let ended = search(model, start, &readings, &weights, self.forces());
        found.converged = ended.is_some();
        if let Some(ended) = ended {
            let squares = self.squares(&ended.unknowns, &ended.residuals, &weights);
            self.judge(&ended, (&weights, noise), &squares, found);
        }
    }
}
