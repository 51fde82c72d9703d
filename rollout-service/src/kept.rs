//! What a client keeps by number, bounded in count and in bytes.

use std::collections::BTreeMap;

use schemas::{Error, ErrorCode};

/// Things with numbers that never come twice.
pub(crate) struct Kept<T> {
    things: BTreeMap<u64, (T, usize)>,
    bytes: usize,
    next: u64,
    count_max: usize,
    bytes_max: usize,
}

impl<T> Kept<T> {
    pub(crate) fn new(count_max: usize, bytes_max: usize) -> Self {
        Self { things: BTreeMap::new(), bytes: 0, next: 1, count_max, bytes_max }
    }

    /// # Errors
    /// There is no room for so many more of so many bytes in all.
    pub(crate) fn check_room(&self, count: usize, bytes: usize) -> Result<(), Error> {
        let full = |wanted: String, found: usize| {
            Error::new(ErrorCode::Capacity, "too many snapshots are kept")
                .wanted(format!("at most {wanted}: forget some"))
                .found(found)
        };
        let (count, bytes) = (self.things.len().saturating_add(count), self.bytes + bytes);
        if count > self.count_max {
            return Err(full(self.count_max.to_string(), count));
        }
        if bytes > self.bytes_max {
            return Err(full(format!("{} bytes", self.bytes_max), bytes));
        }
        Ok(())
    }

    /// Keeps a thing of so many bytes, for which there is room.
    pub(crate) fn keep(&mut self, thing: T, bytes: usize) -> u64 {
        let name = self.next;
        self.next += 1;
        self.bytes += bytes;
        self.things.insert(name, (thing, bytes));
        name
    }

    pub(crate) fn get(&self, name: u64) -> Option<&T> {
        self.things.get(&name).map(|(thing, _)| thing)
    }

    /// Gives one up, if there is one.
    pub(crate) fn forget(&mut self, name: u64) {
        if let Some((_, bytes)) = self.things.remove(&name) {
            self.bytes -= bytes;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn count_and_bytes_have_a_bound_and_room_comes_back() {
        let mut kept = Kept::new(3, 100);
        let first = kept.keep("first", 60);
        let second = kept.keep("second", 40);
        let refused = kept.check_room(1, 1).unwrap_err().to_string();
        assert!(refused.contains("100 bytes") && refused.contains("101"), "{refused}");
        assert!(kept.check_room(2, 0).unwrap_err().to_string().contains("at most 3"));
        kept.check_room(1, 0).unwrap();
        kept.forget(first);
        kept.forget(first);
        kept.check_room(2, 60).unwrap();
        assert!(kept.check_room(1, 61).is_err());
        assert_eq!((kept.get(first), kept.get(second)), (None, Some(&"second")));
        assert_eq!(kept.keep("third", 1), 3);
    }
}
