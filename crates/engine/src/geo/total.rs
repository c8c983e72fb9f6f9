//! Sums of lengths.

/// The sum of lengths, in metres. The standard library's sum of nothing is -0, which JSON would tell as `-0.0`.
pub fn total_m(lengths_m: impl Iterator<Item = f64>) -> f64 {
    lengths_m.fold(0.0, |sum_m, length_m| sum_m + length_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sum_of_nothing_is_not_negative() {
        assert!(total_m(std::iter::empty()).is_sign_positive());
        assert_eq!(total_m([1.0, 2.5].into_iter()), 3.5);
    }
}
