//! Kinds of device, each in its own file or folder.
//!
//! The physics of a device stands in [`crate::mechanics`],
//! [`crate::transduction`] and [`crate::electronics`]; here it is joined to
//! what a user asks: is the drawing sound, what follows from it, what does a
//! load read, what does the twin deliver, how does it look.

mod chain;
mod in_plane_capacitor;
mod measured_force;
mod microchannel;
mod of_sensor;
mod piezoelectric;
mod three_axis_capacitor;
mod trained;

use crate::acquisition::{SignalUnit, Simulated, Stream};
use crate::drawing::Drawing;
use crate::electronics::{CapacitanceBoard, Delivered, LastStage};
use crate::estimation::{FrameError, ObserverOptions, Reader, TouchSession};
use crate::information::{Information, InformationOptions, NoInformation};
use crate::layout::Layout;
use crate::predict::{Load, LoadColumn, LoadKind, Predictor};
use crate::quantity::{CAPACITANCE, Dimension, FORCE};
use crate::sensor::{Broken, Sensor, require};
use crate::stage::Chain;
use crate::summary::{Fact, fact, number, text};
use crate::table::{Cell, Column};
use crate::transduction::PathTable;

pub use chain::{ChainDevice, ChainPredictor, ChainReader, Registry, read_back};
pub use in_plane_capacitor::{InPlaneArray, InPlaneLoadState, InPlanePrediction, InPlanePredictor};
pub use measured_force::MeasuredForceArray;
pub use microchannel::{
    LAYERS, LayerAnswer, MicrochannelArray, MicrochannelLayerState, MicrochannelPrediction,
    MicrochannelPredictor, PartAnswer, loads as microchannel_loads,
};
pub use piezoelectric::{
    Drive, PiezoelectricArray, PiezoelectricPredictor, PlaceInformation, PlacedContact, TestAnswer,
};
pub use three_axis_capacitor::{
    CapacitanceParts, ThreeAxisArray, ThreeAxisLoadState, ThreeAxisPrediction, ThreeAxisPredictor,
};
pub use trained::{ReadingUnit, TrainedArray, TrainedPredictor};

/// A soft cover over square elements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElementCover {
    /// Thickness of the cover above the elements, m.
    pub thickness: f64,
    /// Side of an element, m.
    pub side: f64,
}

/// One kind of device, made from its sensor file ([`crate::sensor::Sensor::device`]).
pub trait Device {
    /// Rules between the keys of the sensor file that concern this element.
    ///
    /// # Errors
    /// The first broken rule, shown at its key.
    fn check(&self) -> Result<(), Broken>;

    /// Names of channels that can be masked; of a device whose channels belong to its
    /// taxels none.
    fn named_channels(&self) -> Vec<String> {
        Vec::new()
    }

    /// Derived quantities for `taxel check`, in the order of the signal:
    /// groups `mechanics`, `transduction`, `electronics`, `estimation`,
    /// `numerics`.
    fn facts(&self) -> Vec<Fact>;

    /// Loads in, electrical response out; none for a device of which nothing
    /// follows ([`crate::sensor::NoModel`]).
    fn predictor(&self) -> Option<Box<dyn Predictor>>;

