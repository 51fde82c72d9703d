//! Numbers on boards, of straight strokes: what a sign allows can be read from near.

/// Most digits that a board has room for.
const DIGITS_MAX: usize = 3;
/// Half height of a digit, half width, and half width of a stroke, where a board has radius 1.
const HALF_HEIGHT: f32 = 0.42;
const HALF_WIDTH: f32 = 0.18;
const HALF_STROKE: f32 = 0.06;
/// Between the middles of two digits.
const PITCH: f32 = 0.5;
/// Three digits are narrower.
const NARROW: f32 = 0.72;

/// Which of the strokes of [`STROKES`] a digit has, by bits.
const OF_DIGIT: [u8; 10] = [
    0b011_1111, 0b000_0110, 0b101_1011, 0b100_1111, 0b110_0110, 0b110_1101, 0b111_1101, 0b000_0111,
    0b111_1111, 0b110_1111,
];
/// Middle and half size of each stroke, in half widths to the right and half heights up: top, right
/// above and below, bottom, left below and above, middle.
const STROKES: [([f32; 2], [f32; 2]); 7] = [
    ([0.0, 1.0], [1.0, 0.0]),
    ([1.0, 0.5], [0.0, 0.5]),
    ([1.0, -0.5], [0.0, 0.5]),
    ([0.0, -1.0], [1.0, 0.0]),
    ([-1.0, -0.5], [0.0, 0.5]),
    ([-1.0, 0.5], [0.0, 0.5]),
    ([0.0, 0.0], [1.0, 0.0]),
];

/// A stroke: its middle to the right of and above the board's, and half its size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stroke {
    pub(super) middle: [f32; 2],
    pub(super) half: [f32; 2],
}

/// The strokes of a number, in radii of the board; none for what has no room.
pub(super) fn strokes(number: u32) -> Vec<Stroke> {
    let digits: Vec<u8> = number.to_string().bytes().map(|digit| digit - b'0').collect();
    if digits.len() > DIGITS_MAX {
        return Vec::new();
    }
    let narrow = if digits.len() == DIGITS_MAX { NARROW } else { 1.0 };
    let first = -PITCH * (digits.len() as f32 - 1.0) / 2.0;
    let mut strokes = Vec::new();
    for (at, digit) in digits.into_iter().enumerate() {
        let bits = OF_DIGIT.get(usize::from(digit)).copied().unwrap_or_default();
        let has = |bit: &usize| (bits >> bit) & 1 == 1;
        for ([right, up], [along, tall]) in
            (0..STROKES.len()).filter(has).filter_map(|bit| STROKES.get(bit))
        {
            let middle = first + PITCH * at as f32 + right * HALF_WIDTH;
            strokes.push(Stroke {
                middle: [middle * narrow, up * HALF_HEIGHT],
                half: [
                    (along * HALF_WIDTH + HALF_STROKE) * narrow,
                    tall * HALF_HEIGHT + HALF_STROKE,
                ],
            });
        }
    }
    strokes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_in_the_middle_of_the_board_and_read_from_left_to_right() {
        for number in [7, 30, 90, 120] {
            let strokes = strokes(number);
            let inside = |stroke: &Stroke| {
                let [right, up] = [0, 1].map(|at| stroke.middle[at].abs() + stroke.half[at]);
                right.hypot(up) < 0.84
            };
            assert!(!strokes.is_empty() && strokes.iter().all(inside), "{number}: {strokes:?}");
        }
        // A one has its strokes to the right of its middle, and stands before the seven.
        let seventeen = strokes(17);
        assert_eq!(seventeen.len(), 2 + 3);
        assert!(seventeen[0].middle[0] < seventeen[4].middle[0]);
        assert!(strokes(1000).is_empty());
    }
}
