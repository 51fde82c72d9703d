//! Numbers on boards: what a sign allows can be read from near.

use bodies::lettering;

/// Most digits that a board has room for.
const DIGITS_MAX: usize = 3;
/// Height of a digit, and half the width of a stroke, where a board has radius 1.
const HEIGHT: f32 = 0.86;
const HALF_STROKE: f32 = 0.07;
/// Three digits are lower.
const LOW: f32 = 0.66;

/// A stroke: its middle and the unit vector along it, to the right and up on the board, and half
/// its length and width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stroke {
    pub(super) middle: [f32; 2],
    pub(super) along: [f32; 2],
    pub(super) half: [f32; 2],
}

/// The strokes of a number, in radii of the board; none for what has no room.
pub(super) fn strokes(number: u32) -> Vec<Stroke> {
    let text = number.to_string();
    if text.len() > DIGITS_MAX {
        return Vec::new();
    }
    let scale = HEIGHT * if text.len() == DIGITS_MAX { LOW } else { 1.0 };
    let stroke = |[from, to]: [[f32; 2]; 2]| {
        let along = [to[0] - from[0], to[1] - from[1]];
        let length = (along[0] * along[0] + along[1] * along[1]).sqrt();
        Stroke {
            middle: [0, 1].map(|axis| (from[axis] + to[axis]) / 2.0 * scale),
            along: along.map(|part| part / length),
            half: [length / 2.0 * scale + HALF_STROKE * 0.6, HALF_STROKE],
        }
    };
    lettering::strokes(&text).into_iter().map(stroke).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_in_the_middle_of_the_board_and_read_from_left_to_right() {
        for number in [7, 30, 90, 120] {
            let strokes = strokes(number);
            let inside = |stroke: &Stroke| {
                let [right, up] = stroke.middle;
                right.hypot(up) + stroke.half[0].hypot(stroke.half[1]) < 1.0
            };
            assert!(!strokes.is_empty() && strokes.iter().all(inside), "{number}: {strokes:?}");
        }
        // A one has its strokes to the left of a seven's.
        let seventeen = strokes(17);
        assert_eq!(seventeen.len(), 2 + 2);
        assert!(seventeen[0].middle[0] < 0.0 && seventeen[3].middle[0] > 0.0);
        assert!(strokes(1000).is_empty());
    }
}
