//! A test load on one element, or a contact beside it, to its signal.

use std::f64::consts::{PI, TAU};

use super::PiezoelectricArray;
use crate::electronics::ChargeBoard;
use crate::estimation::Event;
use crate::figure::{Axis, Chart, Figure, Series, Style};
use crate::mechanics::{
    Base, BondedDisc, ContactPressure, Profile, SeatedSetting, SoftCover, SpherePressure,
};
use crate::predict::{Curve, Load, LoadColumn, LoadKind, LoadRefused, Predictor};
use crate::quantity::{FORCE, LENGTH, TIME};
use crate::sensor::{CoverContact, InPlane, Piezoelectric};
use crate::stress_map::StressMap;
use crate::table::{Cell, Column};
use crate::transduction::SiliconePath;
use taxel_numerics::linear_chain::Chain;

/// Predicts test loads on one element as drawn.
#[derive(Debug, Clone)]
pub struct PiezoelectricPredictor {
    description: Piezoelectric,
    board: ChargeBoard,
    path: Option<SiliconePath>,
    /// Open voltage and output per displacement of the surface.
    by_displacement: Option<[Chain; 2]>,
    /// Open voltage and output per force.
    by_force: Option<[Chain; 2]>,
}

/// The answer to one test load on one element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TestAnswer {
    /// Peak of the output in the direction of loading, V, or C of a charge that is measured.
    pub first: f64,
    /// Peak in the other direction, V.
    pub second: f64,
    /// Kind of event that the two peaks show.
    pub event: Event,
    /// True if the output or the converter is cut.
    pub clipped: bool,
}

/// Quantity that a test load is given by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drive {
    /// Displacement of the surface over the element, m.
    Displacement(f64),
    /// Force on the element, N.
    Force(f64),
}

impl PiezoelectricPredictor {
    /// A predictor for the elements of `array`.
    pub fn new(array: &PiezoelectricArray<'_>) -> Self {
        let chain = |transfer| Chain::new(&transfer).ok();
        let path = array.path().ok();
        let by_displacement = path.and_then(|path| {
            Some([
                chain(array.element.voltage_per_displacement(path))?,
                chain(array.output_per_displacement(path))?,
            ])
        });
        let by_force = chain(array.element.voltage_per_force())
            .zip(chain(array.output_per_force()))
            .map(|(open, output)| [open, output]);
        Self {
            description: array.description.clone(),
            board: array.board.clone(),
            path,
            by_displacement,
            by_force,
        }
    }

    /// Peaks of the output for `profile`; of a cyclic one those of the last
    /// cycle.
    ///
    /// ```
    /// use taxel::device::{Drive, PiezoelectricPredictor};
    /// use taxel::mechanics::Profile;
    /// let sensor = taxel::sensor::Sensor::shipped("piezo-1.5mm").unwrap();
    /// let predictor = PiezoelectricPredictor::new(&sensor.piezoelectric().unwrap());
    /// let impact = Profile::Impact { ramp: 0.01, dwell: 0.2 };
    /// let answer = predictor.test(&impact, Drive::Displacement(46.3e-6)).unwrap();
    /// assert!(answer.first > answer.second && answer.second > 0.0);
    /// ```
    pub fn test(&self, profile: &Profile, drive: Drive) -> Option<TestAnswer> {
        let [_, output] = self.chains(drive)?;
        let knots = profile.knots(drive.size());
        let [from, to] = window(profile, &self.board);
        let [lowest, highest] = output.extremes(&knots, from, to);
        // Loading in the direction of the load, whatever the sign of the gain.
        let pressing = drive.size() * self.board.band.gain > 0.0;
        let (first, second) = if pressing {
            (highest, -lowest)
        } else {
            (-lowest, highest)
        };
        let cut = |voltage: f64| self.board.read(voltage, 0.0).clipped;
        Some(TestAnswer {
            first,
            second,
            event: Event::of_peaks(first, second),
            clipped: cut(lowest) || cut(highest),
        })
    }

    fn chains(&self, drive: Drive) -> Option<&[Chain; 2]> {
        match drive {
            Drive::Displacement(_) => self.by_displacement.as_ref(),
            Drive::Force(_) => self.by_force.as_ref(),
        }
    }

