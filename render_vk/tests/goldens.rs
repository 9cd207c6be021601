//! Pictures as they were when somebody last looked at them.
//!
//! In:    the planet of `planet`; `tests/goldens`: a PNG a picture, `hashes.txt`.
//! Out:   exact hashes where driver and processor are in that list; else within a tolerance.
//! Keeps: nothing; `OVERFLY_MINT=1` writes PNGs of pictures that changed, and the hashes of this
//!        driver and processor beside those of others.
//! Not here: what pictures must show (`headless`).
//!
//! A software driver gives the same bits wherever it runs on the same processor, so a hash that
//! differs is a change of behaviour. It compiles shaders for the processor that it finds: between
//! two processors the same driver's pictures differed by 67.6 to 71.4 dB, with no pixel off by more
//! than 8 of 255. To accept a change: look at the new PNGs, and commit them with the reason.

mod planet;
#[expect(dead_code, reason = "settings and skipping only: there is a planet to draw")]
mod stage;

use glam::DVec3;
use overfly_core::camera::Camera;
use overfly_core::digest::mix;
use overfly_core::inspect::PatchInfo;
use overfly_core::mesh::Patches;
use overfly_core::scene::FrameParts;
use overfly_jobs::Team;
use overfly_render_vk::{Backdrop, Picture, Renderer, RendererSettings, Show};
use std::fs;
use std::path::PathBuf;

const SIZE_PX: [u32; 2] = [128, 72];
const BORDERS_M: [f64; 3] = [1.0, 1.6e6, 2.4e6];

/// Name, what is shown, from where.
type Golden = (&'static str, Show, fn() -> Camera);

/// Shaded ones last: they change with every shader.
const PICTURES: [Golden; 8] = [
    ("wireframe", Show::Wireframe, low_camera),
    ("level", Show::Level, low_camera),
    ("error", Show::ScreenError, low_camera),
    ("residency", Show::Residency, far_camera),
    ("normals", Show::Normals, far_camera),
    ("range", Show::DepthRange, low_camera),
    ("shaded_far", Show::Shaded, far_camera),
    ("shaded_low", Show::Shaded, low_camera),
];

fn far_camera() -> Camera {
    planet::camera(DVec3::new(0.8, 0.5, 0.33).normalize() * 2.2e7, DVec3::ZERO, SIZE_PX, 40.0)
}

fn low_camera() -> Camera {
    let eye = DVec3::new(0.8, 0.5, 0.33).normalize() * 7.6e6;
    planet::camera(eye, DVec3::new(0.7, 0.5, 0.53).normalize() * 6.36e6, SIZE_PX, 60.0)
}

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/goldens")
}

/// Something for each view to tell apart, by slot.
fn infos(patches: &Patches) -> Vec<PatchInfo> {
    let of = |slot: u32| {
        let [level, page_depth, lacking, error] =
            [13, 5, 3, 17].map(|n| u8::try_from(mix(u64::from(slot / 9)) % n).unwrap());
        PatchInfo { error_px: f32::from(error) / 8.0, level, page_depth, lacking, seen: 1 }
    };
    (0..patches.used_end()).map(of).collect()
}

fn draw(renderer: &mut Renderer, (show, camera): (Show, Camera), patches: &Patches) -> Vec<u8> {
    let sun_direction = Some(DVec3::new(1.0, 0.4, 0.3).normalize());
    let view = planet::draws(camera, patches, &BORDERS_M);
    let infos = infos(patches);
    let parts = FrameParts { sun_direction, sea: true };
    let shaded = show == Show::Shaded;
    // A plain one behind debug views, so that they change with their own shader only.
    let backdrop = if shaded { Backdrop::Sky } else { Backdrop::Colour([0.02, 0.03, 0.05]) };
    let of = Picture::of(&view, patches, &parts);
    let picture = Picture { show, infos: &infos, backdrop, ..of };
    renderer.draw(&picture, &Team::alone()).unwrap();
    renderer.read_pixels().unwrap()
}

fn hash(pixels: &[u8]) -> u64 {
    pixels.iter().fold(0, |hash, &byte| mix(hash ^ u64::from(byte)))
}

/// What a picture's bits hang on beside the program: the driver, and the processor as Linux has it.
fn machine(driver: &str) -> String {
    let text = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let facts = ["vendor_id", "cpu family", "model\t"].map(|name| {
        let line = text.lines().find(|line| line.starts_with(name));
        line.and_then(|line| line.split_once(": ")).map_or("?", |(_, fact)| fact)
    });
    format!("{driver} on {}", facts.join(" "))
}

/// Least likeness to the PNG where no hash is known, decibels, and the greatest share of far pixels.
fn tolerance(driver: &str) -> (f64, f64) {
    if driver.contains("llvmpipe") { (60.0, 0.0) } else { (45.0, 1e-3) }
}

