//! Names and units of everything that is measured: the metric vector, the columns, the verdict.
//!
//! In:    the errors of a flight.
//! Out:   (name, value) pairs in a fixed order; spreads for tables; what must not be, in words.
//! Keeps: nothing.
//! Not here: tables, JSON, pictures (the host).
//!
//! Names are stable, end in their unit and never change their meaning. What was not measured is
//! NaN: JSON has `null` for it.

use super::errors::{DepthOrderErrors, FlightErrors, FrameErrors, Thorough};
use super::spread::Spread;

/// A name and a value.
pub type Named = (&'static str, f64);

/// A spread as a table has it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Row {
    /// Short name of the metric.
    pub metric: &'static str,
    /// What it is, in a few words.
    pub what: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Its values. Where percentiles are not kept they are NaN.
    pub spread: Spread,
}

impl FlightErrors {
    /// The whole metric vector of the flight, always the same names in the same order.
    pub fn vector(&self) -> Vec<Named> {
        let mut all = self.error_part();
        all.extend(self.pop_part());
        all.extend(self.crack_part());
        all.extend(self.height_part());
        all.extend(self.arithmetic_part());
        all.extend(self.scale_part());
        all
    }

    /// One value of [`Self::vector`]; NaN where it was not measured or has no such name.
    pub fn value(&self, name: &str) -> f64 {
        self.vector().into_iter().find(|(known, _)| *known == name).map_or(f64::NAN, |(_, x)| x)
    }

    fn error_part(&self) -> Vec<Named> {
        let (e1, e2, e2_m) = (self.e1_px.spread(), self.e2_share.spread(), self.e2_m.spread());
        let e4 = self.merged(|thorough| &thorough.e4_px);
        let rays = self.sum(|frame| frame.rays);
        vec![
            ("e1_rms_px", e1.rms),
            ("e1_p50_px", e1.p50),
            ("e1_p95_px", e1.p95),
            ("e1_p99_px", e1.p99),
            ("e1_p999_px", e1.p999),
            ("e1_max_px", e1.max),
            ("e2_p50_share", e2.p50),
            ("e2_p99_share", e2.p99),
            ("e2_p50_m", e2_m.p50),
            ("e2_p99_m", e2_m.p99),
            ("e3_ppm", self.sum(|frame| frame.e3_rays) / rays * 1e6),
            ("e4_rms_px", e4.rms),
            ("e4_max_px", e4.max),
            ("e4_lost_columns", self.sum_thorough(|thorough| thorough.e4_lost)),
            ("e5_max", self.frames.iter().map(FrameErrors::e5).fold(f64::NAN, f64::max)),
            ("tightness", self.mean(FrameErrors::e5)),
            ("bound_mean_px", self.mean(|frame| frame.bound_px)),
            ("bound_max_px", self.frames.iter().map(|f| f.bound_px).fold(f64::NAN, f64::max)),
        ]
    }

    fn pop_part(&self) -> Vec<Named> {
        let (p1, p3) = (self.p1_px.spread(), self.p3_deg.spread());
        let popping = self.frames.iter().filter(|frame| frame.p1_px.count > 0);
        let gaps_ms: f64 = popping.clone().map(|frame| f64::from(frame.gap_ms)).sum();
        let rate_hz = popping.count() as f64 / gaps_ms * 1e3;
        vec![
            ("p1_rms_px", p1.rms),
            ("p1_p99_px", p1.p99),
            ("p1_p999_px", p1.p999),
            ("p1_max_px", p1.max),
            ("p1_share_above_half_px", self.sum(|frame| frame.p1_above_half) / p1.count as f64),
            ("p1_p999_px_per_s", p1.p999 * rate_hz),
            ("p2_median_px", p1.p50),
            ("p3_p999_deg", p3.p999),
            ("p3_max_deg", p3.max),
            ("cuts_count", self.cuts as f64),
        ]
    }

    fn crack_part(&self) -> Vec<Named> {
        vec![
            ("c1_edges", self.sum_thorough(|thorough| thorough.c1_edges)),
            ("c2_junctions", self.sum_thorough(|thorough| thorough.c2_junctions)),
            ("c3_points", self.sum_thorough(|thorough| thorough.c3_points)),
            ("c4_rays", self.sum(|frame| frame.holes)),
            ("c5_rays", self.sum(|frame| frame.pinholes)),
            ("lost_rays", self.sum(|frame| frame.lost)),
        ]
    }

    fn height_part(&self) -> Vec<Named> {
        let h1 = self.merged(|thorough| &thorough.h1_m);
        let gear = self.merged(|thorough| &thorough.h2_gear_m);
        let near = self.merged(|thorough| &thorough.h2_near_m);
        let far = self.merged(|thorough| &thorough.h2_far_m);
        let step = self.merged(|thorough| &thorough.h2_step_m);
        vec![
            ("h1_rms_m", h1.rms),
            ("h1_max_m", h1.max),
            ("h2_gear_rms_m", gear.rms),
            ("h2_gear_max_m", gear.max),
            ("h2_50_rms_m", near.rms),
            ("h2_50_max_m", near.max),
            ("h2_500_rms_m", far.rms),
            ("h2_500_max_m", far.max),
            ("h2_step_max_m", step.max),
        ]
    }

