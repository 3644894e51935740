//! What may be asked of a design.

use taxel::InputError;
use taxel::device::{Device, PlaceInformation, PlacedContact, read_back};
use taxel::estimation::{Outcome as SearchOutcome, SearchOptions, estimate_unit};
use taxel::information::{Information, InformationOptions, NoInformation, RadiusKnowledge};
use taxel::mechanics::Mechanics;
use taxel::predict::{Load, LoadKind, LoadValue, Loads, Predictor};
use taxel::quantity::{self, Dimension};
use taxel::sensor::Sensor;
use taxel::summary::{self, Fact};
use taxel::table::{Cell, Column};
use taxel::words::advice;
use taxel_bodies::microchannel_section::{DrawnSection, SectionRow, SectionState, solve_section};

use crate::exponents::{Exponents, quantity_of};
use crate::file::{AfterFile, AnswerFile, MechanicsFile, RadiusFile, Source, Take};

/// What became of an answer.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// A number, SI.
    Number(f64),
    /// A word.
    Word(String),
    /// Outside the accepted states, or without information: why.
    Outside(String),
    /// A solver stopped: why.
    Ended(String),
    /// Not asked: the design was refused.
    None,
}

impl Outcome {
    /// The number.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Number(number) => Some(*number),
            _ => None,
        }
    }
}

/// One answer, ready to be evaluated.
#[derive(Debug, Clone)]
pub struct Answer {
    /// Name.
    pub name: String,
    /// Its column in tables.
    pub column: Column,
    /// True if it is a word.
    pub word: bool,
    /// All that it follows from beside the sensor, for the name of a kept result.
    pub statement: String,
    kind: Kind,
    accept: Vec<String>,
}

#[derive(Debug, Clone)]
enum Kind {
    Check(String),
    /// Which of several ways answers for the drawing.
    Way,
    Predict(Prediction),
    Estimate(Estimate),
    Section(Section),
}

/// What is asked of the section of a microchannel.
#[derive(Debug, Clone)]
struct Section {
    quantity: &'static str,
    pressure: Condition,
    thickness: Condition,
    /// Pressures on the way, Pa: those that the study lists, rising; without a list the pressure
    /// is reached at once.
    way: Vec<f64>,
}

/// A number that an answer states, or the variable without a key that it names.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Condition {
    Stated(f64),
    Variable(usize),
}

impl Condition {
    fn at(self, point: &[f64]) -> f64 {
        match self {
            Self::Stated(value) => value,
            Self::Variable(index) => point[index],
        }
    }
}

/// A variable of the study, as an answer may name it.
pub(crate) struct Named<'a> {
    pub(crate) name: &'a str,
    /// True if it has no key, and so changes no sensor file.
    pub(crate) keyless: bool,
    /// Dimension of its numbers; none of words.
    pub(crate) exponents: Option<Exponents>,
    /// Its least value, SI.
    pub(crate) least: f64,
    /// Its values, SI, where the study lists them.
    pub(crate) listed: &'a [f64],
}

/// A section that was solved, with all that it follows from beside the sensor.
#[derive(Debug)]
pub(crate) struct SolvedSection {
    thickness: f64,
    way: Vec<f64>,
    row: SectionRow,
}

#[derive(Debug, Clone)]
struct Prediction {
    quantity: String,
    mechanics: Option<Mechanics>,
    /// Loads in the words of `--load`.
    loads: Vec<String>,
    take: Take,
}

#[derive(Debug, Clone, PartialEq)]
struct Estimate {
    what: Estimated,
    /// One load, or those of a range.
    loads: Vec<String>,
    options: InformationOptions,
    grid: Option<[usize; 2]>,
    take: Take,
}

/// Quantities of an estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Estimated {
    Deviation(&'static str),
    Place,
    A,
    D,
    E,
    Condition,
    Range,
    RangeEndedBy,
    Linearity,
    Crosstalk,
    TimeConstant,
    Bandwidth,
    Stretch,
    Force(usize),
}

/// Quantities of an estimate by name.
const ESTIMATED: [(&str, Estimated); 20] = [
    ("deviation", Estimated::Deviation("")),
    ("deviation_x", Estimated::Deviation("force_x")),
    ("deviation_y", Estimated::Deviation("force_y")),
    ("deviation_z", Estimated::Deviation("force_z")),
    ("deviation_place", Estimated::Place),
    ("deviation_radius", Estimated::Deviation("radius")),
    ("a_criterion", Estimated::A),
    ("d_criterion", Estimated::D),
    ("e_criterion", Estimated::E),
    ("condition", Estimated::Condition),
    ("range", Estimated::Range),
    ("range_ended_by", Estimated::RangeEndedBy),
    ("linearity", Estimated::Linearity),
    ("crosstalk", Estimated::Crosstalk),
    ("time_constant", Estimated::TimeConstant),
    ("bandwidth", Estimated::Bandwidth),
    ("greatest_stretch", Estimated::Stretch),
    ("estimated_force_x", Estimated::Force(0)),
    ("estimated_force_y", Estimated::Force(1)),
    ("estimated_force_z", Estimated::Force(2)),
];

/// A mistake in an answer: its key, the message, advice.
pub(crate) struct Wrong {
    pub(crate) key: &'static str,
    pub(crate) message: String,
    pub(crate) help: String,
}

fn wrong<T>(
    key: &'static str,
    message: impl Into<String>,
    help: impl Into<String>,
) -> Result<T, Wrong> {
    Err(Wrong {
        key,
        message: message.into(),
        help: help.into(),
    })
}

/// Column of a table of designs that says which way answers for each.
pub const WAY_COLUMN: &str = "answered_by";
/// Steps of a range of loads.
const STEPS: usize = 100;
/// Steps in which the end of a range is looked for before it is halved in.
const RANGE_STEPS: usize = 64;
/// Column of a prediction with the stretch of the top of a layer.
const STRETCH: &str = "top_stretch";
/// Cells of the region of a place, along x and y, where none are stated.
const GRID: [usize; 2] = [25, 9];

/// One design while its answers are taken: what several of them need is computed once.
pub(crate) struct Context<'a> {
    sensor: &'a Sensor,
    device: Option<Box<dyn Device + 'a>>,
    facts: Option<Vec<Fact>>,
    predictor: Option<Box<dyn Predictor>>,
    drawn: Option<(&'a Sensor, AfterFile)>,
    /// Numbers over a region with all that they follow from: rms and worst are asked together.
    region: Option<(Estimate, Vec<Option<f64>>)>,
    /// The section of a microchannel on its way of pressures.
    pub(crate) section: Option<SolvedSection>,
    /// Values of the variables.
    point: &'a [f64],
    /// True when the user wants to stop.
    stop: &'a dyn Fn() -> bool,
    /// True once a solution was given up for that.
    pub(crate) stopped: bool,
}

