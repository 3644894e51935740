//! `taxel estimate`: the touch of every frame of a recording as a table.

use std::net::{IpAddr, Ipv4Addr};

use taxel::shown;
use taxel_serve::{TouchTable, run_headless};

use crate::arguments::{Estimate, Hardware, Live, Outputs, Overwrite, RecordOptions};
use crate::commands::live;
use crate::{Done, Stop, outputs};

/// Plays the recording through the session and the pump of `taxel live`, as fast as possible.
pub(crate) fn run(arguments: &Estimate) -> Result<Done, Stop> {
    let Some(recording) = arguments.recording.to_str() else {
        let message = format!(
            "{}: the name is no Unicode; rename the recording",
            shown::path(&arguments.recording)
        );
        return Err(Stop::WrongInput(message));
    };
    let file = arguments.output.clone();
    let file = file.filter(|file| !outputs::is_standard(file));
    let live = Live {
        session: None,
        sensors: Vec::new(),
        named_sensor: Some(arguments.sensor.clone()),
        calibration: arguments.calibration.clone(),
        map: arguments.map.clone(),
        sources: Vec::new(),
        source: format!("replay:{recording}"),
        link: Hardware {
            boards: Vec::new(),
            board: arguments.board.clone(),
            once: true,
            no_last_zero: true,
        },
        speed: "max".into(),
        frames: None,
        headless: true,
        format: arguments.format,
        seed: 1,
        start: arguments.start.clone(),
        save: None,
        events: arguments.events.clone(),
        recording: RecordOptions {
            record: None,
            record_for: None,
            record_or_stop: false,
            record_folder: ".".into(),
        },
        outputs: Outputs {
            out: Vec::new(),
            marks: Vec::new(),
        },
        salvage: arguments.salvage,
        host: IpAddr::V4(Ipv4Addr::LOCALHOST),
        port: 0,
        qr: false,
        table: Some(TouchTable { file }),
        overwrite: Overwrite {
            force: arguments.overwrite.existing() == outputs::Existing::Replaced,
        },
    };
    let session = live::session(&live, live::options(&live)?)?;
    let about = live::about(&session, live.seed);
    let summary = run_headless(session).map_err(|error| live::stop_of_serving(&error))?;
    live::report(&live, &about, &summary)
}
