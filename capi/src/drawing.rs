//! Frames of a host that draws a terrain into command buffers of its own.
//!
//! In:    renderers, command buffers, what to show; a view and a depth range.
//! Out:   uploads and draws recorded; [`ovf_draw_report`]; projections for the host's own geometry.
//! Keeps: nothing.
//! Not here: making renderers (`renderer`), what is over a picture (`overlay`), calls of Vulkan
//!        (`vulkan`).

use crate::border::{Caller, answer};
use crate::columns::view_of;
use crate::overlay::{check, fill, ovf_overlay};
use crate::renderer::{alone, ovf_renderer, shared};
use crate::status::{Fault, OVF_VULKAN, ovf_status};
use crate::terrain::{ovf_terrain, with};
use crate::vulkan::{frame_of, range as record_range, uploads};
use bytemuck::Zeroable;
use overfly::render_vk::{Backdrop, DrawReport, Picture, Show, projection};
use std::ffi::c_void;

/// `ovf_picture.show`: the ground as one would see it.
pub const OVF_SHOW_SHADED: u32 = 0;
/// `ovf_picture.show`: edges of all triangles, those of patches bolder.
pub const OVF_SHOW_WIREFRAME: u32 = 1;
/// `ovf_picture.show`: levels of leaves.
pub const OVF_SHOW_LEVEL: u32 = 2;
/// `ovf_picture.show`: bound on the error on the screen: white at the tolerance, red from twice on.
pub const OVF_SHOW_SCREEN_ERROR: u32 = 3;
/// `ovf_picture.show`: depths of pages; red where a page is lacking.
pub const OVF_SHOW_RESIDENCY: u32 = 4;
/// `ovf_picture.show`: normals: east red, north green, up blue.
pub const OVF_SHOW_NORMALS: u32 = 5;
/// `ovf_picture.show`: which depth range drew it.
pub const OVF_SHOW_DEPTH_RANGE: u32 = 6;
/// `ovf_picture.show`: all patches there are; red those that no view sees.
pub const OVF_SHOW_CULLED: u32 = 7;

/// `ovf_picture.backdrop`: the farthest range draws the sky behind the ground.
pub const OVF_BACKDROP_SKY: u32 = 0;
/// `ovf_picture.backdrop`: what the host cleared to stays behind the ground.
pub const OVF_BACKDROP_HOST: u32 = 1;

/// Where a host records: one of its command buffers, for one of its frames in flight.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_host_frame {
    /// `sizeof(ovf_host_frame)`.
    pub struct_size: u32,
    /// Which frame in flight, below `ovf_renderer_settings.frames_in_flight`. A host that shows
    /// several views takes another one for each.
    pub index: u32,
    /// `VkCommandBuffer`, primary or secondary, which is being recorded.
    pub command_buffer: *mut c_void,
}

/// What a picture shows.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_picture {
    /// `sizeof(ovf_picture)`.
    pub struct_size: u32,
    /// Which view of the terrain's last frame.
    pub view: u32,
    /// `OVF_SHOW_…`.
    pub show: u32,
    /// `OVF_BACKDROP_…`.
    pub backdrop: u32,
    /// What `ovf_renderer_record_overlay` draws over it; null is nothing. Read during the call.
    pub overlay: *const ovf_overlay,
}

/// How much work a picture is.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_draw_report {
    /// `sizeof(ovf_draw_report)`, set by the host.
    pub struct_size: u32,
    /// Patches copied to the device.
    pub uploaded_patches: u32,
    /// The same in bytes.
    pub uploaded_bytes: u64,
    /// Patches drawn, summed over depth ranges.
    pub draws: u32,
    /// Indirect draw commands that draw them.
    pub commands: u32,
    /// Triangles of all draws.
    pub triangles: u64,
    /// Pipelines made so far.
    pub pipelines: u32,
    /// Depth ranges to record.
    pub ranges: u32,
}

/// Makes a picture of the terrain's last frame ready and records the copies of what is new, with
/// the barriers that they need. Outside a pass, once for each frame and index, before its draws;
/// the device has finished what was recorded with this index before. `report` may be null.
///
/// Buffers are submitted in the order in which their uploads were recorded. Where it fails nothing
/// was recorded; after `OVF_VULKAN` all of the ground is uploaded again. Of the terrain it is a call
/// as any: `OVF_BUSY` during a frame, `OVF_STALE` once it was destroyed.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_renderer_record_uploads(
    renderer: ovf_renderer,
    frame: *const ovf_host_frame,
    picture: *const ovf_picture,
    report: *mut ovf_draw_report,
) -> ovf_status {
    answer!(|caller: &Caller| {
        if !report.is_null() {
            caller.check_out("report", report)?;
        }
        let frame = frame_of(caller, frame)?;
        let picture = caller.sized("picture", picture)?;
        let (show, backdrop) = (show_of(picture.show)?, backdrop_of(picture.backdrop)?);
        check(caller, picture.overlay)?;
        let done = alone(renderer, |drawn, place| {
            check_index(frame.index, drawn.settings().frames_in_flight)?;
            with(place.terrain, |state| {
                let ranges = view_of(state, picture.view)?.ranges.len();
                place.news.tell(drawn);
                let looks = state.overfly.looks_mut();
                (looks.show, looks.backdrop) = (show, backdrop);
                fill(caller, picture.overlay, &mut looks.overlay)?;
                let (overfly, output) = (&mut state.overfly, &state.output);
                let record = |picture: &Picture<'_>| uploads(caller, drawn, frame, picture);
                let recorded = overfly.with_picture(output, picture.view as usize, record);
                let outcome = recorded.expect("the view was looked at").map_err(Fault::from);
                if outcome.as_ref().is_err_and(|fault| fault.status == OVF_VULKAN) {
                    // Patches come again by themselves; tiles that were staged are told of again.
                    place.news.note(&[], &overfly.terrain().tiles());
                }
                Ok(report_of(&outcome?, ranges))
            })
        })?;
        if report.is_null() { Ok(()) } else { caller.put("report", report, done) }
    })
}

