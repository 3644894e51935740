//! `taxel live`: frames to touch.

use std::io::{ErrorKind, IsTerminal as _, Write as _};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};
use taxel::acquisition::{Quantity, Stimulus, Stream, Twin};
use taxel::device::Device;
use taxel::electronics::times_in_another_unit;
use taxel::estimation::{FrameError, MOST_CONTACTS, MapNoise, MapOptions, State, TouchSession};
use taxel::sensor::{Element, Sensor};
use taxel::shown;
use taxel::table::{self, Cell, Column, number_or_null};
use taxel_board::{Board, Pressed};
use taxel_files::{COMMIT, Progress, VERSION};
use taxel_recording::{RecordingError, RecordingOptions};
use taxel_serve::link::LinkAddress;
use taxel_serve::{
    EventFile, Failure, LastTouch, LastZero, LineOutput, Marks, Next, Provenance, PumpOptions,
    Replay, ReplaySource, ServeError, Session, Source, SourceError, StartTare, Summary, Survey,
    TwinSource, run_headless, run_with_page, run_with_pages,
};

use crate::arguments::{Format, Live, REST_FRAMES, RecordOptions, Rest};
use crate::outputs::{self, Existing};
use crate::run_files::{NamedText, RunFiles};
use crate::{Done, Stop, files};

mod address_code;
mod hardware;
mod session_file;

pub(crate) fn run(arguments: &Live) -> Result<Done, Stop> {
    let mut each = match &arguments.session {
        Some(path) => session_file::each(path, arguments)?,
        None => arguments.each().map_err(Stop::WrongInput)?,
    };
    if let [one] = &each[..] {
        return run_one(one);
    }
    for (place, one) in (1..).zip(&mut each) {
        let record = &mut one.recording.record;
        *record = record.as_deref().map(|path| of_sensor(path, place));
    }
    run_several(arguments, &each)
}

/// The recording of one of several sensors: `run.mcap` of the second is `run-2.mcap`. All have one clock.
fn of_sensor(path: &Path, place: usize) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let end = path.extension().map_or_else(String::new, |extension| {
        format!(".{}", extension.to_string_lossy())
    });
    path.with_file_name(format!("{stem}-{place}{end}"))
}

/// Several sensors, each with a page that leads to the others.
fn run_several(arguments: &Live, each: &[Live]) -> Result<Done, Stop> {
    if let Some(option) = arguments.of_one_sensor() {
        let message =
            format!("{option}: of several sensors there is a page alone; start them one by one");
        return Err(Stop::WrongInput(message));
    }
    let mut sessions = Vec::new();
    let preparing = Progress::new("preparing the estimators");
    for one in each {
        sessions.push(session(one, options(one)?)?);
    }
    drop(preparing);
    let about: Vec<_> = sessions
        .iter()
        .map(|session| about(session, arguments.seed))
        .collect();
    let summaries = run_with_pages(sessions, address(arguments), |page| told(arguments, page));
    let summaries = match summaries {
        Ok(summaries) => summaries,
        Err(ServeError::NotTold(error)) if error.kind() == ErrorKind::BrokenPipe => {
            return Ok(Done::Complete);
        }
        Err(error) => return Err(stop_of_serving(&error)),
    };
    let mut done = Done::Complete;
    for ((one, about), summary) in each.iter().zip(&about).zip(&summaries) {
        if let Done::WithLosses = report(one, about, summary)? {
            done = Done::WithLosses;
        }
    }
    Ok(done)
}

/// Where the page is to be.
fn address(arguments: &Live) -> SocketAddr {
    let address = SocketAddr::new(arguments.host, arguments.port);
    if !arguments.host.is_loopback() {
        note!(
            "note: {address} can be reached from other machines; the token in the address is the only key"
        );
    }
    address
}

/// Says where the page is.
fn told(arguments: &Live, page: &str) -> std::io::Result<()> {
    if lines_on_standard_output(arguments) {
        writeln!(std::io::stderr(), "{page}")?;
    } else {
        writeln!(std::io::stdout(), "{page}")?;
    }
    let stderr = std::io::stderr();
    if arguments.qr || (stderr.is_terminal() && !arguments.host.is_loopback()) {
        write!(&stderr, "{}", address_code::drawn(page))?;
    }
    if arguments.frames.is_none() {
        note!("open the address above in a browser; Ctrl-C ends");
    }
    Ok(())
}

fn run_one(arguments: &Live) -> Result<Done, Stop> {
    let options = options(arguments)?;
    let preparing = Progress::new("preparing the estimator");
    let mut session = session(arguments, options)?;
    drop(preparing);
    session.options.provenance = saved_provenance(&session.provenance, arguments.seed);
    let about = about(&session, arguments.seed);
    let frames = session.options.frames.or(session.options.expected);
    let ends = arguments.headless && frames.is_some();
    let playing = ends.then(|| Progress::new("playing the frames"));
    let summary = if arguments.headless {
        run_headless(session)
    } else {
        run_with_page(session, address(arguments), |page| told(arguments, page))
    };
    drop(playing);
    let summary = match summary {
        Ok(summary) => summary,
        // Nobody learned the address (`taxel live | head -0`).
        Err(ServeError::NotTold(error)) if error.kind() == ErrorKind::BrokenPipe => {
            return Ok(Done::Complete);
        }
        Err(error) => return Err(stop_of_serving(&error)),
    };
    report(arguments, &about, &summary)
}