impl<'a> Context<'a> {
    pub(crate) fn new(
        sensor: &'a Sensor,
        drawn: Option<(&'a Sensor, AfterFile)>,
        point: &'a [f64],
        stop: &'a dyn Fn() -> bool,
    ) -> Self {
        Self {
            sensor,
            device: sensor.device().ok(),
            facts: None,
            predictor: None,
            drawn,
            region: None,
            section: None,
            point,
            stop,
            stopped: false,
        }
    }

    fn facts(&mut self) -> &[Fact] {
        let sensor = self.sensor;
        self.facts
            .get_or_insert_with(|| summary::summary(sensor).unwrap_or_default())
    }
}

fn column_of(dimension: &'static Dimension, name: &str, typical: f64) -> Column {
    let (unit, scale) = dimension
        .units
        .iter()
        .filter(|(_, scale)| *scale <= typical * 1.0000001)
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .copied()
        .unwrap_or((dimension.si, 1.0));
    Column::new(name, unit, scale, key_of(dimension), 4)
}

/// The SI unit of a dimension as it ends a key of JSON.
pub(crate) fn key_of(dimension: &Dimension) -> &'static str {
    match dimension.si {
        "m" => "m",
        "s" => "s",
        "Hz" => "hz",
        "N" => "n",
        "N/m" => "n_per_m",
        "Pa" => "pa",
        "F" => "f",
        "kg/m3" => "kg_per_m3",
        "Pa s" => "pa_s",
        "m/s" => "m_per_s",
        "C/N" => "c_per_n",
        "ohm" => "ohm",
        "ohm m" => "ohm_m",
        "m2" => "m2",
        "C" => "c",
        "V" => "v",
        _ => "",
    }
}

impl Answer {
    pub(crate) fn read(
        name: &str,
        written: &AnswerFile,
        sensor: &Sensor,
        variables: &[Named<'_>],
    ) -> Result<Self, Wrong> {
        let statement = format!("{written:?}");
        let accept = written
            .accept
            .clone()
            .unwrap_or_else(|| ["ok", "open"].map(str::to_owned).to_vec());
        let (kind, column, word) = match written.of {
            Source::Check => check(name, written, sensor)?,
            Source::Predict => prediction(name, written, sensor)?,
            Source::Estimate => estimate(name, written, sensor)?,
            Source::ChannelSection => section(name, written, sensor, variables)?,
        };
        Ok(Self {
            name: name.to_owned(),
            column,
            word,
            statement,
            kind,
            accept,
        })
    }

    /// Which of several ways answers for the drawing of a design: no question of the study, but a
    /// curve that changes it in its middle must say so.
    pub(crate) fn way() -> Self {
        Self {
            name: String::from(WAY_COLUMN),
            column: Column::plain(WAY_COLUMN),
            word: true,
            statement: String::from(WAY_COLUMN),
            kind: Kind::Way,
            accept: Vec::new(),
        }
    }

    pub(crate) fn evaluate(&self, context: &mut Context<'_>) -> Outcome {
        match &self.kind {
            Kind::Check(quantity) => {
                let facts = context.facts();
                let Some(fact) = facts.iter().find(|fact| fact.name == *quantity) else {
                    return Outcome::Outside(format!("this design has no {quantity}"));
                };
                match &fact.value {
                    summary::Value::Number { si, .. } => finite(*si),
                    summary::Value::Text(text) => match text.parse() {
                        Ok(number) if !self.word => finite(number),
                        _ => Outcome::Word(text.clone()),
                    },
                }
            }
            Kind::Way => {
                let way = context.device.as_deref().map(Device::way);
                Outcome::Word(way.unwrap_or_default())
            }
            Kind::Predict(prediction) => prediction.evaluate(context, &self.accept, self.word),
            Kind::Estimate(estimate) => estimate.evaluate(context, &self.accept),
            Kind::Section(section) => section.evaluate(context, &self.accept),
        }
    }

    /// True if it names the variable at `index`, which has no key.
    pub(crate) fn uses(&self, index: usize) -> bool {
        let Kind::Section(section) = &self.kind else {
            return false;
        };
        [section.pressure, section.thickness].contains(&Condition::Variable(index))
    }
}

/// Advice for a name that is none of `known`.
fn unknown(name: &str, known: &[&str], intro: &str) -> String {
    let all = format!("{intro}: {}", known.join(", "));
    advice(name, known.iter().copied(), &all)
}

fn finite(number: f64) -> Outcome {
    if number.is_finite() {
        Outcome::Number(number)
    } else {
        Outcome::Outside(String::from("has no finite value"))
    }
}

/// Refuses what is written beside the keys that an answer of this kind uses.
fn unused(written: &AnswerFile, used: &[&str]) -> Result<(), Wrong> {
    let given = [
        ("load", written.load.is_some()),
        ("over", written.over.is_some()),
        ("take", written.take.is_some()),
        ("noise", written.noise.is_some()),
        ("grid", written.grid.is_some()),
        ("radius", written.radius.is_some()),
        ("mechanics", written.mechanics.is_some()),
        ("pressure", written.pressure.is_some()),
    ];
    let mut given = given.into_iter().filter(|(_, given)| *given);
    match given.find(|(key, _)| !used.contains(key)) {
        None => Ok(()),
        Some((key, _)) => {
            let of = format!("{:?}", written.of).to_lowercase();
            wrong(
                key,
                format!("an answer of {of} does not use {key}"),
                "leave it out",
            )
        }
    }
}

fn check(name: &str, written: &AnswerFile, sensor: &Sensor) -> Result<(Kind, Column, bool), Wrong> {
    unused(written, &[])?;
    let facts = summary::summary(sensor).unwrap_or_default();
    let Some(fact) = facts.iter().find(|fact| fact.name == written.quantity) else {
        let names: Vec<&str> = facts.iter().map(|fact| fact.name.as_str()).collect();
        return wrong(
            "quantity",
            format!(
                "taxel check prints no \"{}\" of this sensor",
                written.quantity
            ),
            unknown(&written.quantity, &names, "it prints"),
        );
    };
    let (column, word) = match &fact.value {
        summary::Value::Number {
            key, unit, scale, ..
        } => (Column::new(name, unit, *scale, key, 4), false),
        summary::Value::Text(text) => (
            Column::new(name, "", 1.0, "", 4),
            text.parse::<f64>().is_err(),
        ),
    };
    Ok((Kind::Check(written.quantity.clone()), column, word))
}

fn predictor_of(
    sensor: &Sensor,
    device: &dyn Device,
    mechanics: &Mechanics,
) -> Result<Box<dyn Predictor>, String> {
    match mechanics {
        // A table is read like a closed form.
        Mechanics::ClosedForm | Mechanics::Table(_) => device
            .predictor()
            .ok_or_else(|| String::from("this element has no model to predict with")),
        Mechanics::Fem => taxel_bodies::field_predictor(sensor).map_err(|error| error.to_string()),
    }
}

/// The mechanics of an answer, or else that of the sensor file; a table is not left for closed forms.
fn mechanics_of<'m>(
    written: Option<&'m Mechanics>,
    sensor: &'m Sensor,
) -> Result<&'m Mechanics, Wrong> {
    match (written, &sensor.mechanics) {
        (Some(Mechanics::ClosedForm), Mechanics::Table(table)) => Err(Wrong {
            key: "mechanics",
            message: format!(
                "the sensor file answers by the table {table}, and not by closed forms"
            ),
            help: String::from("leave mechanics out here, or in the sensor file"),
        }),
        (written, of_file) => Ok(written.unwrap_or(of_file)),
    }
}

