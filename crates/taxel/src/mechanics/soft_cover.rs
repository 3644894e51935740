//! A soft cover on a stiff base: which part of a load each element carries.
//!
//! The cover is incompressible, bonded to the base and quasi-static. In
//! wave-number space p_base(k) = p_surface(k) T(kh); all loads here are round,
//! so that the force on the base within a circle is one integral and a square
//! gathers it along its edges. A round shear on the surface presses the base in front of it
//! and pulls it behind. `docs/theory/piezoelectric-array.md` derives both.

use std::f64::consts::PI;

use super::sphere_on_layer::SpherePressure;
use rayon::prelude::*;
use taxel_numerics::special::{gauss_panel, gauss_points, j0, j1};

/// Support below the cover.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Base {
    /// A rigid base to which the cover is bonded.
    Rigid,
    /// More of the same: the depth in a half space (Boussinesq).
    HalfSpace,
}

/// A soft cover with its round load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SoftCover {
    /// Thickness h, m; above zero.
    pub thickness: f64,
    /// Support below.
    pub base: Base,
    /// Contact of the load.
    pub contact: ContactPressure,
}

/// A round normal pressure on the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ContactPressure {
    /// All in one point.
    Point,
    /// Even over a disc of this radius, m.
    Uniform(f64),
    /// p₀√(1 − r²/a²) over a disc of this radius a, m: a soft ball (Hertz).
    Hertz(f64),
    /// Of a frictionless rigid sphere on a bonded layer.
    Sphere(SpherePressure),
}

impl ContactPressure {
    /// Radius of the loaded disc, m.
    pub fn radius(self) -> f64 {
        match self {
            Self::Point => 0.0,
            Self::Uniform(radius) | Self::Hertz(radius) => radius,
            Self::Sphere(sphere) => sphere.radius(),
        }
    }

    /// Transform of the pressure of unit force: 2 J₁(ka)/(ka) for the disc,
    /// 3(sin ka − ka cos ka)/(ka)³ for the ball.
    fn transform(self, k: f64) -> f64 {
        let x = k * self.radius();
        match self {
            // (ka)²/10 is the next term: below the rounding here.
            _ if x < 1e-8 => 1.0,
            Self::Point => 1.0,
            Self::Sphere(sphere) => sphere.transform(k),
            Self::Uniform(_) => 2.0 * j1(x) / x,
            Self::Hertz(_) if x < 0.05 => 1.0 - x * x / 10.0 + x.powi(4) / 280.0,
            Self::Hertz(_) => 3.0 * (x.sin() - x * x.cos()) / x.powi(3),
        }
    }
}

/// T(c) = (cosh c + c sinh c)/(cosh²c + c²), c = wave number times thickness:
/// normal stress on the rigid base over the normal pressure on the surface of
/// an incompressible bonded layer without shear on its surface.
///
/// For c ≥ 0; T(0) = 1. Written with exp(−c), so that nothing overflows.
pub fn layer_transmission(c: f64) -> f64 {
    let e = (-c).exp();
    let (cosh, sinh) = (0.5 * (1.0 + e * e), 0.5 * (1.0 - e * e));
    e * (cosh + c * sinh) / (cosh * cosh + c * c * e * e)
}

/// (1 + c) exp(−c): the same for the depth h in a half space (Boussinesq's
/// 3 F z³/(2π R⁵)).
pub fn half_space_transmission(c: f64) -> f64 {
    (1.0 + c) * (-c).exp()
}

/// S(c) = c cosh c/(cosh²c + c²), c = wave number times thickness: normal stress on the rigid
/// base over the shear on the surface of an incompressible bonded layer, a quarter of a wave
/// in front of it.
///
/// For c ≥ 0; S(c) → c for small c. Written with exp(−c), so that nothing overflows.
pub fn layer_shear_transmission(c: f64) -> f64 {
    let e = (-c).exp();
    let cosh = 0.5 * (1.0 + e * e);
    c * e * cosh / (cosh * cosh + c * c * e * e)
}

