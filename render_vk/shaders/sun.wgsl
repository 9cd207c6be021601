// Light of a sun.
const SUN_ON: f32 = 1.0;
const SUN_COS: f32 = 0.99998919;                          // cosine of the disc's radius, 0.2665°
const SUN_DISC: f32 = 60.0;                               // radiance of the disc over SUN_LIGHT

// Light of sun and sky on ground of this normal, over pi.
fn lit(normal: vec3<f32>, up: vec3<f32>, height_m: f32) -> vec3<f32> {
    let sun_cos = dot(view.sun, up);
    // The body itself hides the sun behind its horizon; softened over the sun's width.
    let risen = smoothstep(-0.01, 0.01, sun_cos);
    let direct = sunlight(height_m, max(sun_cos, 0.0)) * (max(dot(normal, view.sun), 0.0) * risen);
    return under_sky(direct, normal, up, sun_cos);
}

// Light of the disc along a ray from the eye.
fn disc_light(ray: vec3<f32>) -> vec3<f32> {
    // The disc's rim is a third of its radius wide, darker outwards as the real one.
    let cosine = dot(ray, view.sun);
    let disc = smoothstep(1.0 - (1.0 - SUN_COS) * 1.3, 1.0 - (1.0 - SUN_COS) * 0.5, cosine);
    return SUN_LIGHT * (SUN_DISC * disc);
}
