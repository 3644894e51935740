//! The array of piezoelectric elements in silicone (P3).

mod check;
mod drawing;
mod facts;
mod predict;
mod simulated;

use std::sync::Arc;

use super::{Device, ElementCover, carries, fits};
use crate::acquisition::{Simulated, Stream};
use crate::drawing::Drawing;
use crate::electronics::{ChargeBoard, Readout};
use crate::estimation::{
    ChargeModel, ChargeOptions, ChargeReader, FrameError, Localiser, ObserverOptions, ProfileFit,
    ProfileModel, Reader, Scale, SlipOptions, localiser,
};
use crate::information::{
    Information, InformationOptions, NoInformation, RadiusKnowledge, Unknown,
};
use crate::layout::Layout;
use crate::mechanics::{Base, ContactPressure, PreloadError, ShareSlopeTable, SoftCover};
use crate::predict::{Load, LoadColumn, LoadKind, Predictor};
use crate::quantity::{Dimension, FORCE, LENGTH};
use crate::sensor::{Broken, Element, Piezoelectric, Sensor, masked_capacitors};
use crate::summary::Fact;
use crate::transduction::{PiezoelectricElement, SiliconePath};
use taxel_numerics::linear_chain::Transfer;

pub use predict::{Drive, PiezoelectricPredictor, TestAnswer};

/// Largest radius of a contact that is located by its profile, m: two elements.
const LARGEST_CONTACT: f64 = 8e-3;
/// Length of signal in which a slip is looked for, s, and the least and greatest
/// speed, m/s: at the least one a ridge takes 0.4 s from one element of the
/// shipped array to the next.
const SLIP_WINDOW: f64 = 1.0;
const SLIP_SPEEDS: [f64; 2] = [10e-3, 300e-3];

/// An array of piezoelectric elements with its board.
#[derive(Debug, Clone)]
pub struct PiezoelectricArray<'a> {
    sensor: &'a Sensor,
    /// Description of the elements in the sensor file.
    pub description: &'a Piezoelectric,
    /// The model of one element.
    pub element: PiezoelectricElement,
    /// The board.
    pub board: ChargeBoard,
}

