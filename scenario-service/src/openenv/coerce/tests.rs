use proptest::prelude::*;
use serde_json::{Value, json};

use super::*;

fn parse(value: Value) -> Result<Action, Vec<FieldError>> {
    let Value::Object(object) = value else { panic!("the test wants an object") };
    action(&object)
}

fn kinds(value: Value) -> Vec<(&'static str, Value)> {
    parse(value).unwrap_err().into_iter().map(|e| (e.kind, Value::Array(e.loc))).collect()
}

#[test]
fn an_empty_object_is_an_observe_with_the_defaults() {
    let action = parse(json!({})).unwrap();
    assert_eq!(action.kind, ActionKind::Observe);
    assert_eq!((action.throttle, action.target_speed_kmh, action.route_steps), (0.0, None, None));
}

#[test]
fn numbers_are_read_from_texts_and_booleans() {
    let action = parse(json!({
        "action_type": "control", "throttle": " 0.5 ", "steer": "-1e-1", "brake": true,
        "route_steps": "2.0", "target_speed_kmh": 30, "destination_x": "-12.5"
    }))
    .unwrap();
    assert_eq!((action.throttle, action.steer, action.brake), (0.5, -0.1, 1.0));
    assert_eq!((action.route_steps, action.target_speed_kmh), (Some(2), Some(30.0)));
    assert_eq!(action.destination_x, Some(-12.5));
    for (input, value) in [(json!(2.0), 2), (json!("3"), 3), (json!(true), 1)] {
        assert_eq!(parse(json!({ "route_steps": input })).unwrap().route_steps, Some(value));
    }
}

#[test]
fn numbers_in_texts_are_written_as_in_python() {
    for (text, value) in [("1_0", 10.0), ("1_0.5", 10.5), ("+1_0.0_0", 10.0), (" 1e0_1\n", 10.0)] {
        let action = parse(json!({ "target_speed_kmh": text })).unwrap();
        assert_eq!(action.target_speed_kmh, Some(value), "{text}");
    }
    for (text, value) in [("1_0", 10), ("+1_0.00", 10), ("007", 7), (" 3 ", 3)] {
        assert_eq!(parse(json!({ "route_steps": text })).unwrap().route_steps, Some(value));
    }
    for text in ["_1", "1_", "1__0", "", "_"] {
        assert_eq!(kinds(json!({ "destination_x": text }))[0].0, "float_parsing", "{text}");
        assert_eq!(kinds(json!({ "route_steps": text }))[0].0, "int_parsing", "{text}");
    }
    for text in ["1e3", "1.", ".0", "1.0_0", "+_1", "++1"] {
        assert_eq!(kinds(json!({ "route_steps": text }))[0].0, "int_parsing", "{text}");
    }
}

#[test]
fn null_is_allowed_only_where_the_type_says_so() {
    assert!(
        parse(json!({
            "lane_direction": null, "target_speed_kmh": null, "brake_intensity": null,
            "target_lane_id": null, "navigation_behavior": null, "destination_x": null,
            "destination_y": null, "destination_z": null, "route_steps": null
        }))
        .is_ok()
    );
    assert_eq!(
        kinds(json!({ "metadata": null, "action_type": null, "throttle": null })),
        [
            ("dict_type", json!(["metadata"])),
            ("literal_error", json!(["action_type"])),
            ("float_type", json!(["throttle"]))
        ]
    );
}

#[test]
fn a_bound_error_names_the_bound_in_the_reference_form() {
    let errors = parse(json!({ "action_type": "control", "throttle": 2 })).unwrap_err();
    assert_eq!(
        serde_json::to_value(&errors).unwrap(),
        json!([{ "type": "less_than_equal", "loc": ["throttle"],
            "msg": "Input should be less than or equal to 1", "input": 2, "ctx": { "le": 1.0 } }])
    );
    let errors = parse(json!({ "steer": -1.5 })).unwrap_err();
    assert_eq!(errors[0].msg, "Input should be greater than or equal to -1");
    assert_eq!(errors[0].ctx, Some(json!({ "ge": -1.0 })));
}

#[test]
fn errors_come_in_field_order_and_unknown_members_last() {
    assert_eq!(
        kinds(json!({
            "zzz": 1, "route_steps": 1.5, "lane_direction": 5, "brake": "x", "steer": [], "aaa": {}
        })),
        [
            ("float_type", json!(["steer"])),
            ("float_parsing", json!(["brake"])),
            ("string_type", json!(["lane_direction"])),
            ("int_from_float", json!(["route_steps"])),
            ("extra_forbidden", json!(["zzz"])),
            ("extra_forbidden", json!(["aaa"])),
        ]
    );
}

