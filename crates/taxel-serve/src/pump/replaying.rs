//! A replay under the control of clients, and the last frame for those who come later.

use std::sync::atomic::Ordering;

use taxel::acquisition::FrameFlags;
use taxel::estimation::Continuity;

use super::{NAP, Pump};
use crate::condition::ConditionSender;
use crate::history::History;
use crate::message::{self, Health};
use crate::moved_rest::MovedRest;
use crate::replay::{Playing, Replay};
use crate::tare::{BaselineSender, Owed, TareHistory};

impl Pump {
    /// Lets clients control the replay.
    pub(crate) fn control(&mut self, replay: Replay) {
        self.playing = Some(Playing::new(replay, self.options.speed));
        self.tell_replay();
    }

    /// Puts where the replay is, and its frame while nothing comes, where the clients' tasks find them.
    pub(super) fn tell_replay(&mut self) {
        if self
            .playing
            .as_ref()
            .is_some_and(|playing| playing.now.paused)
        {
            self.keep_last_frame();
        } else {
            self.shared.status().last_frame = None;
        }
        if let Some(playing) = &self.playing {
            let mut status = self.shared.status();
            status.ended = playing.now.ended;
            status.replay = Some(playing.now.clone());
        }
    }

    /// Opens the recording anew, with an estimator that has seen nothing; false if that fails.
    pub(super) fn play_again(&mut self) -> bool {
        let Some(playing) = &mut self.playing else {
            return false;
        };
        let opened = (playing.replay.reopen)();
        playing.begun();
        match opened {
            Ok((source, session)) => (self.source, self.session) = (source, session),
            Err(message) => {
                self.shared.status().notice = message;
                self.shared.stop.store(true, Ordering::Relaxed);
                return false;
            }
        }
        self.continuity = Continuity::default();
        self.moved_rest = MovedRest::default();
        self.tares = TareHistory::new(&self.session, self.options.rest_from.as_deref());
        self.owed = Owed::default();
        self.rest_recorded = false;
        self.conditions = ConditionSender::default();
        self.baselines = BaselineSender::default();
        self.last = None;
        self.clock.origin = None;
        *self.shared.history() = History::new(self.session.meaning());
        self.shared.events().restart();
        self.forget_below_zero();
        self.tell_rest();
        self.tare_at_start();
        self.tell_replay();
        true
    }

    /// At the end of a replay that clients control: waits for one of them to go on.
    pub(super) fn goes_on_after_the_end(&mut self) -> bool {
        let Some(playing) = &mut self.playing else {
            return false;
        };
        playing.end();
        self.tell_replay();
        self.keep_last_frame();
        while !self.shared.stopped() {
            while let Ok(command) = self.commands.try_recv() {
                self.command(command);
            }
            if self.playing.as_ref().is_some_and(Playing::begins_again) {
                return true;
            }
            std::thread::sleep(NAP);
        }
        false
    }

    /// Keeps the last frame for whoever comes after the end, or while a replay is paused.
    pub(super) fn keep_last_frame(&mut self) {
        if self.last.is_none() {
            return;
        }
        let health = Health {
            continuity: &self.continuity,
            rate: 0.0,
            latency: f64::NAN,
            tared: self.session.estimator().is_tared(),
            capturing: self.session.capturing(),
            host_ns: None,
            flags: FrameFlags::default(),
            lost: self.lost(),
        };
        let touch = self.session.estimator().touch();
        let bytes = message::frame(touch, self.components, &health);
        self.shared.status().last_frame = Some(bytes);
    }
}
