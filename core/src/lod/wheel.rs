//! Deadlines on odometers: for how much motion a diamond's side of a threshold is certain.
//!
//! In:    [`Lasts`] of a judged diamond; [`Motion`] since the last frame.
//! Out:   the bin of a deadline; the bins that are due.
//! Keeps: odometers and, for each bin, whether it holds anything.
//! Not here: how long a verdict lasts (`screen_error`), the ids themselves (`bins`).
//!
//! A verdict holds until the eye has moved far enough, or turned, or the threshold has drifted:
//! `path + scale·(turn + drift) < slack`. For diamonds of one *class*, scale ≤ u = 2^class, so
//! `path/u + turn + drift` is an odometer that serves them all. Deadlines on it lie in timing
//! wheels of 8 slots, one wheel an octave of slack over u: rounded down by at most a quarter of
//! the slack, never up. A frame reads a handful of odometers and empties the slots that they passed.
//!
//! Eyes mostly fly straight. A rule that knows the distance along the course may say how far the
//! eye can go on it, all paths included that stray from it a little: `forward + 64·aside < length`.
//! When the course turns by more than half a degree a new one begins; verdicts given on the one
//! before it count on, and those of the one before that become due.

use core::ops::Range;
use glam::DVec3;

/// What makes a verdict last.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Family {
    /// A leaf too far to be worth a split: counts path and the leaf threshold's fall.
    Far,
    /// A leaf that no view sees: also counts turns and the horizon's lift.
    Hidden,
    /// A parent that a view needs: path, turns, lift and the parent threshold's rise.
    Needed,
    /// A leaf or a parent, counted along the course: neither turns nor thresholds.
    Straight,
}

/// What a metre aside of the course counts.
pub const ASIDE: f64 = 64.0;

/// Cosine of half a degree: a course is kept while the eye's steps are this close to it.
const SAME_COURSE: f64 = 0.999_962;

/// For how much motion a verdict is certain.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Lasts {
    /// Which odometers count.
    pub family: Family,
    /// Not less than any distance that a turn or a drift is multiplied with, metres.
    pub scale_m: f64,
    /// How far the eye may move if nothing else happens, metres.
    pub slack_m: f64,
}

impl Lasts {
    /// For as long as odometers count.
    pub const FOREVER: Self =
        Self { family: Family::Far, scale_m: (1_u64 << 38) as f64, slack_m: f64::INFINITY };
}

/// What happened between two frames, the most of all views.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Motion {
    /// Way of the eye, metres.
    pub path_m: f64,
    /// The same as a vector; zero where there are several eyes and verdicts know no course.
    pub step_m: DVec3,
    /// Change of the horizon's tangent length, metres.
    pub lift_m: f64,
    /// Length of the change of a frustum plane's unit normal.
    pub turn: f64,
    /// Change of the pixels per radian over the lesser of both.
    pub zoom: f64,
}

impl Motion {
    /// Whether nothing at all has happened.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Whether odometers can count it: a finite motion, not as long as a way between planets.
    pub fn is_countable(&self) -> bool {
        self.path_m < 1e9 && self.lift_m < 1e9 && self.turn < 1e3 && self.zoom < 1e3
    }

    /// The greater of each.
    pub fn most(self, other: Self) -> Self {
        Self {
            path_m: self.path_m.max(other.path_m),
            step_m: DVec3::ZERO,
            lift_m: self.lift_m.max(other.lift_m),
            turn: self.turn.max(other.turn),
            zoom: self.zoom.max(other.zoom),
        }
    }
}

const FAMILIES: usize = 5;
const STRAIGHT: usize = Family::Straight as usize;
const CLASSES: usize = 64;
const OCTAVES: usize = 16;
const SLOT_BITS: u64 = 3;
const SLOTS: usize = 1 << SLOT_BITS;
const ALL_SLOTS: u32 = (1 << SLOTS) - 1;
/// Class 0 has u = 2⁻²⁴ m; the last 2³⁹ m, three times the way to the sun.
const CLASS_BIAS: i64 = 24;

