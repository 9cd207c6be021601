//! Pictures of a measured flight: over the worst view, along the flight, on its map.
//!
//! In:    facts, errors, E1 of every ray of the worst frame.
//! Out:   three PNG files.
//! Keeps: nothing.
//! Not here: points and letters (`canvas`).

use super::Facts;
use super::canvas::Canvas;
use crate::cli::Failure;
use overfly::replay::measure::{FlightErrors, FrameErrors};
use plotters::prelude::*;
use std::path::{Path, PathBuf};

/// The frame with the greatest error, and E1 of its rays, so many in a row.
pub struct Worst {
    /// Its errors.
    pub frame: FrameErrors,
    /// Rays in a row, and E1 of all, negative where there is none.
    pub map: (usize, Vec<f64>),
}

const SIZE_PX: [u32; 2] = [1280, 800];
const SMALL: (&str, i32) = ("", 12);
/// As small, with room around: what a legend's box is reckoned from.
const LEGEND: (&str, i32) = ("", 16);
const LARGE: (&str, i32) = ("", 22);

/// Writes the pictures into a folder.
pub fn write(
    folder: &Path,
    facts: &Facts,
    errors: &FlightErrors,
    worst: Option<&Worst>,
) -> Result<Vec<PathBuf>, Failure> {
    let Some(worst) = worst else { return Ok(Vec::new()) };
    let mut canvas = Canvas::new(SIZE_PX);
    heat(&mut canvas, facts, worst)?;
    let view = folder.join("error-view.png");
    canvas.write(&view)?;
    let mut canvas = Canvas::new(SIZE_PX);
    along(&mut canvas, facts, errors)?;
    let flight = folder.join("error-flight.png");
    canvas.write(&flight)?;
    let mut canvas = Canvas::new(SIZE_PX);
    map(&mut canvas, facts, errors)?;
    let place = folder.join("error-map.png");
    canvas.write(&place)?;
    Ok(vec![view, flight, place])
}

/// Dark blue, over green and yellow, to red: 0 to 1.
fn colour(share: f64) -> RGBColor {
    const STOPS: [[f64; 3]; 5] = [
        [38.0, 30.0, 92.0],
        [34.0, 110.0, 142.0],
        [60.0, 170.0, 110.0],
        [240.0, 210.0, 60.0],
        [200.0, 30.0, 30.0],
    ];
    let at = share.clamp(0.0, 1.0) * 4.0;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
    let low = (at as usize).min(3);
    let part = at - low as f64;
    let mixed = [0, 1, 2].map(|i: usize| {
        let mixed = STOPS[low][i] * (1.0 - part) + STOPS[low + 1][i] * part;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a byte")]
        let mixed = mixed as u8;
        mixed
    });
    RGBColor(mixed[0], mixed[1], mixed[2])
}

/// A bar of all colours at the right, with what they stand for.
fn scale(canvas: &mut Canvas, most: f64) -> Result<(), Failure> {
    let area = canvas.into_drawing_area();
    let (left, top, bottom) = (1196, 80, 740);
    for y in top..bottom {
        let share = f64::from(bottom - y) / f64::from(bottom - top);
        let row = [(left, y), (left + 18, y + 1)];
        area.draw(&Rectangle::new(row, colour(share).filled()))?;
    }
    for step in 0..=4 {
        let y = bottom - (bottom - top) * step / 4;
        let label = format!("{:.2}", most * f64::from(step) / 4.0);
        area.draw(&Text::new(label, (left + 24, y - 4), SMALL))?;
    }
    area.draw(&Text::new("px", (left, top - 18), SMALL))?;
    Ok(())
}

