//! Recording timed: what a picture costs the host, alone and with a second worker.
//!
//! In:    triangles behind the eye, so that the device has nothing to fill.
//! Out:   criterion's report: one element is one draw.
//! Keeps: nothing.
//! Not here: what the device takes; uploads (`tests/steady.rs`).
//!
//! `Renderer::draw` returns when its work is submitted, so it is timed with the wait for the last
//! picture outside. A software device works on the same cores: pictures are finished before the
//! next is begun, and the device's part is never in a sample.

#[path = "../tests/planet/mod.rs"]
#[expect(dead_code, reason = "its camera only")]
mod planet;
#[path = "../tests/stage/mod.rs"]
#[expect(dead_code, reason = "settings and skipping only")]
mod stage;

use criterion::{BenchmarkId, Criterion, Throughput};
use glam::DVec3;
use overfly_core::frame::data::ViewDraws;
use overfly_core::geodesy::Ecef;
use overfly_core::mesh::Patches;
use overfly_core::mesh::patches::Leaf;
use overfly_core::scene::FrameParts;
use overfly_core::settings::VertexPrecision;
use overfly_jobs::{Graph, Span, Team, Workers, now_ns};
use overfly_render_vk::{Backdrop, Picture, Renderer, RendererSettings};
use std::sync::Mutex;
use std::time::Duration;

const SIZE_PX: [u32; 2] = [16, 16];

struct Bench {
    renderer: Renderer,
    view: ViewDraws,
    patches: Patches,
    took_ns: u64,
}

impl Bench {
    /// `None` without a device.
    fn new(count: u32, vertices: VertexPrecision, patch_depth: u8) -> Option<Self> {
        let settings = stage::settings(SIZE_PX, count);
        let settings = RendererSettings { vertices, patch_depth, ..settings };
        let renderer = stage::renderer(&settings)?;
        let mut patches = Patches::new(patch_depth, count);
        let eye = DVec3::X * 6.4e6;
        for diamond in 0..count {
            patches.take(Leaf { diamond, side: 0 });
        }
        for (i, vertex) in (0_u32..).zip(&mut patches.vertices) {
            let aside = DVec3::new(10.0, f64::from(i % 977), f64::from(i % 1009));
            vertex.position = Ecef(eye + aside).two_float();
        }
        let camera = planet::camera(eye, DVec3::ZERO, SIZE_PX, 60.0);
        let slots: Vec<u32> = (0..count).collect();
        let view = stage::draws(camera, &slots, &[0.1]);
        Some(Self { renderer, view, patches, took_ns: 0 })
    }

    /// One picture; the wait for the device is not timed.
    fn draw(&mut self, team: &Team<'_>) {
        let parts = FrameParts::default();
        let backdrop = Backdrop::Colour([0.0; 3]);
        let picture = Picture { backdrop, ..Picture::of(&self.view, &self.patches, &parts) };
        self.renderer.wait().expect("a device that is there");
        let begin_ns = now_ns();
        self.renderer.draw(&picture, team).expect("draws that fit");
        self.took_ns += now_ns() - begin_ns;
    }
}

/// Times `draw` on the caller and `workers` threads beside it.
fn timed(criterion: &mut Criterion, name: &str, workers: usize, bench: Bench, elements: u64) {
    let bench = Mutex::new(bench);
    let threads = Workers::new(workers).expect("two threads");
    let mut graph = Graph::<Mutex<Bench>>::new();
    graph.stage(Span("bench.draw"), &[], |bench, team| {
        bench.lock().expect("no panic before").draw(team);
    });
    let mut run = || graph.run(&bench, &threads).expect("no panic");
    (0..4).for_each(|_| run());
    let mut group = criterion.benchmark_group(name);
    group.throughput(Throughput::Elements(elements));
    group.bench_function(BenchmarkId::from_parameter(format!("{workers} beside")), |bencher| {
        bencher.iter_custom(|times| {
            bench.lock().expect("no panic before").took_ns = 0;
            (0..times).for_each(|_| run());
            Duration::from_nanos(bench.lock().expect("no panic before").took_ns)
        });
    });
    group.finish();
}

fn main() {
    let mut criterion = Criterion::default()
        .sample_size(20)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(4))
        .configure_from_args();
    for workers in [0, 1] {
        for count in [6250, 100_000] {
            let Some(bench) = Bench::new(count, VertexPrecision::TwoFloat, 0) else { return };
            timed(&mut criterion, &format!("record/{count}"), workers, bench, count.into());
        }
        let Some(bench) = Bench::new(6250, VertexPrecision::EyeF64, 4) else { return };
        timed(&mut criterion, "eye_f64/vertices", workers, bench, 6250 * 15);
    }
    criterion.final_summary();
}