/// A straight line and how far the eye has gone along and aside of it.
#[derive(Clone, Copy, Default)]
struct Course {
    axis: DVec3,
    forward_m: f64,
    aside_m: f64,
}

/// Bins that the wheels use, from 0.
pub const WHEEL_BINS: u32 = 5 * 64 * 16 * 8;

const _: () = assert!(WHEEL_BINS as usize == FAMILIES * CLASSES * OCTAVES * SLOTS);

/// A sum that is never too small, however little is added to however much.
fn up(sum: f64, step: f64) -> f64 {
    if step > 0.0 { (sum + step).next_up() } else { sum }
}

/// Odometers and wheels.
pub struct Wheels {
    path_m: f64,
    lift_m: f64,
    turn: f64,
    /// Fall of the leaf threshold and rise of the parent threshold, relative; zooms in both.
    drift: [f64; 2],
    /// This course and the one before.
    courses: [Course; 2],
    /// Which of both is this one.
    course: usize,
    /// The course in `course` has just begun: verdicts on the one that it replaced are due.
    is_new_course: bool,
    /// Which octaves of a class have a slot in use, by family and class.
    octaves: [u16; FAMILIES * CLASSES],
    /// Which slots are in use, by family, class and octave.
    slots: Vec<u32>,
    /// What the odometers say now, by family and class; all slots up to here are empty.
    readings: [f64; FAMILIES * CLASSES],
}

impl Wheels {
    /// Odometers at 0 and no deadlines.
    pub fn new() -> Self {
        Self {
            path_m: 0.0,
            lift_m: 0.0,
            turn: 0.0,
            drift: [0.0; 2],
            courses: [Course::default(); 2],
            course: 0,
            is_new_course: false,
            octaves: [0; FAMILIES * CLASSES],
            slots: vec![0; FAMILIES * CLASSES * OCTAVES],
            readings: [0.0; FAMILIES * CLASSES],
        }
    }

    /// Direction of the course, zero before the first motion, and how far the eye has gone on it.
    pub fn course(&self) -> (DVec3, f64) {
        let Course { axis, forward_m, .. } = self.courses[self.course];
        (axis, forward_m)
    }

    /// Counts a step along both courses, and begins a new one where it leaves this one.
    fn follow(&mut self, step_m: DVec3) {
        for course in &mut self.courses {
            let along_m = course.axis.dot(step_m);
            let forward_m = if along_m > 0.0 { along_m } else { 0.0 };
            course.forward_m = up(course.forward_m, forward_m * (1.0 + 1e-12));
            let aside_m = (step_m - course.axis * forward_m).length();
            course.aside_m = up(course.aside_m, aside_m * (1.0 + 1e-12) + forward_m * 1e-15);
        }
        let length_m = step_m.length();
        if length_m > 0.0 && self.course().0.dot(step_m) < SAME_COURSE * length_m {
            self.course = 1 - self.course;
            self.is_new_course = true;
            let axis = step_m / length_m;
            self.courses[self.course] = Course { axis, forward_m: 0.0, aside_m: 0.0 };
        }
    }

    /// Counts a motion.
    pub fn advance(&mut self, motion: &Motion) {
        self.follow(motion.step_m);
        self.path_m = up(self.path_m, motion.path_m);
        self.lift_m = up(self.lift_m, motion.lift_m);
        self.turn = up(self.turn, motion.turn);
        self.drift[0] = up(self.drift[0], motion.zoom);
        self.drift[1] = up(self.drift[1], motion.zoom);
    }

    /// Counts a fall of the threshold of leaves.
    pub fn leaf_threshold_fell(&mut self, from_px: f64, to_px: f64) {
        self.drift[0] = up(self.drift[0], (from_px - to_px) / to_px * (1.0 + 1e-12));
    }

