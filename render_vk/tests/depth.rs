//! Surfaces next to each other: which one is seen, in every format and order of depth.
//!
//! In:    pairs of slanted planes that fill the picture, from 0.1 m to 1e7 m away.
//! Out:   the nearer one in every pixel; `OVERFLY_PROBES=1` prints what each setting resolves.
//! Keeps: nothing.
//! Not here: which borders a scene gets (`tests/contracts/depths.rs` of the workspace).
//!
//! Meshes are cut into triangles each in its own way, so that their errors do not cancel.

mod stage;

use glam::{DMat3, DQuat, DVec3};
use overfly_core::camera::{Camera, View};
use overfly_core::geodesy::{Ecef, Ellipsoid, trig};
use overfly_core::inspect::PatchInfo;
use overfly_core::mesh::Patches;
use overfly_core::scene::FrameParts;
use overfly_core::settings::{DepthFormat, DepthOrder, VertexPrecision};
use overfly_core::units::Radians;
use overfly_jobs::Team;
use overfly_render_vk::{Backdrop, Picture, Renderer, RendererSettings, Show};

const SIZE_PX: [u32; 2] = [96, 64];
const NEAR_M: f64 = 0.1;
/// As far as `ranges: Auto` looks at the Earth, and the ratio that it allows a range.
const FAR_M: f64 = 16.0 * 6_378_137.0;
const RATIO: f64 = 300.0;

/// How a pair of planes lies and is cut.
#[derive(Clone, Copy)]
struct Pair {
    /// Squares along a side of the nearer and of the farther plane.
    squares: [u32; 2],
    /// The farthest point of a plane is so many times as far as its nearest.
    slant: f64,
}

/// Two meshes that have nothing to do with each other: the hardest.
const MESHES: Pair = Pair { squares: [7, 5], slant: 5.0 };
/// Two triangles each.
const WHOLE: Pair = Pair { squares: [1, 1], slant: 2.0 };
const NOTHING_ELSE: FrameParts = FrameParts { sun_direction: None, sea: false };

/// An eye on the Earth, turned so that no axis is anything special.
fn camera() -> Camera {
    let eye = DVec3::new(0.8, 0.5, 0.33).normalize() * 6.372e6;
    let forward = DVec3::new(0.3, -0.7, 0.5).normalize();
    let right = forward.cross(eye.normalize()).normalize();
    let axes = DMat3::from_cols(right, right.cross(forward), -forward);
    let view = View {
        eye: Ecef(eye),
        orientation: DQuat::from_mat3(&axes),
        field_of_view: Radians::from_degrees(60.0),
        size_px: SIZE_PX,
        near_m: NEAR_M,
    };
    Camera::new(&view, &Ellipsoid::WGS84)
}

/// A plane a little larger than the picture, `nearest_m` to `slant` times that away.
fn plane(
    camera: &Camera,
    (nearest_m, slant): (f64, f64),
    squares: u32,
    corners: &mut Vec<[DVec3; 3]>,
) {
    let [tan_x, tan_y] = camera.half_tangents;
    let at = |column: u32, row: u32| {
        let [u, v] = [column, row].map(|n| 1.2 * (2.0 * f64::from(n) / f64::from(squares) - 1.0));
        // One over the depth is linear on a plane.
        let t = (0.6 * u + 0.8 * v) / (1.4 * 1.2);
        let depth_m = nearest_m * 2.0 / ((1.0 + 1.0 / slant) + (1.0 - 1.0 / slant) * t);
        let ray = camera.forward + camera.right * (u * tan_x) + camera.up * (v * tan_y);
        camera.eye.0 + ray * depth_m
    };
    for (column, row) in (0..squares).flat_map(|c| (0..squares).map(move |r| (c, r))) {
        let [a, b] = [at(column, row), at(column + 1, row)];
        let [c, d] = [at(column + 1, row + 1), at(column, row + 1)];
        let halves =
            if squares.is_multiple_of(2) { [[a, b, c], [a, c, d]] } else { [[b, c, d], [b, d, a]] };
        corners.extend(halves);
    }
}