#[test]
fn seeds_are_exact_and_those_that_64_bits_cannot_hold_are_refused() {
    for (input, wanted) in [
        (json!(0), 0),
        (json!(7.0), 7),
        (json!(u64::MAX), u64::MAX),
        (json!("9007199254740993"), 9_007_199_254_740_993),
        (json!("18_446_744_073_709_551_615"), u64::MAX),
        (json!(true), 1),
    ] {
        assert_eq!(seed("seed", &input), Ok(wanted), "{input}");
    }
    for input in [json!(18_446_744_073_709_551_616.0), json!(1e30), json!("18446744073709551616")] {
        let refused = seed("seed", &input).unwrap_err();
        assert_eq!((refused.kind, refused.input), ("less_than_equal", input));
        assert!(refused.msg.ends_with("18446744073709551615"), "{}", refused.msg);
    }
    assert_eq!(seed("seed", &json!(-1)).unwrap_err().kind, "greater_than_equal");
    assert_eq!(seed("seed", &json!("x")).unwrap_err().kind, "int_parsing");
}

#[test]
fn integers_refuse_what_is_not_integral() {
    for (input, kind) in [
        (json!(0), "greater_than_equal"),
        (json!(-3), "greater_than_equal"),
        (json!("2.5"), "int_parsing"),
        (json!("x"), "int_parsing"),
        (json!([]), "int_type"),
        (json!("inf"), "finite_number"),
    ] {
        let found = kinds(json!({ "route_steps": input.clone() }));
        let expected = if input == json!("inf") { "int_parsing" } else { kind };
        assert_eq!(found, [(expected, json!(["route_steps"]))], "{input}");
    }
}

#[test]
fn not_a_number_misses_the_upper_bound_and_no_destination_is_infinite() {
    assert_eq!(kinds(json!({ "throttle": "NaN" })), [("less_than_equal", json!(["throttle"]))]);
    assert_eq!(
        kinds(json!({ "destination_x": "Infinity" })),
        [("finite_number", json!(["destination_x"]))]
    );
}

#[test]
fn the_literal_error_lists_every_verb() {
    let errors = parse(json!({ "action_type": "fly" })).unwrap_err();
    assert_eq!(
        errors[0].msg,
        "Input should be 'control', 'emergency_stop', 'brake_vehicle', 'maintain_speed', \
         'lane_change', 'observe', 'init_navigation_agent', 'set_destination', 'follow_route' or \
         'capture_image'"
    );
}

#[test]
fn a_large_input_is_cut_before_it_is_sent_back() {
    let errors = parse(json!({ "throttle": "x".repeat(100_000) })).unwrap_err();
    assert_eq!(errors[0].input.as_str().unwrap().len(), ECHO_CHARS_MAX);
    let many: Map<String, Value> = (0..10_000).map(|i| (format!("k{i}"), json!(i))).collect();
    assert_eq!(action(&many).unwrap_err().len(), FIELD_ERRORS_MAX);
}

fn any_json() -> impl Strategy<Value = Value> {
    let leaf = prop_oneof![
        Just(Value::Null),
        any::<bool>().prop_map(Value::from),
        any::<i64>().prop_map(Value::from),
        any::<f64>().prop_map(Value::from),
        ".{0,12}".prop_map(Value::from),
        "[-+0-9.eE]{0,6}".prop_map(Value::from),
    ];
    leaf.prop_recursive(3, 16, 4, |inner| {
        prop_oneof![
            prop::collection::vec(inner.clone(), 0..4).prop_map(Value::from),
            prop::collection::btree_map(".{0,6}", inner, 0..4)
                .prop_map(|map| Value::Object(map.into_iter().collect())),
        ]
    })
}

fn field_name() -> impl Strategy<Value = String> {
    prop_oneof![
        prop::sample::select(vec![
            "metadata",
            "action_type",
            "throttle",
            "steer",
            "brake",
            "lane_direction",
            "target_speed_kmh",
            "brake_intensity",
            "target_lane_id",
            "navigation_behavior",
            "destination_x",
            "destination_y",
            "destination_z",
            "route_steps",
        ])
        .prop_map(str::to_owned),
        ".{0,6}",
    ]
}

proptest! {
    #[test]
    fn any_object_is_an_action_in_its_bounds_or_a_list_of_errors(
        object in prop::collection::btree_map(field_name(), any_json(), 0..15)
    ) {
        let object: Map<String, Value> = object.into_iter().collect();
        match action(&object) {
            Ok(action) => {
                prop_assert!((0.0..=1.0).contains(&action.throttle));
                prop_assert!((-1.0..=1.0).contains(&action.steer));
                prop_assert!(action.destination_x.is_none_or(f64::is_finite));
                prop_assert!(action.route_steps.is_none_or(|steps| steps >= 1));
            }
            Err(errors) => prop_assert!(!errors.is_empty()),
        }
    }
}
