//! One section of microchannels, drawn anew and solved under one pressure after the other (P4 II.D).

use crate::mechanics::microchannel_cell::{Closure, Filling};
use crate::mechanics::{filling, solid, void_cell, void_study};
use taxel::mechanics::{CellGeometry, MicrochannelSection};
use taxel::sensor::Microchannel;

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

/// One section at all pressures.
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
/// `element`. None once `stop` says so, which is asked before each pressure.
pub fn solve_section(
    element: &Microchannel,
    drawn: DrawnSection,
    pressures: &[f64],
    stop: &dyn Fn() -> bool,
) -> Option<SectionRow> {
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
        return Some(row);
    }
    let filling = filling(&element.liquid.pressure);
    let mut study = match void_study(&cell, shape, solid(&element.material), &filling) {
        Ok(study) => study,
        Err(failure) => {
            row.ended = Some(failure.to_string());
            return Some(row);
        }
    };
    for &pressure in pressures {
        if stop() {
            return None;
        }
        if row.ended.is_none() {
            match study.press(pressure) {
                Ok(closure) => {
                    let state = if closure.touches {
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
    Some(row)
}
