//! Force on one unit to signal, stage by stage.

use super::super::NotSolvable;
use super::ThreeAxisArray;
use crate::device::{AXES, force_loads, number_cell, number_column};
use crate::electronics::{Delivered, FrontEnd};
use crate::mechanics::{
    Cavity, Crosstalk, Deformation, ElasticDescription, Pressed, PressedUnit, SideContact,
    SolvedBody, Suspension, TopForce, UnitDrawing, UnitSolution,
};
use crate::predict::{Curve, Load, LoadColumn, LoadRefused, Loads, Predictor};
use crate::table::{Cell, Column};
use crate::transduction::{PlateReading, PublishedInverse, Response, TileEdges, UnitModel};

/// Response of one unit of a device to one load.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// The load: force x, y, pressing, N.
    pub force: [f64; 3],
    /// Motion of the tiles.
    pub deformation: Deformation,
    /// Capacitances.
    pub response: Response,
    /// Voltages of the amplifiers, V; none where capacitances are measured.
    pub voltage: [Option<f64>; 4],
    /// Numbers of a frame.
    pub numbers: [Delivered; 4],
    /// Force by the published inverse from these capacitances, N.
    pub published_inverse: [f64; 3],
    /// Capacitor 11 in parts, where its edges follow from the drawing.
    pub parts: Option<CapacitanceParts>,
    /// State of the unit under the load.
    pub state: LoadState,
}

/// Parts of the capacitance 11, F, and its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CapacitanceParts {
    /// The plate pair.
    pub plate: f64,
    /// Its four edges, all other electrodes grounded.
    pub edges: f64,
    /// Its corners, which the edges count twice.
    pub corners: f64,
    /// Least and greatest capacitance by the surroundings, without corners.
    pub surroundings: Option<[f64; 2]>,
    /// Slope of the capacitance against the air gap, F/m; `None` where a tile touches.
    pub by_air_gap: Option<f64>,
}

/// State of a unit under a load.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LoadState {
    /// Within the range in which the model was verified.
    Ok,
    /// Above the usable force, within the full scale.
    AboveUsable,
    /// Above the full scale.
    OutOfRange,
    /// A pair of electrodes is closed: its capacitance is a lower bound, unless the unit was solved
    /// beyond the first touch.
    Closed,
}

impl LoadState {
    /// Name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::AboveUsable => "above_usable",
            Self::OutOfRange => "out_of_range",
            Self::Closed => "closed",
        }
    }
}

/// Predicts loads on one unit: the first calibrated taxel, or else as drawn.
#[derive(Debug, Clone)]
pub struct ThreeAxisPredictor {
    unit: UnitModel,
    /// From the unit at rest.
    published_inverse: PublishedInverse,
    board: FrontEnd,
    usable_force: f64,
    full_scale: f64,
    /// Edges with the least and the greatest capacitance, where edges follow from the
    /// drawing.
    surroundings: Option<[TileEdges; 2]>,
    /// What is typed in and what follows from the drawing.
    remark: String,
    /// The drawing whose stiffness is solved by finite elements before the first answer.
    to_solve: Option<ToSolve>,
    /// The unit under normal forces at large strain, where a load passes the first touch.
    pressed: Option<PressedUnit>,
    /// Greatest normal and greatest side force of the loads, N: those of the bodies to show.
    greatest: [f64; 2],
}

/// A load this many times nearer to the first touch of linear elasticity is solved at large
/// strain.
const EARLY: f64 = 1.15;
/// Steps of the way to the largest normal force.
const PRESSED_STEPS: u32 = 8;

/// A unit to solve.
#[derive(Debug, Clone, Copy)]
struct ToSolve {
    elastic: ElasticDescription,
    drawing: UnitDrawing,
    solution: UnitSolution,
    /// Relative permittivity of the insulation.
    permittivity: f64,
    /// Spacing of the units of a row, m, if a unit has a neighbour there.
    row_pitch: Option<f64>,
}

