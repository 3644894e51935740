//! Files of tests: text to points, with a note on everything that was guessed.

use taxel_ground::quantity::{Dimension, FORCE, LENGTH, TIME};
use taxel_ground::{InputError, separator_of};

use crate::law::Mode;
use crate::relaxation::Held;

/// One test as its file has it, in the order of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Test {
    /// Name of the file.
    pub name: String,
    /// Loading.
    pub mode: Mode,
    /// True where the specimen is pressed: stretches below one.
    pub compression: bool,
    /// Gauge length or height of the undeformed specimen, m.
    pub length: Option<f64>,
    /// Cross-section of the undeformed specimen, m².
    pub area: Option<f64>,
    /// Diameter of a disc, m.
    pub diameter: Option<f64>,
    /// Force at which the extension begins, N.
    pub preload: Option<f64>,
    /// Time in s (where there is one), strain and force per undeformed area in Pa; a strain
    /// from an extension needs its length, which is known here.
    pub rows: Vec<[f64; 3]>,
    /// Where a stretch or a load was held, and not increased: times, and stresses or strains. Such a
    /// test has no rows.
    pub held: Option<Held>,
    /// True if the file has times.
    pub timed: bool,
    /// What was guessed, with what settles it, and the notes of the file.
    pub notes: Vec<String>,
}

impl Test {
    /// A test of strains and nominal stresses (Pa) as they are, in the mode of this name.
    ///
    /// # Errors
    /// A mode that is none of a loading test; strains and stresses of different numbers, or not finite.
    pub fn of(strains: &[f64], stresses: &[f64], mode: &str) -> Result<Self, InputError> {
        let mut reader = Reader::new("test", "");
        let wrong = |message: String| InputError::whole("test", message);
        reader.set_mode(mode).map_err(wrong)?;
        let numbers = strains.iter().chain(stresses);
        if strains.len() != stresses.len() || !numbers.clone().all(|number| number.is_finite()) {
            let message = format!(
                "{} strains and {} stresses: each strain needs a stress, and all are finite",
                strains.len(),
                stresses.len()
            );
            return Err(wrong(message));
        }
        if reader.test.held.is_some() {
            let message = format!("\"{mode}\" is no mode of a loading test");
            return Err(
                wrong(message).help("write one of: uniaxial, compression, planar, equibiaxial")
            );
        }
        let rows = strains
            .iter()
            .zip(stresses)
            .map(|(e, p)| [f64::NAN, *e, *p]);
        reader.test.rows = rows.collect();
        Ok(reader.test)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Meaning {
    Time,
    Length,
    Strain,
    Stretch,
    TrueStrain,
    Force,
    Stress,
    TrueStress,
}

use Meaning::{Force, Length, Strain, Stress, Stretch, Time, TrueStrain, TrueStress};

const NAMES: [(Meaning, &[&str]); 8] = [
    (Time, &["time"]),
    (
        Length,
        &["extension", "displacement", "crosshead", "compression"],
    ),
    (Strain, &["strain", "engineering strain"]),
    (Stretch, &["stretch"]),
    (TrueStrain, &["true strain", "log strain"]),
    (Force, &["force", "load"]),
    (Stress, &["stress", "engineering stress", "nominal stress"]),
    (TrueStress, &["true stress", "cauchy stress"]),
];

/// Standard acceleration, m/s²: a kilogram-force in N.
const KILOGRAM_FORCE: f64 = 9.80665;
/// A pound-force in N.
const POUND_FORCE: f64 = 4.4482216152605;

const STRESSES: &str = "Pa, kPa, MPa, psi, kgf/cm2";
const FORCES: &str = "N, mN, kN, kgf, lbf";

impl Meaning {
    fn of(name: &str) -> Option<Self> {
        let found = NAMES.iter().find(|(_, names)| names.contains(&name));
        found.map(|(meaning, _)| *meaning)
    }

    /// SI value of a unit; `None` if it is none of this quantity.
    fn unit(self, unit: &str) -> Option<f64> {
        match (self, unit) {
            (Time, _) => TIME.unit(unit),
            (Length, _) => LENGTH.unit(unit),
            (Strain | Stretch | TrueStrain, "1" | "-" | "mm/mm") => Some(1.0),
            (Strain | TrueStrain, "%") => Some(0.01),
            (Force, "kgf") => Some(KILOGRAM_FORCE),
            (Force, "lbf") => Some(POUND_FORCE),
            (Force, _) => FORCE.unit(unit),
            (Stress | TrueStress, "psi") => Some(POUND_FORCE / 0.0254_f64.powi(2)),
            (Stress | TrueStress, "kgf/cm2") => Some(KILOGRAM_FORCE * 1e4),
            (Stress | TrueStress, _) => taxel_ground::quantity::STRESS.unit(unit),
            _ => None,
        }
    }

    fn units(self) -> &'static str {
        match self {
            Time => "s, ms, min",
            Length => "mm, m, cm, um",
            Strain | TrueStrain => "1, %",
            Stretch => "1",
            Force => FORCES,
            Stress | TrueStress => STRESSES,
        }
    }

    /// Whether the column says how far, or how strongly.
    fn is_strain(self) -> bool {
        matches!(self, Length | Strain | Stretch | TrueStrain)
    }

    fn is_stress(self) -> bool {
        matches!(self, Force | Stress | TrueStress)
    }
}

struct Column {
    meaning: Meaning,
    at: usize,
    title: String,
    /// SI value of the unit; none if the file does not give it.
    scale: Option<f64>,
}

/// Name and unit of a title such as `Engineering Stress (MPa)`.
fn titled(title: &str) -> (String, Option<String>) {
    let title = title.trim().trim_matches('"');
    let (name, unit) = match title.find(['[', '(']) {
        Some(at) => {
            let unit = title[at + 1..].trim_end_matches([']', ')']).trim();
            (&title[..at], (!unit.is_empty()).then(|| unit.to_owned()))
        }
        None => (title, None),
    };
    let words = name.to_lowercase().replace('_', " ");
    let words: Vec<&str> = words.split_whitespace().collect();
    (words.join(" "), unit)
}

struct Reader<'t> {
    file: &'t str,
    text: &'t str,
    test: Test,
    width: Option<f64>,
    thickness: Option<f64>,
    ramp: Option<f64>,
    /// A stretch that is held is given.
    stretched: bool,
    /// A mode that the file or the user names.
    named_mode: bool,
    /// The user names it.
    overridden: bool,
}

