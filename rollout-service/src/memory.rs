//! The block itself: memory that a client maps, too.
#![allow(
    unsafe_code,
    reason = "mapping memory, and slices of memory that another process maps, cannot be had without"
)]

use std::io;
use std::ops::Range;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::ptr::NonNull;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

use rollouts::Rows;
use rustix::fs::{MemfdFlags, SealFlags};
use rustix::mm::{MapFlags, ProtFlags};

use crate::block::{self, Layout};

/// A block that is mapped into this process, zero at first.
#[derive(Debug)]
struct Mapping {
    base: NonNull<u8>,
    layout: Layout,
}

// SAFETY: the memory belongs to the mapping for as long as it lives; who may touch which part of it
// is settled by `Memory` and `Window`.
unsafe impl Send for Mapping {}
// SAFETY: as above; a shared mapping itself only hands out atomics.
unsafe impl Sync for Mapping {}

impl Drop for Mapping {
    fn drop(&mut self) {
        // SAFETY: base and length are those that `mmap` gave, and nothing borrows from it any more:
        // windows keep the mapping alive.
        let unmapped = unsafe { rustix::mm::munmap(self.base.as_ptr().cast(), self.layout.bytes) };
        if let Err(error) = unmapped {
            tracing::warn!(%error, "a block stays mapped");
        }
    }
}

impl Mapping {
    /// A number in the header, which both sides may touch at any time.
    fn number(&self, at: usize) -> &AtomicU32 {
        debug_assert!(at.is_multiple_of(4) && at + 4 <= block::PAGE, "within the header");
        // SAFETY: within the mapping, aligned, and only ever touched as an atomic here.
        unsafe { AtomicU32::from_ptr(self.base.as_ptr().add(at).cast()) }
    }

    /// As [`number`](Self::number), of eight bytes.
    fn wide(&self, at: usize) -> &AtomicU64 {
        debug_assert!(at.is_multiple_of(8) && at + 8 <= block::PAGE, "within the header");
        // SAFETY: as for `number`.
        unsafe { AtomicU64::from_ptr(self.base.as_ptr().add(at).cast()) }
    }

    /// The numbers of an array that a client writes, as it may at any time.
    fn shared(&self, slot: usize, array: usize) -> &[AtomicU32] {
        let (offset, array) = self.layout.at(slot, array);
        debug_assert_eq!(array.bytes(), array.count() * 4, "numbers of four bytes");
        // SAFETY: within the mapping, as the layout was made for it; aligned to 64 bytes; atomics
        // may change under a shared reference, also by another process.
        unsafe {
            let first = self.base.as_ptr().add(offset).cast::<AtomicU32>();
            std::slice::from_raw_parts(first, array.count())
        }
    }

    /// Part of an array that only this service writes.
    ///
    /// # Safety
    /// Nobody else in this process may have the same part while the slice lives.
    #[allow(clippy::mut_from_ref, reason = "the caller answers for it, see above")]
    unsafe fn own<T: bytemuck::Pod>(
        &self,
        slot: usize,
        array: usize,
        worlds: (&Range<usize>, usize),
    ) -> &mut [T] {
        let (offset, array) = self.layout.at(slot, array);
        let (range, all) = worlds;
        let each = array.count() / all;
        debug_assert_eq!(array.bytes(), array.count() * size_of::<T>(), "{}", array.name);
        assert!(range.start <= range.end && range.end <= all, "worlds of this block");
        // SAFETY: within the mapping, as the layout was made for it; aligned to 64 bytes; every bit
        // pattern is a number. What a client does to arrays that it should only read may change
        // what it reads there, and nothing else: nothing is decided by what these slices hold.
        unsafe {
            let first = self.base.as_ptr().add(offset).cast::<T>().add(range.start * each);
            std::slice::from_raw_parts_mut(first, range.len() * each)
        }
    }
}

/// A block with the descriptor that a client maps it by.
#[derive(Debug)]
pub(crate) struct Memory {
    mapping: Arc<Mapping>,
    descriptor: OwnedFd,
}

