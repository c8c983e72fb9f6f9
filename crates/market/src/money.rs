//! Currencies and their smallest coins.

use rust_decimal::{Decimal, RoundingStrategy};

/// Currencies without a minor unit (ISO 4217, table A.1).
const WHOLE: [&str; 17] = [
    "BIF", "CLP", "DJF", "GNF", "ISK", "JPY", "KMF", "KRW", "PYG", "RWF", "UGX", "UYI", "VND",
    "VUV", "XAF", "XOF", "XPF",
];
/// Currencies whose minor unit is a thousandth (ISO 4217, table A.1).
const THOUSANDTHS: [&str; 7] = ["BHD", "IQD", "JOD", "KWD", "LYD", "OMR", "TND"];

/// Whether a text is the code of a currency by its form: three capital letters.
pub fn is_currency(code: &str) -> bool {
    code.len() == 3 && code.bytes().all(|letter| letter.is_ascii_uppercase())
}

/// How many decimals amounts of a currency have: 2 for most (ISO 4217, table A.1).
pub fn minor_digits(currency: &str) -> u32 {
    if WHOLE.contains(&currency) {
        return 0;
    }
    if THOUSANDTHS.contains(&currency) {
        return 3;
    }
    2
}

/// An amount rounded half up to the minor unit of its currency, and written with all its decimals.
pub fn rounded(amount: Decimal, currency: &str) -> Decimal {
    let digits = minor_digits(currency);
    let mut amount = amount.round_dp_with_strategy(digits, RoundingStrategy::MidpointAwayFromZero);
    amount.rescale(digits);
    amount
}

#[cfg(test)]
mod tests {
    use super::{is_currency, rounded};
    use rust_decimal::Decimal;

    #[test]
    fn halves_go_up_to_the_minor_unit() {
        let cases = [
            ("12.345", "AUD", "12.35"),
            ("12.344999", "AUD", "12.34"),
            ("12.5", "JPY", "13"),
            ("12.49", "XPF", "12"),
            ("1.00050", "KWD", "1.001"),
            ("7", "EUR", "7.00"),
        ];
        for (amount, currency, expected) in cases {
            let amount: Decimal = amount.parse().unwrap();
            assert_eq!(rounded(amount, currency).to_string(), expected);
        }
    }

    #[test]
    fn codes_are_three_capitals() {
        assert!(is_currency("AUD"));
        for wrong in ["", "AU", "aud", "AUDX", "A1D", "ÄUD"] {
            assert!(!is_currency(wrong), "{wrong}");
        }
    }
}
