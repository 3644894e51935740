//! The study file as it is written.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;

/// A study file, schema 2.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StudyFile {
    /// Version of this format: 2.
    pub schema: u32,
    /// Name of the study.
    pub name: String,
    /// Sensor file, relative to the study file, or name of a shipped one: all that is not varied.
    pub sensor: String,
    /// Changes of the sensor file before anything else: path of a key to its value.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    pub set: BTreeMap<String, toml::Value>,
    /// What is varied.
    #[serde(default)]
    pub variables: BTreeMap<String, VariableFile>,
    /// Keys that follow: path of a key to an expression of variables and of other linked keys.
    #[serde(default)]
    pub links: BTreeMap<String, String>,
    /// What is asked of each design.
    #[serde(default)]
    pub answers: BTreeMap<String, AnswerFile>,
    /// Comparisons that a design must fulfil, of variables and answers.
    #[serde(default)]
    pub constraints: BTreeMap<String, String>,
    /// What is to be small and what great.
    #[serde(default)]
    pub objectives: ObjectivesFile,
    /// How `taxel sweep` chooses designs.
    #[serde(default)]
    pub sweep: SweepFile,
    /// How `taxel optimize` works.
    #[serde(default)]
    pub optimize: OptimizeFile,
    /// How `taxel tolerance` works.
    #[serde(default)]
    pub tolerance: ToleranceFile,
    /// Places of elements to choose from, for `taxel optimize`.
    pub place: Option<PlaceFile>,
}

impl StudyFile {
    /// JSON schema of a study file, as `taxel schema study` prints it.
    pub fn json_schema() -> String {
        let schema = schemars::schema_for!(StudyFile);
        // A schema is made of maps and texts.
        let text = serde_json::to_string_pretty(&schema).unwrap_or_default();
        text + "\n"
    }
}

/// A number, or text with a unit.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "a number, true or false, or text such as \"10 mm\" is needed here"
)]
pub enum Bound {
    /// A whole number.
    Whole(i64),
    /// A number.
    Number(f64),
    /// True or false.
    Flag(bool),
    /// A quantity with its unit, or a word.
    Text(String),
}

/// One variable.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VariableFile {
    /// Path of its key in the sensor file. A variable without one is a condition that answers name,
    /// such as the pressure on a section.
    pub key: Option<String>,
    /// Least and greatest value.
    pub range: Option<[Bound; 2]>,
    /// All its values, in the place of a range.
    pub values: Option<Vec<Bound>>,
    /// How values are spaced between the ends of the range; default linear.
    #[serde(default)]
    pub scale: ScaleFile,
    /// Number of values on a grid, 2 to 1000; default 5.
    pub points: Option<usize>,
    /// How far a made device is from the drawing.
    pub spread: Option<SpreadFile>,
    /// What has one made value: the whole device (default), or each capacitor of a taxel.
    #[serde(default)]
    pub each: EachFile,
}

/// What has one made value of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EachFile {
    /// The device: what a layer or a process does.
    #[default]
    Device,
    /// Each capacitor of a taxel, of those keys that may be a list of them: one is independent of
    /// the next.
    Taxel,
}

/// Spacing of values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ScaleFile {
    /// Equal differences.
    #[default]
    Linear,
    /// Equal ratios.
    Log,
}

/// Distribution of a made value about the drawn one: a percentage is relative to it.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SpreadFile {
    /// Even, plus or minus this.
    Uniform(Bound),
    /// Normal with this standard deviation.
    Normal(Bound),
    /// A triangle, plus or minus this.
    Triangular(Bound),
    /// Lognormal with this standard deviation of the logarithm, a percentage.
    Lognormal(Bound),
}

/// One answer.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AnswerFile {
    /// Where it comes from.
    pub of: Source,
    /// Its name there.
    pub quantity: String,
    /// Load, as after `--load`.
    pub load: Option<String>,
    /// Range of loads, such as `fz=0..10 N` or `fz=5 mN..50 N`, in the place of one load.
    pub over: Option<String>,
    /// Which of the answers over a range of loads or a region; default the last of a prediction, the
    /// worst of an estimate over a range, the rms of a region.
    pub take: Option<Take>,
    /// Mechanics of a prediction; default what the sensor file says.
    pub mechanics: Option<MechanicsFile>,
    /// Standard deviation of a reading, in the place of that of the board.
    pub noise: Option<String>,
    /// What is known of the radius of a contact: `known` (default), `unknown`, or a range.
    pub radius: Option<RadiusFile>,
    /// Cells of the rectangle of the elements in whose middles a contact stands: along x, y.
    pub grid: Option<[usize; 2]>,
    /// Pressure on the whole top, for `channel_section`; or the name of a variable without a key.
    pub pressure: Option<String>,
    /// Thickness of the whole sheet, for `channel_section`.
    pub thickness: Option<String>,
    /// States that count as an answer; default `ok` and `open`.
    pub accept: Option<Vec<String>>,
}

/// Source of an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// A number of `taxel check`.
    Check,
    /// A column of `taxel predict`.
    Predict,
    /// What follows from noise through the inverse.
    Estimate,
    /// The section cell of a microchannel, solved by finite elements.
    ChannelSection,
}