/// c exp(−c): the same for the depth h in a half space (Cerruti's 3 F x z²/(2π R⁵)).
pub fn half_space_shear_transmission(c: f64) -> f64 {
    c * (-c).exp()
}

/// Above this c all transmissions are below 1e-17.
const END: f64 = 45.0;
/// Longest panel in c: the nearest pole of T, 0.739i, is half of it away.
const PANEL: f64 = 1.5;
/// Longest panel in the phase of a Bessel function: three periods, for which
/// 16 points leave 1e-12.
const PHASE: f64 = 6.0 * PI;

/// This many thicknesses outside the load a rigid base carries nothing more: the pole
/// of T at 0.739i leaves exp(-0.739*45) = 4e-15.
const FAR: f64 = 45.0;

impl SoftCover {
    fn transmission(&self, c: f64) -> f64 {
        match self.base {
            Base::Rigid => layer_transmission(c),
            Base::HalfSpace => half_space_transmission(c),
        }
    }

    fn shear_transmission(&self, c: f64) -> f64 {
        match self.base {
            Base::Rigid => layer_shear_transmission(c),
            Base::HalfSpace => half_space_shear_transmission(c),
        }
    }

    /// What the base receives of a pressing load, as an integral over wave numbers for radii up
    /// to `reach`, m: ∫₀^∞ T(kh) D(ka) f(k) dk.
    fn pressing(&self, reach: f64) -> Spectrum {
        self.spectrum(reach, |k| self.transmission(k * self.thickness))
    }

    /// The same of a shear load, ∫₀^∞ S(kh) D(ka) f(k) dk.
    fn shearing(&self, reach: f64) -> Spectrum {
        self.spectrum(reach, |k| self.shear_transmission(k * self.thickness))
    }

    /// Points for an f that turns over with the phase k·`reach` at most and ends with the
    /// transmission.
    fn spectrum(&self, reach: f64, transmission: impl Fn(f64) -> f64) -> Spectrum {
        let end = END / self.thickness;
        let phase = end * (reach + self.contact.radius());
        let panels = (phase / PHASE).max(END / PANEL).ceil();
        let width = end / panels;
        let panels = (0..panels as usize).map(|i| i as f64 * width);
        let points = panels.flat_map(|from| gauss_points(from, from + width));
        Spectrum(
            points
                .map(|(k, weight)| (k, weight * self.contact.transform(k) * transmission(k)))
                .collect(),
        )
    }

    /// True beyond the radius outside which a rigid base carries nothing more.
    fn is_far(&self, radius: f64) -> bool {
        self.base == Base::Rigid && radius > self.contact.radius() + FAR * self.thickness
    }

    /// Share of the load that the base carries within `radius` of its axis, over r², 1/m²:
    /// (1/r) ∫₀^∞ T(kh) D(ka) J₁(kr) dk, finite at r = 0; `pressing` reaches that far.
    /// Absolute error of the share below 1e-12.
    fn mean_share(&self, pressing: &Spectrum, radius: f64) -> f64 {
        if self.is_far(radius) {
            1.0 / (radius * radius)
        } else if radius < 1e-6 * self.thickness {
            // J₁(x) → x/2; the next term is (kr)²/8, below 1e-10.
            pressing.against(|k| 0.5 * k)
        } else {
            pressing.against(|k| j1(k * radius)) / radius
        }
    }

    /// Potential of the pressure on the base under a unit of shear along x, 1/m:
    /// p = −∂Φ/∂x, Φ = (1/2π) ∫₀^∞ S(kh) D(ka) J₀(kr) dk.
    fn shear_potential(&self, shearing: &Spectrum, radius: f64) -> f64 {
        if self.is_far(radius) {
            return 0.0;
        }
        shearing.against(|k| j0(k * radius)) / (2.0 * PI)
    }

    /// Pressure on the base at a distance from the axis, m, per pressing force, 1/m²:
    /// p = (1/2π) ∫₀^∞ T(kh) D(ka) k J₀(kr) dk.
    pub fn base_pressure(&self, radius: f64) -> f64 {
        if self.is_far(radius) {
            return 0.0;
        }
        pressure(&self.pressing(radius), radius)
    }

