use proptest::prelude::*;

use super::*;

/// The second difference on a square of `n x n` points, shifted on the diagonal.
fn grid(n: u32, shift: f64) -> (Pattern, Vec<f64>) {
    let mut pattern = Pattern {
        column_starts: vec![0],
        rows: Vec::new(),
    };
    let mut values = Vec::new();
    for i in 0..n * n {
        let mut push = |row: u32, value: f64| {
            pattern.rows.push(row);
            values.push(value);
        };
        push(i, 4.0 + shift);
        if i % n + 1 < n {
            push(i + 1, -1.0);
        }
        if i / n + 1 < n {
            push(i + n, -1.0);
        }
        pattern.column_starts.push(pattern.rows.len() as u32);
    }
    (pattern, values)
}

#[test]
fn definite_and_indefinite_matrices_are_solved_with_one_analysis() {
    let (pattern, definite) = grid(20, 0.0);
    let (_, indefinite) = grid(20, -1.234);
    let mut factor = Cholesky::analyse(&pattern).unwrap();
    for (values, expected) in [
        (&definite, Definiteness::Positive),
        (&indefinite, Definiteness::Indefinite),
        (&definite, Definiteness::Positive),
    ] {
        assert_eq!(factor.refactor(&pattern, values), Ok(expected));
        let x: Vec<f64> = (0..400).map(|i| f64::from(i).sin()).collect();
        let right = pattern.multiply(values, &x);
        let found = solve_checked(&mut factor, &pattern, values, &right).unwrap();
        for (found, x) in found.iter().zip(&x) {
            assert!((found - x).abs() < 1e-10);
        }
    }
}

#[test]
fn a_singular_matrix_is_refused() {
    // A loose chain: no support, the sum of each row is zero.
    let pattern = Pattern {
        column_starts: vec![0, 2, 4, 5],
        rows: vec![0, 1, 1, 2, 2],
    };
    let values = [1.0, -1.0, 2.0, -1.0, 1.0];
    let mut factor = Cholesky::analyse(&pattern).unwrap();
    let factored = factor.refactor(&pattern, &values);
    let solved =
        factored.and_then(|_| solve_checked(&mut factor, &pattern, &values, &[1.0, 0.0, 0.0]));
    assert!(solved.is_err(), "{solved:?}");
}

/// A symmetric matrix, dense.
#[derive(Debug)]
struct Dense(Vec<Vec<f64>>);

impl Dense {
    fn sparse(&self) -> (Pattern, Vec<f64>) {
        let n = self.0.len();
        let mut pattern = Pattern {
            column_starts: vec![0],
            rows: Vec::new(),
        };
        let mut values = Vec::new();
        for column in 0..n {
            for row in column..n {
                if row == column || self.0[row][column] != 0.0 {
                    pattern.rows.push(row as u32);
                    values.push(self.0[row][column]);
                }
            }
            pattern.column_starts.push(pattern.rows.len() as u32);
        }
        (pattern, values)
    }

    /// Solution by the textbook's Cholesky; none when a pivot is not positive.
    fn solve(&self, right: &[f64]) -> Option<Vec<f64>> {
        let (n, mut l, mut x) = (right.len(), self.0.clone(), right.to_vec());
        for j in 0..n {
            for i in j..n {
                let known: f64 = (0..j).map(|k| l[i][k] * l[j][k]).sum();
                l[i][j] -= known;
            }
            if l[j][j] <= 0.0 {
                return None;
            }
            let root = l[j][j].sqrt();
            for row in &mut l[j..] {
                row[j] /= root;
            }
        }
        for i in 0..n {
            let known: f64 = (0..i).map(|k| l[i][k] * x[k]).sum();
            x[i] = (x[i] - known) / l[i][i];
        }
        for i in (0..n).rev() {
            let known: f64 = (i + 1..n).map(|k| l[k][i] * x[k]).sum();
            x[i] = (x[i] - known) / l[i][i];
        }
        Some(x)
    }
}