/// True if the standard output is taken by lines for other programs.
fn lines_on_standard_output(arguments: &Live) -> bool {
    let outputs = arguments.outputs.out.iter();
    let mut outputs = outputs.filter_map(|text| LineOutput::parse(text).ok());
    let table = arguments
        .table
        .as_ref()
        .is_some_and(|table| table.file.is_none());
    table || outputs.any(|output| output.is_standard())
}

/// The outputs; two on the standard output would mix their lines.
fn line_outputs(arguments: &Live) -> Result<Vec<LineOutput>, Stop> {
    let wrong = |message: String| Stop::WrongInput(message);
    let outputs = arguments
        .outputs
        .out
        .iter()
        .map(|text| LineOutput::parse(text));
    let outputs: Vec<_> = outputs
        .collect::<Result<_, _>>()
        .map_err(|error| wrong(error.to_string()))?;
    let on_standard = outputs.iter().filter(|output| output.is_standard());
    if on_standard.count() > 1 {
        let message = "--out: only one output can have the standard output; give the others a file, such as csv:FILE";
        return Err(wrong(message.into()));
    }
    if arguments.outputs.marks.contains(&Marks::StandardInput) && arguments.source == "-" {
        let message = "--marks -: the standard input already is the source";
        return Err(wrong(message.into()));
    }
    Ok(outputs)
}

pub(crate) fn options(arguments: &Live) -> Result<PumpOptions, Stop> {
    let speed = match arguments.speed.as_str() {
        "max" => Some(f64::INFINITY),
        text => text
            .parse()
            .ok()
            .filter(|speed: &f64| *speed > 0.0 && speed.is_finite()),
    };
    let Some(speed) = speed else {
        let message = format!(
            "--speed \"{}\": must be a number above 0, or max",
            arguments.speed
        );
        return Err(Stop::WrongInput(message));
    };
    if arguments.headless
        && arguments.frames.is_none()
        && arguments.source.starts_with("sim:")
        && speed.is_infinite()
    {
        let message = "--headless --speed max on the twin would never end: give --frames N";
        return Err(Stop::WrongInput(message.into()));
    }
    if recorded_rest(arguments).is_some() && (arguments.start.tare || arguments.start.no_tare) {
        let message = "--rest FILE gives the rest values: leave --tare and --no-tare out";
        return Err(Stop::WrongInput(message.into()));
    }
    let RecordOptions {
        record, record_for, ..
    } = &arguments.recording;
    if arguments.headless && record_for.is_some() && record.is_none() {
        let message = "--record-for: there is no recording; add --record FILE.mcap";
        return Err(Stop::WrongInput(message.into()));
    }
    check_outputs(arguments)?;
    let outputs = line_outputs(arguments)?;
    let events = arguments.events.as_deref().map(EventFile::new).transpose();
    let events = events.map_err(|error| Stop::WrongInput(format!("--events {error}")))?;
    Ok(PumpOptions {
        expected: None,
        speed,
        frames: arguments.frames,
        tare_frames: match arguments.start.rest {
            Some(Rest::Frames(frames)) => frames,
            _ => REST_FRAMES,
        },
        start_tare: match &arguments.start.rest {
            _ if arguments.start.tare => StartTare::Asked,
            Some(Rest::Recording(_)) => StartTare::Never,
            _ if arguments.start.no_tare => StartTare::Never,
            _ => StartTare::Automatic,
        },
        rest_from: recorded_rest(arguments).map(shown::path),
        save: arguments.save.clone(),
        replace_files: arguments.overwrite.existing() == Existing::Replaced,
        events,
        record: None,
        record_folder: None,
        outputs,
        table: arguments.table.clone(),
        when_failing: arguments.recording.when_failing(),
        told: |message| note!("warning: {message}"),
        provenance: Vec::new(),
    })
}

/// The recording that the rest values are to come from.
fn recorded_rest(arguments: &Live) -> Option<&Path> {
    match &arguments.start.rest {
        Some(Rest::Recording(path)) => Some(path),
        _ => None,
    }
}

fn check_outputs(arguments: &Live) -> Result<(), Stop> {
    let (_, source) = arguments.source.split_once(':').unwrap_or_default();
    let source = PathBuf::from(source);
    let sensor = arguments.sensor().to_owned();
    let inputs = [&sensor, &source];
    let rest = recorded_rest(arguments).map(Path::to_owned);
    let inputs: Vec<_> = inputs
        .into_iter()
        .chain(&arguments.calibration)
        .chain(&rest)
        .collect();
    let files: Vec<PathBuf> = line_outputs(arguments)?
        .iter()
        .filter_map(|output| output.file().map(Path::to_owned))
        .collect();
    let mut outputs = vec![
        ("--save", arguments.save.as_ref()),
        ("--events", arguments.events.as_ref()),
        ("--record", arguments.recording.record.as_ref()),
    ];
    outputs.extend(files.iter().map(|file| ("--out", Some(file))));
    let table = arguments
        .table
        .as_ref()
        .and_then(|table| table.file.as_ref());
    outputs.push(("--output", table));
    outputs::check(&outputs, &inputs, arguments.overwrite.existing())
}

