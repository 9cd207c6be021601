//! Decorates every floating-point result of a SPIR-V module `NoContraction`.
//!
//! In:    a module's words.
//! Out:   the same module, in which no driver may fuse or reorder float arithmetic.
//! Keeps: nothing.
//! Not here: making SPIR-V (`build.rs`). Without this pass Mesa folds a two-sum to a plain sum.

const HEADER_WORDS: usize = 5;
const OP_DECORATE: u32 = 71;
const NO_CONTRACTION: u32 = 42;

/// Whether an opcode is float arithmetic whose result can be decorated.
pub fn is_float_arithmetic(opcode: u32) -> bool {
    // FNegate, FAdd, FSub, FMul, FDiv, FRem, FMod, and the vector and matrix products with OpDot.
    matches!(opcode, 127 | 129 | 131 | 133 | 136 | 140 | 141 | 142..=148)
}

/// Splits a module's words into its instructions, header left out: (offset, opcode, words).
pub fn instructions(module: &[u32]) -> impl Iterator<Item = (usize, u32, &[u32])> {
    let mut at = HEADER_WORDS;
    core::iter::from_fn(move || {
        let first = *module.get(at)?;
        let (length, opcode) = ((first >> 16) as usize, first & 0xFFFF);
        assert!(length > 0 && at + length <= module.len(), "SPIR-V is cut off at word {at}");
        let found = (at, opcode, &module[at..at + length]);
        at += length;
        Some(found)
    })
}

/// The module with all decorations added.
pub fn without_contraction(module: &[u32]) -> Vec<u32> {
    // Annotations stand together, before the first type; ours go first among them.
    let place = instructions(module)
        .find(|&(_, opcode, _)| matches!(opcode, 19..=39 | 71..=75))
        .map_or(module.len(), |(at, _, _)| at);
    let mut out = module[..place].to_vec();
    for (_, opcode, words) in instructions(module) {
        if is_float_arithmetic(opcode) {
            out.extend([(3 << 16) | OP_DECORATE, words[2], NO_CONTRACTION]);
        }
    }
    out.extend(&module[place..]);
    out
}
