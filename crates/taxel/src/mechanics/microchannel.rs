//! A liquid-filled channel in a soft sheet under pressure (P4).
//!
//! One cross-section closes by the net pressure q = p − P_int alone:
//! [`ClosingCurve`] gives a = A/A₀ for q. The liquid of one channel has one
//! pressure P_int, which [`PressureLaw`] gives for the volume that is left.
//! [`ClosingCurve::settle`] finds the pressure at which the two agree.

use std::f64::consts::FRAC_PI_8;
use std::sync::LazyLock;

use schemars::JsonSchema;
use serde::Deserialize;

use super::material::LinearElastic;
use super::tabulated_cells::{self, CELLS, TabulatedCell};
use crate::quantity::{self, Checked, NonNegativeStress, PositiveFraction, PositiveStress};
use crate::solved_table::{SolvedRow, SolvedTable, interpolated};
use taxel_numerics::{CurveError, MonotoneCurve, OnCurve, roots::ridders};

/// Shape of a cross-section.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SectionShape {
    /// A rectangle with sharp corners.
    #[default]
    Rectangle,
    /// An ellipse; of equal width and height, a round channel.
    Ellipse,
}

/// A cross-section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MicrochannelSection {
    /// Width w, along the surface, m.
    pub width: f64,
    /// Height h, m.
    pub height: f64,
    /// Its shape.
    pub shape: SectionShape,
}

/// A channel that the closed form of P4 calls closed.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("closed: {pressure} Pa is at or above the closing pressure of {closing_pressure} Pa")]
pub struct MicrochannelClosed {
    /// The pressure that was asked for, Pa.
    pub pressure: f64,
    /// The pressure at which the closed form ends, Pa.
    pub closing_pressure: f64,
}

impl MicrochannelSection {
    /// A rectangular cross-section of this width and height, m.
    pub fn rectangle(width: f64, height: f64) -> Self {
        Self {
            width,
            height,
            shape: SectionShape::Rectangle,
        }
    }

    /// An elliptic cross-section of this width and height, m.
    pub fn ellipse(width: f64, height: f64) -> Self {
        Self {
            width,
            height,
            shape: SectionShape::Ellipse,
        }
    }

    /// Area A₀, m²: w h of a rectangle, (π/4) w h of an ellipse.
    pub fn area(&self) -> f64 {
        let around = self.width * self.height;
        match self.shape {
            SectionShape::Rectangle => around,
            SectionShape::Ellipse => std::f64::consts::FRAC_PI_4 * around,
        }
    }

    /// Pressure at which the closed form ends, Pa.
    ///
    /// p_c = E h / (2 (1 − ν²) w)   (P4 Eq. 1, where its bracket diverges)
    pub fn closing_pressure(&self, solid: &LinearElastic) -> f64 {
        solid.plane_strain_modulus() * self.height / (2.0 * self.width)
    }

    /// Area ratio of the closed form, A/A₀ = 1 − p/p_c.
    ///
    /// ΔR/R₀ = 1/(1 − 2 (1 − ν²) w p/(E h)) − 1   (P4 Eq. 1), R/R₀ = A₀/A.
    /// It takes the largest closing of a slit of the width w in an endless body
    /// for the mean, 4/π too much, and knows no free surface, no fixed base
    /// and no liquid. `pressure` in Pa; a pull (negative) opens.
    ///
    /// # Errors
    /// [`MicrochannelClosed`] from the closing pressure on, and for a pressure that
    /// is not a number.
    ///
    /// # Example
    /// ```
    /// use taxel::mechanics::{MicrochannelSection, LinearElastic};
    /// let section = MicrochannelSection::rectangle(400e-6, 60e-6);
    /// let solid = LinearElastic { young_modulus: 500e3, poisson_ratio: 0.5 };
    /// assert!((section.published_area_ratio(&solid, 25e3)? - 0.5).abs() < 1e-12);
    /// let closed = section.published_area_ratio(&solid, 50e3).unwrap_err();
    /// assert!((closed.closing_pressure - 50e3).abs() < 1e-6);
    /// # Ok::<(), taxel::mechanics::MicrochannelClosed>(())
    /// ```
    pub fn published_area_ratio(
        &self,
        solid: &LinearElastic,
        pressure: f64,
    ) -> Result<f64, MicrochannelClosed> {
        let closing_pressure = self.closing_pressure(solid);
        if pressure < closing_pressure {
            Ok(1.0 - pressure / closing_pressure)
        } else {
            Err(MicrochannelClosed {
                pressure,
                closing_pressure,
            })
        }
    }
}

