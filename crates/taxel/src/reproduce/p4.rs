//! P4: the liquid-metal microchannel array.

use super::{Basis, Ledger};
use crate::design::Study;
use crate::device::{ChannelArray, ChannelPredictor};
use crate::electronics::VoltageDivider;
use crate::figure::{Axis, Chart, Figure, Series, Style};
use crate::mechanics::{
    CellGeometry, ChannelSection, ClosingCurve, ClosingState, PaperLaw, PressureLaw,
    SectionClosure, Stretch,
};
use crate::sensor::Sensor;
use crate::transduction::mean_inverse_area_ratio;

use Basis::{Input, Ours, Printed};

const KILOPASCAL: f64 = 1e3;

pub(super) fn fill(ledger: &mut Ledger) {
    let Some(sensor) = Sensor::shipped("liquid-metal-2x4") else {
        return;
    };
    let Ok(array) = sensor.channels() else {
        return;
    };
    let predictor = ChannelPredictor::new(&array);
    equations(ledger, &array);
    requirements(ledger, &array);
    simulation_inputs(ledger, &array);
    single_channel(ledger);
    two_layers(ledger, &array, &predictor);
    fabrication(ledger, &array);
    bench(ledger, &array);
    results(ledger, &array, &predictor);
    discussion(ledger, &array, &predictor);
    figures(ledger, &array, &predictor);
}

/// A tabulated cell under Eq. 2 with the constants of the paper.
struct Cell {
    height: f64,
    roof: f64,
    curve: ClosingCurve,
}

impl Cell {
    /// Height and roof in um; `None` when the design is not tabulated.
    fn new(height: f64, roof: f64) -> Option<Self> {
        let geometry = CellGeometry {
            section: ChannelSection {
                width: 400e-6,
                height: height * 1e-6,
            },
            roof: roof * 1e-6,
            thickness: 500e-6,
            pitch: 600e-6,
        };
        let curve = ClosingCurve::of_cell(&geometry, 2.0 * (75.5e3 + 5.7e3)).ok()?;
        Some(Self {
            height,
            roof,
            curve,
        })
    }

    /// The channel at a pressure in kPa.
    fn at(&self, kilopascal: f64) -> SectionClosure {
        let pressure = kilopascal * KILOPASCAL;
        let load = [Stretch {
            share: 1.0,
            pressure,
        }];
        let settled = self.curve.settle(&PressureLaw::Paper(LAW), &load);
        let internal = settled.map_or(0.0, |channel| channel.internal_pressure);
        self.curve.at(pressure - internal)
    }

    /// Increase of the resistance in % at a pressure in kPa.
    fn increase(&self, kilopascal: f64) -> f64 {
        100.0 * (1.0 / self.at(kilopascal).area_ratio - 1.0)
    }

    /// Pressure in kPa at which the area is `ratio`.
    fn pressure_at(&self, ratio: f64) -> f64 {
        bisect(500.0, |kilopascal| self.at(kilopascal).area_ratio < ratio)
    }

    /// Pressure in kPa at which the roof touches the floor, where computed.
    fn touch(&self) -> Option<f64> {
        self.curve.touch()?;
        Some(bisect(500.0, |kilopascal| {
            self.at(kilopascal).state != ClosingState::Open
        }))
    }
}

const LAW: PaperLaw = PaperLaw {
    expansion: 0.2,
    atmosphere: 101.325e3,
};

