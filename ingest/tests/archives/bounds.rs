//! Bounds: what pages promise of everything finer, hunted for violations.
//!
//! In:    archives of rugged ground, voids, coasts, edges; scenes of all patch depths.
//! Out:   pass, or the worst violations.
//! Keeps: nothing.
//! Not here: that heights agree between pages (`pages`).

use crate::atlas::{Atlas, EARTH, Scene, at, build, even, place_at, point_in, unit};
use crate::rasters::{Sheet, VOID, options, rugged_m, world_m};
use crate::shared_data;
use crate::tiff_file::Number;
use overfly_core::datasource::facts::Datum;
use overfly_core::datasource::{PAGE_SIDE, Page, PageKey};
use overfly_core::geodesy::Geodetic;
use overfly_core::ground::{Ground, LEVEL_BOUNDED, Place, Query, Region};
use overfly_core::lattice::unfold;
use std::fmt::Write;
use std::path::Path;

/// Levels looked at below the last one of the data.
const BEYOND: u8 = 4;
/// Pages keep heights as f32: near 8 km they are rounded to 0.25 mm, on both sides of a bound.
const ROUNDING_M: f64 = 6e-4;

/// What was promised and not held.
#[derive(Default)]
struct Hunt {
    looked: u64,
    broken: u64,
    /// The greatest part of a bound that was used up.
    used: f64,
    worst_m: f64,
    story: String,
}

impl Hunt {
    fn look(&mut self, off_m: f64, bound_m: f64, story: impl Fn() -> String) {
        self.looked += 1;
        if bound_m > 0.0 {
            self.used = self.used.max(off_m / (bound_m + ROUNDING_M));
        }
        let beyond_m = off_m - bound_m - ROUNDING_M;
        // NaN must not pass.
        if beyond_m <= 0.0 {
            return;
        }
        self.broken += 1;
        if beyond_m > self.worst_m || self.story.is_empty() {
            self.worst_m = beyond_m;
            self.story.clear();
            let _ = write!(self.story, "off {off_m:.4} m, bound {bound_m:.4} m: {}", story());
        }
    }

    /// What is wrong, if anything is.
    fn verdict(&self, name: &str) -> Option<String> {
        let Self { broken, looked, worst_m, story, used } = self;
        eprintln!("{name}: {looked} looked at, {used:.3} used, {broken} broken");
        assert!(*looked > 1000, "{name}: only {looked} looked at");
        (*broken > 0)
            .then(|| format!("{name}: {broken} of {looked} broken, by {worst_m:.4} m: {story}"))
    }
}

/// Points of a page: some of its samples, where surfaces bend, and some anywhere.
fn points(key: PageKey, seed: u64) -> impl Iterator<Item = glam::IVec3> {
    (0..12_u64).map(move |k| {
        let random = |i: u64| unit(seed ^ key.bits() ^ (k << 40 | i << 50));
        if k % 3 == 2 {
            return point_in(key, [random(0), random(1)].map(|share| 0.002 + 0.996 * share));
        }
        let last = (PAGE_SIDE - 2) as f64;
        let [i, j] = [random(0), random(1)].map(|share| 1 + (share * last) as usize);
        key.sample(i, j)
    })
}

/// Looks at all levels of the pages around a place.
fn hunt_at(atlas: &Atlas, site: Geodetic, depth_max: u8, hunts: &mut [Hunt; 3]) {
    let place = Place::of(site.normal());
    let mut roots = atlas.bare();
    (0..4).for_each(|quadrant| drop(roots.insert(atlas.page(PageKey::root(quadrant)))));
    let mut grounds = vec![roots];
    for depth in 1..=depth_max {
        let mut ground = grounds[grounds.len() - 1].clone();
        ground.insert(atlas.page(place.page(depth)));
        grounds.push(ground);
        let key = place.page(depth);
        points(key, 7).for_each(|point| hunt_point(&grounds, place_at(point), hunts));
        variation_within(&atlas.page(key), leaf_cells(atlas), &mut hunts[2]);
        (0..depth).for_each(|above| variation(atlas, key, place.page(above), &mut hunts[2]));
    }
}

