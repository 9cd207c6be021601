// The ground as one sees it: coloured by height, slope and hidden layers.

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
const REGOLITH_DARK: vec3<f32> = vec3<f32>(0.060, 0.058, 0.055);
const REGOLITH_BRIGHT: vec3<f32> = vec3<f32>(0.170, 0.163, 0.152);

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
const RIPPLED: f32 = 0.25;                            // slope of the ripples in sand
const SEA_ICE_C: vec2<f32> = vec2<f32>(-7.0, -13.0);

// ---- Water ----
const SHALLOW: vec3<f32> = vec3<f32>(0.040, 0.130, 0.130);
const SHELF: vec3<f32> = vec3<f32>(0.008, 0.042, 0.066);
const DEEP: vec3<f32> = vec3<f32>(0.0022, 0.0095, 0.0280);
const SHELF_M: f32 = 25.0;                            // depth at which shallow colours fade
const DEEP_M: f32 = 900.0;                            // depth at which the shelf's colours fade
const WAVES: f32 = 0.17;                              // slope of the waves: width of the glint
const GLINT: f32 = 0.22;
const REFLECTED_SKY: vec3<f32> = vec3<f32>(0.030, 0.044, 0.062); // per SUN_LIGHT

// ---- Light without a sun or without air ----
const EVEN_LIGHT: f32 = 0.34;                         // of SUN_LIGHT, from all sides
const MOON_ASIDE: f32 = 1.2;                          // tangent of the moon's way off the sun's axis
const AIRLESS_LIGHT: f32 = 0.012;                     // light of the ground on the ground

fn ramp(ends: vec2<f32>, x: f32) -> f32 {
    let t = clamp((x - ends.x) / (ends.y - ends.x), 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

// What a piece of ground is made of.
struct Cover {
    albedo: vec3<f32>,
    rough: f32,                   // how much of the grain's tilt it has
    rippled: f32,                 // how much of the ripples
}

fn covered(under: Cover, over: Cover, amount: f32) -> Cover {
    return Cover(
        mix(under.albedo, over.albedo, amount),
        mix(under.rough, over.rough, amount),
        mix(under.rippled, over.rippled, amount),
    );
}

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

fn land(point: Point, slope: f32, grain: Grain, pixel_m: f32) -> Cover {
    let mottle = grain.broad.x + 0.6 * grain.fine.x;
    let celsius = point.layers.w * 80.0 - 40.0 
        + SNOW_PATCHES_C * (grain.broad.x + 0.35 * grain.fine.x);
    var cover = plants(point.layers.z, celsius, grain);
    let sand = Cover(SAND * (1.0 + 0.10 * mottle + 0.07 * grain.ripple), 0.12, 1.0);
    cover = covered(cover, sand, ramp(BEACH_M, point.height_m + 1.5 * mottle) * view.sea);
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

fn regolith(layers: vec4<f32>, grain: Grain) -> Cover {
    // Rock is young and bright; where there is water elsewhere, there are dark maria here.
    let fresh = 0.60 * layers.y + 0.20 * (layers.x - 0.5);
    let mottle = 0.10 * grain.broad.y + 0.07 * grain.fine.y;
    let bright = clamp(0.35 + fresh - 0.35 * layers.z + mottle, 0.0, 1.0);
    let stone = mix(REGOLITH_DARK, REGOLITH_BRIGHT, bright);
    return Cover(stone * (1.0 + 0.10 * grain.broad.x + 0.16 * grain.fine.x), 0.42, 0.0);
}

// Light of sun and sky on ground of this normal, over pi.
fn lit(normal: vec3<f32>, up: vec3<f32>, height_m: f32) -> vec3<f32> {
    if view.sun_on == 0.0 {
        let facing = 0.5 + 0.5 * dot(normal, view.eye_up);
        return SUN_LIGHT * (EVEN_LIGHT * (0.35 + 0.65 * facing) / PI);
    }
    let sun_cos = dot(view.sun, up);
    // The body itself hides the sun behind its horizon; softened over the sun's width.
    let risen = smoothstep(-0.01, 0.01, sun_cos);
    let direct = sunlight(height_m, max(sun_cos, 0.0)) * (max(dot(normal, view.sun), 0.0) * risen);
    let open = 0.5 + 0.5 * dot(normal, up);
    if view.air == 0.0 { return (direct + SUN_LIGHT * AIRLESS_LIGHT * open) / PI; }
    let sky = SUN_LIGHT * SKY_LIGHT * (PI * day(sun_cos)) + NIGHT_LIGHT * PI;
    // A moon stands opposite the sun, well off the zenith at midnight: its light shows relief.
    let moon = normalize(MOON_ASIDE * vec3<f32>(view.sun.y, -view.sun.x, 0.3) - view.sun);
    let moonlit = smoothstep(-0.02, 0.15, dot(moon, up)) * max(dot(normal, moon), 0.0);
    return (direct + sky * open + MOON_LIGHT * moonlit) / PI;
}

fn water(point: Point, up: vec3<f32>, ray: vec3<f32>, light: vec3<f32>) -> vec3<f32> {
    let depth_m = -point.height_m;
    var body = mix(SHELF, SHALLOW, exp(-depth_m / SHELF_M));
    body = mix(DEEP, body, exp(-depth_m / DEEP_M));
    let ice = ramp(SEA_ICE_C, point.layers.w * 80.0 - 40.0);
    let facing = clamp(-dot(ray, up), 0.0, 1.0);
    let grazing = 1.0 - facing;
    let grazing2 = grazing * grazing;
    let mirror = 0.02 + 0.55 * grazing2 * grazing2 * grazing;
    let sun_cos = dot(view.sun, up);
    let even = select(0.6, day(sun_cos), view.sun_on != 0.0);
    var shine = SUN_LIGHT * REFLECTED_SKY * even + NIGHT_LIGHT;
    let middle = normalize(view.sun - ray);
    let cosine = max(dot(middle, up), 1e-3);
    let tangent2 = (1.0 - cosine * cosine) / (cosine * cosine);
    let facets = exp(-tangent2 / (WAVES * WAVES)) / (4.0 * WAVES * WAVES);
    let risen = smoothstep(-0.01, 0.03, sun_cos) * view.sun_on;
    shine += sunlight(0.0, max(sun_cos, 0.0)) * (GLINT * facets * risen / PI);
    return mix(body * light * (1.0 - mirror) + shine * mirror, SNOW * 0.8 * light, ice);
}

@fragment
fn fragment(point: Point) -> @location(0) vec4<f32> {
    let up = up_at(point.offset);
    let normal = normalize(point.normal);
    let dx = dpdx(point.offset);
    let dy = dpdy(point.offset);
    let distance_m = length(point.offset);
    let ray = point.offset / distance_m;
    var light: vec3<f32>;
    if view.sea != 0.0 && point.height_m < 0.0 {
        light = water(point, up, ray, lit(up, up, 0.0));
    } else {
        let slope = clamp(1.0 - dot(normal, up), 0.0, 1.0);
        let pixel_m = distance_m * view.pixel_rad;
        let grain = grain_at(point.offset, dx, dy, normal, up);
        var cover: Cover;
        if view.air != 0.0 {
            cover = land(point, slope, grain, pixel_m);
        } else {
            cover = regolith(point.layers, grain);
        }
        cover.albedo = draped(point, cover.albedo, grain);
        let tilt = grain.tilt * cover.rough + grain.ripple_tilt * (cover.rippled * RIPPLED);
        light = cover.albedo * lit(tilted(normal, tilt), up, point.height_m);
    }
    let veil = veil_until(ray, distance_m);
    return tone(light * veil.kept + veil.added);
}