/// Where `reached` begins to hold between 0 and `high`.
fn bisect(mut high: f64, reached: impl Fn(f64) -> bool) -> f64 {
    let mut low = 0.0;
    // 500 halved 60 times is below the rounding of the result.
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if reached(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

/// Increase of the resistance in % for a loss of area in %.
fn increase_of(loss: f64) -> f64 {
    100.0 * (mean_inverse_area_ratio([(1.0, 1.0 - 0.01 * loss)]) - 1.0)
}

fn resistance(divider: &VoltageDivider, voltage: f64) -> f64 {
    divider.resistance(voltage).unwrap_or(f64::INFINITY)
}

fn equations(ledger: &mut Ledger, array: &ChannelArray<'_>) {
    let section = array.element.section();
    let solid = array.element.closed_form;
    let pressure = 10e3;
    let x = 2.0 * (1.0 - solid.poisson_ratio.powi(2)) * section.width * pressure
        / (solid.young_modulus * section.height);
    let same = section
        .published_area_ratio(&solid, pressure)
        .is_ok_and(|ratio| ((1.0 / ratio) - 1.0 / (1.0 - x)).abs() < 1e-12);
    let closed = section.published_area_ratio(&solid, 25e3).is_err();
    ledger
        .statement(
            "Eq. 1",
            "resistance under uniform pressure",
            "dR = (rho L/(w h)) (1/(1 - 2 (1 - nu^2) w p/(E h)) - 1)",
            same && closed,
            Ours,
        )
        .note(format!(
            "ends at E h/(2 (1 - nu^2) w): {:.2} kPa for the channel that was built, {:.1}, {:.1} and {:.1} kPa for \
             60, 100 and 200 um; from there on the answer is \"closed\". It takes the largest closing of a slit for \
             the mean, 4/pi too much",
            section.closing_pressure(&solid) / KILOPASCAL,
            height(60.0).closing_pressure(&solid) / KILOPASCAL,
            height(100.0).closing_pressure(&solid) / KILOPASCAL,
            height(200.0).closing_pressure(&solid) / KILOPASCAL,
        ));
    let half = LAW.pressure(0.5);
    ledger
        .statement(
            "Eq. 2",
            "pressure of the liquid",
            "dP = eta P_atm (A_init/A_new - 1)",
            (half - 0.2 * 101.325e3).abs() < 1e-9,
            Ours,
        )
        .note(
            "computed with the volume of the whole channel in the place of the area. It is a scaled gas law and lets \
             no channel close",
        );
    let divider = &array.board.divider;
    ledger.statement(
        "Eq. 3",
        "voltage divider",
        "V = R/(R_ref + R) V_S",
        (divider.voltage(5.0) - 2.0 * 5.0 / 15.0).abs() < 1e-15,
        Ours,
    );
}

fn height(micrometres: f64) -> ChannelSection {
    ChannelSection {
        width: 400e-6,
        height: micrometres * 1e-6,
    }
}

fn requirements(ledger: &mut Ledger, array: &ChannelArray<'_>) {
    let place = "II.A";
    ledger
        .number(
            place,
            "force on one taxel: 1.0 N, a tenth, over four taxels",
            "25 mN",
            1e3 / 10.0 / 4.0,
            Printed,
        )
        .note("the sweep of II.C spreads its 25 mN over four taxels together, so loads are asked for as pressures");
    let width = array.element.section.width * 1e6;
    let wall = array.layout().pitch[0] * 1e6 - width;
    ledger.number(place, "width of a channel", "400 um", width, Ours);
    ledger.number(place, "wall between channels", "200 um", wall, Ours);
    ledger.number(
        place,
        "two channels and a wall across the forceps",
        "~1 mm",
        (2.0 * width + wall) * 1e-3,
        Printed,
    );
    ledger.number(
        place,
        "largest height: half of a jaw of 1 mm",
        "500 um",
        0.5 * 1000.0,
        Printed,
    );
    ledger.statement(
        place,
        "the sensor fits into it",
        "maximum sensor height 500 um",
        array.element.thickness() <= 500e-6,
        Ours,
    );
    let [rows, columns] = array.counts();
    ledger.number("II.B", "taxels, 2x4", "8", (rows * columns) as f64, Ours);
    ledger.number(
        "IV.B",
        "microchannels and voltages",
        "6",
        (rows + columns) as f64,
        Ours,
    );
}

fn simulation_inputs(ledger: &mut Ledger, array: &ChannelArray<'_>) {
    let place = "II.C";
    let modulus = array.element.material.shear_modulus() / KILOPASCAL;
    ledger
        .open(place, "density of PDMS", "965 kg/m3")
        .not_determined("it has no role in statics");
    ledger
        .number(place, "Young's modulus", "500 kPa", 3.0 * modulus, Ours)
        .contradicts("C10 = 75.5 kPa and C01 = 5.7 kPa give 6 (C10 + C01) = 487.2 kPa; Eq. 1 alone uses 500 kPa");
    ledger.number(
        place,
        "Poisson's ratio",
        "0.5",
        array.element.closed_form.poisson_ratio,
        Input,
    );
    ledger
        .number(place, "shear modulus", "250 kPa", 500.0 / 3.0, Printed)
        .contradicts("E = 500 kPa and nu = 0.5 give E/3 = 166.7 kPa; C10 and C01 give 162.4 kPa");
    let crate::mechanics::Hyperelastic::MooneyRivlin(solid) = array.element.material;
    ledger
        .number(place, "C10", "75.5 kPa", solid.c10 / KILOPASCAL, Input)
        .note("in incompressible plane strain only C10 + C01 matters");
    ledger.number(place, "C01", "5.7 kPa", solid.c01 / KILOPASCAL, Input);
    if let PressureLaw::Paper(law) = &array.element.liquid.pressure {
        ledger
            .number(place, "expansion factor eta", "0.2", law.expansion, Input)
            .note("P_atm is not printed; the standard atmosphere gives eta P_atm = 20.265 kPa");
    }
    ledger.number(
        place,
        "area covered by four taxels",
        "1.0 mm2",
        (2.0_f64 * 0.4 + 0.2).powi(2),
        Printed,
    );
    let Ok(study) = Study::parse(SWEEP, Study::shipped_text(SWEEP).unwrap_or_default()) else {
        return;
    };
    let sections = &study.channel_sections;
    ledger
        .number(
            place,
            "least force of the sweep",
            "25 mN",
            sections.pressures.from * 1e-6 / 1e-3,
            Input,
        )
        .note(
            "to 250 mN on 1.0 mm2: taxel sweep p4-sections solves 100 designs at ten pressures. Of its 1000 answers \
             281 are open, 383 touch, 336 lie beyond the end of the solution (a fold at the corner) and are bounded",
        );
    ledger.number(
        place,
        "least height and surface thickness of the sweep",
        "20 um",
        sections.heights.from * 1e6,
        Input,
    );
}

/// The study that repeats the sweep of the paper.
const SWEEP: &str = "p4-sections";

fn single_channel(ledger: &mut Ledger) {
    let place = "II.D";
    let cells: Vec<Cell> = [
        (20.0, 100.0),
        (20.0, 140.0),
        (40.0, 100.0),
        (40.0, 140.0),
        (60.0, 120.0),
        (60.0, 160.0),
        (60.0, 60.0),
        (160.0, 200.0),
    ]
    .into_iter()
    .filter_map(|(height, roof)| Cell::new(height, roof))
    .collect();
    let (best, others): (Vec<&Cell>, Vec<&Cell>) = cells
        .iter()
        .partition(|cell| cell.height <= 60.0 && cell.roof >= 100.0);
    let thin = others.iter().find(|cell| cell.roof == 60.0);
    let same_height = best
        .iter()
        .find(|cell| cell.height == 60.0 && cell.roof == 120.0);
    let thin_is_sensitive = thin.zip(same_height).is_some_and(|(thin, thick)| {
        thin.curve.compliance() > thick.curve.compliance() && thin.touch() < thick.touch()
    });
    ledger
        .statement(
            place,
            "surface layers of 20 to 80 um are most sensitive and have the least range",
            "20-80 um",
            thin_is_sensitive,
            Ours,
        )
        .note("shown by the one tabulated design, 60 um under 60 um, beside 60 um under 120 um");
    let stiffest = others.iter().find(|cell| cell.height == 160.0);
    if let Some(cell) = stiffest {
        ledger
            .number(
                place,
                "least change of resistance at 25 mN, heights 100 to 160 um under more than 100 um",
                "3.6 %",
                cell.increase(25.0),
                Ours,
            )
            .contradicts(format!(
                "C10, C01, Eq. 2 and the printed geometry: 160 um under 200 um, the stiffest of these, changes by 3.6 % \
                 at {:.1} kPa. Two finite-element programs agree on the closing curves of such cells; what the paper did \
                 otherwise is not known",
                cell.pressure_at(1.0 / 1.036)
            ));
    }
    let changes: Vec<f64> = best.iter().map(|cell| cell.increase(25.0)).collect();
    let (low, high) = ends(&changes);
    let touches: Vec<f64> = best.iter().filter_map(|cell| cell.touch()).collect();
    let (first, last) = ends(&touches);
    ledger
        .statement(
            place,
            "heights of 20 to 60 um under 100 to 160 um have adequate changes and ranges",
            "20-60 um, 100-160 um",
            low > 50.0 && first > 50.0,
            Ours,
        )
        .note(format!(
            "at 25 kPa they change by {low:.0} to {high:.0} %, and the roof first touches at {first:.0} to {last:.0} \
             kPa where that is computed"
        ));
    ledger
        .open(
            "Fig. 5",
            "deformed channel, 20 um under 140 um",
            "20 um, 140 um",
        )
        .not_determined("its pressure is not printed; the closing curve of this cell is tabulated");
}

/// Smallest and largest of some values.
fn ends(values: &[f64]) -> (f64, f64) {
    values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(*value), high.max(*value))
        })
}

