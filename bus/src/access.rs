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

/// What world services answer.
const WORLD_KEYS: [&str; 6] = [
    keys::ANY_WORLDS,
    "causeway/*/host/*/worlds",
    "causeway/*/world/*/*/request",
    "causeway/batch/*/tick",
    "causeway/batch/*/shortcut",
    keys::ANY_ASSET,
];
/// What renderers answer.
const RENDER_KEYS: [&str; 2] = ["causeway/render/*/job", "causeway/render/*/shortcut"];
/// Who is up, and how it is.
const PRESENCE_KEYS: [&str; 2] = [keys::ANY_ALIVE, "causeway/draining/*/*"];
/// Messages of somebody who answers, as they come in.
const ANSWERS: [&str; 2] = ["declare_queryable", "reply"];

/// The access list, for the tenants that may watch their worlds from outside.
pub(crate) fn list(watchers: &[Tenant]) -> Value {
    let mut list = List::default();
    list.role("causeway-router", |role| {
        role.may("both", &EVERYTHING, &["causeway/**".to_owned()]);
    });
    list.role("causeway-world", |role| {
        role.answers(&WORLD_KEYS);
        role.may("in", &["put"], &[keys::ANY_WORLD_FRAME]);
        role.may("out", &["declare_subscriber"], &[keys::ANY_WORLD_FRAME]);
        role.may("in", &["put"], &[keys::any_load(ServiceKind::World)]);
        role.may("out", &["declare_subscriber"], &[keys::any_load(ServiceKind::World)]);
        role.is_present(&[ServiceKind::World]);
    });
    list.role("causeway-render", |role| {
        role.answers(&RENDER_KEYS);
        role.asks(&[keys::ANY_ASSET]);
        role.is_present(&[ServiceKind::Render]);
    });
    list.role("causeway-face", |role| {
        role.asks(&WORLD_KEYS);
        role.asks(&RENDER_KEYS);
        role.may("in", &["declare_subscriber"], &[keys::any_load(ServiceKind::World)]);
        role.may("out", &["put"], &[keys::any_load(ServiceKind::World)]);
        role.is_present(&[ServiceKind::Scenario, ServiceKind::Gateway]);
    });
    for tenant in watchers {
        list.role(&format!("tenant-{tenant}"), |role| {
            role.asks(&[
                keys::worlds(tenant),
                format!("causeway/{tenant}/host/*/worlds"),
                format!("causeway/{tenant}/world/*/*/request"),
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
