//! What the ground looks like, for who draws without our shaders.
//!
//! In:    hidden layers, height and slope of a vertex.
//! Out:   albedo; the light that it reflects; what a screen shows of that.
//! Keeps: nothing.
//! Not here: the air before the ground, waves and grain, which are the shaders' alone.
//!
//! The formulas and numbers are those of `render_vk/shaders` where the grain is 0,
//! which is its mean: so close ground has the same colour on the whole, without the speckle.
//! `tests/contracts/columns.rs` holds the numbers against the shader's text, and pictures against
//! pictures.

use crate::geodesy::narrow;
use crate::geodesy::trig::{exp, ln};

type Colour = [f32; 3];
/// None of it, all of it.
type Ends = [f32; 2];

const SAND: Colour = [0.40, 0.35, 0.23];
const DESERT: Colour = [0.340, 0.272, 0.160];
const STEPPE: Colour = [0.170, 0.146, 0.068];
const GRASS: Colour = [0.078, 0.096, 0.034];
const FOREST: Colour = [0.034, 0.052, 0.019];
const TUNDRA: Colour = [0.118, 0.108, 0.072];
const ROCK: Colour = [0.172, 0.166, 0.142];
const DARK_ROCK: Colour = [0.095, 0.090, 0.086];
const SNOW: Colour = [0.50, 0.525, 0.56];
const REGOLITH_DARK: Colour = [0.060, 0.058, 0.055];
const REGOLITH_BRIGHT: Colour = [0.170, 0.163, 0.152];
const STRAW: Colour = [1.22, 1.06, 0.84];
const LEAVES: Colour = [0.82, 0.98, 0.72];
const SHALLOW: Colour = [0.040, 0.130, 0.130];
const SHELF: Colour = [0.008, 0.042, 0.066];
const DEEP: Colour = [0.0022, 0.0095, 0.0280];

const BEACH_M: Ends = [9.0, 2.0];
const STEPPE_WET: Ends = [0.14, 0.34];
const GRASS_WET: Ends = [0.30, 0.50];
const FOREST_WET: Ends = [0.48, 0.72];
const GREEN_C: Ends = [-3.0, 7.0];
const ROCK_SLOPE: Ends = [0.10, 0.32];
const ROCK_LAYER: Ends = [0.45, 0.95];
const SNOW_C: Ends = [-0.5, -4.5];
const SNOW_SLOPE_C: f32 = 14.0;
const SNOW_SLOPE: Ends = [0.62, 0.34];
const SEA_ICE_C: Ends = [-7.0, -13.0];
const SHELF_M: f32 = 25.0;
const DEEP_M: f32 = 900.0;

const SUN_LIGHT: Colour = [20.0, 19.4, 18.4];
const EVEN_LIGHT: f32 = 0.34;
const AIRLESS_LIGHT: f32 = 0.012;
const SKY_LIGHT: Colour = [0.040, 0.058, 0.088];
const NIGHT_LIGHT: Colour = [0.050, 0.065, 0.105];
const TWILIGHT_COS: Ends = [-0.16, 0.22];
const RAYLEIGH: Colour = [4.3e-6, 9.8e-6, 22.0e-6];
const HAZE: Colour = [2.0e-6, 2.0e-6, 2.0e-6];
const SCALE_HEIGHT_M: f32 = 8000.0;
const EXPOSURE: f32 = 0.37;
/// The sine of the sun's elevation below which air no longer gets thicker here.
const LOWEST: f32 = 0.05;

/// Every number here that the shaders have too, under the shaders' name.
pub const SHARED: [(&str, &[f32]); 39] = [
    ("SAND", &SAND),
    ("DESERT", &DESERT),
    ("STEPPE", &STEPPE),
    ("GRASS", &GRASS),
    ("FOREST", &FOREST),
    ("TUNDRA", &TUNDRA),
    ("ROCK", &ROCK),
    ("DARK_ROCK", &DARK_ROCK),
    ("SNOW", &SNOW),
    ("REGOLITH_DARK", &REGOLITH_DARK),
    ("REGOLITH_BRIGHT", &REGOLITH_BRIGHT),
    ("STRAW", &STRAW),
    ("LEAVES", &LEAVES),
    ("SHALLOW", &SHALLOW),
    ("SHELF", &SHELF),
    ("DEEP", &DEEP),
    ("BEACH_M", &BEACH_M),
    ("STEPPE_WET", &STEPPE_WET),
    ("GRASS_WET", &GRASS_WET),
    ("FOREST_WET", &FOREST_WET),
    ("GREEN_C", &GREEN_C),
    ("ROCK_SLOPE", &ROCK_SLOPE),
    ("ROCK_LAYER", &ROCK_LAYER),
    ("SNOW_C", &SNOW_C),
    ("SNOW_SLOPE_C", &[SNOW_SLOPE_C]),
    ("SNOW_SLOPE", &SNOW_SLOPE),
    ("SEA_ICE_C", &SEA_ICE_C),
    ("SHELF_M", &[SHELF_M]),
    ("DEEP_M", &[DEEP_M]),
    ("SUN_LIGHT", &SUN_LIGHT),
    ("EVEN_LIGHT", &[EVEN_LIGHT]),
    ("AIRLESS_LIGHT", &[AIRLESS_LIGHT]),
    ("SKY_LIGHT", &SKY_LIGHT),
    ("NIGHT_LIGHT", &NIGHT_LIGHT),
    ("TWILIGHT_COS", &TWILIGHT_COS),
    ("RAYLEIGH", &RAYLEIGH),
    ("HAZE", &HAZE),
    ("SCALE_HEIGHT_M", &[SCALE_HEIGHT_M]),
    ("EXPOSURE", &[EXPOSURE]),
];

