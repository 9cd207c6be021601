//! Which library this is.
//!
//! In:    nothing.
//! Out:   a number that grows.
//! Keeps: nothing.
//! Not here: the border's version, which is in the constructor's name (`terrain`).

/// Version of this library: major · 65536 + minor · 256 + patch.
#[unsafe(no_mangle)]
pub extern "C" fn ovf_version() -> u32 {
    let part = |text: &str| text.bytes().fold(0, |n, digit| 10 * n + u32::from(digit - b'0'));
    part(env!("CARGO_PKG_VERSION_MAJOR")) << 16
        | part(env!("CARGO_PKG_VERSION_MINOR")) << 8
        | part(env!("CARGO_PKG_VERSION_PATCH"))
}
