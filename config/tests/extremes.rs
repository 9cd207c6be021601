//! Scene files at and beyond their ends: each refusal is a line that names the value and the range.
//!
//! In:    scene texts with one wrong setting; scenes at the ends of all ranges.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: other faults of files (`scenes`), what extreme scenes look like (`core/tests/extremes`).

use overfly_config::read;
use overfly_core::limits::{Limits, check};
use overfly_core::settings::SceneSettings;

fn settings(text: &str) -> SceneSettings {
    read(text, "scene.ron").unwrap_or_else(|faults| panic!("{faults}\nin {text}"))
}

/// The one fault of a text, without file and place.
fn fault_of(text: &str) -> String {
    let Err(faults) = read(text, "scene.ron") else { panic!("no fault in {text}") };
    assert_eq!(faults.faults.len(), 1, "{faults}");
    let fault = &faults.faults[0];
    format!("{}: {}", fault.path, fault.what)
}

/// A setting must be refused for each of these values, by name, value and range.
fn refused(field: &str, around: [&str; 2], values: &[&str], allowed: &str) {
    for value in values {
        let [before, after] = around;
        let found = fault_of(&format!("Scene({before}{value}{after})"));
        assert_eq!(found, format!("{field}: is {value}, allowed is {allowed}"));
    }
}

#[test]
fn case_18_lenses_of_180_degrees_0_less_and_none_are_refused() {
    refused(
        "views[0].field_of_view_deg",
        ["body: Moon, views: [(field_of_view_deg: ", ")]"],
        &["180", "179.5", "0", "-60", "0.005", "NaN", "inf", "-inf", "1e-310"],
        "0.01 to 179",
    );
    for degrees in ["0.01", "179"] {
        settings(&format!("Scene(body: Moon, views: [(field_of_view_deg: {degrees})])"));
    }
}

#[test]
fn case_13_numbers_that_are_none_are_refused_wherever_they_stand() {
    let none = ["NaN", "inf", "-inf", "1e999"];
    for (field, before, after, allowed) in [
        ("views[0].near_m", "body: Moon, views: [(near_m: ", ")]", "0.001 to 1000000"),
        ("views[0].yaw_deg", "body: Moon, views: [(yaw_deg: ", ")]", "-360 to 360"),
        ("views[0].pitch_deg", "body: Moon, views: [(pitch_deg: ", ")]", "-90 to 90"),
        ("lod.morph_s", "body: Moon, lod: (morph_s: ", ")", "0 to 10"),
        ("sources[0].relief", "body: Moon, sources: [Procedural(relief: ", ")]", "0 to 10"),
        (
            "sources[0].finest_m",
            "body: Moon, sources: [Procedural(finest_m: ",
            ")]",
            "0.01 to 1000",
        ),
        ("body.f", "body: Ellipsoid(a_m: 1e6, f: ", ")", "-0.5 to 0.5"),
    ] {
        refused(field, [before, after], &none, allowed);
    }
}

/// The procedural planet that every scene file has, or gets, is made for these radii; bodies of 1 m
/// to 1e12 m are for hosts that bring ground of their own.
#[test]
fn case_19_radii_without_a_procedural_planet_are_refused() {
    refused(
        "body.radius_m",
        ["body: Sphere(radius_m: ", ")"],
        &["0", "-1", "1", "499.9", "1e12", "1000000001", "NaN", "inf"],
        "500 to 1000000000",
    );
}

/// Heights of the procedural planet stay far from its centre: no relief that a file may ask for
/// digs that deep on the least body.
#[test]
fn case_22_no_scene_file_digs_to_the_centre_of_its_body() {
    use overfly_core::datasource::generate::Generator;
    use overfly_core::limits::check_surface;
    for style in ["Earthlike", "Cratered"] {
        for body in ["Sphere(radius_m: 500)", "Sphere(radius_m: 1e9)", "Wgs84"] {
            let source = format!("Procedural(style: {style}, relief: 10)");
            let scene = settings(&format!("Scene(body: {body}, sources: [{source}])"));
            let range_m = Generator::new(&scene).surface_range_m();
            assert_eq!(check_surface(&scene, range_m), Ok(()), "{style} on {body}: {range_m:?}");
        }
    }
}

