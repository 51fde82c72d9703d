//! Whose step a shared world waits for: pure, without a world or a clock.

use schemas::Command;

/// The seats of a shared world, one for each ego, and what is asked for them.
pub(super) struct Rounds {
    seats: Vec<Seat>,
    /// Whether empty seats are waited for no more.
    has_begun: bool,
    /// Those whose absence the world is being told.
    telling: Vec<usize>,
}

#[derive(Default)]
struct Seat {
    who: Who,
    asked: Option<Asked>,
    /// Nobody has told the world yet that nobody steps it.
    is_newly_absent: bool,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Who {
    /// Nobody has come, or who was here has gone.
    #[default]
    Nobody,
    /// Somebody whose step is waited for.
    Here,
    /// Somebody who was waited for too long, until the next step.
    Late,
    /// Nobody any more.
    Over,
}

struct Asked {
    commands: Vec<Command>,
    ticks: u32,
}

/// Why there is no seat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NoSeat {
    /// There is none of this number.
    Unknown,
    /// Somebody has it.
    Taken,
    /// Its episode is over.
    Over,
    /// All have somebody.
    Full,
}

/// What is done in the world at once.
#[derive(Debug, PartialEq)]
pub(super) struct Round {
    /// Of seats that nobody steps any more.
    pub(super) absent: Vec<usize>,
    /// In the order of the seats.
    pub(super) commands: Vec<(usize, Vec<Command>)>,
    pub(super) ticks: u32,
}

impl Rounds {
    /// So many seats; somebody has the first one.
    pub(super) fn new(count: usize) -> Self {
        let mut seats: Vec<Seat> = (0..count).map(|_| Seat::default()).collect();
        seats[0].who = Who::Here;
        Self { seats, has_begun: false, telling: Vec::new() }
    }

    pub(super) fn count(&self) -> usize {
        self.seats.len()
    }

    /// Takes a seat, or the first one that is free.
    pub(super) fn join(&mut self, wanted: Option<usize>) -> Result<usize, NoSeat> {
        let seat = match wanted {
            Some(seat) => match self.seats.get(seat).ok_or(NoSeat::Unknown)?.who {
                Who::Nobody => seat,
                Who::Here | Who::Late => return Err(NoSeat::Taken),
                Who::Over => return Err(NoSeat::Over),
            },
            None => {
                let mut all = self.seats.iter();
                all.position(|seat| seat.who == Who::Nobody).ok_or(NoSeat::Full)?
            }
        };
        self.seats[seat].who = Who::Here;
        Ok(seat)
    }

    /// Gives a seat up; `is_over`: for good.
    pub(super) fn leave(&mut self, seat: usize, is_over: bool) {
        let seat = &mut self.seats[seat];
        if seat.who == Who::Over {
            return;
        }
        seat.is_newly_absent |= seat.who == Who::Here;
        seat.who = if is_over { Who::Over } else { Who::Nobody };
        seat.asked = None;
    }

    /// Asks for a step of one tick or more.
    pub(super) fn ask(&mut self, seat: usize, commands: Vec<Command>, ticks: u32) {
        let seat = &mut self.seats[seat];
        seat.who = Who::Here;
        seat.is_newly_absent = false;
        seat.asked = Some(Asked { commands, ticks });
    }

    /// Whether somebody waits for others.
    pub(super) fn is_waiting(&self) -> bool {
        self.seats.iter().any(|seat| seat.asked.is_some())
    }

    /// Whether it is only for egos that nobody has joined as yet.
    pub(super) fn lacks_only_guests(&self) -> bool {
        !self.has_begun && self.late().next().is_none()
    }

    /// Whether nobody has to be waited for.
    pub(super) fn is_due(&self) -> bool {
        let is_here = |seat: &Seat| seat.who != Who::Nobody;
        let all_have_come = self.has_begun || self.seats.iter().all(is_here);
        self.is_waiting() && all_have_come && self.late().next().is_none()
    }

