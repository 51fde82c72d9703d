//! A tree of boxes, in the order and form the client's format wants.

use nalgebra::Point3;

/// More than boxes wait to be opened in a tree of all items that 32 bits can number.
const DEPTH: usize = 64;

/// Smallest and largest corner of a box.
pub(super) type Bounds = [Point3<f64>; 2];

/// The box around some corners.
pub(super) fn bounds(corners: &[Point3<f64>]) -> Bounds {
    let start = [Point3::from([f64::INFINITY; 3]), Point3::from([f64::NEG_INFINITY; 3])];
    corners.iter().fold(start, |[low, high], corner| [low.inf(corner), high.sup(corner)])
}

/// What a box of the tree holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Content {
    /// One item.
    Item(u32),
    /// All boxes that follow, up to this many later.
    Subtree(u32),
}

/// Boxes around items, depth first.
#[derive(Clone, Debug, Default)]
pub(super) struct Tree {
    pub(super) nodes: Vec<(Bounds, Content)>,
}

impl Tree {
    /// A tree over the boxes of items 0, 1, 2, ….
    pub(super) fn new(boxes: impl Iterator<Item = Bounds>) -> Self {
        let mut items: Vec<(Bounds, u32)> = boxes.zip(0..).collect();
        let mut tree = Self { nodes: Vec::with_capacity(2 * items.len()) };
        if !items.is_empty() {
            tree.build(&mut items);
        }
        tree
    }

    #[allow(clippy::cast_possible_truncation, reason = "items are numbered with 32 bits")]
    fn build(&mut self, items: &mut [(Bounds, u32)]) {
        if let [(bounds, item)] = items {
            self.nodes.push((*bounds, Content::Item(*item)));
            return;
        }
        let all = items.iter().flat_map(|(bounds, _)| *bounds).collect::<Vec<_>>();
        let all = bounds(&all);
        let size = all[1] - all[0];
        let axis = size.imax();
        let middle = |bounds: &Bounds| bounds[0][axis] + bounds[1][axis];
        items.sort_by(|a, b| middle(&a.0).total_cmp(&middle(&b.0)).then(a.1.cmp(&b.1)));
        let index = self.nodes.len();
        self.nodes.push((all, Content::Subtree(0)));
        let (first, second) = items.split_at_mut(items.len() / 2);
        self.build(first);
        self.build(second);
        let size = (self.nodes.len() - index) as u32;
        if let Some((_, content)) = self.nodes.get_mut(index) {
            *content = Content::Subtree(size);
        }
    }

    /// The item nearest to a point by `place_of`, which gives an item's place, or `None` for an
    /// item that does not count; of items as near the first.
    ///
    /// Nearer boxes are opened first: whatever is farther than the first items found stays shut.
    pub(super) fn nearest(
        &self,
        point: &Point3<f64>,
        place_of: impl Fn(u32) -> Option<Point3<f64>>,
    ) -> Option<(u32, Point3<f64>)> {
        let mut best: Option<(f64, usize, u32, Point3<f64>)> = None;
        let mut open: Vec<(f64, usize)> = Vec::with_capacity(DEPTH);
        open.extend(self.gap2(0, point).map(|gap2| (gap2, 0)));
        while let Some((gap2, at)) = open.pop() {
            if best.is_some_and(|(best2, ..)| gap2 > best2) {
                continue;
            }
            match self.nodes.get(at)?.1 {
                Content::Subtree(_) => {
                    let [first, second] = self.halves(at);
                    let [near, far] = [self.gap2(first, point)?, self.gap2(second, point)?];
                    if far < near {
                        open.extend([(near, first), (far, second)]);
                    } else {
                        open.extend([(far, second), (near, first)]);
                    }
                }
                Content::Item(item) => {
                    let Some(place) = place_of(item) else { continue };
                    let distance2 = (place - point).norm_squared();
                    let wins = |(best2, before, ..): (f64, usize, u32, Point3<f64>)| {
                        distance2 < best2 || distance2 <= best2 && at < before
                    };
                    if best.is_none_or(wins) {
                        best = Some((distance2, at, item, place));
                    }
                }
            }
        }
        best.map(|(_, _, item, place)| (item, place))
    }

    /// Square of the distance from a point to a box; 0 inside, `None` beyond the last one.
    fn gap2(&self, at: usize, point: &Point3<f64>) -> Option<f64> {
        let ([low, high], _) = self.nodes.get(at)?;
        Some((point - point.sup(low).inf(high)).norm_squared())
    }

    /// The two boxes of a subtree.
    fn halves(&self, at: usize) -> [usize; 2] {
        let size = match self.nodes.get(at + 1) {
            Some((_, Content::Subtree(size))) => *size as usize,
            _ => 1,
        };
        [at + 1, at + 1 + size]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::town::random::Random;

    #[test]
    fn the_nearest_item_is_the_one_found_by_looking_at_all() {
        let mut random = Random::new(7);
        let mut place = |span_m: f64| {
            Point3::from([(); 3].map(|()| (random.between(0.0, span_m) * 2.0).round() / 2.0))
        };
        let items: Vec<Point3<f64>> = (0..300).map(|_| place(30.0)).collect();
        let tree = Tree::new(items.iter().map(|item| [*item, *item]));
        for step in 0..500 {
            let point = place(40.0);
            let counts = |item: &u32| step % 2 == 0 || item.is_multiple_of(3);
            let found = tree.nearest(&point, |item| {
                counts(&item).then(|| items.get(item as usize).copied()).flatten()
            });
            let gap2 = |item: &Point3<f64>| (item - point).norm_squared();
            let order = tree.nodes.iter().filter_map(|(_, content)| match content {
                Content::Item(item) => Some(*item),
                Content::Subtree(_) => None,
            });
            // Of several as near, the first in the order of the tree.
            let wanted = order
                .filter(counts)
                .filter_map(|item| Some((item, *items.get(item as usize)?)))
                .min_by(|a, b| gap2(&a.1).total_cmp(&gap2(&b.1)));
            assert_eq!(found, wanted);
        }
        assert_eq!(Tree::default().nearest(&place(1.0), |_| None), None);
    }
}
