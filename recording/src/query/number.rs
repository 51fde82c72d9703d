//! Numbers as C++ streams write them.

use std::fmt::{self, Display, Formatter};

/// Significant digits.
const DIGITS: i32 = 6;

/// A number as `%g` writes it: six significant digits, without trailing zeros.
///
/// Values of single precision are widened first, as C++ does.
#[derive(Clone, Copy, Debug)]
pub struct Number(pub f64);

impl From<f32> for Number {
    fn from(value: f32) -> Self {
        Self(f64::from(value))
    }
}

impl Display for Number {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self(value) = *self;
        if !value.is_finite() {
            let sign = if value.is_sign_negative() { "-" } else { "" };
            return write!(f, "{sign}{}", if value.is_nan() { "nan" } else { "inf" });
        }
        // Rounded before the exponent is looked at: 999999.5 is 1e+06.
        let scientific = format!("{value:.*e}", (DIGITS - 1) as usize);
        let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
        let exponent: i32 = exponent.parse().unwrap_or(0);
        if (-4..DIGITS).contains(&exponent) {
            let fixed = format!("{value:.*}", (DIGITS - 1 - exponent) as usize);
            f.write_str(without_zeros(&fixed))
        } else {
            let sign = if exponent < 0 { '-' } else { '+' };
            write!(f, "{}e{sign}{:02}", without_zeros(mantissa), exponent.abs())
        }
    }
}

fn without_zeros(text: &str) -> &str {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_c() {
        // As printf("%g") of glibc has them.
        let expected = [
            (0.0, "0"),
            (-0.0, "-0"),
            (1.0, "1"),
            (-17_219.7, "-17219.7"),
            (24.723_7, "24.7237"),
            (1.5e6, "1.5e+06"),
            (999_999.5, "1e+06"),
            (999_999.4, "999999"),
            (100_000.0, "100000"),
            (123_456.5, "123456"),
            (123_457.5, "123458"),
            (0.000_1, "0.0001"),
            (0.000_099_999_9, "9.99999e-05"),
            (0.000_099_999_96, "0.0001"),
            (0.000_012_345, "1.2345e-05"),
            (1e-100, "1e-100"),
            (0.1 + 0.2, "0.3"),
            (f64::INFINITY, "inf"),
            (f64::NEG_INFINITY, "-inf"),
            (f64::NAN.copysign(1.0), "nan"),
            (f64::NAN.copysign(-1.0), "-nan"),
        ];
        for (value, text) in expected {
            assert_eq!(Number(value).to_string(), text, "{value:?}");
        }
        assert_eq!(Number::from(0.1f32).to_string(), "0.1");
        assert_eq!(Number::from(86.402_6f32).to_string(), "86.4026");
    }

    #[test]
    fn halves_are_rounded_to_even_where_there_are_no_decimals() {
        let whole = |value: f64| format!("{value:8.0}");
        assert_eq!([0.5, 1.5, 2.5].map(whole), ["       0", "       2", "       2"]);
    }
}