    /// Share of the load on a square element of side `side`, m, whose centre
    /// is `offset` = (x, y), m, away from the axis of the load.
    ///
    /// Absolute error below 1e-9; some milliseconds of work. For live use see
    /// [`ShareTable`].
    ///
    /// # Example
    /// ```
    /// use taxel::mechanics::{Base, ContactPressure, SoftCover};
    /// let cover = SoftCover { thickness: 1e-3, base: Base::Rigid, contact: ContactPressure::Uniform(1e-3) };
    /// assert!((cover.share([0.0, 0.0], 2e-3) - 0.668).abs() < 5e-4);
    /// ```
    pub fn share(&self, offset: [f64; 2], side: f64) -> f64 {
        let panels = (side / self.thickness).ceil().max(1.0) as usize;
        gather(offset, side, panels, |radius| {
            self.mean_share(&self.pressing(radius), radius)
        })
    }

    /// Normal force on a square element per shear force along x and along y, spread over the
    /// surface as the pressure of [`SoftCover::contact`]: in front of the force the base is
    /// pressed (positive), behind it is pulled.
    ///
    /// As [`SoftCover::share`]: `offset` is the centre of the element from the axis of the
    /// load. The shares along x are odd in x and sum to zero over a tiling; the moment of the
    /// pressure about y is the shear force times the thickness.
    ///
    /// # Example
    /// ```
    /// use taxel::mechanics::{Base, ContactPressure, SoftCover};
    /// let cover = SoftCover { thickness: 1.15e-3, base: Base::Rigid, contact: ContactPressure::Uniform(2e-3) };
    /// let [in_front, across] = cover.shear_shares([2e-3, 0.0], 2e-3);
    /// assert!((in_front - 0.078).abs() < 3e-4 && across.abs() < 1e-12);
    /// ```
    pub fn shear_shares(&self, offset: [f64; 2], side: f64) -> [f64; 2] {
        let panels = (side / self.thickness).ceil().max(1.0) as usize;
        gather_shear(offset, side, panels, |radius| {
            self.shear_potential(&self.shearing(radius), radius)
        })
    }

    /// Mean normal stress, Pa, on equal square cells of the base, row by row from below, under a
    /// force along x, along y and pressing, N, in the middle. `low` is the corner of the first
    /// cell from there and `cell` the side of a cell, m; `counts` are cells along x and y.
    ///
    /// Cell by cell the sum of the shares of [`SoftCover::share`] and
    /// [`SoftCover::shear_shares`] over its area, by their tables.
    ///
    /// # Example: all of the force arrives
    /// ```
    /// use taxel::mechanics::{Base, ContactPressure, SoftCover};
    /// let cover = SoftCover { thickness: 1e-3, base: Base::Rigid, contact: ContactPressure::Uniform(1e-3) };
    /// let stress = cover.base_stress([0.0, 0.0, 2.0], [-8e-3, -8e-3], 0.5e-3, [32, 32]);
    /// let force: f64 = stress.iter().map(|stress| stress * 0.5e-3 * 0.5e-3).sum();
    /// assert!((force / 2.0 - 1.0).abs() < 2e-3);
    /// ```
    pub fn base_stress(
        &self,
        [force_x, force_y, pressing]: [f64; 3],
        low: [f64; 2],
        cell: f64,
        counts: [usize; 2],
    ) -> Vec<f64> {
        let shares = self.table();
        let shear = (force_x != 0.0 || force_y != 0.0).then(|| self.shear_table());
        let middle = |axis: usize, number: usize| low[axis] + (number as f64 + 0.5) * cell;
        let places = (0..counts[1])
            .flat_map(|row| (0..counts[0]).map(move |column| [middle(0, column), middle(1, row)]));
        places
            .map(|at| {
                let mut force = pressing * shares.share(at, cell);
                if let Some(shear) = &shear {
                    let [along_x, along_y] = shear.shares(at, cell);
                    force += along_x * force_x + along_y * force_y;
                }
                force / (cell * cell)
            })
            .collect()
    }

