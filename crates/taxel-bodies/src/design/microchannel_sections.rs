//! Design sweep of P4 (II.D): closing of microchannels with many cross-sections.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::mechanics::microchannel_cell::{Closure, Filling};
use rayon::prelude::*;

use super::{HeatMap, MapCell, MicrochannelSections};
use crate::mechanics::{filling, solid, void_cell, void_study};
use taxel::mechanics::{CellGeometry, MicrochannelSection};
use taxel::sensor::Microchannel;
use taxel_ground::table::{Cell, Column};

/// State of a section at a pressure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SectionState {
    /// Open over its whole width.
    Open,
    /// The roof touches the floor.
    Closed,
    /// The solution ended before: the change of resistance is a lower bound.
    Beyond,
}

impl SectionState {
    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Open => "open",
            Self::Closed => "closed",
            Self::Beyond => "beyond_solution",
        }
    }
}

/// One section at one pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SectionAnswer {
    /// Pressure on the top, Pa.
    pub pressure: f64,
    /// State.
    pub state: SectionState,
    /// The section; beyond its solution the last one known.
    pub closure: Closure,
    /// Beyond the solution, under the law of the paper: the change of resistance that
    /// can't be exceeded, since the net pressure only grows (R/R0 = 1 + (p - q)/(eta P)).
    pub greatest: Option<f64>,
}

/// One design at all pressures.
#[derive(Debug, Clone, PartialEq)]
pub struct SectionRow {
    /// Height of the microchannel, m.
    pub height: f64,
    /// Solid above it, m.
    pub cover: f64,
    /// Answers in the order of the pressures.
    pub answers: Vec<SectionAnswer>,
    /// Why the solution ended before the last pressure.
    pub ended: Option<String>,
}

impl SectionAnswer {
    /// Relative change of resistance A₀/A − 1.
    pub fn change(&self) -> f64 {
        1.0 / self.closure.area_ratio - 1.0
    }
}

/// Solves every design on all cores; `progress` hears the fraction that is done and the
/// design that came last, and answers whether to go on. Designs that were not begun by
/// then are left out.
pub fn sweep(
    sections: &MicrochannelSections,
    element: &Microchannel,
    pitch: f64,
    progress: &(dyn Fn(f64, &SectionRow) -> bool + Sync),
) -> Vec<SectionRow> {
    let (covers, pressures) = (sections.covers.values(), sections.pressures.values());
    let designs: Vec<(f64, f64)> = sections
        .heights
        .values()
        .into_iter()
        .flat_map(|height| covers.iter().map(move |&cover| (height, cover)))
        .collect();
    let done = AtomicUsize::new(0);
    let stop = Mutex::new(false);
    let mut rows: Vec<(usize, SectionRow)> = designs
        .par_iter()
        .enumerate()
        .filter_map(|(number, &(height, cover))| {
            if stop.lock().is_ok_and(|stop| *stop) {
                return None;
            }
            let drawn = DrawnSection {
                height,
                cover,
                thickness: sections.thickness,
                pitch,
            };
            let row = solve_section(element, drawn, &pressures);
            let count = done.fetch_add(1, Ordering::Relaxed) + 1;
            if !progress(count as f64 / designs.len() as f64, &row)
                && let Ok(mut stop) = stop.lock()
            {
                *stop = true;
            }
            Some((number, row))
        })
        .collect();
    rows.sort_by_key(|(number, _)| *number);
    rows.into_iter().map(|(_, row)| row).collect()
}

/// Lengths of one section, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrawnSection {
    /// Height of the microchannel.
    pub height: f64,
    /// Solid above it.
    pub cover: f64,
    /// Thickness of the whole sheet.
    pub thickness: f64,
    /// From one microchannel to the next.
    pub pitch: f64,
}

