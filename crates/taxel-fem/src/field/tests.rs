//! Laws of the fields, exact solutions and what must be refused.

use super::FieldError;
use super::cases::grid::{Sizes, line, name_nodes, plane, solid};
use super::conduction::Conduction;
use super::electrostatics::{Capacitance, Electrostatics, Infinity, VACUUM_PERMITTIVITY};
use super::exterior::{Ball, Exterior, add_exterior};
use super::geometry::Geometry;
use super::laplace::{Coefficient, Domain, MeshMotion};
use super::sections::{sections, slender_resistance};
use crate::mesh::Mesh;
use proptest::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

fn even(from: f64, to: f64, count: usize) -> Vec<f64> {
    let sizes = Sizes {
        growth: 1.0,
        largest: (to - from) / count as f64,
    };
    line(sizes, &[(from, None), (to, None)])
}

fn domain(mesh: &Mesh, geometry: Geometry) -> Domain<'_> {
    Domain {
        mesh,
        geometry,
        motion: MeshMotion::None,
        exterior: None,
    }
}

/// A block with its faces named "low x", "high x" and so on.
fn block(sides: [f64; 3], counts: [usize; 3]) -> Mesh {
    let lines: [Vec<f64>; 3] = std::array::from_fn(|d| even(0.0, sides[d], counts[d]));
    let mut mesh = solid([&lines[0], &lines[1], &lines[2]], "block");
    for (d, name) in ["x", "y", "z"].into_iter().enumerate() {
        mesh.name_boundary(&format!("low {name}"), |p| p[d] == 0.0);
        mesh.name_boundary(&format!("high {name}"), |p| p[d] == sides[d]);
    }
    mesh
}

/// A sector of a ring between radius 1 and 2 about the second axis, from angle `low` to
/// `high` above the first; the inner circle is named "inner", the outer one "ball".
fn ring(low: f64, high: f64, counts: [usize; 2]) -> Mesh {
    let radii = even(1.0, 2.0, counts[0]);
    let angles = even(low, high, counts[1]);
    let mut mesh = plane(&radii, &angles, &|p| {
        Some(if p[1] > 0.0 { "upper" } else { "lower" })
    });
    mesh.name_boundary("inner", |p| p[0] == 1.0);
    mesh.name_boundary("ball", |p| p[0] == 2.0);
    for point in &mut mesh.points {
        let [radius, angle, _] = *point;
        *point = [radius * libm::cos(angle), radius * libm::sin(angle), 0.0];
    }
    mesh
}

const BALL: Ball = Ball {
    centre: [0.0; 3],
    radius: 2.0,
};

fn capacitance(
    domain: Domain,
    media: &[(&str, Coefficient)],
    conductors: &[&str],
    floating: &[&str],
    zero: &[&str],
) -> Result<Capacitance, FieldError> {
    let infinity = if zero.is_empty() && domain.exterior.is_some() {
        Infinity::Zero
    } else {
        Infinity::Free
    };
    let mut found = Electrostatics {
        domain,
        permittivities: media,
        conductors,
        floating,
        zero,
        infinity,
    }
    .capacitance()?;
    for entry in found.matrix.iter_mut().flatten() {
        *entry /= VACUUM_PERMITTIVITY;
    }
    for entry in found.by_flux.iter_mut().flatten() {
        *entry /= VACUUM_PERMITTIVITY;
    }
    Ok(found)
}

fn ones<'a>(names: &[&'a str]) -> Vec<(&'a str, Coefficient)> {
    let one = Coefficient::Scalar(1.0);
    names.iter().map(|&name| (name, one)).collect()
}

/// Relative difference.
fn apart(a: f64, b: f64) -> f64 {
    (a / b - 1.0).abs()
}

#[test]
fn a_stretched_block_scales_exactly() {
    let mesh = block([1.0, 0.7, 0.4], [2, 2, 2]);
    let stretches = [1.3, 0.9, 0.6];
    let moved: Vec<[f64; 3]> = mesh
        .points
        .iter()
        .map(|p| std::array::from_fn(|i| (stretches[i] - 1.0) * p[i]))
        .collect();
    for motion in [MeshMotion::PulledBack(&moved), MeshMotion::Moved(&moved)] {
        let domain = Domain {
            motion,
            ..domain(&mesh, Geometry::Solid)
        };
        let media = ones(&["block"]);
        let found = capacitance(domain, &media, &["high z"], &[], &["low z"]).unwrap();
        // C/C0 = l1 l2/l3 with C0 = eps A/d, R/R0 = l1/(l2 l3): exact, so rounding alone.
        let expected = 1.3 * 0.9 / 0.6 * (1.0 * 0.7 / 0.4);
        assert!(apart(found.matrix[0][0], expected) < 1e-12);
        let resistance = Conduction {
            domain,
            conductivities: &media,
            from: "low x",
            to: "high x",
        }
        .resistance()
        .unwrap();
        let expected = 1.3 / (0.9 * 0.6) * (1.0 / (0.7 * 0.4));
        assert!(apart(resistance.by_power, expected) < 1e-12);
        assert!(apart(resistance.by_flux, expected) < 1e-12);
    }
}

