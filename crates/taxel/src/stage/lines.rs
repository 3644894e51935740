//! Cells at the crossings of rows and columns of lines, read through all the ways round them.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{CellQuantity, ChainPart, Inverted, Network, OneToOne, PartError, PartParameter};
use crate::quantity::{self, CONDUCTANCE, Checked, NonNegativeResistance, RESISTANCE};
use crate::transduction::{IdleLines, LineNetwork, LineWiring, NetworkError};
use taxel_ground::summary::{Fact, fact, number};

/// How cells are joined to channels.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum NetworkDescription {
    /// Each cell has a channel of its own.
    #[default]
    OneToOne,
    /// Resistance between a row and a column with all other lines open.
    Floating,
    /// A row at the supply, a column at ground through the reference of the readout.
    Divider(Idle),
    /// A row at the supply, all other lines at ground through their multiplexers.
    ZeroPotential(ZeroPotential),
}

/// Lines of a divider that are neither driven nor read.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Idle {
    /// Not connected.
    Open,
    /// At ground, without resistance.
    Grounded,
}

/// Resistances of the multiplexers of a matrix at zero potential.
#[allow(clippy::struct_field_names, reason = "the keys of the sensor file")]
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ZeroPotential {
    /// Between the supply and the driven row, Ω; 0 is an ideal drive.
    #[serde(deserialize_with = "quantity::one::<NonNegativeResistance, _>")]
    #[schemars(with = "Checked<NonNegativeResistance>")]
    pub drive_resistance: f64,
    /// Between each other row and ground, Ω.
    #[serde(deserialize_with = "quantity::one::<NonNegativeResistance, _>")]
    #[schemars(with = "Checked<NonNegativeResistance>")]
    pub idle_resistance: f64,
    /// Between each column and its amplifier, Ω.
    #[serde(deserialize_with = "quantity::one::<NonNegativeResistance, _>")]
    #[schemars(with = "Checked<NonNegativeResistance>")]
    pub column_resistance: f64,
}

impl NetworkDescription {
    /// The network of rows x columns; `reference` is the resistor of a divider, Ω.
    pub fn between(&self, counts: [usize; 2], reference: Option<f64>) -> Box<dyn Network> {
        match self {
            Self::OneToOne => Box::new(OneToOne),
            _ => Box::new(Lines {
                described: *self,
                counts,
                // Without one the board is refused.
                reference: reference.unwrap_or(1.0),
            }),
        }
    }

    /// Shows each number to `each`, which may change it.
    pub fn parameters(&mut self, each: &mut dyn FnMut(PartParameter, &mut f64)) {
        let Self::ZeroPotential(lines) = self else {
            return;
        };
        for (name, value) in [
            ("drive_resistance", &mut lines.drive_resistance),
            ("idle_resistance", &mut lines.idle_resistance),
            ("column_resistance", &mut lines.column_resistance),
        ] {
            let parameter = PartParameter {
                name,
                unit: "ohm",
                bounds: [0.0, f64::INFINITY],
                fitted: false,
                per_cell: false,
                absolute: false,
            };
            each(parameter, value);
        }
    }
}

/// A matrix of lines as a stage: signals per volt of the supply.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lines {
    described: NetworkDescription,
    /// Rows and columns.
    counts: [usize; 2],
    /// Resistor of a divider, Ω.
    reference: f64,
}

impl ChainPart for Lines {
    fn parameters(&mut self, each: &mut dyn FnMut(PartParameter, &mut f64)) {
        self.described.parameters(each);
    }
}

impl Network for Lines {
    fn boxed(&self) -> Box<dyn Network> {
        Box::new(*self)
    }

    fn takes(&self, of_cell: CellQuantity) -> bool {
        of_cell.dimension == Some(&CONDUCTANCE)
    }

