//! The columns of a frame: 64-bit words, each against the same word of the frame before.
//!
//! In:    poses or recorded frames, in order.
//! Out:   payloads of frame blocks, and the same back, bit for bit.
//! Keeps: [`Columns`], the words of the frame before.
//! Not here: checksums and files (`format`, `write`, `read`).
//!
//! ```text
//! flight      index, words: time, latitude, longitude, height, heading, pitch, roll
//! recording   index, count of views, words: time, four digests, then of each view: eye x y z,
//!             orientation x y z w, field of view, near distance, width | height << 32;
//!             count of arrivals, key of each against the key before; from version 2 on
//!             flags u8 (1: the level of detail was held; from version 4 on 2: a scene text follows,
//!             in force from this frame on, and repeated in every key frame)
//! ```
//!
//! The reference of a time is index / rate, so that a steady clock takes one byte a frame; that of
//! any other word is the same word one frame earlier, or 0 in a key frame and where there is none.

use crate::format::{KEY_EVERY, RecordedFrame, has_flags, has_scenes};
use crate::pose::Pose;
use crate::words::{Input, put_count, put_text, put_word};
use glam::{DQuat, DVec3};
use overfly_core::camera::View;
use overfly_core::datasource::PageKey;
use overfly_core::digest::FrameDigest;
use overfly_core::geodesy::{Ecef, Geodetic};
use overfly_core::units::Radians;

const POSE_WORDS: usize = 7;
const FRAME_WORDS: usize = 5;
const VIEW_WORDS: usize = 10;
/// The level of detail was held.
const HOLD_LOD: u8 = 1;
/// A scene text follows.
const SCENE: u8 = 2;

/// What the next frame refers to.
pub(crate) struct Columns {
    rate_hz: f64,
    /// Index of the next frame.
    pub(crate) index: u64,
    words: Vec<u64>,
    previous: Vec<u64>,
    /// The scene in force since it was changed, and what the frame last coded makes of it.
    scene: Option<String>,
    changed: Option<String>,
    /// No frame that was read has told the scene in force.
    untold: bool,
}

impl Columns {
    /// Before the first frame.
    pub(crate) fn new(rate_hz: f64) -> Self {
        Self {
            rate_hz,
            index: 0,
            words: Vec::new(),
            previous: Vec::new(),
            scene: None,
            changed: None,
            untold: false,
        }
    }

    /// Makes the frame last coded the one that the next refers to.
    pub(crate) fn advance(&mut self) {
        core::mem::swap(&mut self.words, &mut self.previous);
        if self.changed.is_some() {
            self.scene = self.changed.take();
        }
        self.index += 1;
    }

    /// Goes on with key frame `index`, which tells the scene in force anew.
    pub(crate) fn jump(&mut self, index: u64) {
        (self.index, self.scene, self.changed) = (index, None, None);
    }

    /// Has the next frame tell the scene in force, since those before it were skipped.
    pub(crate) fn skipped(&mut self) {
        self.untold = self.scene.is_some();
    }

    fn reference(&self, word: usize) -> u64 {
        if word == 0 {
            (self.index as f64 / self.rate_hz).to_bits()
        } else if self.index.is_multiple_of(KEY_EVERY) {
            0
        } else {
            self.previous.get(word).copied().unwrap_or(0)
        }
    }

    fn put_words(&self, out: &mut Vec<u8>) {
        for (i, &word) in self.words.iter().enumerate() {
            put_word(out, word, self.reference(i));
        }
    }

    fn take_words(&mut self, input: &mut Input<'_>, count: usize) -> Option<()> {
        self.words.clear();
        for i in 0..count {
            let word = input.word(self.reference(i))?;
            self.words.push(word);
        }
        Some(())
    }

    /// Appends the payload of a pose.
    pub(crate) fn encode_pose(&mut self, pose: &Pose, out: &mut Vec<u8>) {
        put_count(out, self.index);
        let Pose { time_s, at, heading, pitch, roll } = *pose;
        self.words.clear();
        self.words.extend(
            [time_s, at.lat_rad, at.lon_rad, at.height_m, heading.0, pitch.0, roll.0]
                .map(f64::to_bits),
        );
        self.put_words(out);
    }

