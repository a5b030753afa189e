//! A command called by a program.

use std::sync::Arc;

use errsep::cli::call::call;
use errsep::io::Trouble;
use errsep::io::source::InMemory;

fn profile(text: &str) -> Vec<InMemory> {
    vec![InMemory {
        name: "<data>".to_owned(),
        bytes: Arc::from(text.as_bytes()),
    }]
}

#[test]
fn a_message_points_into_what_is_in_memory() {
    let message = call(
        &["straightness", "<data>"],
        profile("x,deviation\n0,1\n1,a\n"),
    )
    .map(|_| ())
    .unwrap_err();
    let place = message.place().unwrap();
    assert_eq!((place.line, place.column), (3, 3));
    assert_eq!(place.file.to_str(), Some("<data>"));
    assert_eq!(message.trouble(), Trouble::BadInput);
}

/// Two points, and deviations that are all equal, lie on a line whatever was measured.
#[test]
fn a_profile_that_can_only_be_straight_says_so() {
    for (data, said) in [
        (
            "x,deviation\n0,1\n1,2\n",
            Some("Two positions always lie on a line"),
        ),
        (
            "x,deviation\n0,1\n1,2\n0,1\n",
            Some("Two positions always lie on a line"),
        ),
        (
            "x,deviation\n0,1\n1,1\n2,1\n",
            Some("All deviations are equal"),
        ),
        ("x,deviation\n0,1\n1,2\n2,1\n", None),
    ] {
        let answer = call(&["straightness", "<data>"], profile(data))
            .unwrap()
            .answer;
        let page = answer.page.render();
        match said {
            Some(said) => {
                assert!(answer.text.contains(said), "{}", answer.text);
                assert!(
                    answer.json["remarks"][0]
                        .as_str()
                        .unwrap()
                        .starts_with(said)
                );
                assert!(page.contains(said) && !page.contains("The profile is straight"));
            }
            None => assert_eq!(answer.json["remarks"], serde_json::json!([])),
        }
    }
}

#[test]
fn an_unknown_option_is_told_with_its_hint() {
    let message = call(&["reversal", "<data>", "--simultaneus"], profile(""))
        .map(|_| ())
        .unwrap_err();
    assert!(message.what().contains("'--simultaneus'"), "{message}");
    let hint = message.remedy_words().unwrap();
    assert!(hint.contains("'--simultaneous'"), "{hint}");
}

#[test]
fn a_reversal_is_answered_whole() {
    let readings: String = ["1A", "1B", "2A", "2B"]
        .iter()
        .flat_map(|c| (0..9).map(move |i| format!("{c},{i},0.{}\n", i * i % 7)))
        .collect();
    let data = format!("channel,x,reading\n{readings}");
    let called = call(&["reversal", "<data>"], profile(&data)).unwrap();
    assert!(called.answer.json["tilts"]["alpha"]["std"].is_number());
    assert!(!called.answer.tables.is_empty());
    assert!(called.answer.page.render().contains("<svg"));
    assert_eq!(called.provenance.command, ["reversal", "<data>"]);
}

/// Numbers that count something, wherever they are given.
#[test]
fn a_number_that_counts_nothing_is_told_what_it_may_be() {
    let refused = |words: &[&str]| {
        let message = call(words, profile("x,deviation\n0,1\n1,2\n2,1\n"));
        message.map(|_| ()).unwrap_err().what().to_owned()
    };
    for (option, what) in [
        ("--seed=-1", "give a whole number, 0 or greater"),
        ("--seed=1.5", "give a whole number, 0 or greater"),
        ("--seed=99999999999999999999", "it is too great"),
    ] {
        let told = refused(&["straightness", "<data>", option]);
        assert!(
            told.contains("--seed <N>") && told.ends_with(what),
            "{told}"
        );
    }
    for option in ["--severity=-1", "--prove=-1"] {
        let told = refused(&["diagnose", "<data>", option]);
        assert!(
            told.ends_with("give a whole number, 0 or greater"),
            "{told}"
        );
    }
    for option in ["--positions=-1", "--repeats=-1"] {
        let told = refused(&["simulate", "circle", option]);
        assert!(
            told.ends_with("give a whole number, 0 or greater"),
            "{told}"
        );
    }
}

/// Several values after commas are the same as the option given again for each.
#[test]
fn lists_have_commas_or_the_option_again() {
    let json = |words: &[&str]| call(words, Vec::new()).unwrap().answer.json;
    for (kind, commas, again) in [
        (
            "circle",
            "--lobe=2:1.5,3:0.8",
            &["--lobe=2:1.5", "--lobe=3:0.8"][..],
        ),
        (
            "fourier",
            "--spacing=48.5,34.1",
            &["--spacing=48.5", "--spacing", "34.1"],
        ),
        (
            "step-diagonal",
            "--sequence=XYZ,ZYX",
            &["--sequence=XYZ", "--sequence=ZYX"],
        ),
        (
            "step-diagonal",
            "--travel=500,400,300",
            &["--travel", "500", "400", "300"],
        ),
    ] {
        let of = |options: &[&str]| json(&[&["simulate", kind], options].concat());
        assert_eq!(of(&[commas]), of(again), "{kind}");
        assert_ne!(of(&[commas]), of(&[]), "{kind}");
    }
}
