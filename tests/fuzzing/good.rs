//! Good inputs of every command, and the command line of a case.

use std::collections::BTreeMap;
use std::process::Command;

use super::spoil::{self, Spoil};

/// Command lines; a word with a dot is a file of [`Good`].
pub const COMMANDS: &[&str] = &[
    "anova parts.csv",
    "anova parts.csv --recipe section-5.1 --confidence 0.9",
    "circle circle.csv",
    "circle arc.csv --noise 5 --nistir",
    "diagnose line.csv --model calibration-line",
    "diagnose circle.csv --model circle",
    "diagnose traces.csv --effects effects.toml",
    "diagnose scans.csv --setup fourier.toml",
    "four-sensor four.csv --setup four.toml",
    "fourier scans.csv --setup fourier.toml",
    "machine machine.toml predict points.csv",
    "machine machine.toml length points.csv --between a:b --trials 50",
    "machine machine.toml squareness points.csv --first a,b --second b,c --trials 50",
    "machine machine.toml circularity --centre 80,60 --radius 40 --trials 50 --count 12",
    "machine machine.toml parts readings.csv --points points.csv",
    "plan plan.toml",
    "positioning positions.csv --setup positioning.toml",
    "simulate positioning --targets 4 --runs 2 --drift 3",
    "reversal traces.csv --setup reversal.toml",
    "reversal traces.csv --setup reversal.toml --simultaneous",
    "reversal wide.csv --columns x=x:mm,1A=1A:um,1B=1B:um",
    "simulate anova --parts 3 --replicates 2",
    "simulate calibration-line --loads 5",
    "simulate circle --points 12 --lobe 3:2.5",
    "simulate four-sensor --points 19 --spacing 1,1,5",
    "simulate fourier --samples 40 --length 40 --spacing 10",
    "simulate machine machine.toml --points points.csv --stations 3 --repeats 2 --parts 3",
    "simulate reversal --positions 9 --effect zero-jump=1 --spline 4",
    "simulate step-diagonal --steps 2 --travel 600 500 400",
    "step-diagonal steps.csv --setup steps.toml",
    "straightness profile.csv",
    "export linuxcnc positions.json --out x.comp --force",
    "export isg-leadscrew positions.json --axis 1 --points 5 --out x.lis --force",
    "export siemens-eec positions.json --axis X --step 100 --reference 50 --out x.ini --force",
    "export etalon machine.toml --travel X=0:200 --out x.etalon --force",
    "export klipper machine.toml --out x.cfg --force",
    "traces run.csv --window 30",
];

const TEXTS: &[(&str, &str)] = &[
    (
        "profile.csv",
        "x,deviation\n0,-0.31\n50,0.2\n100,0.93\n150,0.4\n200,0.11\n250,-0.84\n",
    ),
    (
        "points.csv",
        "point,x,y,z\na,10,10,0\nb,90,15,0\nc,100,120,5\n",
    ),
    (
        "wide.csv",
        "x,1A,1B,2A,2B\n0,0.1,0.2,0.3,0.1\n20,0.4,0.3,0.6,0.2\n40,0.2,0.8,0.9,0.5\n\
         60,0.9,1.1,1.0,0.8\n80,1.2,1.4,1.9,0.7\n100,1.3,1.9,2.1,1.1\n",
    ),
    (
        "readings.csv",
        "part,point,axis,replicate,value\n1,a,x,1,0.4\n1,a,y,1,-1.2\n1,b,x,1,2.1\n1,b,y,1,0.3\n\
         2,a,x,1,0.9\n2,a,y,1,-0.2\n2,b,x,1,1.7\n2,b,y,1,1.3\n",
    ),
    (
        "machine.toml",
        "chain = \"XYFZ\"\ntool_offset = [0, 0, -80]\n[errors.EXX]\npolynomial = [0.1, 0.02]\nstd = 0.5\n\
         [errors.ECX]\ntable = { positions = [0, 100, 200], values = [0, 1e-5, 3e-6] }\n\
         [errors.EYY]\nvalue = 1.5\nstd = 0.3\ndegrees_of_freedom = 9\n\
         [errors.C0Y]\nreadings = [-3.4e-5, -3.1e-5, -3.6e-5]\n",
    ),
    (
        "reversal.toml",
        "[artefact]\nthickness = 42.0\n[indicator]\nnoise = 0.02\n[model]\nconvention = \"seed\"\nknots = 4\n",
    ),
    (
        "four.toml",
        "[sensors]\nspacing = [5.0, 5.0, 25.0]\nnoise = 0.1\n[separation]\nchoice = \"l-curve\"\n",
    ),
    (
        "fourier.toml",
        "[section]\nlength = 40.0\norders = 6\n[probe]\nnoise = 2.0\n",
    ),
    (
        "steps.toml",
        "[test]\nnoise = 0.2\n[[measured]]\naxis = \"X\"\nslope = 0.004\nstd = 0.0005\ndegrees_of_freedom = 9\n",
    ),
    (
        "positions.json",
        "{\"schema\": \"errsep.positioning/1\", \"axis\": {\"name\": \"X\"}, \"unit\": \"um\", \"points\": [\
         {\"target\": 0, \"mean_forward\": 0.1, \"mean_backward\": 1.2},\n\
         {\"target\": 100, \"mean_forward\": 1.1, \"mean_backward\": 2.4},\n\
         {\"target\": 200, \"mean_forward\": -0.3, \"mean_backward\": 0.9}]}\n",
    ),
    (
        "positioning.toml",
        "[axis]\nname = \"X\"\nkind = \"linear\"\ntravel_from = 0.0\ntravel_to = 500.0\n\
         [uncertainty]\ndevice = 1.0\ndrift = 0.4\n",
    ),
    (
        "plan.toml",
        "noise = 0.02\ntravel = 300.0\npositions = 11\ntilts = [50.0, 0.0, 20.0]\nforms = [1.0, 1.0]\n",
    ),
    (
        "effects.toml",
        "[[effect]]\nname = \"coolant\"\nsignature = [[0.0, 0.0], [100.0, 1.0], [300.0, 1.0]]\nchannels = { 1A = 1.0 }\n",
    ),
];

