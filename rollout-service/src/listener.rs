//! Where clients come in.

use std::io;
use std::os::fd::AsFd;
use std::os::unix::fs::FileTypeExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use schemas::{Error, ErrorCode};
use signals::Termination;

use crate::args::Args;
use crate::folders::Folders;
use crate::limits::SESSIONS_MAX;
use crate::message::{self, Reply};
use crate::session;

/// Why the service ended otherwise than by a signal or with its client.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// Standard input is no socket that can be used.
    #[error("standard input is no Unix socket; `--listen PATH` needs none")]
    Stdin(#[source] io::Error),
    /// The socket cannot be made.
    #[error("cannot listen on {path}")]
    Listen {
        /// As typed.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
    /// Something else than a folder, or nothing, is where a folder is wanted.
    #[error("--{setting} {path:?} is not a folder that can be read")]
    Folder {
        /// What it is for.
        setting: &'static str,
        /// As typed.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
    /// The one client's conversation broke off.
    #[error("the client's batch failed")]
    Session(#[source] io::Error),
    /// Signals cannot be followed.
    #[error("cannot wait for signals")]
    Signals(#[source] io::Error),
}

/// Serves the client on standard input until it goes, or all that connect until SIGINT or SIGTERM.
///
/// # Errors
/// Why it cannot.
pub fn run(args: Args) -> Result<(), RunError> {
    let folders = Folders { maps: args.maps, tasks: args.tasks };
    for (setting, path) in [("maps", &folders.maps), ("tasks", &folders.tasks)] {
        let Some(path) = path else { continue };
        std::fs::read_dir(path).map_err(|source| RunError::Folder {
            setting,
            path: path.clone(),
            source,
        })?;
    }
    match args.listen {
        None => serve_stdin(&folders),
        Some(path) => {
            let listener =
                listen(&path).map_err(|source| RunError::Listen { path: path.clone(), source })?;
            tracing::info!("serving batches on {}", path.display());
            thread::spawn(move || accept(&listener, &folders));
            let ended = wait_for_signal().map_err(RunError::Signals);
            if let Err(error) = std::fs::remove_file(&path) {
                tracing::warn!(%error, "{} stays", path.display());
            }
            ended
        }
    }
}

fn serve_stdin(folders: &Folders) -> Result<(), RunError> {
    let descriptor = io::stdin().as_fd().try_clone_to_owned().map_err(RunError::Stdin)?;
    let socket = UnixStream::from(descriptor);
    socket.peer_addr().map_err(RunError::Stdin)?;
    session::serve(&socket, folders).map_err(RunError::Session)
}

/// Listens where nobody does; a socket that a killed process left behind is replaced, and no other
/// file.
fn listen(path: &Path) -> io::Result<UnixListener> {
    match UnixListener::bind(path) {
        Err(error) if error.kind() == io::ErrorKind::AddrInUse => {
            if !std::fs::symlink_metadata(path)?.file_type().is_socket() {
                return Err(io::Error::new(error.kind(), "a file that is no socket is there"));
            }
            if UnixStream::connect(path).is_ok() {
                return Err(error);
            }
            std::fs::remove_file(path)?;
            UnixListener::bind(path)
        }
        other => other,
    }
}

fn accept(listener: &UnixListener, folders: &Folders) {
    let sessions = Arc::new(AtomicUsize::new(0));
    for client in listener.incoming() {
        let socket = match client {
            Ok(socket) => socket,
            Err(error) => {
                tracing::warn!(%error, "a client was not let in");
                continue;
            }
        };
        if sessions.fetch_add(1, Ordering::AcqRel) >= SESSIONS_MAX {
            sessions.fetch_sub(1, Ordering::AcqRel);
            refuse(&socket);
            continue;
        }
        let (folders, sessions) = (folders.clone(), Arc::clone(&sessions));
        thread::spawn(move || {
            let _place = Place(sessions);
            if let Err(error) = session::serve(&socket, &folders) {
                tracing::warn!(%error, "a client's batch ended");
            }
        });
    }
}

/// One of the sessions, until it ends, also by a panic.
struct Place(Arc<AtomicUsize>);

impl Drop for Place {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::AcqRel);
    }
}

fn refuse(socket: &UnixStream) {
    let error = Error::new(ErrorCode::Capacity, "too many clients at a time")
        .wanted(format!("at most {SESSIONS_MAX}"));
    if let Err(error) = message::send(socket, &Reply::from(error), &[]) {
        tracing::debug!(%error, "a refused client had gone");
    }
}

fn wait_for_signal() -> io::Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(async {
        Termination::follow()?.requested().await;
        Ok(())
    })
}