    /// Force at the top and displacement at the top, N and m.
    fn top(&self, drive: Drive) -> [f64; 2] {
        let stiffness = self.path.map_or(f64::NAN, |path| path.stiffness);
        match drive {
            Drive::Displacement(metres) => [stiffness * metres, metres],
            Drive::Force(newton) => [newton, newton / stiffness],
        }
    }

    /// What a load does to the element.
    fn carried(&self, load: &Load<'_>) -> Result<Carried, LoadRefused> {
        let Some(contact) = ContactLoad::of(load)? else {
            let drive = drive(load)?;
            let [force, displacement] = self.top(drive);
            let pressed = self.description.preloaded();
            let column = pressed.map_or(0.0, |pressed| pressed.thickness);
            if let Drive::Displacement(_) = drive {
                sinks(DISPLACEMENT, displacement, column)?;
            }
            return Ok(Carried {
                drive,
                // A column that would be crushed has none; the force on the element is given.
                displacement: Some(displacement)
                    .filter(|displacement| displacement.abs() < column)
                    .unwrap_or(f64::NAN),
                force,
                element_force: force,
                charge: self.description.ceramic.charge_per_force * force,
                interval: None,
            });
        };
        match self.description.cover.contact {
            CoverContact::RigidDisc => self.under_a_disc(load, &contact),
            CoverContact::Pressure | CoverContact::Sphere => self.under_a_pressure(load, &contact),
        }
    }

    /// A pressure on the silicone above the element, with its shear.
    fn under_a_pressure(
        &self,
        load: &Load<'_>,
        contact: &ContactLoad,
    ) -> Result<Carried, LoadRefused> {
        if load.number(DISPLACEMENT).is_some() {
            return Err(refused(
                DISPLACEMENT,
                "the surface under a pressure has no one displacement",
                "give force_z, or write cover.contact = \"rigid_disc\"",
            ));
        }
        let (cover, side) = (self.soft_cover(contact), self.description.ceramic.side);
        let [force_x, force_y, force_z] = contact.force;
        // As far as a rigid disc of the same size would go, where that is known.
        if let Ok(pressed) = self.disc(contact).pressed() {
            let stiffness = pressed.stiffness(self.description.cover.modulus);
            let thickness = self.description.cover.thickness;
            sinks(FORCE_Z, force_z / stiffness, thickness)?;
        }
        let mut element_force = force_z * cover.share(contact.offset, side);
        if force_x != 0.0 || force_y != 0.0 {
            let [along_x, along_y] = cover.shear_shares(contact.offset, side);
            element_force += along_x * force_x + along_y * force_y;
        }
        let charge = self.description.ceramic.charge_per_force * element_force;
        Ok(Carried {
            drive: Drive::Force(element_force),
            displacement: f64::NAN,
            force: force_z,
            element_force,
            charge,
            interval: self.interval(contact, force_z),
        })
    }

    /// The silicone above the elements, pressed over a contact.
    fn soft_cover(&self, contact: &ContactLoad) -> SoftCover {
        let depth = self.description.depth();
        let sphere =
            || SpherePressure::on_layer(contact.radius, depth).map(ContactPressure::Sphere);
        let even = ContactPressure::Uniform(contact.radius);
        SoftCover {
            thickness: depth,
            base: Base::Rigid,
            contact: match self.description.cover.contact {
                CoverContact::Sphere => sphere().unwrap_or(even),
                CoverContact::Pressure | CoverContact::RigidDisc => even,
            },
        }
    }

    /// The disc of a contact on all of the silicone.
    fn disc(&self, contact: &ContactLoad) -> BondedDisc {
        let cover = &self.description.cover;
        BondedDisc {
            radius: contact.radius,
            thickness: cover.thickness,
            rim: cover.rim,
            grip: cover.grip,
        }
    }