fn prediction(
    name: &str,
    written: &AnswerFile,
    sensor: &Sensor,
) -> Result<(Kind, Column, bool), Wrong> {
    unused(written, &["load", "over", "take", "mechanics"])?;
    let mechanics = written.mechanics.map(|mechanics| match mechanics {
        MechanicsFile::ClosedForm => Mechanics::ClosedForm,
        MechanicsFile::Fem => Mechanics::Fem,
    });
    let device = sensor.device().map_err(|error| Wrong {
        key: "of",
        message: error.to_string(),
        help: String::new(),
    })?;
    let asked = mechanics_of(mechanics.as_ref(), sensor)?;
    let predictor = predictor_of(sensor, device.as_ref(), asked);
    let predictor = predictor.map_err(|message| Wrong {
        key: "of",
        message,
        help: String::from("ask of = \"check\""),
    })?;
    let columns = predictor.columns();
    let Some(column) = columns
        .iter()
        .find(|column| column.name == written.quantity)
    else {
        let names: Vec<&str> = columns.iter().map(|column| column.name.as_str()).collect();
        return wrong(
            "quantity",
            format!(
                "taxel predict has no column \"{}\" for this sensor",
                written.quantity
            ),
            unknown(&written.quantity, &names, "its columns are"),
        );
    };
    let (loads, take) = match (&written.load, &written.over) {
        (Some(load), None) => (vec![load.clone()], Take::Last),
        (None, Some(range)) => {
            let take = written.take.unwrap_or(Take::Last);
            if !matches!(take, Take::Last | Take::Greatest | Take::Least) {
                return wrong(
                    "take",
                    "a range of loads has no region",
                    "use last, greatest or least",
                );
            }
            (over(range)?, take)
        }
        _ => {
            return wrong(
                "load",
                "one of load and over is needed",
                "such as load = \"fz=5 N\"",
            );
        }
    };
    let key = if written.over.is_some() {
        "over"
    } else {
        "load"
    };
    let mut last = None;
    for load in &loads {
        let read = Loads::one(load, predictor.load_columns());
        let read = read.map_err(|error| of_load(key, &error))?;
        predictor
            .combination(&read.given.columns)
            .map_err(|message| Wrong {
                key,
                message,
                help: String::from("name the loads that `taxel predict` takes"),
            })?;
        last = Some(read);
    }
    // A word shows itself only in an answer.
    let mut row = Vec::new();
    let answered = mechanics != Some(Mechanics::Fem)
        && last.is_some_and(|loads| predictor.answer(&loads.load(0), &mut row).is_ok());
    let index = columns.iter().position(|one| one.name == written.quantity);
    let word = answered
        && index
            .is_some_and(|index| matches!(row.get(index), Some(Cell::Text(_) | Cell::State(_))));
    let column = Column {
        name: name.to_owned(),
        ..column.clone()
    };
    let prediction = Prediction {
        quantity: written.quantity.clone(),
        mechanics,
        loads,
        take,
    };
    Ok((Kind::Predict(prediction), column, word))
}

fn of_load(key: &'static str, error: &InputError) -> Wrong {
    Wrong {
        key,
        message: error.message.clone(),
        help: error.help.clone(),
    }
}

