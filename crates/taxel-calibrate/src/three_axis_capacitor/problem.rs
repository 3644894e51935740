//! One three-axis unit under known forces as a problem of least squares.
//!
//! The gauge errs, too, along each axis by its own σ. With J = ∂C/∂F the misfit of the
//! four capacitances of a reading has the covariance σ_C² I + J diag(σ_x², σ_y², σ_z²) Jᵀ;
//! each reading is multiplied by the inverse of its Cholesky factor.
//!
//! The model and J are taken at the most likely force F̂ of a reading, not at that of the
//! gauge: the misfit is C − C(F̂) − J·(F − F̂). This is the fit in which the true forces are
//! unknowns of their own. At the force of the gauge, the bend of C over F would turn the
//! gauge's noise into a bias.

use crate::split::OfSeries;
use taxel::mechanics::{SIDE_X, SIDE_Y};
use taxel::transduction::ThreeAxisModel;
use taxel_numerics::dense::dot;
use taxel_numerics::least_squares::{Parameter, Problem, linear};

/// Names of the four capacitors.
pub(super) const CAPACITORS: [&str; 4] = ["11", "12", "21", "22"];
/// Names of the axes.
pub(super) const AXES: [&str; 3] = ["x", "y", "z"];
/// Kinds of readings with a noise of their own: forces along x, y and z, capacitances.
pub(super) const KINDS: usize = 4;
/// The kind of the capacitances.
pub(super) const CAPACITANCE: usize = 3;
/// Parameters of a unit: four parallel capacitances, four air gaps, nine
/// compliances by rows, two sinkings of the bump.
pub(super) const OWN: usize = 19;
/// Index of the first air gap.
pub(super) const GAP: usize = 4;
/// Index of the first compliance.
pub(super) const COMPLIANCE: usize = 8;
/// Index of the first sinking.
pub(super) const SINKING: usize = 17;

/// One reading of one taxel, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reading {
    pub(super) taxel: usize,
    pub(super) force: [f64; 3],
    /// True if a gauge read the force along each axis; else it is exact.
    pub(super) gauged: [bool; 3],
    pub(super) capacitance: [f64; 4],
    /// Standard deviation of each kind, where the bench gives it.
    pub(super) deviation: [Option<f64>; KINDS],
    pub(super) marked: bool,
}

impl OfSeries for Reading {
    fn series(&self) -> usize {
        self.taxel
    }

    fn is_marked(&self) -> bool {
        self.marked
    }
}

/// Parallel capacitances measured otherwise, and their deviation, F.
pub(crate) type Measured = Option<([f64; 4], f64)>;

/// What is known of the four parallel capacitances before the readings, F.
#[derive(Debug, Clone, Copy)]
pub(super) struct Known {
    values: [f64; 4],
    /// Makes of their errors four independent ones of unit deviation.
    whitening: [[f64; 4]; 4],
}

impl Known {
    /// Measured each by itself.
    pub(super) fn measured((values, deviation): ([f64; 4], f64)) -> Self {
        let row = |i: usize| std::array::from_fn(|k| if i == k { 1.0 / deviation } else { 0.0 });
        Self {
            values,
            whitening: std::array::from_fn(row),
        }
    }

    /// A value that all four have from what surrounds them: its error is common to them, so that
    /// their mean is known no better than one of them. They may differ by as much.
    pub(super) fn common(value: f64, deviation: f64) -> Self {
        const MEAN: [f64; 4] = [0.25; 4];
        const BETWEEN: [[f64; 4]; 3] = [
            [0.5, 0.5, -0.5, -0.5],
            [0.5, -0.5, 0.5, -0.5],
            [0.5, -0.5, -0.5, 0.5],
        ];
        let [first, second, third] = BETWEEN;
        Self {
            values: [value; 4],
            whitening: [MEAN, first, second, third].map(|row| row.map(|part| part / deviation)),
        }
    }
}

