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
//! Each bound only tightens when cap and height interval shrink. A diamond's own error counts from
//! where its own triangles may be, the lesser one of its descendants from where they may be: a
//! kid's own error is at most its parents' lesser one, so priorities are nested.
//!
//! Lens. Errors are vertical. At depth z and tangents t of the picture, a vertical error e is
//! |n⊥ − t·n_f|·e·f/z large, with the normal's parts across and along the view direction: at most
//! A = |n⊥| + T·|n_f|, T the tangent of the corner, and at most √(1 + t²) = 1/cos θ. And z is d·cos θ.
//! So the error is at most e·f/d times the lens min(A/c, 1/c²), c a lower bound on cos θ over the
//! region in the picture: that of the corner, or z/D, the least depth over the greatest distance of
//! any ground of the region. As a ball of the greatest radius of curvature M contains the ellipsoid
//! and X(n) turns by at most M times the angle, D² ≤ (h−k)² + (M²(1 + 0.37s²) + (h + k)M + hk)s²
//! with the chord s of both normals, negative heights counting as 0 in the product. Where an error
//! is below the threshold even with the corner's lens, or above it with none, the lens does not
//! matter; else it enters the slack as below.
//!
//! Certainty. With d the distance bound, the error is on the threshold where d = R = e·f/threshold.
//! If the eye moves by m, the heights change by at most m and √((ρ+h)(ρ+k))·|n−m| by at most λm
//! (λ is 1 nearby, see `stretch` below), so d changes by at most λm. Where the threshold over f
//! falls or rises by a share Δ, R changes by at most RΔ. A plane's value over the region changes by
//! at most m, and by L·φ when its unit normal changes by φ, L the region's farthest point. The
//! horizon's reach changes with the tangent length of the eye. Where the lens
//! counts, the error is on the threshold where dg = R with g = max(c/A, c²). z changes by at most
//! m + φD and D by μm, so c = z/D by at most δ = ((1 + μ)m + φD)/D downward and, while μm is below
//! D/10, by 1.2δ upward; A by (1 + T)φ; d ≤ D. With a = max(1, 1/A), dg falls by at most
//! a(λ + 2 + 2μ)m + a(2 + a(1 + T))dφ, and rises by at most a(1.5λ + 3 + 3μ)m +
//! a(3 + 1.2a(1 + T))dφ while δ is below 0.4 and (1 + T)φ below A/10.
//! So a slack in metres, minus λm, RΔ,
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
    /// Chord from `normal` to the farthest normal of the diamond's own two triangles.
    pub own_cap: f64,
    /// Bound on the height error of drawing the diamond unsplit, metres.
    pub error_m: f64,
    /// Bound on that of drawing any of its descendants, metres; at most `error_m`.
    pub finer_m: f64,
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
    forward: DVec3,
    pixels_per_radian: f64,
    /// Least square of the cosine between the view direction and anything in the picture.
    corner_cosine2: f64,
    /// Tangent of that angle.
    corner_tangent: f64,
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
    /// Pixels per radian are those of the picture's middle; the lens accounts for the rest.
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
            forward: camera.forward,
            pixels_per_radian: camera.pixels_per_radian,
            corner_cosine2: 1.0 / camera.corner_factor,
            corner_tangent: (camera.corner_factor - 1.0).sqrt(),
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
        let turned = |now: DVec3, was: DVec3| (now - was).length();
        let turns = self.planes.iter().zip(&before.planes).map(|(now, was)| turned(*now, *was));
        let turn = turns.fold(turned(self.forward, before.forward), f64::max);
        let change = |now: f64, was: f64| (now - was).abs() / now.min(was);
        let zoom = change(self.pixels_per_radian, before.pixels_per_radian)
            + change(self.corner_cosine2, before.corner_cosine2)
            + change(self.corner_tangent, before.corner_tangent);
        let lift_m = if self.tangent_m.is_finite() {
            (self.tangent_m - before.tangent_m).abs()
        } else {
            0.0
        };
        Some(Motion {
            path_m: (self.eye - before.eye).length(),
            step_m: DVec3::ZERO,
            lift_m,
            turn,
            // Products of small changes, many times over.
            zoom: zoom * (1.0 + zoom),
        })
    }

    /// Lower bound on the distance from the eye to the ground of the region, metres.
    pub fn distance_m(&self, region: &Region) -> f64 {
        self.distances_m(region)[1]
    }

    /// Lower bounds on the distance to the diamond's own triangles and to all of its region.
    fn distances_m(&self, region: &Region) -> [f64; 2] {
        let chord = (self.normal - region.normal).length();
        [region.own_cap, region.cap].map(|cap| self.distance_beyond_m(region, chord - cap))
    }

    /// Lower bound on the distance to ground of the region whose normal is a chord away.
    fn distance_beyond_m(&self, region: &Region, chord: f64) -> f64 {
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
        let [own_m, distance_m] = self.distances_m(region);
        let nearest =
            |distance_m: f64| if distance_m > self.near_m { distance_m } else { self.near_m };
        let (own_m, all_m) = (nearest(own_m), nearest(distance_m));
        let (own, all) = (region.error_m / own_m, region.finer_m / all_m);
        let flat_px = if own > all { own } else { all } * self.pixels_per_radian;
        Look { distance_m, own_m, all_m, flat_px }
    }

    /// How the screen's plane enlarges errors of the region.
    fn lens(&self, region: &Region) -> Lens {
        let [_, curvature_m] = self.horizon.curvature_m;
        let spread = 1.01 * curvature_m * region.cap;
        let along = self.forward.dot(region.normal);
        let lift = |height_m: f64| height_m * along - height_m.abs() * region.cap;
        let (low, high) = (lift(region.low_m), lift(region.high_m));
        let to_surface = self.forward.dot(region.surface - self.eye);
        let depth_m = to_surface - spread + if low < high { low } else { high };
        let chord = (self.normal - region.normal).length() + region.cap;
        let chord = if chord < 2.0 { chord } else { 2.0 };
        let (below, above) = (self.height_m - region.low_m, region.high_m - self.height_m);
        let vertical = if below > above { below } else { above };
        let h = if region.high_m > 0.0 { region.high_m } else { 0.0 };
        let k = if self.height_m > 0.0 { self.height_m } else { 0.0 };
        let bent = curvature_m * curvature_m * (1.0 + 0.37 * chord * chord);
        let across = (bent + (h + k) * curvature_m + h * k) * chord * chord;
        let far_m = (vertical * vertical + across).sqrt();
        let cosine = if depth_m > 0.0 { depth_m / far_m } else { 0.0 };
        let cosine2 = cosine * cosine;
        let cosine2 = if cosine2 > self.corner_cosine2 { cosine2 } else { self.corner_cosine2 };
        let least = |a: f64, b: f64| if a < b { a } else { b };
        let aside = least(self.forward.cross(region.normal).length() + region.cap, 1.0);
        let ahead = least(along.abs() + region.cap, 1.0);
        let across = aside + self.corner_tangent * ahead;
        let across = if across > ACROSS_MIN { across } else { ACROSS_MIN };
        let by_across = cosine2.sqrt() / across;
        let shrink = if by_across > cosine2 { by_across } else { cosine2 };
        Lens { shrink, across, far_m }
    }

    /// Bound on the change of the greatest distance for each metre that the eye moves.
    fn stretch_far(&self, region: &Region) -> f64 {
        let [least, greatest] = self.horizon.curvature_m;
        let chord = (self.normal - region.normal).length() + region.cap;
        1.5 * (greatest / least) * self.stretch(region) * (1.0 + chord)
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
        if self.seen_by_m(region, &look) < 0.0 {
            return 0.0;
        }
        look.flat_px / self.lens(region).shrink
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
        let [own_m, all_m] = self.reaches_m(region, threshold_px);
        let scale_m = look.own_m;
        let slack = |shrink: f64| (look.own_m * shrink - own_m).min(look.all_m * shrink - all_m);
        if look.flat_px < threshold_px * self.corner_cosine2 {
            let slack_m = slack(self.corner_cosine2) / self.corner_cosine2;
            let slack_m = self.path_of(region, slack_m, scale_m);
            return Verdict::Certain(Lasts { family: Family::Far, scale_m, slack_m });
        }
        let seen_by_m = self.seen_by_m(region, &look);
        if seen_by_m < 0.0 {
            let scale_m = self.farthest_m(region).max(scale_m);
            let slack_m = self.path_of(region, -seen_by_m, scale_m);
            return Verdict::Certain(Lasts { family: Family::Hidden, scale_m, slack_m });
        }
        let lens = self.lens(region);
        let error_px = look.flat_px / lens.shrink;
        if error_px >= threshold_px {
            return Verdict::Urgent(error_px);
        }
        let slack_m = slack(lens.shrink) - 1e-9 * lens.far_m - 1e-6;
        let strength = lens.strength();
        let path = self.stretch(region) + 2.0 + 2.0 * self.stretch_far(region);
        let turn = (2.0 + strength * (1.0 + self.corner_tangent)) / path;
        let slack_m = slack_m / (strength * path);
        let most_m = 0.1 * self.horizon.curvature_m[0];
        let slack_m = if slack_m < most_m { slack_m } else { most_m };
        let scale_m = scale_m * if turn > 1.0 { turn } else { 1.0 };
        Verdict::Certain(Lasts { family: Family::Hidden, scale_m, slack_m })
    }

    /// Distances at which the own error and that of all descendants are on a threshold.
    fn reaches_m(&self, region: &Region, threshold_px: f64) -> [f64; 2] {
        [region.error_m, region.finer_m]
            .map(|error_m| error_m * self.pixels_per_radian / threshold_px)
    }

    /// For how long a parent stays above `threshold_px` in this view, or its error.
    fn parent(&self, region: &Region, threshold_px: f64) -> Verdict {
        let look = self.look(region);
        let seen_by_m = self.seen_by_m(region, &look);
        if seen_by_m < 0.0 {
            return Verdict::Urgent(0.0);
        }
        let [own_m, all_m] = self.reaches_m(region, threshold_px);
        let slack = |shrink: f64| (own_m - look.own_m * shrink).max(all_m - look.all_m * shrink);
        let farthest_m = self.farthest_m(region);
        if look.flat_px > threshold_px {
            let scale_m = farthest_m.max(own_m);
            let slack_m = self.path_of(region, slack(1.0).min(seen_by_m), scale_m);
            return Verdict::Certain(Lasts { family: Family::Needed, scale_m, slack_m });
        }
        let lens = self.lens(region);
        let error_px = look.flat_px / lens.shrink;
        if error_px <= threshold_px {
            return Verdict::Urgent(error_px);
        }
        // What is left of dg, and of sight.
        let slack_m = slack(lens.shrink) - 1e-9 * lens.far_m - 1e-6;
        let (strength, tangent) = (lens.strength(), 1.0 + self.corner_tangent);
        let far = self.stretch_far(region);
        let path = 1.5 * self.stretch(region) + 3.0 + 3.0 * far;
        let turn = (3.0 + 1.2 * strength * tangent) / path;
        let most_m = 0.1 * look.all_m * (1.0 / far).min(lens.across / tangent);
        let lens_m = (slack_m / (strength * path)).min(most_m);
        let slack_m = lens_m.min(self.path_of(region, seen_by_m, lens.far_m));
        let scale_m = farthest_m.max(own_m).max(lens.far_m) * turn.max(1.0);
        Verdict::Certain(Lasts { family: Family::Needed, scale_m, slack_m })
    }
}

/// How the screen's plane enlarges errors of a region.
struct Lens {
    /// What an error is divided by: at least the corner's squared cosine.
    shrink: f64,
    /// A: at most so much of a vertical error lies across the view direction.
    across: f64,
    /// Nothing of the region is farther, metres.
    far_m: f64,
}

/// A is never taken for less, so that what depends on it changes slowly.
const ACROSS_MIN: f64 = 0.25;

impl Lens {
    /// a: how strongly the lens changes with the view.
    fn strength(&self) -> f64 {
        if self.across < 1.0 { 1.0 / self.across } else { 1.0 }
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

/// Distances of a region and its error if it lay in the middle of the picture.
struct Look {
    distance_m: f64,
    /// To the diamond's own triangles, at least the near distance.
    own_m: f64,
    /// To all that descends from it, the same.
    all_m: f64,
    flat_px: f64,
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