/// Loads of a range such as `fz=0..10 N` or `fz = 5 mN .. 50 N, radius = 4 mm`: equal steps, or equal
/// ratios where the first of equal steps would leap over more than the least load.
fn over(text: &str) -> Result<Vec<String>, Wrong> {
    let help = "such as over = \"fz=0..10 N\" or \"fz=5 mN..50 N\"";
    let parts = || text.split(',').map(str::trim);
    let ends = parts().find_map(|part| {
        let (name, ends) = part.split_once('=')?;
        let (first, last) = ends.split_once("..")?;
        Some((part, name.trim(), first.trim(), last.trim()))
    });
    let Some((range, name, first, last)) = ends else {
        return wrong("over", format!("\"{text}\" has no two ends"), help);
    };
    let unit =
        last.trim_start_matches(|c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.' | ' '));
    // The first end has the unit of the last one, or one of its own.
    let with_unit = |end: &str| {
        if let Ok(number) = end.parse::<f64>() {
            return Some(number);
        }
        let (dimension, _, si) = quantity_of(end)?;
        let scale = dimension.unit(unit)?;
        Some(si / scale)
    };
    let (Some(low), Some(high)) = (with_unit(first), with_unit(last)) else {
        let message = format!("the ends of \"{range}\" are no numbers of one dimension");
        return wrong("over", message, help);
    };
    if low.is_nan() || high.is_nan() || low >= high {
        return wrong("over", format!("the range \"{range}\" is empty"), help);
    }
    let last_step = STEPS as f64;
    let ratios = low > 0.0 && (high - low) / last_step > low;
    let at = |step: usize| match step {
        // Each end is itself.
        STEPS => high,
        _ if ratios => low * (high / low).powf(step as f64 / last_step),
        _ => low + (high - low) * step as f64 / last_step,
    };
    let load = |step: usize| {
        let ranged = format!("{name}={} {unit}", at(step));
        let parts = parts().map(|part| {
            if part == range {
                ranged.trim_end()
            } else {
                part
            }
        });
        parts.collect::<Vec<_>>().join(", ")
    };
    Ok((0..=STEPS).map(load).collect())
}

impl Prediction {
    fn evaluate(&self, context: &mut Context<'_>, accept: &[String], word: bool) -> Outcome {
        let mechanics = self.mechanics.as_ref().unwrap_or(&context.sensor.mechanics);
        let Some(device) = context.device.as_deref() else {
            return Outcome::Outside(String::from("the board cannot read the element"));
        };
        let mut own = None;
        let predictor: &mut Box<dyn Predictor> = if *mechanics == Mechanics::Fem {
            match predictor_of(context.sensor, device, mechanics) {
                Ok(predictor) => own.insert(predictor),
                Err(why) => return Outcome::Outside(why),
            }
        } else {
            if context.predictor.is_none() {
                context.predictor = device.predictor();
            }
            match &mut context.predictor {
                Some(predictor) => predictor,
                None => return Outcome::Outside(String::from("has no model")),
            }
        };
        let mut best: Option<f64> = None;
        let columns = predictor.columns();
        // Of a way the greatest load is solved first; closed forms prepare nothing.
        for load in self.loads.iter().rev() {
            let Ok(read) = Loads::one(load, predictor.load_columns()) else {
                return Outcome::Outside(format!("the load {load} is refused"));
            };
            if best.is_none()
                && let Err(why) = predictor.prepare(&read, &mut |_| {})
            {
                return Outcome::Ended(why);
            }
            let value = match answer_of(predictor.as_ref(), &columns, &read, &self.quantity, accept)
            {
                Outcome::Number(value) => value,
                other => {
                    return if word || !matches!(other, Outcome::Word(_)) {
                        other
                    } else {
                        Outcome::Outside(String::from("is a word"))
                    };
                }
            };
            best = Some(match (self.take, best) {
                (Take::Greatest, Some(best)) => best.max(value),
                (Take::Least, Some(best)) => best.min(value),
                (_, Some(best)) => best,
                (_, None) => value,
            });
            if self.take == Take::Last {
                break;
            }
        }
        best.map_or(Outcome::None, Outcome::Number)
    }
}

/// The cell of a column under one load, if all states are accepted.
fn answer_of(
    predictor: &dyn Predictor,
    columns: &[Column],
    loads: &Loads,
    quantity: &str,
    accept: &[String],
) -> Outcome {
    let mut row = Vec::new();
    if let Err(refused) = predictor.answer(&loads.load(0), &mut row) {
        return Outcome::Outside(refused.message);
    }
    if let Some(state) = unaccepted(columns, &row, quantity, accept) {
        return Outcome::Outside(format!("state {state}"));
    }
    let index = columns.iter().position(|column| column.name == quantity);
    match index.and_then(|index| row.get(index)) {
        Some(Cell::Number(number)) => finite(*number),
        Some(Cell::Whole(whole)) => Outcome::Number(*whole as f64),
        Some(Cell::Missing) => Outcome::Outside(String::from("there is no number at this load")),
        Some(Cell::Text(text)) => Outcome::Word(text.to_string()),
        Some(Cell::State(state)) => Outcome::Word((*state).to_owned()),
        None => Outcome::Outside(format!("this design has no {quantity}")),
    }
}

/// The first state that is not accepted; of a quantity with the prefix of a state, that state.
fn unaccepted(
    columns: &[Column],
    row: &[Cell],
    quantity: &str,
    accept: &[String],
) -> Option<&'static str> {
    let names = columns.iter().map(|column| column.name.as_str());
    let states: Vec<(&str, &'static str)> = names
        .zip(row)
        .filter_map(|(name, cell)| match cell {
            Cell::State(state) => Some((name, *state)),
            _ => None,
        })
        .collect();
    let own = |name: &str| {
        name.strip_suffix("state")
            .is_some_and(|prefix| !prefix.is_empty() && quantity.starts_with(prefix))
    };
    let has_own = states.iter().any(|(name, _)| own(name));
    let concerned = |name: &str| (!has_own || own(name)) && name != quantity;
    let accepted = |state: &str| accept.iter().any(|ok| ok == state);
    let mut states = states.into_iter();
    states.find_map(|(name, state)| (concerned(name) && !accepted(state)).then_some(state))
}

fn estimate(
    name: &str,
    written: &AnswerFile,
    sensor: &Sensor,
) -> Result<(Kind, Column, bool), Wrong> {
    unused(
        written,
        &["load", "over", "take", "noise", "grid", "radius"],
    )?;
    let found = ESTIMATED
        .iter()
        .find(|(known, _)| *known == written.quantity);
    let Some((_, what)) = found else {
        let names = ESTIMATED.map(|(known, _)| known);
        return wrong(
            "quantity",
            format!("an estimate has no \"{}\"", written.quantity),
            unknown(&written.quantity, &names, "use one of"),
        );
    };
    let device = sensor.device().map_err(|error| Wrong {
        key: "of",
        message: error.to_string(),
        help: String::new(),
    })?;
    let predictor = device.predictor();
    let of_predictor = what.of_predictor();
    if let Some(missing) = what.lacks(device.as_ref(), predictor.as_deref()) {
        return wrong("quantity", missing, "ask for another quantity");
    }
    let load_columns = match &predictor {
        Some(predictor) if of_predictor => predictor.load_columns(),
        _ => device.information_loads(),
    };
    if load_columns.is_empty() {
        return wrong(
            "of",
            "no information is computed for this kind of device",
            "ask of = \"check\"",
        );
    }
    if what.of_device() {
        unused(written, &[])?;
        let column = if *what == Estimated::Bandwidth {
            column_of(&quantity::FREQUENCY, name, 1.0)
        } else {
            column_of(&quantity::TIME, name, 1e-3)
        };
        let estimate = Estimate {
            what: *what,
            loads: Vec::new(),
            options: InformationOptions::default(),
            grid: None,
            take: Take::Last,
        };
        return Ok((Kind::Estimate(estimate), column, false));
    }
    let (given, loads) = loads_of(written, *what, load_columns)?;
    let noise = noise_of(written, device.as_ref())?;
    let options = InformationOptions {
        noise,
        radius: radius(written.radius.as_ref())?,
    };
    let grid = grid_of(written, *what, sensor)?;
    let usual = if written.over.is_some() {
        Take::Worst
    } else {
        Take::Rms
    };
    let take = written.take.unwrap_or(usual);
    if grid.is_some() && written.over.is_some() {
        return wrong("over", "a region is of one load", "leave out grid or over");
    }
    if grid.is_some() && !matches!(take, Take::Mean | Take::Rms | Take::Worst) {
        return wrong(
            "take",
            "a region has a mean, an rms and a worst",
            "use mean, rms or worst",
        );
    }
    let column = estimate_column(name, *what, device.as_ref(), &loads, load_columns, written)?;
    let estimate = Estimate {
        what: *what,
        loads: given,
        options,
        grid,
        take,
    };
    let word = *what == Estimated::RangeEndedBy;
    Ok((Kind::Estimate(estimate), column, word))
}

/// The loads of an estimate, one or those of a range, and the last one, read.
fn loads_of(
    written: &AnswerFile,
    what: Estimated,
    columns: &'static [taxel::predict::LoadColumn],
) -> Result<(Vec<String>, Loads), Wrong> {
    let (key, given) = match (&written.load, &written.over) {
        (Some(load), None) => ("load", vec![load.clone()]),
        (None, Some(range)) if what.of_one_load() => ("over", over(range)?),
        (None, Some(_)) => {
            let message = "over a range of loads deviations, criteria and condition are known";
            return wrong("over", message, "give one load");
        }
        _ => {
            let message = "an estimate needs a load, or a range of them in over";
            return wrong("load", message, "such as load = \"fz=5 N\"");
        }
    };
    let read = given.iter().map(|load| Loads::one(load, columns));
    let read = read.collect::<Result<Vec<Loads>, InputError>>();
    let last = read.map_err(|error| of_load(key, &error))?.pop();
    match last {
        Some(last) => Ok((given, last)),
        None => wrong(key, "there is no load", "give one load"),
    }
}

/// Cells of the region over which a place is asked; none for one contact.
fn grid_of(
    written: &AnswerFile,
    what: Estimated,
    sensor: &Sensor,
) -> Result<Option<[usize; 2]>, Wrong> {
    let place = what == Estimated::Place;
    let of_region = place && written.take.is_some() && written.over.is_none();
    let grid = (of_region || written.grid.is_some()).then(|| written.grid.unwrap_or(GRID));
    if let Some([across, along]) = grid {
        if sensor.piezoelectric().is_err() {
            return wrong(
                "grid",
                "only places on a piezoelectric array have a region",
                "leave grid out",
            );
        }
        if !(1..=1000).contains(&across) || !(1..=1000).contains(&along) {
            return wrong(
                "grid",
                "a grid has 1 to 1000 cells each way",
                "such as grid = [25, 9]",
            );
        }
    }
    Ok(grid)
}

/// Noise of a reading that an answer states, SI.
fn noise_of(written: &AnswerFile, device: &dyn Device) -> Result<Option<f64>, Wrong> {
    let Some(text) = &written.noise else {
        return Ok(None);
    };
    let dimension = device.information_noise();
    match dimension.parse(text) {
        Ok(noise) if noise > 0.0 => Ok(Some(noise)),
        Ok(_) => wrong(
            "noise",
            format!("\"{text}\" is not above zero"),
            format!("write {} above zero", dimension.name),
        ),
        Err(message) => wrong(
            "noise",
            message,
            format!("write {} above zero", dimension.name),
        ),
    }
}

fn radius(written: Option<&RadiusFile>) -> Result<RadiusKnowledge, Wrong> {
    let help = "write known, unknown or a range such as [\"1 mm\", \"4 mm\"]";
    match written {
        None => Ok(RadiusKnowledge::Known),
        Some(RadiusFile::Word(word)) => match word.as_str() {
            "known" => Ok(RadiusKnowledge::Known),
            "unknown" => Ok(RadiusKnowledge::Unknown),
            _ => wrong(
                "radius",
                format!("\"{word}\" says nothing of a radius"),
                help,
            ),
        },
        Some(RadiusFile::Range(ends)) => {
            let [low, high] = ends.each_ref().map(|end| quantity::LENGTH.parse(end));
            match (low, high) {
                (Ok(low), Ok(high)) if low < high => Ok(RadiusKnowledge::Between([low, high])),
                (Err(message), _) | (_, Err(message)) => wrong("radius", message, help),
                _ => wrong("radius", "the range is empty", help),
            }
        }
    }
}

fn estimate_column(
    name: &str,
    what: Estimated,
    device: &dyn Device,
    loads: &Loads,
    load_columns: &[taxel::predict::LoadColumn],
    written: &AnswerFile,
) -> Result<Column, Wrong> {
    let plain = || Column::new(name, "", 1.0, "", 4);
    let first = load_columns
        .iter()
        .zip(&loads.given.columns)
        .find(|(column, given)| **given && matches!(column.kind, LoadKind::Quantity(..)));
    let dimension = match what {
        Estimated::Place => &quantity::LENGTH,
        Estimated::Linearity | Estimated::Crosstalk => {
            return Ok(Column::new(name, "%", 1e-2, "share", 4));
        }
        Estimated::Range => match first.map(|(column, _)| column.kind) {
            Some(LoadKind::Quantity(dimension, _)) => dimension,
            _ => return Ok(plain()),
        },
        Estimated::Force(_) => &quantity::FORCE,
        Estimated::Deviation(of) => {
            let options = InformationOptions::default();
            let unknowns = device.information(&loads.load(0), &options);
            let unknowns = unknowns.map(|found| found.unknowns).unwrap_or_default();
            let found = match of {
                "" if unknowns.iter().filter(|one| !one.beside).count() > 1 => {
                    return wrong(
                        "quantity",
                        "this device estimates several numbers",
                        "use deviation_x, deviation_y, deviation_z or deviation_place",
                    );
                }
                "" => unknowns.first(),
                "radius" => return Ok(column_of(&quantity::LENGTH, name, 1e-3)),
                _ => unknowns.iter().find(|one| one.name == of),
            };
            match found {
                Some(unknown) => unknown.dimension,
                None if unknowns.is_empty() => &quantity::FORCE,
                None => {
                    let names: Vec<&str> = unknowns.iter().map(|one| one.name).collect();
                    return wrong(
                        "quantity",
                        format!("this device does not estimate the {} of", written.quantity),
                        format!("it estimates: {}", names.join(", ")),
                    );
                }
            }
        }
        _ => return Ok(plain()),
    };
    let typical = match what {
        Estimated::Range => 1.0,
        _ => 1e-3,
    };
    Ok(column_of(dimension, name, typical))
}

impl Estimate {
    fn evaluate(&self, context: &mut Context<'_>, accept: &[String]) -> Outcome {
        match self.what {
            Estimated::Range | Estimated::RangeEndedBy => self.range(context, accept),
            Estimated::Force(axis) => self.force(context, axis),
            Estimated::Linearity => self.linearity(context, accept),
            Estimated::Stretch => self.stretch(context, accept),
            Estimated::Crosstalk => self.crosstalk(context),
            Estimated::TimeConstant | Estimated::Bandwidth => self.of_times(context),
            _ if self.grid.is_some() => self.region(context),
            _ => {
                let values = self.loads.iter().map(|load| self.at(context, load));
                match values.collect::<Result<Vec<f64>, Outcome>>() {
                    Ok(values) => summed_up(&values, self.take),
                    Err(outcome) => outcome,
                }
            }
        }
    }

    /// The one load.
    fn load(&self) -> &str {
        self.loads.first().map_or("", String::as_str)
    }

    /// The number that is asked of the information at a load.
    fn at(&self, context: &Context<'_>, load: &str) -> Result<f64, Outcome> {
        let Some(device) = context.device.as_deref() else {
            let why = "the board cannot read the element";
            return Err(Outcome::Outside(String::from(why)));
        };
        let Ok(loads) = Loads::one(load, device.information_loads()) else {
            return Err(Outcome::Outside(format!("the load {load} is refused")));
        };
        match device.information(&loads.load(0), &self.options) {
            Ok(information) => self
                .of(&information, anywhere(context.sensor))
                .ok_or_else(no_information),
            Err(NoInformation::Beyond(why)) => Err(Outcome::Outside(why)),
            Err(error) => Err(Outcome::Outside(error.to_string())),
        }
    }

    /// The number that is asked of an information; none where it is singular, and of a place no
    /// better known than `anywhere`, m.
    fn of(&self, information: &Information, anywhere: f64) -> Option<f64> {
        match self.what {
            Estimated::Deviation("") => information.deviation(information.unknowns[0].name),
            Estimated::Deviation(name) => information.deviation(name),
            Estimated::Place => information
                .place_deviation()
                .filter(|deviation| *deviation < anywhere),
            Estimated::A => information.a_criterion(),
            Estimated::D => information.d_criterion(),
            Estimated::E => information.e_criterion(),
            Estimated::Condition => Some(information.condition()).filter(|one| one.is_finite()),
            _ => None,
        }
    }

    /// Over the middles of the cells of the rectangle of the elements.
    fn region(&self, context: &mut Context<'_>) -> Outcome {
        // How the numbers are summed up changes none of them.
        let question = Self {
            take: Take::Rms,
            ..self.clone()
        };
        if context
            .region
            .as_ref()
            .is_none_or(|(known, _)| *known != question)
        {
            match self.region_values(context.sensor) {
                Ok(values) => context.region = Some((question, values)),
                Err(why) => return Outcome::Outside(why),
            }
        }
        let values = context
            .region
            .as_ref()
            .map(|(_, values)| values.iter().copied());
        let values: Option<Vec<f64>> = values.and_then(Iterator::collect);
        let Some(values) = values else {
            return no_information();
        };
        summed_up(&values, self.take)
    }

    fn region_values(&self, sensor: &Sensor) -> Result<Vec<Option<f64>>, String> {
        let array = sensor.piezoelectric().map_err(|error| error.to_string())?;
        let loads = Loads::one(self.load(), array.information_loads());
        let loads = loads.map_err(|error| error.message)?;
        let load = loads.load(0);
        let (Some(force), Some(radius)) = (load.number(0), load.number(3)) else {
            return Err(String::from("fz and radius of the contact are needed"));
        };
        let places = array.places();
        let contacts = cells(&places, self.grid.unwrap_or(GRID), force);
        let noise = self
            .options
            .noise
            .unwrap_or_else(|| array.element_deviation());
        let farthest = farthest(&places, &contacts) + array.description.ceramic.side;
        let tables = PlaceInformation::new(&array, radius, farthest, noise, self.options.radius);
        let anywhere = anywhere(sensor);
        let value = |contact| self.of(&tables.at(&places, contact), anywhere);
        Ok(contacts.iter().map(value).collect())
    }

    /// The largest load along the direction of the load, at most the load itself, up to which
    /// all states are accepted and no channel is at an end of its range.
    fn range(&self, context: &Context<'_>, accept: &[String]) -> Outcome {
        let predictor = context.device.as_deref().and_then(Device::predictor);
        let Some(predictor) = predictor else {
            return Outcome::Outside(String::from("has no model"));
        };
        let Ok(loads) = Loads::one(self.load(), predictor.load_columns()) else {
            return Outcome::Outside(format!("the load {} is refused", self.load()));
        };
        let columns = predictor.columns();
        let full = loads.load(0);
        let first = full.values().find_map(|value| match value {
            Some(LoadValue::Number(number)) => Some(number),
            _ => None,
        });
        let at = |share: f64| -> Option<String> {
            let scaled = full.scaled(predictor.as_ref(), share);
            let mut row = Vec::new();
            match predictor.answer(&Load::of(&scaled), &mut row) {
                Err(refused) => Some(refused.message),
                Ok(()) => unaccepted(&columns, &row, "", accept)
                    .map(str::to_owned)
                    .or_else(|| {
                        predictor
                            .clips(&Load::of(&scaled))
                            .then(|| "clipped".into())
                    }),
            }
        };
        let steps = (1..=RANGE_STEPS).map(|step| step as f64 / RANGE_STEPS as f64);
        let mut low = 0.0;
        let mut ended = None;
        for share in steps {
            if let Some(why) = at(share) {
                ended = Some((share, why));
                break;
            }
            low = share;
        }
        let Some((mut high, mut why)) = ended else {
            return match self.what {
                Estimated::RangeEndedBy => Outcome::Word(String::from("not_reached")),
                _ => finite(first.unwrap_or(0.0)),
            };
        };
        // Halved until rounding is left.
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            match at(middle) {
                Some(reason) => (high, why) = (middle, reason),
                None => low = middle,
            }
        }
        match self.what {
            Estimated::RangeEndedBy => Outcome::Word(why),
            _ => finite(low * first.unwrap_or(0.0)),
        }
    }

    /// Greatest distance of a reading from the straight line through the reading at rest that is
    /// nearest to all of the way to the load, over the change of the reading at the load.
    fn linearity(&self, context: &Context<'_>, accept: &[String]) -> Outcome {
        let predictor = context.device.as_deref().and_then(Device::predictor);
        let Some(predictor) = predictor else {
            return Outcome::Outside(String::from("has no model"));
        };
        let columns = predictor.columns();
        let places: Vec<usize> = predictor
            .reading_columns()
            .iter()
            .filter_map(|name| columns.iter().position(|column| column.name == *name))
            .collect();
        let mut readings: Vec<Vec<f64>> = vec![Vec::with_capacity(STEPS + 1); places.len()];
        for step in 0..=STEPS {
            let row = self.answered(predictor.as_ref(), step as f64 / STEPS as f64, accept);
            let row = match row {
                Ok(row) => row,
                Err(outcome) => return outcome,
            };
            for (place, readings) in places.iter().zip(&mut readings) {
                match row.get(*place) {
                    Some(Cell::Number(reading)) => readings.push(*reading),
                    _ => return Outcome::Outside(String::from("a channel reads no number")),
                }
            }
        }
        let worst = readings
            .iter()
            .filter_map(|readings| off_line(readings))
            .reduce(f64::max);
        worst.map_or_else(
            || Outcome::Outside(String::from("no channel reads the load")),
            finite,
        )
    }

    /// Stretch of the top of the layer under the load.
    fn stretch(&self, context: &Context<'_>, accept: &[String]) -> Outcome {
        let predictor = context.device.as_deref().and_then(Device::predictor);
        let Some(predictor) = predictor else {
            return Outcome::Outside(String::from("has no model"));
        };
        let row = match self.answered(predictor.as_ref(), 1.0, accept) {
            Ok(row) => row,
            Err(outcome) => return outcome,
        };
        let columns = predictor.columns();
        let place = columns.iter().position(|column| column.name == STRETCH);
        match place.and_then(|place| row.get(place)) {
            Some(Cell::Number(stretch)) => finite(*stretch),
            _ => Outcome::Outside(String::from("has no stretch at this load")),
        }
    }

    /// The answer to a share of the load, if its states are accepted.
    fn answered(
        &self,
        predictor: &dyn Predictor,
        share: f64,
        accept: &[String],
    ) -> Result<Vec<Cell>, Outcome> {
        let Ok(loads) = Loads::one(self.load(), predictor.load_columns()) else {
            let message = format!("the load {} is refused", self.load());
            return Err(Outcome::Outside(message));
        };
        let scaled = loads.load(0).scaled(predictor, share);
        let mut row = Vec::new();
        predictor
            .answer(&Load::of(&scaled), &mut row)
            .map_err(|refused| Outcome::Outside(refused.message))?;
        match unaccepted(&predictor.columns(), &row, "", accept) {
            Some(state) => Err(Outcome::Outside(format!("state {state}"))),
            None => Ok(row),
        }
    }

    fn crosstalk(&self, context: &Context<'_>) -> Outcome {
        let Some(device) = context.device.as_deref() else {
            return Outcome::Outside(String::from("the board cannot read the element"));
        };
        let Ok(loads) = Loads::one(self.load(), device.information_loads()) else {
            return Outcome::Outside(format!("the load {} is refused", self.load()));
        };
        match device.crosstalk(&loads.load(0)) {
            Ok(share) => finite(share),
            Err(NoInformation::Beyond(why)) => Outcome::Outside(why),
            Err(error) => Outcome::Outside(error.to_string()),
        }
    }

    fn of_times(&self, context: &Context<'_>) -> Outcome {
        let Some(device) = context.device.as_deref() else {
            return Outcome::Outside(String::from("the board cannot read the element"));
        };
        if self.what == Estimated::Bandwidth {
            let outside =
                || Outcome::Outside(String::from("nothing limits the band of this design"));
            return device
                .band()
                .map_or_else(outside, |[low, high]| finite(high - low));
        }
        let slowest = device.time_constants().into_iter().reduce(f64::max);
        let outside = || Outcome::Outside(String::from("nothing in this design takes time"));
        slowest.map_or_else(outside, finite)
    }

    /// The force that the estimator of a made device reads at the load, by what was corrected
    /// on it: the readings of the made device through the model of the drawing, of the drawing
    /// with the rest values of the device, or of the device itself.
    fn force(&self, context: &Context<'_>, axis: usize) -> Outcome {
        let (drawn, after) = context
            .drawn
            .unwrap_or((context.sensor, AfterFile::AsDrawn));
        if let (Ok(made), Ok(drawn)) = (context.sensor.three_axis(), drawn.three_axis()) {
            let Ok(loads) = Loads::one(self.load(), made.information_loads()) else {
                return Outcome::Outside(format!("the load {} is refused", self.load()));
            };
            let load = loads.load(0);
            let force = std::array::from_fn(|axis| load.number(axis).unwrap_or(0.0));
            let unit = made.unit_model();
            let response = unit.predict(force).1;
            if response.closed().contains(&true) {
                return Outcome::Outside(String::from("state closed"));
            }
            let model = match after {
                AfterFile::AsDrawn => Some(drawn.unit_model()),
                AfterFile::Rest => drawn.unit_model().at_rest(unit.rest()),
                AfterFile::Bench => Some(unit),
            };
            let Some(model) = model else {
                return Outcome::Outside(String::from("the rest capture is refused"));
            };
            let noise = self.options.noise.unwrap_or_else(|| made.board.deviation());
            let options = SearchOptions::default();
            let found = estimate_unit(
                &model,
                response.capacitance(),
                [noise; 4],
                [true; 4],
                &options,
            );
            return match found.outcome {
                SearchOutcome::Converged => finite(found.force[axis]),
                _ => Outcome::Outside(String::from("the estimate does not converge")),
            };
        }
        let drawn = drawn.device().ok().and_then(|device| device.stages());
        let device = context.device.as_deref();
        if let (Some(device), Some(drawn)) = (device, drawn)
            && let Some(made) = device.stages()
        {
            let columns = device.information_loads();
            let Ok(loads) = Loads::one(self.load(), columns) else {
                return Outcome::Outside(format!("the load {} is refused", self.load()));
            };
            let load = loads.load(0);
            let pressing = columns.iter().position(|column| column.name == "force_z");
            let alone = load.values().flatten().count() == 1;
            let force = pressing.and_then(|column| load.number(column));
            let Some(force) = force.filter(|_| axis == 2 && alone) else {
                return Outcome::Outside(String::from("only force_z is estimated, of a load fz"));
            };
            let layout = &made.layout;
            let middle = layout.rows / 2 * layout.columns + layout.columns / 2;
            let (model, tared) = match after {
                AfterFile::AsDrawn => (&drawn, false),
                AfterFile::Rest => (&drawn, true),
                AfterFile::Bench => (&made, false),
            };
            // The pressing load is the last one of a taxel.
            let at = made.axes.count() * (middle + 1) - 1;
            let found = read_back(&made, model, tared, at, force / made.area());
            let outside = || Outcome::Outside(String::from("no force belongs to the reading"));
            return found.map_or_else(outside, |found| finite(made.area() * found.load));
        }
        Outcome::Outside(String::from(
            "no estimate of a made device for this element",
        ))
    }
}

