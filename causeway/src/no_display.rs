//! Processes that draw where there is no display, without the complaint of Mesa's layer.

use std::os::unix::process::CommandExt as _;
use std::process::Command;

use render_service::NO_DISPLAY;

/// Begins this process anew with the variable that `causeway up` gives renderers, unless it is set:
/// a process that has begun may not change its own. Where that fails, nothing but the complaint
/// comes of it.
pub(crate) fn begin_anew() {
    let (variable, value) = NO_DISPLAY;
    if std::env::var_os(variable).is_some() {
        return;
    }
    let Ok(program) = std::env::current_exe() else { return };
    let mut line = std::env::args_os();
    let mut command = Command::new(program);
    if let Some(name) = line.next() {
        command.arg0(name);
    }
    let _cause = command.args(line).env(variable, value).exec();
}