    /// The table for fast shares on elements.
    pub fn table(&self) -> ShareTable {
        ShareTable {
            thickness: self.thickness,
            mean_share: self.radial_table(
                |reach| self.pressing(reach),
                |pressing, radius| self.mean_share(pressing, radius),
            ),
        }
    }

    /// The table for fast shares of a shear force on elements.
    pub fn shear_table(&self) -> ShearTable {
        ShearTable {
            thickness: self.thickness,
            potential: self.radial_table(
                |reach| self.shearing(reach),
                |shearing, radius| self.shear_potential(shearing, radius),
            ),
        }
    }

    /// The table for shares and their slopes up to the distance `farthest`, m, of an edge of
    /// an element from the axis of the load.
    pub fn slope_table(&self, farthest: f64) -> ShareSlopeTable {
        let step = self.thickness / STEPS_FOR_SLOPES;
        let points = (farthest / step).ceil() as usize + 4;
        let pressing = |reach| self.pressing(reach);
        ShareSlopeTable {
            thickness: self.thickness,
            mean_share: RadialTable::new(step, points, pressing, |pressing, radius| {
                self.mean_share(pressing, radius)
            }),
            pressure: RadialTable::new(step, points, pressing, pressure),
        }
    }

    fn radial_table(
        &self,
        spectrum: impl Fn(f64) -> Spectrum + Sync,
        f: impl Fn(&Spectrum, f64) -> f64 + Sync,
    ) -> RadialTable {
        let step = self.thickness / STEPS_PER_THICKNESS;
        let reach = self.contact.radius() + REACH * self.thickness;
        let points = (reach / step).ceil() as usize + 3;
        RadialTable::new(step, points, spectrum, f)
    }
}

/// Points and weights of an integral over wave numbers: what all radii have in common.
struct Spectrum(Vec<(f64, f64)>);

impl Spectrum {
    fn against(&self, f: impl Fn(f64) -> f64) -> f64 {
        self.0.iter().map(|&(k, weight)| weight * f(k)).sum()
    }
}

/// Pressure at a distance from the axis per pressing force, of which this is the spectrum, 1/m².
fn pressure(pressing: &Spectrum, radius: f64) -> f64 {
    pressing.against(|k| k * j0(k * radius)) / (2.0 * PI)
}

/// ∫ over a square of −∂Φ/∂x and of −∂Φ/∂y for a round potential Φ: differences of its
/// integrals along facing edges.
fn gather_shear(
    offset: [f64; 2],
    side: f64,
    panels: usize,
    potential: impl Fn(f64) -> f64,
) -> [f64; 2] {
    let half = 0.5 * side;
    let edge = |distance: f64, middle: f64| -> f64 {
        let width = side / panels as f64;
        (0..panels)
            .map(|i| middle - half + i as f64 * width)
            .map(|from| gauss_panel(from, from + width, |l| potential(distance.hypot(l))))
            .sum()
    };
    let [x, y] = offset;
    [
        edge(x - half, y) - edge(x + half, y),
        edge(y - half, x) - edge(y + half, x),
    ]
}

/// ∫ over a square of a round density, by Gauss's theorem: the share within r
/// divided by r² is integrated along the edges, (1/2π) Σ ∫ S(r)/r² d dl, where
/// d is the distance of the edge's line from the axis.
pub(super) fn gather(
    offset: [f64; 2],
    side: f64,
    panels: usize,
    mean_share: impl Fn(f64) -> f64,
) -> f64 {
    let half = 0.5 * side;
    let [x, y] = offset;
    let edge = |distance: f64, middle: f64| -> f64 {
        let width = side / panels as f64;
        let along = |l: f64| mean_share(distance.hypot(l));
        let sum: f64 = (0..panels)
            .map(|i| middle - half + i as f64 * width)
            .map(|from| gauss_panel(from, from + width, along))
            .sum();
        distance * sum
    };
    (edge(half + x, y) + edge(half - x, y) + edge(half + y, x) + edge(half - y, x)) / (2.0 * PI)
}

