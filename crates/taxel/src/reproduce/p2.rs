//! P2: the three-axis capacitive array.

use super::{Basis, Ledger};
use crate::device::ThreeAxisArray;
use crate::figure::{Axis, Chart, Figure, Series, Style};
use crate::sensor::Sensor;
use crate::transduction::UnitModel;

use Basis::{Input, Ours, Printed};

const MILLINEWTON: f64 = 1e-3;
const CAPACITORS: [&str; 4] = ["C11", "C12", "C21", "C22"];
const AXES: [&str; 3] = ["x", "y", "z"];
/// Rest capacitances of the measured unit, fF.
const MEASURED: [f64; 4] = [203.0, 204.0, 190.0, 205.0];

pub(super) fn fill(ledger: &mut Ledger) {
    let (Some(array), Some(unit)) = (
        Sensor::shipped("three-axis-8x8"),
        Sensor::shipped("three-axis-unit"),
    ) else {
        return;
    };
    let (Ok(array), Ok(unit)) = (array.three_axis(), unit.three_axis()) else {
        return;
    };
    equations(ledger, &array);
    structure(ledger, &array);
    fabrication(ledger);
    unit_measurement(ledger, &array);
    model_results(ledger, &array);
    distribution(ledger, &array);
    figures(ledger, &unit.unit_model());
}

/// A force of `millinewton` along one axis, N.
fn along(axis: usize, millinewton: f64) -> [f64; 3] {
    let mut force = [0.0; 3];
    force[axis] = millinewton * MILLINEWTON;
    force
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-12 * a.abs().max(b.abs())
}

fn equations(ledger: &mut Ledger, array: &ThreeAxisArray<'_>) {
    let element = array.element;
    let suspension = element.suspension.model();
    let (force, lever) = (along(0, 20.0), element.lever());
    let tilt = suspension.deform(force).displacement[0] / suspension.centre_distance;
    let torque = element.torsion()[0] * tilt;
    ledger
        .statement(
            "Eq. 1",
            "torque of a side force",
            "tau_x = kappa_x theta = F_x cos(theta) l",
            (torque / (force[0] * lever * tilt.cos()) - 1.0).abs() < 1e-5,
            Printed,
        )
        .note(format!(
            "l is here the height of the point of attack, 700 um; at 20 mN cos(theta) is 1 - {:.0e}",
            1.0 - tilt.cos()
        ));
    ledger.statement(
        "Eq. 2",
        "the same for small angles",
        "tau_x = F_x l",
        near(torque, force[0] * lever),
        Printed,
    );
    let slope = suspension.deform(force).slope[0];
    ledger
        .statement(
            "Eq. 3",
            "angle from the displacement",
            "theta = d_x/l",
            near(slope, tilt),
            Printed,
        )
        .note("l is here the distance of the centres, 700 um too");
    signs(ledger, array);
    let mut parallel = array.unit_model();
    parallel.suspension.tile_tilt = 0.0;
    let load = [11e-3, -7e-3, 13e-3];
    let found = parallel.effective_force(parallel.rest(), parallel.predict(load).1.capacitance());
    for (axis, printed) in [
        "F_x = k_x [(D12 + D22) - (D21 + D11)]/2",
        "F_y = k_y [(D12 + D11) - (D21 + D22)]/2",
        "F_z = k_z [D12 + D22 + D11 + D21]/4",
    ]
    .into_iter()
    .enumerate()
    {
        // Capacitances keep 12 digits of a displacement of a micrometre.
        let exact = found.is_some_and(|found| (found[axis] / load[axis] - 1.0).abs() < 1e-10);
        ledger
            .statement(
                &format!("Eq. {}", 7 + axis),
                &format!("force along {} from the closing D = d_eff0 - d_eff", AXES[axis]),
                printed,
                exact,
                Ours,
            )
            .note("exact for tiles that stay parallel; for tiles that tilt with the bump off by less than 2 % of 20 mN");
    }
}