    fn arithmetic_part(&self) -> Vec<Named> {
        let m32 = self.merged(|thorough| &thorough.m32_px);
        let whole = self.merged(|thorough| &thorough.f32_px);
        let jitter = self.merged(|thorough| &thorough.j1_px);
        let worst =
            |of: &dyn Fn(&Thorough) -> f64| self.thorough().map(of).fold(f64::NAN, f64::max);
        let depth = |at: usize, of: fn(&DepthOrderErrors) -> f64| worst(&|t| of(&t.depths[at]));
        vec![
            ("j1_rms_px", jitter.rms),
            ("j1_step_px", worst(&|thorough| thorough.j1_step_px)),
            ("m32_rms_px", m32.rms),
            ("m32_max_px", m32.max),
            ("f32_rms_px", whole.rms),
            ("f32_max_px", whole.max),
            ("z1_scene_share", depth(0, |z| z.z1_share)),
            ("z1_d32f_share", depth(1, |z| z.z1_share)),
            ("z1_d24x3_share", depth(2, |z| z.z1_share)),
            ("z2_scene_ppm", depth(0, |z| z.z2_ppm)),
            ("z2_d32f_ppm", depth(1, |z| z.z2_ppm)),
            ("z2_d24x3_ppm", depth(2, |z| z.z2_ppm)),
        ]
    }

    fn scale_part(&self) -> Vec<Named> {
        let cross = self.merged(|thorough| &thorough.cross.px);
        vec![
            ("t1_count", self.sum(|frame| frame.stretched)),
            ("triangles_mean", self.mean(|frame| frame.mesh_triangles as f64)),
            ("triangles_seen_mean", self.mean(|frame| frame.triangles as f64)),
            ("frames_count", self.frames.len() as f64),
            ("rays_count", self.sum(|frame| frame.rays)),
            ("missing_pages_count", self.sum(|frame| frame.missing_pages)),
            ("thorough_frames_count", self.thorough().count() as f64),
            ("cross_rays_count", self.sum_thorough(|thorough| thorough.cross.rays)),
            ("cross_differ_count", self.sum_thorough(|thorough| thorough.cross.differ)),
            ("cross_rms_px", cross.rms),
            ("cross_max_px", cross.max),
        ]
    }

    /// The spreads of the flight, for tables.
    pub fn rows(&self) -> Vec<Row> {
        let row = |metric, what, unit, spread| Row { metric, what, unit, spread };
        let few = |metric, what, unit, of: fn(&Thorough) -> &Spread| Row {
            metric,
            what,
            unit,
            spread: self.merged(of),
        };
        vec![
            row("E1", "radial error", "px", self.e1_px.spread()),
            row("E2", "depth along a ray", "share", self.e2_share.spread()),
            row("E2", "depth along a ray", "m", self.e2_m.spread()),
            few("E4", "outline", "px", |t| &t.e4_px),
            row("P1", "pop", "px", self.p1_px.spread()),
            row("P3", "turn of normals", "deg", self.p3_deg.spread()),
            few("H1", "height queries", "m", |t| &t.h1_m),
            few("H2", "mesh under the gear", "m", |t| &t.h2_gear_m),
            few("H2", "mesh within 50 m", "m", |t| &t.h2_near_m),
            few("H2", "mesh within 500 m", "m", |t| &t.h2_far_m),
            few("M32", "uploaded bytes", "px", |t| &t.m32_px),
            few("M32", "f32 arithmetic", "px", |t| &t.f32_px),
            few("J1", "jitter", "px", |t| &t.j1_px),
            few("E1", "cross-check", "px", |t| &t.cross.px),
        ]
    }

    /// What must not be: a bound that did not hold, cracks. Empty where all is well.
    pub fn faults(&self) -> Vec<String> {
        let mut faults = Vec::new();
        let over: Vec<_> = self.frames.iter().filter(|frame| frame.e5() > 1.0).collect();
        if let Some(worst) = over.iter().max_by(|a, b| a.e5().total_cmp(&b.e5())) {
            let (e1, at) = (worst.e1_px.max, worst.e1_px.at.pixel);
            faults.push(format!(
                "E5: the bound did not hold in {} of {} frames; worst in frame {}: {e1:.3} px at \
                 pixel ({:.0}, {:.0}) where {:.3} px were certain",
                over.len(),
                self.frames.len(),
                worst.frame,
                at[0],
                at[1],
                worst.bound_px,
            ));
        }
        let first = |of: &dyn Fn(&FrameErrors) -> u64| {
            self.frames.iter().find(|frame| of(frame) > 0).map_or(0, |frame| frame.frame)
        };
        for (name, of) in CRACKS {
            let count: u64 = self.frames.iter().map(of).sum();
            if count > 0 {
                faults.push(format!("{name}: {count}, first in frame {}", first(&of)));
            }
        }
        faults
    }

    /// The frames that were measured thoroughly.
    pub fn thorough(&self) -> impl Iterator<Item = &Thorough> {
        self.frames.iter().filter_map(|frame| frame.thorough.as_ref())
    }

