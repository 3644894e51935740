//! The command line as people write it.

use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::{Args, Parser, Subcommand, ValueEnum};
use taxel::quantity::LENGTH;
use taxel_recording::Columns;
use taxel_serve::link::LinkAddress;
use taxel_serve::{Marks, TouchTable, WhenRecordingFails};

use crate::outputs::Existing;

/// From the drawing of a soft tactile sensor to live touch.
///
/// SENSOR is a sensor file (TOML), or the name of a shipped one, such as
/// three-axis-8x8; a wrong name is answered with all of them.
///
/// What a drawing needs and no shipped table has is solved once and kept in the folder that
/// the environment variable TAXEL_CACHE names, or in taxel in the cache folder of the user.
///
/// Exit codes: 0 done, 1 failed, 2 wrong input, 3 done but frames were lost or clipped.
#[derive(Debug, Parser)]
#[command(name = "taxel", version, disable_help_subcommand = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Check a sensor file or a board file and print what was understood and what follows
    Check(Check),
    /// Loads in, electrical response out
    Predict(Predict),
    /// A study: many designs of a sensor, as a table and a figure
    Sweep(Sweep),
    /// A soft body of your own: problem file and mesh in, forces, shapes and fields out
    Solve(Solve),
    /// The best design of a study, or the designs that no other one dominates
    Optimize(Optimize),
    /// What becomes of devices that are not made as drawn: yield, variance shares
    Tolerance(Tolerance),
    /// Masks, moulds, a bill of layers and a dimensioned drawing, for the workshop
    Fabricate(Fabricate),
    /// Solve the load path of a sensor by finite elements once, as a table that its file may name
    Tabulate(Tabulate),
    /// A sensor for simulators of robots: MJCF of MuJoCo, or the places of its taxels as JSON
    Export(ExportSensor),
    /// Fit the constants of a sensor to calibration data, with their
    /// uncertainty and what the data do not identify
    Calibrate(Calibrate),
    /// Write synthetic calibration data of a sensor
    Twin(Twin),
    /// Laws of rubber: fitted to tests, of a library, or from a hardness
    #[command(subcommand)]
    Material(Material),
    /// Every published number of the four papers beside ours
    Reproduce(Reproduce),
    /// The solver of soft solids against exact solutions and other programs
    Verify(Verify),
    /// Frames to touch, on a page in the browser or as a summary
    Live(Box<Live>),
    /// The touch of every frame of a recording as a table: what live estimates, for later
    Estimate(Box<Estimate>),
    /// Inspect, repair, cut, export and compare recordings of taxel live --record
    Recording(Recording),
    /// Play a virtual device on a wire: the twin or a recording as a board sends it
    Device(Device),
    /// Serial ports that are plugged in, who may open them, and which board fits
    Devices(Devices),
    /// Listen to a board that nobody described, and draft its board file with what speaks for it
    Listen(Listen),
    /// Print the JSON schema of the sensor file, the study file or the stimulus script, or
    /// the reference of the sensor file
    Schema(Schema),
    /// Print the script with which a shell completes the command
    Completions(Completions),
    /// Write manual pages
    Man(ManPages),
}

#[derive(Debug, Subcommand)]
pub(crate) enum Material {
    /// Fit laws to tests, choose one, and say what the tests do not tell
    Fit(Box<MaterialFit>),
    /// Where a law is stable, and whether it is sane in other modes
    Check(MaterialCheck),
    /// Names of the library
    List(MaterialList),
    /// A material of the library, with its source
    Show(MaterialShow),
    /// Modulus of elasticity of a Shore hardness, such as "30 A" or "00-30"
    Hardness(MaterialShow),
}

#[derive(Debug, Args)]
pub(crate) struct MaterialFit {
    /// Files of tests (CSV)
    #[arg(required = true)]
    pub(crate) tests: Vec<PathBuf>,
    /// Law to fit, or all; by default those that the tests can tell
    #[arg(long)]
    pub(crate) law: Option<String>,
    /// Mode of the tests: uniaxial, compression, planar or equibiaxial
    #[arg(long)]
    pub(crate) mode: Option<String>,
    /// Slack: a strain, a length such as 0.8mm, or fit; by default it is fitted and kept where it matters
    #[arg(long)]
    pub(crate) slack: Option<String>,
    /// Compliance of the machine, such as "0.02 mm/N"
    #[arg(long)]
    pub(crate) compliance: Option<String>,
    /// Force that the machine shows without load, such as "0.05 N"
    #[arg(long, allow_hyphen_values = true)]
    pub(crate) force_offset: Option<String>,
    /// Loading of a cyclic test: first, last or a number
    #[arg(long)]
    pub(crate) cycle: Option<String>,
    /// Strains that count, such as 0..1
    #[arg(long)]
    pub(crate) strain_range: Option<String>,
    /// Stretches at which a law must be stable, such as 0.5..3
    #[arg(long)]
    pub(crate) service: Option<String>,
    /// Residuals count relative to their stress, or as they are
    #[arg(long, value_parser = ["relative", "absolute"], default_value = "relative")]
    pub(crate) weight: String,
    /// A point counts by the stretch that it stands for, or all points alike
    #[arg(long, value_parser = ["stretch", "points"], default_value = "stretch")]
    pub(crate) measure: String,
    /// Friction at the faces of a pressed disc: bonded widens the interval downwards
    #[arg(long, value_parser = ["bonded", "none"], default_value = "bonded")]
    pub(crate) friction: String,
    /// Tests count by their points, not each alike
    #[arg(long)]
    pub(crate) pool: bool,
    /// Write the law to this file
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Write a page with figures to this file
    #[arg(long, value_name = "FILE")]
    pub(crate) report: Option<PathBuf>,
    /// Format of the result
    #[arg(long, value_enum, default_value = "table")]
    pub(crate) format: Format,
    #[command(flatten)]
    pub(crate) overwrite: Overwrite,
}

#[derive(Debug, Args)]
pub(crate) struct MaterialCheck {
    /// Name of the library, or a law such as "gent 191 kPa 6.95"
    pub(crate) law: String,
    /// Stretches at which it must be stable, such as 0.5..3
    #[arg(long)]
    pub(crate) service: Option<String>,
    /// Format of the result
    #[arg(long, value_enum, default_value = "table")]
    pub(crate) format: Format,
}

#[derive(Debug, Args)]
pub(crate) struct MaterialList {
    /// Format of the result
    #[arg(long, value_enum, default_value = "table")]
    pub(crate) format: Format,
}