/// Eqs. 4 to 6 have gaps where Eqs. 7 and 8 have their decrease.
fn signs(ledger: &mut Ledger, array: &ThreeAxisArray<'_>) {
    let unit = array.unit_model();
    // Mean gap of the side that a force along the axis closes, less the other.
    let bracket = |axis: usize| {
        let closing = unit.suspension.deform(along(axis, 15.0)).closing;
        let gap: [f64; 4] = std::array::from_fn(|i| unit.plates.rest_gap(i) - closing[i]);
        match axis {
            0 => 0.5 * (gap[1] + gap[3] - gap[2] - gap[0]),
            _ => 0.5 * (gap[1] + gap[0] - gap[2] - gap[3]),
        }
    };
    for (equation, axis, printed, other) in [
        (4, 0, "d_x = (d12 + d22)/2 - (d21 + d11)/2", 7),
        (5, 0, "F_x = (kappa_x/l^2) [(d12 + d22) - (d21 + d11)]/2", 7),
        (6, 1, "F_y = (kappa_y/l^2) [(d12 + d11) - (d21 + d22)]/2", 8),
    ] {
        ledger
            .statement(
                &format!("Eq. {equation}"),
                "the same sign as the force",
                printed,
                bracket(axis) > 0.0,
                Ours,
            )
            .contradicts(format!(
                "Eq. {other}: the same bracket of the decreases of the gaps; a positive force closes the gaps with \
                 the plus sign, figure 5"
            ));
    }
}

fn structure(ledger: &mut Ledger, array: &ThreeAxisArray<'_>) {
    let element = array.element;
    let (plates, outline) = (&element.plates, &element.outline);
    let layout = array.layout();
    let section = "2, Fig. 1";
    let um = 1e6;
    for (what, printed, ours) in [
        ("air gap", "6 um", plates.air_gap[0] * um),
        ("insulation", "6 um", plates.insulation * um),
        ("side of an electrode", "400 um", plates.electrode[0] * um),
        (
            "wall between the capacitors",
            "100 um",
            outline.wall_width * um,
        ),
        ("height of the bump", "300 um", outline.bump_height * um),
    ] {
        ledger.number(section, what, printed, ours, Input);
    }
    let corners = near(outline.bump_base, element.suspension.centre_distance);
    ledger.statement(
        section,
        "the corners of the bump sit at the centres of the capacitors",
        "at the center of each capacitor",
        corners,
        Ours,
    );
    ledger.number(
        "4.1",
        "size of the unit",
        "1300 um",
        outline.unit_side * um,
        Input,
    );
    ledger
        .number("4.1", "l, height of the bump", "700 um", outline.bump_height * um, Ours)
        .contradicts(format!(
            "the height of 300 um of section 2; with its layer (100 um) and the electrode layer (300 um) it is {:.0} \
             um, which the model uses",
            element.lever() * um
        ));
    ledger.number(
        "4.1",
        "l, distance of the centres of the capacitors",
        "700 um",
        element.suspension.centre_distance * um,
        Input,
    );
    ledger
        .number(
            "4.1",
            "largest effective gap",
            "6 um",
            array.unit_model().plates.rest_gap(0) * um,
            Ours,
        )
        .contradicts("the definition of the effective gap, which has the insulation of 6 um in it; only differences count");
    let units = layout.taxels();
    ledger
        .number("3, Fig. 4", "units", "64", units as f64, Input)
        .note("printed as 8x8");
    ledger
        .number("3, Fig. 4", "capacitors", "256", 4.0 * units as f64, Ours)
        .note("printed as 16x16");
    ledger.number("3", "pitch", "2 mm", layout.pitch[0] * 1e3, Input);
    let outer = layout.pitch[0] * (layout.columns as f64 - 1.0) + outline.unit_side;
    ledger
        .number(
            "3",
            "side of the sensor without lines",
            "18 mm",
            outer * 1e3,
            Ours,
        )
        .not_determined(
            "from edge to edge of the outer units; the margin around them is not printed",
        );
    ledger
        .open("2", "crosstalk between units", "negligible")
        .not_determined("no number is printed; the model has none");
    let side = array.unit_model();
    let found = side.effective_force(side.rest(), side.predict(along(0, 15.0)).1.capacitance());
    ledger
        .statement(
            "2",
            "independent response in normal and shear directions",
            "independent",
            found.is_some_and(|force| force[2].abs() < 0.1e-3),
            Ours,
        )
        .note("15 mN along x leave less than 0.1 mN in z by Eq. 9, and nothing by the estimator");
}

