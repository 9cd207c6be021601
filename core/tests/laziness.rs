//! Judging only what is due gives the mesh of judging everything: every frame, whatever happens.
//!
//! In:    flights: straight, turning, jumping, zooming, with pages late; budgets and tolerances.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: the surface's own rules (`surface`), times (`benches`).

mod rig;

use overfly_core::camera::View;
use overfly_core::digest::mix;
use overfly_core::geodesy::{Ellipsoid, Geodetic};
use overfly_core::settings::SceneSettings;
use overfly_core::units::Radians;
use rig::{Rig, scene, view};

const EARTH: Ellipsoid = Ellipsoid::WGS84;

fn at(lat_deg: f64, lon_deg: f64, height_m: f64) -> Geodetic {
    Geodetic::from_degrees(lat_deg, lon_deg, height_m)
}

/// Flies both ways side by side and compares every frame. Returns the diamonds judged by each.
fn side_by_side(
    settings: &SceneSettings,
    frames: u64,
    mut views_of: impl FnMut(u64) -> Vec<View>,
    mut lets: impl FnMut(u64, usize) -> bool,
) -> [u64; 2] {
    let mut lazy = Rig::new(settings, 0);
    let mut all = Rig::new(settings, 0);
    all.terrain.judge_all(true);
    let mut judged = [0, 0];
    for frame in 0..frames {
        let views = views_of(frame);
        lazy.frame(&views, |page| lets(frame, page));
        all.frame(&views, |page| lets(frame, page));
        let (a, b) = (&lazy.output, &all.output);
        judged[0] += u64::from(a.counts.evaluations);
        judged[1] += u64::from(b.counts.evaluations);
        assert_eq!(a.digest, b.digest, "frame {frame}: {:?}\n{:?}", a.counts, b.counts);
        assert_eq!(a.wanted, b.wanted, "frame {frame}");
        let work = |rig: &Rig| {
            let counts = &rig.output.counts;
            (counts.splits, counts.merges, counts.blocked, counts.leaves)
        };
        assert_eq!(work(&lazy), work(&all), "frame {frame}");
        if frame % 64 == 63 {
            lazy.audit();
        }
    }
    judged
}

#[test]
fn a_straight_flight_in_the_budget() {
    for (patch_depth, budget) in [(0, 20_000), (4, 60_000)] {
        let settings = scene(patch_depth, budget);
        let views = |frame: u64| {
            let lon = -121.8 + 2e-4 * frame as f64;
            vec![view(&EARTH, at(46.8, lon, 3_000.0), 80.0, -8.0)]
        };
        let [lazy, all] = side_by_side(&settings, 300, views, |_, _| true);
        println!("k = {patch_depth}: {lazy} judged instead of {all}");
        assert!(lazy * 4 < all, "{lazy} of {all}");
    }
}
