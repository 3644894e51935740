//! A load on the surface to the numbers of a frame, stage by stage.

use crate::acquisition::patch_share;
use crate::device::{number_cell, number_column};
use crate::electronics::Delivered;
use crate::predict::{Curve, Load, LoadColumn, LoadKind, LoadRefused, Predictor};
use crate::quantity::{FORCE, LENGTH, STRESS};
use crate::stage::Chain;
use crate::table::{Cell, Column};

/// Predicts loads on one array.
#[derive(Debug, Clone)]
pub struct ChainPredictor {
    chain: Chain,
}

const fn load(
    name: &'static str,
    short: &'static str,
    kind: LoadKind,
    about: &'static str,
) -> LoadColumn {
    LoadColumn {
        name,
        short,
        kind,
        required: false,
        about,
    }
}

/// The pressure or force, and where it acts.
pub(super) static LOADS: [LoadColumn; 7] = [
    load(
        "pressure",
        "p",
        LoadKind::Quantity(&STRESS, [0.0, 1e9]),
        "on the pitch of one cell, or without row and column on all cells",
    ),
    load(
        "force_z",
        "fz",
        LoadKind::Quantity(&FORCE, [0.0, 1e6]),
        "pressing force, on the pitch of one cell or with radius on a round contact",
    ),
    load(
        "row",
        "row",
        LoadKind::Number([0.0, 255.0]),
        "row of the cell, from 0; without it the middle one",
    ),
    load(
        "column",
        "column",
        LoadKind::Number([0.0, 255.0]),
        "column of the cell, from 0; without it the middle one",
    ),
    load(
        "radius",
        "radius",
        LoadKind::Quantity(&LENGTH, [1e-6, 10.0]),
        "radius of a round contact",
    ),
    load(
        "x",
        "x",
        LoadKind::Quantity(&LENGTH, [-10.0, 10.0]),
        "middle of the round contact",
    ),
    load(
        "y",
        "y",
        LoadKind::Quantity(&LENGTH, [-10.0, 10.0]),
        "middle of the round contact",
    ),
];
const PRESSURE: usize = 0;
const FORCE_Z: usize = 1;
const ROW: usize = 2;
const COLUMN: usize = 3;
const RADIUS: usize = 4;
const X: usize = 5;
const Y: usize = 6;

impl ChainPredictor {
    /// A predictor for the array of `chain`.
    pub fn new(chain: Chain) -> Self {
        Self { chain }
    }

    /// Mean pressure on the pitch of each cell, Pa, and the cell that the load is on: none where it
    /// is on all of them. None for a load without pressure and force.
    pub(super) fn pressures(&self, load: &Load<'_>) -> Option<(Vec<f64>, Option<usize>)> {
        let (chain, layout) = (&self.chain, &self.chain.layout);
        let named = |column: usize, lines: usize| {
            load.number(column).map_or(lines / 2, |line| line as usize)
        };
        let cell = named(ROW, layout.rows) * layout.columns + named(COLUMN, layout.columns);
        let mut pressures = vec![0.0; chain.count()];
        match (load.number(PRESSURE), load.number(FORCE_Z)) {
            (Some(pressure), _) if load.number(ROW).is_none() && load.number(COLUMN).is_none() => {
                pressures.fill(pressure);
                return Some((pressures, None));
            }
            (Some(pressure), _) => pressures[cell] = pressure,
            (None, Some(force)) => match load.number(RADIUS) {
                None => pressures[cell] = force / chain.area(),
                Some(radius) => {
                    let centre = [X, Y].map(|column| load.number(column).unwrap_or(0.0));
                    for (index, pressure) in pressures.iter_mut().enumerate() {
                        let at = layout.flat_position(index);
                        *pressure =
                            force / chain.area() * patch_share(at, layout.pitch, centre, radius);
                    }
                    let most =
                        (0..pressures.len()).max_by(|a, b| pressures[*a].total_cmp(&pressures[*b]));
                    return Some((pressures, most));
                }
            },
            (None, None) => return None,
        }
        Some((pressures, Some(cell)))
    }

    fn refused(&self, load: &Load<'_>) -> Option<LoadRefused> {
        let layout = &self.chain.layout;
        [
            (ROW, layout.rows, "rows"),
            (COLUMN, layout.columns, "columns"),
        ]
        .into_iter()
        .find_map(|(column, lines, name)| {
            let line = load.number(column)?;
            (line.fract() != 0.0 || line as usize >= lines).then(|| LoadRefused {
                column,
                message: format!("{line} is none of the {lines} {name}"),
                help: format!("give a whole number from 0 to {}", lines - 1),
            })
        })
    }

    fn number(&self, signal: f64) -> Delivered {
        self.chain.last.deliver(self.chain.input(signal))
    }

