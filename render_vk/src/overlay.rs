//! Text, boxes and lines over a picture, as columns of small triangles.
//!
//! In:    places in pixels from the top left, or in the scene.
//! Out:   [`Overlay`], and its triangles for one camera.
//! Keeps: what was added since the last clear; memory is reused.
//! Not here: what is written (the host), the pipeline (`passes::overlay`).

use font8x8::{BASIC_FONTS, LATIN_FONTS, UnicodeFonts};
use glam::{DVec2, DVec3};
use overfly_core::camera::Camera;
use overfly_core::geodesy::narrow;

/// Side of a character's cell at scale 1, in pixels.
pub const CELL_PX: f32 = 8.0;
/// Width of lines in pixels.
const LINE_PX: f64 = 1.25;

/// Red, green, blue with the sRGB curve; opacity.
pub type Colour = [u8; 4];

/// One corner of a triangle of an overlay: 12 bytes.
#[derive(Clone, Copy, PartialEq, Debug)]
#[repr(C)]
pub(crate) struct OverlayVertex {
    pub(crate) at_px: [f32; 2],
    pub(crate) colour: Colour,
}

#[derive(Clone, Copy, PartialEq, Debug)]
struct Segment {
    ends: [DVec3; 2],
    colour: Colour,
}

/// What is drawn over a picture: first the lines in the scene, then the rest in the order in which
/// it was added. Nothing of it is hidden by the ground.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Overlay {
    flat: Vec<OverlayVertex>,
    segments: Vec<Segment>,
}

impl Overlay {
    /// Nothing.
    pub const EMPTY: Self = Self { flat: Vec::new(), segments: Vec::new() };

    /// Takes everything out.
    pub fn clear(&mut self) {
        self.flat.clear();
        self.segments.clear();
    }

    /// Whether there is nothing.
    pub fn is_empty(&self) -> bool {
        self.flat.is_empty() && self.segments.is_empty()
    }

    /// A filled rectangle.
    pub fn rect(&mut self, [x, y]: [f32; 2], [width, height]: [f32; 2], colour: Colour) {
        let corner = |dx, dy| OverlayVertex { at_px: [x + dx, y + dy], colour };
        let [a, b, c, d] =
            [corner(0.0, 0.0), corner(width, 0.0), corner(width, height), corner(0.0, height)];
        self.flat.extend([a, b, c, a, c, d]);
    }

    /// Text from its top left corner on; `\n` begins a line. Cells are 8 × 8 pixels times `scale`;
    /// what the font lacks is a question mark.
    pub fn text(&mut self, [left, top]: [f32; 2], scale: f32, colour: Colour, text: &str) {
        let (mut x, mut y) = (left, top);
        for c in text.chars() {
            if c == '\n' {
                (x, y) = (left, y + 1.25 * CELL_PX * scale);
                continue;
            }
            self.glyph([x, y], scale, colour, c);
            x += CELL_PX * scale;
        }
    }

    /// One character, as a rectangle for each run of pixels in a row.
    fn glyph(&mut self, [x, mut y]: [f32; 2], scale: f32, colour: Colour, c: char) {
        let known = BASIC_FONTS.get(c).or_else(|| LATIN_FONTS.get(c));
        for row in known.or_else(|| BASIC_FONTS.get('?')).unwrap_or_default() {
            let mut left = u32::from(row);
            let mut at = 0;
            while left != 0 {
                let skip = left.trailing_zeros();
                left >>= skip;
                let run = left.trailing_ones();
                left >>= run;
                let [from, wide] = [at + skip, run].map(|n| narrow(f64::from(n)) * scale);
                self.rect([x + from, y], [wide, scale], colour);
                at += skip + run;
            }
            y += scale;
        }
    }

    /// A line on the picture.
    pub fn line(&mut self, a: [f32; 2], b: [f32; 2], colour: Colour) {
        let [a, b] = [a, b].map(|[x, y]| DVec2::new(f64::from(x), f64::from(y)));
        line(a, b, colour, &mut self.flat);
    }

    /// A line in the scene, between two points in ECEF metres.
    pub fn segment(&mut self, a: DVec3, b: DVec3, colour: Colour) {
        self.segments.push(Segment { ends: [a, b], colour });
    }

    /// All triangles, for a camera.
    pub(crate) fn triangles(&self, camera: &Camera, out: &mut Vec<OverlayVertex>) {
        out.clear();
        for segment in &self.segments {
            if let Some([a, b]) = projected(camera, segment.ends) {
                line(a, b, segment.colour, out);
            }
        }
        out.extend_from_slice(&self.flat);
    }
}

