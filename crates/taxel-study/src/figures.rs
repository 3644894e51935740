//! Figures of studies, as SVG.

use taxel::svg::{Anchor, Svg};
use taxel::table::Column;

use crate::optimise::Optimum;
use crate::place::Placing;
use crate::study::{Row, Status, Study, Values};
use crate::sweep::{variable_column, way_of};
use crate::tolerance::Tolerance;

const STYLE: &str = ".paper{fill:#fff}.title{font:600 16px sans-serif;fill:#111}.head{font:600 13px sans-serif;fill:#111}\
    .label{font:12px sans-serif;fill:#222}.tick{font:11px sans-serif;fill:#444}.note{font:11px sans-serif;fill:#555}\
    .frame{fill:none;stroke:#333;stroke-width:1}.grid{stroke:#e3e3e3;stroke-width:1}.axis{stroke:#888;stroke-width:1}\
    .best{fill:#d55e00;stroke:#fff;stroke-width:1}.front{fill:#0072b2}.beaten{fill:#b5b5b5}\
    .limit{stroke:#d55e00;stroke-width:1.5;stroke-dasharray:6 4}.curve{fill:none;stroke:#0072b2;stroke-width:2}\
    .first{fill:#0072b2}.total{fill:#9cc9e8}.whisker{stroke:#111;stroke-width:1.2}.border{stroke:#111;stroke-width:2}\
    .place{fill:#eee;stroke:#999}.chosen{fill:#0072b2;stroke:#123}.white{font:600 11px sans-serif;fill:#fff}.bar{fill:#7fb8dc}";

/// Numbers of one axis.
#[derive(Debug, Clone)]
struct Axis {
    label: String,
    low: f64,
    high: f64,
    logarithmic: bool,
}

impl Axis {
    fn of(label: String, values: impl Iterator<Item = f64>, logarithmic: bool) -> Self {
        let finite = values.filter(|value| value.is_finite() && (!logarithmic || *value > 0.0));
        let [low, high] = finite.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
            [low.min(value), high.max(value)]
        });
        let (low, high) = if low > high {
            (0.0, 1.0)
        } else if low == high {
            let room = if low == 0.0 { 1.0 } else { 0.05 * low.abs() };
            (low - room, high + room)
        } else {
            (low, high)
        };
        Self {
            label,
            low,
            high,
            logarithmic: logarithmic && low > 0.0,
        }
    }

    /// With a little room at both ends.
    fn roomy(mut self) -> Self {
        if !self.logarithmic {
            let room = 0.04 * (self.high - self.low);
            self.low -= room;
            self.high += room;
        }
        self
    }

    fn share(&self, value: f64) -> f64 {
        if self.logarithmic {
            (value / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        }
    }

    fn ticks(&self) -> Vec<f64> {
        if self.logarithmic {
            let mut ticks = Vec::new();
            let mut decade = 10f64.powf(self.low.log10().floor());
            while decade <= self.high {
                for step in [1.0, 2.0, 5.0] {
                    let tick = step * decade;
                    if (self.low..=self.high).contains(&tick) {
                        ticks.push(tick);
                    }
                }
                decade *= 10.0;
            }
            if ticks.len() >= 2 {
                return ticks;
            }
        }
        let rough = (self.high - self.low) / 5.0;
        let power = 10f64.powf(rough.log10().floor());
        let steps = [1.0, 2.0, 2.5, 5.0, 10.0];
        let step = steps
            .into_iter()
            .find(|step| step * power >= rough)
            .unwrap_or(10.0)
            * power;
        let first = (self.low / step).ceil() as i64;
        let last = (self.high / step).floor() as i64;
        // At most a dozen, whatever rounding makes of the ends.
        (first..=last.min(first + 12))
            .map(|tick| tick as f64 * step)
            .collect()
    }
}

