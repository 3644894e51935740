//! Force on one three-axis unit to signal, its stiffness by finite elements of the drawing.

use std::sync::Arc;

use super::NotSolvable;
use crate::mechanics::{Crosstalk, DeformedBody, ElasticUnit, TopForce};
use taxel::device::{ThreeAxisArray, ThreeAxisPredictor};
use taxel::mechanics::{Cavity, ElasticDescription, SideContact, Suspension, UnitDrawing};
use taxel::predict::{Curve, Load, LoadColumn, LoadRefused, Loads, Predictor, SolvedBody};
use taxel_ground::table::{Cell, Column};

/// A load this many times nearer to the first touch of linear elasticity is solved at large
/// strain.
const EARLY: f64 = 1.15;
/// Steps of the way to the largest normal force.
const PRESSED_STEPS: u32 = 8;

/// Predicts loads on one unit as drawn, whose stiffness [`Predictor::prepare`] solves.
#[derive(Debug, Clone)]
pub struct ThreeAxisFieldPredictor {
    predictor: ThreeAxisPredictor,
    unit: ElasticUnit,
    elastic: ElasticDescription,
    /// Relative permittivity of the insulation.
    permittivity: f64,
    /// Spacing of the units of a row, m, if a unit has a neighbour there.
    row_pitch: Option<f64>,
    /// A quarter of the unit at large strain, where a load passes the first touch.
    pressed: Option<DeformedBody>,
    /// Greatest normal and greatest side force of the loads, N: those of the bodies to show.
    greatest: [f64; 2],
}

impl ThreeAxisFieldPredictor {
    /// A predictor for the units of `array`; nothing is solved yet.
    ///
    /// # Errors
    /// [`NotSolvable`] where the stiffness is typed in or calibrated.
    pub fn new(array: &ThreeAxisArray<'_>) -> Result<Self, NotSolvable> {
        let element = array.element;
        if !element.calibrated.is_empty() {
            return Err(NotSolvable::Calibrated);
        }
        let from_drawing = element.suspension.from_drawing;
        let layout = array.layout();
        Ok(Self {
            predictor: ThreeAxisPredictor::new(array),
            unit: ElasticUnit::new(array.unit_drawing()),
            elastic: from_drawing.ok_or(NotSolvable::TypedIn)?,
            permittivity: element.plates.insulation_permittivity,
            row_pitch: (layout.columns > 1).then_some(layout.pitch[0]),
            pressed: None,
            greatest: [0.0; 2],
        })
    }

    /// Solves the unit at large strain where a normal force alone passes its first touch; answers
    /// what is to be said about it.
    fn press(&mut self, loads: &Loads, progress: &mut dyn FnMut(f64)) -> Result<String, String> {
        let normal = forces(loads).filter(|[x, y, _]| *x == 0.0 && *y == 0.0);
        let largest = normal.map(|[_, _, z]| z).fold(0.0, f64::max);
        let model = self.predictor.unit();
        let even = model
            .plates
            .air_gap
            .windows(2)
            .all(|gaps| gaps[0] == gaps[1]);
        let vented = self.elastic.cavity == Cavity::Vented;
        if !vented || !even || model.open_share([0.0, 0.0, EARLY * largest]) >= 1.0 {
            return Ok(String::new());
        }
        let solids = (self.elastic.modulus, self.permittivity);
        let path = (largest, PRESSED_STEPS);
        let mut heard = |share: f64| progress(0.3 + 0.7 * share);
        let pressed = self.unit.press(solids, path, &mut heard);
        let (pressed, body) = pressed.map_err(|failure| failure.to_string())?;
        let touch = pressed.touch.map_or_else(
            || String::from("; at large strain no electrode touches"),
            |touch| {
                format!(
                    "; at large strain the electrodes touch first under a normal force of {:.1} mN, {:.0} um from the \
                     middle of the unit along x and y",
                    touch.force * 1e3,
                    touch.least_at[0].max(touch.least_at[1]) * 1e6
                )
            },
        );
        let ended = pressed.ended.as_ref().map_or_else(String::new, |reason| {
            let last = pressed.states.last().map_or(0.0, |state| state.force);
            format!(
                "; beyond {:.1} mN the answers are bounds, the solution ends there: {reason}",
                last * 1e3
            )
        });
        self.predictor.press(pressed);
        self.pressed = Some(body);
        Ok(touch + &ended)
    }
}

