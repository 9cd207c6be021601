// Light without a sun: even, from above the eye.
const SUN_ON: f32 = 0.0;
const EVEN_LIGHT: f32 = 0.34;                         // of SUN_LIGHT, from all sides

fn lit(normal: vec3<f32>, up: vec3<f32>, height_m: f32) -> vec3<f32> {
    let facing = 0.5 + 0.5 * dot(normal, view.eye_up);
    return SUN_LIGHT * (EVEN_LIGHT * (0.35 + 0.65 * facing) / PI);
}

fn disc_light(ray: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(0.0);
}
