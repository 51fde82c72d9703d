//! Letters made of straight strokes, so that a picture needs no font and is the same everywhere.

/// Width and height of a letter in its own units.
const GLYPH: [f64; 2] = [4.0, 6.0];
/// Distance from letter to letter in the same units.
const ADVANCE: f64 = 6.0;

/// Strokes separated by spaces; each is a row of points of two digits, x to the right and y up.
fn strokes(letter: char) -> &'static str {
    match letter.to_ascii_uppercase() {
        '0' | 'O' => "103041453616050110",
        '1' => "152620 1030",
        '2' => "05163645440040",
        '3' => "064624344341301001",
        '4' => "30360242",
        '5' => "460604344341301001",
        '6' => "4536160501103041423303",
        '7' => "064610",
        '8' => "13040516364544331302011030414233",
        '9' => "0110304145361605041343",
        'A' => "0004264440 0242",
        'B' => "00063645443303 3342413000",
        'C' => "4536160501103041",
        'D' => "00063645413000",
        'E' => "46060040 0333",
        'F' => "460600 0333",
        'G' => "45361605011030414323",
        'H' => "0006 4046 0343",
        'I' => "1636 2620 1030",
        'J' => "4641301001",
        'K' => "0006 460340",
        'L' => "060040",
        'M' => "0006244640",
        'N' => "00064046",
        'P' => "00063645443303",
        'Q' => "103041453616050110 2240",
        'R' => "00063645443303 2340",
        'S' => "453616050413334241301001",
        'T' => "0646 2620",
        'U' => "060110304146",
        'V' => "062046",
        'W' => "0610243046",
        'X' => "0046 0640",
        'Y' => "062346 2320",
        'Z' => "06460040",
        '-' => "0343",
        '_' => "0040",
        '.' => "2021",
        '/' => "0046",
        _ => "",
    }
}

/// Width of a text whose letters are this high.
pub(super) fn width(text: &str, height: f64) -> f64 {
    let advances = text.chars().count() as f64 * ADVANCE;
    (advances - (ADVANCE - GLYPH[0])).max(0.0) * height / GLYPH[1]
}

/// The strokes of a text whose lower left corner is at `start`, x to the right and y up.
pub(super) fn lines(text: &str, start: [f64; 2], height: f64) -> Vec<Vec<[f64; 2]>> {
    let unit = height / GLYPH[1];
    let mut lines = Vec::new();
    for (position, letter) in text.chars().enumerate() {
        let left = start[0] + position as f64 * ADVANCE * unit;
        for stroke in strokes(letter).split(' ').filter(|stroke| !stroke.is_empty()) {
            let points = stroke.as_bytes().chunks_exact(2).map(|pair| {
                let [x, y] = [pair[0], pair[1]].map(|digit| f64::from(digit - b'0'));
                [left + x * unit, start[1] + y * unit]
            });
            lines.push(points.collect());
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_letter_and_digit_has_strokes_within_its_box() {
        for letter in ('0'..='9').chain('A'..='Z').chain('a'..='z') {
            let lines = lines(&letter.to_string(), [0.0; 2], 6.0);
            assert!(lines.iter().any(|line| line.len() > 1), "{letter}");
            let inside = |[x, y]: &[f64; 2]| (0.0..=4.0).contains(x) && (0.0..=6.0).contains(y);
            assert!(lines.iter().flatten().all(inside), "{letter}: {lines:?}");
        }
    }

    #[test]
    fn a_text_is_as_wide_as_its_strokes() {
        let rightmost =
            lines("H1H", [10.0, 0.0], 3.0).iter().flatten().map(|[x, _]| *x).fold(0.0, f64::max);
        assert!((rightmost - 10.0 - width("H1H", 3.0)).abs() < 1e-12);
    }
}