#[test]
fn the_slender_formula_is_exact_for_uniform_sections_and_converges_for_a_taper() {
    let mut mesh = block([4.0, 0.2, 0.1], [4, 2, 3]);
    mesh.name_boundary("wall", |p| {
        p[1] == 0.0 || p[1] == 0.2 || p[2] == 0.0 || p[2] == 0.1
    });
    let stretches = [1.5, 0.5, 0.8];
    let uniform: Vec<[f64; 3]> = mesh
        .points
        .iter()
        .map(|p| std::array::from_fn(|i| (stretches[i] - 1.0) * p[i]))
        .collect();
    let found = sections(&mesh, "wall", Some(&uniform), [1.0, 0.0, 0.0]).unwrap();
    assert_eq!(found.len(), 9);
    for section in &found {
        assert!(apart(section.area, 0.02 * 0.4) < 1e-12);
    }
    // R = rho L/A: exact, so rounding alone.
    let expected = 2.0 * 6.0 / (0.02 * 0.4);
    assert!(apart(slender_resistance(2.0, &found), expected) < 1e-12);
    // Width and height grow as 1 + x/8: rho int ds/A = rho L/(A0 (1 + L/8)). Simpson's
    // error with four cells: h^4 f''''/2880 with f'''' < 0.03 of the mean.
    let taper: Vec<[f64; 3]> = mesh
        .points
        .iter()
        .map(|p| [0.0, p[0] / 8.0 * p[1], p[0] / 8.0 * p[2]])
        .collect();
    let found = sections(&mesh, "wall", Some(&taper), [1.0, 0.0, 0.0]).unwrap();
    // The centres move aside: the path is longer and the sections lie askew to it, each
    // by the same angle; A ds is that of the axis times the cosine twice.
    let slope = (0.1 * 0.1 + 0.05 * 0.05) / 64.0;
    let expected = 4.0 / (0.02 * 1.5) * (1.0 + slope);
    assert!(apart(slender_resistance(1.0, &found), expected) < 2e-5);
}

#[test]
fn half_a_section_is_closed_by_its_chord() {
    let mut mesh = block([1.0, 0.2, 0.1], [1, 2, 1]);
    mesh.name_boundary("wall", |p| p[1] == 0.2 || p[2] == 0.0 || p[2] == 0.1);
    let found = sections(&mesh, "wall", None, [1.0, 0.0, 0.0]).unwrap();
    assert!(
        found
            .iter()
            .all(|section| apart(section.area, 0.02) < 1e-12)
    );
    mesh.name_boundary("wall", |p| p[2] == 0.0 || p[2] == 0.1);
    let refused = sections(&mesh, "wall", None, [1.0, 0.0, 0.0]);
    assert!(matches!(refused, Err(FieldError::BrokenSection { .. })));
}

/// Moves a point by something that no cell reproduces.
fn wavy(p: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = p;
    [
        0.08 * libm::sin(2.0 * y + 0.3) + 0.1 * x * x,
        0.07 * libm::sin(1.5 * x) - 0.05 * y * y + 0.03 * z,
        0.06 * z * libm::sin(x + y),
    ]
}

