//! Fields of magnets and the deviations of their positions against independent programs.

use taxel::transduction::{
    CuboidMagnet, CylinderMagnet, MagnetPose, MagnetShape, SphereMagnet, VACUUM_PERMEABILITY,
};

/// Rows of a table below its head and its comments.
fn rows(text: &str) -> Vec<Vec<f64>> {
    let lines = text.lines().filter(|line| !line.starts_with('#')).skip(1);
    lines
        .map(|line| {
            line.split(',')
                .map(|cell| cell.parse().unwrap_or(f64::NAN))
                .collect()
        })
        .collect()
}

fn position(row: &[f64]) -> MagnetPose {
    MagnetPose {
        position: [row[0] * 1e-3, row[1] * 1e-3, row[2] * 1e-3],
        tilt: [row[3] * 1e-3, row[4] * 1e-3],
    }
}

#[test]
fn magnets_of_all_shapes_have_the_fields_of_magpylib() {
    let text = include_str!("../reference/own_magnet_shapes.csv");
    let kinds = text.lines().filter(|line| !line.starts_with('#')).skip(1);
    let mut count = 0;
    for (kind, row) in kinds.zip(rows(text)) {
        let [first, second, third] = [row[1], row[2], row[3]];
        let shape = match kind.split(',').next() {
            Some("cylinder") => MagnetShape::Cylinder(CylinderMagnet {
                diameter: first,
                height: second,
            }),
            Some("cuboid") => MagnetShape::Cuboid(CuboidMagnet {
                sides: [first, second, third],
            }),
            _ => MagnetShape::Sphere(SphereMagnet { diameter: first }),
        };
        let pose = MagnetPose {
            position: [row[5], row[6], row[7]],
            tilt: [row[8], row[9]],
        };
        let found = shape
            .field(row[4], &pose, [row[10], row[11], row[12]])
            .field;
        let size = row[13].hypot(row[14]).hypot(row[15]);
        for (found, expected) in found.iter().zip(&row[13..]) {
            // Four lengths away the field is 1e-3 of the terms that it is the difference of, each
            // rounded to 1e-16 in both programs.
            assert!(
                (found - expected).abs() < 1e-11 * size,
                "{kind}: {found} {expected}"
            );
        }
        count += 1;
    }
    assert_eq!(count, 30);
}

/// Fields of all rows, and the deviations of x, y, z and both tilts from the Fisher information of
/// all sensors together.
fn reproduces(text: &str, disc: CylinderMagnet, remanence: f64, noise: f64, sensors: &[[f64; 2]]) {
    let cylinder = MagnetShape::Cylinder(disc);
    let moment = remanence * cylinder.volume() / VACUUM_PERMEABILITY;
    let diameter = (6.0 * cylinder.volume() / std::f64::consts::PI).cbrt();
    let dipole = MagnetShape::Sphere(SphereMagnet { diameter });
    let head = text
        .split("moment = remanence x volume/mu0 = ")
        .nth(1)
        .unwrap();
    let stated: f64 = head.split(' ').next().unwrap().parse().unwrap();
    assert!((moment / stated - 1.0).abs() < 1e-12, "{moment} {stated}");
    let rows = rows(text);
    for of_pose in rows.chunks(sensors.len()) {
        let pose = position(&of_pose[0][2..7]);
        let (mut jacobian, mut scale) = (Vec::new(), 0.0_f64);
        for (row, [x, y]) in of_pose.iter().zip(sensors) {
            let point = [x * 1e-3, y * 1e-3, 0.0];
            let [of_dipole, of_cylinder] =
                [dipole, cylinder].map(|shape| shape.field(remanence, &pose, point));
            for axis in 0..3 {
                for (found, expected) in
                    [(&of_dipole, row[7 + axis]), (&of_cylinder, row[10 + axis])]
                {
                    let found = found.field[axis] * 1e6;
                    // The columns have ten to twelve digits of the largest component, and the dipole
                    // as a ball of the same moment has the rounding of a cube root.
                    let size = row[7..10].iter().fold(0.0_f64, |a, b| a.max(b.abs()));
                    assert!(
                        (found - expected).abs() < 1e-9 * size,
                        "{row:?}: {found} {expected}"
                    );
                }
                jacobian.push(of_dipole.by_pose[axis]);
                scale = scale.max(of_dipole.field[axis].abs());
            }
        }
        let unknown = |name| taxel::information::Unknown {
            name,
            dimension: &taxel::quantity::LENGTH,
            full_scale: 1.0,
            beside: false,
        };
        let information = taxel::information::Information {
            unknowns: ["x", "y", "z", "tilt_x", "tilt_y"].map(unknown).into(),
            noise: vec![noise; jacobian.len()],
            jacobian: jacobian.iter().map(|row| row.to_vec()).collect(),
            prior: vec![0.0; 5],
        };
        let covariance = information.covariance().unwrap();
        let units = [1e6, 1e6, 1e6, 1e3, 1e3];
        for (unknown, unit) in units.into_iter().enumerate() {
            let found = covariance[unknown][unknown].sqrt() * unit;
            let expected = of_pose[0][13 + unknown];
            // Ten digits are printed; the condition of the Fisher matrix is below 1e4.
            assert!(
                (found / expected - 1.0).abs() < 1e-8,
                "{unknown}: {found} {expected}"
            );
        }
    }
}

#[test]
fn every_row_of_the_disc_over_four_sensors() {
    reproduces(
        include_str!("../reference/own_magnet.csv"),
        CylinderMagnet {
            diameter: 3e-3,
            height: 1e-3,
        },
        1.2,
        0.5e-6,
        &[[2.0, 2.0], [-2.0, 2.0], [-2.0, -2.0], [2.0, -2.0]],
    );
}

#[test]
fn every_row_of_the_disc_over_five_sensors() {
    reproduces(
        include_str!("../reference/own_magnet_five.csv"),
        CylinderMagnet {
            diameter: 3e-3,
            height: 2e-3,
        },
        1.3,
        0.3e-6,
        &[[0.0, 0.0], [7.5, 0.0], [0.0, 7.5], [-7.5, 0.0], [0.0, -7.5]],
    );
}
