//! Blueprints as CARLA's client lists them, and what it may ask for when it spawns one.

use std::sync::LazyLock;

use blueprints::{AttributeKind, Blueprint};
use schemas::{ActorDescription as Described, Attribute};

use crate::dialect::{Actor, ActorAttribute, ActorDefinition, ActorDescription, AttributeValue};
use crate::dialect::{BoundingBox, ClientVersion, Location, Rotation, Vector3D};
use crate::rpc::Refusal;

/// Every listed blueprint that clients of a version know; made once.
pub(crate) fn definitions(version: ClientVersion) -> &'static [ActorDefinition] {
    static OLD: LazyLock<Vec<ActorDefinition>> = LazyLock::new(|| listed(ClientVersion::V0_9));
    static NEW: LazyLock<Vec<ActorDefinition>> = LazyLock::new(|| listed(ClientVersion::V0_10));
    match version {
        ClientVersion::V0_9 => &OLD,
        ClientVersion::V0_10 => &NEW,
    }
}

fn listed(version: ClientVersion) -> Vec<ActorDefinition> {
    let is_listed = |blueprint: &Blueprint| blueprint.listed && version.knows(&blueprint.id);
    let numbered = (1..).zip(blueprints::all());
    let listed = numbered.filter(|(_, blueprint)| is_listed(blueprint));
    let mut listed: Vec<ActorDefinition> =
        listed.map(|(uid, blueprint)| definition(uid, blueprint, version)).collect();
    if version.renames_vehicles() {
        let renamed = blueprints::renamed_in_0_10();
        listed.extend(renamed.map(|(new, same)| definition(uid_of(same), &new, version)));
    }
    listed
}

fn definition(uid: u32, blueprint: &Blueprint, version: ClientVersion) -> ActorDefinition {
    let attribute = |attribute: &blueprints::Attribute| ActorAttribute {
        id: attribute.id.to_owned(),
        kind: version.attribute_kind(attribute.kind),
        value: attribute.value.clone(),
        recommended_values: attribute.recommended.clone(),
        is_modifiable: attribute.is_modifiable,
        restrict_to_recommended: attribute.is_restricted,
    };
    ActorDefinition {
        uid,
        id: blueprint.id.clone(),
        tags: blueprint.tags.join(","),
        attributes: blueprint.attributes.iter().map(attribute).collect(),
    }
}

/// The number that recordings have for the kind of an attribute: that of 0.9.16, whoever gave it.
pub(crate) fn recorded_kind(type_id: &str, attribute: &str) -> u8 {
    let known = blueprints::find(type_id).and_then(|blueprint| blueprint.attribute(attribute));
    ClientVersion::V0_9.attribute_kind(known.map_or(AttributeKind::String, |known| known.kind))
}

fn uid_of(blueprint: &Blueprint) -> u32 {
    let at = blueprints::all().iter().position(|other| other.id == blueprint.id);
    at.map_or(0, |at| at as u32 + 1)
}

/// What the world chooses itself for an actor that is not told.
const CHOSEN_BY_WORLD: [&str; 2] = ["role_name", "color"];

/// The blueprint a client wants, and the attributes that differ from what the world makes of them
/// by itself.
///
/// # Errors
/// CARLA's text for a blueprint that does not exist; what is wrong with an attribute.
pub(crate) fn order(
    description: &ActorDescription,
) -> Result<(&'static Blueprint, Vec<Attribute>), Refusal> {
    let invalid =
        |why: String| Refusal(format!("Spawn failed because of invalid actor description: {why}"));
    let blueprint = blueprints::find(&description.type_id)
        .ok_or_else(|| invalid(format!("there is no blueprint {:?}", description.type_id)))?;
    let mut attributes = Vec::new();
    for given in &description.attributes {
        let Some(known) = blueprint.attribute(&given.id) else { continue };
        let value = known.kind.written(&given.value);
        if value == known.value && !CHOSEN_BY_WORLD.contains(&known.id) {
            continue;
        }
        if !known.accepts(&value) {
            let mut why = format!("{} cannot be {:?}", given.id, given.value);
            if known.is_restricted {
                why += &format!(": wanted one of {}", known.recommended.join(", "));
            }
            return Err(invalid(why));
        }
        attributes.push(Attribute { id: given.id.clone(), value });
    }
    Ok((blueprint, attributes))
}