/// Cross-sections whose first response in an endless body is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MicrochannelShape {
    /// A cut of no height; its area is counted as w h.
    Slit,
    /// An ellipse with the axes w and h.
    Ellipse,
    /// A rectangle with sharp corners, w/h from 1 to 20.
    Rectangle,
}

/// Excess of the rectangle's c₀μ over the slit's, against h/w, from
/// `tables/p4_rectangle.csv`. It is nearly straight in h/w.
static RECTANGLE: LazyLock<Vec<[f64; 2]>> = LazyLock::new(|| {
    let table = SolvedTable::parse(include_str!("../../tables/p4_rectangle.csv"));
    let point = |row: SolvedRow<'_>| {
        let width = row.number("width_over_height");
        [1.0 / width, row.number("compliance") - FRAC_PI_8 * width]
    };
    table.rows().map(point).collect()
});

/// Relative rounding of a quotient of lengths.
const ROUNDING: f64 = 1e-12;

impl MicrochannelShape {
    /// Share of its area that a channel loses per pressure, c₀ in 1/Pa, for
    /// small loads in an endless incompressible body in plane strain:
    /// a = 1 − c₀ q.
    ///
    /// Slit c₀ = (π/8) w/(μ h); ellipse c₀ = (w² + h²)/(2 μ w h), so 1/μ for a
    /// circle; rectangle by interpolation of three computed values, which are
    /// themselves good to 0.3 %. `None` for a rectangle outside w/h = 1 to 20.
    ///
    /// In a thin sheet a channel is softer: twice for a height of 20 um under
    /// a roof of 140 um ([`ClosingCurve::compliance`]).
    ///
    /// # Example
    /// ```
    /// use taxel::mechanics::{MicrochannelSection, MicrochannelShape};
    /// let circle = MicrochannelSection::rectangle(1e-4, 1e-4);
    /// assert_eq!(MicrochannelShape::Ellipse.compliance(circle, 162.4e3), Some(1.0 / 162.4e3));
    /// ```
    pub fn compliance(self, section: MicrochannelSection, shear_modulus: f64) -> Option<f64> {
        let flatness = section.height / section.width;
        let slit = FRAC_PI_8 / flatness;
        let factor = match self {
            Self::Slit => slit,
            Self::Ellipse => 0.5 * (flatness + 1.0 / flatness),
            Self::Rectangle => {
                let ends = [RECTANGLE.first()?[0], RECTANGLE.last()?[0]];
                // Quotients of lengths.
                if flatness < ends[0] * (1.0 - ROUNDING) || flatness > ends[1] * (1.0 + ROUNDING) {
                    return None;
                }
                slit + interpolated(&RECTANGLE, flatness)
            }
        };
        Some(factor / shear_modulus)
    }
}

/// A cell of a sheet with equal parallel channels: what the tabulated closing
/// curves are known for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellGeometry {
    /// Cross-section of the channel.
    pub section: MicrochannelSection,
    /// Solid above the channel, m.
    pub roof: f64,
    /// Thickness of the whole sheet, m.
    pub thickness: f64,
    /// Distance of neighbouring channels' centres, m.
    pub pitch: f64,
}

/// One point of a closing curve.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ClosingPoint {
    /// Net pressure q = p − P_int, Pa.
    #[serde(deserialize_with = "quantity::one::<PositiveStress, _>")]
    #[schemars(with = "Checked<PositiveStress>")]
    pub net_pressure: f64,
    /// Area ratio A/A₀ at this net pressure.
    #[serde(deserialize_with = "quantity::one::<PositiveFraction, _>")]
    #[schemars(with = "Checked<PositiveFraction>")]
    pub area_ratio: f64,
}