/// Name of a parameter of a unit.
pub(super) fn name(place: usize) -> String {
    match place {
        0..GAP => format!("parallel_capacitance_{}", CAPACITORS[place]),
        GAP..COMPLIANCE => format!("air_gap_{}", CAPACITORS[place - GAP]),
        COMPLIANCE..SINKING => {
            let [row, column] = [(place - COMPLIANCE) / 3, (place - COMPLIANCE) % 3];
            format!("compliance_{}{}", AXES[row], AXES[column])
        }
        _ => format!("bump_sinking_{}", AXES[place - SINKING]),
    }
}

/// SI unit of a parameter of a unit.
pub(super) fn unit(place: usize) -> &'static str {
    match place {
        0..GAP => "F",
        GAP..COMPLIANCE => "m",
        COMPLIANCE..SINKING => "m/N",
        _ => "",
    }
}

/// The parameters of a unit.
pub(super) fn values(unit: &ThreeAxisModel) -> Vec<f64> {
    let (plates, suspension) = (&unit.plates, &unit.suspension);
    let mut values = Vec::with_capacity(OWN);
    values.extend(plates.parallel_capacitance);
    values.extend(plates.air_gap);
    values.extend(suspension.compliance.as_flattened());
    values.extend(suspension.bump_sinking);
    values
}

/// `drawn` with the parameters `at` in the place of its own.
pub(super) fn with_values(drawn: &ThreeAxisModel, at: &[f64]) -> ThreeAxisModel {
    let mut unit = *drawn;
    unit.plates.parallel_capacitance.copy_from_slice(&at[..GAP]);
    unit.plates.air_gap.copy_from_slice(&at[GAP..COMPLIANCE]);
    let compliance = unit.suspension.compliance.as_flattened_mut();
    compliance.copy_from_slice(&at[COMPLIANCE..SINKING]);
    unit.suspension.bump_sinking = [at[SINKING], at[SINKING + 1]];
    unit
}

/// A unit, its readings, and what each reading's misfits are multiplied by.
pub(super) struct Bench {
    drawn: ThreeAxisModel,
    /// At their most likely forces, with capacitances less J·(F − F̂).
    readings: Vec<Reading>,
    whitening: Vec<Whitening>,
    /// What is known of the parallel capacitances: four more readings.
    known: Option<Known>,
}

/// Misfits of four capacitances to four numbers of unit variance.
#[derive(Debug, Clone, Copy)]
pub(super) struct Whitening {
    rows: [[f64; 4]; 4],
    /// ∂C/∂F along each axis that a gauge read, zero along the others.
    by_force: [[f64; 4]; 3],
}

impl Whitening {
    /// For a reading with deviations of each kind (N, F) of a unit; `None` where a tile
    /// touches.
    fn new(unit: &ThreeAxisModel, reading: &Reading, deviation: [f64; KINDS]) -> Option<Self> {
        let jacobian = unit.linearise(reading.force)?.jacobian;
        let by_force: [[f64; 4]; 3] = std::array::from_fn(|axis| {
            let gauged = f64::from(u8::from(reading.gauged[axis]));
            jacobian.map(|row| gauged * row[axis])
        });
        let reached: Vec<[f64; 4]> = by_force
            .iter()
            .zip(deviation)
            .map(|(slopes, deviation)| slopes.map(|slope| slope * deviation))
            .filter(|reached| reached.iter().any(|part| *part != 0.0))
            .collect();
        let basis = basis(&reached);
        let mut covariance = [[0.0; 4]; 4];
        for a in 0..4 {
            covariance[a][a] = deviation[CAPACITANCE].powi(2);
            for b in 0..4 {
                let both = |v: &[f64; 4]| dot(v, &basis[a]) * dot(v, &basis[b]);
                covariance[a][b] += reached.iter().map(both).sum::<f64>();
            }
        }
        Some(Self {
            rows: times_inverse_factor(covariance, basis)?,
            by_force,
        })
    }

