//! Every row of the P1 reference tables, computed elsewhere: the layer model
//! with 40 digits, the fields by finite and boundary elements.
#![allow(clippy::unwrap_used)]

use crate::common::{Row, UM, assert_near, table};
use taxel::mechanics::{
    CompressedLayer, ElectrodeModulus, ElectrodeStiffness, Electrodes, EndCondition, GivenFactor,
    LayerKinematics, PublishedThinning, TopFace,
};
use taxel::transduction::{
    CapacitanceLaw, Dielectric, InPlaneModel, PublishedFit, PublishedFringe, Surroundings,
    VACUUM_PERMITTIVITY, coplanar_strips, facing_sides,
};

/// Layer of the paper with a loaded length of `aspect` thicknesses.
fn layer(aspect: f64, end_condition: EndCondition) -> CompressedLayer {
    CompressedLayer {
        thickness: 950e-6,
        youngs_modulus: 1.2e6,
        contact_half_length: aspect * 950e-6,
        contact_depth: 3e-3,
        top: TopFace::Frictionless,
        end_condition,
        end_scale: 1.0,
    }
}

fn electrodes(gap: f64, modulus_ratio: f64) -> Electrodes {
    let youngs_modulus = modulus_ratio * 1.2e6;
    Electrodes {
        gap,
        thickness: 100e-6,
        height: 550e-6,
        width: 1e-3,
        depth: 3e-3,
        stiffness: if modulus_ratio == 1.0 {
            ElectrodeStiffness::AsLayer
        } else {
            ElectrodeStiffness::Modulus(ElectrodeModulus { youngs_modulus })
        },
    }
}

fn device(gap: f64, modulus_ratio: f64, surroundings: Surroundings) -> InPlaneModel {
    // Table 1 of the paper: gap in um, n, q, γ.
    let (rate, scale, exponent) = match (gap * 1e6).round() {
        20.0 => (25.0, 1.85, -0.4),
        50.0 => (10.0, 2.65, -0.3),
        _ => (5.0, 0.65, -0.3),
    };
    InPlaneModel {
        layer: layer(1750.0 / 950.0, EndCondition::Free),
        electrodes: electrodes(gap, modulus_ratio),
        dielectric: Dielectric {
            permittivity: 2.4,
            surroundings,
        },
        published_fit: Some(PublishedFit {
            thinning: PublishedThinning {
                least_thickness: 0.7,
                rate,
            },
            fringe: PublishedFringe { scale, exponent },
        }),
        law: CapacitanceLaw::Mechanics,
        stray_capacitance: 0.0,
        solved: None,
        table: None,
    }
}

#[test]
fn layer_kinematics_table() {
    for row in table("p1_layer_kinematics.csv") {
        let e = row.at("U_over_H");
        let kinematics = LayerKinematics::new(e).unwrap();
        let mid = 600.0 / 950.0;
        let thickness = kinematics.slab(550.0 / 950.0, 650.0 / 950.0) * 9.5;
        for (value, column) in [
            (kinematics.unknown(), "a"),
            (kinematics.top_stretch(), "lambda"),
            (kinematics.stretch(0.5), "f_0p5"),
            (kinematics.stretch(mid), "f_mid"),
            (kinematics.height(0.5), "g_0p5"),
            (kinematics.height(mid), "g_mid"),
            (thickness, "t_over_T"),
        ] {
            // As the physics asks; the table has 13 digits.
            assert_near(
                value,
                row.at(column),
                1e-12,
                0.0,
                &format!("{column} at {e}"),
            );
        }
    }
}

