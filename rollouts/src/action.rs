//! What a driver asks for.

use schemas::{Error, ErrorCode, VehicleControl};

/// Steering wheel and pedals, each from -1 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Action {
    /// Share of the full lock, positive to the left.
    pub steer: f32,
    /// Positive: throttle; negative: brake.
    pub pedal: f32,
}

impl Action {
    /// Numbers of one action in a row of actions.
    pub const WIDTH: usize = 2;

    /// The action in a row, each number brought to -1 to 1.
    #[must_use]
    pub fn from_row(row: &[f32]) -> Self {
        let at = |index: usize| row.get(index).map_or(0.0, |value| value.clamp(-1.0, 1.0));
        Self { steer: at(0), pedal: at(1) }
    }

    /// # Errors
    /// `InvalidArgument` with the first row that is no action.
    pub(crate) fn check(actions: &[f32], rows: usize) -> Result<(), Error> {
        if actions.len() != rows * Self::WIDTH {
            return Err(Error::new(ErrorCode::InvalidArgument, "there are not so many actions")
                .wanted(format!("{rows} rows of {} numbers", Self::WIDTH))
                .found(format!("{} numbers", actions.len())));
        }
        match actions.iter().position(|value| !value.is_finite()) {
            None => Ok(()),
            Some(at) => {
                let row = at / Self::WIDTH;
                let found = actions.get(at).copied().unwrap_or_default();
                Err(Error::new(ErrorCode::InvalidArgument, format!("action {row} is no number"))
                    .wanted("finite numbers; nothing was stepped")
                    .found(format!("{found} in column {}", at % Self::WIDTH)))
            }
        }
    }

    /// As a vehicle takes it.
    pub(crate) fn control(self) -> VehicleControl {
        VehicleControl {
            throttle: self.pedal.max(0.0),
            steer: self.steer,
            brake: (-self.pedal).max(0.0),
            ..VehicleControl::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pedals_are_throttle_or_brake_and_numbers_beyond_the_range_are_its_ends() {
        let action = Action::from_row(&[3.0, -0.25]);
        assert_eq!(action, Action { steer: 1.0, pedal: -0.25 });
        let control = action.control();
        assert_eq!((control.throttle, control.brake, control.steer), (0.0, 0.25, 1.0));
    }

    #[test]
    fn what_is_no_number_is_named_with_its_row() {
        assert!(Action::check(&[0.0, 1.0, -5.0, 9.0], 2).is_ok());
        let error = Action::check(&[0.0, 0.0, 0.0, f32::NAN], 2).unwrap_err().to_string();
        assert!(error.contains("action 1") && error.contains("column 1"), "{error}");
        assert!(Action::check(&[0.0; 3], 2).is_err());
    }
}
