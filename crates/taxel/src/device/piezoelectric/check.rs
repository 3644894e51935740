//! Rules between the keys of a piezoelectric array.

use super::PiezoelectricArray;
use crate::electronics::LastStage;
use crate::mechanics::SeatedSetting;
use crate::quantity::at_most;
use crate::sensor::{
    Broken, CoverContact, InPlane, Seat, check_scan_time, micrometres, require, rounded_down,
    rounded_up,
};
use taxel_numerics::linear_chain::Chain;

/// Frames per second over the corner of the filter: at half of this rate the
/// filter leaves a fifth, which is what folds back.
const RATE_OVER_CORNER: f64 = 10.0;
/// Share of the channel before that a multiplexer may leave in a reading.
const CARRIED_OVER: f64 = 0.01;
/// Least silicone above an element over the side of the element: through less no touch
/// spreads to the elements beside it, and the sums over the profile take very long.
const DEPTH_OVER_SIDE: f64 = 0.05;
/// Largest scatter of the gains: three deviations of it leave a signal.
const GAIN_DEVIATION: f64 = 0.3;

pub(super) fn check(array: &PiezoelectricArray<'_>) -> Result<(), Broken> {
    check_geometry(array)?;
    check_seat(array)?;
    check_preload(array)?;
    check_scan(array)?;
    check_rate(array)?;
    check_output(array)
}

fn key(name: &str) -> String {
    format!("element.piezoelectric.{name}")
}

fn check_geometry(array: &PiezoelectricArray<'_>) -> Result<(), Broken> {
    let (side, cover) = (array.description.ceramic.side, &array.description.cover);
    for pitch in array.sensor.array.pitch {
        require(
            at_most(side, pitch),
            "array.pitch",
            || {
                format!(
                    "elements of {} overlap at a pitch of {}",
                    micrometres(side),
                    micrometres(pitch)
                )
            },
            "give a larger pitch or smaller elements",
        )?;
    }
    require(
        cover.share_above > 0.0,
        &key("cover.share_above"),
        || "there is no silicone above the elements to spread a touch".into(),
        "give the share of the silicone that lies above, such as 0.5",
    )?;
    let (depth, least) = (array.description.depth(), DEPTH_OVER_SIDE * side);
    require(
        at_most(least, depth),
        &key("cover.thickness"),
        || {
            format!(
                "{} of silicone above elements of {} spread no touch to the elements beside",
                micrometres(depth),
                micrometres(side)
            )
        },
        &format!(
            "share_above times thickness must be at least {}, a twentieth of the side of an element",
            micrometres(least)
        ),
    )?;
    let scatter = array.description.fabrication.gain_deviation;
    require(
        scatter <= GAIN_DEVIATION,
        &key("fabrication.gain_deviation"),
        || format!("with a scatter of {scatter} some elements would have no signal"),
        &format!("give at most {GAIN_DEVIATION}"),
    )
}

/// The seat and what acts in the plane of the elements.
fn check_seat(array: &PiezoelectricArray<'_>) -> Result<(), Broken> {
    let description = array.description;
    let (layer, plate) = (description.cover.thickness, description.ceramic.thickness);
    if let Some(Seat::At(seat)) = description.seat {
        let (lowest, highest) = (0.5 * plate, layer - 0.5 * plate);
        require(
            at_most(lowest, seat.height) && at_most(seat.height, highest),
            &key("seat.at.height"),
            || {
                format!(
                    "an element with its middle at {} is not within {} of silicone",
                    micrometres(seat.height),
                    micrometres(layer)
                )
            },
            &format!(
                "give a height from {} to {}: half of the element from each face",
                micrometres(lowest),
                micrometres(highest)
            ),
        )?;
    }
    if description.in_plane == InPlane::Ignored {
        return Ok(());
    }
    require(
        description.charge_constants().is_some(),
        &key("in_plane"),
        || "the stress in the plane of an element gives charge by d31, which is not given".into(),
        "give ceramic.charge_per_force_transverse, such as \"-320 pC/N\", or write in_plane = \"ignored\"",
    )?;
    require(
        description.cover.contact == CoverContact::RigidDisc,
        &key("in_plane"),
        || "the stress in the plane of an element is known under a rigid disc only".into(),
        "write cover.contact = \"rigid_disc\", or in_plane = \"ignored\"",
    )?;
    // All that a load does not say: whether the drawing was solved.
    let (cover, setting) = (
        &description.cover,
        description.seated(SeatedSetting::DISC_AREA),
    );
    let element = setting.element(description.seat_height(), cover.rim, cover.grip);
    element.map(drop).map_err(|outside| {
        let help = "draw what was solved, or write in_plane = \"ignored\"";
        Broken::new(&key("in_plane"), outside.to_string(), help)
    })
}

