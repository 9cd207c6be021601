//! The real files against the facts of their manifest.
//!
//! In:    `../shared/data/dem`.
//! Out:   pass or fail, or a line that it was skipped.
//! Keeps: nothing.
//! Not here: the geoid's grid (`geoid`).

use crate::shared_data;
use overfly_ingest::raster::{OpenOptions, Raster, open};

/// Lowest, highest and voids, read in windows that fit no chunk.
fn facts(raster: &Raster) -> (f32, f32, usize) {
    let (mut least, mut most, mut voids) = (f32::INFINITY, f32::NEG_INFINITY, 0);
    let (columns, rows) = (i64::from(raster.grid.columns), i64::from(raster.grid.rows));
    let mut out = Vec::new();
    for y in (0..rows).step_by(331) {
        for x in (0..columns).step_by(467) {
            let (width, height) = ((columns - x).min(467) as usize, (rows - y).min(331) as usize);
            raster.window(x, y, width, height, &mut out).unwrap();
            voids += out.iter().filter(|height| height.is_nan()).count();
            least = out.iter().fold(least, |least, height| least.min(*height));
            most = out.iter().fold(most, |most, height| most.max(*height));
        }
    }
    (least, most, voids)
}

/// West, south, east and north edge of the outermost postings, in degrees.
fn corners(raster: &Raster) -> [f64; 4] {
    let grid = &raster.grid;
    let [columns, rows] = [grid.columns, grid.rows].map(|count| f64::from(count - 1));
    let [west, north] = grid.origin;
    [west, north + rows * grid.step[1], west + columns * grid.step[0], north]
}

#[test]
fn the_real_files_have_the_manifests_heights_voids_and_corners() {
    let Some(data) = shared_data("the_real_files_have_the_manifests_heights_voids_and_corners")
    else {
        return;
    };
    let (third, quarter) = (1.0 / 6.0, 0.125);
    let files = [
        ("mt_rainier_90m.tif", (263.0, 4371.0, 9033), [-122.0, 46.0, -121.0, 47.0]),
        ("mt_fuji_90m.tif", (-16.0, 3742.0, 2437), [138.0, 35.0, 139.0, 36.0]),
        ("N43E007.hgt.zip", (-11.0, 2064.0, 1595), [7.0, 43.0, 8.0, 44.0]),
        ("N48W125.hgt.zip", (-13.0, 1095.0, 6_483_876), [-125.0, 48.0, -124.0, 49.0]),
        (
            "etopo20_1080x540_i16.tif",
            (-9027.0, 6229.0, 0),
            [-180.0 + third, -90.0 + third, 180.0 - third, 90.0 - third],
        ),
        (
            "mars_mola_1440x720_i16.tif",
            (-8068.0, 21134.0, 0),
            [-180.0 + quarter, -90.0 + quarter, 180.0 - quarter, 90.0 - quarter],
        ),
    ];
    for (name, wanted, edges) in files {
        let rasters = open(&data.join("dem").join(name), &OpenOptions::default()).unwrap();
        assert_eq!(facts(&rasters[0]), wanted, "{name}");
        for (found, edge) in corners(&rasters[0]).into_iter().zip(edges) {
            assert!((found - edge).abs() < 1e-6, "{name}: {found} {edge}");
        }
        let round = name.starts_with("etopo") || name.starts_with("mars");
        assert_eq!(rasters[0].grid.wraps, round, "{name}");
    }
}

#[test]
fn neighbouring_srtm_tiles_agree_along_their_common_edge() {
    let Some(data) = shared_data("neighbouring_srtm_tiles_agree_along_their_common_edge") else {
        return;
    };
    let options = OpenOptions::default();
    let tile = |name: &str| open(&data.join("dem").join(name), &options).unwrap().pop().unwrap();
    let (south, north) = (tile("N49E011.hgt.zip"), tile("N50E011.hgt.zip"));
    let (mut upper, mut lower) = (Vec::new(), Vec::new());
    north.window(0, 1200, 1201, 1, &mut upper).unwrap();
    south.window(0, 0, 1201, 1, &mut lower).unwrap();
    assert_eq!(upper, lower);
    let least = facts(&south).0.min(facts(&north).0);
    let most = facts(&south).1.max(facts(&north).1);
    let voids = facts(&south).2 + facts(&north).2;
    assert_eq!((least, most, voids), (129.0, 1044.0, 28));
}

#[test]
fn the_summit_of_rainier_is_where_it_is() {
    let Some(data) = shared_data("the_summit_of_rainier_is_where_it_is") else { return };
    let path = data.join("dem/mt_rainier_90m.tif");
    let raster = open(&path, &OpenOptions::default()).unwrap().pop().unwrap();
    let place = raster.grid.place((-121.7603_f64).to_radians(), 46.8523_f64.to_radians()).unwrap();
    let [column, row] = place.map(|at| at.round() as i64);
    let mut out = Vec::new();
    raster.window(column, row, 1, 1, &mut out).unwrap();
    // Survey: 4392 m. The grid's posting next to it has 4370, the highest of all 4371.
    assert_eq!(out, [4370.0]);
}
