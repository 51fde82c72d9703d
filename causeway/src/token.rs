//! `causeway token`: tokens for a file of tenants.

use std::fs::{self, OpenOptions};
use std::io::Write as _;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};

use schemas::Tenant;
use tenancy::{Invalid, People, Secret, TokenId};

use crate::failure::Failure;

/// What can be done with tokens.
#[derive(Debug, clap::Subcommand)]
pub(crate) enum Command {
    /// Make a token: it is printed once, only its hash is kept
    New(NewArgs),
    /// Read a file of tenants and say what is wrong with it
    Check {
        /// The file of tenants
        file: PathBuf,
    },
}

/// Settings of `token new`.
#[derive(Debug, clap::Args)]
pub(crate) struct NewArgs {
    /// Whose worlds and quotas come with it
    #[arg(long, value_name = "NAME")]
    tenant: Tenant,
    /// What logs call it, e.g. alice-laptop
    #[arg(long, value_name = "NAME")]
    id: TokenId,
    /// When it ends to be valid, e.g. 2027-01-01T00:00:00Z [default: never]
    #[arg(long, value_name = "TIME", value_parser = tenancy::expiry)]
    expires: Option<String>,
    /// Add it to this file of tenants, and the tenant if it is new there [default: print the entry]
    #[arg(long, value_name = "FILE")]
    add: Option<PathBuf>,
}

/// Why there is no new token.
#[derive(Debug, thiserror::Error)]
enum TokenError {
    #[error("the system has no randomness: {0}")]
    Random(getrandom::Error),
    #[error("{path:?}: {cause}")]
    File { path: PathBuf, cause: std::io::Error },
    #[error("{path:?}: {cause}")]
    Invalid { path: PathBuf, cause: Invalid },
    #[error(transparent)]
    Entry(Invalid),
}

/// Carries out one of them.
///
/// # Errors
/// Settings that cannot work, files that cannot be read or written.
pub(crate) fn run(command: &Command) -> Result<(), Failure> {
    match command {
        Command::New(args) => new(args).map_err(|error| Failure::of(&error)),
        Command::Check { file } => {
            let people = read(file).and_then(|text| parse(file, &text));
            let (tenants, tokens) = people.map_err(|error| Failure::of(&error))?.counts();
            println!("{tenants} tenants, {tokens} tokens");
            Ok(())
        }
    }
}

fn new(args: &NewArgs) -> Result<(), TokenError> {
    let secret = Secret::new(args.id.clone()).map_err(TokenError::Random)?;
    let entry = entry(args, &secret);
    let tenant = format!("[tenant.{}]\n", args.tenant);
    // Alone it is right only if all that was typed is.
    People::parse(&format!("{tenant}{entry}")).map_err(TokenError::Entry)?;
    match &args.add {
        None => println!("{}\n\n{tenant}{entry}", secret.token()),
        Some(path) => {
            add(path, &args.tenant, &tenant, &entry)?;
            println!("{}", secret.token());
        }
    }
    Ok(())
}

fn entry(args: &NewArgs, secret: &Secret) -> String {
    let (id, tenant, sha256) = (&args.id, &args.tenant, secret.sha256());
    let expires = args.expires.as_ref().map(|time| format!("expires = {time}\n"));
    let expires = expires.unwrap_or_default();
    format!("[[token]]\nid = \"{id}\"\ntenant = \"{tenant}\"\nsha256 = \"{sha256}\"\n{expires}")
}

/// Adds to the end of a file, after the whole has been checked.
fn add(path: &Path, tenant: &Tenant, table: &str, entry: &str) -> Result<(), TokenError> {
    let before = if path.exists() { read(path)? } else { String::new() };
    let is_known = parse(path, &before)?.tenants().any(|known| known == tenant);
    let gap = if before.is_empty() || before.ends_with("\n\n") { "" } else { "\n" };
    let table = if is_known { "" } else { table };
    let more = format!("{gap}{table}{entry}");
    parse(path, &format!("{before}{more}"))?;
    let mut options = OpenOptions::new();
    // For its owner alone when it is new.
    let file = options.append(true).create(true).mode(0o600).open(path);
    let written = file.and_then(|mut file| file.write_all(more.as_bytes()));
    written.map_err(|cause| TokenError::File { path: path.to_owned(), cause })
}

fn read(path: &Path) -> Result<String, TokenError> {
    fs::read_to_string(path).map_err(|cause| TokenError::File { path: path.to_owned(), cause })
}

fn parse(path: &Path, text: &str) -> Result<People, TokenError> {
    People::parse(text).map_err(|cause| TokenError::Invalid { path: path.to_owned(), cause })
}
