//! Fixes in order: times that go forwards, places that one can fly between.
//!
//! In:    fixes, how long a gap may be.
//! Out:   rows of each stretch that can be flown without a break; notes on all that was left out.
//! Keeps: nothing.
//! Not here: smoothing (`smooth`), choosing among stretches (the caller).

use crate::fixes::Fixes;
use crate::format::Format;
use core::fmt;
use glam::DVec3;
use overfly_core::geodesy::{Ellipsoid, Geodetic};

/// So many rows are looked ahead to tell a stray fix from a new stretch.
const AHEAD: usize = 5;
/// Fixes nearer in time than this are of one time.
const SAME_NS: i64 = 1_000_000;
/// A gap is this many usual intervals, and within these bounds in seconds.
const GAP_INTERVALS: f64 = 10.0;
const GAP_S: [f64; 2] = [60.0, 600.0];
/// A jump is this many times as fast as nine in ten of the steps, and at least so fast in m/s.
const JUMP_TIMES: f64 = 5.0;
const JUMP_LEAST_MPS: f64 = 100.0;
/// Receivers of transponders repeat a place until the next one comes, at most so long.
const STALE_NS: i64 = 10_000_000_000;
/// Transponders send places 0.4 s to 0.6 s apart (DO-260B); what comes sooner is the
/// one before, by way of another receiver.
const SQUITTER_NS: i64 = 350_000_000;
/// Steps that say how fast a recording is.
const STEPS_MAX: usize = 20_000;

/// What was left out or cut, how often, and where first.
#[derive(Clone, PartialEq, Debug)]
pub struct Note {
    /// What happened, after a count.
    pub what: String,
    /// How often; 0 where a count says nothing.
    pub count: usize,
    /// Line of the first, from 1.
    pub line: u32,
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { what, count, line } = self;
        match count {
            0 => write!(f, "line {line}: {what}"),
            1 => write!(f, "1 fix {what}, line {line}"),
            _ => write!(f, "{count} fixes {what}, the first in line {line}"),
        }
    }
}

/// Why a fix was left out.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Dropped {
    SameTime,
    Stale,
    Back,
    Ahead,
    Spike,
    Lonely,
}

const REASONS: [(Dropped, &str); 6] = [
    (Dropped::SameTime, "left out, being of the same time as the one before"),
    (Dropped::Stale, "left out, as repeating the place before by another way"),
    (Dropped::Back, "left out, since its time goes back"),
    (Dropped::Ahead, "left out, since its time runs ahead of those after it"),
    (Dropped::Spike, "left out, since nothing flies there and back so fast"),
    (Dropped::Lonely, "left out, being alone between gaps"),
];

/// What becomes of a fix.
enum Verdict {
    Keep,
    Drop(Dropped),
    /// Something new begins with it; why.
    Cut(String),
}

/// A fix, the last one kept, and some of those after it.
struct Place<'r> {
    last: usize,
    row: usize,
    ahead: &'r [usize],
}

/// Cleans a file.
pub(crate) struct Cleaner<'f> {
    fixes: &'f Fixes,
    places: Vec<DVec3>,
    gap_s: Option<f64>,
    /// Whether a place may be an old one, repeated.
    repeats: bool,
    dropped: Vec<(Dropped, u32)>,
    cuts: Vec<Note>,
}

/// Stretches as rows, in the order of the file; and notes.
pub(crate) fn clean(fixes: &Fixes, gap_s: Option<f64>) -> (Vec<Vec<usize>>, Vec<Note>) {
    let body = Ellipsoid::WGS84;
    // A height that is missing or a slip must not make a jump: places are on the ellipsoid.
    let place = |i: usize| {
        let (lat_rad, lon_rad) = (fixes.lat_rad[i], fixes.lon_rad[i]);
        body.ecef_from_geodetic(Geodetic { lat_rad, lon_rad, height_m: 0.0 }).0
    };
    let places = (0..fixes.track.len()).map(place).collect();
    let repeats = matches!(fixes.format, Format::AdsbCsv | Format::AdsbJson | Format::BaseStation);
    let mut cleaner =
        Cleaner { fixes, places, gap_s, repeats, dropped: Vec::new(), cuts: Vec::new() };
    let tracks = fixes.track.iter().fold(0, |most, &track| most.max(track));
    let mut rows: Vec<Vec<usize>> = vec![Vec::new(); usize::try_from(tracks).unwrap_or(0) + 1];
    for (row, &track) in fixes.track.iter().enumerate() {
        if let Some(rows) = rows.get_mut(usize::try_from(track).unwrap_or(0)) {
            rows.push(row);
        }
    }
    let mut stretches = Vec::new();
    for rows in rows.into_iter().filter(|rows| !rows.is_empty()) {
        cleaner.one(rows, &mut stretches);
    }
    let notes = cleaner.notes();
    (stretches, notes)
}