/// E1 over the view of the worst frame.
fn heat(canvas: &mut Canvas, facts: &Facts, worst: &Worst) -> Result<(), Failure> {
    let (columns, values) = &worst.map;
    let frame = &worst.frame;
    let rows = values.len() / (*columns).max(1);
    let [width, height] = facts.size_px.map(f64::from);
    let scale_px = (1150.0 / width).min(680.0 / height);
    let (left, top) = (24.0, 80.0);
    let area = canvas.into_drawing_area();
    let title = format!(
        "E1 in frame {} of {}: rms {:.3}, max {:.3} px; certain {:.3} px",
        frame.frame, facts.flight, frame.e1_px.rms, frame.e1_px.max, frame.bound_px
    );
    area.draw(&Text::new(title, (24, 24), LARGE))?;
    area.draw(&Text::new("grey: no ground; cross: the worst ray", (24, 54), SMALL))?;
    #[expect(clippy::cast_possible_truncation, reason = "within the picture")]
    let corner = |column: usize, row: usize| {
        let x = left + column as f64 / *columns as f64 * width * scale_px;
        let y = top + row as f64 / rows as f64 * height * scale_px;
        (x.round() as i32, y.round() as i32)
    };
    for (at, &value) in values.iter().enumerate() {
        let (column, row) = (at % columns, at / columns);
        let (low, high) = (corner(column, row), corner(column + 1, row + 1));
        let fill = if value < 0.0 {
            RGBColor(200, 205, 212)
        } else {
            colour(value / frame.e1_px.max.max(1e-9))
        };
        area.draw(&Rectangle::new([low, (high.0.max(low.0), high.1)], fill.filled()))?;
    }
    let [x, y] = frame.e1_px.at.pixel;
    #[expect(clippy::cast_possible_truncation, reason = "within the picture")]
    let worst = ((left + x * scale_px) as i32, (top + y * scale_px) as i32);
    area.draw(&Cross::new(worst, 7, WHITE.stroke_width(3)))?;
    area.draw(&Cross::new(worst, 6, BLACK.stroke_width(1)))?;
    drop(area);
    scale(canvas, frame.e1_px.max)
}

/// The least and greatest of some numbers, with room around.
fn range(values: impl Iterator<Item = f64>, room: f64) -> core::ops::Range<f64> {
    let finite = values.filter(|value| value.is_finite());
    let [low, high] = finite.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
        [low.min(value), high.max(value)]
    });
    if low > high {
        return 0.0..1.0;
    }
    let room = ((high - low) * room).max(1e-6 * high.abs().max(1.0));
    low - room..high + room
}

/// E1 and its bound along the flight; under it the ground and the eye.
fn along(canvas: &mut Canvas, facts: &Facts, errors: &FlightErrors) -> Result<(), Failure> {
    let area = canvas.into_drawing_area();
    let (upper, lower) = area.split_vertically(470);
    let frames = &errors.frames;
    let (first, last) = (frames[0].frame as f64, frames[frames.len() - 1].frame as f64);
    let along = first..last.max(first + 1.0);
    let line = |of: OfFrame| frames.iter().map(move |frame| (frame.frame as f64, of(frame)));
    let top_px = frames.iter().map(|f| f.e1_px.max.max(f.bound_px)).fold(0.0, f64::max) * 1.05;
    let title = format!("{} over {}: radial error, px", facts.flight, facts.scene_name);
    let mut chart = ChartBuilder::on(&upper)
        .caption(title, LARGE)
        .margin(14)
        .margin_right(30)
        .x_label_area_size(28)
        .y_label_area_size(76)
        .build_cartesian_2d(along.clone(), 0.0..top_px.max(1e-6))?;
    let whole = |value: &f64| format!("{value:.0}");
    let hundredths = |value: &f64| format!("{value:.2}");
    chart
        .configure_mesh()
        .label_style(SMALL)
        .light_line_style(TRANSPARENT)
        .x_label_formatter(&whole)
        .y_label_formatter(&hundredths)
        .draw()?;
    let certain = RGBColor(120, 120, 130);
    let series: [(&str, RGBColor, OfFrame); 4] = [
        ("certain", certain, |frame| frame.bound_px),
        ("E1 max", RGBColor(200, 40, 40), |frame| frame.e1_px.max),
        ("E1 p99", RGBColor(220, 150, 30), |frame| frame.e1_px.p99),
        ("E1 rms", RGBColor(30, 90, 180), |frame| frame.e1_px.rms),
    ];
    for (name, colour, of) in series {
        let drawn = chart.draw_series(LineSeries::new(line(of), colour.stroke_width(2)))?;
        let mark =
            move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], colour.stroke_width(2));
        drawn.label(name).legend(mark);
    }
    let labels = chart.configure_series_labels();
    { labels }
        .position(SeriesLabelPosition::UpperRight)
        .label_font(LEGEND)
        .background_style(WHITE.mix(0.85))
        .border_style(certain)
        .draw()?;
    profile(&lower, errors, along)
}

type OfFrame = fn(&FrameErrors) -> f64;

/// Powers of ten.
const ZOOMS: [f64; 7] = [1.0, 10.0, 1e2, 1e3, 1e4, 1e5, 1e6];

type Area<'a> = DrawingArea<&'a mut Canvas, plotters::coord::Shift>;

