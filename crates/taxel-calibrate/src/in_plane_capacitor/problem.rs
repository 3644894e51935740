//! The readings of in-plane sensors as a least-squares problem.

use crate::split::OfSeries;
use taxel::mechanics::{CompressedLayer, LARGEST_COMPRESSION, LayerKinematics, PublishedThinning};
use taxel::transduction::{CapacitanceLaw, InPlaneModel, PublishedFit, PublishedFringe};
use taxel_numerics::least_squares::{Parameter, Problem};

/// Parameters that all sensors share: modulus and scale of the end factor.
pub(super) const SHARED: usize = 2;
/// Parameters of each sensor: rest capacitance, then q, γ, t_min/T, n.
pub(super) const OWN: usize = 5;

/// The first parameter of a sensor.
pub(super) fn own(sensor: usize) -> usize {
    SHARED + OWN * sensor
}

/// One reading of the bench.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reading {
    pub(super) sensor: usize,
    pub(super) time: Option<f64>,
    pub(super) load: Load,
    /// F.
    pub(super) capacitance: f64,
    /// Standard deviations that the bench gives, N and F.
    pub(super) deviation: [Option<f64>; 2],
    pub(super) marked: bool,
}

/// What the bench did, and what it read of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Load {
    /// Pressed with a force, N, which is taken as exact.
    Force(f64),
    /// Pressed by a displacement, m, which is taken as exact.
    Displacement(f64),
    /// The same, with the force that was read, N.
    Both { displacement: f64, force: f64 },
}

impl Reading {
    /// Load that drives the bench: the displacement where it was read, m, else the force,
    /// N.
    pub(super) fn drive(&self) -> f64 {
        match self.load {
            Load::Force(load) | Load::Displacement(load) => load,
            Load::Both { displacement, .. } => displacement,
        }
    }

    /// Force that was read, N.
    pub(super) fn force(&self) -> Option<f64> {
        match self.load {
            Load::Force(force) | Load::Both { force, .. } => Some(force),
            Load::Displacement(_) => None,
        }
    }

    /// Displacement that was read, m.
    pub(super) fn displacement(&self) -> Option<f64> {
        match self.load {
            Load::Displacement(displacement) | Load::Both { displacement, .. } => {
                Some(displacement)
            }
            Load::Force(_) => None,
        }
    }

    /// True if the force was read beside the displacement.
    pub(super) fn has_both(&self) -> bool {
        matches!(self.load, Load::Both { .. })
    }
}

impl OfSeries for Reading {
    fn series(&self) -> usize {
        self.sensor
    }

    fn is_marked(&self) -> bool {
        self.marked
    }
}

/// Part of a reading that does not depend on the parameters, where the displacement was
/// read.
#[derive(Debug, Clone, Copy)]
struct Motion {
    compression: f64,
    /// s̄/μ = `alone` + k·`by_factor`, k the scale of the drawn end factor.
    alone: f64,
    by_factor: f64,
    law: Published,
}

/// The problem for one law.
pub(super) struct Bench<'a> {
    models: &'a [InPlaneModel],
    readings: &'a [Reading],
    law: CapacitanceLaw,
    /// For each reading; `None` where the compression follows from the force.
    motions: Vec<Option<Motion>>,
    /// Standard deviations of force and capacitance of each reading.
    pub(super) noise: Vec<[f64; 2]>,
    /// True if forces are readings beside displacements.
    with_force: bool,
}

/// The forces must rise, or a compression does not follow from them.
const LEAST_FACTOR: f64 = 0.65;

/// Names of the parameters of a sensor, as in its file.
pub(super) const NAMES: [&str; OWN] = [
    "rest_capacitance",
    "fringe_scale",
    "fringe_exponent",
    "least_thickness",
    "thinning_rate",
];
pub(super) const MODULUS: &str = "youngs_modulus";
pub(super) const END_SCALE: &str = "end_scale";
/// Least and largest end factor at the stiffest compression of the drawing.
pub(super) const FACTOR_BOUNDS: [f64; 2] = [LEAST_FACTOR, 20.0];