impl Cleaner<'_> {
    fn one(&mut self, rows: Vec<usize>, stretches: &mut Vec<Vec<usize>>) {
        for run in self.split(&rows, &|own, place| own.order(place)) {
            let gap_s = self.gap_s.unwrap_or_else(|| self.usual_gap_s(&run));
            let jump_mps = self.jump_mps(&run);
            let cut = self.split(&run, &|own, place| own.flyable(place, gap_s, jump_mps));
            let (flyable, lonely): (Vec<_>, Vec<_>) = cut.into_iter().partition(|s| s.len() > 1);
            stretches.extend(flyable);
            lonely.into_iter().flatten().for_each(|row| self.drop(Dropped::Lonely, row));
        }
    }

    /// Splits rows by a verdict on each but the first.
    fn split(
        &mut self,
        rows: &[usize],
        judge: &dyn Fn(&Self, Place<'_>) -> Verdict,
    ) -> Vec<Vec<usize>> {
        let mut parts = Vec::new();
        let mut part: Vec<usize> = Vec::new();
        for (i, &row) in rows.iter().enumerate() {
            let ahead = &rows[i + 1..(i + 1 + AHEAD).min(rows.len())];
            let verdict = match part.last() {
                Some(&last) => judge(self, Place { last, row, ahead }),
                None => Verdict::Keep,
            };
            match verdict {
                Verdict::Keep => part.push(row),
                Verdict::Drop(why) => self.drop(why, row),
                Verdict::Cut(what) => {
                    self.cuts.push(Note { what, count: 0, line: self.fixes.line[row] });
                    parts.push(core::mem::replace(&mut part, vec![row]));
                }
            }
        }
        parts.push(part);
        parts
    }

    fn drop(&mut self, why: Dropped, row: usize) {
        self.dropped.push((why, self.fixes.line[row]));
    }

    fn time(&self, row: usize) -> i64 {
        self.fixes.time_ns[row]
    }

    fn seconds(&self, from: usize, to: usize) -> f64 {
        (self.time(to) - self.time(from)) as f64 / 1e9
    }

    /// Time goes forwards. A fix out of order is left out where those after it go on from those
    /// before it; else something new begins with it.
    fn order(&self, Place { last, row, ahead }: Place<'_>) -> Verdict {
        let step_ns = self.time(row) - self.time(last);
        if step_ns.abs() < SAME_NS {
            return Verdict::Drop(Dropped::SameTime);
        }
        let is_same = self.places[row] == self.places[last];
        let stale_ns = if is_same { STALE_NS } else { SQUITTER_NS };
        if self.repeats && (0..stale_ns).contains(&step_ns) {
            return Verdict::Drop(Dropped::Stale);
        }
        if step_ns < 0 {
            let goes_on = ahead.iter().any(|&next| self.time(next) > self.time(last));
            if goes_on || ahead.is_empty() {
                return Verdict::Drop(Dropped::Back);
            }
            let back_s = -(step_ns as f64) / 1e9;
            return Verdict::Cut(format!("cut, since time goes back by {back_s:.1} s"));
        }
        let between =
            |&next: &usize| self.time(next) > self.time(last) && self.time(next) < self.time(row);
        let is_far = step_ns as f64 > GAP_S[0] * 1e9;
        if is_far && ahead.iter().any(between) {
            return Verdict::Drop(Dropped::Ahead);
        }
        Verdict::Keep
    }

    /// Steps between fixes, a few thousand at most.
    fn steps<'r>(run: &'r [usize]) -> impl Iterator<Item = (usize, usize)> + 'r {
        let every = run.len().div_ceil(STEPS_MAX).max(1);
        run.windows(2).step_by(every).map(|pair| (pair[0], pair[1]))
    }

    fn usual_gap_s(&self, run: &[usize]) -> f64 {
        let mut steps: Vec<f64> = Self::steps(run).map(|(a, b)| self.seconds(a, b)).collect();
        steps.sort_by(f64::total_cmp);
        let median = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
        (median * GAP_INTERVALS).clamp(GAP_S[0], GAP_S[1])
    }

    fn speed(&self, a: usize, b: usize) -> f64 {
        // Times are rounded, to seconds mostly: two fixes may be nearer than they say.
        self.places[a].distance(self.places[b]) / self.seconds(a, b).max(0.05)
    }

    fn jump_mps(&self, run: &[usize]) -> f64 {
        let mut speeds: Vec<f64> = Self::steps(run).map(|(a, b)| self.speed(a, b)).collect();
        speeds.sort_by(f64::total_cmp);
        let usual = speeds.get(speeds.len() * 9 / 10).copied().unwrap_or(0.0);
        // Of few steps one may be the jump itself.
        let usual =
            if speeds.len() < 10 { speeds.get(speeds.len() / 2).copied() } else { Some(usual) };
        (usual.unwrap_or(0.0) * JUMP_TIMES).max(JUMP_LEAST_MPS)
    }

    /// Fixes that one can fly between. One from which the next ones jump back is left out.
    fn flyable(&self, Place { last, row, ahead }: Place<'_>, gap_s: f64, jump_mps: f64) -> Verdict {
        let wait_s = self.seconds(last, row);
        if wait_s > gap_s {
            return Verdict::Cut(format!("cut, since there is no fix for {wait_s:.1} s"));
        }
        if self.speed(last, row) <= jump_mps {
            return Verdict::Keep;
        }
        if ahead.is_empty() || ahead.iter().any(|&next| self.speed(last, next) <= jump_mps) {
            return Verdict::Drop(Dropped::Spike);
        }
        let far_m = self.places[last].distance(self.places[row]);
        Verdict::Cut(format!("cut, since it jumps {far_m:.0} m in {wait_s:.1} s"))
    }

    fn notes(self) -> Vec<Note> {
        let mut notes = Vec::new();
        for (reason, what) in REASONS {
            let lines = || self.dropped.iter().filter(|(why, _)| *why == reason);
            if let Some(&(_, line)) = lines().next() {
                notes.push(Note { what: what.into(), count: lines().count(), line });
            }
        }
        notes.extend(self.cuts);
        notes
    }
}