    /// Waits no longer. Gives the seats that nobody steps from now on.
    pub(super) fn expire(&mut self) -> Vec<usize> {
        let are_guests = self.lacks_only_guests();
        let late: Vec<usize> = if are_guests {
            let free = self.seats.iter().enumerate();
            free.filter(|(_, seat)| seat.who == Who::Nobody).map(|(index, _)| index).collect()
        } else {
            self.late().collect()
        };
        for index in &late {
            let seat = &mut self.seats[*index];
            seat.is_newly_absent = true;
            if seat.who == Who::Here {
                seat.who = Who::Late;
            }
        }
        self.has_begun |= are_guests;
        late
    }

    /// What is due: as many ticks as the shortest step still takes.
    pub(super) fn begin(&mut self) -> Round {
        self.has_begun = true;
        let absent = self.seats.iter_mut().enumerate();
        let absent = absent
            .filter_map(|(index, seat)| std::mem::take(&mut seat.is_newly_absent).then_some(index));
        let absent: Vec<usize> = absent.collect();
        self.telling.clone_from(&absent);
        let ticks = self.asked().map(|(_, asked)| asked.ticks).min().unwrap_or_default();
        let asked = self.seats.iter_mut().enumerate();
        let asked = asked.filter_map(|(index, seat)| Some((index, seat.asked.as_mut()?)));
        let commands = asked.map(|(index, asked)| (index, std::mem::take(&mut asked.commands)));
        Round { absent, commands: commands.collect(), ticks }
    }

    /// Notes that so many ticks are done. Gives the seats whose steps are.
    pub(super) fn done(&mut self, ticks: u32) -> Vec<usize> {
        self.telling.clear();
        let mut done = Vec::new();
        for (index, seat) in self.seats.iter_mut().enumerate() {
            let Some(asked) = &mut seat.asked else { continue };
            asked.ticks = asked.ticks.saturating_sub(ticks);
            if asked.ticks == 0 {
                seat.asked = None;
                done.push(index);
            }
        }
        done
    }

    /// Nothing of what was asked for will be done, and the world was told nothing. Gives the seats
    /// that had asked.
    pub(super) fn give_up(&mut self) -> Vec<usize> {
        for seat in std::mem::take(&mut self.telling) {
            self.seats[seat].is_newly_absent = true;
        }
        let seats = self.seats.iter_mut().enumerate();
        seats.filter_map(|(index, seat)| seat.asked.take().map(|_| index)).collect()
    }

    /// Whether somebody steps it.
    pub(super) fn is_here(&self, seat: usize) -> bool {
        self.seats[seat].who == Who::Here
    }

    fn asked(&self) -> impl Iterator<Item = (usize, &Asked)> {
        let seats = self.seats.iter().enumerate();
        seats.filter_map(|(index, seat)| Some((index, seat.asked.as_ref()?)))
    }

    /// Seats of those who are waited for.
    fn late(&self) -> impl Iterator<Item = usize> {
        let waited = |seat: &Seat| seat.who == Who::Here && seat.asked.is_none();
        let seats = self.seats.iter().enumerate();
        seats.filter(move |(_, seat)| waited(seat)).map(|(index, _)| index)
    }
}

#[cfg(test)]
mod tests {
    use schemas::ActorId;

    use super::*;

    fn said() -> Vec<Command> {
        vec![Command::DestroyActor { actor: ActorId::FIRST }]
    }

    #[test]
    fn the_first_tick_waits_for_all_egos_and_each_tick_for_all_steps() {
        let mut rounds = Rounds::new(3);
        rounds.ask(0, said(), 1);
        assert!(!rounds.is_due() && rounds.lacks_only_guests());
        assert_eq!(rounds.join(None), Ok(1));
        assert_eq!(rounds.join(Some(2)), Ok(2));
        assert!(!rounds.is_due() && !rounds.lacks_only_guests());
        rounds.ask(2, said(), 1);
        rounds.ask(1, Vec::new(), 1);
        assert!(rounds.is_due());
        let commands = vec![(0, said()), (1, Vec::new()), (2, said())];
        assert_eq!(rounds.begin(), Round { absent: Vec::new(), commands, ticks: 1 });
        assert_eq!(rounds.done(1), [0, 1, 2]);
        assert!(!rounds.is_waiting() && !rounds.is_due());
    }

