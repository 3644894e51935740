//! From the rows of a file to the points of one loading: the steps in their order, each with
//! the number of points that it takes away.

use taxel_ground::InputError;
use taxel_ground::quantity::STRESS;

use crate::file::Test;
use crate::law::Mode;
use crate::material::Tested;

/// Which loading of a cyclic test counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Cycle {
    /// The last one (default): a sensor lives on cycled rubber.
    #[default]
    Last,
    /// A loading by its number, from one.
    Number(usize),
}

/// What is asked of the steps.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Steps {
    /// Compliance of the machine, m/N.
    pub compliance: f64,
    /// Force that the machine shows without load, N.
    pub force_offset: f64,
    /// Which loading counts.
    pub cycle: Cycle,
    /// Strains that count; all by default.
    pub strain_range: Option<[f64; 2]>,
}

/// A test as it is fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct Specimen {
    /// Name of the file.
    pub name: String,
    /// Loading.
    pub mode: Mode,
    /// True where the specimen is pressed.
    pub compression: bool,
    /// Strain and nominal stress (Pa), in order of strain; negative in compression.
    pub points: Vec<[f64; 2]>,
    /// Nominal stress of the preload, Pa: the strains begin there.
    pub preload: Option<f64>,
    /// Stiffening of a disc whose faces are bonded, `1 + 2 S^2`; one where it is no disc.
    pub bonded: f64,
}

impl Specimen {
    /// The loading, as law files have it.
    pub fn tested(&self) -> Tested {
        match self.mode {
            Mode::Uniaxial if self.compression => Tested::Compression,
            Mode::Uniaxial => Tested::Uniaxial,
            Mode::Equibiaxial => Tested::Equibiaxial,
            Mode::Planar => Tested::Planar,
        }
    }
}

/// Part of the range of strain that a turning point must come back.
const HYSTERESIS: f64 = 0.05;
/// Fall of the force after which a specimen counts as broken.
const BREAK: f64 = 0.2;
/// Fewest points that a law is fitted to.
pub const FEWEST: usize = 8;
/// Least range of strain.
const NARROWEST: f64 = 0.05;

/// The points of each test, and one line for each step that changed something.
///
/// # Errors
/// [`InputError`] where the geometry for a step is missing, where too little is left, and where
/// the stress falls while the strain grows.
pub fn prepare(tests: &[Test], steps: &Steps) -> Result<(Vec<Specimen>, Vec<String>), InputError> {
    let mut notes = Vec::new();
    let specimens = tests.iter().map(|test| {
        let mut say = |text: String| notes.push(format!("{}: {text}", test.name));
        specimen(test, steps, &mut say)
    });
    let specimens = specimens.collect::<Result<_, _>>()?;
    Ok((specimens, notes))
}

fn counted(count: usize) -> String {
    let s = if count == 1 { "" } else { "s" };
    format!("{count} point{s}")
}

