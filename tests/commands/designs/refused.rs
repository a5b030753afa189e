//! Readings and set-ups of a design that cannot be used.

use super::*;

const GOOD: &str = "indicator,spindle,x,reading
0,0,0,1
0,0,10,2
0,0,20,1
0,0,30,2
0,90,0,1
0,90,10,2
0,90,20,3
0,90,30,2
";

fn refused(data: &str, setup: &str) -> Output {
    let folder = Folder::with(&[("d.csv", data), ("s.toml", setup)]);
    run(&folder, &["reversal", "d.csv", "--setup", "s.toml"])
}

/// Each bad input is told with its place and what to do.
#[test]
fn bad_input_is_told() {
    let named = GOOD
        .replace("indicator,spindle", "channel")
        .replace("0,90,", "4D,")
        .replace("0,0,", "1A,");
    let angles =
        "[channels]\n1A = { indicator = 0, spindle = 0 }\n4D = { indicator = 270, spindle = 90 }\n";
    let cases: [(&str, String, String, &[&str]); 11] = [
        (
            "NaN",
            GOOD.replace("0,90,10,2", "0,90,10,nan"),
            String::new(),
            &["d.csv:7:", "nan"],
        ),
        (
            "no angle",
            GOOD.replace("0,90,0,1", ",90,0,1"),
            String::new(),
            &["d.csv:6:1", "empty"],
        ),
        (
            "a text for an angle",
            GOOD.replace("0,90,0,1", "0,top,0,1"),
            String::new(),
            &["d.csv:6:3", "top"],
        ),
        (
            "no column of the spindle",
            GOOD.replace("indicator,spindle", "indicator,spindel"),
            String::new(),
            &["d.csv:1:", "spindel", "spindle"],
        ),
        (
            "names beside angles",
            GOOD.replace("indicator,spindle,x", "indicator,channel,x"),
            String::new(),
            &["d.csv:1:1", "`channel` stands beside the angles"],
        ),
        (
            "a channel without angles",
            named.replace("4D", "4E"),
            angles.to_owned(),
            &["d.csv:6:1", "channel `4E` has no angles", "4D"],
        ),
        (
            "the same angles twice",
            named.clone(),
            angles.replace("270, spindle = 90", "360, spindle = 0.3"),
            &["s.toml:3:", "1A and 4D have the same angles"],
        ),
        (
            "half the angles",
            named.clone(),
            angles.replace(", spindle = 90", ""),
            &["s.toml:3:", "spindle"],
        ),
        (
            "an angle that is none",
            named.clone(),
            angles.replace("spindle = 90", "spindle = nan"),
            &["s.toml:3:", "no angle"],
        ),
        (
            "a reading twice",
            format!("{GOOD}0,90,30,5\n"),
            String::new(),
            &["d.csv:10", "line 9 already", "repeat"],
        ),
        (
            "one position",
            GOOD.replace("0,90,10,", "0,90,0,1\n#")
                .replace("0,90,20,", "#")
                .replace("0,90,30,", "#")
                .replace("0,90,0,1\n0,90,0,1", "0,90,0,1"),
            String::new(),
            &["d.csv:6:", "a slope needs two positions"],
        ),
    ];
    for (name, data, setup, told) in cases {
        let output = refused(&data, &setup);
        assert_eq!(
            output.status, 2,
            "{name}: {}{}",
            output.stdout, output.stderr
        );
        assert!(output.stdout.is_empty(), "{name}: {}", output.stdout);
        for part in told {
            assert!(
                output.stderr.contains(part),
                "{name}, {part}: {}",
                output.stderr
            );
        }
    }
}