#[derive(Debug, Args)]
pub(crate) struct MaterialShow {
    /// Name of a material, or a hardness
    pub(crate) name: String,
    /// Format of the result
    #[arg(long, value_enum, default_value = "table")]
    pub(crate) format: Format,
}

/// Format of results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// For people
    Table,
    /// SI values with the unit in the key
    Json,
    /// With the unit in brackets in the header
    Csv,
}

impl From<Format> for taxel::table::Format {
    fn from(format: Format) -> Self {
        match format {
            Format::Table => Self::Table,
            Format::Json => Self::Json,
            Format::Csv => Self::Csv,
        }
    }
}

/// Whether existing files are replaced.
#[derive(Debug, Clone, Args)]
pub(crate) struct Overwrite {
    /// Replace output files that exist
    #[arg(long)]
    pub(crate) force: bool,
}

impl Overwrite {
    pub(crate) fn existing(&self) -> Existing {
        if self.force {
            Existing::Replaced
        } else {
            Existing::Refused
        }
    }
}

#[derive(Debug, Args)]
pub(crate) struct Check {
    /// Sensor file or board file, or the name of a shipped one
    pub(crate) sensor: PathBuf,
    /// Format of the result
    #[arg(long, value_enum, default_value = "table")]
    pub(crate) format: Format,
    /// Write the result to this file instead of the standard output (-)
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Also draw the device to scale into this file (SVG)
    #[arg(long, value_name = "FILE")]
    pub(crate) plot: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) overwrite: Overwrite,
}

#[derive(Debug, Args)]
#[command(group(clap::ArgGroup::new("given").required(true).args(["load", "loads"])))]
pub(crate) struct Predict {
    /// Sensor file, or the name of a shipped one
    pub(crate) sensor: PathBuf,
    /// One load, such as "fx=1 mN, fz=5 mN"; a wrong name is answered with
    /// those that the device has
    #[arg(long, value_name = "SPEC", allow_hyphen_values = true)]
    pub(crate) load: Option<String>,
    /// Table of loads (CSV): columns of the same names with their units, such
    /// as force_z [mN]; other columns are passed on
    #[arg(long, value_name = "FILE")]
    pub(crate) loads: Option<PathBuf>,
    /// Calibration of this sensor: its values take the place of the file's
    /// constants, and answers carry the deviation that it leaves
    #[arg(long, value_name = "FILE")]
    pub(crate) calibration: Option<PathBuf>,
    /// Also print the interval that the deviations in the table `fabrication` of the sensor file
    /// leave: 5 and 95 % of 1000 made devices lie below its ends
    #[arg(long, conflicts_with_all = ["calibration", "vtu"])]
    pub(crate) spread: bool,
    /// Which mechanics answers; without it what the sensor file says
    #[arg(long, value_enum)]
    pub(crate) mechanics: Option<MechanicsName>,
    /// Format of the result
    #[arg(long, value_enum, default_value = "table")]
    pub(crate) format: Format,
    /// Write the result to this file instead of the standard output (-)
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Also draw the answers, and what was solved for the greatest load, into this file: .svg,
    /// or .html for a page
    #[arg(long, value_name = "FILE")]
    pub(crate) plot: Option<PathBuf>,
    /// Also write the bodies that --mechanics fem solved, deformed by the greatest load, with
    /// their stresses into this folder, for ParaView (.vtu)
    #[arg(long, value_name = "FOLDER")]
    pub(crate) vtu: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) overwrite: Overwrite,
}

#[derive(Debug, Args)]
pub(crate) struct Sweep {
    /// Study file (TOML), or the name of a shipped one, such as p1-resolution
    pub(crate) study: PathBuf,
    /// Format of the table
    #[arg(long, value_enum, default_value = "csv")]
    pub(crate) format: Format,
    /// Write the table to this file instead of the standard output (-)
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Also draw the designs into this file: .svg, or .html for a page
    #[arg(long, value_name = "FILE")]
    pub(crate) plot: Option<PathBuf>,
    /// Keep finished designs in this folder, and take from it those that are there
    #[arg(long, value_name = "FOLDER")]
    pub(crate) store: Option<PathBuf>,
    /// Compute one of N parts of the designs into the store, such as 3/16 (of 0/16 to 15/16), and
    /// print nothing; auto takes the part from SLURM_ARRAY_TASK_ID, JOB_COMPLETION_INDEX or
    /// PBS_ARRAY_INDEX
    #[arg(long, value_name = "K/N", requires = "store", conflicts_with_all = ["merge", "status", "output", "plot"])]
    pub(crate) shard: Option<String>,
    /// Number of parts for --shard auto, where the environment does not say it
    #[arg(long, value_name = "N", requires = "shard")]
    pub(crate) shards: Option<usize>,
    /// Print how many designs the store has, and how many are missing; exit code 0 only if none is
    #[arg(long, requires = "store", conflicts_with_all = ["merge", "output", "plot"])]
    pub(crate) status: bool,
    /// Compute nothing: write what the store has, in the order of the study
    #[arg(long, requires = "store")]
    pub(crate) merge: bool,
    #[command(flatten)]
    pub(crate) overwrite: Overwrite,
}

#[derive(Debug, Args)]
pub(crate) struct Optimize {
    /// Study file (TOML), or the name of a shipped one, such as p2-gaps
    pub(crate) study: PathBuf,
    /// Format of the table
    #[arg(long, value_enum, default_value = "csv")]
    pub(crate) format: Format,
    /// Write the table to this file instead of the standard output (-)
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Also draw the result into this file: .svg, or .html for a page
    #[arg(long, value_name = "FILE")]
    pub(crate) plot: Option<PathBuf>,
    /// Write the best design, or the first of the table, as a sensor file
    #[arg(long, value_name = "FILE")]
    pub(crate) best: Option<PathBuf>,
    /// Keep finished designs in this folder, and take from it those that are there
    #[arg(long, value_name = "FOLDER")]
    pub(crate) store: Option<PathBuf>,
    /// Compare the result with this many random designs, and fail if one is better
    #[arg(long, value_name = "N")]
    pub(crate) check: Option<usize>,
    /// Seed in the place of that of the study
    #[arg(long, value_name = "NUMBER")]
    pub(crate) seed: Option<u64>,
    /// Choose places by exchange even where all choices could be tried
    #[arg(long)]
    pub(crate) exchange: bool,
    #[command(flatten)]
    pub(crate) overwrite: Overwrite,
}