/// The device with the parameters `shared` (modulus, scale of the end factor) and `own`.
///
/// The electrodes keep the ratio of their modulus to that of the layer.
pub(super) fn with_values(
    model: &InPlaneModel,
    law: CapacitanceLaw,
    [modulus, end_scale]: [f64; SHARED],
    [rest, scale, exponent, least_thickness, rate]: [f64; OWN],
) -> InPlaneModel {
    let mut found = model.clone();
    found.law = law;
    found.layer.youngs_modulus = modulus;
    found.electrodes.stiffness = model
        .electrodes
        .stiffness
        .scaled(modulus / model.layer.youngs_modulus);
    found.layer.end_scale = end_scale;
    found.published_fit = Some(PublishedFit {
        thinning: PublishedThinning {
            least_thickness,
            rate,
        },
        fringe: PublishedFringe { scale, exponent },
    });
    found.stray_capacitance += rest - found.rest_capacitance();
    found
}

/// The device with the parameters `at` of all sensors, of which it is `sensor`.
pub(super) fn calibrated(
    model: &InPlaneModel,
    law: CapacitanceLaw,
    sensor: usize,
    at: &[f64],
) -> InPlaneModel {
    let values = std::array::from_fn(|k| at[own(sensor) + k]);
    with_values(model, law, [at[0], at[1]], values)
}

impl<'a> Bench<'a> {
    pub(super) fn new(
        models: &'a [InPlaneModel],
        readings: &'a [Reading],
        law: CapacitanceLaw,
        noise: Vec<[f64; 2]>,
    ) -> Self {
        let motion = |reading: &Reading| {
            let model = &models[reading.sensor];
            let compression = reading.displacement()? / model.layer.thickness;
            Motion::new(model, compression)
        };
        let motions: Vec<_> = readings.iter().map(motion).collect();
        Self {
            models,
            readings,
            law,
            with_force: readings.iter().any(Reading::has_both),
            motions,
            noise,
        }
    }

    /// Force and capacitance of a reading; `None` beyond the models.
    pub(super) fn predict(&self, at: &[f64], index: usize) -> Option<[f64; 2]> {
        let reading = &self.readings[index];
        let model = &self.models[reading.sensor];
        let motion = self.motion(at, index)?;
        let force = force_scale(&model.layer, at) * (motion.alone + at[1] * motion.by_factor);
        let change = self.change(at, reading.sensor, &motion)?;
        Some([force, at[own(reading.sensor)] - change])
    }

    /// Readings of force and capacitance less the model, SI; no misfit of a force that was
    /// not read.
    pub(super) fn misfits(&self, at: &[f64], index: usize) -> Option<[f64; 2]> {
        let [force, capacitance] = self.predict(at, index)?;
        let reading = &self.readings[index];
        let force = reading.force().map_or(0.0, |read| read - force);
        Some([force, reading.capacitance - capacitance])
    }

    /// Compression of the layer at a reading.
    pub(super) fn compression(&self, at: &[f64], index: usize) -> Option<f64> {
        Some(self.motion(at, index)?.compression)
    }

    fn motion(&self, at: &[f64], index: usize) -> Option<Motion> {
        let of_force = || self.motion_of_force(at, &self.readings[index]);
        self.motions[index].or_else(of_force)
    }

    fn motion_of_force(&self, at: &[f64], reading: &Reading) -> Option<Motion> {
        let model = &self.models[reading.sensor];
        let mut loaded = model.clone();
        loaded.layer.youngs_modulus = at[0];
        loaded.layer.end_scale = at[1];
        // Noise about zero is no pull.
        let force = reading.force()?.max(0.0);
        let compression = loaded.compression_from_force(force).ok()?;
        Motion::new(model, compression)
    }

