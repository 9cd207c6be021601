//! A world under test: a terrain over procedural or synthetic ground, frame by frame.
//!
//! In:    settings, ground, views.
//! Out:   frame outputs, audits, digests.
//! Keeps: a terrain, its graph, its workers.
//! Not here: what is asserted.

use crate::rig;
use crate::synthetic::{Relief, Synthetic};
use glam::DVec3;
use overfly_core::camera::{View, ViewFault};
use overfly_core::datasource::generate::Generator;
use overfly_core::datasource::{Page, PageKey};
use overfly_core::digest::{FrameDigest, mix};
use overfly_core::frame::{FrameInput, FrameOutput, Terrain, add_stages};
use overfly_core::geodesy::{Ellipsoid, Geodetic};
use overfly_core::settings::SceneSettings;
use overfly_jobs::{Graph, Workers};
use std::sync::Arc;

pub const EARTH: Ellipsoid = Ellipsoid::WGS84;

/// A number in [0, 1) that looks random.
pub fn unit(seed: u64) -> f64 {
    (mix(seed) >> 11) as f64 / (1_u64 << 53) as f64
}

/// A sphere.
pub fn sphere(radius_m: f64) -> Ellipsoid {
    Ellipsoid { a_m: radius_m, f: 0.0 }
}

/// Settings over a body without sources: for synthetic ground.
pub fn bare(body: Ellipsoid, patch_depth: u8, triangles_max: u32) -> SceneSettings {
    let mut settings = rig::scene(patch_depth, triangles_max);
    (settings.body, settings.sources, settings.sea) = (body, Vec::new(), false);
    settings
}

/// A view that looks down on the middle of the body.
pub fn down_on(body: &Ellipsoid, at: Geodetic) -> View {
    rig::view(body, at, 0.0, -90.0)
}

/// Where heights come from.
enum Source {
    Procedural(Generator),
    Synthetic(Synthetic),
}

pub struct World {
    pub terrain: Terrain,
    pub input: FrameInput,
    pub output: FrameOutput,
    source: Source,
    graph: Graph<Terrain>,
    workers: Workers,
}

impl World {
    /// Procedural ground.
    pub fn procedural(settings: &SceneSettings) -> Self {
        let generator = Generator::new(settings);
        let terrain = Terrain::new(settings, &generator);
        Self::over(terrain, Source::Procedural(generator), 0)
    }

    /// Synthetic ground on the settings' body.
    pub fn synthetic(settings: &SceneSettings, relief: Relief) -> Self {
        Self::with_workers(settings, relief, 0)
    }

    pub fn with_workers(settings: &SceneSettings, relief: Relief, workers: usize) -> Self {
        let patch_depth = settings.lod.patch_depth;
        let ground = Synthetic { relief, body: settings.body, patch_depth };
        let generator = Generator::with_archives(settings, vec![ground.facts()]);
        let terrain = Terrain::new(settings, &generator);
        Self::over(terrain, Source::Synthetic(ground), workers)
    }

    fn over(terrain: Terrain, source: Source, workers: usize) -> Self {
        let mut graph = Graph::new();
        add_stages(&mut graph, |terrain: &Terrain| terrain);
        Self {
            terrain,
            input: FrameInput::default(),
            output: FrameOutput::default(),
            source,
            graph,
            workers: Workers::new(workers).unwrap(),
        }
    }

    /// The body.
    pub fn body(&self) -> Ellipsoid {
        self.terrain.settings().body
    }

    /// One page.
    pub fn page(&self, key: PageKey) -> Arc<Page> {
        match &self.source {
            Source::Procedural(generator) => generator.page(key),
            Source::Synthetic(ground) => ground.page(key),
        }
    }

    /// The ground's own height above the ellipsoid at a normal, as it is drawn.
    pub fn height_m(&self, normal: DVec3) -> f64 {
        match &self.source {
            Source::Procedural(generator) => {
                let height_m = generator.planet().unwrap().sample(normal).height_m;
                if self.terrain.settings().sea { height_m.max(0.0) } else { height_m }
            }
            Source::Synthetic(ground) => ground.height_m(normal),
        }
    }

