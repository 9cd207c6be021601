//! What can go wrong, at start-up and while drawing.
//!
//! In:    failed calls of `vk`.
//! Out:   [`StartError`], [`DrawError`].
//! Keeps: nothing.
//! Not here: validation messages (`vk::messages`).

use ash::vk;
use core::fmt;

/// Why there is no renderer.
#[derive(Debug)]
pub enum StartError {
    /// The Vulkan loader is not installed.
    NoLibrary {
        /// What the system's loader of libraries said.
        reason: String,
    },
    /// There is a loader, but no driver with a usable device.
    NoDevice,
    /// Validation was asked for and the layer is not installed.
    NoLayer,
    /// The loader or every device is older than Vulkan 1.1.
    TooOld {
        /// The newest version found.
        found: String,
    },
    /// The best device lacks something that drawing needs.
    NoFeature {
        /// Vulkan's name of it.
        feature: &'static str,
    },
    /// The device has no depth buffer of the format that was asked for.
    NoDepthFormat {
        /// The format.
        format: &'static str,
    },
    /// There is no way to draw to this window.
    NoSurface {
        /// Why.
        reason: String,
    },
    /// What a host lends cannot be drawn with.
    Host {
        /// Which field of [`crate::HostDevice`] or [`crate::HostTarget`].
        field: &'static str,
        /// What it is.
        found: String,
        /// What is allowed.
        allowed: &'static str,
    },
    /// The driver does not keep float arithmetic as written: terrain would jitter.
    Contracted {
        /// How many of the test's answers were wrong.
        wrong: u32,
        /// Of how many.
        of: u32,
    },
    /// A setting is beyond what the renderer or the device can do.
    Setting {
        /// Which field of the settings.
        field: &'static str,
        /// What was asked for.
        found: u64,
        /// What is allowed.
        allowed: String,
    },
    /// This build was made without something that is asked for.
    Absent {
        /// What: a feature of this crate.
        part: &'static str,
    },
    /// A Vulkan call failed.
    Vulkan {
        /// The call.
        call: &'static str,
        /// What it returned.
        result: vk::Result,
    },
    /// The device has no memory left for something.
    Memory {
        /// For what.
        name: String,
        /// How many bytes.
        bytes: u64,
    },
}

/// Why a picture was not drawn or read. The renderer stays usable unless the device is lost.
#[derive(Debug)]
pub enum DrawError {
    /// The view is for pictures of another size than the renderer's.
    Size {
        /// Width and height of the view in pixels.
        view: [u32; 2],
        /// Width and height of the renderer's pictures.
        renderer: [u32; 2],
    },
    /// The view has more depth ranges than the settings allow.
    Ranges {
        /// Ranges of the view.
        found: usize,
        /// Allowed by the settings.
        max: u32,
    },
    /// The patch arena has another depth or more slots than the renderer's.
    Patches {
        /// Depth and slots of the arena.
        found: (u8, usize),
        /// Depth and slots of the renderer.
        renderer: (u8, u32),
    },
    /// A draw names a slot that is free or does not exist.
    Slot {
        /// The slot.
        slot: u32,
    },
    /// A host records a frame in flight that its renderer does not have.
    Frame {
        /// The host's index of it.
        found: u32,
        /// How many the renderer has.
        frames: u32,
    },
    /// A host records a depth range that the frame's view does not have.
    Range {
        /// Which one.
        found: usize,
        /// How many there are.
        ranges: usize,
    },
    /// A range draws more patches than the arena has.
    Draws {
        /// Patches of the range.
        found: usize,
        /// Slots of the renderer's arena.
        max: u32,
    },
    /// The arena has morphs and the renderer does not draw them, or the other way round.
    Morphs {
        /// Vertices of the arena that have one.
        found: usize,
    },
    /// The arena has drapes and the renderer no imagery, or the other way round.
    Drapes {
        /// Slots of the arena that have one.
        found: usize,
    },
    /// The new size is beyond what the device can draw.
    Resize(Box<StartError>),
    /// The depth is kept only where the settings ask for it.
    NoDepthKept,
    /// This renderer draws without a window.
    NoWindow,
    /// Nothing was drawn yet, so there is nothing to read.
    NothingDrawn,
    /// This build was made without something that is asked for.
    Absent {
        /// What: a feature of this crate.
        part: &'static str,
    },
    /// A Vulkan call failed.
    Vulkan {
        /// The call.
        call: &'static str,
        /// What it returned.
        result: vk::Result,
    },
    /// The device has no memory left for something.
    Memory {
        /// For what.
        name: String,
        /// How many bytes.
        bytes: u64,
    },
}