impl Estimated {
    /// True if it is asked of a prediction, whose loads it takes.
    fn of_predictor(self) -> bool {
        matches!(
            self,
            Self::Range | Self::RangeEndedBy | Self::Linearity | Self::Stretch
        )
    }

    /// True if it is the information at one load, and so may be asked over a range of them.
    fn of_one_load(self) -> bool {
        matches!(
            self,
            Self::Deviation(_) | Self::Place | Self::A | Self::D | Self::E | Self::Condition
        )
    }

    /// True if it is of the device, whatever the load.
    fn of_device(self) -> bool {
        matches!(self, Self::TimeConstant | Self::Bandwidth)
    }

    /// What a kind of device has nothing of.
    fn lacks(self, device: &dyn Device, predictor: Option<&dyn Predictor>) -> Option<&'static str> {
        let readings = || predictor.is_some_and(|one| !one.reading_columns().is_empty());
        let stretch = || {
            predictor.is_some_and(|one| one.columns().iter().any(|column| column.name == STRETCH))
        };
        let nothing = Load::of(&[]);
        let missing = match self {
            Self::Linearity => !readings(),
            Self::Stretch => !stretch(),
            Self::Crosstalk => device.crosstalk(&nothing) == Err(NoInformation::Kind),
            Self::TimeConstant => device.time_constants().is_empty(),
            Self::Bandwidth => device.band().is_none(),
            _ => false,
        };
        missing.then_some(match self {
            Self::Linearity => "no readings of this kind of device are computed",
            Self::Stretch => "the closed form of this kind of device has no stretch",
            Self::Crosstalk => "the model of this kind of device has no crosstalk",
            Self::TimeConstant => "nothing in the model of this sensor takes time",
            _ => "the output of this sensor has no band with two ends",
        })
    }
}

