"""The blueprint library as CARLA's own client reads it, and what actors keep of it."""

import carla
import pytest

from carla_site import spawn_car

KIND = carla.ActorAttributeType
# Of a vehicle: type, whether it can be set.
OF_VEHICLES = {
    "role_name": (KIND.String, True),
    "ros_name": (KIND.String, True),
    "sticky_control": (KIND.Bool, True),
    "terramechanics": (KIND.Bool, True),
    "object_type": (KIND.String, False),
    "base_type": (KIND.String, False),
    "special_type": (KIND.String, False),
    "number_of_wheels": (KIND.Int, False),
    "generation": (KIND.Int, False),
    "has_lights": (KIND.Bool, False),
    "has_dynamic_doors": (KIND.Bool, False),
}


@pytest.fixture(scope="module")
def library(site):
    from carla_site import fresh

    return fresh(site.carla_port).get_world().get_blueprint_library()


def ids(blueprints) -> list[str]:
    return sorted(blueprint.id for blueprint in blueprints)


def text(attribute: carla.ActorAttribute) -> str:
    """Its value, whatever its type."""
    return str(attribute).split("value=")[1].removesuffix(")").removesuffix("(const)")


def test_the_library_is_found_and_filtered(library):
    assert len(library) > 200
    assert library.find("vehicle.tesla.model3").id == "vehicle.tesla.model3"
    assert len(library.filter("sensor.camera.*")) == 8
    assert ids(library.filter("vehicle.*")) == ids(library.filter("vehicle"))
    assert ids(library.filter("*model3*")) == ["vehicle.tesla.model3"]
    assert ids(library.filter("vehicle.*").filter("*audi*")) == [
        "vehicle.audi.a2",
        "vehicle.audi.etron",
        "vehicle.audi.tt",
    ]
    assert ids(library[at] for at in range(len(library))) == ids(library)
    assert ids(library.filter("*")) == ids(library)
    filtered = [[one.id for one in library.filter("*")] for _ in range(2)]
    assert filtered[0] == filtered[1]
    with pytest.raises(IndexError, match=r"vehicle\.nope"):
        library.find("vehicle.nope")
    with pytest.raises(IndexError):
        library[len(library)]


def test_the_library_is_filtered_by_attribute(library):
    emergency = library.filter_by_attribute("special_type", "emergency")
    assert ids(emergency) == [
        "vehicle.carlamotors.firetruck",
        "vehicle.dodge.charger_police",
        "vehicle.dodge.charger_police_2020",
        "vehicle.ford.ambulance",
    ]
    two_wheels = library.filter_by_attribute("number_of_wheels", "2")
    kinds = {str(one.get_attribute("base_type")) for one in two_wheels}
    assert len(two_wheels) == 7 and len(kinds) == 2
    assert len(library.filter_by_attribute("gender", "female")) > 10
    assert len(library.filter_by_attribute("gender", "neither")) == 0


def test_a_blueprint_is_matched_by_its_tags(library):
    blueprint = library.find("vehicle.tesla.model3")
    assert sorted(blueprint.tags) == ["model3", "tesla", "vehicle"]
    assert blueprint.has_tag("tesla") and not blueprint.has_tag("tes")
    assert blueprint.match_tags("vehicle.*") and blueprint.match_tags("tes*")
    assert not blueprint.match_tags("walker.*")


def test_every_vehicle_has_carlas_attributes(library):
    for blueprint in library.filter("vehicle.*"):
        for name, (kind, modifiable) in OF_VEHICLES.items():
            attribute = blueprint.get_attribute(name)
            assert (attribute.type, attribute.is_modifiable) == (kind, modifiable), blueprint.id
            assert bool(attribute.recommended_values) == modifiable, (blueprint.id, name)
        assert text(blueprint.get_attribute("role_name")) == "autopilot"
        assert blueprint.get_attribute("number_of_wheels").as_int() in (2, 4, 6)
        if blueprint.has_attribute("color"):
            colour = blueprint.get_attribute("color")
            red, green, blue = (int(part) for part in colour.recommended_values[0].split(","))
            assert colour.as_color() == carla.Color(red, green, blue)


def test_every_value_is_the_first_recommended_one(library):
    for blueprint in library:
        for attribute in blueprint:
            if not attribute.is_modifiable:
                continue
            first = attribute.recommended_values[0]
            if attribute.type == KIND.Bool:
                assert attribute.as_bool() == (first == "true")
            elif attribute.type == KIND.Int:
                assert attribute.as_int() == int(first)
            elif attribute.type == KIND.Float:
                assert attribute.as_float() == pytest.approx(float(first))
            elif attribute.type == KIND.String:
                assert attribute.as_str() == first


def test_walkers_say_how_fast_they_walk_and_run(library):
    walkers = library.filter("walker.pedestrian.*")
    assert len(walkers) == 52
    for walker in walkers:
        still, walk, run = map(float, walker.get_attribute("speed").recommended_values)
        assert still == 0.0 < walk < run
        assert walker.get_attribute("age").as_str() in ("adult", "child", "teenager")
        assert walker.get_attribute("gender").as_str() in ("male", "female")
        assert walker.get_attribute("is_invincible").as_bool()


def test_values_convert_by_their_type_and_not_otherwise(library):
    camera = library.find("sensor.camera.rgb")
    camera.set_attribute("image_size_x", "320")
    camera.set_attribute("fov", "75.5")
    camera.set_attribute("enable_postprocess_effects", "False")
    assert camera.get_attribute("image_size_x").as_int() == 320
    assert camera.get_attribute("fov").as_float() == 75.5
    assert not camera.get_attribute("enable_postprocess_effects").as_bool()
    with pytest.raises(RuntimeError, match="bad attribute cast"):
        camera.get_attribute("image_size_x").as_float()
    with pytest.raises(RuntimeError, match="bad attribute cast"):
        camera.get_attribute("fov").as_bool()


def test_what_cannot_be_set_raises(library):
    car = library.find("vehicle.tesla.model3")
    with pytest.raises(ValueError, match="read-only"):
        car.set_attribute("number_of_wheels", "3")
    with pytest.raises(IndexError, match="nope"):
        car.set_attribute("nope", "1")
    with pytest.raises(IndexError, match="nope"):
        car.get_attribute("nope")
    with pytest.raises(ValueError, match="3 channels"):
        car.set_attribute("color", "red")
    assert not car.has_attribute("nope")


def test_an_actor_keeps_the_attributes_of_its_blueprint(world):
    library = world.get_blueprint_library()
    place = world.get_map().get_spawn_points()[0]
    for id in ("vehicle.tesla.model3", "sensor.other.imu", "static.prop.constructioncone"):
        blueprint = library.find(id)
        actor = world.spawn_actor(blueprint, place)
        assert set(actor.attributes) == {attribute.id for attribute in blueprint}
        for attribute in blueprint:
            value = actor.attributes[attribute.id]
            if attribute.is_modifiable:
                assert value == attribute.recommended_values[0], attribute.id
            else:
                assert value.lower() == text(attribute).lower(), attribute.id
        actor.destroy()
    painted = spawn_car(world, 1, color="1,2,3", role_name="ego_vehicle")
    assert painted.attributes["color"] == "1,2,3"
    assert painted.attributes["role_name"] == "ego_vehicle"
