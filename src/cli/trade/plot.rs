//! Points on logarithmic axes, as SVG that needs nothing beside it.
//!
//! In:    points, what they are called, which are on the front, a law.
//! Out:   an `svg` element; its colours are those of the page's style.
//! Keeps: nothing.
//! Not here: the page around it (`html`).

use overfly::replay::trade::Fit;
use std::fmt::Write;

/// One point of a plot.
pub struct Dot {
    pub at: [f64; 2],
    /// Which style it has, `g0` and on.
    pub group: usize,
    /// Shown where the mouse rests.
    pub label: String,
    pub on_front: bool,
}

/// A plot on logarithmic axes.
pub struct Plot<'a> {
    pub title: &'a str,
    /// What the axes show.
    pub axes: [&'a str; 2],
    pub dots: Vec<Dot>,
    pub law: Option<Fit>,
}

const SIZE: [f64; 2] = [760.0, 460.0];
/// Left, right, top and bottom.
const MARGIN: [f64; 4] = [70.0, 20.0, 34.0, 52.0];

/// A logarithmic axis: from and to, in numbers and on the page.
#[derive(Clone, Copy)]
struct Axis {
    logs: [f64; 2],
    page: [f64; 2],
}

impl Axis {
    fn over(values: impl Iterator<Item = f64>, page: [f64; 2]) -> Self {
        let logs = values
            .map(f64::log10)
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)]);
        let pad = 0.06 * (logs[1] - logs[0]).max(0.5);
        Self { logs: [logs[0] - pad, logs[1] + pad], page }
    }

    fn place(&self, value: f64) -> f64 {
        let share = (value.log10() - self.logs[0]) / (self.logs[1] - self.logs[0]);
        self.page[0] + share * (self.page[1] - self.page[0])
    }

    /// 1, 2 and 5 of each decade, or the decades alone where that is too many.
    fn ticks(&self) -> Vec<f64> {
        let steps = if self.logs[1] - self.logs[0] > 3.0 { &[1.0][..] } else { &[1.0, 2.0, 5.0] };
        let decades = (-12..=12).map(|decade| format!("1e{decade}").parse::<f64>());
        let decades = decades.map(|power| power.expect("a number"));
        let ticks = decades.flat_map(|power| steps.iter().map(move |step| power * step));
        let inside = |value: &f64| (self.logs[0]..=self.logs[1]).contains(&value.log10());
        ticks.filter(inside).collect()
    }
}

/// The plot as SVG; a sentence where there is nothing to show.
pub fn svg(plot: &Plot<'_>) -> String {
    let shown = |dot: &&Dot| dot.at.iter().all(|x| x.is_finite() && *x > 0.0);
    let dots: Vec<&Dot> = plot.dots.iter().filter(shown).collect();
    if dots.is_empty() {
        return format!("<p>{}: nothing to show.</p>\n", escaped(plot.title));
    }
    let [left, right, top, bottom] = MARGIN;
    let x = Axis::over(dots.iter().map(|dot| dot.at[0]), [left, SIZE[0] - right]);
    let y = Axis::over(dots.iter().map(|dot| dot.at[1]), [SIZE[1] - bottom, top]);
    let mut out = format!(
        "<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">\n",
        SIZE[0],
        SIZE[1],
        escaped(plot.title)
    );
    frame(&mut out, plot, (x, y));
    if let Some(law) = &plot.law {
        let [a, b] = law.range;
        let line = [a, b].map(|at| format!("{:.1},{:.1}", x.place(at), y.place(law.at(at))));
        put(&mut out, format_args!("<polyline class=\"law\" points=\"{}\"/>\n", line.join(" ")));
    }
    let mut front: Vec<&&Dot> = dots.iter().filter(|dot| dot.on_front).collect();
    front.sort_by(|a, b| a.at[0].total_cmp(&b.at[0]));
    let line =
        front.iter().map(|dot| format!("{:.1},{:.1}", x.place(dot.at[0]), y.place(dot.at[1])));
    let line = line.collect::<Vec<_>>().join(" ");
    if !line.is_empty() {
        put(&mut out, format_args!("<polyline class=\"front\" points=\"{line}\"/>\n"));
    }
    for dot in &dots {
        let (cx, cy, group) = (x.place(dot.at[0]), y.place(dot.at[1]), dot.group);
        if dot.on_front {
            let ring =
                format_args!("<circle class=\"ring\" cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"8\"/>\n");
            put(&mut out, ring);
        }
        let (label, radius) = (escaped(&dot.label), if group == 0 { 6 } else { 4 });
        put(
            &mut out,
            format_args!(
                "<circle class=\"g{group}\" cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"{radius}\">\
                 <title>{label}</title></circle>\n"
            ),
        );
    }
    out.push_str("</svg>\n");
    out
}

