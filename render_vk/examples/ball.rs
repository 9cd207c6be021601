//! Draws a small made-up planet from several places and writes the pictures: to look at shading.
//!
//! In:    a folder to write to; the current one if none is given.
//! Out:   PNG files; device, work and messages on standard output.
//! Keeps: nothing.
//! Not here: real terrain (the program `overfly`).

#[path = "../tests/planet/mod.rs"]
mod planet;

use glam::DVec3;
use overfly_core::camera::Camera;
use overfly_core::geodesy::{Ellipsoid, Geodetic};
use overfly_core::scene::FrameParts;
use overfly_core::settings::{DepthFormat, DepthOrder, VertexPrecision};
use overfly_jobs::{Team, now_ns};
use overfly_render_vk::{Picture, Renderer, RendererSettings};
use std::error::Error;
use std::path::{Path, PathBuf};

const SIZE_PX: [u32; 2] = [1280, 720];

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| ".".into()));
    let patches = planet::patches(5, 3000.0);
    let mut renderer = Renderer::new(&RendererSettings {
        patch_depth: planet::PATCH_DEPTH,
        patches_max: patches.used_end(),
        size_px: SIZE_PX,
        ranges_max: 3,
        depth_format: DepthFormat::D32F,
        depth_order: DepthOrder::Reversed,
        vertices: VertexPrecision::TwoFloat,
        morph_s: 0.0,
        tolerance_px: 1.0,
        keep_depth: false,
        frames_in_flight: 2,
        validation: false,
    })?;
    println!("{}", renderer.device_line());
    for (name, camera, parts) in scenes() {
        let draws = planet::draws(camera, &patches, &[1.0]);
        let mut report = renderer.draw(&Picture::of(&draws, &patches, &parts), &Team::alone())?;
        renderer.wait()?;
        let begin_ns = now_ns();
        for _ in 0..5 {
            report = renderer.draw(&Picture::of(&draws, &patches, &parts), &Team::alone())?;
        }
        renderer.wait()?;
        println!("{name}: {} µs, {report:?}", (now_ns() - begin_ns) / 5000);
        write(&folder, name, &renderer.read_pixels()?)?;
    }
    Ok(())
}

fn write(folder: &Path, name: &str, pixels: &[u8]) -> Result<(), Box<dyn Error>> {
    let path = folder.join(name).with_extension("png");
    let colour = image::ExtendedColorType::Rgba8;
    image::save_buffer(path, pixels, SIZE_PX[0], SIZE_PX[1], colour)?;
    Ok(())
}

fn scenes() -> Vec<(&'static str, Camera, FrameParts)> {
    let sun = |x, y, z| Some(DVec3::new(x, y, z).normalize());
    let from = |at: Geodetic, ahead_deg: f64, height_m: f64, fov_deg: f64| {
        let ahead = Geodetic::from_degrees(at.lat_rad.to_degrees() + ahead_deg, 20.0, height_m);
        let [eye, target] = [at, ahead].map(|p| Ellipsoid::WGS84.ecef_from_geodetic(p).0);
        planet::camera(eye, target, SIZE_PX, fov_deg)
    };
    let at = |lat_deg, height_m| Geodetic::from_degrees(lat_deg, 20.0, height_m);
    let earth = |sun_direction| FrameParts { sun_direction, sea: true };
    let moon = |sun_direction| FrameParts { sun_direction, sea: false };
    let (noon, low, dusk) = (sun(0.9, 0.1, 0.3), sun(0.05, 0.55, 0.85), sun(-0.62, 0.0, 0.77));
    vec![
        ("far", from(at(20.0, 2.2e7), 0.0, 0.0, 45.0), earth(sun(0.6, -0.6, 0.3))),
        ("orbit", from(at(30.0, 4e5), 14.0, 0.0, 60.0), earth(noon)),
        ("orbit_dusk", from(at(30.0, 4e5), 18.0, 4e4, 60.0), earth(dusk)),
        ("airliner", from(at(45.0, 1.1e4), 2.0, 4e3, 60.0), earth(noon)),
        ("airliner_low_sun", from(at(40.0, 1.1e4), 2.0, 6e3, 60.0), earth(low)),
        ("valley", from(at(40.0, 5e3), 1.0, 5e3, 60.0), earth(noon)),
        ("no_sun", from(at(45.0, 1.1e4), 2.0, 4e3, 60.0), earth(None)),
        ("airless", from(at(20.0, 2.2e7), 0.0, 0.0, 45.0), moon(sun(0.6, -0.6, 0.3))),
        ("airless_low", from(at(40.0, 3e4), 4.0, 0.0, 60.0), moon(low)),
    ]
}
