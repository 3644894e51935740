//! Division of an axis into cells, graded towards its breakpoints.

use super::error::{MeshError, in_range};

/// Most cells on one interval of an axis.
const MOST_CELLS: usize = 100_000;

/// Cells that grow away from a smallest one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Growth {
    /// Size of the smallest cell, in the unit of the axis; it may come out smaller, never larger.
    pub smallest: f64,
    /// Largest ratio of neighbours, 1 to 2.
    pub ratio: f64,
    /// Size that no cell exceeds, in the unit of the axis.
    pub largest: f64,
}

impl Growth {
    /// Cells that double from one to the next, without a largest size.
    pub fn doubling(smallest: f64) -> Self {
        Self {
            smallest,
            ratio: 2.0,
            largest: f64::INFINITY,
        }
    }
}

/// Division of one interval between two breakpoints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Grading {
    /// So many cells of equal size.
    Uniform(usize),
    /// Cells that grow from the start of the interval.
    FromStart(Growth),
    /// Cells that grow from the end of the interval.
    FromEnd(Growth),
    /// Cells that grow from both ends to the middle.
    FromBoth(Growth),
}

/// An axis of a grid: rising positions of the faces of its cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    positions: Vec<f64>,
    /// Numbers of the positions that are breakpoints.
    breakpoints: Vec<usize>,
}

impl Axis {
    /// An axis from rising breakpoints with a grading for each interval between them.
    ///
    /// # Errors
    /// [`MeshError::Gradings`], [`MeshError::Interval`], [`MeshError::OutOfRange`],
    /// [`MeshError::TooManyCells`].
    ///
    /// # Example
    /// ```
    /// use taxel_fem::mesh::{Axis, Grading, Growth};
    /// let towards_two = Grading::FromEnd(Growth::doubling(0.25));
    /// let axis = Axis::new(&[0.0, 2.0, 3.0], &[towards_two, Grading::Uniform(2)])?;
    /// assert_eq!(axis.positions().len(), 4 + 2 + 1);
    /// # Ok::<(), taxel_fem::mesh::MeshError>(())
    /// ```
    pub fn new(breakpoints: &[f64], gradings: &[Grading]) -> Result<Self, MeshError> {
        if breakpoints.len() < 2 || gradings.len() + 1 != breakpoints.len() {
            return Err(MeshError::Gradings {
                breakpoints: breakpoints.len(),
                gradings: gradings.len(),
            });
        }
        let mut axis = Self {
            positions: vec![breakpoints[0]],
            breakpoints: vec![0],
        };
        for (interval, (ends, grading)) in breakpoints.windows(2).zip(gradings).enumerate() {
            let (start, end) = (ends[0], ends[1]);
            if !(start.is_finite() && end.is_finite() && start < end) {
                return Err(MeshError::Interval {
                    interval,
                    start,
                    end,
                });
            }
            let sizes = grading.sizes(end - start)?;
            let mut position = start;
            for size in &sizes[..sizes.len() - 1] {
                position += size;
                axis.positions.push(position);
            }
            axis.positions.push(end);
            let first = axis.breakpoints[interval];
            if !axis.positions[first..].windows(2).all(|w| w[0] < w[1]) {
                // The cells are finer than the digits of their places.
                return Err(MeshError::Interval {
                    interval,
                    start,
                    end,
                });
            }
            axis.breakpoints.push(axis.positions.len() - 1);
        }
        Ok(axis)
    }

    /// An axis of equal cells.
    ///
    /// # Errors
    /// As [`Axis::new`].
    pub fn uniform(start: f64, end: f64, cells: usize) -> Result<Self, MeshError> {
        Self::new(&[start, end], &[Grading::Uniform(cells)])
    }

    /// Faces of the cells, rising.
    pub fn positions(&self) -> &[f64] {
        &self.positions
    }

    /// Number of cells.
    pub fn cell_count(&self) -> usize {
        self.positions.len() - 1
    }

    /// Number of the position of the breakpoint at `value`, or the nearest breakpoint.
    ///
    /// A billionth of the length is forgiven: limits are often sums of others.
    pub(super) fn breakpoint(&self, value: f64) -> Result<usize, f64> {
        let distance = |&index: &usize| (self.positions[index] - value).abs();
        let nearest = self
            .breakpoints
            .iter()
            .copied()
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
            .unwrap_or_default();
        let length = self.positions[self.cell_count()] - self.positions[0];
        if distance(&nearest) <= 1e-9 * length {
            Ok(nearest)
        } else {
            Err(self.positions[nearest])
        }
    }
}

impl Grading {
    /// The division of the mirrored interval.
    #[must_use]
    pub fn mirrored(self) -> Self {
        match self {
            Self::FromStart(growth) => Self::FromEnd(growth),
            Self::FromEnd(growth) => Self::FromStart(growth),
            other => other,
        }
    }

