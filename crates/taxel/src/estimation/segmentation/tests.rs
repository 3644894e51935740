use super::*;
use crate::estimation::Certainty;
use crate::estimation::State;
use crate::estimation::contact::normal_only;

fn cell(columns: usize, index: usize, weight: f64, deviation: f64, threshold: f64) -> Cell {
    Cell {
        position: [(index % columns) as f64, -((index / columns) as f64)],
        weight,
        deviation,
        threshold,
        force: [0.0, 0.0, weight],
        force_covariance: normal_only(deviation),
        certainty: Certainty::Exact,
        noise: 1e-3,
        state: State::Ok,
    }
}

fn contacts(rows: usize, columns: usize, weights: &[f64]) -> Vec<Contact> {
    let mut contacts = Vec::new();
    let cell = |index| cell(columns, index, weights[index], 0.05, 0.5);
    let mut cells = (0..weights.len()).map(cell).collect();
    Segmentation::new(rows, columns, [1.0; 2], Division::Peaks).run(&mut cells, &mut contacts);
    contacts
}

#[test]
fn corners_connect_and_gaps_divide() {
    let weights = [
        2.0,
        0.0,
        0.0,
        1.0,
        0.0,
        1.9,
        0.0,
        0.0,
        f64::NAN,
        0.0,
        0.0,
        4.0,
    ];
    let mut found = Vec::new();
    let mut segmentation = Segmentation::new(3, 4, [1.0; 2], Division::Peaks);
    let cell = |index| cell(4, index, weights[index], 0.05, 0.5);
    let all = segmentation.run(&mut (0..12).map(cell).collect(), &mut found);
    assert_eq!(
        found.iter().map(|c| c.taxels).collect::<Vec<_>>(),
        [1, 2, 1]
    );
    assert_eq!(found[0].peak_taxel, 11);
    assert_eq!(found[1].area, 2.0);
    let mut labels = Vec::new();
    segmentation.label(&mut labels);
    assert_eq!([0, 3, 5, 11].map(|i| labels[i]), [1, 2, 1, 0].map(Some));
    let centre = all.unwrap().0;
    // Rounding of sums of three.
    assert!((centre[0] - (3.0 + 1.9 + 12.0) / 8.9).abs() < 1e-15);
}

#[test]
fn touching_neighbours_are_divided_at_a_dip_and_only_there() {
    let found = contacts(1, 7, &[0.0, 1.0, 4.0, 1.5, 3.0, 1.0, 0.0]);
    assert_eq!(found.len(), 2);
    // The saddle goes with the higher of its neighbours.
    assert_eq!([found[0].taxels, found[1].taxels], [3, 2]);
    assert_eq!([found[0].peak_taxel, found[1].peak_taxel], [2, 4]);
    // 3.0 above 2.8 is within six deviations of the difference, and less than a quarter.
    assert_eq!(
        contacts(1, 7, &[0.0, 1.0, 4.0, 2.8, 3.0, 1.0, 0.0]).len(),
        1
    );
}

#[test]
fn a_low_peak_between_two_high_ones_joins_one_and_leaves_two() {
    let found = contacts(1, 9, &[0.0, 4.0, 1.0, 1.2, 1.0, 4.0, 0.0, 0.0, 0.0]);
    assert_eq!(found.iter().map(|c| c.taxels).sum::<usize>(), 5);
    assert_eq!(found.len(), 2);
}

#[test]
fn what_is_touched_stays_so_down_to_half_the_threshold() {
    let mut segmentation = Segmentation::new(1, 3, [1.0; 2], Division::Peaks);
    let mut count = |weight: f64| {
        let mut found = Vec::new();
        let weights = [0.0, weight, 0.0];
        let cell = |i| cell(3, i, weights[i], 0.05, 0.5);
        segmentation.run(&mut (0..weights.len()).map(cell).collect(), &mut found);
        found.len()
    };
    assert_eq!([0.4, 0.6, 0.3, 0.2, 0.4].map(&mut count), [0, 1, 1, 0, 0]);
}

