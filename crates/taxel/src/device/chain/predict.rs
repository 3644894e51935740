//! A load on the surface to the numbers of a frame, stage by stage.

use crate::acquisition::patch_share;
use crate::device::{force_loads, number_cell, number_column};
use crate::electronics::Delivered;
use crate::predict::{Curve, Load, LoadColumn, LoadKind, LoadRefused, Predictor};
use crate::quantity::{FORCE, LENGTH, STRESS};
use crate::stage::{CellLoad, Chain};
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
/// The force on one taxel.
static FORCES: [LoadColumn; 5] = {
    let [x, y, z] = force_loads(1e5);
    let required = false;
    [
        LoadColumn { required, ..x },
        LoadColumn { required, ..y },
        LoadColumn { required, ..z },
        LOADS[ROW],
        LOADS[COLUMN],
    ]
};

/// What loads the taxels of a chain.
pub(super) fn loads(chain: &Chain) -> &'static [LoadColumn] {
    match chain.cell(0).load() {
        CellLoad::Pressure => &LOADS,
        CellLoad::Force => &FORCES,
    }
}

/// Columns of a force; row and column come after them.
const FORCE_AXES: usize = 3;
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

    /// The taxel that a force is on, and the forces on all of them, N.
    pub(super) fn forces(&self, load: &Load<'_>) -> (usize, Vec<f64>) {
        let (chain, layout) = (&self.chain, &self.chain.layout);
        let named = |column: usize, lines: usize| {
            load.number(column).map_or(lines / 2, |line| line as usize)
        };
        let [row, column] = self.lines();
        let taxel = named(row, layout.rows) * layout.columns + named(column, layout.columns);
        let mut loads = vec![0.0; chain.count()];
        let (count, first) = (chain.axes.count(), chain.axes.first());
        for (slot, force) in loads[count * taxel..count * (taxel + 1)]
            .iter_mut()
            .enumerate()
        {
            *force = load.number(first + slot).unwrap_or(0.0);
        }
        (taxel, loads)
    }

    fn is_of_forces(&self) -> bool {
        self.chain.cell(0).load() == CellLoad::Force
    }

    /// The columns that name row and column.
    fn lines(&self) -> [usize; 2] {
        if self.is_of_forces() {
            [FORCE_AXES, FORCE_AXES + 1]
        } else {
            [ROW, COLUMN]
        }
    }

    fn refused(&self, load: &Load<'_>) -> Option<LoadRefused> {
        let layout = &self.chain.layout;
        let [row, column] = self.lines();
        [
            (row, layout.rows, "rows"),
            (column, layout.columns, "columns"),
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

    /// How the columns of a channel end.
    fn place(&self, channel: usize) -> String {
        let (chain, columns) = (&self.chain, self.chain.layout.columns);
        let (taxel, _) = chain.of_channel(channel);
        let (per_taxel, axes) = (chain.channels_per_taxel(), chain.axes.names());
        let of_taxel = format!("_r{}c{}", taxel / columns, taxel % columns);
        if let Some(name) = chain.network.channel_name(channel % per_taxel) {
            return format!("{of_taxel}_{name}");
        }
        let axis = axes[channel % axes.len()];
        match per_taxel / axes.len() {
            _ if per_taxel == 1 => of_taxel,
            1 => format!("{of_taxel}_{axis}"),
            _ => format!("{of_taxel}_s{}_{axis}", channel % per_taxel / axes.len()),
        }
    }

    fn answer_forces(&self, load: &Load<'_>, row: &mut Vec<Cell>) {
        let (chain, (taxel, loads)) = (&self.chain, self.forces(load));
        let signals = chain.respond(&loads).signals;
        let numbers: Vec<Delivered> = signals.iter().map(|signal| self.number(*signal)).collect();
        row.push(Cell::Whole((taxel / chain.layout.columns) as u64));
        row.push(Cell::Whole((taxel % chain.layout.columns) as u64));
        let sizes: Vec<f64> = loads.iter().map(|force| force.abs()).collect();
        row.push(Cell::State(self.state(&[], &sizes, &numbers)));
        let count = chain.axes.count();
        let own = &loads[count * taxel..count * (taxel + 1)];
        row.extend(own.iter().copied().map(Cell::Number));
        let between = chain.network.between(taxel, &loads);
        row.extend(between.iter().map(|(_, value)| Cell::Number(*value)));
        for (signal, number) in signals.iter().zip(&numbers) {
            row.push(Cell::Number(*signal));
            row.push(number_cell(number, &chain.last));
        }
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
            .enumerate()
            .any(|(channel, number)| number.clipped && !chain.masked[chain.of_channel(channel).0]);
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
        loads(&self.chain)
    }

    fn combination(&self, given: &[bool]) -> Result<(), String> {
        if self.is_of_forces() {
            let any = given[..FORCE_AXES].contains(&true);
            let sentence = "give a force along x (fx), y (fy) or pressing (fz)";
            return any.then_some(()).ok_or_else(|| sentence.into());
        }
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
        if self.is_of_forces() {
            let force = |name: &&str| of(format!("force_{name}"), ("N", 1.0, "n"));
            columns.extend(chain.axes.names().iter().map(force));
            let between = chain.network.between(0, &vec![0.0; chain.count()]);
            let inner = between
                .iter()
                .map(|(what, _)| of(what.name.into(), what.unit));
            columns.extend(inner);
        } else {
            if chain.cover.is_some() {
                columns.push(of("surface_pressure".into(), kpa));
            }
            columns.push(of("pressure".into(), kpa));
            columns.push(of(cell.name.into(), cell.unit));
        }
        for channel in 0..chain.channels() {
            let place = self.place(channel);
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
        if self.is_of_forces() {
            self.answer_forces(load, row);
            return Ok(());
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
        let loads = if self.is_of_forces() {
            Some(self.forces(load).1)
        } else {
            self.pressures(load).map(|(pressures, _)| pressures)
        };
        loads.is_some_and(|pressures| {
            let signals = self.chain.respond(&pressures).signals;
            signals.iter().any(|signal| self.number(*signal).clipped)
        })
    }

    fn curves(&self, _given: &[bool]) -> Vec<Curve> {
        let cell = self.chain.cell(0).quantity();
        if self.is_of_forces() {
            return Vec::new();
        }
        vec![Curve {
            title: format!("{} of the loaded cell", cell.name.replace('_', " ")),
            x: "pressure",
            y: vec![cell.name],
            y_label: cell.name,
        }]
    }

    fn scales_with_load(&self, column: usize) -> bool {
        if self.is_of_forces() {
            column < FORCE_AXES
        } else {
            matches!(column, PRESSURE | FORCE_Z)
        }
    }
}