/// Random entries at random places; `margin` is what the diagonal has more than the sum
/// of its row.
fn matrix(size: usize, margin: f64) -> impl Strategy<Value = Dense> {
    let places = prop::collection::vec((0..size, 0..size, -1.0..1.0), 0..4 * size);
    places.prop_map(move |places| {
        let mut a = vec![vec![0.0; size]; size];
        for (i, j, value) in places {
            if i != j {
                a[i][j] = value;
                a[j][i] = value;
            }
        }
        for (i, row) in a.iter_mut().enumerate() {
            row[i] = row.iter().map(|value: &f64| value.abs()).sum::<f64>() + margin;
        }
        Dense(a)
    })
}

fn right(size: usize) -> Vec<f64> {
    (0..size).map(|i| (1.0 + 7.3 * i as f64).sin()).collect()
}

proptest! {
    #[test]
    fn random_matrices_are_solved_as_dense_ones(
        a in (1usize..90).prop_flat_map(|size| matrix(size, 0.1)),
    ) {
        let (pattern, values) = a.sparse();
        let b = right(pattern.size());
        let expected = a.solve(&b).expect("diagonally dominant");
        let mut factor = Cholesky::analyse(&pattern).unwrap();
        // The same analysis with other values in between, and again bit for bit.
        let mut before: Option<Vec<f64>> = None;
        for factor_of_values in [1.0, 3.0, 1.0] {
            let scaled: Vec<f64> = values.iter().map(|value| value * factor_of_values).collect();
            prop_assert_eq!(factor.refactor(&pattern, &scaled), Ok(Definiteness::Positive));
            let mut x = b.clone();
            factor.solve(&mut x);
            for (x, expected) in x.iter().zip(&expected) {
                // Condition numbers stay below 1e3, and |x| below 10 |b|.
                prop_assert!((x * factor_of_values - expected).abs() < 1e-11);
            }
            if factor_of_values == 1.0 {
                prop_assert!(before.is_none_or(|before| before == x));
                before = Some(x);
            }
        }
    }

    #[test]
    fn definiteness_is_that_of_the_dense_matrix(
        a in (2usize..40).prop_flat_map(|size| (-3.0..1.0).prop_flat_map(move |m| matrix(size, m))),
    ) {
        let (pattern, values) = a.sparse();
        let b = right(pattern.size());
        let expected = a.solve(&b);
        let mut factor = Cholesky::analyse(&pattern).unwrap();
        match factor.refactor(&pattern, &values) {
            Ok(Definiteness::Positive) => prop_assert!(expected.is_some()),
            Ok(Definiteness::Indefinite) => {
                prop_assert!(expected.is_none());
                if let Ok(x) = solve_checked(&mut factor, &pattern, &values, &b) {
                    let back = pattern.multiply(&values, &x);
                    let size = x.iter().fold(1.0_f64, |most, x| most.max(x.abs()));
                    for (back, b) in back.iter().zip(&b) {
                        // The residual that is accepted, for entries of at most 200.
                        prop_assert!((back - b).abs() < 1e-11 * 200.0 * 40.0 * size);
                    }
                }
            }
            Err(error) => prop_assert_eq!(error, LinearError::Singular),
        }
    }
}

