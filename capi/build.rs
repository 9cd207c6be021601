//! The name by which programs that are linked with the shared library look for it.
//!
//! In:    the target.
//! Out:   a linker argument for the `cdylib`.
//! Keeps: nothing.
//! Not here: installing it (`cargo xtask capi`).

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let target = std::env::var("CARGO_CFG_TARGET_OS").unwrap_or_default();
    // Without it a program would look for the very path that it was linked with.
    if target == "linux" {
        println!("cargo::rustc-cdylib-link-arg=-Wl,-soname,liboverfly_c.so");
    }
}