/// Two planes, the nearer first; what debug views are told of their slots.
fn planes(camera: &Camera, pair: Pair, nearest_m: f64, apart: f64) -> (Patches, Vec<PatchInfo>) {
    let mut corners = Vec::new();
    plane(camera, (nearest_m, pair.slant), pair.squares[0], &mut corners);
    let near = corners.len();
    plane(camera, (nearest_m * (1.0 + apart), pair.slant), pair.squares[1], &mut corners);
    let mut infos = vec![PatchInfo::default(); near];
    infos.resize(corners.len(), PatchInfo { level: 1, ..PatchInfo::default() });
    (stage::triangles(&corners), infos)
}

/// Pixels in which the nearer plane is not seen, whichever of both is drawn first.
fn wrong(
    renderer: &mut Renderer,
    borders_m: &[f64],
    pair: Pair,
    (nearest_m, apart): (f64, f64),
) -> usize {
    let camera = camera();
    let (patches, infos) = planes(&camera, pair, nearest_m, apart);
    let mut slots: Vec<u32> = (0..patches.used_end()).collect();
    renderer.note_built(&slots);
    let mut wrong = 0;
    for _ in 0..2 {
        let view = stage::draws(camera, &slots, borders_m);
        let picture = Picture {
            show: Show::Level,
            infos: &infos,
            backdrop: Backdrop::Colour(stage::MAGENTA),
            ..Picture::of(&view, &patches, &NOTHING_ELSE)
        };
        renderer.draw(&picture, &Team::alone()).unwrap();
        // The nearer is blue, the farther red, holes are both.
        let pixels = renderer.read_pixels().unwrap();
        let nearer = |p: &[u8]| p[2] > p[0] && p[2] < 255;
        wrong += pixels.chunks_exact(4).filter(|p| !nearer(p)).count();
        slots.reverse();
    }
    wrong
}

/// Rising distances with `steps` to a decade.
fn distances(from_m: f64, to_m: f64, steps: u32) -> impl Iterator<Item = f64> {
    let ln_step = trig::ln(10.0) / f64::from(steps);
    (0..)
        .map(move |i| from_m * trig::exp(ln_step * f64::from(i)))
        .take_while(move |&d| d <= to_m * 1.000_001)
}

/// Near borders of as many ranges as `ranges: Auto` takes.
fn auto(format: DepthFormat, order: DepthOrder) -> Vec<f64> {
    if (format, order) == (DepthFormat::D32F, DepthOrder::Reversed) {
        return vec![NEAR_M];
    }
    let ln_all = trig::ln(FAR_M / NEAR_M);
    let ranges = (1_u32..).find(|&n| ln_all / f64::from(n) <= trig::ln(RATIO)).unwrap();
    let step = ln_all / f64::from(ranges);
    (0..ranges).map(|i| NEAR_M * trig::exp(step * f64::from(i))).collect()
}

fn with(format: DepthFormat, order: DepthOrder, vertices: VertexPrecision) -> RendererSettings {
    let patches_max = MESHES.squares.map(|n| 2 * n * n).iter().sum();
    RendererSettings {
        depth_format: format,
        depth_order: order,
        vertices,
        ..stage::settings(SIZE_PX, patches_max)
    }
}

const PRECISIONS: [VertexPrecision; 2] = [VertexPrecision::TwoFloat, VertexPrecision::EyeF64];

/// With the borders of `Auto`, planes 1e-4 of their distance apart never fight.
fn never_fight(format: DepthFormat, order: DepthOrder) {
    let borders_m = auto(format, order);
    for vertices in PRECISIONS {
        let Some(mut renderer) = stage::renderer(&with(format, order, vertices)) else { return };
        for nearest_m in distances(NEAR_M, 1e7, 3) {
            let wrong = wrong(&mut renderer, &borders_m, MESHES, (nearest_m, 1e-4));
            assert_eq!(wrong, 0, "pixels wrong at {nearest_m} m, {vertices:?}, {borders_m:?}");
        }
    }
}

#[test]
fn auto_ranges_keep_surfaces_1e_4_apart_from_0_1_m_to_1e7_m_in_d24_forward() {
    assert_eq!(auto(DepthFormat::D24, DepthOrder::Forward).len(), 4);
    never_fight(DepthFormat::D24, DepthOrder::Forward);
}