/// Greatest distance of values at equal steps from the line through the first one whose greatest
/// distance is least, over the change of the last one; none where that is zero.
fn off_line(values: &[f64]) -> Option<f64> {
    let (first, last) = (values.first()?, values.last()?);
    let whole = (last - first).abs();
    let steps = (values.len() - 1) as f64;
    let distance = |slope: f64| {
        let at = |(step, value): (usize, &f64)| {
            (value - first - slope * step as f64 / steps * (last - first)).abs()
        };
        values.iter().enumerate().map(at).fold(0.0, f64::max)
    };
    // The greatest distance is convex in the slope: thirds of an interval that holds the best one.
    let secant =
        |(step, value): (usize, &f64)| (value - first) / (last - first) * steps / step as f64;
    let slopes = values.iter().enumerate().skip(1).map(secant);
    let mut low = slopes.clone().fold(f64::INFINITY, f64::min);
    let mut high = slopes.fold(f64::NEG_INFINITY, f64::max);
    for _ in 0..120 {
        let [one, other] = [low + (high - low) / 3.0, high - (high - low) / 3.0];
        if distance(one) <= distance(other) {
            high = other;
        } else {
            low = one;
        }
    }
    let found = distance(0.5 * (low + high)) / whole;
    (whole > 0.0 && found.is_finite()).then_some(found)
}

