//! What stands for pictures in a build without Vulkan.
//!
//! In:    what `picture` takes.
//! Out:   nothing.
//! Keeps: nothing.
//! Not here: anything.

use overfly::core::settings::SceneSettings;
use std::error::Error;

/// Draws nothing.
pub fn draw(_: &SceneSettings, _: [u32; 2], part: Option<&str>) -> Result<(), Box<dyn Error>> {
    let absent = |part| format!("this program was built without Vulkan, and so without {part}");
    part.map_or(Ok(()), |part| Err(absent(part).into()))
}
