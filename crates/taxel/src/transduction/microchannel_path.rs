//! The load path of two crossing layers of microchannels for its table, and what is read from it.

use std::fmt::Write as _;

use super::path_solution::{LoadPath, NoTable, Off, TableOptions, solve};
use super::path_table::{Contents, Course, PathTable, PathVariable, State, WrongTable};
use crate::mechanics::crossing_microchannels::Crossing;
use crate::mechanics::{
    AlongChannel, ClosingCurve, Fineness, Hyperelastic, MicrochannelError, NotSolved, PressureLaw,
    SectionShape, Stretch, VoidStack,
};
use crate::solutions::digits;
use taxel_numerics::MonotoneCurve;

/// Raised whenever mesh, steps or numbers of the solution change.
const METHOD: u32 = 1;

/// Numbers of one layer at a node, and their places.
const OF_LAYER: usize = 5;
const NET: usize = 0;
const AREA: usize = 1;
const THINNEST: usize = 2;
const CONDUCTANCE: usize = 3;
const GAP: usize = 4;
/// The numbers at rest.
const REST: [f64; OF_LAYER] = [0.0, 1.0, 1.0, 1.0, 1.0];

/// What the table of crossing layers holds.
static CONTENTS: Contents = Contents {
    device: "microchannel",
    variable: PathVariable {
        name: "pressure",
        unit: "kPa",
        scale: 1e3,
        key: "pa",
    },
    largest: HIGHEST,
    numbers: &[
        ("row_net_pressure_pa", Course::Rising),
        ("row_area_ratio", Course::Falling),
        ("row_thinnest_ratio", Course::Falling),
        ("row_conductance_ratio", Course::Falling),
        ("row_gap_ratio", Course::Any),
        ("column_net_pressure_pa", Course::Rising),
        ("column_area_ratio", Course::Falling),
        ("column_thinnest_ratio", Course::Falling),
        ("column_conductance_ratio", Course::Falling),
        ("column_gap_ratio", Course::Any),
    ],
    errors: ["row_change", "column_change"],
};

/// Highest pressure to which a path is followed, Pa.
const HIGHEST: f64 = 100e6;
/// Steps to the touch: by an eighth of the height at most each, and some to find it.
const MOST_STEPS: usize = 120;
/// Part of the height by which the smallest gap falls in a step.
const STEP: f64 = 0.125;
/// Gap over that at rest that counts as touching.
const TOUCHING: f64 = 1e-3;
/// A step is at most so many times the one before.
const GROWTH: f64 = 4.0;
/// Loads nearer to each other than this share of the larger are the same.
const SAME_LOAD: f64 = 1e-9;

/// Two crossing layers as drawn, pressed all over the top.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnLayers {
    /// The layers.
    pub stack: VoidStack,
    /// Which of the upper (0) and the lower layer (1) the rows are, which the columns.
    pub position: [usize; 2],
}

/// A table of crossing layers with the curves that it makes.
#[derive(Debug, Clone, PartialEq)]
pub struct LayersTable {
    /// The table.
    pub table: PathTable,
    /// Closing curves of the row and of the column layer.
    pub closing: [ClosingCurve; 2],
}

impl DrawnLayers {
    /// Solves the load path by finite elements, from rest to where the roof of a channel touches its
    /// floor, as a table; `program` is what makes it, `progress` hears the fraction.
    ///
    /// # Errors
    /// [`NoTable`].
    pub fn tabulate(
        &self,
        options: &TableOptions,
        program: &str,
        progress: &mut dyn FnMut(f64),
    ) -> Result<PathTable, NoTable> {
        let mut path = LayersPath {
            drawn: self,
            kept: Vec::new(),
        };
        solve(&mut path, options, program, progress)
    }

    /// Reads the text of a table of these layers.
    ///
    /// # Errors
    /// [`WrongTable`].
    pub fn read(&self, text: &str) -> Result<LayersTable, WrongTable> {
        let table = PathTable::read(text, &CONTENTS, &self.drawing())?;
        let no_curve =
            |error: &str| WrongTable::Unreadable(format!("its numbers are no curve{error}"));
        if table.ends()[0].iter().ne(REST.iter().chain(&REST)) {
            return Err(no_curve(": it does not begin at rest"));
        }
        let closing = curves(&table).map_err(|error| no_curve(&format!(": {error}")))?;
        Ok(LayersTable { table, closing })
    }