/// One number of those over a range of loads or a region.
fn summed_up(values: &[f64], take: Take) -> Outcome {
    let count = values.len() as f64;
    let found = match take {
        Take::Mean => Some(values.iter().sum::<f64>() / count),
        Take::Rms => {
            let squares: f64 = values.iter().map(|value| value * value).sum();
            Some((squares / count).sqrt())
        }
        Take::Last => values.last().copied(),
        Take::Least => values.iter().copied().reduce(f64::min),
        Take::Greatest | Take::Worst => values.iter().copied().reduce(f64::max),
    };
    found.map_or(Outcome::None, finite)
}

/// Deviation of the place of a contact of which nothing is known but that it is on the taxels, m: that
/// of an even distribution over their rectangle. A measurement that is no better says nothing.
fn anywhere(sensor: &Sensor) -> f64 {
    let array = &sensor.array;
    let [along, across] = [
        array.columns as f64 * array.pitch[0],
        array.rows as f64 * array.pitch[1],
    ];
    along.hypot(across) / 12f64.sqrt()
}

fn no_information() -> Outcome {
    Outcome::Outside(String::from("no_information"))
}

/// Contacts in the middles of the cells of the rectangle of places.
pub(crate) fn cells(places: &[[f64; 2]], grid: [usize; 2], force: f64) -> Vec<PlacedContact> {
    let ends = |axis: usize| {
        let values = places.iter().map(|place| place[axis]);
        let low = values.clone().fold(f64::INFINITY, f64::min);
        [low, values.fold(f64::NEG_INFINITY, f64::max)]
    };
    let middle = |axis: usize, index: usize| {
        let [low, high] = ends(axis);
        low + (high - low) * (index as f64 + 0.5) / grid[axis] as f64
    };
    let cell = |y: usize, x: usize| PlacedContact {
        place: [middle(0, x), middle(1, y)],
        force,
    };
    (0..grid[1])
        .flat_map(|y| (0..grid[0]).map(move |x| (y, x)))
        .map(|(y, x)| cell(y, x))
        .collect()
}

