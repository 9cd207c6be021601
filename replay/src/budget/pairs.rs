//! Two programs in pairs of runs of one flight: slower, the same, faster, or not known yet.
//!
//! In:    times of the same frames by both programs, pair by pair.
//! Out:   a [`Comparison`] for the whole frame and each stage; when to go on; in which order to run.
//! Keeps: [`PairCells`] of each pair: a few numbers, whatever the flight's length.
//! Not here: running anything (the host).
//! Source: paired interleaved runs; block bootstrap, Kuensch 1989.
//!
//! Replays are deterministic, so frame i of one program did what frame i of the other did: their
//! ratio is free of what the flight asks for. Frames in a row are disturbed together, so ratios are
//! first gathered to one median a block; disturbances of a whole run are told by resampling runs.

use super::interval::{Interval, Relation, t_995};
use super::record::FRAME;
use super::statistic::take;
use libm::{exp, log, sqrt};
use overfly_config::Statistic;
use overfly_core::digest::mix;
use std::collections::BTreeMap;

/// Most blocks of a run.
const BLOCKS: usize = 32;
/// Fewest frames of a block.
const BLOCK_LEAST: usize = 8;
/// Stages below this share of the frame's time are too short to be told.
const SHARE_LEAST: f64 = 0.01;
/// And so are those below this mean time, in nanoseconds.
const MEAN_LEAST_NS: f64 = 2000.0;

/// How pairs are run and judged.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PairRule {
    /// The smallest effect that is of interest, as a share of the time.
    pub effect: f64,
    /// Pairs before the first verdict, at least 3.
    pub least: usize,
    /// Pairs after which it ends, decided or not.
    pub most: usize,
    /// Resamples of the bootstrap.
    pub resamples: u32,
    /// Seed of the orders and of the bootstrap.
    pub seed: u64,
}

impl Default for PairRule {
    fn default() -> Self {
        Self { effect: 0.03, least: 6, most: 40, resamples: 500, seed: 1 }
    }
}

impl PairRule {
    /// Whether the first program runs first in a pair. Two pairs in a row have both orders, so that
    /// a drift of the machine favours neither.
    pub fn first_goes_first(&self, pair: usize) -> bool {
        let toss = mix(self.seed ^ mix((pair / 2) as u64)) & 1 == 0;
        toss == pair.is_multiple_of(2)
    }
}

/// What one pair of runs says of one stage.
#[derive(Clone, PartialEq, Debug)]
struct Cell {
    /// Median logarithm of the ratio of times, for each block of frames.
    logs: Vec<f64>,
    /// Logarithm of the ratio of both p99.
    tail: f64,
    /// Mean time of the first program's frames in nanoseconds.
    mean_ns: f64,
}

/// What one pair of runs says.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct PairCells {
    by_stage: BTreeMap<String, Cell>,
}

impl PairCells {
    /// Of the times of two runs by name; frames that only one of both has are left out.
    pub fn of(a: &BTreeMap<String, Vec<u64>>, b: &BTreeMap<String, Vec<u64>>) -> Self {
        let cell = |(name, a): (&String, &Vec<u64>)| {
            let b = b.get(name)?;
            let frames = a.len().min(b.len());
            Some((name.clone(), cell(&a[..frames], &b[..frames])?))
        };
        Self { by_stage: a.iter().filter_map(cell).collect() }
    }
}

/// Times of zero are below the clock's step: they count as one.
fn ns(time_ns: u64) -> f64 {
    time_ns.max(1) as f64
}

fn cell(a: &[u64], b: &[u64]) -> Option<Cell> {
    let ratios: Vec<f64> = a.iter().zip(b).map(|(&a, &b)| log(ns(b) / ns(a))).collect();
    let block = ratios.len().div_ceil(BLOCKS).max(BLOCK_LEAST);
    let p99 = |times: &[u64]| {
        let times: Vec<f64> = times.iter().map(|&time| ns(time)).collect();
        take(Statistic::Percentile(990), 0.0, &times, 1.0).map(|taken| taken.value)
    };
    Some(Cell {
        logs: ratios.chunks(block).map(|block| median(&mut block.to_vec())).collect(),
        tail: log(p99(b)? / p99(a)?),
        mean_ns: a.iter().map(|&time| time as f64).sum::<f64>() / a.len() as f64,
    })
}

