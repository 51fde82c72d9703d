//! The logs and journals of a folder.

use std::path::{Path, PathBuf};

use recording::query;

use super::RecordError;
use super::source::{Opened, open};

/// Folders within folders.
const DEPTH_MAX: usize = 8;
/// Bytes of a mebibyte.
const MIB: f64 = 1_048_576.0;

/// Where to look.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Folder {
    /// The folder
    #[arg(env = "CAUSEWAY_RECORDINGS", default_value = "recordings")]
    folder: PathBuf,
}

/// Prints a line for each, by name; other files are passed over.
///
/// # Errors
/// No such folder.
pub(super) fn list(Folder { folder }: &Folder) -> Result<(), RecordError> {
    let mut files = Vec::new();
    gather(folder, 0, &mut files)
        .map_err(|cause| RecordError::Open { path: folder.clone(), cause })?;
    files.sort();
    for path in files {
        let Ok(opened) = open(&path) else { continue };
        let mib = path.metadata().map_or(0, |file| file.len()) as f64 / MIB;
        let name = path.strip_prefix(folder).unwrap_or(&path).display();
        match opened {
            Opened::Journal(reader) => {
                let (secs, map) = (reader.index().total_secs(), &reader.head().map_name);
                println!("{name}  journal  {map}  {secs:.1} s  {mib:.1} MiB");
            }
            Opened::Log(mut reader) => {
                let last = query::last_frame(&mut reader).ok().flatten();
                let (secs, map) = (last.map_or(0.0, |last| last.elapsed_secs), reader.header());
                let cut = if reader.cut().is_some() { "  cut" } else { "" };
                println!("{name}  log  {}  {secs:.1} s  {mib:.1} MiB{cut}", map.map);
            }
        }
    }
    Ok(())
}

fn gather(folder: &Path, depth: usize, files: &mut Vec<PathBuf>) -> std::io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        let kind = entry.file_type()?;
        if kind.is_dir() && depth < DEPTH_MAX {
            gather(&entry.path(), depth + 1, files)?;
        } else if kind.is_file() {
            files.push(entry.path());
        }
    }
    Ok(())
}
