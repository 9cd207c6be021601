//! The drawn mesh along the rays of a frame: a small rasteriser, all in f64.
//!
//! In:    a drawn mesh, the projection, a grid of rays.
//! Out:   depth and leaf of the nearest triangle on each ray.
//! Keeps: both columns.
//! Not here: the mesh along verticals (`mesh`).
//!
//! A ray meets a triangle where three determinants agree in sign: with corners A, B, C in camera
//! axes and a ray d they are d·(B×C), d·(C×A), d·(A×B), and the depth is A·(B×C) over their sum.
//! Nothing is divided by a depth, so that a triangle may reach behind the eye.

use super::rays::Grid;
use super::screen::Screen;
use super::share::share;
use glam::{DVec2, DVec3};
use overfly_core::inspect::DrawnMesh;
use overfly_core::mesh::topology::indices;
use std::ops::Range;

/// What the rays of a frame meet of the mesh.
#[derive(Clone, Debug, Default)]
pub struct Raster {
    /// Depth along the view direction by ray, row by row; infinite where there is nothing.
    pub depth_m: Vec<f64>,
    /// Leaf there; meaningless where there is nothing.
    pub leaf: Vec<u32>,
    /// Triangles before the eye whose greatest depth is more than ten times the least.
    pub stretched: u32,
    /// Triangles of which some ray could see something.
    pub triangles: u32,
}

/// The rays that a triangle can meet: columns and rows, ends excluded.
struct Span {
    columns: [u32; 2],
    rows: [u32; 2],
}

/// A vertex in camera axes and its pixel; meaningless where that is nearer than the near distance.
type Seen = (DVec3, DVec2);

/// What all triangles are drawn with.
#[derive(Clone, Copy)]
struct Frame<'a> {
    screen: &'a Screen,
    grid: &'a Grid,
    /// Of all rays.
    tangents: &'a [DVec3],
}

impl Raster {
    /// Draws a mesh on so many threads. Nothing nearer than the near distance is drawn.
    pub fn draw(&mut self, mesh: &DrawnMesh, (screen, grid): (&Screen, &Grid), threads: usize) {
        let columns = |row: u32| (0..grid.columns).map(move |column| (column, row));
        let rays = (0..grid.rows).flat_map(columns);
        let tangents: Vec<DVec3> =
            rays.map(|(column, row)| screen.tangents(grid.pixel(column, row))).collect();
        let frame = Frame { screen, grid, tangents: &tangents };
        let count = mesh.leaves.len();
        let size = count.div_ceil(threads.max(1)).max(1);
        let parts = share(count.div_ceil(size), threads, |at| {
            Self::part((mesh, at * size..((at + 1) * size).min(count)), frame)
        });
        *self = Self::empty(grid);
        parts.iter().for_each(|part| self.merge(part));
    }

    fn empty(grid: &Grid) -> Self {
        let (depth_m, leaf) = (vec![f64::INFINITY; grid.len()], vec![0; grid.len()]);
        Self { depth_m, leaf, stretched: 0, triangles: 0 }
    }

    /// Of two triangles at the same depth the one of the earlier leaf is seen.
    fn merge(&mut self, later: &Self) {
        for at in 0..self.depth_m.len() {
            if later.depth_m[at] < self.depth_m[at] {
                (self.depth_m[at], self.leaf[at]) = (later.depth_m[at], later.leaf[at]);
            }
        }
        self.stretched += later.stretched;
        self.triangles += later.triangles;
    }

    fn part((mesh, leaves): (&DrawnMesh, Range<usize>), frame: Frame<'_>) -> Self {
        let mut raster = Self::empty(frame.grid);
        let triangles = indices(mesh.patch_depth);
        let mut seen: Vec<Seen> = Vec::with_capacity(mesh.vertices_per_patch());
        for leaf in leaves {
            seen.clear();
            seen.extend(mesh.places_of(leaf).iter().map(|&place| {
                let view = frame.screen.view(place);
                (view, frame.screen.pixel_of(view))
            }));
            if span_of(&seen, frame).is_none() {
                continue;
            }
            let leaf = u32::try_from(leaf).expect("below 2^32 leaves");
            for three in triangles.chunks_exact(3) {
                let corners = [three[0], three[1], three[2]].map(|at| seen[at as usize]);
                raster.triangle(&corners, leaf, frame);
            }
        }
        raster
    }

    fn triangle(&mut self, corners: &[Seen; 3], leaf: u32, frame: Frame<'_>) {
        let Some(span) = span_of(corners, frame) else { return };
        let (near_m, [a, b, c]) = (frame.screen.near_m, corners.map(|(view, _)| view));
        self.triangles += 1;
        let (least, greatest) = (a.z.min(b.z).min(c.z), a.z.max(b.z).max(c.z));
        if greatest > 10.0 * least.max(near_m) {
            self.stretched += 1;
        }
        let sides = [b.cross(c), c.cross(a), a.cross(b)];
        let (volume, columns) = (a.dot(sides[0]), frame.grid.columns as usize);
        let [left, right] = span.columns.map(|column| column as usize);
        let firsts = (span.rows[0]..span.rows[1]).map(|row| row as usize * columns);
        for at in firsts.flat_map(|first| first + left..first + right) {
            let ray = frame.tangents[at];
            let [u, v, w] = sides.map(|side| ray.dot(side));
            let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
            if !inside {
                continue;
            }
            let depth_m = volume / (u + v + w);
            if depth_m >= near_m && depth_m < self.depth_m[at] {
                (self.depth_m[at], self.leaf[at]) = (depth_m, leaf);
            }
        }
    }
}

/// The strata that the hull of some points touches; `None` where it is not in the picture.
fn span_of(points: &[Seen], Frame { screen, grid, .. }: Frame<'_>) -> Option<Span> {
    let near = points.iter().map(|(p, _)| p.z).fold(f64::INFINITY, f64::min);
    let far = points.iter().map(|(p, _)| p.z).fold(f64::NEG_INFINITY, f64::max);
    if far < screen.near_m {
        return None;
    }
    let [width, height] = screen.size_px;
    let (mut low, mut high) = ([0.0, 0.0], [width, height]);
    if near >= screen.near_m {
        low = [f64::INFINITY; 2];
        high = [f64::NEG_INFINITY; 2];
        for (_, pixel) in points {
            low = [low[0].min(pixel.x), low[1].min(pixel.y)];
            high = [high[0].max(pixel.x), high[1].max(pixel.y)];
        }
    } else if beside(points, screen) {
        return None;
    }
    if high[0] < 0.0 || high[1] < 0.0 || low[0] > width || low[1] > height {
        return None;
    }
    let stratum = grid.stratum_px();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
    let strata = |low: f64, high: f64, side_px: f64, count: u32| {
        let of = |px: f64| (px / side_px).floor().clamp(0.0, f64::from(count)) as u32;
        [of(low), (of(high) + 1).min(count)]
    };
    Some(Span {
        columns: strata(low[0], high[0], stratum.x, grid.columns),
        rows: strata(low[1], high[1], stratum.y, grid.rows),
    })
}

/// Whether points all lie outside of one side of the picture.
fn beside(points: &[Seen], screen: &Screen) -> bool {
    let [x, y] = screen.size_px.map(|size_px| 0.5 * size_px / screen.scale_px);
    let outside = |of: fn(&DVec3) -> f64, tangent: f64| {
        points.iter().all(|(p, _)| of(p) > tangent * p.z)
            || points.iter().all(|(p, _)| of(p) < -tangent * p.z)
    };
    outside(|p| p.x, x) || outside(|p| p.y, y)
}