#[test]
fn auto_ranges_keep_surfaces_1e_4_apart_from_0_1_m_to_1e7_m_in_d24_reversed() {
    never_fight(DepthFormat::D24, DepthOrder::Reversed);
}

#[test]
fn auto_ranges_keep_surfaces_1e_4_apart_from_0_1_m_to_1e7_m_in_d32f_forward() {
    never_fight(DepthFormat::D32F, DepthOrder::Forward);
}

fn one_reversed_float_range_keeps(pair: Pair, apart: f64) {
    for vertices in PRECISIONS {
        let settings = with(DepthFormat::D32F, DepthOrder::Reversed, vertices);
        let Some(mut renderer) = stage::renderer(&settings) else { return };
        for nearest_m in distances(10.0, 1e7, 5) {
            let wrong = wrong(&mut renderer, &[NEAR_M], pair, (nearest_m, apart));
            assert_eq!(wrong, 0, "pixels wrong at {nearest_m} m, {vertices:?}");
        }
    }
}

#[test]
fn one_reversed_float_range_keeps_planes_5e_7_apart_from_10_m_to_1e7_m() {
    one_reversed_float_range_keeps(WHOLE, 5e-7);
}

/// Numbers of a float are up to 1.2e-7 apart, and each mesh rounds its corners its own way.
#[test]
fn one_reversed_float_range_keeps_any_two_meshes_1e_6_apart_from_10_m_to_1e7_m() {
    one_reversed_float_range_keeps(MESHES, 1e-6);
}

/// Otherwise the tests above would see nothing.
#[test]
fn fighting_is_seen_where_it_must_be() {
    for order in [DepthOrder::Forward, DepthOrder::Reversed] {
        let settings = with(DepthFormat::D24, order, VertexPrecision::TwoFloat);
        let Some(mut renderer) = stage::renderer(&settings) else { return };
        let found = wrong(&mut renderer, &[NEAR_M], MESHES, (1e5, 1e-4));
        assert!(found > 1000, "only {found} pixels fight in one range of D24 {order:?}");
    }
    let settings = with(DepthFormat::D32F, DepthOrder::Reversed, VertexPrecision::TwoFloat);
    let Some(mut renderer) = stage::renderer(&settings) else { return };
    let found = wrong(&mut renderer, &[NEAR_M], WHOLE, (1e5, 1e-8));
    assert!(found > 100, "only {found} pixels fight at 1e-8");
}

#[test]
fn what_each_setting_resolves_is_printed_on_request() {
    if std::env::var_os("OVERFLY_PROBES").is_none() {
        println!("skipped: set OVERFLY_PROBES=1");
        return;
    }
    println!("from {NEAR_M} m on by tens: the smallest separation with every pixel right");
    let formats = [DepthFormat::D32F, DepthFormat::D24].into_iter();
    let settings =
        formats.flat_map(|f| [DepthOrder::Reversed, DepthOrder::Forward].map(|order| (f, order)));
    for (format, order) in settings {
        let settings = with(format, order, VertexPrecision::EyeF64);
        let Some(mut renderer) = stage::renderer(&settings) else { return };
        let borders_m = auto(format, order);
        for (name, pair) in [("meshes", MESHES), ("planes", WHOLE)] {
            let row: Vec<String> = distances(NEAR_M, 1e7, 1)
                .map(|d| format!("{:.0e}", resolved(&mut renderer, &borders_m, pair, d)))
                .collect();
            println!("{name}, {format:?} {order:?}: {}", row.join(" "));
        }
    }
}

/// The smallest tried separation such that it and all larger ones show no wrong pixel.
fn resolved(renderer: &mut Renderer, borders_m: &[f64], pair: Pair, nearest_m: f64) -> f64 {
    let decades = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8];
    let tried = decades.iter().flat_map(|decade| [7.0, 5.0, 3.0, 2.0, 1.0].map(|n| n * decade));
    let mut smallest = 1e-2;
    for apart in tried {
        if wrong(renderer, borders_m, pair, (nearest_m, apart)) > 0 {
            break;
        }
        smallest = apart;
    }
    smallest
}