fn fabrication(ledger: &mut Ledger) {
    ledger
        .open("3", "thickness of PDMS layers", "21 to 300 um within +-7 %; +-3.5 % for 300 um")
        .not_determined("the shipped array takes 0.2 um, 3.3 % of 6 um, as one standard deviation of the air gap");
    ledger
        .open(
            "3",
            "process",
            "10 um LOR, 20 um copper, 200 A titanium, 8 min at 50 W, about 300 um PDMS, 5000 rpm, 30 s, 90 C, 90 min, \
             100 nm platinum, 45 min at 100 mTorr, 8 um AZ4330, 150 nm/min, 1.5:1, 80 C, 4 h 20 min, 1 um oxide, 100 um",
        )
        .not_determined("fabrication is not part of the model; layers of 20, 100 and 300 um are in the drawing");
    ledger
        .open("5", "yield of units", "from 50 % to 100 %")
        .not_determined("fabrication is not part of the model; dead capacitors can be masked");
}

fn unit_measurement(ledger: &mut Ledger, array: &ThreeAxisArray<'_>) {
    let unit = array.unit_model();
    let femtofarad = unit.rest()[0] * 1e15;
    let place = "4.1";
    ledger
        .number(place, "theoretical rest capacitance", "172 fF", femtofarad, Ours)
        .note("the permittivity of the insulation is not printed; 2.654 to 2.712 give 172 fF, the file has 2.7");
    for (name, measured) in CAPACITORS.into_iter().zip(MEASURED) {
        let gap = unit
            .at_rest([measured * 1e-15; 4])
            .map_or(f64::NAN, |thin| thin.plates.air_gap[0] * 1e6);
        ledger
            .number(
                place,
                &format!("measured rest capacitance {name}"),
                &format!("{measured} fF"),
                femtofarad,
                Ours,
            )
            .contradicts(format!(
                "the theoretical 172 fF. An air gap of {gap:.2} um or {:.1} fF in parallel explain it; the file \
                 three-axis-unit takes the second",
                measured - femtofarad
            ));
    }
    ledger
        .open(place, "resolution of the gauge", "1 mN")
        .not_determined("a property of the bench; rounding alone is 0.29 mN rms");
    ledger
        .open(place, "resolution of the stage", "about 100 nm")
        .not_determined("a property of the bench; 100 nm are 1.0 mN at the printed k");
    ledger
        .open(place, "measurements averaged for a point", "50")
        .not_determined("noise divided by 7.07; a rest capture averages as many frames");
}

