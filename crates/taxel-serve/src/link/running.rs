//! A running link: its thread, and the queue of what it hands out.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::address::LinkAddress;
use super::error::LinkError;
use super::options::LinkOptions;
use super::port::Link;
use super::reader::{Item, Reader};
use super::state::LinkHandle;
use super::way;
use super::wire::Decode;
use crate::clock::Epoch;

/// Frames that may wait for the pump: two seconds at 10 kHz.
const WAITING: usize = 20_000;
/// Longest wait for the end of the thread.
const FAREWELL: Duration = Duration::from_secs(5);

/// A link whose thread runs; dropped, it ends.
#[derive(Debug)]
pub(crate) struct Running {
    items: Receiver<Item>,
    status: LinkHandle,
    stop: Arc<AtomicBool>,
    origin: Instant,
    thread: Option<JoinHandle<()>>,
}

impl Running {
    /// Starts the thread of a link that misses frames after `stale_after`, s.
    pub(crate) fn start(
        address: LinkAddress,
        stale_after: f64,
        decoder: Box<dyn Decode>,
        options: LinkOptions,
    ) -> Result<Self, LinkError> {
        let baud = (!options.serial.native_usb).then_some(options.serial.baud);
        let baud = baud.filter(|_| matches!(address, LinkAddress::Serial(_)));
        let link: Box<dyn Link> = match options.heard {
            Some(heard) => Box::new(heard),
            None => way::link(address, options.serial, &options.tell),
        };
        let status = LinkHandle::new(link.name(), decoder.board(), decoder.wire_class());
        let stop = Arc::new(AtomicBool::new(false));
        let (sender, items) = sync_channel(WAITING);
        let origin = Epoch::of_process().at;
        let reader = Reader {
            link,
            decoder,
            greeting: options.greeting,
            reconnect: options.reconnect,
            stale_after: (stale_after * 1e9) as u64,
            baud,
            origin,
            status: status.clone(),
            observers: options.observers,
            tell: options.tell,
            items: sender,
            stop: Arc::clone(&stop),
        };
        let thread = std::thread::Builder::new()
            .name("link".into())
            .spawn(move || reader.run())
            .map_err(|cause| LinkError::Thread { cause })?;
        Ok(Self {
            items,
            status,
            stop,
            origin,
            thread: Some(thread),
        })
    }

    /// The status of the link.
    pub(crate) fn status(&self) -> LinkHandle {
        self.status.clone()
    }

    /// When the steady clock of the link was at zero.
    pub(crate) fn origin(&self) -> Instant {
        self.origin
    }

    /// What comes next; `None` if nothing comes within `patience`.
    pub(crate) fn receive(&self, patience: Duration) -> Option<Item> {
        match self.items.recv_timeout(patience) {
            Ok(item) => Some(item),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => Some(Item::End(None)),
        }
    }
}

impl Running {
    /// Ends the thread and closes the link.
    pub(crate) fn stop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let deadline = Instant::now() + FAREWELL;
        let Some(thread) = self.thread.take() else {
            return;
        };
        // The thread may wait in a full queue, and in the system for a port: not for ever.
        while !thread.is_finished() && Instant::now() < deadline {
            while self.items.try_recv().is_ok() {}
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.stop();
    }
}
