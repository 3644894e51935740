//! P4: the liquid-metal microchannel array.

use crate::ledger::Ours;
use taxel::device::{MicrochannelArray, MicrochannelPredictor};
use taxel::electronics::{Stage, VoltageDivider};
use taxel::figure::{Axis, Chart, Figure, Series, Style};
use taxel::mechanics::{
    CellGeometry, ClosingCurve, ClosingState, MicrochannelSection, PaperLaw, PressureLaw,
    SectionClosure, Stretch,
};
use taxel::sensor::Sensor;
use taxel::solutions::{Solutions, TablesOnly};
use taxel::transduction::mean_inverse_area_ratio;
use taxel_study::study::{SensorText, Study};

const KILOPASCAL: f64 = 1e3;

pub(crate) fn fill(ours: &mut Ours) {
    let Some(sensor) = Sensor::shipped("liquid-metal-2x4") else {
        return;
    };
    let Ok(array) = sensor.microchannels() else {
        return;
    };
    let predictor = MicrochannelPredictor::new(&array);
    equations(ours, &array);
    requirements(ours, &array);
    simulation_inputs(ours, &array);
    single_channel(ours);
    two_layers(ours, &array, &predictor);
    fabrication(ours, &array);
    bench(ours, &array);
    results(ours, &array, &predictor);
    discussion(ours, &array, &predictor);
    figures(ours, &array, &predictor);
}

/// A tabulated cell under Eq. 2 with the constants of the paper.
struct Cell {
    law: PaperLaw,
    height: f64,
    roof: f64,
    curve: ClosingCurve,
}

