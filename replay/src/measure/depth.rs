//! Z1 and Z2: whether a depth buffer tells apart what lies close behind each other.
//!
//! In:    what the rays of a frame meet, the depth ranges of the scene.
//! Out:   [`DepthOrderErrors`] of three depth buffers.
//! Keeps: nothing.
//! Not here: depth within a stretched triangle (T1 counts those).
//!
//! Two surfaces lie on each ray, one a small share of its depth behind the other. Both go through
//! the arithmetic of vertices, the division and the rounding of the buffer, all emulated. Equal
//! depths count as wrong: the order of drawing would decide.

use super::errors::DepthOrderErrors;
use super::frame::Measure;
use super::pipeline::Pipeline;
use super::thorough::Shot;
use glam::DVec3;
use overfly_core::geodesy::{Ecef, narrow};
use overfly_core::mesh::PatchVertex;
use overfly_core::settings::{DepthFormat, DepthOrder};

/// Pixels that are looked at.
const PIXELS: usize = 4096;
/// Share of them that may be wrong.
const WRONG: f64 = 1e-3;
/// What the three ranges of 24 bits reach, metres.
const FAR_M: f64 = 1e8;
/// Frames of the slow flight, and how far the middle of the picture moves in each.
const STEPS: u32 = 16;
const STEP_PX: f64 = 0.05;

/// A depth buffer: numbers, order, ranges from near to far.
pub struct Buffer {
    /// Its numbers.
    pub format: DepthFormat,
    /// Which way they run.
    pub order: DepthOrder,
    /// Near and far border of each range, metres; the last may be infinite.
    pub ranges: Vec<[f64; 2]>,
}

/// The scene's own, one of 32 bits of float, three ranges of 24 bits.
fn buffers(shot: &Shot<'_>) -> [Buffer; 3] {
    let depth = &shot.terrain.settings().depth;
    let own = shot.output.views[0].ranges.iter().map(|range| [range.near_m, range.far_m]);
    let near_m = shot.screen.near_m;
    let step = libm::cbrt(FAR_M / near_m);
    let borders = [near_m, near_m * step, near_m * step * step, FAR_M];
    [
        Buffer { format: depth.format, order: depth.order, ranges: own.collect() },
        Buffer {
            format: DepthFormat::D32F,
            order: DepthOrder::Reversed,
            ranges: vec![[near_m, f64::INFINITY]],
        },
        Buffer {
            format: DepthFormat::D24,
            order: DepthOrder::Forward,
            ranges: borders.windows(2).map(|pair| [pair[0], pair[1]]).collect(),
        },
    ]
}

impl Buffer {
    /// Whether the nearer of two depths along the view direction is seen.
    pub fn tells_apart(&self, near: f32, far: f32) -> bool {
        for range in &self.ranges {
            let within = |w: f32| (range[0]..=range[1]).contains(&f64::from(w));
            match (within(near), within(far)) {
                (true, false) => return true,
                (false, true) => return false,
                (true, true) => {
                    let [near, far] = [near, far].map(|w| self.number(*range, w));
                    return match self.order {
                        DepthOrder::Reversed => near > far,
                        DepthOrder::Forward => near < far,
                    };
                }
                (false, false) => {}
            }
        }
        near < far
    }

    /// What the buffer holds for a depth; the same steps as `RangeTerms` and `clip.wgsl`.
    fn number(&self, [near_m, far_m]: [f64; 2], w: f32) -> f64 {
        let (slope, offset) = if far_m.is_finite() {
            (-near_m / (far_m - near_m), near_m * (far_m / (far_m - near_m)))
        } else {
            (0.0, near_m)
        };
        let (slope, offset) = match self.order {
            DepthOrder::Reversed => (narrow(slope), narrow(offset)),
            DepthOrder::Forward => (narrow(1.0 - slope), narrow(-offset)),
        };
        let z = f64::from(((slope * w + offset) / w).clamp(0.0, 1.0));
        match self.format {
            DepthFormat::D32F => z,
            DepthFormat::D24 => (z * f64::from((1 << 24) - 1)).round(),
        }
    }