/// One number of several.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Take {
    /// That of the last load of a range.
    Last,
    /// The greatest.
    Greatest,
    /// The least.
    Least,
    /// The mean over a region, or of an estimate over a range.
    Mean,
    /// The root of the mean square, likewise.
    Rms,
    /// The greatest, likewise.
    Worst,
}

/// Mechanics of a prediction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MechanicsFile {
    /// Closed forms and tables.
    ClosedForm,
    /// Finite elements of the drawing.
    Fem,
}

/// Knowledge of a radius.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "\"known\", \"unknown\" or a list of the least and the greatest radius is needed here"
)]
pub enum RadiusFile {
    /// `known` or `unknown`.
    Word(String),
    /// Least and greatest radius.
    Range([String; 2]),
}

/// Objectives: names of answers, or expressions of answers and variables.
#[derive(Debug, Clone, PartialEq, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ObjectivesFile {
    /// To be small.
    #[serde(default)]
    pub minimise: Vec<String>,
    /// To be great.
    #[serde(default)]
    pub maximise: Vec<String>,
}

/// Plan of a sweep.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SweepFile {
    /// How designs are chosen; a name that ends in .csv is a table of them, relative to the study file.
    pub plan: String,
    /// Number of designs of `latin_hypercube` and `sobol`.
    pub points: usize,
    /// Seed of `latin_hypercube` and of the scrambling of `sobol`.
    pub seed: u64,
    /// Columns of the table in their order: names of variables and answers, `status`, `reason`;
    /// without the key all.
    pub columns: Option<Vec<String>>,
}

impl SweepFile {
    /// True if the plan is a table of designs.
    pub fn is_list(&self) -> bool {
        let ending = std::path::Path::new(&self.plan).extension();
        ending.is_some_and(|ending| ending.eq_ignore_ascii_case("csv"))
    }
}

impl Default for SweepFile {
    fn default() -> Self {
        Self {
            plan: String::from("grid"),
            points: 64,
            seed: 1,
            columns: None,
        }
    }
}

/// Options of an optimisation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OptimizeFile {
    /// Seed of all that is random.
    pub seed: u64,
    /// Most designs that are evaluated.
    pub evaluations: usize,
    /// Designs of one generation; default 60.
    pub population: usize,
}

impl Default for OptimizeFile {
    fn default() -> Self {
        Self {
            seed: 1,
            evaluations: 4000,
            population: 60,
        }
    }
}

/// Options of a tolerance analysis.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ToleranceFile {
    /// Base samples N; N(d + 2) devices are computed for d spreads.
    pub samples: usize,
    /// Seed.
    pub seed: u64,
    /// Devices that are computed where one takes long: a quadratic through them, whose error is stated,
    /// answers for all samples. Without the key every device is computed.
    pub computed: Option<usize>,
    /// What is corrected on each made device before a limit is applied.
    pub after: AfterFile,
    /// Correlations of two spreads: name, name, coefficient.
    pub correlation: Vec<(String, String, f64)>,
    /// Limits of answers.
    pub limits: BTreeMap<String, LimitFile>,
}

impl Default for ToleranceFile {
    fn default() -> Self {
        Self {
            samples: 1024,
            seed: 1,
            computed: None,
            after: AfterFile::AsDrawn,
            correlation: Vec::new(),
            limits: BTreeMap::new(),
        }
    }
}

/// What is corrected on each made device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AfterFile {
    /// Nothing.
    #[default]
    AsDrawn,
    /// Its rest values.
    Rest,
    /// All its constants.
    Bench,
}

/// Limits of one answer.
#[derive(Debug, Clone, PartialEq, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LimitFile {
    /// Greatest value.
    pub at_most: Option<Bound>,
    /// Least value.
    pub at_least: Option<Bound>,
    /// Greatest difference from the nominal design: a percentage, or a value.
    pub within: Option<Bound>,
}

/// Elements to choose.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlaceFile {
    /// What is chosen: `elements`, at candidate places, or `channels`, elements of the array.
    pub of: PlaceOf,
    /// Candidate places of elements, such as `grid 5 x 3, 2.5 mm`.
    pub candidates: Option<String>,
    /// Number of elements to choose.
    pub count: usize,
    /// `a`: rms of the deviation of the place; `d`: mean of half the logarithm of the
    /// determinant of its covariance.
    pub criterion: Criterion,
    /// Contact, such as `fz=100 mN, radius=3.6 mm`.
    pub load: String,
    /// Standard deviation of the force on one element.
    pub noise: Option<String>,
    /// Cells of the rectangle of candidates in whose middles the contact stands; default
    /// 25 x 9.
    pub grid: Option<[usize; 2]>,
    /// Seed of the starts of the exchange; default 1.
    pub seed: Option<u64>,
}

/// What is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PlaceOf {
    /// Places of elements.
    Elements,
    /// Elements of the array that are read.
    Channels,
}

/// Criterion of a choice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Criterion {
    /// Mean square of the deviation.
    A,
    /// Mean logarithm of the determinant.
    D,
}
