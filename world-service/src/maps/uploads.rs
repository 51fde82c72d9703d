//! Maps that clients brought along: by tenant and name, each bounded in number.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use roads::Severity;
use schemas::{Error, ErrorCode, MapRef, Tenant};

use super::{Entry, Text};

/// Maps of one tenant.
const PER_TENANT_MAX: usize = 16;
/// Maps of all tenants.
const UPLOADS_MAX: usize = 256;
/// Characters of a name.
const NAME_CHARS_MAX: usize = 64;

type Table<T> = BTreeMap<(Tenant, String), Arc<Entry<T>>>;

/// Maps by tenant and name.
pub(super) struct Uploads<T>(Mutex<Table<T>>);

impl<T> Uploads<T> {
    /// None yet.
    pub(super) fn new() -> Self {
        Self(Mutex::new(BTreeMap::new()))
    }

    /// Keeps a map under a name; the one it had before goes when its last world does.
    ///
    /// # Errors
    /// `InvalidArgument` for a name that is none or a text that cannot be used or would end CARLA's
    /// client; `Capacity`.
    pub(super) fn put(&self, tenant: &Tenant, name: &str, xodr: String) -> Result<(), Error> {
        check_name(name)?;
        check_text(name, &xodr)?;
        let mut table = self.lock();
        let key = (tenant.clone(), name.to_owned());
        let is_new = !table.contains_key(&key);
        let of_tenant = table.keys().filter(|(owner, _)| owner == tenant).count();
        if is_new && (of_tenant >= PER_TENANT_MAX || table.len() >= UPLOADS_MAX) {
            return Err(Error::new(ErrorCode::Capacity, "too many maps were made known")
                .wanted(format_args!("at most {PER_TENANT_MAX}, or a name that is replaced"))
                .found(format_args!("{name:?}")));
        }
        table.insert(key, Arc::new(Entry::given(Text::new(xodr))));
        Ok(())
    }

    /// The map of a tenant with this name.
    pub(super) fn get(&self, tenant: &Tenant, name: &str) -> Option<Arc<Entry<T>>> {
        self.lock().get(&(tenant.clone(), name.to_owned())).cloned()
    }

    /// The maps of a tenant, ordered by name.
    pub(super) fn list(&self, tenant: &Tenant) -> Vec<MapRef> {
        let table = self.lock();
        let own = table.iter().filter(|((owner, _), _)| owner == tenant);
        own.filter_map(|((_, name), entry)| {
            let digest = entry.text(name).ok()?.digest.clone();
            Some(MapRef { name: name.clone(), digest })
        })
        .collect()
    }

    /// A map of any tenant with this text.
    pub(super) fn with_digest(&self, digest: &str) -> Option<Arc<Entry<T>>> {
        let table = self.lock();
        let mut entries = table.iter().map(|((_, name), entry)| (name, entry));
        let has_it = |(name, entry): &(&String, &Arc<Entry<T>>)| matches!(entry.text(name), Ok(text) if text.digest == digest);
        entries.find(has_it).map(|(_, entry)| Arc::clone(entry))
    }

    fn lock(&self) -> MutexGuard<'_, Table<T>> {
        // Nothing panics while it holds the lock.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn check_name(name: &str) -> Result<(), Error> {
    let fits = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
    if (1..=NAME_CHARS_MAX).contains(&name.len()) && name.chars().all(fits) {
        return Ok(());
    }
    Err(Error::new(ErrorCode::InvalidArgument, "this is no name of a map")
        .wanted(format_args!("1 to {NAME_CHARS_MAX} letters, digits, '_' and '-'"))
        .found(format_args!("{name:?}")))
}

fn check_text(name: &str, xodr: &str) -> Result<(), Error> {
    let refused = |why: String| {
        Error::new(ErrorCode::InvalidArgument, format!("the map {name:?} cannot be used"))
            .found(why)
    };
    let map = roads::Map::parse(name, xodr).map_err(|cause| refused(cause.to_string()))?;
    let report = map.check();
    let fatal = report.diagnostics.iter().find(|fault| fault.severity >= Severity::BreaksClient);
    match fatal {
        Some(fault) => Err(refused(format!("CARLA's client would not survive {fault}"))),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn town() -> String {
        roads::town::build("Town10HD").unwrap()
    }

    #[test]
    fn what_one_tenant_brought_no_other_sees() {
        let uploads = Uploads::<()>::new();
        let (ours, theirs): (Tenant, Tenant) = ("ours".parse().unwrap(), "theirs".parse().unwrap());
        uploads.put(&ours, "Mine", town()).unwrap();
        assert_eq!(uploads.list(&ours).len(), 1);
        assert!(uploads.get(&theirs, "Mine").is_none());
        let digest = uploads.list(&ours)[0].digest.clone();
        assert!(uploads.with_digest(&digest).is_some());
    }

    #[test]
    fn a_broken_text_and_a_name_with_a_path_are_refused() {
        let uploads = Uploads::<()>::new();
        let tenant: Tenant = "ours".parse().unwrap();
        assert!(uploads.put(&tenant, "Broken", "<OpenDRIVE><road".to_owned()).is_err());
        assert!(uploads.put(&tenant, "../Town", town()).is_err());
        assert!(uploads.list(&tenant).is_empty());
    }
}