    fn sum(&self, of: impl Fn(&FrameErrors) -> u64) -> f64 {
        self.frames.iter().map(of).sum::<u64>() as f64
    }

    /// NaN where no frame was measured thoroughly.
    fn sum_thorough(&self, of: impl Fn(&Thorough) -> u64) -> f64 {
        let mut frames = self.thorough().peekable();
        if frames.peek().is_none() { f64::NAN } else { frames.map(of).sum::<u64>() as f64 }
    }

    fn mean(&self, of: impl Fn(&FrameErrors) -> f64) -> f64 {
        self.frames.iter().map(of).sum::<f64>() / self.frames.len() as f64
    }

    fn merged(&self, of: impl Fn(&Thorough) -> &Spread) -> Spread {
        Spread::merged(self.thorough().map(of))
    }
}

type OfFrame = fn(&FrameErrors) -> u64;

/// Counts that must be 0 in every frame.
const CRACKS: [(&str, OfFrame); 6] = [
    ("C1: edges that are not used once in each direction", |f| of_few(f, |t| t.c1_edges)),
    ("C2: vertices between the ends of an edge", |f| of_few(f, |t| t.c2_junctions)),
    ("C3: lattice points drawn at more than one place", |f| of_few(f, |t| t.c3_points)),
    ("C4: rays that see through the mesh", |frame| frame.holes),
    ("C5: single rays that see what lies behind the ground", |frame| frame.pinholes),
    ("rays to ground over which there is no mesh", |frame| frame.lost),
];

fn of_few(frame: &FrameErrors, of: fn(&Thorough) -> u64) -> u64 {
    frame.thorough.as_ref().map_or(0, of)
}

impl FrameErrors {
    /// Everything that was measured in this frame, always the same names in the same order.
    pub fn columns(&self) -> Vec<Named> {
        let mut all = self.own_columns();
        all.extend(thorough_columns(self.thorough.as_ref()));
        all
    }

    fn own_columns(&self) -> Vec<Named> {
        let (e1, p1) = (&self.e1_px, &self.p1_px);
        let pops = |value: f64| if p1.count > 0 { value } else { f64::NAN };
        vec![
            ("frame", self.frame as f64),
            ("lat_deg", self.eye[0]),
            ("lon_deg", self.eye[1]),
            ("height_m", self.eye[2]),
            ("above_m", self.above_m),
            ("triangles", self.mesh_triangles as f64),
            ("triangles_seen", self.triangles as f64),
            ("rays", self.rays as f64),
            ("e1_rms_px", e1.rms),
            ("e1_p50_px", e1.p50),
            ("e1_p95_px", e1.p95),
            ("e1_p99_px", e1.p99),
            ("e1_p999_px", e1.p999),
            ("e1_max_px", e1.max),
            ("e1_max_lat_deg", e1.at.lat_deg),
            ("e1_max_lon_deg", e1.at.lon_deg),
            ("e1_max_pixel_x", e1.at.pixel[0]),
            ("e1_max_pixel_y", e1.at.pixel[1]),
            ("bound_px", self.bound_px),
            ("e5", self.e5()),
            ("e2_p50_share", self.e2_share.p50),
            ("e2_p99_share", self.e2_share.p99),
            ("e3_rays", self.e3_rays as f64),
            ("p1_p999_px", pops(p1.p999)),
            ("p1_max_px", pops(p1.max)),
            ("p2_median_px", pops(p1.p50)),
            ("p3_p999_deg", pops(self.p3_deg.p999)),
            ("c4_rays", self.holes as f64),
            ("c5_rays", self.pinholes as f64),
            ("lost_rays", self.lost as f64),
            ("t1_count", self.stretched as f64),
            ("missing_pages", self.missing_pages as f64),
        ]
    }
}

fn thorough_columns(thorough: Option<&Thorough>) -> Vec<Named> {
    let of = |value: fn(&Thorough) -> f64| thorough.map_or(f64::NAN, value);
    vec![
        ("e4_rms_px", of(|t| t.e4_px.rms)),
        ("e4_max_px", of(|t| t.e4_px.max)),
        ("c1_edges", of(|t| t.c1_edges as f64)),
        ("c2_junctions", of(|t| t.c2_junctions as f64)),
        ("c3_points", of(|t| t.c3_points as f64)),
        ("h1_max_m", of(|t| t.h1_m.max)),
        ("h2_gear_max_m", of(|t| t.h2_gear_m.max)),
        ("h2_50_max_m", of(|t| t.h2_near_m.max)),
        ("h2_500_max_m", of(|t| t.h2_far_m.max)),
        ("h2_step_max_m", of(|t| t.h2_step_m.max)),
        ("m32_max_px", of(|t| t.m32_px.max)),
        ("f32_max_px", of(|t| t.f32_px.max)),
        ("j1_rms_px", of(|t| t.j1_px.rms)),
        ("j1_step_px", of(|t| t.j1_step_px)),
        ("z1_scene_share", of(|t| t.depths[0].z1_share)),
        ("cross_max_px", of(|t| t.cross.px.max)),
    ]
}
