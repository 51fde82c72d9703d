//! What each certificate may do on a bus with TLS: the access list of whoever listens there.
//!
//! The common name of a certificate is a role. What no rule allows is denied.
//!
//! | common name | may |
//! |---|---|
//! | `causeway-router` | pass everything on |
//! | `causeway-world` | answer for worlds and maps, publish frames |
//! | `causeway-render` | answer for pictures, ask for maps |
//! | `causeway-face` | ask worlds and renderers, for any tenant |
//! | `tenant-NAME` | see the frames of that tenant's worlds, and ask about them |

use schemas::{ServiceKind, Tenant, keys};
use serde_json::{Value, json};

/// Who is up, and how it is.
const PRESENCE_KEYS: [&str; 2] = [keys::ANY_ALIVE, keys::ANY_DRAINING];
/// Messages of somebody who answers, as they come in.
const ANSWERS: [&str; 2] = ["declare_queryable", "reply"];

/// What world services answer.
fn world_keys() -> [String; 6] {
    [
        keys::ANY_WORLDS.to_owned(),
        keys::ANY_WORLDS_OF_ANY.to_owned(),
        keys::ANY_WORLD.to_owned(),
        keys::ANY_BATCH_TICK.to_owned(),
        keys::shortcut_to(keys::ANY_BATCH_TICK),
        keys::ANY_ASSET.to_owned(),
    ]
}

/// What renderers answer.
fn render_keys() -> [String; 2] {
    [keys::ANY_RENDER_JOB.to_owned(), keys::shortcut_to(keys::ANY_RENDER_JOB)]
}

/// The access list, for the tenants that may watch their worlds from outside.
pub(crate) fn list(watchers: &[Tenant]) -> Value {
    let mut list = List::default();
    list.role("causeway-router", |role| {
        role.may("both", &EVERYTHING, &[keys::EVERYTHING]);
    });
    list.role("causeway-world", |role| {
        role.answers(&world_keys());
        role.may("in", &["put"], &[keys::ANY_WORLD_FRAME]);
        role.may("out", &["declare_subscriber"], &[keys::ANY_WORLD_FRAME]);
        role.may("in", &["put"], &[keys::any_load(ServiceKind::World)]);
        role.may("out", &["declare_subscriber"], &[keys::any_load(ServiceKind::World)]);
        role.is_present(&[ServiceKind::World]);
    });
    list.role("causeway-render", |role| {
        role.answers(&render_keys());
        role.asks(&[keys::ANY_ASSET]);
        role.is_present(&[ServiceKind::Render]);
    });
    list.role("causeway-face", |role| {
        role.asks(&world_keys());
        role.asks(&render_keys());
        role.may("in", &["declare_subscriber"], &[keys::any_load(ServiceKind::World)]);
        role.may("out", &["put"], &[keys::any_load(ServiceKind::World)]);
        role.is_present(&[ServiceKind::Scenario, ServiceKind::Gateway]);
    });
    for tenant in watchers {
        list.role(&format!("tenant-{tenant}"), |role| {
            role.asks(&[
                keys::worlds(tenant),
                keys::worlds_of_any(tenant),
                keys::any_world_of(tenant),
            ]);
            role.may("in", &["declare_subscriber"], &[keys::any_world_frame(tenant)]);
            role.may("out", &["put"], &[keys::any_world_frame(tenant)]);
        });
    }
    list.value()
}

/// All that can be allowed.
const EVERYTHING: [&str; 9] = [
    "put",
    "delete",
    "declare_subscriber",
    "query",
    "reply",
    "declare_queryable",
    "liveliness_token",
    "liveliness_query",
    "declare_liveliness_subscriber",
];

#[derive(Default)]
struct List {
    rules: Vec<Value>,
    subjects: Vec<Value>,
    policies: Vec<Value>,
}

/// The rules of one role; `in` is what the role sends.
struct Role<'a> {
    name: &'a str,
    rules: Vec<Value>,
}

impl List {
    fn role(&mut self, name: &str, allow: impl FnOnce(&mut Role<'_>)) {
        let mut role = Role { name, rules: Vec::new() };
        allow(&mut role);
        let ids: Vec<&Value> = role.rules.iter().map(|rule| &rule["id"]).collect();
        self.policies.push(json!({"rules": ids, "subjects": [name]}));
        self.subjects.push(json!({"id": name, "cert_common_names": [name]}));
        self.rules.extend(role.rules);
    }

    fn value(self) -> Value {
        json!({
            "enabled": true,
            "default_permission": "deny",
            "rules": self.rules,
            "subjects": self.subjects,
            "policies": self.policies,
        })
    }
}

impl Role<'_> {
    fn may<K: AsRef<str>>(&mut self, way: &str, messages: &[&str], keys: &[K]) {
        let flows: &[&str] = match way {
            "in" => &["ingress"],
            "out" => &["egress"],
            _ => &["ingress", "egress"],
        };
        self.rules.push(json!({
            "id": format!("{}-{}", self.name, self.rules.len()),
            "messages": messages,
            "flows": flows,
            "permission": "allow",
            "key_exprs": keys.iter().map(AsRef::as_ref).collect::<Vec<&str>>(),
        }));
    }

    fn answers<K: AsRef<str>>(&mut self, keys: &[K]) {
        self.may("in", &ANSWERS, keys);
        self.may("out", &["query"], keys);
    }

    fn asks<K: AsRef<str>>(&mut self, keys: &[K]) {
        self.may("in", &["query"], keys);
        self.may("out", &ANSWERS, keys);
    }

    /// Services of these kinds say that they are there, and see all others.
    fn is_present(&mut self, kinds: &[ServiceKind]) {
        let own: Vec<String> = kinds
            .iter()
            .flat_map(|kind| [keys::any_alive(*kind), keys::any_draining(*kind)])
            .collect();
        self.may("in", &["liveliness_token", "declare_queryable", "reply"], &own);
        self.may("out", &["query"], &own);
        let see = ["declare_liveliness_subscriber", "liveliness_query", "query"];
        self.may("in", &see, &PRESENCE_KEYS);
        self.may("out", &["liveliness_token", "reply", "declare_queryable"], &PRESENCE_KEYS);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every right of every role, for whoever reads what changes. Write it anew with
    /// `UPDATE_GOLDEN=1 cargo nextest run --release -p bus the_list_of_rights`.
    #[test]
    fn the_list_of_rights_is_the_one_that_was_read() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/src/access.json");
        let found = list(&["alice".parse().unwrap()]);
        let rules: Vec<String> =
            found["rules"].as_array().unwrap().iter().map(ToString::to_string).collect();
        let found = format!("[\n{}\n]\n", rules.join(",\n"));
        if std::env::var_os("UPDATE_GOLDEN").is_some() {
            std::fs::write(path, &found).unwrap();
        }
        assert_eq!(found, std::fs::read_to_string(path).unwrap());
    }
}
