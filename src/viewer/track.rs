//! What a flight or a recording shows, frame by frame.
//!
//! In:    a bundled flight's name, an `.ovf` file or one that `import` reads; a scene.
//! Out:   [`Track`]: a view for each frame.
//! Keeps: the view that was shown last.
//! Not here: which frame is shown (`play`), files, held digests (`cli::source`).

use crate::cli::Failure;
use crate::cli::source::Source;
use overfly::Overfly;
use overfly::core::camera::View;
use overfly::core::frame::FrameInput;
use overfly::core::settings::SceneSettings;

/// Views at a steady rate.
pub struct Track {
    /// Shown on the screen and in file names.
    pub name: String,
    /// Frames a second.
    pub rate_hz: f64,
    /// How many there are; at least one.
    pub frames: usize,
    source: Source,
    scene: SceneSettings,
    input: FrameInput,
    shown: View,
}

impl Track {
    /// Opens a flight or a recording. Of a recording only the views count: it may be looked at in
    /// any scene.
    ///
    /// # Errors
    /// There is no such flight or file, or no frame in it.
    pub fn open(name: &str, scene: &SceneSettings, overfly: &Overfly) -> Result<Self, Failure> {
        let mut source = Source::open_any(name, overfly)?;
        let mut input = FrameInput::default();
        if source.load(0) {
            source.fill(scene, [1, 1], &mut input)?;
        }
        let Some(shown) = input.views.first().copied() else {
            return Err(format!("{name} holds no frame that can be shown").into());
        };
        Ok(Self {
            name: source.name().to_owned(),
            rate_hz: source.rate_hz(),
            frames: source.frames() + source.lead_in(),
            source,
            scene: scene.clone(),
            input,
            shown,
        })
    }

    /// The first view of a frame. Its size is the window's, not its own. Where the frame cannot be
    /// read or has no view it is the one that was asked for before.
    pub fn view(&mut self, frame: usize) -> View {
        let fills = self.source.load(frame)
            && self.source.fill(&self.scene, [1, 1], &mut self.input).is_ok();
        if fills {
            self.shown = self.input.views.first().copied().unwrap_or(self.shown);
        }
        self.shown
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
        let mut flight = Track::open("poles", &scene, &overfly).unwrap();
        assert!(flight.frames > 100, "{}", flight.frames);
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("two.ovf");
        for frames in [2, 0] {
            let header = Header::recording("two", 60.0, &scene);
            let mut writer = Writer::create(&file, &header).unwrap();
            for frame in 0..frames {
                let views = vec![flight.view(frame), flight.view(9)];
                writer.frame(&RecordedFrame { views, ..Default::default() }).unwrap();
            }
            writer.finish().unwrap();
            let track = Track::open(&file.display().to_string(), &scene, &overfly);
            match frames {
                0 => assert!(track.err().unwrap().to_string().contains("no frame")),
                _ => {
                    let mut track = track.unwrap();
                    assert_eq!(track.frames, 2);
                    assert_eq!([1, 0, 1].map(|i| track.view(i)), [1, 0, 1].map(|i| flight.view(i)));
                }
            }
        }
        let missing = Track::open("nowhere", &scene, &overfly).err().unwrap().to_string();
        assert!(missing.contains("rainier, descent, poles"), "{missing}");
    }
}
