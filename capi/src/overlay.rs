//! Text, boxes and lines over a picture, as C has them.
//!
//! In:    arrays of shapes and of segments; a renderer with a picture that has some.
//! Out:   the façade's overlay, filled; draws recorded.
//! Keeps: nothing.
//! Not here: what else a picture shows (`drawing`), triangles (`render_vk`).

use crate::border::{Caller, Sized32, answer};
use crate::drawing::{check_corner, check_index, ovf_host_frame};
use crate::renderer::{ovf_renderer, shared};
use crate::status::{Fault, ovf_status};
use crate::vulkan::{frame_of, overlay as record_overlay};
use bytemuck::Zeroable;
use overfly::render_vk::Overlay;
use std::ffi::c_char;

/// `ovf_overlay_shape.kind`: a line, 1.25 pixels wide.
pub const OVF_SHAPE_LINE: u32 = 0;
/// `ovf_overlay_shape.kind`: a filled rectangle.
pub const OVF_SHAPE_RECTANGLE: u32 = 1;
/// `ovf_overlay_shape.kind`: text.
pub const OVF_SHAPE_TEXT: u32 = 2;

/// Most shapes, and most segments: as many rectangles are all that a picture takes.
const COUNT_MAX: u32 = 1 << 15;
/// Farthest place and largest size: beyond it pixels in f32 are too coarse to be of use.
const PIXELS_MAX: f32 = 1e6;
/// Largest letters.
const SCALE_MAX: f32 = 1000.0;
/// Farthest end of a segment from the body's centre, along each axis.
const ECEF_MAX_M: f64 = 1e12;

/// A shape on a picture. Pixels go right and down from the picture's top left corner.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_overlay_shape {
    /// `sizeof(ovf_overlay_shape)`.
    pub struct_size: u32,
    /// `OVF_SHAPE_…`.
    pub kind: u32,
    /// One end of a line; the top left corner of a rectangle or text; within 1e6 pixels.
    pub at_px: [f32; 2],
    /// The other end of a line; nobody reads it elsewhere.
    pub to_px: [f32; 2],
    /// Width and height of a rectangle, 0 to 1e6; nobody reads it elsewhere.
    pub size_px: [f32; 2],
    /// Red, green, blue with the sRGB curve; opacity.
    pub srgba: [u8; 4],
    /// Of text: its letters stand in cells of 8 by 8 pixels times this, above 0 up to 1000.
    pub scale: f32,
    /// Of text: Latin letters in UTF-8; a line feed begins a line. What the font lacks is a question
    /// mark.
    pub text: *const c_char,
}

/// A line in the scene.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_overlay_segment {
    /// `sizeof(ovf_overlay_segment)`.
    pub struct_size: u32,
    /// Red, green, blue with the sRGB curve; opacity.
    pub srgba: [u8; 4],
    /// One end, within 1e12 m.
    pub a_ecef_m: [f64; 3],
    /// The other one.
    pub b_ecef_m: [f64; 3],
}

/// What is drawn over a picture: first the segments, then the shapes, each in order. None of it is
/// hidden by the ground. What goes beyond 65 536 triangles is not drawn: lines and rectangles are two
/// each, a letter some forty.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_overlay {
    /// `sizeof(ovf_overlay)`.
    pub struct_size: u32,
    /// How many shapes, at most 32 768.
    pub shape_count: u32,
    /// They; may be null where there are none.
    pub shapes: *const ovf_overlay_shape,
    /// How many segments, at most 32 768.
    pub segment_count: u32,
    /// 0.
    pub reserved: u32,
    /// They; may be null where there are none.
    pub segments: *const ovf_overlay_segment,
}

/// Looks at an overlay, before anything is done; null is none.
pub fn check(caller: &Caller, overlay: *const ovf_overlay) -> Result<(), Fault> {
    each(caller, overlay, |_| {})
}

/// Puts it into the façade's, whose memory is reused.
pub fn fill(caller: &Caller, overlay: *const ovf_overlay, into: &mut Overlay) -> Result<(), Fault> {
    into.clear();
    each(caller, overlay, |part| match part {
        Part::Segment(it) => into.segment(it.a_ecef_m.into(), it.b_ecef_m.into(), it.srgba),
        Part::Line(it) => into.line(it.at_px, it.to_px, it.srgba),
        Part::Rectangle(it) => into.rect(it.at_px, it.size_px, it.srgba),
        Part::Text(it, text) => into.text(it.at_px, it.scale, it.srgba, text),
    })
}

