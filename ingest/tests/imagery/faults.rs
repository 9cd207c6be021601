//! Pictures that cannot be read, and builds that cannot end well: what is said, what is left.
//!
//! In:    files of other kinds, cut ones, wrong shapes, a stop at any moment.
//! Out:   pass or fail.
//! Keeps: nothing.
//! Not here: damaged tiles of archives (`overfly_archive`).

use crate::pictures::{Atlas, Drawing, Georeference, build, mercator_options, options, write_png};
use overfly_archive::{Archive, Imagery, Location, OpenOptions};
use overfly_ingest::{ImageryOptions, IngestError, build_imagery};
use png::{BitDepth, ColorType};
use std::fs;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

const OLD: &[u8] = b"what was there before";

/// What a build says when it refuses.
fn refusal(options: &ImageryOptions) -> String {
    let before = fs::read(&options.output).ok();
    let error = build(options).unwrap_err().to_string();
    assert_eq!(fs::read(&options.output).ok(), before, "{error}");
    error
}

#[test]
fn what_is_no_picture_or_of_another_depth_is_named_with_what_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("in.png"), folder.path().join("a.pmtiles"));
    fs::write(&output, OLD).unwrap();
    let missing = refusal(&options(&input, &output));
    assert!(missing.contains("in.png"), "{missing}");
    fs::write(&input, b"GIF89a and so on").unwrap();
    let gif = refusal(&options(&input, &output));
    assert!(gif.contains("in.png: it begins with the bytes [47, 49, 46, 38]"), "{gif}");
    assert!(gif.contains("PNG (89 50 4e 47) or TIFF"), "{gif}");
    fs::write(&input, b"").unwrap();
    assert!(refusal(&options(&input, &output)).contains("in.png: it begins with the bytes []"));
    let sixteen = (ColorType::Grayscale, BitDepth::Sixteen);
    write_png(&input, [64, 32], sixteen, &vec![0; 64 * 32 * 2]);
    let deep = refusal(&options(&input, &output));
    assert!(deep.contains("in.png: its bit depth is 16 (Grayscale); 1 to 8 bits"), "{deep}");
}

#[test]
fn shapes_bounds_and_projections_that_cannot_be_are_refused_with_what_can() {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("in.png"), folder.path().join("a.pmtiles"));
    Drawing::new([60, 40], |_, _| [9; 4]).write_png(&input);
    let shape = refusal(&options(&input, &output));
    assert!(shape.contains("in.png: its size is 60 × 40 pixels, but the whole body is twice"));
    assert!(shape.contains("--bounds WEST,SOUTH,EAST,NORTH"), "{shape}");
    let square = refusal(&mercator_options(&input, &output));
    assert!(square.contains("the whole Mercator square is as wide as high"), "{square}");
    for bounds in [[10.0, 0.0, 10.0, 5.0], [0.0, 5.0, 1.0, 4.0], [0.0, -91.0, 1.0, 4.0]] {
        let bounded = ImageryOptions { bounds_deg: Some(bounds), ..options(&input, &output) };
        let said = refusal(&bounded);
        assert!(said.contains(&format!("its bounds are {bounds:?}; allowed are")), "{said}");
    }
    let polar = Some([0.0, 0.0, 1.0, 89.5]);
    let polar = ImageryOptions { bounds_deg: polar, ..mercator_options(&input, &output) };
    assert!(refusal(&polar).contains("from -89 to 89"));
    let georeference = Georeference { code: Some(4326), corner: [0.0, 1.0], step: [0.1, -0.1] };
    let tiff = folder.path().join("placed.tif");
    Drawing::new([10, 10], |_, _| [9; 4]).write_tiff(&tiff, &georeference);
    let twice =
        ImageryOptions { bounds_deg: Some([0.0, 0.0, 1.0, 1.0]), ..options(&tiff, &output) };
    let said = refusal(&twice);
    assert!(said.contains("placed.tif: --bounds is given, but the file says itself"), "{said}");
    let elsewhere = Georeference { code: Some(32633), ..georeference };
    Drawing::new([10, 10], |_, _| [9; 4]).write_tiff(&tiff, &elsewhere);
    assert!(refusal(&options(&tiff, &output)).contains("EPSG:32633"));
    // Nothing but transparency.
    Drawing::new([64, 32], |_, _| [9, 9, 9, 0]).write_png(&input);
    let clear = refusal(&options(&input, &output));
    assert!(clear.contains("in.png: there is nothing to see"), "{clear}");
    assert!(!output.exists());
}

#[test]
fn a_picture_cut_anywhere_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let drawing = Drawing::new([128, 64], |x, y| [x as u8 * 2, y as u8, (x * y) as u8, 255]);
    let png = fs::read(drawing.write_png(&folder.path().join("whole.png"))).unwrap();
    let tiff = drawing.write_tiff(&folder.path().join("whole.tif"), &Georeference::default());
    let tiff = fs::read(tiff).unwrap();
    assert!(build(&options(&folder.path().join("whole.tif"), &folder.path().join("t"))).is_ok());
    for (name, bytes) in [("cut.png", png), ("cut.tif", tiff)] {
        let (input, output) = (folder.path().join(name), folder.path().join("a.pmtiles"));
        // The last bytes of a PNG say only that it ends.
        for length in (4..bytes.len() - 20).step_by(bytes.len() / 40) {
            fs::write(&input, &bytes[..length]).unwrap();
            let said = refusal(&options(&input, &output));
            assert!(said.contains(name), "{length}: {said}");
        }
    }
}

#[test]
fn archives_of_one_kind_are_refused_where_the_other_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let picture = Drawing::world(64).write_png(&folder.path().join("world.png"));
    let output = folder.path().join("world.pmtiles");
    Atlas::build(&options(&picture, &output));
    let location = Location::File(output);
    let error = Archive::open(&location, &OpenOptions::default()).unwrap_err().to_string();
    assert!(error.contains("world.pmtiles: it holds imagery"), "{error}");
    assert!(error.contains("where elevation is read"), "{error}");
    let shared = Imagery::open_imagery(&location, &OpenOptions::default());
    assert!(shared.is_ok());
}

#[test]
fn a_stop_at_any_moment_leaves_the_old_archive_and_no_part_of_a_new_one() {
    let folder = tempfile::tempdir().unwrap();
    let picture = Drawing::world(512).write_png(&folder.path().join("world.png"));
    let built = options(&picture, &folder.path().join("a.pmtiles"));
    let events = AtomicU64::new(0);
    let count = |_| {
        events.fetch_add(1, Ordering::Relaxed);
    };
    build_imagery(&built, &AtomicBool::new(false), &count).unwrap();
    let whole = fs::read(&built.output).unwrap();
    let events = events.into_inner();
    assert!(events > 4, "{events}");
    for moment in 0..events {
        fs::write(&built.output, OLD).unwrap();
        let (stop, seen) = (AtomicBool::new(moment == 0), AtomicU64::new(0));
        let raise = |_| {
            if seen.fetch_add(1, Ordering::Relaxed) + 1 >= moment {
                stop.store(true, Ordering::Relaxed);
            }
        };
        let outcome = build_imagery(&built, &stop, &raise);
        let found = fs::read(&built.output).unwrap();
        match outcome {
            Ok(_) => assert!(found == whole && moment + 1 >= events, "moment {moment}"),
            Err(error) => {
                assert!(matches!(error, IngestError::Stopped), "{error}");
                assert_eq!(found, OLD);
            }
        }
        let names = fs::read_dir(folder.path()).unwrap().count();
        assert_eq!(names, 2, "moment {moment}");
    }
}
