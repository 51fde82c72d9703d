use super::*;

fn course(task: &str, town: &str, agents: usize) -> Result<Course, Error> {
    let spec = Spec { task: task.to_owned(), town: town.to_owned(), agents, ..Spec::default() };
    let map = Map::parse(town, &roads::town::build(town).unwrap()).unwrap();
    Course::new(&spec, Arc::new(map))
}

/// The mean lengths of the paper's ways in Town01 are 200, 400 and 770 m.
#[test]
fn ways_are_as_long_as_the_task_says_and_enough_for_the_benchmark() {
    for town in ["Town01", "Town02"] {
        for task in ["corl17-straight", "corl17-one-turn", "corl17-navigation", "lane-keep"] {
            let course = course(task, town, 1).unwrap();
            let (shortest_m, longest_m) = *course.task.way.length_m.of(town);
            assert!(course.pair_count() >= 25, "{town} {task}: {}", course.pair_count());
            for length_m in course.lengths_m() {
                assert!((shortest_m..=longest_m).contains(&length_m), "{town} {task}: {length_m}");
            }
            let mean_m = course.lengths_m().sum::<f32>() / course.pair_count() as f32;
            println!("{town} {task}: {} pairs, mean {mean_m:.0} m", course.pair_count());
        }
    }
}

#[test]
fn towns_have_lanes_to_keep() {
    for town in ["Town03", "Town07"] {
        let course = course("lane-keep", town, 1).unwrap();
        println!("{town}: {} pairs", course.pair_count());
        assert!(course.pair_count() >= 25, "{town}");
    }
}

#[test]
fn starts_are_the_same_for_everybody_and_apart_from_each_other() {
    let (a, b) =
        (course("lane-keep", "Town02", 8).unwrap(), course("lane-keep", "Town02", 8).unwrap());
    for index in [0, 1, 17, STARTS - 1] {
        let (one, other) = (&a.start(index).agents, &b.start(index).agents);
        assert_eq!(one.len(), 8);
        for (place, same) in one.iter().zip(other) {
            assert_eq!((place.pose, place.speed_mps), (same.pose, same.speed_mps));
            assert!((0.0..=10.0).contains(&place.speed_mps));
            let way = place.route.abreast(place.pose.translation.x, place.pose.translation.y, 0);
            assert!(way.left_m.abs() < 0.7 && way.at_m < 1.0, "{way:?}");
        }
        for (index, place) in one.iter().enumerate() {
            let near = |other: &AgentStart| {
                (other.pose.translation.vector - place.pose.translation.vector).norm()
            };
            assert!(one[..index].iter().all(|other| near(other) > APART_M - 2.0));
        }
    }
}

#[test]
fn others_begin_apart_from_agents_and_as_many_as_the_task_says() {
    let course = course("corl17-traffic", "Town02", 1).unwrap();
    assert!(course.has_lights() && course.start_count() >= 32 && course.start_count() < STARTS);
    for index in 0..8 {
        let start = course.start(index);
        assert_eq!((start.cars.len(), start.walkers.len()), (15, 50));
        let own_m = start.agents[0].pose.translation.vector;
        for car in &start.cars {
            assert!((car.pose.translation.vector - own_m).norm() > 10.0);
        }
        for walker in &start.walkers {
            assert!((walker.foot_m - own_m).norm() > 3.0);
        }
    }
    let (one, other) = (&course.start(0).cars, &course.start(1).cars);
    assert!(one.iter().zip(other).any(|(a, b)| a.pose != b.pose), "each start has its own");
}

#[test]
fn a_town_too_small_for_the_agents_says_how_many_it_takes() {
    let error = course("corl17-straight", "Town02", 256).unwrap_err().to_string();
    assert!(error.contains("agents for corl17-straight"), "{error}");
}

#[test]
fn a_town_without_the_ways_of_a_task_is_refused_by_name() {
    for (task, town) in [("roundabout", "Town02"), ("merge", "Town01")] {
        let error = course(task, town, 1).unwrap_err().to_string();
        assert!(error.contains(task) && error.contains(town), "{error}");
    }
}

const ANY_WAY: &str = r#"
about = "Anywhere."
[way]
length_m = { other = [20, 200] }
[time]
mean_kmh = 10
more_secs = 10
[start]
speed_mps = [0, 0]
beside_m = 0
turned_rad = 0
[others]
lights = true
"#;

/// The lights of the map are those of the way straight on and of the way to the left.
#[test]
fn of_several_lights_at_one_line_that_of_the_own_way_holds() {
    let text = include_str!("../../../roads/tests/maps/fork.xodr");
    let map = Map::parse("fork", text).unwrap();
    let task = Task::parse("any", ANY_WAY).unwrap();
    let course = Course::of_task(&Spec::default(), task, Arc::new(map)).unwrap();
    let held = |pair: &Pair| pair.route.stop_after(0.0).map(|stop| (stop.at_m, stop.light));
    let crossing: Vec<_> =
        course.pairs.iter().filter_map(|pair| Some((pair, held(pair)?))).collect();
    for (pair, (at_m, light)) in &crossing {
        let wanted = usize::from(pair.route.goal().y_m > 20.0);
        assert_eq!(*light, wanted, "{:?}", pair.route.goal());
        assert_eq!(pair.route.stop_after(*at_m), None);
    }
    for light in [0, 1] {
        assert!(crossing.iter().any(|(_, (_, found))| *found == light), "none by light {light}");
    }
}