    /// The least distance of two surfaces that this buffer and format should tell apart.
    fn stated_share(&self) -> f64 {
        match self.format {
            DepthFormat::D32F => 3e-7,
            DepthFormat::D24 => 1e-4,
        }
    }
}

/// Points on the mesh, one a pixel.
struct Points {
    eye: DVec3,
    away: Vec<DVec3>,
    pipeline: Pipeline,
}

impl Points {
    fn new(measure: &Measure, shot: &Shot<'_>) -> Self {
        let (grid, screen) = (&shot.grid, &shot.screen);
        let depths = &measure.raster.depth_m;
        let seen: Vec<usize> = (0..depths.len()).filter(|&at| depths[at].is_finite()).collect();
        let stride = seen.len().div_ceil(PIXELS).max(1);
        let away = seen.iter().step_by(stride).map(|&at| {
            let at_u32 = u32::try_from(at).expect("a stratum");
            let pixel = grid.pixel(at_u32 % grid.columns, at_u32 / grid.columns);
            screen.to_body(screen.tangents(pixel)) * depths[at]
        });
        let camera = &shot.output.views[0].camera;
        let pipeline = Pipeline::new(shot.terrain.settings(), camera, shot.output.time_ms);
        Self { eye: screen.eye, away: away.collect(), pipeline }
    }

    /// Depths before a pipeline's eye of all points, moved away by a share of their distance.
    fn depths(&self, pipeline: &Pipeline, share: f64) -> Vec<f32> {
        let depth = |away: &DVec3| {
            let place = self.eye + *away * (1.0 + share);
            let vertex = PatchVertex { position: Ecef(place).two_float(), ..PatchVertex::EMPTY };
            pipeline.view(&vertex, None)[2]
        };
        self.away.iter().map(depth).collect()
    }
}

/// Z1 and Z2 of the three buffers.
pub(super) fn measure(measure: &Measure, shot: &Shot<'_>) -> [DepthOrderErrors; 3] {
    let points = Points::new(measure, shot);
    buffers(shot).map(|buffer| DepthOrderErrors {
        z1_share: least_share(&points, &buffer),
        z2_ppm: flicker_ppm(&points, &buffer, shot.screen.scale_px),
    })
}

/// Z1: by halving on a logarithmic scale.
fn least_share(points: &Points, buffer: &Buffer) -> f64 {
    let near = points.depths(&points.pipeline, 0.0);
    let wrong = |share: f64| {
        let far = points.depths(&points.pipeline, share);
        let pairs = near.iter().zip(&far);
        let wrong = pairs.filter(|&(&near, &far)| !buffer.tells_apart(near, far)).count();
        wrong as f64 / near.len().max(1) as f64
    };
    let (mut low, mut high) = (-30.0, 4.0);
    while high - low > 0.05 {
        let middle = f64::midpoint(low, high);
        if wrong(libm::exp2(middle)) > WRONG { low = middle } else { high = middle }
    }
    libm::exp2(high)
}

/// Z2: how often the order of two surfaces flips while the eye moves slowly.
fn flicker_ppm(points: &Points, buffer: &Buffer, scale_px: f64) -> f64 {
    let mut along: Vec<f64> = points.away.iter().map(|away| away.length()).collect();
    along.sort_unstable_by(f64::total_cmp);
    let Some(&middle_m) = along.get(along.len() / 2) else { return 0.0 };
    let aside = points.away[0].normalize().any_orthonormal_vector();
    let step_m = aside * (STEP_PX * middle_m / scale_px);
    let (mut before, mut flips): (Option<Vec<bool>>, usize) = (None, 0);
    for step in 0..STEPS {
        let pipeline = points.pipeline.moved(points.eye + step_m * f64::from(step));
        let near = points.depths(&pipeline, 0.0);
        let far = points.depths(&pipeline, buffer.stated_share());
        let pairs = near.iter().zip(&far);
        let now: Vec<bool> = pairs.map(|(&near, &far)| buffer.tells_apart(near, far)).collect();
        let flipped = |before: &Vec<bool>| before.iter().zip(&now).filter(|(a, b)| a != b).count();
        flips += before.as_ref().map_or(0, flipped);
        before = Some(now);
    }
    flips as f64 / (points.away.len() as f64 * f64::from(STEPS - 1)) * 1e6
}