    /// Loads at which [`Device::information`] is asked for; none for a device without it.
    fn information_loads(&self) -> &'static [LoadColumn] {
        &[]
    }

    /// Dimension of the noise that a question for [`Device::information`] may state.
    fn information_noise(&self) -> &'static Dimension {
        &CAPACITANCE
    }

    /// What one frame says of a load; the columns are those of
    /// [`Device::information_loads`].
    ///
    /// # Errors
    /// [`NoInformation`] for a device without a model, and beyond the model.
    fn information(
        &self,
        load: &Load<'_>,
        options: &InformationOptions,
    ) -> Result<Information, NoInformation> {
        let _ = (load, options);
        Err(NoInformation::Kind)
    }

    /// The largest answer on an axis or a taxel that a load is not on, over that on the loaded one.
    ///
    /// # Errors
    /// [`NoInformation`] for a device whose model has none, and a load on several axes or on none.
    fn crosstalk(&self, load: &Load<'_>) -> Result<f64, NoInformation> {
        let _ = load;
        Err(NoInformation::Kind)
    }

    /// Time constants of all in the model that follows a load with a delay or forgets it, s:
    /// relaxation, leak, filter.
    fn time_constants(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Corner frequencies between which the output follows the load, Hz; none for a device whose
    /// output holds a load at rest, or is not limited above.
    fn band(&self) -> Option<[f64; 2]> {
        None
    }

    /// Which of several ways answers for its drawing, such as a table or a solution: drawings with
    /// other words are not points of one curve. Empty for a device with one way.
    fn way(&self) -> String {
        String::new()
    }

    /// Most that its soft layer is compressed in the range that it reads, a share of the thickness;
    /// none where its model does not say.
    fn compression(&self) -> Option<f64> {
        None
    }

    /// Predictor of a device that was not made as drawn: each length or gain whose standard
    /// deviation the table `fabrication` of the sensor file states is off by that times a number
    /// of `normal`. None for a device without such a table.
    fn made(&self, normal: &mut dyn FnMut() -> f64) -> Option<Box<dyn Predictor>> {
        let _ = normal;
        None
    }

    /// Keys of the sensor file that may have a value for each capacitor of a taxel in the place of
    /// one for all, with the number of these.
    fn lists(&self) -> &'static [(&'static str, usize)] {
        &[]
    }

    /// The stages of its signal, as drawn; none for a device that is no chain of them, or whose loads
    /// do not follow from its readings.
    fn stages(&self) -> Option<Chain> {
        None
    }

    /// Soft cover that spreads a contact over the elements; none for a device whose contacts press
    /// the taxel below them.
    fn cover(&self) -> Option<ElementCover> {
        None
    }

    /// One piece of fabrication for the simulated twin; none without a
    /// physical model.
    fn simulated(&self) -> Option<Box<dyn Simulated>>;

    /// Reader of the frames of `stream`, calibrated as drawn: how readings become
    /// values.
    ///
    /// # Errors
    /// [`FrameError`] when the frames cannot be of this device.
    fn reader(&self, stream: &Stream) -> Result<Box<dyn Reader>, FrameError>;

    /// Options for following contacts and events of the device.
    fn observed(&self, stream: &Stream) -> ObserverOptions {
        ObserverOptions::new(stream)
    }

    /// Estimator and observer of the frames of `stream`.
    ///
    /// # Errors
    /// [`FrameError`] when the frames cannot be of this device.
    fn session(&self, stream: &Stream) -> Result<TouchSession, FrameError> {
        Ok(TouchSession::new(
            self.reader(stream)?,
            self.observed(stream),
        ))
    }

    /// Top view and cross-section to scale.
    fn drawing(&self) -> Drawing;
}

/// Refuses frames that carry another quantity than the board gives.
fn carries(stream: &Stream, last: &LastStage) -> Result<(), FrameError> {
    let (found, unit) = (stream.unit.quantity, last.unit());
    if found == unit.quantity {
        Ok(())
    } else {
        Err(FrameError::quantity(found, &unit))
    }
}

/// Refuses masks of channels that the device does not have.
fn check_masked_channels(sensor: &Sensor, device: &dyn Device) -> Result<(), Broken> {
    let names = device.named_channels();
    for (index, mask) in sensor.mask.iter().enumerate() {
        let Some(channel) = &mask.channel else {
            continue;
        };
        let key = format!("mask.{index}.channel");
        let taxels = "the channels of this device belong to its taxels";
        let help = "write taxel = [row, column]";
        require(!names.is_empty(), &key, || taxels.into(), help)?;
        require(
            names.contains(channel),
            &key,
            || format!("there is no channel \"{channel}\""),
            &format!("use one of: {}", names.join(", ")),
        )?;
    }
    Ok(())
}

/// Refuses masks of capacitors on a device whose taxels are not made of four.
fn check_mask(sensor: &Sensor) -> Result<(), Broken> {
    for (index, mask) in sensor.mask.iter().enumerate() {
        require(
            mask.capacitor.is_none(),
            &format!("mask.{index}.capacitor"),
            || "a taxel of this device has no four capacitors".into(),
            "leave the key out to mask the taxel",
        )?;
    }
    Ok(())
}

/// Refuses a board without noise, or one that cannot read what its capacitors have at least.
fn check_capacitor_board(
    board: &CapacitanceBoard,
    at_least: Option<(&str, f64)>,
) -> Result<(), Broken> {
    require(
        board.deviation() > 0.0,
        board.noise_key(),
        || "a board without any noise gives no uncertainty".into(),
        "give the noise of one reading, such as \"0.1 mV\"",
    )?;
    let [_, most] = board.span();
    match at_least {
        // What is added may bring a value that is too low into the range.
        Some((what, value)) if value >= most => check_readable(board, what, value),
        _ => Ok(()),
    }
}

/// Refuses a capacitance, F, that the board cannot read.
fn check_readable(board: &CapacitanceBoard, what: &str, value: f64) -> Result<(), Broken> {
    let [least, most] = board.span();
    require(
        least < value && value < most,
        board.last.range_key(),
        || {
            format!(
                "{what} of {:.2} fF is outside what the board can read, {:.2} to {:.2} fF",
                value * 1e15,
                least * 1e15,
                most * 1e15
            )
        },
        "change the range, or the drive or the feedback capacitor of an amplifier",
    )
}

