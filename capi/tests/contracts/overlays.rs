//! Overlays: the façade's pixels, and what is refused.
//!
//! In:    shapes and segments, good and bad; a Vulkan device and the Khronos layer.
//! Out:   test results; those that draw are skipped by name without a device.
//! Keeps: nothing.
//! Not here: allocations (`c_drawing_allocation`), triangles (`render_vk`).

use super::calls::*;
use super::drawing::Both;
use super::lent::*;
use overfly::config;
use overfly::core::geodesy::Geodetic;
use overfly::core::settings::SceneSettings;
use overfly::render_vk::{Overlay, Show};
use overfly_c::drawing::*;
use overfly_c::overlay::*;
use overfly_c::renderer::*;
use overfly_c::status::*;
use std::ffi::c_char;
use std::ptr::{dangling_mut, null, null_mut};

const RED: [u8; 4] = [250, 20, 20, 255];
const PALE: [u8; 4] = [255, 255, 255, 96];
const TEXT: &str = "ALT 1 200 ft\n37° Ünlüe 山";

fn shapes(text: *const c_char) -> [ovf_overlay_shape; 4] {
    let plain = ovf_overlay_shape { srgba: RED, ..sized() };
    [
        // Half of it is beneath the text, half beyond the picture.
        ovf_overlay_shape {
            kind: OVF_SHAPE_RECTANGLE,
            at_px: [-20.0, 8.0],
            size_px: [150.5, 60.0],
            srgba: PALE,
            ..plain
        },
        ovf_overlay_shape { kind: OVF_SHAPE_TEXT, at_px: [12.0, 16.0], scale: 2.0, text, ..plain },
        ovf_overlay_shape { at_px: [600.25, 20.0], to_px: [320.0, 350.0], ..plain },
        ovf_overlay_shape { kind: OVF_SHAPE_RECTANGLE, at_px: [300.0, 340.0], ..plain },
    ]
}

/// Up from the ground of [`dive`], and one that goes through the eye's back.
fn segments(scene: &SceneSettings) -> [ovf_overlay_segment; 2] {
    let at = |lat_rad, lon_rad, height_m| {
        let place = Geodetic { lat_rad, lon_rad, height_m };
        scene.body.ecef_from_geodetic(place).0.to_array()
    };
    let plain: ovf_overlay_segment = sized();
    let (a_ecef_m, b_ecef_m) = (at(0.25, 0.34, 5.0), at(0.26, 0.38, 60.0));
    let near = at(0.25, 0.31, 130.0);
    [
        ovf_overlay_segment { srgba: PALE, a_ecef_m, b_ecef_m, ..plain },
        ovf_overlay_segment { srgba: RED, a_ecef_m: near, b_ecef_m: a_ecef_m, ..plain },
    ]
}

fn overlay(shapes: &[ovf_overlay_shape], segments: &[ovf_overlay_segment]) -> ovf_overlay {
    ovf_overlay {
        shape_count: u32::try_from(shapes.len()).unwrap(),
        shapes: shapes.as_ptr(),
        segment_count: u32::try_from(segments.len()).unwrap(),
        segments: segments.as_ptr(),
        ..sized()
    }
}

fn in_rust(shapes: &[ovf_overlay_shape], segments: &[ovf_overlay_segment]) -> Overlay {
    let mut overlay = Overlay::default();
    // Segments come first, whatever the order in which they are added.
    let [below, text, line, empty] = shapes else { panic!("the four above") };
    overlay.rect(below.at_px, below.size_px, below.srgba);
    overlay.text(text.at_px, text.scale, text.srgba, TEXT);
    overlay.line(line.at_px, line.to_px, line.srgba);
    overlay.rect(empty.at_px, empty.size_px, empty.srgba);
    for it in segments {
        overlay.segment(it.a_ecef_m.into(), it.b_ecef_m.into(), it.srgba);
    }
    overlay
}

/// How many pixels differ.
fn differ(a: &[u8], b: &[u8]) -> usize {
    assert_eq!(a.len(), b.len());
    a.chunks_exact(4).zip(b.chunks_exact(4)).filter(|(a, b)| a != b).count()
}

#[test]
fn text_boxes_and_lines_are_the_facade_s_to_the_last_byte() {
    let test = "text_boxes_and_lines_are_the_facade_s_to_the_last_byte";
    if !go_on("overlays", test) {
        return;
    }
    let scene = config::load("small").unwrap();
    let mut both = Both::new(scene.clone());
    (0..30).for_each(|frame| both.fly(frame, None));
    let text = std::ffi::CString::new(TEXT).unwrap();
    let (shapes, segments) = (shapes(text.as_ptr()), segments(&scene));
    let overlay = overlay(&shapes, &segments);
    let mut drawn = |picture| {
        draw_in_c(&mut both.canvas, both.renderer, picture);
        both.canvas.read_pixels().unwrap()
    };
    let bare = drawn(sized());
    let over = drawn(ovf_picture { overlay: &raw const overlay, ..sized() });
    // A program of the first version says nothing of overlays.
    let struct_size = u32::try_from(std::mem::offset_of!(ovf_picture, overlay)).unwrap();
    let older = ovf_picture { struct_size, overlay: dangling_mut(), ..sized() };
    assert_eq!(differ(&drawn(older), &bare), 0, "what was over the last picture is gone");
    let no_shapes = ovf_overlay { shape_count: 0, shapes: null(), ..overlay };
    let lines = drawn(ovf_picture { overlay: &raw const no_shapes, ..sized() });

    let expected = both.facade.draw((0, [0, 0]), Show::Shaded);
    assert_eq!(differ(&expected, &bare), 0);
    both.facade.overfly.looks_mut().overlay = in_rust(&shapes, &segments);
    let expected = both.facade.draw((0, [0, 0]), Show::Shaded);
    assert!(expected == over, "{} pixels differ", differ(&expected, &over));
    let (of_all, of_lines) = (differ(&over, &bare), differ(&lines, &bare));
    println!("{of_all} pixels of the overlay, {of_lines} of lines in the scene");
    assert!(of_lines > 100 && of_all > of_lines + 5000, "{of_all}, {of_lines}");
    both.close();
}

