//! Least squares and minima of functions.

/// The minimum of a function by the simplex of Nelder and Mead. It ends where its corners differ by
/// less than a relative tolerance, or all lie below a floor.
pub(crate) fn simplex(
    start: &[f64],
    sizes: &[f64],
    (tolerance, floor): (f64, f64),
    value: &dyn Fn(&[f64]) -> f64,
) -> (Vec<f64>, f64) {
    let count = start.len();
    let mut corners: Vec<(Vec<f64>, f64)> = vec![(start.to_vec(), value(start))];
    for (place, size) in sizes.iter().enumerate() {
        let mut corner = start.to_vec();
        corner[place] += size;
        let at = value(&corner);
        corners.push((corner, at));
    }
    let sort = |corners: &mut Vec<(Vec<f64>, f64)>| {
        corners.sort_by(|one, other| one.1.total_cmp(&other.1));
    };
    sort(&mut corners);
    // Each turn replaces the worst corner; 200 for each constant take any start to the rounding.
    for _ in 0..200 * count {
        let (best, worst) = (corners[0].1, corners[count].1);
        if worst - best <= tolerance * best.abs() || worst <= floor {
            break;
        }
        let middle: Vec<f64> = (0..count)
            .map(|place| corners[..count].iter().map(|(x, _)| x[place]).sum::<f64>() / count as f64)
            .collect();
        let away = |factor: f64| {
            let worst = &corners[count].0;
            let x: Vec<f64> = middle
                .iter()
                .zip(worst)
                .map(|(middle, worst)| middle + factor * (middle - worst))
                .collect();
            let at = value(&x);
            (x, at)
        };
        let reflected = away(1.0);
        let next = if reflected.1 < best {
            let further = away(2.0);
            Some(if further.1 < reflected.1 {
                further
            } else {
                reflected
            })
        } else if reflected.1 < corners[count - 1].1 {
            Some(reflected)
        } else {
            let nearer = if reflected.1 < worst {
                away(0.5)
            } else {
                away(-0.5)
            };
            (nearer.1 < worst.min(reflected.1)).then_some(nearer)
        };
        if let Some(next) = next {
            corners[count] = next;
        } else {
            let best = corners[0].0.clone();
            for corner in &mut corners[1..] {
                for (x, best) in corner.0.iter_mut().zip(&best) {
                    *x = f64::midpoint(*x, *best);
                }
                corner.1 = value(&corner.0);
            }
        }
        sort(&mut corners);
    }
    corners.swap_remove(0)
}

/// The least value of a function: on a grid between the ends, then by golden sections between
/// the neighbours of the best, to the root of the rounding.
pub(crate) fn least(ends: [f64; 2], count: usize, value: impl Fn(f64) -> f64) -> (f64, f64) {
    let step = (ends[1] - ends[0]) / (count - 1) as f64;
    let at = |n: usize| ends[0] + step * n as f64;
    let (mut best, mut least) = (ends[0], f64::INFINITY);
    for n in 0..count {
        let found = value(at(n));
        if found < least {
            (best, least) = (at(n), found);
        }
    }
    let golden = (5.0_f64.sqrt() - 1.0) / 2.0;
    let (mut low, mut high) = ((best - step).max(ends[0]), (best + step).min(ends[1]));
    let mut inner =
        [high - golden * (high - low), low + golden * (high - low)].map(|x| (x, value(x)));
    while high - low > 1e-9 * step.max(low.abs()) {
        let [a, b] = inner;
        let better = if a.1 <= b.1 { a } else { b };
        if better.1 < least {
            (best, least) = better;
        }
        // One of the two points within stays.
        if a.1 <= b.1 {
            high = b.0;
            let x = high - golden * (high - low);
            inner = [(x, value(x)), a];
        } else {
            low = a.0;
            let x = low + golden * (high - low);
            inner = [b, (x, value(x))];
        }
    }
    (best, least)
}

/// Least squares on columns by modified Gram-Schmidt: the coefficients and the residuals,
/// target less columns. None where a column depends on those before it to 1e-9 of its length.
pub(crate) fn solved(
    mut columns: Vec<Vec<f64>>,
    mut target: Vec<f64>,
) -> Option<(Vec<f64>, Vec<f64>)> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let count = columns.len();
    let mut r = vec![vec![0.0; count + 1]; count];
    for k in 0..count {
        let before = dot(&columns[k], &columns[k]).sqrt();
        if !(before > 0.0 && before.is_finite()) {
            return None;
        }
        for j in 0..k {
            let part = dot(&columns[j], &columns[k]);
            r[j][k] = part;
            let (done, rest) = columns.split_at_mut(k);
            for (entry, unit) in rest[0].iter_mut().zip(&done[j]) {
                *entry -= part * unit;
            }
        }
        let length = dot(&columns[k], &columns[k]).sqrt();
        if length < 1e-9 * before {
            return None;
        }
        r[k][k] = length;
        columns[k].iter_mut().for_each(|entry| *entry /= length);
        let part = dot(&columns[k], &target);
        r[k][count] = part;
        for (entry, unit) in target.iter_mut().zip(&columns[k]) {
            *entry -= part * unit;
        }
    }
    let mut found = vec![0.0; count];
    for k in (0..count).rev() {
        let known: f64 = (k + 1..count).map(|j| r[k][j] * found[j]).sum();
        found[k] = (r[k][count] - known) / r[k][k];
    }
    Some((found, target))
}
