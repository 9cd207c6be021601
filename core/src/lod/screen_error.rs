//! Priority of a diamond: the guaranteed projected error, the maximum over the views.
//!
//! In:    [`Region`] of a diamond, [`Sight`] of each view.
//! Out:   an error bound in pixels; 0 where nothing of the region can be seen.
//! Keeps: nothing.
//! Not here: where bounds come from (`diamonds`), what is done with priorities (`refine`).
//!
//! Distance. Let ρ be the ellipsoid's least radius of curvature. A ball of radius ρ rolls inside
//! it, so for ground points with normals n, m and heights h, k the squared distance is at least
//! |(ρ+h)n − (ρ+k)m|² = (h−k)² + (ρ+h)(ρ+k)|n−m|².
//! Horizon. A ball of the greatest radius of curvature contains it, so from height h nothing of
//! height k is seen farther than the sum of both tangent lengths to that ball, lowered to the
//! deepest ground. Frustum. A plane's greatest value over the region is bounded term by term.
//! Each bound only tightens when cap and height interval shrink: so priorities are nested.

use crate::camera::Camera;
use crate::geodesy::Ellipsoid;
use glam::DVec3;

/// What bounds a diamond and all its descendants.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Region {
    /// Surface normal at the diamond's centre.
    pub normal: DVec3,
    /// Ellipsoid point of that normal, ECEF metres.
    pub surface: DVec3,
    /// Chord from `normal` to the farthest normal of the region.
    pub cap: f64,
    /// Least height of the ground in the region, metres.
    pub low_m: f64,
    /// Greatest height of the ground in the region, metres.
    pub high_m: f64,
    /// Bound on the height error of drawing the diamond unsplit, metres.
    pub error_m: f64,
    /// Length of the tangent from `high_m` down to the deepest ground, metres.
    pub tangent_m: f64,
}

/// What the body contributes to every priority.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Horizon {
    /// Least and greatest radius of curvature of the ellipsoid, metres.
    pub curvature_m: [f64; 2],
    /// The deepest surface of the whole body, metres.
    pub floor_m: f64,
    /// The highest ground of the whole body, metres.
    pub peak_m: f64,
}

impl Horizon {
    /// Of a body whose ground lies within `height_range_m`; a sea hides what is below height 0.
    pub fn new(body: &Ellipsoid, height_range_m: [f64; 2], sea: bool) -> Self {
        let [low_m, high_m] = height_range_m;
        let surface_m = |height_m: f64| if sea && height_m < 0.0 { 0.0 } else { height_m };
        let (floor_m, peak_m) = (surface_m(low_m), surface_m(high_m));
        Self { curvature_m: body.curvature_radii_m(), floor_m, peak_m }
    }

    /// Length of the tangent from a height down to the deepest ground.
    pub fn tangent_m(&self, height_m: f64) -> f64 {
        let (r, above) = (self.curvature_m[1] + self.floor_m, height_m - self.floor_m);
        if above > 0.0 { (above * (2.0 * r + above)).sqrt() } else { 0.0 }
    }
}

/// What one view contributes to every priority.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sight {
    eye: DVec3,
    normal: DVec3,
    height_m: f64,
    planes: [DVec3; 4],
    pixels_per_radian: f64,
    near_m: f64,
    tangent_m: f64,
    horizon: Horizon,
}

impl Sight {
    /// The sight of a camera over a body.
    ///
    /// An error e at distance d looks at most e·f·c/d pixels large, f the pixels per radian of the
    /// picture's middle, c its corner factor: the screen is a plane, not a sphere.
    pub fn new(camera: &Camera, horizon: Horizon) -> Self {
        let below = camera.height_m <= horizon.floor_m;
        Self {
            eye: camera.eye.0,
            normal: camera.normal,
            height_m: camera.height_m,
            planes: camera.side_planes,
            pixels_per_radian: camera.pixels_per_radian * camera.corner_factor,
            near_m: camera.near_m,
            // From below all ground the horizon hides nothing.
            tangent_m: if below { f64::INFINITY } else { horizon.tangent_m(camera.height_m) },
            horizon,
        }
    }

    /// Lower bound on the distance from the eye to the ground of the region, metres.
    pub fn distance_m(&self, region: &Region) -> f64 {
        let chord = (self.normal - region.normal).length() - region.cap;
        let chord = if chord > 0.0 { chord } else { 0.0 };
        let above = self.height_m - region.high_m;
        let below = region.low_m - self.height_m;
        let vertical = if above > 0.0 {
            above
        } else if below > 0.0 {
            below
        } else {
            0.0
        };
        let rho = self.horizon.curvature_m[0];
        let across = (rho + self.height_m) * (rho + region.low_m) * chord * chord;
        (vertical * vertical + if across > 0.0 { across } else { 0.0 }).sqrt()
    }

    fn outside_frustum(&self, region: &Region) -> bool {
        let to_surface = region.surface - self.eye;
        let spread = 1.01 * self.horizon.curvature_m[1] * region.cap;
        self.planes.iter().any(|plane| {
            let along = plane.dot(region.normal);
            let lift = |height_m: f64| height_m * along + height_m.abs() * region.cap;
            let (low, high) = (lift(region.low_m), lift(region.high_m));
            plane.dot(to_surface) + spread + if low > high { low } else { high } < 0.0
        })
    }

    /// Error bound of the region on this view's screen, in pixels.
    pub fn error_px(&self, region: &Region) -> f64 {
        let distance_m = self.distance_m(region);
        if distance_m > self.tangent_m + region.tangent_m || self.outside_frustum(region) {
            return 0.0;
        }
        let nearest_m = if distance_m > self.near_m { distance_m } else { self.near_m };
        region.error_m * self.pixels_per_radian / nearest_m
    }
}

/// Priority of a region: the largest error over all views.
pub fn priority_px(region: &Region, sights: &[Sight]) -> f64 {
    sights.iter().fold(0.0, |worst, sight| {
        let error_px = sight.error_px(region);
        if error_px > worst { error_px } else { worst }
    })
}
