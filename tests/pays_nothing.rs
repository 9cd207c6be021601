//! A frame and its columns allocate nothing in the steady state.
//!
//! In:    the `small` and `earth` scenes, a counting allocator.
//! Out:   passes or fails.
//! Keeps: a count of allocations.
//! Not here: the same for bare graphs (`jobs/tests`).

mod counting;

use overfly::core::frame::{FrameInput, FrameOutput};
use overfly::{DrawColumns, Overfly, VertexColumns, config, replay};

/// Flies a stretch and returns (frames with page arrivals, splits, allocations inside frames).
fn fly(workers: usize, warm_up: usize, frames: usize) -> (u32, u32, u64) {
    let scene = config::load("earth").unwrap();
    let mut overfly = Overfly::new(&scene, workers).unwrap();
    let mut loader = overfly.loader(1).unwrap();
    let flight = overfly.flight("rainier").unwrap();
    let (mut input, mut output) = (FrameInput::default(), FrameOutput::default());
    let (mut draws, mut vertices) = (DrawColumns::default(), VertexColumns::default());
    let (mut with_pages, mut splits, mut allocations) = (0, 0, 0);
    for (index, pose) in flight.poses[..warm_up + frames].iter().enumerate() {
        input.views.clear();
        input.views.push(replay::view_of(pose, &scene.views[0], [1280, 720], &scene.body));
        loader.fetch(&output.wanted, &mut input.arrived);
        let before = counting::allocations();
        overfly.frame(&mut input, &mut output).unwrap();
        overfly.columns(&output, 0, &mut draws).unwrap();
        // While it warms up, as a renderer that comes late.
        let slots = if index < warm_up { &draws.slot } else { &output.built };
        overfly.vertices(slots, &mut vertices).unwrap();
        if index >= warm_up {
            allocations += counting::allocations() - before;
            with_pages += u32::from(output.counts.admitted > 0);
            splits += output.counts.splits;
        }
    }
    (with_pages, splits, allocations)
}

#[test]
fn a_frame_and_its_columns_allocate_nothing_in_the_steady_state() {
    for workers in [0, 1] {
        let (with_pages, splits, allocations) = fly(workers, 600, 900);
        println!("{workers} workers: {with_pages} frames with pages, {splits} splits");
        assert!(splits > 0, "nothing happened in these frames");
        assert_eq!(allocations, 0, "{workers} workers");
    }
}
