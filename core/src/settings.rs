//! Resolved settings of a scene: complete, SI, no serde, no defaults.
//!
//! In:    built by `overfly_config` from RON, or by a host as a literal.
//! Out:   [`SceneSettings`] and its listing, which recordings keep and compare.
//! Keeps: nothing.
//! Not here: files, defaults, ranges (`overfly_config`); capacities (`limits`).

use crate::datasource::procedural::{ProceduralSettings, Style};
use crate::digest::{Chain, mix};
use crate::geodesy::Ellipsoid;
use crate::units::{Pixels, Radians};
use glam::DVec3;

/// Everything that a scene is made of.
#[derive(Clone, PartialEq, Debug)]
pub struct SceneSettings {
    /// Shape of the body.
    pub body: Ellipsoid,
    /// Where heights come from, finest first: archives, then at most one procedural source.
    pub sources: Vec<SourceSettings>,
    /// Level of detail.
    pub lod: LodSettings,
    /// The views of each frame, relative to the recorded pose. At least one.
    pub views: Vec<LensSettings>,
    /// Depth ranges of the renderer.
    pub depth: DepthSettings,
    /// How a renderer gets from a vertex to its place before the eye.
    pub vertices: VertexPrecision,
    /// Archives of imagery that drape over the ground, the finest first.
    pub imagery: Vec<String>,
    /// Memory limits.
    pub memory: MemorySettings,
    /// Water covers the ground below height 0.
    pub sea: bool,
    /// The sun; without one the ground is lit evenly.
    pub sun: Option<SunSettings>,
}

/// One source of heights.
#[derive(Clone, PartialEq, Debug)]
pub enum SourceSettings {
    /// Real elevation, in a file or on a server.
    Archive {
        /// Path of the file, or an address as [`is_address`] knows it.
        location: String,
    },
    /// The procedural planet: no files.
    Procedural {
        /// Which planet of all.
        seed: u64,
        /// What kind of ground.
        style: Style,
        /// Scale of all heights; 1 is Earth-like.
        relief: f64,
        /// Shortest wavelength of the ground in metres.
        finest_m: f64,
        /// Strength of the detail below the last level of archives, 0 to 10; 0 is none.
        detail: f64,
    },
}

/// The knobs of the level of detail.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LodSettings {
    /// No diamond is split whose error bound on the screen is this small or smaller.
    pub tolerance: Pixels,
    /// Never more triangles than this in the mesh; at least 8·2^`patch_depth`.
    pub triangles_max: u32,
    /// A leaf is drawn as 2^k triangles; 0, 2, 4, 6 or 8.
    pub patch_depth: u8,
    /// Most diamond splits in one frame, forced ones included.
    pub splits_max: u32,
    /// Most diamond merges in one frame: a count of its own, so that splits cannot starve merges.
    pub merges_max: u32,
    /// Deepest level of a leaf, at most 56 − `patch_depth`.
    pub level_max: u8,
    /// Longest list of wanted pages in one frame.
    pub wanted_max: u32,
    /// How long a new vertex takes from the surface that it refines to its own place, in seconds
    /// of the flight; 0 is at once.
    pub morph_s: f64,
}

/// One view of the scene, relative to the pose of a flight.
#[derive(Clone, PartialEq, Debug)]
pub struct LensSettings {
    /// Shown in tables and file names.
    pub name: String,
    /// Vertical field of view.
    pub field_of_view: Radians,
    /// Turned to the right of the nose.
    pub yaw: Radians,
    /// Turned up from the nose.
    pub pitch: Radians,
    /// Nothing nearer is drawn; metres.
    pub near_m: f64,
}

/// Numbers in a depth buffer.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum DepthFormat {
    /// 32 bits of float.
    D32F,
    /// 24 bits of fixed point.
    D24,
}

/// Which way depth runs.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum DepthOrder {
    /// 1 near, 0 far: what floats resolve best.
    Reversed,
    /// 0 near, 1 far.
    Forward,
}

/// How a renderer gets from a vertex to its place before the eye. Both give one f32 triple a
/// lattice key, whatever patch draws it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum VertexPrecision {
    /// The shader subtracts two-float pairs: no work in a frame; good for fields of view down to
    /// about 1°.
    TwoFloat,
    /// The host subtracts and rotates in f64 in every frame: good for any field of view.
    EyeF64,
}

/// How the renderer cuts the view in depth.
#[derive(Clone, PartialEq, Debug)]
pub struct DepthSettings {
    /// Numbers in the depth buffer.
    pub format: DepthFormat,
    /// Which way they run.
    pub order: DepthOrder,
    /// Borders between the ranges in metres, rising; n borders make n + 1 ranges.
    pub splits_m: Vec<f64>,
}