/// Records the draws of one depth range, in the subpass that the renderer was made for, after the
/// picture's uploads. From the farthest, `ovf_draw_report.ranges` - 1, to the nearest, 0; the depth
/// was cleared since the one before, to 0 where `ovf_limits.depth_order` is reversed, else to 1. The
/// picture's top left corner is at `left_px`, `top_px` of the target, within which it fits.
///
/// After it the range's depth is there for geometry of the host's, with `ovf_terrain_projection`.
/// Pipelines, descriptor sets 0 to 2, push constants, vertex and index buffers, viewport and scissor
/// are others then. Several threads may record ranges at once, each into a buffer of its own.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_renderer_record_range(
    renderer: ovf_renderer,
    frame: *const ovf_host_frame,
    range: u32,
    left_px: i32,
    top_px: i32,
) -> ovf_status {
    answer!(|caller: &Caller| {
        let frame = frame_of(caller, frame)?;
        let at_px = check_corner(left_px, top_px)?;
        shared(renderer, |drawn| {
            check_index(frame.index, drawn.settings().frames_in_flight)?;
            Ok(record_range(caller, drawn, frame, (range, at_px))?)
        })
    })
}

/// The projection of one depth range of a view, as the ground is drawn with it: 16 numbers, column by
/// column, from eye space (x right, y up, z backward, metres from the eye) to Vulkan's clip space (y
/// down, z from 0 to w). With the axes and the eye of `ovf_terrain_eye`, a point's z and w are the
/// ground's to the last bit; only what is between the range's borders is seen.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_terrain_projection(
    terrain: ovf_terrain,
    view: u32,
    range: u32,
    columns: *mut f32,
) -> ovf_status {
    answer!(|caller: &Caller| {
        let out = caller.array_out("columns", columns, 16)?;
        let found = with(terrain, |state| {
            let (view, order) = (view_of(state, view)?, state.overfly.scene().depth.order);
            let most = view.ranges.len();
            projection(view, range as usize, order)
                .ok_or_else(|| Fault::invalid(format!("range is {range}, allowed is below {most}")))
        })?;
        found.as_flattened().iter().enumerate().for_each(|(at, &number)| out.put(at, number));
        Ok(())
    })
}

/// Where a picture stands on a target, which it does not leave at its top left.
pub fn check_corner(left_px: i32, top_px: i32) -> Result<[i32; 2], Fault> {
    for (name, found) in [("left_px", left_px), ("top_px", top_px)] {
        if found < 0 {
            let most = i32::MAX;
            let sentence = format!("{name} is {found}, allowed is 0 to {most}");
            return Err(Fault::invalid(sentence));
        }
    }
    Ok([left_px, top_px])
}

/// Whether a renderer has such a frame in flight.
pub fn check_index(index: u32, frames: u32) -> Result<(), Fault> {
    if index < frames {
        return Ok(());
    }
    Err(Fault::invalid(format!("frame: index is {index}, allowed is below {frames}")))
}

fn show_of(show: u32) -> Result<Show, Fault> {
    let all = [
        (OVF_SHOW_SHADED, Show::Shaded),
        (OVF_SHOW_WIREFRAME, Show::Wireframe),
        (OVF_SHOW_LEVEL, Show::Level),
        (OVF_SHOW_SCREEN_ERROR, Show::ScreenError),
        (OVF_SHOW_RESIDENCY, Show::Residency),
        (OVF_SHOW_NORMALS, Show::Normals),
        (OVF_SHOW_DEPTH_RANGE, Show::DepthRange),
        (OVF_SHOW_CULLED, Show::Culled),
    ];
    let found = all.into_iter().find(|&(number, _)| number == show);
    found.map(|(_, show)| show).ok_or_else(|| {
        let most = OVF_SHOW_CULLED;
        Fault::invalid(format!("picture: show is {show}, allowed is 0 to {most}"))
    })
}

fn backdrop_of(backdrop: u32) -> Result<Backdrop, Fault> {
    match backdrop {
        OVF_BACKDROP_SKY => Ok(Backdrop::Sky),
        // Which colour is the host's matter: it has cleared to it.
        OVF_BACKDROP_HOST => Ok(Backdrop::Colour([0.0; 3])),
        _ => {
            let sentence = format!("picture: backdrop is {backdrop}, allowed is 0 or 1");
            Err(Fault::invalid(sentence))
        }
    }
}

fn report_of(report: &DrawReport, ranges: usize) -> ovf_draw_report {
    ovf_draw_report {
        struct_size: 0,
        uploaded_patches: report.uploaded_patches,
        uploaded_bytes: report.uploaded_bytes,
        draws: report.draws,
        commands: report.commands,
        triangles: report.triangles,
        pipelines: report.pipelines,
        ranges: u32::try_from(ranges).expect("few ranges"),
    }
}