/// Solves one section under one pressure, Pa, after the other; width, solid and liquid are those of
/// `element`.
pub fn solve_section(element: &Microchannel, drawn: DrawnSection, pressures: &[f64]) -> SectionRow {
    let DrawnSection {
        height,
        cover,
        thickness,
        pitch,
    } = drawn;
    let shape = element.section.shape;
    let cell = void_cell(&CellGeometry {
        section: MicrochannelSection {
            height,
            ..element.section()
        },
        roof: cover,
        thickness,
        pitch,
    });
    let mut row = SectionRow {
        height,
        cover,
        answers: Vec::new(),
        ended: None,
    };
    if element.liquid.initial_pressure.is_some() {
        row.ended = Some(String::from(
            "a section is solved from a liquid without pressure: leave liquid.initial_pressure out",
        ));
        return row;
    }
    let filling = filling(&element.liquid.pressure);
    let mut study = match void_study(&cell, shape, solid(&element.material), &filling) {
        Ok(study) => study,
        Err(failure) => {
            row.ended = Some(failure.to_string());
            return row;
        }
    };
    for &pressure in pressures {
        if row.ended.is_none() {
            match study.press(pressure) {
                Ok(closure) => {
                    let state = if closure.gap <= 0.0 {
                        SectionState::Closed
                    } else {
                        SectionState::Open
                    };
                    row.answers.push(SectionAnswer {
                        pressure,
                        state,
                        closure,
                        greatest: None,
                    });
                    continue;
                }
                Err(failure) => row.ended = Some(failure.to_string()),
            }
        }
        let Ok(closure) = study.closure() else {
            break;
        };
        row.answers.push(SectionAnswer {
            pressure,
            state: SectionState::Beyond,
            closure,
            greatest: match filling {
                Filling::Gas(scale) => Some((pressure - closure.pressure + closure.inside) / scale),
                _ => None,
            },
        });
    }
    row
}

/// Columns of the table of a sweep.
pub fn columns() -> Vec<Column> {
    vec![
        Column::new("height", "um", 1e-6, "m", 1),
        Column::new("cover", "um", 1e-6, "m", 1),
        Column::new("pressure", "kPa", 1e3, "pa", 2),
        Column::new("area_ratio", "", 1.0, "", 5),
        Column::new("change", "", 1.0, "", 5),
        Column::new("change_at_most", "", 1.0, "", 5),
        Column::new("internal_pressure", "kPa", 1e3, "pa", 4),
        Column::new("gap", "um", 1e-6, "m", 4),
        Column::new("fold", "um", 1e-6, "m", 3),
        Column::new("greatest_stress", "kPa", 1e3, "pa", 2),
        Column::plain("state"),
        Column::new("solved_to_pressure", "kPa", 1e3, "pa", 3),
    ]
}

/// The table of a sweep.
pub fn cells(rows: &[SectionRow]) -> Vec<Vec<Cell>> {
    rows.iter()
        .flat_map(|row| {
            row.answers.iter().map(|answer| {
                let closure = &answer.closure;
                vec![
                    Cell::Number(row.height),
                    Cell::Number(row.cover),
                    Cell::Number(answer.pressure),
                    Cell::Number(closure.area_ratio),
                    Cell::Number(answer.change()),
                    answer.greatest.map_or(Cell::from(""), Cell::Number),
                    Cell::Number(closure.inside),
                    Cell::Number(closure.gap),
                    Cell::Number(closure.fold),
                    Cell::Number(closure.stress),
                    Cell::from(answer.state.name()),
                    Cell::Number(closure.pressure),
                ]
            })
        })
        .collect()
}

/// The change of resistance over height and cover, one map for each pressure.
pub fn heat_map(title: &str, sections: &MicrochannelSections, rows: &[SectionRow]) -> HeatMap {
    let (heights, covers) = (sections.heights.values(), sections.covers.values());
    let um = |lengths: &[f64]| lengths.iter().map(|x| tenths(x * 1e6)).collect();
    let field = |height: f64, cover: f64, number: usize| {
        let row = rows
            .iter()
            .find(|row| row.height == height && row.cover == cover);
        let answer = row.and_then(|row| row.answers.get(number));
        MapCell {
            value: answer.map(|answer| answer.greatest.unwrap_or(answer.change())),
            mark: match answer.map(|answer| answer.state) {
                Some(SectionState::Closed) => "*",
                Some(SectionState::Beyond) => "<",
                _ => "",
            },
        }
    };
    let map = |number: usize, pressure: f64| {
        let cells = covers
            .iter()
            .flat_map(|&cover| heights.iter().map(move |&height| (height, cover)))
            .map(|(height, cover)| field(height, cover, number))
            .collect();
        (format!("{} kPa", tenths(pressure / 1e3)), cells)
    };
    let pressures = sections.pressures.values();
    HeatMap {
        title: title.to_owned(),
        value: String::from("relative change of resistance R/R0 - 1"),
        across: (String::from("height of the microchannel, um"), um(&heights)),
        upward: (String::from("cover, um"), um(&covers)),
        maps: pressures
            .iter()
            .enumerate()
            .map(|(n, &p)| map(n, p))
            .collect(),
        caption: String::from(
            "* the roof touches the floor;  < the solution ended before: at most this number (table: also a lower bound)",
        ),
    }
}

/// A number with one decimal where it needs it.
fn tenths(value: f64) -> String {
    let text = format!("{value:.1}");
    text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
}
