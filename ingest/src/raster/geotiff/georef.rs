//! Where a GeoTIFF lies: its tags and keys become a grid.
//!
//! In:    tie points and scale or a transformation, and the key directory.
//! Out:   the grid and whether rows must be turned round.
//! Keeps: nothing.
//! Not here: heights (`geotiff`).
//! Source: OGC 19-008r4, GeoTIFF 1.1.

use super::super::{Grid, Projection, RasterError};
use std::path::Path;

/// Plain latitude and longitude on a body whose shape the file itself defines.
const USER_DEFINED: u16 = 32767;

/// Geographic systems that agree with WGS 84 to a few metres or better.
const GEOGRAPHIC: [u16; 4] = [4326, 4258, 4269, 4979];

/// Web Mercator, under its own number and an older one. (900913 does not fit into a key.)
const MERCATOR: [u16; 2] = [3857, 3785];

/// Degrees beyond a grid's proper range that are put down to half a pixel or to rounding.
const LATITUDE_SLACK: f64 = 1.0;

/// The georeferencing tags of one image, as numbers. Empty where a tag is missing.
#[derive(Debug, Default)]
pub(crate) struct GeoTags {
    /// Tag 33550.
    pub pixel_scale: Vec<f64>,
    /// Tag 33922.
    pub tie_points: Vec<f64>,
    /// Tag 34264.
    pub transformation: Vec<f64>,
    /// Tag 34735.
    pub keys: Vec<u16>,
}

/// Pixel (column, row) lies at origin + column · step.
struct Affine {
    origin: [f64; 2],
    step: [f64; 2],
}

/// The grid of an image, and whether its rows run north in the file.
pub(crate) fn grid(
    name: &Path,
    size: [u32; 2],
    tags: &GeoTags,
) -> Result<(Grid, bool), RasterError> {
    let affine = affine(name, tags)?;
    let projection = projection(name, tags)?;
    feet(name, tags)?;
    let Affine { origin, step } = affine;
    // An area's posting is its centre; a point is its posting.
    let half = if tags.key(1025) == Some(2) { 0.0 } else { 0.5 };
    let mut origin = [origin[0] + half * step[0], origin[1] + half * step[1]];
    let flipped = step[1] > 0.0;
    if flipped {
        origin[1] += (f64::from(size[1]) - 1.0) * step[1];
    }
    let grid = Grid::new(projection, size, origin, [step[0], -step[1].abs()]);
    plausible(name, &grid)?;
    Ok((grid, flipped))
}

fn affine(name: &Path, tags: &GeoTags) -> Result<Affine, RasterError> {
    let affine = match (&tags.pixel_scale[..], &tags.tie_points[..], &tags.transformation[..]) {
        ([east, south, ..], [column, row, _, x, y, _, ..], _) => {
            let step = [*east, -*south];
            Affine { origin: [x - column * step[0], y - row * step[1]], step }
        }
        (_, _, [a, b, _, x, d, e, _, y, ..]) => {
            if *b != 0.0 || *d != 0.0 {
                return Err(refused(name, "the raster is rotated", None));
            }
            Affine { origin: [*x, *y], step: [*a, *e] }
        }
        _ => {
            let advice = "say where it lies: gdal_translate -a_srs EPSG:4326 \
                          -a_ullr WEST NORTH EAST SOUTH in.tif out.tif";
            return Err(RasterError::unsupported(name, "no georeferencing", advice));
        }
    };
    let numbers = affine.origin.iter().chain(&affine.step);
    let sound = numbers.into_iter().all(|number| number.is_finite() && number.abs() < 1e9);
    if !sound || affine.step.iter().any(|step| step.abs() < 1e-9) {
        let Affine { origin, step } = affine;
        let found = format!("its georeferencing makes no sense: origin {origin:?}, step {step:?}");
        return Err(RasterError::broken(name, found));
    }
    if affine.step[0] < 0.0 {
        return Err(refused(name, "columns run west", None));
    }
    Ok(affine)
}

