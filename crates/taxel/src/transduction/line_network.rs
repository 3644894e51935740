//! Rows x columns of admittances: what a board reads of every crossing, with all the ways round
//! it, and the admittances back from the readings.
//!
//! Conductances of a resistive matrix, or capacitances: the equations are the same. Every reading
//! is a function of three entries of one symmetric matrix over the lines: with all other lines
//! open, the generalised inverse Z of the Laplacian L; with lines at ground through resistances R,
//! the admittance H = L (1 + RL)⁻¹ that sources behind them see, which is finite for R = 0, so
//! that an ideal drive is a known potential. The longer side of the matrix is eliminated: its
//! block of L is diagonal. A crossing changes both by the product of the potential differences
//! across it that its two lines make there: dL = y (e_k − e_l)(e_k − e_l)′ d ln y.

use faer::Mat;
use faer::linalg::solvers::Solve;
use taxel_numerics::bicgstab;
use taxel_numerics::dense::{
    Rows, add_scaled, cholesky, cholesky_solve, dot, product, square, transposed,
};

/// A matrix of crossings and how it is read. All of its vectors are row by row.
///
/// # Example: a uniform matrix reads (N + M − 1)/(NM) of one crossing
/// ```
/// use taxel::transduction::{LineNetwork, LineWiring};
/// let network = LineNetwork { rows: 8, columns: 8, wiring: LineWiring::Floating };
/// let mut readings = [0.0; 64];
/// network.read(&[1.0 / 200e3; 64], &mut readings)?;
/// assert!((readings[0] - 46_875.0).abs() < 1e-8);
/// let inverse = network.invert(&readings, [1.0, 1e9], None)?;
/// assert!((inverse.ln_admittance[5].exp() * 200e3 - 1.0).abs() < 1e-11);
/// # Ok::<(), taxel::transduction::NetworkError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineNetwork {
    /// Rows N.
    pub rows: usize,
    /// Columns M.
    pub columns: usize,
    /// What is at the lines.
    pub wiring: LineWiring,
}

/// What is at the lines, and what is read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LineWiring {
    /// Between a row and a column, all others open: the impedance, 1 over the unit of the
    /// admittances.
    Floating,
    /// The row at the supply, the column at ground through a reference: the voltage across it, V.
    Divider {
        /// Impedance of the reference.
        reference: f64,
        /// Voltage of the driven row, V.
        supply: f64,
        /// The other lines.
        idle: IdleLines,
    },
    /// The row at the supply, all other lines at 0 V, each through its multiplexer: the current
    /// of the column times the feedback of its amplifier, V.
    ZeroPotential {
        /// Impedance between the supply and the driven row; 0 is an ideal drive.
        drive_resistance: f64,
        /// Impedance between another row and ground.
        idle_resistance: f64,
        /// Impedance between a column and its virtual ground.
        column_resistance: f64,
        /// Voltage of the driven row, V.
        supply: f64,
        /// Impedance of the feedback.
        feedback: f64,
    },
}

/// Lines of a divider that are neither driven nor read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum IdleLines {
    /// Not connected.
    Open,
    /// At ground through this impedance.
    Grounded(f64),
}

/// Admittances from readings.
#[derive(Debug, Clone, PartialEq)]
pub struct Inverse {
    /// ln y of each crossing.
    pub ln_admittance: Vec<f64>,
    /// Crossings whose reading is at a limit: their admittance is a bound.
    pub saturated: Vec<usize>,
    /// Newton steps.
    pub steps: usize,
    /// Largest difference that is left between the logarithms of the readings and of what these
    /// admittances read.
    pub residual: f64,
}

/// Why there is no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NetworkError {
    /// A vector does not have one number for each crossing.
    #[error("{given} numbers for {rows} rows x {columns} columns")]
    WrongCount {
        /// Rows of the network.
        rows: usize,
        /// Columns of the network.
        columns: usize,
        /// Numbers given.
        given: usize,
    },
    /// An admittance, a reading or a limit is outside its range.
    #[error("{quantity} {given} at crossing {crossing}: it must be above 0 and below {below}")]
    OutOfRange {
        /// The quantity.
        quantity: &'static str,
        /// Crossing, row by row.
        crossing: usize,
        /// What was given.
        given: f64,
        /// Upper end of what is allowed; the lower one is 0.
        below: f64,
    },
    /// No admittances that were found read like this.
    #[error(
        "no admittances read like this: after {steps} steps crossing {crossing} is off by {residual:.1e} of its reading, {tolerance:.0e} is rounding"
    )]
    NotConverged {
        /// Newton steps.
        steps: usize,
        /// Crossing that is farthest off, row by row.
        crossing: usize,
        /// By how much of its reading.
        residual: f64,
        /// By how much it may be off.
        tolerance: f64,
    },
    /// The slopes have no inverse: some crossings cannot be distinguished.
    #[error("the slopes of the readings have no inverse")]
    Singular,
}

