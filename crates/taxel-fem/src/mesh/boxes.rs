//! Pairs of boxes that meet, found by halving.

/// Least and greatest coordinates.
pub(super) type Bounds = [[f64; 3]; 2];

/// Boxes in a half that are compared one by one: halving fewer costs more than it saves.
const FEW: usize = 8;

/// The box around some points.
pub(super) fn bounds(points: impl IntoIterator<Item = [f64; 3]>) -> Bounds {
    let nothing = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    points.into_iter().fold(nothing, |[low, high], point| {
        let at = |d: usize| (low[d].min(point[d]), high[d].max(point[d]));
        let ends = [at(0), at(1), at(2)];
        [ends.map(|end| end.0), ends.map(|end| end.1)]
    })
}

fn meet([low, high]: &Bounds, [other_low, other_high]: &Bounds) -> bool {
    (0..3).all(|d| low[d] <= other_high[d] && other_low[d] <= high[d])
}

/// Calls `each` with the numbers of each two boxes that meet, the lower first, once.
pub(super) fn pairs(boxes: &[Bounds], mut each: impl FnMut(usize, usize)) {
    let mut order: Vec<usize> = (0..boxes.len()).collect();
    let whole = Half::new(boxes, &mut order);
    whole.within(boxes, &mut each);
}

/// Boxes with the box around them, and their halves.
struct Half<'a> {
    around: Bounds,
    boxes: &'a [usize],
    halves: Option<Box<[Self; 2]>>,
}

impl<'a> Half<'a> {
    fn new(all: &[Bounds], boxes: &'a mut [usize]) -> Self {
        let around = bounds(boxes.iter().flat_map(|&number| all[number]));
        if boxes.len() <= FEW {
            return Self {
                around,
                boxes,
                halves: None,
            };
        }
        let width = |d: &usize| around[1][*d] - around[0][*d];
        let axis = (0..3)
            .max_by(|a, b| width(a).total_cmp(&width(b)))
            .unwrap_or(0);
        let middle = |number: &usize| all[*number][0][axis] + all[*number][1][axis];
        let half = boxes.len() / 2;
        boxes.select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)));
        let (first, second) = boxes.split_at_mut(half);
        Self {
            around,
            halves: Some(Box::new([Self::new(all, first), Self::new(all, second)])),
            boxes: &[],
        }
    }

    fn within(&self, all: &[Bounds], each: &mut impl FnMut(usize, usize)) {
        if let Some(halves) = &self.halves {
            let [first, second] = halves.as_ref();
            first.within(all, each);
            second.within(all, each);
            first.between(second, all, each);
        }
        for (at, &one) in self.boxes.iter().enumerate() {
            for &other in self.boxes[..at]
                .iter()
                .filter(|&&other| meet(&all[one], &all[other]))
            {
                each(one.min(other), one.max(other));
            }
        }
    }

    fn between(&self, other: &Self, all: &[Bounds], each: &mut impl FnMut(usize, usize)) {
        if !meet(&self.around, &other.around) {
            return;
        }
        match (&self.halves, &other.halves) {
            (Some(halves), _) => halves
                .iter()
                .for_each(|half| half.between(other, all, each)),
            (None, Some(halves)) => halves.iter().for_each(|half| self.between(half, all, each)),
            (None, None) => {
                for &one in self.boxes {
                    for &two in other
                        .boxes
                        .iter()
                        .filter(|&&two| meet(&all[one], &all[two]))
                    {
                        each(one.min(two), one.max(two));
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn pairs_are_those_that_meet(
            boxes in prop::collection::vec(prop::array::uniform3((-9_i32..9, 0_i32..5)), 0..60)
        ) {
            let boxes: Vec<Bounds> = boxes
                .iter()
                .map(|sides| [sides.map(|(low, _)| f64::from(low)), sides.map(|(low, size)| f64::from(low + size))])
                .collect();
            let mut found = Vec::new();
            pairs(&boxes, |one, other| found.push((one, other)));
            found.sort_unstable();
            let mut all = Vec::new();
            for one in 0..boxes.len() {
                let others = (one + 1..boxes.len()).filter(|&other| meet(&boxes[one], &boxes[other]));
                all.extend(others.map(|other| (one, other)));
            }
            prop_assert_eq!(found, all);
        }
    }
}
