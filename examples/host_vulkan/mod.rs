//! A small Vulkan program such as a simulator has: what is around overfly's draws.
//!
//! In:    a place to look from; triangles of its own.
//! Out:   pictures that it owns, drawn together with overfly.
//! Keeps: instance, device, queue, images, passes, command buffers.
//! Not here: what is shown (`own_vulkan.rs`, `cockpit.rs`).
//!
//! [`frames`] is the file to read: where overfly's calls stand among the host's. The others are
//! Vulkan as any program has it.

pub mod canvas;
pub mod frames;
pub mod host;
pub mod journey;
#[allow(dead_code, reason = "own_vulkan draws nothing of its own")]
pub mod solids;

/// What most of it returns: an example has nothing to decide on errors.
pub type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

/// Where to write the picture: what follows `--out`, else `default`.
pub fn out_file(default: &str) -> Outcome<std::path::PathBuf> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    match &words[..] {
        [] => Ok(default.into()),
        [flag, file] if flag == "--out" => Ok(file.into()),
        _ => Err(format!("usage: [--out FILE.png], not `{}`", words.join(" ")).into()),
    }
}

/// Writes the picture, says what the layer said, and makes an exit code of it.
pub fn finish(
    file: &std::path::Path,
    (pixels, [width, height]): (&[u8], [u32; 2]),
    messages: Option<&host::Messages>,
) -> Outcome<std::process::ExitCode> {
    image::save_buffer(file, pixels, width, height, image::ExtendedColorType::Rgba8)?;
    println!("{}", file.display());
    let Some(messages) = messages else {
        println!("validation layer: not installed");
        return Ok(std::process::ExitCode::SUCCESS);
    };
    let messages = messages.lock().map_err(|error| error.to_string())?;
    messages.iter().for_each(|message| println!("{message}"));
    println!("validation messages: {}", messages.len());
    Ok(if messages.is_empty() {
        std::process::ExitCode::SUCCESS
    } else {
        std::process::ExitCode::FAILURE
    })
}
