//! Flights in memory, and the three that come with overfly.
//!
//! In:    a name, the body, the height of its ground.
//! Out:   a [`Flight`]: poses at a steady rate.
//! Keeps: nothing.
//! Not here: the file format (`format`), flights of other programs (`resample`).

mod descent;
mod landing;
mod poles;
mod track;

use crate::format::{Header, Kind};
use crate::pose::Pose;
use crate::read::{Ending, Frame, ReadError, Reader};
use crate::write::{WriteError, Writer};
use overfly_core::geodesy::{Ellipsoid, Geodetic};
use std::path::Path;

pub use descent::descent;
pub use poles::poles;

/// Names of the flights that come with overfly.
pub const BUNDLED: [&str; 3] = ["rainier", "descent", "poles"];

/// The file that the example `resample` makes from the log of a Cessna around Mount Rainier.
const RAINIER: &[u8] = include_bytes!("../../flights/rainier.ovf");

/// Rainier's flight keeps this distance from the ground, scaled like its heights; metres.
const RAINIER_CLEARANCE_M: f64 = 300.0;

/// Poses at a steady rate.
#[derive(Clone, PartialEq, Debug)]
pub struct Flight {
    /// Shown in tables and file names.
    pub name: String,
    /// Poses a second.
    pub rate_hz: f64,
    /// Pose i is that of time i / `rate_hz`.
    pub poses: Vec<Pose>,
    /// By how much the whole flight was raised above what was flown or asked for; metres. Not kept
    /// in files: there the raised heights are the heights.
    pub raised_m: f64,
}

/// A bundled flight over the bare WGS 84 ellipsoid; `None` for other names.
pub fn bundled(name: &str) -> Option<Flight> {
    flight(name, &Ellipsoid::WGS84, &|_| 0.0)
}

/// A bundled flight over `body`, whose ground is as high above the ellipsoid as
/// `ground_height_m` says; `None` for names that are not in [`BUNDLED`].
///
/// - `rainier` is flown at its own latitudes and longitudes; heights scale with the radius, and the
///   whole flight is raised until it keeps 300 m (scaled alike) from the ground once a second.
/// - `descent` and `poles`: see [`descent`] and [`poles`].
///
/// Equal bodies and grounds make equal bits.
pub fn flight(
    name: &str,
    body: &Ellipsoid,
    ground_height_m: &dyn Fn(Geodetic) -> f64,
) -> Option<Flight> {
    match name {
        "rainier" => Some(rainier(body, ground_height_m)),
        "descent" => Some(descent(body, ground_height_m)),
        "poles" => Some(poles(body, ground_height_m)),
        _ => None,
    }
}

impl Flight {
    /// Raises every pose; negative lowers.
    pub fn raised(&mut self, by_m: f64) {
        for pose in &mut self.poses {
            pose.at.height_m += by_m;
        }
        self.raised_m += by_m;
    }

    /// Smallest height above the ground in metres, looked at every `every` poses (1 or more);
    /// infinite for a flight without poses.
    pub fn clearance_m(&self, every: usize, ground_height_m: &dyn Fn(Geodetic) -> f64) -> f64 {
        let above = |pose: &Pose| pose.at.height_m - ground_height_m(pose.at);
        self.poses.iter().step_by(every).map(above).fold(f64::INFINITY, f64::min)
    }

    /// Raises the flight where it comes nearer to the ground than `least_m`.
    fn kept_above(
        mut self,
        least_m: f64,
        every: usize,
        ground_height_m: &dyn Fn(Geodetic) -> f64,
    ) -> Self {
        let lack_m = least_m - self.clearance_m(every, ground_height_m);
        if lack_m > 0.0 {
            self.raised(lack_m);
        }
        self
    }

    /// Writes the flight to a file.
    ///
    /// # Errors
    /// Where the rate is not usable or the file system refuses.
    pub fn write(&self, path: &Path) -> Result<(), WriteError> {
        let frames = self.poses.len() as u64;
        let header = Header { frames, ..Header::flight(&self.name, self.rate_hz) };
        let mut writer = Writer::create(path, &header)?;
        for pose in &self.poses {
            writer.pose(pose)?;
        }
        writer.finish()
    }

    /// Reads a flight as far as it goes; the second part says whether that is all.
    ///
    /// # Errors
    /// Where there is no readable header, or it is a recording's.
    pub fn read(path: &Path) -> Result<(Self, Ending), ReadError> {
        Self::from_reader(Reader::open(path)?)
    }

    /// As [`Flight::read`], from an open reader that has given out no frame.
    ///
    /// # Errors
    /// Where it is a recording's.
    pub fn from_reader(mut reader: Reader) -> Result<(Self, Ending), ReadError> {
        reader.expect(Kind::Flight)?;
        let mut poses = Vec::new();
        let ending = reader.drain(|frame| {
            if let Frame::Pose(pose) = frame {
                poses.push(pose);
            }
        });
        let Header { name, rate_hz, .. } = reader.header().clone();
        Ok((Self { name, rate_hz, poses, raised_m: 0.0 }, ending))
    }
}

/// The Cessna's flight, as recorded but for its heights.
fn rainier(body: &Ellipsoid, ground_height_m: &dyn Fn(Geodetic) -> f64) -> Flight {
    let reader = Reader::from_bytes(RAINIER, "rainier.ovf").expect("the bundled file has a header");
    let (mut flight, _) = Flight::from_reader(reader).expect("the bundled file is a flight");
    let scale = body.a_m / Ellipsoid::WGS84.a_m;
    for pose in &mut flight.poses {
        pose.at.height_m *= scale;
    }
    flight.kept_above(RAINIER_CLEARANCE_M * scale, 60, ground_height_m)
}
