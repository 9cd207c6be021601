// What water mirrors without a sun: an even sky.
const EVEN_SKY: f32 = 0.6;                            // of the day's

fn shine(up: vec3<f32>, ray: vec3<f32>) -> vec3<f32> {
    return SUN_LIGHT * REFLECTED_SKY * EVEN_SKY + NIGHT_LIGHT;
}
