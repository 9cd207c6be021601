// The ground as one sees it: its cover (`land`, `regolith`), in light (`sun`, `no_sun`).
const RIPPLED: f32 = 0.25;                            // slope of the ripples in sand

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

// Light of dry ground at a point.
fn ground(point: Point, steps: Steps, up: vec3<f32>, distance_m: f32) -> vec3<f32> {
    let normal = normalize(point.normal);
    let slope = clamp(1.0 - dot(normal, up), 0.0, 1.0);
    let pixel_m = distance_m * view.pixel_rad;
    let grain = grain_at(point.offset, steps.x, steps.y, normal, up);
    var cover = cover_of(point, slope, grain, pixel_m);
    cover.albedo = draped(point, steps, cover.albedo, grain);
    let tilt = grain.tilt * cover.rough + grain.ripple_tilt * (cover.rippled * RIPPLED);
    return cover.albedo * lit(tilted(normal, tilt), up, point.height_m);
}

@fragment
fn fragment(point: Point) -> @location(0) vec4<f32> {
    let steps = steps_at(point);
    let up = up_at(point.offset);
    let distance_m = length(point.offset);
    let ray = point.offset / distance_m;
    let veil = veil_until(ray, distance_m);
    return tone(seen(point, steps, up, ray, distance_m) * veil.kept + veil.added);
}