    /// All that a table follows from.
    fn drawing(&self) -> Vec<String> {
        let stack = &self.stack;
        let Hyperelastic::MooneyRivlin(material) = &stack.material;
        let upper = if self.position[0] == 0 {
            "rows"
        } else {
            "columns"
        };
        let mut text = format!(
            "solution = two crossing layers of microchannels, the whole top pressed\n\
             solver = taxel-fem {} method {METHOD}\n\
             upper = {upper}\n",
            taxel_fem::VERSION
        );
        for (key, value) in [
            ("width", stack.section.width),
            ("height", stack.section.height),
            ("pitch", stack.pitch),
            ("base", stack.base),
            ("between", stack.between),
            ("cover", stack.cover),
            ("c10", material.c10),
            ("c01", material.c01),
        ] {
            let _ = writeln!(text, "{key} = {}", digits(value));
        }
        let liquid = match &stack.liquid {
            PressureLaw::Vented => String::from("vented"),
            PressureLaw::Sealed => String::from("sealed"),
            PressureLaw::Paper(law) => {
                let [expansion, atmosphere] = [law.expansion, law.atmosphere].map(digits);
                format!("expansion {expansion} of {atmosphere}")
            }
            PressureLaw::Tabulated(points) => {
                let point = |point: &crate::mechanics::LiquidPoint| {
                    let [volume, pressure] = [point.volume_ratio, point.pressure].map(digits);
                    format!("{volume} {pressure}")
                };
                points.iter().map(point).collect::<Vec<_>>().join(", ")
            }
        };
        let _ = writeln!(text, "liquid = {liquid}");
        if stack.section.shape == SectionShape::Ellipse {
            text.push_str("shape = ellipse\n");
        }
        text.lines().map(str::to_owned).collect()
    }

    /// Numbers of both layers, rows first.
    fn numbers(&self, crossing: &Crossing) -> Vec<f64> {
        let of_layer = |row: usize| {
            [
                crossing.pressure - crossing.inside[row],
                crossing.volume_ratio[row],
                crossing.thinnest[row],
                1.0 / crossing.resistance_ratio[row],
                crossing.gap[row] / self.stack.section.height,
            ]
        };
        self.position.into_iter().flat_map(of_layer).collect()
    }
}

/// Closing curves of the row and of the column layer.
fn curves(table: &PathTable) -> Result<[ClosingCurve; 2], MicrochannelError> {
    let of_layer = |layer: usize| {
        let first = layer * OF_LAYER;
        let curve = |number: usize| {
            let (points, slopes) = table.against(first + NET, first + number);
            MonotoneCurve::with_slopes(points, &slopes).map_err(MicrochannelError::from)
        };
        let along = AlongChannel {
            conductance: curve(CONDUCTANCE)?,
            thinnest: curve(THINNEST)?,
        };
        let [_, end] = table.ends();
        let touch = (end[first + GAP] <= TOUCHING).then_some(end[first + AREA]);
        Ok::<_, MicrochannelError>(ClosingCurve::of_path(curve(AREA)?, touch, along))
    };
    Ok([of_layer(0)?, of_layer(1)?])
}

/// A path that is being solved.
struct LayersPath<'d> {
    drawn: &'d DrawnLayers,
    /// States of the usual mesh.
    kept: Vec<State>,
}

impl LayersPath<'_> {
    /// A state that was solved at a load.
    fn known(&self, load: f64) -> Option<&State> {
        self.kept
            .iter()
            .find(|(kept, _)| (kept - load).abs() <= SAME_LOAD * load)
    }
}

