//! The sensor file: the only description of a device.

mod checks;
mod in_plane_capacitor;
mod mask;
mod measured_force;
mod microchannel;
mod piezoelectric;
mod three_axis_capacitor;
mod trained_body;

use schemars::JsonSchema;
use serde::Deserialize;

use crate::electronics::Electronics;
use crate::layout::{ArrayDescription, Layout};
use crate::mechanics::Mechanics;
use crate::schema;
use crate::solutions::Solutions;
use crate::stage::{BodyElement, Cells, MagneticSkin, OwnParts};

pub use in_plane_capacitor::{GapScatter, InPlaneCapacitor};
pub use mask::{CapacitorName, Mask};
pub use measured_force::MeasuredForce;
pub use microchannel::{
    ClosingDescription, FoundChannels, LayerDescription, Liquid, Microchannel,
    MicrochannelFabrication, PlaneStrainCell, SectionDescription,
};
pub use piezoelectric::{
    CeramicDescription, CoverContact, CoverDescription, InPlane, Piezoelectric,
    PiezoelectricFabrication, Seat, SeatHeight,
};
pub use three_axis_capacitor::{CalibratedUnit, Fabrication, Outline, ThreeAxisCapacitor};

pub use trained_body::{ChannelGroup, MOST_CHANNELS, TrainedBody};

pub use checks::{Broken, micrometres};
pub(crate) use checks::{
    check as check_keys, check_instrument, check_scan_time, require, rounded_down, rounded_up,
};
pub(crate) use mask::table as masked_capacitors;

/// The version of the sensor file that this program reads.
pub const SCHEMA_VERSION: u32 = 2;

/// Shipped sensor files: name and text.
const SHIPPED: &[(&str, &str)] = &[
    (
        "three-axis-8x8",
        include_str!("../../sensors/three-axis-8x8.toml"),
    ),
    (
        "three-axis-unit",
        include_str!("../../sensors/three-axis-unit.toml"),
    ),
    (
        "in-plane-20um",
        include_str!("../../sensors/in-plane-20um.toml"),
    ),
    (
        "in-plane-50um",
        include_str!("../../sensors/in-plane-50um.toml"),
    ),
    (
        "in-plane-100um",
        include_str!("../../sensors/in-plane-100um.toml"),
    ),
    (
        "piezo-1.5mm",
        include_str!("../../sensors/piezo-1.5mm.toml"),
    ),
    (
        "piezo-2.3mm",
        include_str!("../../sensors/piezo-2.3mm.toml"),
    ),
    (
        "liquid-metal-2x4",
        include_str!("../../sensors/liquid-metal-2x4.toml"),
    ),
    ("force-4x4", include_str!("../../sensors/force-4x4.toml")),
    (
        "resistive-mat-8x8",
        include_str!("../../sensors/resistive-mat-8x8.toml"),
    ),
    (
        "pressure-chips-1x8",
        include_str!("../../sensors/pressure-chips-1x8.toml"),
    ),
    (
        "magnet-over-four-hall",
        include_str!("../../sensors/magnet-over-four-hall.toml"),
    ),
    (
        "eflesh-lattice",
        include_str!("../../sensors/eflesh-lattice.toml"),
    ),
    ("soft-dome", include_str!("../../sensors/soft-dome.toml")),
];

const REFERENCE_HEAD: &str = "\
# Sensor-file reference

Every key of a sensor file. `taxel schema reference` prints this page from the types that read the file, so it is
current. [The guide](first-sensor-file.md) explains how to write one, [another](which-model.md) which model to choose.

Each section is a table of the file; its title is the path of the table, and the path of a key is that title, a dot and
the key. A table may also be written in braces behind its key: `mount = { cylinder = { radius = \"4 mm\" } }`; keys
that belong to one value of several, such as `mount.cylinder.radius`, are required where that value is chosen. `[]` in
a path stands for each entry of a list. A required key has no default. Any other key is refused.

A modulus may be that of a material: `{ material = \"rtv615\" }` names one of `taxel material list`, and `{ material = {
file = \"silicone.toml\" } }` a law file of `taxel material fit`, from the folder of the sensor file. So may the
`material` of microchannels: `material = \"ecoflex-00-30\"`. [The guide](material.md) says what follows from it.
";

/// A device as its file describes it, with an element of a user's own or one that is shipped
/// ([`Sensor`]).
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Sensor")]
pub struct Described<E> {
    /// Version of this format: 2.
    #[schemars(extend("const" = 2))]
    pub schema: u32,
    /// Name of the device.
    pub name: String,
    /// Number and positions of the taxels.
    pub array: ArrayDescription,
    /// Element of one taxel.
    pub element: E,
    /// The board that reads the taxels.
    pub electronics: Electronics,
    /// Which mechanics predicts; `taxel predict --mechanics` overrides it.
    #[serde(default)]
    pub mechanics: Mechanics,
    /// Taxels or capacitors that are known not to work.
    #[serde(default)]
    pub mask: Vec<Mask>,
}

/// A device as its file describes it.
pub type Sensor = Described<Element>;

