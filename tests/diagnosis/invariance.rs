//! What must not change a diagnosis: the basis in which the model's freedom is written, columns that
//! add nothing to it, the order of the readings' units, an effect that is listed twice.

use errsep::diagnosis::{Diagnosis, Kind, Options, Tabulated, diagnose_with};
use errsep_models::model::{Effect, FittedModel, Freedom, Record};
use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use errsep_models::reversal::exact_readings::{Scene, SceneNoise};
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Channels that are fitted by an offset and a slope each, the freedom written in some basis and the
/// readings in some unit.
#[derive(Clone)]
struct Lines {
    reversal: Linearised,
    record: Record,
    freedom: DMatrix<f64>,
}

impl Lines {
    fn new(reversal: &Linearised) -> Self {
        let places = reversal.places();
        let freedom = DMatrix::from_fn(places.len(), 8, |k, column| {
            let here = f64::from(u8::from(places[k].channel == column / 2));
            here * places[k].x.powi((column % 2) as i32)
        });
        Self {
            record: reversal.record().clone(),
            reversal: reversal.clone(),
            freedom,
        }
    }
}

impl FittedModel for Lines {
    fn name(&self) -> &'static str {
        "lines"
    }
    fn reading_unit(&self) -> &'static str {
        "um"
    }
    fn record(&self) -> &Record {
        &self.record
    }
    fn freedom(&self) -> Freedom {
        Freedom {
            columns: self.freedom.clone(),
            profiles: None,
        }
    }
    fn channel_names(&self) -> Vec<String> {
        self.reversal.channel_names()
    }
    fn refit(&self, observed: DVector<f64>) -> Self {
        Self {
            record: self.record.with(observed),
            ..self.clone()
        }
    }
    fn effects(&self) -> Vec<Box<dyn Effect<Self>>> {
        Vec::new()
    }
}

/// An effect that rises and falls along the travel; by the middle of the travel it turns into another.
fn effect(name: &str, peak: f64) -> Tabulated {
    toml::from_str(&format!(
        "name = '{name}'\nsignature = [[0.0, 0.0], [{peak}, 1.0], [{}, 0.0], [1000.0, 0.0]]\nchannels = {{ 1A = 1.0, 2B = -1.0 }}",
        1.5 * peak
    ))
    .unwrap()
}

/// Lines with one of two effects in them.
fn readings(seed: u64) -> Lines {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let noise = SceneNoise {
        white: 0.05,
        ..SceneNoise::default()
    };
    let scene = Scene::random(40, 4, 3e-5, 0.0, noise, &mut random);
    let reversal = Linearised::new(&scene.measured(seed), Assumptions::default()).unwrap();
    let mut lines = Lines::new(&reversal);
    let change = Effect::<Lines>::columns(
        &effect("early", 60.0),
        &lines,
        &errsep_models::model::Shape::only(),
    );
    lines.record.observed += change[0].dense(lines.observed().len()) * 0.12;
    lines
}

fn diagnosed(lines: &Lines, names: &[(&str, f64)]) -> Diagnosis {
    let catalogue = names
        .iter()
        .map(|(name, peak)| Box::new(effect(name, *peak)) as Box<dyn Effect<Lines>>)
        .collect();
    let options = Options {
        draws: 200,
        ..Options::default()
    };
    diagnose_with(lines, catalogue, &options)
}

const TWO: [(&str, f64); 2] = [("early", 60.0), ("late", 100.0)];

/// Rounding of sums over a thousand readings, in figures of the size of one.
fn alike(a: &Diagnosis, b: &Diagnosis, scale: f64) {
    assert_eq!(a.verdict.kind, b.verdict.kind);
    assert_eq!(a.verdict.effects, b.verdict.effects);
    assert_eq!(a.verdict.indistinguishable, b.verdict.indistinguishable);
    let (gap, other) = (a.gap.before.rms * scale, b.gap.before.rms);
    assert!((gap - other).abs() < 1e-6 * gap, "{gap} {other}");
    for (one, two) in a.candidates.iter().zip(&b.candidates) {
        assert_eq!(one.effect, two.effect);
        assert!((one.explained - two.explained).abs() < 1e-6);
    }
}

#[test]
fn the_basis_and_the_gauge_of_the_freedom_do_not_matter() {
    for seed in 1..4 {
        let lines = readings(seed);
        let plain = diagnosed(&lines, &TWO);
        assert_eq!(
            plain.verdict.kind,
            Kind::Effect,
            "{}",
            plain.verdict.statement
        );
        assert_eq!(plain.verdict.effects, ["early"]);
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        // A random basis of the same columns and five columns more that lie in their span.
        let mix = DMatrix::from_fn(8, 13, |_, _| random.random::<f64>() - 0.5);
        let mut scaled = lines.freedom.clone();
        // The slopes in units of the offsets, or the mixture would be near singular.
        scaled.column_iter_mut().for_each(|mut c| c /= c.norm());
        let turned = Lines {
            freedom: scaled * mix,
            ..lines.clone()
        };
        alike(&plain, &diagnosed(&turned, &TWO), 1.0);
    }
}

#[test]
fn the_unit_of_the_readings_does_not_matter() {
    let lines = readings(5);
    let plain = diagnosed(&lines, &TWO);
    for scale in [1e3, 1e-3] {
        let scaled = lines.refit(lines.observed() * scale);
        alike(&plain, &diagnosed(&scaled, &TWO), scale);
    }
}

#[test]
fn an_effect_listed_twice_is_one_that_cannot_be_told_apart() {
    let lines = readings(6);
    let plain = diagnosed(&lines, &TWO);
    let twice = diagnosed(&lines, &[("early", 60.0), ("late", 100.0), ("again", 60.0)]);
    assert_eq!(plain.verdict.effects, ["early"]);
    assert_eq!(twice.verdict.kind, Kind::Effect);
    assert_eq!(twice.verdict.indistinguishable.len(), 1);
    let mut group = twice.verdict.indistinguishable[0].clone();
    group.sort();
    assert_eq!(group, ["again", "early"]);
    assert_eq!(twice.verdict.separate.len(), 1);
}

/// Single readings far out are pulled in and told; they neither make an effect nor hide one.
#[test]
fn single_spikes_neither_make_an_effect_nor_hide_one() {
    let mut lines = readings(7);
    let mut random = ChaCha8Rng::seed_from_u64(7);
    for _ in 0..12 {
        let trace = random.random_range(0..lines.traces().len());
        let range = lines.traces()[trace].clone();
        let k = random.random_range(range.start + 2..range.end - 2);
        // Forty standard deviations of the noise.
        lines.record.observed[k] += 2.0;
    }
    let diagnosis = diagnosed(&lines, &TWO);
    assert_eq!(
        diagnosis.verdict.effects,
        ["early"],
        "{}",
        diagnosis.verdict.statement
    );
    assert!(
        diagnosis
            .notes
            .iter()
            .any(|n| n.contains("single readings stand out"))
    );
    // k·u with k = 4, u = 0.05/√(2·1280) of the noise's own estimate, and what the pulled-in
    // readings keep: twelve of 1280 at four standard deviations.
    assert!(
        (diagnosis.gap.noise - 0.05).abs() < 0.008,
        "{}",
        diagnosis.gap.noise
    );
}