    fn change(&self, at: &[f64], sensor: usize, motion: &Motion) -> Option<f64> {
        let model = &self.models[sensor];
        match self.law {
            CapacitanceLaw::Published => {
                let own = own(sensor);
                let law = &motion.law;
                let [scale, exponent] = [at[own + 1], at[own + 2]];
                let facing = law.facing(at[own + 3], at[own + 4]);
                Some(facing * scale * law.power(exponent))
            }
            CapacitanceLaw::Mechanics => {
                // Only the motion enters; the force of this state is not used.
                let state = model.compress(motion.compression).ok()?;
                model.change_by_mechanics(&state).ok()
            }
        }
    }

    /// Slopes of the change of one reading by q, γ, t_min/T and n.
    fn change_slopes(&self, at: &[f64], sensor: usize, motion: &Motion) -> [f64; OWN - 1] {
        if self.law == CapacitanceLaw::Mechanics {
            return [0.0; OWN - 1];
        }
        let own = own(sensor);
        let law = &motion.law;
        let [scale, exponent, least, rate] = [1, 2, 3, 4].map(|k| at[own + k]);
        let (facing, power) = (law.facing(least, rate), law.power(exponent));
        let thinned = -(-rate * law.compression).exp_m1();
        let thinning = scale * power * law.per_thickness;
        let by_rate = (1.0 - least) * law.compression * (1.0 - thinned);
        let logarithm = if law.compression > 0.0 {
            law.logarithm
        } else {
            0.0
        };
        [
            facing * power,
            facing * power * scale * logarithm,
            -thinning * thinned,
            thinning * by_rate,
        ]
    }

    /// Slopes of compression and capacitance against modulus and factor where the
    /// compression follows from the force: dC/dE and dC/dχ.
    fn slopes_through_force(&self, at: &[f64], reading: &Reading) -> Option<[f64; 2]> {
        let here = self.motion_of_force(at, reading)?;
        let model = &self.models[reading.sensor];
        if here.compression == 0.0 {
            return Some([0.0; 2]);
        }
        let step = (1e-5 * here.compression).min(0.5 * (LARGEST_COMPRESSION - here.compression));
        let step = step.max(1e-9);
        let [below, above] = [
            Motion::new(model, here.compression - step)?,
            Motion::new(model, here.compression + step)?,
        ];
        let stress = |m: &Motion| m.alone + at[1] * m.by_factor;
        let rise = stress(&above) - stress(&below);
        let fall =
            self.change(at, reading.sensor, &above)? - self.change(at, reading.sensor, &below)?;
        // At a fixed force E·s(e, χ) stays: s_e de = −s dE/E − s_χ dχ.
        Some([stress(&here) / at[0], here.by_factor].map(|moved| fall / rise * moved))
    }
}

fn force_scale(layer: &CompressedLayer, at: &[f64]) -> f64 {
    layer.contact_area() * at[0] / 3.0
}

impl Motion {
    fn new(model: &InPlaneModel, compression: f64) -> Option<Self> {
        let kinematics = LayerKinematics::new(compression.max(0.0)).ok()?;
        let aspect = model.layer.aspect();
        let compression = kinematics.compression();
        let ends = model.closed_layer().end_condition;
        let drawn = ends.factor(aspect, compression).ok()?;
        let ratio = model.force_ratio(compression);
        let alone = ratio * kinematics.mean_stress(aspect, 0.0);
        Some(Self {
            compression,
            alone,
            by_factor: ratio * kinematics.mean_stress(aspect, drawn) - alone,
            law: Published::new(model, &kinematics),
        })
    }
}

/// The published law at one state: X(t_min, n)·q·(U/D)^γ.
#[derive(Debug, Clone, Copy)]
struct Published {
    compression: f64,
    /// ln(U/D); −∞ at rest.
    logarithm: f64,
    /// ε₀ε_r w_e T/D.
    scale: f64,
    /// ε₀ε_r w_e T/d.
    per_thickness: f64,
}