#[test]
fn layer_force_table() {
    for row in table("p1_layer_force.csv") {
        let (e, aspect) = (row.at("U_over_H"), row.at("ell"));
        let chi = row.at("chi");
        let kinematics = LayerKinematics::new(e).unwrap();
        let what = format!("e = {e}, ell = {aspect}, chi = {chi}");
        // As the physics asks; the table has 13 digits.
        let constant = kinematics.pressure_constant(aspect, chi);
        assert_near(constant, row.at("Pi_over_mu"), 1e-11, 0.0, &what);
        let stress = kinematics.mean_stress(aspect, chi);
        assert_near(stress, row.at("sbar_over_mu"), 1e-11, 0.0, &what);
        // The same through the layer with its units.
        let state = layer(aspect, EndCondition::Given(GivenFactor { chi }))
            .compress(e)
            .unwrap();
        let force = row.at("sbar_over_mu") * 0.4e6 * 2.0 * aspect * 950e-6 * 3e-3;
        assert_near(state.force, force, 1e-11, 0.0, &what);
    }
}

/// Bonded layer under uniform compression, table of the look-up values that
/// the paper takes from its reference 7.
#[test]
fn look_up_table_of_the_unknown() {
    for (e, unknown, stretch) in [
        (0.01, 0.17320433, 1.01518968),
        (0.02, 0.24494472, 1.03076766),
        (0.05, 0.38725542, 1.07997305),
        (0.10, 0.54747142, 1.17117488),
        (0.15, 0.67010411, 1.27590565),
        (0.20, 0.77307418, 1.39710223),
        (0.25, 0.86327038, 1.53856676),
        (0.30, 0.94417987, 1.70529910),
        (0.35, 1.01783171, 1.90399185),
        (0.40, 1.08550713, 2.14378730),
        (0.50, 1.20605625, 2.80342540),
    ] {
        let kinematics = LayerKinematics::new(e).unwrap();
        // Half of the last printed digit.
        assert_near(kinematics.unknown(), unknown, 0.0, 5e-9, "unknown");
        assert_near(kinematics.top_stretch(), stretch, 0.0, 5e-9, "stretch");
    }
}

/// Comparison of the end conditions with tables of finite elements.
fn against_finite_elements(name: &str, end: EndCondition, allowed: impl Fn(&Row) -> [f64; 2]) {
    for row in table(name) {
        let (e, aspect) = (row.at("U_over_H"), row.at("ell"));
        let state = layer(aspect, end).compress(e).unwrap();
        let ratio = row.at("sbar_over_mu_fe") * 0.4e6 / state.mean_stress;
        let [least, most] = allowed(&row);
        let inside = (least..=most).contains(&ratio);
        assert!(inside, "ell {aspect}, e {e}: fe/model {ratio}");
    }
}

#[test]
fn free_ends_against_finite_elements() {
    // The table's own ratio, printed with four digits; its forces with four.
    against_finite_elements("p1_fe_free_layer_contact.csv", EndCondition::Free, |row| {
        let ratio = row.at("fe_over_model");
        [ratio * 0.999, ratio * 1.001]
    });
}

#[test]
fn short_layer_against_finite_elements() {
    against_finite_elements(
        "p1_fe_free_layer_contact.csv",
        EndCondition::ShortLayer,
        |row| {
            // ell = 1 and 2 are interpolated in this table: its own rounding.
            // From ell = 5 on: the table's ratio to the rule 1 − 0.25/ell, which
            // lies within 2.3 %. (At ell = 2 the rule would be off by 0.908 to
            // 1.029.)
            let ratio = row.at("fe_over_model_rule");
            if row.at("ell") <= 2.0 {
                return [0.999, 1.001];
            }
            assert!((0.977..=1.023).contains(&ratio), "{ratio}");
            [ratio * 0.999, ratio * 1.001]
        },
    );
}

/// Finite elements of section 13 of the theory, electrodes as soft as the layer:
/// `taxel predict --mechanics fem` with a half length of 2850 um, 10 mm deep.
#[test]
fn short_layer_between_its_table_and_its_rule() {
    for (e, force) in [
        (0.02, 6.038),
        (0.05, 15.994),
        (0.1, 35.774),
        (0.2, 96.174),
        (0.3, 206.43),
        (0.4, 420.29),
    ] {
        let mean_stress = force / (2.0 * 2850e-6 * 10e-3);
        let state = layer(3.0, EndCondition::ShortLayer).compress(e).unwrap();
        let ratio = mean_stress / state.mean_stress;
        // The rule 1 − 0.25 H/L alone would give 0.964 to 1.018.
        assert!((0.985..=1.01).contains(&ratio), "{e}: {ratio}");
    }
}

