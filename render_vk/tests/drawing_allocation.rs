//! A picture allocates nothing on the host once the first ones are drawn.
//!
//! In:    the planet of `planet`, a counting allocator.
//! Out:   passes or fails.
//! Keeps: a count of allocations.
//! Not here: the device's memory (`steady`), what drivers allocate.

#[path = "../../tests/counting.rs"]
mod counting;
mod planet;
#[expect(dead_code, reason = "settings and skipping only: there is a planet to draw")]
mod stage;

use counting::allocations;
use glam::DVec3;
use overfly_core::scene::FrameParts;
use overfly_core::settings::VertexPrecision;
use overfly_jobs::Team;
use overfly_render_vk::{Overlay, Picture, RendererSettings, Show};

const SIZE_PX: [u32; 2] = [64, 48];

#[test]
fn pictures_allocate_nothing_after_the_first_ones() {
    for vertices in [VertexPrecision::TwoFloat, VertexPrecision::EyeF64] {
        let patches = planet::patches(3, 4000.0);
        let settings = RendererSettings {
            patch_depth: planet::PATCH_DEPTH,
            vertices,
            ..stage::settings(SIZE_PX, patches.used_end())
        };
        let Some(mut renderer) = stage::renderer(&settings) else { return };
        let eye = DVec3::new(0.8, 0.5, 0.33).normalize() * 6.45e6;
        let camera = planet::camera(eye, DVec3::ZERO, SIZE_PX, 60.0);
        let view = planet::draws(camera, &patches, &[0.1, 30.0, 1e4]);
        let mut overlay = Overlay::default();
        overlay.text([2.0, 2.0], 1.0, [255; 4], "steady");
        overlay.segment(DVec3::X * 6.4e6, DVec3::Y * 6.4e6, [255; 4]);
        let parts = FrameParts { sun_direction: Some(DVec3::X), sea: true };
        let built: Vec<u32> = (0..patches.used_end()).step_by(3).collect();
        let mut draw = |show| {
            renderer.note_built(&built);
            let plain = Picture::of(&view, &patches, &parts);
            let picture = Picture { show, overlay: &overlay, ..plain };
            renderer.draw(&picture, &Team::alone()).unwrap();
        };
        // Twice, because there are two frames in flight.
        (0..2).for_each(|_| Show::ALL.into_iter().for_each(&mut draw));
        let before = allocations();
        (0..4).for_each(|_| Show::ALL.into_iter().for_each(&mut draw));
        assert_eq!(allocations() - before, 0, "{vertices:?}");
    }
}
