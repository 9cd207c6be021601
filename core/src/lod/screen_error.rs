//! Priority of a diamond: the guaranteed projected error, the maximum over the views.
//!
//! In:    [`Region`] of a diamond, [`Sight`] of each view, a threshold.
//! Out:   an error bound in pixels; 0 where nothing of the region can be seen; verdicts: on which
//!        side of the threshold the bound is, and for how much motion that is certain.
//! Keeps: nothing.
//! Not here: where bounds come from (`cover`), what is done with verdicts (`agenda`).
//!
//! Distance. Let ρ be the ellipsoid's least radius of curvature. A ball of radius ρ rolls inside
//! it, so for ground points with normals n, m and heights h, k the squared distance is at least
//! |(ρ+h)n − (ρ+k)m|² = (h−k)² + (ρ+h)(ρ+k)|n−m|².
//! Horizon. A ball of the greatest radius of curvature contains it, so from height h nothing of
//! height k is seen farther than the sum of both tangent lengths to that ball, lowered to the
//! deepest ground. Frustum. A plane's greatest value over the region is bounded term by term.
//! Each bound only tightens when cap and height interval shrink: so priorities are nested.
//!
//! Certainty. With d the distance bound, the error is on the threshold where d = R = e·f/threshold.
//! If the eye moves by m, the heights change by at most m and √((ρ+h)(ρ+k))·|n−m| by at most λm
//! (λ is 1 nearby, see `stretch` below), so d changes by at most λm. Where the threshold over f
//! falls or rises by a share Δ, R changes by at most RΔ. A plane's value over the region changes by
//! at most m, and by L·φ when its unit normal changes by φ, L the region's farthest point. The
//! horizon's reach changes with the tangent length of the eye. So a slack in metres, minus λm, RΔ,
//! Lφ and the tangents' change, stays positive for as long as `Lasts` tells.

use super::agenda::Verdict;
use super::wheel::{Family, Lasts, Motion};
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
    /// Of a body whose drawn surface lies within `surface_range_m` above the ellipsoid.
    pub fn new(body: &Ellipsoid, surface_range_m: [f64; 2]) -> Self {
        let [floor_m, peak_m] = surface_range_m;
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
    /// Greatest √((ρ + k)/(ρ + h)) of any ground k and any eye h for which verdicts last.
    steepness: f64,
    horizon: Horizon,
}

/// Eyes deeper than this share of the least radius of the floor get no lasting verdicts: close to
/// the body's centre the normal under the eye turns without bound.
const DEEPEST_EYE: f64 = 0.9;

impl Sight {
    /// The sight of a camera over a body.
    ///
    /// An error e at distance d looks at most e·f·c/d pixels large, f the pixels per radian of the
    /// picture's middle, c its corner factor: the screen is a plane, not a sphere.
    pub fn new(camera: &Camera, horizon: Horizon) -> Self {
        let below = camera.height_m <= horizon.floor_m;
        let rho = horizon.curvature_m[0];
        let deepest_m = DEEPEST_EYE * (rho + horizon.floor_m);
        let steepness = ((rho + horizon.peak_m) / deepest_m).sqrt();
        Self {
            eye: camera.eye.0,
            normal: camera.normal,
            height_m: camera.height_m,
            planes: camera.side_planes,
            pixels_per_radian: camera.pixels_per_radian * camera.corner_factor,
            near_m: camera.near_m,
            // From below all ground the horizon hides nothing.
            tangent_m: if below { f64::INFINITY } else { horizon.tangent_m(camera.height_m) },
            steepness,
            horizon,
        }
    }