/// Linear albedo of a place, 0 to 1.
///
/// - `layers`, `height_m`: as a [`PatchVertex`](super::PatchVertex) has them.
/// - `slope`: 1 − cosine of the angle between the ground's normal and the vertical.
/// - `sea`: the scene has one. Then there are plants, beaches, snow and water, whose albedo is that
///   of its body: mirror the sky in it as you like. Else all is bare regolith.
pub fn albedo(layers: [u8; 4], height_m: f32, slope: f32, sea: bool) -> [f32; 3] {
    let layers = layers.map(|layer| f32::from(layer) / 255.0);
    let celsius = layers[3] * 80.0 - 40.0;
    match sea {
        false => regolith(layers),
        true if height_m < 0.0 => water(-height_m, celsius),
        true => land(layers, height_m, slope, celsius),
    }
}

fn land([rough, rock, moisture, _]: [f32; 4], height_m: f32, slope: f32, celsius: f32) -> Colour {
    let mut colour = mix(DESERT, STEPPE, ramp(STEPPE_WET, moisture));
    colour = mix(colour, GRASS, ramp(GRASS_WET, moisture));
    colour = mix(colour, FOREST, ramp(FOREST_WET, moisture));
    colour = mix(TUNDRA, colour, ramp(GREEN_C, celsius));
    let hue = mix(STRAW, LEAVES, 0.5);
    colour = [0, 1, 2].map(|i: usize| colour[i] * hue[i]);
    colour = mix(colour, SAND, ramp(BEACH_M, height_m));
    let stone = mix(ROCK, DARK_ROCK, (rough * 0.8).clamp(0.0, 1.0));
    let bare = ramp(ROCK_SLOPE, slope).max(0.8 * ramp(ROCK_LAYER, rock));
    colour = mix(colour, stone, bare);
    let snow = ramp(SNOW_C, celsius + SNOW_SLOPE_C * slope) * ramp(SNOW_SLOPE, slope);
    mix(colour, SNOW, snow)
}

fn regolith([rough, rock, moisture, _]: [f32; 4]) -> Colour {
    let fresh = 0.60 * rock + 0.20 * (rough - 0.5);
    mix(REGOLITH_DARK, REGOLITH_BRIGHT, (0.35 + fresh - 0.35 * moisture).clamp(0.0, 1.0))
}

fn water(depth_m: f32, celsius: f32) -> Colour {
    let left = |fades_m: f32| narrow(exp(-f64::from(depth_m / fades_m)));
    let body = mix(DEEP, mix(SHELF, SHALLOW, left(SHELF_M)), left(DEEP_M));
    mix(body, SNOW.map(|c| c * 0.8), ramp(SEA_ICE_C, celsius))
}

/// What ground of an albedo reflects where no sun shines, as the shaders have it: light from all
/// sides, more from above. `facing` is the cosine between the ground's normal and up at the eye.
pub fn evenly_lit(albedo: [f32; 3], facing: f32) -> [f32; 3] {
    let share = EVEN_LIGHT * (0.35 + 0.65 * (0.5 + 0.5 * facing)) / core::f32::consts::PI;
    [0, 1, 2].map(|i: usize| albedo[i] * (SUN_LIGHT[i] * share))
}

/// How ground faces the sun, and the sun the ground: cosines.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Facing {
    /// Between the ground's normal and the sun.
    pub normal_sun: f32,
    /// Between the normal and the vertical.
    pub normal_up: f32,
    /// Between the sun and the vertical.
    pub sun_up: f32,
}

