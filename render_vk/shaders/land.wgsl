// Ground under air: by height, slope and the hidden layers of moisture and temperature.

// ---- Ground colours: linear albedo ----
const SAND: vec3<f32> = vec3<f32>(0.40, 0.35, 0.23);
const DESERT: vec3<f32> = vec3<f32>(0.340, 0.272, 0.160);
const STEPPE: vec3<f32> = vec3<f32>(0.170, 0.146, 0.068);
const GRASS: vec3<f32> = vec3<f32>(0.078, 0.096, 0.034);
const FOREST: vec3<f32> = vec3<f32>(0.034, 0.052, 0.019);
const TUNDRA: vec3<f32> = vec3<f32>(0.118, 0.108, 0.072);
const ROCK: vec3<f32> = vec3<f32>(0.172, 0.166, 0.142);
const DARK_ROCK: vec3<f32> = vec3<f32>(0.095, 0.090, 0.086);
const SNOW: vec3<f32> = vec3<f32>(0.50, 0.525, 0.56);

const STRAW: vec3<f32> = vec3<f32>(1.22, 1.06, 0.84);  // factors on the colour of plants
const LEAVES: vec3<f32> = vec3<f32>(0.82, 0.98, 0.72);

// ---- Where they lie: pairs are (none of it, all of it) ----
const BEACH_M: vec2<f32> = vec2<f32>(9.0, 2.0);       // height
const STEPPE_WET: vec2<f32> = vec2<f32>(0.14, 0.34);  // moisture, 0 to 1
const GRASS_WET: vec2<f32> = vec2<f32>(0.30, 0.50);
const FOREST_WET: vec2<f32> = vec2<f32>(0.48, 0.72);
const GREEN_C: vec2<f32> = vec2<f32>(-3.0, 7.0);      // temperature where plants are green
const ROCK_SLOPE: vec2<f32> = vec2<f32>(0.10, 0.32);  // 1 - cosine of the slope
const ROCK_LAYER: vec2<f32> = vec2<f32>(0.45, 0.95);  // the rock layer, 0 to 1
const SNOW_C: vec2<f32> = vec2<f32>(-0.5, -4.5);      // temperature of snow on flat ground
const SNOW_SLOPE_C: f32 = 14.0;                       // a cliff must be this much colder
const SNOW_SLOPE: vec2<f32> = vec2<f32>(0.62, 0.34);  // too steep for snow to lie
const PATCHES: f32 = 0.09;                            // moisture, by the grain
const SNOW_PATCHES_C: f32 = 1.4;                      // temperature, by the grain

// Bands of rock along the height, bent by the grain.
fn strata(height_m: f32, grain: Grain, pixel_m: f32) -> f32 {
    let wide = sin(height_m * 0.071 + 2.5 * grain.broad.y) * exp(-pixel_m / 25.0);
    let narrow = sin(height_m * 0.43 + 4.0 * grain.broad.x + grain.fine.y) * exp(-pixel_m / 4.0);
    return 0.6 * wide + 0.4 * narrow;
}

// Plants by moisture and temperature: patches of the drier and the wetter kind.
fn plants(moisture: f32, celsius: f32, grain: Grain) -> Cover {
    let patchy = grain.broad.y + 0.6 * grain.fine.y;
    let wet = moisture + PATCHES * patchy;
    let steppe = Cover(STEPPE, 0.45, 0.0);
    let grass = Cover(GRASS, 0.40, 0.0);
    let forest = Cover(FOREST, 0.90, 0.0);
    var cover = covered(Cover(DESERT, 0.25, 1.0), steppe, ramp(STEPPE_WET, wet));
    cover = covered(cover, grass, ramp(GRASS_WET, wet));
    cover = covered(cover, forest, ramp(FOREST_WET, wet));
    cover = covered(Cover(TUNDRA, 0.55, 0.0), cover, ramp(GREEN_C, celsius + 3.0 * patchy));
    // Dry straw and fresh leaves, besides light and dark.
    let hue = mix(STRAW, LEAVES, clamp(0.5 + 0.5 * (grain.fine.y - grain.broad.x), 0.0, 1.0));
    cover.albedo *= hue * (1.0 + 0.24 * grain.broad.x + 0.34 * grain.fine.x);
    return cover;
}

fn cover_of(point: Point, slope: f32, grain: Grain, pixel_m: f32) -> Cover {
    let mottle = grain.broad.x + 0.6 * grain.fine.x;
    let celsius = point.layers.w * 80.0 - 40.0
        + SNOW_PATCHES_C * (grain.broad.x + 0.35 * grain.fine.x);
    var cover = plants(point.layers.z, celsius, grain);
    let sand = Cover(SAND * (1.0 + 0.10 * mottle + 0.07 * grain.ripple), 0.12, 1.0);
    cover = covered(cover, sand, ramp(BEACH_M, point.height_m + 1.5 * mottle));
    var stone = mix(ROCK, DARK_ROCK, clamp(point.layers.x * 0.8 + 0.4 * grain.broad.y, 0.0, 1.0));
    let bands = 0.22 * strata(point.height_m, grain, pixel_m) * smoothstep(0.02, 0.25, slope);
    stone *= 1.0 + bands + 0.16 * grain.broad.x + 0.32 * grain.fine.x;
    // Scree: loose stone lies in streaks between plants where the ground is half steep.
    let steep = ramp(ROCK_SLOPE, slope + 0.07 * mottle);
    let high = 0.8 * ramp(ROCK_LAYER, point.layers.y + 0.22 * mottle);
    cover = covered(cover, Cover(stone, 1.0, 0.0), max(steep, high));
    let lies = ramp(SNOW_SLOPE, slope + 0.10 * grain.fine.x);
    let snow = ramp(SNOW_C, celsius + SNOW_SLOPE_C * slope) * lies;
    let crust = SNOW * (1.0 + 0.05 * grain.broad.y + 0.07 * grain.fine.y);
    return covered(cover, Cover(crust, 0.16, 0.10), snow);
}
