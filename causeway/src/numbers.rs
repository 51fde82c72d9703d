//! Numbers as they are typed.

/// Nothing, or more.
///
/// # Errors
/// What was wanted instead.
pub(crate) fn from_zero(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number: &f64| number.is_finite() && *number >= 0.0);
    number.ok_or_else(|| "wanted a number from 0 on".to_owned())
}

/// How long something is measured, in seconds.
///
/// # Errors
/// What was wanted instead.
pub(crate) fn seconds(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number: &f64| *number > 0.0 && *number <= 3_600.0);
    number.ok_or_else(|| "wanted seconds above 0 and at most 3600".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_in_the_range_is_refused_by_what_was_wanted() {
        assert_eq!((from_zero("0"), seconds("0.5")), (Ok(0.0), Ok(0.5)));
        for wrong in ["nan", "inf", "-1", "far"] {
            assert!(from_zero(wrong).unwrap_err().contains("from 0 on"), "{wrong}");
            assert!(seconds(wrong).unwrap_err().contains("at most 3600"), "{wrong}");
        }
    }
}
