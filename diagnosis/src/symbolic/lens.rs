//! The whole grammar on its grid, seen in one space: every term's statistic at the cost of one product a block.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::detection::dictionary::surprise;
use crate::levels::{INVISIBLE, SEPARABLE};
use crate::symbolic::grammar::{Grammar, Term};
use crate::symbolic::view::View;

/// *Limit.* Sine, squared, below which two patterns are one: a hundredth of the change.
const ALIKE: f64 = 1e-4;
/// *Limit.* Shapes of a function at which patterns are told apart.
const EXAMINED: usize = 9;

/// A function at one shape of its grid.
struct Entry {
    kind: usize,
    shape: f64,
    /// Its first column.
    first: usize,
    order: usize,
    /// For each pattern of its kind GᵀG as seen, of the first column, of both, of the second; nothing where the
    /// model absorbs it.
    grams: Vec<Option<[f64; 3]>>,
}

/// The grammar in a view.
pub(super) struct Lens {
    entries: Vec<Entry>,
    /// Patterns of each kind that the model does not take for each other, the simplest of those that it does.
    pub patterns: Vec<Vec<usize>>,
    /// The blocks of each pattern with a weight other than zero.
    weights: Vec<Vec<(usize, f64)>>,
    /// The view's rows of each block.
    rows: Vec<Vec<usize>>,
    /// Values of every column at these rows.
    tables: Vec<DMatrix<f64>>,
}

/// A term of the grid with its statistic.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spot {
    pub term: Term,
    /// T.
    pub statistic: f64,
    /// −2 ln of its chi-squared tail.
    pub surprise: f64,
}

/// Products of every column with some vectors, block by block.
pub(super) struct Products(Vec<DMatrix<f64>>);

impl Lens {
    pub fn new(grammar: &Grammar, view: &View) -> Self {
        let count = grammar.blocks.iter().max().map_or(0, |b| b + 1);
        let mut rows = vec![Vec::new(); count];
        for (k, row) in view.rows.iter().enumerate() {
            rows[grammar.blocks[*row]].push(k);
        }
        let weights: Vec<Vec<(usize, f64)>> = grammar
            .patterns
            .iter()
            .map(|p| {
                let of = |b: usize| (b, p.weight(b));
                let seen = (0..count).filter(|b| !rows[*b].is_empty());
                seen.map(of).filter(|(_, w)| *w != 0.0).collect()
            })
            .collect();
        let mut entries = Vec::new();
        let mut columns = 0;
        for (kind, k) in grammar.kinds.iter().enumerate() {
            let order = k.function.order();
            for shape in k.function.grid(&grammar.coordinates[k.coordinate]) {
                entries.push(Entry {
                    kind,
                    shape,
                    first: columns,
                    order,
                    grams: Vec::new(),
                });
                columns += order;
            }
        }
        let mut tables: Vec<DMatrix<f64>> = rows
            .iter()
            .map(|r| DMatrix::zeros(r.len(), columns))
            .collect();
        for entry in &entries {
            let kind = &grammar.kinds[entry.kind];
            let c = &grammar.coordinates[kind.coordinate];
            for (table, own) in tables.iter_mut().zip(&rows) {
                for (k, row) in own.iter().enumerate() {
                    let u = c.values[view.rows[*row]];
                    let values = kind.function.at(c, entry.shape, u);
                    for j in 0..entry.order {
                        table[(k, entry.first + j)] = values[j];
                    }
                }
            }
        }
        let mut lens = Self {
            entries,
            patterns: Vec::new(),
            weights,
            rows,
            tables,
        };
        lens.measured(grammar, view);
        lens
    }

    /// Finds which patterns the model tells apart, and their squares.
    fn measured(&mut self, grammar: &Grammar, view: &View) {
        let grams: Vec<Gram> = self
            .entries
            .par_iter()
            .map(|entry| Gram::of(self, entry, view))
            .collect();
        let all: Vec<usize> = (0..self.weights.len()).collect();
        self.patterns = (0..grammar.kinds.len())
            .map(|kind| {
                let own: Vec<usize> = (0..self.entries.len())
                    .filter(|e| self.entries[*e].kind == kind)
                    .collect();
                // A step of the time is a constant of every channel that is read before it or after it.
                let each = own.len().div_ceil(EXAMINED).max(1);
                let examined = own.iter().skip(each / 2).step_by(each);
                let told: BTreeSet<usize> = examined
                    .flat_map(|entry| self.told_apart(&grams[*entry], &all))
                    .collect();
                told.into_iter().collect()
            })
            .collect();
        for (k, gram) in grams.iter().enumerate() {
            let kept = &self.patterns[self.entries[k].kind];
            let of = |p: &usize| gram.pattern(&self.weights[*p]);
            self.entries[k].grams = kept.iter().map(of).collect();
        }
    }