#[test]
fn case_32_to_34_budgets_of_0_to_u64_max_are_refused_beyond_what_there_is() {
    let beyond =
        ["0", "1", "7", "16000001", "2147483648", "4294967295", "18446744073709551615", "-1"];
    let around = ["body: Moon, lod: (patch_depth: 0, triangles_max: ", ")"];
    refused("lod.triangles_max", around, &beyond, "8 to 16000000");
    let counts = ["0", "65537", "4294967295", "18446744073709551615"];
    for name in ["splits_max", "merges_max"] {
        let before = format!("body: Moon, lod: ({name}: ");
        refused(&format!("lod.{name}"), [&before, ")"], &counts, "1 to 65536");
    }
    let around = ["body: Moon, lod: (wanted_max: ", ")"];
    refused("lod.wanted_max", around, &["0", "4097", "18446744073709551615"], "1 to 4096");
    let around = ["body: Moon, memory: (pages_mib: ", ")"];
    let mib = ["0", "3", "65537", "18446744073709551615"];
    refused("memory.pages_mib", around, &mib, "4 to 65536");
    let least = "Scene(body: Moon, lod: (patch_depth: 0, triangles_max: 8))";
    assert_eq!(Limits::of(&settings(least)).leaves, 8);
}

#[test]
fn case_35_levels_beyond_the_lattice_are_refused() {
    let around = ["body: Moon, lod: (patch_depth: 0, level_max: ", ")"];
    refused("lod.level_max", around, &["57", "60", "255", "-1"], "0 to 56");
    for level_max in [0, 56] {
        let text = format!("Scene(body: Moon, lod: (patch_depth: 0, level_max: {level_max}))");
        assert_eq!(settings(&text).lod.level_max, level_max);
    }
}

/// A file must ask for some error; only a host's literal may have a tolerance of 0 or infinity.
#[test]
fn case_36_tolerances_of_0_infinity_and_nan_are_refused() {
    refused(
        "lod.tolerance_px",
        ["body: Moon, lod: (tolerance_px: ", ")"],
        &["0", "0.009", "-1", "NaN", "inf", "-inf", "1000001", "1e-310"],
        "0.01 to 1000000",
    );
}

#[test]
fn case_38_flatter_and_longer_bodies_than_geodesy_is_tested_with_are_refused() {
    refused(
        "body.f",
        ["body: Ellipsoid(a_m: 6.4e6, f: ", ")"],
        &["1", "0.99", "0.51", "-0.51", "-2"],
        "-0.5 to 0.5",
    );
}

/// What a file may say, core takes: the two sets of ranges never part.
#[test]
fn scenes_at_the_ends_of_all_ranges_are_within_what_core_takes() {
    for text in [
        "Scene(body: Sphere(radius_m: 500), lod: (tolerance_px: 0.01, level_max: 0))",
        "Scene(body: Sphere(radius_m: 1e9), lod: (tolerance_px: 1e6, morph_s: 10))",
        "Scene(body: Ellipsoid(a_m: 1e9, f: 0.5), lod: (patch_depth: 0, level_max: 56))",
        "Scene(body: Ellipsoid(a_m: 1e6, f: -0.5), lod: (patch_depth: 8, level_max: 48))",
        "Scene(body: Moon, lod: (triangles_max: 16000000, splits_max: 65536, merges_max: 65536))",
        "Scene(body: Moon, lod: (patch_depth: 8, triangles_max: 2048), memory: (pages_mib: 65536))",
        "Scene(body: Moon, depth: (ranges: [1, 2, 3, 4, 5, 6, 7]))",
        "Scene(body: Wgs84, depth: (format: D24, ranges: 8), memory: (pages_mib: 4))",
    ] {
        let scene = settings(text);
        assert_eq!(check(&scene), Ok(()), "{text}");
        let limits = Limits::checked(&scene).unwrap();
        assert!(limits.leaves >= 8 && limits.diamonds > limits.leaves && limits.pages >= 4);
    }
}
