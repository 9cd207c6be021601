//! A host for tests: lockstep pages, any pages withheld, frames one by one.
//!
//! In:    settings, poses, which wanted pages to let through.
//! Out:   frame outputs, audits.
//! Keeps: a terrain, its graph, its workers.
//! Not here: what is asserted.
#![allow(dead_code, missing_docs, reason = "each test binary uses its part of the rig")]

use overfly_core::camera::{View, orientation_from_attitude};
use overfly_core::datasource::generate::Generator;
use overfly_core::datasource::procedural::Style;
use overfly_core::frame::{FrameInput, FrameOutput, Terrain, add_stages};
use overfly_core::geodesy::{Ellipsoid, Geodetic};
use overfly_core::settings::*;
use overfly_core::units::{Pixels, Radians};
use overfly_jobs::{Graph, Workers};

pub fn scene(patch_depth: u8, triangles_max: u32) -> SceneSettings {
    SceneSettings {
        body: Ellipsoid::WGS84,
        sources: vec![SourceSettings::Procedural {
            seed: 1,
            style: Style::Earthlike,
            relief: 1.0,
            finest_m: 0.2,
            detail: 1.0,
        }],
        lod: LodSettings {
            tolerance: Pixels(0.2),
            triangles_max,
            patch_depth,
            splits_max: 400,
            merges_max: 400,
            level_max: 48,
            wanted_max: 64,
            morph_s: 0.0,
        },
        views: vec![],
        depth: DepthSettings {
            format: DepthFormat::D32F,
            order: DepthOrder::Reversed,
            splits_m: vec![30.0, 1e4],
        },
        vertices: VertexPrecision::TwoFloat,
        imagery: Vec::new(),
        memory: MemorySettings { pages_bytes: 64 << 20 },
        sea: true,
        sun: None,
    }
}

pub fn view(body: &Ellipsoid, at: Geodetic, heading_deg: f64, pitch_deg: f64) -> View {
    View {
        eye: body.ecef_from_geodetic(at),
        orientation: orientation_from_attitude(
            at,
            Radians::from_degrees(heading_deg),
            Radians::from_degrees(pitch_deg),
            Radians(0.0),
        ),
        field_of_view: Radians::from_degrees(60.0),
        size_px: [640, 360],
        near_m: 0.1,
    }
}

pub struct Rig {
    pub generator: Generator,
    pub terrain: Terrain,
    pub graph: Graph<Terrain>,
    pub workers: Workers,
    pub input: FrameInput,
    pub output: FrameOutput,
}

impl Rig {
    pub fn new(settings: &SceneSettings, workers: usize) -> Self {
        let generator = Generator::new(settings);
        let terrain = Terrain::new(settings, &generator);
        let mut graph = Graph::new();
        add_stages(&mut graph, |terrain: &Terrain| terrain);
        Self {
            generator,
            terrain,
            graph,
            workers: Workers::new(workers).unwrap(),
            input: FrameInput::default(),
            output: FrameOutput::default(),
        }
    }

    /// One frame; pages wanted by the last one arrive if `lets` says so.
    pub fn frame(&mut self, views: &[View], mut lets: impl FnMut(usize) -> bool) {
        self.input.views.clear();
        self.input.views.extend_from_slice(views);
        let arriving = self.output.wanted.iter().enumerate().filter(|(i, _)| lets(*i));
        self.input.arrived.extend(arriving.map(|(_, &key)| self.generator.page(key)));
        self.run();
    }

    /// One frame with the input as it stands.
    pub fn run(&mut self) {
        self.terrain.begin(&mut self.input).unwrap();
        self.graph.run(&self.terrain, &self.workers).unwrap();
        self.terrain.finish(&mut self.output);
    }

    /// Frames until nothing changes; how many.
    pub fn settle(&mut self, views: &[View]) -> u32 {
        for frame in 0..2000 {
            self.frame(views, |_| true);
            let counts = &self.output.counts;
            if counts.leaves > 0
                && counts.splits + counts.merges + counts.wanted + counts.admitted == 0
            {
                return frame;
            }
        }
        panic!("no fixed point: {:?}", self.output.counts);
    }

    pub fn audit(&self) {
        self.terrain.audit().unwrap();
    }
}
