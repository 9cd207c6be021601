//! Numbers, times and help over the picture.
//!
//! In:    [`Readout`]: what a frame came to; [`Times`] of the last frames; lines of help.
//! Out:   lines of text, bars, and both on an [`Overlay`].
//! Keeps: [`Times`].
//! Not here: where the numbers come from (`session`), glyphs (`overfly_render_vk`).

use overfly::core::frame::data::{DeviceTotals, FrameCounts};
use overfly::core::geodesy::Geodetic;
use overfly::core::geodesy::narrow;
use overfly::render_vk::Overlay;
use std::collections::VecDeque;
use std::fmt::Write;

const TEXT: [u8; 4] = [235, 240, 245, 255];
const NOTICE: [u8; 4] = [255, 214, 120, 255];
const PANEL: [u8; 4] = [8, 12, 18, 150];
const FRAME: [u8; 4] = [110, 190, 255, 230];
const WORK: [u8; 4] = [255, 170, 80, 255];
const SLOW: [u8; 4] = [255, 80, 70, 255];
const MARK: [u8; 4] = [255, 255, 255, 110];

/// Side of a character and height of a line at scale 1, in pixels.
const CELL_PX: f64 = 8.0;
const LINE_PX: f64 = 10.0;
const MARGIN_PX: f64 = 6.0;
/// Frames in the graph.
pub const FRAMES: usize = 240;
/// Full height of the graph: two frames at 60 Hz.
const GRAPH_MS: f64 = 1e3 / 30.0;
const GRAPH_PX: f64 = 100.0;
const BYTES_PER_MIB: f64 = 1_048_576.0;

/// What a frame came to, in numbers.
pub struct Readout<'a> {
    /// Where the eye is.
    pub place: Geodetic,
    /// Above the ground; empty where it is not loaded.
    pub agl_m: Option<f64>,
    /// Above sea level, where that is known.
    pub msl_m: Option<f64>,
    /// Clockwise from north, and upwards, in degrees.
    pub look_deg: [f64; 2],
    /// How fast the keys fly.
    pub speed_m_s: f64,
    /// The frame's counts.
    pub counts: &'a FrameCounts,
    /// Memory of resident pages.
    pub pages_bytes: u64,
    /// Memory of the renderer.
    pub device: DeviceTotals,
    /// Draws and triangles of the picture.
    pub drawn: [u64; 2],
    /// Milliseconds of each stage.
    pub stages_ms: &'a [(&'static str, f64)],
    /// Milliseconds from the last frame to this one.
    pub frame_ms: f64,
    /// Error on the screen that may stay.
    pub tolerance_px: f64,
    /// What the ground is coloured by.
    pub show: &'static str,
    /// Frozen, recording, playing: what is not as usual.
    pub states: &'a [String],
}

/// The numbers as lines.
pub fn lines(readout: &Readout<'_>) -> Vec<String> {
    let at = readout.place;
    let counts = readout.counts;
    let mib = |bytes: u64| bytes as f64 / BYTES_PER_MIB;
    let or_dash = |height_m: Option<f64>| height_m.map_or("-".into(), metres);
    let mut lines = vec![
        format!(
            "{} {}",
            angle(at.lat_rad.to_degrees(), ['N', 'S']),
            angle(at.lon_rad.to_degrees(), ['E', 'W'])
        ),
        format!("MSL {}  AGL {}", or_dash(readout.msl_m), or_dash(readout.agl_m)),
        format!(
            "heading {:.1}  pitch {:+.1}  {}/s",
            readout.look_deg[0],
            readout.look_deg[1],
            metres(readout.speed_m_s)
        ),
        format!("{} triangles  {} patches", grouped(counts.triangles.into()), counts.leaves),
        format!("drawn {} triangles in {} draws", grouped(readout.drawn[1]), readout.drawn[0]),
        format!("splits {}  merges {}  built {}", counts.splits, counts.merges, counts.built),
        format!(
            "pages {}  wanted {}  {:.1} MiB",
            counts.pages,
            counts.wanted,
            mib(readout.pages_bytes)
        ),
        format!("device {:.1} MiB", mib(readout.device.bytes)),
        format!(
            "{}  tolerance {} px  bound {:.2} px",
            readout.show, readout.tolerance_px, counts.error_px_bound
        ),
        format!("{:.1} fps  {:.2} ms", 1e3 / readout.frame_ms.max(1e-3), readout.frame_ms),
    ];
    let stages = readout.stages_ms.iter();
    lines.extend(stages.map(|(name, ms)| format!("  {name:<20}{ms:>8.3}")));
    lines.extend(readout.states.iter().cloned());
    lines
}

