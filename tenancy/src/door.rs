//! Who comes in.

use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock};
use std::time::{Duration, Instant, SystemTime};

use jiff::Timestamp;
use schemas::Tenant;

use crate::failures::{Failures, WINDOW};
use crate::people::{Invalid, People, Quotas, Visitor};

/// How often a file of tenants should be looked at.
pub const FOLLOW_EVERY: Duration = Duration::from_secs(2);
/// Bytes of the largest file of tenants.
const FILE_BYTES_MAX: u64 = 16 << 20;

/// Why somebody does not come in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// No token was presented.
    #[error("this server wants a token: send 'Authorization: Bearer cw_...'")]
    NoToken,
    /// Unknown, wrong or expired; which of them is nobody's business.
    #[error("this token is not valid here, or no longer")]
    WrongToken,
    /// Too many wrong tokens came from the same address.
    #[error("too many wrong tokens from this address; come again in {} s", WINDOW.as_secs())]
    TooMany,
}

/// Why a file of tenants cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("{path:?}: {cause}")]
pub struct DoorError {
    path: PathBuf,
    cause: Cause,
}

#[derive(Debug, thiserror::Error)]
enum Cause {
    #[error("{0}")]
    Read(#[from] std::io::Error),
    #[error("wanted at most {FILE_BYTES_MAX} bytes, found {0}")]
    Large(u64),
    #[error("{0}")]
    Invalid(#[from] Invalid),
}

/// Decides who comes in.
pub struct Door(Rule);

enum Rule {
    /// Everybody, as one tenant with all there is.
    Open(Tenant),
    /// Who has a token.
    Tokens(Followed),
}

struct Followed {
    path: PathBuf,
    people: RwLock<Arc<People>>,
    /// `None`: it was away.
    seen: Mutex<Option<Stamp>>,
    failures: Mutex<Failures>,
}

/// What changes with a file: a new one that replaces it may be as old as it.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Stamp {
    modified: Option<SystemTime>,
    bytes: u64,
}

impl Door {
    /// Lets everybody in as one tenant.
    pub fn open(tenant: Tenant) -> Self {
        Self(Rule::Open(tenant))
    }

    /// Asks for tokens of a file.
    ///
    /// # Errors
    /// [`DoorError`]: it cannot be read, or is none.
    pub fn with_tokens(path: &Path) -> Result<Self, DoorError> {
        let (people, stamp) = read(path)?;
        let (tenants, tokens) = people.counts();
        tracing::info!(?path, tenants, tokens, "who may come in");
        Ok(Self(Rule::Tokens(Followed {
            path: path.to_owned(),
            people: RwLock::new(Arc::new(people)),
            seen: Mutex::new(Some(stamp)),
            failures: Mutex::new(Failures::new()),
        })))
    }

    /// Whether nobody is asked for a token.
    pub fn is_open(&self) -> bool {
        matches!(self.0, Rule::Open(_))
    }

    /// Who presents this from there.
    ///
    /// # Errors
    /// [`Refusal`].
    pub fn admit(&self, presented: Option<&str>, address: IpAddr) -> Result<Visitor, Refusal> {
        let followed = match &self.0 {
            Rule::Open(tenant) => {
                let quotas = Quotas::default();
                return Ok(Visitor { tenant: tenant.clone(), token: None, quotas });
            }
            Rule::Tokens(followed) => followed,
        };
        let presented = presented.ok_or(Refusal::NoToken)?;
        // A right token comes in whatever others do that share its address, as behind a proxy.
        followed.people().who(presented, Timestamp::now()).ok_or_else(|| {
            let (now, mut failures) = (Instant::now(), followed.failures());
            if failures.is_shut_out(address, now) {
                return Refusal::TooMany;
            }
            failures.note(address, now);
            Refusal::WrongToken
        })
    }

    /// How much a tenant may use, where nobody presents a token; everything at an open door.
    pub fn quotas_of(&self, tenant: &Tenant) -> Quotas {
        match &self.0 {
            Rule::Open(_) => Quotas::default(),
            Rule::Tokens(followed) => followed.people().quotas_of(tenant),
        }
    }

