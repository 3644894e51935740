//! The frames of a link as a source.

use std::time::{Duration, Instant};

use taxel::acquisition::{Frame, Stream};

use taxel_recording::mcap::ClockMessage;

use crate::link::{
    ClockRelation, ClockWatch, Decode, Item, LinkAddress, LinkError, LinkHandle, LinkOptions,
    Running,
};
use crate::record::{LinkRecorder, Recorder, RecorderSlot};
use crate::source::{Next, Source, SourceError};

/// Longest wait for a frame before commands are looked at.
const NAP: Duration = Duration::from_millis(20);

/// Frames decoded from the bytes of a link.
#[derive(Debug)]
pub struct LinkSource {
    stream: Stream,
    link: Running,
    newest_ns: u64,
    recorder: RecorderSlot,
    clock: ClockWatch,
    connects: u32,
}

impl LinkSource {
    /// Starts the thread of a link whose frames mean what `stream` says.
    ///
    /// # Errors
    /// [`LinkError::Thread`].
    pub fn start(
        address: LinkAddress,
        stream: Stream,
        decoder: Box<dyn Decode>,
        mut options: LinkOptions,
    ) -> Result<Self, LinkError> {
        let stale_after = crate::stale_after(&stream);
        let recorder = RecorderSlot::default();
        let clock = ClockWatch::new(options.delay);
        let observer = LinkRecorder::new(RecorderSlot::clone(&recorder));
        options.observers.push(Box::new(observer));
        Ok(Self {
            link: Running::start(address, stale_after, decoder, options)?,
            stream,
            newest_ns: 0,
            recorder,
            clock,
            connects: 0,
        })
    }

    /// The status of the link.
    pub fn status(&self) -> LinkHandle {
        self.link.status()
    }

    /// Follows the clock of the board.
    fn follow(&mut self, frame: &Frame) {
        let status = self.status();
        let Some(relation) = self.clock.push(frame, status.lost().is_some()) else {
            return;
        };
        status.lock().clock = Some(relation);
        if let Some(recorder) = self.recorder.get() {
            recorder.clock(message(
                &relation,
                frame.host_ns.unwrap_or(0),
                self.connects,
            ));
        }
    }
}

/// The relation as a recording keeps it; `arrival_ns` is that of the newest frame.
fn message(relation: &ClockRelation, arrival_ns: u64, segment: u32) -> ClockMessage {
    let nanoseconds = |seconds: Option<f64>| seconds.map_or(f64::NAN, |seconds| seconds * 1e9);
    ClockMessage {
        host_ns: arrival_ns,
        segment,
        device_time_ns: Some(relation.device_time_ns),
        offset_ns: relation.host_ns as f64 - relation.device_time_ns as f64,
        rate: 1.0 + relation.rate_difference,
        lower_ns: nanoseconds(relation.before_s),
        upper_ns: nanoseconds(Some(relation.behind_s)),
        ..ClockMessage::default()
    }
}

impl Source for LinkSource {
    fn stream(&self) -> &Stream {
        &self.stream
    }

    fn next(&mut self) -> Result<Next, SourceError> {
        match self.link.receive(NAP) {
            Some(Item::Frame(frame)) => {
                self.newest_ns = frame.time_ns;
                self.follow(&frame);
                Ok(Next::Frame(frame))
            }
            Some(Item::Reconnected) => {
                self.clock.reconnected();
                self.connects += 1;
                Ok(Next::Reconnected)
            }
            Some(Item::End(None)) => Ok(Next::End),
            Some(Item::End(Some(error))) => Err(error.into()),
            None => Ok(Next::Nothing(self.newest_ns)),
        }
    }

    fn arrival(&self, frame: &Frame) -> Option<Instant> {
        let since = Duration::from_nanos(frame.host_ns?);
        self.link.origin().checked_add(since)
    }

    fn taken(&self, frame: &Frame) -> Option<Instant> {
        let host_ns = self.clock.host_ns(frame.time_ns)?;
        self.link
            .origin()
            .checked_add(Duration::from_nanos(host_ns))
    }

    fn link(&self) -> Option<LinkHandle> {
        Some(self.status())
    }

    fn is_live(&self) -> bool {
        true
    }

    fn record_to(&mut self, recorder: Option<&Recorder>) {
        self.recorder.set(recorder);
    }

    fn stop(&mut self) {
        self.link.stop();
    }
}