/// Greatest distance between a place and a contact, m.
pub(crate) fn farthest(places: &[[f64; 2]], contacts: &[PlacedContact]) -> f64 {
    let distance = |place: &[f64; 2], contact: &PlacedContact| {
        (place[0] - contact.place[0]).hypot(place[1] - contact.place[1])
    };
    let all = places
        .iter()
        .flat_map(|place| contacts.iter().map(move |contact| distance(place, contact)));
    all.fold(0.0, f64::max)
}

/// Columns of a section, in the order of `p4-sections`.
const SECTION: [(&str, &str, f64, &str); 9] = [
    ("area_ratio", "", 1.0, ""),
    ("change", "", 1.0, ""),
    ("change_at_most", "", 1.0, ""),
    ("internal_pressure", "kPa", 1e3, "pa"),
    ("gap", "um", 1e-6, "m"),
    ("fold", "um", 1e-6, "m"),
    ("greatest_stress", "kPa", 1e3, "pa"),
    ("state", "", 1.0, ""),
    ("solved_to_pressure", "kPa", 1e3, "pa"),
];

fn section(
    name: &str,
    written: &AnswerFile,
    sensor: &Sensor,
    variables: &[Named<'_>],
) -> Result<(Kind, Column, bool), Wrong> {
    unused(written, &["pressure"])?;
    if sensor.microchannels().is_err() {
        return wrong(
            "of",
            "channel_section needs a sensor with microchannels",
            "name such as liquid-metal-2x4",
        );
    }
    let found = SECTION
        .iter()
        .find(|(known, ..)| *known == written.quantity);
    let Some((quantity, unit, scale, si)) = found else {
        let names = SECTION.map(|(known, ..)| known);
        return wrong(
            "quantity",
            format!("a section has no \"{}\"", written.quantity),
            unknown(&written.quantity, &names, "use one of"),
        );
    };
    let condition = |key: &'static str, text: Option<&String>, dimension: &'static Dimension| {
        let Some(text) = text else {
            return wrong(
                key,
                format!("channel_section needs {key}"),
                format!("write {} with its unit", dimension.name),
            );
        };
        if let Some(index) = variables.iter().position(|one| one.name == *text) {
            return variable_of(key, &variables[index], dimension)
                .map(|()| Condition::Variable(index));
        }
        match dimension.parse(text) {
            Ok(value) if value > 0.0 => Ok(Condition::Stated(value)),
            Ok(_) => wrong(
                key,
                format!("\"{text}\" is not above zero"),
                "give more than zero",
            ),
            Err(message) => wrong(key, message, "or name a variable without a key"),
        }
    };
    let pressure = condition("pressure", written.pressure.as_ref(), &quantity::STRESS)?;
    let thickness = condition("thickness", written.thickness.as_ref(), &quantity::LENGTH)?;
    let mut way = match pressure {
        Condition::Variable(index) => variables[index].listed.to_vec(),
        Condition::Stated(_) => Vec::new(),
    };
    way.sort_by(f64::total_cmp);
    let section = Section {
        quantity,
        pressure,
        thickness,
        way,
    };
    let word = *quantity == "state";
    let column = if word {
        Column::plain(name)
    } else {
        Column::new(name, unit, *scale, si, 5)
    };
    Ok((Kind::Section(section), column, word))
}

/// Refuses a variable that is no condition of this dimension, above zero.
fn variable_of(
    key: &'static str,
    variable: &Named<'_>,
    dimension: &'static Dimension,
) -> Result<(), Wrong> {
    let name = variable.name;
    if !variable.keyless {
        return wrong(
            key,
            format!("the variable {name} has a key of its own"),
            "name a variable without a key",
        );
    }
    if variable.exponents != Some(Exponents::of(dimension)) {
        return wrong(
            key,
            format!("the variable {name} is not {}", dimension.name),
            format!("give {} with its unit there", dimension.name),
        );
    }
    if variable.least <= 0.0 {
        return wrong(
            key,
            format!("the variable {name} is not above zero everywhere"),
            "give more than zero there",
        );
    }
    Ok(())
}

impl Section {
    /// The section of the upper layer under the pressure.
    fn evaluate(&self, context: &mut Context<'_>, accept: &[String]) -> Outcome {
        let Ok(array) = context.sensor.microchannels() else {
            return Outcome::Outside(String::from("has no microchannels"));
        };
        let element = array.element;
        let drawn = DrawnSection {
            height: element.section.height,
            cover: element.rows.roof.min(element.columns.roof),
            thickness: self.thickness.at(context.point),
            pitch: context.sensor.array.pitch[0],
        };
        if drawn.height + drawn.cover >= drawn.thickness {
            return Outcome::Outside(String::from(
                "the sheet is thinner than microchannel and cover",
            ));
        }
        let pressure = self.pressure.at(context.point);
        let way = if self.way.contains(&pressure) {
            self.way.clone()
        } else {
            vec![pressure]
        };
        let known = context.section.take();
        let same = |known: &SolvedSection| known.thickness == drawn.thickness && known.way == way;
        let solved = if let Some(known) = known.filter(same) {
            known
        } else {
            let Some(row) = solve_section(element, drawn, &way, context.stop) else {
                context.stopped = true;
                return Outcome::None;
            };
            SolvedSection {
                thickness: drawn.thickness,
                row,
                way,
            }
        };
        let outcome = self.of(&solved.row, pressure, accept);
        context.section = Some(solved);
        outcome
    }

    fn of(&self, row: &SectionRow, pressure: f64, accept: &[String]) -> Outcome {
        let mut answers = row.answers.iter();
        let Some(answer) = answers.find(|answer| answer.pressure == pressure) else {
            return Outcome::Ended(row.ended.clone().unwrap_or_default());
        };
        let state = answer.state.name();
        // A bound is no number unless the study accepts it.
        let closed = answer.state == SectionState::Closed;
        if !closed && !accept.iter().any(|ok| ok == state) {
            return Outcome::Outside(format!("state {state}"));
        }
        let closure = &answer.closure;
        finite(match self.quantity {
            "area_ratio" => closure.area_ratio,
            "change" => answer.change(),
            // Only what lies beyond the solution has a bound.
            "change_at_most" => match answer.greatest {
                Some(greatest) => greatest,
                None => return Outcome::None,
            },
            "internal_pressure" => closure.inside,
            "gap" => closure.gap,
            "fold" => closure.fold,
            "state" => return Outcome::Word(state.to_owned()),
            "solved_to_pressure" => closure.pressure,
            _ => closure.stress,
        })
    }
}
