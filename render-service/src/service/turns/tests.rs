//! Tenants who share one who draws, in the time of a model.

use schemas::WorldId;

use super::*;

const MILLIS: u64 = 1_000_000;
/// Between two looks at who asks while nothing is drawn.
const LOOK_NANOS: u64 = MILLIS / 4;
/// Between an answer and the next question of the same session.
const PAUSE_NANOS: u64 = MILLIS;

/// Somebody who asks again soon after an answer, always for the same.
struct Asker {
    whose: Whose,
    cost_nanos: u64,
    got_nanos: u64,
    longest_wait_nanos: u64,
}

fn asker(tenant: &str, session: u64, cost_millis: u64) -> Asker {
    let whose = (tenant.parse().unwrap(), WorldId::new(session).unwrap());
    Asker { whose, cost_nanos: cost_millis * MILLIS, got_nanos: 0, longest_wait_nanos: 0 }
}

/// What an asker waits for.
#[derive(Debug)]
struct Job {
    asker: usize,
    asked_at: u64,
    left_nanos: u64,
}

/// Begins at most a slice of a job, and takes slices for half as dear as they are. Where it took
/// small things for dearer they would go in several rounds, and one would always wait.
struct Model;

struct Turn {
    whose: Whose,
    job: Job,
    slice_nanos: u64,
    estimate: u64,
}

impl Begin<Job> for Model {
    type Turn = Turn;

    fn can_begin(&self, _: &Tenant, _: &Job) -> bool {
        true
    }

    fn cost_of_turn(&self, job: &Job) -> u64 {
        job.left_nanos.min(SLICE_NANOS)
    }

    fn begin(&mut self, whose: &Whose, job: Job) -> Option<(Turn, u64)> {
        let slice_nanos = self.cost_of_turn(&job);
        let is_slice = slice_nanos == SLICE_NANOS;
        let estimate = if is_slice { slice_nanos / 2 } else { slice_nanos };
        Some((Turn { whose: whose.clone(), job, slice_nanos, estimate }, estimate))
    }
}

/// Serves them for so long.
fn served(mut askers: Vec<Asker>, millis: u64) -> Vec<Asker> {
    let mut queue = FairQueue::new(64, SAVED_NANOS_MAX);
    let mut asking: Vec<(u64, usize)> = (0..askers.len()).map(|at| (0, at)).collect();
    let (mut now, mut prompt, mut held) = (0, PromptAskers::default(), None::<Awaited>);
    let begun = Instant::now();
    let moment = |now| begun + Duration::from_nanos(now);
    while now < millis * MILLIS {
        if let Some(held) = held.take() {
            held.settle(&mut queue, moment(now));
        }
        for (when, at) in asking.extract_if(.., |(when, _)| *when <= now) {
            let Asker { whose, cost_nanos, .. } = &askers[at];
            prompt.note_question(whose, moment(when));
            queue
                .push(whose.clone(), Job { asker: at, asked_at: when, left_nanos: *cost_nanos })
                .unwrap();
        }
        let Round { turns, awaited } = next_round(&mut queue, &prompt, &mut Model, moment(now));
        now +=
            if turns.is_empty() { LOOK_NANOS } else { turns.iter().map(|t| t.slice_nanos).sum() };
        held = awaited.filter(|_| turns.is_empty());
        for Turn { whose, mut job, slice_nanos, estimate } in turns {
            queue.charge(&whose, slice_nanos as i64 - estimate as i64);
            let asker = &mut askers[job.asker];
            asker.got_nanos += slice_nanos;
            job.left_nanos -= slice_nanos;
            if job.left_nanos > 0 {
                queue.put_back(whose, job);
            } else {
                asker.longest_wait_nanos = asker.longest_wait_nanos.max(now - job.asked_at);
                prompt.note_answer(whose, moment(now));
                asking.push((now + PAUSE_NANOS, job.asker));
            }
        }
    }
    askers
}

/// Of the time, what each has had.
fn shares(served: &[Asker], millis: u64) -> Vec<f64> {
    served.iter().map(|asker| asker.got_nanos as f64 / (millis * MILLIS) as f64).collect()
}

/// The goal: at least 80 % of an eighth each, for seven whose pictures cost so much, and none of
/// them waits longer than two slices and what the seven ask for take.
fn seven_get_their_eighths(cost_millis: u64) {
    let wild = (1..=32).map(|session| asker("wild", session, 2_000));
    let small = (0..7).map(|at| asker(&format!("small-{at}"), 100 + at, cost_millis));
    let served = served(wild.chain(small).collect(), 80_000);
    let shares = shares(&served, 80_000);
    let (wild, small) = shares.split_at(32);
    let of_wild: f64 = wild.iter().sum();
    let waits = served.iter().skip(32).map(|asker| asker.longest_wait_nanos / MILLIS);
    let longest_millis = waits.max().unwrap();
    println!("of {cost_millis} ms: {small:.3?}, wild {of_wild:.3}, waits {longest_millis} ms");
    assert!(small.iter().all(|share| *share >= 0.8 / 8.0), "{small:.3?}");
    assert!(of_wild >= 0.8 / 8.0, "{of_wild}");
    assert!(longest_millis <= 2 * 30 + 7 * cost_millis, "{longest_millis} ms");
}

#[test]
fn seven_small_tenants_beside_a_wild_one_get_their_eighths() {
    seven_get_their_eighths(8);
}

#[test]
fn seven_tenants_of_pictures_far_below_a_slice_get_their_eighths_too() {
    seven_get_their_eighths(1);
}

/// Who waits long between two small pictures is not waited for at the cost of others.
#[test]
fn one_small_tenant_leaves_a_wild_one_its_half() {
    let served = served(vec![asker("wild", 1, 2_000), asker("small", 2, 1)], 40_000);
    let shares = shares(&served, 40_000);
    println!("the wild one and the small one: {shares:.3?}");
    assert!(shares[0] >= 0.8 / 2.0, "{shares:.3?}");
}

#[test]
fn sessions_of_a_tenant_share_what_it_gets() {
    let costs = [2_000, 2_000, 100, 8];
    let askers = costs.iter().zip(1..).map(|(cost, session)| asker("one", session, *cost));
    let shares = shares(&served(askers.collect(), 40_000), 40_000);
    println!("{shares:.3?}");
    assert!(shares.iter().all(|share| *share >= 0.8 / 4.0), "{shares:.3?}");
}