/// Ground and eye along the flight.
fn profile(
    area: &Area<'_>,
    errors: &FlightErrors,
    along: core::ops::Range<f64>,
) -> Result<(), Failure> {
    let frames = &errors.frames;
    let eye = |frame: &FrameErrors| frame.eye[2];
    let ground = |frame: &FrameErrors| frame.eye[2] - frame.above_m;
    let heights = range(frames.iter().flat_map(|f| [eye(f), ground(f)]), 0.06);
    let floor = heights.start;
    let mut chart = ChartBuilder::on(area)
        .caption("ground and eye, metres; frames of the flight below", SMALL)
        .margin(14)
        .margin_right(30)
        .x_label_area_size(28)
        .y_label_area_size(76)
        .build_cartesian_2d(along, heights)?;
    let whole = |value: &f64| format!("{value:.0}");
    chart
        .configure_mesh()
        .label_style(SMALL)
        .light_line_style(TRANSPARENT)
        .x_label_formatter(&whole)
        .y_label_formatter(&whole)
        .draw()?;
    let brown = RGBColor(130, 105, 80);
    let known = frames.iter().filter(|frame| frame.above_m.is_finite());
    let below = known.map(|frame| (frame.frame as f64, ground(frame)));
    chart.draw_series(AreaSeries::new(below, floor, brown.mix(0.6)).border_style(brown))?;
    let above = frames.iter().map(|frame| (frame.frame as f64, eye(frame)));
    chart.draw_series(LineSeries::new(above, BLACK.stroke_width(2)))?;
    Ok(())
}

/// The flight from above, each measured frame in the colour of its greatest error.
fn map(canvas: &mut Canvas, facts: &Facts, errors: &FlightErrors) -> Result<(), Failure> {
    let track = unwrapped(errors);
    let most = errors.frames.iter().map(|f| f.e1_px.max).fold(0.0, f64::max);
    let area = canvas.into_drawing_area();
    let (left, _) = area.split_horizontally(1170);
    let [lon, lat] = square(&track, [1020.0, 680.0]);
    let span = lat.end - lat.start;
    let digits = (1..7).find(|&digits| span * ZOOMS[digits] > 40.0).unwrap_or(7);
    let title = format!("{} over {}: E1 max by frame", facts.flight, facts.scene_name);
    let mut chart = ChartBuilder::on(&left)
        .caption(title, LARGE)
        .margin(14)
        .x_label_area_size(48)
        .y_label_area_size(110)
        .build_cartesian_2d(lon, lat)?;
    let degrees = |value: &f64| format!("{value:.digits$}");
    chart
        .configure_mesh()
        .label_style(SMALL)
        .light_line_style(TRANSPARENT)
        .x_label_formatter(&degrees)
        .y_label_formatter(&degrees)
        .x_desc("longitude, degrees east")
        .y_desc("latitude, degrees")
        .axis_desc_style(SMALL)
        .draw()?;
    let grey = RGBColor(170, 170, 176);
    chart.draw_series(LineSeries::new(track.iter().copied(), grey))?;
    // The worst frames come last, on top.
    let mut order: Vec<usize> = (0..track.len()).collect();
    order.sort_by(|&a, &b| errors.frames[a].e1_px.max.total_cmp(&errors.frames[b].e1_px.max));
    let dots = order.into_iter().map(|at| {
        let share = errors.frames[at].e1_px.max / most.max(1e-9);
        Circle::new(track[at], 4, colour(share).filled())
    });
    chart.draw_series(dots)?;
    drop(chart);
    drop((left, area));
    scale(canvas, most)
}

/// Longitude and latitude of each frame; longitudes go on across the antimeridian.
fn unwrapped(errors: &FlightErrors) -> Vec<(f64, f64)> {
    let mut turns = 0.0;
    let mut before = f64::NAN;
    let place = |frame: &FrameErrors| {
        let [lat, lon, _] = frame.eye;
        let step = lon - before;
        if step > 180.0 {
            turns -= 360.0;
        } else if step < -180.0 {
            turns += 360.0;
        }
        before = lon;
        (lon + turns, lat)
    };
    errors.frames.iter().map(place).collect()
}

/// Ranges of longitude and latitude in which a metre is as long both ways, but near the poles.
fn square(track: &[(f64, f64)], size_px: [f64; 2]) -> [core::ops::Range<f64>; 2] {
    let lon = range(track.iter().map(|place| place.0), 0.05);
    let lat = range(track.iter().map(|place| place.1), 0.05);
    let middle = [f64::midpoint(lon.start, lon.end), f64::midpoint(lat.start, lat.end)];
    let shrink = overfly::core::geodesy::trig::cos(middle[1].to_radians()).max(0.05);
    let per_px = ((lon.end - lon.start) * shrink / size_px[0])
        .max((lat.end - lat.start) / size_px[1])
        .max(1e-6);
    let half = [per_px / shrink * size_px[0] / 2.0, per_px * size_px[1] / 2.0];
    [0, 1].map(|i: usize| middle[i] - half[i]..middle[i] + half[i])
}