#[test]
fn pulled_back_and_moved_are_one() {
    let flat = |p: &[f64; 3]| {
        let [x, y, _] = wavy(*p);
        [x, y, 0.0]
    };
    let curved = ring(0.0, FRAC_PI_2, [3, 4]);
    let plane: Vec<_> = curved.points.iter().map(flat).collect();
    let mut bent = block([1.0, 1.0, 1.0], [2, 2, 2]);
    for point in &mut bent.points {
        let by = wavy(*point);
        (0..3).for_each(|i| point[i] += by[(i + 1) % 3]);
    }
    let solid: Vec<_> = bent.points.iter().map(|p| wavy(*p)).collect();
    for (mesh, geometry, motion, ends) in [
        (&curved, Geometry::Plane, &plane, ["inner", "ball"]),
        (&curved, Geometry::Axisymmetric, &plane, ["inner", "ball"]),
        (&bent, Geometry::Solid, &solid, ["low x", "high x"]),
    ] {
        let media: Vec<_> = mesh.regions.iter().map(String::as_str).collect();
        let media = ones(&media);
        let with = |motion| {
            let domain = Domain {
                motion,
                ..domain(mesh, geometry)
            };
            let found = capacitance(domain, &media, &ends[..1], &[], &ends[1..]).unwrap();
            found.matrix[0][0]
        };
        let pulled_back = with(MeshMotion::PulledBack(motion));
        let moved = with(MeshMotion::Moved(motion));
        // Equal integrands at equal points: rounding alone.
        assert!(apart(pulled_back, moved) < 1e-12, "{geometry:?}");
        assert!(apart(with(MeshMotion::None), moved) > 1e-3, "{geometry:?}");
    }
}

#[test]
fn a_tensor_is_what_a_shear_makes_of_a_scalar() {
    let mesh = block([1.0, 0.8, 0.5], [2, 2, 2]);
    let shear = 0.4;
    let moved: Vec<_> = mesh
        .points
        .iter()
        .map(|p| [shear * p[2], 0.0, 0.0])
        .collect();
    let domain = domain(&mesh, Geometry::Solid);
    // F^-1 F^-T of F = 1 + g e1 e3: (1 + g^2, 1, 1; 13: -g).
    let k = Coefficient::Tensor([1.0 + shear * shear, 1.0, 1.0, 0.0, 0.0, -shear]);
    let tensor = capacitance(domain, &[("block", k)], &["high z"], &[], &["low z"]).unwrap();
    let sheared = Domain {
        motion: MeshMotion::Moved(&moved),
        ..domain
    };
    let scalar = capacitance(sheared, &ones(&["block"]), &["high z"], &[], &["low z"]).unwrap();
    // The same matrices: rounding alone.
    assert!(apart(tensor.matrix[0][0], scalar.matrix[0][0]) < 1e-12);
}

#[test]
fn a_coaxial_capacitor_converges_with_the_fourth_power() {
    let error = |count: usize| {
        let (radii, heights) = (even(1.0, 3.0, count), even(0.0, 0.5, 1));
        let mut mesh = plane(&radii, &heights, &|_| Some("space"));
        mesh.name_boundary("inner", |p| p[0] == 1.0);
        mesh.name_boundary("outer", |p| p[0] == 3.0);
        let domain = domain(&mesh, Geometry::Axisymmetric);
        let found = capacitance(domain, &ones(&["space"]), &["inner"], &[], &["outer"]).unwrap();
        found.matrix[0][0] / (TAU * 0.5 / 3.0_f64.ln()) - 1.0
    };
    let (coarse, fine) = (error(4), error(8));
    // Energies of quadratic cells: h^4, from above.
    assert!(fine > 0.0 && fine < 1e-4, "{fine}");
    assert!((coarse / fine).log2() > 3.6, "{coarse} {fine}");
}

/// A sphere of radius one; the mesh is half or a quarter of its section.
fn sphere_with(mesh: &mut Mesh) -> Exterior {
    add_exterior(mesh, "ball", BALL, 2).unwrap()
}

#[test]
fn a_sphere_between_two_half_spaces_sees_their_mean() {
    let mut mesh = ring(-FRAC_PI_2, FRAC_PI_2, [6, 16]);
    let exterior = sphere_with(&mut mesh);
    let domain = Domain {
        exterior: Some(&exterior),
        ..domain(&mesh, Geometry::Axisymmetric)
    };
    let media = [
        ("upper", Coefficient::Scalar(2.0)),
        ("lower", Coefficient::Scalar(5.0)),
    ];
    let found = capacitance(domain, &media, &["inner"], &[], &[]).unwrap();
    // The field is radial: C = 2 pi a (eps1 + eps2). Quadratic cells of 1/6 radius
    // and 11 degrees.
    assert!(apart(found.matrix[0][0], TAU * 7.0) < 1e-4);
    assert!(found.mismatch() < 1e-10);
    // A free infinity takes the potential of the only conductor: no charge.
    let alone = Electrostatics {
        domain,
        permittivities: &media,
        conductors: &["inner"],
        floating: &[],
        zero: &[],
        infinity: Infinity::Free,
    };
    let charge = alone.capacitance().unwrap().matrix[0][0] / VACUUM_PERMITTIVITY;
    assert!(charge.abs() < 1e-9);
}