#[derive(Debug, Args)]
pub(crate) struct Tolerance {
    /// Study file (TOML), or the name of a shipped one, such as p2-tolerance
    pub(crate) study: PathBuf,
    /// Format of the table
    #[arg(long, value_enum, default_value = "table")]
    pub(crate) format: Format,
    /// Write the table to this file instead of the standard output (-)
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Also draw shares, distributions and yields into this file: .svg, or .html for a page
    #[arg(long, value_name = "FILE")]
    pub(crate) plot: Option<PathBuf>,
    /// Seed in the place of that of the study
    #[arg(long, value_name = "NUMBER")]
    pub(crate) seed: Option<u64>,
    /// What is corrected on each made device, in the place of what the study says
    #[arg(long, value_enum)]
    pub(crate) after: Option<After>,
    /// Keep finished devices in this folder, and take from it those that are there
    #[arg(long, value_name = "FOLDER")]
    pub(crate) store: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) overwrite: Overwrite,
}

/// What is corrected on each made device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum After {
    /// Nothing
    #[value(name = "as_drawn")]
    AsDrawn,
    /// Its rest values
    Rest,
    /// All its constants
    Bench,
}

impl From<After> for taxel_study::file::AfterFile {
    fn from(after: After) -> Self {
        match after {
            After::AsDrawn => Self::AsDrawn,
            After::Rest => Self::Rest,
            After::Bench => Self::Bench,
        }
    }
}

#[derive(Debug, Args)]
pub(crate) struct Fabricate {
    /// Sensor file, or the name of a shipped one
    pub(crate) sensor: PathBuf,
    /// Write the files into this folder, which is made: masks.dxf, masks.gds, moulds (.stl),
    /// layers.csv, drawing.svg
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) output: PathBuf,
    /// Share by which cast parts shrink, such as "1.5 %": moulds are made larger by 1/(1 - share)
    #[arg(long, value_name = "SHARE", default_value = "0 %", value_parser = shrink)]
    pub(crate) shrink: f64,
    /// Mirror the masks along x, for exposure from behind
    #[arg(long)]
    pub(crate) mirror: bool,
    /// Which side of the edges the figures of masks fill
    #[arg(long, value_enum, default_value = "as-drawn")]
    pub(crate) polarity: PolarityName,
    /// Add crosses outside the corners of the array, at the same places in all masks
    #[arg(long)]
    pub(crate) marks: bool,
    /// Coordinates of masks are multiples of this length; refused if rounding moves an edge by
    /// more than 0.1 % of the smallest distance between edges of its mask
    #[arg(long, value_name = "LENGTH", default_value = "1 nm", value_parser = grid)]
    pub(crate) grid: f64,
    /// Format of the summary
    #[arg(long, value_enum, default_value = "table")]
    pub(crate) format: Format,
    #[command(flatten)]
    pub(crate) overwrite: Overwrite,
}

/// Grids that masks may have, m.
const GRIDS: [f64; 2] = [1e-12, 1e-4];

/// A share by which cast parts shrink, such as "1.5 %".
fn shrink(text: &str) -> Result<f64, String> {
    let percent = text.trim().strip_suffix('%').map(str::trim);
    percent
        .and_then(|number| number.parse::<f64>().ok())
        .filter(|percent| (0.0..=20.0).contains(percent))
        .map(|percent| percent / 100.0)
        .ok_or_else(|| String::from("must be a percentage from 0 % to 20 %, such as \"1.5 %\""))
}

/// The grid of masks, m.
fn grid(text: &str) -> Result<f64, String> {
    let grid = LENGTH.parse(text)?;
    if (GRIDS[0]..=GRIDS[1]).contains(&grid) {
        return Ok(grid);
    }
    Err(String::from(
        "must be from 1e-3 nm to 100 um, such as \"1 nm\"",
    ))
}

/// Polarity of masks as the command line names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum PolarityName {
    /// The parts themselves
    AsDrawn,
    /// What is left of the array around the parts
    Inverted,
}

impl From<PolarityName> for taxel_fabricate::Polarity {
    fn from(name: PolarityName) -> Self {
        match name {
            PolarityName::AsDrawn => Self::AsDrawn,
            PolarityName::Inverted => Self::Inverted,
        }
    }
}

#[derive(Debug, Args)]
pub(crate) struct Tabulate {
    /// Sensor file, or the name of a shipped one
    pub(crate) sensor: PathBuf,
    /// Write the table (JSON) to this file, for mechanics = { table = "FILE" } in the sensor file
    #[arg(short, long, value_name = "TABLE")]
    pub(crate) output: PathBuf,
    /// Nodes are added until the interpolation error is below this share of full scale, or there is
    /// no table [default: 1e-4, and a larger error is stated where the solution itself leaps; of a
    /// body element.body.tolerance]
    #[arg(long, value_name = "SHARE", value_parser = tolerance)]
    pub(crate) tolerance: Option<f64>,
    /// Most points of the table of a body, beside 59 fresh ones that it is compared with [default: 200]
    #[arg(long, value_name = "NUMBER")]
    pub(crate) points: Option<usize>,
    /// Points of a body that are solved at a time; the table does not depend on it [default: 1]
    #[arg(long, value_name = "NUMBER")]
    pub(crate) jobs: Option<usize>,
    #[command(flatten)]
    pub(crate) overwrite: Overwrite,
}

/// A share of full scale.
fn tolerance(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(value) if (1e-6..=0.1).contains(&value) => Ok(value),
        _ => Err(String::from("must be a number from 1e-6 to 0.1")),
    }
}

#[derive(Debug, Args)]
pub(crate) struct ExportSensor {
    /// Sensor file, or the name of a shipped one
    pub(crate) sensor: PathBuf,
    /// What for
    #[arg(long, value_enum)]
    pub(crate) to: ExportTo,
    /// Coefficient of sliding friction of the taxels, for mjcf
    #[arg(long, value_name = "NUMBER", default_value = "1", value_parser = friction)]
    pub(crate) friction: f64,
    /// Write the result to this file instead of the standard output (-)
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) overwrite: Overwrite,
}

/// What a sensor is exported to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ExportTo {
    /// Bodies, sites and force sensors to include in a model of MuJoCo
    Mjcf,
    /// Poses, pitch, period and noise in SI units
    Json,
}

/// A coefficient of friction.
fn friction(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(value) if (0.0..=10.0).contains(&value) => Ok(value),
        _ => Err(String::from("must be a number from 0 to 10")),
    }
}

