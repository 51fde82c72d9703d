//! The bus between two places in one process. One binary, as each links all of Zenoh.

mod common;
mod frames;
mod hostile;
mod presence;
mod requests;
