//! What the commands of studies share: reading a study, its sensor, its store, its outputs.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value};
use taxel::shown;
use taxel::table;
use taxel_files::study::block;
pub(crate) use taxel_files::study::{StudyText, read, text};
use taxel_files::{COMMIT, VERSION};
use taxel_study::run::Runner;
use taxel_study::store::{Store, StoreError};
use taxel_study::study::{Row, Study};
use taxel_study::sweep;

use crate::arguments::Format;
use crate::outputs::{self, Existing};
use crate::{Stop, files};

/// The study in a file with its text, once it is known that the targets of its results, the
/// picture `plot` among them, can be written.
pub(crate) fn open(
    path: &PathBuf,
    targets: &[(&str, Option<&PathBuf>)],
    plot: Option<&PathBuf>,
    existing: Existing,
) -> Result<(Study, StudyText), Stop> {
    outputs::check(targets, &[path], existing)?;
    if let Some(plot) = plot {
        files::is_page(plot)?;
    }
    let text = text(path)?;
    let (study, sensor) = read(&text)?;
    outputs::check(targets, &[path, &sensor], existing)?;
    Ok((study, text))
}

/// The store in a folder: of designs that take long one in each block.
pub(crate) fn store(
    folder: &Path,
    study: &Study,
    text: &str,
    designs: usize,
) -> Result<Store, Stop> {
    let store = Store::open(folder, block(study, text, designs), text).map_err(refused)?;
    if store.rebuilt {
        note!(
            "note: --store {}: its manifest was lost or cut; it is written anew, and {} designs are kept",
            shown::path(store.folder()),
            store.len()
        );
    }
    if store.damaged > 0 {
        note!(
            "note: {} damaged blocks in {}: their designs are computed again",
            store.damaged,
            shown::path(folder)
        );
    }
    Ok(store)
}

/// The end of a command whose store cannot be used.
pub(crate) fn refused(error: StoreError) -> Stop {
    match error {
        StoreError::Other(message) => Stop::WrongInput(message),
        error @ StoreError::Io(..) => Stop::Failed(error.to_string()),
    }
}

/// Runs `work` with a runner that listens to signals and tells its progress.
pub(crate) fn running<T>(
    study: &Study,
    what: &str,
    expected: usize,
    store: Option<Store>,
    work: impl FnOnce(&mut Runner<'_>) -> Result<T, StoreError>,
) -> Result<T, Stop> {
    let interrupt = crate::interrupt::Interrupt::listen();
    let progress = taxel_files::Progress::new(what);
    let tell = |count: usize| progress.at((count as f64 / expected.max(1) as f64).min(1.0));
    let stop = || interrupt.asked();
    let mut runner = Runner {
        store,
        stop: &stop,
        progress: &tell,
        ..Runner::new(study)
    };
    work(&mut runner).map_err(refused)
}

/// What heads a JSON document of a study.
pub(crate) fn about(study: &Study, seed: u64) -> Map<String, Value> {
    let mut about = Map::new();
    for (key, value) in [
        ("study", study.name.as_str()),
        ("study_hash", study.hash.as_str()),
        ("sensor", study.sensor.as_str()),
        ("sensor_hash", study.sensor_hash.as_str()),
        ("version", VERSION),
        ("commit", COMMIT),
    ] {
        about.insert(key.to_owned(), Value::from(value));
    }
    about.insert("seed".to_owned(), Value::from(seed));
    about
}

/// The table of designs.
pub(crate) fn table_of(study: &Study, format: Format, seed: u64, rows: &[Row]) -> String {
    let (columns, cells) = sweep::all(study, rows);
    table::render(format.into(), &about(study, seed), &columns, &cells)
}

/// The table of a sweep.
pub(crate) fn sweep_of(study: &Study, format: Format, seed: u64, rows: &[Row]) -> String {
    let (columns, cells) = sweep::table(study, rows);
    table::render(format.into(), &about(study, seed), &columns, &cells)
}

/// Writes a figure, on a page with its table where the name ends in .html.
pub(crate) fn plot(
    path: Option<&PathBuf>,
    existing: Existing,
    title: &str,
    svg: impl FnOnce() -> String,
    table: impl FnOnce() -> String,
) -> Result<(), Stop> {
    let Some(path) = path else { return Ok(()) };
    let text = if files::is_page(path)? {
        taxel_study::figures::page(title, &svg(), &table())
    } else {
        svg()
    };
    outputs::write(Some(path), existing, &text).map(drop)
}

/// Tells that designs are not answered in one way, where they are not.
pub(crate) fn tell_ways(study: &Study, rows: &[Row]) {
    let ways = sweep::ways(study, rows);
    if ways.len() < 2 {
        return;
    }
    for (count, way) in ways {
        note!(
            "note: {count} of {} designs are answered by: {way}",
            rows.len()
        );
    }
    note!(
        "note: they are not points of one curve: where it changes, so may an answer without a reason in the drawing"
    );
}

/// Tells why designs failed, the commonest reason first.
pub(crate) fn tell_reasons(rows: &[Row]) {
    for (count, reason) in sweep::reasons(rows).into_iter().take(5) {
        note!("note: {count} of {} designs: {reason}", rows.len());
    }
}