#[derive(Debug, Args)]
pub(crate) struct Completions {
    /// The shell
    #[arg(value_enum)]
    pub(crate) shell: clap_complete::Shell,
}

#[derive(Debug, Args)]
pub(crate) struct ManPages {
    /// Write the pages into this folder, which is made, such as ~/.local/share/man/man1
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) overwrite: Overwrite,
}

#[derive(Debug, Args)]
pub(crate) struct Solve {
    /// Problem file (TOML), or the name of a shipped one: dome, channel, fingertip, pad
    pub(crate) problem: PathBuf,
    /// Format of the table, which has a row for each step
    #[arg(long, value_enum, default_value = "table")]
    pub(crate) format: Format,
    /// Write the table to this file instead of the standard output (-)
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Also draw the body, deformed by the last step, with its stress into this file: .svg
    #[arg(long, value_name = "FILE")]
    pub(crate) plot: Option<PathBuf>,
    /// Also write the body at rest and after each step (.vtu) and their list (steps.pvd) into this
    /// folder, for ParaView
    #[arg(long, value_name = "FOLDER")]
    pub(crate) vtu: Option<PathBuf>,
    /// Also write the state after each step into this file, and where an interrupted or failed
    /// solution ended: --resume goes on from there
    #[arg(long, value_name = "FILE")]
    pub(crate) save: Option<PathBuf>,
    /// Go on from a state that --save wrote
    #[arg(long, value_name = "FILE")]
    pub(crate) resume: Option<PathBuf>,
    /// Only check the problem file and its mesh
    #[arg(long)]
    pub(crate) check: bool,
    #[command(flatten)]
    pub(crate) overwrite: Overwrite,
}

/// Mechanics as the command line names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum MechanicsName {
    /// Closed forms and tables; answers at once
    ClosedForm,
    /// Finite elements of the drawing; seconds to minutes
    Fem,
}

impl From<MechanicsName> for taxel::mechanics::Mechanics {
    fn from(name: MechanicsName) -> Self {
        match name {
            MechanicsName::ClosedForm => Self::ClosedForm,
            MechanicsName::Fem => Self::Fem,
        }
    }
}

#[derive(Debug, Clone, Args)]
pub(crate) struct Live {
    /// Sensor file, or the name of a shipped one [default: three-axis-8x8]; a recording that
    /// describes itself needs none. Several run side by side on one page
    #[arg(value_name = "SENSOR")]
    pub(crate) sensors: Vec<PathBuf>,
    /// The one of `sensors` that is meant
    #[arg(skip)]
    pub(crate) named_sensor: Option<PathBuf>,
    /// Calibration of this sensor, which estimation then inverts
    #[arg(long, value_name = "FILE")]
    pub(crate) calibration: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) map: Maps,
    /// Where frames come from: sim: (the twin under a shipped script that fits
    /// it), sim:NAME of a shipped script, sim:SCRIPT.toml, or replay:RECORDING; with --board
    /// serial:PORT, serial:auto, tcp:HOST:PORT, ws:HOST:PORT/PATH, udp:PORT[@GROUP], -, a named pipe,
    /// exec:"PROGRAM ARGUMENTS", or replay:FILE of bytes that were captured; of several sensors
    /// one for each, in their order
    #[arg(long = "source", value_name = "SOURCE", default_value = "sim:")]
    pub(crate) sources: Vec<String>,
    /// The one of `sources` that is meant
    #[arg(skip)]
    pub(crate) source: String,
    /// Session file (TOML): several sensors with their sources, boards and calibrations, in place of
    /// the arguments of each
    #[arg(long, value_name = "FILE", conflicts_with_all = ["sensors", "sources", "calibration", "boards"])]
    pub(crate) session: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) link: Hardware,
    /// Device seconds per second; "max" is as fast as possible
    #[arg(long, default_value = "1")]
    pub(crate) speed: String,
    /// End after this many new frames
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) frames: Option<u64>,
    /// No page; a summary at the end
    #[arg(long)]
    pub(crate) headless: bool,
    /// Format of the summary
    #[arg(long, value_enum, default_value = "table")]
    pub(crate) format: Format,
    /// Seed of the twin's noise
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) start: RestAtStart,
    /// Also write the raw frames to this file, for replay
    #[arg(long, value_name = "FILE")]
    pub(crate) save: Option<PathBuf>,
    /// Also write the events of contacts to this file, one line each as they
    /// come: .csv or .jsonl
    #[arg(long, value_name = "FILE")]
    pub(crate) events: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) recording: RecordOptions,
    #[command(flatten)]
    pub(crate) outputs: Outputs,
    /// Play the complete frames of a recording that ends in the middle of one
    #[arg(long)]
    pub(crate) salvage: bool,
    /// Address of the page; any other than the loopback opens it to the network
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1")]
    pub(crate) host: IpAddr,
    /// Port of the page; 0 takes a free one
    #[arg(long, default_value_t = 7117)]
    pub(crate) port: u16,
    /// Show the address as a QR code on the standard error; without it only where that is a terminal
    /// and other machines reach the page
    #[arg(long)]
    pub(crate) qr: bool,
    /// The estimates of every frame as a table, for `taxel estimate`
    #[arg(skip)]
    pub(crate) table: Option<TouchTable>,
    #[command(flatten)]
    pub(crate) overwrite: Overwrite,
}

impl Live {
    /// What is asked of each sensor: of sensors and sources there is one for all, or as many.
    ///
    /// # Errors
    /// In words, for other numbers of them.
    pub(crate) fn each(&self) -> Result<Vec<Self>, String> {
        let count = self.sensors.len().max(self.sources.len()).max(1);
        let fits = |given: usize| given <= 1 || given == count;
        if !fits(self.sensors.len()) || !fits(self.sources.len()) {
            return Err(format!(
                "{} sensors and {} sources: give one --source for each sensor, in their order",
                self.sensors.len(),
                self.sources.len()
            ));
        }
        let source = |place: usize| self.sources.get(place).or(self.sources.first());
        // What is simulated needs no board.
        let links = (0..count).filter(|place| {
            count == 1 || source(*place).is_some_and(|source| LinkAddress::is_one(source))
        });
        let links: Vec<_> = links.collect();
        let boards = &self.link.boards;
        if boards.len() > 1 && boards.len() != links.len() {
            return Err(format!(
                "{} boards and {} links: give one --board for all, or one for each link, in their order",
                boards.len(),
                links.len()
            ));
        }
        let one = |place: usize| {
            let link = links.iter().position(|link| *link == place);
            let board = link.and_then(|link| boards.get(link).or(boards.first()));
            let mut one = self.clone();
            one.named_sensor = self.sensors.get(place).or(self.sensors.first()).cloned();
            one.source = source(place).cloned().unwrap_or_default();
            one.link.board = board.cloned();
            one
        };
        Ok((0..count).map(one).collect())
    }

