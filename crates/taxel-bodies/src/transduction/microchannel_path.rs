//! The load path of two crossing layers of microchannels for its table.

use super::path_solution::{LoadPath, NoTable, Off, TableOptions, solve};
use crate::mechanics::crossing_microchannels::Crossing;
use crate::mechanics::{Fineness, NotSolved, crossing_study, light_pressure};
use taxel::mechanics::{PressureLaw, Stretch};
use taxel::transduction::DrawnLayers;
use taxel::transduction::microchannel_table::{
    CONDUCTANCE, CONTENTS, HIGHEST, NET, OF_LAYER, REST, TOUCHING, layer_curves,
};
use taxel::transduction::path_table::{Contents, PathState, PathTable};

/// Steps to the touch: by an eighth of the height at most each, and some to find it.
const MOST_STEPS: usize = 120;
/// Part of the height by which the smallest gap falls in a step.
const STEP: f64 = 0.125;
/// A step is at most so many times the one before.
const GROWTH: f64 = 4.0;
/// Loads nearer to each other than this share of the larger are the same.
const SAME_LOAD: f64 = 1e-9;

/// Solves the load path of crossing layers by finite elements, from rest to where the roof of a
/// channel touches its floor, as a table; `program` is what makes it, `progress` hears the fraction.
///
/// # Errors
/// [`NoTable`].
pub fn tabulate_layers(
    layers: &DrawnLayers,
    options: &TableOptions,
    program: &str,
    progress: &mut dyn FnMut(f64),
) -> Result<PathTable, NoTable> {
    let mut path = LayersPath {
        drawn: layers,
        kept: Vec::new(),
    };
    solve(&mut path, options, program, progress)
}

/// Numbers of both layers, rows first.
fn numbers(drawn: &DrawnLayers, crossing: &Crossing) -> Vec<f64> {
    let of_layer = |row: usize| {
        [
            crossing.pressure - crossing.inside[row],
            crossing.volume_ratio[row],
            crossing.thinnest[row],
            1.0 / crossing.resistance_ratio[row],
            crossing.gap[row] / drawn.stack.section.height,
        ]
    };
    drawn.position.into_iter().flat_map(of_layer).collect()
}

/// A path that is being solved.
struct LayersPath<'d> {
    drawn: &'d DrawnLayers,
    /// States of the usual mesh.
    kept: Vec<PathState>,
}

impl LayersPath<'_> {
    /// A state that was solved at a load.
    fn known(&self, load: f64) -> Option<&PathState> {
        self.kept
            .iter()
            .find(|(kept, _)| (kept - load).abs() <= SAME_LOAD * load)
    }
}

impl LoadPath for LayersPath<'_> {
    const CONTENTS: &'static Contents = &CONTENTS;

    fn drawing(&self) -> Vec<String> {
        self.drawn.path_statement()
    }

    /// To the first touch of roof and floor.
    fn reach(&mut self, progress: &mut dyn FnMut(f64)) -> Result<(f64, Option<String>), NoTable> {
        let stack = &self.drawn.stack;
        if stack.liquid == PressureLaw::Sealed {
            return Err(NoTable::Sealed);
        }
        let height = stack.section.height;
        let mut study = crossing_study(stack, Fineness::Usual)?;
        let mut gap = |pressure: f64| {
            study
                .press(pressure)
                .map(|state| state.gap.into_iter().fold(f64::INFINITY, f64::min) / height)
        };
        let mut before = [0.0, 1.0];
        let mut pressure = light_pressure(stack);
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

    fn states(&mut self, loads: &[f64], fineness: Fineness) -> Result<Vec<PathState>, NoTable> {
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
                        none => none.insert(crossing_study(&self.drawn.stack, fineness)?),
                    };
                    let crossing = study
                        .press(*load)
                        .map_err(|failure| NotSolved::Solver(failure.to_string()))?;
                    (*load, numbers(self.drawn, &crossing))
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
    fn off(
        &self,
        table: &PathTable,
        _: &PathState,
        states: &[PathState],
    ) -> Result<Vec<Off>, NoTable> {
        let closing = layer_curves(table).map_err(NotSolved::from)?;
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
