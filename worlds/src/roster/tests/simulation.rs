//! Hosts that die, stand still and come again, and news of them that comes late, twice or never:
//! whoever is asked to place a world always can while somebody is up, and once all has been told,
//! what is known is what is.

#[path = "../../../../tests/seeds.rs"]
mod seeds;

use std::collections::VecDeque;

use super::*;

const STEPS: usize = 300;
const HOSTS: [&str; 4] = ["a", "b", "c", "d"];

/// What the bus says of a host, in the order in which it happened.
#[derive(Clone, Copy, Debug)]
enum Token {
    /// With the number of the process, or 0 where it was not told.
    Up(u32),
    Down,
}

/// What tasks say some time, in any order, or never.
#[derive(Clone, Copy, Debug)]
enum News {
    /// A way was opened, which leads to the process that runs then.
    Opened(Coming),
    /// Somebody watches the way to a process.
    Watched(Coming, u32),
    Load,
    Full,
    /// A world was made by a process.
    Made(u32),
}

/// A host of this machine, or of another one.
#[derive(Debug, Default)]
struct Host {
    /// Number of the process that runs.
    process: Option<u32>,
    is_heard: bool,
    is_draining: bool,
    tokens: VecDeque<Token>,
    news: Vec<News>,
}

struct Simulation {
    dice: SplitMix64,
    roster: Roster<u32>,
    hosts: [Host; HOSTS.len()],
    processes: u32,
}

impl Simulation {
    fn roll(&mut self, sides: usize) -> usize {
        (self.dice.next_u64() % sides as u64) as usize
    }

    fn step(&mut self) {
        let at = self.roll(HOSTS.len());
        let number_is_told = self.roll(8) > 0;
        let host = &mut self.hosts[at];
        let told = |number: u32| if number_is_told { number } else { 0 };
        match (self.dice.next_u64() % 12, host.process) {
            (0, None) => {
                self.processes += 1;
                (host.process, host.is_heard) = (Some(self.processes), true);
                host.tokens.push_back(Token::Up(told(self.processes)));
            }
            (0, Some(_)) => {
                host.process = None;
                if std::mem::take(&mut host.is_heard) {
                    host.tokens.push_back(Token::Down);
                }
            }
            // It stands still, and goes on.
            (1, Some(number)) => {
                host.is_heard = !host.is_heard;
                let token = if host.is_heard { Token::Up(told(number)) } else { Token::Down };
                host.tokens.push_back(token);
            }
            (2, _) => host.is_draining = !host.is_draining,
            (3, Some(number)) => host.news.push(News::Made(number)),
            (4, _) => host.news.push(News::Load),
            (5, _) => host.news.push(News::Full),
            (6, _) => self.tell_draining(),
            (7..=9, _) => self.hear_token(at),
            _ => self.hear_news(at),
        }
        self.place();
    }

    fn tell_draining(&mut self) {
        let hosts = &self.hosts;
        let drains = |id: &ServiceId| {
            HOSTS.iter().zip(hosts).any(|(name, host)| id == &self::id(name) && host.is_draining)
        };
        self.roster.note_draining(drains);
    }

    fn hear_token(&mut self, at: usize) {
        let Some(token) = self.hosts[at].tokens.pop_front() else { return };
        let is_doubled = self.roll(4) == 0;
        for _ in 0..=usize::from(is_doubled) {
            let news = match token {
                Token::Up(number) => self.roster.come_up(&id(HOSTS[at]), number).map(News::Opened),
                Token::Down => self
                    .roster
                    .fall_silent(&id(HOSTS[at]))
                    .map(|(coming, process)| News::Watched(coming, process)),
            };
            self.hosts[at].news.extend(news);
        }
    }

    fn hear_news(&mut self, at: usize) {
        let count = self.hosts[at].news.len();
        if count == 0 {
            return;
        }
        let which = self.roll(count);
        let (is_lost, is_doubled) = (self.roll(8) == 0, self.roll(4) == 0);
        let news = self.hosts[at].news[which];
        // A watch ends with the process alone.
        let is_watching = matches!(news, News::Watched(..));
        if !is_doubled && !is_watching {
            self.hosts[at].news.swap_remove(which);
        }
        if !is_lost || is_watching {
            self.tell(at, news);
        }
    }

    fn tell(&mut self, at: usize, news: News) {
        let (host, roster, id) = (&self.hosts[at], &mut self.roster, id(HOSTS[at]));
        match news {
            // The first half of the hosts are on this machine.
            News::Opened(coming) => {
                if let Some(process) = host.process {
                    roster.open(&id, coming, process, at < HOSTS.len() / 2);
                }
            }
            News::Watched(coming, process) if host.process != Some(process) => {
                roster.die(&id, coming);
            }
            News::Watched(..) => {}
            News::Load => roster.hear_load(&id, Load::default()),
            News::Full => roster.note_full(&id),
            News::Made(process) => roster.note_world(&id, world(process)),
        }
    }

    /// A world that is placed goes to the best that is known of those that are left.
    fn place(&mut self) {
        let but: BTreeSet<ServiceId> = HOSTS
            .iter()
            .filter(|_| self.dice.next_u64().is_multiple_of(4))
            .map(|name| id(name))
            .collect();
        let left: Vec<(ServiceId, bool)> = (self.roster.hosts.iter())
            .filter(|(id, _)| !but.contains(*id))
            .map(|(id, known)| (id.clone(), known.is_open() && !known.is_full))
            .collect();
        let placed = self.roster.place(&but).map(|(id, _)| id);
        match placed {
            None => assert!(left.is_empty(), "nobody is asked, of {left:?}"),
            Some(placed) => {
                let (_, is_good) = left.iter().find(|(id, _)| *id == placed).expect("one of them");
                assert!(*is_good || !left.iter().any(|(_, good)| *good), "{placed} of {left:?}");
            }
        }
    }

    /// Whoever stands still goes on, and everything is told.
    fn end(mut self) {
        for at in 0..HOSTS.len() {
            if let Some(number) = self.hosts[at].process {
                self.hosts[at].tokens.push_back(Token::Up(number));
            }
            while !self.hosts[at].tokens.is_empty() {
                self.hear_token(at);
            }
            for news in std::mem::take(&mut self.hosts[at].news) {
                self.tell(at, news);
            }
        }
        self.tell_draining();
        let running = || HOSTS.iter().zip(&self.hosts).filter(|(_, host)| host.process.is_some());
        let ids: Vec<ServiceId> = running().map(|(name, _)| id(name)).collect();
        let heard: Vec<ServiceId> = self.roster.heard().into_iter().map(|(id, _)| id).collect();
        assert_eq!(heard, ids);
        assert_eq!(self.roster.hosts.len(), ids.len(), "somebody is known that is gone");
        let is_open = running().any(|(_, host)| !host.is_draining);
        for (name, host) in running() {
            let process = host.process.unwrap();
            let (found, way) = self.roster.host_of(world(process)).expect("it is up");
            assert_eq!(found, &id(name));
            assert!(way.is_none_or(|way| *way == process), "{way:?} leads not to {process}");
            assert_eq!(self.roster.should_move(world(process)), host.is_draining && is_open);
        }
    }
}

fn run(seed: u64) {
    let mut simulation = Simulation {
        dice: SplitMix64::new(seed),
        roster: Roster::new(seed),
        hosts: Default::default(),
        processes: 0,
    };
    for _ in 0..STEPS {
        simulation.step();
    }
    simulation.end();
}

#[test]
fn whatever_is_told_of_hosts_in_the_end_all_that_run_are_known_and_no_other() {
    seeds::each(run);
}