    /// The first option that only a run of one sensor can have.
    pub(crate) fn of_one_sensor(&self) -> Option<&'static str> {
        [
            (self.headless, "--headless"),
            (self.save.is_some(), "--save"),
            (self.events.is_some(), "--events"),
            (!self.outputs.out.is_empty(), "--out"),
            (!self.outputs.marks.is_empty(), "--marks"),
        ]
        .iter()
        .find(|(given, _)| *given)
        .map(|(_, name)| *name)
    }

    /// The sensor that was named, or the usual one.
    pub(crate) fn sensor(&self) -> &Path {
        let usual = Path::new("three-axis-8x8");
        self.named_sensor.as_deref().unwrap_or(usual)
    }
}

/// Every estimate of the table is the one that `taxel live` makes of the same frames: the
/// recording is played through the same session, as fast as possible.
#[derive(Debug, Args)]
pub(crate) struct Estimate {
    /// Sensor file, or the name of a shipped one
    pub(crate) sensor: PathBuf,
    /// Recording that `taxel live --source replay:` plays
    pub(crate) recording: PathBuf,
    /// Calibration of this sensor, which estimation then inverts
    #[arg(long, value_name = "FILE")]
    pub(crate) calibration: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) map: Maps,
    /// Board file (TOML), or the name of a shipped one, for bytes that were captured
    #[arg(long, value_name = "BOARD")]
    pub(crate) board: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) start: RestAtStart,
    /// Write the table (CSV) to this file; without it, and with -, to the standard output, and
    /// the summary to the standard error
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Also write the events of contacts to this file: .csv or .jsonl
    #[arg(long, value_name = "FILE")]
    pub(crate) events: Option<PathBuf>,
    /// Format of the summary
    #[arg(long, value_enum, default_value = "table")]
    pub(crate) format: Format,
    /// Take the complete frames of a recording that ends in the middle of one
    #[arg(long)]
    pub(crate) salvage: bool,
    #[command(flatten)]
    pub(crate) overwrite: Overwrite,
}

/// The recording of the whole run.
#[derive(Debug, Clone, Args)]
pub(crate) struct RecordOptions {
    /// Record all of the run to this file (.mcap): frames, touch, events, tares and the files
    /// it was made with; whatever ends the program, no more than the last 100 ms are lost. Of
    /// several sensors each has a file (run-1.mcap, run-2.mcap), by one clock
    #[arg(long, value_name = "FILE")]
    pub(crate) record: Option<PathBuf>,
    /// Also record messages of types that this program knows, for each frame; export makes them of a recording
    /// without
    #[arg(long, value_name = "PROGRAM")]
    pub(crate) record_for: Option<RecordFor>,
    /// End the run if the recording, or the file of --save, --events or --out, fails; without it
    /// the measurement goes on
    #[arg(long)]
    pub(crate) record_or_stop: bool,
    /// Folder of the recordings that are begun on the page
    #[arg(long, value_name = "FOLDER", default_value = ".")]
    pub(crate) record_folder: PathBuf,
}

/// A program that has types of messages of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum RecordFor {
    /// WrenchStamped of the total, Image of the values, PointCloud2 of the contacts
    Ros2,
    /// Grid and RawImage of the values, SceneUpdate with arrows and contacts, FrameTransform
    Foxglove,
}

impl RecordOptions {
    /// What becomes of the run when one of its files fails.
    pub(crate) fn when_failing(&self) -> WhenRecordingFails {
        if self.record_or_stop {
            WhenRecordingFails::Stop
        } else {
            WhenRecordingFails::GoOn
        }
    }
}

#[derive(Debug, Args)]
pub(crate) struct Device {
    /// Sensor file, or the name of a shipped one
    pub(crate) sensor: PathBuf,
    /// Board file (TOML), or the name of a shipped one: how the frames become bytes
    #[arg(long, value_name = "BOARD")]
    pub(crate) board: PathBuf,
    /// Where the bytes go: pty (its name is printed), pty:LINK (a link that leads to it),
    /// tcp:PORT, tcp:HOST:PORT, udp:HOST:PORT, or - for the standard output
    #[arg(long, value_name = "PLACE")]
    pub(crate) on: String,
    /// Script of what presses on the twin, or the name of a shipped one; without it the usual
    /// one of the sensor
    #[arg(long, value_name = "SCRIPT", conflicts_with = "replay")]
    pub(crate) script: Option<PathBuf>,
    /// Play this recording in place of the twin
    #[arg(long, value_name = "FILE")]
    pub(crate) replay: Option<PathBuf>,
    /// Frames a second, such as "1 kHz"; without it what the board file says, or the sensor file
    #[arg(long, value_name = "RATE")]
    pub(crate) rate: Option<String>,
    /// File of what goes wrong (TOML)
    #[arg(long, value_name = "FILE")]
    pub(crate) faults: Option<PathBuf>,
    /// Seed of the noise and of what goes wrong
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Write what was done to each frame to this file, one line of JSON each
    #[arg(long, value_name = "FILE")]
    pub(crate) truth: Option<PathBuf>,
    /// Take commands that move what presses: tcp:PORT, or - for lines of the standard input
    #[arg(long, value_name = "PLACE")]
    pub(crate) control: Option<String>,
    /// End after this many frames
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) frames: Option<u64>,
    #[command(flatten)]
    pub(crate) overwrite: Overwrite,
}

#[derive(Debug, Args)]
pub(crate) struct Listen {
    /// serial:PORT, tcp:HOST:PORT, ws:HOST:PORT/PATH, udp:PORT, -, a named pipe,
    /// exec:"PROGRAM ARGUMENTS", or a file of bytes as a board sent them
    pub(crate) source: String,
    /// Write the board file here instead of to the standard output (-)
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Listen for so long, s
    #[arg(long, default_value_t = 5.0, value_parser = listening)]
    pub(crate) seconds: f64,
    /// Speed of a serial port
    #[arg(long, default_value_t = 115_200)]
    pub(crate) baud: u32,
    /// Then show the channels on the page, as taxel live --raw does; of a link on a terminal that is done
    /// unasked
    #[arg(long)]
    pub(crate) live: bool,
    /// Show no page
    #[arg(long, conflicts_with_all = ["live", "port"])]
    pub(crate) no_page: bool,
    /// Port of the page, as of taxel live; 0 takes a free one
    #[arg(long)]
    pub(crate) port: Option<u16>,
    #[command(flatten)]
    pub(crate) overwrite: Overwrite,
}