const SIMULATED: &[(&str, &str)] = &[
    ("parts.csv", "anova --parts 4 --replicates 3"),
    ("circle.csv", "circle --points 14 --lobe 3:2"),
    ("arc.csv", "circle --points 9 --arc 60 --noise 5"),
    ("line.csv", "calibration-line --loads 8 --sets 2"),
    (
        "traces.csv",
        "reversal --positions 11 --repeats 2 --both-directions",
    ),
    ("four.csv", "four-sensor --points 19"),
    (
        "scans.csv",
        "fourier --samples 60 --length 40 --spacing 10 --spacing 17",
    ),
    ("steps.csv", "step-diagonal --steps 2"),
    (
        "positions.csv",
        "positioning --targets 4 --runs 3 --drift 2",
    ),
];

/// The files, each good.
pub struct Good(BTreeMap<&'static str, String>);

impl Good {
    /// Written here, or made by the program.
    pub fn made() -> Self {
        let mut files: BTreeMap<_, _> = TEXTS
            .iter()
            .map(|(name, text)| (*name, (*text).to_owned()))
            .collect();
        for (name, arguments) in SIMULATED {
            let output = Command::new(env!("CARGO_BIN_EXE_errsep"))
                .arg("simulate")
                .args(arguments.split(' '))
                .output()
                .unwrap();
            assert!(output.status.success(), "{arguments}");
            files.insert(name, String::from_utf8(output.stdout).unwrap());
        }
        let turns = (0..600).map(|i| {
            let time = f64::from(i) * 0.01;
            let wave = 10.0 * (15.7 * time).sin() + 0.01 * f64::from(i * i % 11);
            format!("{time:.2},{:.3},{wave:.4}\n", 5.0 * time)
        });
        files.insert(
            "run.csv",
            "time,x,reading\n".to_owned() + &turns.collect::<String>(),
        );
        Self(files)
    }
}

/// One run: its command line and its files.
pub struct Case {
    pub arguments: Vec<String>,
    pub files: BTreeMap<&'static str, Vec<u8>>,
    pub as_json: bool,
}

impl Case {
    /// A command with its files and arguments spoilt.
    pub fn new(good: &Good, command: usize, spoils: &[Spoil], as_json: bool) -> Self {
        let words = COMMANDS[command % COMMANDS.len()].split(' ');
        let mut arguments: Vec<String> = words.map(str::to_owned).collect();
        let mut files: BTreeMap<_, _> = good
            .0
            .iter()
            .filter(|(name, _)| arguments.iter().any(|word| word == *name))
            .map(|(name, text)| (*name, text.clone().into_bytes()))
            .collect();
        for spoil in spoils {
            spoil::apply(spoil, &mut arguments, &mut files);
        }
        if as_json {
            arguments.extend(["--format", "json"].map(str::to_owned));
        }
        Self {
            arguments,
            files,
            as_json,
        }
    }

    /// The command line and the files, as text.
    pub fn in_words(&self) -> String {
        let mut words = format!("errsep {:?}\n", self.arguments);
        for (name, bytes) in &self.files {
            let text = String::from_utf8_lossy(bytes);
            let begin: String = text.chars().take(3000).collect();
            words += &format!("--- {name}\n{begin}\n");
        }
        words
    }
}