const MODES: &str = "uniaxial, compression, planar, equibiaxial, relaxation, creep";

/// Reads the text of a test; `mode` overrides what the file says.
///
/// # Errors
/// [`InputError`], at the line and with the remedy: a unit or the geometry of the specimen is
/// missing, a strain could be a number or per cent, a value is no number.
pub fn read(file: &str, text: &str, mode: Option<&str>) -> Result<Test, InputError> {
    let mut reader = Reader::new(file, text);
    reader.overridden = mode.is_some();
    if let Some(mode) = mode {
        reader.set_mode(mode).map_err(|message| {
            let help = format!("--mode is one of: {MODES}");
            InputError::whole(file, message).help(help)
        })?;
    }
    reader.read()?;
    Ok(reader.test)
}

impl<'t> Reader<'t> {
    fn new(file: &'t str, text: &'t str) -> Self {
        Self {
            file,
            text: text.strip_prefix('\u{feff}').unwrap_or(text),
            test: Test {
                name: file.to_owned(),
                mode: Mode::Uniaxial,
                compression: false,
                length: None,
                area: None,
                diameter: None,
                preload: None,
                rows: Vec::new(),
                held: None,
                timed: false,
                notes: Vec::new(),
            },
            width: None,
            thickness: None,
            ramp: None,
            stretched: false,
            named_mode: false,
            overridden: false,
        }
    }
}