/// A time to listen, s.
fn listening(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if (0.1..=3600.0).contains(&seconds) => Ok(seconds),
        _ => Err("must be a number of seconds from 0.1 to 3600".into()),
    }
}

#[derive(Debug, Args)]
pub(crate) struct Devices {
    /// Format of the result
    #[arg(long, value_enum, default_value = "table")]
    pub(crate) format: DeviceFormat,
}

/// Format of the list of devices.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum DeviceFormat {
    /// For people
    Table,
    /// For programs
    Json,
}

/// A board and its link.
#[derive(Debug, Clone, Args)]
pub(crate) struct Hardware {
    /// Board file (TOML), or the name of a shipped one: what the bytes of the link mean; of several
    /// links one for all, or one for each
    #[arg(long = "board", value_name = "BOARD")]
    pub(crate) boards: Vec<PathBuf>,
    /// The one of `boards` that is meant
    #[arg(skip)]
    pub(crate) board: Option<PathBuf>,
    /// End when the link is lost; without it the link is opened again for ever
    #[arg(long)]
    pub(crate) once: bool,
    /// Neither compare the zero of the start with that of the last run on this link nor keep it; it is kept in
    /// the folder that TAXEL_STATE names, or in taxel in ~/.local/state
    #[arg(long)]
    pub(crate) no_last_zero: bool,
}

/// What goes to other programs while it runs, and what comes in.
#[derive(Debug, Clone, Args)]
pub(crate) struct Outputs {
    /// Each frame to other programs: jsonl or csv on the standard output, jsonl:FILE, csv:FILE, or lines at a
    /// port (csv:tcp:PORT, jsonl:tcp:HOST:PORT); osc:HOST:PORT; plotjuggler:HOST:PORT; lsl, streams of the
    /// lab streaming layer; may be repeated
    #[arg(long, value_name = "OUTPUT")]
    pub(crate) out: Vec<String>,
    /// Take each line of the standard input (-), or each sample of a stream of the lab streaming layer
    /// (lsl:NAME), as a mark; may be repeated
    #[arg(long, value_name = "SOURCE", value_parser = Marks::parse)]
    pub(crate) marks: Vec<Marks>,
}

/// What is shown as a map, and how.
#[derive(Debug, Clone, Args)]
pub(crate) struct Maps {
    /// Show the channels as a map of raw readings, without the model of any sensor
    #[arg(long, conflicts_with = "calibration")]
    pub(crate) raw: bool,
    /// Of a recording of several sensors, topics, streams or data sets: the one to play, by name
    /// or from 1 on
    #[arg(long, value_name = "PART", visible_aliases = ["topic", "stream", "dataset"])]
    pub(crate) part: Option<String>,
    /// What the columns of a table are, or the channels of a recording of another program, by
    /// number, name or range: "time=2[ms],value=3-18[kPa],ignore=1", sequence=, "rate=100 Hz".
    /// What is not named is recognised, and printed
    #[arg(long, value_name = "COLUMNS")]
    pub(crate) columns: Option<Columns>,
    /// On a map also report steps, impacts, cyclic loads and slips of contacts
    #[arg(long)]
    pub(crate) all_events: bool,
}

/// Where the rest values of the first frames come from.
#[derive(Debug, Clone, Args)]
pub(crate) struct RestAtStart {
    /// Capture the rest values at the start, on any device and whatever presses; without it
    /// only where the device needs it and no taxel stands out
    #[arg(long)]
    pub(crate) tare: bool,
    /// Capture none at the start: keep the rest values of the drawing
    #[arg(long, conflicts_with = "tare")]
    pub(crate) no_tare: bool,
    /// Frames that a rest capture averages [default: 50]; or a recording of this device, whose
    /// first 50 frames are at rest: its rest values instead of a capture at the start
    #[arg(long, value_name = "FRAMES|FILE")]
    pub(crate) rest: Option<Rest>,
}

/// What `--rest` says.
#[derive(Debug, Clone)]
pub(crate) enum Rest {
    /// Capture them from so many frames.
    Frames(usize),
    /// Take them from the first frames of a recording.
    Recording(PathBuf),
}

/// Frames of a rest capture.
pub(crate) const REST_FRAMES: usize = 50;

impl FromStr for Rest {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.parse() {
            Ok(frames @ 2..=100_000) => Ok(Self::Frames(frames)),
            Ok(_) => Err("must be 2 to 100000 frames, or a recording".into()),
            Err(_) => Ok(Self::Recording(text.into())),
        }
    }
}

#[derive(Debug, Args)]
pub(crate) struct Recording {
    #[command(subcommand)]
    pub(crate) command: RecordingCommand,
}

/// Only what its own CRC confirms is ever taken from a recording. Its file is never changed.
#[derive(Debug, Subcommand)]
pub(crate) enum RecordingCommand {
    /// What is in a recording, what is missing, and whether it ended well
    ///
    /// Exit code 3 if something is damaged or missing, or the recording was not finished.
    Inspect(Inspect),
    /// Write a finished recording of all that is whole in a damaged or unfinished one
    ///
    /// Exit code 3 if something is missing in it.
    Repair(Repair),
    /// Make a recording of a file of another program
    ///
    /// Tables, bags of ROS 1 and 2, XDF, NPY, NPZ and HDF5. What was taken for what is printed.
    /// Exit code 3 if the file is cut.
    Import(Import),
    /// Forces, deviations, states, contacts, events, readings and marks for other programs
    Export(Export),
    /// Write a stretch of time as a recording of its own
    Cut(Cut),
    /// Make the frames anew from the bytes of the wire, with another board file
    ///
    /// Exit code 3 if something was lost or damaged.
    Decode(DecodeWire),
    /// Play a recording again and say where touch is no longer the recorded one
    ///
    /// With two recordings: where their touch is not the same. Exit code 3 if it is not.
    Compare(Compare),
}

