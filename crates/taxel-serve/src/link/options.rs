//! How a link is used, and who hears it.

use std::sync::Arc;

use super::heard::Heard;
use super::serial::SerialSettings;
use super::state::LinkStatus;
use super::wire::Greeting;

/// Hears what a link brings, in the thread of the link: it must not wait for anything.
pub trait LinkObserver: Send {
    /// Bytes as they arrived, ns since the program began.
    fn wire(&mut self, host_ns: u64, bytes: &[u8]);

    /// Nothing has arrived since; called again and again while that is so.
    fn quiet(&mut self, _host_ns: u64) {}

    /// The state has changed.
    fn link(&mut self, status: &LinkStatus);
}

/// What happens when a link is lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Reconnect {
    /// It is opened again, for ever.
    #[default]
    ForEver,
    /// The run ends.
    Once,
}

/// How a link is used.
pub struct LinkOptions {
    /// The link itself, where it was opened and heard before.
    pub heard: Option<Heard>,
    /// How a serial port is opened.
    pub serial: SerialSettings,
    /// What is said to the board.
    pub greeting: Greeting,
    /// What happens when it is lost.
    pub reconnect: Reconnect,
    /// Smallest and largest time, s, that it takes at least from a reading to the arrival of
    /// its last byte; `None` where it is not known.
    pub delay: Option<[f64; 2]>,
    /// Those who hear everything.
    pub observers: Vec<Box<dyn LinkObserver>>,
    /// Hears what the operator should know, one line each.
    pub tell: Arc<dyn Fn(&str) + Send + Sync>,
}

impl Default for LinkOptions {
    fn default() -> Self {
        Self {
            heard: None,
            serial: SerialSettings::default(),
            greeting: Greeting::default(),
            reconnect: Reconnect::ForEver,
            delay: None,
            observers: Vec::new(),
            tell: Arc::new(|_| ()),
        }
    }
}