    /// Counts a rise of the threshold of parents.
    pub fn parent_threshold_rose(&mut self, from_px: f64, to_px: f64) {
        self.drift[1] = up(self.drift[1], (to_px - from_px) / from_px * (1.0 + 1e-12));
    }

    fn reading(&self, family: usize, class: usize) -> f64 {
        if family >= STRAIGHT {
            let Course { forward_m, aside_m, .. } = self.courses[family - STRAIGHT];
            return (forward_m + ASIDE * aside_m) * unit_inverse(class);
        }
        let seen = [0.0, self.lift_m, self.lift_m][family];
        let turn = [0.0, self.turn, self.turn][family];
        let drift = self.drift[family / 2];
        (self.path_m + seen) * unit_inverse(class) + turn + drift
    }

    /// The bin of a deadline that starts now; `None` where the next motion may already be too
    /// much.
    #[inline]
    pub fn bin_of(&self, lasts: &Lasts) -> Option<u32> {
        let class = class_of(lasts.scale_m)?;
        let family = lasts.family as usize;
        let family = if family == STRAIGHT { family + self.course } else { family };
        let at = family * CLASSES + class;
        let reading = self.readings[at];
        let share = lasts.slack_m * unit_inverse(class);
        let share = if share > 1.0 { 1.0 } else { share };
        // Less by what rounding may add, here and in the readings to come.
        let share = share * (1.0 - 1e-6) - reading * 1e-13;
        let octave = octave_of(share)?;
        let slot = slot_of(tick(reading + share, octave));
        let bin = (at * OCTAVES + octave) * SLOTS + slot;
        Some(u32::try_from(bin).expect("bins are counted in u32"))
    }

    /// Notes that a bin is no longer empty.
    pub fn filled(&mut self, bin: u32) {
        let wheel = bin as usize / SLOTS;
        self.slots[wheel] |= 1 << (bin as usize % SLOTS);
        self.octaves[wheel / OCTAVES] |= 1 << (wheel % OCTAVES);
    }

    /// Notes that a bin has become empty.
    pub fn emptied(&mut self, bin: u32) {
        let wheel = bin as usize / SLOTS;
        self.slots[wheel] &= !(1 << (bin as usize % SLOTS));
        if self.slots[wheel] == 0 {
            self.octaves[wheel / OCTAVES] &= !(1 << (wheel % OCTAVES));
        }
    }

    /// Calls `empty` with every bin in use that the odometers have passed; they count as empty.
    /// Before a bin is passed, calls `ease` with it and the motions like this one that are left
    /// until then; `ease` tells whether it emptied the bin.
    pub fn pass(&mut self, mut empty: impl FnMut(u32), mut ease: impl FnMut(u32, f64) -> bool) {
        let replaced = core::mem::take(&mut self.is_new_course).then_some(STRAIGHT + self.course);
        for at in 0..FAMILIES * CLASSES {
            let reading = self.reading(at / CLASSES, at % CLASSES);
            let all = if replaced == Some(at / CLASSES) { ALL_SLOTS } else { 0 };
            let from = core::mem::replace(&mut self.readings[at], reading);
            let mut octaves = self.octaves[at];
            while octaves != 0 {
                let octave = octaves.trailing_zeros() as usize;
                octaves &= octaves - 1;
                let wheel = at * OCTAVES + octave;
                let passed = passed_slots(tick(from, octave), tick(reading, octave));
                self.empty_slots(wheel, self.slots[wheel] & (passed | all), &mut empty);
                self.ease_next(wheel, [from, reading], &mut ease);
            }
        }
    }

    /// Calls `ease` with the bin that a wheel passes next, if it is in use.
    fn ease_next(
        &mut self,
        wheel: usize,
        [from, reading]: [f64; 2],
        ease: &mut impl FnMut(u32, f64) -> bool,
    ) {
        let octave = wheel % OCTAVES;
        // A threshold that rises from 0 is an endless drift, which has passed everything.
        let next = tick(reading, octave).saturating_add(1);
        let slot = slot_of(next);
        if self.slots[wheel] >> slot & 1 == 0 {
            return;
        }
        let motions = (next as f64 * width(octave) - reading) / (reading - from);
        let bin = u32::try_from(wheel * SLOTS + slot).expect("bins are counted in u32");
        if motions > 1.0 && ease(bin, motions) {
            self.emptied(bin);
        }
    }

