//! Force on one unit to signal, stage by stage.

use super::ThreeAxisArray;
use crate::device::{AXES, force_loads, number_cell, number_column};
use crate::electronics::{CapacitanceBoard, Delivered};
use crate::mechanics::{Pressed, PressedUnit, Suspension, ThreeAxisDeformation};
use crate::predict::{Curve, Load, LoadColumn, LoadRefused, Loads, Predictor};
use crate::table::{Cell, Column};
use crate::transduction::{
    PlateReading, PublishedInverse, ThreeAxisModel, ThreeAxisResponse, TileEdges,
};

/// Response of one unit of a device to one load.
#[derive(Debug, Clone, PartialEq)]
pub struct ThreeAxisPrediction {
    /// The load: force x, y, pressing, N.
    pub force: [f64; 3],
    /// Motion of the tiles.
    pub deformation: ThreeAxisDeformation,
    /// Capacitances.
    pub response: ThreeAxisResponse,
    /// Voltages of the amplifiers, V; none where capacitances are measured.
    pub voltage: [Option<f64>; 4],
    /// Numbers of a frame.
    pub numbers: [Delivered; 4],
    /// Force by the published inverse from these capacitances, N.
    pub published_inverse: [f64; 3],
    /// Capacitor 11 in parts, where its edges follow from the drawing.
    pub parts: Option<CapacitanceParts>,
    /// State of the unit under the load.
    pub state: ThreeAxisLoadState,
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
pub enum ThreeAxisLoadState {
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

impl ThreeAxisLoadState {
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
    unit: ThreeAxisModel,
    /// From the unit at rest.
    published_inverse: PublishedInverse,
    board: CapacitanceBoard,
    usable_force: f64,
    full_scale: f64,
    /// Edges with the least and the greatest capacitance, where edges follow from the
    /// drawing.
    surroundings: Option<[TileEdges; 2]>,
    /// What is typed in and what follows from the drawing.
    remark: String,
    /// The unit under normal forces at large strain, where a load passes the first touch.
    pressed: Option<PressedUnit>,
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
            pressed: None,
        }
    }

    /// Makes the four air gaps larger by these lengths, m.
    pub(super) fn open(&mut self, by: [f64; 4]) {
        for (air, by) in self.unit.plates.air_gap.iter_mut().zip(by) {
            *air += by;
        }
        self.published_inverse = PublishedInverse::new(self.unit.plates, self.unit.rest());
    }

    /// The model of the unit.
    pub fn unit(&self) -> &ThreeAxisModel {
        &self.unit
    }

    /// What is typed in and what follows from the drawing.
    pub fn remark(&self) -> &str {
        &self.remark
    }

    /// Takes a suspension in the place of that of the drawing.
    pub fn suspend(&mut self, suspension: Suspension) {
        self.unit.suspension = suspension;
    }

    /// Answers normal forces alone by a unit that was solved at large strain.
    pub fn press(&mut self, pressed: PressedUnit) {
        self.pressed = Some(pressed);
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
    pub fn predict(&self, force: [f64; 3]) -> ThreeAxisPrediction {
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
        ThreeAxisPrediction {
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
    fn respond_pressed(&self, pressed: &Pressed) -> (ThreeAxisDeformation, ThreeAxisResponse) {
        let plates = &self.unit.plates;
        let deformation = ThreeAxisDeformation {
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
        let response = ThreeAxisResponse {
            plates: std::array::from_fn(reading),
        };
        (deformation, response)
    }

    fn parts(
        &self,
        deformation: &ThreeAxisDeformation,
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

    fn state(&self, force: [f64; 3], response: &ThreeAxisResponse) -> ThreeAxisLoadState {
        let largest = force
            .iter()
            .fold(0.0, |largest: f64, f| largest.max(f.abs()));
        if response.closed().contains(&true) {
            ThreeAxisLoadState::Closed
        } else if largest > self.full_scale {
            ThreeAxisLoadState::OutOfRange
        } else if largest > self.usable_force {
            ThreeAxisLoadState::AboveUsable
        } else {
            ThreeAxisLoadState::Ok
        }
    }
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

const CAPACITORS: [&str; 4] = ["11", "12", "21", "22"];
/// The force on a taxel, at most this much along each axis, N.
pub(super) static LOADS: [LoadColumn; 3] = force_loads(1e3);

impl Predictor for ThreeAxisPredictor {
    fn prepare(
        &mut self,
        _loads: &Loads,
        _progress: &mut dyn FnMut(f64),
    ) -> Result<Option<String>, String> {
        Ok(Some(self.remark.clone()))
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
            let bound = answer.state == ThreeAxisLoadState::Closed
                && self.pressed_by(answer.force).is_none();
            let ends = parts.surroundings.filter(|_| !bound);
            row.extend(match ends {
                Some(ends) => ends.map(Cell::Number),
                None => [Cell::Missing, Cell::Missing],
            });
            row.push(parts.by_air_gap.map_or(Cell::Missing, Cell::Number));
        }
        row.push(Cell::Number(answer.response.least_air_gap()));
        row.extend(answer.voltage.into_iter().flatten().map(Cell::Number));
        row.extend(
            answer
                .numbers
                .map(|number| number_cell(&number, &self.board.last)),
        );
        row.extend(answer.published_inverse.map(Cell::Number));
        row.push(Cell::State(answer.state.name()));
        let closed = answer.response.closed();
        row.push(if closed.contains(&true) {
            let names = (0..4).filter(|i| closed[*i]).map(|i| CAPACITORS[i]);
            Cell::from(names.collect::<Vec<_>>().join(" "))
        } else {
            Cell::Missing
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
