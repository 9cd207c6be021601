// What water mirrors under a sun: the sky, and the sun in its waves.
const WAVES: f32 = 0.17;                              // slope of the waves: width of the glint
const GLINT: f32 = 0.22;

fn shine(up: vec3<f32>, ray: vec3<f32>) -> vec3<f32> {
    let sun_cos = dot(view.sun, up);
    let sky = SUN_LIGHT * REFLECTED_SKY * day(sun_cos) + NIGHT_LIGHT;
    let middle = normalize(view.sun - ray);
    let cosine = max(dot(middle, up), 1e-3);
    let tangent2 = (1.0 - cosine * cosine) / (cosine * cosine);
    let facets = exp(-tangent2 / (WAVES * WAVES)) / (4.0 * WAVES * WAVES);
    let risen = smoothstep(-0.01, 0.03, sun_cos);
    return sky + sunlight(0.0, max(sun_cos, 0.0)) * (GLINT * facets * risen / PI);
}
