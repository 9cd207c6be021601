// Does the two-sum survive this driver? Each item is a point, an eye and room for the answer.
struct Item {
    hi: vec4<f32>,
    lo: vec4<f32>,
    eye_hi: vec4<f32>,
    eye_lo: vec4<f32>,
    answer: vec4<f32>,
}

@group(0) @binding(0) var<storage, read_write> items: array<Item>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) at: vec3<u32>) {
    let item = items[at.x];
    let answer = relative_to(item.hi.xyz, item.lo.xyz, item.eye_hi.xyz, item.eye_lo.xyz);
    items[at.x].answer = vec4<f32>(answer, 0.0);
}
