//! Every key expression of the bus, built and parsed here and nowhere else.
//!
//! | key | kind | payload |
//! |---|---|---|
//! | `causeway/{tenant}/worlds` | query | [`Request`](crate::Request) about worlds and maps |
//! | `causeway/{tenant}/host/{host}/worlds` | query | the same of one world service |
//! | `causeway/{tenant}/world/{number}/{id}/request` | query | [`Request`](crate::Request) to one world: commands, ticks |
//! | `causeway/{tenant}/world/{id}/frame` | publication | [`Frame`](crate::Frame) after every tick |
//! | `causeway/batch/{host}/tick` | query | ticks of many worlds of one host, of any tenant |
//! | `causeway/render/{worker}/job` | query | [`RenderJob`](crate::RenderJob) → images |
//! | `causeway/batch/{host}/shortcut`, `causeway/render/{worker}/shortcut` | query | name of a Unix socket that takes the same |
//! | `causeway/alive/{kind}/{id}` | liveliness, query | [`Alive`](crate::Alive) |
//! | `causeway/draining/{kind}/{id}` | liveliness | none: the service takes no new work |
//! | `causeway/load/{kind}/{id}` | publication | [`Load`](crate::Load), every second |
//! | `causeway/asset/{digest}` | query | OpenDRIVE text or texture by content hash |
//!
//! `batch`, `render`, `alive`, `draining`, `load` and `asset` carry no tenant: they belong to
//! services alone.

use crate::{ServiceId, ServiceKind, Tenant, WorldId};

/// Requests about worlds: create, list, destroy, snapshot, restore, fork, list maps.
pub fn worlds(tenant: &Tenant) -> String {
    format!("causeway/{tenant}/worlds")
}

/// [`worlds`] of every tenant, for the service that answers.
pub const ANY_WORLDS: &str = "causeway/*/worlds";

/// [`worlds`] of one world service.
pub fn worlds_of(tenant: &Tenant, host: &ServiceId) -> String {
    format!("causeway/{tenant}/host/{host}/worlds")
}

/// [`worlds_of`] every world service.
pub fn worlds_of_any(tenant: &Tenant) -> String {
    format!("causeway/{tenant}/host/*/worlds")
}

/// [`worlds_of_any`] of every tenant.
pub const ANY_WORLDS_OF_ANY: &str = "causeway/*/host/*/worlds";

/// [`worlds_of`] of every tenant, for the service that answers.
pub fn any_worlds_of(host: &ServiceId) -> String {
    format!("causeway/*/host/{host}/worlds")
}

/// Requests to one world: commands, ticks. The number before the world's id is that of its
/// [host](WorldId::host): only there somebody answers.
// The last chunk keeps `causeway/alive/world/{id}` and `causeway/batch/world/tick` from matching
// [`any_world`]: the transport knows no reserved words.
pub fn world(tenant: &Tenant, world: WorldId) -> String {
    format!("causeway/{tenant}/world/{}/{}/request", world.host(), world.get())
}

/// [`world`] of every tenant and every world of a host, for the service that answers.
pub fn any_world(host: u32) -> String {
    format!("causeway/*/world/{host}/*/request")
}

/// [`world`] of every world of a tenant.
pub fn any_world_of(tenant: &Tenant) -> String {
    format!("causeway/{tenant}/world/*/*/request")
}

/// [`world`] of every tenant, host and world.
pub const ANY_WORLD: &str = "causeway/*/world/*/*/request";

/// The frame of one world, published after every tick.
pub fn world_frame(tenant: &Tenant, world: WorldId) -> String {
    format!("causeway/{tenant}/world/{}/frame", world.get())
}

/// [`world_frame`] of every world of a tenant.
pub fn any_world_frame(tenant: &Tenant) -> String {
    format!("causeway/{tenant}/world/*/frame")
}

/// [`world_frame`] of every tenant and world.
pub const ANY_WORLD_FRAME: &str = "causeway/*/world/*/frame";

/// Ticks of many worlds of one world service in one round trip.
pub fn batch_tick(host: &ServiceId) -> String {
    format!("causeway/batch/{host}/tick")
}

/// [`batch_tick`] of every world service.
pub const ANY_BATCH_TICK: &str = "causeway/batch/*/tick";

/// Jobs for one renderer.
pub fn render_job(worker: &ServiceId) -> String {
    format!("causeway/render/{worker}/job")
}

/// [`render_job`] of every renderer.
pub const ANY_RENDER_JOB: &str = "causeway/render/*/job";

/// Where a service takes past the bus what is asked under [`render_job`] or [`batch_tick`].
pub fn shortcut_to(key: &str) -> String {
    format!("{}/shortcut", key.rsplit_once('/').map_or(key, |(service, _)| service))
}

/// Liveliness of one service, and what it says of itself.
pub fn alive(kind: ServiceKind, id: &ServiceId) -> String {
    format!("causeway/alive/{}/{id}", kind.as_str())
}