    /// Appends the payload of a recorded frame.
    pub(crate) fn encode_frame(&mut self, frame: &RecordedFrame, out: &mut Vec<u8>) {
        put_count(out, self.index);
        put_count(out, frame.views.len() as u64);
        self.words.clear();
        self.words.push(frame.time_s.to_bits());
        self.words.extend(frame.digest.parts());
        for view in &frame.views {
            self.words.extend(view_words(view));
        }
        self.put_words(out);
        put_count(out, frame.arrived.len() as u64);
        let mut before = 0;
        for key in &frame.arrived {
            put_word(out, key.bits(), before);
            before = key.bits();
        }
        self.changed = frame.scene.clone().filter(|text| self.scene.as_ref() != Some(text));
        let is_key = self.index.is_multiple_of(KEY_EVERY);
        let scene = self.changed.as_ref().or(self.scene.as_ref().filter(|_| is_key));
        let flag = |set, bit| if set { bit } else { 0 };
        out.push(flag(frame.hold_lod, HOLD_LOD) | flag(scene.is_some(), SCENE));
        if let Some(text) = scene {
            put_text(out, text);
        }
    }

    /// Reads the index in front of a payload.
    pub(crate) fn decode_index(input: &mut Input<'_>) -> Option<u64> {
        input.count()
    }

    /// Reads a pose after its index.
    pub(crate) fn decode_pose(&mut self, input: &mut Input<'_>) -> Result<Pose, &'static str> {
        self.take_words(input, POSE_WORDS).ok_or("pose")?;
        let value = |i: usize| f64::from_bits(self.words[i]);
        Ok(Pose {
            time_s: value(0),
            at: Geodetic { lat_rad: value(1), lon_rad: value(2), height_m: value(3) },
            heading: Radians(value(4)),
            pitch: Radians(value(5)),
            roll: Radians(value(6)),
        })
    }

    /// Reads a recorded frame of a version after its index.
    pub(crate) fn decode_frame(
        &mut self,
        input: &mut Input<'_>,
        version: u32,
    ) -> Result<RecordedFrame, &'static str> {
        let views = input.count().and_then(|n| usize::try_from(n).ok()).ok_or("count of views")?;
        let words = views.checked_mul(VIEW_WORDS).and_then(|n| n.checked_add(FRAME_WORDS));
        // Every word takes at least a byte: so no count can make the reader reserve without end.
        let words = words.filter(|&n| n <= input.len()).ok_or("count of views")?;
        self.take_words(input, words).ok_or("views")?;
        let arrived = decode_arrivals(input).ok_or("arrivals")?;
        let flags = if has_flags(version) { input.byte() } else { Some(0) };
        let known = if has_scenes(version) { HOLD_LOD | SCENE } else { HOLD_LOD };
        let flags = flags.filter(|flags| flags & !known == 0).ok_or("flags")?;
        let scene = self.decode_scene(input, flags & SCENE != 0)?;
        let [_, pages, mesh, vertices, draws] =
            self.words[..FRAME_WORDS].try_into().expect("the frame's words were read");
        Ok(RecordedFrame {
            time_s: f64::from_bits(self.words[0]),
            views: self.words[FRAME_WORDS..].chunks_exact(VIEW_WORDS).map(view_of_words).collect(),
            arrived,
            hold_lod: flags & HOLD_LOD != 0,
            scene,
            digest: FrameDigest { pages, mesh, vertices, draws },
        })
    }
}

impl Columns {
    /// The scene that a frame changes to, or that was changed to in what was skipped.
    fn decode_scene(
        &mut self,
        input: &mut Input<'_>,
        follows: bool,
    ) -> Result<Option<String>, &'static str> {
        if follows {
            let text = input.text().ok_or("scene")?;
            self.changed = Some(text).filter(|text| self.scene.as_ref() != Some(text));
        }
        let untold = core::mem::take(&mut self.untold);
        Ok(self.changed.clone().or_else(|| self.scene.clone().filter(|_| untold)))
    }
}

fn decode_arrivals(input: &mut Input<'_>) -> Option<Vec<PageKey>> {
    let mut arrived = Vec::new();
    let mut before = 0;
    for _ in 0..input.count()? {
        before = input.word(before)?;
        arrived.push(PageKey::from_bits(before)?);
    }
    Some(arrived)
}

fn view_words(view: &View) -> [u64; VIEW_WORDS] {
    let [x, y, z] = view.eye.0.to_array().map(f64::to_bits);
    let [qx, qy, qz, qw] = view.orientation.to_array().map(f64::to_bits);
    let size = u64::from(view.size_px[0]) | u64::from(view.size_px[1]) << 32;
    [x, y, z, qx, qy, qz, qw, view.field_of_view.0.to_bits(), view.near_m.to_bits(), size]
}

fn view_of_words(words: &[u64]) -> View {
    let value = |i: usize| f64::from_bits(words[i]);
    let half = |bits: u64| u32::try_from(bits & 0xFFFF_FFFF).expect("32 bits");
    View {
        eye: Ecef(DVec3::new(value(0), value(1), value(2))),
        orientation: DQuat::from_xyzw(value(3), value(4), value(5), value(6)),
        field_of_view: Radians(value(7)),
        size_px: [half(words[9]), half(words[9] >> 32)],
        near_m: value(8),
    }
}