/// Memory limits.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MemorySettings {
    /// Bytes of all resident pages together.
    pub pages_bytes: u64,
}

/// Where the sun stands; [`SunSettings::direction_at`] tells.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum SunSettings {
    /// In one place for the whole flight.
    Fixed {
        /// Body-fixed unit vector towards the sun.
        direction: DVec3,
    },
    /// As the Earth's year and day have it, over any body.
    Clock {
        /// UTC at the flight's time 0, in seconds since 1970-01-01T00:00:00Z without leap seconds.
        start_unix_s: f64,
        /// The sun goes on with the flight's time; else it stays where it is at the start.
        runs: bool,
    },
}

/// Whether an archive's location is an address on a server; all others are paths.
pub fn is_address(location: &str) -> bool {
    ["http://", "https://"].into_iter().any(|scheme| {
        location.get(..scheme.len()).is_some_and(|start| start.eq_ignore_ascii_case(scheme))
    })
}

impl SourceSettings {
    /// As recordings list it. An archive of the same name in another folder is the same; `detail`
    /// counts only beside archives, and scenes without any keep the text they always had.
    fn listed(&self, beside_archives: bool) -> String {
        match self {
            Self::Archive { location } if is_address(location) => format!("Archive({location:?})"),
            Self::Archive { location } => {
                let name = location.rsplit(['/', '\\']).next().unwrap_or(location);
                format!("Archive({name:?})")
            }
            Self::Procedural { seed, style, relief, finest_m, detail } => {
                let detail =
                    if beside_archives { format!(", detail: {detail:?}") } else { String::new() };
                format!(
                    "Procedural {{ seed: {seed}, style: {style:?}, relief: {relief:?}, \
                     finest_m: {finest_m:?}{detail} }}"
                )
            }
        }
    }
}

impl SceneSettings {
    /// Locations of the archives, finest first.
    pub fn archives(&self) -> impl Iterator<Item = &str> {
        self.sources.iter().filter_map(|source| match source {
            SourceSettings::Archive { location } => Some(location.as_str()),
            SourceSettings::Procedural { .. } => None,
        })
    }

    /// What the procedural planet of this scene is made from; `None` where there is none.
    pub fn procedural_source(&self) -> Option<ProceduralSettings> {
        self.sources.iter().find_map(|source| match *source {
            SourceSettings::Archive { .. } => None,
            SourceSettings::Procedural { seed, style, relief, finest_m, .. } => {
                let radius_m = (2.0 * self.body.a_m + self.body.b_m()) / 3.0;
                Some(ProceduralSettings { seed, radius_m, style, relief, finest_m })
            }
        })
    }

    /// Strength of the procedural detail below the last level of archives; 0 is none.
    pub fn detail(&self) -> f64 {
        let detail = self.sources.iter().find_map(|source| match *source {
            SourceSettings::Archive { .. } => None,
            SourceSettings::Procedural { detail, .. } => Some(detail),
        });
        detail.unwrap_or(0.0)
    }

    /// Every setting that can change a frame's bits, as (path, value), in a fixed order.
    ///
    /// Of `depth` that is where the ranges end, for patches are placed by range; numbers and order
    /// in the depth buffer, `vertices`, `imagery` and `sun` are only the renderer's, so a
    /// recording replays with others. Ranges that follow from a format are listed as resolved.
    pub fn listing(&self) -> Vec<(String, String)> {
        let mut list = vec![
            ("body.a_m".into(), format!("{:?}", self.body.a_m)),
            ("body.f".into(), format!("{:?}", self.body.f)),
        ];
        let beside_archives = self.archives().next().is_some();
        for (i, source) in self.sources.iter().enumerate() {
            list.push((format!("sources[{i}]"), source.listed(beside_archives)));
        }
        let lod = &self.lod;
        for (name, value) in [
            ("tolerance_px", format!("{:?}", lod.tolerance.0)),
            ("triangles_max", lod.triangles_max.to_string()),
            ("patch_depth", lod.patch_depth.to_string()),
            ("splits_max", lod.splits_max.to_string()),
            ("merges_max", lod.merges_max.to_string()),
            ("level_max", lod.level_max.to_string()),
            ("wanted_max", lod.wanted_max.to_string()),
            ("morph_s", format!("{:?}", lod.morph_s)),
        ] {
            list.push((format!("lod.{name}"), value));
        }
        for (i, view) in self.views.iter().enumerate() {
            list.push((format!("views[{i}]"), format!("{view:?}")));
        }
        list.push(("sea".into(), self.sea.to_string()));
        list.push(("depth.splits_m".into(), format!("{:?}", self.depth.splits_m)));
        list.push(("memory.pages_bytes".into(), self.memory.pages_bytes.to_string()));
        list
    }

