//! Scans of the Fourier three-sensor method.

use errsep_models::fourier::{Compensation, FourierScans, Scan, Section};
use errsep_models::model::AnyModel;

use super::Args;
use super::case::Case;
use crate::cli::Answer;
use crate::cli::fourier::ORDERS;
use crate::io::Message;
use crate::io::fourier::{FourierSetup, read_scans, told};

/// Most differences that are diagnosed together: noise is a matrix of the readings of a scan.
const MOST: usize = 20_000;

pub(super) fn run(args: &Args) -> Result<Answer, Message> {
    let setup = match &args.setup {
        Some(path) => FourierSetup::read(path)?,
        None => FourierSetup::default(),
    };
    super::positive(setup.probe.noise, "[probe] noise", args)?;
    let length = args.length.or(setup.section.length).ok_or_else(|| {
        Message::bad_input("the length of the section is not known")
            .in_file(args.setup.as_ref().unwrap_or(&args.data))
            .remedy("give [section] length in the set-up, with --setup")
    })?;
    let section = Section {
        length,
        orders: setup.section.orders.unwrap_or(ORDERS),
    };
    let mut scans: Vec<Scan> = Vec::new();
    for located in read_scans(
        &args.data,
        &args.columns.map(),
        setup.probe.spacing.first().copied(),
    )? {
        located.check(section, Compensation::None)?;
        scans.push(located.scan);
    }
    let readings: usize = scans.iter().map(|s| s.readings.len()).sum();
    if readings > MOST {
        return Err(Message::bad_input(format!(
            "{readings} slide positions are more than the {MOST} that are diagnosed together"
        ))
        .in_file(&args.data)
        .remedy("take every n-th position, or fewer repeats"));
    }
    let model = FourierScans::new(&scans, section, setup.probe.noise)
        .map_err(|e| told(&e).in_file(&args.data))?;
    Case {
        readings: format!("{} scans of {} probe spacings", scans.len(), model.spacings().len()),
        model: AnyModel::new(&model),
        along: "slide position",
        notes: vec!["The readings are differences of two probes, free of the slide; their noise is that of two readings. A step at the joint that all spacings share is the slope of the workpiece.".to_owned()],
        inputs: Vec::new(),
    }
    .answer(args)
}