/// Steps after which Newton's method is given up: from a uniform matrix it takes twelve at most
/// to random ones of two decades (`cargo test -p taxel --test all inversion_undoes_reading`).
const STEPS: usize = 100;

impl LineNetwork {
    /// Readings of all crossings.
    ///
    /// # Errors
    /// [`NetworkError`] when a count is wrong or an admittance not positive and finite.
    pub fn read(&self, admittance: &[f64], readings: &mut [f64]) -> Result<(), NetworkError> {
        self.check(readings)?;
        let lines = self.solved(admittance)?;
        for (at, reading) in readings.iter_mut().enumerate() {
            *reading = self.reading(lines.coordinate(at).0);
        }
        Ok(())
    }

    /// Slopes d reading / d ln y: a row for each reading.
    ///
    /// # Errors
    /// As [`LineNetwork::read`].
    pub fn slopes(&self, admittance: &[f64]) -> Result<Vec<Vec<f64>>, NetworkError> {
        let (lines, all) = (self.solved(admittance)?, 0..admittance.len());
        let row = |at: usize| {
            let (coordinate, weights) = lines.coordinate(at);
            let per_coordinate = self.reading_slope(self.reading(coordinate));
            all.clone()
                .map(|of| per_coordinate * lines.slope(weights, at, of))
                .collect()
        };
        Ok(all.clone().map(row).collect())
    }

    /// Admittances that give these readings, by Newton's method in ln y with exact slopes, until
    /// the readings agree to rounding.
    ///
    /// Readings beyond `limits` (the rails) count as the limit and are named. `start`: ln y of
    /// the last frame; without it, or where it leads nowhere, each crossing starts as that of a
    /// uniform matrix.
    ///
    /// # Errors
    /// [`NetworkError`] when a count is wrong, a reading is not a number or a limit more than the
    /// wiring can read, or no admittances read like this.
    pub fn invert(
        &self,
        readings: &[f64],
        limits: [f64; 2],
        start: Option<&[f64]>,
    ) -> Result<Inverse, NetworkError> {
        self.check(readings)?;
        let target = readings.iter().enumerate().map(|(crossing, &given)| {
            let within = if given.is_nan() {
                given
            } else {
                given.max(limits[0]).min(limits[1])
            };
            Ok(self.coordinate(inside("reading", crossing, within, self.supply())?))
        });
        let target: Vec<f64> = target.collect::<Result<_, NetworkError>>()?;
        let uniform = self.uniform();
        let uniform = target
            .iter()
            .map(|coordinate| coordinate + uniform)
            .collect();
        let found = match start {
            Some(start) => {
                self.check(start)?;
                let from_start = self.newton(&target, start.to_vec());
                from_start.or_else(|_| self.newton(&target, uniform))
            }
            None => self.newton(&target, uniform),
        };
        let is_beyond = |i: &usize| readings[*i] <= limits[0] || readings[*i] >= limits[1];
        let saturated = (0..readings.len()).filter(is_beyond).collect();
        found.map(|found| Inverse { saturated, ..found })
    }

    /// Standard deviations of ln y for independent readings of these standard deviations.
    ///
    /// # Errors
    /// As [`LineNetwork::spread`].
    pub fn deviations(
        &self,
        admittance: &[f64],
        deviations: &[f64],
    ) -> Result<Vec<f64>, NetworkError> {
        let spread = self.spread(admittance, deviations)?;
        Ok(spread.row_iter().map(|row| row.norm_l2()).collect())
    }

    /// Largest standard deviation of ln y over the relative one of the readings, which are
    /// independent: 1 would be a crossing by itself.
    ///
    /// # Errors
    /// As [`LineNetwork::spread`].
    pub fn noise_gain(&self, admittance: &[f64]) -> Result<f64, NetworkError> {
        let mut readings = vec![0.0; admittance.len()];
        self.read(admittance, &mut readings)?;
        let gains = self.deviations(admittance, &readings)?;
        Ok(gains.into_iter().fold(0.0, f64::max))
    }