#[test]
fn an_inflated_sphere_is_a_larger_sphere() {
    let mut mesh = ring(0.0, FRAC_PI_2, [8, 8]);
    let exterior = sphere_with(&mut mesh);
    // By 0.3 (2 - r) along the radius: 1 goes to 1.3, the ball stays.
    let inner = ring(0.0, FRAC_PI_2, [8, 8]).points.len();
    let moved: Vec<[f64; 3]> = (0..mesh.points.len())
        .map(|node| {
            let p = mesh.points[node];
            let r = p[0].hypot(p[1]);
            let factor = if node < inner && r < 2.0 - 1e-12 {
                0.3 * (2.0 - r) / r
            } else {
                0.0
            };
            p.map(|x| factor * x)
        })
        .collect();
    for motion in [MeshMotion::PulledBack(&moved), MeshMotion::Moved(&moved)] {
        let domain = Domain {
            motion,
            exterior: Some(&exterior),
            ..domain(&mesh, Geometry::Axisymmetric)
        };
        let media = ones(&["upper"]);
        let found = capacitance(domain, &media, &["inner"], &[], &[]).unwrap();
        // Half of 4 pi a; quadratic cells of 1/8 radius.
        assert!(apart(found.matrix[0][0], 2.0 * PI * 1.3) < 1e-4);
    }
}

/// A slab of two layers between plates, with a sheet between them.
fn layered() -> Mesh {
    let (xs, ys) = (even(0.0, 1.0, 2), even(0.0, 1.0, 4));
    let mut mesh = plane(&xs, &ys, &|p| {
        Some(if p[1] < 0.5 { "soft" } else { "hard" })
    });
    name_nodes(&mut mesh, "sheet", &|p| p[1] == 0.5);
    mesh.name_boundary("bottom", |p| p[1] == 0.0);
    mesh.name_boundary("top", |p| p[1] == 1.0);
    mesh
}

#[test]
fn a_floating_sheet_on_an_equipotential_changes_nothing() {
    let mesh = layered();
    let domain = domain(&mesh, Geometry::Plane);
    let media = [
        ("soft", Coefficient::Scalar(2.0)),
        ("hard", Coefficient::Scalar(6.0)),
    ];
    // In series: 1/(0.5/2 + 0.5/6) = 3, exact for linear potentials.
    for floating in [&[][..], &["sheet"]] {
        let found = capacitance(domain, &media, &["top"], floating, &["bottom"]).unwrap();
        assert!(apart(found.matrix[0][0], 3.0) < 1e-12);
        assert!(apart(found.to_ground(0), 3.0) < 1e-12);
        let sheet = mesh.node_sets["sheet"][0] as usize;
        assert!(apart(found.potentials[0][sheet], 0.75) < 1e-12);
    }
    let found = capacitance(domain, &media, &["top", "bottom"], &["sheet"], &[]).unwrap();
    assert!(apart(found.mutual(0, 1), 3.0) < 1e-12);
    assert!(apart(found.differential(0, 1), 3.0) < 1e-12);
    assert!(found.to_ground(0).abs() < 1e-11);
}

#[test]
fn what_cannot_be_solved_is_named() {
    let mesh = layered();
    let field = domain(&mesh, Geometry::Plane);
    let media = ones(&["soft", "hard"]);
    let error = |found: Result<Capacitance, FieldError>| found.unwrap_err();
    let found = capacitance(field, &media, &["roof"], &[], &["bottom"]);
    assert!(matches!(error(found), FieldError::UnknownName { name, .. } if name == "roof"));
    let found = capacitance(field, &media[..1], &["top"], &[], &["bottom"]);
    assert!(matches!(error(found), FieldError::NoCoefficient { region } if region == "hard"));
    let found = capacitance(field, &media, &["top", "hard"], &[], &["bottom"]);
    assert!(matches!(error(found), FieldError::Touching { first, .. } if first == "top"));
    let bad = [media[0], ("hard", Coefficient::Scalar(f64::NAN))];
    let found = capacitance(field, &bad, &["top"], &[], &["bottom"]);
    assert!(matches!(error(found), FieldError::NotPositive { .. }));
    let found = capacitance(field, &media, &[], &["sheet"], &[]);
    assert!(matches!(error(found), FieldError::Undetermined { .. }));
    let solid = domain(&mesh, Geometry::Solid);
    let found = capacitance(solid, &media, &["top"], &[], &["bottom"]);
    assert!(matches!(error(found), FieldError::WrongDimension { .. }));
    // The lower layer is pushed through the bottom.
    let mut moved = vec![[0.0; 3]; mesh.points.len()];
    for &node in &mesh.node_sets["sheet"] {
        moved[node as usize][1] = -0.6;
    }
    for motion in [
        MeshMotion::PulledBack(&moved[..]),
        MeshMotion::Moved(&moved),
    ] {
        let domain = Domain { motion, ..field };
        let found = capacitance(domain, &media, &["top"], &[], &["bottom"]);
        let error = error(found);
        assert!(matches!(&error, FieldError::Inverted { region, .. } if region == "soft"));
        assert!(error.to_string().contains("volume ratio -"), "{error}");
    }
    let short = Domain {
        motion: MeshMotion::Moved(&moved[1..]),
        ..field
    };
    let found = capacitance(short, &media, &["top"], &[], &["bottom"]);
    assert!(matches!(error(found), FieldError::WrongLength { .. }));
}