/// A number in at most four digits.
fn short(value: f64) -> String {
    if value == 0.0 {
        return String::from("0");
    }
    let size = value.abs();
    if !(1e-3..1e5).contains(&size) {
        return format!("{value:.2e}");
    }
    let decimals = (3 - size.log10().floor() as i32).clamp(0, 6) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

fn title_of(column: &Column) -> String {
    let name = column.name.replace('_', " ");
    if column.unit.is_empty() {
        name
    } else {
        format!("{name} [{}]", column.unit)
    }
}

/// A frame of axes; gives the place of a pair of values.
fn frame(svg: &mut Svg, corner: [f64; 2], size: [f64; 2], x: &Axis, y: &Axis) {
    for tick in x.ticks() {
        let at = corner[0] + size[0] * x.share(tick);
        svg.line("grid", [at, corner[1]], [at, corner[1] + size[1]]);
        svg.text(
            "tick",
            [at, corner[1] + size[1] + 15.0],
            Anchor::Middle,
            &short(tick),
        );
    }
    for tick in y.ticks() {
        let at = corner[1] + size[1] * (1.0 - y.share(tick));
        svg.line("grid", [corner[0], at], [corner[0] + size[0], at]);
        svg.text(
            "tick",
            [corner[0] - 6.0, at + 4.0],
            Anchor::End,
            &short(tick),
        );
    }
    svg.rectangle("frame", corner, size);
    let below = [corner[0] + size[0] / 2.0, corner[1] + size[1] + 34.0];
    svg.text("label", below, Anchor::Middle, &x.label);
    svg.upward_text(
        "label",
        [corner[0] - 52.0, corner[1] + size[1] / 2.0],
        &y.label,
    );
}

fn at(corner: [f64; 2], size: [f64; 2], x: &Axis, y: &Axis, [a, b]: [f64; 2]) -> [f64; 2] {
    [
        corner[0] + size[0] * x.share(a),
        corner[1] + size[1] * (1.0 - y.share(b)),
    ]
}

/// A scale from dark blue over green to yellow.
fn colour(share: f64) -> String {
    const SCALE: [[f64; 3]; 6] = [
        [68.0, 1.0, 84.0],
        [65.0, 68.0, 135.0],
        [42.0, 120.0, 142.0],
        [34.0, 168.0, 132.0],
        [122.0, 209.0, 81.0],
        [253.0, 231.0, 37.0],
    ];
    let share = if share.is_finite() {
        share.clamp(0.0, 1.0)
    } else {
        0.0
    };
    let place = share * 5.0;
    let below = (place as usize).min(4);
    let part = place - below as f64;
    let mix = |k: usize| SCALE[below][k] * (1.0 - part) + SCALE[below + 1][k] * part;
    format!("rgb({:.0},{:.0},{:.0})", mix(0), mix(1), mix(2))
}

/// A quantity of a row, in the unit for people.
struct Shown<'a> {
    column: Column,
    value: Box<dyn Fn(&Row) -> f64 + 'a>,
    logarithmic: bool,
}

fn variables(study: &Study) -> Vec<Shown<'_>> {
    let varied = study
        .variables
        .iter()
        .enumerate()
        .filter(|(_, one)| one.values.varies());
    varied
        .map(|(index, variable)| {
            let column = variable_column(variable);
            let scale = column.scale;
            Shown {
                value: Box::new(move |row: &Row| row.point[index] / scale),
                logarithmic: matches!(
                    variable.values,
                    Values::Range {
                        logarithmic: true,
                        ..
                    }
                ),
                column,
            }
        })
        .collect()
}

fn answers(study: &Study) -> Vec<Shown<'_>> {
    let numbers = study
        .answers
        .iter()
        .enumerate()
        .filter(|(_, one)| !one.word);
    numbers
        .map(|(index, answer)| {
            let scale = answer.column.scale;
            Shown {
                column: answer.column.clone(),
                value: Box::new(move |row: &Row| {
                    row.answers[index]
                        .number()
                        .map_or(f64::NAN, |number| number / scale)
                }),
                logarithmic: false,
            }
        })
        .collect()
}

fn feasible(study: &Study, row: &Row) -> bool {
    row.status == Status::Done
        && study
            .violations(row)
            .iter()
            .all(|one| *one <= crate::optimise::SLACK)
}

/// The figure of a sweep: lines over one variable, maps over two (small ones for each value of a
/// condition), parallel coordinates and pairs over more.
pub fn sweep(study: &Study, rows: &[Row]) -> String {
    let across = variables(study);
    if study.sweep.plan == "grid"
        && let Some(order) = of_condition(study)
    {
        return small_maps(study, rows, order);
    }
    match across.len() {
        0 | 1 => lines(study, rows),
        2 if study.sweep.plan == "grid" => maps(study, rows),
        2 => pairs(study, rows, None),
        _ => {
            let parallel = parallel(study, rows);
            beside(&parallel, &pairs(study, rows, None))
        }
    }
}

/// Two figures, one below the other.
fn beside(first: &str, second: &str) -> String {
    let size = |svg: &str| -> [f64; 2] {
        let text = svg
            .split_once("viewBox=\"0 0 ")
            .map_or("", |(_, rest)| rest);
        let text = text.split_once('"').map_or("", |(text, _)| text);
        let mut numbers = text.split(' ').map(|one| one.parse().unwrap_or(100.0));
        [
            numbers.next().unwrap_or(100.0),
            numbers.next().unwrap_or(100.0),
        ]
    };
    let ([w1, h1], [w2, h2]) = (size(first), size(second));
    let width = w1.max(w2);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {}\" width=\"{width}\" height=\"{}\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n{first}<svg y=\"{h1}\" width=\"{w2}\" height=\"{h2}\">\n{second}</svg>\n</svg>\n",
        h1 + h2,
        h1 + h2
    )
}

const WIDTH: f64 = 720.0;

