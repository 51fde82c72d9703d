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
    /// The first segment of the path on which it may be met.
    start: usize,
}

impl<'a> Queue<'a> {
    /// Adds a body if its box comes near the strip.
    pub(super) fn add(&mut self, body: &'a Body, strip: impl FnOnce() -> Strip<'a>) {
        if let Some(start) = self.strip.get_or_insert_with(strip).start(body) {
            self.bodies.push(Candidate { body, start });
        }
    }

    /// The first body in the way.
    pub(crate) fn first(&self) -> Option<Ahead> {
        let strip = self.strip.as_ref()?;
        let mut best: Option<(Ahead, usize)> = None;
        let mut least: Vec<(f32, usize)> = Vec::with_capacity(self.bodies.len());
        least.extend(
            (0..)
                .zip(&self.bodies)
                .map(|(index, Candidate { body, start })| (strip.least_gap_m(body, *start), index)),
        );
        least.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        for (least_gap_m, index) in least {
            if best.is_some_and(|(ahead, _)| ahead.gap_m < least_gap_m) {
                break;
            }
            let Some(Candidate { body, start }) = self.bodies.get(index) else { continue };
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

    /// All of them, the first one first.
    pub(crate) fn all(&self) -> Vec<Ahead> {
        let Some(strip) = &self.strip else { return Vec::new() };
        let met = self.bodies.iter().filter_map(|it| strip.ahead(it.body, it.start));
        let mut all: Vec<Ahead> = met.collect();
        all.sort_by(|a, b| a.gap_m.total_cmp(&b.gap_m));
        all
    }
}
