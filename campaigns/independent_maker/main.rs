//! An independent maker of reversal readings, and how the diagnosis answers them.
//!
//! Readings are written from the physics of rig, mounts, styli and slides, and share neither code nor
//! forms with the catalogue: `physics/` has each error source in at least four realisations that differ
//! in what a machine leaves free. Sizes are such that what a free dense fit cannot take up is 0.7 to 3
//! times the noise of a reading. The tables stand in `docs/validation/independent.md`; the command line
//! is in `arguments.rs`.

mod arguments;
mod case;
mod chance;
mod design;
mod dump;
mod forms;
mod judge;
mod noise;
mod physics;
mod product;
mod projection;
mod rig;
mod seen;
mod sets;
mod table;

use std::process::ExitCode;

use arguments::{Arguments, Set, USAGE};

fn main() -> ExitCode {
    let arguments = match Arguments::read(std::env::args().skip(1)) {
        Ok(arguments) => arguments,
        Err(what) => {
            eprintln!("{what}\n\n{USAGE}");
            return ExitCode::from(2);
        }
    };
    let run = match arguments.set {
        Set::Single => sets::single::run(&arguments),
        Set::Pairs => sets::pairs::run(&arguments),
        Set::Withheld => sets::withheld::run(&arguments),
        Set::Nulls => sets::nulls::run(&arguments),
    };
    match run {
        Ok(()) => ExitCode::SUCCESS,
        Err(what) => {
            eprintln!("{what}");
            ExitCode::FAILURE
        }
    }
}
