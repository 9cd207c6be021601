//! Pictures, each with a text beside it from which it can be drawn again.
//!
//! In:    pixels; a view, a scene, what was shown; a sidecar's text.
//! Out:   PNG and RON files; [`Sidecar`], every number of it to the bit.
//! Keeps: nothing.
//! Not here: drawing (`session`), stills of a replay (`cli::stills`).

use super::session::scene_of;
use crate::cli::stills::write_png;
use crate::cli::{Failure, write_whole};
use glam::{DQuat, DVec3};
use overfly::core::camera::View;
use overfly::core::digest::{Chain, mix};
use overfly::core::geodesy::Ecef;
use overfly::core::settings::{SceneSettings, SunSettings};
use overfly::core::units::{Pixels, Radians};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::{Path, PathBuf};

/// Everything that a picture depends on, beside the data of the scene.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(rename = "Picture", deny_unknown_fields)]
pub struct Sidecar {
    /// Version of overfly that drew it.
    pub version: String,
    /// A preset or a scene file, as it was named.
    pub scene: String,
    /// [`text_digest`] of the scene's text, as 16 hexadecimal digits.
    pub scene_digest: String,
    /// Name of the debug view.
    pub show: String,
    /// Width and height in pixels.
    pub size_px: [u32; 2],
    /// Error on the screen that may stay; it may differ from the scene's.
    pub tolerance_px: f64,
    /// Time of the flight in seconds.
    pub time_s: f64,
    /// Body-fixed direction towards the sun, if there was one.
    pub sun: Option<[f64; 3]>,
    /// The eye, body-fixed, in metres.
    pub eye_m: [f64; 3],
    /// Camera axes to body-fixed axes: x, y, z, w.
    pub orientation: [f64; 4],
    /// Vertical field of view in radians.
    pub field_of_view_rad: f64,
    /// Nothing nearer is drawn; metres.
    pub near_m: f64,
    /// For people: latitude, longitude in degrees, height above the ellipsoid in metres.
    pub place: [f64; 3],
}

/// Why a sidecar cannot be read.
#[derive(Debug)]
pub struct SidecarFault {
    file: PathBuf,
    what: String,
}

impl fmt::Display for SidecarFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: no sidecar of a picture: {}", self.file.display(), self.what)
    }
}

impl std::error::Error for SidecarFault {}

/// A number for a scene's text, the same on every machine.
pub fn text_digest(text: &str) -> String {
    let mut chain = Chain::default();
    text.bytes().for_each(|byte| chain.add(mix(u64::from(byte))));
    format!("{:016x}", chain.0)
}

impl Sidecar {
    /// Reads a sidecar.
    ///
    /// # Errors
    /// The file cannot be read, or it is none, or its view cannot be drawn.
    pub fn read(path: &Path) -> Result<Self, SidecarFault> {
        let fault = |what: String| SidecarFault { file: path.into(), what };
        let text = std::fs::read_to_string(path).map_err(|error| fault(error.to_string()))?;
        let sidecar: Self = ron::from_str(&text).map_err(|error| fault(error.to_string()))?;
        sidecar.view().check().map_err(|error| fault(error.to_string()))?;
        Ok(sidecar)
    }

    /// The file's text.
    pub fn text(&self) -> String {
        let pretty = ron::ser::PrettyConfig::default().struct_names(true).compact_arrays(true);
        ron::ser::to_string_pretty(self, pretty).expect("numbers and texts are RON")
    }

    /// The scene as it was drawn: name, text and settings, with the picture's own tolerance, sun and
    /// lens. `name` stands in for the recorded one, where the file has gone elsewhere.
    ///
    /// # Errors
    /// The scene cannot be read, or is not the one that was drawn.
    pub fn scene(&self, name: Option<&str>) -> Result<(String, String, SceneSettings), Failure> {
        let name = name.unwrap_or(&self.scene);
        let (text, mut scene) = scene_of(name)?;
        let (expected, found) = (&self.scene_digest, text_digest(&text));
        if *expected != found {
            let what = format!("its text has the digest {found}, the picture's scene {expected}");
            return Err(format!("{name}: {what}").into());
        }
        scene.lod.tolerance = Pixels(self.tolerance_px);
        scene.views[0].field_of_view = Radians(self.field_of_view_rad);
        scene.views[0].near_m = self.near_m;
        let fixed = |sun| SunSettings::Fixed { direction: DVec3::from_array(sun) };
        scene.sun = self.sun.map(fixed);
        Ok((name.to_owned(), text, scene))
    }

    /// The view, bit for bit as it was.
    pub fn view(&self) -> View {
        View {
            eye: Ecef(DVec3::from_array(self.eye_m)),
            orientation: DQuat::from_array(self.orientation),
            field_of_view: Radians(self.field_of_view_rad),
            size_px: self.size_px,
            near_m: self.near_m,
        }
    }

