//! One client and its batch.

use std::io;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::thread::available_parallelism;

use rollouts::{Action, Course, Reset, Shard, Spec};
use rustix::event::EventfdFlags;
use schemas::{ActorId, Error, ErrorCode};

use crate::block::{self, Layout};
use crate::crew::{self, Crew};
use crate::folders::Folders;
use crate::kept::Kept;
use crate::limits::{
    BLOCK_BYTES_MAX, FRAMES_MAX, SLOTS_MAX, SNAPSHOT_BYTES_MAX, SNAPSHOTS_MAX, THREADS_MAX,
    WORLDS_PER_THREAD,
};
use crate::memory::{Header, Memory};
use crate::message::{self, Opened, Reply, Request};
use crate::station::{Answer, Job, SharedSnapshot, Station};
use crate::waiting::{Waiting, Woken};

/// Serves one client until it goes.
///
/// # Errors
/// When the socket or the operating system fails.
pub(crate) fn serve(socket: &UnixStream, folders: &Folders) -> io::Result<()> {
    loop {
        let Some(text) = message::receive(socket)? else { return Ok(()) };
        let opened = match message::read(&text) {
            Ok(Request::Open { spec, slots, threads }) => open(&spec, slots, threads, folders)?,
            Ok(_) => Err(Error::new(ErrorCode::InvalidArgument, "no batch is open")
                .wanted("open, before anything else")),
            Err(error) => Err(error),
        };
        match opened {
            Ok((mut batch, opened)) => {
                let descriptors =
                    [batch.memory.descriptor(), batch.go.as_fd(), batch.ready.as_fd()];
                message::send(socket, &Reply::Opened(Box::new(opened)), &descriptors)?;
                return batch.serve(socket);
            }
            Err(error) => message::send(socket, &error.into(), &[])?,
        }
    }
}

/// Worlds, the block that they write, and what the client keeps of them.
struct Batch {
    memory: Memory,
    header: Header,
    go: OwnedFd,
    ready: OwnedFd,
    crew: Crew,
    worlds: usize,
    /// The slot that was written last.
    slot: usize,
    sequence: u64,
    snapshots: Kept<SharedSnapshot>,
    waiting: Waiting,
}

/// # Errors
/// Outer: the operating system's. Inner: what of the request cannot be.
fn open(
    spec: &Spec,
    slots: usize,
    threads: Option<usize>,
    folders: &Folders,
) -> io::Result<Result<(Batch, Opened), Error>> {
    let prepared = prepare(spec, slots, threads, folders);
    let (layout, course, shards, parts) = match prepared {
        Ok(prepared) => prepared,
        Err(error) => return Ok(Err(error)),
    };
    let mut memory = Memory::new(layout)?;
    let windows = memory.windows(spec.worlds, &parts);
    let numbers = spec.agents * Action::WIDTH;
    let stations = shards.into_iter().zip(windows).zip(&parts).map(|((shard, window), part)| {
        let actions = (part.start * numbers, part.len() * numbers);
        Station::new(shard, window, memory.header(), actions)
    });
    let stations = stations.collect();
    let threads = parts.len();
    let event = || rustix::event::eventfd(0, EventfdFlags::CLOEXEC | EventfdFlags::NONBLOCK);
    let mut batch = Batch {
        header: memory.header(),
        go: event()?,
        ready: event()?,
        crew: Crew::new(stations, parts)?,
        memory,
        worlds: spec.worlds,
        slot: 0,
        sequence: 0,
        snapshots: Kept::new(SNAPSHOTS_MAX, SNAPSHOT_BYTES_MAX),
        waiting: Waiting::default(),
    };
    batch.sign();
    let slot = batch.slot;
    if let Err(error) = batch.crew.each(|_| Some(Job::Show { slot })) {
        return Ok(Err(error));
    }
    let opened = Opened {
        layout: batch.memory.layout().clone(),
        spec: spec.clone(),
        columns: spec.observation.columns(),
        blocks: spec.observation.blocks(),
        episode_columns: rollouts::EPISODE_COLUMNS.to_vec(),
        threads,
        step_secs: spec.step_secs(),
        ways_m: course.lengths_m().collect(),
        header: [block::STATUS_AT, block::MESSAGE_LENGTH_AT, block::MESSAGE_AT, block::SEQUENCE_AT],
    };
    Ok(Ok((batch, opened)))
}

type Prepared = (Layout, Arc<Course>, Vec<Shard>, Vec<std::ops::Range<usize>>);