impl<'a> PiezoelectricArray<'a> {
    /// The first stage of the board.
    pub fn readout(&self) -> &'a Readout {
        &self.sensor.electronics.readout
    }

    /// `None` when the board takes no charge.
    pub(crate) fn new(sensor: &'a Sensor, description: &'a Piezoelectric) -> Option<Self> {
        let element = description.element();
        let array = &sensor.array;
        let board = ChargeBoard::new(
            &sensor.electronics,
            [array.rows, array.columns],
            element.capacitance,
            element.leak_resistance,
        )?;
        Some(Self {
            sensor,
            description,
            element,
            board,
        })
    }

    /// Where the elements are.
    pub fn layout(&self) -> Layout {
        self.sensor.layout()
    }

    /// Output per force on an element, V/N, or C/N of a charge that is measured.
    pub fn output_per_force(&self) -> Transfer {
        Transfer::constant(self.element.charge_per_force).then(&self.board.band.transfer())
    }

    /// Output per displacement of the surface over an element, V/m or C/m,
    /// through the preloaded silicone `path`.
    pub fn output_per_displacement(&self, path: SiliconePath) -> Transfer {
        self.element
            .charge_per_displacement(path)
            .then(&self.board.band.transfer())
    }

    /// The silicone over one element under the preload.
    ///
    /// # Errors
    /// [`PreloadError`]; never after [`Sensor::parse`].
    pub fn path(&self) -> Result<SiliconePath, PreloadError> {
        self.description.path()
    }

    /// Output per force in the middle of the band, V/N or C/N.
    pub fn output_per_newton(&self) -> f64 {
        self.board.band.gain * self.element.charge_per_force
    }

    /// Which elements are masked.
    pub fn masked(&self) -> Vec<bool> {
        let array = &self.sensor.array;
        masked_capacitors(&self.sensor.mask, array.rows, array.columns)
            .iter()
            .map(|channels| channels.contains(&true))
            .collect()
    }

    /// Profiles of contacts of unknown size, as drawn.
    pub fn profile_model(&self) -> ProfileModel {
        let layout = self.layout();
        let thickness = self.description.depth();
        ProfileModel {
            rows: layout.rows,
            columns: layout.columns,
            pitch: layout.pitch,
            side: self.description.ceramic.side,
            thickness,
            radii: ProfileModel::unknown_radii(thickness, LARGEST_CONTACT),
            gain_deviation: self.description.fabrication.gain_deviation,
            margin: 0.0,
        }
    }

    /// Gain of each element over the mean, from its map of indentations.
    fn gains(&self) -> Vec<f64> {
        let learned = self.description.indentations.as_ref();
        learned.map_or_else(
            || vec![1.0; self.layout().taxels()],
            |map| map.gains.clone(),
        )
    }

    /// Standard deviation of a gain: of those that were learned, or of those as made.
    fn gain_deviation(&self) -> f64 {
        let learned = self.description.indentations.as_ref();
        learned.map_or(self.description.fabrication.gain_deviation, |map| {
            map.gain_deviation
        })
    }

    /// Localiser of a lone contact: the map of its indentations, or
    /// the profile of the soft cover.
    fn localiser(&self) -> Option<Arc<dyn Localiser>> {
        let fit = ProfileFit::new(self.profile_model())?;
        match &self.description.indentations {
            // What a regression needs was checked when its file was read.
            Some(map) => localiser(map, fit).ok(),
            None => Some(Arc::new(fit)),
        }
    }

    /// Model of the device as drawn, for the estimator.
    pub fn model(&self) -> ChargeModel {
        let unit = self.board.unit();
        ChargeModel {
            layout: self.layout(),
            channel: self.board.last.scale(),
            reading: Scale::new(unit.quantity, unit.symbol, unit.si_per_unit),
            limit: self.board.output.limit,
            rest: self.board.output.offset,
            output_per_newton: self.output_per_newton(),
            gains: self.gains(),
            gain_deviation: self.gain_deviation(),
            high_pass: self.board.band.high_pass,
            low_pass: self.board.band.low_pass,
            deviation: self.board.deviation(),
            period: self.board.period(),
            masked: self.masked(),
            full_scale: self.description.full_scale,
        }
    }
}

/// A contact of one place on the array.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlacedContact {
    /// Place x, y from the middle of the array, m.
    pub place: [f64; 2],
    /// Pressing force, N.
    pub force: f64,
}

/// Information of elements about contacts of one radius: the tables are made once.
#[derive(Debug, Clone)]
pub struct PlaceInformation {
    side: f64,
    full_scale: f64,
    extent: f64,
    noise: f64,
    radius: RadiusKnowledge,
    table: ShareSlopeTable,
    /// Half the step of a slope against the radius, m, and the tables at both its ends.
    step: f64,
    beside: Option<Box<[ShareSlopeTable; 2]>>,
}

/// Step of the radius for a slope against it, as a share of it: error 1e-6 by curvature.
const RADIUS_STEP: f64 = 1e-3;

impl PlaceInformation {
    /// Of contacts with the even pressure of a disc of `radius`, m, at most `farthest`, m,
    /// from a corner of an element; `noise` is that of the force on one element, N.
    pub fn new(
        array: &PiezoelectricArray<'_>,
        radius: f64,
        farthest: f64,
        noise: f64,
        knowledge: RadiusKnowledge,
    ) -> Self {
        let table = |radius: f64| {
            let cover = SoftCover {
                thickness: array.description.depth(),
                base: Base::Rigid,
                contact: ContactPressure::Uniform(radius),
            };
            cover.slope_table(farthest)
        };
        let step = RADIUS_STEP * radius;
        Self {
            side: array.description.ceramic.side,
            full_scale: array.description.full_scale,
            extent: array.layout().pitch[0],
            noise,
            radius: knowledge,
            table: table(radius),
            step,
            beside: (knowledge != RadiusKnowledge::Known)
                .then(|| Box::new([table(radius - step), table(radius + step)])),
        }
    }