#[test]
fn fronts_of_any_width_are_eliminated() {
    // A band: in the order of its columns one chain of fronts; dense beyond half.
    for size in [1, 7, 8, 9, 23, 24, 25, 31, 48, 65, 130] {
        for band in [1, 5, 30, 130] {
            let entry = |i: usize, j: usize| match i.abs_diff(j) {
                0 => 2.0 * band as f64,
                apart if apart <= band => -((i * j) as f64).sin().abs(),
                _ => 0.0,
            };
            let a = Dense(
                (0..size)
                    .map(|i| (0..size).map(|j| entry(i, j)).collect())
                    .collect(),
            );
            let (pattern, values) = a.sparse();
            let b = right(size);
            let mut factor = Cholesky::analyse(&pattern).unwrap();
            let found = factor.refactor(&pattern, &values);
            let Some(expected) = a.solve(&b) else {
                assert_eq!(found, Ok(Definiteness::Indefinite));
                continue;
            };
            assert_eq!(found, Ok(Definiteness::Positive));
            let mut x = b.clone();
            factor.solve(&mut x);
            for (x, expected) in x.iter().zip(&expected) {
                assert!(
                    (x - expected).abs() < 1e-11 * (1.0 + expected.abs()),
                    "{size} {band}"
                );
            }
        }
    }
}

#[test]
fn the_first_pivot_that_is_not_positive_ends_the_factorisation() {
    let (pattern, mut values) = grid(20, 0.0);
    let mut factor = Cholesky::analyse(&pattern).unwrap();
    for bad in [-1.0, 0.0] {
        let place = pattern.column(250).start;
        let good = std::mem::replace(&mut values[place], bad);
        assert_eq!(
            factor.refactor(&pattern, &values),
            Ok(Definiteness::Indefinite)
        );
        values[place] = good;
    }
    values[5] = f64::NAN;
    assert_eq!(
        factor.refactor(&pattern, &values),
        Err(LinearError::Singular)
    );
}

#[test]
fn a_matrix_without_unknowns_is_positive() {
    let pattern = Pattern {
        column_starts: vec![0],
        rows: Vec::new(),
    };
    let mut factor = Cholesky::analyse(&pattern).unwrap();
    assert_eq!(factor.refactor(&pattern, &[]), Ok(Definiteness::Positive));
    factor.solve(&mut []);
}

#[test]
fn any_number_of_threads_gives_the_same_factor() {
    // Four dense parts, each pair joined by another, and one that joins all.
    let part = 190u32;
    let holds = |row: u32, column: u32| {
        let (r, c) = (row / part, column / part);
        r == c || r == 6 || (c < 4 && r == 4 + c / 2)
    };
    let n = 7 * part;
    let mut pattern = Pattern {
        column_starts: vec![0],
        rows: Vec::new(),
    };
    let mut values = Vec::new();
    for column in 0..n {
        for row in (column..n).filter(|&row| holds(row, column)) {
            pattern.rows.push(row);
            values.push(if row == column {
                f64::from(n)
            } else {
                f64::from(row * column).sin()
            });
        }
        pattern.column_starts.push(pattern.rows.len() as u32);
    }
    let b = right(n as usize);
    let solved = |factor: &mut Cholesky, values: &[f64]| {
        let definiteness = factor.refactor(&pattern, values).unwrap();
        let mut x = b.clone();
        factor.solve(&mut x);
        (definiteness, x)
    };
    let one = solved(&mut Cholesky::for_threads(&pattern, 1).unwrap(), &values);
    assert_eq!(one.0, Definiteness::Positive);
    let back = pattern.multiply(&values, &one.1);
    for (back, b) in back.iter().zip(&b) {
        assert!((back - b).abs() < 1e-12);
    }
    for threads in [2, 3] {
        let mut factor = Cholesky::for_threads(&pattern, threads).unwrap();
        assert!(factor.analysis.branches.len() > 1);
        assert_eq!(solved(&mut factor, &values), one);
        // Among other cases it is one thread's.
        let (there, ()) = rayon::join(|| solved(&mut factor, &values), || ());
        assert_eq!(there, one);
        // A pivot in a branch, and one above.
        for column in [100, n - 1] {
            let mut bad = values.clone();
            bad[pattern.column(column as usize).start] = -1.0;
            assert_eq!(solved(&mut factor, &bad).0, Definiteness::Indefinite);
        }
        assert_eq!(solved(&mut factor, &values), one);
    }
}