    fn told_apart(&self, gram: &Gram, patterns: &[usize]) -> Vec<usize> {
        let mut kept: Vec<usize> = Vec::new();
        for p in patterns {
            let own = &self.weights[*p];
            if gram.pattern(own).is_none() {
                continue;
            }
            let square = gram.product(own, own);
            let alike = |q: &usize| {
                let other = &self.weights[*q];
                let across = gram.product(own, other);
                let whole = square * gram.product(other, other);
                across * across > (1.0 - ALIKE) * whole
            };
            if !kept.iter().any(alike) {
                kept.push(*p);
            }
        }
        kept
    }

    /// Number of different forms of one term.
    pub fn forms(&self) -> usize {
        self.patterns.iter().map(Vec::len).sum()
    }

    /// ln of the prior probability of a law's form: one term and two are as probable, and so are the classes of forms of
    /// a term, by the number of its parameters and whether its pattern is plain (all channels alike or one alone,
    /// whatever the direction); all forms of a class are. What is simple is thereby the likelier.
    pub fn prior(&self, grammar: &Grammar, terms: &[Term]) -> f64 {
        let class = |kind: usize, pattern: usize| {
            let parameters = grammar.kinds[kind].function.parameters();
            (parameters, grammar.patterns[pattern].is_simple())
        };
        let mut forms: BTreeMap<(usize, bool), f64> = BTreeMap::new();
        for (kind, patterns) in self.patterns.iter().enumerate() {
            for pattern in patterns {
                *forms.entry(class(kind, *pattern)).or_default() += 1.0;
            }
        }
        let of = |term: &Term| {
            let own = forms.get(&class(term.kind, term.pattern));
            own.copied().unwrap_or(1.0).ln() + (forms.len().max(1) as f64).ln()
        };
        let all: f64 = terms.iter().map(of).sum();
        // Of two terms either may be the first.
        match terms.len() {
            1 => -all - 2f64.ln(),
            _ => -all,
        }
    }

    /// Products with whitened, projected vectors of the view, one a column.
    pub fn products(&self, view: &View, vectors: DMatrix<f64>) -> Products {
        let adjoint = view.space.adjoint(vectors);
        let of =
            |(rows, table): (&Vec<usize>, &DMatrix<f64>)| table.tr_mul(&adjoint.select_rows(rows));
        Products(self.rows.iter().zip(&self.tables).map(of).collect())
    }

    /// The sum of a pattern over products by block.
    fn product(&self, blocks: &[[f64; 2]], pattern: usize) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for (block, weight) in &self.weights[pattern] {
            sums[0] += weight * blocks[*block][0];
            sums[1] += weight * blocks[*block][1];
        }
        sums
    }

    /// Goes through all terms of the grid with their statistic in one vector, beside others of unit length that
    /// it is orthogonal to.
    fn each(
        &self,
        products: &Products,
        vector: usize,
        beside: &[usize],
        mut found: impl FnMut(&Entry, usize, f64),
    ) {
        let count = products.0.len();
        // Of the vector, then of those beside it.
        let mut blocks = vec![[0.0; 2]; count * (1 + beside.len())];
        for entry in &self.entries {
            for (slot, k) in std::iter::once(&vector).chain(beside).enumerate() {
                for (block, own) in products.0.iter().enumerate() {
                    let second = if entry.order > 1 {
                        own[(entry.first + 1, *k)]
                    } else {
                        0.0
                    };
                    blocks[slot * count + block] = [own[(entry.first, *k)], second];
                }
            }
            let (own, others) = blocks.split_at(count);
            for (pattern, gram) in self.patterns[entry.kind].iter().zip(&entry.grams) {
                let Some(mut g) = *gram else { continue };
                let whole = g[0] + g[2];
                for other in others.chunks(count) {
                    let c = self.product(other, *pattern);
                    g[0] -= c[0] * c[0];
                    g[1] -= c[0] * c[1];
                    g[2] -= c[1] * c[1];
                }
                if g[0] + g[2] < SEPARABLE * whole {
                    continue;
                }
                let s = self.product(own, *pattern);
                let t = if entry.order == 1 {
                    s[0] * s[0] / g[0]
                } else {
                    let determinant = g[0] * g[2] - g[1] * g[1];
                    if determinant <= 1e-6 * g[0] * g[2] {
                        continue;
                    }
                    (s[0] * s[0] * g[2] - 2.0 * s[0] * s[1] * g[1] + s[1] * s[1] * g[0])
                        / determinant
                };
                found(entry, *pattern, t);
            }
        }
    }

    /// The greatest statistic of one and of two amplitudes, each with its term.
    pub fn greatest(
        &self,
        products: &Products,
        vector: usize,
        beside: &[usize],
    ) -> [Option<Spot>; 2] {
        let mut most: [Option<Spot>; 2] = [None, None];
        self.each(products, vector, beside, |entry, pattern, statistic| {
            let own = &mut most[entry.order - 1];
            if own.is_none_or(|m| statistic > m.statistic) {
                *own = Some(spot(entry, pattern, statistic));
            }
        });
        most.map(|m| m.map(Spot::judged))
    }

    /// The best shape of every form, the greatest surprise first.
    pub fn forms_by_surprise(
        &self,
        products: &Products,
        vector: usize,
        beside: &[usize],
    ) -> Vec<Spot> {
        let patterns = self.weights.len();
        let mut best: Vec<Option<Spot>> = vec![None; self.patterns.len() * patterns];
        self.each(products, vector, beside, |entry, pattern, statistic| {
            let own = &mut best[entry.kind * patterns + pattern];
            if own.is_none_or(|m| statistic > m.statistic) {
                *own = Some(spot(entry, pattern, statistic));
            }
        });
        let mut all: Vec<Spot> = best.into_iter().flatten().map(Spot::judged).collect();
        all.sort_by(|a, b| b.surprise.total_cmp(&a.surprise));
        all
    }
}

