//! A scene pays for what it has: nothing is done and nothing kept for what it has not.
//!
//! In:    scenes with and without views, sea, sun, morphs, imagery, a renderer.
//! Out:   counts of jobs, columns and pages; digests.
//! Keeps: nothing.
//! Not here: pipelines and buffers (`render_vk/tests/sparing.rs`), heap calls (`pays_nothing`).

use super::flights::Tour;
use overfly::core::datasource::PageKey;
use overfly::core::frame::{FrameInput, FrameOutput};
use overfly::core::settings::SceneSettings;
use overfly::{Overfly, config};

fn small() -> SceneSettings {
    config::load("small").unwrap()
}

/// Names of the jobs of the last frame.
fn jobs(overfly: &Overfly) -> Vec<&'static str> {
    overfly.spans().stages().map(|record| record.span.0).collect()
}

#[test]
fn a_frame_without_a_renderer_has_six_jobs_and_no_picture() {
    let mut tour = Tour::new("descent", "small", 0);
    tour.frame(0, false);
    // A seventh, `render_vk.record`, comes with a renderer.
    let all =
        ["camera", "datasource.admit", "lod.prioritise", "lod.refine", "mesh.build", "mesh.place"];
    let mut found = jobs(&tour.overfly);
    found.sort_unstable();
    assert_eq!(found, all);
    assert!(tour.overfly.draw(&tour.output, 0).unwrap().is_none());
}

#[test]
fn without_views_nothing_is_refined_wanted_or_drawn() {
    let mut overfly = Overfly::new(&small(), 0).unwrap();
    let (mut input, mut output) = (FrameInput::default(), FrameOutput::default());
    for frame in 0..5 {
        input.time_s = f64::from(frame);
        overfly.frame(&mut input, &mut output).unwrap();
        let counts = &output.counts;
        assert_eq!((counts.splits, counts.merges, counts.drawn), (0, 0, 0), "frame {frame}");
        assert!(output.views.is_empty());
    }
    assert_eq!(output.counts.evaluations, 0);
}

#[test]
fn columns_are_there_for_what_the_scene_has() {
    let plain = SceneSettings { sea: false, sun: None, ..small() };
    let mut still = plain.clone();
    still.lod.morph_s = 0.0;
    let [moving, still] = [plain, still].map(|scene| Overfly::new(&scene, 0).unwrap());
    let columns = |overfly: &Overfly| {
        let patches = overfly.terrain().patches();
        (patches.morphs.len(), patches.drapes.len(), patches.vertices.len())
    };
    let (morphs, drapes, vertices) = columns(&moving);
    assert_eq!((morphs, drapes), (vertices, 0));
    assert_eq!(columns(&still), (0, 0, vertices));
    let page = still.sources().page(PageKey::root(0)).unwrap();
    assert!(page.survey.is_none() && page.colour.is_none(), "what real ground has");
}

#[test]
fn sun_and_what_is_drawn_otherwise_change_no_bit_of_a_frame() {
    let mut scene = small();
    scene.depth.splits_m.clear();
    let dark = SceneSettings { sun: None, ..scene.clone() };
    let digests = [scene, dark].map(|scene| {
        let overfly = Overfly::new(&scene, 0).unwrap();
        let mut tour = Tour::over(overfly, scene, "descent");
        let digest = |index| {
            tour.frame(index, false);
            tour.output.digest
        };
        (0..40).map(digest).collect::<Vec<_>>()
    });
    assert_eq!(digests[0], digests[1]);
}
