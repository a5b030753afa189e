//! Effects that each indicator has by its own amount: which indicators a variant is of.

use super::FirstOrder;
use crate::model::{Column, FittedModel, Parameter};

/// Both indicators, each by its own amount.
pub(super) const BOTH: usize = 0;
/// The near indicator alone.
pub(super) const NEAR: usize = 1;
/// The far indicator alone.
pub(super) const FAR: usize = 2;
/// Number of these; the variant of an effect is one of them and a multiple of this.
pub(super) const SCOPES: usize = 3;

/// The scopes that the readings can show, the fullest first.
pub(super) fn scopes(model: &FirstOrder) -> &'static [usize] {
    let has = |sign: f64| model.present().iter().any(|c| c.indicator_sign() == sign);
    match (has(1.0), has(-1.0)) {
        (true, true) => &[BOTH, NEAR, FAR],
        (true, false) => &[NEAR],
        (false, _) => &[FAR],
    }
}

/// The signs of the indicators that a variant is of.
pub(super) fn signs(variant: usize) -> &'static [f64] {
    match variant % SCOPES {
        BOTH => &[1.0, -1.0],
        NEAR => &[1.0],
        _ => &[-1.0],
    }
}

/// A signature in all readings, taken apart into one for each indicator that a variant is of.
pub(super) fn apart(model: &FirstOrder, variant: usize, whole: &Column) -> Vec<Column> {
    let of = |sign: &f64| {
        let (rows, values) = whole
            .rows
            .iter()
            .zip(&whole.values)
            .filter(|(row, _)| model.channel(&model.places()[**row]).indicator_sign() == *sign)
            .unzip();
        Column { rows, values }
    };
    signs(variant).iter().map(of).collect()
}

/// The amplitudes of a variant, by their names for one indicator alone, the near and the far.
pub(super) fn sizes(variant: usize, names: [&'static str; 3], like: &Parameter) -> Vec<Parameter> {
    let [alone, near, far] = names;
    let chosen: &[&'static str] = match variant % SCOPES {
        BOTH => &[near, far],
        _ => &[alone],
    };
    let named = |name: &&'static str| Parameter { name, ..*like };
    chosen.iter().map(named).collect()
}

/// The scope in words.
pub(super) fn words(variant: usize) -> &'static str {
    match variant % SCOPES {
        BOTH => "both indicators, each by its own amount",
        NEAR => "near indicator",
        _ => "far indicator",
    }
}

/// The scopes other than a variant's own, with what else the variant says kept.
pub(super) fn others(model: &FirstOrder, variant: usize) -> impl Iterator<Item = usize> {
    let kind = variant - variant % SCOPES;
    let scopes = scopes(model).iter().map(move |scope| kind + scope);
    scopes.filter(move |other| *other != variant)
}