    fn quantity(&self, _: CellQuantity) -> CellQuantity {
        match self.network().wiring {
            LineWiring::Floating => CellQuantity {
                name: "resistance",
                dimension: Some(&RESISTANCE),
                unit: ("kohm", 1e3, "ohm"),
            },
            LineWiring::Divider { .. } => CellQuantity {
                name: "share_of_the_supply",
                dimension: None,
                unit: ("%", 1e-2, "share"),
            },
            LineWiring::ZeroPotential { .. } => CellQuantity {
                name: "conductance",
                dimension: Some(&CONDUCTANCE),
                unit: ("uS", 1e-6, "siemens"),
            },
        }
    }

    fn read(&self, values: &[f64], signals: &mut [f64]) {
        // Noise can bring a cell below zero, where nothing conducts.
        let values: Vec<f64> = values
            .iter()
            .map(|value| value.max(f64::MIN_POSITIVE))
            .collect();
        if self.network().read(&values, signals).is_err() {
            signals.fill(f64::NAN);
        }
    }

    fn invert(&self, signals: &[f64], noise: &[f64], found: &mut Inverted) {
        let (count, [rows, columns]) = (signals.len(), self.counts);
        let is_there = |cell: usize| !signals[cell].is_nan();
        let row_is_there = |i: &usize| (0..columns).any(|j| is_there(i * columns + j));
        let column_is_there = |j: &usize| (0..rows).any(|i| is_there(i * columns + j));
        let kept = [
            (0..rows).filter(row_is_there).collect::<Vec<_>>(),
            (0..columns).filter(column_is_there).collect(),
        ];
        let cells: Vec<usize> = kept[0]
            .iter()
            .flat_map(|i| kept[1].iter().map(move |j| i * columns + j))
            .collect();
        let network = Self {
            counts: kept.each_ref().map(Vec::len),
            ..*self
        };
        let of = |all: &[f64]| cells.iter().map(|cell| all[*cell]).collect::<Vec<_>>();
        let result = network.found(&of(signals), &of(noise), &of(&found.values));
        found.converged = result.is_ok();
        let (values, deviations, spread) = result.unwrap_or_default();
        let on_all = |of_kept: &[f64], missing: f64| {
            let mut all = vec![missing; count];
            for (cell, value) in cells.iter().zip(of_kept) {
                all[*cell] = *value;
            }
            all
        };
        found.values = on_all(&values, f64::NAN);
        found.deviations = on_all(&deviations, f64::NAN);
        found.spread = vec![vec![0.0; count]; if spread.is_empty() { 0 } else { count }];
        for (cell, row) in cells.iter().zip(&spread) {
            found.spread[*cell] = on_all(row, 0.0);
        }
    }

    fn lines(&self) -> Vec<Vec<usize>> {
        let [rows, columns] = self.counts;
        let row = |i: usize| (0..columns).map(|j| i * columns + j).collect();
        let column = |j: usize| (0..rows).map(|i| i * columns + j).collect();
        let all = (0..rows).map(row).chain((0..columns).map(column));
        all.filter(|line: &Vec<usize>| line.len() > 1).collect()
    }

    fn joins(&self, count: usize) -> Result<(), PartError> {
        let zero = matches!(self.described, NetworkDescription::ZeroPotential(_));
        if zero || count <= MOST_CROSSINGS {
            return Ok(());
        }
        Err(PartError {
            key: "network".into(),
            message: format!(
                "{count} crossings: where the idle lines are not at zero potential, each reading depends on all \
                 crossings, and at most {MOST_CROSSINGS} are inverted"
            ),
            help: "read fewer lines together, or at zero_potential".into(),
        })
    }

