// Subtracts two points that are each the unevaluated sum of two f32 triples.
//
// The same f32 operations, in the same order, as `TwoFloat::relative_to` in
// core/src/geodesy/frames.rs: the result is a function of the two points alone. It needs every
// operation to stay what it says, so the build decorates all of them `NoContraction`.
fn relative_to(
    hi: vec3<f32>,
    lo: vec3<f32>,
    eye_hi: vec3<f32>,
    eye_lo: vec3<f32>,
) -> vec3<f32> {
    let b = -eye_hi;
    let sum = hi + b;
    let bb = sum - hi;
    let lost = (hi - (sum - bb)) + (b - bb);
    return sum + (lost + (lo - eye_lo));
}
