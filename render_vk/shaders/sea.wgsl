// The sea: all that lies below height 0.
const SHALLOW: vec3<f32> = vec3<f32>(0.040, 0.130, 0.130);
const SHELF: vec3<f32> = vec3<f32>(0.008, 0.042, 0.066);
const DEEP: vec3<f32> = vec3<f32>(0.0022, 0.0095, 0.0280);
const SHELF_M: f32 = 25.0;                            // depth at which shallow colours fade
const DEEP_M: f32 = 900.0;                            // depth at which the shelf's colours fade
const REFLECTED_SKY: vec3<f32> = vec3<f32>(0.030, 0.044, 0.062); // per SUN_LIGHT
const SEA_ICE_C: vec2<f32> = vec2<f32>(-7.0, -13.0);

fn water(point: Point, up: vec3<f32>, ray: vec3<f32>, light: vec3<f32>) -> vec3<f32> {
    let depth_m = -point.height_m;
    var body = mix(SHELF, SHALLOW, exp(-depth_m / SHELF_M));
    body = mix(DEEP, body, exp(-depth_m / DEEP_M));
    let ice = ramp(SEA_ICE_C, point.layers.w * 80.0 - 40.0);
    let facing = clamp(-dot(ray, up), 0.0, 1.0);
    let grazing = 1.0 - facing;
    let grazing2 = grazing * grazing;
    let mirror = 0.02 + 0.55 * grazing2 * grazing2 * grazing;
    return mix(body * light * (1.0 - mirror) + shine(up, ray) * mirror, SNOW * 0.8 * light, ice);
}

// Light of what is seen at a point, before the air.
fn seen(
    point: Point,
    steps: Steps,
    up: vec3<f32>,
    ray: vec3<f32>,
    distance_m: f32,
) -> vec3<f32> {
    if point.height_m < 0.0 { return water(point, up, ray, lit(up, up, 0.0)); }
    return ground(point, steps, up, distance_m);
}
