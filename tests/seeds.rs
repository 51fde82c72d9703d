//! Seeds of simulations: a thousand by default; `CAUSEWAY_SEEDS=100000` or `CAUSEWAY_SEEDS=77..78`
//! for others.

use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

/// Runs with every seed; says with which one it failed.
pub(crate) fn each(mut run: impl FnMut(u64)) {
    for seed in seeds() {
        if let Err(panic) = catch_unwind(AssertUnwindSafe(|| run(seed))) {
            eprintln!("repeat it with CAUSEWAY_SEEDS={seed}..{}", seed + 1);
            resume_unwind(panic);
        }
    }
}

/// A number of seeds, or a range of them.
fn seeds() -> Range<u64> {
    let Ok(wanted) = std::env::var("CAUSEWAY_SEEDS") else { return 0..1_000 };
    let number = |text: &str| text.trim().parse().expect("CAUSEWAY_SEEDS is N or FROM..TO");
    match wanted.split_once("..") {
        Some((from, to)) => number(from)..number(to),
        None => 0..number(&wanted),
    }
}
