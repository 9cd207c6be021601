//! Draws a small made-up planet from several places and writes the pictures: to look at shading.
//!
//! In:    a folder to write to; the current one if none is given.
//! Out:   PNG files; device, times, how restless a flight is, and messages on standard output.
//! Keeps: nothing.
//! Not here: real terrain (the program `overfly`).

#[path = "../tests/planet/mod.rs"]
mod planet;

use glam::DVec3;
use overfly_core::camera::Camera;
use overfly_core::geodesy::{Ellipsoid, Geodetic};
use overfly_core::mesh::{PatchVertex, Patches};
use overfly_core::scene::FrameParts;
use overfly_core::settings::{DepthFormat, DepthOrder, VertexPrecision};
use overfly_jobs::{Team, now_ns};
use overfly_render_vk::{Picture, Renderer, RendererSettings};
use std::error::Error;
use std::path::{Path, PathBuf};

const SIZE_PX: [u32; 2] = [1280, 720];
const FOV_DEG: f64 = 60.0;
/// Pictures of one view that are timed.
const TIMES: usize = 5;
/// Pictures of a flight, pixels that the ground right below moves from one to the next, and the
/// height that it is flown at.
const FLIGHT: (u32, f64, f64) = (32, 0.05, 100.0);

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
        sea: false,
        sun: false,
        imagery: false,
        tolerance_px: 1.0,
        keep_depth: false,
        frames_in_flight: 2,
        validation: std::env::args().nth(2).is_some_and(|word| word == "validate"),
    })?;
    println!("{}", renderer.device_line());
    for (name, camera, parts) in scenes(&patches) {
        let draws = planet::draws(camera, &patches, &[1.0]);
        let mut times_us = Vec::new();
        for _ in 0..=TIMES {
            let begin_ns = now_ns();
            renderer.draw(&Picture::of(&draws, &patches, &parts), &Team::alone())?;
            renderer.wait()?;
            times_us.push((now_ns() - begin_ns) / 1000);
        }
        // The first one also uploads.
        times_us.remove(0);
        times_us.sort_unstable();
        println!("{name}: {} µs, at best {} µs", times_us[TIMES / 2], times_us[0]);
        write(&folder, name, &renderer.read_pixels()?)?;
    }
    println!("flight: {:.4} of 255 from picture to picture", flight(&mut renderer, &patches)?);
    renderer.validation_messages().iter().for_each(|message| println!("{message}"));
    Ok(())
}

/// Mean difference between consecutive pictures of a slow flight over even ground.
fn flight(renderer: &mut Renderer, patches: &Patches) -> Result<f64, Box<dyn Error>> {
    let (count, moved_px, height_m) = FLIGHT;
    let step_m = height_m * moved_px * FOV_DEG.to_radians() / f64::from(SIZE_PX[1]);
    let (from, ahead) = ground(patches, 0.55);
    let parts = FrameParts { sun_direction: Some(DVec3::new(0.9, 0.1, 0.3)), sea: true };
    let (mut before, mut sum) = (Vec::new(), 0);
    for number in 0..count {
        let eye = from + from.normalize() * height_m + ahead * (step_m * f64::from(number));
        let target = eye + ahead * 3.0 - from.normalize();
        let draws = planet::draws(planet::camera(eye, target, SIZE_PX, FOV_DEG), patches, &[1.0]);
        renderer.draw(&Picture::of(&draws, patches, &parts), &Team::alone())?;
        let now = renderer.read_pixels()?;
        let differences = now.iter().zip(&before).map(|(a, b)| u64::from(a.abs_diff(*b)));
        sum += differences.sum::<u64>();
        before = now;
    }
    // The fourth byte of a pixel never differs.
    let bytes = f64::from(SIZE_PX[0] * SIZE_PX[1] * 3) * f64::from(count - 1);
    #[expect(clippy::cast_precision_loss, reason = "a mean to look at")]
    let mean = sum as f64 / bytes;
    Ok(mean)
}

/// A place on dry ground whose moisture is nearest to `wet`, and the way to a neighbouring place.
fn ground(patches: &Patches, wet: f64) -> (DVec3, DVec3) {
    let place = |vertex: &PatchVertex| {
        let [hi, lo] =
            [vertex.position.hi, vertex.position.lo].map(|v| DVec3::from(v.map(f64::from)));
        hi + lo
    };
    let moisture = |vertex: &PatchVertex| f64::from(vertex.layers[2]) / 255.0;
    let off = |vertex: &PatchVertex| {
        let cold = f64::from(200_u8.saturating_sub(vertex.layers[3])) / 100.0;
        (moisture(vertex) - wet).abs() + cold
    };
    let per_patch = patches.vertices_per_patch as usize;
    let dry = patches
        .vertices
        .chunks(per_patch)
        .filter(|patch| patch.iter().all(|vertex| (300.0..1500.0).contains(&vertex.height_m)));
    let found = dry.min_by(|a, b| off(&a[4]).total_cmp(&off(&b[4])));
    let [from, to] = [4, 1].map(|at| place(&found.expect("the planet has dry ground")[at]));
    (from, (to - from).normalize())
}

fn write(folder: &Path, name: &str, pixels: &[u8]) -> Result<(), Box<dyn Error>> {
    let path = folder.join(name).with_extension("png");
    let colour = image::ExtendedColorType::Rgba8;
    image::save_buffer(path, pixels, SIZE_PX[0], SIZE_PX[1], colour)?;
    Ok(())
}

fn scenes(patches: &Patches) -> Vec<(&'static str, Camera, FrameParts)> {
    let sun = |x, y, z| Some(DVec3::new(x, y, z).normalize());
    let from = |at: Geodetic, ahead_deg: f64, height_m: f64, fov_deg: f64| {
        let ahead = Geodetic::from_degrees(at.lat_rad.to_degrees() + ahead_deg, 20.0, height_m);
        let [eye, target] = [at, ahead].map(|p| Ellipsoid::WGS84.ecef_from_geodetic(p).0);
        planet::camera(eye, target, SIZE_PX, fov_deg)
    };
    let above = |wet: f64, height_m: f64| {
        let (from, ahead) = ground(patches, wet);
        let up = from.normalize();
        let target = from + ahead * (4.0 * height_m);
        planet::camera(from + up * height_m, target, SIZE_PX, FOV_DEG)
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
        ("grass_2m", above(0.55, 2.0), earth(noon)),
        ("desert_2m", above(0.05, 2.0), earth(noon)),
        ("forest_30m", above(0.90, 30.0), earth(noon)),
        ("grass_100m", above(0.55, 100.0), earth(noon)),
        ("grass_1km", above(0.55, 1e3), earth(noon)),
        ("grass_10km", above(0.55, 1e4), earth(noon)),
        ("grass_100km", above(0.55, 1e5), earth(noon)),
        ("night_100m", above(0.55, 100.0), earth(sun(-0.9, -0.1, -0.3))),
        ("no_sun", from(at(45.0, 1.1e4), 2.0, 4e3, 60.0), earth(None)),
        ("airless", from(at(20.0, 2.2e7), 0.0, 0.0, 45.0), moon(sun(0.6, -0.6, 0.3))),
        ("airless_2m", above(0.55, 2.0), moon(noon)),
        ("airless_1km", above(0.55, 1e3), moon(noon)),
        ("airless_low", from(at(40.0, 3e4), 4.0, 0.0, 60.0), moon(low)),
    ]
}
