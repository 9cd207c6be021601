//! Places as latitude, longitude and height, and as body-fixed points.
//!
//! In:    arrays of degrees and metres.
//! Out:   arrays in the other form.
//! Keeps: nothing.
//! Not here: the formulas (`overfly_core::geodesy`).

use crate::arrays::{Numbers, array, array_of_points, places_at, points};
use crate::raised::refused;
use numpy::PyArrayDyn;
use overfly::core::geodesy::{Ecef, Ellipsoid};
use pyo3::prelude::*;

type Array = Py<PyArrayDyn<f64>>;

/// An ellipsoid from equatorial radius and flattening; nothing is WGS 84.
fn body_of(body: Option<(f64, f64)>) -> PyResult<Ellipsoid> {
    let Some((a_m, f)) = body else { return Ok(Ellipsoid::WGS84) };
    if (1.0..=1e12).contains(&a_m) && (-0.5..=0.5).contains(&f) {
        return Ok(Ellipsoid { a_m, f });
    }
    let allowed = "allowed are a radius from 1 to 1e12 m and a flattening from -0.5 to 0.5";
    Err(refused(format!("body is ({a_m}, {f}), {allowed}")))
}

/// Body-fixed points of latitudes, longitudes and heights above the ellipsoid.
///
/// `body` is equatorial radius in metres and flattening, as `Terrain.body`; WGS 84 where it is not
/// given. Error: rounding alone, below 4 nm.
///
/// >>> import overfly
/// >>> overfly.ecef_from_geodetic(0.0, 90.0, 10.0).round(3).tolist()
/// [0.0, 6378147.0, 0.0]
#[pyfunction]
#[pyo3(signature = (lat_deg, lon_deg, height_m, *, body=None))]
pub fn ecef_from_geodetic(
    py: Python<'_>,
    lat_deg: Numbers<'_>,
    lon_deg: Numbers<'_>,
    height_m: Numbers<'_>,
    body: Option<(f64, f64)>,
) -> PyResult<Array> {
    let body = body_of(body)?;
    let (places, shape) = places_at(&lat_deg, &lon_deg, &height_m)?;
    let points = places.into_iter().map(|at| body.ecef_from_geodetic(at).0);
    array_of_points(py, points, &shape)
}

/// Latitudes, longitudes and heights above the ellipsoid of body-fixed points, which are given as
/// x, y and z along the last axis. Defined everywhere, the poles and the centre included.
///
/// >>> import overfly
/// >>> lat_deg, lon_deg, height_m = overfly.geodetic_from_ecef([0.0, 6378147.0, 0.0])
/// >>> print(f"{lat_deg:.6f} {lon_deg:.6f} {height_m:.3f}")
/// 0.000000 90.000000 10.000
#[pyfunction]
#[pyo3(signature = (ecef_m, *, body=None))]
pub fn geodetic_from_ecef(
    py: Python<'_>,
    ecef_m: Numbers<'_>,
    body: Option<(f64, f64)>,
) -> PyResult<(Array, Array, Array)> {
    let body = body_of(body)?;
    let (points, shape) = points("ecef_m", &ecef_m)?;
    let places: Vec<_> = points.into_iter().map(|p| body.geodetic_from_ecef(Ecef(p))).collect();
    let degrees = 180.0 / core::f64::consts::PI;
    let lats = places.iter().map(|at| at.lat_rad * degrees).collect();
    let lons = places.iter().map(|at| at.lon_rad * degrees).collect();
    let heights = places.iter().map(|at| at.height_m).collect();
    Ok((array(py, lats, &shape)?, array(py, lons, &shape)?, array(py, heights, &shape)?))
}
