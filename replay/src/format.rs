//! The `.ovf` file: its header, its blocks, and when a recording fits a scene.
//!
//! In:    names, rates, the settings of a scene.
//! Out:   headers and blocks as bytes; differences of settings.
//! Keeps: nothing.
//! Not here: the words of a frame (`payload`), files (`write`, `read`).
//!
//! All numbers are little-endian. A *count* takes seven bits a byte; a *text* is a count and UTF-8.
//!
//! ```text
//! file    magic "OVERFLY\0", version u32, block 'H', any number of block 'F', block 'E'
//! block   marker u8, payload length u24, check u8 (marker ^ length bytes ^ A5),
//!         CRC-32 of the payload u32, payload
//! H       kind u8 (0 flight, 1 recording), name text, rate_hz f64, frames u64 (0: open-ended),
//!         settings digest u64, count of settings, (path text, value text) of each;
//!         in a recording the scene text
//! F       index count, then the columns: see the module `payload`
//! E       frames u64
//! ```
//!
//! | version | what came with it |
//! |---|---|
//! | 1 | flights, which are still written so; recordings without flags |
//! | 2 | recordings with a byte of flags at the end of each frame |
//! | 4 | recordings whose scene changes on the way; 3 is left out, for a flipped bit would make it 2 |
//!
//! There is no index: every [`KEY_EVERY`]-th frame refers to none before it, a block is known by its
//! checks wherever a reader lands, and a frame's block begins with its index. So any frame is found by
//! halving the file, without an end block as well, and behind damage.
//!
//! The check byte makes a damaged length look damaged: without it a length that points past the
//! end would be taken for a file that was cut off.

use crate::words::{Input, put_count, put_text};
use core::fmt;
use overfly_core::camera::View;
use overfly_core::datasource::PageKey;
use overfly_core::digest::FrameDigest;
use overfly_core::settings::SceneSettings;

/// The first bytes of every file.
pub const MAGIC: [u8; 8] = *b"OVERFLY\0";
/// The newest version; this crate reads all of them, and writes the oldest that holds the kind.
pub const VERSION: u32 = 4;
/// The first version.
const FIRST_VERSION: u32 = 1;
/// The first version whose frames may change the scene.
const SCENES_VERSION: u32 = 4;
/// Every frame whose index is a multiple of this refers to no earlier one.
pub const KEY_EVERY: u64 = 256;
/// Largest payload of a block in bytes.
pub const PAYLOAD_MAX: usize = (1 << 24) - 1;

/// The setting that scenes have had since there are morphs, and its value before: none.
const BEFORE_MORPHS: (&str, &str) = ("lod.morph_s", "0.0");

/// How the paths end under which a header lists what archives hold.
const CONTENT: &str = ".content";

pub(crate) const HEADER_MARK: u8 = b'H';
pub(crate) const FRAME_MARK: u8 = b'F';
pub(crate) const END_MARK: u8 = b'E';
/// Bytes of a block before its payload.
pub(crate) const BLOCK_HEAD: usize = 9;

/// What a file holds.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// Poses only: plays in any scene.
    Flight,
    /// Everything that went into each frame, and its digest: replays in its own scene only.
    Recording,
}

impl Kind {
    /// The version that a file of this kind is written in.
    pub(crate) fn version(self) -> u32 {
        match self {
            Self::Flight => FIRST_VERSION,
            Self::Recording => VERSION,
        }
    }
}

/// Whether this crate reads a version.
pub(crate) fn is_readable(version: u32) -> bool {
    matches!(version, FIRST_VERSION | 2 | VERSION)
}

/// Whether the frames of recordings of a version have flags.
pub(crate) fn has_flags(version: u32) -> bool {
    version > FIRST_VERSION
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Flight => "flight",
            Self::Recording => "recording",
        })
    }
}

/// Whether the frames of recordings of a version may change the scene.
pub(crate) fn has_scenes(version: u32) -> bool {
    version >= SCENES_VERSION
}