/// What ground of an albedo reflects under a sun: `height_m` above the ellipsoid, `sea` as in
/// [`albedo`] (with one there is air).
///
/// As the shaders have it but for the moon at night, and for the light that air takes from the sun:
/// here air is flat, so that on the Earth green sunlight is 0.6 % too dark at an elevation of 30°,
/// 1.4 % at 20° and 22 % at 5°.
pub fn sunlit(albedo: [f32; 3], facing: Facing, height_m: f32, sea: bool) -> [f32; 3] {
    let risen = ramp([-0.01, 0.01], facing.sun_up);
    let open = 0.5 + 0.5 * facing.normal_up;
    let day = ramp(TWILIGHT_COS, facing.sun_up);
    let air_m = SCALE_HEIGHT_M * narrow(exp(-f64::from(height_m.max(0.0) / SCALE_HEIGHT_M)))
        / facing.sun_up.max(LOWEST);
    let pi = core::f32::consts::PI;
    [0, 1, 2].map(|i: usize| {
        let direct = SUN_LIGHT[i] * facing.normal_sun.max(0.0) * risen;
        if !sea {
            return albedo[i] * (direct + SUN_LIGHT[i] * AIRLESS_LIGHT * open) / pi;
        }
        let left = narrow(exp(-f64::from((RAYLEIGH[i] + HAZE[i]) * air_m)));
        let sky = (SUN_LIGHT[i] * SKY_LIGHT[i] * (day * day) + NIGHT_LIGHT[i]) * pi;
        albedo[i] * (direct * left + sky * open) / pi
    })
}

/// Linear light as a screen shows it: tone curve, then sRGB. Source: Narkowicz 2015; IEC 61966-2-1.
pub fn shown(light: [f32; 3]) -> [u8; 3] {
    light.map(|light| {
        let x = light * EXPOSURE;
        let toned = (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14);
        let linear = f64::from(toned.clamp(0.0, 1.0));
        let coded = if linear <= 0.003_130_8 {
            linear * 12.92
        } else {
            1.055 * exp(ln(linear) / 2.4) - 0.055
        };
        #[expect(clippy::cast_possible_truncation, reason = "rounded, 0 to 255")]
        let byte = (coded * 255.0).round() as u8;
        byte
    })
}

fn ramp([none, all]: Ends, x: f32) -> f32 {
    let t = ((x - none) / (all - none)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

fn mix(a: Colour, b: Colour, share: f32) -> Colour {
    [0, 1, 2].map(|i: usize| a[i] * (1.0 - share) + b[i] * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Layers of rough, rock, moisture and degrees Celsius.
    fn layers(rough: u8, rock: u8, moisture: u8, celsius: f32) -> [u8; 4] {
        #[expect(clippy::cast_possible_truncation, reason = "0 to 255 by construction")]
        let warmth = ((celsius + 40.0) / 80.0 * 255.0).round() as u8;
        [rough, rock, moisture, warmth]
    }

    #[test]
    fn ground_has_the_colour_of_what_it_is() {
        let green = albedo(layers(0, 0, 128, 20.0), 300.0, 0.0, true);
        assert!(green[1] > green[0] && green[1] > green[2], "{green:?}");
        assert_eq!(albedo(layers(0, 0, 128, -30.0), 300.0, 0.0, true), SNOW);
        assert_eq!(albedo(layers(0, 0, 128, 20.0), 1.0, 0.0, true), SAND);
        let deep = albedo(layers(0, 0, 0, 20.0), -9000.0, 0.0, true);
        assert!(deep.iter().zip(DEEP).all(|(found, c)| (found - c).abs() < 1e-3), "{deep:?}");
        let cliff = albedo(layers(255, 0, 128, 20.0), 300.0, 0.5, true);
        assert!(cliff.iter().zip(ROCK).all(|(found, c)| *found < c), "{cliff:?}");
        let moon = albedo(layers(0, 255, 0, -30.0), -300.0, 0.0, false);
        assert!(moon.iter().zip(REGOLITH_BRIGHT).all(|(found, c)| *found <= c), "{moon:?}");
    }

    #[test]
    fn screens_show_dark_as_0_and_bright_as_255_and_never_less_for_more() {
        assert_eq!((shown([0.0; 3]), shown([1e6; 3])), ([0; 3], [255; 3]));
        let steps: Vec<u8> = (0..2000_u16).map(|i| shown([f32::from(i) / 100.0; 3])[0]).collect();
        assert!(steps.is_sorted());
        assert!(evenly_lit(SAND, 1.0)[0] > evenly_lit(SAND, 0.0)[0]);
    }

    #[test]
    fn the_sun_lights_what_faces_it_and_a_low_one_is_red() {
        let lit = |normal_sun, sun_up, sea| {
            sunlit([0.5; 3], Facing { normal_sun, normal_up: 1.0, sun_up }, 0.0, sea)
        };
        assert!(lit(0.9, 0.9, true)[1] > lit(0.2, 0.9, true)[1]);
        let (low, high) = (lit(1.0, 0.1, true), lit(1.0, 1.0, true));
        assert!(low[2] / low[0] < 0.7 * high[2] / high[0], "{low:?} {high:?}");
        assert!(lit(1.0, -0.5, true)[0] > 0.0 && lit(1.0, -0.5, false)[0] < 0.05);
    }
}