    /// What the elements at `places`, m, say of a contact.
    pub fn at(&self, places: &[[f64; 2]], contact: &PlacedContact) -> Information {
        let mut unknowns = Vec::new();
        for (name, dimension, full_scale, beside) in [
            ("x", &LENGTH, self.extent, false),
            ("y", &LENGTH, self.extent, false),
            ("force_z", &FORCE, self.full_scale, true),
            ("radius", &LENGTH, self.extent, true),
        ] {
            unknowns.push(Unknown {
                name,
                dimension,
                full_scale,
                beside,
            });
        }
        let count = 3 + usize::from(self.beside.is_some());
        unknowns.truncate(count);
        let mut prior = vec![0.0; count];
        if let RadiusKnowledge::Between([least, greatest]) = self.radius {
            // An even distribution has a variance of a twelfth of its width squared.
            prior[3] = 12.0 / (greatest - least).powi(2);
        }
        let row = |place: &[f64; 2]| {
            let offset = [place[0] - contact.place[0], place[1] - contact.place[1]];
            let share = |table: &ShareSlopeTable| table.share(offset, self.side);
            let [by_x, by_y] = self.table.slopes(offset, self.side);
            let mut row = vec![
                contact.force * by_x,
                contact.force * by_y,
                share(&self.table),
            ];
            if let Some([low, high]) = self.beside.as_deref() {
                row.push(contact.force * (share(high) - share(low)) / (2.0 * self.step));
            }
            row
        };
        Information {
            unknowns,
            jacobian: places.iter().map(row).collect(),
            noise: vec![self.noise; places.len()],
            prior,
        }
    }
}

impl PiezoelectricArray<'_> {
    /// Places of the elements that are not masked, from the middle of the array, m.
    pub fn places(&self) -> Vec<[f64; 2]> {
        let layout = self.layout();
        let places = (0..layout.taxels()).map(|taxel| layout.flat_position(taxel));
        let used = places.zip(self.masked()).filter(|(_, masked)| !masked);
        used.map(|(place, _)| place).collect()
    }

    /// Deviation of the force on one element by one reading in the middle of the band, N.
    pub fn element_deviation(&self) -> f64 {
        self.board.deviation() / self.output_per_newton()
    }
}

/// Columns of a load that an array locates.
const PLACE: [usize; 2] = [1, 2];
const RADIUS: usize = 3;

static INFORMATION_LOADS: [LoadColumn; 4] = {
    use predict::column;
    let length = LoadKind::Quantity(&LENGTH, [-10.0, 10.0]);
    [
        column(
            "force_z",
            "fz",
            LoadKind::Quantity(&FORCE, [0.0, 1e6]),
            "pressing force of the contact",
        ),
        column(
            "x",
            "x",
            length,
            "place of the contact from the middle of the array",
        ),
        column("y", "y", length, "the same along y"),
        column(
            "contact_radius",
            "radius",
            LoadKind::Quantity(&LENGTH, [1e-6, 1.0]),
            "radius of the contact",
        ),
    ]
};