fn check_preload(array: &PiezoelectricArray<'_>) -> Result<(), Broken> {
    let path = array.path();
    let message = || match &path {
        Err(error) => error.to_string(),
        Ok(_) => String::new(),
    };
    require(
        path.is_ok(),
        &key("cover.preload"),
        message,
        "give a smaller preload, a larger area, or law = \"neo_hookean\"",
    )?;
    let Ok(path) = path else { return Ok(()) };
    let chain = Chain::new(&array.output_per_displacement(path));
    let message = || match &chain {
        Err(error) => format!("nothing damps the element: {error}"),
        Ok(_) => String::new(),
    };
    require(
        chain.is_ok(),
        &key("ceramic.damping_ratio"),
        message,
        "give a damping ratio above zero",
    )
}

fn check_scan(array: &PiezoelectricArray<'_>) -> Result<(), Broken> {
    check_scan_time(array.sensor, array.board.scan_time())?;
    let carried = array.board.carried_over();
    require(
        at_most(carried, CARRIED_OVER),
        "electronics.scan",
        || {
            format!(
                "a reading still holds {:.2} % of the channel before it; at most {} %",
                carried * 100.0,
                CARRIED_OVER * 100.0
            )
        },
        &format!(
            "give a channel time of at least {} us",
            rounded_up(array.board.output.settling * (1.0 / CARRIED_OVER).ln() * 1e6)
        ),
    )
}

/// The frames must be fast enough for what the filter lets through.
fn check_rate(array: &PiezoelectricArray<'_>) -> Result<(), Broken> {
    let Some(time) = array.board.band.low_pass else {
        return Ok(());
    };
    let corner = 1.0 / (std::f64::consts::TAU * time);
    let (rate, least) = (1.0 / array.board.period(), RATE_OVER_CORNER * corner);
    require(
        at_most(least, rate),
        "electronics.frame_rate",
        || {
            format!(
                "{} frames/s do not suffice for a filter with its corner at {} Hz: what it lets through folds back",
                rounded_down(rate),
                rounded_down(corner)
            )
        },
        &format!(
            "give at least {} Hz, ten times the corner, or a lower corner",
            rounded_up(least)
        ),
    )
}

fn check_output(array: &PiezoelectricArray<'_>) -> Result<(), Broken> {
    let [low, high] = array.board.span();
    let rest = array.board.output.offset;
    let unit = array.board.unit();
    require(
        low < rest && rest < high,
        array.board.last.range_key(),
        || {
            let [rest, low, high] = [rest, low, high].map(|value| value / unit.si_per_unit);
            format!(
                "the {} at rest of {rest} {} is outside what the board can read, {low} to {high} {}",
                unit.quantity, unit.symbol, unit.symbol
            )
        },
        "give a range and a limit around it",
    )?;
    let measured = matches!(array.board.last, LastStage::Instrument(_));
    require(
        !measured || array.board.deviation() > 0.0,
        "electronics.readout.measured.noise",
        || "an instrument without any noise gives no uncertainty".into(),
        "give the noise of one reading, such as \"0.1 mV\"",
    )
}
