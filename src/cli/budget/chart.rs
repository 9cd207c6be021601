//! Charts of a run, as SVG that needs nothing beside it.
//!
//! In:    columns of frames.
//! Out:   `svg` elements; their colours are those of the page's style.
//! Keeps: nothing.
//! Not here: the page around them (`html`).

use crate::cli::trade::plot::{self, escaped};
use std::fmt::Write;

/// Width of all charts; those of frames lie exactly above each other.
const WIDTH: f64 = 1000.0;
const LEFT: f64 = 62.0;
const RIGHT: f64 = 12.0;
/// Room for a title above and for numbers below.
const TOP: f64 = 26.0;
const BOTTOM: f64 = 24.0;

/// A linear axis: from and to, in numbers and on the page.
#[derive(Clone, Copy)]
struct Axis {
    from: f64,
    to: f64,
    page: [f64; 2],
}

impl Axis {
    fn place(&self, value: f64) -> f64 {
        let share = (value - self.from) / (self.to - self.from).max(1e-300);
        self.page[0] + share.clamp(0.0, 1.0) * (self.page[1] - self.page[0])
    }

    /// Some five round numbers.
    fn ticks(&self) -> Vec<f64> {
        let rough = (self.to - self.from) / 5.0;
        if !(rough > 0.0 && rough.is_finite()) {
            return Vec::new();
        }
        let power: f64 = (-12..=15)
            .map(|power| format!("1e{power}").parse().expect("a number"))
            .take_while(|&power: &f64| power <= rough)
            .last()
            .unwrap_or(1e-12);
        let step = [1.0, 2.0, 5.0, 10.0].map(|by| by * power);
        let step = step.into_iter().find(|&step| step >= rough).unwrap_or(rough);
        let first = (self.from / step).ceil();
        let tick = |i: u32| (first + f64::from(i)) * step;
        (0..20).map(tick).take_while(|&tick| tick <= self.to).collect()
    }
}

/// Seconds along the flight, from the first frame to the last.
#[derive(Clone, Copy)]
pub struct Along {
    pub frames: usize,
    pub first_s: f64,
    pub last_s: f64,
}

impl Along {
    fn axis(&self) -> Axis {
        let to = self.last_s.max(self.first_s + 1e-3);
        Axis { from: self.first_s, to, page: [LEFT, WIDTH - RIGHT] }
    }

    /// Where a frame lies; frames are taken to be equally long.
    fn x(&self, frame: f64) -> f64 {
        let share = frame / (self.frames.max(2) - 1) as f64;
        LEFT + share.clamp(0.0, 1.0) * (WIDTH - RIGHT - LEFT)
    }
}

/// A number of an axis or of a count; both may be 0, which logarithmic axes never are.
fn number(value: f64) -> String {
    if value == 0.0 { "0".into() } else { plot::number(value) }
}

fn put(out: &mut String, text: std::fmt::Arguments<'_>) {
    out.write_fmt(text).expect("a text grows");
}

fn open(title: &str, height: f64) -> String {
    let title = escaped(title);
    format!(
        "<svg viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{title}\">\n\
         <text class=\"title\" x=\"{LEFT}\" y=\"17\">{title}</text>\n"
    )
}

/// Grid and numbers of both axes.
fn grid(out: &mut String, x: &Axis, y: &Axis) {
    let (top, bottom) = (y.page[1], y.page[0]);
    for value in x.ticks() {
        let at = x.place(value);
        put(out, format_args!("<path class=\"grid\" d=\"M{at:.1} {top}V{bottom}\"/>"));
        let (down, text) = (bottom + 15.0, number(value));
        put(out, format_args!("<text class=\"x\" x=\"{at:.1}\" y=\"{down}\">{text}</text>\n"));
    }
    for value in y.ticks() {
        let at = y.place(value);
        let (left, right) = (x.page[0], x.page[1]);
        put(out, format_args!("<path class=\"grid\" d=\"M{left} {at:.1}H{right}\"/>"));
        let (aside, down, text) = (left - 6.0, at + 4.0, number(value));
        put(out, format_args!("<text class=\"y\" x=\"{aside}\" y=\"{down:.1}\">{text}</text>\n"));
    }
}

