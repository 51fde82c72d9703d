//! Who asks for the next picture at once when one was sent.
//!
//! A session that has one picture drawn at a time wants nothing in the moment between two of them.
//! A slice of somebody else's large picture that is begun in that moment takes as long as many of
//! its pictures. So for those who are owed time a moment is waited.
//!
//! - **Source:** anticipatory scheduling (Iyer and Druschel, 2001), there for disks.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use super::fair_queue::Whose;

/// Who asks again within this time is prompt; so long is waited for who was prompt the last time.
pub(crate) const PATIENCE: Duration = Duration::from_millis(3);
/// Those who were answered and have not asked again: more are forgotten.
const ANSWERED_MAX: usize = 1_024;

/// Those who were answered of late.
#[derive(Debug, Default)]
pub(crate) struct PromptAskers {
    answered: BTreeMap<Whose, Answered>,
}

#[derive(Debug)]
struct Answered {
    at: Instant,
    /// Whether the last question came promptly.
    was_prompt: bool,
    /// Whether another has come since.
    has_asked: bool,
}

impl PromptAskers {
    /// Notes that somebody asks.
    pub(crate) fn note_question(&mut self, whose: &Whose, now: Instant) {
        if let Some(answered) = self.answered.get_mut(whose)
            && !answered.has_asked
        {
            answered.was_prompt = now.duration_since(answered.at) <= PATIENCE;
            answered.has_asked = true;
        }
    }

    /// Notes that somebody's picture is drawn.
    pub(crate) fn note_answer(&mut self, whose: Whose, now: Instant) {
        if self.answered.len() >= ANSWERED_MAX {
            self.answered.retain(|_, answered| now.duration_since(answered.at) <= PATIENCE);
        }
        if self.answered.len() < ANSWERED_MAX || self.answered.contains_key(&whose) {
            let was_prompt = self.answered.get(&whose).is_some_and(|before| before.was_prompt);
            self.answered.insert(whose, Answered { at: now, was_prompt, has_asked: false });
        }
    }

    /// Those of them who are owed time and should ask in a moment, each with until when.
    pub(crate) fn expected(
        &self,
        now: Instant,
        is_owed: impl Fn(&Whose) -> bool,
    ) -> Vec<(Whose, Instant)> {
        let expected = self.answered.iter().filter(|(whose, answered)| {
            let is_expected = answered.was_prompt && !answered.has_asked;
            is_expected && now < answered.at + PATIENCE && is_owed(whose)
        });
        expected.map(|(whose, answered)| (whose.clone(), answered.at + PATIENCE)).collect()
    }
}

#[cfg(test)]
mod tests {
    use schemas::WorldId;

    use super::*;

    #[test]
    fn only_who_is_prompt_and_owed_is_waited_for_and_not_for_long() {
        let mut askers = PromptAskers::default();
        let whose = |session| ("one".parse().unwrap(), WorldId::new(session).unwrap());
        let (prompt, slow) = (whose(1), whose(2));
        let begun = Instant::now();
        let at = |millis| begun + Duration::from_millis(millis);
        for who in [&prompt, &slow] {
            askers.note_question(who, at(0));
            askers.note_answer(who.clone(), at(10));
        }
        let until = |askers: &PromptAskers, now| {
            let expected = askers.expected(now, |_| true);
            expected.into_iter().map(|(_, until)| until).max()
        };
        assert_eq!(until(&askers, at(10)), None);
        askers.note_question(&prompt, at(12));
        askers.note_question(&slow, at(20));
        assert_eq!(until(&askers, at(21)), None);
        askers.note_answer(slow, at(30));
        assert_eq!(until(&askers, at(30)), None);
        askers.note_answer(prompt.clone(), at(31));
        assert_eq!(until(&askers, at(32)), Some(at(31) + PATIENCE));
        assert_eq!(askers.expected(at(32), |who| *who != prompt), []);
        assert_eq!(until(&askers, at(31) + PATIENCE), None);
        askers.note_question(&prompt, at(40));
        askers.note_answer(prompt, at(41));
        assert_eq!(until(&askers, at(41)), None);
    }

    #[test]
    fn those_who_never_ask_again_are_forgotten() {
        let mut askers = PromptAskers::default();
        let begun = Instant::now();
        for session in 1..=10_000 {
            let whose = ("one".parse().unwrap(), WorldId::new(session).unwrap());
            askers.note_answer(whose, begun + Duration::from_millis(session));
        }
        assert!(askers.answered.len() <= ANSWERED_MAX);
    }
}