/// Net pressure to area ratio of one cross-section, a = f(q).
///
/// It depends on q = p − P_int alone where the body is incompressible, its
/// bottom fixed, its sides symmetric and its top loaded evenly.
#[derive(Debug, Clone, PartialEq)]
pub struct ClosingCurve {
    /// q in Pa to a, from (0, 1) on.
    curve: MonotoneCurve,
    /// −q in Pa to a, from (0, 1) on, where it was solved how the section bulges; without it a
    /// follows the slope at rest.
    bulging: Option<MonotoneCurve>,
    /// Area ratio at which roof and floor touch, where it is known.
    touch: Option<f64>,
    source: CurveSource,
    /// What is known of the sections along the channel; without it they are taken for equal.
    along: Option<AlongChannel>,
}

/// Sections along a channel that crosses others, over the net pressure in Pa.
#[derive(Debug, Clone, PartialEq)]
pub struct AlongChannel {
    /// Conductance over that at rest, from (0, 1) on.
    pub conductance: MonotoneCurve,
    /// Area ratio of the thinnest section, from (0, 1) on.
    pub thinnest: MonotoneCurve,
}

/// Where a closing curve comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum CurveSource {
    /// A shipped table.
    Tabulated {
        /// Greatest error of the net pressure at an area ratio, as a share.
        error: f64,
    },
    /// The plane-strain cell of the drawing, solved.
    Solved {
        /// Greatest known error of the net pressure at an area ratio, as a share.
        error: f64,
        /// Why the solution ended before the microchannel was closed to 6 %.
        ended: Option<String>,
    },
    /// Points that were given.
    Points,
    /// The load path of the crossing layers, solved and tabulated.
    LoadPath,
}

impl CurveSource {
    /// In a word or two.
    pub fn words(&self) -> &'static str {
        match self {
            Self::Tabulated { .. } => "table",
            Self::Solved { .. } => "solved, kept",
            Self::Points => "points",
            Self::LoadPath => "a table of finite elements",
        }
    }
}

/// State of closing of a cross-section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ClosingState {
    /// The liquid pushes harder than the load: a > 1 by the slope at rest.
    Bulging,
    /// Open over its whole width.
    Open,
    /// The roof touches the floor; the corners are open.
    Closed,
    /// Closed further than the curve is known: the area ratio is an upper
    /// bound, the last one of the curve.
    Beyond {
        /// Net pressure at which the curve ends, Pa.
        limit: f64,
    },
}

/// Area of an over-filled channel over the drawn one, at most.
const MOST_BULGED: f64 = 2.0;
/// Points on the part of its curve between the filled and the drawn area, and on the part beyond.
const ON_BULGE: u8 = 8;

/// One cross-section under its load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SectionClosure {
    /// Net pressure q = p − P_int, Pa.
    pub net_pressure: f64,
    /// Area ratio A/A₀; the mean of the sections along the channel.
    pub area_ratio: f64,
    /// Conductance of this part of the channel over that at rest: the area ratio where the sections
    /// are taken for equal.
    pub conductance: f64,
    /// Area ratio of the thinnest section, where a solution along the channel has it.
    pub thinnest: Option<f64>,
    /// State of closing.
    pub state: ClosingState,
}

/// Law of the pressure in the liquid of a microchannel; volumes are those of the whole
/// microchannel, V/V₀.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum PressureLaw {
    /// P_int = η P_atm (V₀/V − 1), a scaled trapped gas (P4 Eq. 2).
    Paper(PaperLaw),
    /// The liquid leaves freely: P_int = 0.
    Vented,
    /// Liquid and ends are rigid: the volume of the channel stays what it was,
    /// so what is pressed out of one part bulges the others.
    Sealed,
    /// Straight lines through points of falling volume, from (1, 0) on.
    Tabulated(Vec<LiquidPoint>),
}

/// Constants of P4 Eq. 2.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PaperLaw {
    /// Expansion factor η.
    #[serde(deserialize_with = "quantity::one::<PositiveFraction, _>")]
    #[schemars(with = "Checked<PositiveFraction>")]
    pub expansion: f64,
    /// Atmospheric pressure P_atm, Pa.
    #[serde(deserialize_with = "quantity::one::<PositiveStress, _>")]
    #[schemars(with = "Checked<PositiveStress>")]
    pub atmosphere: f64,
}