#[test]
fn moment_and_covariances_are_sums_over_the_members() {
    let mut found = Vec::new();
    let with_shear = |index: usize| {
        let mut cell = cell(2, index, 1.0, 0.1, 0.5);
        // A couple about the middle.
        cell.force[1] = if index == 0 { -2.0 } else { 2.0 };
        cell.state = [State::Ok, State::Closed][index];
        cell
    };
    Segmentation::new(1, 2, [1.0; 2], Division::Peaks)
        .run(&mut (0..2).map(with_shear).collect(), &mut found);
    let contact = found[0];
    assert_eq!(contact.torsion, 2.0);
    assert_eq!(contact.bound, Some(State::Closed));
    // Two variances of 0.01.
    assert!((contact.force_covariance[2][2] - 0.02).abs() < 1e-17);
    // Σσ²δ²/(Σw)² = 0.01·(0.25 + 0.25)/4; a half on either side leaves to the
    // grid the harmonic with s² = 1/4: u² = 20π²(1/4 − 1/12).
    let u2 = 20.0 * std::f64::consts::PI.powi(2) / 6.0;
    let expected = 0.01 * 0.5 / 4.0 + 1.0 / 12.0 / (1.0 + u2 * u2 / 9.0);
    assert!((contact.covariance[0] - expected).abs() < 1e-15);
}

/// Share of a round pressure of unit force that a cell from `left` to `right`
/// carries along x.
fn cell_share(shape: Shape, [left, right]: [f64; 2]) -> f64 {
    match shape {
        // Marginal of √(1 − r²): (3/4)(1 − x²), integrated.
        Shape::Hertz(a) => {
            let within = |x: f64| {
                let t = (x / a).clamp(-1.0, 1.0);
                0.5 + 0.25 * (3.0 * t - t * t * t)
            };
            within(right) - within(left)
        }
        Shape::Gauss(s) => {
            let within = |x: f64| 0.5 * (1.0 + libm::erf(x / (s * 2f64.sqrt())));
            within(right) - within(left)
        }
    }
}

#[derive(Clone, Copy, Debug)]
enum Shape {
    Hertz(f64),
    Gauss(f64),
}

/// The stated covariance must cover the error of the grid for every size, at
/// every position within a cell: squared over all positions and, by four deviations,
/// at each.
#[test]
fn stated_covariance_covers_the_grid_for_every_size_and_place() {
    let sizes = [0.05, 0.2, 0.35, 0.5, 0.7, 1.0, 1.5, 2.5];
    let shapes = sizes
        .into_iter()
        .flat_map(|a| [Shape::Hertz(a), Shape::Gauss(a / 5f64.sqrt())]);
    for shape in shapes {
        let mut squares = 0.0;
        for step in 0..200 {
            let position = 8.0 + f64::from(step) / 200.0;
            let weights: Vec<f64> = (0..17)
                .map(|i| f64::from(i) - position)
                .map(|x| cell_share(shape, [x - 0.5, x + 0.5]))
                .collect();
            let mut found = Vec::new();
            let cell = |i: usize| cell(17, i, weights[i], 1e-4, 0.01);
            Segmentation::new(1, 17, [1.0; 2], Division::Peaks)
                .run(&mut (0..17).map(cell).collect(), &mut found);
            let contact = found[0];
            let ratio = (contact.centre[0] - position) / contact.covariance[0].sqrt();
            assert!(ratio.abs() < 4.0, "{shape:?} at {position}: {ratio}");
            squares += ratio * ratio / 200.0;
        }
        assert!(squares < 1.2, "{shape:?}: {squares}");
    }
}

#[test]
fn what_is_left_of_a_contact_is_no_second_one() {
    let mut segmentation = Segmentation::new(1, 5, [1.0; 2], Division::Peaks);
    let mut run = |weights: [f64; 5]| {
        let mut found = Vec::new();
        let cell = |index: usize| cell(5, index, weights[index], 0.01, 2.0);
        segmentation.run(&mut (0..5).map(cell).collect(), &mut found);
        let taxels: Vec<usize> = found.iter().map(|contact| contact.taxels).collect();
        taxels
    };
    assert_eq!(run([5.0, 4.0, 3.0, 0.0, 0.0]), [3]);
    // The middle has gone: the cell behind it only holds.
    assert_eq!(run([5.0, 0.0, 1.5, 0.0, 0.0]), [1]);
    assert_eq!(run([5.0, 0.0, 1.5, 0.0, 0.0]), [1]);
    // A contact that fades holds, and one that rises again is another.
    assert_eq!(run([1.5, 0.0, 2.5, 0.0, 0.0]), [1, 1]);
    assert_eq!(run([1.5, 0.0, 1.5, 0.0, 0.0]), [1, 1]);
}