    /// Normal stress on the plane of the elements around a contact, without what the elements
    /// do to it; `None` for a load that is no contact or has no answer.
    fn stress_map(&self, load: &Load<'_>) -> Option<StressMap> {
        let contact = ContactLoad::of(load).ok()??;
        let carried = self.carried(load).ok()?;
        let (side, thickness) = (
            self.description.ceramic.side,
            self.description.cover.thickness,
        );
        let [x, y] = contact.offset.map(f64::abs);
        let half = (contact.radius + AROUND * thickness).max(x.max(y) + side);
        let (low, cell) = ([-half; 2], 2.0 * half / CELLS as f64);
        let stress = match self.description.cover.contact {
            CoverContact::RigidDisc => {
                let pressed = self.disc(&contact).pressed().ok()?;
                let mean = carried.force / (PI * contact.radius * contact.radius);
                let middle = |number: usize| (number as f64 + 0.5) * cell - half;
                let cells = (0..CELLS).flat_map(|row| {
                    (0..CELLS).map(move |column| middle(column).hypot(middle(row)))
                });
                let at = |distance| pressed.pressure(distance).map(|ratio| mean * ratio);
                cells
                    .map(|distance| at(distance).unwrap_or(f64::NAN))
                    .collect()
            }
            CoverContact::Pressure | CoverContact::Sphere => {
                let cover = self.soft_cover(&contact);
                cover.base_stress(contact.force, low, cell, [CELLS; 2])
            }
        };
        Some(StressMap {
            title: String::from("Normal stress on the plane of the element under the contact"),
            low,
            cell,
            columns: CELLS,
            stress,
            elements: vec![(contact.offset, String::from("element"))],
            element_side: side,
            contacts: vec![([0.0; 2], contact.radius)],
        })
    }

    /// A rigid disc on all of the silicone.
    fn under_a_disc(&self, load: &Load<'_>, contact: &ContactLoad) -> Result<Carried, LoadRefused> {
        let (description, cover) = (&self.description, &self.description.cover);
        let [force_x, force_y, force_z] = contact.force;
        for (column, force) in [(FORCE_X, force_x), (FORCE_Y, force_y)] {
            if force != 0.0 {
                return Err(refused(
                    column,
                    format!("a shear of {force} N under a rigid disc is not solved"),
                    "leave it out, or write cover.contact = \"pressure\"",
                ));
            }
        }
        let pressed = self.disc(contact).pressed().map_err(|error| {
            let [lowest, highest] = [error.lowest, error.highest].map(|a| a * cover.thickness);
            let allowed = format!(
                "give a contact_radius from {:.4} to {:.4} mm",
                lowest * 1e3,
                highest * 1e3
            );
            refused(CONTACT_RADIUS, error.to_string(), &allowed)
        })?;
        let stiffness = pressed.stiffness(cover.modulus);
        let force = match load.number(DISPLACEMENT) {
            Some(metres) => stiffness * metres,
            None => force_z,
        };
        let given = load.number(DISPLACEMENT).map_or(FORCE_Z, |_| DISPLACEMENT);
        sinks(given, force / stiffness, cover.thickness)?;
        let side = description.ceramic.side;
        let share = pressed.share(contact.offset, side).ok_or_else(|| {
            let [x, y] = contact.offset.map(|along| along * 1e3);
            refused(
                OFFSET_X,
                format!("the element at {x}, {y} mm reaches beyond the disc, where a layer that goes on is not tabulated"),
                "give a smaller offset, a larger contact_radius, or cover.rim = \"flush\"",
            )
        })?;
        let element_force = share * force;
        let charge = match description.in_plane {
            InPlane::Ignored => description.ceramic.charge_per_force * element_force,
            InPlane::Bonded => self.bonded_charge(contact, force)?,
        };
        Ok(Carried {
            // What the board gets: the charge, as a force by d33 alone.
            drive: Drive::Force(charge / description.ceramic.charge_per_force),
            displacement: force / stiffness,
            force,
            element_force,
            charge,
            interval: self.interval(contact, force),
        })
    }

    /// What the table of elements in their layer was solved for, under this contact.
    fn setting(&self, contact: &ContactLoad) -> SeatedSetting {
        self.description
            .seated(PI * contact.radius * contact.radius)
    }

    /// Charge of an element that is bonded to the silicone, C.
    fn bonded_charge(&self, contact: &ContactLoad, force: f64) -> Result<f64, LoadRefused> {
        let cover = &self.description.cover;
        let help = "write in_plane = \"ignored\", or give a load that was solved";
        if contact.off_centre() {
            let message = "the stress in the plane of an element was solved under the middle of the disc only";
            return Err(refused(OFFSET_X, message, help));
        }
        let setting = self.setting(contact);
        let height = self.description.seat_height();
        let element = setting.element(height, cover.rim, cover.grip);
        let element = element.map_err(|error| refused(CONTACT_RADIUS, error.to_string(), help))?;
        // The check of the sensor file demands d31.
        let constants = self.description.charge_constants();
        let constants = constants.unwrap_or([f64::NAN; 2]);
        let mean = force * setting.element_area / setting.disc_area;
        Ok(mean * element.charge_per_force(constants))
    }

