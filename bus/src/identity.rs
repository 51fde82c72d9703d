//! By what a process is known where the bus asks: a certificate of mutual TLS.

use std::path::{Path, PathBuf};

use crate::BusError;

/// Files of a process on a bus whose addresses begin with `tls/`.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct IdentityArgs {
    /// Certificates (PEM) that sign for everybody on a bus with TLS
    #[arg(long, env = "CAUSEWAY_BUS_CA", value_name = "FILE", requires_all = ["bus_cert", "bus_key"])]
    pub bus_ca: Option<PathBuf>,
    /// Certificate (PEM) of this process; its common name says what it may do, e.g. causeway-world
    #[arg(long, env = "CAUSEWAY_BUS_CERT", value_name = "FILE", requires = "bus_ca")]
    pub bus_cert: Option<PathBuf>,
    /// Key (PEM) of that certificate
    #[arg(long, env = "CAUSEWAY_BUS_KEY", value_name = "FILE", requires = "bus_ca")]
    pub bus_key: Option<PathBuf>,
}

impl IdentityArgs {
    /// All three files, if they are named.
    pub fn identity(&self) -> Option<Identity> {
        Some(Identity {
            authority: self.bus_ca.clone()?,
            certificate: self.bus_cert.clone()?,
            key: self.bus_key.clone()?,
        })
    }
}

/// By what a process is known on the bus, and by what it knows others. Files in PEM.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Certificates that sign for everybody.
    pub authority: PathBuf,
    /// Of this process. Its common name is its role on the bus.
    pub certificate: PathBuf,
    /// Of the certificate.
    pub key: PathBuf,
}

impl Identity {
    /// The transport's settings.
    ///
    /// # Errors
    /// [`BusError::IdentityFile`] names the file that cannot be read.
    pub(crate) fn settings(&self) -> Result<[(&'static str, String); 8], BusError> {
        let (authority, certificate, key) =
            (quoted(&self.authority)?, quoted(&self.certificate)?, quoted(&self.key)?);
        Ok([
            ("transport/link/tls/root_ca_certificate", authority),
            ("transport/link/tls/listen_certificate", certificate.clone()),
            ("transport/link/tls/listen_private_key", key.clone()),
            ("transport/link/tls/connect_certificate", certificate),
            ("transport/link/tls/connect_private_key", key),
            ("transport/link/tls/enable_mtls", true.to_string()),
            ("transport/link/tls/verify_name_on_connect", true.to_string()),
            // There is no list of certificates that are taken back, so they are short-lived.
            ("transport/link/tls/close_link_on_expiration", true.to_string()),
        ])
    }
}

/// A path as a setting.
fn quoted(path: &Path) -> Result<String, BusError> {
    let unread = |cause| BusError::IdentityFile { path: path.to_owned(), cause };
    std::fs::File::open(path).map_err(unread)?;
    let path = path.to_str().ok_or_else(|| unread(std::io::ErrorKind::InvalidFilename.into()))?;
    Ok(serde_json::Value::from(path).to_string())
}