fn lines(study: &Study, rows: &[Row]) -> String {
    let mut svg = Svg::default();
    let (across, upward) = (variables(study), answers(study));
    let height = 64.0 + 300.0 * upward.len().max(1) as f64;
    svg.rectangle("paper", [0.0; 2], [WIDTH, height]);
    svg.text("title", [WIDTH / 2.0, 26.0], Anchor::Middle, &study.name);
    if let Some(over) = across.first() {
        for (index, answer) in upward.iter().enumerate() {
            let points: Vec<[f64; 2]> = rows
                .iter()
                .map(|row| [(over.value)(row), (answer.value)(row)])
                .filter(|point| point[1].is_finite())
                .collect();
            let xs = rows.iter().map(|row| (over.value)(row));
            let x = Axis::of(title_of(&over.column), xs, over.logarithmic);
            let y = Axis::of(title_of(&answer.column), points.iter().map(|p| p[1]), false).roomy();
            let (corner, size) = ([86.0, 44.0 + 300.0 * index as f64], [600.0, 236.0]);
            frame(&mut svg, corner, size, &x, &y);
            let mut places: Vec<[f64; 2]> = points
                .iter()
                .map(|point| at(corner, size, &x, &y, *point))
                .collect();
            places.sort_by(|a, b| a[0].total_cmp(&b[0]));
            for change in changes(study, rows, over) {
                let across = corner[0] + size[0] * x.share(change);
                svg.line("limit", [across, corner[1]], [across, corner[1] + size[1]]);
            }
            if !places.is_empty() {
                svg.path("curve", &places, false);
            }
            for place in places {
                svg.circle("front", place, 3.0);
            }
        }
    }
    let ways = crate::sweep::ways(study, rows);
    if ways.len() > 1 {
        let names: Vec<&str> = ways.iter().map(|(_, way)| way.as_str()).collect();
        let note = format!(
            "dashed: the way of answering changes ({})",
            names.join("; ")
        );
        svg.text("note", [86.0, 40.0], Anchor::Start, &note);
    }
    svg.finish([WIDTH, height], &study.name, STYLE)
}

/// Values of a variable in the middles between designs that were answered in two ways.
fn changes(study: &Study, rows: &[Row], over: &Shown<'_>) -> Vec<f64> {
    let mut answered: Vec<(f64, &str)> = rows
        .iter()
        .filter_map(|row| Some(((over.value)(row), way_of(study, row)?)))
        .collect();
    answered.sort_by(|a, b| a.0.total_cmp(&b.0));
    let pairs = answered.windows(2).filter(|pair| pair[0].1 != pair[1].1);
    pairs.map(|pair| 0.5 * (pair[0].0 + pair[1].0)).collect()
}

/// A map of each answer over two variables; designs that break a constraint are framed off,
/// those without an answer are left white.
fn maps(study: &Study, rows: &[Row]) -> String {
    let mut svg = Svg::default();
    let (across, upward) = (variables(study), answers(study));
    let lists: Vec<Vec<f64>> = study
        .variables
        .iter()
        .filter(|one| one.values.varies())
        .map(|one| one.values.grid(one.points))
        .collect();
    let (nx, ny) = (lists[0].len(), lists[1].len());
    let panel = 380.0;
    let height = 90.0 + panel * upward.len() as f64;
    svg.rectangle("paper", [0.0; 2], [WIDTH, height]);
    svg.text("title", [WIDTH / 2.0, 26.0], Anchor::Middle, &study.name);
    let bad: Vec<bool> = rows.iter().map(|row| !feasible(study, row)).collect();
    for (index, answer) in upward.iter().enumerate() {
        let (corner, size) = ([90.0, 84.0 + panel * index as f64], [480.0, 280.0]);
        let values: Vec<f64> = rows.iter().map(|row| (answer.value)(row)).collect();
        let positive = values
            .iter()
            .all(|value| !value.is_finite() || *value > 0.0);
        let scale = Axis::of(String::new(), values.iter().copied(), positive);
        svg.text(
            "head",
            [corner[0], corner[1] - 12.0],
            Anchor::Start,
            &title_of(&answer.column),
        );
        let cell = [size[0] / nx as f64, size[1] / ny as f64];
        let place = |i: usize, j: usize| {
            [
                corner[0] + cell[0] * i as f64,
                corner[1] + size[1] - cell[1] * (j + 1) as f64,
            ]
        };
        for i in 0..nx {
            for j in 0..ny {
                let Some(value) = values.get(i * ny + j).filter(|value| value.is_finite()) else {
                    continue;
                };
                let [x, y] = place(i, j);
                svg.raw(&format!(
                    "<rect x=\"{x:.2}\" y=\"{y:.2}\" width=\"{:.2}\" height=\"{:.2}\" fill=\"{}\"/>",
                    cell[0] + 0.3,
                    cell[1] + 0.3,
                    colour(scale.share(*value))
                ));
            }
        }
        // The border between what holds and what does not.
        let is_bad = |i: usize, j: usize| bad.get(i * ny + j).copied().unwrap_or(true);
        if !study.constraints.is_empty() {
            for i in 0..nx {
                for j in 0..ny {
                    let [x, y] = place(i, j);
                    if i + 1 < nx && is_bad(i, j) != is_bad(i + 1, j) {
                        svg.line("border", [x + cell[0], y], [x + cell[0], y + cell[1]]);
                    }
                    if j + 1 < ny && is_bad(i, j) != is_bad(i, j + 1) {
                        svg.line("border", [x, y], [x + cell[0], y]);
                    }
                }
            }
        }
        svg.rectangle("frame", corner, size);
        map_axes(&mut svg, corner, size, &across, &lists);
        colour_bar(
            &mut svg,
            [corner[0] + size[0] + 24.0, corner[1]],
            size[1],
            &scale,
        );
    }
    let mut note = String::from("white: no answer");
    if !study.constraints.is_empty() {
        let names: Vec<&str> = study
            .constraints
            .iter()
            .map(|(name, _)| name.as_str())
            .collect();
        let names = names.join(", ");
        note = format!("{note}; black line: border of the constraints ({names})");
    }
    svg.text("note", [90.0, 44.0], Anchor::Start, &note);
    svg.finish([WIDTH, height], &study.name, STYLE)
}

