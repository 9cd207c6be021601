// Light where there is no air.
const AIRLESS_LIGHT: f32 = 0.012;                     // light of the ground on the ground

fn sunlight(height_m: f32, sun_cos: f32) -> vec3<f32> {
    return SUN_LIGHT;
}

fn veil_until(ray: vec3<f32>, t_end: f32) -> Veil {
    return Veil(vec3<f32>(1.0), vec3<f32>(0.0));
}

// Light on ground of this normal, over pi: `direct` of the sun, and of the ground around.
fn under_sky(direct: vec3<f32>, normal: vec3<f32>, up: vec3<f32>, sun_cos: f32) -> vec3<f32> {
    let open = 0.5 + 0.5 * dot(normal, up);
    return (direct + SUN_LIGHT * AIRLESS_LIGHT * open) / PI;
}
