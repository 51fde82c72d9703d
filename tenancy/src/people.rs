//! The file of tenants.

use std::collections::BTreeMap;

use jiff::Timestamp;
use schemas::Tenant;
use serde::Deserialize;

use crate::secret::{Hash, TokenId, split};

/// Tokens of one file.
const TOKENS_MAX: usize = 10_000;

/// How much of a site a tenant may use. `None`: as much as there is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Quotas {
    /// Sessions at once at one face.
    pub sessions_max: Option<u32>,
    /// Pixels that are drawn for it in a second, at one face.
    pub pixels_per_second: Option<u64>,
    /// Actors of one world that are not the map's own.
    pub actors_per_world: Option<u32>,
    /// Cameras of one world.
    pub cameras_per_world: Option<u32>,
    /// MiB of its folder of recordings, at one gateway.
    pub recordings_mib: Option<u32>,
}

impl Quotas {
    /// Those of tenants of which the file says nothing.
    pub const USUAL: Self = Self {
        sessions_max: Some(64),
        pixels_per_second: Some(20_000_000),
        actors_per_world: Some(500),
        cameras_per_world: Some(16),
        recordings_mib: Some(1_024),
    };

    /// The others' where this one says nothing.
    fn or(self, other: Self) -> Self {
        Self {
            sessions_max: self.sessions_max.or(other.sessions_max),
            pixels_per_second: self.pixels_per_second.or(other.pixels_per_second),
            actors_per_world: self.actors_per_world.or(other.actors_per_world),
            cameras_per_world: self.cameras_per_world.or(other.cameras_per_world),
            recordings_mib: self.recordings_mib.or(other.recordings_mib),
        }
    }

    /// The name of one that allows nothing.
    fn none(&self) -> Option<&'static str> {
        let wide = |value: Option<u32>| value.map(u64::from);
        let named = [
            ("sessions_max", wide(self.sessions_max)),
            ("pixels_per_second", self.pixels_per_second),
            ("actors_per_world", wide(self.actors_per_world)),
            ("cameras_per_world", wide(self.cameras_per_world)),
            ("recordings_mib", wide(self.recordings_mib)),
        ];
        named.into_iter().find(|(_, value)| *value == Some(0)).map(|(name, _)| name)
    }
}

/// Who asks, as far as the site is concerned.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Visitor {
    /// Whose worlds and pictures they are.
    pub tenant: Tenant,
    /// The id of the token that was presented; `None` where nobody is asked for one.
    pub token: Option<TokenId>,
    /// How much the tenant may use.
    pub quotas: Quotas,
}

/// Why a text is no file of tenants.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Invalid {
    /// No TOML, or not with these names.
    #[error("{0}")]
    Form(String),
    /// A tenant's name.
    #[error("[tenant.{0}]: {1}")]
    Tenant(String, schemas::InvalidName),
    /// A quota of nothing.
    #[error("[{0}]: {1} must be at least 1")]
    Quota(String, &'static str),
    /// A member of a token.
    #[error("token {0:?}: {1}")]
    Token(String, String),
    /// More than anybody reads through.
    #[error("wanted at most {TOKENS_MAX} tokens, found {0}")]
    Many(usize),
}

/// Tenants and their tokens.
pub struct People {
    /// Of tenants that are not named.
    usual: Quotas,
    tenants: BTreeMap<Tenant, Quotas>,
    tokens: BTreeMap<TokenId, Token>,
}