impl Reader<'_> {
    fn note(&mut self, text: String) {
        self.test.notes.push(text);
    }

    fn wrong(&self, line: usize, part: &str, message: impl Into<String>) -> InputError {
        let text = self.text.lines().nth(line).unwrap_or_default();
        let byte = text.find(part).unwrap_or(0);
        let column = text[..byte].chars().count() + 1;
        InputError::on_line(
            self.file,
            line + 1,
            text,
            column,
            part.chars().count(),
            message,
        )
    }

    fn set_mode(&mut self, name: &str) -> Result<(), String> {
        self.test.compression = name == "compression";
        self.test.held = matches!(name, "relaxation" | "creep").then(|| Held {
            points: Vec::new(),
            ramp: None,
            creeps: name == "creep",
        });
        self.test.mode = match name {
            "uniaxial" | "compression" | "relaxation" | "creep" => Mode::Uniaxial,
            "planar" => Mode::Planar,
            "equibiaxial" => Mode::Equibiaxial,
            _ => return Err(format!("\"{name}\" is no mode of a loading test")),
        };
        self.named_mode = true;
        Ok(())
    }

    /// A line `# key = "value"`.
    fn key(&mut self, line: usize, key: &str, value: &str) -> Result<(), InputError> {
        let quantity = |dimension: &Dimension| {
            dimension
                .parse(value)
                .ok()
                .filter(|value| *value > 0.0)
                .ok_or_else(|| {
                    let help = format!("write {} such as \"3 {}\"", dimension.name, dimension.si);
                    let message = format!("\"{value}\" is not {} above zero", dimension.name);
                    self.wrong(line, value, message).key(key).help(help)
                })
        };
        match key {
            "gauge_length" | "height" => self.test.length = Some(quantity(&LENGTH)?),
            "width" => self.width = Some(quantity(&LENGTH)?),
            "thickness" => self.thickness = Some(quantity(&LENGTH)?),
            "diameter" => self.test.diameter = Some(quantity(&LENGTH)?),
            "stretch" => {
                self.stretched = true;
                self.note(format!("{key}: {value}"));
            }
            "ramp" => self.ramp = Some(quantity(&TIME)?),
            "preload" => self.test.preload = Some(quantity(&FORCE)?),
            "mode" if self.overridden => {}
            "mode" => self.set_mode(value).map_err(|message| {
                let help = format!("write one of: {MODES}");
                self.wrong(line, value, message).key(key).help(help)
            })?,
            _ => self.note(format!("{key}: {value}")),
        }
        Ok(())
    }

    /// Geometry in the words of a machine: `Specimen Width (mm);6`.
    fn geometry(&mut self, cells: &[&str]) {
        let [title, value, ..] = cells else {
            return;
        };
        let (name, unit) = titled(title);
        let Some(value) = unit
            .and_then(|unit| LENGTH.unit(&unit))
            .zip(value.trim().replace(',', ".").parse::<f64>().ok())
            .map(|(scale, value)| scale * value)
            .filter(|value| *value > 0.0 && value.is_finite())
        else {
            return;
        };
        let slot = match name.trim_start_matches("specimen ") {
            "length" | "gauge length" | "height" => &mut self.test.length,
            "width" => &mut self.width,
            "thickness" => &mut self.thickness,
            "diameter" => &mut self.test.diameter,
            _ => return,
        };
        *slot = Some(value);
        self.note(format!(
            "{name}: {:.6} mm, read above the table",
            value * 1e3
        ));
    }

    fn columns(&mut self, line: usize, cells: &[&str]) -> Result<Option<Vec<Column>>, InputError> {
        let mut found = Vec::new();
        for (at, cell) in cells.iter().enumerate() {
            let (name, unit) = titled(cell);
            let Some(meaning) = Meaning::of(&name) else {
                continue;
            };
            found.push((meaning, at, (*cell).to_owned(), unit));
        }
        let has = |what: fn(Meaning) -> bool| found.iter().any(|(meaning, ..)| what(*meaning));
        let timed = has(|meaning| meaning == Time);
        let whole = match &self.test.held {
            None => has(Meaning::is_strain) && has(Meaning::is_stress),
            Some(held) if held.creeps => timed && has(Meaning::is_strain),
            Some(_) => timed && has(Meaning::is_stress),
        };
        if !whole {
            // A stretch, or the ramp to it, above times and stresses alone is one that is held.
            let held = self.ramp.is_some() || self.stretched;
            if self.test.held.is_none() && held && timed && has(Meaning::is_stress) {
                self.test.held = Some(Held {
                    points: Vec::new(),
                    ramp: None,
                    creeps: false,
                });
                self.note(
                    "mode: relaxation, because there are times and stresses; settled by --mode"
                        .into(),
                );
                self.named_mode = true;
                return self.columns(line, cells);
            }
            return Ok(None);
        }
        let columns = found.into_iter().map(|(meaning, at, title, unit)| {
            let scale = match &unit {
                Some(unit) => Some(meaning.unit(unit).ok_or_else(|| {
                    let message = format!("\"{unit}\" is no unit of \"{}\"", title.trim());
                    let help = format!("use one of: {}", meaning.units());
                    self.wrong(line, unit, message).help(help)
                })?),
                None if matches!(meaning, Strain | Stretch | TrueStrain) => None,
                None => {
                    let name = title.trim();
                    let first = meaning.units().split(", ").next().unwrap_or_default();
                    let message = format!("the unit of \"{name}\" is missing");
                    let help = format!("write `{name} [{first}]`; units: {}", meaning.units());
                    return Err(self.wrong(line, name, message).help(help));
                }
            };
            Ok(Column {
                meaning,
                at,
                title,
                scale,
            })
        });
        columns.collect::<Result<_, _>>().map(Some)
    }

    fn read(&mut self) -> Result<(), InputError> {
        // A file of a machine may have lines of another form above its table: the separator
        // is that of the most frequent kind.
        let text = self.text;
        let separator = match separator_of(text) {
            b',' if text.matches(';').count() > text.matches(',').count() => ';',
            other => char::from(other),
        };
        let mut lines = text.lines().enumerate();
        let (header, columns) = loop {
            let Some((line, raw)) = lines.next() else {
                let help = "the header names a strain (strain, stretch, extension [mm]) and a stress \
                            (stress [kPa], force [N])";
                let message = "no line has a column of strain and one of stress";
                return Err(InputError::whole(self.file, message).help(help));
            };
            let raw = raw.trim();
            if let Some(comment) = raw.strip_prefix('#') {
                if let Some((key, value)) = comment.split_once('=') {
                    let value = value.trim().trim_matches('"').to_owned();
                    self.key(line, key.trim(), &value)?;
                }
                continue;
            }
            let cells: Vec<&str> = raw.split(separator).collect();
            if let Some(columns) = self.columns(line, &cells)? {
                break (line, columns);
            }
            self.geometry(&cells);
        };
        if !self.named_mode {
            self.note("mode: uniaxial, because nothing says otherwise; settled by --mode".into());
        }
        self.test.area = match (self.width, self.thickness, self.test.diameter) {
            (Some(width), Some(thickness), _) => Some(width * thickness),
            (_, _, Some(diameter)) => Some(std::f64::consts::PI / 4.0 * diameter * diameter),
            _ => None,
        };
        let mut table = Vec::new();
        let mut commas = false;
        for (line, raw) in lines {
            if raw.trim().is_empty() || raw.starts_with('#') {
                continue;
            }
            let cells: Vec<&str> = raw.split(separator).collect();
            let values = columns.iter().map(|column| {
                let cell = cells.get(column.at).copied().unwrap_or_default().trim();
                let decimal = separator != ',' && cell.contains(',');
                commas |= decimal;
                let plain = if decimal {
                    cell.replace(',', ".")
                } else {
                    cell.to_owned()
                };
                let number = plain
                    .parse::<f64>()
                    .ok()
                    .filter(|number| number.is_finite());
                number.ok_or_else(|| {
                    let message = format!(
                        "\"{cell}\" in \"{}\" is no finite number",
                        column.title.trim()
                    );
                    self.wrong(line, cell, message)
                        .help("correct the value, or take the row out")
                })
            });
            table.push((line, values.collect::<Result<Vec<f64>, _>>()?));
        }
        if separator != ',' {
            let name = if separator == ';' { "semicolon" } else { "tab" };
            self.note(format!("separator: {name}"));
        }
        if commas {
            self.note("decimal sign: comma".into());
        }
        self.rows(header, columns, &table)
    }

    /// The units of strains that the header does not give, by the values.
    fn guess_scales(
        &mut self,
        header: usize,
        columns: &mut [Column],
        table: &[(usize, Vec<f64>)],
    ) -> Result<(), InputError> {
        // A true strain beside an engineering one says whether that is a number or per cent.
        let truth = columns
            .iter()
            .position(|column| column.meaning == TrueStrain);
        for (at, column) in columns.iter_mut().enumerate() {
            if column.scale.is_some() {
                continue;
            }
            if let Some(truth) = truth.filter(|_| column.meaning == Strain)
                && let Some((_, last)) = table.iter().max_by(|a, b| a.1[at].total_cmp(&b.1[at]))
            {
                let agrees =
                    |scale: f64| (last[at] * scale / last[truth].exp_m1() - 1.0).abs() < 0.01;
                column.scale = [1.0, 0.01].into_iter().find(|scale| agrees(*scale));
                if column.scale.is_some() {
                    continue;
                }
            }
            let largest = table
                .iter()
                .fold(0.0_f64, |most, (_, row)| most.max(row[at].abs()));
            let name = column.title.trim().to_owned();
            // A strain of 3 (300 %) is common and one of 20 is none of a silicone; what lies
            // between could be either.
            if column.meaning == Stretch || largest < 3.0 {
                column.scale = Some(1.0);
                self.note(format!("{name}: a plain number; settled by `{name} [1]`"));
            } else if largest > 20.0 {
                column.scale = Some(0.01);
                self.note(format!(
                    "{name}: per cent, since it reaches {largest}; settled by `{name} [%]`"
                ));
            } else {
                let message = format!("\"{name}\" reaches {largest}: a number or per cent?");
                let help = format!("write `{name} [1]` or `{name} [%]`");
                return Err(self.wrong(header, &name, message).help(help));
            }
        }
        Ok(())
    }

    fn rows(
        &mut self,
        header: usize,
        mut columns: Vec<Column>,
        table: &[(usize, Vec<f64>)],
    ) -> Result<(), InputError> {
        self.guess_scales(header, &mut columns, table)?;
        let of = |wanted: Meaning| columns.iter().position(|column| column.meaning == wanted);
        let value = |row: &[f64], at: usize| row[at] * columns[at].scale.unwrap_or(1.0);
        let (time, length, strain, stretch) = (of(Time), of(Length), of(Strain), of(Stretch));
        let (force, stress) = (of(Force), of(Stress));
        if let Some(mut held) = self.test.held.take() {
            // The length and the cross-section are only factors: a series is of shares.
            let measured = if held.creeps {
                strain.or(stretch).or(length)
            } else {
                stress.or(force).or(of(TrueStress))
            };
            let area = match (stress.or(of(TrueStress)), self.test.area) {
                (None, Some(area)) => area,
                _ => 1.0,
            };
            if let Some((time, measured)) = time.zip(measured) {
                let less = f64::from(u8::from(held.creeps && Some(measured) == stretch));
                held.points = table
                    .iter()
                    .map(|(_, row)| [value(row, time), (value(row, measured) - less) / area])
                    .collect();
            }
            held.ramp = self.ramp;
            self.test.held = Some(held);
            self.test.timed = true;
            return Ok(());
        }
        let truly = of(TrueStrain).zip(of(TrueStress));
        let missing = |what: &str, keys: &str| {
            let message = format!("{what} of the specimen is missing");
            let help = format!("write {keys} above the header");
            InputError::whole(self.file, message).help(help)
        };
        let direct = strain.or(stretch).or(length).zip(stress.or(force));
        if direct.is_none() && truly.is_none() {
            let message = "a true strain needs a true stress, and an engineering strain an engineering stress or a force";
            return Err(
                InputError::whole(self.file, message).help("name the columns that belong together")
            );
        }
        let gauge = match (strain.or(stretch), length, self.test.length) {
            (None, Some(_), None) if direct.is_some() => {
                let keys =
                    "`# gauge_length = \"33 mm\"` or, for compression, `# height = \"10 mm\"`";
                return Err(missing("the gauge length", keys));
            }
            (_, _, length) => length.unwrap_or(f64::NAN),
        };
        let area = match (stress, force, self.test.area) {
            (None, Some(_), None) if direct.is_some() => {
                let keys = "`# width = \"6 mm\"` and `# thickness = \"3 mm\"`, or `# diameter = \"20 mm\"`,";
                return Err(missing("the cross-section", keys));
            }
            (_, _, area) => area.unwrap_or(f64::NAN),
        };
        let mut rows = Vec::new();
        let mut disagree = Vec::new();
        for (line, row) in table {
            let engineering = direct.is_some().then(|| {
                let e = match (strain, stretch, length) {
                    (Some(at), ..) => value(row, at),
                    (_, Some(at), _) => value(row, at) - 1.0,
                    (_, _, Some(at)) => value(row, at) / gauge,
                    _ => f64::NAN,
                };
                let p = match (stress, force) {
                    (Some(at), _) => value(row, at),
                    (_, Some(at)) => value(row, at) / area,
                    _ => f64::NAN,
                };
                (e, p)
            });
            let from_true = truly.map(|(strain, stress)| {
                let e = value(row, strain).exp_m1();
                (e, value(row, stress) / (1.0 + e))
            });
            if let Some(((_, p), (_, from_true))) = engineering.zip(from_true)
                && (p - from_true).abs() > 0.01 * p.abs() + 100.0
            {
                disagree.push((line + 1).to_string());
            }
            let (e, p) = engineering.or(from_true).unwrap_or((f64::NAN, f64::NAN));
            rows.push([time.map_or(f64::NAN, |at| value(row, at)), e, p]);
        }
        if direct.is_none() {
            self.note("true strain and true stress were turned into engineering ones".into());
        }
        if !disagree.is_empty() {
            let lines = disagree.join(", ");
            self.note(format!(
                "true and engineering columns disagree on line {lines}; the engineering ones are used"
            ));
        }
        self.test.timed = time.is_some();
        self.test.rows = rows;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mistakes_are_marked_with_their_remedy() {
        for (text, mark, remedy) in [
            (
                "strain [1],stress\n0.1,2\n",
                "stress",
                "write `stress [Pa]`",
            ),
            (
                "strain,stress [kPa]\n5,2\n",
                "strain",
                "write `strain [1]` or `strain [%]`",
            ),
            ("strain [1],force [lb]\n0.1,2\n", "lb", "use one of: N, mN"),
            ("strain [1],stress [kPa]\n0.1,x\n", "x", "take the row out"),
            (
                "# width = \"6\"\nstrain [1],stress [kPa]\n",
                "6",
                "such as \"3 m\"",
            ),
            (
                "# mode = \"bulge\"\nstrain [1],stress [kPa]\n",
                "bulge",
                "equibiaxial",
            ),
        ] {
            let error = read("pull.csv", text, None).expect_err(text);
            let place = error.place.as_ref().expect("a place");
            let marked: String = place
                .text
                .chars()
                .skip(place.column - 1)
                .take(place.width)
                .collect();
            assert_eq!(marked, mark, "{text}");
            assert!(error.help.contains(remedy), "{}", error.help);
        }
        for (text, remedy) in [
            ("extension [mm],stress [kPa]\n1,2\n", "gauge_length"),
            ("strain [1],force [N]\n1,2\n", "# width"),
            ("strain [1],true stress [kPa]\n1,2\n", "belong together"),
            ("a,b\n1,2\n", "names a strain"),
        ] {
            let error = read("pull.csv", text, None).expect_err(text);
            assert!(error.help.contains(remedy), "{}", error.help);
        }
    }

    #[test]
    fn every_way_to_write_a_point_gives_it() {
        let (e, p) = (0.25_f64, 80e3);
        let force = p * 6e-3 * 3e-3;
        let head = "# gauge_length = \"33 mm\"\n# width = \"6 mm\"\n# thickness = \"3 mm\"\n";
        for text in [
            format!("strain [1],stress [kPa]\n{e},80\n"),
            format!(
                "Engineering_Strain (%);Engineering Stress (MPa)\n{};0,08\n",
                25
            ),
            format!("stretch,stress [Pa]\n{},{p}\n", 1.0 + e),
            format!(
                "true strain [1],true stress [kPa]\n{},{}\n",
                e.ln_1p(),
                80.0 * (1.0 + e)
            ),
            format!("{head}extension [mm],force [N]\n{},{force}\n", 33.0 * e),
            format!(
                "Specimen Length (mm);33;\n\ndisplacement (mm)\tstress [kPa]\n{}\t80\n",
                33.0 * e
            )
            .replace('\t', ";"),
            format!("strain [1],stress [psi]\n{e},{}\n", p / 6894.757293168361),
        ] {
            let test = read("pull.csv", &text, None).expect(&text);
            let [_, strain, stress] = test.rows[0];
            // Rounding of some products.
            assert!(
                (strain - e).abs() < 1e-14 && (stress / p - 1.0).abs() < 1e-14,
                "{text}"
            );
        }
    }
}
