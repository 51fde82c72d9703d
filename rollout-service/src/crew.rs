//! Several stations, the first on the caller's thread and each other one on its own.

use std::io;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

use schemas::{Error, ErrorCode};

use crate::station::{Answer, Job, Station};

/// All stations of a batch.
pub(crate) struct Crew {
    own: Station,
    others: Vec<Worker>,
    /// Worlds of each station.
    parts: Vec<Range<usize>>,
}

/// A station on a thread of its own, which ends when this is dropped.
struct Worker {
    jobs: SyncSender<Work>,
    answers: Receiver<Result<Answer, Error>>,
}

enum Work {
    Check(usize),
    Do(Job),
}

/// Parts of about equal size for so many threads, in order; none is empty.
pub(crate) fn parts(worlds: usize, threads: usize) -> Vec<Range<usize>> {
    let threads = threads.clamp(1, worlds.max(1));
    (0..threads).map(|index| worlds * index / threads..worlds * (index + 1) / threads).collect()
}

impl Crew {
    /// - **Domain:** one station for each part, at least one.
    ///
    /// # Errors
    /// When the operating system starts no thread.
    pub(crate) fn new(stations: Vec<Station>, parts: Vec<Range<usize>>) -> io::Result<Self> {
        let mut stations = stations.into_iter();
        let own = stations.next().ok_or_else(|| io::Error::other("a crew without stations"))?;
        let others = stations.map(Worker::start).collect::<io::Result<_>>()?;
        Ok(Self { own, others, parts })
    }

    /// Steps all worlds. Nothing is stepped unless everything can be.
    ///
    /// # Errors
    /// What was refused.
    pub(crate) fn step(&mut self, slot: usize) -> Result<(), Error> {
        if !self.others.is_empty() {
            self.check(slot)?;
        }
        self.each(|_| Some(Job::Step { slot }))
    }

    fn check(&mut self, slot: usize) -> Result<(), Error> {
        for worker in &self.others {
            worker.send(Work::Check(slot))?;
        }
        let own = self.own.check(slot);
        // Every answer is taken, whatever the others said.
        let answers: Vec<_> = self.others.iter().map(Worker::answer).collect();
        let others = answers.into_iter().try_for_each(|answer| answer.map(|_| ()));
        own.and(others)
    }

    /// Gives each station the job made for its worlds, all at the same time.
    ///
    /// # Errors
    /// The first that was refused.
    pub(crate) fn each(
        &mut self,
        mut job: impl FnMut(&Range<usize>) -> Option<Job>,
    ) -> Result<(), Error> {
        let mut jobs = self.parts.iter().map(&mut job);
        let own = jobs.next().flatten();
        let asked: Vec<bool> = self
            .others
            .iter()
            .zip(jobs)
            .map(|(worker, job)| job.map(|job| worker.send(Work::Do(job))).transpose())
            .map(|sent| sent.map(|sent| sent.is_some()))
            .collect::<Result<_, _>>()?;
        let mut result = own.map_or(Ok(()), |job| self.own.work(job).map(|_| ()));
        for (worker, asked) in self.others.iter().zip(asked) {
            if asked {
                result = result.and(worker.answer().map(|_| ()));
            }
        }
        result
    }

    /// Gives a job to the station of one world; the job gets the world's number there.
    ///
    /// # Errors
    /// What was refused, or that there is no such world.
    pub(crate) fn at(
        &mut self,
        world: usize,
        job: impl FnOnce(usize) -> Job,
    ) -> Result<Answer, Error> {
        let found = self.parts.iter().position(|part| part.contains(&world));
        let station = found.ok_or_else(|| {
            let count = self.parts.last().map_or(0, |part| part.end);
            Error::new(ErrorCode::InvalidArgument, "there is no such world")
                .wanted(format!("below {count}"))
                .found(world)
        })?;
        let job = job(world - self.parts[station].start);
        match station.checked_sub(1).and_then(|index| self.others.get(index)) {
            None => self.own.work(job),
            Some(worker) => {
                worker.send(Work::Do(job))?;
                worker.answer()
            }
        }
    }
}

impl Worker {
    fn start(mut station: Station) -> io::Result<Self> {
        let (jobs, todo) = sync_channel(1);
        let (done, answers) = sync_channel(1);
        thread::Builder::new().name("worlds".to_owned()).spawn(move || {
            for work in todo {
                let result = catch_unwind(AssertUnwindSafe(|| match work {
                    Work::Check(slot) => station.check(slot).map(|()| Answer::Done),
                    Work::Do(job) => station.work(job),
                }));
                // After a panic the worlds are in no state to go on.
                let Ok(answer) = result else { return };
                if done.send(answer).is_err() {
                    return;
                }
            }
        })?;
        Ok(Self { jobs, answers })
    }

    fn send(&self, work: Work) -> Result<(), Error> {
        self.jobs.send(work).map_err(|_| broken())
    }

    fn answer(&self) -> Result<Answer, Error> {
        self.answers.recv().map_err(|_| broken())?
    }
}

fn broken() -> Error {
    Error::new(ErrorCode::Internal, "a thread of this batch ended; its log says why")
        .wanted("a new batch")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn worlds_are_dealt_out_evenly_and_in_order() {
        assert_eq!(parts(5, 2), [0..2, 2..5]);
        assert_eq!(parts(2, 8), [0..1, 1..2]);
        assert_eq!(parts(7, 0), std::slice::from_ref(&(0..7)));
    }
}
