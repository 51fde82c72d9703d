//! The bus face: jobs come in on one key, wait fairly, are drawn together and answered.

pub(crate) mod cost;
pub(crate) mod fair_queue;
pub(crate) mod figures;
pub(crate) mod job_queue;
pub(crate) mod prompt_askers;
pub(crate) mod textures;
pub(crate) mod towns;
pub(crate) mod turns;
pub(crate) mod worker;
