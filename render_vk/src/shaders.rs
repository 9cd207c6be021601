//! The compiled shaders: SPIR-V as words.
//!
//! In:    what `build.rs` left.
//! Out:   one module a program.
//! Keeps: nothing.
//! Not here: pipelines (`passes`).

use overfly_core::settings::VertexPrecision;

macro_rules! module {
    ($name:literal) => {
        words(include_bytes!(concat!(env!("OUT_DIR"), "/", $name, ".spv")))
    };
}

/// For whom the ground is drawn.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Ground {
    /// As one sees it.
    Plain,
    /// As one sees it, under imagery.
    Draped,
    /// Debug views.
    Debug,
}

/// Ground, `vertex`: how vertices are placed, whether they move, and for whom.
pub(crate) fn ground(placed: VertexPrecision, morphs: bool, ground: Ground) -> Vec<u32> {
    use Ground::{Debug, Draped, Plain};
    use VertexPrecision::{EyeF64, TwoFloat};
    match (placed, morphs, ground) {
        (TwoFloat, false, Plain) => module!("ground_two_float"),
        (TwoFloat, true, Plain) => module!("ground_two_float_morph"),
        (TwoFloat, false, Draped) => module!("ground_two_float_drape"),
        (TwoFloat, true, Draped) => module!("ground_two_float_morph_drape"),
        (TwoFloat, false, Debug) => module!("ground_two_float_debug"),
        (TwoFloat, true, Debug) => module!("ground_two_float_morph_debug"),
        (EyeF64, false, Plain) => module!("ground_eye"),
        (EyeF64, true, Plain) => module!("ground_eye_morph"),
        (EyeF64, false, Draped) => module!("ground_eye_drape"),
        (EyeF64, true, Draped) => module!("ground_eye_morph_drape"),
        (EyeF64, false, Debug) => module!("ground_eye_debug"),
        (EyeF64, true, Debug) => module!("ground_eye_morph_debug"),
    }
}

/// Ground: `fragment`.
pub(crate) fn terrain(ground: Ground) -> Vec<u32> {
    match ground {
        Ground::Plain => module!("terrain"),
        Ground::Draped => module!("terrain_drape"),
        Ground::Debug => module!("debug"),
    }
}

/// Sky: `vertex`, `fragment`.
pub(crate) fn sky() -> Vec<u32> {
    module!("sky")
}

/// Overlay: `vertex`, `fragment`.
pub(crate) fn overlay() -> Vec<u32> {
    module!("overlay")
}

/// The two-sum on its own: `main`.
pub(crate) fn self_test() -> Vec<u32> {
    module!("self_test")
}

fn words(bytes: &[u8]) -> Vec<u32> {
    bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

#[cfg(test)]
#[path = "../spirv_pass.rs"]
mod spirv_pass;

#[cfg(test)]
mod tests {
    use super::spirv_pass::{instructions, is_float_arithmetic, without_contraction};
    use super::*;

    /// Result ids of float arithmetic, and ids decorated `NoContraction`; both sorted.
    fn float_results_and_decorated(module: &[u32]) -> (Vec<u32>, Vec<u32>) {
        let (mut results, mut decorated) = (Vec::new(), Vec::new());
        for (_, opcode, words) in instructions(module) {
            match opcode {
                71 if words[2] == 42 => decorated.push(words[1]),
                other if is_float_arithmetic(other) => results.push(words[2]),
                _ => {}
            }
        }
        results.sort_unstable();
        decorated.sort_unstable();
        (results, decorated)
    }

    #[test]
    fn every_float_result_of_every_shader_is_decorated_once() {
        use VertexPrecision::{EyeF64, TwoFloat};
        let all = [Ground::Plain, Ground::Draped, Ground::Debug];
        let mut modules = vec![(sky(), 50), (overlay(), 5), (self_test(), 8)];
        modules.extend(all.map(|ground| (terrain(ground), 30)));
        for (placed, morphs) in
            [(TwoFloat, false), (TwoFloat, true), (EyeF64, false), (EyeF64, true)]
        {
            modules.extend(all.map(|to| (ground(placed, morphs, to), 10)));
        }
        for (module, least) in modules {
            let (results, decorated) = float_results_and_decorated(&module);
            assert!(results.len() >= least, "only {} float operations", results.len());
            assert_eq!(results, decorated);
        }
    }

    #[test]
    fn the_pass_knows_every_float_arithmetic_opcode_of_the_specification() {
        let known: Vec<u32> = (0..1000).filter(|&o| is_float_arithmetic(o)).collect();
        // FNegate FAdd FSub FMul FDiv FRem FMod, then VectorTimesScalar to Dot in one run.
        let first = [127, 129, 131, 133, 136, 140, 141];
        let products = [142, 143, 144, 145, 146, 147, 148];
        assert_eq!(known, [first, products].concat());
    }

    #[test]
    fn the_pass_puts_decorations_before_types_and_leaves_the_rest() {
        let op = |opcode: u32, words: &[u32]| {
            let length = u32::try_from(words.len() + 1).unwrap();
            [&[(length << 16) | opcode], words].concat()
        };
        let header = vec![0x0723_0203, 0x0001_0300, 0, 9, 0];
        let body = [op(17, &[1]), op(22, &[2, 32]), op(129, &[2, 3, 4, 5])];
        let module = [header.clone(), body.concat()].concat();
        let decorated =
            [header, body[0].clone(), op(71, &[3, 42]), body[1].clone(), body[2].clone()].concat();
        assert_eq!(without_contraction(&module), decorated);
    }
}