    /// Calls `empty` with every bin in use; they count as empty.
    pub fn pass_all(&mut self, mut empty: impl FnMut(u32)) {
        // Nobody's deadline is left, so the odometers may start anew.
        (self.path_m, self.lift_m, self.turn, self.drift) = (0.0, 0.0, 0.0, [0.0; 2]);
        for course in &mut self.courses {
            (course.forward_m, course.aside_m) = (0.0, 0.0);
        }
        self.is_new_course = false;
        for wheel in 0..self.slots.len() {
            self.empty_slots(wheel, self.slots[wheel], &mut empty);
        }
        for at in 0..FAMILIES * CLASSES {
            self.readings[at] = self.reading(at / CLASSES, at % CLASSES);
        }
    }

    fn empty_slots(&mut self, wheel: usize, mut due: u32, empty: &mut impl FnMut(u32)) {
        while due != 0 {
            let bin = wheel * SLOTS + due.trailing_zeros() as usize;
            due &= due - 1;
            let bin = u32::try_from(bin).expect("bins are counted in u32");
            empty(bin);
            self.emptied(bin);
        }
    }

    /// The bins of the wheels in use, for checks.
    pub fn in_use(&self) -> impl Iterator<Item = u32> + use<'_> {
        let bins: Range<u32> = 0..WHEEL_BINS;
        bins.filter(|&bin| self.slots[bin as usize / SLOTS] >> (bin as usize % SLOTS) & 1 == 1)
    }
}

impl Default for Wheels {
    fn default() -> Self {
        Self::new()
    }
}

/// 2^−class, exact.
#[inline]
fn unit_inverse(class: usize) -> f64 {
    f64::from_bits((1023 + CLASS_BIAS.unsigned_abs() - class as u64) << 52)
}

/// The class whose u is at least `scale_m`; `None` if there is none so large.
#[inline]
fn class_of(scale_m: f64) -> Option<usize> {
    let exponent = (scale_m.to_bits() >> 52).cast_signed() - 1023;
    let class = exponent + 1 + CLASS_BIAS;
    let fits = scale_m >= 0.0 && class < CLASSES as i64;
    fits.then(|| usize::try_from(class.max(0)).expect("clamped"))
}

/// The octave below which a share of u lies: 0 for [1/2, 1), …; `None` if it is too small.
#[inline]
fn octave_of(share: f64) -> Option<usize> {
    let below_one = 1022_i64 - (share.to_bits() >> 52).cast_signed();
    let fits = share > 0.0 && below_one < OCTAVES as i64;
    fits.then(|| usize::try_from(below_one.max(0)).expect("clamped"))
}

/// The tick of an octave's wheel in which a reading falls: 1/4 to 1/8 of a share of the octave.
#[inline]
fn tick(reading: f64, octave: usize) -> u64 {
    let per_unit = f64::from_bits((1023 + SLOT_BITS + octave as u64) << 52);
    #[expect(clippy::cast_possible_truncation, reason = "saturates where shares are lost anyway")]
    let tick = (reading * per_unit) as u64;
    tick
}

/// The slot of a tick.
#[inline]
fn slot_of(tick: u64) -> usize {
    usize::try_from(tick % SLOTS as u64).expect("below the number of slots")
}

/// The width of an octave's ticks.
#[inline]
fn width(octave: usize) -> f64 {
    f64::from_bits((1023 - SLOT_BITS - octave as u64) << 52)
}

