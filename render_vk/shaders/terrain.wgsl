// The ground: patches of two-float vertices, coloured by height, slope and hidden layers.

// ---- Ground colours: linear albedo ----
const SAND: vec3<f32> = vec3<f32>(0.40, 0.35, 0.23);
const DESERT: vec3<f32> = vec3<f32>(0.340, 0.272, 0.160);
const STEPPE: vec3<f32> = vec3<f32>(0.215, 0.185, 0.085);
const GRASS: vec3<f32> = vec3<f32>(0.095, 0.113, 0.040);
const FOREST: vec3<f32> = vec3<f32>(0.034, 0.052, 0.019);
const TUNDRA: vec3<f32> = vec3<f32>(0.150, 0.137, 0.095);
const ROCK: vec3<f32> = vec3<f32>(0.172, 0.166, 0.142);
const DARK_ROCK: vec3<f32> = vec3<f32>(0.095, 0.090, 0.086);
const SNOW: vec3<f32> = vec3<f32>(0.60, 0.63, 0.67);
const REGOLITH_DARK: vec3<f32> = vec3<f32>(0.060, 0.058, 0.055);
const REGOLITH_BRIGHT: vec3<f32> = vec3<f32>(0.170, 0.163, 0.152);

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
const SEA_ICE_C: vec2<f32> = vec2<f32>(-7.0, -13.0);

// ---- Water ----
const SHALLOW: vec3<f32> = vec3<f32>(0.040, 0.130, 0.130);
const SHELF: vec3<f32> = vec3<f32>(0.008, 0.042, 0.066);
const DEEP: vec3<f32> = vec3<f32>(0.0022, 0.0095, 0.0280);
const SHELF_M: f32 = 25.0;                            // depth at which shallow colours fade
const DEEP_M: f32 = 900.0;                            // depth at which the shelf's colours fade
const WAVES: f32 = 0.13;                              // slope of the waves: width of the glint
const GLINT: f32 = 0.9;
const REFLECTED_SKY: vec3<f32> = vec3<f32>(0.030, 0.044, 0.062); // per SUN_LIGHT

// ---- Light without a sun or without air ----
const EVEN_LIGHT: f32 = 0.34;                         // of SUN_LIGHT, from all sides
const AIRLESS_LIGHT: f32 = 0.012;                     // light of the ground on the ground

struct Ground {
    @location(0) hi: vec3<f32>,
    @location(1) lo: vec3<f32>,
    @location(2) normal_oct: vec2<f32>,
    @location(3) layers: vec4<f32>,
    @location(4) height_m: f32,
}

struct Point {
    @invariant @builtin(position) position: vec4<f32>,
    @location(0) offset: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) layers: vec4<f32>,
    @location(3) height_m: f32,
}

// Inverse of the octahedral map: z > 0 is the inner diamond, z < 0 is folded outwards.
fn unfolded(e: vec2<f32>) -> vec3<f32> {
    let z = 1.0 - abs(e.x) - abs(e.y);
    let fold = max(-z, 0.0);
    let x = e.x + select(fold, -fold, e.x >= 0.0);
    let y = e.y + select(fold, -fold, e.y >= 0.0);
    return normalize(vec3<f32>(x, y, z));
}

@vertex
fn vertex(ground: Ground) -> Point {
    let offset = relative_to(ground.hi, ground.lo, view.eye_hi, view.eye_lo);
    let away = dot(view.forward, offset);
    var out: Point;
    out.position = vec4<f32>(
        dot(view.right, offset) * view.inverse_tan_x,
        -(dot(view.up, offset) * view.inverse_tan_y),
        view.depth_slope * away + view.depth_offset,
        away,
    );
    out.offset = offset;
    out.normal = unfolded(ground.normal_oct);
    out.layers = ground.layers;
    out.height_m = ground.height_m;
    return out;
}

fn ramp(ends: vec2<f32>, x: f32) -> f32 {
    let t = clamp((x - ends.x) / (ends.y - ends.x), 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

fn land_albedo(layers: vec4<f32>, height_m: f32, slope: f32) -> vec3<f32> {
    let rock_layer = layers.y;
    let moisture = layers.z;
    let celsius = layers.w * 80.0 - 40.0;
    var plants = mix(DESERT, STEPPE, ramp(STEPPE_WET, moisture));
    plants = mix(plants, GRASS, ramp(GRASS_WET, moisture));
    plants = mix(plants, FOREST, ramp(FOREST_WET, moisture));
    var albedo = mix(TUNDRA, plants, ramp(GREEN_C, celsius));
    albedo = mix(albedo, SAND, ramp(BEACH_M, height_m) * view.sea);
    let stone = mix(ROCK, DARK_ROCK, clamp(layers.x * 0.8, 0.0, 1.0));
    let bare = max(ramp(ROCK_SLOPE, slope), 0.8 * ramp(ROCK_LAYER, rock_layer));
    albedo = mix(albedo, stone, bare);
    let snow = ramp(SNOW_C, celsius + SNOW_SLOPE_C * slope) * ramp(SNOW_SLOPE, slope);
    return mix(albedo, SNOW, snow);
}

fn regolith_albedo(layers: vec4<f32>) -> vec3<f32> {
    // Rock is young and bright; where there is water elsewhere, there are dark maria here.
    let fresh = 0.60 * layers.y + 0.20 * (layers.x - 0.5);
    let bright = clamp(0.35 + fresh - 0.35 * layers.z, 0.0, 1.0);
    return mix(REGOLITH_DARK, REGOLITH_BRIGHT, bright);
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
    return (direct + sky * open) / PI;
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
    var shine = SUN_LIGHT * REFLECTED_SKY * even;
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
    let distance_m = length(point.offset);
    let ray = point.offset / distance_m;
    var light: vec3<f32>;
    if view.sea != 0.0 && point.height_m < 0.0 {
        light = water(point, up, ray, lit(up, up, 0.0));
    } else {
        let slope = clamp(1.0 - dot(normal, up), 0.0, 1.0);
        var albedo = regolith_albedo(point.layers);
        if view.air != 0.0 { albedo = land_albedo(point.layers, point.height_m, slope); }
        light = albedo * lit(normal, up, point.height_m);
    }
    let veil = veil_until(ray, distance_m);
    return tone(light * veil.kept + veil.added);
}
