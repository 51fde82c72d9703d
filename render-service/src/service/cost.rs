//! What drawing costs: guessed at first, then learned from what was drawn.

use std::time::Duration;

use crate::sliced::Work;

/// Guessed nanoseconds of a pass, of a pixel of colour and of one of geometry: on two processors
/// that have other work as well.
const SOFTWARE_NANOS: [f64; 3] = [8e5, 25.0, 10.0];
/// The same on a GPU.
const GPU_NANOS: [f64; 3] = [3e5, 2.0, 2.0];
/// How far one observation moves the estimate towards what was seen.
const STEP: f64 = 0.2;
/// How wrong the guess may turn out to be, as a factor either way.
const FACTOR_MAX: f64 = 100.0;

/// An estimate that is linear in the parts of the work.
///
/// - **Units:** nanoseconds.
/// - **Source:** normalised least mean squares; each part counts by what it was guessed to cost.
#[derive(Clone, Debug)]
pub(crate) struct CostModel {
    guess: [f64; 3],
    /// What each part costs, as a factor of the guess.
    factors: [f64; 3],
}

impl CostModel {
    /// For processors or a GPU.
    pub(crate) fn new(is_software: bool) -> Self {
        let guess = if is_software { SOFTWARE_NANOS } else { GPU_NANOS };
        Self { guess, factors: [1.0; 3] }
    }

    /// What this takes, in nanoseconds; at least 1.
    pub(crate) fn nanos(&self, work: &Work) -> u64 {
        let parts = self.guessed(work);
        let sum: f64 = parts.iter().zip(self.factors).map(|(part, factor)| part * factor).sum();
        sum.max(1.0) as u64
    }

    /// Learns how long something took. What took much longer than it should, as the processors were
    /// taken away meanwhile, counts as twice as long.
    pub(crate) fn learn(&mut self, work: &Work, took: Duration) {
        let expected = self.nanos(work) as f64;
        let error = (took.as_nanos() as f64).min(2.0 * expected) - expected;
        let parts = self.guessed(work);
        let squares: f64 = parts.iter().map(|part| part * part).sum();
        if squares == 0.0 {
            return;
        }
        for (factor, part) in self.factors.iter_mut().zip(parts) {
            let better = *factor + STEP * error * part / squares;
            *factor = better.clamp(1.0 / FACTOR_MAX, FACTOR_MAX);
        }
    }

    fn guessed(&self, work: &Work) -> [f64; 3] {
        let [pass, colour, geometry] = self.guess;
        [
            work.passes as f64 * pass,
            work.colour_px as f64 * colour,
            work.geometry_px as f64 * geometry,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_things_cost_is_learned_by_parts_and_outliers_do_little() {
        let mut model = CostModel::new(true);
        let truth = |work: &Work| {
            Duration::from_nanos(
                2_000_000 * work.passes + 30 * work.colour_px + 45 * work.geometry_px,
            )
        };
        let works = [(1, 57_600, 0), (1, 921_600, 0), (2, 0, 460_800), (3, 230_400, 57_600)]
            .map(|(passes, colour_px, geometry_px)| Work { passes, colour_px, geometry_px });
        for _ in 0..400 {
            works.iter().for_each(|work| model.learn(work, truth(work)));
        }
        let is_near = |model: &CostModel, work: &Work| {
            let ratio = model.nanos(work) as f64 / truth(work).as_nanos() as f64;
            (0.7..1.4).contains(&ratio)
        };
        assert!(works.iter().all(|work| is_near(&model, work)), "{model:?}");
        model.learn(&works[1], Duration::from_secs(30));
        assert!(works.iter().all(|work| is_near(&model, work)), "{model:?}");
    }
}