/// An actor as clients cache it, without its stream: what it was given, and defaults for the rest.
pub(crate) fn actor(described: &Described, version: ClientVersion) -> Actor {
    let blueprint = blueprints::find(&described.blueprint);
    let id = described.id.into();
    Actor {
        id,
        parent_id: described.attachment.map(|attachment| attachment.parent).into(),
        description: ActorDescription {
            uid: blueprint.map_or(0, uid_of),
            type_id: type_id(described, blueprint, version).to_owned(),
            attributes: attributes(blueprint, &described.attributes, version),
        },
        bounding_box: BoundingBox {
            location: Location::of(described.box_centre_m),
            extent: Vector3D::size(described.box_half_extent_m),
            rotation: Rotation::default(),
            actor_id: id,
        },
        semantic_tags: vec![described.tag],
        stream_token: Vec::new(),
    }
}

/// The id by which a client ordered an actor: clients of 0.10 send the one that they know in the
/// attribute `ros_name`.
fn type_id<'a>(
    described: &'a Described,
    blueprint: Option<&Blueprint>,
    version: ClientVersion,
) -> &'a str {
    let is_renamed = |name: &&str| {
        let is_same = |named: &Blueprint| blueprint.is_some_and(|one| one.id == named.id);
        blueprints::is_renamed_in_0_10(name) && blueprints::find(name).is_some_and(is_same)
    };
    let name = described.attributes.iter().find(|attribute| attribute.id == "ros_name");
    let name = name.map(|attribute| attribute.value.as_str()).filter(is_renamed);
    name.filter(|_| version.renames_vehicles()).unwrap_or(&described.blueprint)
}

fn attributes(
    blueprint: Option<&Blueprint>,
    given: &[Attribute],
    version: ClientVersion,
) -> Vec<AttributeValue> {
    let known = blueprint.map_or(&[][..], |blueprint| &blueprint.attributes);
    let value_of = |id: &str| given.iter().find(|attribute| attribute.id == id);
    let of_blueprint = known.iter().map(|attribute| AttributeValue {
        id: attribute.id.to_owned(),
        kind: version.attribute_kind(attribute.kind),
        value: value_of(attribute.id).map_or(&attribute.value, |given| &given.value).clone(),
    });
    let is_known = |attribute: &&Attribute| known.iter().any(|other| other.id == attribute.id);
    let further = given.iter().filter(|attribute| !is_known(attribute)).map(|attribute| {
        let (id, value) = (attribute.id.clone(), attribute.value.clone());
        AttributeValue { id, kind: version.attribute_kind(AttributeKind::String), value }
    });
    of_blueprint.chain(further).collect()
}

/// What stands in for scenery that was met, by semantic tag.
pub(crate) fn scenery(tag: u8) -> Actor {
    let type_id = format!("static.{}", tag_name(tag));
    let description = ActorDescription { uid: 0, type_id, attributes: Vec::new() };
    Actor { description, semantic_tags: vec![tag], ..Actor::default() }
}

/// CARLA's name of a semantic tag, in lower case.
fn tag_name(tag: u8) -> &'static str {
    const NAMES: [&str; 29] = [
        "none",
        "road",
        "sidewalk",
        "building",
        "wall",
        "fence",
        "pole",
        "trafficlight",
        "trafficsign",
        "vegetation",
        "terrain",
        "sky",
        "pedestrian",
        "rider",
        "car",
        "truck",
        "bus",
        "train",
        "motorcycle",
        "bicycle",
        "static",
        "dynamic",
        "other",
        "water",
        "roadline",
        "ground",
        "bridge",
        "railtrack",
        "guardrail",
    ];
    NAMES.get(usize::from(tag)).copied().unwrap_or("other")
}

/// Whether a blueprint sends a stream. Lane invasions are found by the client itself.
pub(crate) fn has_stream(type_id: &str) -> bool {
    type_id.starts_with("sensor.") && type_id != "sensor.other.lane_invasion"
}

#[cfg(test)]
mod tests {
    use schemas::{ActorId, ActorKind, Vec3};

    use super::*;