pub(crate) fn session(arguments: &Live, options: PumpOptions) -> Result<Session, Stop> {
    if LinkAddress::is_one(&arguments.source) {
        return hardware::link_session(arguments, options);
    }
    let (kind, rest) = arguments
        .source
        .split_once(':')
        .unwrap_or((&arguments.source, ""));
    match &arguments.link.board {
        Some(board) if kind == "replay" && !rest.is_empty() => {
            return hardware::capture_session(arguments, board, Path::new(rest), options);
        }
        Some(board) => {
            return Err(Stop::WrongInput(format!(
                "--board {}: --source \"{}\" is no link; use serial:PORT, tcp:HOST:PORT, udp:PORT, -, exec:\"PROGRAM\", or replay:FILE of captured bytes",
                shown::path(board),
                arguments.source
            )));
        }
        None => {}
    }
    match kind {
        "sim" => twin_session(arguments, rest, options),
        "replay" if !rest.is_empty() => replay_session(arguments, &PathBuf::from(rest), options),
        _ => Err(Stop::WrongInput(format!(
            "--source \"{}\" is no source\nhelp: use sim:, sim:SCRIPT.toml or replay:RECORDING; of hardware serial:PORT, tcp:HOST:PORT, udp:PORT, - or exec:\"PROGRAM\", with --board",
            arguments.source
        ))),
    }
}

fn twin_session(arguments: &Live, script: &str, options: PumpOptions) -> Result<Session, Stop> {
    let named = files::sensor(arguments.sensor())?;
    let usual = named.sensor.element.usual_script();
    let name = if script.is_empty() { usual } else { script };
    let text = match Stimulus::shipped_text(name) {
        Some(text) if !Path::new(name).exists() => text.to_owned(),
        _ => files::text(Path::new(name))?,
    };
    let stimulus = Stimulus::parse(name, &text)?;
    let twin = Twin::new(&named.sensor, &stimulus, arguments.seed)
        .map_err(|message| {
            Stop::WrongInput(format!(
                "{name}: {message}\nhelp: give --source sim:SCRIPT.toml with its probes on taxels of this array"
            ))
        })?;
    let source = TwinSource::new(twin);
    let run = RunFiles {
        stimulus: Some(NamedText {
            name: name.to_owned(),
            text,
        }),
        ..asked(arguments)?
    };
    if arguments.map.raw {
        return map_session(source, &MapNoise::default(), &run, options, arguments);
    }
    sensed(named, source, run, options, arguments)
}

/// What the command line says of a run.
fn asked(arguments: &Live) -> Result<RunFiles, Stop> {
    let calibration = arguments.calibration.as_deref().map(|path| {
        let name = shown::path(path);
        files::text(path).map(|text| NamedText { name, text })
    });
    Ok(RunFiles {
        calibration: calibration.transpose()?,
        raw: arguments.map.raw,
        all_events: arguments.map.all_events,
        ..RunFiles::default()
    })
}

/// A session whose frames mean what the sensor says.
fn sensed(
    named: files::NamedSensor,
    source: impl Source + 'static,
    mut run: RunFiles,
    mut options: PumpOptions,
    arguments: &Live,
) -> Result<Session, Stop> {
    run.sensor = Some(NamedText {
        name: named.name.clone(),
        text: named.text.clone(),
    });
    let named = match &run.calibration {
        Some(NamedText { name, text }) => files::applied_text(named, name, text)?,
        None => named,
    };
    let device = files::device(&named.sensor)?;
    let mut touch = touch(
        device.as_ref(),
        source.stream(),
        arguments,
        &arguments.source,
    )?;
    let steps = board_of(&run).map_or(Vec::new(), |board| board.steps());
    touch.set_steps(&steps);
    if let Some(path) = recorded_rest(arguments) {
        let bare = has_bare_recordings(&named.sensor);
        let session = |stream: &Stream| {
            let name = format!("--rest {}", shown::path(path));
            self::touch(device.as_ref(), stream, arguments, &name)
        };
        touch.restore_rest(&rest_of(path, bare, arguments, session)?);
    }
    let last_zero = last_zero(arguments, &run, || {
        let mut again = self::touch(device.as_ref(), source.stream(), arguments, "").ok()?;
        again.set_steps(&steps);
        Some(again)
    });
    run.record(arguments, touch.meaning(), &mut options);
    let drawing = device.drawing().svg();
    drop(device);
    Ok(Session {
        touch,
        drawing,
        source: Box::new(source),
        last_zero,
        marks: arguments.outputs.marks.clone(),
        replay: None,
        options,
        provenance: provenance(arguments, named.sensor.name, named.hash),
    })
}

