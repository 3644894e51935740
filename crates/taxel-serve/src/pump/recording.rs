//! What goes into the recording of a run, and recordings that clients begin and end.

use std::sync::Arc;
use std::time::{Duration, Instant};

use taxel::acquisition::Frame;
use taxel::shown;
use taxel_recording::mcap::{FrameMessage, HealthMessage, LinkMessage, MarkMessage, RestKind};

use super::{Failure, NewMark, Pump, RUNNING};
use crate::clock::Epoch;
use crate::condition::ChannelConditions;
use crate::link::LinkHandle;
use crate::record::Recorder;
use crate::tare::By;

/// Time from one record of losses and conditions to the next.
const HEALTH_EVERY: Duration = Duration::from_secs(1);

impl Pump {
    /// Notes what a person or a program says, at the newest frame or when it happened.
    pub(super) fn note(&mut self, mark: NewMark) {
        let NewMark { text, by, at } = mark;
        let time_ns = match at {
            Some(at) => self.device_time_ns(at),
            None => self.last.as_ref().map(|last| last.time_ns),
        };
        if let Some(recorder) = &self.recorder {
            let epoch = Epoch::of_process();
            recorder.mark(MarkMessage {
                utc_ns: at.map_or(0, |at| epoch.utc_ns_at(at)),
                host_ns: at.map(|at| epoch.since_ns(at)),
                device_time_ns: time_ns,
                text: text.clone(),
                by,
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

    /// Device time of a moment, ns, from the newest frame; `None` before the first. Of frames that stay away
    /// nothing is said.
    fn device_time_ns(&self, at: Instant) -> Option<u64> {
        let newest = self.last.as_ref()?.time_ns;
        let speed = if self.source.is_live() {
            1.0
        } else {
            self.options.speed
        };
        if !speed.is_finite() {
            return Some(newest);
        }
        let most = Duration::from_secs_f64(crate::stale_after(self.source.stream()));
        let then = self.newest_taken;
        let ahead = at.saturating_duration_since(then).min(most).as_secs_f64();
        let before = then.saturating_duration_since(at).as_secs_f64();
        let nanoseconds = |seconds: f64| (seconds * speed * 1e9) as u64;
        let time_ns = newest.saturating_add(nanoseconds(ahead));
        Some(time_ns.saturating_sub(nanoseconds(before)))
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