    /// What happened between an earlier sight of this view and this one; `None` where no verdict
    /// may last: another near distance, an eye through the floor of all ground or far below it.
    pub fn motion_since(&self, before: &Self) -> Option<Motion> {
        let rho = self.horizon.curvature_m[0];
        let deepest_m = DEEPEST_EYE * (rho + self.horizon.floor_m) - rho;
        let same = self.near_m == before.near_m
            && self.tangent_m.is_finite() == before.tangent_m.is_finite();
        if !same || self.height_m < deepest_m || before.height_m < deepest_m {
            return None;
        }
        let turns = self.planes.iter().zip(&before.planes).map(|(now, was)| (*now - *was).length());
        let (now, was) = (self.pixels_per_radian, before.pixels_per_radian);
        let lift_m = if self.tangent_m.is_finite() {
            (self.tangent_m - before.tangent_m).abs()
        } else {
            0.0
        };
        Some(Motion {
            path_m: (self.eye - before.eye).length(),
            step_m: DVec3::ZERO,
            lift_m,
            turn: turns.fold(0.0, f64::max),
            zoom: (now - was).abs() / now.min(was),
        })
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

    /// Bound on the change of [`Self::distance_m`] for each metre that the eye moves.
    ///
    /// With c the chord between the normals the gradient is at most √((ρ+k)/(ρ+h))·(1 + c/2); a
    /// slack is never more than a tenth of ρ, so c grows by less than what is added here.
    fn stretch(&self, region: &Region) -> f64 {
        self.steepness * (1.1 + (self.normal - region.normal).length())
    }

    /// By how much the region is in the frustum, metres: negative outside.
    fn frustum_margin_m(&self, region: &Region) -> f64 {
        let to_surface = region.surface - self.eye;
        let spread = 1.01 * self.horizon.curvature_m[1] * region.cap;
        let of = |plane: &DVec3| {
            let along = plane.dot(region.normal);
            let lift = |height_m: f64| height_m * along + height_m.abs() * region.cap;
            let (low, high) = (lift(region.low_m), lift(region.high_m));
            plane.dot(to_surface) + spread + if low > high { low } else { high }
        };
        let [a, b, c, d] = [0, 1, 2, 3].map(|side| of(&self.planes[side]));
        a.min(b).min(c.min(d))
    }

    /// What this view sees of a region.
    fn look(&self, region: &Region) -> Look {
        let distance_m = self.distance_m(region);
        let nearest_m = if distance_m > self.near_m { distance_m } else { self.near_m };
        Look {
            distance_m,
            nearest_m,
            error_px: region.error_m * self.pixels_per_radian / nearest_m,
        }
    }

    /// By how much the region is seen: the lesser margin before horizon and frustum, metres.
    /// Negative where it is hidden; then the greater of both counts.
    fn seen_by_m(&self, region: &Region, look: &Look) -> f64 {
        let above_m = (self.tangent_m + region.tangent_m) - look.distance_m;
        let inside_m = self.frustum_margin_m(region);
        above_m.min(inside_m)
    }

    /// Whether this view may see any of the region.
    pub fn sees(&self, region: &Region) -> bool {
        self.seen_by_m(region, &self.look(region)) >= 0.0
    }

    /// Error bound of the region on this view's screen, in pixels.
    pub fn error_px(&self, region: &Region) -> f64 {
        let look = self.look(region);
        if self.seen_by_m(region, &look) < 0.0 { 0.0 } else { look.error_px }
    }

    /// Not less than the distance to any point of the region by which a turn moves it, metres.
    fn farthest_m(&self, region: &Region) -> f64 {
        let (low, high) = (region.low_m.abs(), region.high_m.abs());
        (region.surface - self.eye).length() + if low > high { low } else { high }
    }

    /// A slack in metres of motion, from one in metres of distance; rounding taken off.
    fn path_of(&self, region: &Region, slack_m: f64, scale_m: f64) -> f64 {
        let most_m = 0.1 * self.horizon.curvature_m[0];
        let path_m = (slack_m - 1e-9 * scale_m - 1e-6) / self.stretch(region);
        if path_m < most_m { path_m } else { most_m }
    }

    /// For how long a leaf stays below `threshold_px` in this view, or its error.
    fn leaf(&self, region: &Region, threshold_px: f64) -> Verdict {
        let look = self.look(region);
        if look.error_px < threshold_px {
            let reach_m = region.error_m * self.pixels_per_radian / threshold_px;
            let scale_m = look.nearest_m;
            let slack_m = self.path_of(region, look.nearest_m - reach_m, scale_m);
            return Verdict::Certain(Lasts { family: Family::Far, scale_m, slack_m });
        }
        let seen_by_m = self.seen_by_m(region, &look);
        if seen_by_m >= 0.0 {
            return Verdict::Urgent(look.error_px);
        }
        let scale_m = self.farthest_m(region).max(look.nearest_m);
        let slack_m = self.path_of(region, -seen_by_m, scale_m);
        Verdict::Certain(Lasts { family: Family::Hidden, scale_m, slack_m })
    }

    /// For how long a parent stays above `threshold_px` in this view, or its error.
    fn parent(&self, region: &Region, threshold_px: f64) -> Verdict {
        let look = self.look(region);
        let seen_by_m = self.seen_by_m(region, &look);
        if seen_by_m < 0.0 {
            return Verdict::Urgent(0.0);
        }
        if look.error_px <= threshold_px {
            return Verdict::Urgent(look.error_px);
        }
        let reach_m = region.error_m * self.pixels_per_radian / threshold_px;
        let scale_m = self.farthest_m(region).max(reach_m);
        let slack_m = (reach_m - look.nearest_m).min(seen_by_m);
        let slack_m = self.path_of(region, slack_m, scale_m);
        Verdict::Certain(Lasts { family: Family::Needed, scale_m, slack_m })
    }
}

/// The most motion of any view between two frames; `None` where no verdict may last, as when
/// there are more or fewer views.
pub fn motion_between(before: &[Sight], now: &[Sight]) -> Option<Motion> {
    if before.len() != now.len() {
        return None;
    }
    let of = |(now, before): (&Sight, &Sight)| now.motion_since(before);
    now.iter().zip(before).map(of).try_fold(Motion::default(), |most, one| Some(most.most(one?)))
}

/// Distance and error of a region in a view, whether it is seen or not.
struct Look {
    distance_m: f64,
    nearest_m: f64,
    error_px: f64,
}

/// Priority of a region: the largest error over all views.
pub fn priority_px(region: &Region, sights: &[Sight]) -> f64 {
    sights.iter().fold(0.0, |worst, sight| {
        let error_px = sight.error_px(region);
        if error_px > worst { error_px } else { worst }
    })
}

/// The verdict on a leaf: certain while it is below the threshold in every view.
pub fn judge_leaf(region: &Region, sights: &[Sight], threshold_px: f64) -> Verdict {
    let both = |all, one| match (all, one) {
        (Verdict::Urgent(a), Verdict::Urgent(b)) => Verdict::Urgent(if a > b { a } else { b }),
        (Verdict::Urgent(px), _) | (_, Verdict::Urgent(px)) => Verdict::Urgent(px),
        (Verdict::Certain(a), Verdict::Certain(b)) => Verdict::Certain(Lasts {
            family: if b.family == Family::Hidden { b.family } else { a.family },
            scale_m: a.scale_m.max(b.scale_m),
            slack_m: a.slack_m.min(b.slack_m),
        }),
    };
    let verdicts = sights.iter().map(|sight| sight.leaf(region, threshold_px));
    verdicts.reduce(both).unwrap_or(Verdict::Certain(Lasts::FOREVER))
}

/// The verdict on a parent: certain while it is above the threshold in one view.
pub fn judge_parent(region: &Region, sights: &[Sight], threshold_px: f64) -> Verdict {
    sights.iter().map(|sight| sight.parent(region, threshold_px)).fold(
        Verdict::Urgent(0.0),
        |all, one| match (all, one) {
            (Verdict::Certain(a), Verdict::Certain(b)) => {
                Verdict::Certain(if b.slack_m > a.slack_m { b } else { a })
            }
            (Verdict::Certain(lasts), _) | (_, Verdict::Certain(lasts)) => Verdict::Certain(lasts),
            (Verdict::Urgent(a), Verdict::Urgent(b)) => Verdict::Urgent(if a > b { a } else { b }),
        },
    )
}