    /// The same sidecar for another view.
    #[must_use]
    pub fn with_view(mut self, view: &View) -> Self {
        self.eye_m = view.eye.0.to_array();
        self.orientation = view.orientation.to_array();
        self.field_of_view_rad = view.field_of_view.0;
        self.size_px = view.size_px;
        self.near_m = view.near_m;
        self
    }
}

/// Writes a picture and its sidecar into a folder, under the first number that is free; the
/// picture's path.
///
/// # Errors
/// The folder cannot be written to, or `pixels` are not as many as the sidecar's size says.
pub fn write(folder: &Path, pixels: Vec<u8>, sidecar: &Sidecar) -> Result<PathBuf, Failure> {
    let name = |number: u32| folder.join(format!("view-{number:04}.png"));
    let path = (1..)
        .map(name)
        .find(|path| !path.exists() && !path.with_extension("ron").exists())
        .ok_or("there is no free name left")?;
    write_png(&path, sidecar.size_px, pixels)?;
    write_whole(&path.with_extension("ron"), sidecar.text().as_bytes())?;
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sidecar() -> Sidecar {
        Sidecar {
            version: "0.1.0".into(),
            scene: "C:\\alps \"x\".ron".into(),
            scene_digest: text_digest("Scene()"),
            show: "shaded".into(),
            size_px: [2, 3],
            tolerance_px: 1.0 / 3.0,
            time_s: -0.0,
            sun: Some([1e-300, f64::MIN_POSITIVE / 3.0, -0.0]),
            eye_m: [-2_304_557.123_456_789, 0.1 + 0.2, 6_378_137.000_000_001],
            orientation: [0.1, -0.7, 1.0 / 7.0, 1e-17],
            field_of_view_rad: 1.047_197_551_196_597_6,
            near_m: 0.1,
            place: [46.852_3, -121.760_3, 4500.0],
        }
    }

    fn bits(sidecar: &Sidecar) -> Vec<u64> {
        let mut numbers = vec![sidecar.tolerance_px, sidecar.time_s, sidecar.near_m];
        numbers.push(sidecar.field_of_view_rad);
        numbers.extend(sidecar.eye_m);
        numbers.extend(sidecar.orientation);
        numbers.extend(sidecar.place);
        numbers.extend(sidecar.sun.unwrap());
        numbers.into_iter().map(f64::to_bits).collect()
    }

    #[test]
    fn a_sidecar_comes_back_to_the_bit() {
        let folder = tempfile::tempdir().unwrap();
        let written = sidecar();
        let path = write(folder.path(), vec![7; 24], &written).unwrap();
        let read = Sidecar::read(&path.with_extension("ron")).unwrap();
        assert_eq!((&read, bits(&read)), (&written, bits(&written)));
        assert_eq!(written.clone().with_view(&read.view()), written);
        let picture = image::open(&path).unwrap().into_rgba8();
        assert_eq!((picture.dimensions(), picture.into_raw()), ((2, 3), vec![7; 24]));
        let next = write(folder.path(), vec![7; 24], &written).unwrap();
        assert_ne!(next, path, "an old picture is never lost");
        assert!(write(folder.path(), vec![7; 23], &written).is_err());
    }

    #[test]
    fn what_is_no_sidecar_says_why() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("x.ron");
        let mut broken = sidecar();
        broken.near_m = 0.0;
        for (text, part) in [
            ("Scene()".to_owned(), "no sidecar"),
            (sidecar().text().replace("show", "shown"), "shown"),
            (broken.text(), "near distance"),
        ] {
            std::fs::write(&file, text).unwrap();
            let fault = Sidecar::read(&file).unwrap_err().to_string();
            assert!(fault.contains(part) && fault.contains("x.ron"), "{fault}");
        }
        assert!(Sidecar::read(&folder.path().join("none.ron")).is_err());
    }

    #[test]
    fn a_sidecar_brings_its_scene_and_refuses_another() {
        let (text, small) = scene_of("small").unwrap();
        let written =
            Sidecar { scene: "small".into(), scene_digest: text_digest(&text), ..sidecar() };
        let (name, again, scene) = written.scene(None).unwrap();
        assert_eq!((name.as_str(), again), ("small", text));
        assert_eq!(scene.lod.tolerance.0, written.tolerance_px);
        let sun = scene.sun.unwrap().direction_at(77.0);
        assert_eq!(Some(sun.to_array()), written.sun);
        assert_eq!(scene.sources, small.sources);
        let moon = written.scene(Some("moon")).unwrap_err().to_string();
        assert!(moon.contains("moon") && moon.contains(&written.scene_digest), "{moon}");
    }

    #[test]
    fn texts_that_differ_have_other_digests() {
        assert_eq!(text_digest("Scene()").len(), 16);
        assert_eq!(text_digest("a"), text_digest("a"));
        assert_ne!(text_digest("ab"), text_digest("ba"));
    }
}
