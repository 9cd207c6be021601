// Light, whatever it falls through: its constants, the way from light to what is shown.

const SUN_LIGHT: vec3<f32> = vec3<f32>(20.0, 19.4, 18.4); // irradiance before the air, arbitrary
const EXPOSURE: f32 = 0.37;
const PI: f32 = 3.14159265;

// The local up, `offset` metres from the eye.
fn up_at(offset: vec3<f32>) -> vec3<f32> {
    return normalize(view.eye_up * (view.body_radius_m + view.eye_height_m) + offset);
}

// What the air between the eye and a point does to light: keeps `kept`, adds `added`.
struct Veil {
    kept: vec3<f32>,
    added: vec3<f32>,
}

// To display range; the picture's format does the sRGB curve. Source: Narkowicz 2015.
fn tone(light: vec3<f32>) -> vec4<f32> {
    let x = light * EXPOSURE;
    let shown = (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14);
    return vec4<f32>(clamp(shown, vec3<f32>(0.0), vec3<f32>(1.0)), 1.0);
}