/// The finest ground at a place against all coarser levels, and against the ranges that grounds
/// of fewer pages give.
fn hunt_point(grounds: &[Ground], there: Geodetic, [bounds, ranges, _]: &mut [Hunt; 3]) {
    let (ground, coarser) = grounds.split_last().unwrap();
    let finest = even(u8::try_from(coarser.len()).unwrap());
    let Some(fine) = ground.height(there, Query::Exact(finest)).ok() else { return };
    for level in LEVEL_BOUNDED..finest {
        let coarse = ground.height(there, Query::Exact(level)).ok().unwrap();
        let off_m = (coarse.height_m - fine.height_m).abs();
        let story = || format!("level {level} at {there:?} {fine:?}");
        bounds.look(off_m, coarse.bound_m, story);
    }
    for (depth, ground) in coarser.iter().enumerate() {
        let range = ground.min_max(Region { centre: there, radius_m: 0.0 }).ok().unwrap();
        let off_m = (range.low_m - fine.height_m).max(fine.height_m - range.high_m);
        let story = || format!("depth {depth}, {range:?} at {there:?} {fine:?}");
        ranges.look(off_m.max(0.0), 0.0, story);
    }
}

/// Cells that a leaf drawn from a page's samples has along a side: its descendants reach farther.
fn leaf_cells(atlas: &Atlas) -> usize {
    1 << (atlas.scene.patch_depth / 2).min(2)
}

/// Samples of a page, and of a fine one within it, against the variation that is stated there.
fn variation(atlas: &Atlas, fine: PageKey, coarse: PageKey, hunt: &mut Hunt) {
    let (fine_page, coarse_page) = (atlas.page(fine), atlas.page(coarse));
    let reach = i32::try_from(leaf_cells(atlas)).unwrap();
    for at in 0..16_u64 {
        let random = |i: u64| unit(fine.bits() ^ (at << 33 | i << 44 | 5));
        let [i, j] = [0, 1].map(|axis| (random(axis) * PAGE_SIDE as f64) as usize);
        let point = fine.sample(i, j);
        let (u, v) = unfold(coarse.quadrant(), point);
        let (u0, v0) = coarse.origin();
        let near = |along: i32, axis: u64| {
            // From as far before the cell to as far behind it as makes `reach` cells in all.
            let shift = (random(axis) * f64::from(2 * reach)) as i32 - reach + 1;
            usize::try_from((along / coarse.step() + shift).clamp(0, 64)).unwrap()
        };
        let (a, b) = (near(u - u0, 2), near(v - v0, 3));
        let bound_m = coarse_page.bound_at(coarse.sample(a, b)).variation_m;
        let fine_m = f64::from(fine_page.heights_m[j * PAGE_SIDE + i]);
        let coarse_m = f64::from(coarse_page.heights_m[b * PAGE_SIDE + a]);
        hunt.look((fine_m - coarse_m).abs(), f64::from(bound_m), || {
            format!("variation: {coarse:?} sample {a} {b} {coarse_m} of {fine:?} {i} {j} {fine_m}")
        });
    }
}

/// Samples of a page against all as far from them as a leaf is wide.
fn variation_within(page: &Page, reach: usize, hunt: &mut Hunt) {
    let places = (0..PAGE_SIDE).flat_map(|j| (0..PAGE_SIDE).map(move |i| (i, j)));
    for (i, j) in places.filter(|(i, j)| (i + j) % 2 == 0) {
        let bound_m = f64::from(page.bound_at(page.key.sample(i, j)).variation_m);
        let own_m = f64::from(page.heights_m[j * PAGE_SIDE + i]);
        let beside = [(i + reach, j), (i, j + reach), (i + reach, j + reach)];
        for (a, b) in beside.into_iter().filter(|&(a, b)| a < PAGE_SIDE && b < PAGE_SIDE) {
            let other_m = f64::from(page.heights_m[b * PAGE_SIDE + a]);
            hunt.look((own_m - other_m).abs(), bound_m, || {
                format!("variation: {:?} samples {i} {j} {own_m}, {a} {b} {other_m}", page.key)
            });
        }
    }
}