fn two_layers(ledger: &mut Ledger, array: &ChannelArray<'_>, predictor: &ChannelPredictor) {
    let (element, place) = (array.element, "II.E");
    ledger.number(
        place,
        "height of the channels",
        "20 um",
        element.section.height * 1e6,
        Ours,
    );
    ledger.number(
        place,
        "surface layer",
        "140 um",
        element.columns.roof * 1e6,
        Ours,
    );
    let between = (element.rows.roof - element.columns.roof - element.section.height) * 1e6;
    ledger.number(
        place,
        "surface layer of the lower channels",
        "140 um",
        between,
        Ours,
    );
    ledger.number(place, "base", "100 um", element.base * 1e6, Ours);
    let loss = |layer: usize, pressure: f64| {
        let answer = predictor.predict(pressure, 1.0);
        answer.map_or(f64::NAN, |answer| {
            100.0 * (1.0 - answer.layers[layer].volume_ratio)
        })
    };
    let cell = Cell::new(20.0, 140.0);
    let needed = |loss: f64| LAW.pressure(1.0 - 0.01 * loss) / KILOPASCAL;
    let plane = cell.map_or(f64::NAN, |cell| cell.pressure_at(0.305));
    ledger
        .number(place, "loss of area, upper layer, at 50 kPa", "69.5 %", loss(1, 50e3), Ours)
        .not_determined(format!(
            "the load is not printed. The plane-strain cell loses 69.5 % at {plane:.2} kPa; with Eq. 2 any channel \
             needs more than {:.2} kPa",
            needed(69.5)
        ));
    ledger.number(
        place,
        "increase of resistance that follows from 69.5 %",
        "228 %",
        increase_of(69.5),
        Printed,
    );
    ledger
        .number(place, "loss of area, lower layer, at 15 kPa", "38.2 %", loss(0, 15e3), Ours)
        .not_determined(format!(
            "the load is not printed; with Eq. 2 any channel needs more than {:.2} kPa. Under one uniform pressure \
             both layers lose nearly the same, {:.0} and {:.0} % at 25 kPa. A patch of 1.0 mm2 on two channels of each \
             layer separates them: by our finite elements of a block of 1.4 mm the thinnest sections lose 62 and 38 % \
             at 10 kPa, 74 and 45 % at 12 kPa (on a mesh twice as coarse 62 and 38, 74 and 44 %)",
            needed(38.2),
            loss(1, 25e3),
            loss(0, 24.99e3)
        ));
    ledger.number(
        place,
        "increase of resistance that follows from 38.2 %",
        "62 %",
        increase_of(38.2),
        Printed,
    );
    ledger
        .open(
            "Fig. 6",
            "deformed sheet of two layers",
            "surface and wire frame",
        )
        .not_determined(
            "its load is not printed. taxel predict --mechanics fem solves the crossing layers: at 25 kPa the thinnest \
             sections are 0.340 and 0.448 of their area, over the walls of the other layer; with patch_x and patch_y \
             it solves a patch on the block of all taxels",
        );
}