    /// Reads the file again if it has changed. One that cannot be used changes nothing.
    pub fn follow(&self) {
        let Rule::Tokens(followed) = &self.0 else { return };
        let path = &followed.path;
        let now = stamp(path).ok();
        if now == *followed.seen() {
            return;
        }
        match read(path) {
            Ok((people, stamp)) => {
                let (tenants, tokens) = people.counts();
                tracing::info!(target: "audit", ?path, tenants, tokens, "read tenants again");
                *followed.seen() = Some(stamp);
                let mut now = followed.people.write().unwrap_or_else(PoisonError::into_inner);
                *now = Arc::new(people);
            }
            Err(error) => {
                tracing::error!(target: "audit", %error, "tenants stay as they were: mend their file");
                // One that may not be read may be readable later, without another change.
                if now.is_none() || matches!(error.cause, Cause::Invalid(_) | Cause::Large(_)) {
                    *followed.seen() = now;
                }
            }
        }
    }
}

impl Followed {
    fn people(&self) -> Arc<People> {
        // Nothing panics while it holds one of these locks.
        Arc::clone(&self.people.read().unwrap_or_else(PoisonError::into_inner))
    }

    fn seen(&self) -> MutexGuard<'_, Option<Stamp>> {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn failures(&self) -> MutexGuard<'_, Failures> {
        self.failures.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn stamp(path: &Path) -> Result<Stamp, std::io::Error> {
    let metadata = std::fs::metadata(path)?;
    Ok(Stamp { modified: metadata.modified().ok(), bytes: metadata.len() })
}

fn read(path: &Path) -> Result<(People, Stamp), DoorError> {
    let wrong = |cause| DoorError { path: path.to_owned(), cause };
    let stamp = stamp(path).map_err(|cause| wrong(cause.into()))?;
    if stamp.bytes > FILE_BYTES_MAX {
        return Err(wrong(Cause::Large(stamp.bytes)));
    }
    let text = std::fs::read_to_string(path).map_err(|cause| wrong(cause.into()))?;
    let people = People::parse(&text).map_err(|cause| wrong(cause.into()))?;
    Ok((people, stamp))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Secret;
    use crate::failures::FAILURES_MAX;

    const ADDRESS: IpAddr = IpAddr::V4(std::net::Ipv4Addr::LOCALHOST);

    fn file_of(secrets: &[(&str, &Secret)]) -> String {
        let mut text = String::new();
        for (name, secret) in secrets {
            let sha256 = secret.sha256();
            text += &format!(
                "[tenant.{name}]\n[[token]]\nid = \"{name}\"\ntenant = \"{name}\"\nsha256 = \"{sha256}\"\n"
            );
        }
        text
    }

    fn secret(id: &str) -> Secret {
        Secret::new(id.parse().unwrap()).unwrap()
    }

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("causeway-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        folder
    }

    #[test]
    fn an_open_door_knows_one_tenant() {
        let door = Door::open("local".parse().unwrap());
        for presented in [None, Some("whatever")] {
            let visitor = door.admit(presented, ADDRESS).unwrap();
            assert_eq!((visitor.tenant.as_str(), visitor.token), ("local", None));
            assert_eq!(visitor.quotas, Quotas::default());
        }
    }

    #[test]
    fn a_changed_file_counts_and_a_broken_one_does_not() {
        let folder = folder("door");
        let path = folder.join("tokens.toml");
        let (alice, bob) = (secret("alice"), secret("bob"));
        std::fs::write(&path, file_of(&[("alice", &alice)])).unwrap();
        let door = Door::with_tokens(&path).unwrap();
        let admits = |secret: &Secret| door.admit(Some(&secret.token()), ADDRESS).is_ok();
        assert_eq!((admits(&alice), admits(&bob)), (true, false));

        std::fs::write(&path, file_of(&[("alice", &alice), ("bob", &bob)])).unwrap();
        door.follow();
        assert_eq!((admits(&alice), admits(&bob)), (true, true));

        std::fs::write(&path, "[[").unwrap();
        door.follow();
        assert_eq!((admits(&alice), admits(&bob)), (true, true));

        std::fs::write(&path, file_of(&[("bob", &bob)])).unwrap();
        door.follow();
        assert_eq!((admits(&alice), admits(&bob)), (false, true));
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn who_guesses_has_to_wait_and_others_at_the_same_address_come_in() {
        let folder = folder("guesses");
        let path = folder.join("tokens.toml");
        let alice = secret("alice");
        std::fs::write(&path, file_of(&[("alice", &alice)])).unwrap();
        let door = Door::with_tokens(&path).unwrap();
        assert_eq!(door.admit(None, ADDRESS), Err(Refusal::NoToken));
        let guesses = (0..10 * FAILURES_MAX).map(|_| door.admit(Some("cw_alice_x"), ADDRESS));
        assert!(guesses.into_iter().any(|guess| guess == Err(Refusal::TooMany)));
        assert!(door.admit(Some(&alice.token()), ADDRESS).is_ok());
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_file_that_cannot_be_used_is_named() {
        let error = Door::with_tokens(Path::new("/nowhere/tokens.toml")).err().unwrap();
        assert!(error.to_string().contains("/nowhere/tokens.toml"), "{error}");
    }
}