fn projection(name: &Path, tags: &GeoTags) -> Result<Projection, RasterError> {
    let (geographic, projected) = (tags.key(2048), tags.key(3072));
    let model = tags.key(1024).unwrap_or(if projected.is_some() { 1 } else { 2 });
    match (model, projected, geographic) {
        (1, Some(code), _) if MERCATOR.contains(&code) => Ok(Projection::WebMercator),
        (1, Some(code), _) => Err(refused(name, "", Some(code))),
        (1, None, _) => Err(refused(name, "", Some(USER_DEFINED))),
        (2, _, None) if tags.keys.is_empty() => {
            let advice =
                "if it is in degrees, say so: gdal_translate -a_srs EPSG:4326 in.tif out.tif";
            Err(RasterError::unsupported(name, "no coordinate system", advice))
        }
        (2, _, code)
            if code.is_none_or(|code| code == USER_DEFINED || GEOGRAPHIC.contains(&code)) =>
        {
            match tags.key(2054) {
                None | Some(9102 | 9122) => Ok(Projection::PlateCarree),
                Some(unit) => {
                    Err(refused(name, &format!("angles in unit {unit}, not degrees"), None))
                }
            }
        }
        (2, _, code) => Err(refused(name, "", code)),
        (model, _, _) => Err(refused(name, &format!("coordinates of model type {model}"), None)),
    }
}

/// A refusal with the line that converts the file.
fn refused(name: &Path, found: &str, code: Option<u16>) -> RasterError {
    let input = name.file_name().unwrap_or_default().to_string_lossy();
    let stem = name.file_stem().unwrap_or_default().to_string_lossy();
    let (found, system) = match code {
        Some(USER_DEFINED) => {
            ("a projection of its own".to_owned(), "'+proj=longlat +R=RADIUS_IN_METRES +no_defs'")
        }
        Some(code) => (format!("EPSG:{code} is not supported"), "EPSG:4326"),
        None => (found.to_owned(), "EPSG:4326"),
    };
    let advice =
        format!("convert it first: gdalwarp -t_srs {system} -r bilinear {input} {stem}_4326.tif");
    RasterError::unsupported(name, found, advice)
}

/// Heights in feet would be taken for metres.
fn feet(name: &Path, tags: &GeoTags) -> Result<(), RasterError> {
    match tags.key(4099) {
        None | Some(0 | 9001 | USER_DEFINED) => Ok(()),
        Some(unit) => {
            let found = format!("heights in unit EPSG:{unit}, not metres");
            let advice =
                "convert them: gdal_calc.py -A in.tif --calc=A*METRES_PER_UNIT --outfile=out.tif";
            Err(RasterError::unsupported(name, found, advice))
        }
    }
}

fn plausible(name: &Path, grid: &Grid) -> Result<(), RasterError> {
    let south = grid.origin[1] + f64::from(grid.rows - 1) * grid.step[1];
    let width = f64::from(grid.columns) * grid.step[0];
    let [west, north] = grid.origin;
    let (most_width, most_west, most_north) = match grid.projection {
        Projection::PlateCarree => (361.0, 540.0, 90.0 + LATITUDE_SLACK),
        Projection::WebMercator => (4.02e7, 6.1e7, 1.0e8),
    };
    let fits = width <= most_width + grid.step[0]
        && west.abs() <= most_west
        && north <= most_north
        && south >= -most_north;
    if fits {
        return Ok(());
    }
    let found = format!(
        "it claims to reach from {west} east for {width} and from {north} to {south} north, \
         which no {:?} grid does",
        grid.projection
    );
    Err(RasterError::broken(name, found))
}

impl GeoTags {
    /// Whether the file says anything of where it lies.
    pub fn is_empty(&self) -> bool {
        self.pixel_scale.is_empty()
            && self.tie_points.is_empty()
            && self.transformation.is_empty()
            && self.keys.is_empty()
    }

