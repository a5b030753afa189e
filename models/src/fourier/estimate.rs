//! Coefficients of all orders with their covariance, from joined scans and the steps at their joints.

use super::along::Along;
use super::group::{Group, group, information};
use super::joint::{Joint, ShiftTerm, join, sum_of};
use super::result::{Combination, JointStep, OrderResult};
use super::scan::{FourierError, Scan, Section};
use super::spectrum::profile;
use super::spread::Spread;
use super::steps::{Steps, fit_steps};
use super::transfer::{LOST_BELOW, determinant};
use realfft::num_complex::Complex64;

/// Scans whose P2 and P3 are joined.
#[derive(Debug, Clone)]
pub(super) struct Joined<'a> {
    pub scans: &'a [Scan],
    pub joints: Vec<Joint>,
    pub groups: Vec<Group>,
    /// Of each scan, orders 0 to (N − 1)/2.
    pub spectra: Vec<Vec<Complex64>>,
    /// Readings on the section in the first scan; the profile is given there.
    pub samples: usize,
}

/// Where the step at the joint of each scan comes from.
#[derive(Debug, Clone)]
pub(super) enum Taken {
    /// The fit, one a group.
    Fitted(Steps),
    /// A weighted sum of readings of each scan; of none: no step is taken out.
    Readings(Vec<Vec<ShiftTerm>>),
}

/// The result of a combination.
#[derive(Debug, Clone)]
pub(super) struct Profiled {
    /// Orders 1, 2, … without their uncertainties.
    pub orders: Vec<OrderResult>,
    /// Their covariance for unit noise of a reading.
    pub spread: Spread,
    /// What the mean of P1 over the scans of the first length passes into each order.
    pub through_first: Vec<Complex64>,
    /// Step that was taken out of the mean of each group, µm.
    pub taken: Vec<f64>,
    /// Workpiece on the section, µm.
    pub workpiece: Vec<f64>,
}

impl<'a> Joined<'a> {
    /// Joins and groups the scans.
    ///
    /// # Errors
    /// Those of [`join`], and [`FourierError::NoScan`].
    pub fn new(scans: &'a [Scan], section: Section) -> Result<Self, FourierError> {
        let joints: Vec<Joint> = scans
            .iter()
            .map(|scan| join(scan, section))
            .collect::<Result<_, _>>()?;
        let samples = joints
            .first()
            .map(|j| j.difference.len())
            .ok_or(FourierError::NoScan)?;
        let (groups, spectra) = group(scans, &joints, section);
        Ok(Self {
            scans,
            joints,
            groups,
            spectra,
            samples,
        })
    }

    /// Root mean square of the difference signals, µm.
    pub fn size(&self) -> f64 {
        let (mut sum, mut count) = (0.0, 0usize);
        for joint in &self.joints {
            sum += joint.difference.iter().map(|v| v * v).sum::<f64>();
            count += joint.difference.len();
        }
        (sum / count.max(1) as f64).sqrt()
    }

    /// The steps by all spacings together, or for the hybrid method by each spacing alone, as its
    /// candidates are; nothing where the form kept takes a step over.
    pub fn fitted(&self, section: Section, combination: Combination) -> Option<Steps> {
        let highest = self.groups.iter().map(Group::highest).max().unwrap_or(0);
        let fit = |groups: &[Group]| {
            Some(fit_steps(groups, section.orders, highest))
                .filter(|steps| steps.rank == steps.unknowns)
        };
        if combination == Combination::LeastSquares {
            return fit(&self.groups);
        }
        let mut all = Steps::none(self.groups.len());
        for (place, g) in self.groups.iter().enumerate() {
            all.insert(place, &fit(std::slice::from_ref(g))?);
        }
        Some(all)
    }

    /// Variance of the steps over that of white noise.
    pub fn steps_under(&self, along: Option<&Along>, taken: &Taken) -> f64 {
        match (along, taken) {
            (None, _) => 1.0,
            (Some(along), Taken::Readings(_)) => along.of_reading(),
            (Some(along), Taken::Fitted(_)) => {
                let each = self.groups.iter().filter(|g| g.has_step());
                each.map(|g| along.of_step(g)).fold(1.0, f64::max)
            }
        }
    }

    /// Fitted steps of the spacings that have a third probe, for unit noise.
    pub fn steps_of_fit(&self, fitted: &Steps) -> Vec<JointStep> {
        let of = |(place, g): (usize, &Group)| {
            g.has_step().then_some(())?;
            Some(JointStep {
                spacing: g.spacing,
                value: *fitted.values.get(place)?,
                std: fitted.std(place),
            })
        };
        self.groups.iter().enumerate().filter_map(of).collect()
    }

