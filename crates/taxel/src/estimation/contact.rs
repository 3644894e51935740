//! One contact on the array: what its taxels say together.

use super::{Certainty, State};

/// One contact region.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Number of taxels.
    pub taxels: usize,
    /// Area of their cells on the developed surface, m².
    pub area: f64,
    /// Centre of the normal force on the developed surface, m.
    pub centre: [f64; 2],
    /// Covariance of the centre xx, xy, yy, m²: the noise of the taxels, what
    /// untouched neighbours may carry, and the grid itself; `NaN` where the
    /// noise of a taxel is not known.
    pub covariance: [f64; 3],
    /// Sum of the taxels' forces x, y, z, each in its taxel's frame, N.
    pub force: [f64; 3],
    /// Its covariance, N².
    pub force_covariance: [[f64; 3]; 3],
    /// Standard deviation of its pressing part by the noise of the readings alone, N: what differs
    /// from frame to frame.
    pub noise: f64,
    /// Moment about the normal through the centre, N m, right-handed about z.
    /// The two others vanish: the centre is that of the normal force.
    pub torsion: f64,
    /// Largest weight in the region (normal force, N).
    pub peak: f64,
    /// Index of the taxel with the largest weight.
    pub peak_taxel: usize,
    /// The state of a taxel that gives no more than a bound (saturated, gap
    /// closed, out of range), if there is one: the force is a least force.
    pub bound: Option<State>,
    /// How much the force says: unknown once a taxel of the contact is uncertain.
    pub certainty: Certainty,
    /// Number of the contact, which stays with it over frames; 0 until its track
    /// is known.
    pub id: u64,
    /// Velocity of the contact, m/s; `NaN` until its track is known.
    pub velocity: [f64; 2],
}

impl Contact {
    /// Takes back what a force that is not exact does not say: of a bound the shear and the
    /// moment, of an unknown one all. On a device that `pulls` what is missing is no bound.
    pub(super) fn say_no_more(&mut self, components: usize, pulls: bool) {
        if pulls
            && self.certainty == Certainty::AtLeast
            && self.bound.is_none_or(|state| !state.is_bound())
        {
            self.certainty = Certainty::Unknown;
        }
        if self.certainty == Certainty::Exact {
            return;
        }
        if components == 3 {
            for axis in 0..2 {
                self.force[axis] = f64::NAN;
                self.force_covariance[axis] = [f64::NAN; 3];
            }
            self.torsion = f64::NAN;
        }
        if self.certainty == Certainty::Unknown {
            (self.force, self.torsion, self.peak) = ([f64::NAN; 3], f64::NAN, f64::NAN);
            self.force_covariance = [[f64::NAN; 3]; 3];
        }
    }
}

impl Default for Contact {
    /// No taxel.
    fn default() -> Self {
        Self {
            taxels: 0,
            area: 0.0,
            centre: [0.0; 2],
            covariance: [0.0; 3],
            force: [0.0; 3],
            force_covariance: [[0.0; 3]; 3],
            noise: f64::NAN,
            torsion: 0.0,
            peak: f64::NEG_INFINITY,
            peak_taxel: 0,
            bound: None,
            certainty: Certainty::Exact,
            id: 0,
            velocity: [f64::NAN; 2],
        }
    }
}

/// One taxel as contacts are found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// Position on the developed surface, m.
    pub position: [f64; 2],
    /// Normal force or value; `NaN` for none.
    pub weight: f64,
    /// Standard deviation of the weight.
    pub deviation: f64,
    /// Weight above which the cell is touched.
    pub threshold: f64,
    /// Force for the sum of the region.
    pub force: [f64; 3],
    /// Covariance of the force.
    pub force_covariance: [[f64; 3]; 3],
    /// Standard deviation of its pressing part by the noise of the readings alone.
    pub noise: f64,
    /// State of the value of the cell.
    pub state: State,
    /// How much its force says; unknown where the cell was touched when it was last known, and the
    /// weight is that of then.
    pub certainty: Certainty,
}

/// Covariance of a force that is a normal force only.
pub(super) fn normal_only(deviation: f64) -> [[f64; 3]; 3] {
    let mut covariance = [[0.0; 3]; 3];
    covariance[2][2] = deviation * deviation;
    covariance
}

/// A contact while it is gathered: first [`Gathering::add`] for all its cells,
/// then [`Gathering::settle`], then [`Gathering::add_about_centre`] and
/// [`Gathering::add_neighbour`].
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Gathering {
    pub(super) contact: Contact,
    weight: f64,
    /// Σwx, Σwy.
    moment: [f64; 2],
    /// Σσ²δδᵀ about the centre, xx, xy, yy.
    noise: [f64; 3],
    /// Σwδδ about the centre, along x and y.
    spread: [f64; 2],
    /// Cells whose force is known.
    known: usize,
    /// Variance of the pressing part by noise.
    by_noise: f64,
}

