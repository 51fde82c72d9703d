//! A tree of boxes, in the order and form the client's format wants.

use nalgebra::Point3;

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
    /// item that does not count.
    pub(super) fn nearest(
        &self,
        point: &Point3<f64>,
        place_of: impl Fn(u32) -> Option<Point3<f64>>,
    ) -> Option<(u32, Point3<f64>)> {
        let mut best: Option<(f64, u32, Point3<f64>)> = None;
        let mut at = 0;
        while let Some(([low, high], content)) = self.nodes.get(at) {
            let outside = point - point.sup(low).inf(high);
            let hopeless = best.is_some_and(|(best2, ..)| outside.norm_squared() >= best2);
            at += match content {
                Content::Subtree(size) if hopeless => *size as usize,
                Content::Subtree(_) => 1,
                Content::Item(item) => {
                    if !hopeless && let Some(place) = place_of(*item) {
                        let distance2 = (place - point).norm_squared();
                        if best.is_none_or(|(best2, ..)| distance2 < best2) {
                            best = Some((distance2, *item, place));
                        }
                    }
                    1
                }
            };
        }
        best.map(|(_, item, place)| (item, place))
    }
}