#[derive(Debug, Args)]
pub(crate) struct Import {
    /// File of another program, the folder of a bag, or - for a table on the standard input
    pub(crate) file: PathBuf,
    /// Write the frames to this file: .csv or .mcap
    #[arg(short, long, value_name = "NEW")]
    pub(crate) output: PathBuf,
    /// Of a file of several topics, streams or data sets: the one to read, by name or from 1 on
    #[arg(long, value_name = "PART", visible_aliases = ["topic", "stream", "dataset"])]
    pub(crate) part: Option<String>,
    /// What the columns of a table are, or the channels of a part, by number, name or range:
    /// "time=2[ms],value=3-18[kPa],ignore=1", sequence=, "rate=100 Hz"
    #[arg(long, value_name = "COLUMNS")]
    pub(crate) columns: Option<Columns>,
    #[command(flatten)]
    pub(crate) overwrite: Overwrite,
}

#[derive(Debug, Args)]
pub(crate) struct Inspect {
    /// Recordings of taxel live --record, such as those of the sensors of one run, or files of
    /// other programs
    #[arg(required = true, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,
    /// Format of the result
    #[arg(long, value_enum, default_value = "table")]
    pub(crate) format: Format,
}

#[derive(Debug, Args)]
pub(crate) struct Repair {
    /// Recording of taxel live --record; it is not changed
    pub(crate) file: PathBuf,
    /// Write the whole recording to this file (.mcap)
    #[arg(short, long, value_name = "NEW")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) overwrite: Overwrite,
}

#[derive(Debug, Args)]
pub(crate) struct Export {
    /// Recording of taxel live --record
    pub(crate) file: PathBuf,
    /// Where to: X.csv for one table over time, X.npz for NumPy, X.mcap for ROS 2 or Foxglove with messages that
    /// they know beside those of taxel, or a folder for a table of each kind; a folder is made
    #[arg(short, long, value_name = "FILE|FOLDER")]
    pub(crate) output: PathBuf,
    /// Whose messages X.mcap has; without it those of ROS 2
    #[arg(long = "for", value_name = "PROGRAM")]
    pub(crate) program: Option<RecordFor>,
    #[command(flatten)]
    pub(crate) overwrite: Overwrite,
}

#[derive(Debug, Args)]
pub(crate) struct DecodeWire {
    /// Recording of taxel live --record of a board, or a file of the bytes that a board sent
    pub(crate) file: PathBuf,
    /// Board file (TOML), or the name of a shipped one
    #[arg(long, value_name = "BOARD")]
    pub(crate) board: PathBuf,
    /// Write the frames to this file (.csv), which `taxel live --source replay:` plays
    #[arg(short, long, value_name = "NEW")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) overwrite: Overwrite,
}

#[derive(Debug, Args)]
pub(crate) struct Cut {
    /// Recording of taxel live --record; it is not changed
    pub(crate) file: PathBuf,
    /// Begin, from the start of the recording on, such as "90 s"
    #[arg(long, value_name = "TIME", default_value = "0 s", value_parser = seconds)]
    pub(crate) from: f64,
    /// End, from the start of the recording on, such as "2 min" [default: the end]
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    pub(crate) to: Option<f64>,
    /// Write the stretch to this file (.mcap)
    #[arg(short, long, value_name = "NEW")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) overwrite: Overwrite,
}

#[derive(Debug, Args)]
pub(crate) struct Compare {
    /// Recording of taxel live --record
    pub(crate) file: PathBuf,
    /// Another one; without it the frames of FILE are estimated again by this program
    pub(crate) other: Option<PathBuf>,
}

/// A time with its unit, s.
fn seconds(text: &str) -> Result<f64, String> {
    let wrong = || {
        format!(
            "\"{text}\" is not a time; write a number of 0 or more with its unit, such as \"90 s\", \"250 ms\", \"2 min\" or \"1 h\""
        )
    };
    let split = text
        .find(|c: char| c.is_ascii_alphabetic() && c != 'e')
        .ok_or_else(wrong)?;
    let (number, unit) = text.split_at(split);
    let scale = match unit.trim() {
        "ms" => 1e-3,
        "s" => 1.0,
        "min" => 60.0,
        "h" => 3600.0,
        _ => return Err(wrong()),
    };
    let number: f64 = number.trim().parse().map_err(|_| wrong())?;
    Some(number * scale)
        .filter(|seconds| (0.0..1e9).contains(seconds))
        .ok_or_else(wrong)
}

#[derive(Debug, Args)]
pub(crate) struct Calibrate {
    /// Sensor file, or the name of a shipped one
    pub(crate) sensor: PathBuf,
    /// Readings (CSV): columns with their units, such as force_z [N],
    /// displacement [um], capacitance [fF]; a message about a wrong one lists all.
    /// For a piezoelectric array also indentations at known positions (x, y,
    /// radius, voltage_1 ...), alone or beside it. For a device that is trained: tables
    /// (time, x, y, force_z, channel_1 ...) or folders of recordings, one or
    /// more for each run
    #[arg(required = true)]
    pub(crate) data: Vec<PathBuf>,
    /// Another sensor whose readings are in the same table, separated by its
    /// column (gap); may be repeated
    #[arg(long, value_name = "SENSOR")]
    pub(crate) with: Vec<PathBuf>,
    /// Write the calibration file (TOML) to this file; - is the standard output,
    /// and the summary goes to the standard error
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Write a report with figures to this file (HTML)
    #[arg(long, value_name = "FILE")]
    pub(crate) report: Option<PathBuf>,
    /// Readings held out to judge the fit: 20% (the last of each sensor in
    /// time), random:20%, random:20%:SEED, column (the column hold_out), none
    #[arg(long, value_name = "WHICH", default_value = "20%")]
    pub(crate) hold_out: String,
    /// Model that is wanted; without it the usual one of the device
    #[arg(long)]
    pub(crate) model: Option<String>,
    /// Intervals from profiles of the likelihood: slower, and right where the
    /// model is curved
    #[arg(long)]
    pub(crate) profile: bool,
    /// Give outliers little weight (Huber's loss)
    #[arg(long)]
    pub(crate) robust: bool,
    /// Rows a second of tables without a time, such as "28 Hz", of a device that is trained
    #[arg(long, value_name = "RATE", value_parser = rate)]
    pub(crate) rate: Option<f64>,
    /// Unit of the scale in recordings without a header, of a device that is trained: g or N;
    /// without it grams, unless the sensor file speaks against it
    #[arg(long, value_name = "UNIT", value_enum)]
    pub(crate) scale_unit: Option<ScaleUnitName>,
    /// Format of the result
    #[arg(long, value_enum, default_value = "table")]
    pub(crate) format: CalibrateFormat,
    #[command(flatten)]
    pub(crate) overwrite: Overwrite,
}