    /// From ln y to that of readings with these coordinates.
    fn newton(&self, target: &[f64], mut x: Vec<f64>) -> Result<Inverse, NetworkError> {
        // Logarithms of readings between 1e-28 and 1e28 are below 64 and round by that much; the
        // relative rounding of sums over all lines is below their number.
        let tolerance = 64.0 * f64::EPSILON * (self.rows + self.columns) as f64;
        let stopped = |steps, (crossing, residual)| NetworkError::NotConverged {
            steps,
            crossing,
            residual,
            tolerance,
        };
        let mut lines = self.lines(&x).ok_or(stopped(0, (0, f64::INFINITY)))?;
        let mut misfit = lines.misfit(target);
        let mut steps = 0;
        loop {
            let worst = largest(&misfit);
            if worst.1 <= tolerance {
                return Ok(Inverse {
                    ln_admittance: x,
                    saturated: Vec::new(),
                    steps,
                    residual: worst.1,
                });
            }
            let length = dot(&misfit, &misfit);
            // The longest step along a direction that brings the readings nearer, by a
            // ten-thousandth of what the slope promises (Armijo); a billionth of the Newton step
            // is as good as none.
            let nearer = |direction: Vec<f64>| {
                (0..30)
                    .map(|halvings| 0.5_f64.powi(halvings))
                    .find_map(|part| {
                        let mut moved = x.clone();
                        add_scaled(&mut moved, part, &direction);
                        let lines = self.lines(&moved)?;
                        let misfit = lines.misfit(target);
                        let is_nearer = dot(&misfit, &misfit) <= (1.0 - 2e-4 * part) * length;
                        is_nearer.then_some((moved, lines, misfit))
                    })
            };
            let step = lines.iterated(&misfit).and_then(nearer);
            let step = step.or_else(|| nearer(lines.eliminated(&misfit)));
            let step = step.filter(|_| steps < STEPS);
            (x, lines, misfit) = step.ok_or(stopped(steps, worst))?;
            steps += 1;
        }
    }

    fn check(&self, numbers: &[f64]) -> Result<(), NetworkError> {
        let (rows, columns, given) = (self.rows, self.columns, numbers.len());
        let is_right = given == rows * columns && given > 0;
        is_right.then_some(()).ok_or(NetworkError::WrongCount {
            rows,
            columns,
            given,
        })
    }

    fn solved(&self, admittance: &[f64]) -> Result<Lines, NetworkError> {
        self.check(admittance)?;
        let x = admittance.iter().enumerate().map(|(crossing, &given)| {
            Ok(inside("admittance", crossing, given, f64::INFINITY)?.ln())
        });
        let x: Vec<f64> = x.collect::<Result<_, NetworkError>>()?;
        self.lines(&x).ok_or(NetworkError::Singular)
    }

    fn lines(&self, x: &[f64]) -> Option<Lines> {
        let (series, law) = match self.wiring {
            LineWiring::Floating => (None, Law::Loop { reference: 1.0 }),
            LineWiring::Divider {
                reference, idle, ..
            } => match idle {
                IdleLines::Open => (None, Law::Loop { reference }),
                IdleLines::Grounded(idle) => {
                    let changes = [-idle, reference - idle];
                    let law = Law::Transfer {
                        scale: reference,
                        changes,
                        limited: true,
                    };
                    (Some([idle; 2]), law)
                }
            },
            LineWiring::ZeroPotential {
                drive_resistance,
                idle_resistance,
                column_resistance,
                supply,
                feedback,
            } => {
                let changes = [drive_resistance - idle_resistance, 0.0];
                let law = Law::Transfer {
                    scale: feedback * supply,
                    changes,
                    limited: false,
                };
                (Some([idle_resistance, column_resistance]), law)
            }
        };
        let y: Vec<f64> = x.iter().map(|x| x.exp()).collect();
        let y: Rows = y.chunks(self.columns).map(<[f64]>::to_vec).collect();
        let tall = self.rows >= self.columns;
        match (tall, law) {
            (true, _) => Lines::new(y, tall, series, law),
            (
                false,
                Law::Transfer {
                    scale,
                    changes: [a, b],
                    limited,
                },
            ) => {
                let law = Law::Transfer {
                    scale,
                    changes: [b, a],
                    limited,
                };
                Lines::new(transposed(&y), tall, series.map(|[a, b]| [b, a]), law)
            }
            (false, Law::Loop { .. }) => Lines::new(transposed(&y), tall, series, law),
        }
    }