fn line(a: DVec2, b: DVec2, colour: Colour, out: &mut Vec<OverlayVertex>) {
    let aside = (b - a).normalize_or_zero().perp() * (LINE_PX / 2.0);
    let corner = |at: DVec2| OverlayVertex { at_px: [narrow(at.x), narrow(at.y)], colour };
    let [a0, a1, b0, b1] = [a - aside, a + aside, b - aside, b + aside].map(corner);
    out.extend([a0, a1, b1, a0, b1, b0]);
}

/// Both ends in pixels, cut at the near border; `None` behind the eye or far beside the picture.
fn projected(camera: &Camera, ends: [DVec3; 2]) -> Option<[DVec2; 2]> {
    let [mut a, mut b] = ends.map(|end| {
        let offset = end - camera.eye.0;
        DVec3::new(offset.dot(camera.right), offset.dot(camera.up), offset.dot(camera.forward))
    });
    let near = camera.near_m;
    if a.z < near && b.z < near {
        return None;
    }
    let cut = |from: DVec3, to: DVec3| from + (to - from) * ((near - from.z) / (to.z - from.z));
    (a, b) = (if a.z < near { cut(a, b) } else { a }, if b.z < near { cut(b, a) } else { b });
    let size = camera.size_px.map(f64::from);
    let [tan_x, tan_y] = camera.half_tangents;
    let place = |p: DVec3| {
        let (x, y) = (p.x / (p.z * tan_x), p.y / (p.z * tan_y));
        DVec2::new((0.5 + 0.5 * x) * size[0], (0.5 - 0.5 * y) * size[1])
    };
    let (a, b) = (place(a), place(b));
    // Beyond this f32 pixels are too coarse to be of use.
    let limit = 1e6;
    (a.abs().max_element() < limit && b.abs().max_element() < limit).then_some([a, b])
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::camera::View;
    use overfly_core::geodesy::{Ecef, Ellipsoid};
    use overfly_core::units::Radians;

    const WHITE: Colour = [255; 4];

    fn camera() -> Camera {
        let view = View {
            eye: Ecef(DVec3::new(7e6, 0.0, 0.0)),
            orientation: glam::DQuat::from_rotation_y(core::f64::consts::FRAC_PI_2),
            field_of_view: Radians(1.0),
            size_px: [200, 100],
            near_m: 1.0,
        };
        Camera::new(&view, &Ellipsoid::WGS84)
    }

    #[test]
    fn a_line_straight_ahead_goes_through_the_middle() {
        let camera = camera();
        let ahead = camera.eye.0 + camera.forward * 100.0;
        let mut overlay = Overlay::default();
        overlay.segment(ahead - camera.right, ahead + camera.right, WHITE);
        let mut out = Vec::new();
        overlay.triangles(&camera, &mut out);
        assert_eq!(out.len(), 6);
        let middle = out.iter().map(|v| f64::from(v.at_px[0])).sum::<f64>() / 6.0;
        assert!((middle - 100.0).abs() < 1e-3, "{middle}");
        assert!(out.iter().all(|v| (v.at_px[1] - 50.0).abs() < 1.0));
    }

    #[test]
    fn what_is_behind_the_eye_is_left_out_and_what_crosses_is_cut() {
        let camera = camera();
        let [behind, ahead] = [-50.0, 50.0].map(|m| camera.eye.0 + camera.forward * m);
        let mut overlay = Overlay::default();
        overlay.segment(behind, behind + camera.up, WHITE);
        let mut out = Vec::new();
        overlay.triangles(&camera, &mut out);
        assert!(out.is_empty());
        overlay.segment(behind + camera.up * 0.1, ahead, WHITE);
        overlay.triangles(&camera, &mut out);
        assert_eq!(out.len(), 6);
        assert!(out.iter().all(|v| v.at_px.iter().all(|c| c.is_finite())));
    }

    #[test]
    fn text_covers_as_many_pixels_as_its_glyphs_have() {
        let mut overlay = Overlay::default();
        overlay.text([4.0, 4.0], 1.0, WHITE, "I\n°");
        let area: f32 = overlay
            .flat
            .chunks_exact(6)
            .map(|q| (q[2].at_px[0] - q[0].at_px[0]) * (q[2].at_px[1] - q[0].at_px[1]))
            .sum();
        let bits = |c: char| {
            let glyph = BASIC_FONTS.get(c).or_else(|| LATIN_FONTS.get(c)).unwrap();
            glyph.iter().map(|row| row.count_ones()).sum::<u32>()
        };
        assert_eq!(area, narrow(f64::from(bits('I') + bits('°'))));
        assert!(bits('°') > 0);
        overlay.clear();
        assert!(overlay.is_empty());
    }
}
