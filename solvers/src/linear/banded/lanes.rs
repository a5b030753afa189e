//! Loops over eight lanes which the compiler turns into vector instructions, and the choice of the
//! instruction set at run time.

/// Number of doubles handled together; columns are padded with zeros to a multiple of it.
pub const LANES: usize = 8;

/// A column whose sum of squares is below this is zero: its reflection would divide by a number
/// that has underflowed.
pub const NEGLIGIBLE_SQUARE: f64 = 1e-280;

/// a·b + c, with one rounding where the instruction set has it.
#[inline(always)]
pub fn multiply_add<const FMA: bool>(a: f64, b: f64, c: f64) -> f64 {
    if FMA { a.mul_add(b, c) } else { a * b + c }
}

/// The sum of the lanes.
#[inline(always)]
pub fn sum(lanes: [f64; LANES]) -> f64 {
    ((lanes[0] + lanes[4]) + (lanes[2] + lanes[6]))
        + ((lanes[1] + lanes[5]) + (lanes[3] + lanes[7]))
}

/// vᵀv; the length is a multiple of [`LANES`].
#[inline(always)]
pub fn norm_squared<const FMA: bool>(v: &[f64]) -> f64 {
    let mut lanes = [0.0; LANES];
    for chunk in v.as_chunks::<LANES>().0 {
        for l in 0..LANES {
            lanes[l] = multiply_add::<FMA>(chunk[l], chunk[l], lanes[l]);
        }
    }
    sum(lanes)
}
