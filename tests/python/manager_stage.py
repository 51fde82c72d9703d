"""A motorway on which CARLA's Traffic Manager is tried, and what is measured there."""

import carla

from carla_site import spawn_at

TOWN = "Town04"
#: A motorway of this town: lanes -2 to -5 from left to right, 0.9 km, limit 70 km/h.
MOTORWAY = 12
MIDDLE_LANE = -3
SPEED_KMH = 36.0
SETTLE_TICKS = 160


class Stage:
    """A world on the motorway's town and the Traffic Manager that drives in it."""

    def __init__(self, client: carla.Client, world: carla.World, port: int, client_port: int = 0):
        self.client = client
        self.client_port = client_port
        self.world = world
        self.town = world.get_map()
        self.port = port
        self.manager = client.get_trafficmanager(port)
        self.manager.set_synchronous_mode(True)
        self.manager.set_random_device_seed(7)
        self.cars = []

    def car(self, at_m: float, lane: int = MIDDLE_LANE, driven: bool = True, **attributes: str):
        """A car on the motorway; driven ones keep to 36 km/h and to their lane."""
        place = self.town.get_waypoint_xodr(MOTORWAY, lane, at_m)
        return self.car_at(place, driven, **attributes)

    def car_at(self, place: carla.Waypoint, driven: bool = True, **attributes: str):
        car = spawn_at(self.world, place, **attributes)
        self.cars.append(car)
        if driven:
            self.drive(car)
        return car

    def drive(self, car: carla.Vehicle) -> None:
        car.set_autopilot(True, self.port)
        self.manager.auto_lane_change(car, False)
        self.manager.set_desired_speed(car, SPEED_KMH)

    def clear(self) -> None:
        for car in self.cars:
            car.set_autopilot(False, self.port)
        self.world.tick()
        destroy = [carla.command.DestroyActor(car) for car in self.cars]
        self.client.apply_batch_sync(destroy, True)
        self.cars = []

    def lane(self, car: carla.Vehicle) -> int:
        return self.town.get_waypoint(car.get_location()).lane_id

    def lanes(self, car: carla.Vehicle, count: int) -> list[int]:
        """The lanes that a car is on in the next ticks, without repetition."""
        seen = [self.lane(car)]
        for _ in range(count):
            self.world.tick()
            lane = self.lane(car)
            if lane != seen[-1]:
                seen.append(lane)
        return seen

    def right_of_middle(self, car: carla.Vehicle) -> float:
        """How far a car is to the right of the middle of its lane, in metres."""
        lane = self.town.get_waypoint(car.get_location()).transform
        away = car.get_location() - lane.location
        right = lane.get_right_vector()
        return away.x * right.x + away.y * right.y


def speed_kmh(car: carla.Vehicle) -> float:
    return 3.6 * car.get_velocity().length()


def gap_m(behind: carla.Vehicle, ahead: carla.Vehicle) -> float:
    """Between the bumpers."""
    middle_m = behind.get_location().distance(ahead.get_location())
    return middle_m - behind.bounding_box.extent.x - ahead.bounding_box.extent.x


def fork_of(town: carla.Map) -> dict:
    """A place 30 m before a junction with ways in at least two directions, and these.

    It is some metres behind the junction before, too.
    """
    for place in town.generate_waypoints(7.0):
        ahead = place.next(30.0)
        if any(step.is_junction for step in place.previous(5.0)):
            continue
        if place.is_junction or any(step.is_junction for step in place.next(25.0)):
            continue
        if len(ahead) < 2 or not all(step.is_junction for step in ahead):
            continue
        ways = set()
        for step in ahead:
            end = step
            while end.is_junction:
                end = end.next(2.0)[0]
            turn = end.transform.rotation.yaw - place.transform.rotation.yaw
            turn = (turn + 180.0) % 360.0 - 180.0
            ways.add("Straight" if abs(turn) < 45.0 else "Right" if turn > 0.0 else "Left")
        if {"Left", "Right"} <= ways:
            return {"before": place, "ways": ways}
    raise LookupError("no junction to turn at")


def travelled(world: carla.World, car: carla.Vehicle, count: int) -> float:
    way_m, last = 0.0, None
    for _ in range(count):
        world.tick()
        at = car.get_location()
        way_m += at.distance(last) if last else 0.0
        last = at
    return way_m
