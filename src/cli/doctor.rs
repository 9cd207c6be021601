//! `overfly doctor`: what this machine has, what is missing, and how to get it.
//!
//! In:    the machine.
//! Out:   a report; exit code 0 if flights can be drawn, else 1.
//! Keeps: nothing.
//! Not here: installing anything (`cargo xtask`).

use overfly::render_vk;
use std::process::ExitCode;

/// The layer that tests need.
const VALIDATION: &str = "VK_LAYER_KHRONOS_validation";

/// Runs the command.
pub fn run() -> ExitCode {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    say!("cores       {cores}: `--workers {}` uses all of them", cores.saturating_sub(1));
    match render_vk::devices() {
        Ok(devices) if devices.is_empty() => return lacking("no Vulkan device"),
        Ok(devices) => {
            for device in devices {
                let render_vk::DeviceInfo { name, kind, driver, api_version } = device;
                say!("device      {name} ({kind}), {driver}, Vulkan {api_version}");
            }
        }
        Err(error) => return lacking(&error.to_string()),
    }
    match render_vk::layers() {
        Ok(layers) if layers.iter().any(|layer| layer == VALIDATION) => {
            say!("validation  {VALIDATION}");
        }
        Ok(_) => say!(
            "validation  missing: tests cannot check Vulkan use\n            \
             Debian, Ubuntu: apt-get install vulkan-validationlayers"
        ),
        Err(_) => say!("validation  unknown without a Vulkan loader"),
    }
    ExitCode::SUCCESS
}

fn lacking(what: &str) -> ExitCode {
    say!("device      none: {what}");
    say!("            everything but drawing works: replay with --no-render");
    say!("            Debian, Ubuntu: apt-get install libvulkan1 mesa-vulkan-drivers");
    ExitCode::from(super::NO_DEVICE)
}