/// The two variables with a key and the condition, by their places in a point, if these are what varies.
fn of_condition(study: &Study) -> Option<[usize; 3]> {
    let varied = (0..study.variables.len()).filter(|index| study.variables[*index].values.varies());
    let (keyed, conditions): (Vec<usize>, Vec<usize>) =
        varied.partition(|index| study.variables[*index].key.is_some());
    match (&keyed[..], &conditions[..]) {
        ([x, y], [condition]) => Some([*x, *y, *condition]),
        _ => None,
    }
}

/// For each answer a row of small maps, one for each value of the condition, in one scale of colours.
fn small_maps(study: &Study, rows: &[Row], order: [usize; 3]) -> String {
    const ACROSS: usize = 5;
    let (side, gap, left, top) = (108.0, [10.0, 34.0], 60.0, 70.0);
    let lists = order.map(|index| {
        let variable = &study.variables[index];
        variable.values.grid(variable.points)
    });
    let columns = order.map(|index| variable_column(&study.variables[index]));
    let nearest = |list: &[f64], value: f64| {
        let distance = |index: &usize| (list[*index] - value).abs();
        (0..list.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)))
    };
    let lines = lists[2].len().div_ceil(ACROSS);
    let block = lines as f64 * (side + gap[1]) + 44.0;
    let upward = answers(study);
    let height = top + block * upward.len() as f64;
    let mut svg = Svg::default();
    svg.rectangle("paper", [0.0; 2], [WIDTH, height]);
    svg.text("title", [WIDTH / 2.0, 26.0], Anchor::Middle, &study.name);
    let ends = |index: usize| {
        let shown =
            |value: Option<&f64>| short(value.copied().unwrap_or(f64::NAN) / columns[index].scale);
        let (first, last) = (shown(lists[index].first()), shown(lists[index].last()));
        format!("{} from {first} to {last}", title_of(&columns[index]))
    };
    let note = format!(
        "to the right {}; upward {}; white: no answer",
        ends(0),
        ends(1)
    );
    svg.text("note", [left, 44.0], Anchor::Start, &note);
    for (number, answer) in upward.iter().enumerate() {
        let values: Vec<f64> = rows.iter().map(|row| (answer.value)(row)).collect();
        let positive = values
            .iter()
            .all(|value| !value.is_finite() || *value > 0.0);
        let scale = Axis::of(String::new(), values.iter().copied(), positive);
        let head = top + block * number as f64;
        svg.text(
            "head",
            [left, head],
            Anchor::Start,
            &title_of(&answer.column),
        );
        let corner = |k: usize| {
            [
                left + (side + gap[0]) * (k % ACROSS) as f64,
                head + 10.0 + (side + gap[1]) * (k / ACROSS) as f64,
            ]
        };
        let cell = [0, 1].map(|axis| side / lists[axis].len() as f64);
        for (row, value) in rows
            .iter()
            .zip(&values)
            .filter(|(_, value)| value.is_finite())
        {
            let place = [0, 1, 2].map(|k| nearest(&lists[k], row.point[order[k]]));
            let [Some(i), Some(j), Some(k)] = place else {
                continue;
            };
            let [x, y] = corner(k);
            svg.raw(&format!(
                "<rect x=\"{:.2}\" y=\"{:.2}\" width=\"{:.2}\" height=\"{:.2}\" fill=\"{}\"/>",
                x + cell[0] * i as f64,
                y + side - cell[1] * (j + 1) as f64,
                cell[0] + 0.3,
                cell[1] + 0.3,
                colour(scale.share(*value))
            ));
        }
        for (k, value) in lists[2].iter().enumerate() {
            svg.rectangle("frame", corner(k), [side; 2]);
            let [x, y] = corner(k);
            let name = format!("{} {}", short(value / columns[2].scale), columns[2].unit);
            svg.text(
                "tick",
                [x + side / 2.0, y + side + 15.0],
                Anchor::Middle,
                &name,
            );
        }
        let bar = [left + (side + gap[0]) * ACROSS as f64 + 4.0, head + 10.0];
        colour_bar(&mut svg, bar, side, &scale);
    }
    svg.finish([WIDTH, height], &study.name, STYLE)
}

