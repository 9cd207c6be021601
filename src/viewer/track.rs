//! What a flight or a recording shows, frame by frame.
//!
//! In:    a bundled flight's name, an `.ovf` file or one that `import` reads; a scene.
//! Out:   [`Track`]: a view for each frame.
//! Keeps: all views in memory.
//! Not here: which frame is shown (`play`), held digests (`cli::source`).

use crate::cli::Failure;
use crate::cli::source::{flight_of, recording_header};
use overfly::Overfly;
use overfly::core::camera::View;
use overfly::core::settings::SceneSettings;
use overfly::replay::{BUNDLED, Flight, Recording, view_of};
use std::path::Path;

/// Views at a steady rate.
pub struct Track {
    /// Shown on the screen and in file names.
    pub name: String,
    /// Frames a second.
    pub rate_hz: f64,
    /// The first view of each frame; at least one. Their size is the window's, not their own.
    pub views: Vec<View>,
}

impl Track {
    /// Opens a flight or a recording. Of a recording only the views count: it may be looked at in
    /// any scene.
    ///
    /// # Errors
    /// There is no such flight or file, or no frame in it.
    pub fn open(name: &str, scene: &SceneSettings, overfly: &Overfly) -> Result<Self, Failure> {
        let track = if BUNDLED.contains(&name) {
            Self::of_flight(&overfly.flight(name)?, scene)
        } else if recording_header(name)?.is_some() {
            Self::of_recording(Recording::open(Path::new(name))?)
        } else {
            Self::of_flight(&flight_of(name)?.0, scene)
        };
        if track.views.is_empty() {
            return Err(format!("{name} holds no frame that can be shown").into());
        }
        Ok(track)
    }

    fn of_flight(flight: &Flight, scene: &SceneSettings) -> Self {
        let lens = &scene.views[0];
        let view = |pose| view_of(pose, lens, [1, 1], &scene.body);
        Self {
            name: flight.name.clone(),
            rate_hz: flight.rate_hz,
            views: flight.poses.iter().map(view).collect(),
        }
    }

    fn of_recording(recording: Recording) -> Self {
        let views = recording.frames.iter().filter_map(|frame| frame.views.first().copied());
        Self {
            views: views.collect(),
            rate_hz: recording.header.rate_hz,
            name: recording.header.name,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly::replay::{Header, RecordedFrame, Writer};

    #[test]
    fn a_recording_is_seen_as_it_was_and_an_empty_one_is_refused() {
        let scene = overfly::config::load("small").unwrap();
        let overfly = Overfly::new(&scene, 0).unwrap();
        let flight = Track::open("poles", &scene, &overfly).unwrap();
        assert!(flight.views.len() > 100, "{}", flight.views.len());
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("two.ovf");
        for frames in [2, 0] {
            let header = Header::recording("two", 60.0, &scene);
            let mut writer = Writer::create(&file, &header).unwrap();
            for view in &flight.views[..frames] {
                let views = vec![*view, flight.views[9]];
                writer.frame(&RecordedFrame { views, ..Default::default() }).unwrap();
            }
            writer.finish().unwrap();
            let track = Track::open(&file.display().to_string(), &scene, &overfly);
            match frames {
                0 => assert!(track.err().unwrap().to_string().contains("no frame")),
                _ => assert_eq!(track.unwrap().views, flight.views[..2]),
            }
        }
        let missing = Track::open("nowhere", &scene, &overfly).err().unwrap().to_string();
        assert!(missing.contains("rainier, descent, poles"), "{missing}");
    }
}