/// Points of [`ShareTable`] per thickness of the cover.
const STEPS_PER_THICKNESS: f64 = 32.0;
/// Beyond this many thicknesses outside the load the base carries nothing: the
/// pole of T at 0.739i leaves exp(−0.739·22) = 9e-8.
const REACH: f64 = 22.0;

/// Tabulated shares of one cover and load, for live use: two microseconds per
/// element, absolute error below 1e-6.
///
/// Only for a rigid base, where nothing is carried far outside the load.
#[derive(Debug, Clone, PartialEq)]
pub struct ShareTable {
    thickness: f64,
    mean_share: RadialTable,
}

impl ShareTable {
    /// As [`SoftCover::share`].
    pub fn share(&self, offset: [f64; 2], side: f64) -> f64 {
        gather(offset, side, table_panels(side, self.thickness), |radius| {
            let tabulated = self.mean_share.at(radius);
            tabulated.unwrap_or_else(|| 1.0 / (radius * radius))
        })
    }
}

/// Points of [`ShareSlopeTable`] per thickness: twice those of [`ShareTable`], 16 times less
/// error of the cubics.
const STEPS_FOR_SLOPES: f64 = 64.0;

/// Tabulated shares and their slopes against the place of the load: absolute error of a share
/// below 2e-8.
#[derive(Debug, Clone, PartialEq)]
pub struct ShareSlopeTable {
    thickness: f64,
    mean_share: RadialTable,
    pressure: RadialTable,
}

impl ShareSlopeTable {
    /// As [`SoftCover::share`].
    pub fn share(&self, offset: [f64; 2], side: f64) -> f64 {
        gather(offset, side, table_panels(side, self.thickness), |radius| {
            let tabulated = self.mean_share.at(radius);
            tabulated.unwrap_or_else(|| 1.0 / (radius * radius))
        })
    }

    /// Slope of the share against the place of the load along x and y, 1/m: with p on the
    /// base, the integral of p along the edge that the load moves to, less that along the
    /// edge that it leaves.
    pub fn slopes(&self, offset: [f64; 2], side: f64) -> [f64; 2] {
        // Moving the load moves the element the other way.
        gather_shear(offset, side, table_panels(side, self.thickness), |radius| {
            self.pressure.at(radius).unwrap_or(0.0)
        })
    }
}

/// Tabulated shares of a shear force, as [`ShareTable`] has those of a pressing force:
/// absolute error below 1e-6.
#[derive(Debug, Clone, PartialEq)]
pub struct ShearTable {
    thickness: f64,
    potential: RadialTable,
}

impl ShearTable {
    /// As [`SoftCover::shear_shares`].
    pub fn shares(&self, offset: [f64; 2], side: f64) -> [f64; 2] {
        let panels = table_panels(side, self.thickness);
        gather_shear(offset, side, panels, |radius| {
            self.potential.at(radius).unwrap_or(0.0)
        })
    }
}

/// Panels along the side of an element whose share is taken from a table.
fn table_panels(side: f64, thickness: f64) -> usize {
    (side / (3.0 * thickness)).ceil().max(1.0) as usize
}

/// An even function of the radius at equal steps.
#[derive(Debug, Clone, PartialEq)]
struct RadialTable {
    per_step: f64,
    values: Vec<f64>,
}

/// Radii for which one [`Spectrum`] is made, that of the farthest of them.
const RADII_PER_SPECTRUM: usize = 32;
/// Of the points of a table one in so many is integrated: 8 per thickness for shares, 16 where
/// there are slopes. A polynomial through twelve of them has the others: where the
/// transmissions have fallen to 1e-3, at kh = 10, its points are a tenth of a wave apart.
const INTEGRATED: usize = 4;
/// Points of that polynomial.
const THROUGH: usize = 12;