    /// What no reading reaches.
    fn supply(&self) -> f64 {
        match self.wiring {
            LineWiring::Divider { supply, .. } => supply,
            _ => f64::INFINITY,
        }
    }

    /// A reading as the logarithm that is nearly linear in ln y: ln V, ln V/(V₀ − V) of a
    /// divider, −ln of an impedance.
    fn coordinate(&self, reading: f64) -> f64 {
        match self.wiring {
            LineWiring::Floating => -reading.ln(),
            LineWiring::Divider { supply, .. } => (reading / (supply - reading)).ln(),
            LineWiring::ZeroPotential { .. } => reading.ln(),
        }
    }

    fn reading(&self, coordinate: f64) -> f64 {
        match self.wiring {
            LineWiring::Floating => (-coordinate).exp(),
            LineWiring::Divider { supply, .. } => supply / (1.0 + (-coordinate).exp()),
            LineWiring::ZeroPotential { .. } => coordinate.exp(),
        }
    }

    /// d reading / d coordinate.
    fn reading_slope(&self, reading: f64) -> f64 {
        match self.wiring {
            LineWiring::Floating => -reading,
            LineWiring::Divider { supply, .. } => reading * (supply - reading) / supply,
            LineWiring::ZeroPotential { .. } => reading,
        }
    }

    /// ln y less the coordinate of a crossing in a uniform matrix whose lines are ideal.
    fn uniform(&self) -> f64 {
        let of_all = (self.rows + self.columns - 1) as f64 / (self.rows * self.columns) as f64;
        match self.wiring {
            LineWiring::Floating => of_all.ln(),
            LineWiring::Divider {
                reference,
                idle: IdleLines::Open,
                ..
            } => (of_all / reference).ln(),
            LineWiring::Divider { reference, .. } => -reference.ln(),
            LineWiring::ZeroPotential {
                supply, feedback, ..
            } => -(supply * feedback).ln(),
        }
    }

    /// d reading / d ln y of each crossing by its own reading.
    pub(crate) fn own_slopes(&self, admittance: &[f64]) -> Result<Vec<f64>, NetworkError> {
        let lines = self.solved(admittance)?;
        let own = |at: usize| {
            let (coordinate, weights) = lines.coordinate(at);
            self.reading_slope(self.reading(coordinate)) * lines.slope(weights, at, at)
        };
        Ok((0..admittance.len()).map(own).collect())
    }

    /// J⁻¹ with each column times the deviation of its reading: its product with its own transpose is
    /// the covariance of ln y for independent readings.
    ///
    /// # Errors
    /// As [`LineNetwork::read`]; [`NetworkError::Singular`].
    pub fn spread(&self, admittance: &[f64], deviations: &[f64]) -> Result<Mat<f64>, NetworkError> {
        self.check(deviations)?;
        let (slopes, count) = (self.slopes(admittance)?, deviations.len());
        let noise = |i: usize, j: usize| if i == j { deviations[i] } else { 0.0 };
        let slopes = Mat::from_fn(count, count, |i, j| slopes[i][j]);
        let spread = slopes
            .partial_piv_lu()
            .solve(Mat::from_fn(count, count, noise));
        let is_finite = spread.norm_max().is_finite();
        is_finite.then_some(spread).ok_or(NetworkError::Singular)
    }
}

/// How a reading follows from the entries of its lines p and q.
#[derive(Debug, Clone, Copy)]
enum Law {
    /// Z_pp + Z_qq − 2 Z_pq, over a reference.
    Loop { reference: f64 },
    /// −scale H_pq / ((1 + a H_pp)(1 + b H_qq) − a b H_pq²), a and b what the impedances of the
    /// two lines are more than those of idle ones; a divider is `limited` by its supply, of which
    /// this is the share.
    Transfer {
        scale: f64,
        changes: [f64; 2],
        limited: bool,
    },
}

/// A network that is solved: lines p of the longer side, then q of the shorter one.
struct Lines {
    /// A row for each p.
    admittance: Rows,
    /// The lines p are the rows.
    tall: bool,
    law: Law,
    /// Potential of each line, a row each, per unit source at every line.
    potentials: Rows,
    /// Entries of the lines with themselves.
    own: Vec<f64>,
    /// Those of p and q.
    both: Rows,
}