    fn facts_at(&self, rest: f64, pressed: f64) -> Vec<Fact> {
        let [rows, columns] = self.counts;
        let corner = |i: usize| i / columns + i % columns < 2;
        let ghost = (0..rows * columns).map(|i| if corner(i) { pressed } else { rest });
        let ghost: Vec<f64> = ghost.collect();
        let source = "deviation of a conductance over that of its reading, both relative";
        let gain = |(name, pattern): (&str, &[f64])| {
            let gain = self.gain(pattern).unwrap_or(f64::INFINITY);
            fact(
                "transduction",
                name,
                number(gain, "times", "times", 1.0),
                source,
            )
        };
        [
            ("noise_gain_empty", &vec![rest; rows * columns][..]),
            ("noise_gain_ghost", &ghost[..]),
        ]
        .map(gain)
        .into()
    }
}

/// Most crossings whose covariances are computed for each frame where every reading depends on all
/// of them: 32 x 32.
const MOST_CROSSINGS: usize = 1024;

type Found = (Vec<f64>, Vec<f64>, Vec<Vec<f64>>);

impl Lines {
    fn network(&self) -> LineNetwork {
        let wiring = match self.described {
            NetworkDescription::Divider(idle) => LineWiring::Divider {
                reference: self.reference,
                supply: 1.0,
                idle: match idle {
                    Idle::Open => IdleLines::Open,
                    Idle::Grounded => IdleLines::Grounded(0.0),
                },
            },
            NetworkDescription::ZeroPotential(lines) => LineWiring::ZeroPotential {
                drive_resistance: lines.drive_resistance,
                idle_resistance: lines.idle_resistance,
                column_resistance: lines.column_resistance,
                supply: 1.0,
                feedback: 1.0,
            },
            NetworkDescription::Floating | NetworkDescription::OneToOne => LineWiring::Floating,
        };
        let [rows, columns] = self.counts;
        LineNetwork {
            rows,
            columns,
            wiring,
        }
    }

    /// Largest relative deviation of a conductance over that of its reading.
    fn gain(&self, values: &[f64]) -> Result<f64, NetworkError> {
        let network = self.network();
        if !matches!(network.wiring, LineWiring::ZeroPotential { .. }) {
            return network.noise_gain(values);
        }
        let mut readings = vec![0.0; values.len()];
        network.read(values, &mut readings)?;
        let slopes = network.own_slopes(values)?;
        let gains = readings.iter().zip(slopes);
        Ok(gains
            .map(|(reading, slope)| (reading / slope).abs())
            .fold(0.0, f64::max))
    }

    fn found(&self, signals: &[f64], noise: &[f64], start: &[f64]) -> Result<Found, NetworkError> {
        let network = self.network();
        // What is lost in the noise is an upper bound.
        let least = noise.iter().copied().fold(f64::INFINITY, f64::min);
        let most = match network.wiring {
            LineWiring::Divider { supply, .. } => supply - least.min(0.5 * supply),
            _ => f64::MAX,
        };
        let start: Vec<f64> = start
            .iter()
            .map(|value| value.max(f64::MIN_POSITIVE).ln())
            .collect();
        let inverse = network.invert(signals, [least, most], Some(&start))?;
        let values: Vec<f64> = inverse.ln_admittance.iter().map(|x| x.exp()).collect();
        if let LineWiring::ZeroPotential { .. } = network.wiring {
            // A reading is all but its own crossing's: what the others add to the variance is of
            // the second order in the resistances of the lines over that of a crossing.
            let slopes = network.own_slopes(&values)?;
            let each = values.iter().zip(noise).zip(slopes);
            let deviations = each
                .map(|((value, noise), slope)| (value * noise / slope).abs())
                .collect();
            return Ok((values, deviations, Vec::new()));
        }
        let spread = network.spread(&values, noise)?;
        let row = |i: usize| {
            (0..values.len())
                .map(|j| values[i] * spread[(i, j)])
                .collect()
        };
        let spread: Vec<Vec<f64>> = (0..values.len()).map(row).collect();
        let deviations = spread
            .iter()
            .map(|row| row.iter().map(|part| part * part).sum::<f64>().sqrt());
        Ok((values.clone(), deviations.collect(), spread))
    }
}
