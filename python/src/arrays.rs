//! Numbers in from numpy, checked and copied; columns out to numpy.
//!
//! In:    arrays, sequences or numbers.
//! Out:   columns with the shape that they came in; arrays of that shape.
//! Keeps: nothing.
//! Not here: what the numbers mean.

use crate::raised::refused;
use glam::DVec3;
use numpy::{AllowTypeChange, Element, IxDyn, PyArray1, PyArrayDyn, PyArrayLikeDyn};
use numpy::{PyArrayMethods, PyUntypedArrayMethods};
use overfly::core::geodesy::Geodetic;
use pyo3::prelude::*;

/// Whatever numpy can make float64 of.
pub type Numbers<'py> = PyArrayLikeDyn<'py, f64, AllowTypeChange>;

/// What a number is called, and the least and the greatest that it may be.
pub type Range = (&'static str, [f64; 2]);

/// Latitudes.
pub const LATITUDE: Range = ("lat_deg", [-90.0, 90.0]);
/// Longitudes.
pub const LONGITUDE: Range = ("lon_deg", [-180.0, 360.0]);
/// Heights above the ellipsoid.
pub const HEIGHT: Range = ("height_m", [-1e7, 1e12]);
/// Coordinates of points.
const COORDINATE_MAX_M: f64 = 1e15;

/// A number within its range.
pub fn checked((name, [least, most]): Range, value: f64) -> PyResult<f64> {
    if (least..=most).contains(&value) {
        return Ok(value);
    }
    Err(refused(format!("{name} is {value}, allowed is {least:?} to {most:?}")))
}

/// Numbers, row by row.
fn column((name, [least, most]): Range, numbers: &Numbers<'_>) -> PyResult<Vec<f64>> {
    let values: Vec<f64> = numbers.as_array().iter().copied().collect();
    let wrong = values.iter().position(|value| !(least..=most).contains(value));
    let Some(index) = wrong else { return Ok(values) };
    let place = place_of(index, numbers.shape());
    let value = values[index];
    Err(refused(format!("{name}{place} is {value}, allowed is {least:?} to {most:?}")))
}

/// `[2, 0]` of an array, nothing of a single number.
fn place_of(mut index: usize, shape: &[usize]) -> String {
    let mut place: Vec<usize> = Vec::new();
    for &side in shape.iter().rev() {
        place.push(index % side);
        index /= side;
    }
    place.reverse();
    if place.is_empty() { String::new() } else { format!("{place:?}") }
}

/// Numbers that belong together have one shape.
fn check_shapes(a: (&str, &[usize]), b: (&str, &[usize])) -> PyResult<()> {
    if a.1 == b.1 {
        return Ok(());
    }
    let ((a, a_shape), (b, b_shape)) = (a, b);
    Err(refused(format!("{a} has shape {a_shape:?} and {b} {b_shape:?}, allowed are equal ones")))
}

/// One place on the ellipsoid.
pub fn place(lat_deg: f64, lon_deg: f64) -> PyResult<Geodetic> {
    let (lat_deg, lon_deg) = (checked(LATITUDE, lat_deg)?, checked(LONGITUDE, lon_deg)?);
    Ok(Geodetic::from_degrees(lat_deg, lon_deg, 0.0))
}

/// Places on the ellipsoid, and their shape.
pub fn places(lat: &Numbers<'_>, lon: &Numbers<'_>) -> PyResult<(Vec<Geodetic>, Vec<usize>)> {
    check_shapes((LATITUDE.0, lat.shape()), (LONGITUDE.0, lon.shape()))?;
    let (lats, lons) = (column(LATITUDE, lat)?, column(LONGITUDE, lon)?);
    let place = |(lat, lon)| Geodetic::from_degrees(lat, lon, 0.0);
    Ok((lats.into_iter().zip(lons).map(place).collect(), lat.shape().to_vec()))
}

/// Places at heights, and their shape.
pub fn places_at(
    lat: &Numbers<'_>,
    lon: &Numbers<'_>,
    height: &Numbers<'_>,
) -> PyResult<(Vec<Geodetic>, Vec<usize>)> {
    check_shapes((LATITUDE.0, lat.shape()), (HEIGHT.0, height.shape()))?;
    let (mut places, shape) = places(lat, lon)?;
    for (place, height_m) in places.iter_mut().zip(column(HEIGHT, height)?) {
        place.height_m = height_m;
    }
    Ok((places, shape))
}

/// Points, x, y and z along the last axis, and the shape without that axis.
pub fn points(name: &'static str, numbers: &Numbers<'_>) -> PyResult<(Vec<DVec3>, Vec<usize>)> {
    let shape = numbers.shape();
    let Some((3, outer)) = shape.split_last() else {
        let found = format!("{name} has shape {shape:?}");
        return Err(refused(format!("{found}, allowed is x, y and z along the last axis")));
    };
    let values = column((name, [-COORDINATE_MAX_M, COORDINATE_MAX_M]), numbers)?;
    let points = values.chunks_exact(3).map(DVec3::from_slice).collect();
    Ok((points, outer.to_vec()))
}

/// One point.
pub fn point(name: &'static str, numbers: &Numbers<'_>) -> PyResult<DVec3> {
    let (points, outer) = points(name, numbers)?;
    match (&points[..], &outer[..]) {
        (&[point], []) => Ok(point),
        _ => Err(refused(format!(
            "{name} has shape {:?}, allowed is x, y and z of one point",
            numbers.shape()
        ))),
    }
}

/// An array of some shape, its values row by row.
pub fn array<T: Element>(
    py: Python<'_>,
    values: Vec<T>,
    shape: &[usize],
) -> PyResult<Py<PyArrayDyn<T>>> {
    Ok(PyArray1::from_vec(py, values).reshape(IxDyn(shape))?.unbind())
}

/// Points as an array, x, y and z along its last axis.
pub fn array_of_points(
    py: Python<'_>,
    points: impl Iterator<Item = DVec3>,
    outer: &[usize],
) -> PyResult<Py<PyArrayDyn<f64>>> {
    let values = points.flat_map(|point| point.to_array()).collect();
    array(py, values, &[outer, &[3]].concat())
}