#[test]
fn wide_layer_against_finite_elements() {
    // The condition interpolates this table: its own rounding at the nodes.
    against_finite_elements("p1_fe_punch_force.csv", EndCondition::WideLayer, |_| {
        [0.9995, 1.0005]
    });
}

/// The force of the whole sensor, 3.5 mm wide, with its electrodes in it.
#[test]
fn force_of_the_sensor_against_finite_elements() {
    for row in table("p1_fe_sensor.csv") {
        let e = row.at("U_over_H");
        if e == 0.0 {
            continue;
        }
        let state = layer(1750.0 / 950.0, EndCondition::ShortLayer)
            .compress(e)
            .unwrap();
        let ratio = row.at("sbar_over_mu") * 0.4e6 / state.mean_stress;
        // Elements to 0.5 %, and a length between those of the table. Electrodes
        // of another modulus stiffen the layer, which the model does not know:
        // measured for wide and narrow electrodes, and stated, not hidden.
        let allowed = match (row.text("Ee_over_Ed"), row.text("b")) {
            ("1", _) => 0.996..=1.010,
            ("1.75", "1000") => 1.038..=1.058,
            ("1.75", _) => 1.007..=1.022,
            _ => 1.12..=1.15,
        };
        assert!(
            allowed.contains(&ratio),
            "{} at {e}: {ratio}",
            row.text("D")
        );
    }
}

#[test]
fn published_law_table() {
    for row in table("p1_eq7_curves.csv") {
        let gap = row.si("D", UM);
        let e = row.at("U_over_H");
        let model = device(gap, 1.75, Surroundings::Uniform);
        let layer = model.layer.compress(e).unwrap();
        let fit = model.published_fit.unwrap();
        let deformed =
            model
                .electrodes
                .deform_as_published(&model.layer, &layer.kinematics, &fit.thinning);
        let what = format!("D = {gap}, e = {e}");
        let per_depth = model.dielectric.scale(model.electrodes.depth);
        // As the physics asks; the table has 12 digits.
        for (value, column) in [
            (deformed.thickness / 100e-6, "t_over_T_eq8"),
            (deformed.gap / gap, "d_over_D"),
            (
                model.change_of_parallel_plates(&layer).unwrap() / per_depth,
                "pp_term",
            ),
            (fit.fringe.change(1.0, e * 950e-6 / gap), "factor_q"),
            (
                model.change_as_published(&layer).unwrap() / per_depth,
                "dC_over",
            ),
        ] {
            assert_near(
                value,
                row.at(column),
                1e-10,
                0.0,
                &format!("{column} {what}"),
            );
        }
    }
}

/// Thin coplanar strips in an unbounded medium, width over gap.
#[test]
fn coplanar_strips_table() {
    for (width, expected) in [
        (0.1, 0.830644062),
        (0.5, 1.27926157),
        (1.0, 1.56340192),
        (2.0, 1.90067024),
        (5.0, 2.40777018),
        (10.0, 2.82038435),
        (20.0, 3.24658110),
        (50.0, 3.82060377),
        (100.0, 4.25872722),
    ] {
        // Half of the last printed digit.
        assert_near(coplanar_strips(1.0, width), expected, 2e-9, 0.0, "strips");
    }
}

