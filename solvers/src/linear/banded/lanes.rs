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

#[inline(always)]
fn sum(lanes: [f64; LANES]) -> f64 {
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

/// (vᵀa, vᵀb, vᵀc, vᵀd) of four columns that lie `stride` apart in `columns`.
#[inline(always)]
pub fn dot_four<const FMA: bool>(v: &[f64], columns: &[f64], stride: usize) -> [f64; 4] {
    let length = v.len();
    let of = |j: usize| {
        columns[j * stride..j * stride + length]
            .as_chunks::<LANES>()
            .0
    };
    let (a, b, c, d) = (of(0), of(1), of(2), of(3));
    let v = v.as_chunks::<LANES>().0;
    let mut lanes = [[0.0; LANES]; 4];
    for ((((v, a), b), c), d) in v.iter().zip(a).zip(b).zip(c).zip(d) {
        for l in 0..LANES {
            lanes[0][l] = multiply_add::<FMA>(v[l], a[l], lanes[0][l]);
            lanes[1][l] = multiply_add::<FMA>(v[l], b[l], lanes[1][l]);
            lanes[2][l] = multiply_add::<FMA>(v[l], c[l], lanes[2][l]);
            lanes[3][l] = multiply_add::<FMA>(v[l], d[l], lanes[3][l]);
        }
    }
    lanes.map(sum)
}

/// vᵀa.
#[inline(always)]
pub fn dot<const FMA: bool>(v: &[f64], a: &[f64]) -> f64 {
    let mut lanes = [0.0; LANES];
    for (v, a) in v
        .as_chunks::<LANES>()
        .0
        .iter()
        .zip(a.as_chunks::<LANES>().0)
    {
        for l in 0..LANES {
            lanes[l] = multiply_add::<FMA>(v[l], a[l], lanes[l]);
        }
    }
    sum(lanes)
}

/// y ← y + f·v.
#[inline(always)]
pub fn add_scaled<const FMA: bool>(y: &mut [f64], f: f64, v: &[f64]) {
    for (y, v) in y.iter_mut().zip(v) {
        *y = multiply_add::<FMA>(f, *v, *y);
    }
}
