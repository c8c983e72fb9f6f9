//! How sure a share or a count is: 95 % intervals.

use skyway_contract::Share;

/// The 97.5th percentile of the standard normal distribution.
const Z: f64 = 1.959_963_984_540_054;
/// What lies outside on either side.
const TAIL: f64 = 0.025;
/// Above this count the quantile is taken from Wilson and Hilferty's approximation, which is then right to 7 digits.
const EXACT_MAX: u64 = 100_000;
/// Halvings of an interval: more than a double has bits.
const HALVINGS: u32 = 80;

/// A share with its 95 % interval (Wilson's score, 1927). A count above `of` counts as `of`; of none, the share is 0 and its
/// interval all there is.
pub fn wilson(count: u64, of: u64) -> Share {
    let count = count.min(of);
    if of == 0 {
        return Share {
            count,
            of,
            fraction: 0.0,
            low_fraction: 0.0,
            high_fraction: 1.0,
        };
    }
    let n = of as f64;
    let fraction = count as f64 / n;
    let z2 = Z * Z;
    let centre = (fraction + z2 / (2.0 * n)) / (1.0 + z2 / n);
    let spread = fraction * (1.0 - fraction) / n + z2 / (4.0 * n * n);
    let half = Z * spread.sqrt() / (1.0 + z2 / n);
    // At the ends the formula gives 0 and 1, but for the rounding.
    let low = if count == 0 { 0.0 } else { centre - half };
    let high = if count == of { 1.0 } else { centre + half };
    Share {
        count,
        of,
        fraction,
        low_fraction: low.clamp(0.0, fraction),
        high_fraction: high.clamp(fraction, 1.0),
    }
}

/// The exact 95 % interval of the mean of a Poisson count (Garwood 1936): halves of chi-square quantiles, of 2.5 % with
/// twice the count degrees of freedom, and of 97.5 % with two more.
pub fn poisson_interval(count: u64) -> (f64, f64) {
    let low = if count == 0 {
        0.0
    } else {
        chi_square_quantile(TAIL, count) / 2.0
    };
    (low, chi_square_quantile(1.0 - TAIL, count + 1) / 2.0)
}

/// The quantile of the chi-square distribution with `2 * half_degrees` degrees of freedom, `half_degrees` at least 1.
fn chi_square_quantile(probability: f64, half_degrees: u64) -> f64 {
    let shape = half_degrees as f64;
    let guess = 2.0 * wilson_hilferty(probability, shape);
    if half_degrees > EXACT_MAX {
        return guess;
    }
    // The distribution function rises, so the quantile is between two arguments that it divides.
    let (mut low, mut high) = (0.0, shape + 10.0 * shape.sqrt() + 50.0);
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(low, high);
        if lower_gamma(shape, middle) < probability {
            low = middle;
        } else {
            high = middle;
        }
    }
    2.0 * f64::midpoint(low, high)
}

/// The quantile of the gamma distribution with scale 1, nearly (Wilson and Hilferty 1931). Only for the two tails.
fn wilson_hilferty(probability: f64, shape: f64) -> f64 {
    let z = if probability < 0.5 { -Z } else { Z };
    let ninth = 1.0 / (9.0 * shape);
    shape * (1.0 - ninth + z * ninth.sqrt()).powi(3)
}

/// The regularized lower incomplete gamma function P(shape, x) of a whole shape: the series below the mean, the continued
/// fraction of its complement above (Abramowitz and Stegun 6.5.29, 6.5.31).
fn lower_gamma(shape: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    let scale = (shape * x.ln() - x - ln_gamma(shape)).exp();
    if x < shape + 1.0 {
        let mut term = 1.0 / shape;
        let mut sum = term;
        let mut denominator = shape;
        while term > sum * f64::EPSILON {
            denominator += 1.0;
            term *= x / denominator;
            sum += term;
        }
        return scale * sum;
    }
    1.0 - scale * upper_fraction(shape, x)
}