impl<E> Described<E> {
    /// The same device with another element.
    pub(crate) fn with<F>(self, element: F) -> Described<F> {
        Described {
            schema: self.schema,
            name: self.name,
            array: self.array,
            element,
            electronics: self.electronics,
            mechanics: self.mechanics,
            mask: self.mask,
        }
    }
}

/// Element of a taxel; the header in the file names the model.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Element {
    /// Four capacitors under one bump (P2).
    ThreeAxisCapacitor(Box<ThreeAxisCapacitor>),
    /// Two electrodes side by side in a soft layer (P1).
    InPlaneCapacitor(Box<InPlaneCapacitor>),
    /// Piezoelectric plates in a soft cover (P3).
    Piezoelectric(Box<Piezoelectric>),
    /// Two crossing layers of liquid-metal microchannels (P4).
    Microchannel(Box<Microchannel>),
    /// A body without a physical model, whose channels are learned.
    Trained(Box<TrainedBody>),
    /// Taxels whose board gives forces.
    MeasuredForce(MeasuredForce),
    /// Cells below a cover, read through a network.
    Cells(Box<Cells>),
    /// Magnets in rubber over magnetometers.
    MagneticSkin(Box<MagneticSkin>),
    /// A body of a problem file, solved by finite elements once.
    Body(Box<BodyElement>),
    /// One of a user's own ([`crate::device::Registry`]).
    #[serde(skip)]
    #[schemars(skip)]
    Own(OwnParts),
}

/// A board that cannot read this kind of element.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Unreadable {
    /// Its first stage takes something else.
    #[error("a {readout} cannot read a {element}; it needs: {allowed}")]
    Stage {
        /// Key of the element.
        element: &'static str,
        /// Key of the stage found.
        readout: &'static str,
        /// Keys of the stages that can.
        allowed: String,
    },
    /// Its instrument gives another quantity.
    #[error("\"{symbol}\" is a unit of {found}; an instrument at a {element} gives {needed}")]
    Unit {
        /// Key of the element.
        element: &'static str,
        /// The unit in the sensor file.
        symbol: &'static str,
        /// Quantity of this unit.
        found: &'static str,
        /// Quantities that the element has.
        needed: String,
        /// Their units.
        units: String,
    },
    /// The stage before its instrument takes something else.
    #[error("in front of \"{symbol}\" a {element} has no {stage}")]
    Before {
        /// Key of the element.
        element: &'static str,
        /// The unit of the instrument.
        symbol: &'static str,
        /// Key of the stage in the sensor file.
        stage: &'static str,
        /// Key of the stages that can stand there, and before which unit.
        help: String,
    },
}

impl Unreadable {
    /// Key at which a sensor file shows it.
    pub(crate) fn key(&self) -> &'static str {
        match self {
            Self::Stage { .. } => "electronics.readout",
            Self::Unit { .. } => "electronics.readout.measured.unit",
            Self::Before { .. } => "electronics.readout.measured.stage",
        }
    }

    /// What to do.
    pub(crate) fn help(&self) -> String {
        match self {
            Self::Stage { .. } => "give one of those stages".into(),
            Self::Unit { units, .. } => format!("use one of: {units}"),
            Self::Before { help, .. } => help.clone(),
        }
    }
}

/// A device of which nothing can be computed, because its drawing says nothing
/// of its mechanics.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "nothing follows from the drawing of an array with the element `{element}`: it has no physical model\nhelp: train it with `taxel calibrate SENSOR RECORDINGS -o CAL.toml`; with positions in \
     the recordings, `taxel predict SENSOR --calibration CAL.toml` then answers the channels at a position"
)]
pub struct NoModel {
    /// Key of the element.
    pub element: &'static str,
}

/// An element of whose drawing fast forms are solved, or read from a table that
/// the sensor file names.
trait Solvable {
    /// Rules between the lengths of the drawing.
    ///
    /// # Errors
    /// The first broken rule, shown at its key.
    fn check_lengths(&self, array: &ArrayDescription) -> Result<(), Broken>;

    /// Takes `table` (its name and text) or goes back to the fast forms and solves what no shipped
    /// table has.
    ///
    /// # Errors
    /// The key of a part that has no solution, no model or not this table.
    fn solve(
        &mut self,
        array: &ArrayDescription,
        table: Option<(&str, &str)>,
        solutions: &mut dyn Solutions,
    ) -> Result<(), Broken>;
}

/// Refuses the table of an element, by its key, that has no load path.
fn no_table(key: &str, named: bool) -> Result<(), Broken> {
    require(
        !named,
        "mechanics.table",
        || format!("an array with the element `{key}` takes no table"),
        "leave mechanics out: tables are of an in_plane_capacitor, a microchannel or a body",
    )
}

impl Solvable for BodyElement {
    fn check_lengths(&self, _array: &ArrayDescription) -> Result<(), Broken> {
        // The lengths of a body are those of its mesh.
        Ok(())
    }

    fn solve(
        &mut self,
        _array: &ArrayDescription,
        table: Option<(&str, &str)>,
        solutions: &mut dyn Solutions,
    ) -> Result<(), Broken> {
        let solved = BodyElement::solve(self, table, solutions);
        solved.map_err(|(key, message, help)| Broken::new(&key, message, &help))
    }
}

