//! Paints a procedural planet as hill-shaded pictures, from the whole world down to 2 m.
//!
//! In:    `relief OUTDIR [earthlike|cratered|small] [SEED]`.
//! Out:   `world.png` and one picture per zoom in OUTDIR.
//! Keeps: nothing.
//! Not here: pages, LOD and Vulkan; only `Planet::sample` is looked at.

use std::error::Error;
use std::path::Path;

use glam::DVec3;
use image::{Rgb, RgbImage};
use overfly_core::datasource::procedural::{Planet, ProceduralSettings, Sample, Style};

const ZOOMS_M: [(&str, f64); 9] = [
    ("2000km", 2.0e6),
    ("400km", 4.0e5),
    ("200km", 2.0e5),
    ("60km", 6.0e4),
    ("20km", 2.0e4),
    ("2km", 2000.0),
    ("200m", 200.0),
    ("20m", 20.0),
    ("2m", 2.0),
];
const ZOOM_PIXELS: u32 = 768;

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().collect();
    let folder = args.get(1).map_or("relief", String::as_str);
    let name = args.get(2).map_or("earthlike", String::as_str);
    let seed = args.get(3).map_or(Ok(1), |text| text.parse::<u64>())?;
    let (style, radius_m) = match name {
        "cratered" => (Style::Cratered, 1_737_400.0),
        "small" => (Style::Earthlike, 1000.0),
        _ => (Style::Earthlike, 6_371_000.0),
    };
    let settings = ProceduralSettings { seed, radius_m, style, relief: 1.0, finest_m: 0.15 };
    let planet = Planet::new(&settings);
    std::fs::create_dir_all(folder)?;
    let view = View { planet: &planet, radius_m, style };
    paint_world(&view, &Path::new(folder).join(format!("{name}_world.png")))?;
    let targets = [("coast", find(&view, is_coast)), ("peak", find(&view, is_peak))];
    for (what, at) in targets {
        let sample = planet.sample(at);
        println!("{what}: {at} height {:.1} m", sample.height_m);
        for (zoom, width_m) in ZOOMS_M {
            if width_m < radius_m {
                let path = Path::new(folder).join(format!("{name}_{what}_{zoom}.png"));
                paint_zoom(&view, at, width_m, &path)?;
            }
        }
    }
    Ok(())
}

struct View<'a> {
    planet: &'a Planet,
    radius_m: f64,
    style: Style,
}

/// Prefers rugged ground at sea level.
fn is_coast(sample: &Sample) -> f64 {
    sample.ruggedness.min(0.3) * 60.0 - sample.height_m.abs()
}

/// Prefers height, and less so warmth, to see more than snow.
fn is_peak(sample: &Sample) -> f64 {
    sample.height_m * (0.3 + f64::from(sample.layers.temperature) / 255.0)
}

/// The best of many points spread over the planet.
fn find(view: &View, score: impl Fn(&Sample) -> f64) -> DVec3 {
    let mut best = (f64::MIN, DVec3::X);
    for i in 0..60_000 {
        let i = f64::from(i);
        let z = (i * 0.618_033_988_749_895).fract() * 1.6 - 0.8;
        let turn = (i * 0.754_877_666_246_693).fract();
        let n = direction(z, turn);
        let value = score(&view.planet.sample(n));
        if value > best.0 {
            best = (value, n);
        }
    }
    best.1
}

fn direction(z: f64, turn: f64) -> DVec3 {
    let longitude = turn * core::f64::consts::TAU;
    let flat = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(flat * libm::cos(longitude), flat * libm::sin(longitude), z)
}

fn paint_world(view: &View, path: &Path) -> Result<(), Box<dyn Error>> {
    let (width, height) = (2048, 1024);
    let at = |x: u32, y: u32| {
        let latitude = (0.5 - (f64::from(y) + 0.5) / f64::from(height)) * core::f64::consts::PI;
        direction(libm::sin(latitude), f64::from(x) / f64::from(width) - 0.5)
    };
    let pixel_m = view.radius_m * core::f64::consts::TAU / f64::from(width);
    paint(view, [width, height], pixel_m, &at).save(path)?;
    Ok(())
}