/// Title, axes and grid.
fn frame(out: &mut String, plot: &Plot<'_>, (x, y): (Axis, Axis)) {
    let [left, _, top, _] = MARGIN;
    let middle = (x.page[0] + x.page[1]) / 2.0;
    put(
        out,
        format_args!(
            "<text class=\"title\" x=\"{left}\" y=\"20\">{}</text>\n",
            escaped(plot.title)
        ),
    );
    for value in x.ticks() {
        let (at, end) = (x.place(value), y.page[0]);
        put(out, format_args!("<path class=\"grid\" d=\"M{at:.1} {top}V{end}\"/>\n"));
        let text = number(value);
        put(
            out,
            format_args!("<text class=\"x\" x=\"{at:.1}\" y=\"{:.1}\">{text}</text>\n", end + 18.0),
        );
    }
    for value in y.ticks() {
        let (at, end) = (y.place(value), x.page[1]);
        put(out, format_args!("<path class=\"grid\" d=\"M{left} {at:.1}H{end}\"/>\n"));
        let text = number(value);
        put(
            out,
            format_args!(
                "<text class=\"y\" x=\"{:.1}\" y=\"{:.1}\">{text}</text>\n",
                left - 8.0,
                at + 4.0
            ),
        );
    }
    let [x_name, y_name] = plot.axes.map(escaped);
    put(
        out,
        format_args!(
            "<text class=\"x\" x=\"{middle}\" y=\"{:.1}\">{x_name}</text>\n",
            SIZE[1] - 10.0
        ),
    );
    let y_middle = (y.page[0] + y.page[1]) / 2.0;
    put(
        out,
        format_args!(
            "<text class=\"x\" transform=\"translate(16 {y_middle}) rotate(-90)\">{y_name}</text>\n"
        ),
    );
}

fn put(out: &mut String, text: std::fmt::Arguments<'_>) {
    out.write_fmt(text).expect("a text grows");
}

/// A number of an axis, short.
pub fn number(value: f64) -> String {
    match value {
        x if x >= 1e6 => format!("{}M", x / 1e6),
        x if x >= 1e3 => format!("{}k", x / 1e3),
        x if x >= 1e-3 => format!("{}", (x * 1e6).round() / 1e6),
        x => format!("{x:e}"),
    }
}

/// Text that cannot be taken for tags.
pub fn escaped(text: &str) -> String {
    let escape = |c: char| match c {
        '&' => "&amp;".to_owned(),
        '<' => "&lt;".to_owned(),
        '>' => "&gt;".to_owned(),
        '"' => "&quot;".to_owned(),
        c => c.to_string(),
    };
    text.chars().map(escape).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plot_shows_every_usable_dot_and_escapes_what_it_says() {
        let dot = |at, on_front| Dot { at, group: 1, label: "<a & b>".into(), on_front };
        let dots = vec![dot([1e3, 5.0], true), dot([1e5, 0.5], true), dot([2e4, f64::NAN], false)];
        let svg = svg(&Plot { title: "t", axes: ["x", "y"], dots, law: None });
        assert_eq!(svg.matches("&lt;a &amp; b&gt;").count(), 2);
        assert_eq!(svg.matches("class=\"ring\"").count(), 2);
        assert!(svg.contains(">10k</text>") && svg.ends_with("</svg>\n"));
    }

    #[test]
    fn numbers_of_an_axis_are_short() {
        let words = [0.05, 0.2, 1.0, 500.0, 2e4, 5e6].map(number);
        assert_eq!(words, ["0.05", "0.2", "1", "500", "20k", "5M"]);
    }
}
