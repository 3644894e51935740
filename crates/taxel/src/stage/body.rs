//! A body that finite elements solved, as a sensor file describes it.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;

use super::{
    BodyArray, BodyMake, CellLaw as _, ForceCell, OneToOne, PartError, PartParameter, Parts, Share,
};
use crate::electronics::Electronics;
use crate::of_drawing::OfDrawing;
use crate::quantity::{AnyQuantity, CAPACITANCE, Dimension, FORCE, LENGTH, RESISTANCE};
use crate::solutions::{BodyDrawing, BodyFiles, BodyLoad, BodyOutput, Solutions, Unsolved};
use crate::transduction::{MOST_PARAMETERS, ResponseTable};

/// A body of a problem file: each taxel is one, on a rigid board.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodyElement {
    /// Problem file of `taxel solve`; its name counts from the folder of this file. A shipped problem
    /// has its name alone.
    pub problem: String,
    /// Parameters of the problem that are the load, one to four, each with its range `[least,
    /// largest]`; the others keep the value of their last step.
    pub load: BTreeMap<String, [AnyQuantity; 2]>,
    /// The output of the problem that is the force.
    pub force: BodyForce,
    /// What is read, in the order of the frames.
    pub channel: Vec<BodyChannel>,
    /// Largest error of the table, as a share of the range of each output; by default 0.001 over one
    /// parameter and 0.005 over more.
    #[serde(default)]
    pub tolerance: Option<Share>,
    /// What the made body has in the place of what was drawn, over it.
    #[serde(default)]
    pub made: BodyMake,
    /// Standard deviations of what is made, over the value as drawn, by the name of the number:
    /// `stiffness`, `sensitivity`.
    #[serde(default)]
    pub fabrication: BTreeMap<String, Share>,
    #[serde(skip)]
    #[schemars(skip)]
    pub(crate) table: OfDrawing<ResponseTable>,
}

/// An axis of the mesh of a problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BodyAxis {
    /// The first coordinate.
    X,
    /// The second.
    Y,
    /// The third.
    Z,
}

/// The force that presses a body: exactly one of `obstacle`, `reaction` and `rigid`.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodyForce {
    /// Name of an obstacle or a contact.
    pub obstacle: Option<String>,
    /// A surface of `output.reactions`.
    pub reaction: Option<String>,
    /// Name of a rigid body.
    pub rigid: Option<String>,
    /// Axis of the force.
    pub along: BodyAxis,
    /// 1 or -1: what makes a pressing force positive.
    #[serde(default = "one")]
    pub sign: i8,
    /// The parameter of `load` that presses, from zero on; needed if there are several.
    pub by: Option<String>,
}

fn one() -> i8 {
    1
}

/// A channel of a body: exactly one of `capacitance`, `resistance`, `displacement` and `reaction`.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodyChannel {
    /// Its name, in tables and on the page.
    pub name: String,
    /// Two electrodes, or one for its capacitance to all others and to ground.
    #[serde(default)]
    pub capacitance: Vec<String>,
    /// Name of a resistance, or of the cavity of a channel.
    pub resistance: Option<String>,
    /// A point of `output.displacements`.
    pub displacement: Option<String>,
    /// A surface of `output.reactions`.
    pub reaction: Option<String>,
    /// Axis of a displacement or a reaction.
    pub along: Option<BodyAxis>,
}

impl BodyAxis {
    fn letter(self) -> char {
        match self {
            Self::X => 'x',
            Self::Y => 'y',
            Self::Z => 'z',
        }
    }
}

impl BodyForce {
    fn output(&self) -> Option<BodyOutput> {
        let given = [
            (&self.obstacle, "force"),
            (&self.reaction, "reaction"),
            (&self.rigid, "force"),
        ];
        let mut given = given
            .iter()
            .filter_map(|(name, what)| Some((name.as_ref()?, what)));
        let (name, what) = given.next().filter(|_| given.next().is_none())?;
        Some(BodyOutput::Column {
            name: format!("{name}_{what}_{}", self.along.letter()),
            unit: FORCE.si,
        })
    }
}

impl BodyChannel {
    fn output(&self) -> Option<(BodyOutput, &'static Dimension)> {
        let vector = |name: &String, what: &str, dimension: &'static Dimension| {
            let name = format!("{name}_{what}_{}", self.along?.letter());
            let unit = dimension.si;
            Some((BodyOutput::Column { name, unit }, dimension))
        };
        let own = (
            &self.capacitance[..],
            &self.resistance,
            &self.displacement,
            &self.reaction,
        );
        match own {
            ([], Some(name), None, None) => {
                let name = format!("{name}_resistance");
                let unit = RESISTANCE.si;
                Some((BodyOutput::Column { name, unit }, &RESISTANCE))
            }
            ([], None, Some(name), None) => vector(name, "displacement", &LENGTH),
            ([], None, None, Some(name)) => vector(name, "reaction", &FORCE),
            ([_] | [_, _], None, None, None) => {
                let electrodes = self.capacitance.clone();
                Some((BodyOutput::Capacitance(electrodes), &CAPACITANCE))
            }
            _ => None,
        }
    }
}