#[test]
fn undeformed_capacitance_table() {
    let dielectric = Dielectric {
        permittivity: 2.4,
        surroundings: Surroundings::Uniform,
    };
    for row in table("p1_cap_undeformed.csv") {
        let bars = taxel::mechanics::DeformedElectrodes {
            gap: row.si("D", UM),
            thickness: row.si("T", UM),
            width: row.si("b", UM),
        };
        let ours = dielectric.uniform(&bars, 1.0) / dielectric.scale(1.0);
        let what = format!("T {}, D {}, b {}", row.at("T"), row.at("D"), row.at("b"));
        // The table has seven digits.
        assert_near(facing_sides(&bars), row.at("parallel"), 1e-7, 0.0, &what);
        assert_near(ours, row.at("approx"), 1e-6, 0.0, &what);
        // What the closed form lacks of the full field.
        let low = 1.0 - ours / row.at("C_over_eps");
        let allowed = match row.at("b") / row.at("T") {
            wide if wide >= 10.0 => 0.0075..=0.022,
            1.0 => 0.0327..=0.080,
            _ => 0.015..=0.111,
        };
        assert!(allowed.contains(&low), "{what}: {low}");
    }
}

#[test]
fn deformed_electrodes_table() {
    let mut seen = 0;
    for row in table("p1_fe_sensor.csv") {
        let (gap, ratio, e) = (row.si("D", UM), row.at("Ee_over_Ed"), row.at("U_over_H"));
        if row.at("b") != 1000.0 {
            continue;
        }
        seen += 1;
        let what = format!("D {gap}, Ee/Ed {ratio}, e {e}");
        let layer = layer(1750.0 / 950.0, EndCondition::Free);
        let electrodes = electrodes(gap, ratio);
        let kinematics = LayerKinematics::new(e).unwrap();
        let deformed = electrodes.deform(&layer, &kinematics).unwrap();
        let middle = 1.0 + layer.stretch_excess(&kinematics, electrodes.middle());
        // Five printed decimals.
        assert_near(middle, row.at("f_mid"), 0.0, 5.1e-6, &what);
        // The tables of factors have four decimals of a stretch below 0.61; a
        // layer as soft as its electrodes is closed form against elements,
        // 0.05 % for gap and thickness. The width there is up to 0.6 % of f,
        // because the mean over its depth is not the value at mid-height.
        let allowed = if ratio == 1.0 { 5e-4 } else { 5e-5 };
        assert_near(
            deformed.gap / gap,
            row.at("d_mean_over_D"),
            allowed,
            0.0,
            &what,
        );
        let thickness = deformed.thickness / electrodes.thickness;
        assert_near(
            thickness,
            row.at("t_face_over_T"),
            2.0 * allowed,
            0.0,
            &what,
        );
        let wide = if ratio == 1.0 { 6e-3 } else { allowed };
        let width = deformed.width / electrodes.width;
        assert_near(width, row.at("b_ratio"), wide, 0.0, &what);
    }
    assert_eq!(seen, 55);
}

#[test]
fn change_against_the_full_field() {
    for row in table("p1_fe_sensor.csv") {
        let (gap, ratio, e) = (row.si("D", UM), row.at("Ee_over_Ed"), row.at("U_over_H"));
        if row.at("b") != 1000.0 || e == 0.0 {
            continue;
        }
        let model = device(gap, ratio, Surroundings::Uniform);
        let state = model.respond(e).unwrap();
        let scale = model.dielectric.scale(model.electrodes.depth);
        let rest = match row.text("D") {
            "20" => 8.90682,
            "50" => 5.33232,
            _ => 3.90534,
        };
        let field = rest - row.at("C_over_eps");
        // The facing sides alone, on the electrodes of the elements themselves:
        // the change of the field is nearly theirs. Measured on this table,
        // 0.99496 (20 um) to 1.10710 (100 um), and rounded outwards.
        let sides = (1.0 - row.at("t_face_over_T") / row.at("d_mean_over_D")) * 100e-6 / gap;
        let of_sides = field / sides;
        assert!((0.994..=1.108).contains(&of_sides), "{gap} {e}: {of_sides}");
        let found = state.change / scale / field;
        // Facing sides and thin strips stand for the field of thick bars of
        // unequally stretched width and gap. Measured, and no more is claimed:
        // 0.7 % low to 3.4 % high, 8.5 % high for electrodes 3.5 times as stiff.
        let allowed = if ratio > 2.0 {
            1.07..=1.086
        } else {
            0.993..=1.034
        };
        assert!(
            allowed.contains(&found),
            "D {gap}, ratio {ratio}, e {e}: {found}"
        );
    }
}