    /// Least and greatest charge by what a drawing leaves open, C, where it is known.
    fn interval(&self, contact: &ContactLoad, force: f64) -> Option<[f64; 2]> {
        let [force_x, force_y, _] = contact.force;
        if contact.off_centre() || force_x != 0.0 || force_y != 0.0 {
            return None;
        }
        let setting = self.setting(contact);
        let charges = setting
            .charge_interval(self.description.charge_constants()?)
            .ok()?;
        let mean = force * setting.element_area / setting.disc_area;
        let [one, other] = charges.map(|charge| charge * mean);
        Some([one.min(other), one.max(other)])
    }
}

/// Refuses a load of `column` under which the surface would sink by `displacement`, m, of all
/// the silicone, `thickness`, or more.
fn sinks(column: usize, displacement: f64, thickness: f64) -> Result<(), LoadRefused> {
    if displacement.abs() < thickness {
        return Ok(());
    }
    let millimetres = 1e3 * thickness;
    Err(refused(
        column,
        format!(
            "the surface would move by {:.3} mm of silicone that is {millimetres:.3} mm thick",
            1e3 * displacement
        ),
        &format!("give a load that moves it by less than {millimetres:.3} mm"),
    ))
}

/// Cells of a picture along each side, and how far it goes beyond a contact in thicknesses of
/// the silicone.
const CELLS: usize = 72;
const AROUND: f64 = 3.0;

/// A load as the element meets it.
#[derive(Debug, Clone, Copy)]
struct Carried {
    /// What drives the element and the board.
    drive: Drive,
    /// Displacement of the surface or of the disc, m; NaN where there is no one.
    displacement: f64,
    /// Pressing force of the load, N.
    force: f64,
    /// Force normal to the element, N.
    element_force: f64,
    /// Charge at the top of the load, C.
    charge: f64,
    /// Least and greatest charge by what a drawing leaves open, C.
    interval: Option<[f64; 2]>,
}

/// A load on a round contact beside the element.
#[derive(Debug, Clone, Copy)]
struct ContactLoad {
    /// Radius of the contact, m.
    radius: f64,
    /// Centre of the element from the middle of the contact, m.
    offset: [f64; 2],
    /// Force x, y, pressing, N.
    force: [f64; 3],
}

impl ContactLoad {
    /// `None` for a load that stands on the element itself.
    fn of(load: &Load<'_>) -> Result<Option<Self>, LoadRefused> {
        let at = |column| load.number(column).unwrap_or(0.0);
        let force = [FORCE_X, FORCE_Y, FORCE_Z].map(at);
        let Some(radius) = load.number(CONTACT_RADIUS) else {
            let help =
                "give contact_radius too, and with offset_x and offset_y where the element is";
            for (column, value) in [(FORCE_X, force[0]), (FORCE_Y, force[1])] {
                if value != 0.0 {
                    let message = format!(
                        "a shear of {value} N presses an element beside its contact, which is not given"
                    );
                    return Err(refused(column, message, help));
                }
            }
            for column in [OFFSET_X, OFFSET_Y] {
                if load.number(column).is_some() {
                    let message =
                        format!("{} is from a contact that is not given", LOADS[column].name);
                    return Err(refused(column, message, help));
                }
            }
            return Ok(None);
        };
        if load.number(DISPLACEMENT).is_some() && load.number(FORCE_Z).is_some() {
            return drive(load).map(|_| None);
        }
        Ok(Some(Self {
            radius,
            offset: [OFFSET_X, OFFSET_Y].map(at),
            force,
        }))
    }

    /// True if the element is not under the middle of the contact.
    fn off_centre(&self) -> bool {
        // A hundredth of the radius changes the pressure by 1e-4.
        self.offset[0].hypot(self.offset[1]) > 0.01 * self.radius
    }
}

impl Drive {
    /// Its amplitude in its own unit.
    pub fn size(self) -> f64 {
        match self {
            Self::Displacement(size) | Self::Force(size) => size,
        }
    }

    fn basis(self) -> &'static str {
        match self {
            Self::Displacement(_) => "per_displacement",
            Self::Force(_) => "per_force",
        }
    }
}

