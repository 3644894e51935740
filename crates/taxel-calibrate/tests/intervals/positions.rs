//! Positions of contacts below a soft cover, each on another device.

use std::sync::{Arc, LazyLock};

use crate::tally::{Case, Printed};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use taxel::estimation::{ELLIPSE_95, Localiser, Located, ProfileFit, ProfileModel};
use taxel::mechanics::ShareTable;
use taxel::sensor::Sensor;

/// Noise over the highest force.
const NOISE: f64 = 0.002;
/// Radii of lone contacts, m.
const RADII: [f64; 5] = [1.5e-3, 2.3e-3, 2.9e-3, 3.6e-3, 5e-3];
/// Radius and distance of pairs, m.
const PAIRS: [[f64; 2]; 6] = [
    [2.3e-3, 6e-3],
    [2.3e-3, 9e-3],
    [2.3e-3, 12e-3],
    [3.6e-3, 6e-3],
    [3.6e-3, 9e-3],
    [3.6e-3, 12e-3],
];
/// A lone contact is placed for a radius that is not known, all being as likely on a
/// logarithmic scale; of one small radius the ellipses hold fewer.
const REACHED: f64 = 0.87;

/// Contacts of one size on an array whose gains are anew in each trial.
struct Array {
    fit: Arc<ProfileFit>,
    elements: Vec<[f64; 2]>,
    table: ShareTable,
}

impl Array {
    fn new(fit: &Arc<ProfileFit>, radius: f64) -> Self {
        Self {
            elements: fit.model().centroid().positions,
            table: fit.model().cover(radius).table(),
            fit: fit.clone(),
        }
    }

    /// Anywhere over the elements.
    fn anywhere(&self, random: &mut ChaCha8Rng) -> [f64; 2] {
        [0, 1].map(|axis| self.elements[0][axis].abs() * random.random_range(-1.0..1.0))
    }

    /// Two positions so far apart.
    fn pair(&self, distance: f64, random: &mut ChaCha8Rng) -> [[f64; 2]; 2] {
        let [x, y] = self.elements[0].map(f64::abs);
        loop {
            let one = self.anywhere(random);
            let turn = random.random_range(0.0..std::f64::consts::TAU);
            let other = [
                one[0] + distance * turn.cos(),
                one[1] + distance * turn.sin(),
            ];
            if other[0].abs() < x && other[1].abs() < y {
                return [one, other];
            }
        }
    }

    /// Contacts that are found for contacts of some forces, N.
    fn found(&self, contacts: &[([f64; 2], f64)], random: &mut ChaCha8Rng) -> Vec<Located> {
        let model = self.fit.model();
        let force = |at: &[f64; 2]| -> f64 {
            let offset = |centre: &[f64; 2]| [centre[0] - at[0], centre[1] - at[1]];
            let carried = contacts
                .iter()
                .map(|(centre, force)| force * self.table.share(offset(centre), model.side));
            carried.sum()
        };
        let exact: Vec<f64> = self.elements.iter().map(force).collect();
        let sigma = NOISE * exact.iter().copied().fold(0.0, f64::max);
        let mut normal = || random.sample::<f64, _>(StandardNormal);
        let read = |force: &f64| force * (1.0 + model.gain_deviation * normal()) + sigma * normal();
        let forces: Vec<f64> = exact.iter().map(read).collect();
        self.fit.positions(&forces, &vec![sigma; forces.len()])
    }
}

/// The shipped array, or one with so many elements.
fn fit(cells: Option<[usize; 2]>) -> Arc<ProfileFit> {
    let sensor = Sensor::shipped("piezo-1.5mm").unwrap();
    let model = sensor.piezoelectric().unwrap().profile_model();
    let [rows, columns] = cells.unwrap_or([model.rows, model.columns]);
    let model = ProfileModel {
        rows,
        columns,
        ..model
    };
    Arc::new(ProfileFit::new(model).unwrap())
}

/// The shipped array, and a larger one.
static SHIPPED: LazyLock<Arc<ProfileFit>> = LazyLock::new(|| fit(None));
static LARGE: LazyLock<Arc<ProfileFit>> = LazyLock::new(|| fit(Some([4, 6])));

pub(crate) fn all() -> Vec<Case> {
    let mut all: Vec<Case> = RADII.map(lone).into();
    all.push(any_size());
    all.extend(PAIRS.map(|pair| two("P3, pair on 2 x 4 elements", true, &SHIPPED, pair)));
    all.extend(PAIRS.map(|pair| two("P3, pair on 4 x 6 elements", false, &LARGE, pair)));
    all
}

fn lone(radius: f64) -> Case {
    let array = LazyLock::new(move || Array::new(&SHIPPED, radius));
    let name = format!("ellipse, radius {:.1} mm", radius * 1e3);
    let run = move |seed: u64| -> Vec<Printed> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        one(&array, &name, &mut random).into_iter().collect()
    };
    Case {
        name: "P3, lone contact",
        short: true,
        reached: REACHED,
        run: Box::new(run),
    }
}

/// A contact of the sizes that are expected: as likely on a logarithmic scale from the smallest
/// to the largest.
fn any_size() -> Case {
    let run = move |seed: u64| -> Vec<Printed> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let radii = &SHIPPED.model().radii;
        let (least, most) = (radii[0], radii[radii.len() - 1]);
        let radius = least * (most / least).powf(random.random::<f64>());
        let array = Array::new(&SHIPPED, radius);
        one(&array, "ellipse, any radius", &mut random)
            .into_iter()
            .collect()
    };
    Case {
        name: "P3, lone contact of any size",
        short: false,
        reached: 1.0,
        run: Box::new(run),
    }
}

/// Whether the ellipse of one contact holds it, where it has one.
fn one(array: &Array, name: &str, random: &mut ChaCha8Rng) -> Option<Printed> {
    let at = array.anywhere(random);
    let found = array.found(&[(at, 1.0)], random);
    let [located] = &found[..] else { return None };
    Some((name.to_owned(), located.position?.distance(at) < ELLIPSE_95))
}

/// Contacts of 0.5 and 1 N, as far as they are found as two, each against the one that it
/// is nearest to.
fn two(
    name: &'static str,
    short: bool,
    fit: &'static LazyLock<Arc<ProfileFit>>,
    [radius, distance]: [f64; 2],
) -> Case {
    let array = LazyLock::new(move || Array::new(fit, radius));
    let run = move |seed: u64| -> Vec<Printed> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let [one, other] = array.pair(distance, &mut random);
        let found = array.found(&[(one, 0.5), (other, 1.0)], &mut random);
        if found.len() != 2 {
            return Vec::new();
        }
        let far = |found: &Located, at: [f64; 2]| {
            let from = found.position.map(|position| position.centre);
            from.map_or(0.0, |from| (from[0] - at[0]).hypot(from[1] - at[1]))
        };
        let straight = far(&found[0], one) + far(&found[1], other);
        let crossed = far(&found[0], other) + far(&found[1], one);
        let truth = if straight <= crossed {
            [one, other]
        } else {
            [other, one]
        };
        let [radius, distance] = [radius, distance].map(|length| length * 1e3);
        let name = format!("ellipse, radius {radius:.1} mm, {distance:.0} mm apart");
        let pairs = found.iter().zip(truth);
        pairs
            .filter_map(|(found, at)| {
                Some((name.clone(), found.position?.distance(at) < ELLIPSE_95))
            })
            .collect()
    };
    Case {
        name,
        short,
        reached: 1.0,
        run: Box::new(run),
    }
}