/// One point of a tabulated pressure law.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LiquidPoint {
    /// Volume over the volume at rest, V/V₀.
    #[serde(deserialize_with = "quantity::one::<PositiveFraction, _>")]
    #[schemars(with = "Checked<PositiveFraction>")]
    pub volume_ratio: f64,
    /// Gauge pressure of the liquid, Pa.
    #[serde(deserialize_with = "quantity::one::<NonNegativeStress, _>")]
    #[schemars(with = "Checked<NonNegativeStress>")]
    pub pressure: f64,
}

/// A part of a channel under one pressure on the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stretch {
    /// Its share of the length of the channel, 0 to 1.
    pub share: f64,
    /// Pressure on the surface above it, Pa.
    pub pressure: f64,
}

/// A channel at rest under its loads.
#[derive(Debug, Clone, PartialEq)]
pub struct SettledChannel {
    /// Gauge pressure of the liquid P_int, Pa.
    pub internal_pressure: f64,
    /// Volume over the volume at rest, V/V₀.
    pub volume_ratio: f64,
    /// The parts, in the order they were given.
    pub sections: Vec<SectionClosure>,
}

/// A channel or a load that cannot be computed.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum MicrochannelError {
    /// No tabulated cell has this geometry.
    #[error(
        "no closing curve is tabulated for a channel of {:.4} x {:.4} um under {:.4} um in a sheet of {:.4} um at a \
         pitch of {:.4} um; known are 400 um wide channels, pitch 600 um, sheet 500 um, with height/roof 20/100, \
         20/140, 20/200, 40/100, 40/140, 60/60, 60/120, 60/160, 100/100, 100/140, 160/120 and 160/200 um, and all \
         of these scaled; the command `taxel` and Sensor::parse_with solve such a cell, or give the curve as points",
        cell.section.width * 1e6, cell.section.height * 1e6, cell.roof * 1e6, cell.thickness * 1e6, cell.pitch * 1e6
    )]
    NotTabulated {
        /// The geometry, m.
        cell: CellGeometry,
    },
    /// The points of a closing curve are not monotone.
    #[error("closing curve: {0}")]
    Curve(#[from] CurveError),
    /// The points of a pressure law do not go from (1, 0) to less volume and
    /// more pressure.
    #[error(
        "point {index} of the pressure law: the first point must be volume_ratio = 1 with pressure \"0 Pa\", \
         and from point to point the volume must fall and the pressure rise"
    )]
    PressureLaw {
        /// Position of the point in the list.
        index: usize,
    },
    /// Shares that are negative or do not sum to 1.
    #[error(
        "the shares of the channel's length sum to {sum}; they must not be negative and sum to 1"
    )]
    Shares {
        /// Their sum.
        sum: f64,
    },
    /// A pressure of filling that bulges the channel too far.
    #[error(
        "a microchannel filled to {:.4} kPa bulges further than is known, twice its drawn area at most; the model holds up to \
         {:.4} kPa",
        pressure * 1e-3, limit * 1e-3
    )]
    Filling {
        /// The pressure, Pa.
        pressure: f64,
        /// The greatest one, Pa.
        limit: f64,
    },
    /// A pull, or a pressure that is not a number.
    #[error("a pressure of {pressure} Pa on the surface: the closing curves hold for zero or more")]
    Pressure {
        /// The pressure, Pa.
        pressure: f64,
    },
}

impl AlongChannel {
    /// Conductance over that at rest at a net pressure in Pa, of the last point beyond it; and the
    /// area ratio of the thinnest section, which is not known there.
    fn at(&self, net_pressure: f64) -> (f64, Option<f64>) {
        let conductance = match self.conductance.at(net_pressure) {
            OnCurve::Inside { value, .. }
            | OnCurve::Below([_, value])
            | OnCurve::Above([_, value]) => value,
        };
        let thinnest = match self.thinnest.at(net_pressure) {
            OnCurve::Inside { value, .. } => Some(value),
            OnCurve::Below(_) | OnCurve::Above(_) => None,
        };
        (conductance, thinnest)
    }
}

