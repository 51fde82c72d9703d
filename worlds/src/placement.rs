//! Where a new world goes.
//!
//! Of two hosts drawn at random the one with less to do: with loads that are a second old,
//! whoever always takes the least loaded sends everybody to the same host until the next load.
//!
//! **Source:** Mitzenmacher, "The Power of Two Choices in Randomized Load Balancing", IEEE TPDS
//! 12(10), 2001; the same, "How Useful Is Old Information?", IEEE TPDS 11(1), 2000.

use schemas::{Load, SplitMix64};

/// Hosts of this machine come before others while their score is below this.
const NEAR_SCORE_MAX: f64 = 0.7;
/// How busy one more world is taken to make a host until it tells its next load.
const BUSY_OF_A_WORLD: f64 = 0.002;

/// A host that takes new worlds.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Candidate {
    /// What it told last, if it has.
    pub(crate) load: Option<Load>,
    /// Worlds that were placed there since.
    pub(crate) placed: u32,
    /// Whether it is on this machine.
    pub(crate) is_near: bool,
    /// Whether it has said anything of itself.
    pub(crate) is_known: bool,
}

impl Candidate {
    /// 0 for who has nothing to do, 1 for who can take no more.
    fn score(&self) -> f64 {
        let load = self.load.unwrap_or_default();
        let placed = f64::from(self.placed);
        let busy = f64::from(load.busy) + placed * BUSY_OF_A_WORLD;
        let taken = f64::from(load.worlds) + placed;
        let share = if load.worlds_max == 0 { 0.0 } else { taken / f64::from(load.worlds_max) };
        busy.max(share)
    }
}

/// The place of the chosen one; `None` when there is none. The only one is chosen without dice. Who
/// is only announced, and says nothing, comes after all others: anybody can announce anything.
pub(crate) fn choose(candidates: &[Candidate], dice: &mut SplitMix64) -> Option<usize> {
    let those = |are: fn(&Candidate) -> bool| -> Vec<usize> {
        let all = candidates.iter().enumerate();
        all.filter(|(_, host)| are(host)).map(|(index, _)| index).collect()
    };
    let mut open = those(|host| host.is_near && host.is_known && host.score() < NEAR_SCORE_MAX);
    if open.is_empty() {
        open = those(|host| host.is_known);
    }
    if open.is_empty() {
        open = those(|_| true);
    }
    if open.len() < 2 {
        return open.pop();
    }
    let mut draw = || {
        let index = (dice.next_u64() % open.len() as u64) as usize;
        open.swap_remove(index)
    };
    let (first, second) = (draw(), draw());
    let score = |index: usize| candidates.get(index).map_or(f64::MAX, Candidate::score);
    Some(if score(second) < score(first) { second } else { first })
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOSTS: usize = 10;
    const FACES: usize = 8;
    /// Worlds per second, and how long each lives.
    const WORLDS_PER_SECOND: usize = 400;
    const LIFE_SECS: usize = 20;
    const SECONDS: usize = 60;

    fn near(busy: f32) -> Candidate {
        let load = Load { worlds: 0, worlds_max: 100, busy };
        Candidate { load: Some(load), placed: 0, is_near: true, is_known: true }
    }

    #[test]
    fn the_only_host_is_chosen_without_dice_and_of_two_the_one_with_less_to_do() {
        let mut dice = SplitMix64::new(1);
        assert_eq!(choose(&[], &mut dice), None);
        assert_eq!(choose(&[near(0.9)], &mut dice), Some(0));
        assert_eq!(dice, SplitMix64::new(1));
        for _ in 0..100 {
            assert_eq!(choose(&[near(0.5), near(0.2)], &mut dice), Some(1));
        }
        let many = Load { worlds: 60, worlds_max: 100, busy: 0.2 };
        let full = Candidate { load: Some(many), ..near(0.0) };
        assert_eq!(choose(&[full, near(0.3)], &mut dice), Some(1));
    }

    #[test]
    fn a_host_of_this_machine_comes_first_while_it_has_room() {
        let mut dice = SplitMix64::new(1);
        let far = Candidate { is_near: false, ..near(0.0) };
        for _ in 0..100 {
            assert_eq!(choose(&[far, near(0.5), far], &mut dice), Some(1));
        }
        let chosen = |dice: &mut SplitMix64| choose(&[far, near(0.9), far], dice);
        assert!((0..100).all(|_| chosen(&mut dice) != Some(1)), "it has too much to do");
    }

    #[test]
    fn who_says_nothing_of_itself_comes_after_all_others() {
        let mut dice = SplitMix64::new(1);
        let silent = Candidate::default();
        let far = Candidate { is_near: false, ..near(0.99) };
        for _ in 0..100 {
            assert_eq!(choose(&[silent, silent, far, silent], &mut dice), Some(2));
        }
        assert!(choose(&[silent, silent], &mut dice).is_some(), "better than nobody");
    }

    /// The promise is 5 µs; a busy machine gets a hundred times as long.
    #[test]
    fn one_of_a_hundred_hosts_is_chosen_soon() {
        let hosts: Vec<Candidate> = (0..100).map(|host| near(host as f32 / 100.0)).collect();
        let (mut dice, begun) = (SplitMix64::new(1), std::time::Instant::now());
        assert!((0..10_000).all(|_| choose(&hosts, &mut dice).is_some()));
        let micros = begun.elapsed().as_secs_f64() * 100.0;
        eprintln!("one of a hundred hosts is chosen in {micros:.2} µs");
        assert!(micros < 500.0, "{micros} µs");
    }

    /// Eight faces that hear loads once a second. The most loaded host over the mean, after it has
    /// settled.
    #[test]
    fn loads_stay_even_though_they_are_told_late() {
        let mut dice = SplitMix64::new(7);
        let mut ends = [[0_u32; LIFE_SECS]; HOSTS];
        let mut worst: f64 = 0.0;
        for second in 0..SECONDS {
            ends.iter_mut().for_each(|host| host[second % LIFE_SECS] = 0);
            let worlds = ends.map(|host| host.iter().sum::<u32>());
            let told = worlds.map(|worlds| Candidate {
                load: Some(Load { worlds, worlds_max: 4_096, busy: worlds as f32 / 4_096.0 }),
                is_known: true,
                ..Candidate::default()
            });
            let mut heard = [told; FACES];
            for world in 0..WORLDS_PER_SECOND {
                let candidates = &mut heard[world % FACES];
                let host = choose(candidates, &mut dice).unwrap();
                candidates[host].placed += 1;
                ends[host][second % LIFE_SECS] += 1;
            }
            let now = ends.map(|host| f64::from(host.iter().sum::<u32>()));
            let mean = now.iter().sum::<f64>() / HOSTS as f64;
            if second >= LIFE_SECS {
                worst = worst.max(now.into_iter().fold(0.0, f64::max) / mean);
            }
        }
        assert!(worst < 1.10, "{worst}");
    }
}
