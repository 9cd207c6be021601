//! Frames and their pictures allocate nothing once warm, with a renderer that C holds.
//!
//! In:    a terrain that stands still, text over it, a counting allocator; a Vulkan device, or none.
//! Out:   passes or fails; skipped by name without a device, unless `OVERFLY_REQUIRE_GPU` is 1.
//! Keeps: a count of allocations.
//! Not here: questions to the ground (`c_allocation`), frames that fetch pages.

#[path = "contracts/calls.rs"]
#[expect(dead_code, reason = "the other tests use the rest")]
mod calls;
#[path = "../../tests/counting.rs"]
mod counting;
#[path = "contracts/lent.rs"]
#[expect(dead_code, reason = "the other tests use the rest")]
mod lent;

use calls::*;
use counting::allocations;
use lent::host_vulkan::canvas::Canvas;
use lent::host_vulkan::host::Host;
use lent::*;
use overfly::config;
use overfly::render_vk::RendererSettings;
use overfly_c::drawing::ovf_picture;
use overfly_c::overlay::*;
use overfly_c::renderer::ovf_renderer_destroy;
use overfly_c::terrain::ovf_terrain_destroy;
use std::rc::Rc;

// One test in this binary: the count is of the whole process.
#[test]
fn frames_and_pictures_allocate_nothing_once_warm() {
    if !device("frames_and_pictures_allocate_nothing_once_warm") {
        return;
    }
    let host = Rc::new(Host::new().unwrap());
    let overfly = opened_in_rust();
    let scene = config::load("small").unwrap();
    let settings = RendererSettings::of(&scene, overfly.terrain().limits(), SIZE_PX);
    let mut canvas = Canvas::new(&host, SIZE_PX, &settings).unwrap();
    let terrain = open_small(Some(&waiting()));
    let renderer = renderer_of(terrain, &canvas);
    let text = c"steady".as_ptr();
    let shape = ovf_overlay_shape { kind: OVF_SHAPE_TEXT, scale: 1.0, text, ..sized() };
    let overlay = ovf_overlay { shape_count: 1, shapes: &raw const shape, ..sized() };
    let step = |canvas: &mut Canvas, frame: usize| {
        fly_views(terrain, frame, &[dive(0)], None);
        draw_in_c(canvas, renderer, ovf_picture { overlay: &raw const overlay, ..sized() }).draws
    };
    let warm: u32 = (0..40).map(|frame| step(&mut canvas, frame)).sum();
    let before = allocations();
    let draws: u32 = (40..60).map(|frame| step(&mut canvas, frame)).sum();
    assert_eq!(allocations() - before, 0);
    assert!(warm > 0 && draws > 1000, "{warm}, {draws}");
    host.wait_idle().unwrap();
    must(ovf_renderer_destroy(renderer));
    must(ovf_terrain_destroy(terrain));
    drop(canvas);
    end(host);
}