#[test]
fn a_wrong_outside_is_named() {
    let mut mesh = ring(0.0, FRAC_PI_2, [2, 4]);
    let wrong = Ball {
        radius: 2.1,
        ..BALL
    };
    let found = add_exterior(&mut mesh.clone(), "ball", wrong, 2);
    assert!(matches!(found, Err(FieldError::NotRound { .. })));
    let exterior = sphere_with(&mut mesh);
    let moved = vec![[0.0, 1e-3, 0.0]; mesh.points.len()];
    let domain = Domain {
        motion: MeshMotion::Moved(&moved),
        exterior: Some(&exterior),
        ..domain(&mesh, Geometry::Axisymmetric)
    };
    let found = capacitance(domain, &ones(&["upper"]), &["inner"], &[], &[]);
    assert!(matches!(found, Err(FieldError::OutsideMoves { .. })));
}

#[test]
fn a_part_that_no_conductor_reaches_is_counted() {
    let mesh = plane(&even(0.0, 3.0, 3), &[0.0, 1.0], &|p| match p[0] {
        x if x < 1.0 => Some("left"),
        x if x > 2.0 => Some("right"),
        _ => None,
    });
    let mut mesh = mesh;
    mesh.name_boundary("end", |p| p[0] == 0.0);
    mesh.name_boundary("face", |p| p[0] == 1.0);
    let field = domain(&mesh, Geometry::Plane);
    let media = ones(&["left", "right"]);
    let found = capacitance(field, &media, &["end"], &[], &["face"]);
    assert_eq!(found.unwrap_err(), FieldError::Undetermined { unknowns: 9 });
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn a_maxwell_matrix_is_symmetric_dominant_and_equal_from_energy_and_flux(
        media in prop::collection::vec(1.0..20.0_f64, 2),
        cuts in (0.1..0.3_f64, 0.4..0.6_f64, 0.7..0.9_f64),
    ) {
        let xs = line(
            Sizes { growth: 2.0, largest: 0.1 },
            &[(0.0, None), (cuts.0, Some(0.01)), (cuts.1, Some(0.01)), (cuts.2, Some(0.01)), (1.0, None)],
        );
        let mut mesh = plane(&xs, &even(0.0, 1.0, 6), &|p| {
            Some(if p[1] < 0.5 { "lower" } else { "upper" })
        });
        name_nodes(&mut mesh, "first", &|p| p[1] == 0.5 && p[0] <= cuts.0);
        name_nodes(&mut mesh, "second", &|p| p[1] == 0.5 && p[0] >= cuts.1 && p[0] <= cuts.2);
        mesh.name_boundary("third", |p| p[1] == 1.0);
        let media = [
            ("lower", Coefficient::Scalar(media[0])),
            ("upper", Coefficient::Scalar(media[1])),
        ];
        let field = domain(&mesh, Geometry::Plane);
        let names = ["first", "second", "third"];
        let found = capacitance(field, &media, &names, &[], &[]).unwrap();
        prop_assert!(found.mismatch() < 1e-10);
        let largest = found.matrix[0][0];
        for i in 0..3 {
            // Nothing at zero: a common potential has no field.
            prop_assert!(found.to_ground(i).abs() < 1e-10 * largest);
            for j in 0..i {
                prop_assert!(found.mutual(i, j) > 0.0);
                prop_assert!((found.by_flux[i][j] - found.by_flux[j][i]).abs() < 1e-10 * largest);
            }
        }
        // Grounding the last one takes its row and column away.
        let part = capacitance(field, &media, &names[..2], &[], &names[2..]).unwrap();
        for i in 0..2 {
            for j in 0..2 {
                prop_assert!((part.matrix[i][j] - found.matrix[i][j]).abs() < 1e-10 * largest);
            }
        }
    }
}
