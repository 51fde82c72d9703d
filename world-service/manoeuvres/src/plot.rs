//! Lines over an axis, as SVG. Writing to a string cannot fail.

use std::fmt::Write;

const WIDTH: f32 = 640.0;
const HEIGHT: f32 = 400.0;
/// Left, top, right, bottom.
const MARGIN: [f32; 4] = [64.0, 36.0, 16.0, 48.0];
const COLOURS: [&str; 6] = ["#1f5fa8", "#c0392b", "#2e8b57", "#8e5ea2", "#d08a1d", "#444444"];
/// Points drawn of one line.
const POINTS_MAX: usize = 400;

/// One plot.
pub(crate) struct Plot<'a> {
    pub title: &'a str,
    pub x: &'a str,
    pub y: &'a str,
    pub lines: Vec<(String, Vec<(f32, f32)>)>,
}

/// Round numbers about an interval: the first, the last and their distance.
fn ticks(low: f32, high: f32) -> (f32, f32, f32) {
    let span = (high - low).max(1.0e-6);
    let power = 10.0f32.powf((span / 5.0).log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|factor| factor * power)
        .find(|step| span / step <= 6.0)
        .unwrap_or(10.0 * power);
    ((low / step).floor() * step, (high / step).ceil() * step, step)
}

/// Where values are drawn.
struct Axes {
    x: (f32, f32, f32),
    y: (f32, f32, f32),
}

impl Axes {
    fn x_at(&self, x: f32) -> f32 {
        let [left, _, right, _] = MARGIN;
        left + (x - self.x.0) / (self.x.1 - self.x.0) * (WIDTH - left - right)
    }

    fn y_at(&self, y: f32) -> f32 {
        let [_, top, _, bottom] = MARGIN;
        HEIGHT - bottom - (y - self.y.0) / (self.y.1 - self.y.0) * (HEIGHT - top - bottom)
    }

    /// Lines and numbers of both axes.
    fn grid(&self) -> String {
        let [left, top, right, bottom] = MARGIN;
        let values = |(low, high, step): (f32, f32, f32)| {
            (0..=((high - low) / step).round() as u32).map(move |index| low + step * index as f32)
        };
        let mut svg = String::new();
        for x in values(self.x) {
            let (at, y, label) = (self.x_at(x), HEIGHT - bottom, number(x, self.x.2));
            let _ = writeln!(
                svg,
                r##"<path d="M{at:.1} {top}V{y}" stroke="#dddddd"/>
<text x="{at:.1}" y="{}" text-anchor="middle">{label}</text>"##,
                y + 16.0
            );
        }
        for y in values(self.y) {
            let (at, x, label) = (self.y_at(y), WIDTH - right, number(y, self.y.2));
            let _ = writeln!(
                svg,
                r##"<path d="M{left} {at:.1}H{x}" stroke="#dddddd"/>
<text x="{}" y="{:.1}" text-anchor="end">{label}</text>"##,
                left - 6.0,
                at + 4.0
            );
        }
        svg
    }
}

impl Plot<'_> {
    fn axes(&self) -> Axes {
        let range = |value: fn(&(f32, f32)) -> f32| {
            let points = self.lines.iter().flat_map(|(_, points)| points).map(value);
            let (low, high) = points
                .filter(|value| value.is_finite())
                .fold((f32::MAX, f32::MIN), |(low, high), value| (low.min(value), high.max(value)));
            if low > high { ticks(0.0, 1.0) } else { ticks(low, high) }
        };
        Axes { x: range(|point| point.0), y: range(|point| point.1) }
    }

    pub(crate) fn svg(&self) -> String {
        let axes = self.axes();
        let [left, top, right, bottom] = MARGIN;
        let (middle_x, below) = (f32::midpoint(left, WIDTH - right), HEIGHT - 12.0);
        let middle_y = f32::midpoint(top, HEIGHT - bottom);
        let Self { title, x, y, lines } = self;
        let mut svg = format!(
            r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="12">
<rect width="{WIDTH}" height="{HEIGHT}" fill="#ffffff"/>
<text x="{left}" y="22" font-size="15">{title}</text>
{}<text x="{middle_x}" y="{below}" text-anchor="middle">{x}</text>
<text x="16" y="{middle_y}" text-anchor="middle" transform="rotate(-90 16 {middle_y})">{y}</text>
"##,
            axes.grid()
        );
        for (index, (name, points)) in lines.iter().enumerate() {
            let colour = COLOURS[index % COLOURS.len()];
            let (x, y) = (left + 12.0, top + 16.0 * (index as f32 + 1.0));
            let path = path(points, colour, &axes);
            let _ = writeln!(svg, r#"{path}<text x="{x}" y="{y}" fill="{colour}">{name}</text>"#);
        }
        svg.push_str("</svg>\n");
        svg
    }
}

fn path(points: &[(f32, f32)], colour: &str, axes: &Axes) -> String {
    let every = points.len().div_ceil(POINTS_MAX).max(1);
    let last = points.len().saturating_sub(1);
    let kept = points.iter().enumerate().filter(|(index, _)| index % every == 0 || *index == last);
    let mut path = String::new();
    for (_, (x, y)) in kept.filter(|(_, (x, y))| x.is_finite() && y.is_finite()) {
        let letter = if path.is_empty() { 'M' } else { 'L' };
        let _ = write!(path, "{letter}{:.1} {:.1}", axes.x_at(*x), axes.y_at(*y));
    }
    format!(r#"<path d="{path}" fill="none" stroke="{colour}" stroke-width="1.6"/>"#)
}

fn number(value: f32, step: f32) -> String {
    let digits = (-step.log10().floor()).max(0.0) as usize;
    let text = format!("{value:.digits$}");
    if text.trim_start_matches('-').chars().all(|digit| matches!(digit, '0' | '.')) {
        "0".to_owned()
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_end_on_round_numbers_around_the_data() {
        assert_eq!(ticks(0.3, 9.4), (0.0, 10.0, 2.0));
        let (low, high, step) = ticks(-0.013, 0.027);
        assert!(low <= -0.013 && high >= 0.027 && (step - 0.01).abs() < 1.0e-6);
    }

    #[test]
    fn every_line_is_drawn_with_its_name() {
        let lines = vec![("one".to_owned(), vec![(0.0, 0.0), (1.0, f32::NAN), (2.0, 4.0)])];
        let svg = Plot { title: "t", x: "x", y: "y", lines }.svg();
        assert!(svg.contains(">one</text>") && svg.contains("fill=\"none\""), "{svg}");
        assert!(!svg.contains("NaN"), "{svg}");
    }
}