impl Device for PiezoelectricArray<'_> {
    fn check(&self) -> Result<(), Broken> {
        check::check(self)
    }

    fn facts(&self) -> Vec<Fact> {
        facts::facts(self)
    }

    fn made(&self, normal: &mut dyn FnMut() -> f64) -> Option<Box<dyn Predictor>> {
        // The signal of an element is proportional to its charge.
        let gain = 1.0 + self.description.fabrication.gain_deviation * normal();
        let mut sensor = self.sensor.clone();
        let Element::Piezoelectric(made) = &mut sensor.element else {
            return None;
        };
        made.ceramic.charge_per_force *= gain;
        if let Some(transverse) = &mut made.ceramic.charge_per_force_transverse {
            *transverse *= gain;
        }
        let array = sensor.piezoelectric().ok()?;
        Some(Box::new(PiezoelectricPredictor::new(&array)))
    }

    fn cover(&self) -> Option<ElementCover> {
        Some(ElementCover {
            thickness: self.description.depth(),
            side: self.description.ceramic.side,
        })
        .filter(|cover| cover.thickness > 0.0)
    }

    fn predictor(&self) -> Option<Box<dyn Predictor>> {
        Some(Box::new(PiezoelectricPredictor::new(self)))
    }

    fn information_loads(&self) -> &'static [LoadColumn] {
        &INFORMATION_LOADS
    }

    fn information_noise(&self) -> &'static Dimension {
        &FORCE
    }

    fn information(
        &self,
        load: &Load<'_>,
        options: &InformationOptions,
    ) -> Result<Information, NoInformation> {
        let need = |column: usize| {
            load.number(column).ok_or_else(|| {
                NoInformation::Beyond(format!("{} is missing", INFORMATION_LOADS[column].name))
            })
        };
        let contact = PlacedContact {
            place: PLACE.map(|column| load.number(column).unwrap_or(0.0)),
            force: need(0)?,
        };
        let places = self.places();
        let noise = options.noise.unwrap_or_else(|| self.element_deviation());
        let farthest = places
            .iter()
            .map(|place| (place[0] - contact.place[0]).hypot(place[1] - contact.place[1]))
            .fold(0.0, f64::max)
            + 2.0 * self.description.ceramic.side;
        let radius = need(RADIUS)?;
        let tables = PlaceInformation::new(self, radius, farthest, noise, options.radius);
        Ok(tables.at(&places, &contact))
    }

    /// By what the cover carries to the elements.
    fn crosstalk(&self, load: &Load<'_>) -> Result<f64, NoInformation> {
        let information = self.information(load, &InformationOptions::default())?;
        let force = information.unknowns.iter();
        let force = force.enumerate().find(|(_, one)| one.name == "force_z");
        let column = force.map_or(0, |(column, _)| column);
        let mut shares: Vec<f64> = information.jacobian.iter().map(|row| row[column]).collect();
        shares.sort_by(|a, b| b.total_cmp(a));
        match shares.as_slice() {
            [loaded, next, ..] if *loaded > 0.0 => Ok(next / loaded),
            _ => Err(NoInformation::Beyond(String::from(
                "no two elements carry the contact",
            ))),
        }
    }

    fn time_constants(&self) -> Vec<f64> {
        let band = &self.board.band;
        let all = std::iter::once(band.high_pass).chain(band.low_pass);
        all.filter(|time| time.is_finite()).collect()
    }

    fn band(&self) -> Option<[f64; 2]> {
        let band = &self.board.band;
        let corner = |time: f64| 1.0 / (std::f64::consts::TAU * time);
        Some([corner(band.high_pass), corner(band.low_pass?)])
    }

    fn simulated(&self) -> Option<Box<dyn Simulated>> {
        Some(Box::new(simulated::Piece::new(self)))
    }

    fn reader(&self, stream: &Stream) -> Result<Box<dyn Reader>, FrameError> {
        let model = self.model();
        fits(stream, model.layout.taxels(), model.layout.columns)?;
        carries(stream, &self.board.last)?;
        let reader = ChargeReader::new(model, ChargeOptions::default());
        Ok(Box::new(match self.localiser() {
            Some(localiser) => reader.with_localiser(localiser),
            None => reader,
        }))
    }

    fn observed(&self, stream: &Stream) -> ObserverOptions {
        let model = self.model();
        let (layout, taxels) = (&model.layout, model.layout.taxels());
        let slip = SlipOptions {
            rows: layout.rows,
            columns: layout.columns,
            pitch: layout.pitch[0],
            delays: (0..taxels).map(|taxel| self.board.delay(taxel)).collect(),
            window: SLIP_WINDOW,
            speeds: SLIP_SPEEDS,
            least_score: 0.5,
            longest_pause: 10.0 * model.period,
        };
        let options = ObserverOptions {
            slip: (layout.columns > 1).then_some(slip),
            ..ObserverOptions::new(stream)
        };
        options.on(layout)
    }

    fn drawing(&self) -> Drawing {
        drawing::drawing(self)
    }
}