impl ThreeAxisPredictor {
    /// A predictor for the units of `array`.
    pub fn new(array: &ThreeAxisArray<'_>) -> Self {
        let unit = array.typical_unit();
        Self {
            unit,
            published_inverse: PublishedInverse::new(unit.plates, unit.rest()),
            board: array.board.clone(),
            usable_force: array.element.usable_force,
            full_scale: array.element.full_scale,
            surroundings: array.edges().ok().map(|edges| edges.surroundings),
            remark: remark(array),
            to_solve: None,
            pressed: None,
            greatest: [0.0; 2],
        }
    }

    /// Makes the four air gaps larger by these lengths, m.
    pub(super) fn open(&mut self, by: [f64; 4]) {
        for (air, by) in self.unit.plates.air_gap.iter_mut().zip(by) {
            *air += by;
        }
        self.published_inverse = PublishedInverse::new(self.unit.plates, self.unit.rest());
    }

    /// The same whose stiffness is solved by finite elements.
    ///
    /// # Errors
    /// [`NotSolvable`] where it is typed in or calibrated.
    pub fn solving(array: &ThreeAxisArray<'_>) -> Result<Self, NotSolvable> {
        let element = array.element;
        if !element.calibrated.is_empty() {
            return Err(NotSolvable::Calibrated);
        }
        let from_drawing = element.suspension.from_drawing;
        let elastic = from_drawing.ok_or(NotSolvable::TypedIn)?;
        Ok(Self {
            to_solve: Some(ToSolve {
                elastic,
                drawing: array.unit_drawing(),
                solution: UnitSolution::default(),
                permittivity: element.plates.insulation_permittivity,
                row_pitch: (array.layout().columns > 1).then_some(array.sensor.array.pitch[0]),
            }),
            ..Self::new(array)
        })
    }

    /// The chain for a force x, y, pressing, N.
    ///
    /// ```
    /// let sensor = taxel::sensor::Sensor::shipped("three-axis-8x8").unwrap();
    /// let row = taxel::device::ThreeAxisPredictor::new(&sensor.three_axis().unwrap())
    ///     .predict([0.0, 0.0, 10e-3]);
    /// // P2: 10 mN raise the capacitance of the plates by 13 %; the edges rise less.
    /// let parts = row.parts.unwrap();
    /// assert!((parts.plate / 172.2977e-15 - 1.1324).abs() < 1e-4);
    /// assert!((row.response.capacitance()[0] / 204.02e-15 - 1.118).abs() < 1e-3);
    /// ```
    pub fn predict(&self, force: [f64; 3]) -> Prediction {
        let solved = self.pressed_by(force);
        let (deformation, response) = solved.map_or_else(
            || self.unit.predict(force),
            |pressed| self.respond_pressed(&pressed),
        );
        let capacitance = response.capacitance();
        let motion = self.published_inverse.motion(capacitance);
        let published_inverse = self
            .unit
            .suspension
            .force_from_displacement(motion.displacement)
            .unwrap_or([f64::NAN; 3]);
        Prediction {
            force,
            deformation,
            voltage: capacitance.map(|c| self.board.voltage(c)),
            numbers: capacitance.map(|c| self.board.read(c, 0.0)),
            published_inverse,
            parts: self.parts(&deformation, capacitance[0], solved.as_ref()),
            state: self.state(force, &response),
            response,
        }
    }

    /// The unit as it was solved under a normal force alone, N; `None` for other forces.
    fn pressed_by(&self, [x, y, z]: [f64; 3]) -> Option<Pressed> {
        self.pressed
            .as_ref()
            .filter(|_| x == 0.0 && y == 0.0)?
            .at(z)
    }