fn model_results(ledger: &mut Ledger, array: &ThreeAxisArray<'_>) {
    let element = array.element;
    let (unit, stiffness) = (array.unit_model(), element.suspension.stiffness);
    let gap = unit.plates.rest_gap(0);
    let mut parallel = unit;
    parallel.suspension.tile_tilt = 0.0;
    // Read back from the displacement by the published inverse at 15 mN.
    let read_back = |unit: &UnitModel, axis: usize| {
        let readings = unit.predict(along(axis, 15.0)).1.capacitance();
        15e-3 / unit.effective_motion(unit.rest(), readings).displacement[axis]
    };
    for (axis, printed) in ["9.62e3 N/m", "1.04e4 N/m", "1.04e4 N/m"]
        .into_iter()
        .enumerate()
    {
        ledger
            .number(
                "4.1, 5",
                &format!("spring constant along {}, read from Fig. 8 of the model", AXES[axis]),
                printed,
                read_back(&parallel, axis),
                Ours,
            )
            .note(format!(
                "an input that comes back at 15 mN for parallel tiles, as the paper assumes; tiles that tilt with the \
                 bump give {:.0} N/m",
                read_back(&unit, axis)
            ));
    }
    for (axis, printed) in ["1.3 %/mN", "1.2 %/mN", "1.2 %/mN"].into_iter().enumerate() {
        ledger
            .number(
                "Abstract, 4.1, 5",
                &format!("sensitivity along {}", AXES[axis]),
                printed,
                0.1 / (stiffness[axis] * gap),
                Printed,
            )
            .note("1/(k g) with the gap that 172 fF implies; along x and y it is the difference of the two sides");
    }
    let full = element.full_scale;
    ledger.number(
        "Abstract, 5",
        "full scale of all axes",
        "20 mN",
        full * 1e3,
        Ours,
    );
    let top = element.outline.bump_top;
    ledger
        .number("Abstract", "pressure at full scale", "250 kPa", full / (top * top) * 1e-3, Ours)
        .not_determined(format!(
            "the area is not printed: 250 kPa is 0.08 mm2, the flat top of the bump about {:.3} mm2, the cell of the \
             array 4 mm2",
            top * top * 1e6
        ));
    ledger.number(
        "4.1",
        "range in which the model works",
        "15 mN",
        element.usable_force * 1e3,
        Ours,
    );
    figure_claims(ledger, array);
}

fn figure_claims(ledger: &mut Ledger, array: &ThreeAxisArray<'_>) {
    let unit = array.unit_model();
    let rest = unit.rest();
    let rises = |axis: usize| {
        let now = unit.predict(along(axis, 15.0)).1.capacitance();
        let changes: [bool; 4] = std::array::from_fn(|i| now[i] > rest[i]);
        changes
    };
    ledger.statement(
        "Fig. 5 (a)",
        "under a force along x C12 and C22 rise, the others fall",
        "increased ... decreased",
        rises(0) == [false, true, false, true],
        Ours,
    );
    ledger.statement(
        "Fig. 5 (b)",
        "under a force along y C11 and C12 rise, the others fall",
        "the same behavior",
        rises(1) == [true, true, false, false],
        Ours,
    );
    ledger.statement(
        "Fig. 5 (c)",
        "under a normal force all four rise",
        "the same behavior",
        rises(2) == [true; 4],
        Ours,
    );
    let closure = unit.plates.air_gap[0] / unit.suspension.compliance[2][2];
    ledger
        .statement(
            "Fig. 5 (c)",
            "the gap begins to close within the range of the figure",
            "abrupt change in the slope of C12 and C22",
            closure < 20e-3,
            Ours,
        )
        .contradicts(format!(
            "k_z = 1.04e4 N/m and 6 um, which close a parallel gap at {:.1} mN; the probe was tilted, as the paper says",
            closure * 1e3
        ));
    ledger
        .open("Fig. 5 (a), (b)", "asymmetry around zero", "additional normal force")
        .not_determined("the sinking of the probe into the bump has no printed size; part of it is the curve of 1/gap");
    let displacement = unit.suspension.deform(along(2, 15.0)).displacement;
    ledger.statement(
        "Fig. 8 (c)",
        "a normal force moves along z only",
        "only the z displacement",
        displacement[0] == 0.0 && displacement[1] == 0.0 && displacement[2] > 0.0,
        Ours,
    );
    ledger
        .open(
            "Fig. 8 (a), (b)",
            "displacement along z under a side force",
            "some in z displacements",
        )
        .not_determined("attributed to the setup, without a size");
    ledger
        .open("4.1", "creep", "could not observe any")
        .not_determined(
            "the gauge has 1 mN; relaxing springs can be given, the shipped files have none",
        );
}