fn replay_session(arguments: &Live, path: &Path, options: PumpOptions) -> Result<Session, Stop> {
    let (session, survey) = replayed(arguments, path, options.clone(), None)?;
    let (again, path) = (arguments.clone(), path.to_owned());
    let (from_ns, to_ns) = (survey.first_ns, survey.first_ns + survey.duration_ns);
    let reopen = move || {
        let opened = replayed(&again, &path, options.clone(), Some(&survey));
        let opened = opened.map(|(session, _)| (session.source, session.touch));
        opened.map_err(|stop| stop.to_string())
    };
    let replay = Replay {
        from_ns,
        to_ns,
        reopen: Box::new(reopen),
    };
    Ok(Session {
        replay: Some(replay),
        ..session
    })
}

/// The session of a recording, and what a first reading of all of it found; `known` where it has been read.
fn replayed(
    arguments: &Live,
    path: &Path,
    options: PumpOptions,
    known: Option<&Survey>,
) -> Result<(Session, Survey), Stop> {
    let bare = takes_bare(arguments.sensor());
    let open = || {
        ReplaySource::open(
            path,
            &recording_options(bare || arguments.map.raw, arguments),
        )
    };
    let surveyed = match known {
        Some(survey) => Ok((survey.clone(), Ok(()))),
        None => open().map(Survey::of),
    };
    let survey = match surveyed.unwrap_or_else(|error| (Survey::default(), Err(error))) {
        (survey, Ok(())) if survey.frames == 0 => {
            let message = format!("{}: there is no frame in it", shown::path(path));
            return Err(Stop::WrongInput(message));
        }
        (survey, Ok(())) => survey,
        (survey, Err(error)) if arguments.salvage && is_cut(&error) => survey,
        (_, Err(error)) => {
            // It may have no header because of a sensor file with a mistake.
            files::sensor(arguments.sensor())?;
            return Err(stop_of_source(&error));
        }
    };
    let source = open()
        .map_err(|error| stop_of_source(&error))?
        .paced(&survey);
    if let Some(taken) = source.taken().filter(|_| known.is_none()) {
        note!("note: {}: {taken}", shown::path(path));
    }
    let recorded = source.findings().map(RunFiles::of);
    let foreign = recorded.is_none();
    let options = PumpOptions {
        expected: Some(survey.frames),
        // The changes of the rest values are part of such a recording.
        start_tare: match options.start_tare {
            StartTare::Automatic if recorded.is_some() => StartTare::Never,
            asked => asked,
        },
        ..options
    };
    if let Some(recorded) = recorded.filter(|_| arguments.named_sensor.is_none()) {
        let session = recorded_session(arguments, source, &survey.noise, recorded, options)?;
        return Ok((session, survey));
    }
    let stream = source.stream();
    if let parts @ [_, _, ..] = source.parts()
        && arguments.map.part.is_none()
        && known.is_none()
    {
        let (count, parts) = (parts.len(), parts.join(", "));
        let of_others = matches!(source.format(), taxel_recording::Format::Foreign(_));
        let kind = if of_others { "series" } else { "sensors" };
        note!(
            "note: the recording has {count} {kind}: {parts}; this is {}; --part plays another",
            stream.name
        );
    }
    // Counts and readings of capacitors mean something only with the sensor they are of; other
    // recordings describe themselves, unless the sensor that is named gives the same quantity.
    // Without a sensor counts are counts.
    let described = match stream.unit.quantity {
        _ if bare || stream.channels_per_taxel == 4 => false,
        Quantity::Counts => arguments.named_sensor.is_none(),
        quantity => !gives(arguments, quantity)?,
    };
    let run = RunFiles {
        surveyed: true,
        ..asked(arguments)?
    };
    if arguments.map.raw || described {
        let session = map_session(source, &survey.noise, &run, options, arguments)?;
        return Ok((session, survey));
    }
    let named = files::sensor(arguments.sensor())?;
    let step = survey.usual_step().unwrap_or(0.0);
    let rate = named.sensor.electronics.frame_rate;
    if let Some([message, help]) = times_in_another_unit(step, rate).filter(|_| foreign) {
        let path = shown::path(path);
        return Err(Stop::WrongInput(format!("{path}: {message}\nhelp: {help}")));
    }
    Ok((sensed(named, source, run, options, arguments)?, survey))
}

/// A session of a recording that has its sensor and its calibration with it.
fn recorded_session(
    arguments: &Live,
    source: ReplaySource,
    noise: &MapNoise,
    recorded: RunFiles,
    options: PumpOptions,
) -> Result<Session, Stop> {
    let asked = asked(arguments)?;
    let run = RunFiles {
        calibration: asked.calibration.or(recorded.calibration),
        stimulus: recorded.stimulus,
        board: recorded.board,
        raw: asked.raw || recorded.raw,
        all_events: asked.all_events || recorded.all_events,
        surveyed: recorded.surveyed || (asked.raw && !recorded.raw),
        sensor: None,
    };
    match recorded.sensor {
        Some(NamedText { name, text }) if !run.raw => {
            let named = files::sensor_of_text(&name, text)?;
            sensed(named, source, run, options, arguments)
        }
        _ => {
            let unknown = MapNoise::default();
            let noise = if run.surveyed { noise } else { &unknown };
            map_session(source, noise, &run, options, arguments)
        }
    }
}