    /// Motion of the tiles and response of a unit that was solved.
    fn respond_pressed(&self, pressed: &Pressed) -> (Deformation, Response) {
        let plates = &self.unit.plates;
        let deformation = Deformation {
            displacement: [0.0, 0.0, pressed.closing],
            closing: [pressed.closing; 4],
            slope: [0.0; 2],
            bulge: [plates.air_gap[0] - pressed.closing - pressed.least_gap; 4],
        };
        let edges = plates
            .edges
            .map_or(0.0, |edges| of_edges(edges, plates.electrode, pressed));
        let reading = |i: usize| PlateReading {
            capacitance: plates.parallel_capacitance[i] + pressed.capacitance + edges,
            least_air_gap: pressed.least_gap.max(0.0),
        };
        let response = Response {
            plates: std::array::from_fn(reading),
        };
        (deformation, response)
    }

    fn parts(
        &self,
        deformation: &Deformation,
        total: f64,
        solved: Option<&Pressed>,
    ) -> Option<CapacitanceParts> {
        let plates = &self.unit.plates;
        let of_drawing = plates.edges?;
        let reading = |edges| match solved {
            Some(pressed) => of_edges(edges, plates.electrode, pressed),
            None => plates.edge_reading(edges, 0, deformation),
        };
        let with_corners = reading(of_drawing);
        let plate = total - with_corners;
        let between = |edges| plate + reading(edges);
        Some(CapacitanceParts {
            plate: plate - plates.parallel_capacitance[0],
            edges: with_corners - of_drawing.corners,
            corners: of_drawing.corners,
            surroundings: self.surroundings.map(|ends| ends.map(between)),
            by_air_gap: plates
                .slope_after(0, deformation)
                .filter(|_| solved.is_none()),
        })
    }

    /// Solves the unit at large strain where a normal force alone passes its first touch; answers
    /// what is to be said about it.
    fn press(
        &mut self,
        unit: &ToSolve,
        loads: &Loads,
        progress: &mut dyn FnMut(f64),
    ) -> Result<String, String> {
        let normal = forces(loads).filter(|[x, y, _]| *x == 0.0 && *y == 0.0);
        let largest = normal.map(|[_, _, z]| z).fold(0.0, f64::max);
        let even = self
            .unit
            .plates
            .air_gap
            .windows(2)
            .all(|gaps| gaps[0] == gaps[1]);
        let vented = unit.elastic.cavity == Cavity::Vented;
        if !vented || !even || self.unit.open_share([0.0, 0.0, EARLY * largest]) >= 1.0 {
            return Ok(String::new());
        }
        let solids = (unit.elastic.modulus, unit.permittivity);
        let path = (largest, PRESSED_STEPS);
        let mut heard = |share: f64| progress(0.3 + 0.7 * share);
        let pressed = unit.drawing.press(solids, &unit.solution, path, &mut heard);
        let pressed = pressed.map_err(|failure| failure.to_string())?;
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
        self.pressed = Some(pressed);
        Ok(touch + &ended)
    }

    fn state(&self, force: [f64; 3], response: &Response) -> LoadState {
        let largest = force
            .iter()
            .fold(0.0, |largest: f64, f| largest.max(f.abs()));
        if response.closed().contains(&true) {
            LoadState::Closed
        } else if largest > self.full_scale {
            LoadState::OutOfRange
        } else if largest > self.usable_force {
            LoadState::AboveUsable
        } else {
            LoadState::Ok
        }
    }
}

/// The forces of all loads along x, y and z, N.
fn forces(loads: &Loads) -> impl Iterator<Item = [f64; 3]> {
    (0..loads.len()).map(|number| {
        let load = loads.load(number);
        [0, 1, 2].map(|axis| load.number(axis).unwrap_or(0.0))
    })
}

/// Edges with corners, F, of a tile of these sides, m, whose inner and outer edges have the air
/// gaps of a solved unit.
fn of_edges(edges: TileEdges, electrode: [f64; 2], pressed: &Pressed) -> f64 {
    let [inner, outer] = pressed.edge_gaps;
    let rise = 0.5 * (inner - outer);
    let air = f64::midpoint(inner, outer);
    edges.at(electrode, air, [rise; 2]).capacitance
}