impl Lines {
    /// `series`: impedances of the lines p and q to ground; without, nothing is at ground.
    /// `None` when it cannot be solved in these numbers.
    fn new(y: Rows, tall: bool, series: Option<[f64; 2]>, law: Law) -> Option<Self> {
        let (long, short) = (y.len(), y[0].len());
        let shift = if series.is_some() { 1.0 } else { 0.0 };
        let [of_p, of_q] = series.unwrap_or([1.0; 2]);
        let sums: Vec<f64> = y.iter().map(|row| row.iter().sum()).collect();
        let parts: Vec<f64> = sums.iter().map(|sum| 1.0 / (shift + of_p * sum)).collect();
        let scale = |(row, part): (&Vec<f64>, &f64)| row.iter().map(|y| part * y).collect();
        let scaled: Rows = y.iter().zip(&parts).map(scale).collect();
        let (from_q, from_p) = (transposed(&y), transposed(&scaled));
        // What the elimination of p leaves between the lines q; the diagonal from the others, so
        // that nothing cancels.
        let mut between = product(&from_q, &scaled);
        for (q, line) in between.iter_mut().enumerate() {
            for entry in &mut *line {
                *entry *= -of_p;
            }
            line[q] = 0.0;
            line[q] = shift * from_p[q].iter().sum::<f64>() - line.iter().sum::<f64>();
        }
        // Potentials count from their mean where nothing is at ground.
        let ground = (1.0 - shift) * sums.iter().sum::<f64>() / (short * short) as f64;
        let one = |i: usize, j: usize| if i == j { 1.0 } else { 0.0 };
        let entry = |i: usize, j: usize| ground + of_q * between[i][j] + shift * one(i, j);
        let factor = cholesky(square(short, entry))?;
        let units = square(short, one);
        let left: Rows = units
            .iter()
            .map(|unit| cholesky_solve(&factor, unit))
            .collect();
        let transfer = product(&scaled, &left);
        let around = product(&transfer, &from_p);
        let potentials = square(long + short, |i, j| match (i < long, j < long) {
            (true, true) => of_p * of_q * around[i][j] + parts[i] * one(i, j),
            (true, false) => of_p * transfer[i][j - long],
            (false, true) => of_q * transfer[j][i - long],
            (false, false) => left[i - long][j - long],
        });
        let own = (0..long + short).map(|line| match line.checked_sub(long) {
            _ if series.is_none() => potentials[line][line],
            None => parts[line] * (sums[line] - of_q * dot(&y[line], &transfer[line])),
            Some(q) => dot(&between[q], &left[q]),
        });
        let own: Vec<f64> = own.collect();
        let sign = 1.0 - 2.0 * shift;
        let both: Rows = transfer
            .iter()
            .map(|row| row.iter().map(|entry| sign * entry).collect())
            .collect();
        let is_finite = own
            .iter()
            .chain(both.iter().flatten())
            .all(|entry| entry.is_finite());
        is_finite.then_some(Self {
            admittance: y,
            tall,
            law,
            potentials,
            own,
            both,
        })
    }

    /// Lines p and q of a crossing, and q among all lines.
    fn crossing(&self, at: usize) -> [usize; 3] {
        let (long, short) = (self.admittance.len(), self.admittance[0].len());
        let [p, q] = if self.tall {
            [at / short, at % short]
        } else {
            [at % long, at / long]
        };
        [p, q, long + q]
    }

    /// Coordinate of the reading of a crossing, and what it grows by per y times the square of
    /// the potential difference that p makes, that q makes, and their product.
    fn coordinate(&self, at: usize) -> (f64, [f64; 3]) {
        let [line, column, other] = self.crossing(at);
        let (p, q, pq) = (self.own[line], self.own[other], self.both[line][column]);
        match self.law {
            Law::Loop { reference } => {
                let impedance = p + q - 2.0 * pq;
                let weights = [1.0, 1.0, -2.0].map(|part| part / impedance);
                ((reference / impedance).ln(), weights)
            }
            Law::Transfer {
                scale,
                changes: [a, b],
                limited,
            } => {
                let both = (1.0 + a * p) * (1.0 + b * q) - a * b * pq * pq;
                let share = -scale * pq / both;
                let rest = if limited { 1.0 - share } else { 1.0 };
                let own = [-a * (1.0 + b * q) / both, -b * (1.0 + a * p) / both];
                let weights = [own[0], own[1], 1.0 / pq + 2.0 * a * b * pq / both];
                ((share / rest).ln(), weights.map(|weight| weight / rest))
            }
        }
    }

