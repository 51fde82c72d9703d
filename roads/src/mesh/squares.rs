//! Things by the squares of the ground in which they lie.

/// Things by square. Those of one square stay in the order in which they were given.
#[derive(Debug)]
pub(super) struct Squares<T> {
    /// Ordered by square.
    things: Vec<([i32; 2], T)>,
}

impl<T> Default for Squares<T> {
    fn default() -> Self {
        Self { things: Vec::new() }
    }
}

impl<T> Squares<T> {
    pub(super) fn new(mut things: Vec<([i32; 2], T)>) -> Self {
        things.sort_by_key(|(square, _)| *square);
        Self { things }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.things.is_empty()
    }

    /// All in these squares, from the lowest to the highest.
    ///
    /// **Cost:** logarithmic for each column that has any, and linear in what is found.
    pub(super) fn within(&self, [low, high]: [[i32; 2]; 2]) -> impl Iterator<Item = &T> {
        let mut from = low;
        let columns = std::iter::from_fn(move || {
            loop {
                let first = self.things.partition_point(|(square, _)| *square < from);
                let rest = self.things.get(first..)?;
                let ([x, y], _) = *rest.first()?;
                if x > high[0] {
                    return None;
                }
                if y < low[1] {
                    // The first of a later column lies below all that is wanted.
                    from = [x, low[1]];
                    continue;
                }
                from = [x.checked_add(1)?, low[1]];
                let count = rest.partition_point(|(square, _)| *square <= [x, high[1]]);
                if count > 0 {
                    return rest.get(..count);
                }
            }
        });
        columns.flatten().map(|(_, thing)| thing)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every rectangle of squares about a sparse set gives what lies in it and nothing else.
    #[test]
    fn a_rectangle_gives_what_lies_in_it_in_order() {
        let all: Vec<[i32; 2]> = (-4..5i32)
            .flat_map(|x| (-4..5i32).map(move |y| [x, y]))
            .filter(|[x, y]| (x * 7 + y * 3).rem_euclid(4) == 0 && *x != 1)
            .collect();
        let squares = Squares::new(all.iter().rev().map(|square| (*square, *square)).collect());
        let mut found_any = 0;
        for low in (-5..6).flat_map(|x| (-5..6).map(move |y| [x, y])) {
            for high in (low[0]..6).flat_map(|x| (low[1]..6).map(move |y| [x, y])) {
                let found: Vec<_> = squares.within([low, high]).copied().collect();
                let is_in = |[x, y]: &[i32; 2]| {
                    (low[0]..=high[0]).contains(x) && (low[1]..=high[1]).contains(y)
                };
                let wanted: Vec<_> = all.iter().filter(|square| is_in(square)).copied().collect();
                assert_eq!(found, wanted, "{low:?} to {high:?}");
                found_any += found.len();
            }
        }
        assert!(found_any > 1_000);
    }

    #[test]
    fn things_of_one_square_stay_in_their_order() {
        let squares = Squares::new(vec![([0, 0], 3), ([0, 1], 9), ([0, 0], 1), ([0, 0], 2)]);
        assert_eq!(squares.within([[0, 0]; 2]).collect::<Vec<_>>(), [&3, &1, &2]);
        assert!(Squares::<u8>::default().within([[0, 0], [9, 9]]).next().is_none());
    }
}
