// Light through air, and every constant of it.

// ---- Light ----
const SKY_LIGHT: vec3<f32> = vec3<f32>(0.040, 0.058, 0.088); // sky on flat ground, per SUN_LIGHT
const NIGHT_LIGHT: vec3<f32> = vec3<f32>(0.050, 0.065, 0.105); // never quite dark
const MOON_LIGHT: vec3<f32> = vec3<f32>(2.6, 3.1, 4.2);      // irradiance of a moon, far too bright
const MOON_ASIDE: f32 = 1.2;                          // tangent of the moon's way off the sun's axis

// ---- Air: one exponential profile of molecules and haze together ----
const RAYLEIGH: vec3<f32> = vec3<f32>(4.3e-6, 9.8e-6, 22.0e-6); // per metre at height 0, clear
const HAZE: vec3<f32> = vec3<f32>(2.0e-6, 2.0e-6, 2.0e-6);  // 1/e in the green: 85 km
const HAZE_G: f32 = 0.72;                                // how much haze scatters forward
const SCALE_HEIGHT_M: f32 = 8000.0;
const AIR_TOP_M: f32 = 64000.0;                          // e⁻⁸ of the ground's density
const TWICE_SCATTERED: vec3<f32> = vec3<f32>(0.006, 0.008, 0.011); // per SUN_LIGHT
const TWILIGHT_COS: vec2<f32> = vec2<f32>(-0.16, 0.22);  // sun's sine: night below, day above

// Height of the point `t` metres along a ray from the eye, without cancellation.
fn height_at(cos_up: f32, t: f32) -> f32 {
    let r = view.body_radius_m + view.eye_height_m;
    let grown = (2.0 * r * cos_up + t) * t;
    return view.eye_height_m + grown / (sqrt(max(r * r + grown, 0.0)) + r);
}

// Where a ray from the eye is inside the air, at most up to `t_end`: start and length in metres.
fn inside_air(cos_up: f32, t_end: f32) -> vec2<f32> {
    let r = view.body_radius_m + view.eye_height_m;
    let b = r * cos_up;
    let c = (AIR_TOP_M - view.eye_height_m) * (view.body_radius_m + AIR_TOP_M + r);
    let d = b * b + c;
    if d <= 0.0 { return vec2<f32>(0.0, 0.0); }
    let root = sqrt(d);
    let exit = select(root - b, c / (root + b), b > 0.0);
    let entry = select(max(-b - root, 0.0), 0.0, c > 0.0);
    let end = min(exit, t_end);
    return vec2<f32>(entry, max(end - entry, 0.0));
}

// Air between two points of a ray, in metres of ground-level air, and where its middle is.
// Source: Gauss-Legendre quadrature of six points.
fn air_along(cos_up: f32, start_and_length: vec2<f32>) -> vec2<f32> {
    let node = vec3<f32>(0.03376524, 0.16939531, 0.38069041);
    let weight = vec3<f32>(0.08566225, 0.18038079, 0.23395697);
    var amount = 0.0;
    var moment = 0.0;
    for (var i = 0; i < 3; i++) {
        for (var side = 0; side < 2; side++) {
            let x = select(node[i], 1.0 - node[i], side == 1);
            let t = start_and_length.x + x * start_and_length.y;
            let density = weight[i] * exp(-max(height_at(cos_up, t), 0.0) / SCALE_HEIGHT_M);
            amount += density;
            moment += density * t;
        }
    }
    return vec2<f32>(amount * start_and_length.y, moment / max(amount, 1e-20));
}

// Air from a height up to space along a slanted line, in metres of ground-level air.
// Source: Schüler, "An approximation to the Chapman grazing-incidence function", GPU Pro 3.
fn air_above(height_m: f32, cos_up: f32) -> f32 {
    let x = (view.body_radius_m + max(height_m, 0.0)) / SCALE_HEIGHT_M;
    let c = sqrt(0.5 * PI * x);
    let density = exp(-max(height_m, 0.0) / SCALE_HEIGHT_M);
    let climbing = c / ((c - 1.0) * abs(cos_up) + 1.0);
    if cos_up >= 0.0 { return SCALE_HEIGHT_M * density * climbing; }
    let sine = sqrt(max(1.0 - cos_up * cos_up, 0.0));
    let grazing = 2.0 * sqrt(0.5 * PI * x * sine) * exp(min(x - x * sine, 30.0));
    return SCALE_HEIGHT_M * density * max(grazing - climbing, climbing);
}

// Light of the sun that is left at a height, `sun_cos` being the sun's cosine to the local up.
fn sunlight(height_m: f32, sun_cos: f32) -> vec3<f32> {
    return SUN_LIGHT * exp(-(RAYLEIGH + HAZE) * min(air_above(height_m, sun_cos), 1e7));
}

// How much of the day's sky is lit for a sun at this cosine.
fn day(sun_cos: f32) -> f32 {
    let x = smoothstep(TWILIGHT_COS.x, TWILIGHT_COS.y, sun_cos);
    return x * x;
}

fn veil_until(ray: vec3<f32>, t_end: f32) -> Veil {
    var veil: Veil;
    veil.kept = vec3<f32>(1.0);
    veil.added = vec3<f32>(0.0);
    let cos_up = dot(ray, view.eye_up);
    let segment = inside_air(cos_up, t_end);
    if segment.y <= 0.0 { return veil; }
    let air = air_along(cos_up, segment);
    veil.kept = exp(-(RAYLEIGH + HAZE) * air.x);
    // All the scattering happens where the air's middle is.
    let sun_cos = dot(view.sun, up_at(ray * air.y));
    let cosine = dot(ray, view.sun) * SUN_ON;
    let g = HAZE_G * SUN_ON;
    let molecules = 3.0 / (16.0 * PI) * (1.0 + cosine * cosine);
    let spread = 1.0 + g * g - 2.0 * g * cosine;
    let haze = (1.0 - g * g) / (4.0 * PI * spread * sqrt(spread));
    let once = (RAYLEIGH * molecules + HAZE * haze) / (RAYLEIGH + HAZE);
    let height_m = max(height_at(cos_up, air.y), 0.0);
    let light = sunlight(height_m, sun_cos) * once
        + SUN_LIGHT * TWICE_SCATTERED * day(sun_cos)
        + NIGHT_LIGHT;
    veil.added = light * (vec3<f32>(1.0) - veil.kept);
    return veil;
}

// Light on ground of this normal, over pi: `direct` of the sun, and of sky and moon.
fn under_sky(direct: vec3<f32>, normal: vec3<f32>, up: vec3<f32>, sun_cos: f32) -> vec3<f32> {
    let open = 0.5 + 0.5 * dot(normal, up);
    let sky = SUN_LIGHT * SKY_LIGHT * (PI * day(sun_cos)) + NIGHT_LIGHT * PI;
    // A moon stands opposite the sun, well off the zenith at midnight: its light shows relief.
    let moon = normalize(MOON_ASIDE * vec3<f32>(view.sun.y, -view.sun.x, 0.3) - view.sun);
    let moonlit = smoothstep(-0.02, 0.15, dot(moon, up)) * max(dot(normal, moon), 0.0);
    return (direct + sky * open + MOON_LIGHT * moonlit) / PI;
}