fn specimen(
    test: &Test,
    steps: &Steps,
    say: &mut dyn FnMut(String),
) -> Result<Specimen, InputError> {
    let wrong = |message: String, help: &str| InputError::whole(&test.name, message).help(help);
    for note in &test.notes {
        say(note.clone());
    }
    let mut rows = test.rows.clone();
    ordered(&mut rows, test.timed, say);
    let area = test.area.ok_or_else(|| {
        let message = "the cross-section of the specimen is missing".to_owned();
        wrong(
            message,
            "write `# width = \"6 mm\"` and `# thickness = \"3 mm\"` above the header",
        )
    });
    if steps.compliance != 0.0 {
        let length = test.length.ok_or_else(|| {
            let message = "the gauge length of the specimen is missing".to_owned();
            wrong(
                message,
                "write `# gauge_length = \"33 mm\"` above the header",
            )
        })?;
        let area = area.clone()?;
        for row in &mut rows {
            row[1] -= steps.compliance * row[2] * area / length;
        }
        say("the compliance of the machine was taken out".into());
    }
    if steps.force_offset != 0.0 {
        let offset = steps.force_offset / area.clone()?;
        for row in &mut rows {
            row[2] -= offset;
        }
        say(format!(
            "{:.4} kPa were taken from each stress (--force-offset)",
            offset / 1e3
        ));
    }
    let mut points = one_loading(test, &rows, steps, say)?;
    if let Some([low, high]) = steps.strain_range {
        let before = points.len();
        points.retain(|[e, _]| (low..=high).contains(e));
        if points.len() < before {
            let removed = counted(before - points.len());
            say(format!("strain {low} to {high}: {removed} left out"));
        }
    }
    enough(test, &points)?;
    let bonded = match (test.compression, test.diameter, test.length) {
        (true, Some(diameter), Some(height)) => {
            let factor = 1.0 + 2.0 * (diameter / (4.0 * height)).powi(2);
            say(format!(
                "friction: a disc whose faces are bonded would be {factor:.3} times as stiff"
            ));
            if factor > 1.2 {
                say("lubricate the faces or take taller specimens".into());
            }
            factor
        }
        _ => 1.0,
    };
    // Stable: equal strains keep the order of the file.
    points.sort_by(|one, other| one[0].total_cmp(&other[0]));
    if test.compression {
        points = points.into_iter().map(|[e, p]| [-e, -p]).collect();
    }
    let preload = test.preload.map(|force| Ok(force / area?)).transpose()?;
    Ok(Specimen {
        name: test.name.clone(),
        mode: test.mode,
        compression: test.compression,
        points,
        preload,
        bonded,
    })
}

/// The points of one loading, without what came before it and after its break; in compression
/// both numbers are counted as positive.
fn one_loading(
    test: &Test,
    rows: &[[f64; 3]],
    steps: &Steps,
    say: &mut dyn FnMut(String),
) -> Result<Vec<[f64; 2]>, InputError> {
    let wrong = |message: String, help: &str| InputError::whole(&test.name, message).help(help);
    let mut points: Vec<[f64; 2]> = rows.iter().map(|[_, e, p]| [*e, *p]).collect();
    possible(test, &points)?;
    if test.compression {
        let turned = points.iter().filter(|[e, _]| *e > 0.0).count();
        for point in &mut points {
            *point = point.map(f64::abs);
        }
        if turned > 0 {
            say("compression: positive numbers are taken as pressing, their sign is turned".into());
        }
    } else if points.iter().map(|[_, p]| *p).sum::<f64>() < 0.0 {
        let message = "the stress of a pull is negative".to_owned();
        return Err(wrong(message, "turn the sign, or say --mode compression"));
    }
    let mut loadings = loadings(&points);
    if let Some(last) = loadings.last_mut() {
        let removed = cut_break(last);
        if removed > 0 {
            say(format!(
                "break: {} after the greatest force left out",
                counted(removed)
            ));
        }
    }
    if loadings.len() > 1 {
        let last = loadings.len();
        say(format!(
            "{last} loadings; settled by --cycle first, last or a number"
        ));
    }
    let number = match steps.cycle {
        Cycle::Last => loadings.len(),
        Cycle::Number(number) => number,
    };
    let Some(mut points) = number
        .checked_sub(1)
        .and_then(|at| loadings.get(at).cloned())
    else {
        let message = format!(
            "loading {number} was asked for; there are {}",
            loadings.len()
        );
        return Err(wrong(message, "--cycle is first, last or a number from 1"));
    };
    // The foot takes away what falls, so this is asked before it.
    let (slow, fast) = points.split_at(points.len() / 2);
    let mean = |part: &[[f64; 2]]| part.iter().map(|[_, p]| p).sum::<f64>() / part.len() as f64;
    if mean(fast) < mean(slow) {
        let message = "the stress falls while the strain grows, without a break".to_owned();
        return Err(wrong(
            message,
            "this is not a loading branch: choose one by --cycle",
        ));
    }
    if let Some([_, p]) = points.iter().find(|[e, p]| *e == 0.0 && *p > 0.0)
        && test.preload.is_none()
    {
        say(format!(
            "the stress at zero strain is {:.2} kPa: noise, or an offset (--force-offset), or a preload",
            p / 1e3
        ));
    }
    let foot = foot(&points);
    if foot > 0 {
        points.drain(..foot);
        say(format!("foot: {} left out at the start", counted(foot)));
    }
    Ok(points)
}