fn distribution(ledger: &mut Ledger, array: &ThreeAxisArray<'_>) {
    let place = "4.2";
    let capacitors = 4 * array.layout().taxels();
    ledger
        .number(
            place,
            "frame rate of the board, 256 capacitors of 651 us",
            "6 frames per second",
            1.0 / (capacitors as f64 * 651e-6),
            Printed,
        )
        .note("651 us for each capacitor follow from it");
    let rate = 1.0 / array.board.period();
    ledger
        .statement(
            place,
            "a dedicated board would be faster than 30 frames per second",
            "over 30",
            rate > 30.0,
            Ours,
        )
        .note(format!(
            "the shipped array reads rows at once, {rate} frames per second: a choice"
        ));
    ledger
        .number(
            "Abstract, 4.2, 5",
            "response time",
            "160 ms",
            1e3 / 6.0,
            Printed,
        )
        .not_determined(
            "\"no afterimage\" bounds it by one frame, 166.7 ms at 6 frames per second",
        );
    ledger
        .open(
            "2, 5",
            "response time of the previous structure",
            "more than 1 s",
        )
        .not_determined("no dynamics are modelled");
    ledger
        .open(
            "4.2, Fig. 10",
            "forces of a finger",
            "F_x, F_y, F_z in images",
        )
        .not_determined("forces are not printed as numbers; script finger shows the same patterns");
    ledger
        .open(
            "4.2, Fig. 11, 12",
            "radius of curvature; two polarities of F_x",
            "4 mm",
        )
        .not_determined(
            "the geometry is an input, mount = { cylinder = ... }; no force is printed",
        );
    ledger
        .open("1", "spatial resolution wanted for a finger", "around 1 mm")
        .not_determined("a requirement; the pitch of this array is 2 mm");
}

fn figures(ledger: &mut Ledger, unit: &UnitModel) {
    let rest = unit.rest();
    let normalised = |axis: usize, capacitor: usize| -> Vec<[f64; 2]> {
        (0..=40)
            .map(|i| 0.5 * f64::from(i))
            .map(|force| {
                let now = unit.predict(along(axis, force)).1.capacitance();
                [force, now[capacitor] / rest[capacitor]]
            })
            .collect()
    };
    let chart = |title: String, x: &str, y: Axis, series| Chart {
        title,
        x: Axis::new(x, "mN"),
        y,
        series,
    };
    let charts = AXES.iter().enumerate().map(|(axis, name)| {
        let series = CAPACITORS
            .iter()
            .enumerate()
            .map(|(i, capacitor)| Series::new(*capacitor, normalised(axis, i), Style::Line));
        chart(
            format!("force along {name}"),
            "force",
            Axis::new("C/C0", ""),
            series.collect(),
        )
    });
    ledger.figure(
        "Figure 5",
        Figure {
            title: String::from("Normalised capacitances over force"),
            charts: charts.collect(),
            caption: String::from(
                "The unit three-axis-unit: rest values as measured, the excess over 172 fF taken as parallel \
                 capacitance. The four tiles move as one rigid plane, and the probe does not sink into the bump; the \
                 printed curves bend for C12 and C22 in (c), which a parallel plane of these constants does not.",
            ),
        },
    );
    let displacement = |loaded: usize, axis: usize| -> Vec<[f64; 2]> {
        (0..=30)
            .map(|i| 0.5 * f64::from(i))
            .map(|force| {
                let readings = unit.predict(along(loaded, force)).1.capacitance();
                let motion = unit.effective_motion(rest, readings).displacement;
                [force, motion[axis] * 1e6]
            })
            .collect()
    };
    let charts = AXES.iter().enumerate().map(|(loaded, name)| {
        let series = AXES.iter().enumerate().map(|(axis, along)| {
            Series::new(
                format!("d_{along}"),
                displacement(loaded, axis),
                Style::Line,
            )
        });
        chart(
            format!("force along {name}"),
            "force",
            Axis::new("displacement", "um"),
            series.collect(),
        )
    });
    ledger.figure(
        "Figure 8",
        Figure {
            title: String::from("Displacements by Eqs. 7 to 9 over force"),
            charts: charts.collect(),
            caption: String::from(
                "Computed from the capacitances of the unit three-axis-unit as the paper does, with its spring \
                 constants and the parallel capacitance known. The small d_z under side forces is the error of the \
                 parallel gap for tilted tiles, not the sinking that the paper saw.",
            ),
        },
    );
}