/// [`alive`] of every service of one kind.
pub fn any_alive(kind: ServiceKind) -> String {
    format!("causeway/alive/{}/*", kind.as_str())
}

/// [`alive`] of every service.
pub const ANY_ALIVE: &str = "causeway/alive/*/*";

/// Liveliness of a service that takes no new work.
pub fn draining(kind: ServiceKind, id: &ServiceId) -> String {
    format!("causeway/draining/{}/{id}", kind.as_str())
}

/// [`draining`] of every service of one kind.
pub fn any_draining(kind: ServiceKind) -> String {
    format!("causeway/draining/{}/*", kind.as_str())
}

/// [`draining`] of every service.
pub const ANY_DRAINING: &str = "causeway/draining/*/*";

/// How much a service has to do.
pub fn load(kind: ServiceKind, id: &ServiceId) -> String {
    format!("causeway/load/{}/{id}", kind.as_str())
}

/// [`load`] of every service of one kind.
pub fn any_load(kind: ServiceKind) -> String {
    format!("causeway/load/{}/*", kind.as_str())
}

/// A map's OpenDRIVE text or a texture of a world by the hexadecimal BLAKE3 digest of its bytes.
pub fn asset(digest: &str) -> String {
    format!("causeway/asset/{digest}")
}

/// [`asset`] of every digest, for the service that answers.
pub const ANY_ASSET: &str = "causeway/asset/*";

/// All of them.
pub const EVERYTHING: &str = "causeway/**";

/// The inverse of [`worlds`] and [`worlds_of`]; `None` for any other key.
pub fn parse_worlds(key: &str) -> Option<Tenant> {
    let place = key.strip_prefix("causeway/")?.strip_suffix("/worlds")?;
    let (tenant, host) = place.split_once("/host/").map_or((place, None), |(t, h)| (t, Some(h)));
    host.is_none_or(|host| host.parse::<ServiceId>().is_ok()).then(|| tenant.parse().ok())?
}

/// The inverse of [`world`]; `None` for any other key.
pub fn parse_world(key: &str) -> Option<(Tenant, WorldId)> {
    let place = key.strip_prefix("causeway/")?.strip_suffix("/request")?;
    let (tenant, place) = place.split_once("/world/")?;
    let (host, id) = place.split_once('/')?;
    let id = decimal(id).filter(|id| id.host().to_string() == host)?;
    Some((tenant.parse().ok()?, id))
}

/// The inverse of [`world_frame`]; `None` for any other key.
pub fn parse_world_frame(key: &str) -> Option<(Tenant, WorldId)> {
    let place = key.strip_prefix("causeway/")?.strip_suffix("/frame")?;
    let (tenant, id) = place.split_once("/world/")?;
    Some((tenant.parse().ok()?, decimal(id)?))
}

/// The inverse of [`alive`]; `None` for any other key.
pub fn parse_alive(key: &str) -> Option<(ServiceKind, ServiceId)> {
    parse_service(key.strip_prefix("causeway/alive/")?)
}

/// The inverse of [`draining`]; `None` for any other key.
pub fn parse_draining(key: &str) -> Option<(ServiceKind, ServiceId)> {
    parse_service(key.strip_prefix("causeway/draining/")?)
}

/// The inverse of [`load`]; `None` for any other key.
pub fn parse_load(key: &str) -> Option<(ServiceKind, ServiceId)> {
    parse_service(key.strip_prefix("causeway/load/")?)
}

fn parse_service(place: &str) -> Option<(ServiceKind, ServiceId)> {
    let (kind, id) = place.split_once('/')?;
    Some((ServiceKind::parse(kind)?, id.parse().ok()?))
}

/// The inverse of [`asset`]; `None` for any other key.
pub fn parse_asset(key: &str) -> Option<&str> {
    let digest = key.strip_prefix("causeway/asset/")?;
    let hexadecimal = |c: u8| c.is_ascii_digit() || (b'a'..=b'f').contains(&c);
    (digest.len() == 64 && digest.bytes().all(hexadecimal)).then_some(digest)
}