impl LoadPath for LayersPath<'_> {
    const CONTENTS: &'static Contents = &CONTENTS;

    fn drawing(&self) -> Vec<String> {
        self.drawn.drawing()
    }

    /// To the first touch of roof and floor.
    fn reach(&mut self, progress: &mut dyn FnMut(f64)) -> Result<(f64, Option<String>), NoTable> {
        let stack = &self.drawn.stack;
        if stack.liquid == PressureLaw::Sealed {
            return Err(NoTable::Sealed);
        }
        let height = stack.section.height;
        let mut study = stack.study(Fineness::Usual)?;
        let mut gap = |pressure: f64| {
            study
                .press(pressure)
                .map(|state| state.gap.into_iter().fold(f64::INFINITY, f64::min) / height)
        };
        let mut before = [0.0, 1.0];
        let mut pressure = stack.light();
        // The lowest pressure at which roof and floor have touched.
        let mut touched: Option<f64> = None;
        for _ in 0..MOST_STEPS {
            let here = match gap(pressure) {
                Ok(here) => here,
                Err(failure) if before[0] == 0.0 => {
                    return Err(NotSolved::Solver(failure.to_string()).into());
                }
                Err(failure) => {
                    let ended = format!(
                        "before roof and floor touched, with {:.2} of the height between them ({})",
                        before[1], failure.reason
                    );
                    return Ok((before[0], Some(ended)));
                }
            };
            if here.abs() <= TOUCHING {
                progress(1.0);
                return Ok((pressure, None));
            }
            progress((1.0 - here).clamp(0.0, 1.0));
            if here < 0.0 {
                touched = Some(pressure);
                // Beyond the touch the contact holds the gap; before it lies more than the half.
                pressure = 0.5 * (before[0] + pressure);
                continue;
            }
            let slope = (before[1] - here) / (pressure - before[0]);
            let wanted = (here / slope).min(STEP / slope);
            let step = if slope > 0.0 { wanted } else { f64::INFINITY };
            let step = step.min(GROWTH * (pressure - before[0]));
            before = [pressure, here];
            pressure += step;
            if let Some(touched) = touched.filter(|touched| pressure >= *touched) {
                pressure = 0.5 * (before[0] + touched);
            }
            if pressure > HIGHEST {
                break;
            }
        }
        Err(NoTable::Open {
            pressure: before[0],
            gap: before[1],
        })
    }

    fn states(&mut self, loads: &[f64], fineness: Fineness) -> Result<Vec<State>, NoTable> {
        let mut study = None;
        let mut states = Vec::new();
        for load in loads {
            let known = (fineness == Fineness::Usual)
                .then(|| self.known(*load))
                .flatten();
            let state = match known {
                _ if *load == 0.0 => (0.0, REST.repeat(2)),
                Some(known) => known.clone(),
                None => {
                    let study = match &mut study {
                        Some(study) => study,
                        none => none.insert(self.drawn.stack.study(fineness)?),
                    };
                    let crossing = study
                        .press(*load)
                        .map_err(|failure| NotSolved::Solver(failure.to_string()))?;
                    (*load, self.drawn.numbers(&crossing))
                }
            };
            states.push(state);
        }
        if fineness == Fineness::Usual {
            for state in &states {
                if self.known(state.0).is_none() {
                    self.kept.push(state.clone());
                }
            }
        }
        Ok(states)
    }

    /// Of the change of resistance of each layer, by its net pressure and by the pressure on the top:
    /// the larger of the two.
    fn off(&self, table: &PathTable, _: &State, states: &[State]) -> Result<Vec<Off>, NoTable> {
        let closing = curves(table).map_err(NotSolved::from)?;
        let [_, end] = table.ends();
        let mut all = Vec::new();
        for (pressure, solved) in states {
            let mut off = Off::default();
            for (layer, closing) in closing.iter().enumerate() {
                let at = |number: usize| solved[layer * OF_LAYER + number];
                let full = 1.0 / end[layer * OF_LAYER + CONDUCTANCE] - 1.0;
                let whole = Stretch {
                    share: 1.0,
                    pressure: *pressure,
                };
                let settled = closing
                    .settle(&self.drawn.stack.liquid, &[whole])
                    .map_err(NotSolved::from)?;
                for section in [closing.at(at(NET)), settled.sections[0]] {
                    let one = (1.0 / section.conductance - 1.0 / at(CONDUCTANCE)) / full;
                    if one.abs() > off[layer].abs() {
                        off[layer] = one;
                    }
                }
            }
            all.push(off);
        }
        Ok(all)
    }
}
