//! Whatever is done to a file, reading and solving it ends in an answer or a message, never in a
//! panic.

use std::io::Write;

use errsep::io::ColumnMap;
use errsep::io::reversal::{ReversalSetup, read};
use errsep_models::reversal::staged::{Interpolation, Options, Removal, solve};
use proptest::prelude::*;

const TIDY: &str = "\
channel,repeat,direction,time,x,reading
1A,1,forward,0,0.0,0.12
1A,1,forward,1,10.5,0.2
1A,1,backward,2,20.25,-0.4
1A,2,forward,2,30,-0.4
1B,1,forward,3,0,1e-3
1B,1,forward,4,10,0.3
1B,1,forward,5,20,0.35
2A,1,forward,6,1,12
2A,1,forward,7,11,12.5
2A,1,forward,8,21,13
2B,1,forward,9,0,0
2B,1,forward,10,10,0
2B,1,forward,11,20,0
";

const WIDE: &str = "\
x;1A;1B;2A;2B
0;0,1;0,2;0,3;0,4
10,5;0,2;0,1;0,5;0,4
20;0,3;;0,1;0,2
31;0,1;0,9;0,3;0,4
";

const SETUP: &str = "\
[artefact]
thickness = 42.0
[indicator]
noise = 0.02
[model]
convention = \"rigid\"
interpolation = \"linear\"
[columns]
x = \"position:mm\"
";

/// One change: bytes put in, taken out or put over others.
#[derive(Debug, Clone)]
enum Change {
    Insert(usize, Vec<u8>),
    Remove(usize, usize),
    Replace(usize, u8),
    Repeat(usize, usize),
}

fn change() -> impl Strategy<Value = Change> {
    let pieces = prop_oneof![
        Just(b"\n".to_vec()),
        Just(b",".to_vec()),
        Just(b";".to_vec()),
        Just(b"\"".to_vec()),
        Just(b"\r".to_vec()),
        Just(b"1e308".to_vec()),
        Just(b"-1e308".to_vec()),
        Just(b"NaN".to_vec()),
        Just(b"0".to_vec()),
        Just(b"9".to_vec()),
        Just(b"\0".to_vec()),
        Just("µ".as_bytes().to_vec()),
        proptest::collection::vec(any::<u8>(), 1..6),
    ];
    prop_oneof![
        (any::<usize>(), pieces).prop_map(|(at, b)| Change::Insert(at, b)),
        (any::<usize>(), 1..40_usize).prop_map(|(at, n)| Change::Remove(at, n)),
        (any::<usize>(), any::<u8>()).prop_map(|(at, b)| Change::Replace(at, b)),
        (any::<usize>(), 1..60_usize).prop_map(|(at, n)| Change::Repeat(at, n)),
    ]
}

fn apply(text: &str, changes: &[Change]) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    for change in changes {
        let length = bytes.len() + 1;
        match change {
            Change::Insert(at, piece) => {
                let at = at % length;
                bytes.splice(at..at, piece.iter().copied());
            }
            Change::Remove(at, n) => {
                let at = at % length;
                bytes.drain(at..(at + n).min(length - 1));
            }
            Change::Replace(at, b) => {
                if let Some(byte) = bytes.get_mut(at % length) {
                    *byte = *b;
                }
            }
            Change::Repeat(at, n) => {
                let at = at % length;
                let piece = bytes[at..(at + n).min(length - 1)].to_vec();
                bytes.splice(at..at, piece);
            }
        }
    }
    bytes
}

fn file(bytes: &[u8]) -> tempfile::NamedTempFile {
    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(bytes).unwrap();
    file
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn readings(changes in proptest::collection::vec(change(), 0..5), wide in any::<bool>()) {
        let file = file(&apply(if wide { WIDE } else { TIDY }, &changes));
        match read(file.path(), &ColumnMap::default()) {
            Err(message) => prop_assert!(message.render().contains(&message.to_string())),
            Ok(data) => {
                for removal in [None, Some(Removal::Rotation)] {
                    for interpolation in [Interpolation::Linear, Interpolation::Cubic] {
                        let options = Options {
                            removal,
                            interpolation,
                            thickness: Some(30.0),
                            ..Options::default()
                        };
                        if let Err(why) = solve(&data.observations, &options) {
                            prop_assert!(!why.to_string().is_empty());
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn setups(changes in proptest::collection::vec(change(), 0..5)) {
        let file = file(&apply(SETUP, &changes));
        if let Err(message) = ReversalSetup::read(file.path()) {
            prop_assert!(message.render().contains(&message.to_string()));
        }
    }
}