/// Time constants after the last corner of a load until it has died away.
const FADED: f64 = 8.0;

/// Where the peaks are looked for, s.
fn window(profile: &Profile, board: &ChargeBoard) -> [f64; 2] {
    match *profile {
        Profile::Step { ramp } => [0.0, ramp + FADED * slowest(board)],
        Profile::Impact { ramp, dwell } => [0.0, 2.0 * ramp + dwell + FADED * slowest(board)],
        Profile::Cyclic { period, cycles, .. } | Profile::Sine { period, cycles } => {
            let cycles = f64::from(cycles);
            [(cycles - 1.0) * period, cycles * period]
        }
    }
}

fn slowest(board: &ChargeBoard) -> f64 {
    board.band.slowest()
}

const PROFILE: usize = 0;
const DISPLACEMENT: usize = 1;
const FORCE_Z: usize = 2;
const RAMP: usize = 3;
const DWELL: usize = 4;
const PERIOD: usize = 5;
const CYCLES: usize = 6;
const FORCE_X: usize = 7;
const FORCE_Y: usize = 8;
const CONTACT_RADIUS: usize = 9;
const OFFSET_X: usize = 10;
const OFFSET_Y: usize = 11;

/// Words of the column `profile`.
const PROFILES: [&str; 4] = ["step", "impact", "cyclic", "sine"];
const MOST_CYCLES: f64 = 1000.0;

/// A column that may be left out.
pub(super) const fn column(
    name: &'static str,
    short: &'static str,
    kind: LoadKind,
    about: &'static str,
) -> LoadColumn {
    LoadColumn {
        name,
        short,
        kind,
        required: false,
        about,
    }
}

static LOADS: [LoadColumn; 12] = [
    LoadColumn {
        required: true,
        ..column(
            "profile",
            "profile",
            LoadKind::Word(&PROFILES),
            "how the load runs",
        )
    },
    column(
        "displacement",
        "x",
        LoadKind::Quantity(&LENGTH, [-1e-2, 1e-2]),
        "top displacement of the surface over an element",
    ),
    column(
        "force_z",
        "fz",
        LoadKind::Quantity(&FORCE, [-1e3, 1e3]),
        "top force on an element or a contact, in place of the displacement",
    ),
    column(
        "ramp",
        "ramp",
        LoadKind::Quantity(&TIME, [1e-6, 1e3]),
        "duration of a ramp; not of a sine",
    ),
    column(
        "dwell",
        "dwell",
        LoadKind::Quantity(&TIME, [0.0, 1e3]),
        "time at the top of an impact",
    ),
    column(
        "period",
        "period",
        LoadKind::Quantity(&TIME, [1e-6, 1e3]),
        "period of a cyclic load or a sine",
    ),
    column(
        "cycles",
        "cycles",
        LoadKind::Number([1.0, MOST_CYCLES]),
        "number of cycles; the peaks are those of the last one",
    ),
    column(
        "force_x",
        "fx",
        LoadKind::Quantity(&FORCE, [-1e3, 1e3]),
        "top shear force of a contact along x",
    ),
    column(
        "force_y",
        "fy",
        LoadKind::Quantity(&FORCE, [-1e3, 1e3]),
        "the same along y",
    ),
    column(
        "contact_radius",
        "radius",
        LoadKind::Quantity(&LENGTH, [1e-6, 0.1]),
        "radius of a contact on the silicone; without it the force is on the element",
    ),
    column(
        "offset_x",
        "dx",
        LoadKind::Quantity(&LENGTH, [-1.0, 1.0]),
        "centre of the element from the middle of the contact along x; 0 without it",
    ),
    column(
        "offset_y",
        "dy",
        LoadKind::Quantity(&LENGTH, [-1.0, 1.0]),
        "the same along y",
    ),
];

fn refused(column: usize, message: impl Into<String>, help: &str) -> LoadRefused {
    LoadRefused {
        column,
        message: message.into(),
        help: help.to_owned(),
    }
}

/// The number of a column that this profile cannot do without.
fn needed(load: &Load<'_>, column: usize, profile: &str) -> Result<f64, LoadRefused> {
    let name = LOADS[column].name;
    load.number(column).ok_or_else(|| {
        refused(
            column,
            format!("a load of the profile {profile} needs {name}"),
            &format!("give {name}"),
        )
    })
}