fn fabrication(ledger: &mut Ledger, array: &ChannelArray<'_>) {
    ledger
        .number(
            "III, Fig. 7",
            "thickness of the device",
            "350 um",
            array.element.thickness() * 1e6,
            Ours,
        )
        .contradicts("the layers of II.E: 140 + 20 + 140 + 20 + 100 um = 420 um");
    ledger
        .open(
            "III",
            "process",
            "20 um of SU-8 2010, 20 mTorr for 3 hours, 10:1, 60 C for 30-40 minutes, 65 W for 30 s, 1 cm2",
        )
        .not_determined("fabrication is not part of the model; 20 um is the height of the channels");
}

fn bench(ledger: &mut Ledger, array: &ChannelArray<'_>) {
    let divider = &array.board.divider;
    ledger.number(
        "IV.A",
        "1/250 of a load cell of 10 N",
        "40 mN",
        10e3 / 250.0,
        Printed,
    );
    ledger
        .open("IV.A", "accuracy of the load cell", "+-0.5 %")
        .not_determined(
            "no accuracy is claimed below 40 mN; the loads of the requirement lie there",
        );
    ledger.number(
        "IV.B",
        "reference resistor",
        "10 ohm",
        divider.reference,
        Ours,
    );
    ledger.number("IV.B", "supply", "2.0 V", divider.supply, Ours);
    ledger
        .open("IV.B", "sampling", "10 kHz")
        .not_determined("the shipped file reads means of 100 samples, 100 frames/s: a choice");
    ledger
        .open(
            "IV.C",
            "forces and speed of the pads",
            "0.0 mN to 100 mN, 50 um per second",
        )
        .not_determined(
            "the model has no time, and its force scale is not that of the bench, see V.C",
        );
    ledger
        .open(
            "Fig. 12",
            "pads (b) to (e): cylinders on the four central taxels",
            "500 um",
        )
        .not_determined(
            "scripts pad-a to pad-e press these places; size and place of bar (a) are not printed",
        );
}