impl Gathering {
    pub(super) fn add(&mut self, index: usize, cell: &Cell) {
        self.weight += cell.weight;
        for axis in 0..2 {
            self.moment[axis] += cell.weight * cell.position[axis];
        }
        let contact = &mut self.contact;
        contact.taxels += 1;
        contact.certainty = contact.certainty.max(cell.certainty);
        if cell.certainty == Certainty::Unknown {
            contact.bound = Some(cell.state);
            if contact.taxels == 1 {
                contact.peak_taxel = index;
            }
            return;
        }
        self.known += 1;
        self.by_noise += cell.noise * cell.noise;
        if cell.weight > contact.peak {
            (contact.peak, contact.peak_taxel) = (cell.weight, index);
        }
        for (sum, force) in contact.force.iter_mut().zip(cell.force) {
            *sum += force;
        }
        let covariance = cell.force_covariance.iter().flatten();
        for (sum, value) in contact
            .force_covariance
            .iter_mut()
            .flatten()
            .zip(covariance)
        {
            *sum += value;
        }
        if cell.state.is_bound() {
            contact.bound = contact.bound.or(Some(cell.state));
        }
    }

    /// Fixes the centre.
    pub(super) fn settle(&mut self) {
        self.contact.centre = self.moment.map(|moment| moment / self.weight);
    }

    pub(super) fn add_about_centre(&mut self, cell: &Cell) {
        let [x, y] = self.offset(cell);
        self.add_noise(cell.deviation * cell.deviation, [x, y]);
        self.spread[0] += cell.weight * x * x;
        self.spread[1] += cell.weight * y * y;
        if cell.certainty != Certainty::Unknown {
            self.contact.torsion += x * cell.force[1] - y * cell.force[0];
        }
    }

    /// A neighbour that is not touched carries what it reads, which the centre leaves out; without a
    /// reading anything between nothing and its threshold.
    pub(super) fn add_neighbour(&mut self, cell: &Cell) {
        let offset = self.offset(cell);
        let read = cell.weight.powi(2) + cell.deviation.powi(2);
        let square = if read.is_nan() {
            cell.threshold.powi(2) / 12.0
        } else {
            read
        };
        self.add_noise(square, offset);
    }

    fn offset(&self, cell: &Cell) -> [f64; 2] {
        std::array::from_fn(|axis| cell.position[axis] - self.contact.centre[axis])
    }

    fn add_noise(&mut self, variance: f64, [x, y]: [f64; 2]) {
        for (sum, factor) in self.noise.iter_mut().zip([x * x, x * y, y * y]) {
            *sum += variance * factor;
        }
    }

    /// The contact on a grid of this pitch x, y, m.
    pub(super) fn finish(&self, pitch: [f64; 2]) -> Contact {
        let mut contact = self.contact;
        contact.noise = self.by_noise.sqrt();
        // What is left of a contact is a bound; nothing left says nothing.
        if contact.certainty == Certainty::Unknown && self.known > 0 {
            contact.certainty = Certainty::AtLeast;
        }
        contact.area = contact.taxels as f64 * pitch[0] * pitch[1];
        let square = self.weight * self.weight;
        contact.covariance = self.noise.map(|sum| sum / square);
        for (axis, entry) in [(0, 0), (1, 2)] {
            contact.covariance[entry] +=
                grid_variance(self.spread[axis] / self.weight, pitch[axis]);
        }
        contact
    }

    /// Sum of the weights.
    pub(super) fn weight(&self) -> f64 {
        self.weight
    }
}

/// Variance of a centre along one axis because cells of width `pitch` gather
/// the load, where the weights spread by the variance `spread` about it.
///
/// A cell gives no information on the position within it: a load on one cell may be
/// anywhere in it, p²/12. A load over the border of two cells is narrower than
/// they are and lies between the border and the centre of force: (p²/4 − s²)/3.
/// Of a wide load the error is the first harmonic of the grid,
/// (p/π) ĝ(2π/p) sin(2πx/p), with ĝ of a Hertzian pressure of radius a = √5 s,
/// |ĝ(u)|² ≤ 1/(1 + u⁴/9).
fn grid_variance(spread: f64, pitch: f64) -> f64 {
    let square = pitch * pitch;
    let narrow = (square / 4.0 - spread) / 3.0;
    let load = (spread - square / 12.0).max(0.0);
    let u = 20.0 * std::f64::consts::PI.powi(2) * load / square;
    narrow
        .min(square / 12.0)
        .max(square / 12.0 / (1.0 + u * u / 9.0))
}
