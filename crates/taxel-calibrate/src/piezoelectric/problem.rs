//! One element under known loads as a problem of least squares: three
//! constants, and peaks of test loads or a voltage over time as readings.

use crate::loads::{LEAST_SPAN, Loads};
use crate::split::OfSeries;
use taxel::mechanics::Profile;
use taxel::sensor::{Element, Sensor};
use taxel_numerics::least_squares::Problem;
use taxel_numerics::linear_chain::{Chain, Transfer};

/// d₃₃, R and μ, as in the sensor file.
pub(super) const NAMES: [&str; 3] = ["charge_per_force", "leak_resistance", "viscosity"];
pub(super) const UNITS: [&str; 3] = ["C/N", "ohm", "Pa s"];
pub(super) const GAIN: usize = 0;
pub(super) const LEAK: usize = 1;
pub(super) const VISCOSITY: usize = 2;
pub(super) const OWN: usize = 3;

/// Time constants after the last corner of a load until it has died away.
const FADED: f64 = 8.0;

/// Quantity that drives the element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Drive {
    /// Displacement of the surface, m.
    Displacement,
    /// Force on the element, N.
    Force,
}

/// One voltage of the bench.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reading {
    pub(super) line: usize,
    /// Amplitude of a test load, or the load at this moment; m or N.
    pub(super) load: f64,
    /// V.
    pub(super) voltage: f64,
    /// Standard deviation where the bench gives it, V.
    pub(super) deviation: Option<f64>,
    pub(super) marked: bool,
    pub(super) what: What,
}

impl OfSeries for Reading {
    /// All are of one element.
    fn series(&self) -> usize {
        0
    }

    fn is_marked(&self) -> bool {
        self.marked
    }
}

/// Kind of a voltage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum What {
    /// A peak of the profile with this number, in the direction of loading or
    /// against it.
    Peak {
        /// Index among the profiles.
        profile: usize,
        /// True if in the direction of loading.
        first: bool,
    },
    /// The output at this time, s.
    Sample(f64),
}

/// Device by the sensor file, with constants to be replaced.
#[derive(Debug, Clone)]
pub(crate) struct Device {
    sensor: Sensor,
    pub(super) drive: Drive,
}

/// The output of an element and how long it remembers.
struct Response {
    chain: Chain,
    /// Sign of the output under a rising load.
    sign: f64,
    /// Slowest time constant, s.
    slowest: f64,
}

impl Device {
    pub(super) fn new(sensor: &Sensor, drive: Drive) -> Self {
        Self {
            sensor: sensor.clone(),
            drive,
        }
    }

    /// Constants of the sensor file.
    pub(super) fn drawn(&self) -> [f64; OWN] {
        match &self.sensor.element {
            Element::Piezoelectric(element) => [
                element.ceramic.charge_per_force,
                element.ceramic.leak_resistance,
                element.cover.viscosity,
            ],
            _ => [f64::NAN; OWN],
        }
    }

    fn response(&self, at: &[f64]) -> Option<Response> {
        let mut sensor = self.sensor.clone();
        put(&mut sensor, at);
        let array = sensor.piezoelectric().ok()?;
        let transfer: Transfer = match self.drive {
            Drive::Force => array.output_per_force(),
            Drive::Displacement => array.output_per_displacement(array.path().ok()?),
        };
        let band = array.board.band;
        Some(Response {
            chain: Chain::new(&transfer).ok()?,
            sign: band.gain.signum(),
            slowest: band.high_pass.max(band.low_pass.unwrap_or(0.0)),
        })
    }
}

/// Puts the constants into a sensor.
pub(super) fn put(sensor: &mut Sensor, at: &[f64]) {
    if let Element::Piezoelectric(element) = &mut sensor.element {
        element.ceramic.charge_per_force = at[GAIN];
        element.ceramic.leak_resistance = at[LEAK];
        element.cover.viscosity = at[VISCOSITY];
    }
}

impl Response {
    /// Peaks for a load of one unit, in its direction and against it; of a
    /// cyclic load those of the last cycle.
    fn peaks(&self, profile: &Profile) -> [f64; 2] {
        let faded = FADED * self.slowest;
        let [from, to] = match *profile {
            Profile::Step { ramp } => [0.0, ramp + faded],
            Profile::Impact { ramp, dwell } => [0.0, 2.0 * ramp + dwell + faded],
            Profile::Cyclic { period, cycles, .. } | Profile::Sine { period, cycles } => [
                (f64::from(cycles) - 1.0) * period,
                f64::from(cycles) * period,
            ],
        };
        let [least, most] = self.chain.extremes(&profile.knots(1.0), from, to);
        if self.sign > 0.0 {
            [most, -least]
        } else {
            [-least, most]
        }
    }

    /// Outputs at `times` under the load along `path`, at rest before it.
    fn samples(&self, path: &[[f64; 2]], times: &[f64]) -> Vec<f64> {
        let first = path.first().map_or(0.0, |knot| knot[1]);
        let moved: Vec<[f64; 2]> = path.iter().map(|[t, x]| [*t, x - first]).collect();
        // Whatever stood before the first reading has faded, and the chain
        // passes nothing that stays.
        self.chain.respond(&moved, times)
    }
}