/// Only the one spelling that [`world`] writes: no sign, no leading zero.
fn decimal(text: &str) -> Option<WorldId> {
    let value: u64 = text.parse().ok()?;
    if value.to_string() == text { WorldId::new(value) } else { None }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::RESERVED;

    proptest! {
        #[test]
        fn what_is_built_parses_back(tenant in "[a-z0-9-]{1,32}", id in 1u64..) {
            prop_assume!(!RESERVED.contains(&tenant.as_str()));
            let (tenant, id) = (tenant.parse::<Tenant>().unwrap(), WorldId::new(id).unwrap());
            prop_assert_eq!(parse_worlds(&worlds(&tenant)), Some(tenant.clone()));
            prop_assert_eq!(parse_world(&world(&tenant, id)), Some((tenant.clone(), id)));
            let host: ServiceId = "world-2".parse().unwrap();
            prop_assert_eq!(parse_worlds(&worlds_of(&tenant, &host)), Some(tenant.clone()));
            prop_assert_eq!(parse_world_frame(&world_frame(&tenant, id)), Some((tenant, id)));
        }

        #[test]
        fn no_text_becomes_a_tenant_with_key_syntax(text in ".{0,40}") {
            if let Ok(tenant) = text.parse::<Tenant>() {
                prop_assert!(!tenant.as_str().contains(['/', '*', '$', '#', '?', '@', ' ']));
            }
        }
    }

    #[test]
    fn hostile_keys_are_refused() {
        for key in [
            "causeway/a/b/worlds",
            "causeway/*/worlds",
            "causeway/batch/worlds",
            "causeway//worlds",
            "causeway/a/host/*/worlds",
            "causeway/batch/host/h/worlds",
            "other/a/worlds",
        ] {
            assert_eq!(parse_worlds(key), None, "{key}");
        }
        for key in [
            "causeway/a/world/0/0/request",
            "causeway/a/world/0/-1/request",
            "causeway/a/world/0/01/request",
            "causeway/a/world/0/+1/request",
            "causeway/a/world/1/1/request",
            "causeway/a/world/1/request",
        ] {
            assert_eq!(parse_world(key), None, "{key}");
        }
        assert_eq!(parse_asset("causeway/asset/../../etc/passwd"), None);
    }

    /// As the transport matches: chunk by chunk, `*` is any one chunk.
    fn matches(expression: &str, key: &str) -> bool {
        let mut chunks = expression.split('/').zip(key.split('/'));
        expression.split('/').count() == key.split('/').count()
            && chunks.all(|(wanted, found)| wanted == "*" || wanted == found)
    }

    #[test]
    fn what_belongs_to_services_never_reaches_who_answers_tenants() {
        for id in ["world", "worlds", "tick", "job", "request"] {
            let id: ServiceId = id.parse().unwrap();
            let mut keys = vec![batch_tick(&id)];
            keys.extend([render_job(&id), shortcut_to(&render_job(&id))]);
            keys.push(shortcut_to(&batch_tick(&id)));
            keys.extend(ServiceKind::ALL.map(|kind| alive(kind, &id)));
            keys.extend(ServiceKind::ALL.map(|kind| draining(kind, &id)));
            keys.extend(ServiceKind::ALL.map(|kind| load(kind, &id)));
            for key in keys {
                for expression in [ANY_WORLDS, &any_worlds_of(&id), &any_world(1)] {
                    assert!(!matches(expression, &key), "{expression} matches {key}");
                }
            }
        }
    }

    #[test]
    fn what_stands_for_all_of_a_kind_matches_one_of_it() {
        let (tenant, host) = ("alice".parse().unwrap(), "world-2".parse().unwrap());
        let id = WorldId::new(7).unwrap();
        let kind = ServiceKind::World;
        let shortcut = shortcut_to(&batch_tick(&host));
        for (expression, key) in [
            (ANY_WORLDS, worlds(&tenant)),
            (ANY_WORLDS_OF_ANY, worlds_of(&tenant, &host)),
            (&worlds_of_any(&tenant), worlds_of(&tenant, &host)),
            (ANY_WORLD, world(&tenant, id)),
            (&any_world_of(&tenant), world(&tenant, id)),
            (&any_world(id.host()), world(&tenant, id)),
            (ANY_WORLD_FRAME, world_frame(&tenant, id)),
            (&any_world_frame(&tenant), world_frame(&tenant, id)),
            (ANY_BATCH_TICK, batch_tick(&host)),
            (&shortcut_to(ANY_BATCH_TICK), shortcut),
            (ANY_RENDER_JOB, render_job(&host)),
            (&shortcut_to(ANY_RENDER_JOB), shortcut_to(&render_job(&host))),
            (ANY_ALIVE, alive(kind, &host)),
            (&any_alive(kind), alive(kind, &host)),
            (ANY_DRAINING, draining(kind, &host)),
            (&any_draining(kind), draining(kind, &host)),
            (&any_load(kind), load(kind, &host)),
            (ANY_ASSET, asset("0a")),
        ] {
            assert!(matches(expression, &key), "{expression} does not match {key}");
            assert!(!matches(expression, "causeway/bob/anything"), "{expression}");
        }
    }

    #[test]
    fn services_parse_back() {
        let id: ServiceId = "render-0".parse().unwrap();
        for kind in ServiceKind::ALL {
            assert_eq!(parse_alive(&alive(kind, &id)), Some((kind, id.clone())));
            assert_eq!(parse_draining(&draining(kind, &id)), Some((kind, id.clone())));
            assert_eq!(parse_load(&load(kind, &id)), Some((kind, id.clone())));
        }
    }
}