/// Refuses what no specimen can have.
fn possible(test: &Test, points: &[[f64; 2]]) -> Result<(), InputError> {
    let wrong =
        |message: String, help: &str| Err(InputError::whole(&test.name, message).help(help));
    if points.is_empty() {
        return wrong(
            "the table has no rows".into(),
            "give the file as the machine wrote it",
        );
    }
    let [_, largest] = STRESS.sizes;
    for [e, p] in points {
        let l = if test.compression {
            1.0 - e.abs()
        } else {
            1.0 + e
        };
        if l <= 0.0 {
            let message = format!("a strain of {e} is a stretch of {l}, which must be above 0");
            return wrong(
                message,
                "write `strain [%]` for per cent; a stretch counts from 1",
            );
        }
        if p.abs() > largest {
            let message = format!("a stress of {p:e} Pa is none of rubber");
            return wrong(message, "look at the unit, and at the cross-section");
        }
    }
    Ok(())
}

/// Refuses what is too little for a law.
fn enough(test: &Test, points: &[[f64; 2]]) -> Result<(), InputError> {
    let range = points.last().map_or(0.0, |l| l[0]) - points.first().map_or(0.0, |p| p[0]);
    if points.len() < FEWEST || range < NARROWEST {
        let message = format!(
            "{} over a strain of {range:.3} are left; a law needs {FEWEST} over {NARROWEST}",
            counted(points.len())
        );
        let help = "give a longer test, or a wider --strain-range";
        return Err(InputError::whole(&test.name, message).help(help));
    }
    Ok(())
}

/// Equal rows once; time that steps back is said and ignored.
fn ordered(rows: &mut Vec<[f64; 3]>, timed: bool, say: &mut dyn FnMut(String)) {
    let before = rows.len();
    rows.dedup_by(|one, other| one[1..] == other[1..]);
    if rows.len() < before {
        say(format!(
            "repeated rows: {} left out",
            counted(before - rows.len())
        ));
    }
    let back = rows
        .windows(2)
        .filter(|pair| pair[1][0] < pair[0][0])
        .count();
    if timed && back > 0 {
        say(format!("time steps back at {back} row(s): ignored"));
    }
}

/// Loading branches: from each turning point below to the next one above.
fn loadings(points: &[[f64; 2]]) -> Vec<Vec<[f64; 2]>> {
    let strains = points.iter().map(|[e, _]| *e);
    let (low, high) = strains.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), e| {
        (low.min(e), high.max(e))
    });
    let come_back = HYSTERESIS * (high - low);
    let mut found = Vec::new();
    let (mut rising, mut start, mut extreme) = (true, 0, 0);
    for (at, [e, _]) in points.iter().enumerate() {
        let best = points[extreme][0];
        if (rising && *e >= best) || (!rising && *e <= best) {
            extreme = at;
        } else if (e - best).abs() > come_back {
            if rising {
                found.push(points[start..=extreme].to_vec());
            }
            (rising, start, extreme) = (!rising, extreme, at);
        }
    }
    if rising && start < points.len() {
        // Behind the last maximum there is only what the strain swings by.
        found.push(points[start..].to_vec());
    }
    found
}

fn cut_break(points: &mut Vec<[f64; 2]>) -> usize {
    let Some((peak, most)) = points
        .iter()
        .map(|[_, p]| *p)
        .enumerate()
        .max_by(|one, other| one.1.total_cmp(&other.1))
    else {
        return 0;
    };
    let fell = points[peak..]
        .iter()
        .any(|[_, p]| *p < (1.0 - BREAK) * most);
    let removed = points.len() - 1 - peak;
    if !fell {
        return 0;
    }
    points.truncate(peak + 1);
    removed
}

/// Leading points of no positive stress, or of a stress above the next one.
fn foot(points: &[[f64; 2]]) -> usize {
    let kept = (0..points.len()).find(|at| {
        points[*at][1] > 0.0
            && points
                .get(at + 1)
                .is_none_or(|next| points[*at][1] <= next[1])
    });
    kept.unwrap_or(points.len())
}