fn hunt(name: &str, archives: &[&Path], scene: Scene, sites: &[Geodetic]) {
    let mut failures = Vec::new();
    for patch_depth in [0, 4, 8] {
        let atlas = Atlas::open(archives, Scene { patch_depth, ..scene });
        let mut hunts = <[Hunt; 3]>::default();
        for &site in sites {
            hunt_at(&atlas, site, atlas.depth() + BEYOND, &mut hunts);
        }
        for (hunt, what) in hunts.iter().zip(["bound", "min_max", "variation"]) {
            let name = format!("{name}, patch depth {patch_depth}, {what}");
            failures.extend(hunt.verdict(&name));
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

/// Sites in a box of degrees.
fn sites(count: u64, [west, south, east, north]: [f64; 4]) -> Vec<Geodetic> {
    let site = |i: u64| {
        let [a, b] = [unit(i * 2 + 11), unit(i * 2 + 12)];
        at(south + (north - south) * a, west + (east - west) * b)
    };
    (0..count).map(site).collect()
}

/// A quarter of a degree of rugged 9″ ground.
const RUGGED: Sheet = Sheet { first_deg: [10.0, 46.25], step_deg: [0.0025; 2], size: [101, 101] };

#[test]
fn bounds_hold_on_rugged_ground_its_edge_and_the_planet_around_it() {
    let folder = tempfile::tempdir().unwrap();
    let input = RUGGED.write_whole(&folder.path().join("a.tif"), rugged_m);
    let output = folder.path().join("a.pmtiles");
    build(&options(&[input], &output)).unwrap();
    // The blend is 8 postings or 0.02° wide.
    let mut all = sites(12, [10.0, 46.0, 10.25, 46.25]);
    all.extend(sites(6, [10.25, 46.0, 10.28, 46.25]));
    all.extend(sites(6, [10.0, 45.97, 10.25, 46.0]));
    all.extend(sites(6, [9.9, 45.9, 10.4, 46.4]));
    hunt("rugged", &[&output], EARTH, &all);
}

#[test]
fn bounds_hold_without_a_planet_without_a_sea_and_with_strong_detail() {
    let folder = tempfile::tempdir().unwrap();
    let input = RUGGED.write_whole(&folder.path().join("a.tif"), rugged_m);
    let output = folder.path().join("a.pmtiles");
    build(&options(&[input], &output)).unwrap();
    let all = sites(8, [9.98, 45.98, 10.27, 46.27]);
    hunt("alone", &[&output], Scene { detail: None, ..EARTH }, &all);
    hunt("alone and dry", &[&output], Scene { detail: None, sea: false, ..EARTH }, &all);
    hunt("detail 10", &[&output], Scene { detail: Some(10.0), ..EARTH }, &all);
    hunt("detail 0", &[&output], Scene { detail: Some(0.0), sea: false, ..EARTH }, &all);
}

#[test]
fn bounds_hold_where_islands_stand_beside_deeps() {
    let folder = tempfile::tempdir().unwrap();
    // What lies between is far from both: no mark of a page is as low or as high as its reach.
    let spiky = |lon: f64, lat: f64| {
        let cell = |deg: f64| (deg * 133.4).round() as u64;
        let rolled = unit(cell(lon) << 20 | cell(lat));
        let middle = [lon, lat].iter().all(|deg| (deg * 133.4 - (deg * 133.4).round()).abs() < 0.2);
        match rolled {
            low if middle && low < 0.2 => -600.0,
            high if middle && high > 0.8 => 400.0,
            _ => -100.0,
        }
    };
    let input = RUGGED.write_whole(&folder.path().join("a.tif"), spiky);
    let output = folder.path().join("a.pmtiles");
    build(&options(&[input], &output)).unwrap();
    hunt("islands", &[&output], EARTH, &sites(40, [10.02, 46.02, 10.23, 46.23]));
}

#[test]
fn bounds_hold_around_voids() {
    let folder = tempfile::tempdir().unwrap();
    let ragged = |lon: f64, lat: f64| {
        let wide = (lon - 10.1).abs() < 0.05 && (lat - 46.1).abs() < 0.04;
        let speck = unit((lon * 4e5) as u64 ^ ((lat * 4e5) as u64) << 30) < 0.05;
        if wide || speck { VOID } else { rugged_m(lon, lat) }
    };
    let input = RUGGED.write_whole(&folder.path().join("a.tif"), ragged);
    let output = folder.path().join("a.pmtiles");
    build(&options(&[input], &output)).unwrap();
    hunt("voids", &[&output], EARTH, &sites(16, [10.03, 46.04, 10.17, 46.16]));
}

#[test]
fn bounds_hold_where_a_fine_inset_lies_in_a_world() {
    let folder = tempfile::tempdir().unwrap();
    let world = Sheet::world(2.0).write_whole(&folder.path().join("w.tif"), world_m);
    let inset = Sheet::new([20.0, 10.0], 0.025, [81, 81]);
    let inset = inset.write(&folder.path().join("i.tif"), Number::F32, rugged_m);
    let output = folder.path().join("a.pmtiles");
    build(&options(&[world, inset], &output)).unwrap();
    let mut all = sites(10, [19.5, 7.5, 22.5, 10.5]);
    all.extend(sites(6, [-180.0, -90.0, 180.0, 90.0]));
    all.extend([at(90.0, 0.0), at(-90.0, 30.0), at(3.0, 180.0), at(0.0, 90.0)]);
    hunt("inset", &[&output], EARTH, &all);
}

#[test]
fn bounds_hold_where_one_archive_lies_over_another() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let world = Sheet::world(2.0).write_whole(&path("w.tif"), world_m);
    let inset = RUGGED.write_whole(&path("i.tif"), |lon, lat| rugged_m(lon, lat) + 3000.0);
    build(&options(&[world], &path("w.pmtiles"))).unwrap();
    build(&options(&[inset], &path("i.pmtiles"))).unwrap();
    let all = sites(14, [9.95, 45.95, 10.3, 46.3]);
    hunt("stacked", &[&path("i.pmtiles"), &path("w.pmtiles")], EARTH, &all);
}

#[test]
fn bounds_hold_where_a_raster_reaches_over_many_latitudes() {
    let folder = tempfile::tempdir().unwrap();
    // Its eastern edge converges: the blend is far narrower in the north than in the middle.
    let tall = Sheet::new([0.0, 84.0], 0.5, [61, 169]);
    let input = tall.write_whole(&folder.path().join("a.tif"), |_, _| 3000.0);
    let output = folder.path().join("a.pmtiles");
    build(&options(&[input], &output)).unwrap();
    let mut all = sites(12, [30.0, 70.0, 40.0, 84.0]);
    all.extend(sites(6, [-10.0, 76.0, 0.0, 84.0]));
    hunt("tall", &[&output], Scene { detail: None, sea: false, ..EARTH }, &all);
}

#[test]
fn bounds_hold_where_a_sector_ends_at_the_pole() {
    let folder = tempfile::tempdir().unwrap();
    let sector = Sheet::new([0.0, 90.0], 0.25, [241, 81]);
    let input = sector.write_whole(&folder.path().join("a.tif"), |_, _| 3000.0);
    let output = folder.path().join("a.pmtiles");
    build(&options(&[input], &output)).unwrap();
    let mut all = sites(10, [-20.0, 88.0, 80.0, 90.0]);
    all.push(at(90.0, 0.0));
    hunt("sector", &[&output], Scene { detail: None, sea: false, ..EARTH }, &all);
}

#[test]
fn bounds_hold_with_a_geoid() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("g.gtx");
    let node = |at: usize| if (at / 91) % 2 == at % 2 { 80.0 } else { -60.0 };
    std::fs::write(&path, crate::layers::gtx([-90.0, -180.0, 4.0, 4.0], [46, 91], node)).unwrap();
    let input =
        RUGGED.write_whole(&folder.path().join("a.tif"), |lon, lat| rugged_m(lon, lat) - 900.0);
    let output = folder.path().join("a.pmtiles");
    let built = options(&[input], &output);
    build(&overfly_ingest::BuildOptions { datum: Datum::Egm96, geoid: Some(path), ..built })
        .unwrap();
    hunt("geoid", &[&output], EARTH, &sites(12, [9.97, 45.97, 10.28, 46.28]));
}

#[test]
fn bounds_hold_on_real_mountains_and_coasts() {
    let name = "bounds_hold_on_real_mountains_and_coasts";
    let Some(data) = shared_data(name) else { return };
    let folder = tempfile::tempdir().unwrap();
    let files = if cfg!(debug_assertions) {
        vec![("N43E007.hgt.zip", [7.0, 43.4, 7.6, 44.02])]
    } else {
        vec![
            ("N43E007.hgt.zip", [7.0, 43.4, 7.6, 44.02]),
            ("mt_rainier_90m.tif", [-122.02, 45.98, -120.98, 47.02]),
            ("mt_fuji_90m.tif", [137.98, 34.98, 139.02, 36.02]),
        ]
    };
    for (file, area) in files {
        let output = folder.path().join("a.pmtiles");
        let built = options(&[data.join("dem").join(file)], &output);
        let geoid = Some(data.join("dem/egm96_15.gtx"));
        build(&overfly_ingest::BuildOptions { datum: Datum::Egm96, geoid, ..built }).unwrap();
        hunt(file, &[&output], EARTH, &sites(24, area));
    }
}