    /// State of the array at these pressures on its surface and at its cells, Pa.
    fn state(&self, pressures: &[f64], cell_loads: &[f64], numbers: &[Delivered]) -> &'static str {
        let chain = &self.chain;
        let largest = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
        let used = numbers
            .iter()
            .zip(&chain.masked)
            .any(|(number, masked)| number.clipped && !masked);
        if largest(cell_loads) > chain.full_scale {
            "out_of_range"
        } else if used {
            "saturated"
        } else {
            let cover = chain.cover.as_ref();
            cover
                .and_then(|cover| cover.beyond(largest(pressures), chain.layout.pitch))
                .unwrap_or("ok")
        }
    }
}

impl Predictor for ChainPredictor {
    fn load_columns(&self) -> &'static [LoadColumn] {
        &LOADS
    }

    fn combination(&self, given: &[bool]) -> Result<(), String> {
        let sentence = if given[PRESSURE] == given[FORCE_Z] {
            "give either pressure (p) or force_z (fz)"
        } else if given[PRESSURE] && given[RADIUS] {
            "a round contact (radius) has a force: give fz"
        } else if (given[X] || given[Y]) && !given[RADIUS] {
            "x and y are of a round contact: give its radius, or row and column"
        } else if given[RADIUS] && (given[ROW] || given[COLUMN]) {
            "give the middle of a round contact as x and y, not as row and column"
        } else {
            return Ok(());
        };
        Err(sentence.into())
    }

    fn columns(&self) -> Vec<Column> {
        let chain = &self.chain;
        let cell = chain.cell(0).quantity();
        let signal = chain.network.quantity(cell);
        let of = |name: String, (unit, scale, key)| Column::new(name, unit, scale, key, 4);
        let kpa = ("kPa", 1e3, "pa");
        let mut columns = vec![
            Column::plain("row"),
            Column::plain("column"),
            Column::plain("state"),
        ];
        if chain.cover.is_some() {
            columns.push(of("surface_pressure".into(), kpa));
        }
        columns.push(of("pressure".into(), kpa));
        columns.push(of(cell.name.into(), cell.unit));
        let layout = &chain.layout;
        for index in 0..chain.count() {
            let place = format!("_r{}c{}", index / layout.columns, index % layout.columns);
            columns.push(of(format!("signal{place}"), signal.unit));
            columns.push(number_column("", &place, &chain.last));
        }
        columns
    }

    fn reading_columns(&self) -> Vec<String> {
        let columns = self.columns();
        let signals = columns
            .iter()
            .filter(|column| column.name.starts_with("signal_"));
        signals.map(|column| column.name.clone()).collect()
    }

    fn answer(&self, load: &Load<'_>, row: &mut Vec<Cell>) -> Result<(), LoadRefused> {
        if let Some(refused) = self.refused(load) {
            return Err(refused);
        }
        let Some((pressures, at)) = self.pressures(load) else {
            return Err(LoadRefused {
                column: FORCE_Z,
                message: "neither pressure nor force_z is given".into(),
                help: "give one of them".into(),
            });
        };
        let (chain, response) = (&self.chain, self.chain.respond(&pressures));
        let numbers: Vec<Delivered> = response
            .signals
            .iter()
            .map(|signal| self.number(*signal))
            .collect();
        let cell = at.unwrap_or_else(|| {
            chain.layout.rows / 2 * chain.layout.columns + chain.layout.columns / 2
        });
        row.push(Cell::Whole((cell / chain.layout.columns) as u64));
        row.push(Cell::Whole((cell % chain.layout.columns) as u64));
        row.push(Cell::State(self.state(
            &pressures,
            &response.cell_loads,
            &numbers,
        )));
        if chain.cover.is_some() {
            row.push(Cell::Number(pressures[cell]));
        }
        row.push(Cell::Number(response.cell_loads[cell]));
        row.push(Cell::Number(response.values[cell]));
        for (signal, number) in response.signals.iter().zip(&numbers) {
            row.push(Cell::Number(*signal));
            row.push(number_cell(number, &chain.last));
        }
        Ok(())
    }

    fn clips(&self, load: &Load<'_>) -> bool {
        self.pressures(load).is_some_and(|(pressures, _)| {
            let signals = self.chain.respond(&pressures).signals;
            signals.iter().any(|signal| self.number(*signal).clipped)
        })
    }

    fn curves(&self, _given: &[bool]) -> Vec<Curve> {
        let cell = self.chain.cell(0).quantity();
        vec![Curve {
            title: format!("{} of the loaded cell", cell.name.replace('_', " ")),
            x: "pressure",
            y: vec![cell.name],
            y_label: cell.name,
        }]
    }

    fn scales_with_load(&self, column: usize) -> bool {
        matches!(column, PRESSURE | FORCE_Z)
    }
}