struct Token {
    tenant: Tenant,
    hash: Hash,
    expires: Option<Timestamp>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    default: Quotas,
    #[serde(default)]
    tenant: BTreeMap<String, Quotas>,
    #[serde(default)]
    token: Vec<TokenEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TokenEntry {
    id: String,
    tenant: String,
    sha256: String,
    expires: Option<toml::value::Datetime>,
}

impl People {
    /// Reads a file of tenants.
    ///
    /// # Errors
    /// [`Invalid`]: the first thing that is wrong with it.
    pub fn parse(text: &str) -> Result<Self, Invalid> {
        let file: File =
            toml::from_str(text).map_err(|why| Invalid::Form(why.to_string().trim().to_owned()))?;
        if file.token.len() > TOKENS_MAX {
            return Err(Invalid::Many(file.token.len()));
        }
        let usual = checked("default", file.default)?.or(Quotas::USUAL);
        let mut tenants = BTreeMap::new();
        for (name, quotas) in file.tenant {
            let quotas = checked(&format!("tenant.{name}"), quotas)?.or(usual);
            let tenant = name.parse().map_err(|why| Invalid::Tenant(name, why))?;
            tenants.insert(tenant, quotas);
        }
        let mut tokens = BTreeMap::new();
        for entry in file.token {
            let (id, token) = entry.read(&tenants)?;
            let name = id.to_string();
            if tokens.insert(id, token).is_some() {
                return Err(Invalid::Token(name, "its id is there twice".to_owned()));
            }
        }
        Ok(Self { usual, tenants, tokens })
    }

    /// Whose token this is. An unknown id takes as long as a wrong secret.
    pub fn who(&self, presented: &str, now: Timestamp) -> Option<Visitor> {
        let (id, secret) = split(presented)?;
        let hash = Hash::of(secret);
        let found = id.parse().ok().and_then(|id: TokenId| self.tokens.get_key_value(&id));
        let nobody = Hash::of("");
        let wanted = found.map_or(&nobody, |(_, token)| &token.hash);
        let is_right = wanted.is(&hash);
        let (id, token) = found.filter(|_| is_right)?;
        if token.expires.is_some_and(|expires| expires <= now) {
            return None;
        }
        let quotas = self.tenants.get(&token.tenant).copied()?;
        Some(Visitor { tenant: token.tenant.clone(), token: Some(id.clone()), quotas })
    }

    /// How much a tenant may use.
    pub fn quotas_of(&self, tenant: &Tenant) -> Quotas {
        self.tenants.get(tenant).copied().unwrap_or(self.usual)
    }

    /// Who is named.
    pub fn tenants(&self) -> impl Iterator<Item = &Tenant> {
        self.tenants.keys()
    }