impl Memory {
    /// A block of zeros whose size is sealed, so that no client can make it shorter under us.
    ///
    /// # Errors
    /// When the operating system gives no memory.
    pub(crate) fn new(layout: Layout) -> io::Result<Self> {
        let flags = MemfdFlags::CLOEXEC | MemfdFlags::ALLOW_SEALING;
        let descriptor = rustix::fs::memfd_create("causeway-rollout", flags)?;
        rustix::fs::ftruncate(&descriptor, layout.bytes as u64)?;
        let seals = SealFlags::SHRINK | SealFlags::GROW | SealFlags::SEAL;
        rustix::fs::fcntl_add_seals(&descriptor, seals)?;
        let protection = ProtFlags::READ | ProtFlags::WRITE;
        // SAFETY: a new mapping at an address that the kernel chooses touches nothing that is.
        let base = unsafe {
            rustix::mm::mmap(
                std::ptr::null_mut(),
                layout.bytes,
                protection,
                MapFlags::SHARED,
                &descriptor,
                0,
            )?
        };
        let base = NonNull::new(base.cast::<u8>())
            .ok_or_else(|| io::Error::other("memory was mapped at address 0"))?;
        Ok(Self { mapping: Arc::new(Mapping { base, layout }), descriptor })
    }

    pub(crate) fn layout(&self) -> &Layout {
        &self.mapping.layout
    }

    pub(crate) fn descriptor(&self) -> BorrowedFd<'_> {
        self.descriptor.as_fd()
    }

    /// Windows onto parts of all worlds; consumes the right to make others.
    ///
    /// # Panics
    /// Where parts are not in order, or overlap.
    pub(crate) fn windows(&mut self, worlds: usize, parts: &[Range<usize>]) -> Vec<Window> {
        let ordered = parts.windows(2).all(|pair| pair[0].end <= pair[1].start);
        assert!(ordered, "parts follow each other");
        assert_eq!(Arc::strong_count(&self.mapping), 1, "windows are made once");
        let window = |part: &Range<usize>| Window {
            mapping: Arc::clone(&self.mapping),
            worlds: part.clone(),
            all: worlds,
        };
        parts.iter().map(window).collect()
    }

    /// The header.
    pub(crate) fn header(&self) -> Header {
        Header(Arc::clone(&self.mapping))
    }
}

/// The first page of a block, and the actions of all worlds: what both sides may touch at any time.
#[derive(Debug)]
pub(crate) struct Header(Arc<Mapping>);

impl Header {
    /// Writes one number of four bytes.
    pub(crate) fn set(&self, at: usize, value: u32) {
        self.0.number(at).store(value, Ordering::Release);
    }

    /// Writes one number of eight bytes.
    pub(crate) fn set_wide(&self, at: usize, value: u64) {
        self.0.wide(at).store(value, Ordering::Release);
    }

    /// Writes a text, cut to what fits, and its length.
    pub(crate) fn say(&self, text: &str) {
        let most = (block::PAGE - block::MESSAGE_AT) / 4 * 4;
        let cut = text.floor_char_boundary(most);
        let bytes = &text.as_bytes()[..cut];
        for (index, part) in bytes.chunks(4).enumerate() {
            let mut word = [0; 4];
            word[..part.len()].copy_from_slice(part);
            self.set(block::MESSAGE_AT + 4 * index, u32::from_ne_bytes(word));
        }
        self.set(block::MESSAGE_LENGTH_AT, bytes.len() as u32);
    }

    /// Copies some of the numbers of all worlds' actions.
    pub(crate) fn actions(&self, slot: usize, range: Range<usize>, into: &mut Vec<f32>) {
        into.clear();
        let numbers = self.0.shared(slot, block::ACTIONS)[range].iter();
        into.extend(numbers.map(|number| f32::from_bits(number.load(Ordering::Relaxed))));
    }
}

/// The arrays of some worlds, of which no other window has any.
#[derive(Debug)]
pub(crate) struct Window {
    mapping: Arc<Mapping>,
    worlds: Range<usize>,
    all: usize,
}