/// Asserts how a call ended, and that its sentence names what was wrong.
#[track_caller]
fn ends(status: ovf_status, wanted: ovf_status, says: &str) {
    assert_eq!(status, wanted, "{}", last_error());
    let said = last_error();
    assert!(said.contains(says), "`{said}` does not say `{says}`");
}

/// What uploads say to an overlay, of a renderer that never was: `OVF_STALE` where it is good.
fn uploads(overlay: ovf_overlay) -> ovf_status {
    let frame = ovf_host_frame { command_buffer: dangling_mut::<u64>().cast(), ..sized() };
    let picture = ovf_picture { overlay: &raw const overlay, ..sized() };
    let none = ovf_renderer { bits: 0 };
    // SAFETY: pointers are null or good; there is no renderer that would use the handle.
    unsafe { ovf_renderer_record_uploads(none, &frame, &picture, null_mut()) }
}

#[test]
fn overlays_that_cannot_be_are_refused_before_anything_is_done() {
    let letters = c"abc".as_ptr();
    let shape = |change: fn(&mut ovf_overlay_shape)| {
        let mut shapes = shapes(letters);
        shapes.iter_mut().take(2).for_each(change);
        uploads(overlay(&shapes, &[]))
    };
    ends(shape(|_| {}), OVF_STALE, "is 0, which names none");
    ends(shape(|it| it.kind = 3), OVF_INVALID, "overlay: shapes[0]: kind is 3, allowed is 0 to 2");
    ends(shape(|it| it.struct_size = 40), OVF_STRUCT_SIZE, "sizeof(ovf_overlay_shape)");
    for bad in [f32::NAN, f32::INFINITY, -1.1e6] {
        let with = |change: fn(&mut ovf_overlay_shape, f32)| {
            let mut shapes = shapes(letters);
            shapes.iter_mut().for_each(|it| change(it, bad));
            uploads(overlay(&shapes, &[]))
        };
        ends(with(|it, bad| it.at_px[1] = bad), OVF_INVALID, "shapes[0]: at_px has ");
        ends(with(|it, bad| it.to_px[0] = bad), OVF_INVALID, "shapes[2]: to_px has ");
        ends(with(|it, bad| it.size_px[0] = bad), OVF_INVALID, "shapes[0]: size_px has ");
        ends(with(|it, bad| it.scale = bad), OVF_INVALID, "shapes[1]: scale is ");
    }
    let text = shape(|it| it.text = null());
    ends(text, OVF_NULL_POINTER, "shapes[1]: text is null");
    ends(shape(|it| it.text = c"\xff".as_ptr()), OVF_INVALID, "shapes[1]: text is not UTF-8");

    let good: [ovf_overlay_segment; 2] = [sized(), sized()];
    ends(uploads(overlay(&[], &good)), OVF_STALE, "is 0, which names none");
    for bad in [f64::NAN, f64::NEG_INFINITY, 2e12] {
        let mut segments = good;
        segments[1].b_ecef_m[2] = bad;
        ends(uploads(overlay(&[], &segments)), OVF_INVALID, "segments[1]: b_ecef_m has ");
    }
    let mixed = [good[0], ovf_overlay_segment { struct_size: 8, ..good[1] }];
    ends(uploads(overlay(&[], &mixed)), OVF_STRUCT_SIZE, "sizeof(ovf_overlay_segment)");
}

#[test]
fn arrays_of_overlays_are_whole_and_frames_are_good() {
    let none: ovf_overlay = sized();
    ends(uploads(none), OVF_STALE, "is 0, which names none");
    ends(uploads(ovf_overlay { struct_size: 24, ..none }), OVF_STRUCT_SIZE, "sizeof(ovf_overlay)");
    ends(uploads(ovf_overlay { shape_count: 1, ..none }), OVF_NULL_POINTER, "shapes[0]");
    ends(uploads(ovf_overlay { segment_count: 1, ..none }), OVF_NULL_POINTER, "segments[0]");
    let many = uploads(ovf_overlay { segment_count: 32_769, ..none });
    ends(many, OVF_INVALID, "segment_count is 32769, allowed is at most 32768");
    let frame = ovf_host_frame { command_buffer: dangling_mut::<u64>().cast(), ..sized() };
    let record = |frame: *const _, at: [i32; 2]| {
        let none = ovf_renderer { bits: 0 };
        // SAFETY: pointers are null or good; there is no renderer that would use the handle.
        unsafe { ovf_renderer_record_overlay(none, frame, at[0], at[1]) }
    };
    ends(record(null(), [0, 0]), OVF_NULL_POINTER, "frame is null");
    ends(record(&sized(), [0, 0]), OVF_NULL_POINTER, "command_buffer is null");
    ends(record(&frame, [0, -4]), OVF_INVALID, "top_px is -4");
    ends(record(&frame, [0, 0]), OVF_STALE, "is 0, which names none");
}