/// The continued fraction, from its beginning on (Lentz 1976).
fn upper_fraction(shape: f64, x: f64) -> f64 {
    const TINY: f64 = 1e-300;
    const STEPS_MAX: u32 = 100_000;
    let mut b = x + 1.0 - shape;
    let mut c = 1.0 / TINY;
    let mut d = 1.0 / b;
    let mut fraction = d;
    for step in 1..STEPS_MAX {
        let a = f64::from(step) * (shape - f64::from(step));
        b += 2.0;
        d = 1.0 / nonzero(a * d + b, TINY);
        c = nonzero(b + a / c, TINY);
        let factor = c * d;
        fraction *= factor;
        if (factor - 1.0).abs() < f64::EPSILON {
            break;
        }
    }
    fraction
}

fn nonzero(value: f64, tiny: f64) -> f64 {
    if value.abs() < tiny { tiny } else { value }
}

/// The logarithm of the gamma function at 1 or above: Stirling's series, from 10 on, and down by the recurrence
/// (Abramowitz and Stegun 6.1.41).
fn ln_gamma(x: f64) -> f64 {
    let mut shifted = x;
    let mut product = 1.0;
    while shifted < 10.0 {
        product *= shifted;
        shifted += 1.0;
    }
    let inverse = 1.0 / shifted;
    let square = inverse * inverse;
    let series =
        inverse * (1.0 / 12.0 - square * (1.0 / 360.0 - square * (1.0 / 1260.0 - square / 1680.0)));
    let half_ln_tau = 0.918_938_533_204_672_8;
    (shifted - 0.5) * shifted.ln() - shifted + half_ln_tau + series - f64::ln(product)
}

#[cfg(test)]
mod tests {
    use super::{EXACT_MAX, chi_square_quantile, poisson_interval, wilson, wilson_hilferty};

    fn near(found: f64, expected: f64, tolerance: f64) {
        let is_near = (found - expected).abs() <= tolerance;
        assert!(is_near, "{found} is not {expected}");
    }

    /// Agresti and Coull (1998) and the common table of Wilson intervals.
    #[test]
    fn wilson_as_published() {
        let cases = [
            (0, 10, 0.0, 0.277_532_799),
            (5, 10, 0.236_593_1, 0.763_406_9),
            (10, 10, 0.722_467_2, 1.0),
            (81, 263, 0.255_289_1, 0.366_184_2),
        ];
        for (count, of, low, high) in cases {
            let share = wilson(count, of);
            near(share.low_fraction, low, 3e-5);
            near(share.high_fraction, high, 3e-5);
        }
    }

    #[test]
    fn of_none_nothing_is_known() {
        let share = wilson(0, 0);
        assert_eq!(
            (share.fraction, share.low_fraction, share.high_fraction),
            (0.0, 0.0, 1.0)
        );
        assert_eq!(wilson(9, 4).count, 4);
    }

    /// Ulm (1990), and Garwood's table.
    #[test]
    fn poisson_as_published() {
        let cases = [
            (0, 0.0, 3.689),
            (1, 0.025, 5.572),
            (2, 0.242, 7.225),
            (3, 0.619, 8.767),
            (5, 1.623, 11.668),
            (10, 4.795, 18.390),
            (20, 12.217, 30.888),
            (30, 20.241, 42.827),
            (50, 37.111, 65.919),
            (100, 81.364, 121.627),
        ];
        for (count, low, high) in cases {
            let interval = poisson_interval(count);
            near(interval.0, low, 6e-4);
            near(interval.1, high, 6e-4);
        }
    }

    #[test]
    fn quantiles_as_published() {
        near(chi_square_quantile(0.975, 1), 7.377_759, 1e-6);
        near(chi_square_quantile(0.025, 1), 0.050_636, 1e-6);
        near(chi_square_quantile(0.975, 5), 20.483_177, 1e-6);
        near(chi_square_quantile(0.025, 50), 74.221_927, 1e-6);
        near(chi_square_quantile(0.975, 50), 129.561_197, 1e-6);
    }

    #[test]
    fn where_the_approximation_begins_nothing_jumps() {
        for probability in [0.025, 0.975] {
            let exact = chi_square_quantile(probability, EXACT_MAX);
            let approximate = 2.0 * wilson_hilferty(probability, EXACT_MAX as f64);
            near(approximate / exact, 1.0, 1e-7);
        }
        let (low, high) = poisson_interval(u64::MAX - 1);
        assert!(low < high && high.is_finite());
    }
}
