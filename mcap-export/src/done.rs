//! What was done to a world before a tick.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

/// What was done before a tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Done {
    /// That of the frame after it.
    pub tick: u64,
    /// The length that the tick was asked for, in seconds; `None`: the world's own.
    pub wanted_secs: Option<f64>,
    /// Requests of the bus, in order.
    pub requests: Vec<Vec<u8>>,
}

impl Done {
    /// Whether the world only ticked.
    pub(crate) fn is_nothing(&self) -> bool {
        self.requests.is_empty() && self.wanted_secs.is_none()
    }

    pub(crate) fn told(&self) -> Value {
        let requests: Vec<String> = self.requests.iter().map(|one| STANDARD.encode(one)).collect();
        // As text: not every reader of JSON keeps all bits of a number.
        let wanted = self.wanted_secs.map_or_else(String::new, |secs| format!("{secs:?}"));
        json!({"tick": self.tick, "wanted_secs": wanted, "requests": requests})
    }

    /// From the message of a file; `None` for others than are written here.
    pub fn of(message: &[u8]) -> Option<Self> {
        let told: Value = serde_json::from_slice(message).ok()?;
        let requests = told["requests"].as_array()?.iter();
        let requests = requests.map(|one| STANDARD.decode(one.as_str()?).ok());
        let wanted_secs = match told["wanted_secs"].as_str()? {
            "" => None,
            secs => Some(secs.parse().ok()?),
        };
        let requests = requests.collect::<Option<_>>()?;
        Some(Self { tick: told["tick"].as_u64()?, wanted_secs, requests })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_told_is_read_to_the_bit() {
        let secs = 0.1 + 0.2;
        for wanted_secs in [None, Some(secs), Some(1.0 / 60.0)] {
            let done = Done { tick: 7, wanted_secs, requests: vec![vec![0, 255], Vec::new()] };
            assert_eq!(Done::of(done.told().to_string().as_bytes()), Some(done));
        }
        assert_eq!(Done::of(b"{\"tick\": 7}"), None);
        assert_eq!(Done::of(b"no JSON"), None);
    }
}