    fn apply(&self, misfit: [f64; 4]) -> [f64; 4] {
        self.rows.map(|row| dot(&row, &misfit))
    }

    /// Σ·Jᵀ·V⁻¹ times a misfit: by how much the most likely force is beyond that of the gauge.
    fn most_likely(&self, misfit: [f64; 4], deviation: [f64; KINDS]) -> [f64; 3] {
        let whitened = self.apply(misfit);
        std::array::from_fn(|axis| {
            let along = dot(&self.apply(self.by_force[axis]), &whitened);
            deviation[axis].powi(2) * along
        })
    }

    /// Covariance of the four numbers by an error of each kind of deviation one.
    pub(super) fn unit_covariances(&self) -> [[[f64; 4]; 4]; KINDS] {
        let mut found = [[[0.0; 4]; 4]; KINDS];
        for (found, slopes) in found.iter_mut().zip(self.by_force) {
            let moved = self.apply(slopes);
            *found = moved.map(|a| moved.map(|b| a * b));
        }
        found[CAPACITANCE] = self.rows.map(|a| self.rows.map(|b| dot(&a, &b)));
        found
    }
}

/// Four directions at right angles, the first ones spanning `reached`.
fn basis(reached: &[[f64; 4]]) -> [[f64; 4]; 4] {
    let unit = |i: usize| std::array::from_fn(|k| f64::from(u8::from(i == k)));
    let mut found: Vec<[f64; 4]> = Vec::with_capacity(4);
    for candidate in reached.iter().copied().chain((0..4).map(unit)) {
        let mut left: [f64; 4] = candidate;
        // Twice is enough for right angles in rounding.
        for _ in 0..2 {
            for direction in &found {
                let along = dot(direction, &left);
                left = std::array::from_fn(|k| left[k] - along * direction[k]);
            }
        }
        let length = dot(&left, &left).sqrt();
        if found.len() < 4 && length > 1e-6 * dot(&candidate, &candidate).sqrt() {
            found.push(left.map(|x| x / length));
        }
    }
    std::array::from_fn(|k| found.get(k).copied().unwrap_or_default())
}

/// L⁻¹·basis with covariance = L·Lᵀ.
fn times_inverse_factor(covariance: [[f64; 4]; 4], basis: [[f64; 4]; 4]) -> Option<[[f64; 4]; 4]> {
    let mut factor = [[0.0; 4]; 4];
    let mut rows = basis;
    for i in 0..4 {
        for j in 0..i {
            let sum: f64 = (0..j).map(|k| factor[i][k] * factor[j][k]).sum();
            factor[i][j] = (covariance[i][j] - sum) / factor[j][j];
        }
        let sum: f64 = (0..i).map(|k| factor[i][k] * factor[i][k]).sum();
        factor[i][i] = (covariance[i][i] - sum).sqrt();
        for j in 0..i {
            let share = factor[i][j];
            rows[i] = std::array::from_fn(|k| rows[i][k] - share * rows[j][k]);
        }
        rows[i] = rows[i].map(|x| x / factor[i][i]);
    }
    rows.as_flattened()
        .iter()
        .all(|x| x.is_finite())
        .then_some(rows)
}

impl Bench {
    /// `deviations` of each kind of each reading; `None` where the unit `at` which the
    /// whitening is made touches. `settled` says that this unit is near the best one, so that
    /// the most likely forces can be found with it.
    pub(super) fn new(
        drawn: &ThreeAxisModel,
        (at, settled): (&ThreeAxisModel, bool),
        readings: &[Reading],
        deviations: &[[f64; KINDS]],
        known: Option<Known>,
    ) -> Option<Self> {
        let steps = if settled { STEPS } else { 0 };
        let pairs = readings.iter().zip(deviations);
        let found = pairs.map(|(reading, deviation)| {
            likely(at, reading, *deviation, steps).or_else(|| likely(at, reading, *deviation, 0))
        });
        let found: Vec<(Reading, Whitening)> = found.collect::<Option<_>>()?;
        let (readings, whitening) = found.into_iter().unzip();
        Some(Self {
            drawn: *drawn,
            readings,
            known,
            whitening,
        })
    }

