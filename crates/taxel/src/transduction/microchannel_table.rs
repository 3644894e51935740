//! What is read from the table of two crossing layers of microchannels.

use std::fmt::Write as _;

use super::path_table::{Contents, Course, PathTable, PathVariable, WrongTable};
use crate::mechanics::{
    AlongChannel, ClosingCurve, Hyperelastic, MicrochannelError, PressureLaw, SectionShape,
    VoidStack,
};
use crate::of_drawing::{SOLVER_VERSION, digits};
use taxel_numerics::MonotoneCurve;

/// Raised whenever mesh, steps or numbers of the solution change.
const METHOD: u32 = 1;

/// Numbers of one layer at a node.
pub const OF_LAYER: usize = 5;
/// Index of the net pressure among them, Pa.
pub const NET: usize = 0;
/// Index of the area over that at rest.
const AREA: usize = 1;
/// Index of the area of the thinnest section over that at rest.
const THINNEST: usize = 2;
/// Index of the conductance over that at rest.
pub const CONDUCTANCE: usize = 3;
/// Index of the smallest gap over the height of a channel.
const GAP: usize = 4;
/// The numbers of one layer at rest.
pub const REST: [f64; OF_LAYER] = [0.0, 1.0, 1.0, 1.0, 1.0];

/// What the table of crossing layers holds.
pub static CONTENTS: Contents = Contents {
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
pub const HIGHEST: f64 = 100e6;
/// Gap over that at rest that counts as touching.
pub const TOUCHING: f64 = 1e-3;

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
    /// Reads the text of a table of these layers.
    ///
    /// # Errors
    /// [`WrongTable`].
    pub fn read(&self, text: &str) -> Result<LayersTable, WrongTable> {
        let table = PathTable::read(text, &CONTENTS, &self.path_statement())?;
        let no_curve =
            |error: &str| WrongTable::Unreadable(format!("its numbers are no curve{error}"));
        if table.ends()[0].iter().ne(REST.iter().chain(&REST)) {
            return Err(no_curve(": it does not begin at rest"));
        }
        let closing = layer_curves(&table).map_err(|error| no_curve(&format!(": {error}")))?;
        Ok(LayersTable { table, closing })
    }

    /// All that a table follows from, as `key = value`.
    pub fn path_statement(&self) -> Vec<String> {
        let stack = &self.stack;
        let Hyperelastic::MooneyRivlin(material) = &stack.material;
        let upper = if self.position[0] == 0 {
            "rows"
        } else {
            "columns"
        };
        let mut text = format!(
            "solution = two crossing layers of microchannels, the whole top pressed\n\
             solver = taxel-fem {SOLVER_VERSION} method {METHOD}\n\
             upper = {upper}\n"
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
}

/// Closing curves of the row and of the column layer.
///
/// # Errors
/// [`MicrochannelError`] when the numbers are no curves.
pub fn layer_curves(table: &PathTable) -> Result<[ClosingCurve; 2], MicrochannelError> {
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
