//! How many files and sockets this process may have open.

use rustix::process::{Resource, getrlimit, setrlimit};

/// Raises the soft limit to the hard one: a shell's usual 1,024 is less than the clients that one
/// service may have. Children get the raised limit too. Where it cannot be raised, that is logged.
pub(crate) fn allow_all() {
    let mut limit = getrlimit(Resource::Nofile);
    let given = limit.current;
    if given == limit.maximum {
        return;
    }
    limit.current = limit.maximum;
    match setrlimit(Resource::Nofile, limit) {
        Ok(()) => tracing::debug!(?given, now = ?limit.current, "more files may be open"),
        Err(error) => {
            tracing::warn!(?given, %error, "no more files may be open; raise it with ulimit -n");
        }
    }
}
