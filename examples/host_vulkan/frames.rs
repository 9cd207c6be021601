//! A frame of the host: where overfly's calls stand among its own.
//!
//! In:    a canvas; what is drawn where on it.
//! Out:   one submitted command buffer.
//! Keeps: nothing.
//! Not here: images and passes (`canvas`), pictures (`journey`).

use super::Outcome;
use super::canvas::Canvas;
use overfly::jobs::Team;
use overfly::render_vk::ash::vk;
use overfly::render_vk::{HostFrame, HostRenderer, Picture};

/// A picture on the canvas.
pub struct Pane<'a> {
    pub renderer: &'a mut HostRenderer,
    pub picture: &'a Picture<'a>,
    /// Where its top left corner is.
    pub at_px: [i32; 2],
}

/// Draws panes one after the other, each from its farthest depth range to its nearest. Then `own`
/// records the host's draws, over the nearest range of the last pane and its depth.
pub fn draw(
    canvas: &mut Canvas,
    panes: &mut [Pane<'_>],
    own: impl FnOnce(&Canvas, vk::CommandBuffer),
) -> Outcome<()> {
    let (buffer, index) = canvas.begin()?;
    let frame = HostFrame { buffer, index };
    for pane in &mut *panes {
        // SAFETY: the buffer is being recorded, outside a pass; `begin` has waited for the frame
        // that had this index; buffers are submitted as they are recorded.
        unsafe { pane.renderer.record_uploads(frame, pane.picture, &Team::alone()) }?;
    }
    // SAFETY: the buffer is being recorded, outside the pass, then in it, then outside again;
    // overfly's pipelines were made for this pass; the panes are within the canvas.
    unsafe {
        canvas.begin_pass(buffer);
        for pane in &mut *panes {
            let ranges = pane.picture.view.ranges.len();
            for range in (0..ranges).rev() {
                canvas.clear_depth(buffer);
                pane.renderer.record_range(frame, range, pane.at_px)?;
            }
        }
        own(canvas, buffer);
        for pane in panes {
            pane.renderer.record_overlay(frame, pane.at_px)?;
        }
        canvas.host.device.cmd_end_render_pass(buffer);
    }
    canvas.submit()
}