/// One frame of a recording: what went in, and what state it ended in.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct RecordedFrame {
    /// Time of the flight in seconds.
    pub time_s: f64,
    /// The views, as the host gave them.
    pub views: Vec<View>,
    /// The pages that arrived, in order.
    pub arrived: Vec<PageKey>,
    /// The mesh was held as it was; `false` in all recordings of version 1.
    pub hold_lod: bool,
    /// The scene file from this frame on, where it is another than before. Of frames that are read
    /// out of order the first tells the one in force, if that is not the header's.
    pub scene: Option<String>,
    /// What the frame ended in.
    pub digest: FrameDigest,
}

/// What a file says of itself before its frames.
#[derive(Clone, PartialEq, Debug)]
pub struct Header {
    /// Poses or frames.
    pub kind: Kind,
    /// Name of the flight.
    pub name: String,
    /// Frames a second, above zero and finite.
    pub rate_hz: f64,
    /// How many frames there will be; 0 where nobody knew when the file was begun.
    pub frames: u64,
    /// [`SceneSettings::digest`] of the recorded scene; 0 in a flight.
    pub settings_digest: u64,
    /// [`SceneSettings::listing`] of the recorded scene; empty in a flight.
    pub settings: Vec<(String, String)>,
    /// The scene file's text, so that a recording brings its scene; may be empty, and is in a
    /// flight.
    pub scene_text: String,
}

/// A setting in which a scene is not the recorded one.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Difference {
    /// Path of the setting, as in [`SceneSettings::listing`].
    pub path: String,
    /// Its value in the recording; `None` where it had none.
    pub recorded: Option<String>,
    /// Its value in the scene at hand; `None` where it has none.
    pub now: Option<String>,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let or_nothing = |value: &Option<String>| value.clone().unwrap_or("nothing".into());
        let (recorded, now) = (or_nothing(&self.recorded), or_nothing(&self.now));
        write!(f, "{}: recorded with {recorded}, now {now}", self.path)
    }
}

impl Header {
    /// The header of an open-ended flight.
    pub fn flight(name: &str, rate_hz: f64) -> Self {
        Self {
            kind: Kind::Flight,
            name: name.into(),
            rate_hz,
            frames: 0,
            settings_digest: 0,
            settings: Vec::new(),
            scene_text: String::new(),
        }
    }

    /// The header of an open-ended recording of `scene`.
    pub fn recording(name: &str, rate_hz: f64, scene: &SceneSettings) -> Self {
        Self {
            kind: Kind::Recording,
            settings_digest: scene.digest(),
            settings: scene.listing(),
            ..Self::flight(name, rate_hz)
        }
    }

    /// The same recording, over archives whose contents have these hashes, in the scene's order: it
    /// is refused over others. Without archives it is as it was.
    #[must_use]
    pub fn over_contents(mut self, contents: &[u64]) -> Self {
        self.settings.extend(listed(contents));
        self
    }

    /// Archives whose contents are not the recorded ones. Empty where the recording may be replayed
    /// as far as they go; always so for a flight.
    pub fn differs_from_contents(&self, contents: &[u64]) -> Vec<Difference> {
        if self.kind == Kind::Flight {
            return Vec::new();
        }
        let recorded = self.settings.iter().filter(|(path, _)| path.ends_with(CONTENT));
        differences(&recorded.cloned().collect::<Vec<_>>(), &listed(contents))
    }

    /// The settings of `scene` that are not the recorded ones, in the recording's order, then those
    /// that the recording lacks. Empty where it may be replayed; always so for a flight.
    ///
    /// A recording from before there were morphs replays in a scene that has none.
    pub fn differs_from(&self, scene: &SceneSettings) -> Vec<Difference> {
        if self.kind == Kind::Flight {
            return Vec::new();
        }
        let recorded = self.settings.iter().filter(|(path, _)| !path.ends_with(CONTENT));
        let mut recorded: Vec<_> = recorded.cloned().collect();
        let (path, value) = BEFORE_MORPHS;
        if recorded.iter().all(|(recorded, _)| recorded != path) {
            recorded.push((path.into(), value.into()));
        }
        differences(&recorded, &scene.listing())
    }