fn wrong(key: &str, message: String, help: &str) -> PartError {
    PartError {
        key: key.into(),
        message,
        help: help.into(),
    }
}

impl BodyElement {
    /// Largest error of the table that is asked for, as a share of the range of each output.
    fn tolerance(&self) -> f64 {
        let usual = if self.load.len() == 1 { 1e-3 } else { 5e-3 };
        self.tolerance.map_or(usual, |share| share.0)
    }

    /// What is to be solved; `files` are its problem and its mesh, where they are at hand.
    ///
    /// # Errors
    /// The first rule between the keys that is broken.
    pub fn drawing(&self, files: BodyFiles) -> Result<BodyDrawing, PartError> {
        self.check()?;
        let pressing = match (&self.force.by, self.load.keys().next()) {
            (Some(by), _) => by.clone(),
            (None, Some(only)) => only.clone(),
            (None, None) => String::new(),
        };
        let loads = self.load.iter().map(|(name, ends)| BodyLoad {
            name: name.clone(),
            unit: ends[0].dimension.si,
            range: ends.map(|end| end.value),
        });
        let missing = |key: &str| wrong(key, "names no output".into(), "name one");
        let force = self.force.output().ok_or_else(|| missing("force"))?;
        let channels: Option<Vec<_>> = self.channel.iter().map(BodyChannel::output).collect();
        let channels = channels.ok_or_else(|| missing("channel"))?;
        let names = self.channel.iter().map(|channel| channel.name.clone());
        Ok(BodyDrawing {
            problem: self.problem.clone(),
            files,
            loads: loads.collect(),
            pressing,
            force,
            sign: f64::from(self.force.sign),
            channels: names
                .zip(channels.into_iter().map(|(output, _)| output))
                .collect(),
            tolerance: self.tolerance(),
        })
    }

    /// Rules between the keys.
    fn check(&self) -> Result<(), PartError> {
        let count = self.load.len();
        if !(1..=MOST_PARAMETERS).contains(&count) {
            return Err(wrong(
                "load",
                format!("a load of {count} parameters; one to {MOST_PARAMETERS} can be tabulated"),
                "name parameters of the problem, such as load = { travel = [\"0 mm\", \"1 mm\"] }",
            ));
        }
        for (name, [low, high]) in &self.load {
            let key = format!("load.{name}");
            if low.dimension != high.dimension {
                let message = format!("{} and {}", low.dimension.name, high.dimension.name);
                return Err(wrong(&key, message, "give both ends in units of one kind"));
            }
            if low.value >= high.value {
                let message = "the range is empty".into();
                return Err(wrong(&key, message, "give the least value first"));
            }
        }
        let by = match &self.force.by {
            None if count > 1 => {
                return Err(wrong(
                    "force",
                    "it is not said which of several parameters presses".into(),
                    "add by = \"…\" with the parameter of load that drives the probe",
                ));
            }
            None => self.load.iter().next(),
            Some(by) => self.load.get_key_value(by),
        };
        let Some((name, range)) = by else {
            let names: Vec<&str> = self.load.keys().map(String::as_str).collect();
            let help = format!("give one of: {}", names.join(", "));
            return Err(wrong("force.by", "is no parameter of load".into(), &help));
        };
        if range[0].value != 0.0 {
            return Err(wrong(
                &format!("load.{name}"),
                "what presses begins at rest, at zero".into(),
                "let its range begin at 0",
            ));
        }
        if self.force.output().is_none() {
            let message = "the force is that of one obstacle, reaction or rigid".into();
            return Err(wrong("force", message, "give one of those keys"));
        }
        if ![1, -1].contains(&self.force.sign) {
            let message = format!("{} is no sign", self.force.sign);
            return Err(wrong("force.sign", message, "give 1 or -1"));
        }
        if self.channel.is_empty() {
            let help = "give at least one: [[element.body.channel]]";
            return Err(wrong("channel", "nothing is read".into(), help));
        }
        let mut first: Option<&'static Dimension> = None;
        for (number, channel) in self.channel.iter().enumerate() {
            let key = format!("channel.{number}");
            let Some((_, dimension)) = channel.output() else {
                return Err(wrong(
                    &key,
                    format!("\"{}\" is no one output", channel.name),
                    "give one of capacitance = [\"A\", \"B\"], resistance, displacement with along, reaction with along",
                ));
            };
            if self.channel[..number]
                .iter()
                .any(|one| one.name == channel.name)
            {
                let message = format!("two channels are called \"{}\"", channel.name);
                return Err(wrong(&key, message, "give one of them another name"));
            }
            let known = first.get_or_insert(dimension);
            if **known != *dimension {
                return Err(wrong(
                    &key,
                    format!(
                        "\"{}\" is {}, the channels before it are {}: one board reads one quantity",
                        channel.name, dimension.name, known.name
                    ),
                    "describe a sensor of each quantity",
                ));
            }
        }
        Ok(())
    }