fn results(ledger: &mut Ledger, array: &ChannelArray<'_>, predictor: &ChannelPredictor) {
    let divider = &array.board.divider;
    let (rest, pressed) = (resistance(divider, 0.505), resistance(divider, 0.732));
    let drawn = array.layers[1].conductor.rest_resistance();
    ledger
        .number("V.A, Fig. 13", "voltage at rest", "0.505 V", divider.voltage(drawn), Ours)
        .note("the length of the channels is not printed; 91.92 mm in the file is chosen for this voltage");
    ledger
        .number("Fig. 13", "resistance at 0.505 V", "3.67 ohm", rest, Printed)
        .contradicts(format!(
            "Eq. 3 with V_S = 2.0 V and R_ref = 10 ohm; 3.67 ohm would read {:.3} V. It is {:.3} ohm/m times 100 mm, \
             so probably a nominal value",
            divider.voltage(3.67),
            drawn / array.layers[1].conductor.length
        ));
    ledger
        .number(
            "V.A",
            "increase of the voltage, 0.505 to 0.732 V",
            "45 %",
            100.0 * (0.732 / 0.505 - 1.0),
            Printed,
        )
        .note(format!(
            "of the voltage; the resistance rises from {rest:.3} to {pressed:.3} ohm, by {:.1} %",
            100.0 * (pressed / rest - 1.0)
        ));
    ledger
        .open("V.A", "voltage at 100 mN", "0.732 V")
        .not_determined("what part of the channel is pressed, and the skin of the liquid metal");
    let voltage = |kilopascal: f64| {
        let answer = predictor.predict(kilopascal * KILOPASCAL, 1.0);
        answer.map_or(f64::NAN, |answer| answer.layers[1].voltage)
    };
    let end = bisect(60.0, |kilopascal| voltage(kilopascal) > 0.732);
    let worst = (1..20)
        .map(|i| {
            let share = f64::from(i) / 20.0;
            let chord = voltage(0.0) + share * (voltage(end) - voltage(0.0));
            (voltage(share * end) - chord).abs() / (voltage(end) - voltage(0.0))
        })
        .fold(0.0, f64::max);
    ledger
        .statement(
            "V.A",
            "the voltage rises nearly linearly from 0.505 to 0.732 V",
            "smooth, nearly linear",
            worst < 0.05,
            Ours,
        )
        .note(format!(
            "a channel loaded all over reaches 0.732 V at {end:.1} kPa and leaves the chord by at most {:.1} % of the \
             rise: Eq. 2 and the divider bend opposite ways",
            100.0 * worst
        ));
    ledger
        .open("Fig. 13", "bias of the force", "~ 20 mN")
        .not_determined("a bias of the bench, to be subtracted");
    let change = 100.0 * 0.01 * 0.505 / (divider.slope(rest) * rest);
    ledger
        .open("V.B, Fig. 13", "change of the neighbour's voltage; its resistance decreases slightly", "1 %")
        .not_determined(format!(
            "1 % of the voltage is {change:.2} % of the resistance. In the closed form the unpressed part of a channel \
             bulges, but channels are not coupled; a patch or a punch by finite elements couples them"
        ));
    ledger
        .open("Fig. 14", "pad of the figure", "Fig. 11.a")
        .contradicts("Fig. 11 is the circuit; the text speaks of a point load, pad 12-b, and 12-a is the bar");
    ledger
        .open("Fig. 14", "bias of the force", "~ 5 mN")
        .not_determined("a bias of the bench, to be subtracted");
    let lower_is_weaker = predictor
        .predict(20e3, 1.0)
        .is_ok_and(|answer| answer.layers[0].change < answer.layers[1].change);
    ledger.statement(
        "V.C",
        "the lower layer responds less",
        "less sensitivity",
        lower_is_weaker,
        Ours,
    );
    saturation(ledger, divider, rest);
}

