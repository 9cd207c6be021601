//! A parallel-for calls its body once per chunk, with borders that no worker count moves.
//!
//! In:    lengths and grains, worker counts.
//! Out:   assertions.
//! Keeps: nothing.
//! Not here: graphs of more than one stage (`order`).

use crate::{COUNTS, run_one, workers};
use overfly_jobs::{Graph, Span, Team};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread;

/// First index and length of every chunk, in index order.
fn borders(team: &Team, len: usize, grain: usize) -> Vec<(usize, usize)> {
    let seen = Mutex::new(Vec::new());
    let mut items = vec![0_u8; len];
    team.for_each_chunk(&mut items, grain, |first, chunk| {
        seen.lock().unwrap().push((first, chunk.len()));
    });
    let mut seen = seen.into_inner().unwrap();
    seen.sort_unstable();
    seen
}

#[test]
fn chunk_borders_follow_from_length_and_grain_alone() {
    for (len, grain) in [(0, 1), (1, 1), (1, 9), (7, 7), (8, 7), (1000, 3), (1000, 64), (63, 100)] {
        let expected: Vec<_> =
            (0..len).step_by(grain).map(|first| (first, grain.min(len - first))).collect();
        assert_eq!(borders(&Team::alone(), len, grain), expected);
        for count in COUNTS {
            let found = Mutex::new(Vec::new());
            run_one(&found, &workers(count), move |found, team| {
                *found.lock().unwrap() = borders(team, len, grain);
            });
            assert_eq!(found.into_inner().unwrap(), expected, "{len} by {grain}, {count} workers");
        }
    }
}

/// A sum whose value depends on how the numbers are grouped, so that a moved border would show.
fn grouped_sum(team: &Team, seed: u32) -> f64 {
    let mut values: Vec<f64> = (0..10_000_u32).map(|i| 1.0 / f64::from(i + seed)).collect();
    let mut tags = vec![0_usize; values.len()];
    for _ in 0..3 {
        team.for_each_chunk2(&mut values, &mut tags, 37, |first, values, tags| {
            let sum: f64 = values.iter().sum();
            for (offset, (value, tag)) in values.iter_mut().zip(tags).enumerate() {
                *value = *value * 0.5 + sum * 0.25;
                *tag += first + offset;
            }
        });
    }
    assert!(tags.iter().enumerate().all(|(index, tag)| *tag == 3 * index));
    values.iter().sum()
}

#[test]
fn results_have_the_same_bits_for_any_number_of_workers() {
    let expected = grouped_sum(&Team::alone(), 3).to_bits();
    for count in COUNTS {
        let workers = workers(count);
        assert_eq!(workers.count(), count);
        let found = Mutex::new(0);
        let mut graph = Graph::<Mutex<u64>>::new();
        graph.stage(Span("sum"), &[], |found, team| {
            *found.lock().unwrap() = grouped_sum(team, 3).to_bits();
        });
        for _ in 0..20 {
            graph.run(&found, &workers).unwrap();
            assert_eq!(*found.lock().unwrap(), expected, "{count} workers");
        }
    }
}

#[test]
fn every_index_comes_once() {
    for count in COUNTS {
        let hits: Vec<AtomicU32> = (0..5000).map(|_| AtomicU32::new(0)).collect();
        run_one(&hits, &workers(count), move |hits, team| {
            assert_eq!(team.workers(), count);
            team.for_each_index(hits.len(), |index| {
                hits[index].fetch_add(1, Ordering::Relaxed);
            });
            team.for_each_index(0, |_| unreachable!());
        });
        assert!(hits.iter().all(|hits| hits.load(Ordering::Relaxed) == 1));
    }
}

/// Calls every element of `hits` from a loop that must stay on this thread.
fn count_here(team: &Team, hits: &[AtomicU32]) {
    let here = thread::current().id();
    team.for_each_index(hits.len(), |index| {
        assert_eq!(thread::current().id(), here);
        hits[index].fetch_add(1, Ordering::Relaxed);
    });
}

#[test]
fn a_loop_inside_a_chunk_runs_in_place() {
    for count in COUNTS {
        let hits: Vec<AtomicU32> = (0..400 * 50).map(|_| AtomicU32::new(0)).collect();
        run_one(&hits, &workers(count), |hits, team| {
            team.for_each_index(400, |outer| count_here(team, &hits[outer * 50..][..50]));
        });
        assert!(hits.iter().all(|hits| hits.load(Ordering::Relaxed) == 1));
    }
}

fn add_hundred(team: &Team, sum: &AtomicU32) {
    team.for_each_index(100, |_| _ = sum.fetch_add(1, Ordering::Relaxed));
}

#[test]
fn a_team_may_be_used_from_threads_of_the_stage_itself() {
    let sum = AtomicU32::new(0);
    run_one(&sum, &workers(2), |sum, team| {
        thread::scope(|scope| (0..4).for_each(|_| _ = scope.spawn(|| add_hundred(team, sum))));
    });
    assert_eq!(sum.into_inner(), 400);
}

#[test]
#[should_panic(expected = "one length")]
fn slices_of_different_lengths_are_refused() {
    Team::alone().for_each_chunk2(&mut [1, 2], &mut [1], 1, |_, _, _| ());
}

#[test]
#[should_panic(expected = "at least one element")]
fn a_grain_of_zero_is_refused() {
    Team::alone().for_each_chunk(&mut [1, 2], 0, |_, _| ());
}
