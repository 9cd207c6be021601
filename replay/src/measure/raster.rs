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
use glam::DVec3;
use overfly_core::inspect::DrawnMesh;
use overfly_core::mesh::topology::indices;

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

impl Raster {
    /// Draws a mesh. Nothing nearer than the near distance is drawn.
    pub fn draw(&mut self, mesh: &DrawnMesh, screen: &Screen, grid: &Grid) {
        self.depth_m.clear();
        self.depth_m.resize(grid.len(), f64::INFINITY);
        self.leaf.clear();
        self.leaf.resize(grid.len(), 0);
        (self.stretched, self.triangles) = (0, 0);
        let triangles = indices(mesh.patch_depth);
        let mut view = vec![DVec3::ZERO; mesh.vertices_per_patch()];
        for leaf in 0..mesh.leaves.len() {
            let places = mesh.places_of(leaf);
            view.iter_mut().zip(places).for_each(|(view, &place)| *view = screen.view(place));
            if span_of(&view, screen, grid).is_none() {
                continue;
            }
            let leaf = u32::try_from(leaf).expect("below 2^32 leaves");
            for three in triangles.chunks_exact(3) {
                let corners = [three[0], three[1], three[2]].map(|at| view[at as usize]);
                self.triangle(corners, leaf, (screen, grid));
            }
        }
    }

    fn triangle(&mut self, [a, b, c]: [DVec3; 3], leaf: u32, (screen, grid): (&Screen, &Grid)) {
        let Some(span) = span_of(&[a, b, c], screen, grid) else { return };
        self.triangles += 1;
        let (least, greatest) = (a.z.min(b.z).min(c.z), a.z.max(b.z).max(c.z));
        if greatest > 10.0 * least.max(screen.near_m) {
            self.stretched += 1;
        }
        let sides = [b.cross(c), c.cross(a), a.cross(b)];
        let volume = a.dot(sides[0]);
        let rows = span.rows[0]..span.rows[1];
        let columns = || span.columns[0]..span.columns[1];
        for (row, column) in rows.flat_map(|row| columns().map(move |column| (row, column))) {
            let ray = screen.tangents(grid.pixel(column, row));
            let [u, v, w] = sides.map(|side| ray.dot(side));
            let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
            let depth_m = volume / (u + v + w);
            let at = row as usize * grid.columns as usize + column as usize;
            if inside && depth_m >= screen.near_m && depth_m < self.depth_m[at] {
                self.depth_m[at] = depth_m;
                self.leaf[at] = leaf;
            }
        }
    }
}

/// The strata that the hull of some points touches; `None` where it is not in the picture.
fn span_of(points: &[DVec3], screen: &Screen, grid: &Grid) -> Option<Span> {
    let near = points.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
    let far = points.iter().map(|p| p.z).fold(f64::NEG_INFINITY, f64::max);
    if far < screen.near_m {
        return None;
    }
    let [width, height] = screen.size_px;
    let (mut low, mut high) = ([0.0, 0.0], [width, height]);
    if near >= screen.near_m {
        low = [f64::INFINITY; 2];
        high = [f64::NEG_INFINITY; 2];
        for point in points {
            let pixel = screen.pixel_of(*point);
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
fn beside(points: &[DVec3], screen: &Screen) -> bool {
    let [x, y] = screen.size_px.map(|size_px| 0.5 * size_px / screen.scale_px);
    let outside = |of: fn(&DVec3) -> f64, tangent: f64| {
        points.iter().all(|p| of(p) > tangent * p.z)
            || points.iter().all(|p| of(p) < -tangent * p.z)
    };
    outside(|p| p.x, x) || outside(|p| p.y, y)
}