fn profile(load: &Load<'_>) -> Result<Profile, LoadRefused> {
    let Some(word) = load.word(PROFILE) else {
        let help = format!("use one of: {}", PROFILES.join(", "));
        return Err(refused(PROFILE, "this load has no profile", &help));
    };
    let get = |column| needed(load, column, PROFILES[word]);
    Ok(match PROFILES[word] {
        "step" => Profile::Step { ramp: get(RAMP)? },
        "impact" => Profile::Impact {
            ramp: get(RAMP)?,
            dwell: get(DWELL)?,
        },
        "cyclic" => {
            let (ramp, period) = (get(RAMP)?, get(PERIOD)?);
            if ramp > 0.5 * period {
                return Err(refused(
                    RAMP,
                    format!("a ramp of {ramp} s does not fit into half a period of {period} s"),
                    "give a ramp of at most half the period",
                ));
            }
            Profile::Cyclic {
                ramp,
                period,
                cycles: cycles(load)?,
            }
        }
        _ => Profile::Sine {
            period: get(PERIOD)?,
            cycles: cycles(load)?,
        },
    })
}

/// A whole number of cycles.
fn cycles(load: &Load<'_>) -> Result<u32, LoadRefused> {
    let number = needed(load, CYCLES, "cyclic or sine")?;
    if number.fract() == 0.0 {
        return Ok(number as u32);
    }
    let message = format!("{number} is no whole number of cycles");
    Err(refused(CYCLES, message, "give a whole number"))
}

fn drive(load: &Load<'_>) -> Result<Drive, LoadRefused> {
    match (load.number(DISPLACEMENT), load.number(FORCE_Z)) {
        (Some(metres), None) => Ok(Drive::Displacement(metres)),
        (None, Some(newton)) => Ok(Drive::Force(newton)),
        (Some(_), Some(_)) => Err(refused(
            FORCE_Z,
            "displacement and force_z are both given",
            "leave one of them open: the signal per displacement depends on the silicone, the one per force does not",
        )),
        (None, None) => Err(refused(
            DISPLACEMENT,
            "neither displacement nor force_z is given",
            "give one of them",
        )),
    }
}

