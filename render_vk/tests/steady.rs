//! After the first pictures a picture costs what is new in it and nothing else.
//!
//! In:    the planet of `planet`; how much is new from picture to picture.
//! Out:   uploads in proportion to it; no new pipeline, no new memory on the device.
//! Keeps: nothing.
//! Not here: allocations of the host (`drawing_allocation`), times (benches).

mod planet;
#[expect(dead_code, reason = "settings and skipping only: there is a planet to draw")]
mod stage;

use glam::DVec3;
use overfly_core::mesh::{PatchMorph, Patches};
use overfly_core::scene::FrameParts;
use overfly_core::settings::VertexPrecision;
use overfly_jobs::Team;
use overfly_render_vk::{DrawReport, Overlay, Picture, Renderer, RendererSettings, Show};

const SIZE_PX: [u32; 2] = [64, 48];
const PATCHES: u32 = 8 << 6;
const BORDERS_M: [f64; 3] = [0.1, 30.0, 1e4];

fn settings(vertices: VertexPrecision, morph_s: f64) -> RendererSettings {
    let patch_depth = planet::PATCH_DEPTH;
    RendererSettings { patch_depth, vertices, morph_s, ..stage::settings(SIZE_PX, PATCHES) }
}

fn draw(renderer: &mut Renderer, show: Show, patches: &Patches) -> DrawReport {
    let eye = DVec3::new(0.8, 0.5, 0.33).normalize() * 6.45e6;
    let camera = planet::camera(eye, DVec3::ZERO, SIZE_PX, 60.0);
    let view = planet::draws(camera, patches, &BORDERS_M);
    let mut overlay = Overlay::default();
    overlay.text([2.0, 2.0], 1.0, [255; 4], "steady");
    let parts = FrameParts { sun_direction: Some(DVec3::X), sea: true };
    let picture = Picture { show, overlay: &overlay, ..Picture::of(&view, patches, &parts) };
    renderer.draw(&picture, &Team::alone()).unwrap()
}

#[test]
fn what_is_uploaded_is_what_is_new() {
    for (morph_s, vertex_bytes) in [(0.0, 36), (0.5, 36 + 24)] {
        let settings = settings(VertexPrecision::TwoFloat, morph_s);
        let Some(mut renderer) = stage::renderer(&settings) else { return };
        let mut patches = planet::patches(3, 4000.0);
        if morph_s > 0.0 {
            patches.morphs = vec![PatchMorph::EMPTY; patches.vertices.len()];
        }
        let first = draw(&mut renderer, Show::Shaded, &patches);
        assert_eq!(first.uploaded_patches, PATCHES);
        for new in [0, 1, 2, 5, 50, 500] {
            let slots: Vec<u32> = (0..new).map(|i| i * 37 % PATCHES).collect();
            renderer.note_built(&slots);
            let report = draw(&mut renderer, Show::Shaded, &patches);
            let bytes = u64::from(new) * u64::from(patches.vertices_per_patch) * vertex_bytes;
            assert_eq!((report.uploaded_patches, report.uploaded_bytes), (new, bytes));
        }
    }
}

#[test]
fn nothing_is_made_after_the_first_pictures() {
    for vertices in [VertexPrecision::TwoFloat, VertexPrecision::EyeF64] {
        let Some(mut renderer) = stage::renderer(&settings(vertices, 0.0)) else { return };
        let patches = planet::patches(3, 4000.0);
        let mut all = || {
            let reports = Show::ALL.map(|show| draw(&mut renderer, show, &patches));
            (reports[Show::ALL.len() - 1].pipelines, renderer.device_totals())
        };
        all();
        let warm = all();
        assert!(warm.0 >= 3 && warm.1.allocations > 0);
        for _ in 0..3 {
            assert_eq!(all(), warm);
        }
    }
}