/// Degrees with a hemisphere: to 10 cm on the Earth.
fn angle(degrees: f64, [positive, negative]: [char; 2]) -> String {
    let side = if degrees < 0.0 { negative } else { positive };
    format!("{:.6} {side}", degrees.abs())
}

/// A length with as many digits as one can read.
fn metres(length_m: f64) -> String {
    match length_m.abs() {
        near if near < 100.0 => format!("{length_m:.2} m"),
        far if far < 1e5 => format!("{length_m:.0} m"),
        _ => format!("{:.1} km", length_m / 1e3),
    }
}

/// Digits in groups of three.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

/// Times of the last frames, the newest last.
#[derive(Default)]
pub struct Times {
    /// From frame to frame, and of the work of one, in milliseconds.
    frames_ms: VecDeque<[f64; 2]>,
}

/// A filled rectangle of the graph.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Bar {
    at_px: [f64; 2],
    size_px: [f64; 2],
    colour: [u8; 4],
}

impl Times {
    /// Adds a frame.
    pub fn add(&mut self, frame_ms: f64, work_ms: f64) {
        if self.frames_ms.len() == FRAMES {
            self.frames_ms.pop_front();
        }
        self.frames_ms.push_back([frame_ms, work_ms]);
    }

    /// Mean time from frame to frame over half the graph; 0 before the first.
    pub fn mean_ms(&self) -> f64 {
        let count = self.frames_ms.len().min(FRAMES / 2);
        let sum = self.frames_ms.iter().rev().take(count).fold(0.0, |sum, [ms, _]| sum + ms);
        sum / (count as f64).max(1.0)
    }

    /// The graph, its lower left corner at `at_px`: a bar for each frame, the work's part of it in
    /// front, and a line at 60 Hz. What is slower than 30 Hz is cut off and red.
    pub fn bars(&self, [left, bottom]: [f64; 2]) -> Vec<Bar> {
        let wide = FRAMES as f64;
        let panel =
            Bar { at_px: [left, bottom - GRAPH_PX], size_px: [wide, GRAPH_PX], colour: PANEL };
        let bar = |x: f64, ms: f64, colour| {
            let high = GRAPH_PX * (ms / GRAPH_MS).clamp(0.0, 1.0);
            Bar { at_px: [x, bottom - high], size_px: [1.0, high], colour }
        };
        let mut bars = vec![panel];
        let first = left + wide - self.frames_ms.len() as f64;
        for (index, &[frame_ms, work_ms]) in self.frames_ms.iter().enumerate() {
            let x = first + index as f64;
            bars.push(bar(x, frame_ms, if frame_ms > GRAPH_MS { SLOW } else { FRAME }));
            bars.push(bar(x, work_ms.min(frame_ms), WORK));
        }
        let half = [left, bottom - GRAPH_PX / 2.0];
        bars.push(Bar { at_px: half, size_px: [wide, 1.0], colour: MARK });
        bars
    }
}

/// What lies over a picture.
pub struct Panels<'a> {
    /// Lines at the top left; none where there are no numbers.
    pub lines: &'a [String],
    /// Lines of help, in the middle.
    pub help: &'a [String],
    /// What just happened, at the bottom.
    pub notice: Option<&'a str>,
    /// The graph at the bottom right, if it is shown.
    pub times: Option<&'a Times>,
}

/// Paints panels over a picture, characters `scale` times as large as the font.
pub fn paint(panels: &Panels<'_>, size_px: [u32; 2], scale: f64, overlay: &mut Overlay) {
    let [width, height] = size_px.map(f64::from);
    if let Some(times) = panels.times {
        for bar in times.bars([width - FRAMES as f64 - MARGIN_PX, height - MARGIN_PX]) {
            overlay.rect(narrowed(bar.at_px), narrowed(bar.size_px), bar.colour);
        }
    }
    text_panel(overlay, panels.lines, [MARGIN_PX, MARGIN_PX], (scale, TEXT));
    let [wide, high] = extent(panels.help, scale);
    let middle = [((width - wide) / 2.0).max(0.0), ((height - high) / 2.0).max(0.0)];
    text_panel(overlay, panels.help, middle, (scale, TEXT));
    if let Some(notice) = panels.notice {
        let below = height - 3.0 * MARGIN_PX - LINE_PX * scale;
        text_panel(overlay, &[notice.to_owned()], [MARGIN_PX, below], (scale, NOTICE));
    }
}