fn paint_zoom(view: &View, at: DVec3, width_m: f64, path: &Path) -> Result<(), Box<dyn Error>> {
    let east = DVec3::Z.cross(at).normalize();
    let north = at.cross(east);
    let pixel_m = width_m / f64::from(ZOOM_PIXELS);
    let centre = f64::from(ZOOM_PIXELS) * 0.5;
    let point = |x: u32, y: u32| {
        let right = (f64::from(x) - centre) * pixel_m / view.radius_m;
        let up = (centre - f64::from(y)) * pixel_m / view.radius_m;
        (at + east * right + north * up).normalize()
    };
    paint(view, [ZOOM_PIXELS; 2], pixel_m, &point).save(path)?;
    Ok(())
}

fn paint(view: &View, size: [u32; 2], pixel_m: f64, at: &dyn Fn(u32, u32) -> DVec3) -> RgbImage {
    let [width, height] = size;
    let row = |y: u32| (0..=width).map(|x| view.planet.sample(at(x, y))).collect::<Vec<_>>();
    let mut picture = RgbImage::new(width, height);
    let mut above = row(0);
    for y in 0..height {
        let below = row(y + 1);
        for x in 0..width {
            let i = x as usize;
            let (here, east, south) = (&above[i], &above[i + 1], &below[i]);
            let dx = (east.height_m - here.height_m) / pixel_m;
            let dy = (south.height_m - here.height_m) / pixel_m;
            picture.put_pixel(x, y, shade(view, here, (dx, dy), pixel_m));
        }
        above = below;
    }
    picture
}

/// Light from the north-west; far views exaggerate slopes as relief maps do.
fn shade(view: &View, here: &Sample, slope: (f64, f64), pixel_m: f64) -> Rgb<u8> {
    let boost = 1.0 + 12.0 * pixel_m / (pixel_m + 3000.0 * view.radius_m / 6.371e6);
    let flat = view.style == Style::Earthlike && here.height_m < 0.0;
    let boost = if flat { boost * 0.4 } else { boost };
    let (dx, dy) = (slope.0 * boost, slope.1 * boost);
    let light = (0.5 * dx + 0.5 * dy + 0.7) / (1.0 + dx * dx + dy * dy).sqrt();
    let light = 0.22 + 1.0 * light.max(0.0);
    let colour = match view.style {
        Style::Earthlike => earth_colour(here, view.radius_m),
        Style::Cratered => moon_colour(here),
    };
    Rgb(colour.map(|c| byte(c * light)))
}

#[expect(clippy::cast_possible_truncation, reason = "clamped to what a byte holds")]
fn byte(share: f64) -> u8 {
    (share * 255.0).clamp(0.0, 255.0) as u8
}

fn earth_colour(here: &Sample, radius_m: f64) -> [f64; 3] {
    let layers = here.layers;
    let [rock, moist] = [layers.rock, layers.moisture].map(|v| f64::from(v) / 255.0);
    let celsius = f64::from(layers.temperature) / 255.0 * 80.0 - 40.0;
    if here.height_m < 0.0 {
        let deepest_m = if radius_m > 1e5 { 5000.0 } else { 20.0 };
        let depth = (-here.height_m / deepest_m).min(1.0).sqrt();
        let sea = blend([0.22, 0.50, 0.58], [0.03, 0.10, 0.24], depth);
        return blend(sea, [0.85, 0.90, 0.95], step(-8.0, -14.0, celsius));
    }
    let grass = blend([0.62, 0.58, 0.33], [0.20, 0.38, 0.13], step(0.30, 0.75, moist));
    let soil = blend([0.78, 0.66, 0.44], grass, step(0.12, 0.40, moist));
    let cold = blend(soil, [0.45, 0.44, 0.34], step(6.0, -3.0, celsius));
    let bare = blend(cold, [0.46, 0.42, 0.38], step(0.35, 0.75, rock));
    let snow = step(-3.0, -9.0, celsius) * (1.0 - 0.75 * step(0.45, 0.8, rock));
    blend(bare, [0.80, 0.82, 0.86], snow)
}

fn moon_colour(here: &Sample) -> [f64; 3] {
    let [rock, mare] = [here.layers.rock, here.layers.moisture].map(|v| f64::from(v) / 255.0);
    let ground = blend([0.52, 0.51, 0.49], [0.25, 0.25, 0.26], mare);
    blend(ground, [0.85, 0.84, 0.82], step(0.4, 1.0, rock))
}

fn step(low: f64, high: f64, x: f64) -> f64 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

fn blend(a: [f64; 3], b: [f64; 3], share: f64) -> [f64; 3] {
    [0, 1, 2].map(|i| a[i] + (b[i] - a[i]) * share)
}