/// One thing of an overlay, looked at.
enum Part<'a> {
    Segment(ovf_overlay_segment),
    Line(ovf_overlay_shape),
    Rectangle(ovf_overlay_shape),
    Text(ovf_overlay_shape, &'a str),
}

fn each(
    caller: &Caller,
    overlay: *const ovf_overlay,
    mut take: impl FnMut(Part<'_>),
) -> Result<(), Fault> {
    if overlay.is_null() {
        return Ok(());
    }
    let overlay = caller.sized("overlay", overlay)?;
    let segments = (overlay.segments, overlay.segment_count);
    all(caller, "segment", segments, |it| {
        take(Part::Segment(segment_of(it)?));
        Ok(())
    })?;
    all(caller, "shape", (overlay.shapes, overlay.shape_count), |it| {
        take(shape_of(caller, it)?);
        Ok(())
    })
}

/// Runs `act` on each struct of an array; faults say which.
fn all<T: Sized32>(
    caller: &Caller,
    name: &str,
    (start, count): (*const T, u32),
    mut act: impl FnMut(T) -> Result<(), Fault>,
) -> Result<(), Fault> {
    if count > COUNT_MAX {
        let sentence = format!("overlay: {name}_count is {count}, allowed is at most {COUNT_MAX}");
        return Err(Fault::invalid(sentence));
    }
    for index in 0..count as usize {
        let of_one = |fault: Fault| {
            let sentence = format!("overlay: {name}s[{index}]: {}", fault.sentence);
            Fault::new(fault.status, sentence)
        };
        let one = caller.sized_at(name, start, index).map_err(of_one)?;
        act(one).map_err(of_one)?;
    }
    Ok(())
}

fn segment_of(it: ovf_overlay_segment) -> Result<ovf_overlay_segment, Fault> {
    for (name, end) in [("a_ecef_m", it.a_ecef_m), ("b_ecef_m", it.b_ecef_m)] {
        let within = -ECEF_MAX_M..=ECEF_MAX_M;
        if let Some(bad) = end.into_iter().find(|found| !within.contains(found)) {
            let sentence = format!("{name} has {bad}, allowed is within {ECEF_MAX_M:e}");
            return Err(Fault::invalid(sentence));
        }
    }
    Ok(it)
}

fn shape_of(caller: &Caller, it: ovf_overlay_shape) -> Result<Part<'_>, Fault> {
    within("at_px", it.at_px, -PIXELS_MAX)?;
    match it.kind {
        OVF_SHAPE_LINE => within("to_px", it.to_px, -PIXELS_MAX).map(|()| Part::Line(it)),
        OVF_SHAPE_RECTANGLE => within("size_px", it.size_px, 0.0).map(|()| Part::Rectangle(it)),
        OVF_SHAPE_TEXT if it.scale > 0.0 && it.scale <= SCALE_MAX => {
            Ok(Part::Text(it, caller.text("text", it.text)?))
        }
        OVF_SHAPE_TEXT => {
            let found = it.scale;
            let sentence = format!("scale is {found}, allowed is above 0 up to {SCALE_MAX}");
            Err(Fault::invalid(sentence))
        }
        kind => {
            let sentence = format!("kind is {kind}, allowed is 0 to {OVF_SHAPE_TEXT}");
            Err(Fault::invalid(sentence))
        }
    }
}

fn within(name: &str, found: [f32; 2], least: f32) -> Result<(), Fault> {
    match found.into_iter().find(|found| !(least..=PIXELS_MAX).contains(found)) {
        None => Ok(()),
        Some(bad) => {
            let sentence = format!("{name} has {bad}, allowed is {least} to {PIXELS_MAX}");
            Err(Fault::invalid(sentence))
        }
    }
}

/// Records the overlay of the picture that `ovf_renderer_record_uploads` was given last with this
/// index, over whatever was drawn, in the subpass that the renderer was made for; nothing where it
/// had none. Depth is neither read nor written. The picture's top left corner is at `left_px`,
/// `top_px`, as for `ovf_renderer_record_range`, which says what is set otherwise afterwards.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_renderer_record_overlay(
    renderer: ovf_renderer,
    frame: *const ovf_host_frame,
    left_px: i32,
    top_px: i32,
) -> ovf_status {
    answer!(|caller: &Caller| {
        let frame = frame_of(caller, frame)?;
        let at_px = check_corner(left_px, top_px)?;
        shared(renderer, |drawn| {
            check_index(frame.index, drawn.settings().frames_in_flight)?;
            Ok(record_overlay(caller, drawn, frame, at_px)?)
        })
    })
}
