//! The compiled shaders: SPIR-V as words.
//!
//! In:    what `build.rs` left.
//! Out:   one module a program.
//! Keeps: nothing.
//! Not here: pipelines (`passes`).

use crate::parts::Lit;
use overfly_core::settings::VertexPrecision;

/// `PROGRAMS`: names and bytes of all programs of this build.
mod programs {
    include!(concat!(env!("OUT_DIR"), "/programs.rs"));
}

/// For whom the ground is drawn.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Ground {
    /// As one sees it.
    Plain(Lit),
    /// As one sees it, under imagery.
    Draped(Lit),
    /// Debug views.
    Debug,
}

/// Ground, `vertex`: how vertices are placed, whether they move, and for whom.
pub(crate) fn ground(placed: VertexPrecision, morphs: bool, ground: Ground) -> Vec<u32> {
    let place = match placed {
        VertexPrecision::TwoFloat => "two_float",
        VertexPrecision::EyeF64 => "eye",
    };
    let morph = if morphs { "_morph" } else { "" };
    let shown = match ground {
        Ground::Plain(_) => "",
        Ground::Draped(_) => "_drape",
        Ground::Debug => "_debug",
    };
    program(&format!("ground_{place}{morph}{shown}"))
}

/// Ground: `fragment`.
pub(crate) fn terrain(ground: Ground) -> Vec<u32> {
    match ground {
        Ground::Plain(lit) => program(&format!("terrain{}", suffix(lit))),
        Ground::Draped(lit) => program(&format!("terrain{}_drape", suffix(lit))),
        Ground::Debug => program("debug"),
    }
}

/// Sky: `vertex`, `fragment`.
pub(crate) fn sky(lit: Lit) -> Vec<u32> {
    program(&format!("sky{}", suffix(lit)))
}

/// Overlay: `vertex`, `fragment`.
pub(crate) fn overlay() -> Vec<u32> {
    program("overlay")
}

/// The two-sum on its own: `main`.
pub(crate) fn self_test() -> Vec<u32> {
    program("self_test")
}

fn suffix(lit: Lit) -> &'static str {
    match (lit.sea, lit.sun) {
        (false, false) => "",
        (true, false) => "_sea",
        (false, true) => "_sun",
        (true, true) => "_sea_sun",
    }
}

/// The words of a program that this build has: what it lacks was refused before.
fn program(name: &str) -> Vec<u32> {
    let found = programs::PROGRAMS.iter().find(|(program, _)| *program == name);
    words(found.unwrap_or_else(|| panic!("no program {name}")).1)
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
        let places = programs::PROGRAMS.iter().filter(|(name, _)| name.starts_with("ground_"));
        let (places, all) = (places.count(), programs::PROGRAMS.len());
        if cfg!(all(feature = "debug", feature = "imagery", feature = "sea", feature = "sky")) {
            assert!(places == 12 && all >= 18, "{places} of {all}");
        }
        let least = |name: &str| match name {
            "self_test" => 8,
            "overlay" => 5,
            "debug" => 30,
            "sky" => 4,
            name if name.starts_with("ground_") => 10,
            name if name.starts_with("sky") => 5,
            _ => 50,
        };
        let modules = programs::PROGRAMS.iter().map(|(name, bytes)| (words(bytes), least(name)));
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
