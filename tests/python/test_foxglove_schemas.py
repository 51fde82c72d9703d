"""Fields of the schemas in MCAP files, against those that Foxglove publishes."""

import importlib
import json

from google.protobuf import descriptor

from test_mcap_exports import exported, recording  # noqa: F401

# Messages of protobuf that Foxglove's JSON has as objects of these fields.
TIMES = {
    "google.protobuf.Timestamp": {"sec", "nsec"},
    "google.protobuf.Duration": {"sec", "nsec"},
}


def published(name: str) -> descriptor.Descriptor:
    """A message of Foxglove's package, as `foxglove.SceneUpdate`."""
    short = name.removeprefix("foxglove.")
    module = importlib.import_module(f"foxglove_schemas_protobuf.{short}_pb2")
    return module.DESCRIPTOR.message_types_by_name[short]


def unknown(schema: dict, message: descriptor.Descriptor, at: str) -> list[str]:
    """Properties of a schema that are no fields of the message, also of those within."""
    found = []
    # Of what is never written the fields are not told.
    for name, inner in schema.get("properties", {}).items():
        place = f"{at}.{name}"
        if message.full_name in TIMES:
            found += [] if name in TIMES[message.full_name] else [place]
            continue
        field = message.fields_by_name.get(name)
        if field is None:
            found.append(place)
            continue
        one = inner["items"] if inner.get("type") == "array" else inner
        if one.get("type") == "object":
            if field.message_type is None:
                found.append(place)
            else:
                found += unknown(one, field.message_type, place)
        elif field.message_type is not None:
            found.append(place)
    return found


def test_every_field_is_one_of_foxgloves(recording, tmp_path):  # noqa: F811
    _, _, _, ids = recording
    cameras = ("--camera", "chase", "--camera", ids["camera"], "--picture-size", "160x90")
    file = exported(recording, tmp_path, "--sensors", "--boxes", *cameras)
    schemas = {schema.name: schema for _, schema in file.schemas.values()}
    ours = {name for name in schemas if name.startswith("foxglove.")}
    assert len(ours) >= 10, ours
    for name in sorted(ours):
        schema = json.loads(schemas[name].data)
        assert schema["properties"], name
        assert unknown(schema, published(name), name) == []


def test_a_field_that_foxglove_does_not_have_is_found():
    colour = {"type": "object", "properties": {"r": {}, "alpha": {}}}
    wrong = {"properties": {"entities": {"type": "array", "items": {"properties": {"hue": {}}}}}}
    wrong["properties"]["entities"]["items"]["type"] = "object"
    assert unknown(colour, published("foxglove.Color"), "colour") == ["colour.alpha"]
    assert unknown(wrong, published("foxglove.SceneUpdate"), "scene") == ["scene.entities.hue"]
