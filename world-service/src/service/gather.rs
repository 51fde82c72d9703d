//! One answer from the results of several shards.

use std::sync::{Arc, Mutex, PoisonError};

use schemas::Reply;

use super::Answer;

type Finish<T> = Box<dyn FnOnce(Vec<T>) -> Reply + Send>;

/// Collects results from several threads; the last one answers. Dropped before that, the asker
/// hears of an internal error.
pub struct Gather<T> {
    state: Mutex<State<T>>,
}

struct State<T> {
    results: Vec<Option<T>>,
    missing: usize,
    finish: Option<(Finish<T>, Answer)>,
}

impl<T> Gather<T> {
    /// Waits for `count` results, at least one.
    pub fn new(
        count: usize,
        answer: Answer,
        finish: impl FnOnce(Vec<T>) -> Reply + Send + 'static,
    ) -> Arc<Self> {
        let results = std::iter::repeat_with(|| None).take(count).collect();
        let finish = Some((Box::new(finish) as Finish<T>, answer));
        Arc::new(Self { state: Mutex::new(State { results, missing: count, finish }) })
    }

    /// Gives the results at these indices; each index counts once.
    pub fn give(&self, given: impl IntoIterator<Item = (usize, T)>) {
        // A result is moved in whole or not at all, so a poisoned state is a good state.
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        for (index, result) in given {
            if let Some(empty @ None) = state.results.get_mut(index) {
                *empty = Some(result);
                state.missing -= 1;
            }
        }
        if state.missing > 0 {
            return;
        }
        let results = std::mem::take(&mut state.results).into_iter().flatten().collect();
        let finish = state.finish.take();
        drop(state);
        if let Some((finish, answer)) = finish {
            answer(finish(results));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use schemas::WorldId;

    use super::*;

    #[test]
    fn the_last_result_answers_in_the_order_of_the_indices() {
        let (sender, replies) = mpsc::sync_channel(2);
        let answer: Answer = Box::new(move |reply| sender.send(reply).unwrap());
        let gather = Gather::new(3, answer, Reply::Forked);
        let id = |value| WorldId::new(value).unwrap();
        gather.give([(2, id(3))]);
        gather.give([(2, id(9)), (7, id(9))]);
        assert!(replies.try_recv().is_err());
        gather.give([(0, id(1)), (1, id(2))]);
        assert_eq!(replies.try_recv().unwrap(), Reply::Forked(vec![id(1), id(2), id(3)]));
    }
}