/// The slots of the ticks after `from` up to and with `to`.
#[inline]
fn passed_slots(from: u64, to: u64) -> u32 {
    let count = to.saturating_sub(from);
    if count >= SLOTS as u64 {
        return ALL_SLOTS;
    }
    let run = ((1_u64 << count) - 1) << ((from + 1) % SLOTS as u64);
    u32::try_from((run | run >> SLOTS) & ((1_u64 << SLOTS) - 1)).expect("one bit a slot")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::digest::mix;

    fn unit(seed: u64) -> f64 {
        (mix(seed) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Random verdicts under random motion: none may be passed late, and none much too early.
    #[test]
    fn no_deadline_is_passed_late_and_none_much_more_than_a_quarter_too_early() {
        let mut wheels = Wheels::new();
        let mut pending: Vec<(u32, Lasts, f64, f64)> = Vec::new();
        let (mut path_m, mut drift, mut seed, mut early, mut done) = (0.0, 0.0, 0, 0, 0);
        for frame in 0..4_000_u64 {
            let motion = Motion { path_m: 3.0 * unit(frame), ..Motion::default() };
            let fall = if frame % 50 == 7 { 1e-3 } else { 0.0 };
            wheels.advance(&motion);
            wheels.leaf_threshold_fell(1.0 + fall, 1.0);
            (path_m, drift) = (path_m + motion.path_m, drift + fall);
            let mut due = Vec::new();
            wheels.pass(|bin| due.push(bin), |_, _| false);
            pending.retain(|&(bin, lasts, at_m, drifted)| {
                let used_m = path_m - at_m + lasts.scale_m * (drift - drifted);
                let is_due = due.contains(&bin);
                assert!(is_due || used_m < lasts.slack_m, "{lasts:?} is late: {used_m}");
                // Classes round the scale up by at most 2, so only the path is held exactly.
                let slow =
                    drift == drifted && used_m + 3.0 < 0.74 * lasts.slack_m.min(lasts.scale_m);
                early += u32::from(is_due && slow);
                done += u32::from(is_due);
                !is_due
            });
            for _ in 0..5 {
                seed += 3;
                let scale_m = 1e4 * unit(seed) + 1e-3;
                let slack_m = scale_m * unit(seed + 1) * unit(seed + 2);
                let lasts = Lasts { family: Family::Far, scale_m, slack_m };
                let bin = wheels.bin_of(&lasts);
                bin.into_iter().for_each(|bin| wheels.filled(bin));
                pending.extend(bin.map(|bin| (bin, lasts, path_m, drift)));
            }
        }
        assert_eq!(early, 0);
        assert!(done > 10_000, "{done}");
    }

    #[test]
    fn what_is_too_large_or_too_small_for_a_wheel_gets_no_bin() {
        let wheels = Wheels::new();
        let book = |scale_m, slack_m| {
            wheels.bin_of(&Lasts { family: Family::Hidden, scale_m, slack_m }).is_some()
        };
        assert!(book(100.0, 10.0) && book(100.0, 1e300) && book(0.0, 1.0) && book(5e11, 1e11));
        for (scale_m, slack_m) in [(100.0, 0.0), (100.0, -1.0), (100.0, 1e-4), (1e18, 1e17)] {
            assert!(!book(scale_m, slack_m), "{scale_m} {slack_m}");
        }
        for odd in [f64::NAN, f64::INFINITY, -1.0] {
            assert!(!book(odd, 1.0), "scale {odd}");
        }
        assert!(!book(1.0, f64::NAN));
    }

    #[test]
    fn a_pass_over_all_empties_all() {
        let mut wheels = Wheels::new();
        for step in 1..100 {
            let slack_m = f64::from(step);
            let lasts = Lasts { family: Family::Needed, scale_m: 1000.0, slack_m };
            wheels.filled(wheels.bin_of(&lasts).unwrap());
        }
        let before = wheels.in_use().count();
        let mut passed = 0;
        wheels.pass_all(|_| passed += 1);
        assert!(passed == before && before > 20 && wheels.in_use().count() == 0);
    }
}