impl ClosingCurve {
    /// The curve of a tabulated cell for a solid of `shear_modulus`, Pa.
    ///
    /// Lengths scale freely and pressures with the modulus: the cell is known
    /// by its ratios, and any incompressible Mooney-Rivlin solid is a
    /// neo-Hookean one in plane strain. The total thickness hardly matters (420
    /// instead of 500 um moves the pressure of a given closing by 0.3 %), but
    /// is not replaced silently.
    ///
    /// # Errors
    /// [`MicrochannelError::NotTabulated`] for another geometry.
    pub fn of_cell(cell: &CellGeometry, shear_modulus: f64) -> Result<Self, MicrochannelError> {
        let known = CELLS
            .iter()
            .find(|known| is_scaled(cell, known))
            .ok_or(MicrochannelError::NotTabulated { cell: *cell })?;
        let scale = shear_modulus / tabulated_cells::SHEAR_MODULUS; // Pa per tabulated kPa
        let rows = known.rows.iter().map(|(ratio, net)| [net * scale, *ratio]);
        let points = std::iter::once([0.0, 1.0]).chain(rows).collect();
        let source = CurveSource::Tabulated { error: known.error };
        let curve = MonotoneCurve::new(points, Some(-known.compliance / scale))?;
        Ok(Self::of_source(curve, known.touch, source))
    }

    /// True if a table has this cell.
    pub fn is_tabulated(cell: &CellGeometry) -> bool {
        CELLS.iter().any(|known| is_scaled(cell, known))
    }

    /// A curve with where it comes from.
    pub(super) fn of_source(curve: MonotoneCurve, touch: Option<f64>, source: CurveSource) -> Self {
        Self {
            curve,
            bulging: None,
            touch,
            source,
            along: None,
        }
    }

    /// The same curve with how the section bulges: −q in Pa to a, from (0, 1) on.
    #[must_use]
    pub(super) fn bulging(mut self, bulging: MonotoneCurve) -> Self {
        self.bulging = Some(bulging);
        self
    }

    /// True if it was solved how the section bulges, and is not taken from the slope at rest.
    pub fn knows_bulging(&self) -> bool {
        self.bulging.is_some()
    }

    /// The curve of a load path: net pressure to area ratio with the sections along the channel.
    pub fn of_path(curve: MonotoneCurve, touch: Option<f64>, along: AlongChannel) -> Self {
        Self {
            along: Some(along),
            ..Self::of_source(curve, touch, CurveSource::LoadPath)
        }
    }

    /// True if the sections along the channel are known, not only their mean.
    pub fn knows_sections(&self) -> bool {
        self.along.is_some()
    }

    /// The curve through given points; rest, (0, 1), is not among them.
    ///
    /// # Errors
    /// [`MicrochannelError::Curve`] when the net pressure does not rise or the area
    /// ratio does not fall from point to point.
    pub fn from_points(points: &[ClosingPoint]) -> Result<Self, MicrochannelError> {
        let given = points.iter().map(|at| [at.net_pressure, at.area_ratio]);
        let points = std::iter::once([0.0, 1.0]).chain(given).collect();
        let curve = MonotoneCurve::new(points, None)?;
        Ok(Self::of_source(curve, None, CurveSource::Points))
    }

    /// Where the curve comes from.
    pub fn source(&self) -> &CurveSource {
        &self.source
    }

    /// The same curve for a solid that is `factor` times as stiff: all pressures
    /// are multiplied by it.
    #[must_use]
    pub fn stiffened(mut self, factor: f64) -> Self {
        self.curve = self.curve.stretched(factor);
        self.bulging = self.bulging.map(|curve| curve.stretched(factor));
        self.along = self.along.map(|along| AlongChannel {
            conductance: along.conductance.stretched(factor),
            thinnest: along.thinnest.stretched(factor),
        });
        self
    }