fn extent(lines: &[String], scale: f64) -> [f64; 2] {
    let longest = lines.iter().map(|line| line.chars().count()).max().unwrap_or(0);
    [longest as f64 * CELL_PX * scale, lines.len() as f64 * LINE_PX * scale]
}

fn text_panel(
    overlay: &mut Overlay,
    lines: &[String],
    [x, y]: [f64; 2],
    (scale, colour): (f64, [u8; 4]),
) {
    if lines.is_empty() {
        return;
    }
    let edge = MARGIN_PX / 2.0;
    let [wide, high] = extent(lines, scale);
    let size_px = [wide + 2.0 * edge, high + 2.0 * edge];
    overlay.rect(narrowed([x - edge, y - edge]), narrowed(size_px), PANEL);
    let mut text = String::new();
    lines.iter().for_each(|line| writeln!(text, "{line}").expect("text grows"));
    overlay.text(narrowed([x, y]), narrow(scale), colour, text.trim_end());
}

fn narrowed(at_px: [f64; 2]) -> [f32; 2] {
    at_px.map(narrow)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_as_people_write_them() {
        let counts = FrameCounts {
            leaves: 1234,
            triangles: 316_000,
            splits: 3,
            merges: 2,
            built: 28,
            pages: 456,
            wanted: 7,
            error_px_bound: 1.25,
            ..FrameCounts::default()
        };
        let readout = Readout {
            place: Geodetic::from_degrees(46.8523, -121.7603, 4500.0),
            agl_m: Some(107.613),
            msl_m: None,
            look_deg: [233.04, -11.0],
            speed_m_s: 53.8065,
            counts: &counts,
            pages_bytes: 3 << 19,
            device: DeviceTotals { allocations: 9, bytes: 1 << 25 },
            drawn: [1650, 422_400],
            stages_ms: &[("mesh.build", 1.5)],
            frame_ms: 20.0,
            tolerance_px: 0.5,
            show: "shaded",
            states: &["frozen".into()],
        };
        let expected = [
            "46.852300 N 121.760300 W",
            "MSL -  AGL 108 m",
            "heading 233.0  pitch -11.0  53.81 m/s",
            "316 000 triangles  1234 patches",
            "drawn 422 400 triangles in 1650 draws",
            "splits 3  merges 2  built 28",
            "pages 456  wanted 7  1.5 MiB",
            "device 32.0 MiB",
            "shaded  tolerance 0.5 px  bound 1.25 px",
            "50.0 fps  20.00 ms",
            "  mesh.build             1.500",
            "frozen",
        ];
        assert_eq!(lines(&readout), expected);
        assert_eq!(metres(-12.345), "-12.35 m");
        assert_eq!(metres(4e5), "400.0 km");
        assert_eq!(grouped(20_000_000), "20 000 000");
    }

    #[test]
    fn the_graph_holds_the_last_frames_and_cuts_off_slow_ones() {
        let mut times = Times::default();
        assert_eq!((times.bars([0.0, 100.0]).len(), times.mean_ms()), (2, 0.0));
        (0..500).for_each(|_| times.add(10.0, 5.0));
        times.add(1000.0, 20.0);
        let bars = times.bars([30.0, 200.0]);
        assert_eq!(bars.len(), 2 + 2 * FRAMES);
        let [.., slow, work, _] = bars[..] else { panic!() };
        let full = Bar { at_px: [269.0, 100.0], size_px: [1.0, 100.0], colour: SLOW };
        assert_eq!(slow, full);
        assert_eq!((work.at_px, work.colour), ([269.0, 140.0], WORK));
        for bar in &bars {
            let [x, y] = bar.at_px;
            assert!((30.0..270.0).contains(&x) && (100.0..=200.0).contains(&y), "{bar:?}");
            assert!((y + bar.size_px[1] - 200.0).abs() < 1e-9 || bar.colour == MARK);
        }
        assert!((times.mean_ms() - (119.0 * 10.0 + 1000.0) / 120.0).abs() < 1e-9);
    }

    #[test]
    fn nothing_to_say_paints_nothing_and_all_of_it_something() {
        let mut overlay = Overlay::default();
        let nothing = Panels { lines: &[], help: &[], notice: None, times: None };
        paint(&nothing, [320, 240], 1.0, &mut overlay);
        assert!(overlay.is_empty());
        let (lines, times) = (["one".into(), "two".into()], Times::default());
        let all = Panels { lines: &lines, help: &lines, notice: Some("so"), times: Some(&times) };
        paint(&all, [320, 240], 2.0, &mut overlay);
        assert!(!overlay.is_empty());
    }
}