    pub(super) fn whitening(&self) -> &[Whitening] {
        &self.whitening
    }

    /// Slopes of all residuals by each parameter.
    pub(super) fn whitened_slopes(&self, at: &[f64]) -> Vec<Vec<f64>> {
        let mut columns = vec![vec![0.0; self.readings()]; at.len()];
        self.slopes(&[], at, &mut columns);
        columns
    }
}

/// A reading at its most likely force for a unit, and its whitening there; `None` where a
/// tile touches.
fn likely(
    unit: &ThreeAxisModel,
    reading: &Reading,
    deviation: [f64; KINDS],
    steps: usize,
) -> Option<(Reading, Whitening)> {
    let mut moved = *reading;
    let mut whitening = Whitening::new(unit, &moved, deviation)?;
    for _ in 0..steps {
        let beyond = whitening.most_likely(misfit(unit, &moved)?, deviation);
        moved.force = std::array::from_fn(|axis| reading.force[axis] + beyond[axis]);
        whitening = Whitening::new(unit, &moved, deviation)?;
        for (i, capacitance) in moved.capacitance.iter_mut().enumerate() {
            let back = (0..3).map(|axis| whitening.by_force[axis][i] * beyond[axis]);
            *capacitance = reading.capacitance[i] + back.sum::<f64>();
        }
    }
    Some((moved, whitening))
}

/// Measured less modelled capacitances of a reading, F; `None` where a tile
/// touches.
pub(super) fn misfit(unit: &ThreeAxisModel, reading: &Reading) -> Option<[f64; 4]> {
    let (_, response) = unit.predict(reading.force);
    if response.closed().contains(&true) {
        return None;
    }
    let model = response.capacitance();
    Some(std::array::from_fn(|i| reading.capacitance[i] - model[i]))
}

/// Gauge less model: the force along each gauged axis by which the gauge
/// stands off the four capacitances, N; `None` where a tile touches.
pub(super) fn force_error(unit: &ThreeAxisModel, reading: &Reading) -> Option<[f64; 3]> {
    let axes: Vec<usize> = (0..3).filter(|axis| reading.gauged[*axis]).collect();
    let mut moved = *reading;
    for _ in 0..STEPS {
        let misfit = misfit(unit, &moved)?;
        let jacobian = unit.linearise(moved.force)?.jacobian;
        let own = |row: &[f64; 3]| axes.iter().map(|axis| row[*axis]).collect();
        let design: Vec<Vec<f64>> = jacobian.iter().map(own).collect();
        let found = linear::solve(&design, &misfit)?;
        for (axis, step) in axes.iter().zip(found.coefficients) {
            moved.force[*axis] += step;
        }
    }
    Some(std::array::from_fn(|axis| {
        reading.force[axis] - moved.force[axis]
    }))
}

impl Problem for Bench {
    fn readings(&self) -> usize {
        4 * (self.readings.len() + usize::from(self.known.is_some()))
    }

    fn residuals(&self, at: &[f64], residuals: &mut [f64]) -> bool {
        let unit = with_values(&self.drawn, at);
        for (index, reading) in self.readings.iter().enumerate() {
            let Some(misfit) = misfit(&unit, reading) else {
                return false;
            };
            let whitened = self.whitening[index].apply(misfit);
            residuals[4 * index..4 * index + 4].copy_from_slice(&whitened);
        }
        if let Some(known) = &self.known {
            let last = 4 * self.readings.len();
            for (row, residual) in known.whitening.iter().zip(&mut residuals[last..]) {
                let parts = row.iter().zip(known.values).zip(at);
                *residual = parts.map(|((part, value), at)| part * (value - at)).sum();
            }
        }
        true
    }

