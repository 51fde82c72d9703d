//! Random numbers of one sensor.

use nalgebra::{ComplexField, RealField};
use serde::{Deserialize, Serialize};

use schemas::SplitMix64;

/// A stream of its own for each sensor, so that one more sensor changes nothing for the others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Noise {
    rng: SplitMix64,
}

impl Noise {
    /// The stream that follows from the world's seed, the sensor's `noise_seed` and its
    /// number in that world.
    pub(super) fn new(world_seed: u64, noise_seed: u64, sensor: u32) -> Self {
        let branch = |seed: u64, branch: u64| SplitMix64::new(seed).next_u64() ^ branch;
        let seed = branch(branch(world_seed, noise_seed), sensor.into());
        Self { rng: SplitMix64::new(SplitMix64::new(seed).next_u64()) }
    }

    /// From 0 up to but without 1, all equally likely.
    pub(super) fn uniform(&mut self) -> f32 {
        // The upper 24 bits: as many as single precision has.
        (self.rng.next_u64() >> 40) as f32 / (1u32 << 24) as f32
    }

    /// Normally distributed about 0; draws nothing for a deviation of 0.
    ///
    /// - **Source:** Box, Muller, "A note on the generation of random normal deviates", 1958.
    pub(super) fn normal(&mut self, deviation: f64) -> f64 {
        if deviation == 0.0 {
            return 0.0;
        }
        let mut unit = || (self.rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        let (first, second) = (1.0 - unit(), unit());
        let radius = ComplexField::sqrt(-2.0 * ComplexField::ln(first));
        deviation * radius * ComplexField::cos(f64::two_pi() * second)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(world_seed: u64, noise_seed: u64, sensor: u32) -> Noise {
        Noise::new(world_seed, noise_seed, sensor)
    }

    #[test]
    fn normal_numbers_have_the_mean_and_deviation_asked_for() {
        let mut noise = noise(1, 0, 1);
        let values: Vec<f64> = (0..20_000).map(|_| noise.normal(2.0)).collect();
        let mean = values.iter().sum::<f64>() / 20_000.0;
        let square = values.iter().map(|value| value * value).sum::<f64>() / 20_000.0;
        // Five standard errors.
        assert!(mean.abs() < 0.07, "{mean}");
        assert!((square.sqrt() - 2.0).abs() < 0.05, "{square}");
    }

    #[test]
    fn every_seed_and_sensor_has_a_stream_of_its_own() {
        let first = |mut noise: Noise| noise.uniform();
        let streams = [noise(1, 0, 1), noise(2, 0, 1), noise(1, 1, 1), noise(1, 0, 2)];
        let mut firsts = streams.map(first);
        assert_eq!(firsts[0], first(noise(1, 0, 1)));
        firsts.sort_by(f32::total_cmp);
        assert!(firsts.windows(2).all(|pair| pair[0] != pair[1]), "{firsts:?}");
    }
}
