//! Where contacts may be, before their positions are refined: each in turn on a
//! coarse raster, beside the others.

use super::{COARSE, Fitted, OWN_CONTACT, ROUNDS, SEEDS, Scene, Shape, Trial, within};
use crate::estimation::position_fit::{OFFSETS, WINDOW};
use taxel_numerics::dense::{dot, remove_projections};

impl Scene<'_> {
    /// Prepares the raster: positions within a pitch of the elements that carry a
    /// force.
    pub(super) fn raster(&mut self) {
        let highest = self.forces.iter().copied().fold(0.0, f64::max);
        let pairs = self.elements.iter().zip(self.forces);
        let near = pairs.filter(|(_, force)| **force > OWN_CONTACT * highest);
        let near: Vec<[f64; 2]> = near.map(|(at, _)| *at).collect();
        let close = |at: &[f64; 2]| near.iter().any(|one| within(*one, *at, WINDOW as f64));
        let [right, up, _] = self.limits();
        let steps = |last: f64| {
            (0..=last as usize)
                .step_by(COARSE[0])
                .map(|step| step as f64)
        };
        let positions = steps(right).flat_map(|x| steps(up).map(move |y| [x, y]));
        let positions: Vec<[f64; 2]> = positions.filter(close).collect();
        for size in (0..self.tables.len()).step_by(COARSE[1]) {
            for at in &positions {
                let row = self.on_grid(*at, size);
                let shape = Shape {
                    at: *at,
                    size: size as f64,
                    force: 0.0,
                };
                self.raster.push(Trial { shape, row });
            }
        }
    }

    /// Shares over the deviations at a whole step and size.
    fn on_grid(&self, at: [f64; 2], size: usize) -> Vec<f64> {
        let pairs = self.elements.iter().zip(&self.roots);
        pairs
            .map(|(element, root)| {
                let [x, y] = [0, 1].map(|axis| (element[axis] - at[axis]).abs() as usize);
                let inside = x < OFFSETS && y < OFFSETS;
                if inside {
                    root * self.tables[size][x * OFFSETS + y]
                } else {
                    0.0
                }
            })
            .collect()
    }

    /// One contact, begun at the best position of each size.
    pub(super) fn one(&self) -> Fitted {
        let mut best: Option<Fitted> = None;
        for size in (0..self.tables.len()).step_by(COARSE[1]) {
            let of_size = |shape: &Shape| shape.size == size as f64;
            let begin = self.beside(&[], &of_size);
            let fitted = self.refined(begin.into_iter().collect());
            if best.as_ref().is_none_or(|best| fitted.misfit < best.misfit) {
                best = Some(fitted);
            }
        }
        best.unwrap_or_else(|| self.refined(Vec::new()))
    }

    /// The contact of the raster, among those that `may` be, that lowers the
    /// misfit most beside `others`, whose forces are free.
    fn beside(&self, others: &[Shape], may: &dyn Fn(&Shape) -> bool) -> Option<Shape> {
        // The others span what they can explain.
        let mut basis: Vec<Vec<f64>> = Vec::with_capacity(others.len());
        for other in others {
            let mut row = self.weighed(other.at, other.size);
            remove_projections(&mut row, &basis);
            let length = dot(&row, &row).sqrt();
            if length > 1e-9 {
                for value in &mut row {
                    *value /= length;
                }
                basis.push(row);
            }
        }
        let mut left = self.weighted.clone();
        remove_projections(&mut left, &basis);
        let mut best: Option<(f64, Shape)> = None;
        for Trial { shape, row } in &self.raster {
            if !may(shape) {
                continue;
            }
            let explained: f64 = basis.iter().map(|one| dot(one, row).powi(2)).sum();
            let (cross, square) = (dot(&left, row), dot(row, row) - explained);
            let gain = cross * cross / square;
            if cross > 0.0 && square > 0.0 && best.is_none_or(|(most, _)| gain > most) {
                let force = cross / square;
                best = Some((gain, Shape { force, ..*shape }));
            }
        }
        best.map(|(_, shape)| shape)
    }

    /// Fits of one contact more, begun at the elements where most force is
    /// left, the best first.
    pub(super) fn one_more(&self, found: &Fitted) -> Vec<Fitted> {
        let left = self.residuals(&found.shapes);
        let mut seeds: Vec<usize> = (0..left.len()).collect();
        seeds.sort_by(|a, b| left[*b].total_cmp(&left[*a]));
        let mut fits: Vec<Fitted> = Vec::new();
        for seed in seeds.into_iter().take(SEEDS) {
            let mut shapes = found.shapes.clone();
            let middle = self.elements[seed];
            let near = |one: &Shape| within(one.at, middle, 0.5 * WINDOW as f64);
            shapes.extend(self.beside(&shapes, &near));
            for _ in 0..ROUNDS {
                for index in 0..shapes.len() {
                    let own = shapes.remove(index);
                    let near = |one: &Shape| within(one.at, own.at, WINDOW as f64);
                    shapes.insert(index, self.beside(&shapes, &near).unwrap_or(own));
                }
            }
            let fitted = self.refined(shapes);
            if fitted.shapes.len() > found.shapes.len() {
                fits.push(fitted);
            }
        }
        let misfit = |a: &Fitted, b: &Fitted| a.misfit.total_cmp(&b.misfit);
        if let Some(best) = fits.iter().min_by(|a, b| misfit(a, b)).cloned() {
            fits.extend(self.other_sizes(&best));
        }
        fits.sort_by(misfit);
        fits.dedup_by(|a, b| (a.misfit - b.misfit).abs() < 1e-2);
        fits
    }
    /// The same contacts with one of another size, each begun at its best position
    /// beside the others: a small contact further off may do what a large one
    /// does.
    pub(super) fn other_sizes(&self, found: &Fitted) -> Vec<Fitted> {
        let mut fits = Vec::new();
        for own in 0..found.shapes.len() {
            let mut others = found.shapes.clone();
            let one = others.remove(own);
            for size in (0..self.tables.len()).step_by(COARSE[1]) {
                let may = |shape: &Shape| {
                    shape.size == size as f64 && within(shape.at, one.at, WINDOW as f64)
                };
                let Some(begin) = self.beside(&others, &may) else {
                    continue;
                };
                let mut shapes = others.clone();
                shapes.insert(own, begin);
                fits.push(self.refined(shapes));
            }
        }
        fits
    }
}