fn saturation(ledger: &mut Ledger, divider: &VoltageDivider, rest: f64) {
    let saturated = resistance(divider, 1.97);
    ledger
        .number(
            "V.C",
            "voltage of a channel that is completely collapsed",
            "1.97 V",
            divider.voltage(f64::INFINITY),
            Ours,
        )
        .contradicts(format!(
            "V_S = 2.0 V: 1.97 V is {saturated:.0} ohm, {:.0} times rest. Either a path is left or V_S was 1.97 V; \
             the file keeps it as the threshold of saturation",
            saturated / rest
        ));
    let area = std::f64::consts::PI * 0.25e-3 * 0.25e-3;
    ledger
        .open("V.C", "force at which the upper layer saturates", "180 mN")
        .contradicts(format!(
            "the procedure, 0 to 100 mN. It is {:.0} kPa under the pad; vented and without the skin of the liquid metal the \
             channel touches near 3.2 mN, and with Eq. 2 it never closes",
            0.18 / area / KILOPASCAL
        ));
    ledger
        .open("V.C", "force at which the lower layer saturates", "1008 mN")
        .contradicts(format!(
            "the procedure, 0 to 100 mN. It is {:.1} MPa under the pad",
            1.008 / area * 1e-6
        ));
}

fn discussion(ledger: &mut Ledger, array: &ChannelArray<'_>, predictor: &ChannelPredictor) {
    ledger
        .open("Abstract", "sensitivity", "less than 50 mN")
        .not_determined("no noise of the bench is printed");
    let pitch = array.layout().pitch[0] * 1e6;
    ledger
        .statement(
            "Abstract",
            "resolution of places on the order of 100's of microns",
            "100's of microns",
            (100.0..1000.0).contains(&pitch),
            Ours,
        )
        .note(format!("the pitch of the taxels, {pitch:.0} um"));
    let (sensitive, insensitive) = (Cell::new(20.0, 100.0), Cell::new(100.0, 100.0));
    let later = sensitive.zip(insensitive).is_some_and(|(soft, stiff)| {
        stiff.curve.compliance() < soft.curve.compliance() && stiff.touch() > soft.touch()
    });
    ledger
        .statement(
            "VI.A",
            "insensitive channels measure greater loads before saturation",
            "greater applied loads",
            later,
            Ours,
        )
        .note(
            "100 um under 100 um against 20 um under 100 um; the first touch stands for saturation",
        );
    let published = predictor.predict(25e3, 1.0);
    ledger
        .statement(
            "II.B",
            "the closed form does not fit channels that are large against their sheet",
            "not appropriate",
            published.is_ok_and(|answer| answer.closed_form.is_err()),
            Ours,
        )
        .note("at 25 kPa, the least load of the sweep, Eq. 1 calls the channel closed; the cell has twice its resistance");
    ledger
        .open("VII", "forces sensed", "on the order of 10^2's of mN")
        .not_determined("the force scale of the bench, see V.C");
}