    /// One number for the whole listing.
    pub fn digest(&self) -> u64 {
        let mut chain = Chain::default();
        for (path, value) in self.listing() {
            for byte in path.bytes().chain([b'=']).chain(value.bytes()).chain([b'\n']) {
                chain.add(mix(u64::from(byte)));
            }
        }
        chain.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLANET: SourceSettings = SourceSettings::Procedural {
        seed: 2029,
        style: Style::Cratered,
        relief: 1.0,
        finest_m: 0.15,
        detail: 0.5,
    };
    const PLANET_TEXT: &str =
        "Procedural { seed: 2029, style: Cratered, relief: 1.0, finest_m: 0.15 }";

    fn scene(sources: Vec<SourceSettings>) -> SceneSettings {
        SceneSettings {
            body: Ellipsoid::WGS84,
            sources,
            lod: LodSettings {
                tolerance: Pixels(1.0),
                triangles_max: 1000,
                patch_depth: 4,
                splits_max: 1,
                merges_max: 1,
                level_max: 40,
                wanted_max: 1,
                morph_s: 0.0,
            },
            views: Vec::new(),
            depth: DepthSettings {
                format: DepthFormat::D32F,
                order: DepthOrder::Reversed,
                splits_m: Vec::new(),
            },
            vertices: VertexPrecision::TwoFloat,
            imagery: Vec::new(),
            memory: MemorySettings { pages_bytes: 1 << 20 },
            sea: false,
            sun: None,
        }
    }

    fn archive(location: &str) -> SourceSettings {
        SourceSettings::Archive { location: location.into() }
    }

    fn listed(scene: &SceneSettings) -> Vec<String> {
        let sources = |(path, _): &(String, String)| path.starts_with("sources");
        scene.listing().into_iter().filter(sources).map(|(_, value)| value).collect()
    }

    #[test]
    fn scenes_without_archives_are_listed_as_they_always_were() {
        let scene = scene(vec![PLANET]);
        assert_eq!(listed(&scene), [PLANET_TEXT]);
        assert_eq!(scene.archives().count(), 0);
        assert_eq!(scene.procedural_source().unwrap().seed, 2029);
    }

    #[test]
    fn archives_are_listed_by_name_wherever_they_lie() {
        let here = scene(vec![archive("a/alps.pmtiles"), archive("http://h/p.pmtiles"), PLANET]);
        let there =
            scene(vec![archive("C:\\b\\alps.pmtiles"), archive("http://h/p.pmtiles"), PLANET]);
        assert_eq!(here.digest(), there.digest());
        let planet = PLANET_TEXT.replace(" }", ", detail: 0.5 }");
        let expected = ["Archive(\"alps.pmtiles\")", "Archive(\"http://h/p.pmtiles\")", &planet];
        assert_eq!(listed(&here), expected);
        assert_eq!(here.archives().collect::<Vec<_>>(), ["a/alps.pmtiles", "http://h/p.pmtiles"]);
        assert_eq!(here.detail(), 0.5);
    }

    #[test]
    fn archives_alone_have_neither_planet_nor_detail() {
        let scene = scene(vec![archive("alps.pmtiles")]);
        assert_eq!((scene.procedural_source(), scene.detail()), (None, 0.0));
    }

    #[test]
    fn what_only_a_renderer_uses_is_not_listed_and_where_ranges_end_is() {
        let before = scene(vec![PLANET]);
        let mut drawn_otherwise = before.clone();
        drawn_otherwise.depth.format = DepthFormat::D24;
        drawn_otherwise.depth.order = DepthOrder::Forward;
        drawn_otherwise.vertices = VertexPrecision::EyeF64;
        drawn_otherwise.imagery = vec!["blue.pmtiles".into()];
        drawn_otherwise.sun = Some(SunSettings::Clock { start_unix_s: 0.0, runs: true });
        assert_eq!(drawn_otherwise.digest(), before.digest());
        let mut ranges = before.clone();
        ranges.depth.splits_m = vec![30.0];
        let mut morphing = before.clone();
        morphing.lod.morph_s = 0.25;
        assert_ne!(ranges.digest(), before.digest());
        assert_ne!(morphing.digest(), before.digest());
    }

    #[test]
    fn only_http_and_https_are_addresses() {
        assert!(is_address("http://a") && is_address("HTTPS://a"));
        assert!(["", "é", "ftp://a", "a/http://b"].into_iter().all(|path| !is_address(path)));
    }
}