/// Ticks and labels of a map: the middles of its columns and rows.
fn map_axes(
    svg: &mut Svg,
    corner: [f64; 2],
    size: [f64; 2],
    across: &[Shown<'_>],
    lists: &[Vec<f64>],
) {
    let step = |count: usize| count.div_ceil(9);
    let columns = lists[0].len() as f64;
    for (i, value) in lists[0].iter().enumerate().step_by(step(lists[0].len())) {
        let middle = [
            corner[0] + size[0] * (i as f64 + 0.5) / columns,
            corner[1] + size[1] + 15.0,
        ];
        let text = short(value / across[0].column.scale);
        svg.text("tick", middle, Anchor::Middle, &text);
    }
    let rows = lists[1].len() as f64;
    for (j, value) in lists[1].iter().enumerate().step_by(step(lists[1].len())) {
        let middle = [
            corner[0] - 6.0,
            corner[1] + size[1] * (1.0 - (j as f64 + 0.5) / rows) + 4.0,
        ];
        let text = short(value / across[1].column.scale);
        svg.text("tick", middle, Anchor::End, &text);
    }
    let below = [corner[0] + size[0] / 2.0, corner[1] + size[1] + 34.0];
    svg.text("label", below, Anchor::Middle, &title_of(&across[0].column));
    let left = [corner[0] - 58.0, corner[1] + size[1] / 2.0];
    svg.upward_text("label", left, &title_of(&across[1].column));
}

fn colour_bar(svg: &mut Svg, corner: [f64; 2], height: f64, scale: &Axis) {
    const STEPS: usize = 60;
    for step in 0..STEPS {
        let share = (step as f64 + 0.5) / STEPS as f64;
        svg.raw(&format!(
            "<rect x=\"{:.2}\" y=\"{:.2}\" width=\"14\" height=\"{:.2}\" fill=\"{}\"/>",
            corner[0],
            corner[1] + height * (1.0 - (step + 1) as f64 / STEPS as f64),
            height / STEPS as f64 + 0.4,
            colour(share)
        ));
    }
    for tick in scale.ticks() {
        let y = corner[1] + height * (1.0 - scale.share(tick));
        svg.line("axis", [corner[0] + 14.0, y], [corner[0] + 18.0, y]);
        svg.text(
            "tick",
            [corner[0] + 21.0, y + 4.0],
            Anchor::Start,
            &short(tick),
        );
    }
}

/// What colours the designs of a figure: the first objective, else the first answer.
fn colouring(study: &Study, rows: &[Row]) -> (String, Vec<f64>, Axis) {
    let (name, values): (String, Vec<f64>) = match study.objectives.first() {
        Some(objective) => {
            let index = objective.expression.lone_name();
            let column = index.and_then(|index| {
                let answer = index.checked_sub(study.variables.len())?;
                study
                    .answers
                    .get(answer)
                    .map(|answer| answer.column.clone())
            });
            let scale = column.as_ref().map_or(1.0, |column| column.scale);
            let value = |row: &Row| study.objective_values(row)[0] / scale;
            let title = column.map_or_else(|| objective.name.clone(), |column| title_of(&column));
            (title, rows.iter().map(value).collect())
        }
        None => match answers(study).first() {
            Some(answer) => (
                title_of(&answer.column),
                rows.iter().map(|row| (answer.value)(row)).collect(),
            ),
            None => (String::new(), vec![0.0; rows.len()]),
        },
    };
    let axis = Axis::of(name.clone(), values.iter().copied(), false);
    (name, values, axis)
}

/// Parallel coordinates: a line for each design through its variables and answers.
fn parallel(study: &Study, rows: &[Row]) -> String {
    let mut svg = Svg::default();
    let all: Vec<Shown<'_>> = variables(study).into_iter().chain(answers(study)).collect();
    let width = (120.0 * all.len() as f64 + 120.0).max(WIDTH);
    let (top, tall, height) = (92.0, 300.0, 440.0);
    svg.rectangle("paper", [0.0; 2], [width, height]);
    svg.text("title", [width / 2.0, 26.0], Anchor::Middle, &study.name);
    let (name, values, scale) = colouring(study, rows);
    svg.text(
        "note",
        [24.0, 48.0],
        Anchor::Start,
        &format!(
            "colour: {name}, {} (dark) to {}; grey: breaks a constraint",
            short(scale.low),
            short(scale.high)
        ),
    );
    let axes: Vec<Axis> = all
        .iter()
        .map(|shown| {
            Axis::of(
                title_of(&shown.column),
                rows.iter().map(|row| (shown.value)(row)),
                shown.logarithmic,
            )
        })
        .collect();
    let step = (width - 140.0) / (all.len().max(2) - 1) as f64;
    let x = |index: usize| 70.0 + step * index as f64;
    for holds in [false, true] {
        for (row, value) in rows.iter().zip(&values) {
            if row.status != Status::Done || feasible(study, row) != holds {
                continue;
            }
            let places: Vec<String> = axes
                .iter()
                .zip(&all)
                .enumerate()
                .map(|(index, (axis, shown))| {
                    let share = axis.share((shown.value)(row));
                    format!("{:.1},{:.1}", x(index), top + tall * (1.0 - share))
                })
                .collect();
            let stroke = if holds {
                colour(scale.share(*value))
            } else {
                String::from("#ccc")
            };
            svg.raw(&format!(
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{stroke}\" stroke-opacity=\"0.6\"/>",
                places.join(" ")
            ));
        }
    }
    for (index, axis) in axes.iter().enumerate() {
        svg.line("axis", [x(index), top], [x(index), top + tall]);
        svg.text(
            "tick",
            [x(index), top - 6.0],
            Anchor::Middle,
            &short(axis.high),
        );
        svg.text(
            "tick",
            [x(index), top + tall + 14.0],
            Anchor::Middle,
            &short(axis.low),
        );
        let below = [
            x(index),
            top + tall + if index % 2 == 0 { 32.0 } else { 48.0 },
        ];
        svg.text("label", below, Anchor::Middle, &axis.label);
    }
    svg.finish([width, height], &study.name, STYLE)
}

/// Every variable against every answer: of a sweep in colours of the first objective, of an
/// optimisation with the `best` design marked.
fn pairs(study: &Study, rows: &[Row], best: Option<&Row>) -> String {
    let mut svg = Svg::default();
    let (across, upward) = (variables(study), answers(study));
    // The label of a panel and its ticks stand to the left of it.
    let (cell, label, top) = ([310.0, 220.0], 84.0, 82.0);
    let size = [
        (cell[0] * across.len() as f64 + 20.0).max(WIDTH),
        top + cell[1] * upward.len() as f64,
    ];
    svg.rectangle("paper", [0.0; 2], size);
    svg.text("title", [size[0] / 2.0, 26.0], Anchor::Middle, &study.name);
    let (name, values, scale) = colouring(study, rows);
    let words = match best {
        Some(best) => format!(
            "orange: the best of {} designs, {}",
            rows.len(),
            described(study, best)
        ),
        None => format!(
            "colour: {name}, from {} (dark) to {} (light)",
            short(scale.low),
            short(scale.high)
        ),
    };
    svg.text("note", [label, 46.0], Anchor::Start, &words);
    if !study.constraints.is_empty() {
        let words = "grey: breaks a constraint";
        svg.text("note", [label, 62.0], Anchor::Start, words);
    }
    for (j, answer) in upward.iter().enumerate() {
        for (i, variable) in across.iter().enumerate() {
            let done = rows.iter().filter(|row| row.status == Status::Done);
            let xs = rows.iter().map(|row| (variable.value)(row));
            let x = Axis::of(title_of(&variable.column), xs, variable.logarithmic).roomy();
            let y = Axis::of(
                title_of(&answer.column),
                done.map(|row| (answer.value)(row)),
                false,
            )
            .roomy();
            let corner = [label + cell[0] * i as f64, top + cell[1] * j as f64];
            let inner = [cell[0] - label, cell[1] - 56.0];
            frame(&mut svg, corner, inner, &x, &y);
            for (row, value) in rows.iter().zip(&values) {
                let point = [(variable.value)(row), (answer.value)(row)];
                if !point[1].is_finite() {
                    continue;
                }
                let [px, py] = at(corner, inner, &x, &y, point);
                let fill = match best {
                    _ if !feasible(study, row) => String::from("#ccc"),
                    Some(_) => String::from("#0072b2"),
                    None => colour(scale.share(*value)),
                };
                svg.raw(&format!(
                    "<circle cx=\"{px:.1}\" cy=\"{py:.1}\" r=\"2.5\" fill=\"{fill}\"/>"
                ));
            }
            if let Some(best) = best {
                let point = [(variable.value)(best), (answer.value)(best)];
                svg.circle("best", at(corner, inner, &x, &y, point), 6.0);
            }
        }
    }
    svg.finish(size, &study.name, STYLE)
}

/// A design in words: its variables and its answers.
fn described(study: &Study, row: &Row) -> String {
    let all = variables(study).into_iter().chain(answers(study));
    let word = |shown: Shown<'_>| {
        let name = shown.column.name.replace('_', " ");
        let unit = shown.column.unit;
        format!("{name} {} {unit}", short((shown.value)(row)))
            .trim_end()
            .to_owned()
    };
    all.map(word).collect::<Vec<_>>().join(", ")
}