    /// Sizes of the cells on an interval of this length.
    fn sizes(self, length: f64) -> Result<Vec<f64>, MeshError> {
        match self {
            Self::Uniform(count) => {
                in_range("number of cells", count as f64, 1.0, MOST_CELLS as f64)?;
                Ok(vec![length / count as f64; count])
            }
            Self::FromStart(growth) => growth.sizes(length),
            Self::FromEnd(growth) => {
                let mut sizes = growth.sizes(length)?;
                sizes.reverse();
                Ok(sizes)
            }
            Self::FromBoth(growth) => {
                let mut sizes = growth.sizes(length / 2.0)?;
                if sizes.len() == 1 && growth.smallest >= length {
                    return Ok(vec![length]);
                }
                let second: Vec<f64> = sizes.iter().rev().copied().collect();
                sizes.extend(second);
                Ok(sizes)
            }
        }
    }
}

impl Growth {
    /// Fewest growing cells that fill the length, the first of the smallest size.
    fn sizes(self, length: f64) -> Result<Vec<f64>, MeshError> {
        let least = length / MOST_CELLS as f64;
        in_range("smallest cell", self.smallest, least, f64::INFINITY)?;
        in_range("growth of cells", self.ratio, 1.0, 2.0)?;
        in_range("largest cell", self.largest, self.smallest, f64::INFINITY)?;
        let mut count = 0;
        let mut covered = 0.0;
        // A billionth is forgiven, so that no cell is added for rounding.
        while covered < length * (1.0 - 1e-9) {
            covered += self.size(count, self.ratio);
            count += 1;
        }
        if count as f64 * self.smallest >= length {
            // Even equal cells fill the length: none needs to grow.
            return Ok(vec![length / count as f64; count]);
        }
        let total = |ratio: f64| (0..count).map(|k| self.size(k, ratio)).sum::<f64>();
        let (mut low, mut high) = (1.0, self.ratio);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if total(middle) < length {
                low = middle;
            } else {
                high = middle;
            }
        }
        Ok((0..count).map(|k| self.size(k, high)).collect())
    }

    fn size(self, cell: usize, ratio: f64) -> f64 {
        (self.smallest * ratio.powf(cell as f64)).min(self.largest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn sizes(axis: &Axis) -> Vec<f64> {
        axis.positions().windows(2).map(|w| w[1] - w[0]).collect()
    }

    #[test]
    fn doubling_cells_fill_a_length_of_seven() {
        let grading = Grading::FromStart(Growth::doubling(1.0));
        let axis = Axis::new(&[0.0, 7.0], &[grading]).unwrap();
        for (size, expected) in sizes(&axis).iter().zip([1.0, 2.0, 4.0]) {
            assert!((size - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn wrong_descriptions_are_refused() {
        let uniform = Grading::Uniform(2);
        let of = |growth: Growth| Axis::new(&[0.0, 1.0], &[Grading::FromStart(growth)]);
        assert!(matches!(
            Axis::new(&[0.0, 1.0], &[uniform, uniform]),
            Err(MeshError::Gradings {
                breakpoints: 2,
                gradings: 2
            })
        ));
        assert!(matches!(
            Axis::new(&[0.0, 1.0, 1.0], &[uniform, uniform]),
            Err(MeshError::Interval { interval: 1, .. })
        ));
        assert!(Axis::new(&[0.0, f64::NAN], &[uniform]).is_err());
        assert!(Axis::uniform(1e16, 1e16 + 4.0, 8).is_err());
        assert!(Axis::uniform(0.0, 1.0, 0).is_err());
        for smallest in [0.0, -1.0, 1e-9, f64::NAN] {
            assert!(of(Growth::doubling(smallest)).is_err(), "{smallest}");
        }
        let fast = Growth {
            ratio: 2.5,
            ..Growth::doubling(0.1)
        };
        assert!(matches!(
            of(fast),
            Err(MeshError::OutOfRange {
                value: 2.5,
                high: 2.0,
                ..
            })
        ));
        let capped = Growth {
            largest: 0.05,
            ..Growth::doubling(0.1)
        };
        assert!(of(capped).is_err());
    }

    proptest! {
        #[test]
        fn graded_cells_fill_the_interval_within_their_limits(
            start in -5.0..5.0_f64,
            length in 0.01..100.0_f64,
            part in 1e-4..2.0_f64,
            ratio in 1.0..2.0_f64,
            cap in 1.0..50.0_f64,
            both in any::<bool>(),
        ) {
            let smallest = part * length;
            let growth = Growth { smallest, ratio, largest: cap * smallest };
            let grading = if both { Grading::FromBoth(growth) } else { Grading::FromStart(growth) };
            let axis = Axis::new(&[start, start + length], &[grading]).unwrap();
            let sizes = sizes(&axis);
            let rounding = 1e-12 * (start.abs() + length);
            prop_assert_eq!(axis.positions()[axis.cell_count()], start + length);
            prop_assert!(sizes[0] <= smallest + rounding);
            for pair in sizes.windows(2) {
                prop_assert!(pair[1] <= pair[0] * ratio + 4.0 * rounding);
                prop_assert!(both || pair[1] >= pair[0] - 4.0 * rounding);
            }
            for size in &sizes {
                prop_assert!(*size <= cap * smallest + rounding && *size > 0.0);
            }
        }
    }
}
