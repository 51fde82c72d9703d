//! Tokens: `cw_ID_SECRET`, of which only a hash is kept.

use std::fmt;
use std::str::FromStr;

use base64::Engine as _;
use base64::engine::general_purpose::URL_SAFE_NO_PAD;
use sha2::{Digest as _, Sha256};
use subtle::ConstantTimeEq as _;

/// What every token begins with, so that scanners for leaked secrets find it.
const PREFIX: &str = "cw_";
/// Bytes of a secret; so many random ones need no slow hash.
const SECRET_BYTES: usize = 32;
/// Characters of the longest id.
const ID_CHARS_MAX: usize = 64;

/// The part of a token that logs may show: 1 to 64 of `[a-z0-9-]`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct TokenId(String);

impl TokenId {
    /// The text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl FromStr for TokenId {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let is_legal = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        if !text.is_empty() && text.len() <= ID_CHARS_MAX && text.chars().all(is_legal) {
            return Ok(Self(text.to_owned()));
        }
        let found: String = text.chars().take(ID_CHARS_MAX).collect();
        Err(format!("the id of a token is 1 to {ID_CHARS_MAX} of a-z, 0-9 and '-', not {found:?}"))
    }
}

impl fmt::Display for TokenId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// SHA-256 of the part of a token that nobody may know.
#[derive(Clone, Copy)]
pub(crate) struct Hash([u8; 32]);

impl Hash {
    /// Of a secret as it is presented.
    pub(crate) fn of(secret: &str) -> Self {
        Self(Sha256::digest(secret.as_bytes()).into())
    }

    /// 64 hexadecimal digits.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        let mut bytes = [0; 32];
        if text.len() != 64 || !text.is_ascii() {
            return None;
        }
        for (index, byte) in bytes.iter_mut().enumerate() {
            *byte = u8::from_str_radix(text.get(2 * index..2 * index + 2)?, 16).ok()?;
        }
        Some(Self(bytes))
    }

    /// Takes as long for every other hash.
    pub(crate) fn is(&self, other: &Self) -> bool {
        self.0.ct_eq(&other.0).into()
    }
}

impl fmt::Display for Hash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

/// A time at which a token may end, as it was typed.
///
/// # Errors
/// What was wanted instead.
pub fn expiry(text: &str) -> Result<String, String> {
    match text.parse::<jiff::Timestamp>() {
        Ok(time) if time <= jiff::Timestamp::now() => Err("wanted a time to come".to_owned()),
        Ok(time) => Ok(time.to_string()),
        Err(_) => Err("wanted a time with an offset, e.g. 2027-01-01T00:00:00Z".to_owned()),
    }
}

/// A new token, before only its hash is kept.
pub struct Secret {
    id: TokenId,
    secret: String,
}

impl Secret {
    /// A token nobody can guess.
    ///
    /// # Errors
    /// The system has no randomness.
    pub fn new(id: TokenId) -> Result<Self, getrandom::Error> {
        let mut bytes = [0; SECRET_BYTES];
        getrandom::fill(&mut bytes)?;
        Ok(Self { id, secret: URL_SAFE_NO_PAD.encode(bytes) })
    }

    /// What the user sends.
    pub fn token(&self) -> String {
        format!("{PREFIX}{}_{}", self.id, self.secret)
    }

    /// SHA-256 of the part after the last underscore of the id, in hexadecimal digits: what the
    /// file of tenants has.
    pub fn sha256(&self) -> String {
        Hash::of(&self.secret).to_string()
    }
}

/// The id and the secret of what a client presents. An id has no underscore, a secret may.
pub(crate) fn split(presented: &str) -> Option<(&str, &str)> {
    presented.strip_prefix(PREFIX)?.split_once('_')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_new_token_is_found_by_its_parts_and_no_two_are_alike() {
        let id: TokenId = "alice-laptop".parse().unwrap();
        let [one, other] = [id.clone(), id].map(|id| Secret::new(id).unwrap());
        let token = one.token();
        let (id, secret) = split(&token).unwrap();
        assert_eq!((id, secret.len()), ("alice-laptop", 43));
        assert!(Hash::parse(&one.sha256()).unwrap().is(&Hash::of(secret)));
        assert!(!Hash::parse(&other.sha256()).unwrap().is(&Hash::of(secret)));
    }

    #[test]
    fn a_hash_is_what_sha256sum_prints() {
        let of_abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(Hash::of("abc").to_string(), of_abc);
        for wrong in ["", &of_abc[1..], &of_abc.replace('b', "x"), &"é".repeat(32)] {
            assert!(Hash::parse(wrong).is_none(), "{wrong}");
        }
    }

    #[test]
    fn an_expiry_is_a_time_that_is_the_same_everywhere() {
        assert_eq!(expiry("2999-01-01T01:00:00+01:00").unwrap(), "2999-01-01T00:00:00Z");
        assert_eq!(expiry("2020-01-01T00:00:00Z").unwrap_err(), "wanted a time to come");
        for wrong in ["", "tomorrow", "2027-01-01", "2027-01-01T00:00:00"] {
            assert!(expiry(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn ids_that_could_be_taken_for_something_else_are_refused() {
        for wrong in ["", "Alice", "a_b", "a b", &"a".repeat(65)] {
            assert!(wrong.parse::<TokenId>().is_err(), "{wrong}");
        }
    }
}
