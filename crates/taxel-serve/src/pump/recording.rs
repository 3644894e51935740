//! What goes into the recording of a run, and recordings that clients begin and end.

use std::sync::Arc;
use std::time::{Duration, Instant};

use taxel::acquisition::Frame;
use taxel::shown;
use taxel_recording::mcap::{FrameMessage, HealthMessage, LinkMessage, MarkMessage, RestKind};

use super::{Failure, Pump, RUNNING};
use crate::condition::ChannelConditions;
use crate::link::LinkHandle;
use crate::record::Recorder;
use crate::tare::By;

/// Time from one record of losses and conditions to the next.
const HEALTH_EVERY: Duration = Duration::from_secs(1);

impl Pump {
    /// Notes what a person or a program says, at the newest frame.
    pub(super) fn note(&mut self, text: String, time_ns: Option<u64>) {
        if let Some(recorder) = &self.recorder {
            recorder.mark(MarkMessage {
                device_time_ns: time_ns,
                text: text.clone(),
                ..MarkMessage::default()
            });
        }
        let shared = Arc::clone(&self.shared);
        let noted = self.events.mark(text, time_ns.unwrap_or(0), &|event| {
            shared.events().push(event);
        });
        if let Err(error) = noted {
            self.file_failed(error);
        }
    }

    /// Records the run from here on, as a run that is recorded from its beginning.
    pub(super) fn start_recording(
        &mut self,
        name: &str,
        time_ns: Option<u64>,
    ) -> Result<(), String> {
        let Some(folder) = self.options.record_folder.as_ref() else {
            return Err("this run takes no recordings from its clients".into());
        };
        if let Some(recorder) = &self.recorder {
            let path = shown::path(recorder.path());
            return Err(format!("{path} is being written: stop it first"));
        }
        if self.session.capturing() {
            // Half a capture could not be repeated from the recording.
            return Err(RUNNING.into());
        }
        let file = folder.named(name)?;
        let recorder = Recorder::create(&file, self.source.stream(), false, self.pace)
            .map_err(|error| error.to_string())?;
        self.source.record_to(Some(&recorder));
        self.shared.status().recording = Some(recorder.clone());
        if let Some(link) = self.shared.link.get().map(LinkHandle::now) {
            recorder.link(LinkMessage {
                host_ns: link.since_ns,
                segment: self.segment,
                state: link.state.name().into(),
                reason: link.reason,
                ..LinkMessage::default()
            });
        }
        self.recorder = Some(recorder);
        self.recorded_health = None;
        self.record_rest(RestKind::Begun, By::Start, time_ns, String::new());
        Ok(())
    }

    /// Ends the recording; its thread finishes the file while the run goes on.
    pub(super) fn stop_recording(&mut self) {
        if self.recorder.is_some() {
            self.record_health();
        }
        self.source.record_to(None);
        self.shared.status().recording = None;
        if let Some(recorder) = self.recorder.take() {
            self.finishing
                .push(std::thread::spawn(move || recorder.finish()));
        }
    }

    /// Records a frame as it came, and notices a recording that has failed.
    pub(super) fn record_frame(&mut self, frame: &Frame) -> Result<(), Failure> {
        let Some(recorder) = &self.recorder else {
            return Ok(());
        };
        if let Some(failure) = recorder.failure() {
            let message = failure.to_owned();
            if recorder.stops_run() {
                return Err(Failure::Record { message });
            }
            let mut status = self.shared.status();
            if status.notice.is_empty() {
                status.notice = message;
            }
            return Ok(());
        }
        recorder.raw(FrameMessage {
            utc_ns: 0,
            frame: frame.clone(),
        });
        let due = |since: Instant| since.elapsed() >= HEALTH_EVERY;
        if self.recorded_health.is_none_or(due) {
            self.record_health();
        }
        Ok(())
    }

    pub(super) fn record_health(&mut self) {
        self.recorded_health = Some(Instant::now());
        let conditions = ChannelConditions::of(&self.session);
        let counts = &self.continuity;
        let span = self.recent.front().zip(self.recent.back());
        let span = span.map_or(0.0, |(a, b)| b.duration_since(*a).as_secs_f64());
        let wrong = conditions.wrong.into_iter();
        let (wrong, reasons) = wrong.map(|wrong| (wrong.name, wrong.reason)).unzip();
        let message = HealthMessage {
            utc_ns: 0,
            device_time_ns: self.last.as_ref().map_or(0, |last| last.time_ns),
            accepted: counts.accepted,
            lost: self.lost().unwrap_or(counts.lost),
            late: counts.late,
            duplicate: counts.duplicate,
            repeated: counts.repeated,
            restarts: self.restarts(),
            clipped: self.clipped_frames,
            rate: self.recent.len().saturating_sub(1) as f64 / span,
            wrong,
            reasons,
        };
        if let Some(recorder) = &self.recorder {
            recorder.health(message);
        }
    }
}
