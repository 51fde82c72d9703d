//! Digits and capitals as straight strokes, for what is written on signs.

/// Of a character's cell: half of its width, and from the middle of one to the middle of the next,
/// in heights of a capital.
const HALF_WIDTH: f32 = 0.29;
const PITCH: f32 = 0.82;
/// Units of the strokes' grid from the middle to the edges of a cell.
const GRID: [f32; 2] = [2.0, 3.0];

const ZERO: &str = "10 01 05 16 36 45 41 30 10";
const EIGHT: &str = "13 04 05 16 36 45 44 33 13 02 01 10 30 41 42 33";

/// A straight stroke from one place to another, right of and above the middle of a text, in heights
/// of a capital.
pub type Stroke = [[f32; 2]; 2];

/// The middle lines of the strokes of a text of one line; nothing for characters that have none
/// here.
///
/// - **Frame:** to the right and up; the origin is the middle of the text.
/// - **Unit:** the height of a capital.
pub fn strokes(text: &str) -> Vec<Stroke> {
    let first = -PITCH * (text.chars().count().saturating_sub(1)) as f32 / 2.0;
    let mut strokes = Vec::new();
    for (at, character) in text.chars().enumerate() {
        let middle = first + PITCH * at as f32;
        for line in lines(character).split(',') {
            let points: Vec<[f32; 2]> = line.split(' ').filter_map(point).collect();
            let placed = |[x, y]: [f32; 2]| [middle + x * HALF_WIDTH, y * 0.5];
            strokes.extend(points.windows(2).filter_map(|pair| match pair {
                [from, to] => Some([placed(*from), placed(*to)]),
                _ => None,
            }));
        }
    }
    strokes
}

/// Lines through places of a grid of 5 columns and 7 rows, from the lower left: column, then row.
fn lines(character: char) -> &'static str {
    match character {
        '0' | 'O' => ZERO,
        '1' => "14 26 20",
        '2' => "05 16 36 45 44 00 40",
        '3' => "05 16 36 45 44 33 42 41 30 10 01,33 23",
        '4' => "30 36 02 42",
        '5' => "46 06 04 34 43 41 30 10 01",
        '6' => "45 36 16 05 01 10 30 41 42 33 03",
        '7' => "06 46 10",
        '8' => EIGHT,
        '9' => "01 10 30 41 45 36 16 05 04 13 43",
        'P' => "00 06 36 45 44 33 03",
        'S' => "45 36 16 05 04 13 33 42 41 30 10 01",
        'T' => "06 46,26 20",
        _ => "",
    }
}

/// A place of the grid, from -1 to 1 along both axes.
fn point(place: &str) -> Option<[f32; 2]> {
    let mut digits = place.chars().filter_map(|digit| digit.to_digit(10)).map(|digit| digit as f32);
    let (column, row) = (digits.next()?, digits.next()?);
    Some([column / GRID[0] - 1.0, row / GRID[1] - 1.0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_character_of_signs_fills_its_cell_and_reads_from_left_to_right() {
        for character in "0123456789STOP".chars() {
            let ends: Vec<[f32; 2]> = strokes(&character.to_string()).concat();
            let span = |axis: usize| {
                let parts = ends.iter().map(|end| end[axis]);
                parts.clone().fold(f32::MIN, f32::max) - parts.fold(f32::MAX, f32::min)
            };
            assert!((span(1) - 1.0).abs() < 1e-6, "{character}: {ends:?}");
            assert!(span(0) <= 2.0 * HALF_WIDTH + 1e-6, "{character}: {ends:?}");
        }
        let stop = strokes("STOP");
        assert!(stop.first().unwrap()[0][0] < -HALF_WIDTH && stop.last().unwrap()[1][0] > 0.5);
        assert!(strokes("?").is_empty() && strokes("").is_empty());
    }

    #[test]
    fn characters_differ() {
        let all: Vec<char> = "123456789STP0".chars().collect();
        for (at, one) in all.iter().enumerate() {
            for other in &all[at + 1..] {
                assert_ne!(strokes(&one.to_string()), strokes(&other.to_string()));
            }
        }
    }
}
