//! What is flown in the LEB workload: how fine, along which path, how fast.
//!
//! In:    words of a command line, frame numbers.
//! Out:   [`Preset`], [`Path`], [`Speed`], and the eye of [`Flight::eye`], the same bits anywhere.
//! Keeps: nothing.
//! Not here: the refinement rule (`recursion`).

use std::fmt;
use std::str::FromStr;

/// How fine the mesh is, named after its leaves on frame 0 of a cruise.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Preset {
    /// 49 806 leaves, the deepest at 23.
    L50k,
    /// 199 207 leaves, the deepest at 25.
    L200k,
    /// 989 961 leaves, the deepest at 27.
    L1M,
    /// 3 960 773 leaves, the deepest at 29.
    L4M,
    /// 15 842 692 leaves, the deepest at 31.
    L16M,
}

impl Preset {
    /// Every preset, coarsest first.
    pub const ALL: [Self; 5] = [Self::L50k, Self::L200k, Self::L1M, Self::L4M, Self::L16M];

    /// The word for it on a command line and in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::L50k => "50k",
            Self::L200k => "200k",
            Self::L1M => "1M",
            Self::L4M => "4M",
            Self::L16M => "16M",
        }
    }

    /// The square of the threshold, edge over distance: a longest edge of length e seen from d is
    /// split if e² > T²·d². From 1M on each preset has a quarter of the one before.
    pub const fn threshold_squared(self) -> f64 {
        match self {
            Self::L50k => 0.0025,
            Self::L200k => 0.000_625,
            Self::L1M => 0.000_125,
            Self::L4M => 0.000_031_25,
            Self::L16M => 0.000_007_812_5,
        }
    }

    /// Leaves and deepest leaf on frame 0 of a cruise.
    pub const fn cruise_start(self) -> (u64, u32) {
        match self {
            Self::L50k => (49_806, 23),
            Self::L200k => (199_207, 25),
            Self::L1M => (989_961, 27),
            Self::L4M => (3_960_773, 29),
            Self::L16M => (15_842_692, 31),
        }
    }
}

/// How the altitude goes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Path {
    /// At 1/64 all the time.
    Cruise,
    /// From 8/64 down to 1/64 over 600 frames, then level.
    Dive,
}

impl Path {
    /// Both paths.
    pub const ALL: [Self; 2] = [Self::Cruise, Self::Dive];

    /// The word for it on a command line and in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Cruise => "cruise",
            Self::Dive => "dive",
        }
    }

    /// The altitude on a frame, in sides of the square.
    fn height(self, frame: u32) -> f64 {
        match self {
            Self::Cruise => 1.0 / 64.0,
            Self::Dive => {
                let left = if frame < 600 { f64::from(600 - frame) / 600.0 } else { 0.0 };
                (1.0 / 64.0) * (1.0 + 7.0 * left)
            }
        }
    }
}

/// How far a frame goes over the ground.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Speed {
    /// 1/24000 of the side a frame: 250 m/s at 60 Hz over a square of 100 km.
    V1,
    /// Ten times that.
    V10,
}

impl Speed {
    /// Both speeds.
    pub const ALL: [Self; 2] = [Self::V1, Self::V10];

    /// The word for it on a command line and in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::V1 => "v1",
            Self::V10 => "v10",
        }
    }

    /// The step of one frame, in sides of the square.
    const fn step(self) -> f64 {
        match self {
            Self::V1 => 1.0 / 24_000.0,
            Self::V10 => 1.0 / 2_400.0,
        }
    }
}

/// One flight: a path at a speed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Flight {
    /// How the altitude goes.
    pub path: Path,
    /// How far a frame goes.
    pub speed: Speed,
}

impl Flight {
    /// The eye on a frame: x and y inside the unit square, then the altitude, in sides of the
    /// square. The operations and their order are part of the workload.
    pub fn eye(self, frame: u32) -> [f64; 3] {
        let s = self.speed.step() * f64::from(frame);
        [0.25 + 0.8 * s, 0.375 + 0.6 * s, self.path.height(frame)]
    }
}

/// A word that names no preset, path or speed.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct UnknownWord {
    what: &'static str,
    word: String,
    allowed: Vec<&'static str>,
}

impl fmt::Display for UnknownWord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { what, word, allowed } = self;
        write!(f, "no {what} is called {word:?}, allowed are {}", allowed.join(", "))
    }
}

impl std::error::Error for UnknownWord {}

/// The value whose name the word is.
fn named<T: Copy>(
    what: &'static str,
    word: &str,
    all: &[T],
    name: fn(T) -> &'static str,
) -> Result<T, UnknownWord> {
    let unknown = || UnknownWord {
        what,
        word: word.to_owned(),
        allowed: all.iter().copied().map(name).collect(),
    };
    all.iter().copied().find(|&value| name(value) == word).ok_or_else(unknown)
}

impl FromStr for Preset {
    type Err = UnknownWord;

    fn from_str(word: &str) -> Result<Self, UnknownWord> {
        named("preset", word, &Self::ALL, Self::name)
    }
}

impl FromStr for Path {
    type Err = UnknownWord;

    fn from_str(word: &str) -> Result<Self, UnknownWord> {
        named("path", word, &Self::ALL, Self::name)
    }
}

impl FromStr for Speed {
    type Err = UnknownWord;

    fn from_str(word: &str) -> Result<Self, UnknownWord> {
        named("speed", word, &Self::ALL, Self::name)
    }
}
