//! Who is in the way of a vehicle, as far as it is asked for.

use super::strip::Strip;
use super::{Ahead, Body};

/// Bodies in the way of a vehicle on a path.
#[derive(Debug, Default)]
pub(crate) struct Queue<'a> {
    /// None while nobody may be in the way.
    strip: Option<Strip<'a>>,
    /// In the order of the scene.
    bodies: Vec<Candidate<'a>>,
}

/// A body that may be in the way.
#[derive(Clone, Copy, Debug)]
struct Candidate<'a> {
    body: &'a Body,
    /// The first segment of the path on which it may be met, and the least gap to it then.
    start: usize,
    least_gap_m: f32,
}

impl<'a> Queue<'a> {
    /// Adds a body that is met from a segment on at the earliest.
    pub(super) fn add(&mut self, body: &'a Body, start: usize, strip: impl FnOnce() -> Strip<'a>) {
        let least_gap_m = self.strip.get_or_insert_with(strip).least_gap_m(body, start);
        self.bodies.push(Candidate { body, start, least_gap_m });
    }

    /// The first body in the way.
    pub(crate) fn first(&self) -> Option<Ahead> {
        let strip = self.strip.as_ref()?;
        let mut best: Option<(Ahead, usize)> = None;
        let mut next = self.nearest_after(None);
        while let Some((least_gap_m, index)) = next {
            if best.is_some_and(|(ahead, _)| ahead.gap_m < least_gap_m) {
                break;
            }
            next = self.nearest_after(next);
            let Some(Candidate { body, start, .. }) = self.bodies.get(index) else { continue };
            let Some(ahead) = strip.ahead(body, *start) else { continue };
            // Of equals the first one of the scene, as in the whole queue.
            let is_first = best.is_none_or(|(known, before)| {
                ahead.gap_m.total_cmp(&known.gap_m).then(index.cmp(&before)).is_lt()
            });
            if is_first {
                best = Some((ahead, index));
            }
        }
        best.map(|(ahead, _)| ahead)
    }

    /// The least gap and the position of the body that may be met next after another one.
    fn nearest_after(&self, before: Option<(f32, usize)>) -> Option<(f32, usize)> {
        let order = |a: &(f32, usize), b: &(f32, usize)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        let all = self.bodies.iter().zip(0..).map(|(it, index)| (it.least_gap_m, index));
        let others = all.filter(|it| before.is_none_or(|before| order(it, &before).is_gt()));
        others.min_by(order)
    }

    /// All of them, the first one first.
    pub(crate) fn all(&self) -> Vec<Ahead> {
        let Some(strip) = &self.strip else { return Vec::new() };
        let met = self.bodies.iter().filter_map(|it| strip.ahead(it.body, it.start));
        let mut all: Vec<Ahead> = met.collect();
        all.sort_by(|a, b| a.gap_m.total_cmp(&b.gap_m));
        all
    }
}
