//! Prints the OpenDRIVE text of a generated town: `print_town Town03`; without a name, the names.
#![allow(clippy::print_stdout, reason = "this is what the program is for")]

use std::process::ExitCode;

fn main() -> ExitCode {
    let Some(name) = std::env::args().nth(1) else {
        for name in roads::town::names() {
            println!("{name}");
        }
        return ExitCode::SUCCESS;
    };
    match roads::town::build(&name) {
        Some(text) => {
            print!("{text}");
            ExitCode::SUCCESS
        }
        None => {
            eprintln!("no town {name:?}; without a name, this program lists them");
            ExitCode::FAILURE
        }
    }
}