    /// Slope of the coordinate of `at`, which has these weights, with ln y of `of`.
    fn slope(&self, [of_p, of_q, of_both]: [f64; 3], at: usize, of: usize) -> f64 {
        let ([k, l, other], [line_p, _, line_q]) = (self.crossing(of), self.crossing(at));
        let across = |line: usize| self.potentials[k][line] - self.potentials[other][line];
        let (p, q) = (across(line_p), across(line_q));
        self.admittance[k][l] * (of_p * p * p + of_q * q * q + of_both * p * q)
    }

    fn misfit(&self, target: &[f64]) -> Vec<f64> {
        let off = target
            .iter()
            .enumerate()
            .map(|(at, target)| target - self.coordinate(at).0);
        // What is no number is infinitely far.
        off.map(|off| if off.is_nan() { f64::INFINITY } else { off })
            .collect()
    }

    /// The Newton step with all slopes.
    fn eliminated(&self, misfit: &[f64]) -> Vec<f64> {
        let count = misfit.len();
        let weights: Vec<[f64; 3]> = (0..count).map(|at| self.coordinate(at).1).collect();
        let slopes = Mat::from_fn(count, count, |at, of| self.slope(weights[at], at, of));
        let step = slopes
            .partial_piv_lu()
            .solve(Mat::from_fn(count, 1, |i, _| misfit[i]));
        (0..count).map(|i| step[(i, 0)]).collect()
    }

    /// The Newton step without the matrix of slopes (van der Vorst's BiCGSTAB, scaled by their
    /// diagonal), to a share of the misfit that keeps convergence quadratic; `None` where it
    /// costs more than elimination.
    fn iterated(&self, misfit: &[f64]) -> Option<Vec<f64>> {
        let (count, lines) = (misfit.len(), self.own.len());
        let weights: Vec<[f64; 3]> = (0..count).map(|at| self.coordinate(at).1).collect();
        let diagonal: Vec<f64> = (0..count)
            .map(|at| self.slope(weights[at], at, at))
            .collect();
        let long = self.admittance.len();
        let of_sources = &transposed(&self.potentials)[..long];
        let across = |at: usize| {
            let [p, _, q] = self.crossing(at);
            let mut across = self.potentials[p].clone();
            add_scaled(&mut across, -1.0, &self.potentials[q]);
            across
        };
        let across: Rows = (0..count).map(across).collect();
        // Slopes times a change of ln y, over the diagonal: the change of L between the potentials.
        let apply = |step: &[f64]| -> Vec<f64> {
            let mut currents = vec![vec![0.0; lines]; lines];
            for (at, step) in step.iter().enumerate() {
                let [p, q, other] = self.crossing(at);
                let part = self.admittance[p][q] * step;
                add_scaled(&mut currents[p], part, &across[at]);
                add_scaled(&mut currents[other], -part, &across[at]);
            }
            let pairs = |i: usize| {
                self.potentials
                    .iter()
                    .zip(&currents)
                    .map(move |(a, b)| a[i] * b[i])
            };
            let own: Vec<f64> = (0..lines).map(|i| pairs(i).sum()).collect();
            let of_q: Rows = currents.iter().map(|row| row[long..].to_vec()).collect();
            let both = product(of_sources, &of_q);
            let of = |at: usize| {
                let [p, q, other] = self.crossing(at);
                dot(&weights[at], &[own[p], own[other], both[p][q]]) / diagonal[at]
            };
            (0..count).map(of).collect()
        };
        let right: Vec<f64> = misfit
            .iter()
            .zip(&diagonal)
            .map(|(off, own)| off / own)
            .collect();
        // Two products of 3 n (N + M) in each iteration, n³/3 in an elimination.
        let steps = count * count / (18 * lines) + 1;
        bicgstab(apply, right, largest(misfit).1.min(0.1), steps)
    }
}

/// A number above zero and below `below`.
fn inside(
    quantity: &'static str,
    crossing: usize,
    given: f64,
    below: f64,
) -> Result<f64, NetworkError> {
    let is_inside = given > 0.0 && given < below;
    is_inside.then_some(given).ok_or(NetworkError::OutOfRange {
        quantity,
        crossing,
        given,
        below,
    })
}

/// The largest absolute value and where it is.
fn largest(values: &[f64]) -> (usize, f64) {
    let sizes = values.iter().map(|value| value.abs()).enumerate();
    sizes.fold(
        (0, 0.0),
        |most, one| if one.1 > most.1 { one } else { most },
    )
}
