use super::*;

const WHOLE: &str = r#"
about = "A test."
ends = ["arrived", "red_light"]
[way]
length_m = { Town01 = [60, 250], other = [50, 150] }
turns = [{ degrees = [60, 120], count = [1, 2], side = "left" }]
[time]
mean_kmh = 36
more_secs = 5
[start]
speed_mps = [0, 8]
beside_m = 0.1
turned_rad = 0
[others]
cars = { Town01 = 20, other = 15 }
lights = true
[weathers]
training = ["ClearNoon", "WetNoon"]
[reward]
progress = 2
"#;

#[test]
fn every_task_can_be_read_and_says_what_it_is() {
    for (name, _) in TASKS {
        let task = Task::named(name).unwrap();
        assert_eq!(task.name, name);
        assert!(task.about.ends_with('.') && task.ends.contains(&End::Arrived), "{name}");
    }
    let error = Task::named("fly").unwrap_err().to_string();
    assert!(error.contains("corl17-straight"), "{error}");
}

#[test]
fn a_task_is_what_its_text_says() {
    let task = Task::parse("mine", WHOLE).unwrap();
    assert_eq!(*task.way.length_m.of("Town01_Opt"), (60.0, 250.0));
    assert_eq!(*task.way.length_m.of("Town07"), (50.0, 150.0));
    assert_eq!(task.limit_secs(100.0), 15.0);
    assert_eq!((*task.others.cars.of("Town02"), *task.others.walkers.of("Town02")), (15, 0));
    assert_eq!(task.ends, [End::Arrived, End::RedLight]);
    let bends = |turn: f32| Bends { junctions_rad: vec![turn], elsewhere_rad: 0.0 };
    assert!(task.way.fits(&bends(1.5)) && !task.way.fits(&bends(-1.5)), "to the left alone");
}

#[test]
fn what_cannot_be_is_refused_with_its_place() {
    for (from, to, words) in [
        ("mean_kmh = 36", "mean_kmh = 0", "time.mean_kmh is out of range; wanted 0.1 to 500"),
        ("mean_kmh = 36", "mean_kmh = \"fast\"", "line 8"),
        ("more_secs = 5", "mores = 5", "unknown field `mores`"),
        ("[60, 120], count", "[120, 60], count", "degrees of way.turns is out of order"),
        ("side = \"left\"", "side = \"up\"", "unknown variant `up`"),
        (", other = [50, 150] }", " }", "`other` towns is missing"),
        ("cars = { Town01 = 20, other = 15 }", "cars = 5000", "others.cars is out of range"),
        ("\"WetNoon\"", "\"Snow\"", "weathers.training: there is no such weather"),
        ("training = [", "trained = [", "unknown field `trained`"),
        ("progress = 2", "fame = 2", "there is no such term"),
        ("\"red_light\"", "\"sunset\"", "unknown variant `sunset`"),
        ("beside_m = 0.1", "beside_m = nan", "start.beside_m is out of range"),
    ] {
        assert!(WHOLE.contains(from), "{from}");
        let error = Task::parse("mine", &WHOLE.replace(from, to)).unwrap_err().to_string();
        assert!(error.contains(words) && error.contains("task mine"), "{to}: {error}");
    }
    let long = format!("# {}", "x".repeat(limits::TASK_BYTES_MAX));
    assert!(Task::parse("mine", &long).unwrap_err().to_string().contains("too large"));
}