/// The figure of an optimisation: of one objective all designs with the best one, of two the front with the
/// dominated designs grey, of three and more parallel coordinates of the front.
pub fn optimum(study: &Study, optimum: &Optimum) -> String {
    match study.objectives.len() {
        2 => front(study, optimum),
        1 => {
            let mut rows: Vec<Row> = optimum
                .dominated
                .iter()
                .map(|one| one.row.clone())
                .collect();
            rows.extend(optimum.front.iter().map(|one| one.row.clone()));
            let best = optimum.front.first().map(|one| &one.row);
            pairs(study, &rows, best)
        }
        _ => {
            let rows: Vec<Row> = optimum.front.iter().map(|one| one.row.clone()).collect();
            parallel(study, &rows)
        }
    }
}

/// Title and scale of an objective.
fn objective(study: &Study, index: usize) -> (String, f64) {
    let objective = &study.objectives[index];
    let column = objective.expression.lone_name().and_then(|name| {
        let answer = name.checked_sub(study.variables.len())?;
        study
            .answers
            .get(answer)
            .map(|answer| answer.column.clone())
    });
    let way = if objective.sign > 0.0 {
        "less is better"
    } else {
        "more is better"
    };
    column.map_or_else(
        || (format!("{} ({way})", objective.name), 1.0),
        |column| (format!("{} ({way})", title_of(&column)), column.scale),
    )
}