impl Published {
    fn new(model: &InPlaneModel, kinematics: &LayerKinematics) -> Self {
        let scale = model.rest_capacitance_without_fringe();
        let middle = model.electrodes.middle();
        let stretch = 1.0 + model.layer.stretch_excess(kinematics, middle);
        let compression = kinematics.compression();
        let displacement = compression * model.layer.thickness;
        Self {
            compression,
            logarithm: (displacement / model.electrodes.gap).ln(),
            scale,
            per_thickness: scale / stretch,
        }
    }

    fn facing(&self, least: f64, rate: f64) -> f64 {
        let thinned = -(-rate * self.compression).exp_m1();
        self.scale - self.per_thickness * (1.0 - (1.0 - least) * thinned)
    }

    fn power(&self, exponent: f64) -> f64 {
        if self.compression > 0.0 {
            (exponent * self.logarithm).exp()
        } else {
            0.0
        }
    }
}

impl Problem for Bench<'_> {
    fn readings(&self) -> usize {
        self.readings.len() * if self.with_force { 2 } else { 1 }
    }

    fn residuals(&self, at: &[f64], residuals: &mut [f64]) -> bool {
        let count = self.readings.len();
        for index in 0..count {
            let Some([force, capacitance]) = self.misfits(at, index) else {
                return false;
            };
            let noise = self.noise[index];
            residuals[index] = capacitance / noise[1];
            if self.with_force {
                // Without a displacement the force is the load, no reading.
                let both = self.readings[index].has_both();
                residuals[count + index] = if both { force / noise[0] } else { 0.0 };
            }
        }
        true
    }

    fn slopes(&self, _: &[Parameter], at: &[f64], columns: &mut [Vec<f64>]) -> bool {
        let count = self.readings.len();
        for column in columns.iter_mut() {
            column.fill(0.0);
        }
        for (index, reading) in self.readings.iter().enumerate() {
            let noise = self.noise[index];
            let own = own(reading.sensor);
            let motion = if let Some(motion) = self.motions[index] {
                if reading.has_both() {
                    let scale = force_scale(&self.models[reading.sensor].layer, at) / noise[0];
                    let stress = motion.alone + at[1] * motion.by_factor;
                    columns[0][count + index] = -scale * stress / at[0];
                    columns[1][count + index] = -scale * motion.by_factor;
                }
                motion
            } else {
                let (Some(through), Some(motion)) = (
                    self.slopes_through_force(at, reading),
                    self.motion_of_force(at, reading),
                ) else {
                    return false;
                };
                // C falls with the change, and the change with a stiffer layer.
                columns[0][index] = -through[0] / noise[1];
                columns[1][index] = -through[1] / noise[1];
                motion
            };
            columns[own][index] = -1.0 / noise[1];
            for (k, slope) in self
                .change_slopes(at, reading.sensor, &motion)
                .iter()
                .enumerate()
            {
                columns[own + 1 + k][index] = slope / noise[1];
            }
        }
        true
    }

    fn remedy(&self, together: &[usize]) -> String {
        let kinds: Vec<usize> = together
            .iter()
            .filter(|j| **j >= SHARED)
            .map(|j| (j - SHARED) % OWN)
            .collect();
        let shared = together.iter().any(|j| *j < SHARED);
        if shared && !self.with_force {
            let missing = if self.readings.iter().any(|r| r.force().is_none()) {
                "force"
            } else {
                "displacement"
            };
            return format!("read the {missing} too, or give a measured modulus");
        }
        if shared {
            return "press further, or measure the modulus on a plain block of the layer".into();
        }
        let thinning = kinds.iter().any(|kind| *kind >= 3);
        let fringe = kinds.iter().any(|kind| *kind == 1 || *kind == 2);
        match (thinning, fringe) {
            (true, true) => {
                "press to a higher compression, take more readings below 1/n of the thickness, or \
                             measure the thickness of the electrodes under load"
                    .into()
            }
            (true, false) => "measure the thickness of the electrodes under load".into(),
            _ => "take more readings at small loads".into(),
        }
    }
}