/// True if a sensor was named whose board gives `quantity` itself.
fn gives(arguments: &Live, quantity: Quantity) -> Result<bool, Stop> {
    let Some(name) = &arguments.named_sensor else {
        return Ok(false);
    };
    let named = files::sensor(name)?;
    let last = named.sensor.electronics.last_stage();
    Ok(last.is_some_and(|last| last.unit().quantity == quantity))
}

/// The board of a run.
fn board_of(run: &RunFiles) -> Option<Board> {
    let board = run.board.as_ref()?;
    Board::parse(&board.name, &board.text).ok()
}

/// A session whose frames are a map that describes itself.
fn map_session(
    source: impl Source + 'static,
    noise: &MapNoise,
    run: &RunFiles,
    mut options: PumpOptions,
    arguments: &Live,
) -> Result<Session, Stop> {
    let all_events = run.all_events;
    let stream = source.stream();
    if let Some(path) = &arguments.calibration {
        let message = format!(
            "--calibration {}: {} describes itself and takes no calibration",
            shown::path(path),
            arguments.source
        );
        return Err(Stop::WrongInput(message));
    }
    if !arguments.map.raw && stream.unit.quantity == Quantity::Counts {
        note!(
            "note: counts without a sensor file: a map of raw readings; name the sensor for touch"
        );
    }
    // A board of a named sensor may give newtons: raw, they are no touch of that sensor.
    let is_map = matches!(stream.unit.quantity, Quantity::Pressure | Quantity::Force)
        && arguments.named_sensor.is_none();
    if arguments.map.raw && is_map {
        note!(
            "note: --raw changes nothing: the frames are a map in {}",
            stream.unit.symbol
        );
    }
    // A board names its channels.
    let board = board_of(run);
    let (steps, kinds) = board
        .as_ref()
        .map_or_else(Default::default, |board| (board.steps(), board.kinds()));
    let names = board.iter().flat_map(Board::names).map(str::to_owned);
    let names: Vec<String> = names.collect();
    let options_of = |noise: &MapNoise| MapOptions {
        noise: noise.clone(),
        all_events,
        names: names.clone(),
        steps: steps.clone(),
        kinds: kinds.clone(),
        falls: board
            .as_ref()
            .is_some_and(|board| board.pressed == Pressed::Falls),
    };
    let mut touch = TouchSession::map(stream, &options_of(noise));
    if let Some(path) = recorded_rest(arguments) {
        // What changes at rest is noise.
        let bare = arguments.map.raw;
        let noise = noise_of(path, bare, arguments)?;
        touch = TouchSession::map(stream, &options_of(&noise));
        touch.restore_rest(&rest_of(path, bare, arguments, |stream| {
            Ok(TouchSession::map(stream, &options_of(&noise)))
        })?);
    }
    let frames = matches!(arguments.start.rest, Some(Rest::Frames(_)));
    if frames && !arguments.start.tare && !touch.estimator().rules().rest.at_start {
        note!(
            "note: a map is not tared at the start: --rest FRAMES counts from *Tare* on the page, or with --tare"
        );
    }
    let last_zero = last_zero(arguments, run, || {
        Some(TouchSession::map(stream, &options_of(noise)))
    });
    run.record(arguments, touch.meaning(), &mut options);
    Ok(Session {
        touch,
        drawing: String::new(),
        provenance: provenance(arguments, stream.name.clone(), String::new()),
        source: Box::new(source),
        last_zero,
        marks: arguments.outputs.marks.clone(),
        replay: None,
        options,
    })
}

/// The zero of the last run of a sensor on this link, to be compared with that of the start; `again` is another
/// session of the sensor.
fn last_zero(
    arguments: &Live,
    run: &RunFiles,
    again: impl FnOnce() -> Option<TouchSession>,
) -> Option<LastZero> {
    if arguments.link.no_last_zero || !LinkAddress::is_one(&arguments.source) {
        return None;
    }
    let files = [&run.sensor, &run.calibration, &run.board];
    let texts = files.into_iter().flatten().map(|file| file.text.as_str());
    // Another specimen of the same drawing is on another link, as far as a program can know.
    let texts: Vec<&str> = texts.chain([arguments.source.as_str()]).collect();
    let name = taxel_files::sha256(texts.join("\0").as_bytes());
    let folder = taxel_files::state_folder()?;
    Some(LastZero::new(
        folder.join("zeros").join(format!("{name}.json")),
        again()?,
    ))
}

/// How a recording is opened.
fn recording_options(bare: bool, arguments: &Live) -> RecordingOptions {
    RecordingOptions {
        bare,
        part: arguments.map.part.clone(),
        columns: arguments.map.columns.clone().unwrap_or_default(),
    }
}