/// A failure of a call, whoever made it.
#[derive(Debug)]
pub(crate) enum Fault {
    Absent { part: &'static str },
    Call { call: &'static str, result: vk::Result },
    Memory { name: String, bytes: u64 },
}

/// For `map_err`: names the call that failed.
pub(crate) fn failed(call: &'static str) -> impl FnOnce(vk::Result) -> Fault {
    move |result| Fault::Call { call, result }
}

impl From<Fault> for StartError {
    fn from(fault: Fault) -> Self {
        match fault {
            Fault::Absent { part } => Self::Absent { part },
            Fault::Call { call, result } => Self::Vulkan { call, result },
            Fault::Memory { name, bytes } => Self::Memory { name, bytes },
        }
    }
}

impl From<Fault> for DrawError {
    fn from(fault: Fault) -> Self {
        match fault {
            Fault::Absent { part } => Self::Absent { part },
            Fault::Call { call, result } => Self::Vulkan { call, result },
            Fault::Memory { name, bytes } => Self::Memory { name, bytes },
        }
    }
}

impl fmt::Display for StartError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoLibrary { reason } => write!(
                f,
                "the Vulkan loader cannot be loaded ({reason}); \
                 on Debian it is the package libvulkan1"
            ),
            Self::NoDevice => write!(
                f,
                "no Vulkan device found; on Debian the package mesa-vulkan-drivers has drivers, \
                 one of which needs no graphics hardware"
            ),
            Self::NoLayer => write!(
                f,
                "the Vulkan validation layer is not installed; \
                 on Debian it is the package vulkan-validationlayers"
            ),
            Self::TooOld { found } => write!(f, "Vulkan {found} is too old, 1.1 is needed"),
            Self::NoFeature { feature } => write!(f, "the Vulkan device has no {feature}"),
            Self::NoDepthFormat { format } => {
                write!(f, "the Vulkan device cannot draw with depth.format {format}")
            }
            Self::NoSurface { reason } => write!(f, "cannot draw to the window: {reason}"),
            Self::Host { field, found, allowed } => {
                write!(f, "the host's {field} is {found}, allowed is {allowed}")
            }
            Self::Contracted { wrong, of } => write!(
                f,
                "the driver reorders float arithmetic: {wrong} of {of} two-sums are wrong"
            ),
            Self::Setting { field, found, allowed } => {
                write!(f, "renderer: {field} is {found}, allowed is {allowed}")
            }
            Self::Absent { part } => write_absent(f, part),
            Self::Vulkan { call, result } => write!(f, "{call} failed: {result}"),
            Self::Memory { name, bytes } => write_memory(f, name, *bytes),
        }
    }
}

impl fmt::Display for DrawError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Size { view, renderer } => write!(
                f,
                "the view is {} x {} pixels, the renderer's pictures are {} x {}",
                view[0], view[1], renderer[0], renderer[1]
            ),
            Self::Ranges { found, max } => {
                write!(f, "the view has {found} depth ranges, the renderer allows {max}")
            }
            Self::Patches { found, renderer } => write!(
                f,
                "the arena has {} patches of depth {}, the renderer {} of depth {}",
                found.1, found.0, renderer.1, renderer.0
            ),
            Self::Slot { slot } => write!(f, "the view draws slot {slot}, which holds no patch"),
            Self::Frame { found, frames } => {
                write!(f, "there is no frame {found} in flight, the renderer has {frames}")
            }
            Self::Range { found, ranges } => {
                write!(f, "there is no depth range {found}, the frame's view has {ranges}")
            }
            Self::Draws { found, max } => {
                write!(f, "a range draws {found} patches, the renderer has room for {max}")
            }
            Self::Morphs { found } => {
                write!(
                    f,
                    "the arena has {found} morphs, which is not what the renderer is made for"
                )
            }
            Self::Drapes { found } => {
                write!(
                    f,
                    "the arena has {found} drapes, which is not what the renderer is made for"
                )
            }
            Self::Resize(error) => error.fmt(f),
            Self::NoDepthKept => write!(f, "keep_depth is off, so no depth was kept"),
            Self::NoWindow => write!(f, "this renderer has no window"),
            Self::NothingDrawn => write!(f, "nothing was drawn yet"),
            Self::Absent { part } => write_absent(f, part),
            Self::Vulkan { call, result } => write!(f, "{call} failed: {result}"),
            Self::Memory { name, bytes } => write_memory(f, name, *bytes),
        }
    }
}

fn write_absent(f: &mut fmt::Formatter<'_>, part: &str) -> fmt::Result {
    write!(f, "this program was built without {part}: build overfly-render-vk with that feature")
}

fn write_memory(f: &mut fmt::Formatter<'_>, name: &str, bytes: u64) -> fmt::Result {
    write!(f, "no device memory left for {name} ({bytes} bytes)")
}

impl core::error::Error for StartError {}
impl core::error::Error for DrawError {}
