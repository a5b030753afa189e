//! What is known of a variance: its mean and its own variance.

/// Mean and variance of a variance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moments {
    /// The mean.
    pub mean: f64,
    /// How far it is known.
    pub variance: f64,
    /// Degrees of freedom where it is known without doubt.
    pub most_freedom: f64,
}

impl Moments {
    /// The scale v and the degrees of freedom ν of the scaled inverse χ² law, v ν/χ², that has this mean and
    /// variance: what is normal with that variance divides by √v to Student's law with ν.
    pub fn student(&self) -> (f64, f64) {
        if !(self.variance > 0.0) {
            return (self.mean, self.most_freedom);
        }
        let freedom = 4.0 + 2.0 * self.mean * self.mean / self.variance;
        (self.mean * (freedom - 2.0) / freedom, freedom)
    }

    /// Of the sum of two variances that are known from independent values.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            mean: self.mean + other.mean,
            variance: self.variance.max(0.0) + other.variance.max(0.0),
            most_freedom: self.most_freedom + other.most_freedom,
        }
    }

    /// Of a variance that is this one, or with a probability the other.
    #[must_use]
    pub fn or(self, other: Self, probability: f64) -> Self {
        let mix = |own: f64, other: f64| (1.0 - probability) * own + probability * other;
        let apart = self.mean - other.mean;
        Self {
            mean: mix(self.mean, other.mean),
            variance: mix(self.variance.max(0.0), other.variance.max(0.0))
                + probability * (1.0 - probability) * apart * apart,
            most_freedom: mix(self.most_freedom, other.most_freedom),
        }
    }
}