/// The noise of a recording at rest.
fn noise_of(path: &Path, bare: bool, arguments: &Live) -> Result<MapNoise, Stop> {
    let wrong = |error: SourceError| Stop::WrongInput(format!("--rest {error}"));
    let options = recording_options(bare, arguments);
    let (survey, end) = Survey::of(ReplaySource::open(path, &options).map_err(wrong)?);
    end.map_err(wrong)?;
    Ok(survey.noise)
}

/// The rest values that the first frames of a recording give.
fn rest_of(
    path: &Path,
    bare: bool,
    arguments: &Live,
    session: impl Fn(&Stream) -> Result<TouchSession, Stop>,
) -> Result<taxel::estimation::Rest, Stop> {
    let wrong = |error: SourceError| Stop::WrongInput(format!("--rest {error}"));
    let refused = |why: String| Stop::WrongInput(format!("--rest {}: {why}", shown::path(path)));
    let options = recording_options(bare, arguments);
    let mut source = ReplaySource::open(path, &options).map_err(wrong)?;
    let mut session = session(source.stream())?;
    session.begin_rest_capture(REST_FRAMES);
    let mut frames = 0;
    while let Next::Frame(frame) = source.next().map_err(wrong)? {
        frames += 1;
        let observed = session.push(&frame);
        match observed
            .map_err(|error| refused(error.to_string()))?
            .captured
        {
            None => {}
            Some(Ok(())) => return Ok(session.rest()),
            Some(Err(why)) => return Err(refused(why.to_string())),
        }
    }
    Err(refused(format!(
        "{frames} frames; a rest capture takes {REST_FRAMES}\nhelp: record more with taxel live ... --frames {REST_FRAMES} --save FILE"
    )))
}

/// The session of a device with the frames of `source`.
fn touch(
    device: &dyn Device,
    stream: &Stream,
    arguments: &Live,
    source: &str,
) -> Result<TouchSession, Stop> {
    device.session(stream).map_err(|error| {
        if matches!(
            error,
            FrameError::Untrained | FrameError::TrainedWithMasked { .. }
        ) {
            let sensor = shown::path(arguments.sensor());
            return Stop::WrongInput(format!(
                "{sensor}: {error}\nhelp: taxel calibrate {sensor} RECORDINGS -o CAL.toml, then give --calibration CAL.toml"
            ));
        }
        if let FrameError::NotInvertible(_) = error {
            return Stop::WrongInput(format!(
                "{}: {error}\nhelp: taxel predict answers its loads; to read forces choose other surroundings, a smaller \
                 gap or electrodes farther from a grounded face",
                shown::path(arguments.sensor())
            ));
        }
        Stop::WrongInput(format!(
            "{} does not fit {}: {error}\nhelp: the frames are of {} x {} taxels; name the sensor file they come from",
            source,
            shown::path(arguments.sensor()),
            stream.rows,
            stream.columns
        ))
    })
}

fn takes_bare(sensor: &Path) -> bool {
    files::sensor(sensor).is_ok_and(|named| has_bare_recordings(&named.sensor))
}

/// True if recordings of this sensor may come without a header: its file says
/// what the channels are.
fn has_bare_recordings(sensor: &Sensor) -> bool {
    matches!(sensor.element, Element::Trained(_))
}

fn is_cut(error: &SourceError) -> bool {
    matches!(error, SourceError::Recording(error) if matches!(**error, RecordingError::Truncated { .. }))
}

fn stop_of_source(error: &SourceError) -> Stop {
    let help = if is_cut(error) {
        "\nhelp: --salvage plays its complete frames"
    } else {
        ""
    };
    Stop::WrongInput(format!("{error}{help}"))
}

pub(crate) fn stop_of_serving(error: &ServeError) -> Stop {
    match error {
        ServeError::Listen { .. } => Stop::WrongInput(error.to_string()),
        _ => Stop::Failed(error.to_string()),
    }
}

fn provenance(arguments: &Live, device: String, sensor_hash: String) -> Provenance {
    Provenance {
        device,
        version: VERSION.into(),
        commit: COMMIT.into(),
        sensor_hash,
        source: arguments.source.clone(),
    }
}

fn saved_provenance(provenance: &Provenance, seed: u64) -> Vec<String> {
    vec![
        format!("taxel {} {}", provenance.version, provenance.commit),
        format!("sensor_hash {}", provenance.sensor_hash),
        format!("source {}", provenance.source),
        format!("seed {seed}"),
    ]
}

pub(crate) fn about(session: &Session, seed: u64) -> Map<String, Value> {
    let stream = session.source.stream();
    let provenance = &session.provenance;
    // The frames of crossing channels are one row of channels; people count taxels.
    let layout = &session.touch.meaning().layout;
    let seed = if provenance.source.starts_with("sim:") {
        Value::from(seed)
    } else {
        Value::Null
    };
    let pairs = [
        ("name", Value::from(provenance.device.clone())),
        ("source", Value::from(provenance.source.clone())),
        ("rows", Value::from(layout.rows)),
        ("columns", Value::from(layout.columns)),
        ("channels", Value::from(stream.channels())),
        ("channel_unit", Value::from(stream.unit.symbol.clone())),
        (
            "pitch_m",
            stream.pitch.map_or(Value::Null, |pitch| json!(pitch)),
        ),
        ("seed", seed),
        ("sensor_hash", Value::from(provenance.sensor_hash.clone())),
        ("version", Value::from(provenance.version.clone())),
        ("commit", Value::from(provenance.commit.clone())),
    ];
    pairs
        .into_iter()
        .map(|(key, value)| (key.to_owned(), value))
        .collect()
}