    #[test]
    fn long_steps_go_on_while_short_ones_are_asked_for_again() {
        let mut rounds = Rounds::new(2);
        rounds.join(None).unwrap();
        rounds.ask(0, said(), 5);
        rounds.ask(1, said(), 2);
        assert_eq!(rounds.begin().ticks, 2);
        assert_eq!(rounds.done(2), [1]);
        assert!(!rounds.is_due());
        rounds.ask(1, said(), 4);
        let round = rounds.begin();
        // What the first one wanted is done already.
        assert_eq!((round.ticks, &round.commands[0].1), (3, &Vec::new()));
        assert_eq!(rounds.done(3), [0]);
    }

    #[test]
    fn who_is_late_is_waited_for_once_and_is_here_again_with_a_step() {
        let mut rounds = Rounds::new(2);
        rounds.join(None).unwrap();
        rounds.ask(0, Vec::new(), 1);
        assert_eq!(rounds.expire(), [1]);
        assert!(rounds.is_due() && !rounds.is_here(1));
        assert_eq!(rounds.begin().absent, [1]);
        rounds.done(1);
        rounds.ask(0, Vec::new(), 1);
        assert!(rounds.is_due());
        assert_eq!(rounds.begin().absent, [] as [usize; 0]);
        rounds.done(1);
        rounds.ask(1, Vec::new(), 1);
        assert!(!rounds.is_due() && rounds.is_here(1));
    }

    #[test]
    fn egos_that_nobody_joins_as_are_waited_for_once() {
        let mut rounds = Rounds::new(3);
        rounds.ask(0, Vec::new(), 1);
        assert_eq!(rounds.expire(), [1, 2]);
        assert!(rounds.is_due());
        assert_eq!(rounds.begin().absent, [1, 2]);
        rounds.done(1);
        rounds.ask(0, Vec::new(), 1);
        assert!(rounds.is_due());
        assert_eq!(rounds.join(Some(1)), Ok(1));
        assert!(!rounds.is_due());
    }

    #[test]
    fn who_leaves_completes_a_round_and_an_ego_whose_episode_is_over_is_nobodys() {
        let mut rounds = Rounds::new(2);
        rounds.join(None).unwrap();
        rounds.ask(0, Vec::new(), 1);
        rounds.leave(1, true);
        assert!(rounds.is_due());
        assert_eq!(rounds.begin().absent, [1]);
        assert_eq!(rounds.join(Some(1)), Err(NoSeat::Over));
        assert_eq!(rounds.join(None), Err(NoSeat::Full));
        assert_eq!(rounds.join(Some(0)), Err(NoSeat::Taken));
        assert_eq!(rounds.join(Some(2)), Err(NoSeat::Unknown));
        rounds.done(1);
        rounds.leave(0, false);
        assert_eq!(rounds.join(None), Ok(0));
    }

    #[test]
    fn a_world_that_could_not_be_told_of_an_absence_is_told_it_again() {
        let mut rounds = Rounds::new(2);
        rounds.join(None).unwrap();
        rounds.ask(0, Vec::new(), 1);
        rounds.expire();
        for _ in 0..2 {
            assert_eq!(rounds.begin().absent, [1]);
            assert_eq!(rounds.give_up(), [0]);
            rounds.ask(0, Vec::new(), 1);
        }
        assert_eq!(rounds.begin().absent, [1]);
        rounds.done(1);
        rounds.ask(0, Vec::new(), 1);
        assert_eq!(rounds.begin().absent, [] as [usize; 0]);
        assert_eq!(rounds.give_up(), [0]);
        rounds.ask(0, Vec::new(), 1);
        assert_eq!(rounds.begin().absent, [] as [usize; 0], "the round before told it");
    }

    #[test]
    fn who_goes_while_waiting_asks_for_nothing_more() {
        let mut rounds = Rounds::new(2);
        rounds.join(None).unwrap();
        rounds.ask(0, said(), 1);
        rounds.leave(0, false);
        assert!(!rounds.is_waiting());
        rounds.ask(1, said(), 1);
        // The ego of who has left is one that nobody has come for.
        assert!(rounds.lacks_only_guests());
        rounds.expire();
        assert_eq!(rounds.begin().commands.len(), 1);
        assert_eq!(rounds.give_up(), [1]);
    }
}
