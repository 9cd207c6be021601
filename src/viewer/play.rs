//! Playing a flight: which frame is shown, and how that goes on.
//!
//! In:    play, pause, step, seek; time that passes.
//! Out:   the frame, always one that there is.
//! Keeps: [`Transport`].
//! Not here: what a frame shows (`track`), keys (`keys`).

/// How far one press of an arrow goes, in seconds.
const SEEK_S: f64 = 5.0;

/// Where to seek.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Seek {
    /// Five seconds back.
    Back,
    /// Five seconds on.
    On,
    /// The first frame.
    Start,
    /// The last.
    End,
}

/// A flight that plays, or stands still.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Transport {
    /// Index of the last frame.
    last: usize,
    rate_hz: f64,
    frame: usize,
    /// Part of the next frame that has passed.
    part: f64,
    playing: bool,
}

impl Transport {
    /// Plays `frames` frames, at least one, from the first on.
    pub fn new(frames: usize, rate_hz: f64) -> Self {
        Self { last: frames.saturating_sub(1), rate_hz, frame: 0, part: 0.0, playing: true }
    }

    /// The frame that is shown.
    pub fn frame(&self) -> usize {
        self.frame
    }

    /// Its time since the first, and the last one's, in seconds.
    pub fn times_s(&self) -> [f64; 2] {
        [self.frame, self.last].map(|frame| frame as f64 / self.rate_hz)
    }

    /// Whether it goes on by itself.
    pub fn playing(&self) -> bool {
        self.playing
    }

    /// Pauses, or plays; at the end from the beginning.
    pub fn toggle(&mut self) {
        self.playing = !self.playing;
        if self.playing && self.frame == self.last {
            self.show(0);
        }
    }

    /// Stands still from now on.
    pub fn pause(&mut self) {
        self.playing = false;
    }

    /// Pauses, so many frames on, or back.
    pub fn step(&mut self, frames: isize) {
        self.pause();
        self.show(self.frame.saturating_add_signed(frames));
    }

    /// Goes elsewhere, and on from there if it played.
    pub fn seek(&mut self, seek: Seek) {
        let far = frames_in(SEEK_S, self.rate_hz);
        self.show(match seek {
            Seek::Back => self.frame.saturating_sub(far),
            Seek::On => self.frame.saturating_add(far),
            Seek::Start => 0,
            Seek::End => self.last,
        });
    }

    /// Lets time pass. The last frame stays, paused.
    pub fn advance(&mut self, dt_s: f64) {
        if !self.playing {
            return;
        }
        let passed = self.part + dt_s.max(0.0) * self.rate_hz;
        let whole = frames_in(passed, 1.0);
        self.show(self.frame.saturating_add(whole));
        self.part = passed.fract();
        self.playing = self.frame < self.last;
    }

    fn show(&mut self, frame: usize) {
        self.frame = frame.min(self.last);
        self.part = 0.0;
    }
}

/// Whole frames in a time; what no counter holds is as good as the largest that fits.
fn frames_in(time_s: f64, rate_hz: f64) -> usize {
    let frames = (time_s * rate_hz).floor().clamp(0.0, f64::from(u32::MAX));
    #[expect(clippy::cast_possible_truncation, reason = "a whole number that u32 holds")]
    let frames = frames as u32;
    usize::try_from(frames).unwrap_or(usize::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_is_as_many_frames_as_the_rate_however_it_is_cut() {
        for (steps, dt_s) in [(4_u32, 0.25), (64, 1.0 / 64.0), (1024, 1.0 / 1024.0)] {
            let mut transport = Transport::new(1000, 60.0);
            (0..steps).for_each(|_| transport.advance(dt_s));
            assert_eq!(transport.frame(), 60);
        }
    }

    #[test]
    fn it_stops_at_the_last_frame_and_plays_again_from_the_first() {
        let mut transport = Transport::new(10, 60.0);
        transport.advance(1e300);
        assert_eq!((transport.frame(), transport.playing()), (9, false));
        transport.advance(1.0);
        assert_eq!(transport.frame(), 9);
        transport.toggle();
        assert_eq!((transport.frame(), transport.playing()), (0, true));
        transport.toggle();
        transport.advance(1.0);
        assert_eq!((transport.frame(), transport.playing()), (0, false));
    }

    #[test]
    fn steps_and_seeks_end_where_the_flight_ends() {
        let mut transport = Transport::new(1000, 60.0);
        transport.step(-1);
        assert_eq!((transport.frame(), transport.playing()), (0, false));
        transport.step(3);
        transport.seek(Seek::On);
        assert_eq!(transport.frame(), 303);
        transport.seek(Seek::End);
        transport.step(isize::MAX);
        assert_eq!(transport.frame(), 999);
        assert_eq!(transport.times_s(), [999.0 / 60.0; 2]);
        transport.seek(Seek::Back);
        assert_eq!(transport.frame(), 699);
        transport.seek(Seek::Start);
        transport.seek(Seek::Back);
        assert_eq!(transport.frame(), 0);
    }

    #[test]
    fn one_frame_alone_is_a_flight_too() {
        let mut transport = Transport::new(1, 60.0);
        transport.advance(1.0);
        transport.seek(Seek::On);
        transport.step(1);
        transport.toggle();
        transport.advance(f64::NAN);
        assert_eq!(transport.frame(), 0);
    }
}