    /// Tenants and tokens.
    pub fn counts(&self) -> (usize, usize) {
        (self.tenants.len(), self.tokens.len())
    }
}

impl TokenEntry {
    fn read(self, tenants: &BTreeMap<Tenant, Quotas>) -> Result<(TokenId, Token), Invalid> {
        let Self { id: name, tenant, sha256, expires } = self;
        let wrong = |why: String| Invalid::Token(name.clone(), why);
        let id: TokenId = name.parse().map_err(&wrong)?;
        let known = tenants.keys().find(|known| known.as_str() == tenant);
        let tenant = known.ok_or_else(|| wrong(format!("there is no [tenant.{tenant}]")))?.clone();
        let hash = Hash::parse(&sha256)
            .ok_or_else(|| wrong("sha256 must be 64 hexadecimal digits".to_owned()))?;
        let expires = expires.map(|when| {
            let text = when.to_string();
            let form = "expires must be a time with an offset, e.g. 2027-01-01T00:00:00Z, not";
            text.parse().map_err(|_| wrong(format!("{form} {text}")))
        });
        Ok((id, Token { tenant, hash, expires: expires.transpose()? }))
    }
}

fn checked(table: &str, quotas: Quotas) -> Result<Quotas, Invalid> {
    match quotas.none() {
        Some(name) => Err(Invalid::Quota(table.to_owned(), name)),
        None => Ok(quotas),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Secret;

    fn secret(id: &str) -> Secret {
        Secret::new(id.parse().unwrap()).unwrap()
    }

    fn entry(id: &str, tenant: &str, secret: &Secret, more: &str) -> String {
        let sha256 = secret.sha256();
        format!("[[token]]\nid = {id:?}\ntenant = {tenant:?}\nsha256 = \"{sha256}\"\n{more}\n")
    }

    #[test]
    fn a_token_is_its_tenants_until_it_expires() {
        let (alice, bob) = (secret("alice-laptop"), secret("bob"));
        let text = format!(
            "[default]\nsessions_max = 8\n[tenant.alice]\nsessions_max = 2\n[tenant.bob]\n{}{}",
            entry("alice-laptop", "alice", &alice, "expires = 2027-01-01T01:00:00+01:00"),
            entry("bob", "bob", &bob, ""),
        );
        let people = People::parse(&text).unwrap();
        assert_eq!(people.counts(), (2, 2));
        let at = |text: &str| text.parse::<Timestamp>().unwrap();
        let (before, after) = (at("2026-12-31T23:59:59Z"), at("2027-01-01T00:00:00Z"));
        let visitor = people.who(&alice.token(), before).unwrap();
        assert_eq!(visitor.tenant.as_str(), "alice");
        assert_eq!(visitor.token.unwrap().as_str(), "alice-laptop");
        assert_eq!(visitor.quotas.sessions_max, Some(2));
        assert_eq!(visitor.quotas.pixels_per_second, Quotas::USUAL.pixels_per_second);
        assert_eq!(visitor.quotas.actors_per_world, Some(500));
        let of = |name: &str| people.quotas_of(&name.parse().unwrap()).sessions_max;
        assert_eq!([of("alice"), of("bob"), of("carol")], [Some(2), Some(8), Some(8)]);
        assert_eq!(people.who(&alice.token(), after), None);
        assert_eq!(people.who(&bob.token(), after).unwrap().quotas.sessions_max, Some(8));
    }

    #[test]
    fn nobody_comes_in_with_anything_else() {
        let alice = secret("alice");
        let text = format!("[tenant.alice]\n{}", entry("alice", "alice", &alice, ""));
        let people = People::parse(&text).unwrap();
        let token = alice.token();
        let foreign = token.replace("cw_alice_", "cw_bob_");
        let other = secret("alice").token();
        for wrong in ["", "cw_", "cw_alice_", &token[3..], &token[..50], &foreign, &other] {
            assert_eq!(people.who(wrong, Timestamp::now()), None, "{wrong}");
        }
        assert!(people.who(&token, Timestamp::now()).is_some());
    }

    /// The promise is 20 µs; a busy machine gets fifty times as long.
    #[test]
    fn a_token_among_a_thousand_is_checked_soon() {
        let secrets: Vec<Secret> = (0..1_000).map(|number| secret(&format!("t{number}"))).collect();
        let entries: String = (0..)
            .zip(&secrets)
            .map(|(number, secret)| entry(&format!("t{number}"), "alice", secret, ""))
            .collect();
        let people = People::parse(&format!("[tenant.alice]\n{entries}")).unwrap();
        let now = Timestamp::now();
        let begun = std::time::Instant::now();
        assert!(secrets.iter().all(|secret| people.who(&secret.token(), now).is_some()));
        let micros = begun.elapsed().as_secs_f64() * 1e6 / secrets.len() as f64;
        eprintln!("a token is checked in {micros:.1} µs");
        assert!(micros < 1_000.0, "{micros} µs");
    }

    #[test]
    fn what_is_wrong_with_a_file_is_said() {
        let alice = secret("alice");
        let good = format!("[tenant.alice]\n{}", entry("alice", "alice", &alice, ""));
        let cases = [
            (good.replace("[tenant.alice]", ""), "there is no [tenant.alice]"),
            (good.replace("[tenant.alice]", "[tenant.Alice]"), "[tenant.Alice]: a name is"),
            (good.replace(&alice.sha256(), "abc"), "sha256 must be 64 hexadecimal digits"),
            (good.clone() + "expires = 2027-01-01", "expires must be a time with an offset"),
            (good.clone() + "colour = 1", "unknown field `colour`"),
            (good.replace("[tenant.alice]", "[tenant.alice]\nsessions_max = 0"), "at least 1"),
            (good.clone() + "[default]\nrecordings_mib = 0", "[default]: recordings_mib must be"),
            (good.clone() + &entry("alice", "alice", &alice, ""), "its id is there twice"),
            ("[[".to_owned(), "TOML parse error"),
        ];
        for (text, wanted) in cases {
            let found = People::parse(&text).err().unwrap().to_string();
            assert!(found.contains(wanted), "{found}");
        }
    }
}
