//! Nothing there, the four channels told by their angles, and designs that leave nothing over.

use errsep::diagnosis::{Diagnosis, Kind, Options, diagnose};
use errsep_models::reversal::designs::{DesignReading, Zero};
use errsep_models::reversal::diagnosable::{Assumptions, Linearised, NotDiagnosable};
use errsep_models::reversal::{Channel, Convention, Direction, Observations, Reading};

use super::{EIGHT, Moment, NOISE, PUT, Put, SIXTEEN, diagnosed};

#[test]
fn nothing_is_named_where_nothing_is_there() {
    for (design, seed) in [
        (EIGHT, 1),
        (EIGHT, 2),
        (SIXTEEN, 1),
        ("0/0,0/90,0/180,0/270", 1),
    ] {
        let put = Put {
            design,
            seed,
            repeats: 2,
            positions: 40,
            ..PUT
        };
        let diagnosis = diagnosed(&put.with(|_| 0.0));
        // Verdict: wrong in one of a hundred seeds by its own level.
        assert_eq!(
            diagnosis.verdict.kind,
            Kind::None,
            "{design}: {}",
            diagnosis.verdict.statement
        );
    }
}

#[test]
fn four_channels_told_by_their_angles() {
    let put = Put {
        design: "1A,1B,2A,2B",
        ..PUT
    };
    type Change = fn(&Moment) -> f64;
    let cases: [(&str, Change); 3] = [
        ("nothing", |_| 0.0),
        ("zero-jump", |m| {
            f64::from(u8::from(m.indicator() == 180.0 && m.part > 0.43)) * 0.4
        }),
        ("reversal-shift", |m| {
            if m.theta > 1.0 {
                m.side(m.x - 3.0) - m.side(m.x)
            } else {
                0.0
            }
        }),
    ];
    for (what, change) in cases {
        let readings = put.with(change);
        let reading = |r: &DesignReading| Reading {
            channel: Channel::ALL[r.channel],
            repeat: r.repeat,
            direction: r.direction,
            time: r.time,
            x: r.x,
            value: r.value,
        };
        let four = Observations {
            readings: readings.readings.iter().map(reading).collect(),
        };
        let rigid = Assumptions {
            convention: Convention::Rigid,
            ..Assumptions::default()
        };
        let options = Options {
            draws: 200,
            ..Options::default()
        };
        let of_four = diagnose(&Linearised::new(&four, rigid).unwrap(), &options);
        let of_design = diagnosed(&readings);
        assert_eq!(of_four.verdict.effects, of_design.verdict.effects, "{what}");
        // ε·κ: the same fit by other sums, 1e-9 of the gap.
        let (one, other) = (of_four.gap.before.rms, of_design.gap.before.rms);
        assert!(
            (one - other).abs() < 1e-9 * one.max(NOISE),
            "{what}: {one} {other}"
        );
        for name in [("alpha", "alpha_h"), ("setup", "gamma_1"), ("cone", "cone")] {
            let of = |d: &Diagnosis, name: &str| {
                d.bias.iter().find(|b| b.quantity == name).map(|b| b.before)
            };
            let (one, other) = (of(&of_four, name.0), of(&of_design, name.1));
            let (Some(one), Some(other)) = (one, other) else {
                panic!("{what}: {name:?} {one:?} {other:?}");
            };
            // ε·κ: the same line by other sums.
            assert!(
                (one - other).abs() < 1e-12,
                "{what}: {name:?} {one} {other}"
            );
        }
    }
}

#[test]
fn what_leaves_nothing_over_is_refused() {
    let put = Put {
        design: "0/0,0/180",
        repeats: 1,
        ..PUT
    };
    let mut readings = put.with(|_| 0.0);
    readings
        .readings
        .retain(|r| r.direction == Direction::Forward);
    let refused = Linearised::of_design(&readings, Zero::Reset, None, Assumptions::default());
    assert!(matches!(refused, Err(NotDiagnosable::NothingLeft { .. })));
}
