//! Soft bodies with odd outlines, pressed and drawn over a rough plate and over another soft body,
//! with default settings: `tests/bodies`, sections that no shipped problem has.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;

use taxel::table::Cell;
use taxel_bodies::problem::{Body, Ended, ProblemFile};

/// A body of `tests/bodies`.
fn body(name: &str) -> Body {
    with(name, "", "")
}

/// The same with one text of its file replaced.
fn with(name: &str, from: &str, to: &str) -> Body {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bodies");
    let text = fs::read_to_string(folder.join(format!("{name}.toml"))).unwrap();
    assert!(text.contains(from), "{name} has no {from}");
    let text = text.replacen(from, to, 1);
    let mesh = fs::read(folder.join(format!("{name}.msh"))).unwrap();
    let file = ProblemFile::parse(name, &text).unwrap();
    Body::new(file, (name, &text), (name, &mesh)).unwrap()
}

/// Solves so many steps.
fn go_on(body: &mut Body, steps: usize) {
    for _ in 0..steps {
        match body.step(|_| true) {
            Ok(ended) => assert_eq!(ended, Ended::Done),
            Err(failure) => panic!("{}", body.explain(&failure)),
        }
    }
}

/// The last number of a column.
fn last(body: &Body, name: &str) -> f64 {
    let columns = body.columns();
    let at = columns.iter().position(|column| column.name == name);
    match body.cells().last().unwrap()[at.unwrap()] {
        Cell::Number(value) => value,
        _ => panic!("{name} is no number"),
    }
}

#[test]
fn a_skewed_keel_and_a_bow_slide_at_the_friction_times_their_load() {
    for (name, friction) in [("keel", 0.2), ("bow", 0.4)] {
        let mut body = body(name);
        assert_eq!(body.notes(), [""; 0], "{name}");
        go_on(&mut body, 3);
        // Pressed it does not slide as a whole yet.
        let share = |body: &Body| last(body, "plate_force_x") / last(body, "plate_force_y");
        assert!(share(&body).abs() < 0.9 * friction, "{name}");
        go_on(&mut body, 3);
        let share = share(&body);
        assert!((share / -friction - 1.0).abs() < 1e-6, "{name}: {share}");
    }
}

#[test]
fn a_saved_state_keeps_where_the_multipliers_stand() {
    let mut points = body("bow");
    go_on(&mut points, 3);
    let saved = points.save("bow");
    let at_corners = saved.replacen("\"corners\": false", "\"corners\": true", 1);
    assert_ne!(at_corners, saved);
    let resumed = |text: &str| {
        let mut body = body("bow");
        body.restore(text, "bow").unwrap();
        assert_eq!(body.save("bow"), text);
        body
    };
    let mut whole = resumed(&at_corners);
    assert!(whole.went_to_corners());
    // Between its steps it is stopped, and the last one is the same to the last bit.
    go_on(&mut whole, 1);
    let mut second = resumed(&whole.save("bow"));
    go_on(&mut whole, 1);
    go_on(&mut second, 1);
    assert_eq!(second.save("bow"), whole.save("bow"));
    // Multipliers at points end elsewhere.
    go_on(&mut points, 2);
    assert!(!points.went_to_corners());
    assert_ne!(points.save("bow"), whole.save("bow"));
}

#[test]
fn a_mushroom_is_pressed_by_a_rough_plate_to_its_end() {
    let mut body = body("mushroom");
    go_on(&mut body, 6);
    let force = last(&body, "plate_force_y");
    assert!(force < -2.5 && force > -20.0, "{force}");
}

#[test]
fn a_mushroom_goes_on_after_its_rim_has_snapped() {
    let mut body = with("mushroom", "friction = 0.5", "friction = 0.7");
    go_on(&mut body, 5);
    assert!(body.jumps().is_empty());
    go_on(&mut body, 1);
    let ways = body.jumps().iter().map(|jump| jump.way);
    let farthest = ways.fold(0.0, f64::max);
    assert!((2e-4..1e-3).contains(&farthest), "{farthest}");
    let force = last(&body, "plate_force_y");
    assert!(force < -2.5 && force > -20.0, "{force}");
}

#[test]
fn a_tube_is_pressed_and_rolled_at_any_friction() {
    let mut before: Option<f64> = None;
    let mut jumps = Vec::new();
    for friction in [0.2, 0.3, 0.45, 0.55, 0.6, 0.8] {
        let mut body = with("tube", "friction = 0.4", &format!("friction = {friction}"));
        go_on(&mut body, 4);
        // It comes to rest on one point that neither sticks nor slides to one side.
        assert!(
            !body.went_to_corners() && body.jumps().is_empty(),
            "{friction}"
        );
        assert!(body.effort().most <= 25, "{friction}: {:?}", body.effort());
        go_on(&mut body, 1);
        jumps.extend_from_slice(body.jumps());
        go_on(&mut body, 1);
        let press = last(&body, "plate_force_y");
        let share = last(&body, "plate_force_x") / press;
        assert!(
            (share / -friction - 1.0).abs() < 1e-3,
            "{friction}: {share}"
        );
        // The more it drags, the less it presses: by a jump or without, it comes to one state.
        let less = before.is_none_or(|before| press < before && press > 0.75 * before);
        assert!(less, "{friction}: {press} after {before:?}");
        before = Some(press);
    }
    // Where it slips, its left flank folds at the inner wall.
    assert!(!jumps.is_empty());
    for jump in jumps {
        assert!((2e-4..1e-3).contains(&jump.way), "{jump:?}");
        assert!(jump.place[0] < -2e-3 && jump.place[1] < 4e-3, "{jump:?}");
    }
}

#[test]
fn a_tube_is_drawn_over_a_wavy_slab() {
    let mut body = body("tube_slab");
    go_on(&mut body, 6);
    assert!(last(&body, "least_volume_ratio") > 0.0);
    // It drags, by less than the friction and the slopes of the waves allow.
    let share = last(&body, "touch_force_x") / last(&body, "touch_force_y");
    assert!((-0.7..-0.3).contains(&share), "{share}");
}

#[test]
fn bodies_that_overlap_at_rest_are_told() {
    let mut body = body("bell");
    // The file lists its cells clockwise.
    let [turned, note] = body.notes() else {
        panic!("{:?}", body.notes());
    };
    assert!(turned.contains("48 cells are given inside out"), "{turned}");
    assert!(
        note.starts_with("\"touch\" overlaps by ") && note.contains("step 0"),
        "{note}"
    );
    go_on(&mut body, 6);
}
