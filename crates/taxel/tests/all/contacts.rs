//! Contacts of a simulator: the force is kept, and a soft cover spreads it as the reference table
//! says.
#![allow(clippy::unwrap_used)]

use crate::common::commented_table;
use proptest::prelude::*;
use taxel::contacts::{ContactSpread, PointContact};
use taxel::sensor::Sensor;

#[test]
fn a_contact_lights_the_neighbours_as_the_reference_table_of_p3() {
    let (_, rows) = commented_table("p3_layer_transmission.csv");
    let mut compared = 0;
    for row in rows {
        let [depth, radius, side] =
            ["h_m", "contact_radius_m", "element_side_m"].map(|name| row.at(name));
        let [dx, dy, share] = ["dx_m", "dy_m", "share_of_force"].map(|name| row.at(name));
        let text = Sensor::shipped_text("piezo-1.5mm").unwrap();
        let text = text
            .replace(
                "thickness = \"1.5 mm\"",
                &format!("thickness = \"{} mm\"", 2e3 * depth),
            )
            .replace("side = \"2 mm\"", &format!("side = \"{} mm\"", 1e3 * side));
        // Thick covers leave no room for a plate of this pitch; those are of no device.
        let Ok(sensor) = Sensor::parse("piezo.toml", &text) else {
            continue;
        };
        let spread = ContactSpread::new(&sensor, radius).unwrap();
        let [x, y] = spread.layout().flat_position(5);
        let contact = PointContact {
            point: [x + dx, y + dy, 0.0],
            force: [0.0, 0.0, -2.0],
        };
        let loads = spread.loads(&[contact]);
        let found = loads.taxels[5][2] / 2.0;
        // The fast table of shares: below 2e-4 (tests of the table itself).
        assert!(
            (found - share).abs() < 2e-4,
            "{depth} {radius} {dx} {dy}: {found} and not {share}"
        );
        assert!(loads.taxels.iter().filter(|load| load[2] > 0.0).count() > 3);
        compared += 1;
    }
    assert!(compared >= 20, "{compared}");
}

#[test]
fn without_a_cover_the_taxel_below_is_pressed_and_beyond_the_edge_none() {
    for name in [
        "in-plane-50um",
        "three-axis-8x8",
        "liquid-metal-2x4",
        "force-4x4",
    ] {
        let sensor = Sensor::shipped(name).unwrap();
        let layout = sensor.layout();
        let force = [0.25, -0.5, -2.0];
        for taxel in 0..layout.taxels() {
            let [x, y] = layout.flat_position(taxel);
            let point = [x + 0.3 * layout.pitch[0], y - 0.3 * layout.pitch[1], 0.0];
            let loads = sensor
                .loads_from_contacts(&[PointContact { point, force }], 0.0)
                .unwrap();
            for (other, load) in loads.taxels.iter().enumerate() {
                let expected = if other == taxel {
                    [0.25, -0.5, 2.0]
                } else {
                    [0.0; 3]
                };
                assert_eq!(*load, expected, "{name} {taxel} {other}");
            }
            assert_eq!(loads.beside, [0.0; 3]);
        }
        let point = [layout.pitch[0] * layout.columns as f64, 0.0, 0.0];
        let loads = sensor
            .loads_from_contacts(&[PointContact { point, force }], 0.0)
            .unwrap();
        assert_eq!(loads.beside, force, "{name}");
        assert!(loads.taxels.iter().all(|load| *load == [0.0; 3]));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn the_total_force_is_kept(
        device in 0_usize..4,
        bent: bool,
        radius in 0.0_f64..4e-3,
        contacts in prop::collection::vec((prop::array::uniform2(-1.2_f64..1.2), prop::array::uniform3(-5.0_f64..5.0)), 1..6),
    ) {
        let name = ["in-plane-50um", "three-axis-8x8", "piezo-1.5mm", "liquid-metal-2x4"][device];
        let mut text = Sensor::shipped_text(name).unwrap().to_owned();
        if bent {
            text = text.replace("mount = \"flat\"", "mount = { cylinder = { radius = \"20 mm\" } }");
        }
        let sensor = Sensor::parse(name, &text).unwrap();
        let spread = ContactSpread::new(&sensor, radius).unwrap();
        let layout = spread.layout();
        let half = [0.5 * layout.pitch[0] * layout.columns as f64, 0.5 * layout.pitch[1] * layout.rows as f64];
        let contacts: Vec<PointContact> = contacts
            .iter()
            .map(|([x, y], force)| PointContact { point: [x * half[0], y * half[1], 0.0], force: *force })
            .collect();
        let loads = spread.loads(&contacts);
        let mut sum = loads.beside;
        for (taxel, load) in loads.taxels.iter().enumerate() {
            let [x, y, pressing] = layout.wrench(taxel, *load).force;
            for (sum, part) in sum.iter_mut().zip([x, y, -pressing]) {
                *sum += part;
            }
        }
        for axis in 0..3 {
            let total: f64 = contacts.iter().map(|contact| contact.force[axis]).sum();
            prop_assert!((sum[axis] - total).abs() < 1e-9, "{sum:?} {total}");
        }
    }
}