    fn slopes(&self, _: &[Parameter], at: &[f64], columns: &mut [Vec<f64>]) -> bool {
        let unit = with_values(&self.drawn, at);
        let suspension = &unit.suspension;
        let share = suspension.tile_tilt / suspension.centre_distance;
        for (index, reading) in self.readings.iter().enumerate() {
            let deformation = suspension.deform(reading.force);
            let Some(plates) = unit.plates.respond_with_slopes(&deformation) else {
                return false;
            };
            let closing = plates.by_closing;
            // ∂C/∂d of the three displacements.
            let [by_x, by_y] = [(0, SIDE_X), (1, SIDE_Y)].map(|(axis, side)| -> [f64; 4] {
                std::array::from_fn(|i| {
                    0.5 * side[i] * closing[i] + share * plates.by_slope[axis][i]
                })
            });
            let by_motion = [by_x, by_y, closing];
            let [x, y, z] = reading.force;
            let sinking = suspension.bump_sinking;
            let apparent = [x, y, z + sinking[0] * x.abs() + sinking[1] * y.abs()];
            let mut write = |column: usize, slope: [f64; 4]| {
                let whitened = self.whitening[index].apply(slope);
                for (k, value) in whitened.into_iter().enumerate() {
                    columns[column][4 * index + k] = -value;
                }
            };
            for (i, closing) in closing.into_iter().enumerate() {
                let only = |value: f64| std::array::from_fn(|k| if k == i { value } else { 0.0 });
                write(i, only(1.0));
                // A wider gap is as less closing.
                write(GAP + i, only(-closing));
            }
            for (row, slope) in by_motion.iter().enumerate() {
                for (axis, force) in apparent.iter().enumerate() {
                    write(COMPLIANCE + 3 * row + axis, slope.map(|s| s * force));
                }
            }
            for (axis, force) in [x, y].into_iter().enumerate() {
                let slope = |i: usize| {
                    let moved = (0..3).map(|row| by_motion[row][i] * suspension.compliance[row][2]);
                    moved.sum::<f64>() * force.abs()
                };
                write(SINKING + axis, std::array::from_fn(slope));
            }
        }
        if let Some(known) = &self.known {
            let last = 4 * self.readings.len();
            for (j, column) in columns.iter_mut().enumerate() {
                for (row, slope) in known.whitening.iter().zip(&mut column[last..]) {
                    *slope = -row.get(j).copied().unwrap_or(0.0);
                }
            }
        }
        true
    }

    fn remedy(&self, together: &[usize]) -> String {
        if together.iter().any(|place| *place < COMPLIANCE) {
            return far_enough(&self.drawn);
        }
        if together.iter().any(|place| *place >= SINKING) {
            return "push to both sides along each axis".into();
        }
        "push further along x and y, or use a finer gauge".into()
    }
}

/// The narrowest air gap, m.
pub(super) fn least_gap(unit: &ThreeAxisModel) -> f64 {
    let gaps = unit.plates.air_gap.into_iter();
    gaps.fold(f64::INFINITY, f64::min)
}

/// Range of loads that separates parallel capacitance and gap.
pub(super) fn far_enough(drawn: &ThreeAxisModel) -> String {
    let closing = least_gap(drawn) / drawn.suspension.compliance[2][2];
    format!(
        "a sweep to {:.0} mN, which closes two thirds of the air, a finer gauge, or a measured \
         parallel_capacitance would",
        1e3 * CLOSED * closing
    )
}

/// Steps from the gauge's force to the most likely one and to that of the capacitances:
/// Newton's, so that a tenth between them becomes 1e-8.
const STEPS: usize = 4;
/// Share of the air after which the bend of 1/gap separates it from a constant.
const CLOSED: f64 = 0.64;