/// What of the answers is typed in and what follows from the drawing.
fn remark(array: &ThreeAxisArray<'_>) -> String {
    let unit = array.typical_unit();
    let (fitted, suspension) = (array.element.calibrated.first(), &array.element.suspension);
    let capacitance = if unit.plates.edges.is_some() {
        "the edges of the electrodes follow from the drawing"
    } else {
        "the parallel capacitance is typed in"
    };
    let stiffness = match (fitted, suspension.from_drawing) {
        (Some(_), _) => String::from("stiffness and gaps are calibrated"),
        (None, Some(elastic)) => format!(
            "the stiffness follows from the drawing with a modulus of {:.3} MPa",
            elastic.modulus * 1e-6
        ),
        (None, None) => {
            String::from("the stiffness is typed in: wall, cavities and layers do not change it")
        }
    };
    format!("{capacitance}; {stiffness}")
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

const CAPACITORS: [&str; 4] = ["11", "12", "21", "22"];
/// The force on a taxel, at most this much along each axis, N.
pub(super) static LOADS: [LoadColumn; 3] = force_loads(1e3);

impl Predictor for ThreeAxisPredictor {
    fn prepare(
        &mut self,
        loads: &Loads,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Option<String>, String> {
        let Some(unit) = self.to_solve else {
            return Ok(Some(self.remark.clone()));
        };
        let solved = unit
            .drawing
            .solve(&unit.solution)
            .map_err(|failure| failure.to_string())?;
        progress(if unit.row_pitch.is_some() { 0.1 } else { 0.2 });
        let beside = if let Some(pitch) = unit.row_pitch {
            let row = UnitDrawing {
                pitch,
                ..unit.drawing
            };
            let found = row.crosstalk(&unit.solution);
            progress(0.3);
            in_words(&found.map_err(|failure| failure.to_string())?)
        } else {
            String::new()
        };
        let found = solved.compliance;
        self.unit.suspension = Suspension::of_drawing(&unit.elastic, &unit.drawing, &found);
        let touch = self.press(&unit, loads, progress)?;
        let greatest = |axis: fn([f64; 3]) -> f64| {
            let larger = |most: f64, part: f64| if part.abs() > most.abs() { part } else { most };
            forces(loads).map(axis).fold(0.0, larger)
        };
        self.greatest = [
            greatest(|[.., z]| z),
            greatest(|[x, y, _]| x.abs().max(y.abs())),
        ];
        let over = |solved: f64, table: f64| 100.0 * (solved / table - 1.0);
        let beside_table = unit.drawing.compliance().map_or_else(
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
            self.remark,
            solved.unknowns,
            100.0 * found.error,
        )))
    }

    /// The unit under the greatest normal force and under the greatest side force on its flat top
    /// of all loads; a bar shifts no mirror image, and its side force is not shown.
    fn bodies(&self) -> Result<Vec<SolvedBody>, String> {
        let mut bodies: Vec<SolvedBody> =
            self.pressed.iter().map(|unit| unit.body.clone()).collect();
        let Some(unit) = &self.to_solve else {
            return Ok(bodies);
        };
        let [normal, side] = self.greatest;
        let on_top = unit.elastic.side_contact == SideContact::Top;
        for (along, force, shown) in [
            (TopForce::Normal, normal, bodies.is_empty()),
            (TopForce::Side, side, on_top),
        ] {
            if shown && force != 0.0 {
                let load = (along, force);
                let body = unit.drawing.body(&unit.elastic, &unit.solution, load);
                bodies.push(body.map_err(|failure| failure.to_string())?);
            }
        }
        Ok(bodies)
    }

    fn load_columns(&self) -> &'static [LoadColumn] {
        &LOADS
    }

    fn columns(&self) -> Vec<Column> {
        let force =
            |name: &str| AXES.map(|axis| Column::new(format!("{name}_{axis}"), "mN", 1e-3, "n", 3));
        let mut columns = Vec::from(force("force"));
        columns.extend(
            AXES.map(|axis| Column::new(format!("displacement_{axis}"), "nm", 1e-9, "m", 2)),
        );
        columns.extend(
            CAPACITORS.map(|c| Column::new(format!("capacitance_{c}"), "fF", 1e-15, "f", 3)),
        );
        if self.unit.plates.edges.is_some() {
            let part = |name: &str| Column::new(format!("{name}_11"), "fF", 1e-15, "f", 3);
            columns.extend(
                [
                    "plate",
                    "edges",
                    "corners",
                    "capacitance_least",
                    "capacitance_greatest",
                ]
                .map(part),
            );
            columns.push(Column::new(
                "capacitance_by_air_gap_11",
                "fF/um",
                1e-9,
                "f_per_m",
                3,
            ));
        }
        columns.push(Column::new("least_air_gap", "um", 1e-6, "m", 4));
        if self.board.voltage(0.0).is_some() {
            let voltage = |c| Column::new(format!("voltage_{c}"), "mV", 1e-3, "v", 3);
            columns.extend(CAPACITORS.map(voltage));
        }
        let last = &self.board.last;
        columns.extend(CAPACITORS.map(|c| number_column("", &format!("_{c}"), last)));
        columns.extend(force("published_inverse"));
        columns.push(Column::plain("state"));
        columns.push(Column::plain("closed"));
        columns
    }

    fn reading_columns(&self) -> Vec<String> {
        let voltage = self.board.voltage(0.0).is_some();
        let what = if voltage { "voltage" } else { "capacitance" };
        CAPACITORS.map(|c| format!("{what}_{c}")).to_vec()
    }

    fn clips(&self, load: &Load<'_>) -> bool {
        let answer = self.predict(std::array::from_fn(|axis| load.number(axis).unwrap_or(0.0)));
        answer.numbers.iter().any(|number| number.clipped)
    }

    fn answer(&self, load: &Load<'_>, row: &mut Vec<Cell>) -> Result<(), LoadRefused> {
        let answer = self.predict(std::array::from_fn(|axis| load.number(axis).unwrap_or(0.0)));
        row.extend(answer.force.map(Cell::Number));
        row.extend(answer.deformation.displacement.map(Cell::Number));
        row.extend(answer.response.capacitance().map(Cell::Number));
        if let Some(parts) = answer.parts {
            row.extend([parts.plate, parts.edges, parts.corners].map(Cell::Number));
            // A bound has no interval.
            let bound =
                answer.state == LoadState::Closed && self.pressed_by(answer.force).is_none();
            let ends = parts.surroundings.filter(|_| !bound);
            row.extend(match ends {
                Some(ends) => ends.map(Cell::Number),
                None => [Cell::from(""), Cell::from("")],
            });
            row.push(parts.by_air_gap.map_or(Cell::from(""), Cell::Number));
        }
        row.push(Cell::Number(answer.response.least_air_gap()));
        row.extend(answer.voltage.into_iter().flatten().map(Cell::Number));
        row.extend(
            answer
                .numbers
                .map(|number| number_cell(&number, &self.board.last)),
        );
        row.extend(answer.published_inverse.map(Cell::Number));
        row.push(Cell::from(answer.state.name()));
        let closed = answer.response.closed();
        row.push(if closed.contains(&true) {
            let names = (0..4).filter(|i| closed[*i]).map(|i| CAPACITORS[i]);
            Cell::from(names.collect::<Vec<_>>().join(" "))
        } else {
            Cell::from("")
        });
        Ok(())
    }

    fn curves(&self, given: &[bool]) -> Vec<Curve> {
        let named = (0..3).filter(|axis| given.get(*axis) == Some(&true));
        named
            .map(|axis| Curve {
                title: format!("Capacitances against the force along {}", AXES[axis]),
                x: LOADS[axis].name,
                y: vec![
                    "capacitance_11",
                    "capacitance_12",
                    "capacitance_21",
                    "capacitance_22",
                ],
                y_label: "capacitance",
            })
            .collect()
    }
}