impl RadialTable {
    /// An even function of a spectrum and a radius at radii from zero on, `step` apart.
    fn new(
        step: f64,
        points: usize,
        spectrum: impl Fn(f64) -> Spectrum + Sync,
        f: impl Fn(&Spectrum, f64) -> f64 + Sync,
    ) -> Self {
        let apart = INTEGRATED as f64 * step;
        let integrated = points.div_ceil(INTEGRATED) + THROUGH / 2;
        let of_block = |first: usize| -> Vec<f64> {
            let end = integrated.min(first + RADII_PER_SPECTRUM);
            let spectrum = spectrum(end as f64 * apart);
            let at = |point: usize| f(&spectrum, point as f64 * apart);
            (first..end).map(at).collect()
        };
        let blocks = (0..integrated).into_par_iter();
        let blocks = blocks.step_by(RADII_PER_SPECTRUM);
        let integrated: Vec<f64> = blocks.flat_map_iter(of_block).collect();
        // Point `node` of twelve lies so many steps of theirs from the one before the place.
        let along = |node: usize| node as f64 - (THROUGH / 2 - 1) as f64;
        let weights: [[f64; THROUGH]; INTEGRATED] = std::array::from_fn(|part| {
            let place = part as f64 / INTEGRATED as f64;
            std::array::from_fn(|node| {
                let others = (0..THROUGH).filter(|other| *other != node);
                let factor = |other| (place - along(other)) / (along(node) - along(other));
                others.map(factor).product()
            })
        });
        let between = |point: usize| -> f64 {
            let (cell, part) = (point / INTEGRATED, point % INTEGRATED);
            let nodes = (0..THROUGH).map(|node| {
                let from_zero = (cell + node).abs_diff(THROUGH / 2 - 1);
                weights[part][node] * integrated[from_zero]
            });
            nodes.sum()
        };
        Self {
            per_step: 1.0 / step,
            values: (0..points).map(between).collect(),
        }
    }