    /// The curve of a microchannel that is over-filled to a gauge pressure, Pa, with its area at
    /// rest over the drawn one.
    ///
    /// The area follows from the net pressure alone, so that the filled state is the curve at
    /// −`pressure`: a′(q′) = f(q′ − P)/f(−P), where pressures of the liquid count from P. The
    /// bulging f(−P) is solved with the cell ([`Self::knows_bulging`]); of shipped tables and of
    /// points it follows the slope at rest, 1 + c₀P (`docs/theory/microchannel.md`, section 5).
    ///
    /// # Errors
    /// [`MicrochannelError::Filling`] for a pressure that more than doubles the area.
    ///
    /// # Example
    /// ```
    /// use taxel::mechanics::*;
    /// let section = MicrochannelSection::rectangle(400e-6, 20e-6);
    /// let cell = CellGeometry { section, roof: 140e-6, thickness: 500e-6, pitch: 600e-6 };
    /// let (filled, bulged) = ClosingCurve::of_cell(&cell, 162.4e3)?.filled(5e3)?;
    /// assert!((bulged - 1.526).abs() < 1e-3);
    /// // What closes the drawn channel by nothing closes the filled one to its drawn area.
    /// assert!((filled.at(5e3).area_ratio * bulged - 1.0).abs() < 1e-12);
    /// # Ok::<(), MicrochannelError>(())
    /// ```
    ///
    /// # Example: too much is refused
    /// ```
    /// use taxel::mechanics::*;
    /// let section = MicrochannelSection::rectangle(400e-6, 20e-6);
    /// let cell = CellGeometry { section, roof: 140e-6, thickness: 500e-6, pitch: 600e-6 };
    /// let error = ClosingCurve::of_cell(&cell, 162.4e3)?.filled(20e3).unwrap_err();
    /// assert!(matches!(error, MicrochannelError::Filling { .. }));
    /// # Ok::<(), MicrochannelError>(())
    /// ```
    pub fn filled(&self, pressure: f64) -> Result<(Self, f64), MicrochannelError> {
        let limit = match &self.bulging {
            Some(curve) => curve.end()[0],
            None => (MOST_BULGED - 1.0) / self.compliance(),
        };
        if !(0.0..=limit).contains(&pressure) {
            return Err(MicrochannelError::Filling { pressure, limit });
        }
        if pressure == 0.0 {
            return Ok((self.clone(), 1.0));
        }
        let (bulged, rate) = self.bulge(pressure);
        let steps = (0..ON_BULGE).map(|step| f64::from(step) / f64::from(ON_BULGE));
        let up_to_drawn = steps.clone().map(|share| {
            let (area, _) = self.bulge((1.0 - share) * pressure);
            [share * pressure, area / bulged]
        });
        let drawn = self.curve.points().iter();
        let drawn = drawn.map(|[net, ratio]| [net + pressure, ratio / bulged]);
        let curve = MonotoneCurve::new(up_to_drawn.chain(drawn).collect(), Some(-rate / bulged))?;
        let touch = self.touch.map(|touch| touch / bulged);
        let mut filled = Self::of_source(curve, touch, self.source.clone());
        if self.knows_bulging() && pressure < limit {
            let beyond = steps.chain(std::iter::once(1.0)).map(|share| {
                let more = share * (limit - pressure);
                [more, self.bulge(pressure + more).0 / bulged]
            });
            let beyond = MonotoneCurve::new(beyond.collect(), Some(rate / bulged))?;
            filled = filled.bulging(beyond);
        }
        Ok((filled, bulged))
    }

    /// Area ratio and its rise, 1/Pa, under a pressure inside that is higher than outside, Pa: a line
    /// beyond the end of what was solved.
    fn bulge(&self, inside: f64) -> (f64, f64) {
        match self.bulging.as_ref().map(|curve| (curve, curve.at(inside))) {
            Some((_, OnCurve::Inside { value, slope })) => (value, slope),
            Some((curve, OnCurve::Above([last, most]))) => {
                let slope = curve.end_slope();
                (most + slope * (inside - last), slope)
            }
            Some((_, OnCurve::Below(_))) | None => {
                (1.0 + self.compliance() * inside, self.compliance())
            }
        }
    }

    /// Share of the area lost per net pressure at rest, c₀ = −da/dq, 1/Pa.
    pub fn compliance(&self) -> f64 {
        -self.curve.start_slope()
    }

    /// The last point of the curve: net pressure in Pa and area ratio.
    pub fn end(&self) -> [f64; 2] {
        self.curve.end()
    }

    /// Area ratio at which roof and floor touch first, where it is known.
    pub fn touch(&self) -> Option<f64> {
        self.touch
    }