    /// The payload of the header block.
    pub(crate) fn encode(&self) -> Vec<u8> {
        let mut out = vec![u8::from(self.kind == Kind::Recording)];
        put_text(&mut out, &self.name);
        out.extend_from_slice(&self.rate_hz.to_bits().to_le_bytes());
        out.extend_from_slice(&self.frames.to_le_bytes());
        out.extend_from_slice(&self.settings_digest.to_le_bytes());
        put_count(&mut out, self.settings.len() as u64);
        for (path, value) in &self.settings {
            put_text(&mut out, path);
            put_text(&mut out, value);
        }
        if self.kind == Kind::Recording {
            put_text(&mut out, &self.scene_text);
        }
        out
    }

    /// Back from a payload; the name of the field that makes no sense otherwise.
    pub(crate) fn decode(payload: &[u8]) -> Result<Self, &'static str> {
        let mut input = Input::new(payload);
        let kind = match input.byte() {
            Some(0) => Kind::Flight,
            Some(1) => Kind::Recording,
            _ => return Err("kind"),
        };
        let name = input.text().ok_or("name")?;
        let rate_hz = f64::from_bits(input.u64().ok_or("rate")?);
        if !rate_is_usable(rate_hz) {
            return Err("rate");
        }
        let frames = input.u64().ok_or("frame count")?;
        let settings_digest = input.u64().ok_or("settings digest")?;
        let mut settings = Vec::new();
        for _ in 0..input.count().ok_or("settings")? {
            settings.push((input.text().ok_or("settings")?, input.text().ok_or("settings")?));
        }
        let scene_text = match kind {
            Kind::Flight => String::new(),
            Kind::Recording => input.text().ok_or("scene")?,
        };
        if input.len() != 0 {
            return Err("end of the header");
        }
        Ok(Self { kind, name, rate_hz, frames, settings_digest, settings, scene_text })
    }
}

/// What archives hold, as settings beside those of the scene, where they are listed first.
fn listed(contents: &[u64]) -> Vec<(String, String)> {
    let each = contents.iter().enumerate();
    each.map(|(i, hash)| (format!("sources[{i}]{CONTENT}"), format!("{hash:016x}"))).collect()
}

/// In the order of `recorded`, then what it lacks.
fn differences(recorded: &[(String, String)], now: &[(String, String)]) -> Vec<Difference> {
    let find = |list: &[(String, String)], path: &str| {
        list.iter().find(|(p, _)| p == path).map(|(_, value)| value.clone())
    };
    let mut differences = Vec::new();
    for (path, value) in recorded {
        let found = find(now, path);
        if found.as_ref() != Some(value) {
            let (path, recorded) = (path.clone(), Some(value.clone()));
            differences.push(Difference { path, recorded, now: found });
        }
    }
    for (path, value) in now {
        if find(recorded, path).is_none() {
            let (path, now) = (path.clone(), Some(value.clone()));
            differences.push(Difference { path, recorded: None, now });
        }
    }
    differences
}

/// Whether frames can be counted at this rate.
pub(crate) fn rate_is_usable(rate_hz: f64) -> bool {
    rate_hz.is_finite() && rate_hz > 0.0
}

/// The first bytes of a block; the payload is at most [`PAYLOAD_MAX`] bytes long.
pub(crate) fn block_head(marker: u8, payload: &[u8]) -> [u8; BLOCK_HEAD] {
    let length = u32::try_from(payload.len()).expect("a payload is below 2^24 bytes");
    let [a, b, c, _] = length.to_le_bytes();
    let [w, x, y, z] = crc32fast::hash(payload).to_le_bytes();
    [marker, a, b, c, check_byte(marker, [a, b, c]), w, x, y, z]
}

/// What the check byte of a block must be.
pub(crate) fn check_byte(marker: u8, length: [u8; 3]) -> u8 {
    0xA5 ^ marker ^ length[0] ^ length[1] ^ length[2]
}