    /// Takes the text of a table that the sensor file names, or asks for the solution.
    ///
    /// # Errors
    /// A key with a message and what to do.
    pub(crate) fn solve(
        &mut self,
        named: Option<(&str, &str)>,
        solutions: &mut dyn Solutions,
    ) -> Result<(), (String, String, String)> {
        let below = |error: PartError| {
            let key = format!("element.body.{}", error.key);
            (key, error.message, error.help)
        };
        self.table = OfDrawing(None);
        self.check().map_err(below)?;
        let of_problem = |message: String| {
            let help = "give a problem file of `taxel solve`, or the name of a shipped one";
            ("element.body.problem".into(), message, help.into())
        };
        let files = solutions.body(&self.problem).map_err(of_problem)?;
        let Some((name, text)) = named else {
            let files = files.ok_or_else(|| of_problem(Unsolved::TablesOnly.to_string()))?;
            let drawing = self.drawing(files).map_err(below)?;
            let table = drawing.answer(solutions).map_err(|unsolved| {
                let help = "taxel solve with this problem shows how far it goes";
                ("element.body".into(), unsolved.to_string(), help.into())
            })?;
            self.table = OfDrawing(Some(table));
            return Ok(());
        };
        let of_table = |message: String| {
            let help = "make the table of this drawing: taxel tabulate SENSOR -o TABLE";
            let message = format!("{name}: {message}");
            ("mechanics.table".into(), message, help.into())
        };
        let table = ResponseTable::read(text).map_err(|wrong| of_table(wrong.to_string()))?;
        // Where the problem cannot be opened, the table is that of the one that it names.
        let drawing = self.drawing(files.unwrap_or_default()).map_err(below)?;
        if let Some(message) = drawing.differs(&table.file().drawing) {
            return Err(of_table(message));
        }
        self.table = OfDrawing(Some(table));
        Ok(())
    }

    /// The table of its answers, once it is solved.
    pub fn table(&self) -> Option<&ResponseTable> {
        self.table.0.as_ref()
    }

    /// Standard deviations of what is made, by the name of the number.
    pub fn deviations(&self) -> Vec<(String, f64)> {
        let stated = self.fabrication.iter();
        stated
            .map(|(name, share)| (name.clone(), share.0))
            .collect()
    }

    /// The chain of `count` bodies and what reads them.
    pub fn parts(&self, count: usize, electronics: &Electronics) -> Parts {
        let dimension = self.channel.first().and_then(|one| Some(one.output()?.1));
        let network = self
            .table
            .0
            .as_ref()
            .zip(dimension)
            .map(|(table, dimension)| {
                let names = self.channel.iter().map(|one| one.name.clone());
                let of = |name: &str| self.fabrication.get(name).map_or(0.0, |share| share.0);
                let mut array = BodyArray::new(table, dimension, names.collect());
                array.bodies = vec![self.made; count];
                array.fabrication = ["stiffness", "sensitivity"].map(of);
                let problem = self.check().err().or_else(|| array.wrong_force());
                array.problem = problem.or_else(|| self.unread(electronics));
                array
            });
        let full_scale = network.as_ref().map_or(1.0, BodyArray::full_scale);
        Parts {
            network: network.map_or_else(|| Box::new(OneToOne) as _, |array| Box::new(array) as _),
            ..Parts::of_cell(ForceCell::Found.boxed(), full_scale)
        }
    }

    /// What a capacitance-to-digital chip cannot read.
    fn unread(&self, electronics: &Electronics) -> Option<PartError> {
        let chip = electronics.capacitance_to_digital()?;
        let wanted = if chip.floating { 2 } else { 1 };
        let at = self
            .channel
            .iter()
            .position(|channel| channel.capacitance.len() != wanted)?;
        let (has, needs) = if chip.floating {
            ("one plate", "between two electrodes: give both")
        } else {
            ("two plates", "to ground: give one electrode")
        };
        Some(wrong(
            &format!("channel.{at}"),
            format!("it has {has}, which this chip does not read"),
            &format!(
                "electronics.readout.capacitance_to_digital.floating says that it measures {needs}"
            ),
        ))
    }

    /// Shows each number of the body to `each`, which may change it.
    pub fn parameters(&mut self, each: &mut dyn FnMut(PartParameter, &mut f64)) {
        self.made.shown(each);
    }
}
