//! Maps that clients brought along: a world service that comes later does not have them.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Maps that are kept, and bytes of them; the newest is always kept.
const MAPS_MAX: usize = 16;
const BYTES_MAX: usize = 64 * 1024 * 1024;

/// Texts by name, oldest first.
#[derive(Debug, Default)]
pub(crate) struct Uploads {
    texts: Mutex<Vec<(String, Arc<str>)>>,
}

impl Uploads {
    /// Keeps the text of a map, in the place of an earlier one of that name.
    pub(crate) fn keep(&self, name: String, text: Arc<str>) {
        let mut texts = self.lock();
        texts.retain(|(known, _)| *known != name);
        texts.push((name, text));
        let bytes = |texts: &[(String, Arc<str>)]| -> usize {
            texts.iter().map(|(_, text)| text.len()).sum()
        };
        while texts.len() > MAPS_MAX || (texts.len() > 1 && bytes(&texts) > BYTES_MAX) {
            texts.remove(0);
        }
    }

    /// All that are kept.
    pub(crate) fn all(&self) -> Vec<(String, Arc<str>)> {
        self.lock().clone()
    }

    fn lock(&self) -> MutexGuard<'_, Vec<(String, Arc<str>)>> {
        // Nothing panics while it holds the lock.
        self.texts.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_are_kept_and_not_too_many_bytes() {
        let uploads = Uploads::default();
        let names = || uploads.all().into_iter().map(|(name, _)| name).collect::<Vec<_>>();
        for number in 0..MAPS_MAX + 2 {
            uploads.keep(number.to_string(), "text".into());
        }
        assert_eq!((names().len(), names()[0].as_str()), (MAPS_MAX, "2"));
        uploads.keep("2".to_owned(), "new".into());
        assert_eq!(names().last().unwrap(), "2");
        uploads.keep("large".to_owned(), "x".repeat(BYTES_MAX + 1).into());
        assert_eq!(names(), ["large"]);
    }
}