impl Cell {
    /// Height and roof in um; `None` when the design is not tabulated.
    fn new(ours: &Ours, height: f64, roof: f64) -> Option<Self> {
        let geometry = CellGeometry {
            section: section(ours, height),
            roof: roof * 1e-6,
            thickness: ours.printed("largest_height", -6),
            // A channel and a wall.
            pitch: 600e-6,
        };
        let shear_modulus = 2.0 * (ours.printed("c10", 3) + ours.printed("c01", 3));
        let curve = ClosingCurve::of_cell(&geometry, shear_modulus).ok()?;
        Some(Self {
            law: law(ours),
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
        let settled = self.curve.settle(&PressureLaw::Paper(self.law), &load);
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

/// Eq. 2 with the printed factor at the standard atmosphere, which is not printed.
fn law(ours: &Ours) -> PaperLaw {
    PaperLaw {
        expansion: ours.printed("expansion", 0),
        atmosphere: 101.325e3,
    }
}

/// A channel of the printed width; height in um.
fn section(ours: &Ours, height: f64) -> MicrochannelSection {
    MicrochannelSection::rectangle(ours.printed("channel_width", -6), height * 1e-6)
}

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

fn equations(ours: &mut Ours, array: &MicrochannelArray<'_>) {
    let drawn = array.element.section();
    let solid = array.element.closed_form;
    let pressure = 10e3;
    let x = 2.0 * (1.0 - solid.poisson_ratio.powi(2)) * drawn.width * pressure
        / (solid.young_modulus * drawn.height);
    let same = drawn
        .published_area_ratio(&solid, pressure)
        .is_ok_and(|ratio| ((1.0 / ratio) - 1.0 / (1.0 - x)).abs() < 1e-12);
    let closed = drawn.published_area_ratio(&solid, 25e3).is_err();
    let closing = |height: f64| section(ours, height).closing_pressure(&solid) / KILOPASCAL;
    let [closing_60, closing_100, closing_200] = [60.0, 100.0, 200.0].map(closing);
    ours.holds("eq_1", same && closed)
        .with("closing_20", drawn.closing_pressure(&solid) / KILOPASCAL)
        .with("closing_60", closing_60)
        .with("closing_100", closing_100)
        .with("closing_200", closing_200);
    let law = law(ours);
    let half = law.pressure(0.5);
    ours.holds("eq_2", (half - law.expansion * law.atmosphere).abs() < 1e-9);
    let Some(Stage::VoltageDivider(divider)) = &array.first_stage() else {
        return;
    };
    let (supply, reference) = (
        ours.printed("supply", 0),
        ours.printed("reference_resistor", 0),
    );
    let voltage = supply * 5.0 / (reference + 5.0);
    ours.holds("eq_3", (divider.voltage(5.0) - voltage).abs() < 1e-15);
}

fn requirements(ours: &mut Ours, array: &MicrochannelArray<'_>) {
    ours.number("taxel_force", 1e3 / 10.0 / 4.0);
    let width = array.element.section.width * 1e6;
    let wall = array.layout().pitch[0] * 1e6 - width;
    ours.number("channel_width", width);
    ours.number("wall", wall);
    ours.number("two_channels", (2.0 * width + wall) * 1e-3);
    ours.number("largest_height", 0.5 * 1000.0);
    let largest = ours.printed("largest_height", -6);
    ours.holds("sensor_height", array.element.thickness() <= largest);
    let [rows, columns] = array.counts();
    ours.number("taxels", (rows * columns) as f64);
    ours.number("microchannels", (rows + columns) as f64);
}

fn simulation_inputs(ours: &mut Ours, array: &MicrochannelArray<'_>) {
    let modulus = array.element.material.shear_modulus() / KILOPASCAL;
    ours.number("youngs_modulus", 3.0 * modulus);
    ours.number("poisson_ratio", array.element.closed_form.poisson_ratio);
    ours.number("shear_modulus", ours.printed("youngs_modulus", 0) / 3.0);
    let taxel::mechanics::Hyperelastic::MooneyRivlin(solid) = array.element.material;
    ours.number("c10", solid.c10 / KILOPASCAL);
    ours.number("c01", solid.c01 / KILOPASCAL);
    if let PressureLaw::Paper(law) = &array.element.liquid.pressure {
        ours.number("expansion", law.expansion);
    }
    let side = 2.0 * ours.printed("channel_width", -3) + ours.printed("wall", -3);
    ours.number("taxel_area", side.powi(2));
    for (row, variable, scale) in [
        ("sweep_force", "pressure", 1e-3),
        ("sweep_height", "height", 1e6),
    ] {
        // A pressure in Pa on 1 mm² is a force of as many uN.
        if let Some(least) = least_of_sweep(variable) {
            ours.number(row, least * scale);
        }
    }
}

/// The least value of a variable in the study that repeats the sweep of the paper, SI.
fn least_of_sweep(variable: &str) -> Option<f64> {
    const STUDY: &str = "p4-sections";
    let text = taxel_study::shipped_text(STUDY)?;
    let name = "liquid-metal-2x4";
    let sensor = SensorText {
        name,
        text: Sensor::shipped_text(name)?,
    };
    let solutions = Box::new(|| Box::new(TablesOnly) as Box<dyn Solutions>);
    let study = Study::parse(STUDY, text, &sensor, solutions).ok()?;
    let found = study.variables.iter().find(|one| one.name == variable)?;
    found.values.grid(found.points).first().copied()
}

fn single_channel(ours: &mut Ours) {
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
    .filter_map(|(height, roof)| Cell::new(ours, height, roof))
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
    ours.holds("thin_surfaces", thin_is_sensitive);
    let stiffest = others.iter().find(|cell| cell.height == 160.0);
    if let Some(cell) = stiffest {
        let pressure = cell.pressure_at(1.0 / (1.0 + 0.01 * ours.printed("least_change", 0)));
        ours.number("least_change", cell.increase(25.0))
            .with("pressure", pressure);
    }
    let changes: Vec<f64> = best.iter().map(|cell| cell.increase(25.0)).collect();
    let (low, high) = ends(&changes);
    let touches: Vec<f64> = best.iter().filter_map(|cell| cell.touch()).collect();
    let (first, last) = ends(&touches);
    ours.holds("adequate_range", low > 50.0 && first > 50.0)
        .with("low", low)
        .with("high", high)
        .with("first", first)
        .with("last", last);
}

/// Smallest and largest of some values.
fn ends(values: &[f64]) -> (f64, f64) {
    values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(*value), high.max(*value))
        })
}

fn two_layers(ours: &mut Ours, array: &MicrochannelArray<'_>, predictor: &MicrochannelPredictor) {
    let element = array.element;
    ours.number("channel_height", element.section.height * 1e6);
    ours.number("surface_layer", element.columns.roof * 1e6);
    let between = (element.rows.roof - element.columns.roof - element.section.height) * 1e6;
    ours.number("lower_surface_layer", between);
    ours.number("base", element.base * 1e6);
    let loss = |layer: usize, pressure: f64| {
        let answer = predictor.predict(pressure, 1.0);
        answer.map_or(f64::NAN, |answer| {
            100.0 * (1.0 - answer.layers[layer].volume_ratio)
        })
    };
    let cell = Cell::new(ours, 20.0, 140.0);
    let [upper, lower] = ["upper_loss", "lower_loss"].map(|id| ours.printed(id, 0));
    let law = law(ours);
    let needed = |loss: f64| law.pressure(1.0 - 0.01 * loss) / KILOPASCAL;
    let plane = cell.map_or(f64::NAN, |cell| cell.pressure_at(1.0 - 0.01 * upper));
    ours.number("upper_loss", loss(1, 50e3))
        .with("plane", plane)
        .with("needed", needed(upper));
    ours.number("upper_increase", increase_of(upper));
    ours.number("lower_loss", loss(0, 15e3))
        .with("needed", needed(lower))
        .with("upper", loss(1, 25e3))
        .with("lower", loss(0, 24.99e3));
    ours.number("lower_increase", increase_of(lower));
}

fn fabrication(ours: &mut Ours, array: &MicrochannelArray<'_>) {
    ours.number("device_thickness", array.element.thickness() * 1e6);
}

fn bench(ours: &mut Ours, array: &MicrochannelArray<'_>) {
    let Some(Stage::VoltageDivider(divider)) = &array.first_stage() else {
        return;
    };
    ours.number("load_cell_limit", 10e3 / 250.0);
    ours.number("reference_resistor", divider.reference);
    ours.number("supply", divider.supply);
}

fn results(ours: &mut Ours, array: &MicrochannelArray<'_>, predictor: &MicrochannelPredictor) {
    let Some(Stage::VoltageDivider(divider)) = &array.first_stage() else {
        return;
    };
    let [low, high] = ["rest_voltage", "pressed_voltage"].map(|id| ours.printed(id, 0));
    let (rest, pressed) = (resistance(divider, low), resistance(divider, high));
    let drawn = array.layers[1].conductor.rest_resistance();
    ours.number("rest_voltage", divider.voltage(drawn));
    let nominal = ours.printed("rest_resistance", 0);
    let rows = ["rest_voltage", "supply", "reference_resistor"];
    ours.derived("rest_resistance", rows, |[read, supply, reference]| {
        reference * read / (supply - read)
    })
    .with("voltage", divider.voltage(nominal))
    .with("per_length", drawn / array.layers[1].conductor.length);
    ours.number("voltage_increase", 100.0 * (high / low - 1.0))
        .with("rest", rest)
        .with("pressed", pressed)
        .with("increase", 100.0 * (pressed / rest - 1.0));
    let voltage = |kilopascal: f64| {
        let answer = predictor.predict(kilopascal * KILOPASCAL, 1.0);
        answer.map_or(f64::NAN, |answer| answer.layers[1].signal)
    };
    let end = bisect(60.0, |kilopascal| voltage(kilopascal) > high);
    let worst = (1..20)
        .map(|i| {
            let share = f64::from(i) / 20.0;
            let chord = voltage(0.0) + share * (voltage(end) - voltage(0.0));
            (voltage(share * end) - chord).abs() / (voltage(end) - voltage(0.0))
        })
        .fold(0.0, f64::max);
    ours.holds("linear_voltage", worst < 0.05)
        .with("end", end)
        .with("chord", 100.0 * worst);
    pad_and_neighbour(ours, divider, rest, low);
    let lower_is_weaker = predictor
        .predict(20e3, 1.0)
        .is_ok_and(|answer| answer.layers[0].change < answer.layers[1].change);
    ours.holds("lower_responds_less", lower_is_weaker);
    saturation(ours, divider, rest);
}

/// A pad on one of 2 x 2 crossings, from the run `neighbour`, at the printed resistance.
fn pad_and_neighbour(ours: &mut Ours, divider: &VoltageDivider, rest: f64, low: f64) {
    // Share of the voltage per share of the resistance.
    let per = divider.slope(rest) * rest / low;
    let printed = ours.printed("neighbour", 0);
    let change = printed / per;
    let run = ours.table.run("neighbour").map(|run| &run.values);
    let of = |name: &str| run.and_then(|values| values.get(name).copied());
    let (Some(beside), Some(force)) = (of("beside"), of("force")) else {
        return;
    };
    let scale = ours.printed("pressed_force", 0) / force;
    // Printed is a decrease.
    ours.number("neighbour", -per * beside)
        .with("change", change);
    ours.number("pressed_force", force).with("scale", scale);
}

fn saturation(ours: &mut Ours, divider: &VoltageDivider, rest: f64) {
    let saturated = resistance(divider, ours.printed("collapsed_voltage", 0));
    ours.derived("collapsed_voltage", ["supply"], |[supply]| supply)
        .with("saturated", saturated)
        .with("times", saturated / rest);
    let radius = 0.5 * ours.printed("pads", -6);
    let area = std::f64::consts::PI * radius * radius;
    let [upper, lower] = ["upper_saturation", "lower_saturation"].map(|id| ours.printed(id, -3));
    ours.words("upper_saturation")
        .with("pressure", upper / area / KILOPASCAL);
    ours.words("lower_saturation")
        .with("pressure", lower / area * 1e-6);
}

fn discussion(ours: &mut Ours, array: &MicrochannelArray<'_>, predictor: &MicrochannelPredictor) {
    let pitch = array.layout().pitch[0] * 1e6;
    ours.holds("place_resolution", (100.0..1000.0).contains(&pitch))
        .with("pitch", pitch);
    let (sensitive, insensitive) = (Cell::new(ours, 20.0, 100.0), Cell::new(ours, 100.0, 100.0));
    let later = sensitive.zip(insensitive).is_some_and(|(soft, stiff)| {
        stiff.curve.compliance() < soft.curve.compliance() && stiff.touch() > soft.touch()
    });
    ours.holds("insensitive_channels", later);
    point_and_distributed(ours, array, predictor);
    over_filling(ours);
    let published = predictor.predict(25e3, 1.0);
    ours.holds(
        "closed_form_limit",
        published.is_ok_and(|answer| answer.closed_form.is_err()),
    );
}

/// Channels whose liquid has a pressure before any load, kPa and 1/kPa.
struct Filled {
    /// Pressure on the top at which roof and floor touch, with the filling and without, by Eq. 2.
    trapped: [f64; 2],
    /// The same where a reservoir holds the pressure.
    held: [f64; 2],
    /// First change of resistance per pressure over that without filling.
    sensitivity: f64,
}

impl Filled {
    /// The area follows from the net pressure alone, so that the touch has one net pressure.
    /// Eq. 2 is read as the law of a scaled gas: from the filled state, whose area is `bulged`
    /// times the drawn one, its pressure scale is eta (P_atm + P). `slope` is what the filled
    /// channel first loses of its own area per net pressure, 1/kPa.
    fn new(cell: &Cell, filled: f64, bulged: f64, slope: f64) -> Option<Self> {
        let touch = cell.curve.touch()?;
        let net = bisect(500.0, |kilopascal| {
            cell.curve.at(kilopascal * KILOPASCAL).area_ratio <= touch
        });
        let over = PaperLaw {
            atmosphere: cell.law.atmosphere + filled * KILOPASCAL,
            ..cell.law
        };
        let of = |law: &PaperLaw, ratio: f64| law.pressure(ratio) / KILOPASCAL;
        let first = |law: &PaperLaw, own: f64| {
            own / (1.0 + law.expansion * law.atmosphere / KILOPASCAL * own)
        };
        let drawn = cell.curve.compliance() * KILOPASCAL;
        Some(Self {
            trapped: [
                net + filled + of(&over, touch / bulged),
                net + of(&cell.law, touch),
            ],
            held: [net + filled, net],
            sensitivity: first(&over, slope) / first(&cell.law, drawn),
        })
    }
}

fn over_filling(ours: &mut Ours) {
    let cell = Cell::new(ours, 20.0, 140.0);
    let run = ours.table.run("filled").map(|run| &run.values);
    let of = |name: &str| run.and_then(|values| values.get(name).copied());
    let (Some(cell), Some(pressure), Some(ratio), Some(slope)) =
        (cell, of("pressure"), of("area_ratio"), of("slope"))
    else {
        return;
    };
    let Some(filled) = Filled::new(&cell, pressure, ratio, slope) else {
        return;
    };
    let later = |[with, without]: [f64; 2]| with > without;
    ours.holds("over_filling", later(filled.trapped) && later(filled.held))
        .with("trapped", filled.trapped[0])
        .with("gas", filled.trapped[1])
        .with("held", filled.held[0])
        .with("vented", filled.held[1])
        .with("sensitivity", 100.0 * filled.sensitivity);
}

/// One force on the pad of a point load and on the area of four taxels.
fn point_and_distributed(
    ours: &mut Ours,
    array: &MicrochannelArray<'_>,
    predictor: &MicrochannelPredictor,
) {
    let force = 1e-3;
    let (pad, area) = (ours.printed("pads", -6), ours.printed("taxel_area", -6));
    let length = array.layers[1].conductor.length;
    // Pressure, and change of the channel and loss of area below it, of a load of this length.
    let under = |area: f64, along: f64| {
        let pressure = force / area;
        let answer = predictor.predict(pressure, along / length);
        answer.map_or([f64::NAN; 3], |answer| {
            let upper = &answer.layers[1];
            [
                pressure,
                upper.change,
                1.0 - upper.parts[0].loaded.area_ratio,
            ]
        })
    };
    let [point, even] = [
        under(std::f64::consts::FRAC_PI_4 * pad * pad, pad),
        under(area, area.sqrt()),
    ];
    ours.holds(
        "point_and_distributed",
        point[1] > even[1] && point[2] > even[2],
    )
    .with("force", force * 1e3)
    .with("point", point[0] / KILOPASCAL)
    .with("even", even[0] / KILOPASCAL)
    .with("times", point[1] / even[1])
    .with("point_loss", 100.0 * point[2])
    .with("even_loss", 100.0 * even[2]);
}

fn figures(ours: &mut Ours, array: &MicrochannelArray<'_>, predictor: &MicrochannelPredictor) {
    let voltage = |layer: usize, pressure: f64| {
        let answer = predictor.predict(pressure, 1.0);
        answer.map_or(f64::NAN, |answer| answer.layers[layer].signal)
    };
    let [low, high] = ["rest_voltage", "pressed_voltage"].map(|id| ours.printed(id, 0));
    // The pressure that stands for 100 mN.
    let scale = bisect(60e3, |pressure| voltage(1, pressure) > high) / 100.0;
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
    ours.figure(
        "Figure 13",
        Figure::of(
            "Voltage of the pressed channel over force",
            chart(vec![
                Series::new("upper layer, model", curve(1, 100), Style::Line),
                Series::new(
                    "printed ends",
                    vec![[0.0, low], [100.0, high]],
                    Style::Marks,
                ),
            ]),
            format!(
                "Shape only. The model is loaded all over by a uniform pressure with Eq. 2; {scale:.0} Pa stand for 1 mN, \
                 chosen so that 100 mN read the printed {high} V. The printed bias of ~20 mN is left out. The \
                 model's own force scale is far below that of the bench.",
            ),
        ),
    );
    // Up to the end of the closing curve of the lower layer.
    let known = bisect(100e3, |pressure| {
        let answer = predictor.predict(pressure, 1.0);
        answer.is_ok_and(|answer| {
            answer.layers[0].state == taxel::device::MicrochannelLayerState::Beyond
        })
    });
    let last = (known / scale).floor() as u32;
    ours.figure(
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
                array.board.saturation
            ),
        ),
    );
}
