//! A process started by `up` ends when `up` does, even when `up` was killed and could not say so.
//!
//! `up` holds the other end of the standard input of each of its processes and never writes. The
//! operating system closes it with `up`, however `up` ends.

use std::io::{self, Read};
use std::thread;
use std::time::Duration;

use rustix::process::{Signal, getpid, kill_process};

/// How long the service may take to end in good order.
const GRACE: Duration = Duration::from_secs(2);

/// Asks this process to stop as soon as standard input ends, and ends it when it does not.
///
/// # Errors
/// When no thread can be started.
pub(crate) fn end_with_stdin() -> io::Result<()> {
    thread::Builder::new().name("lifeline".to_owned()).spawn(|| {
        wait_for_end(io::stdin().lock());
        // The same way as for a person or a supervisor: the service has one way to stop.
        let _ = kill_process(getpid(), Signal::TERM);
        thread::sleep(GRACE);
        std::process::exit(1);
    })?;
    Ok(())
}

fn wait_for_end(mut input: impl Read) {
    let mut ignored = [0; 64];
    loop {
        match input.read(&mut ignored) {
            Ok(1..) => {}
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Ok(0) | Err(_) => return,
        }
    }
}