/// Unit of a scale as the command line names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ScaleUnitName {
    /// Grams
    #[value(name = "g")]
    Grams,
    /// Newtons
    #[value(name = "N", alias = "n")]
    Newtons,
}

impl From<ScaleUnitName> for taxel_calibrate::ScaleUnit {
    fn from(name: ScaleUnitName) -> Self {
        match name {
            ScaleUnitName::Grams => Self::Grams,
            ScaleUnitName::Newtons => Self::Newtons,
        }
    }
}

/// A rate with its unit, Hz.
fn rate(text: &str) -> Result<f64, String> {
    let (number, factor) = match text.trim() {
        text if text.ends_with("kHz") => (text.trim_end_matches("kHz"), 1e3),
        text => (text.strip_suffix("Hz").unwrap_or(""), 1.0),
    };
    let rate = number.trim().parse::<f64>().map(|number| number * factor);
    rate.ok()
        .filter(|rate| (1e-3..=1e6).contains(rate))
        .ok_or_else(|| {
            format!(
                "\"{text}\" is not a rate; write a number above 0 with Hz or kHz, such as \"28 Hz\""
            )
        })
}

/// Format of the result of a calibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum CalibrateFormat {
    /// For people
    Table,
    /// SI values
    Json,
}

#[derive(Debug, Args)]
pub(crate) struct Twin {
    /// Sensor file, or the name of a shipped one
    pub(crate) sensor: PathBuf,
    /// Synthetic calibration data, as `taxel calibrate` reads them
    #[arg(long, required = true)]
    pub(crate) calibration_data: bool,
    /// Another sensor in the same table; may be repeated
    #[arg(long, value_name = "SENSOR")]
    pub(crate) with: Vec<PathBuf>,
    /// Write the readings to this file instead of the standard output (-)
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Seed of the noise
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Readings of each sensor
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u64).range(8..=1_000_000))]
    pub(crate) readings: u64,
    /// Cycles of loading and unloading
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    pub(crate) cycles: u64,
    /// Largest relative compression, up to 0.4
    #[arg(long, value_name = "E", default_value_t = 0.28, value_parser = share::<40>)]
    pub(crate) compression: f64,
    /// Standard deviation of a reading over the largest one
    #[arg(long, value_name = "SHARE", default_value_t = 0.01, value_parser = share::<50>)]
    pub(crate) noise: f64,
    /// Force of loading over that of unloading, less one
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, value_parser = share::<50>)]
    pub(crate) hysteresis: f64,
    /// Change of the signal from first to last reading, over its range
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, value_parser = share::<100>)]
    pub(crate) drift: f64,
    /// Tilt of the probe along the gap, degrees, up to 5
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, value_parser = share::<500>)]
    pub(crate) tilt: f64,
    /// Share of the largest change of a liquid-metal channel from which it reads
    /// no more
    #[arg(long, value_name = "SHARE", default_value_t = 1.0, value_parser = share::<100>)]
    pub(crate) saturation: f64,
    /// Indentations on a grid by a probe with a contact of this radius in mm,
    /// in place of loads; may be repeated
    #[arg(long, value_name = "MM", value_parser = millimetres)]
    pub(crate) probe: Vec<f64>,
    /// Distance of these indentations in mm
    #[arg(long, value_name = "MM", default_value_t = 1.0, value_parser = millimetres)]
    pub(crate) grid: f64,
    #[command(flatten)]
    pub(crate) overwrite: Overwrite,
}

/// A length in mm.
fn millimetres(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(value) if (0.05..=100.0).contains(&value) => Ok(value),
        _ => Err(String::from("must be a number of mm from 0.05 to 100")),
    }
}

/// A number from 0 to `PERCENT` hundredths.
fn share<const PERCENT: u16>(text: &str) -> Result<f64, String> {
    let most = f64::from(PERCENT) / 100.0;
    match text.parse() {
        Ok(value) if (0.0..=most).contains(&value) => Ok(value),
        _ => Err(format!("must be a number from 0 to {most}")),
    }
}

#[derive(Debug, Args)]
pub(crate) struct Reproduce {
    /// Only these papers; all four if none is named
    #[arg(value_enum)]
    pub(crate) papers: Vec<PaperName>,
    /// Format of the report; without it HTML to a file that ends in .html, JSON to one
    /// that ends in .json, and the counts alone to the standard output
    #[arg(long, value_enum)]
    pub(crate) format: Option<ReportFormat>,
    /// Write the report to this file; - is the standard output, and the counts go
    /// to the standard error
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Also write the rows of each paper into its page, p1.md to p4.md, of
    /// this folder
    #[arg(long, value_name = "FOLDER")]
    pub(crate) ledger: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) overwrite: Overwrite,
}

#[derive(Debug, Args)]
pub(crate) struct Verify {
    /// Only these cases: a group (A to D), a family (B7) or a case (B2); all
    /// if none is named
    pub(crate) cases: Vec<String>,
    /// Coarser meshes and fewer rows
    #[arg(long)]
    pub(crate) short: bool,
    /// Also write a report to this file: .html, or .json for SI values. It is
    /// written after each case, so that an interrupted run leaves what is done; - is
    /// the standard output, which takes the JSON when all is done
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) overwrite: Overwrite,
}

/// A paper as the command line names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum PaperName {
    /// In-plane capacitive sensor
    #[value(name = "P1", alias = "p1")]
    P1,
    /// Three-axis capacitive array
    #[value(name = "P2", alias = "p2")]
    P2,
    /// Piezoelectric array
    #[value(name = "P3", alias = "p3")]
    P3,
    /// Liquid-metal array
    #[value(name = "P4", alias = "p4")]
    P4,
}

/// Format of the report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ReportFormat {
    /// One page with its figures, readable without a network
    Html,
    /// The same as data
    Json,
}

#[derive(Debug, Args)]
pub(crate) struct Schema {
    /// Which schema
    #[arg(value_enum, default_value = "sensor")]
    pub(crate) of: SchemaOf,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum SchemaOf {
    /// Sensor file
    Sensor,
    /// Sensor file, as a page for people (Markdown)
    Reference,
    /// Stimulus script
    Stimulus,
    /// Study file
    Study,
    /// Board file
    Board,
    /// Board file, as a page for people (Markdown)
    BoardReference,
    /// Problem file of taxel solve
    Problem,
    /// Problem file, as a page for people (Markdown)
    ProblemReference,
}
