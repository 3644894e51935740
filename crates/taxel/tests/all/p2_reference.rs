//! Every row of the P2 reference tables, computed elsewhere with 60 digits.
//!
//! The tolerances are those that section 11 of the physics of P2 asks for.
#![allow(clippy::unwrap_used)]

use crate::common::{CAPACITORS, FF, MN, NM, Row, UM, assert_near, table};
use std::collections::HashMap;
use taxel::estimation::{SearchOptions, estimate_unit};
use taxel::mechanics::{Relaxation, RelaxationTerm, Suspension};
use taxel::transduction::ThreeAxisModel;
use taxel::transduction::{Plates, VACUUM_PERMITTIVITY, mean_inverse_gap};

fn units() -> HashMap<String, ThreeAxisModel> {
    let model = |row: &Row| {
        assert_eq!(row.at("eps0_F_per_m"), VACUUM_PERMITTIVITY);
        let k = [
            row.at("k_x_N_per_m"),
            row.at("k_y_N_per_m"),
            row.at("k_z_N_per_m"),
        ];
        ThreeAxisModel {
            suspension: Suspension {
                compliance: [
                    [1.0 / k[0], 0.0, 0.0],
                    [0.0, 1.0 / k[1], 0.0],
                    [0.0, 0.0, 1.0 / k[2]],
                ],
                centre_distance: row.si("L_um", UM),
                tile_tilt: row.at("eta"),
                bump_sinking: [0.0; 2],
                bulge: [0.0; 3],
            },
            plates: Plates {
                electrode: [row.si("a_um", UM), row.si("b_um", UM)],
                air_gap: CAPACITORS.map(|c| row.si(&format!("d_air{c}_um"), UM)),
                insulation_gap: row.si("d_ins_um", UM) / row.at("eps_ins"),
                parallel_capacitance: CAPACITORS.map(|c| row.si(&format!("C_par{c}_fF"), FF)),
                edges: None,
            },
        }
    };
    table("p2_params.csv")
        .iter()
        .map(|row| (row.text("set").to_owned(), model(row)))
        .collect()
}

#[test]
fn tilted_plate_table() {
    for row in table("p2_tilted_plate.csv") {
        let (a, b) = (row.si("a_um", UM), row.si("b_um", UM));
        let (x, y) = (row.at("slope_x"), row.at("slope_y"));
        let m = mean_inverse_gap(
            row.si("gap_equiv_um", UM),
            x.abs() * a / 2.0,
            y.abs() * b / 2.0,
        );
        let m = m.unwrap().value;
        let what = format!("slopes {x} {y}");
        let capacitance = VACUUM_PERMITTIVITY * a * b * m;
        assert_near(capacitance, row.si("C_fF", FF), 1e-12, 0.0, &what);
        assert_near(1.0 / m, row.si("egd_um", UM), 1e-12, 0.0, &what);
    }
}

#[test]
fn forward_table() {
    let units = units();
    for (line, row) in table("p2_forward.csv").iter().enumerate() {
        let unit = &units[row.text("set")];
        let force = ["Fx_mN", "Fy_mN", "Fz_mN"].map(|c| row.si(c, MN));
        let (deformation, response) = unit.predict(force);
        let what = format!("row {line} {} {force:?}", row.text("set"));
        for (axis, column) in ["d_x_nm", "d_y_nm", "d_z_nm"].into_iter().enumerate() {
            assert_near(
                deformation.displacement[axis],
                row.si(column, NM),
                1e-12,
                0.0,
                &what,
            );
        }
        let capacitance = response.capacitance();
        for (i, c) in CAPACITORS.into_iter().enumerate() {
            assert_near(
                capacitance[i],
                row.si(&format!("C{c}_fF"), FF),
                1e-12,
                0.0,
                &what,
            );
        }
        // The least gap is a difference of micrometres: absolute to 1e-12 of 6 um.
        let air = row.si("min_air_gap_um", UM);
        assert_near(response.least_air_gap(), air, 1e-12, 6e-18, &what);

        let motion = unit.effective_motion(unit.rest(), capacitance);
        let force = unit.effective_force(unit.rest(), capacitance).unwrap();
        for (axis, column) in ["egd_Fx_mN", "egd_Fy_mN", "egd_Fz_mN"]
            .into_iter()
            .enumerate()
        {
            // Forces that vanish by symmetry: 1e-12 of the full scale of 20 mN.
            assert_near(force[axis], row.si(column, MN), 1e-12, 2e-14, &what);
        }
        assert_near(
            motion.twist,
            row.si("egd_twist_nm", NM),
            1e-12,
            1e-18,
            &what,
        );
    }
}