/// Frames of each of `count` stretches of about equal length.
fn stretches(frames: usize, count: usize) -> impl Iterator<Item = std::ops::Range<usize>> {
    let count = count.min(frames).max(1);
    (0..count).map(move |i| i * frames / count..(i + 1) * frames / count)
}

/// Least and most of each stretch, so that no hitch is lost; a limit is a dashed line.
pub fn band(title: &str, along: Along, column: &[f64], limits: &[f64]) -> String {
    let height = 260.0;
    let mut out = open(title, height);
    let most = column.iter().copied().fold(1e-6, f64::max);
    let y = Axis { from: 0.0, to: most * 1.05, page: [height - BOTTOM, TOP] };
    grid(&mut out, &along.axis(), &y);
    let (mut path, mut tops) = (String::new(), Vec::new());
    for stretch in stretches(column.len(), 900) {
        let middle = (stretch.start + stretch.end - 1) as f64 / 2.0;
        let values = &column[stretch];
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let most = values.iter().copied().fold(0.0, f64::max);
        // A single frame is a dot of one pixel.
        let (low, high) = (y.place(least) + 0.5, y.place(most) - 0.5);
        put(&mut path, format_args!("M{:.1} {low:.1}V{high:.1}", along.x(middle)));
        tops.push(format!("{:.1},{high:.1}", along.x(middle)));
    }
    let tops = tops.join(" ");
    put(&mut out, format_args!("<polyline class=\"tops\" points=\"{tops}\"/>\n"));
    put(&mut out, format_args!("<path class=\"band\" d=\"{path}\"/>\n"));
    for &limit in limits.iter().filter(|&&limit| limit <= y.to) {
        let (at, right) = (y.place(limit), WIDTH - RIGHT);
        put(&mut out, format_args!("<path class=\"limit\" d=\"M{LEFT} {at:.1}H{right}\"/>\n"));
    }
    out.push_str("</svg>\n");
    out
}