/// Cells per contact of a map, one frame after the other; a cell is touched above 2.
fn regions(columns: usize, least: usize, frames: &[&[f64]]) -> Vec<Vec<usize>> {
    let rows = frames[0].len() / columns;
    let mut segmentation = Segmentation::new(rows, columns, [1.0; 2], Division::Regions { least });
    let run = |weights: &&[f64]| {
        let mut found = Vec::new();
        let cell = |index| cell(columns, index, weights[index], f64::NAN, 2.0);
        segmentation.run(&mut (0..weights.len()).map(cell).collect(), &mut found);
        found.iter().map(|contact| contact.taxels).collect()
    };
    frames.iter().map(run).collect()
}

#[test]
fn a_region_begins_above_the_threshold_and_holds_down_to_half_of_it() {
    // Two peaks with a dip are one region, and its skirt down to 1 is part of it.
    assert_eq!(
        regions(7, 1, &[&[1.0, 9.0, 1.0, 8.0, 1.0, 0.9, 0.0]]),
        [[5]]
    );
    let low: &[f64] = &[0.0, 1.5, 1.9, 0.0];
    let high: &[f64] = &[0.0, 1.5, 2.1, 0.0];
    let none: Vec<usize> = Vec::new();
    let found = regions(4, 1, &[low, high, low, &[0.0, 0.5, 0.9, 0.0], low]);
    assert_eq!(found, [none.clone(), vec![2], vec![2], none.clone(), none]);
}

#[test]
fn regions_of_less_than_the_least_area_are_none_and_near_ones_are_one() {
    let one_between: &[f64] = &[5.0, 4.0, 0.0, 3.0, 4.0, 0.0, 0.0, 5.0];
    assert_eq!(regions(8, 1, &[one_between]), [[4, 1]]);
    assert_eq!(regions(8, 2, &[one_between]), [[4]]);
    // What is left out joins nothing.
    let stuck: &[f64] = &[5.0, 4.0, 0.0, 0.0, 3.0, 0.0, 0.0, 5.0, 5.0];
    assert_eq!(regions(9, 2, &[stuck]), [[2, 2]]);
}

#[test]
fn one_cell_that_reads_too_much_and_noise_beside_it_are_no_touch() {
    let stuck: &[f64] = &[0.0, 1.1, 5.0, 1.2, 1.0, 0.0];
    let touch: &[f64] = &[0.0, 1.1, 5.0, 2.1, 1.0, 0.0];
    let none: Vec<usize> = Vec::new();
    let found = regions(6, 4, &[stuck, touch, stuck]);
    assert_eq!(found, [none, vec![4], vec![4]]);
}

#[test]
fn more_contacts_than_a_frame_can_have_are_merged() {
    // Single cells of growing height on a grid with two cells between them.
    for division in [Division::Peaks, Division::Regions { least: 1 }] {
        let (rows, columns) = (64, 64);
        let weight = |index: usize| match (index / columns % 3, index % columns % 3) {
            (0, 0) => 3.0 + index as f64,
            _ => 0.0,
        };
        let cell = |index| cell(columns, index, weight(index), f64::NAN, 2.0);
        let mut cells: Vec<Cell> = (0..rows * columns).map(cell).collect();
        let mut found = Vec::new();
        let mut segmentation = Segmentation::new(rows, columns, [1.0; 2], division);
        segmentation.run(&mut cells, &mut found);
        assert_eq!(
            (found.len(), segmentation.merged()),
            (MOST_CONTACTS, 22 * 22 - 64)
        );
        // No force is lost.
        let sum: f64 = found.iter().map(|contact| contact.force[2]).sum();
        assert_eq!(sum, cells.iter().map(|cell| cell.weight).sum::<f64>());
        assert_eq!(
            found.iter().map(|contact| contact.taxels).sum::<usize>(),
            22 * 22
        );
    }
}