/// # Errors
/// What of the request cannot be.
fn prepare(
    spec: &Spec,
    slots: usize,
    threads: Option<usize>,
    folders: &Folders,
) -> Result<Prepared, Error> {
    spec.check()?;
    let range = |what: &str, found: usize, least: usize, most: usize| {
        let error = Error::new(ErrorCode::InvalidArgument, format!("{what} are out of range"));
        let error = error.wanted(format!("{least} to {most}")).found(found);
        if (least..=most).contains(&found) { Ok(()) } else { Err(error) }
    };
    range("slots", slots, 2, SLOTS_MAX)?;
    let cores = available_parallelism().map_or(1, usize::from);
    let threads = threads.unwrap_or_else(|| spec.worlds.div_ceil(WORLDS_PER_THREAD).min(cores));
    range("threads", threads, 1, THREADS_MAX)?;
    let layout = Layout::new(spec, slots).filter(|layout| layout.bytes <= BLOCK_BYTES_MAX);
    let layout = layout.ok_or_else(|| {
        Error::new(ErrorCode::TooLarge, "the arrays are too large")
            .wanted(format!("at most {BLOCK_BYTES_MAX} bytes: fewer worlds, agents or slots"))
    })?;
    let task = folders.task(&spec.task)?;
    let course = Arc::new(Course::of_task(spec, task, folders.map(&spec.town)?)?);
    let parts = crew::parts(spec.worlds, threads);
    let shards = Shard::all(spec, &course, &parts)?;
    Ok((layout, course, shards, parts))
}

impl Batch {
    /// Steps and answers until the client goes.
    ///
    /// # Errors
    /// When the socket or the operating system fails.
    fn serve(&mut self, socket: &UnixStream) -> io::Result<()> {
        loop {
            let Woken { to_step, asked } = self.waiting.wait(&self.go, socket)?;
            if to_step {
                self.step()?;
            }
            if asked {
                let Some(text) = message::receive(socket)? else { return Ok(()) };
                let reply = match message::read(&text) {
                    Ok(request) => self.answer(request).unwrap_or_else(Reply::from),
                    Err(error) => error.into(),
                };
                message::send(socket, &reply, &[])?;
            }
        }
    }

    fn step(&mut self) -> io::Result<()> {
        let mut count = [0; 8];
        rustix::io::read(&self.go, &mut count)?;
        let slot = self.next_slot();
        match self.crew.step(slot) {
            Ok(()) => {
                self.slot = slot;
                self.sequence += 1;
                self.header.set(block::STATUS_AT, 0);
            }
            Err(error) => {
                self.header.say(&error.to_string());
                self.header.set(block::STATUS_AT, 1);
            }
        }
        self.header.set_wide(block::SEQUENCE_AT, self.sequence);
        rustix::io::write(&self.ready, &1_u64.to_ne_bytes())?;
        Ok(())
    }

    fn next_slot(&self) -> usize {
        (self.slot + 1) % self.memory.layout().slots
    }

    /// Writes the parts of the header that stay.
    fn sign(&self) {
        let layout = self.memory.layout();
        self.header.set(0, u32::from_le_bytes(block::MAGIC));
        self.header.set(4, block::VERSION);
        self.header.set(16, layout.slots as u32);
    }

    /// # Errors
    /// What was refused.
    fn answer(&mut self, request: Request) -> Result<Reply, Error> {
        match request {
            Request::Open { .. } => {
                Err(Error::new(ErrorCode::InvalidArgument, "the batch is open already")
                    .wanted("another connection for another batch"))
            }
            Request::Reset { seeds, mask } => self.reset(seeds, mask),
            Request::Snapshot { worlds } => self.snapshot(&worlds),
            Request::Frames { worlds } => self.frames(&worlds),
            Request::Restore { snapshots, worlds, reseed } => {
                self.restore(&snapshots, &worlds, reseed)
            }
            Request::Fork { world, into, reseed } => {
                let origin = Arc::new(self.take(world)?);
                let copies = into.into_iter().map(|world| (world, Arc::clone(&origin)));
                self.put(copies.collect(), reseed)
            }
            Request::Forget { snapshots } => {
                for name in snapshots {
                    self.snapshots.forget(name);
                }
                Ok(Reply::Done { slot: self.slot })
            }
        }
    }

