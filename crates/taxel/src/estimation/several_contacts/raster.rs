//! Where contacts may be, before their positions are refined: each in turn on a
//! coarse raster, beside the others.

use super::{COARSE, Fitted, OWN_CONTACT, ROUNDS, SEEDS, Scene, Shape, within};
use crate::estimation::position_fit::{OFFSETS, WINDOW};
use taxel_numerics::dense::{dot, remove_projections};

/// Positions within a pitch of the elements that carry a force, each with contacts of
/// some of the sizes.
pub(super) struct Raster {
    sizes: Vec<f64>,
    /// Offsets of the table along one axis.
    offsets: usize,
    /// Shares of all sizes at each offset.
    table: Vec<f64>,
    places: Vec<Place>,
}

/// A position of the raster.
struct Place {
    at: [f64; 2],
    /// For each size, the product of its shares with the forces, and with themselves.
    products: Vec<[f64; 2]>,
}

impl Raster {
    pub(super) fn new(scene: &Scene<'_>) -> Self {
        let sizes = || (0..scene.tables.len()).step_by(COARSE[1]);
        let steps = || (0..OFFSETS).step_by(COARSE[0]);
        let offsets = steps().flat_map(|i| steps().map(move |j| i * OFFSETS + j));
        let shares = |offset| sizes().map(move |size| scene.tables[size][offset]);
        let mut raster = Self {
            sizes: sizes().map(|size| size as f64).collect(),
            offsets: steps().count(),
            table: offsets.flat_map(shares).collect(),
            places: Vec::new(),
        };
        let highest = scene.forces.iter().copied().fold(0.0, f64::max);
        let pairs = scene.elements.iter().zip(scene.forces);
        let near = pairs.filter(|(_, force)| **force > OWN_CONTACT * highest);
        let near: Vec<[f64; 2]> = near.map(|(at, _)| *at).collect();
        let close = |at: &[f64; 2]| near.iter().any(|one| within(*one, *at, WINDOW as f64));
        let [right, up, _] = scene.limits();
        let steps = |last: f64| {
            let steps = (0..=last as usize).step_by(COARSE[0]);
            steps.map(|step| step as f64)
        };
        let positions = steps(right).flat_map(|x| steps(up).map(move |y| [x, y]));
        for at in positions.filter(close) {
            let mut products = vec![[0.0; 2]; raster.sizes.len()];
            let weights = scene.roots.iter().zip(&scene.weighted);
            for ((root, force), element) in weights.zip(&scene.elements) {
                for ([cross, square], share) in products.iter_mut().zip(raster.shares(at, *element))
                {
                    let row = share * root;
                    *cross += row * force;
                    *square += row * row;
                }
            }
            raster.places.push(Place { at, products });
        }
        raster
    }

    /// Shares on an element of contacts of all sizes at a position.
    fn shares(&self, at: [f64; 2], element: [f64; 2]) -> &[f64] {
        let [x, y] = [0, 1].map(|axis| (element[axis] - at[axis]).abs() as usize / COARSE[0]);
        if x.max(y) < self.offsets {
            &self.table[(x * self.offsets + y) * self.sizes.len()..][..self.sizes.len()]
        } else {
            &[]
        }
    }
}