    /// The value of a short key. Keys whose values lie in other tags are no numbers we need.
    fn key(&self, wanted: u16) -> Option<u16> {
        let entries = self.keys.get(4..)?.chunks_exact(4);
        entries.filter(|entry| entry[0] == wanted && entry[1] == 0).map(|entry| entry[3]).next()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tags(keys: &[[u16; 2]]) -> GeoTags {
        let mut list = vec![1, 1, 0, u16::try_from(keys.len()).unwrap()];
        for [key, value] in keys {
            list.extend([*key, 0, 1, *value]);
        }
        GeoTags {
            pixel_scale: vec![0.1, 0.2, 0.0],
            tie_points: vec![0.0, 0.0, 0.0, 10.0, 50.0, 0.0],
            transformation: Vec::new(),
            keys: list,
        }
    }

    fn message(keys: &[[u16; 2]]) -> String {
        grid(Path::new("dir/in.tif"), [10, 10], &tags(keys)).unwrap_err().to_string()
    }

    #[test]
    fn areas_shift_by_half_a_pixel_and_points_do_not() {
        let name = Path::new("in.tif");
        let (area, _) = grid(name, [10, 10], &tags(&[[1024, 2], [1025, 1], [2048, 4326]])).unwrap();
        let (point, _) =
            grid(name, [10, 10], &tags(&[[1024, 2], [1025, 2], [2048, 4326]])).unwrap();
        assert_eq!(area.origin, [10.05, 49.9]);
        assert_eq!(point.origin, [10.0, 50.0]);
        assert_eq!(area.step, [0.1, -0.2]);
    }

    #[test]
    fn a_tie_point_may_be_any_pixel() {
        let mut tags = tags(&[[1024, 2], [1025, 2], [2048, 4326]]);
        tags.tie_points = vec![5.0, 5.0, 0.0, 10.5, 49.0, 0.0];
        let (grid, flipped) = grid(Path::new("in.tif"), [10, 10], &tags).unwrap();
        assert_eq!((grid.origin, flipped), ([10.0, 50.0], false));
    }

    #[test]
    fn rows_that_run_north_are_turned_round() {
        let mut tags = tags(&[[1024, 2], [1025, 2], [2048, 4326]]);
        tags.pixel_scale.clear();
        tags.transformation =
            vec![0.5, 0.0, 0.0, 7.0, 0.0, 0.25, 0.0, 40.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        let (grid, flipped) = grid(Path::new("in.tif"), [10, 5], &tags).unwrap();
        assert!(flipped);
        assert_eq!((grid.origin, grid.step), ([7.0, 41.0], [0.5, -0.25]));
    }

    #[test]
    fn planetary_degrees_pass_and_planetary_metres_do_not() {
        let body = [[1024, 2], [2048, 32767], [2054, 9102]];
        assert!(grid(Path::new("mars.tif"), [10, 10], &tags(&body)).is_ok());
        let message = message(&[[1024, 1], [2048, 32767], [3072, 32767]]);
        assert!(message.contains("gdalwarp -t_srs '+proj=longlat +R="), "{message}");
    }

    #[test]
    fn other_systems_are_refused_with_their_code_and_the_line_that_helps() {
        let message = message(&[[1024, 1], [3072, 32633]]);
        let wanted = "dir/in.tif: EPSG:32633 is not supported; convert it first: \
                      gdalwarp -t_srs EPSG:4326 -r bilinear in.tif in_4326.tif";
        assert_eq!(message, wanted);
        assert!(self::message(&[[1024, 2], [2048, 4267]]).contains("EPSG:4267"));
        let nothing = GeoTags { keys: Vec::new(), ..tags(&[]) };
        let error = grid(Path::new("in.tif"), [10, 10], &nothing).unwrap_err();
        assert!(error.to_string().contains("no coordinate system"), "{error}");
    }

    #[test]
    fn rotation_feet_and_missing_places_are_refused() {
        let name = Path::new("in.tif");
        let mut rotated = tags(&[[1024, 2], [2048, 4326]]);
        rotated.pixel_scale.clear();
        rotated.transformation = vec![0.5, 0.1, 0.0, 7.0, 0.0, 0.25, 0.0, 40.0];
        assert!(grid(name, [9, 9], &rotated).unwrap_err().to_string().contains("rotated"));
        assert!(message(&[[1024, 2], [2048, 4326], [4099, 9002]]).contains("not metres"));
        let nowhere = GeoTags::default();
        let message = grid(name, [9, 9], &nowhere).unwrap_err().to_string();
        assert!(message.contains("no georeferencing") && message.contains("-a_ullr"), "{message}");
    }

    #[test]
    fn metres_that_claim_to_be_degrees_are_refused() {
        let mut tags = tags(&[[1024, 2], [2048, 4326]]);
        tags.tie_points[4] = 5_000_000.0;
        let message = grid(Path::new("in.tif"), [9, 9], &tags).unwrap_err().to_string();
        assert!(message.contains("PlateCarree"), "{message}");
    }
}
