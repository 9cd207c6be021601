// The ground as its makers look at it.
struct PatchInfo {
    error_px: f32,
    // Level, page depth, lacking levels, seen: a byte each.
    bytes: u32,
}

@group(1) @binding(0) var<storage, read> infos: array<PatchInfo>;

const WIREFRAME: u32 = 1u;
const LEVEL: u32 = 2u;
const SCREEN_ERROR: u32 = 3u;
const RESIDENCY: u32 = 4u;
const NORMALS: u32 = 5u;
const DEPTH_RANGE: u32 = 6u;

const EDGE_PX: f32 = 0.7;       // half the width of triangles' edges
const BORDER_PX: f32 = 1.3;     // and of patches'

// Six colours that differ for whoever sees few: neighbours in the row differ most.
fn sixth(index: u32) -> vec3<f32> {
    var colours = array<vec3<f32>, 6>(
        vec3<f32>(0.00, 0.17, 0.45), vec3<f32>(0.80, 0.35, 0.02), vec3<f32>(0.02, 0.35, 0.17),
        vec3<f32>(0.85, 0.75, 0.05), vec3<f32>(0.35, 0.02, 0.30), vec3<f32>(0.10, 0.46, 0.80),
    );
    return colours[index % 6u];
}

// From a colour over white to another: 0 to 1 to 2.
fn heat(x: f32) -> vec3<f32> {
    let cold = mix(vec3<f32>(0.01, 0.06, 0.45), vec3<f32>(0.9), clamp(2.0 * x - 1.0, 0.0, 1.0));
    return mix(cold, vec3<f32>(0.60, 0.01, 0.01), clamp(x - 1.0, 0.0, 1.0));
}

// How near a place is to a triangle's edge (x) and to the patch's border (y), in pixels.
//
// The patch is a grid of squares between its legs. Halving cuts each square along a diagonal,
// the way of which alternates like a chessboard.
fn edges(at: vec2<f32>) -> vec2<f32> {
    let f = at - floor(at);
    let even = (u32(floor(at.x)) + u32(floor(at.y))) % 2u == 0u;
    let diagonal = select(abs(f.x + f.y - 1.0), abs(f.x - f.y), even);
    let wide = vec2<f32>(fwidth(at.x), fwidth(at.y));
    let straight = min(min(f.x, 1.0 - f.x) / wide.x, min(f.y, 1.0 - f.y) / wide.y);
    let slanted = diagonal / fwidth(select(at.x + at.y, at.x - at.y, even));
    // A patch of n segments has (n + 1) (n + 2) / 2 vertices.
    let segments = (sqrt(8.0 * f32(view.vertices_per_patch) + 1.0) - 3.0) * 0.5;
    let end = (segments - at.x - at.y) / fwidth(at.x + at.y);
    let border = min(min(at.x / wide.x, at.y / wide.y), end);
    return vec2<f32>(min(straight, slanted), border);
}

@fragment
fn fragment(point: Point) -> @location(0) vec4<f32> {
    let up = normalize(view.eye_up * (view.body_radius_m + view.eye_height_m) + point.offset);
    let normal = normalize(point.normal);
    let facing = clamp(dot(normal, normalize(up + 0.7 * view.right)), 0.0, 1.0);
    let near = edges(point.at);
    var colour = vec3<f32>(0.30, 0.31, 0.33);
    if view.show == WIREFRAME {
        let edge = 1.0 - smoothstep(EDGE_PX - 0.5, EDGE_PX + 0.5, near.x);
        let border = 1.0 - smoothstep(BORDER_PX - 0.5, BORDER_PX + 0.5, near.y);
        // Where triangles are too small for edges of their own, they are left out, patches later.
        let step_px = 1.0 / max(fwidth(point.at.x), fwidth(point.at.y));
        let drawn = edge * smoothstep(2.0, 6.0, step_px);
        let bold = border * smoothstep(0.8, 3.0, step_px);
        colour = mix(colour * (0.2 + 0.8 * facing), vec3<f32>(0.55, 0.60, 0.62), drawn);
        return vec4<f32>(mix(colour, vec3<f32>(0.85, 0.45, 0.03), bold), 1.0);
    }
    if view.show == NORMALS {
        let east = normalize(cross(vec3<f32>(0.0, 0.0, 1.0), up) + vec3<f32>(1e-6, 0.0, 0.0));
        let north = cross(up, east);
        let local = vec3<f32>(dot(normal, east), dot(normal, north), dot(normal, up));
        return vec4<f32>(0.5 + 0.5 * local, 1.0);
    }
    if view.show == DEPTH_RANGE {
        colour = sixth(range.index);
    } else {
        let info = infos[point.slot];
        let level = info.bytes & 0xffu;
        let depth = (info.bytes >> 8u) & 0xffu;
        let lacking = (info.bytes >> 16u) & 0xffu;
        let seen = info.bytes >> 24u;
        if view.show == LEVEL {
            colour = sixth(level);
        } else if view.show == SCREEN_ERROR {
            colour = heat(info.error_px / view.tolerance_px);
        } else if view.show == RESIDENCY {
            let lack = clamp(f32(lacking) / 6.0, 0.0, 1.0);
            let there = mix(sixth(depth), vec3<f32>(0.3), 0.6);
            colour = mix(there, vec3<f32>(0.75, 0.02, 0.01), select(0.0, 0.4 + 0.6 * lack, lacking > 0u));
        } else {
            colour = select(vec3<f32>(0.60, 0.04, 0.03), vec3<f32>(0.10, 0.35, 0.12), seen != 0u);
        }
    }
    let border = 1.0 - smoothstep(0.2, 1.2, near.y);
    colour *= 0.35 + 0.65 * facing;
    return vec4<f32>(mix(colour, colour * 0.45, border), 1.0);
}