impl Element {
    /// Name of the shipped script that shows the element in use.
    pub fn usual_script(&self) -> &'static str {
        match self {
            Self::ThreeAxisCapacitor(_) => "finger",
            // The twin of a trained element is refused before a script matters.
            Self::InPlaneCapacitor(_) | Self::Trained(_) => "press",
            Self::Piezoelectric(_) => "piezo-slide",
            Self::Microchannel(_) => "pad-b",
            Self::MeasuredForce(_) | Self::Cells(_) | Self::Own(_) => "two-fingers",
            Self::MagneticSkin(_) | Self::Body(_) => "push",
        }
    }

    /// The kinds that are solved.
    fn solvable(&mut self) -> Option<&mut dyn Solvable> {
        match self {
            Self::ThreeAxisCapacitor(element) => Some(element.as_mut()),
            Self::InPlaneCapacitor(element) => Some(element.as_mut()),
            Self::Microchannel(element) => Some(element.as_mut()),
            Self::Body(element) => Some(element.as_mut()),
            _ => None,
        }
    }

    /// Key of the element in a sensor file.
    pub fn key(&self) -> &'static str {
        match self {
            Self::ThreeAxisCapacitor(_) => "three_axis_capacitor",
            Self::InPlaneCapacitor(_) => "in_plane_capacitor",
            Self::Piezoelectric(_) => "piezoelectric",
            Self::Microchannel(_) => "microchannel",
            Self::Trained(_) => "trained",
            Self::MeasuredForce(_) => "measured_force",
            Self::Cells(_) => "cells",
            Self::MagneticSkin(_) => "magnetic_skin",
            Self::Body(_) => "body",
            Self::Own(own) => own.key,
        }
    }
}

impl Sensor {
    /// Rules between the lengths of a drawing that may have to be solved.
    ///
    /// # Errors
    /// The first broken rule, shown at its key.
    pub(crate) fn check_lengths(&mut self) -> Result<(), Broken> {
        let element = self.element.solvable();
        element.map_or(Ok(()), |element| element.check_lengths(&self.array))
    }

    /// Solves what the fast forms of the drawing need and no shipped table has, and checks
    /// that there is a model of all parts then.
    ///
    /// # Errors
    /// The key of a part that has no solution or no model.
    pub(crate) fn solve(&mut self, solutions: &mut dyn Solutions) -> Result<(), Broken> {
        let key = self.element.key();
        let named = match &self.mechanics {
            Mechanics::Table(name) => Some(name.as_str()),
            _ => None,
        };
        let Some(element) = self.element.solvable() else {
            return no_table(key, named.is_some());
        };
        let text = named.map(|name| solutions.table(name)).transpose();
        let text = text.map_err(|message| {
            let help =
                "give a file that taxel tabulate wrote; its name is relative to the sensor file";
            Broken::new("mechanics.table", message, help)
        })?;
        let table = named.zip(text.as_deref());
        element.solve(&self.array, table, solutions)
    }

    /// The same sensor by closed forms where its file names a table; what they need of the drawing
    /// comes from `solutions`.
    ///
    /// # Errors
    /// A sentence when the closed forms do not have the drawing.
    pub fn by_closed_forms(&self, solutions: &mut dyn Solutions) -> Result<Self, String> {
        let mut sensor = self.clone();
        if matches!(self.element, Element::Body(_)) {
            // Its table is the only fast form that it has.
            return Ok(sensor);
        }
        sensor.mechanics = Mechanics::ClosedForm;
        sensor
            .solve(solutions)
            .map_err(|broken| broken.to_string())?;
        Ok(sensor)
    }

    /// The body of a problem file, if its element is one.
    pub fn body(&self) -> Option<&BodyElement> {
        match &self.element {
            Element::Body(body) => Some(body),
            _ => None,
        }
    }

    /// Names of the shipped sensor files.
    pub fn shipped_names() -> impl Iterator<Item = &'static str> {
        SHIPPED.iter().map(|(name, _)| *name)
    }

    /// Text of a shipped sensor file.
    pub fn shipped_text(name: &str) -> Option<&'static str> {
        SHIPPED
            .iter()
            .find(|(shipped, _)| *shipped == name)
            .map(|(_, text)| *text)
    }

    /// A shipped sensor.
    pub fn shipped(name: &str) -> Option<Self> {
        Self::shipped_text(name).and_then(|text| Self::parse(name, text).ok())
    }

    /// Where the taxels are.
    pub fn layout(&self) -> Layout {
        Layout::new(&self.array)
    }

    /// The JSON schema of the sensor file, as committed beside the shipped
    /// files; editors complete and check with it.
    pub fn json_schema() -> String {
        taxel_material::schema::<Self>()
    }

    /// The reference of the sensor file, Markdown: every key with its meaning,
    /// unit and range, from the same types as [`Self::json_schema`].
    pub fn reference() -> String {
        schema::reference::<Self>(REFERENCE_HEAD)
    }
}