/// The forces of all loads along x, y and z, N.
fn forces(loads: &Loads) -> impl Iterator<Item = [f64; 3]> {
    (0..loads.len()).map(|number| {
        let load = loads.load(number);
        [0, 1, 2].map(|axis| load.number(axis).unwrap_or(0.0))
    })
}

/// Closings of the neighbour in a row.
fn in_words(found: &Crosstalk) -> String {
    let percent = |[near, far]: [f64; 2]| format!("{:+.1} and {:+.1} %", 100.0 * near, 100.0 * far);
    format!(
        "; the near and the far plates of a neighbour in the row close by {} of its closing under a normal force, and \
         by {} of that of its near side under a force along the row",
        percent(found.normal),
        percent(found.side)
    )
}

impl Predictor for ThreeAxisFieldPredictor {
    fn prepare(
        &mut self,
        loads: &Loads,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Option<String>, String> {
        let solved = self.unit.solve().map_err(|failure| failure.to_string())?;
        progress(if self.row_pitch.is_some() { 0.1 } else { 0.2 });
        let beside = if let Some(pitch) = self.row_pitch {
            let row = ElasticUnit {
                drawing: UnitDrawing {
                    pitch,
                    ..self.unit.drawing
                },
                ..self.unit
            };
            let found = row.crosstalk();
            progress(0.3);
            in_words(&found.map_err(|failure| failure.to_string())?)
        } else {
            String::new()
        };
        let (found, drawing) = (solved.compliance, self.unit.drawing);
        let suspension = Suspension::of_drawing(&self.elastic, &drawing, &found);
        self.predictor.suspend(suspension);
        let touch = self.press(loads, progress)?;
        let greatest = |axis: fn([f64; 3]) -> f64| {
            let larger = |most: f64, part: f64| if part.abs() > most.abs() { part } else { most };
            forces(loads).map(axis).fold(0.0, larger)
        };
        self.greatest = [
            greatest(|[.., z]| z),
            greatest(|[x, y, _]| x.abs().max(y.abs())),
        ];
        let over = |solved: f64, table: f64| 100.0 * (solved / table - 1.0);
        let beside_table = drawing.compliance().map_or_else(
            |outside| format!("no table has it ({outside})"),
            |table| {
                format!(
                    "closing per normal force {:+.1} % and per side force {:+.1} % off the table",
                    over(found.c_zz, table.c_zz),
                    over(found.c_xx, table.c_xx)
                )
            },
        );
        progress(1.0);
        Ok(Some(format!(
            "{}; solved with {} unknowns, error {:.0} %: {beside_table}{beside}{touch}",
            self.predictor.remark(),
            solved.unknowns,
            100.0 * found.error,
        )))
    }

    /// The unit under the greatest normal force and under the greatest side force on its flat top
    /// of all loads; a bar shifts no mirror image, and its side force is not shown.
    fn bodies(&self) -> Result<Vec<Arc<dyn SolvedBody>>, String> {
        let mut bodies: Vec<Arc<dyn SolvedBody>> = Vec::new();
        if let Some(body) = &self.pressed {
            bodies.push(Arc::new(body.clone()));
        }
        let [normal, side] = self.greatest;
        let on_top = self.elastic.side_contact == SideContact::Top;
        for (along, force, shown) in [
            (TopForce::Normal, normal, bodies.is_empty()),
            (TopForce::Side, side, on_top),
        ] {
            if shown && force != 0.0 {
                let body = self.unit.body(&self.elastic, (along, force));
                bodies.push(Arc::new(body.map_err(|failure| failure.to_string())?));
            }
        }
        Ok(bodies)
    }

    fn load_columns(&self) -> &'static [LoadColumn] {
        self.predictor.load_columns()
    }

    fn columns(&self) -> Vec<Column> {
        self.predictor.columns()
    }

    fn reading_columns(&self) -> Vec<String> {
        self.predictor.reading_columns()
    }

    fn clips(&self, load: &Load<'_>) -> bool {
        self.predictor.clips(load)
    }

    fn answer(&self, load: &Load<'_>, row: &mut Vec<Cell>) -> Result<(), LoadRefused> {
        self.predictor.answer(load, row)
    }

    fn curves(&self, given: &[bool]) -> Vec<Curve> {
        self.predictor.curves(given)
    }
}