/// The ground beneath the eye as an area, the eye as a line; heights in metres at some frames.
pub fn profile(along: Along, ground: &[(u32, f64)], eye: &[f64]) -> String {
    let height = 150.0;
    let mut out = open("terrain beneath the eye, and the eye; metres above the ellipsoid", height);
    let heights = || ground.iter().map(|(_, height_m)| *height_m).chain(eye.iter().copied());
    let (least, most) =
        (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
    let pad = 0.05 * (most - least).max(1.0);
    let y = Axis { from: least - pad, to: most + pad, page: [height - BOTTOM, TOP] };
    grid(&mut out, &along.axis(), &y);
    let at = |frame: f64, height_m: f64| format!("{:.1},{:.1}", along.x(frame), y.place(height_m));
    if let [(first, _), .., (last, _)] = ground {
        let points: Vec<String> = ground.iter().map(|(f, h)| at(f64::from(*f), *h)).collect();
        let ends = [*last, *first].map(|frame| at(f64::from(frame), y.from));
        let points = format!("{} {}", points.join(" "), ends.join(" "));
        put(&mut out, format_args!("<polygon class=\"ground\" points=\"{points}\"/>\n"));
    }
    let every = eye.len().div_ceil(900).max(1);
    let points = eye.iter().enumerate().step_by(every).map(|(f, h)| at(f as f64, *h));
    let points = points.collect::<Vec<_>>().join(" ");
    put(&mut out, format_args!("<polyline class=\"eye\" points=\"{points}\"/>\n</svg>\n"));
    out
}

/// When something happened: a row each, the darker the more in a stretch.
pub fn events(along: Along, rows: &[(&str, &[f64])]) -> String {
    let (row, top) = (16.0, TOP);
    let height = top + row * rows.len() as f64 + 6.0;
    let mut out = open("events: the darker, the more", height);
    for (i, (name, column)) in rows.iter().enumerate() {
        let up = top + row * i as f64;
        let most = column.iter().copied().fold(0.0, f64::max);
        let (aside, down, name) = (LEFT - 6.0, up + 11.0, escaped(name));
        put(&mut out, format_args!("<text class=\"y\" x=\"{aside}\" y=\"{down}\">{name}</text>"));
        for stretch in stretches(column.len(), 300) {
            let (first, last) = (stretch.start as f64, stretch.end as f64);
            let value = column[stretch].iter().copied().fold(0.0, f64::max);
            if value <= 0.0 {
                continue;
            }
            let (x, w) = (along.x(first), (along.x(last) - along.x(first)).max(1.0));
            let dark = 0.25 + 0.75 * value / most;
            let rest = number(value);
            put(
                &mut out,
                format_args!(
                    "<rect class=\"event\" x=\"{x:.1}\" y=\"{up}\" width=\"{w:.1}\" height=\"13\" \
                     opacity=\"{dark:.2}\"><title>{name}: {rest}</title></rect>"
                ),
            );
        }
        out.push('\n');
    }
    out.push_str("</svg>\n");
    out
}

/// Mean times of the stages of each stretch, one upon the other.
pub fn stack(along: Along, columns: &[(String, Vec<f64>)]) -> String {
    let height = 240.0;
    let mut out = open("stages, milliseconds: means of stretches, stacked", height);
    let frames = columns.first().map_or(0, |(_, column)| column.len());
    let stretches: Vec<_> = stretches(frames, 200).collect();
    let mean = |column: &Vec<f64>, stretch: &std::ops::Range<usize>| {
        column[stretch.clone()].iter().sum::<f64>() / stretch.len().max(1) as f64
    };
    let mut below = vec![0.0; stretches.len()];
    let mut layers = Vec::new();
    for (_, column) in columns {
        let above: Vec<f64> =
            stretches.iter().zip(&below).map(|(s, low)| low + mean(column, s)).collect();
        layers.push((below, above.clone()));
        below = above;
    }
    let most = below.iter().copied().fold(1e-6, f64::max);
    let y = Axis { from: 0.0, to: most * 1.05, page: [height - BOTTOM, TOP] };
    grid(&mut out, &along.axis(), &y);
    for (i, ((name, _), (low, high))) in columns.iter().zip(&layers).enumerate() {
        let at = |(stretch, value): (&std::ops::Range<usize>, &f64)| {
            let middle = (stretch.start + stretch.end).saturating_sub(1) as f64 / 2.0;
            format!("{:.1},{:.1}", along.x(middle), y.place(*value))
        };
        let there = stretches.iter().zip(high).map(at);
        let back = stretches.iter().zip(low).rev().map(at);
        let points = there.chain(back).collect::<Vec<_>>().join(" ");
        let name = escaped(name);
        put(
            &mut out,
            format_args!(
                "<polygon class=\"s{i}\" points=\"{points}\"><title>{name}</title></polygon>\n"
            ),
        );
    }
    out.push_str("</svg>\n");
    out
}

/// How many frames took how long, in 60 steps from nothing to the longest; heights are logarithmic,
/// so that a single hitch is seen.
pub fn histogram(column: &[f64]) -> String {
    const STEPS: usize = 60;
    let height = 220.0;
    let mut out = open("histogram of frame times, milliseconds; heights are logarithmic", height);
    let most = column.iter().copied().fold(1e-6, f64::max);
    let mut counts = [0_u32; STEPS];
    for &value in column {
        let step = (0..STEPS - 1).find(|step| value < most * (step + 1) as f64 / STEPS as f64);
        counts[step.unwrap_or(STEPS - 1)] += 1;
    }
    let log = |count: u32| (1.0 + f64::from(count)).log10();
    let tallest = counts.iter().map(|&count| log(count)).fold(0.1, f64::max);
    let x = Axis { from: 0.0, to: most, page: [LEFT, WIDTH - RIGHT] };
    let y = Axis { from: 0.0, to: tallest * 1.05, page: [height - BOTTOM, TOP] };
    grid(&mut out, &x, &Axis { to: -1.0, ..y });
    let wide = (WIDTH - RIGHT - LEFT) / STEPS as f64;
    for (step, &count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
        let (left, up) = (LEFT + wide * step as f64, y.place(log(count)));
        let (w, tall) = (wide - 1.0, y.page[0] - up);
        put(
            &mut out,
            format_args!(
                "<rect class=\"bar\" x=\"{left:.1}\" y=\"{up:.1}\" width=\"{w:.1}\" \
                 height=\"{tall:.1}\"><title>{count} frames up to {:.3} ms</title></rect>\n",
                most * (step + 1) as f64 / STEPS as f64
            ),
        );
    }
    out.push_str("</svg>\n");
    out
}

/// The track from above, north up, with some frames marked.
pub fn map(lat_deg: &[f64], lon_deg: &[f64], marked: &[(usize, String)]) -> String {
    let height = 460.0;
    let mut out = open("the flight from above, north up; marked: the worst frames", height);
    let span = |column: &[f64]| {
        let low = column.iter().copied().fold(f64::INFINITY, f64::min);
        (low, column.iter().copied().fold(f64::NEG_INFINITY, f64::max))
    };
    let ((south, north), (west, east)) = (span(lat_deg), span(lon_deg));
    // A degree of longitude is shorter by the cosine of the latitude; never by more than 20 times.
    let middle_rad = ((south + north) / 2.0).to_radians();
    let shrink = overfly::core::geodesy::trig::cos(middle_rad).max(0.05);
    let (wide, tall) = (WIDTH - RIGHT - LEFT, height - BOTTOM - TOP);
    let scale = (wide / ((east - west) * shrink).max(1e-6)).min(tall / (north - south).max(1e-6));
    let x = |lon: f64| LEFT + wide / 2.0 + (lon - (west + east) / 2.0) * shrink * scale;
    let y = |lat: f64| TOP + tall / 2.0 - (lat - (south + north) / 2.0) * scale;
    let every = lat_deg.len().div_ceil(2000).max(1);
    let mut path = String::new();
    let mut before: Option<f64> = None;
    for (lat, lon) in lat_deg.iter().zip(lon_deg).step_by(every) {
        // Over the antimeridian the line is not drawn round the world.
        let jumps = before.is_none_or(|before| (before - lon).abs() > 180.0);
        let letter = if jumps { 'M' } else { 'L' };
        put(&mut path, format_args!("{letter}{:.1} {:.1}", x(*lon), y(*lat)));
        before = Some(*lon);
    }
    put(&mut out, format_args!("<path class=\"eye\" d=\"{path}\"/>\n"));
    for (frame, label) in marked {
        let (cx, cy, label) = (x(lon_deg[*frame]), y(lat_deg[*frame]), escaped(label));
        put(
            &mut out,
            format_args!(
                "<circle class=\"worst\" cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"5\">\
                 <title>{label}</title></circle>\n"
            ),
        );
    }
    let corners = [(LEFT, TOP + 12.0, north, west), (LEFT, height - 6.0, south, west)];
    for (left, down, lat, lon) in corners {
        put(&mut out, format_args!("<text x=\"{left}\" y=\"{down}\">{lat:.4}, {lon:.4}</text>\n"));
    }
    out.push_str("</svg>\n");
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_band_keeps_the_single_hitch_of_many_frames() {
        let along = Along { frames: 36_000, first_s: 0.0, last_s: 600.0 };
        let mut column = vec![2.0; 36_000];
        let calm = band("t", along, &column, &[]);
        column[17_777] = 60.0;
        let svg = band("<t>", along, &column, &[16.6]);
        // What is longest reaches to 26 + 210 × 0.05 / 1.05 = 36, less half a pixel.
        let tops = |svg: &str| svg.matches("V35.5").count();
        assert_eq!((tops(&svg), tops(&calm)), (1, 900));
        assert!(svg.contains("&lt;t&gt;") && svg.contains("class=\"limit\""));
    }

    #[test]
    fn charts_of_one_frame_and_of_standing_still_have_no_odd_numbers() {
        let along = Along { frames: 1, first_s: 0.0, last_s: 0.0 };
        let all = [
            band("b", along, &[2.0], &[]),
            profile(along, &[(0, 5.0)], &[6.0]),
            events(along, &[("x", &[0.0])]),
            stack(along, &[("s".into(), vec![0.0])]),
            histogram(&[0.0]),
            map(&[46.0], &[-121.0], &[(0, "w".into())]),
        ];
        for svg in all {
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
            assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n"));
        }
    }

    #[test]
    fn ticks_are_round_and_inside() {
        let axis = Axis { from: 0.0, to: 9.5, page: [0.0, 1.0] };
        assert_eq!(axis.ticks(), [0.0, 2.0, 4.0, 6.0, 8.0]);
        let axis = Axis { from: 300.0, to: 900.0, page: [0.0, 1.0] };
        assert_eq!(axis.ticks(), [400.0, 600.0, 800.0]);
    }
}