    /// Rugged ground well above the sea, in degrees.
    pub fn land(&self) -> (f64, f64) {
        let Source::Procedural(generator) = &self.source else { return (46.8, -121.8) };
        let places = (0..2000_u64).map(|i| (120.0 * unit(i) - 60.0, 360.0 * unit(!i) - 180.0));
        let rated = places.map(|(lat, lon)| {
            let normal = Geodetic::from_degrees(lat, lon, 0.0).normal();
            (generator.planet().unwrap().sample(normal), (lat, lon))
        });
        let high = rated.filter(|(sample, _)| sample.height_m > 500.0);
        let best = high.max_by(|a, b| a.0.ruggedness.total_cmp(&b.0.ruggedness));
        best.expect("there is land").1
    }

    /// The eye this far above the ground of [`Self::land`].
    pub fn eye_above_land(&self, above_m: f64) -> Geodetic {
        let (lat_deg, lon_deg) = self.land();
        self.eye_above(lat_deg, lon_deg, above_m)
    }

    /// The point of the true surface at a normal.
    pub fn surface(&self, normal: DVec3) -> DVec3 {
        self.body().surface_from_normal(normal) + normal * self.height_m(normal)
    }

    /// The eye this far above the true surface.
    pub fn eye_above(&self, lat_deg: f64, lon_deg: f64, above_m: f64) -> Geodetic {
        let at = Geodetic::from_degrees(lat_deg, lon_deg, 0.0);
        Geodetic { height_m: self.height_m(at.normal()) + above_m, ..at }
    }

    /// One frame; all pages wanted by the last one arrive.
    pub fn frame(&mut self, views: &[View]) {
        self.try_frame(views).unwrap();
    }

    /// One frame, or why it cannot begin.
    pub fn try_frame(&mut self, views: &[View]) -> Result<(), ViewFault> {
        self.input.views.clear();
        self.input.views.extend_from_slice(views);
        let wanted = std::mem::take(&mut self.output.wanted);
        let pages: Vec<_> = wanted.iter().map(|&key| self.page(key)).collect();
        self.input.arrived.extend(pages);
        self.output.wanted = wanted;
        self.terrain.begin(&mut self.input)?;
        self.graph.run(&self.terrain, &self.workers).unwrap();
        self.terrain.finish(&mut self.output);
        Ok(())
    }

    /// Frames until nothing changes; how many.
    pub fn settle(&mut self, views: &[View]) -> u32 {
        for frame in 0..3000 {
            self.frame(views);
            let counts = &self.output.counts;
            let work = counts.splits + counts.merges + counts.wanted + counts.admitted;
            if counts.leaves > 0 && work == 0 {
                return frame;
            }
        }
        panic!("no fixed point: {:?}", self.output.counts);
    }

    /// No event: everything finite, the surface closed, the budget kept.
    pub fn check(&self) {
        self.terrain.audit().unwrap();
        let counts = &self.output.counts;
        assert!(counts.error_px_bound.is_finite() && counts.error_px_bound >= 0.0, "{counts:?}");
        assert!(counts.triangles <= self.terrain.settings().lod.triangles_max, "{counts:?}");
        let patches = self.terrain.patches();
        for slot in 0..patches.used_end() {
            let Some((centre, radius_m)) = patches.sphere(slot) else { continue };
            assert!(centre.is_finite() && radius_m.is_finite(), "slot {slot}");
            let vertices = patches.vertices_of(slot);
            let finite = |v: [f32; 3]| v.into_iter().all(f32::is_finite);
            assert!(vertices.iter().all(|v| finite(v.position.hi) && finite(v.position.lo)));
        }
        for view in &self.output.views {
            let camera = &view.camera;
            let vectors = [camera.normal, camera.right, camera.up, camera.forward];
            let planes = camera.side_planes.into_iter().chain(vectors);
            assert!(planes.into_iter().all(|v| (v.length() - 1.0).abs() < 1e-9), "{camera:?}");
            assert!(camera.pixels_per_radian.is_finite() && camera.corner_factor.is_finite());
        }
    }

    /// Settles and checks; the digest.
    pub fn settled(&mut self, views: &[View]) -> FrameDigest {
        self.settle(views);
        self.check();
        self.output.digest
    }
}