fn spot(entry: &Entry, pattern: usize, statistic: f64) -> Spot {
    Spot {
        term: Term {
            kind: entry.kind,
            pattern,
            shape: entry.shape,
        },
        statistic,
        surprise: entry.order as f64,
    }
}

impl Spot {
    /// With its surprise in place of its number of amplitudes.
    fn judged(self) -> Self {
        Self {
            surprise: surprise(self.statistic, self.surprise as usize),
            ..self
        }
    }
}

/// Products of the seen columns of one entry in every block, and of their whitened lengths.
struct Gram {
    /// (block · order + column), squared.
    seen: DMatrix<f64>,
    whole: Vec<f64>,
    order: usize,
}

impl Gram {
    fn of(lens: &Lens, entry: &Entry, view: &View) -> Self {
        let (blocks, order) = (lens.rows.len(), entry.order);
        let mut columns = DMatrix::zeros(view.rows.len(), blocks * order);
        for block in 0..blocks {
            for (k, row) in lens.rows[block].iter().enumerate() {
                for j in 0..order {
                    columns[(*row, block * order + j)] = lens.tables[block][(k, entry.first + j)];
                }
            }
        }
        let (seen, sizes) = view.space.forward(columns);
        Self {
            seen: seen.tr_mul(&seen),
            whole: sizes.iter().map(|s| s * s).collect(),
            order,
        }
    }

    /// Sum over the columns of the product of two patterns.
    fn product(&self, a: &[(usize, f64)], b: &[(usize, f64)]) -> f64 {
        (0..self.order).map(|j| self.columns(a, j, b, j)).sum()
    }

    fn columns(&self, a: &[(usize, f64)], i: usize, b: &[(usize, f64)], j: usize) -> f64 {
        let mut sum = 0.0;
        for (p, v) in a {
            for (q, w) in b {
                sum += v * w * self.seen[(p * self.order + i, q * self.order + j)];
            }
        }
        sum
    }

    fn pattern(&self, weights: &[(usize, f64)]) -> Option<[f64; 3]> {
        let last = self.order - 1;
        let first = self.columns(weights, 0, weights, 0);
        let both = if last > 0 {
            self.columns(weights, 0, weights, 1)
        } else {
            0.0
        };
        let second = if last > 0 {
            self.columns(weights, 1, weights, 1)
        } else {
            0.0
        };
        let whole: f64 = weights
            .iter()
            .flat_map(|(b, w)| (0..self.order).map(move |j| (b * self.order + j, w * w)))
            .map(|(k, square)| square * self.whole[k])
            .sum();
        (first + second > INVISIBLE * whole).then_some([first, both, second])
    }
}

/// An orthonormal basis of seen columns.
pub(super) fn unit(seen: &DMatrix<f64>) -> DMatrix<f64> {
    let sizes: Vec<f64> = seen.column_iter().map(|c| c.norm()).collect();
    crate::detection::basis::orthonormal(seen, &sizes)
}

/// A vector less its parts along unit vectors.
pub(super) fn beside(vector: &DVector<f64>, basis: &DMatrix<f64>) -> DVector<f64> {
    vector - basis * basis.tr_mul(vector)
}