/// The middle value, or the mean of both.
fn median(values: &mut [f64]) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => values[middle],
        _ => (values[middle - 1] + values[middle]) / 2.0,
    }
}

/// What all pairs say of the whole frame or of a stage.
#[derive(Clone, PartialEq, Debug)]
pub struct Comparison {
    /// Name of the stage.
    pub name: String,
    /// By how much the second program is slower, of the median frame.
    pub typical: Interval,
    /// By how much its p99 is larger. It is told, and decides nothing: it takes far more runs.
    pub tail: Interval,
    /// What the typical frame says.
    pub relation: Relation,
    /// Mean time of the first program's frames in milliseconds.
    pub mean_ms: f64,
}

/// Compares the whole frame, then each stage.
pub fn compare(pairs: &[PairCells], names: &[&str], rule: &PairRule) -> Vec<Comparison> {
    let cells = |name: &str| -> Vec<&Cell> {
        pairs.iter().filter_map(|pair| pair.by_stage.get(name)).collect()
    };
    let mean_ns = |cells: &[&Cell]| {
        cells.iter().map(|cell| cell.mean_ns).sum::<f64>() / cells.len().max(1) as f64
    };
    let frame_ns = mean_ns(&cells(FRAME));
    let one = |name: &&str| {
        let cells = cells(name);
        let mean_ns = mean_ns(&cells);
        let typical: Vec<&[f64]> = cells.iter().map(|cell| &cell.logs[..]).collect();
        let tail: Vec<&[f64]> = cells.iter().map(|cell| std::slice::from_ref(&cell.tail)).collect();
        let typical = interval(&typical, rule);
        let short = mean_ns < MEAN_LEAST_NS.max(SHARE_LEAST * frame_ns);
        let relation = if short { Relation::TooShort } else { typical.relation(rule.effect) };
        let (name, mean_ms) = ((*name).to_owned(), mean_ns / 1e6);
        Comparison { name, typical, tail: interval(&tail, rule), relation, mean_ms }
    };
    names.iter().map(one).collect()
}

/// Whether more pairs could change anything: not where the frame and all its stages are decided,
/// nor at the limit.
pub fn goes_on(comparisons: &[Comparison], pairs: usize, rule: &PairRule) -> bool {
    let open = comparisons.iter().any(|one| one.relation == Relation::Inconclusive);
    pairs < rule.least || (open && pairs < rule.most)
}

/// The median of all blocks of all pairs. Its standard error is that of the bootstrap: pairs are
/// drawn with replacement, and so are the blocks of each; few pairs widen it as Student has it.
fn interval(pairs: &[&[f64]], rule: &PairRule) -> Interval {
    let mut all: Vec<f64> = pairs.concat();
    let estimate = median(&mut all);
    if pairs.len() < 2 || estimate.is_nan() {
        let shown = if estimate.is_nan() { f64::NAN } else { exp(estimate) - 1.0 };
        return Interval { estimate: shown, low: f64::NEG_INFINITY, high: f64::INFINITY };
    }
    let mut draw = Draw(rule.seed);
    let mut drawn = Vec::with_capacity(all.len());
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..rule.resamples {
        drawn.clear();
        for _ in pairs {
            let blocks = pairs[draw.below(pairs.len())];
            drawn.extend((0..blocks.len()).map(|_| blocks[draw.below(blocks.len())]));
        }
        let off = median(&mut drawn) - estimate;
        sum += off;
        squares += off * off;
    }
    let (count, runs) = (f64::from(rule.resamples), pairs.len() as f64);
    let variance = (squares - sum * sum / count) / (count - 1.0);
    let error = sqrt(variance.max(0.0) * runs / (runs - 1.0));
    let half = t_995(pairs.len()) * error;
    let share = |log: f64| exp(log) - 1.0;
    Interval {
        estimate: share(estimate),
        low: share(estimate - half),
        high: share(estimate + half),
    }
}

/// Numbers that depend on a seed alone.
struct Draw(u64);

impl Draw {
    fn below(&mut self, count: usize) -> usize {
        self.0 = mix(self.0);
        // The product of two numbers below 2^64 fits; the bias is below count / 2^64.
        let high = (u128::from(self.0) * count as u128) >> 64;
        usize::try_from(high).expect("less than count")
    }
}
