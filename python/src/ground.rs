//! Answers of the ground as arrays, and the words that questions are asked in.
//!
//! In:    `best`, `exact:N`, `within:M`; answers of core.
//! Out:   [`Heights`], [`Contacts`], [`Ray`], [`Readiness`].
//! Keeps: nothing.
//! Not here: who answers (`terrain`).

use crate::arrays::{array, array_of_points};
use crate::raised::refused;
use glam::DVec3;
use numpy::PyArrayDyn;
use overfly::core::ground::{self, Answer, Contact, Height, Hit, LEVEL_MAX, Query};
use overfly::core::units::Metres;
use pyo3::prelude::*;

/// A query in the words of `overfly probe --level`.
pub fn query_of(text: &str) -> PyResult<Query> {
    let query = match text.split_once(':') {
        None if text == "best" => Some(Query::BestResident),
        Some(("exact", level)) => {
            level.parse().ok().filter(|level| *level <= LEVEL_MAX).map(Query::Exact)
        }
        Some(("within", metres)) => {
            let metres = metres.parse().ok().filter(|m: &f64| *m >= 0.0 && m.is_finite());
            metres.map(|metres| Query::Within(Metres(metres)))
        }
        _ => None,
    };
    query.ok_or_else(|| {
        refused(format!(
            "query is `{text}`, allowed are best, exact:N (0 to {LEVEL_MAX}) and within:M (metres)"
        ))
    })
}

/// `Status` of Python: these numbers are its members.
fn status_of<T>(answer: &Answer<T>) -> u8 {
    match answer {
        Answer::Ok(_) => 0,
        Answer::Coarser(_) => 1,
        Answer::NotReady => 2,
        Answer::Refused => 3,
    }
}

/// The ground at places: arrays of the shape that was asked with.
#[pyclass(frozen, get_all, module = "overfly")]
pub struct Heights {
    /// Height of the surface above the ellipsoid in metres, water where there is a sea; NaN where
    /// there is no number.
    pub height_m: Py<PyArrayDyn<f64>>,
    /// Neither a finer level nor the ground itself is farther than this from `height_m`; NaN where
    /// there is no number.
    pub bound_m: Py<PyArrayDyn<f64>>,
    /// Height of sea level above the ellipsoid in metres; heights above the sea are `height_m` less
    /// this.
    pub sea_level_m: Py<PyArrayDyn<f64>>,
    /// Lattice level of the surface.
    pub level: Py<PyArrayDyn<u8>>,
    /// Members of `Status`: as asked, coarser than asked, no page there.
    pub status: Py<PyArrayDyn<u8>>,
    /// Whether the surface is water.
    pub water: Py<PyArrayDyn<bool>>,
}

impl Heights {
    /// Answers as columns.
    pub fn of(py: Python<'_>, answers: &[Answer], shape: &[usize]) -> PyResult<Self> {
        let found = |of: fn(Height) -> f64| {
            let column = answers.iter().map(|answer| answer.found().map_or(f64::NAN, of));
            array(py, column.collect(), shape)
        };
        let level = |answer: &Answer| answer.found().map_or(0, |found| found.level);
        let water = |answer: &Answer| answer.found().is_some_and(|found| found.water);
        Ok(Self {
            height_m: found(|height| height.height_m)?,
            bound_m: found(|height| height.bound_m)?,
            sea_level_m: found(|height| height.sea_level_m)?,
            level: array(py, answers.iter().map(level).collect(), shape)?,
            status: array(py, answers.iter().map(status_of).collect(), shape)?,
            water: array(py, answers.iter().map(water).collect(), shape)?,
        })
    }
}

/// The ground below points, as flight models ask for it: arrays of the shape that was asked with,
/// vectors along a last axis of three.
#[pyclass(frozen, get_all, module = "overfly")]
pub struct Contacts {
    /// Height of the point above the surface along the vertical; negative under ground. Metres.
    pub agl_m: Py<PyArrayDyn<f64>>,
    /// Where the vertical meets the surface, body-fixed, in metres.
    pub contact_m: Py<PyArrayDyn<f64>>,
    /// Unit normal of the surface there, outward, body-fixed.
    pub normal: Py<PyArrayDyn<f64>>,
    /// Neither a finer level nor the ground itself is farther than this from the surface. Metres.
    pub bound_m: Py<PyArrayDyn<f64>>,
    /// Members of `Status`.
    pub status: Py<PyArrayDyn<u8>>,
}

impl Contacts {
    /// Answers as columns.
    pub fn of(py: Python<'_>, answers: &[Answer<Contact>], shape: &[usize]) -> PyResult<Self> {
        let found = |of: fn(Contact) -> f64| {
            let column = answers.iter().map(|answer| answer.found().map_or(f64::NAN, of));
            array(py, column.collect(), shape)
        };
        let vectors = |of: fn(Contact) -> DVec3| {
            let column = answers.iter().map(|answer| answer.found().map_or(DVec3::NAN, of));
            array_of_points(py, column, shape)
        };
        Ok(Self {
            agl_m: found(|contact| contact.agl_m)?,
            contact_m: vectors(|contact| contact.contact.0)?,
            normal: vectors(|contact| contact.ground.normal)?,
            bound_m: found(|contact| contact.ground.bound_m)?,
            status: array(py, answers.iter().map(status_of).collect(), shape)?,
        })
    }
}

/// Where a ray first meets the ground; `distance_m` and the like are `None` where it does not.
#[pyclass(frozen, get_all, module = "overfly")]
pub struct Ray {
    /// A member of `Status`. Unless it is 0, finer ground might be in the way.
    pub status: u8,
    /// Distance from the origin in metres; 0 where it is under ground.
    pub distance_m: Option<f64>,
    /// The place, body-fixed, in metres.
    pub point_m: Option<(f64, f64, f64)>,
    /// Unit normal of the surface there, outward, body-fixed.
    pub normal: Option<(f64, f64, f64)>,
    /// Lattice level of the surface there.
    pub level: Option<u8>,
}

impl Ray {
    /// An answer.
    pub fn of(answer: Answer<Option<Hit>>) -> Self {
        let hit = answer.found().flatten();
        Self {
            status: status_of(&answer),
            distance_m: hit.map(|hit| hit.distance_m),
            point_m: hit.map(|hit| hit.point.0.into()),
            normal: hit.map(|hit| hit.normal.into()),
            level: hit.map(|hit| hit.level),
        }
    }
}

/// How much of what heights of a level need in a region is there.
#[pyclass(frozen, get_all, module = "overfly")]
pub struct Readiness {
    /// Share of the needed pages that are there, 0 to 1.
    pub fraction: f64,
    /// The coarsest level that some place has to do with; `None` where a place has none.
    pub worst_level: Option<u8>,
    /// Needed pages that are not there.
    pub missing: u32,
}

impl From<ground::Readiness> for Readiness {
    fn from(found: ground::Readiness) -> Self {
        let ground::Readiness { fraction, worst_level, missing } = found;
        Self { fraction, worst_level, missing }
    }
}
