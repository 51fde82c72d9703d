//! How long does it take to tell whose token one is, among ten thousand?
#![allow(clippy::unwrap_used, reason = "a bench that cannot run stops")]
#![allow(missing_docs, reason = "the macros of criterion define public items")]

use std::fmt::Write;
use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use jiff::Timestamp;
use tenancy::{People, Secret};

const TOKENS: usize = 10_000;

fn check(criterion: &mut Criterion) {
    let secrets: Vec<Secret> =
        (0..TOKENS).map(|at| Secret::new(format!("id-{at}").parse().unwrap()).unwrap()).collect();
    let mut file = "[tenant.lab]\n".to_owned();
    for (at, secret) in secrets.iter().enumerate() {
        let sha256 = secret.sha256();
        writeln!(file, "[[token]]\nid = \"id-{at}\"\ntenant = \"lab\"\nsha256 = \"{sha256}\"")
            .unwrap();
    }
    let people = People::parse(&file).unwrap();
    let now = Timestamp::now();
    let right = secrets.last().unwrap().token();
    let (wrong, unknown) = (format!("{right}x"), right.replace("id-9999", "nobody"));
    assert!(people.who(&right, now).is_some());
    assert!(people.who(&wrong, now).is_none() && people.who(&unknown, now).is_none());
    let mut group = criterion.benchmark_group("token");
    for (name, presented) in [("right", right), ("wrong", wrong), ("unknown", unknown)] {
        group.bench_function(name, |bencher| {
            bencher.iter(|| people.who(black_box(&presented), now));
        });
    }
    group.finish();
}

criterion_group!(benches, check);
criterion_main!(benches);
