//! A replay under the control of clients: pause, step, speed, loop, and going to a time.

use serde::Serialize;
use taxel::estimation::TouchSession;

use crate::source::Source;

/// A source from its beginning, with an estimator that has seen nothing.
pub type Reopen = dyn Fn() -> Result<(Box<dyn Source>, TouchSession), String> + Send;

/// A recording that can be played again.
pub struct Replay {
    /// Device time of its first frame, ns.
    pub from_ns: u64,
    /// Device time of its last frame, ns.
    pub to_ns: u64,
    /// Opens it anew.
    pub reopen: Box<Reopen>,
}

/// Where a replay is, as the status has it.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct ReplayNow {
    pub(crate) from_ns: u64,
    pub(crate) to_ns: u64,
    pub(crate) at_ns: Option<u64>,
    pub(crate) paused: bool,
    /// `None` for as fast as possible.
    pub(crate) speed: Option<f64>,
    #[serde(rename = "loop")]
    pub(crate) looped: bool,
    pub(crate) ended: bool,
}

/// What a client asks of a replay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ReplayCommand {
    /// Stop at the frame that is shown, or go on.
    Pause(bool),
    /// Show the next frame, and stop there.
    Step,
    /// Go to this device time, ns: the frames before it are estimated as if they were played.
    Seek(u64),
    /// Device seconds per second.
    Speed(f64),
    /// Begin again at the end.
    Loop(bool),
}

/// A replay that is played.
pub(crate) struct Playing {
    pub(crate) replay: Replay,
    pub(crate) now: ReplayNow,
    /// One more frame although it is paused.
    step: bool,
    /// Begin again before the next frame.
    again: bool,
    /// Frames before this time are not shown, ns.
    goal_ns: Option<u64>,
}

impl Playing {
    pub(crate) fn new(replay: Replay, speed: f64) -> Self {
        Self {
            now: ReplayNow {
                from_ns: replay.from_ns,
                to_ns: replay.to_ns,
                at_ns: None,
                paused: false,
                speed: Some(speed).filter(|speed| speed.is_finite()),
                looped: false,
                ended: false,
            },
            replay,
            step: false,
            again: false,
            goal_ns: None,
        }
    }

    pub(crate) fn obey(&mut self, command: ReplayCommand) {
        match command {
            ReplayCommand::Pause(paused) => self.now.paused = paused,
            ReplayCommand::Step => {
                self.now.paused = true;
                self.step = true;
            }
            ReplayCommand::Seek(time_ns) => {
                let time_ns = time_ns.clamp(self.now.from_ns, self.now.to_ns);
                self.again |= self.now.ended || self.now.at_ns.is_some_and(|at| time_ns <= at);
                self.goal_ns = Some(time_ns);
            }
            ReplayCommand::Speed(speed) => {
                if speed > 0.0 && speed.is_finite() {
                    self.now.speed = Some(speed);
                }
            }
            ReplayCommand::Loop(looped) => self.now.looped = looped,
        }
    }

    /// True if the frame of this time is not to be waited for: it lies before the goal, or is
    /// the one that was stepped to or reaches the goal.
    pub(crate) fn is_due(&mut self, time_ns: u64) -> bool {
        if self.again || std::mem::take(&mut self.step) {
            return true;
        }
        match self.goal_ns {
            Some(goal) if time_ns < goal => true,
            Some(_) => {
                self.goal_ns = None;
                true
            }
            None => false,
        }
    }

    /// True while frames are passed over on the way to a time.
    pub(crate) fn passes_over(&self) -> bool {
        self.goal_ns.is_some()
    }

    /// True if it is to begin again before the next frame.
    pub(crate) fn begins_again(&self) -> bool {
        self.again
    }

    /// It has begun again.
    pub(crate) fn begun(&mut self) {
        self.again = false;
        self.now.ended = false;
        self.now.at_ns = None;
    }

    /// The last frame was shown; true if it goes on from the beginning.
    pub(crate) fn end(&mut self) -> bool {
        self.goal_ns = None;
        self.again |= self.now.looped;
        self.now.ended = !self.again;
        self.again
    }
}