impl Scene<'_> {
    /// One contact, begun at the best position of each size.
    pub(super) fn one(&self, raster: &Raster) -> Fitted {
        let begin = self.beside(raster, &[], &|_| true);
        let fits = begin.iter().map(|(_, shape)| self.refined(vec![*shape]));
        let best = fits.min_by(|a, b| a.misfit.total_cmp(&b.misfit));
        best.unwrap_or_else(|| self.refined(Vec::new()))
    }

    /// The contact of each size that lowers the misfit most beside `others`, whose forces
    /// are free, of those that `may` be at their positions; with what it lowers it by.
    fn beside(
        &self,
        raster: &Raster,
        others: &[Shape],
        may: &dyn Fn([f64; 2]) -> bool,
    ) -> Vec<(f64, Shape)> {
        // The others span what they can explain.
        let mut basis: Vec<Vec<f64>> = Vec::with_capacity(others.len());
        for other in others {
            let mut row = self.weighed(other);
            remove_projections(&mut row, &basis);
            let length = dot(&row, &row).sqrt();
            if length > 1e-9 {
                for value in &mut row {
                    *value /= length;
                }
                basis.push(row);
            }
        }
        let explained: Vec<f64> = basis.iter().map(|one| dot(one, &self.weighted)).collect();
        for row in &mut basis {
            for (value, root) in row.iter_mut().zip(&self.roots) {
                *value *= root;
            }
        }
        let mut best: Vec<Option<(f64, Shape)>> = vec![None; raster.sizes.len()];
        let mut left = vec![[0.0; 2]; raster.sizes.len()];
        let mut along = vec![0.0; raster.sizes.len()];
        for place in raster.places.iter().filter(|place| may(place.at)) {
            left.copy_from_slice(&place.products);
            for (row, explained) in basis.iter().zip(&explained) {
                along.fill(0.0);
                for (value, element) in row.iter().zip(&self.elements) {
                    for (sum, share) in along.iter_mut().zip(raster.shares(place.at, *element)) {
                        *sum += value * share;
                    }
                }
                for ([cross, square], along) in left.iter_mut().zip(&along) {
                    *cross -= explained * along;
                    *square -= along * along;
                }
            }
            let sizes = raster.sizes.iter().zip(&left);
            for ((size, [cross, square]), best) in sizes.zip(&mut best) {
                let gain = cross * cross / square;
                let more = best.is_none_or(|(most, _)| gain > most);
                if *cross > 0.0 && *square > 0.0 && more {
                    let shape = Shape {
                        at: place.at,
                        size: *size,
                        force: cross / square,
                    };
                    *best = Some((gain, shape));
                }
            }
        }
        best.into_iter().flatten().collect()
    }

    /// Fits of one contact more, begun at the elements where most force is
    /// left, the best first.
    pub(super) fn one_more(&self, raster: &Raster, found: &Fitted) -> Vec<Fitted> {
        let best = |others: &[Shape], may: &dyn Fn([f64; 2]) -> bool| {
            let of_sizes = self.beside(raster, others, may).into_iter();
            let best = of_sizes.max_by(|(a, _), (b, _)| a.total_cmp(b));
            best.map(|(_, shape)| shape)
        };
        let left = self.residuals(&found.shapes);
        let mut seeds: Vec<usize> = (0..left.len()).collect();
        seeds.sort_by(|a, b| left[*b].total_cmp(&left[*a]));
        let mut starts: Vec<Vec<Shape>> = Vec::new();
        for seed in seeds.into_iter().take(SEEDS) {
            let mut shapes = found.shapes.clone();
            let middle = self.elements[seed];
            shapes.extend(best(&shapes, &|at| within(at, middle, 0.5 * WINDOW as f64)));
            for _ in 0..ROUNDS {
                for index in 0..shapes.len() {
                    let own = shapes.remove(index);
                    let moved = best(&shapes, &|at| within(at, own.at, WINDOW as f64));
                    shapes.insert(index, moved.unwrap_or(own));
                }
            }
            if shapes.len() > found.shapes.len() && !starts.contains(&shapes) {
                starts.push(shapes);
            }
        }
        let mut fits: Vec<Fitted> = starts.into_iter().map(|one| self.refined(one)).collect();
        let misfit = |a: &Fitted, b: &Fitted| a.misfit.total_cmp(&b.misfit);
        if let Some(best) = fits.iter().min_by(|a, b| misfit(a, b)).cloned() {
            fits.extend(self.other_sizes(raster, &best));
        }
        fits.sort_by(misfit);
        fits.dedup_by(|a, b| (a.misfit - b.misfit).abs() < 1e-2);
        fits
    }

    /// The same contacts with one of another size, each begun at its best position
    /// beside the others: a small contact further off may do what a large one
    /// does.
    fn other_sizes(&self, raster: &Raster, found: &Fitted) -> Vec<Fitted> {
        let mut fits = Vec::new();
        for own in 0..found.shapes.len() {
            let mut others = found.shapes.clone();
            let one = others.remove(own);
            let near = |at| within(at, one.at, WINDOW as f64);
            for (_, begin) in self.beside(raster, &others, &near) {
                let mut shapes = others.clone();
                shapes.insert(own, begin);
                fits.push(self.refined(shapes));
            }
        }
        fits
    }
}