impl Window {
    /// The arrays of a slot that the service writes.
    pub(crate) fn rows(&mut self, slot: usize) -> Rows<'_> {
        let (mapping, worlds) = (&*self.mapping, (&self.worlds, self.all));
        assert!(slot < mapping.layout.slots, "a slot of this block");
        // SAFETY: each array is taken once; windows do not overlap; the rows borrow this window
        // mutably, so that it gives no others meanwhile.
        unsafe {
            Rows {
                observations: mapping.own(slot, block::OBSERVATIONS, worlds),
                finals: mapping.own(slot, block::FINALS, worlds),
                rewards: mapping.own(slot, block::REWARDS, worlds),
                terminations: mapping.own(slot, block::TERMINATIONS, worlds),
                truncations: mapping.own(slot, block::TRUNCATIONS, worlds),
                alive: mapping.own(slot, block::ALIVE, worlds),
                episodes: mapping.own(slot, block::EPISODES, worlds),
                seeds: mapping.own(slot, block::SEEDS, worlds),
                ticks: mapping.own(slot, block::TICKS, worlds),
                hashes: mapping.own(slot, block::HASHES, worlds),
            }
        }
    }

    /// Copies the observations of one slot, and what goes with them, to another.
    pub(crate) fn carry(&mut self, from: usize, to: usize) {
        if from == to {
            return;
        }
        let (mapping, worlds) = (&*self.mapping, (&self.worlds, self.all));
        assert!(from.max(to) < mapping.layout.slots, "slots of this block");
        // SAFETY: as for `rows`; the slots are different, so that no slice overlaps another.
        unsafe {
            copy::<f32>(mapping, block::OBSERVATIONS, (from, to), worlds);
            for array in [block::SEEDS, block::TICKS, block::HASHES] {
                copy::<u64>(mapping, array, (from, to), worlds);
            }
            copy::<u8>(mapping, block::ALIVE, (from, to), worlds);
            mapping.own::<f32>(to, block::REWARDS, worlds).fill(0.0);
            mapping.own::<u8>(to, block::TERMINATIONS, worlds).fill(0);
            mapping.own::<u8>(to, block::TRUNCATIONS, worlds).fill(0);
        }
    }
}

/// # Safety
/// As for [`Mapping::own`], in both slots, which must differ.
unsafe fn copy<T: bytemuck::Pod>(
    mapping: &Mapping,
    array: usize,
    (from, to): (usize, usize),
    worlds: (&Range<usize>, usize),
) {
    // SAFETY: the caller's.
    unsafe {
        let source: &[T] = mapping.own(from, array, worlds);
        mapping.own::<T>(to, array, worlds).copy_from_slice(source);
    }
}

#[cfg(test)]
mod tests {
    use rollouts::Spec;

    use super::*;

    fn memory(worlds: usize) -> Memory {
        let spec = Spec { worlds, agents: 2, ..Spec::default() };
        Memory::new(Layout::new(&spec, 2).unwrap()).unwrap()
    }

    #[test]
    fn windows_write_next_to_each_other_and_carry_what_was_there() {
        let mut memory = memory(3);
        let mut windows = memory.windows(3, &[0..1, 1..3]);
        let width = Spec::default().width();
        windows[0].rows(0).observations.fill(1.0);
        windows[1].rows(0).observations.fill(2.0);
        windows[1].rows(0).rewards.fill(5.0);
        windows[1].carry(0, 1);
        assert_eq!(windows[0].rows(0).observations, vec![1.0; 2 * width]);
        assert_eq!(windows[1].rows(1).observations, vec![2.0; 4 * width]);
        assert_eq!(windows[1].rows(1).rewards, [0.0; 4]);
        assert_eq!(windows[0].rows(1).observations, vec![0.0; 2 * width]);
    }

    #[test]
    fn a_text_too_long_for_the_header_is_cut() {
        let memory = memory(1);
        let header = memory.header();
        header.say(&"ä".repeat(4_000));
        header.set(block::STATUS_AT, 7);
        assert_eq!(memory.mapping.number(block::STATUS_AT).load(Ordering::Acquire), 7);
        let length = memory.mapping.number(block::MESSAGE_LENGTH_AT).load(Ordering::Acquire);
        assert!(length as usize <= block::PAGE - block::MESSAGE_AT);
    }

    #[test]
    fn nobody_can_change_the_size_of_a_block() {
        let memory = memory(1);
        assert!(rustix::fs::ftruncate(memory.descriptor(), 0).is_err());
    }
}
