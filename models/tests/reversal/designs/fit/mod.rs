//! The simultaneous fit of designs: derivatives, known truth, and the four-channel fit beside it.

mod endings;
mod four_channels;
mod truth;

use errsep_models::noise::Law;
use errsep_models::reversal::designs::simulate::{DesignPlan, simulate};
use errsep_models::reversal::designs::{
    Design, DesignChannel, DesignFitError, DesignObservations, DesignOptions, DesignReading, Zero,
    central_differences, fit, staged,
};
use errsep_models::reversal::simultaneous::{self, Knots, Noise, NoiseOrigin, Thickness};
use errsep_models::reversal::{Channel, Convention, Observations, Reading, simulate as four};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const EIGHT: &str = "0/0,180/0,90/0,270/0,0/180,180/180,90/180,270/180";
const THIRDS: &str = "0/0,120/0,240/0,0/120,120/120,240/120,0/240,120/240,240/240";
const NEAR_TOP: &str = "0/0,0/90,0/180,0/270,90/0,90/90,90/180,90/270";

fn plan(design: &str) -> DesignPlan {
    DesignPlan {
        slopes_rad: [2e-4, -1.5e-4, 3e-4, 1e-4, 2.5e-4, 0.0, 0.0],
        thickness_mm: 40.0,
        noise_um: 0.05,
        forms_um: [2.0, 1.0],
        seed: 11,
        ..DesignPlan::of(Design::parse(design).unwrap())
    }
}

fn options(cells: usize) -> DesignOptions {
    DesignOptions {
        thickness_mm: 40.0,
        knots: Knots::Cells(cells),
        ..DesignOptions::default()
    }
}

/// The four channels' readings as a design of two angles.
fn as_design(observations: &Observations) -> DesignObservations {
    let channels = Channel::ALL.map(DesignChannel::from).to_vec();
    let reading = |r: &Reading| DesignReading {
        channel: r.channel.index(),
        repeat: r.repeat,
        direction: r.direction,
        time: r.time,
        x: r.x,
        value: r.value,
    };
    DesignObservations {
        design: Design::new(channels).unwrap(),
        readings: observations.readings.iter().map(reading).collect(),
    }
}