/// Refuses frames that do not have `expected` channels in rows of `columns`
/// taxels.
fn fits(stream: &Stream, expected: usize, columns: usize) -> Result<(), FrameError> {
    if stream.channels() != expected || stream.columns != columns {
        return Err(FrameError::Channels {
            found: stream.channels(),
            expected,
        });
    }
    Ok(())
}

/// Frames of numbers in `unit`, `channels_per_taxel` for each taxel of `layout`, every
/// `period` s.
fn stream_of(layout: &Layout, channels_per_taxel: usize, period: f64, unit: SignalUnit) -> Stream {
    let pitch = [layout.pitch[1], layout.pitch[0]];
    let taxels = [layout.rows, layout.columns];
    Stream {
        unit,
        ..Stream::of_counts(taxels, pitch, channels_per_taxel, period)
    }
}

/// Names of the axes in columns.
const AXES: [&str; 3] = ["x", "y", "z"];

/// The force on a taxel as a load, at most `largest` along each axis, N.
const fn force_loads(largest: f64) -> [LoadColumn; 3] {
    const fn axis(
        name: &'static str,
        short: &'static str,
        about: &'static str,
        largest: f64,
    ) -> LoadColumn {
        LoadColumn {
            name,
            short,
            kind: LoadKind::Quantity(&FORCE, [-largest, largest]),
            required: true,
            about,
        }
    }
    [
        axis("force_x", "fx", "side force along x", largest),
        axis("force_y", "fy", "side force along y", largest),
        axis("force_z", "fz", "pressing force", largest),
    ]
}

/// Column of the numbers of a frame: counts, or values in the unit of the instrument.
fn number_column(prefix: &str, suffix: &str, last: &LastStage) -> Column {
    let name = |what: &str| format!("{prefix}{what}{suffix}");
    let LastStage::Instrument(measured) = last else {
        return Column::plain(name("counts"));
    };
    let unit = &measured.unit;
    let key = unit.key();
    Column::new(name("reading"), unit.symbol, unit.si_per_unit, key, 4)
}

/// Cell of a number of a frame.
fn number_cell(delivered: &Delivered, last: &LastStage) -> Cell {
    match last {
        LastStage::Converter(_) => Cell::Whole(delivered.number as u64),
        LastStage::Instrument(_) => Cell::Number(delivered.number),
    }
}

/// Times of a board for a frame and for the `scan` in it, s.
fn timing(period: f64, scan: f64, of_what: &'static str) -> Vec<Fact> {
    let time = |name, seconds, source| {
        let seconds = number(seconds, "s", "ms", 1e-3);
        fact("electronics", name, seconds, source)
    };
    vec![
        time("frame_period", period, "1/frame rate"),
        time("scan_time", scan, of_what),
    ]
}

/// What a table of the load path says of itself, in a group of facts.
fn of_table(group: &'static str, table: &PathTable) -> Vec<Fact> {
    let end = table.variable();
    let mut facts = vec![
        fact(
            group,
            "table_nodes",
            text(&table.nodes()),
            "loads that were solved",
        ),
        fact(
            group,
            format!("table_ends_at_{}", end.name),
            number(table.end(), end.key, end.unit, end.scale),
            "end of the load path",
        ),
    ];
    for (what, errors, source) in [
        (
            "interpolation",
            &table.interpolation,
            "observed between the nodes, over that at the end of the table",
        ),
        (
            "mesh",
            &table.mesh,
            "difference of a finer mesh, over that at the end of the table",
        ),
    ] {
        facts.extend(errors.of_full_scale.iter().map(|(quantity, share)| {
            let share = number(*share, "share", "%", 1e-2);
            fact(
                group,
                format!("table_{what}_error_of_{quantity}"),
                share,
                source,
            )
        }));
    }
    facts
}

/// Quantities derived from a board that reads capacitors.
fn capacitor_board(board: &CapacitanceBoard) -> Vec<Fact> {
    let [low, high] = board.span();
    let mut facts = timing(
        board.period(),
        board.scan_time(),
        "time for all capacitors of a frame",
    );
    let [range, noise] = match board.last {
        LastStage::Converter(_) => [
            "converter range through the amplifier",
            "amplifier noise and rounding to counts",
        ],
        LastStage::Instrument(_) => [
            "electronics.readout.measured.range",
            "electronics.readout.measured.noise",
        ],
    };
    for (name, value, source) in [
        ("lowest_capacitance", low, range),
        ("highest_capacitance", high, range),
        ("noise_of_a_reading", board.deviation(), noise),
    ] {
        let value = number(value, "f", "fF", 1e-15);
        facts.push(fact("electronics", name, value, source));
    }
    facts
}