fn surroundings(name: &str) -> Option<Surroundings> {
    Some(match name {
        "uniform" => Surroundings::Uniform,
        "air_above" => Surroundings::AirAbove,
        "air_above_glass_below" => Surroundings::AirAboveGlassBelow,
        "air_above_below" => Surroundings::AirAboveBelow,
        "grounded_base" => Surroundings::GroundedBase,
        "grounded_base_mutual" => Surroundings::GroundedBaseMutual,
        "grounded_base_uniform" => Surroundings::GroundedBaseUniform,
        "grounded_base_uniform_mutual" => Surroundings::GroundedBaseUniformMutual,
        _ => return None,
    })
}

/// Statements of the pages and the shipped files.
#[test]
fn surroundings_matter() {
    let rows = table("p1_cap_surroundings.csv");
    let change = |gap: &str, e: &str, kind: &str| {
        let at = |e: &str| {
            let row = rows.iter().find(|row| {
                row.text("D") == gap
                    && row.text("U_over_H") == e
                    && row.text("surroundings") == kind
            });
            row.unwrap().at("C_over_eps0")
        };
        at("0") - at(e)
    };
    for (gap, e, kind, percent) in [
        ("20", "0.05", "air_above", 4.0),
        ("20", "0.2", "air_above", 5.0),
        ("50", "0.05", "air_above", 8.0),
        ("50", "0.2", "air_above", 11.0),
        ("100", "0.05", "air_above", 16.0),
        ("100", "0.2", "air_above", 20.0),
        ("100", "0.2", "grounded_base", -57.0),
    ] {
        let found = 100.0 * (change(gap, e, kind) / change(gap, e, "uniform") - 1.0);
        // Whole per cent are said; the table's differences are good to 0.5 %.
        assert_near(found, percent, 0.0, 0.6, &format!("{gap} {e} {kind}"));
    }
}

#[test]
fn surroundings_table() {
    let rows = table("p1_cap_surroundings.csv");
    for row in &rows {
        let kind = surroundings(row.text("surroundings")).unwrap();
        let uniform = rows
            .iter()
            .find(|other| {
                other.text("surroundings") == "uniform"
                    && other.text("D") == row.text("D")
                    && other.text("U_over_H") == row.text("U_over_H")
            })
            .unwrap();
        let expected = row.at("C_over_eps0") - uniform.at("C_over_eps0");
        let offset = kind.offset(row.at("D") / 100.0, row.at("U_over_H"), 1.0);
        // Four printed decimals.
        assert_near(
            offset / VACUUM_PERMITTIVITY,
            expected,
            0.0,
            1e-9,
            row.text("D"),
        );
        if row.at("U_over_H") == 0.0 {
            continue;
        }
        let rest = rows
            .iter()
            .find(|other| {
                other.text("surroundings") == row.text("surroundings")
                    && other.text("D") == row.text("D")
                    && other.at("U_over_H") == 0.0
            })
            .unwrap();
        let model = device(row.si("D", UM), 1.75, kind);
        let change = model.respond(row.at("U_over_H")).unwrap().change;
        let field = rest.at("C_over_eps0") - row.at("C_over_eps0");
        let uniform_rest = rows
            .iter()
            .find(|other| {
                other.text("surroundings") == "uniform"
                    && other.text("D") == row.text("D")
                    && other.at("U_over_H") == 0.0
            })
            .unwrap();
        let uniform_field = uniform_rest.at("C_over_eps0") - uniform.at("C_over_eps0");
        // The surroundings come from this table; what is left is the error of
        // the closed form in a uniform medium (change_against_the_full_field).
        let ours = change / VACUUM_PERMITTIVITY / 3e-3 - field;
        let share = ours / uniform_field;
        assert!((0.015..=0.034).contains(&share), "{ours} {share}");
    }
}