fn front(study: &Study, optimum: &Optimum) -> String {
    let mut svg = Svg::default();
    let size = [WIDTH, 480.0];
    svg.rectangle("paper", [0.0; 2], size);
    svg.text("title", [WIDTH / 2.0, 26.0], Anchor::Middle, &study.name);
    let [(first, s0), (second, s1)] = [objective(study, 0), objective(study, 1)];
    let point = |row: &Row| {
        let values = study.objective_values(row);
        [values[0] / s0, values[1] / s1]
    };
    let front: Vec<[f64; 2]> = optimum.front.iter().map(|one| point(&one.row)).collect();
    let beaten: Vec<[f64; 2]> = optimum
        .dominated
        .iter()
        .filter(|one| one.violation == 0.0)
        .map(|one| point(&one.row))
        .collect();
    let both = || front.iter().chain(&beaten);
    let x = Axis::of(first, both().map(|p| p[0]), false).roomy();
    let y = Axis::of(second, both().map(|p| p[1]), false).roomy();
    let (corner, inner) = ([86.0, 60.0], [600.0, 350.0]);
    frame(&mut svg, corner, inner, &x, &y);
    for (class, radius, points) in [("beaten", 2.0, &beaten), ("front", 4.0, &front)] {
        for one in points
            .iter()
            .filter(|one| one.iter().all(|value| value.is_finite()))
        {
            svg.circle(class, at(corner, inner, &x, &y, *one), radius);
        }
    }
    let note = format!(
        "blue: {} designs that no other one dominates; grey: dominated designs on the way",
        front.len()
    );
    svg.text("note", [86.0, 48.0], Anchor::Start, &note);
    if let Some(first) = optimum.front.first().map(|one| &one.row) {
        svg.circle("best", at(corner, inner, &x, &y, point(first)), 6.0);
        let note = format!("orange, the file of --best: {}", described(study, first));
        svg.text("note", [86.0, size[1] - 8.0], Anchor::Start, &note);
    }
    svg.finish(size, &study.name, STYLE)
}

/// The figure of a tolerance analysis: shares as a tornado, the distribution with its limits,
/// and the yield against the width of a limit.
pub fn tolerance(study: &Study, found: &Tolerance) -> String {
    let mut svg = Svg::default();
    let shown: Vec<_> = found
        .answers
        .iter()
        .filter(|one| one.deviation > 0.0)
        .collect();
    let bars = 44.0 * found.spreads.len() as f64 + 70.0;
    let panel = bars + 640.0;
    let size = [WIDTH, 60.0 + panel * shown.len().max(1) as f64];
    svg.rectangle("paper", [0.0; 2], size);
    svg.text("title", [WIDTH / 2.0, 26.0], Anchor::Middle, &study.name);
    for (index, one) in shown.iter().enumerate() {
        let answer = &study.answers[one.answer];
        let scale = answer.column.scale;
        let top = 50.0 + panel * index as f64;
        svg.text(
            "head",
            [20.0, top + 14.0],
            Anchor::Start,
            &format!(
                "{}: share of the variance by each spread",
                title_of(&answer.column)
            ),
        );
        let mut order: Vec<_> = one.shares.iter().collect();
        order.sort_by(|a, b| b.total.value.total_cmp(&a.total.value));
        let x = |share: f64| 150.0 + 500.0 * share.clamp(0.0, 1.0);
        for (row, share) in order.iter().enumerate() {
            let y = top + 34.0 + 44.0 * row as f64;
            svg.text(
                "label",
                [142.0, y + 18.0],
                Anchor::End,
                &share.variable.replace('_', " "),
            );
            svg.rectangle("total", [150.0, y], [x(share.total.value) - 150.0, 26.0]);
            svg.rectangle(
                "first",
                [150.0, y + 6.0],
                [x(share.first.value) - 150.0, 14.0],
            );
            let [low, high] = share.total.interval.map(x);
            svg.line("whisker", [low, y + 13.0], [high, y + 13.0]);
            svg.text(
                "tick",
                [high + 6.0, y + 17.0],
                Anchor::Start,
                &format!("{:.3}", share.total.value),
            );
        }
        if order.is_empty() {
            svg.text(
                "label",
                [40.0, top + 50.0],
                Anchor::Start,
                "no shares: devices failed or spreads are correlated",
            );
        } else {
            let note =
                "dark: alone; light: with what it does together with others; line: 95 % interval";
            svg.text("note", [150.0, top + bars - 22.0], Anchor::Start, note);
        }
        histogram(&mut svg, study, one, top + bars, scale);
        yield_curve(&mut svg, study, one, top + bars + 320.0);
    }
    svg.finish(size, &study.name, STYLE)
}