    /// Steps by the readings at the joints of the spacings that have a third probe, for unit noise;
    /// none where a joint was not read.
    pub fn steps_of_readings(
        &self,
        terms: Result<&[Vec<ShiftTerm>], &FourierError>,
    ) -> Vec<JointStep> {
        let Ok(terms) = terms else {
            return Vec::new();
        };
        let of = |g: &Group| {
            g.has_step().then_some(())?;
            let own = terms.get(*g.scans.first()?)?;
            let squares: f64 = own.iter().map(|t| t.weight * t.weight).sum();
            Some(JointStep {
                spacing: g.spacing,
                value: self.mean_of(g, terms),
                std: (squares / g.repeats()).sqrt(),
            })
        };
        self.groups.iter().filter_map(of).collect()
    }

    /// Mean over the repeats of a group of the weighted sums of readings.
    fn mean_of(&self, g: &Group, terms: &[Vec<ShiftTerm>]) -> f64 {
        let sums = g
            .scans
            .iter()
            .filter_map(|&i| Some(sum_of(self.scans.get(i)?, terms.get(i)?)));
        sums.sum::<f64>() / g.repeats()
    }

    /// Combines the scans.
    pub fn profile(&self, section: Section, combination: Combination, taken: &Taken) -> Profiled {
        let groups = &self.groups;
        let steps: Vec<f64> = match taken {
            Taken::Fitted(steps) => steps.values.clone(),
            Taken::Readings(terms) => groups.iter().map(|g| self.mean_of(g, terms)).collect(),
        };
        let nothing = vec![Complex64::default(); section.orders];
        // What a mean difference signal of one at an order adds to the coefficient.
        let mut shares = vec![nothing.clone(); groups.len()];
        let mut own = Vec::with_capacity(section.orders);
        let mut orders = Vec::with_capacity(section.orders);
        for place in 0..section.orders {
            let (mut result, spacing) = self.order(section, place + 1);
            let used = |g: &Group| combination == Combination::LeastSquares || g.spacing == spacing;
            let known = information(groups, result.order, used).filter(|_| !result.lost);
            own.push(known.map_or(0.0, f64::recip));
            if let Some(known) = known {
                result.gain = (self.samples as f64 / known).sqrt();
                for ((g, &step), share) in groups.iter().zip(&steps).zip(&mut shares) {
                    let signal = g.without_step(result.order, step);
                    if let (true, Some(signal), Some(passed), Some(share)) = (
                        used(g),
                        signal,
                        g.transfer.get(result.order),
                        share.get_mut(place),
                    ) {
                        *share = g.weight() * passed.conj() / known;
                        result.coefficient += *share * signal;
                    }
                }
            }
            orders.push(result);
        }
        let mut spread = Spread::new(own);
        let through: Vec<Vec<Complex64>> = groups
            .iter()
            .zip(&shares)
            .map(|(g, share)| {
                let step = g.step.iter().skip(1);
                share.iter().zip(step).map(|(s, h)| s * h).collect()
            })
            .collect();
        match taken {
            Taken::Fitted(steps) => {
                for root in &steps.roots {
                    let mut response = nothing.clone();
                    for (amount, through) in root.iter().zip(&through) {
                        for (sum, value) in response.iter_mut().zip(through) {
                            *sum += *amount * value;
                        }
                    }
                    spread.add(1.0, response);
                }
            }
            Taken::Readings(terms) => {
                for ((g, share), through) in groups.iter().zip(&shares).zip(&through) {
                    let own = g.scans.first().and_then(|&i| terms.get(i));
                    spread.add_readings(g, own.map_or(&[][..], Vec::as_slice), share, through);
                }
            }
        }
        let mut through_first = nothing;
        for (_, share) in groups
            .iter()
            .zip(&shares)
            .filter(|(g, _)| g.samples == self.samples)
        {
            for (sum, value) in through_first.iter_mut().zip(share) {
                *sum += value;
            }
        }
        let mut series = vec![Complex64::default()];
        series.extend(orders.iter().map(|o| o.coefficient));
        Profiled {
            workpiece: profile(&series, self.samples),
            orders,
            spread,
            through_first,
            taken: steps,
        }
    }

    /// What the scans pass of an order, and the spacing that passes most.
    fn order(&self, section: Section, order: usize) -> (OrderResult, f64) {
        let determinants: Vec<f64> = self
            .scans
            .iter()
            .map(|s| determinant(s.spacing, section.length, order))
            .collect();
        let (best_scan, greatest) = determinants.iter().copied().enumerate().fold(
            (0, f64::NEG_INFINITY),
            |best, (i, value)| {
                if value > best.1 { (i, value) } else { best }
            },
        );
        let spacing = self.scans.get(best_scan).map_or(f64::NAN, |s| s.spacing);
        let result = OrderResult {
            order,
            determinants,
            best_scan,
            gain: 0.0,
            coefficient: Complex64::default(),
            real_std: 0.0,
            imaginary_std: 0.0,
            covariance: 0.0,
            lost: greatest < LOST_BELOW,
        };
        (result, spacing)
    }
}
