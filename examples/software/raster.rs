//! Triangles to pixels on the processor, as Vulkan would: 8 bits of subpixel, top-left rule.
//!
//! In:    corners in clip space with their light.
//! Out:   [`Canvas`]: light and nearness of each pixel, and a PNG of them.
//! Keeps: nothing.
//! Not here: where triangles come from (`software`).
//!
//! One buffer of 1/w serves from a centimetre to orbit, so depth ranges need not be told apart.

use overfly::core::mesh::shade::shown;
use std::path::Path;

/// Pictures' widths beside the picture that are kept, so that fixed-point numbers stay small.
const GUARD: f32 = 4.0;
const SUBPIXELS: i64 = 256;

/// A corner in clip space: x and y within ±w are in the picture; w is metres along the view.
#[derive(Clone, Copy)]
pub struct Corner {
    pub x: f32,
    pub y: f32,
    pub w: f32,
    /// Linear light.
    pub light: [f32; 3],
}

/// A picture in the making.
pub struct Canvas {
    pub size_px: [usize; 2],
    pub light: Vec<[f32; 3]>,
    /// 1 / distance along the view in metres; 0 where nothing was drawn.
    pub nearness: Vec<f32>,
}

impl Canvas {
    /// A black one.
    pub fn new(size_px: [u32; 2]) -> Self {
        let size_px = size_px.map(|n| n as usize);
        let pixels = size_px[0] * size_px[1];
        Self { size_px, light: vec![[0.0; 3]; pixels], nearness: vec![0.0; pixels] }
    }

    /// Draws a triangle, if it faces the eye: what of it is beyond `near_m` and near the picture.
    pub fn triangle(&mut self, near_m: f32, corners: [Corner; 3]) {
        let inside: [&dyn Fn(&Corner) -> f32; 5] = [
            &|c| c.w - near_m,
            &|c| GUARD * c.w - c.x,
            &|c| GUARD * c.w + c.x,
            &|c| GUARD * c.w - c.y,
            &|c| GUARD * c.w + c.y,
        ];
        let is_whole = inside.iter().all(|inside| corners.iter().all(|c| inside(c) >= 0.0));
        if is_whole {
            return self.fill(corners);
        }
        let cut = |kept: Vec<Corner>, inside: &&dyn Fn(&Corner) -> f32| clipped(&kept, *inside);
        let kept = inside.iter().fold(corners.to_vec(), cut);
        for i in 2..kept.len() {
            self.fill([kept[0], kept[i - 1], kept[i]]);
        }
    }

    fn fill(&mut self, [a, b, c]: [Corner; 3]) {
        // Seen from outside the ground turns left; here, with y down, turning right is positive.
        let corners = [a, c, b];
        let at = corners.map(|corner| self.snapped(corner));
        let area = turn(at[0], at[1], at[2]);
        if area <= 0 {
            return;
        }
        let [columns, rows] = [0, 1].map(|axis: usize| {
            let (least, most) = at.iter().fold((i64::MAX, i64::MIN), |(least, most), at| {
                (least.min(at[axis]), most.max(at[axis]))
            });
            let end = i64::try_from(self.size_px[axis]).expect("pictures are small");
            (least / SUBPIXELS).max(0)..(most / SUBPIXELS + 1).min(end)
        });
        let edges = [(at[1], at[2]), (at[2], at[0]), (at[0], at[1])];
        let part = |(from, to), point, w: f32| turn(from, to, point) as f32 / area as f32 / w;
        for (y, x) in rows.flat_map(|y| columns.clone().map(move |x| (y, x))) {
            let centre = [x, y].map(|n| n * SUBPIXELS + SUBPIXELS / 2);
            if edges.iter().all(|&(from, to)| is_inside(from, to, centre)) {
                let share = [0, 1, 2].map(|i: usize| part(edges[i], centre, corners[i].w));
                let [x, y] = [x, y].map(|n| usize::try_from(n).expect("in the picture"));
                self.put(y * self.size_px[0] + x, &corners, share);
            }
        }
    }

    /// `share` is how much of a pixel each corner makes up, over its w: they sum to 1 / w there.
    fn put(&mut self, pixel: usize, corners: &[Corner; 3], share: [f32; 3]) {
        let nearness: f32 = share.iter().sum();
        if nearness > self.nearness[pixel] {
            let light = |i: usize| (0..3).map(|c| share[c] * corners[c].light[i]).sum::<f32>();
            self.light[pixel] = [0, 1, 2].map(|i| light(i) / nearness);
            self.nearness[pixel] = nearness;
        }
    }

    fn snapped(&self, corner: Corner) -> [i64; 2] {
        [(corner.x, self.size_px[0]), (corner.y, self.size_px[1])].map(|(c, size_px)| {
            let pixels = (0.5 + 0.5 * c / corner.w) * size_px as f32;
            #[expect(clippy::cast_possible_truncation, reason = "rounded, within the guard")]
            let snapped = (pixels * SUBPIXELS as f32).round() as i64;
            snapped
        })
    }

    /// What a screen shows of the light, three bytes a pixel, row by row.
    pub fn bytes(&self) -> Vec<u8> {
        self.light.iter().flat_map(|&light| shown(light)).collect()
    }

    /// Writes a PNG.
    pub fn write(&self, path: &Path) -> Result<(), String> {
        let [width, height] = self.size_px.map(|n| u32::try_from(n).expect("came as u32"));
        image::save_buffer(path, &self.bytes(), width, height, image::ColorType::Rgb8)
            .map_err(|error| format!("{}: {error}", path.display()))
    }
}

/// Twice the area of a triangle, positive if it turns right in the picture.
fn turn(a: [i64; 2], b: [i64; 2], c: [i64; 2]) -> i64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Whether a point lies to the right of an edge; of those on it, the top and left edges have them.
fn is_inside(from: [i64; 2], to: [i64; 2], point: [i64; 2]) -> bool {
    let [x, y] = [to[0] - from[0], to[1] - from[1]];
    let has_its_points = y < 0 || (y == 0 && x > 0);
    let right = turn(from, to, point);
    right > 0 || (right == 0 && has_its_points)
}

/// What of a convex polygon lies where `inside` is not negative.
fn clipped(corners: &[Corner], inside: &dyn Fn(&Corner) -> f32) -> Vec<Corner> {
    let mut kept = Vec::with_capacity(corners.len() + 1);
    for (at, corner) in corners.iter().enumerate() {
        let next = &corners[(at + 1) % corners.len()];
        let (here, there) = (inside(corner), inside(next));
        if here >= 0.0 {
            kept.push(*corner);
        }
        if (here >= 0.0) != (there >= 0.0) {
            let t = here / (here - there);
            let mix = |a: f32, b: f32| a + (b - a) * t;
            kept.push(Corner {
                x: mix(corner.x, next.x),
                y: mix(corner.y, next.y),
                w: mix(corner.w, next.w),
                light: [0, 1, 2].map(|i: usize| mix(corner.light[i], next.light[i])),
            });
        }
    }
    kept
}