    /// Cubic through the four nearest points; `None` beyond the table.
    fn at(&self, radius: f64) -> Option<f64> {
        let position = radius * self.per_step;
        let cell = position as usize;
        let after = self.values.get(cell + 1..cell + 3)?;
        let here = self.values[cell];
        // The function is even: the point before the first is the second.
        let before = if cell == 0 {
            after[0]
        } else {
            self.values[cell - 1]
        };
        let s = position - cell as f64;
        let (t, u) = (s - 1.0, s - 2.0);
        let v = s + 1.0;
        Some(
            -s * t * u / 6.0 * before + v * t * u / 2.0 * here - v * s * u / 2.0 * after[0]
                + v * s * t / 6.0 * after[1],
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const POINT_ON_A_HALF_SPACE: SoftCover = SoftCover {
        thickness: 1e-3,
        base: Base::HalfSpace,
        contact: ContactPressure::Point,
    };

    #[test]
    fn transmissions_start_at_one_and_a_thick_layer_is_twice_a_half_space() {
        assert_eq!(layer_transmission(0.0), 1.0);
        assert_eq!(half_space_transmission(0.0), 1.0);
        // The rigid base doubles the stress; the rest is exp(−2c).
        let ratio = layer_transmission(30.0) / half_space_transmission(30.0);
        assert!((ratio - 2.0).abs() < 1e-12);
        assert_eq!(layer_transmission(1e6), 0.0);
    }

    #[test]
    fn shear_transmissions_start_as_c_and_a_thick_layer_is_twice_a_half_space() {
        for c in [0.0, 1e-9, 1e-5] {
            // The next terms are c²/2 and c² of the first.
            assert!((layer_shear_transmission(c) - c).abs() <= c * c);
            assert!((half_space_shear_transmission(c) - c).abs() <= c * c);
        }
        let ratio = layer_shear_transmission(30.0) / half_space_shear_transmission(30.0);
        assert!((ratio - 2.0).abs() < 1e-12);
        assert_eq!(layer_shear_transmission(1e6), 0.0);
    }

    #[test]
    fn point_shear_on_a_half_space_is_cerruti() {
        let cover = POINT_ON_A_HALF_SPACE;
        for radius in [1e-5, 0.3e-3, 1e-3, 5e-3] {
            // 3xz²/(2πR⁵) is −∂/∂x of z²/(2πR³).
            let expected = 1e-6 / (2.0 * PI * f64::hypot(1e-3, radius).powi(3));
            let found = cover.shear_potential(&cover.shearing(radius), radius);
            assert!((found / expected - 1.0).abs() < 1e-10, "{found} {expected}");
        }
    }

    #[test]
    fn point_load_on_a_half_space_is_boussinesq() {
        let cover = POINT_ON_A_HALF_SPACE;
        for radius in [1e-5, 0.3e-3, 1e-3, 5e-3] {
            // ∫ 3z³/(2πR⁵) over the disc.
            let expected = 1.0 - (1e-3 / f64::hypot(1e-3, radius)).powi(3);
            let within = radius * radius * cover.mean_share(&cover.pressing(radius), radius);
            assert!((within - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn pressure_of_a_point_load_on_a_half_space_is_boussinesq() {
        let cover = POINT_ON_A_HALF_SPACE;
        for radius in [0.0, 0.3e-3, 2e-3] {
            // 3z³/(2πR⁵).
            let expected = 3e-9 / (2.0 * PI * f64::hypot(1e-3, radius).powi(5));
            let found = cover.base_pressure(radius);
            assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
        }
    }

    #[test]
    fn slopes_are_those_of_the_share_against_the_place_of_the_load() {
        let cover = SoftCover {
            thickness: 0.75e-3,
            base: Base::Rigid,
            contact: ContactPressure::Uniform(2e-3),
        };
        let table = cover.slope_table(6e-3);
        for offset in [[0.3e-3, -0.2e-3], [2.1e-3, 1.0e-3], [-3.0e-3, 0.4e-3]] {
            let share = |x: f64, y: f64| cover.share([offset[0] - x, offset[1] - y], 2e-3);
            assert!((table.share(offset, 2e-3) - share(0.0, 0.0)).abs() < 2e-8);
            let h = 1e-5;
            let found = table.slopes(offset, 2e-3);
            let differences = [
                share(h, 0.0) - share(-h, 0.0),
                share(0.0, h) - share(0.0, -h),
            ];
            for (slope, difference) in found.into_iter().zip(differences) {
                // Curvature of the differences: (h/thickness)²; the slopes are up to 300/m.
                assert!(
                    (slope - difference / (2.0 * h)).abs() < 0.1,
                    "{slope} {difference}"
                );
            }
        }
    }

    #[test]
    fn points_between_those_that_are_integrated_are_exact() {
        for contact in [
            ContactPressure::Point,
            ContactPressure::Uniform(0.2e-3),
            ContactPressure::Hertz(3e-3),
        ] {
            let cover = SoftCover {
                thickness: 1e-3,
                base: Base::Rigid,
                contact,
            };
            let slopes = cover.slope_table(4e-3);
            // What the tables state, and a part of it.
            for (table, error) in [
                (&cover.table().mean_share, 1e-6),
                (&slopes.mean_share, 2e-9),
            ] {
                let scale = table.values[0];
                for point in (0..160).step_by(7) {
                    let radius = point as f64 / table.per_step;
                    let exact = cover.mean_share(&cover.pressing(radius), radius);
                    let off = (table.values[point] - exact) / scale;
                    assert!(off.abs() < error, "{contact:?} {point}: {off:e}");
                }
            }
            let scale = slopes.pressure.values[0];
            for point in (0..250).step_by(7) {
                let exact = cover.base_pressure(point as f64 / slopes.pressure.per_step);
                let off = (slopes.pressure.values[point] - exact) / scale;
                assert!(off.abs() < 2e-8, "{contact:?} {point}: {off:e}");
            }
        }
    }

    #[test]
    fn transforms_join_their_series() {
        for contact in [ContactPressure::Uniform(1.0), ContactPressure::Hertz(1.0)] {
            for k in [0.9999e-8, 0.0499999] {
                let step = contact.transform(k * 1.0001) - contact.transform(k);
                // The true step is 2e-4 (ka)²/8 at most; 1e-16/(ka)³ cancels.
                assert!(step.abs() < 3e-5 * k * k + 1e-11, "{contact:?} {k} {step}");
            }
        }
    }
}
