//! `taxel listen`: from the bytes of a board that nobody described to its board file.

use std::fmt::Write as _;
use std::io::{IsTerminal as _, Read as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use clap::Parser as _;
use taxel::shown;
use taxel_board::{Draft, LEAST_PACKETS};
use taxel_files::Progress;
use taxel_serve::link::{Heard, LinkAddress, SerialSettings};

use crate::arguments::{Arguments, Command, Listen};
use crate::outputs::{self, Existing};
use crate::{Done, Stop};

/// Bytes of a file that are looked at.
const MOST: u64 = 4 << 20;

pub(crate) fn run(arguments: &Listen) -> Result<Done, Stop> {
    let Listen { source, output, .. } = arguments;
    let existing = arguments.overwrite.existing();
    outputs::check(
        &[("--output", output.as_ref())],
        &[&PathBuf::from(source)],
        existing,
    )?;
    let is_link = LinkAddress::is_one(source);
    let file = output.as_deref().filter(|file| !outputs::is_standard(file));
    let asked = arguments.live || arguments.port.is_some();
    if asked && file.is_none() {
        let message = "the page reads the board file: name one with -o board.toml";
        return Err(Stop::WrongInput(message.into()));
    }
    let page = asked || is_link && !arguments.no_page && std::io::stdout().is_terminal();
    let (bytes, rate) = if is_link {
        heard(arguments)?
    } else {
        (captured(Path::new(source))?, None)
    };
    let drafting = Progress::new("looking for what the bytes are");
    let draft = taxel_board::listen(&bytes, rate);
    drop(drafting);
    let draft = draft.map_err(|tried| {
        let mut message = format!(
            "{source}: {} bytes, and no board file that reads them; a claim needs {LEAST_PACKETS} packets that agree",
            bytes.len()
        );
        for why in tried {
            let _ = write!(message, "\n- {why}");
        }
        message.push_str("\nhelp: listen longer (--seconds 20), compare the speed of the port (--baud), or write the board file by hand: docs/book/board-file.md");
        Stop::WrongInput(message)
    })?;
    let report = report(&draft, bytes.len());
    let played = if is_link {
        source.clone()
    } else {
        format!("replay:{source}")
    };
    let Some(file) = file else {
        note!("{}", report.trim_end());
        outputs::write(None, existing, &draft.file)?;
        if !page {
            return Ok(Done::Complete);
        }
        // The page reads a file, and none was asked for.
        let name = format!("taxel-listen-{}.toml", std::process::id());
        let file = std::env::temp_dir().join(name);
        outputs::write(Some(&file), Existing::Refused, &draft.file)?;
        let done = show(arguments, &file, &played);
        let _ = std::fs::remove_file(&file);
        return done;
    };
    outputs::write(Some(file), existing, &draft.file)?;
    let (name, line) = (shown::path(file), live_words(file, &played).join(" "));
    outputs::print(&format!(
        "{report}{name} says so; the channels live: {line}\n"
    ))?;
    if page {
        return show(arguments, file, &played);
    }
    Ok(Done::Complete)
}

/// The command that shows the channels of a board on the page.
fn live_words(board: &Path, played: &str) -> [String; 7] {
    let board = shown::path(board);
    let words = [
        "taxel", "live", "--raw", "--board", &board, "--source", played,
    ];
    words.map(str::to_owned)
}

/// Runs that command.
fn show(arguments: &Listen, board: &Path, played: &str) -> Result<Done, Stop> {
    let words = live_words(board, played);
    let line = words.join(" ");
    let port = arguments.port.map(|port| format!("--port={port}"));
    match Arguments::try_parse_from(words.into_iter().chain(port)).map(|found| found.command) {
        Ok(Command::Live(live)) => super::live::run(&live),
        _ => Err(Stop::Failed(format!("{line}: cannot be run"))),
    }
}

/// What was found, one line each.
fn report(draft: &Draft, bytes: usize) -> String {
    let mut report = format!(
        "{bytes} bytes: {} frames, {:.1} % of the bytes\n",
        draft.frames,
        100.0 * draft.taken
    );
    for line in &draft.evidence {
        let _ = writeln!(report, "- {line}");
    }
    report
}

/// What comes over a link in the time asked for, and its bytes a second.
fn heard(arguments: &Listen) -> Result<(Vec<u8>, Option<f64>), Stop> {
    let wrong = |error: taxel_serve::link::LinkError| Stop::WrongInput(error.to_string());
    let address = LinkAddress::parse(&arguments.source).map_err(wrong)?;
    let serial = SerialSettings {
        baud: arguments.baud,
        ..SerialSettings::default()
    };
    note!(
        "{}: listening for {} s",
        arguments.source,
        arguments.seconds
    );
    let tell: Arc<dyn Fn(&str) + Send + Sync> = Arc::new(|line| note!("{line}"));
    let mut bytes = Vec::new();
    let mut times: Option<[Instant; 2]> = None;
    let mut first_piece = 0;
    let mut take = |piece: &[u8]| {
        bytes.extend_from_slice(piece);
        let now = Instant::now();
        if times.is_none() {
            first_piece = piece.len();
        }
        times = Some([times.map_or(now, |[first, _]| first), now]);
        false
    };
    let time = Duration::from_secs_f64(arguments.seconds);
    Heard::listen(address, serial, &tell, &[], time, &mut take).map_err(wrong)?;
    let rate = times.and_then(|[first, last]| {
        let seconds = last.duration_since(first).as_secs_f64();
        // What came first took its time before.
        (seconds > 0.0).then(|| (bytes.len() - first_piece) as f64 / seconds)
    });
    if bytes.is_empty() {
        return Err(Stop::WrongInput(format!(
            "{}: no byte came in {} s\nhelp: does the board send without being asked, and is it this port? taxel devices lists the ports",
            arguments.source, arguments.seconds
        )));
    }
    Ok((bytes, rate))
}

/// The first bytes of a file.
fn captured(path: &Path) -> Result<Vec<u8>, Stop> {
    let unreadable = |error: std::io::Error| {
        Stop::WrongInput(format!(
            "{}: cannot be read: {error}\nhelp: give a link (serial:PORT, tcp:HOST:PORT, udp:PORT, -, exec:\"PROGRAM\") or a file of bytes as a board sent them",
            shown::path(path)
        ))
    };
    if !std::fs::metadata(path).map_err(unreadable)?.is_file() {
        return Err(unreadable(std::io::Error::other("it is no ordinary file")));
    }
    let file = std::fs::File::open(path).map_err(unreadable)?;
    let mut bytes = Vec::new();
    file.take(MOST)
        .read_to_end(&mut bytes)
        .map_err(unreadable)?;
    Ok(bytes)
}