pub(crate) fn report(
    arguments: &Live,
    about: &Map<String, Value>,
    summary: &Summary,
) -> Result<Done, Stop> {
    let fields = fields(about, summary);
    let report = match arguments.format {
        Format::Json => table::json(&Value::Object(fields)),
        Format::Table => fields
            .iter()
            .filter(|(key, _)| !LISTS.contains(&key.as_str()))
            .map(line)
            .collect(),
        Format::Csv => {
            let columns: Vec<_> = fields.keys().map(Column::plain).collect();
            let row = fields
                .values()
                .map(|value| Cell::from(text(value)))
                .collect();
            table::render(table::Format::Csv, &Map::new(), &columns, &[row])
        }
    };
    if arguments.headless || arguments.frames.is_some() {
        let beside = lines_on_standard_output(arguments).then_some(Path::new("-"));
        outputs::print_beside(beside, &report)?;
    }
    // The end of a recording or of another file was told at once.
    let recording = summary.recording.as_ref();
    let told = summary.failed_files.contains(&summary.notice)
        || recording.is_some_and(|recording| recording.failure.as_ref() == Some(&summary.notice));
    if !summary.notice.is_empty() && summary.failure.is_none() && !told {
        note!("note: {}", summary.notice);
    }
    if let Some(link) = &summary.link
        && !link.remark.is_empty()
        && link.remark != summary.notice
    {
        note!("note: {}", link.remark);
    }
    for output in summary.outputs.iter().filter(|output| output.dropped > 0) {
        note!(
            "note: --out {}: {} frames are missing in it: its reader is too slow",
            output.output,
            output.dropped
        );
    }
    if summary.merged_frames > 0 {
        note!(
            "note: in {} frames more than {MOST_CONTACTS} regions stand out; those beyond are part of the contact beside them",
            summary.merged_frames
        );
    }
    if let Some(below) = &summary.below_zero {
        let taxels = match below.taxels {
            1 => "1 taxel reads".to_owned(),
            taxels => format!("{taxels} taxels read"),
        };
        note!(
            "note: {taxels} below zero: {}; lift off and tare again",
            below.cause
        );
    }
    let recording_lost = summary
        .recording
        .as_ref()
        .is_some_and(|recording| recording.failure.is_some() || recording.lost > 0);
    if let Some(recording) = &summary.recording
        && recording.lost > 0
    {
        note!(
            "note: {} messages are missing in {}: the disk did not take them in time",
            recording.lost,
            shown::path(&recording.path)
        );
    }
    let wire_losses = summary.link.as_ref().is_some_and(|link| {
        let wire = &link.wire;
        let nothing_decoded = link.bytes > 0 && wire.delivered == 0;
        nothing_decoded || link.overrun > 0 || !wire.is_clean()
    });
    let losses = summary.lost.is_some_and(|lost| lost > 0)
        || summary.continuity.late > 0
        || summary.clipped_frames > 0
        || wire_losses
        || recording_lost
        || !summary.failed_files.is_empty();
    match &summary.failure {
        Some(Failure::Source(error)) if arguments.salvage && is_cut(error) => {
            note!("note: {error}");
            Ok(Done::WithLosses)
        }
        Some(failure) => Err(Stop::Failed(failure.to_string())),
        None if losses => Ok(Done::WithLosses),
        None => Ok(Done::Complete),
    }
}

/// More readings than this are not listed.
const MOST_LISTED: usize = 256;
/// Fields that are too long for a line that people read.
const LISTS: [&str; 3] = ["last_taxel_forces_n", "last_events", "wrong_channels"];

fn line((key, value): (&String, &Value)) -> String {
    match value {
        Value::Null if key == "lost" => format!("{key:<24} not known\n"),
        Value::Null => String::new(),
        value => format!("{key:<24} {}\n", text(value)),
    }
}

/// A value as a person writes it: text without quotes, nothing for nothing.
fn text(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        value => value.to_string(),
    }
}

fn numbers(values: &[f64]) -> Value {
    values.iter().map(|value| number_or_null(*value)).collect()
}