fn figures(ledger: &mut Ledger, array: &ChannelArray<'_>, predictor: &ChannelPredictor) {
    let voltage = |layer: usize, pressure: f64| {
        let answer = predictor.predict(pressure, 1.0);
        answer.map_or(f64::NAN, |answer| answer.layers[layer].voltage)
    };
    // The pressure that stands for 100 mN.
    let scale = bisect(60e3, |pressure| voltage(1, pressure) > 0.732) / 100.0;
    let curve = |layer: usize, last: u32| -> Vec<[f64; 2]> {
        (0..=last)
            .map(f64::from)
            .map(|force| [force, voltage(layer, force * scale)])
            .collect()
    };
    let chart = |series| Chart {
        title: String::new(),
        x: Axis::new("force, scaled", "mN"),
        y: Axis::new("voltage", "V"),
        series,
    };
    ledger.figure(
        "Figure 13",
        Figure::of(
            "Voltage of the pressed channel over force",
            chart(vec![
                Series::new("upper layer, model", curve(1, 100), Style::Line),
                Series::new(
                    "printed ends",
                    vec![[0.0, 0.505], [100.0, 0.732]],
                    Style::Marks,
                ),
            ]),
            format!(
                "Shape only. The model is loaded all over by a uniform pressure with Eq. 2; {scale:.0} Pa stand for 1 mN, \
                 chosen so that 100 mN read the printed 0.732 V. The printed bias of ~20 mN is left out. The \
                 model's own force scale is far below that of the bench.",
            ),
        ),
    );
    // Up to the end of the closing curve of the lower layer.
    let known = bisect(100e3, |pressure| {
        let answer = predictor.predict(pressure, 1.0);
        answer.is_ok_and(|answer| answer.layers[0].state == crate::device::LayerState::Beyond)
    });
    let last = (known / scale).floor() as u32;
    ledger.figure(
        "Figure 14",
        Figure::of(
            "Voltage of both layers over force",
            chart(vec![
                Series::new("upper layer, model", curve(1, last), Style::Line),
                Series::new("lower layer, model", curve(0, last), Style::Line),
            ]),
            format!(
                "Shape only, with the force scale of figure 13, up to where the closing curve of the lower layer ends \
                 ({:.0} kPa). Loaded all over, the layers differ little; the printed disparity is that of a point \
                 load. Saturation at {} V, 180 and 1008 mN, is beyond the model.",
                known / KILOPASCAL,
                array.board.divider.saturation
            ),
        ),
    );
}
