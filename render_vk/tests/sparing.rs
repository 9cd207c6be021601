//! A picture pays for what it shows, and a renderer for what its scene has.
//!
//! In:    the planet of `planet`; pictures and settings with and without each optional part.
//! Out:   counts of pipelines, command buffers, buffers and their bytes.
//! Keeps: nothing.
//! Not here: what a frame of a scene does without a renderer (`tests/contracts/sparing.rs`).

mod planet;
#[expect(dead_code, reason = "settings and skipping only: there is a planet to draw")]
mod stage;

use glam::DVec3;
use overfly_core::mesh::{PatchMorph, Patches};
use overfly_core::scene::FrameParts;
use overfly_jobs::Team;
use overfly_render_vk::{Backdrop, DrawReport, Overlay, Picture, Renderer, RendererSettings, Show};

const SIZE_PX: [u32; 2] = [64, 48];
const PATCHES: u32 = 8 << 6;
const NOTHING: Backdrop = Backdrop::Colour([0.0; 3]);

fn settings() -> RendererSettings {
    let patch_depth = planet::PATCH_DEPTH;
    RendererSettings { patch_depth, ..stage::settings(SIZE_PX, PATCHES) }
}

/// Draws the planet, or nothing of it.
fn draw(
    renderer: &mut Renderer,
    patches: &Patches,
    (backdrop, show, overlay): (Backdrop, Show, &Overlay),
    parts: FrameParts,
) -> DrawReport {
    let eye = DVec3::new(0.8, 0.5, 0.33).normalize() * 6.45e6;
    let camera = planet::camera(eye, DVec3::ZERO, SIZE_PX, 60.0);
    let view = planet::draws(camera, patches, &[0.1]);
    let picture = Picture { show, overlay, backdrop, ..Picture::of(&view, patches, &parts) };
    renderer.draw(&picture, &Team::alone()).unwrap()
}

#[test]
fn sky_overlay_and_debug_views_are_made_for_the_picture_that_has_them() {
    let Some(mut renderer) = stage::renderer(&settings()) else { return };
    let patches = planet::patches(3, 4000.0);
    let mut overlay = Overlay::default();
    let bare = FrameParts::default();
    let ground = draw(&mut renderer, &patches, (NOTHING, Show::Shaded, &overlay), bare);
    let totals = renderer.device_totals();
    assert_eq!(ground.pipelines, 1, "the ground's alone");

    // Sun and sea are another program of the ground: the same work, to the last count, for the host.
    let lit = FrameParts { sun_direction: Some(DVec3::X), sea: true };
    let again = draw(&mut renderer, &patches, (NOTHING, Show::Shaded, &overlay), lit);
    assert_eq!((again.uploaded_patches, again.uploaded_bytes, again.pipelines), (0, 0, 2));
    let DrawReport { uploaded_patches, uploaded_bytes, pipelines, .. } = ground;
    assert_eq!(DrawReport { uploaded_patches, uploaded_bytes, pipelines, ..again }, ground);
    assert_eq!(renderer.device_totals(), totals);

    let sky = draw(&mut renderer, &patches, (Backdrop::Sky, Show::Shaded, &overlay), lit);
    assert_eq!((sky.pipelines, sky.secondaries), (3, ground.secondaries + 1));
    assert_eq!(renderer.device_totals(), totals, "the sky needs no buffer");

    overlay.text([2.0, 2.0], 1.0, [255; 4], "more");
    let written = draw(&mut renderer, &patches, (NOTHING, Show::Shaded, &overlay), bare);
    assert_eq!((written.pipelines, written.secondaries), (4, ground.secondaries + 1));
    let with_overlay = renderer.device_totals();
    assert!(with_overlay.allocations > totals.allocations, "{with_overlay:?}");

    let overlay = Overlay::default();
    let levels = draw(&mut renderer, &patches, (NOTHING, Show::Normals, &overlay), bare);
    assert_eq!((levels.pipelines, levels.secondaries), (5, ground.secondaries));
    let last = draw(&mut renderer, &patches, (NOTHING, Show::Shaded, &overlay), bare);
    assert_eq!((last.secondaries, last.commands), (ground.secondaries, ground.commands));
}

#[test]
fn programs_of_the_scene_are_made_before_its_first_picture() {
    let settings = RendererSettings { sea: true, sun: true, ..settings() };
    let Some(mut renderer) = stage::renderer(&settings) else { return };
    let patches = planet::patches(3, 4000.0);
    let lit = FrameParts { sun_direction: Some(DVec3::X), sea: true };
    let overlay = Overlay::default();
    let first = draw(&mut renderer, &patches, (NOTHING, Show::Shaded, &overlay), lit);
    assert_eq!(first.pipelines, 1, "no other than that of the settings");
}

#[test]
fn a_view_without_ground_draws_nothing() {
    let Some(mut renderer) = stage::renderer(&settings()) else { return };
    let patches = Patches::new(planet::PATCH_DEPTH, PATCHES);
    let overlay = Overlay::default();
    let empty =
        draw(&mut renderer, &patches, (NOTHING, Show::Shaded, &overlay), FrameParts::default());
    let counts = (empty.draws, empty.commands, empty.secondaries, empty.uploaded_bytes);
    assert_eq!(counts, (0, 0, 0, 0));
}

#[test]
fn morphs_and_imagery_have_buffers_where_the_scene_has_them() {
    let Some(plain) = stage::renderer(&settings()) else { return };
    let plain = plain.device_totals();
    let vertices = planet::patches(3, 4000.0).vertices.len() as u64;
    let moving = RendererSettings { morph_s: 0.5, ..settings() };
    let moving = stage::renderer(&moving).unwrap().device_totals();
    assert_eq!(moving.allocations, plain.allocations + 1);
    let morphs = vertices * size_of::<PatchMorph>() as u64;
    assert!(moving.bytes >= plain.bytes + morphs, "{moving:?}, {plain:?}");
    let draped = RendererSettings { imagery: true, ..settings() };
    let draped = stage::renderer(&draped).unwrap().device_totals();
    assert!(draped.allocations >= plain.allocations + 2, "{draped:?}, {plain:?}");
    assert!(draped.bytes > plain.bytes + (1 << 20), "{draped:?}, {plain:?}");
}