impl Predictor for PiezoelectricPredictor {
    fn load_columns(&self) -> &'static [LoadColumn] {
        &LOADS
    }

    fn combination(&self, given: &[bool]) -> Result<(), String> {
        let loads = [DISPLACEMENT, FORCE_Z, FORCE_X, FORCE_Y];
        if loads.iter().any(|column| given.get(*column) == Some(&true)) {
            Ok(())
        } else {
            Err(String::from("give displacement or force_z"))
        }
    }

    fn columns(&self) -> Vec<Column> {
        let unit = self.board.unit();
        let peak = |name: &str| Column::new(name, unit.symbol, unit.si_per_unit, unit.key, 3);
        let charge = |name: &str| Column::new(name, "pC", 1e-12, "c", 3);
        vec![
            Column::plain("profile"),
            Column::plain("basis"),
            Column::new("displacement", "um", 1e-6, "m", 3),
            Column::new("force_z", "mN", 1e-3, "n", 3),
            Column::new("element_force", "mN", 1e-3, "n", 3),
            charge("charge"),
            charge("charge_least"),
            charge("charge_greatest"),
            peak("a1"),
            peak("a2"),
            peak("a1_plus_a2"),
            Column::new("normalised_sum", "", 1.0, "", 6),
            Column::plain("event"),
            Column::plain("clipped"),
        ]
    }

    fn answer(&self, load: &Load<'_>, row: &mut Vec<Cell>) -> Result<(), LoadRefused> {
        let (profile, carried) = (profile(load)?, self.carried(load)?);
        let drive = carried.drive;
        let word = load.word(PROFILE).map_or("", |word| PROFILES[word]);
        let [least, greatest] = carried.interval.unwrap_or([f64::NAN; 2]);
        let Some(answer) = self.test(&profile, drive) else {
            // Only a sensor file that its check refuses has no chain.
            return Err(refused(PROFILE, "this device has no stable response", ""));
        };
        let sum = answer.first + answer.second;
        row.extend([Cell::from(word), Cell::from(drive.basis())]);
        row.extend(
            [
                carried.displacement,
                carried.force,
                carried.element_force,
                carried.charge,
                least,
                greatest,
                answer.first,
                answer.second,
                sum,
                sum / self.board.largest(),
            ]
            .map(known),
        );
        row.push(Cell::from(answer.event.name()));
        row.push(Cell::from(if answer.clipped {
            let [lowest, highest] = self.board.span();
            let si = self.board.unit().key.to_uppercase();
            format!("clipped beyond {lowest} to {highest} {si}")
        } else {
            String::new()
        }));
        Ok(())
    }

    fn scales_with_load(&self, column: usize) -> bool {
        matches!(column, DISPLACEMENT | FORCE_X | FORCE_Y | FORCE_Z)
    }

    fn reading_columns(&self) -> Vec<String> {
        vec![String::from("a1")]
    }

    fn clips(&self, load: &Load<'_>) -> bool {
        let (Ok(profile), Ok(carried)) = (profile(load), self.carried(load)) else {
            return false;
        };
        let answer = self.test(&profile, carried.drive);
        answer.is_some_and(|answer| answer.clipped)
    }

    fn curves(&self, given: &[bool]) -> Vec<Curve> {
        let by_force = given.get(FORCE_Z) == Some(&true);
        vec![Curve {
            title: String::from("Peaks of the output"),
            x: if by_force { "force_z" } else { "displacement" },
            y: vec!["a1", "a2", "a1_plus_a2"],
            y_label: "amplitude",
        }]
    }

    fn pictures(&self, load: &Load<'_>) -> Vec<(String, String)> {
        let map = self.stress_map(load);
        map.into_iter()
            .map(|map| (map.title.clone(), map.svg()))
            .collect()
    }

    fn history(&self, load: &Load<'_>) -> Option<Figure> {
        let (profile, drive) = (profile(load).ok()?, self.carried(load).ok()?.drive);
        let [open, output] = self.chains(drive)?;
        let knots = profile.knots(drive.size());
        let end = history_end(&profile, &self.board);
        let times: Vec<f64> = (0..=HISTORY_POINTS)
            .map(|i| end * f64::from(i) / f64::from(HISTORY_POINTS))
            .collect();
        let output_unit = self.board.unit();
        let curve = |chain: &Chain, name: &str| {
            let values = chain.respond(&knots, &times);
            let points = times.iter().zip(values);
            let points = points.map(|(t, v)| [*t * 1e3, v / output_unit.si_per_unit]);
            Series::new(name, points.collect(), Style::Line)
        };
        let mut signals = vec![curve(output, "output")];
        if output_unit.key == "v" {
            signals.insert(0, curve(open, "at the element"));
        }
        let (label, unit, scale) = match drive {
            Drive::Displacement(_) => ("displacement", "um", 1e6),
            Drive::Force(_) => ("force", "mN", 1e3),
        };
        let mut input: Vec<[f64; 2]> = knots.iter().map(|[t, x]| [t * 1e3, x * scale]).collect();
        input.extend(knots.last().map(|[_, last]| [end * 1e3, last * scale]));
        let chart = |title: &str, y: Axis, series| Chart {
            title: title.to_owned(),
            x: Axis::new("time", "ms"),
            y,
            series,
        };
        Some(Figure {
            title: String::from("One element over time"),
            charts: vec![
                chart(
                    "load",
                    Axis::new(label, unit),
                    vec![Series::new(label, input, Style::Line)],
                ),
                chart(
                    "signal",
                    Axis::new(output_unit.quantity, output_unit.symbol),
                    signals,
                ),
            ],
            caption: format!(
                "The load is given {}. High-pass corner {:.3} Hz; the values do not depend on a sampling rate.",
                match drive {
                    Drive::Displacement(_) => "as displacement of the surface over the element",
                    Drive::Force(_) => "as force on the element",
                },
                1.0 / (TAU * self.board.band.high_pass),
            ),
        })
    }
}

/// A number, or an empty cell where it is not known.
fn known(number: f64) -> Cell {
    if number.is_nan() {
        return Cell::Missing;
    }
    Cell::Number(number)
}

/// Points of a curve over time.
const HISTORY_POINTS: u32 = 1500;

/// End of a curve over time, s: until the signal has faded to 2 %.
fn history_end(profile: &Profile, board: &ChargeBoard) -> f64 {
    let last = profile.knots(1.0).last().map_or(0.0, |knot| knot[0]);
    last + 4.0 * slowest(board)
}