    /// Area ratio and state at a net pressure in Pa.
    fn closing_at(&self, net_pressure: f64) -> (f64, ClosingState) {
        match self.curve.at(net_pressure) {
            OnCurve::Inside { value, .. } if self.touch.is_some_and(|touch| value <= touch) => {
                (value, ClosingState::Closed)
            }
            OnCurve::Inside { value, .. } => (value, ClosingState::Open),
            OnCurve::Below(_) => (self.bulge(-net_pressure.min(0.0)).0, ClosingState::Bulging),
            OnCurve::Above([limit, least]) => (least, ClosingState::Beyond { limit }),
        }
    }

    /// The cross-section at a net pressure in Pa; a NaN counts as zero.
    pub fn at(&self, net_pressure: f64) -> SectionClosure {
        let (area_ratio, state) = self.closing_at(net_pressure);
        let (conductance, thinnest) = match &self.along {
            Some(along) if net_pressure >= 0.0 => along.at(net_pressure),
            // Under more pressure inside than outside the sections are taken for equal.
            _ => (area_ratio, None),
        };
        SectionClosure {
            net_pressure,
            area_ratio,
            conductance,
            thinnest,
            state,
        }
    }

    /// The pressure of the liquid, and all parts of the channel with it.
    ///
    /// Solves P = law(V/V₀), V/V₀ = Σ share · f(p − P). The volume rises with
    /// P and the law falls with the volume, so there is one solution between 0
    /// and the largest pressure on the surface.
    ///
    /// # Errors
    /// [`MicrochannelError::Shares`] and [`MicrochannelError::Pressure`].
    ///
    /// # Example: at 25 kPa the liquid carries four fifths of the load
    /// ```
    /// use taxel::mechanics::*;
    /// let section = MicrochannelSection::rectangle(400e-6, 20e-6);
    /// let cell = CellGeometry { section, roof: 140e-6, thickness: 500e-6, pitch: 600e-6 };
    /// let curve = ClosingCurve::of_cell(&cell, 162.4e3)?;
    /// let law = PressureLaw::Paper(PaperLaw { expansion: 0.2, atmosphere: 101.325e3 });
    /// let channel = curve.settle(&law, &[Stretch { share: 1.0, pressure: 25e3 }])?;
    /// assert!((channel.volume_ratio - 0.4995).abs() < 1e-4);
    /// assert!((channel.internal_pressure - 20.305e3).abs() < 5.0);
    /// # Ok::<(), MicrochannelError>(())
    /// ```
    pub fn settle(
        &self,
        law: &PressureLaw,
        stretches: &[Stretch],
    ) -> Result<SettledChannel, MicrochannelError> {
        let highest = highest_pressure(stretches)?;
        let volume = |internal: f64| -> f64 {
            stretches
                .iter()
                .map(|part| part.share * self.closing_at(part.pressure - internal).0)
                .sum()
        };
        let internal_pressure = match law {
            PressureLaw::Vented => 0.0,
            PressureLaw::Sealed => rising_root(highest, |internal| volume(internal) - 1.0),
            PressureLaw::Paper(law) => rising_root(highest, |internal| {
                internal - law.pressure(volume(internal))
            }),
            PressureLaw::Tabulated(points) => rising_root(highest, |internal| {
                internal - tabulated_pressure(points, volume(internal))
            }),
        };
        Ok(SettledChannel {
            internal_pressure,
            volume_ratio: volume(internal_pressure),
            sections: stretches
                .iter()
                .map(|part| self.at(part.pressure - internal_pressure))
                .collect(),
        })
    }
}

impl PressureLaw {
    /// The law of an over-filled channel, whose pressures count from `pressure`, Pa, and volumes
    /// from the filled state: that of a gas, from the filled state, has the scale
    /// η (P_atm + P); all others are as they were, and a reservoir holds P.
    #[must_use]
    pub fn filled(&self, pressure: f64) -> Self {
        match self {
            Self::Paper(law) => Self::Paper(PaperLaw {
                atmosphere: law.atmosphere + pressure,
                ..*law
            }),
            other => other.clone(),
        }
    }
}

