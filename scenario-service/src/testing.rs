//! What several unit tests share.

use std::sync::Arc;

/// The default town.
pub(crate) fn map() -> Arc<roads::Map> {
    let text = roads::town::build("Town10HD_Opt").unwrap();
    Arc::new(roads::Map::parse("Town10HD_Opt", &text).unwrap())
}