    #[test]
    fn every_value_parses_by_its_kind_or_the_client_refuses_the_library() {
        for definition in definitions(ClientVersion::V0_9) {
            let blueprint = blueprints::find(&definition.id).unwrap();
            for attribute in &blueprint.attributes {
                assert!(
                    attribute.kind.accepts(&attribute.value),
                    "{} {}",
                    blueprint.id,
                    attribute.id
                );
            }
        }
    }

    #[test]
    fn clients_of_0_10_count_kinds_from_zero_and_know_fewer_sensors() {
        let [old, new] = [ClientVersion::V0_9, ClientVersion::V0_10].map(definitions);
        let renamed = blueprints::renamed_in_0_10().count();
        assert_eq!((old.len() - 3, renamed), (new.len() - renamed, 15));
        for told in new {
            let id = &blueprints::find(&told.id).unwrap().id;
            let same = old.iter().find(|definition| definition.id == *id).unwrap();
            assert_eq!(same.uid, told.uid);
            for (told, same) in told.attributes.iter().zip(&same.attributes) {
                assert_eq!((&told.id, told.kind + 1), (&same.id, same.kind));
            }
        }
        assert_eq!(recorded_kind("vehicle.lincoln.mkz", "number_of_wheels"), 2);
        assert_eq!(recorded_kind("vehicle.lincoln.mkz", "unheard_of"), 4);
    }

    #[test]
    fn clients_of_0_10_are_told_the_id_that_they_ordered() {
        let ordered = |id: &str, version| {
            let known = definitions(ClientVersion::V0_10).iter();
            let definition = known.clone().find(|definition| definition.id == id).unwrap();
            let given = |one: &ActorAttribute| AttributeValue {
                id: one.id.clone(),
                kind: one.kind,
                value: one.value.clone(),
            };
            let description = ActorDescription {
                uid: definition.uid,
                type_id: id.to_owned(),
                attributes: definition.attributes.iter().map(given).collect(),
            };
            let (blueprint, attributes) = order(&description).unwrap();
            let described = Described {
                id: ActorId::new(1).unwrap(),
                attachment: None,
                kind: ActorKind::Vehicle,
                blueprint: blueprint.id.clone(),
                attributes,
                box_centre_m: Vec3::zeros(),
                box_half_extent_m: Vec3::zeros(),
                tag: 14,
                signal: None,
            };
            actor(&described, version).description.type_id
        };
        for (id, old) in [
            ("vehicle.mini.cooper", "vehicle.mini.cooper_s_2021"),
            ("vehicle.mini.cooper_s_2021", "vehicle.mini.cooper_s_2021"),
            ("vehicle.ue4.audi.tt", "vehicle.audi.tt"),
            ("vehicle.nissan.patrol", "vehicle.nissan.patrol"),
        ] {
            assert_eq!(ordered(id, ClientVersion::V0_10), id);
            assert_eq!(ordered(id, ClientVersion::V0_9), old);
        }
    }

    #[test]
    fn defaults_are_left_out_and_nonsense_is_refused() {
        let with = |id: &str, value: &str| ActorDescription {
            uid: 0,
            type_id: "vehicle.lincoln.mkz".to_owned(),
            attributes: vec![AttributeValue {
                id: id.to_owned(),
                kind: 4,
                value: value.to_owned(),
            }],
        };
        for role in ["hero", "autopilot"] {
            let (_, attributes) = order(&with("role_name", role)).unwrap();
            assert_eq!(attributes[0].value, role);
        }
        let (_, attributes) = order(&with("sticky_control", "true")).unwrap();
        assert_eq!(attributes, []);
        let (_, attributes) = order(&with("sticky_control", "False")).unwrap();
        assert_eq!(attributes[0].value, "false");
        assert!(order(&with("sticky_control", "perhaps")).is_err());
        let camera = ActorDescription {
            type_id: "sensor.camera.rgb".to_owned(),
            ..with("picture_quality", "best")
        };
        let refusal = order(&camera).unwrap_err().0;
        assert!(refusal.ends_with("\"best\": wanted one of site, low, high"), "{refusal}");
        let unknown = ActorDescription { type_id: "vehicle.no".to_owned(), ..Default::default() };
        assert!(order(&unknown).unwrap_err().0.contains("invalid actor description"));
    }
}
