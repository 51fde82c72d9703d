//! Do our drivers stay on any road?
//!
//! Prints a row for every map and kind of driver.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use manoeuvres::{Drive, Drivers, Stuck, Trial, drive};
use roads::Map;

#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Args {
    /// Folder with OpenDRIVE files (`<map name>.xodr`); our own towns if none is given.
    #[arg(long, value_name = "DIR", env = "CAUSEWAY_MAPS")]
    maps: Option<PathBuf>,
    /// Cars on each map, as far as there is room.
    #[arg(long, value_name = "N", default_value_t = 20,
        value_parser = clap::value_parser!(u32).range(1..))]
    cars: u32,
    /// Simulated minutes for each row.
    #[arg(long, value_name = "N", default_value_t = 10,
        value_parser = clap::value_parser!(u32).range(1..))]
    minutes: u32,
    /// Who drives: traffic, agents, routes, pilots or riders; all of them if none is named.
    #[arg(long, value_name = "WHO", value_delimiter = ',', value_parser = drivers)]
    drivers: Vec<Drivers>,
    /// Names of the maps to drive on; all if none is named.
    #[arg(value_name = "MAP")]
    only: Vec<String>,
    /// On roads as wet as they get.
    #[arg(long)]
    wet: bool,
    /// Tell on the error stream who stands at the end, and whom or what each of them waits for.
    #[arg(long)]
    why: bool,
}

/// Why there is no table.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RoadsError {
    /// The folder of maps.
    #[error("{path:?} cannot be read: {cause}")]
    Read {
        /// What was to be read.
        path: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// A map that is not there.
    #[error("wanted one of the maps {known}, found {name:?}")]
    NoMap {
        /// What was asked for.
        name: String,
        /// What there is.
        known: String,
    },
}

pub(crate) fn run(args: &Args) -> Result<(), RoadsError> {
    let mut chosen = maps(args.maps.as_deref())?;
    let known = chosen.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ");
    let is_known = |name: &&String| chosen.iter().any(|(known, _)| known == *name);
    if let Some(name) = args.only.iter().find(|name| !is_known(name)) {
        return Err(RoadsError::NoMap { name: name.clone(), known });
    }
    chosen.retain(|(name, _)| args.only.is_empty() || args.only.contains(name));
    println!(
        "| map | drivers | cars | worst, m | at | left the road | tipped | collided | rules broken | stuck | m/s |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    let all = if args.drivers.is_empty() { &Drivers::ALL[..] } else { &args.drivers };
    for (name, text) in chosen {
        let map = match Map::parse(&name, &text) {
            Ok(map) => Arc::new(map),
            Err(error) => {
                println!("| {name} | not read: {error} |");
                continue;
            }
        };
        for &drivers in all {
            let who = drivers.as_str();
            let Args { cars: count, minutes, wet, .. } = *args;
            match drive(&map, &Trial { drivers, count, minutes, wet }) {
                Ok(found) => {
                    print(&name, who, &found);
                    found.stuck.iter().filter(|_| args.why).for_each(explain);
                }
                Err(error) => println!("| {name} | {who} | {error} |"),
            }
        }
    }
    Ok(())
}

/// One row of the table.
fn print(name: &str, who: &str, found: &Drive) {
    println!(
        "| {name} | {who} | {} | {:.1} | {:.0}, {:.0} | {} | {} | {} | {} | {} | {:.1} |",
        found.vehicles,
        found.worst_m,
        found.worst_at_m.x,
        found.worst_at_m.y,
        found.left,
        found.tipped,
        found.collided,
        found.broken,
        found.stuck.len(),
        found.mean_mps
    );
}

/// Tells on the error stream what somebody waits for.
fn explain(stuck: &Stuck) {
    let Stuck { id, at_m, secs, held, status } = stuck;
    let [x, y] = [at_m.x, at_m.y];
    let held = held.map_or_else(|| "a pilot".to_owned(), |held| format!("{held:?}"));
    let status = status.map_or_else(String::new, |status| format!(", {status:?}"));
    eprintln!("{id} at {x:.1}, {y:.1} stands for {secs} s: {held}{status}");
}

fn drivers(text: &str) -> Result<Drivers, String> {
    let found = Drivers::ALL.into_iter().find(|drivers| drivers.as_str() == text);
    let known = Drivers::ALL.map(Drivers::as_str).join(", ");
    found.ok_or_else(|| format!("wanted one of {known}"))
}

/// Names and texts, in order of names.
fn maps(folder: Option<&Path>) -> Result<Vec<(String, String)>, RoadsError> {
    let Some(folder) = folder else {
        let towns = roads::town::names().filter(|name| name.ends_with("_Opt"));
        let built = towns.filter_map(|name| Some((name.to_owned(), roads::town::build(name)?)));
        return Ok(built.collect());
    };
    let failed = |path: &Path| {
        let path = path.to_path_buf();
        move |cause| RoadsError::Read { path, cause }
    };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed(folder))? {
        let path = entry.map_err(failed(folder))?.path();
        if path.extension().is_some_and(|extension| extension == "xodr") {
            files.push(path);
        }
    }
    files.sort();
    let read = |path: PathBuf| {
        let text = std::fs::read_to_string(&path).map_err(failed(&path))?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok((name, text))
    };
    files.into_iter().map(read).collect()
}