fn fields(about: &Map<String, Value>, summary: &Summary) -> Map<String, Value> {
    let mut fields = about.clone();
    let counts = &summary.continuity;
    let rate = match counts.accepted {
        0 | 1 => f64::NAN,
        frames => (frames - 1) as f64 / summary.duration,
    };
    let latency = |latencies: &taxel_serve::Latencies| {
        json!({
            "p50": latencies.quantile(0.5),
            "p90": latencies.quantile(0.9),
            "p99": latencies.quantile(0.99),
            "p99_9": latencies.quantile(0.999),
            "largest": latencies.largest(),
        })
    };
    let mut put = |key: &str, value: Value| fields.insert(key.to_owned(), value);
    put("frames", Value::from(counts.accepted));
    put("lost", summary.lost.map_or(Value::Null, Value::from));
    put("late", Value::from(counts.late));
    put("duplicate", Value::from(counts.duplicate));
    put("repeated", Value::from(counts.repeated));
    put("restarts", Value::from(summary.restarts));
    put("clipped_frames", Value::from(summary.clipped_frames));
    put("merged_frames", Value::from(summary.merged_frames));
    if let Some(recording) = &summary.recording {
        put(
            "recording",
            json!({
                "file": recording.path.to_string_lossy(),
                "bytes": recording.bytes,
                "messages": recording.messages,
                "lost": recording.lost,
                "failure": recording.failure,
            }),
        );
    }
    if !summary.failed_files.is_empty() {
        put("failed_files", json!(summary.failed_files));
    }
    put("duration_s", number_or_null(summary.duration));
    put("rate_hz", number_or_null(rate));
    if summary.waited.count() > 0 {
        put("arrival_to_pump_s", latency(&summary.waited));
    }
    put("latency_s", latency(&summary.latency));
    if summary.sent.count() > 0 {
        put("sent_latency_s", latency(&summary.sent));
    }
    if let Some(link) = &summary.link {
        put("link", json!(link));
    }
    if !summary.outputs.is_empty() {
        let outputs = summary.outputs.iter().map(|output| {
            json!({ "out": output.output, "lines": output.lines, "dropped": output.dropped })
        });
        put("outputs", outputs.collect());
    }
    put("tare", json!(summary.tare));
    put("notice", Value::from(summary.notice.clone()));
    put("below_zero", json!(summary.below_zero));
    put("events", json!(summary.events.counts));
    put("last_events", json!(summary.events.last));
    let conditions = &summary.conditions;
    put("condition", Value::from(condition_in_words(summary)));
    put("wrong_channels", json!(conditions.wrong));
    put("swapped", json!(conditions.swapped));
    if let Some(last) = &summary.last {
        fields.extend(last_fields(last));
    }
    fields
}

/// What the last frame says.
fn last_fields(last: &LastTouch) -> Map<String, Value> {
    let mut fields = Map::new();
    // Without a pitch positions are counted in cells.
    let centre_key = if last.in_metres {
        "last_centre_of_pressure_m"
    } else {
        "last_centre_of_pressure_cells"
    };
    let mut put = |key: &str, value: Value| fields.insert(key.to_owned(), value);
    put("last_sequence", Value::from(last.sequence));
    put("last_time_ns", Value::from(last.time_ns));
    put("last_force_n", numbers(&last.force));
    put("last_force_deviation_n", numbers(&last.deviation));
    put("last_certainty", Value::from(last.certainty.name()));
    put(
        "last_reason",
        last.reason
            .map_or(Value::Null, |state| Value::from(state.name())),
    );
    put("last_zero_known", Value::from(last.zero_known));
    put("last_moment_n_m", numbers(&last.moment));
    put("last_sum_si", last.sum.map_or(Value::Null, number_or_null));
    put(
        centre_key,
        last.centre_of_pressure.map_or(Value::Null, |c| numbers(&c)),
    );
    put("last_contacts", Value::from(last.contacts));
    let states = State::ALL
        .iter()
        .zip(last.states)
        .filter(|(_, count)| *count > 0);
    put(
        "last_states",
        states
            .map(|(state, count)| (state.name().to_owned(), Value::from(count)))
            .collect::<Map<_, _>>()
            .into(),
    );
    let vectors = last.values.iter().filter(|_| last.components == 3);
    put(
        "last_taxel_forces_n",
        vectors.map(|value| numbers(value)).collect(),
    );
    if last.components == 1 && last.readings.len() <= MOST_LISTED {
        let pressed: Vec<f64> = last.values.iter().map(|value| value[2]).collect();
        put("last_signals_si", numbers(&last.readings));
        put("last_taxel_values_si", numbers(&pressed));
    }
    fields
}

/// Condition of the channels; nothing is well of which nothing is known.
fn condition_in_words(summary: &Summary) -> String {
    let conditions = &summary.conditions;
    let Some(last) = &summary.last else {
        return "not known: no frame came".into();
    };
    let (channels, masked) = (conditions.channels, conditions.masked_channels);
    if last.faulty_channels > conditions.wrong_channels {
        return format!("{} of {channels} channels faulty", last.faulty_channels);
    }
    let found = match conditions.wrong_channels {
        0 if masked == 0 && channels == 1 => "the channel is well".into(),
        0 if masked == 0 => format!("all {channels} channels well"),
        0 => format!("{} of {channels} channels well", channels - masked),
        wrong => format!("{wrong} of {channels} channels wrong"),
    };
    let found = match masked {
        0 => found,
        masked => format!("{found}, {masked} masked"),
    };
    let damaged = summary.link.as_ref().map_or(0, |link| link.wire.damaged);
    match damaged {
        0 => found,
        damaged => format!("{found} in what came whole; {damaged} stretches were damaged"),
    }
}