impl PaperLaw {
    /// P_int = η P_atm (V₀/V − 1), Pa   (P4 Eq. 2 with volumes for areas).
    pub fn pressure(&self, volume_ratio: f64) -> f64 {
        self.expansion * self.atmosphere * (1.0 / volume_ratio - 1.0)
    }
}

impl PressureLaw {
    /// Checks what a type cannot: the order of tabulated points.
    ///
    /// # Errors
    /// [`MicrochannelError::PressureLaw`].
    pub fn check(&self) -> Result<(), MicrochannelError> {
        let Self::Tabulated(points) = self else {
            return Ok(());
        };
        let starts = points
            .first()
            .is_some_and(|first| first.volume_ratio == 1.0 && first.pressure == 0.0);
        let ordered = |pair: &[LiquidPoint]| {
            pair[1].volume_ratio < pair[0].volume_ratio && pair[1].pressure > pair[0].pressure
        };
        match points.windows(2).position(|pair| !ordered(pair)) {
            _ if !starts || points.len() < 2 => Err(MicrochannelError::PressureLaw { index: 0 }),
            Some(index) => Err(MicrochannelError::PressureLaw { index: index + 1 }),
            None => Ok(()),
        }
    }
}

/// Straight lines through `points`; zero at rest volume and above, the last
/// pressure below the last volume.
pub fn tabulated_pressure(points: &[LiquidPoint], volume_ratio: f64) -> f64 {
    let last = points.last().map_or(0.0, |point| point.pressure);
    if volume_ratio >= 1.0 {
        return 0.0;
    }
    points
        .windows(2)
        .find(|pair| volume_ratio >= pair[1].volume_ratio)
        .map_or(last, |pair| {
            let share = (pair[0].volume_ratio - volume_ratio)
                / (pair[0].volume_ratio - pair[1].volume_ratio);
            pair[0].pressure + share * (pair[1].pressure - pair[0].pressure)
        })
}

/// The largest pressure on the surface, of loads that make sense.
fn highest_pressure(stretches: &[Stretch]) -> Result<f64, MicrochannelError> {
    let sum: f64 = stretches.iter().map(|part| part.share).sum();
    // Shares are quotients of lengths: a few roundings.
    let whole = (sum - 1.0).abs() <= 1e-9;
    if !(whole && stretches.iter().all(|part| part.share >= 0.0)) {
        return Err(MicrochannelError::Shares { sum });
    }
    let bad = |pressure: &f64| !(*pressure >= 0.0 && pressure.is_finite());
    let mut pressures = stretches.iter().map(|part| part.pressure);
    if let Some(pressure) = pressures.clone().find(bad) {
        return Err(MicrochannelError::Pressure { pressure });
    }
    Ok(pressures.by_ref().fold(0.0, f64::max))
}

/// Root of a rising function between 0 and `highest`, to the last digit, so that a root rises
/// with what the function falls with: where rounding leaves no change of sign, the end nearest
/// to it.
fn rising_root(highest: f64, excess: impl Fn(f64) -> f64) -> f64 {
    let near = ridders([0.0, highest], &excess);
    // What the method leaves is some bits; bisection has the rest.
    let around = [1.0 - 16.0 * f64::EPSILON, 1.0 + 16.0 * f64::EPSILON].map(|part| near * part);
    let mut low = if excess(around[0]) < 0.0 {
        around[0]
    } else {
        0.0
    };
    let mut high = around[1].min(highest);
    if excess(high) < 0.0 {
        high = highest;
    }
    if excess(low) >= 0.0 {
        return low;
    }
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return high;
        }
        if excess(middle) < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
}

/// True if `cell` is `known` up to a scale of all lengths.
fn is_scaled(cell: &CellGeometry, known: &TabulatedCell) -> bool {
    let scale = cell.section.width / tabulated_cells::WIDTH;
    let same = |length: f64, known: f64| (length - known * scale).abs() <= 1e-9 * known * scale;
    cell.section.shape == SectionShape::Rectangle
        && same(cell.section.height, known.height)
        && same(cell.roof, known.roof)
        && same(cell.thickness, tabulated_cells::THICKNESS)
        && same(cell.pitch, tabulated_cells::PITCH)
}