#[test]
fn inverse_table() {
    let units = units();
    for (line, row) in table("p2_inverse.csv").iter().enumerate() {
        let unit = &units[row.text("set")];
        let measured = CAPACITORS.map(|c| row.si(&format!("C{c}_fF"), FF));
        let sigma = [row.si("sigma_fF", FF); 4];
        let found = estimate_unit(unit, measured, sigma, [true; 4], &SearchOptions::default());
        let what = format!("row {line} {found:?}");
        let deviation = found.deviation();
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            // 1e-7 mN.
            assert_near(
                found.force[axis],
                row.si(&format!("F{name}_mN"), MN),
                0.0,
                1e-10,
                &what,
            );
            let expected = row.si(&format!("std_F{name}_mN"), MN);
            assert_near(deviation[axis], expected, 1e-6, 0.0, &what);
        }
        for (a, b, column) in [(0, 1, "corr_xy"), (0, 2, "corr_xz"), (1, 2, "corr_yz")] {
            let correlation = found.covariance[a][b] / deviation[a] / deviation[b];
            assert_near(correlation, row.at(column), 1e-6, 1e-9, &what);
        }
        assert_near(found.chi2, row.at("chi2"), 1e-6, 1e-9, &what);
        // The residual is the root of chi2: where that is zero, of rounding.
        assert_near(
            found.signed_residual.abs(),
            row.at("signed_residual").abs(),
            1e-6,
            1e-6,
            &what,
        );
        if row.at("chi2") > 1e-6 {
            assert!(
                found.signed_residual * row.at("signed_residual") > 0.0,
                "{what}"
            );
        }
    }
}

#[test]
fn relaxation_table() {
    let stiffness = |row: &Row| row.at("k_N_per_m");
    let terms = table("p2_relaxation_terms.csv");
    let long_time = stiffness(&terms[0]);
    let terms: Vec<_> = terms[1..]
        .iter()
        .map(|row| RelaxationTerm {
            ratio: stiffness(row) / long_time,
            time: row.at("tau_s"),
        })
        .collect();
    let mut operator = Relaxation::<1>::new(&terms);
    let mut before = 0.0;
    for row in table("p2_relaxation.csv") {
        let time = row.at("t_s");
        let total = operator.push([long_time * row.si("d_nm", NM)], time - before)[0];
        before = time;
        let what = format!("t = {time}");
        assert_near(total, row.si("F_mN", MN), 1e-12, 0.0, &what);
        for (memory, column) in operator.memory().iter().zip(["q1_nm", "q2_nm", "q3_nm"]) {
            // The internal variables change sign: absolute to 1e-12 of 500 nm.
            assert_near(
                memory[0] / long_time,
                row.si(column, NM),
                1e-12,
                5e-19,
                &what,
            );
        }
    }
}

#[test]
fn creep_step_is_undone() {
    let terms = [RelaxationTerm {
        ratio: 1200.0 / 10400.0,
        time: 0.8,
    }];
    let mut operator = Relaxation::<1>::new(&terms);
    let mut creep = Relaxation::<1>::new(&terms);
    let mut before = 0.0;
    for row in table("p2_creep_step.csv") {
        let dt = row.at("t_s") - before;
        before = row.at("t_s");
        let force = operator.push([10400.0 * row.si("d_nm", NM)], dt)[0];
        // Straight lines through a curve at 10 ms steps: 1e-6.
        assert_near(force, 10e-3, 1e-6, 0.0, "force from displacement");
        let displacement = creep.push_total([10e-3], dt)[0] / 10400.0;
        assert_near(
            displacement,
            row.si("d_nm", NM),
            1e-5,
            0.0,
            "creep under constant force",
        );
    }
}