    fn reset(
        &mut self,
        seeds: Option<Vec<Option<u64>>>,
        mask: Option<Vec<bool>>,
    ) -> Result<Reply, Error> {
        let seeds = seeds.unwrap_or_else(|| vec![None; self.worlds]);
        let mask = mask.unwrap_or_else(|| vec![true; self.worlds]);
        for (what, found) in [("seeds", seeds.len()), ("entries of the mask", mask.len())] {
            if found != self.worlds {
                return Err(Error::new(
                    ErrorCode::InvalidArgument,
                    format!("wrong number of {what}"),
                )
                .wanted(self.worlds)
                .found(found));
            }
        }
        let choices = mask.iter().zip(&seeds).map(|(chosen, seed)| match (chosen, seed) {
            (false, _) => Reset::Keep,
            (true, None) => Reset::Next,
            (true, Some(seed)) => Reset::Seed(*seed),
        });
        let choices: Vec<Reset> = choices.collect();
        let (from, slot) = (self.slot, self.next_slot());
        let resets = |part: &std::ops::Range<usize>| {
            Some(Job::Reset { from, slot, resets: choices[part.clone()].to_vec() })
        };
        self.crew.each(resets)?;
        self.slot = slot;
        Ok(Reply::Done { slot })
    }

    fn take(&mut self, world: usize) -> Result<rollouts::Snapshot, Error> {
        match self.crew.at(world, |world| Job::Snapshot { world })? {
            Answer::Snapshot(snapshot) => Ok(snapshot),
            _ => Err(Error::new(ErrorCode::Internal, "no snapshot was taken")),
        }
    }

    /// Worlds as frames, for whoever has them drawn.
    fn frames(&mut self, worlds: &[usize]) -> Result<Reply, Error> {
        if worlds.len() > FRAMES_MAX {
            return Err(Error::new(ErrorCode::TooLarge, "too many frames for one reply")
                .wanted(format!("at most {FRAMES_MAX}"))
                .found(worlds.len()));
        }
        let (mut frames, mut cars) = (Vec::new(), Vec::new());
        for world in worlds {
            let Answer::Frame(frame, own) = self.crew.at(*world, |world| Job::Frame { world })?
            else {
                return Err(Error::new(ErrorCode::Internal, "no frame was told"));
            };
            frames.push(frame);
            cars.push(own.into_iter().map(ActorId::get).collect());
        }
        Ok(Reply::Frames { bytes: frames.iter().map(Vec::len).collect(), cars, frames })
    }

    fn snapshot(&mut self, worlds: &[usize]) -> Result<Reply, Error> {
        self.snapshots.check_room(worlds.len(), 0)?;
        let (mut taken, mut bytes) = (Vec::with_capacity(worlds.len()), 0);
        for world in worlds {
            let snapshot = self.take(*world)?;
            bytes += snapshot.bytes();
            self.snapshots.check_room(worlds.len(), bytes)?;
            taken.push(snapshot);
        }
        let keep = |snapshot: rollouts::Snapshot| {
            let bytes = snapshot.bytes();
            self.snapshots.keep(Arc::new(snapshot), bytes)
        };
        Ok(Reply::Snapshots { snapshots: taken.into_iter().map(keep).collect() })
    }

    fn restore(&mut self, names: &[u64], worlds: &[usize], reseed: bool) -> Result<Reply, Error> {
        if names.len() != worlds.len() {
            return Err(Error::new(
                ErrorCode::InvalidArgument,
                "snapshots and worlds do not match",
            )
            .wanted(format!("{} worlds", names.len()))
            .found(worlds.len()));
        }
        let found = names.iter().zip(worlds).map(|(name, world)| {
            let snapshot = self.snapshots.get(*name).ok_or_else(|| {
                Error::new(ErrorCode::InvalidArgument, "there is no such snapshot")
                    .wanted("one that was taken and not forgotten")
                    .found(name)
            })?;
            Ok((*world, Arc::clone(snapshot)))
        });
        let found = found.collect::<Result<_, Error>>()?;
        self.put(found, reseed)
    }

    /// Lets worlds go on from snapshots; the number of a copy decides its stream.
    fn put(&mut self, copies: Vec<(usize, SharedSnapshot)>, reseed: bool) -> Result<Reply, Error> {
        if let Some((world, _)) = copies.iter().find(|(world, _)| *world >= self.worlds) {
            return Err(Error::new(ErrorCode::InvalidArgument, "there is no such world")
                .wanted(format!("below {}", self.worlds))
                .found(world));
        }
        let (from, slot) = (self.slot, self.next_slot());
        let restores = |part: &std::ops::Range<usize>| {
            let own = copies.iter().enumerate().filter(|(_, (world, _))| part.contains(world));
            let worlds = own.map(|(number, (world, snapshot))| {
                let stream = reseed.then_some(number as u64 + 1);
                (world - part.start, Arc::clone(snapshot), stream)
            });
            Some(Job::Restore { from, slot, worlds: worlds.collect() })
        };
        self.crew.each(restores)?;
        self.slot = slot;
        Ok(Reply::Done { slot })
    }
}
