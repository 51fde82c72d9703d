//! Turns of lights.

use std::collections::BTreeSet;

use schemas::{Command, TrafficLightColour as Colour, TrafficLightCommand};

use crate::support::{colour, first_group, light, roads, run, set_colour, world};

#[test]
fn a_turn_is_10_s_green_3_s_yellow_and_2_s_red_to_the_tick() {
    let mut world = world();
    let [first, next] = first_group(&world);
    let mut changes = Vec::new();
    let mut before = [colour(&world, first[0]), colour(&world, next[0])];
    for tick in 1..=310 {
        world.tick().unwrap();
        let now = [colour(&world, first[0]), colour(&world, next[0])];
        if now != before {
            changes.push((tick, now));
        }
        before = now;
        assert!(now.contains(&Colour::Red), "two turns at once at {tick}");
    }
    use Colour::{Green, Red, Yellow};
    assert_eq!(changes, [(200, [Yellow, Red]), (260, [Red, Red]), (300, [Red, Green])]);
}

#[test]
fn lights_of_one_controller_show_the_same_and_every_controller_gets_its_turn() {
    let mut world = world();
    let lights = roads().traffic_lights();
    let mut green: BTreeSet<usize> = BTreeSet::new();
    for _ in 0..60 {
        run(&mut world, 20);
        let frame = world.frame();
        for (index, controller) in lights.controllers.iter().enumerate() {
            let shown: Vec<Colour> =
                controller.lights.iter().map(|l| frame.traffic_lights[*l].colour).collect();
            assert!(shown.windows(2).all(|pair| pair[0] == pair[1]), "{shown:?}");
            if shown[0] == Colour::Green {
                green.insert(index);
            }
        }
    }
    assert_eq!(green.len(), lights.controllers.len());
}

#[test]
fn frozen_lights_stay_and_go_on_where_they_were() {
    let mut world = world();
    let [first, _] = first_group(&world);
    run(&mut world, 150);
    world.apply(&Command::TrafficLight(TrafficLightCommand::Freeze { frozen: true })).unwrap();
    run(&mut world, 400);
    let frozen = light(&world, first[0]);
    assert!(frozen.frozen && frozen.colour == Colour::Green, "{frozen:?}");
    assert!((frozen.elapsed_secs - 7.5).abs() < 1.0e-3, "{frozen:?}");
    world.apply(&Command::TrafficLight(TrafficLightCommand::Freeze { frozen: false })).unwrap();
    run(&mut world, 49);
    assert_eq!(colour(&world, first[0]), Colour::Green);
    run(&mut world, 1);
    assert_eq!(colour(&world, first[0]), Colour::Yellow);
}

#[test]
fn a_reset_group_begins_anew_and_others_go_on() {
    let mut world = world();
    let [first, next] = first_group(&world);
    let other = world.frame().traffic_lights.iter().find(|l| l.group == 1).unwrap().actor;
    run(&mut world, 310);
    assert_eq!(colour(&world, next[0]), Colour::Green);
    let elsewhere = light(&world, other);
    world
        .apply(&Command::TrafficLight(TrafficLightCommand::Reset { actor: Some(next[0]) }))
        .unwrap();
    assert_eq!(colour(&world, first[0]), Colour::Green);
    assert_eq!((colour(&world, next[0]), light(&world, first[0]).elapsed_secs), (Colour::Red, 0.0));
    assert_eq!(light(&world, other), elsewhere);
    run(&mut world, 199);
    assert_eq!(colour(&world, first[0]), Colour::Green);
    run(&mut world, 1);
    assert_eq!(colour(&world, first[0]), Colour::Yellow);
    world.apply(&Command::TrafficLight(TrafficLightCommand::Reset { actor: None })).unwrap();
    assert!(world.frame().traffic_lights.iter().all(|light| light.elapsed_secs == 0.0));
}

#[test]
fn a_light_shows_what_it_is_told_until_its_turn_and_its_times_are_its_controllers() {
    let mut world = world();
    let [first, next] = first_group(&world);
    world.apply(&set_colour(next[0], Colour::Off)).unwrap();
    let times = Command::TrafficLight(TrafficLightCommand::Set {
        actor: first[0],
        colour: None,
        green_secs: Some(1.0),
        yellow_secs: Some(0.5),
        red_secs: Some(0.25),
    });
    world.apply(&times).unwrap();
    for actor in &first {
        let light = light(&world, *actor);
        assert_eq!((light.green_secs, light.yellow_secs, light.red_secs), (1.0, 0.5, 0.25));
    }
    assert_eq!(light(&world, next[0]).green_secs, 10.0);
    run(&mut world, 34);
    assert_eq!((colour(&world, first[0]), colour(&world, next[0])), (Colour::Red, Colour::Off));
    run(&mut world, 1);
    assert_eq!(colour(&world, next[0]), Colour::Green);
}