/// Lines of `hashes.txt`: hash, picture, machine; in order of machines, then of pictures.
fn hashes() -> Vec<(String, String, String)> {
    let text = fs::read_to_string(folder().join("hashes.txt")).unwrap_or_default();
    let line = |line: &str| {
        let mut words = line.splitn(3, ' ').map(str::to_owned);
        (words.next().unwrap(), words.next().unwrap(), words.next().unwrap())
    };
    text.lines().map(line).collect()
}

fn mint(machine: &str, name: &str, pixels: &[u8], is_changed: bool) {
    fs::create_dir_all(folder()).unwrap();
    let mut lines = hashes();
    if is_changed {
        let [width, height] = SIZE_PX;
        let image = image::RgbaImage::from_raw(width, height, pixels.to_vec()).unwrap();
        image.save(folder().join(format!("{name}.png"))).unwrap();
        // Other machines have not drawn it yet.
        lines.retain(|(_, picture, _)| picture != name);
    }
    lines.retain(|(_, picture, of)| picture != name || of != machine);
    lines.push((format!("{:016x}", hash(pixels)), name.to_owned(), machine.to_owned()));
    let place = |name: &str| PICTURES.iter().position(|(picture, ..)| *picture == name);
    lines.sort_by_key(|(_, picture, machine)| (machine.clone(), place(picture)));
    let text: String = lines
        .iter()
        .map(|(hash, picture, machine)| format!("{hash} {picture} {machine}\n"))
        .collect();
    fs::write(folder().join("hashes.txt"), text).unwrap();
}

/// Peak signal to noise of the worst channel in decibels, and the share of pixels of which a
/// channel differs by more than 8 of 255.
fn difference(a: &[u8], b: &[u8]) -> (f64, f64) {
    assert_eq!(a.len(), b.len());
    let pixels = (a.len() / 4) as f64;
    let off = |a: u8, b: u8| f64::from(a.abs_diff(b));
    let both = || a.chunks_exact(4).zip(b.chunks_exact(4));
    let noise = |channel: usize| {
        both().map(|(a, b)| off(a[channel], b[channel])).map(|d| d * d).sum::<f64>() / pixels
    };
    let worst = [0, 1, 2].map(noise).into_iter().fold(1e-9, f64::max);
    let psnr_db = 10.0 * overfly_core::geodesy::trig::ln(255.0 * 255.0 / worst)
        / overfly_core::geodesy::trig::ln(10.0);
    let far = both().filter(|(a, b)| (0..3).any(|i| off(a[i], b[i]) > 8.0)).count();
    (psnr_db, far as f64 / pixels)
}

#[test]
fn pictures_are_as_they_were() {
    let settings =
        RendererSettings { patch_depth: planet::PATCH_DEPTH, ..stage::settings(SIZE_PX, 8 << 8) };
    let Some(mut renderer) = stage::renderer(&settings) else { return };
    let driver = renderer.device_line();
    let (machine, (least_db, most_far)) = (machine(&driver), tolerance(&driver));
    let patches = planet::patches(4, 4000.0);
    let known = hashes();
    let mut faults = Vec::new();
    for (name, show, camera) in PICTURES {
        let pixels = draw(&mut renderer, (show, camera()), &patches);
        let golden = image::open(folder().join(format!("{name}.png"))).ok();
        let likeness = golden.map(|golden| difference(&pixels, golden.into_rgba8().as_raw()));
        let (psnr_db, far) = likeness.unwrap_or((0.0, 1.0));
        let is_like = psnr_db >= least_db && far <= most_far;
        if std::env::var_os("OVERFLY_MINT").is_some() {
            mint(&machine, name, &pixels, !is_like);
            continue;
        }
        let found = format!("{:016x}", hash(&pixels));
        let expected = known.iter().find(|(_, picture, of)| picture == name && *of == machine);
        if expected.map_or(!is_like, |(hash, ..)| *hash != found) {
            faults.push(format!("{name}: {found}, {psnr_db:.1} dB, {:.2} % far", 100.0 * far));
        }
    }
    assert!(faults.is_empty(), "{machine}: {faults:#?}; OVERFLY_MINT=1 accepts what is new");
}

#[test]
fn differences_are_seen() {
    let a = vec![100_u8; 4 * 1000];
    let mut b = a.clone();
    assert!(difference(&a, &b).0 > 100.0);
    b[4..8].fill(120);
    let (psnr_db, far) = difference(&a, &b);
    assert!((52.0..53.0).contains(&psnr_db) && far == 1e-3, "{psnr_db} {far}");
    b.iter_mut().step_by(4).for_each(|red| *red = 102);
    assert!(difference(&a, &b).0 < 45.0);
}