/// Least readings: three constants and five more.
const LEAST: usize = 8;

/// The readings of a table with what they were taken under.
pub(crate) struct Table {
    pub(super) device: Device,
    pub(super) readings: Vec<Reading>,
    /// Test loads that occur.
    pub(super) profiles: Vec<Profile>,
    /// Load over time, of a voltage over time.
    pub(super) path: Vec<[f64; 2]>,
}

impl Table {
    /// A table without readings.
    pub(super) fn new(device: Device) -> Self {
        Self {
            device,
            readings: Vec::new(),
            profiles: Vec::new(),
            path: Vec::new(),
        }
    }

    /// True if the voltages are those of a recording, not peaks.
    pub(super) fn is_recorded(&self) -> bool {
        !self.path.is_empty()
    }

    /// Outputs for the constants `at`; `None` where there is no stable chain.
    pub(super) fn voltages(&self, readings: &[Reading], at: &[f64]) -> Option<Vec<f64>> {
        let response = self.device.response(at)?;
        // Peaks grow in proportion to the load.
        let unit: Vec<[f64; 2]> = self.profiles.iter().map(|p| response.peaks(p)).collect();
        let times: Vec<f64> = readings
            .iter()
            .filter_map(|r| match r.what {
                What::Sample(time) => Some(time),
                What::Peak { .. } => None,
            })
            .collect();
        let mut samples = response.samples(&self.path, &times).into_iter();
        let voltage = |reading: &Reading| match reading.what {
            What::Peak { profile, first } => {
                Some(unit[profile][usize::from(!first)] * reading.load.abs())
            }
            What::Sample(_) => samples.next(),
        };
        readings.iter().map(voltage).collect()
    }

    /// Each reading with its output for the constants `at`; none without a stable chain.
    pub(super) fn beside_model<'a>(
        &self,
        readings: &'a [Reading],
        at: &[f64],
    ) -> impl Iterator<Item = (&'a Reading, f64)> + Clone + use<'a> {
        let model = self.voltages(readings, at).unwrap_or_default();
        readings.iter().zip(model)
    }

    /// Readings over what the constants `at` give, by least squares.
    pub(super) fn ratio(&self, readings: &[Reading], at: &[f64]) -> f64 {
        let (mut both, mut square) = (0.0, 0.0);
        for (reading, model) in self.beside_model(readings, at) {
            both += reading.voltage * model;
            square += model * model;
        }
        if square > 0.0 { both / square } else { 1.0 }
    }

    /// Loads of some readings: sizes of test loads, or a load over time.
    pub(super) fn loads(&self, readings: &[Reading]) -> Loads {
        let recorded = self.is_recorded();
        let load = |r: &Reading| if recorded { r.load } else { r.load.abs() };
        let (column, unit) = match self.device.drive {
            Drive::Displacement => ("displacement", ("um", 1e-6)),
            Drive::Force => ("force_z", ("mN", 1e-3)),
        };
        Loads {
            name: String::new(),
            column,
            unit,
            values: readings.iter().map(load).collect(),
            least: LEAST,
            // The element answers to changes, however large the load stays.
            span: if recorded { 0.0 } else { LEAST_SPAN },
            from_rest: false,
        }
    }
}

/// Readings of an element.
pub(super) struct Bench<'a> {
    pub(super) table: &'a Table,
    pub(super) readings: &'a [Reading],
    /// Standard deviation of a voltage without one of its own, V.
    pub(super) deviation: f64,
}

impl Problem for Bench<'_> {
    fn readings(&self) -> usize {
        self.readings.len()
    }

    fn residuals(&self, at: &[f64], residuals: &mut [f64]) -> bool {
        let Some(model) = self.table.voltages(self.readings, at) else {
            return false;
        };
        for ((residual, reading), model) in residuals.iter_mut().zip(self.readings).zip(model) {
            *residual = (reading.voltage - model) / reading.deviation.unwrap_or(self.deviation);
        }
        residuals.iter().all(|r| r.is_finite())
    }

    fn remedy(&self, together: &[usize]) -> String {
        let of = |place: usize| together.contains(&place);
        if of(VISCOSITY) {
            return "record fast ramps, with displacement and voltage on one clock".into();
        }
        if of(LEAK) {
            return "hold the load about as long as the time constant, or vary the period".into();
        }
        "load further".into()
    }
}

/// One indentation of a table.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Indentation {
    /// Forces on the elements by the gain of the drawing, N.
    pub(super) forces: Vec<f64>,
    /// Standard deviation of each, N.
    pub(super) deviation: f64,
    /// Centre of the probe on the developed surface, m.
    pub(super) place: [f64; 2],
    /// Radius of its contact, m, where the bench knows it.
    pub(super) radius: Option<f64>,
}

/// An indentation whose highest signal is below this many deviations is of no use.
const LEAST_PEAK: f64 = 6.0;

impl Indentation {
    pub(super) fn is_weak(&self) -> bool {
        let highest = self.forces.iter().copied().fold(0.0, f64::max);
        highest < LEAST_PEAK * self.deviation
    }
}