fn histogram(
    svg: &mut Svg,
    study: &Study,
    one: &crate::tolerance::Distribution,
    top: f64,
    scale: f64,
) {
    const BINS: usize = 40;
    let column = &study.answers[one.answer].column;
    let values: Vec<f64> = one.values.iter().map(|value| value / scale).collect();
    let x = Axis::of(title_of(column), values.iter().copied(), false).roomy();
    let mut counts = vec![0usize; BINS];
    for value in &values {
        let bin = (x.share(*value) * BINS as f64) as usize;
        counts[bin.min(BINS - 1)] += 1;
    }
    let most = counts.iter().copied().max().unwrap_or(1).max(1) as f64;
    let y = Axis {
        label: String::from("devices"),
        low: 0.0,
        high: 1.08 * most,
        logarithmic: false,
    };
    let (corner, size) = ([86.0, top + 16.0], [600.0, 236.0]);
    frame(svg, corner, size, &x, &y);
    for (bin, count) in counts.iter().enumerate() {
        let width = size[0] / BINS as f64;
        let tall = size[1] * *count as f64 / y.high;
        svg.rectangle(
            "bar",
            [corner[0] + width * bin as f64, corner[1] + size[1] - tall],
            [width - 0.5, tall],
        );
    }
    let limit = study
        .limits
        .iter()
        .find(|(of, _)| *of == one.answer)
        .map(|(_, limit)| *limit);
    let width = limit.and_then(|limit| limit.width(one.nominal));
    let ends = [
        limit.and_then(|limit| limit.at_most),
        limit.and_then(|limit| limit.at_least),
        width.map(|width| one.nominal - width),
        width.map(|width| one.nominal + width),
    ];
    for end in ends.into_iter().flatten() {
        let share = x.share(end / scale);
        if (0.0..=1.0).contains(&share) {
            let at = corner[0] + size[0] * share;
            svg.line("limit", [at, corner[1]], [at, corner[1] + size[1]]);
        }
    }
    let text = match one.yields {
        Some(found) => format!(
            "limits dashed: {:.1} % within (95 %: {:.1} to {:.1} %)",
            100.0 * found.value,
            100.0 * found.interval[0],
            100.0 * found.interval[1]
        ),
        None => String::from("no limit is given"),
    };
    svg.text("note", [corner[0], top + 8.0], Anchor::Start, &text);
}

/// Share of devices within a width about the nominal answer, against that width.
fn yield_curve(svg: &mut Svg, study: &Study, one: &crate::tolerance::Distribution, top: f64) {
    let mut widths: Vec<f64> = one
        .values
        .iter()
        .map(|value| 100.0 * (value / one.nominal - 1.0).abs())
        .collect();
    widths.sort_by(f64::total_cmp);
    let name = study.answers[one.answer].name.replace('_', " ");
    let x = Axis::of(
        format!("width of a limit about the nominal {name} [+-%]"),
        [0.0].into_iter().chain(widths.last().copied()),
        false,
    );
    let y = Axis {
        label: String::from("yield [%]"),
        low: 0.0,
        high: 100.0,
        logarithmic: false,
    };
    let (corner, size) = ([86.0, top + 10.0], [600.0, 236.0]);
    frame(svg, corner, size, &x, &y);
    let count = widths.len() as f64;
    let step = (widths.len() / 200).max(1);
    let mut points = vec![at(corner, size, &x, &y, [0.0, 0.0])];
    for (index, width) in widths.iter().enumerate().step_by(step) {
        points.push(at(
            corner,
            size,
            &x,
            &y,
            [*width, 100.0 * (index + 1) as f64 / count],
        ));
    }
    svg.path("curve", &points, false);
}

/// The figure of a placing: candidates, and the chosen ones with their numbers.
pub fn placing(study: &Study, found: &Placing) -> String {
    let mut svg = Svg::default();
    let reach = |axis: usize| {
        found
            .candidates
            .iter()
            .map(|place| place[axis].abs())
            .fold(0.0, f64::max)
            + found.side
    };
    let pixel = 300.0 / reach(0).max(reach(1)).max(1e-9);
    let size = [WIDTH, 2.0 * reach(1) * pixel + 130.0];
    svg.rectangle("paper", [0.0; 2], size);
    svg.text("title", [WIDTH / 2.0, 26.0], Anchor::Middle, &study.name);
    let middle = [WIDTH / 2.0, 64.0 + reach(1) * pixel];
    let best = found.best.first();
    for (index, place) in found.candidates.iter().enumerate() {
        let chosen = best.is_some_and(|best| best.chosen.contains(&index));
        let side = found.side * pixel;
        let centre = [middle[0] + place[0] * pixel, middle[1] - place[1] * pixel];
        let corner = [centre[0] - side / 2.0, centre[1] - side / 2.0];
        svg.rectangle(
            if chosen { "chosen" } else { "place" },
            corner,
            [side, side],
        );
        let class = if chosen { "white" } else { "tick" };
        svg.text(
            class,
            [centre[0], centre[1] + 4.0],
            Anchor::Middle,
            &index.to_string(),
        );
    }
    let text = best.map_or_else(
        || String::from("no choice has information everywhere"),
        |best| {
            format!(
                "blue: chosen; deviation of the place {} mm rms, {} mm at worst",
                short(best.rms * 1e3),
                short(best.worst * 1e3)
            )
        },
    );
    svg.text(
        "label",
        [WIDTH / 2.0, size[1] - 22.0],
        Anchor::Middle,
        &text,
    );
    svg.finish(size, &study.name, STYLE)
}

/// A page with a figure and its table, which needs nothing else.
pub fn page(title: &str, svg: &str, table: &str) -> String {
    let escape = taxel::svg::escape;
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<title>{0}</title>\n\
         <style>body{{font-family:system-ui,sans-serif;margin:2rem}}pre{{overflow:auto;font-size:12px}}</style>\n{svg}\n\
         <pre>{1}</pre>\n</html>\n",
        escape(title),
        escape(table)
    )
}
