// Radiance of roads, sidewalks, lawns, roofs. Appended to arriving.

// Part of the sky that is seen from level ground among what stands on it: beside a wall that is `h`
// high, at `s` from it, all but (1 - s / sqrt(s * s + h * h)) / 2; below an underside alike, with
// the gap for the height.
fn open_sky(world: vec3<f32>) -> f32 {
    var open = 1.0;
    for (var at = 0u; at < views[view].lists.w; at++) {
        let occluder = occluders[views[view].lists.z + at];
        let beside = world - occluder.place.xyz;
        let height = occluder.place.w;
        let ahead = occluder.ahead_half.xy;
        let sides = vec2<f32>(dot(beside.xy, ahead), beside.y * ahead.x - beside.x * ahead.y);
        let beyond = abs(sides) - occluder.ahead_half.zw;
        let outside = length(max(beyond, vec2<f32>(0.0)));
        let inside = min(max(beyond.x, beyond.y), 0.0);
        let away = outside + inside;
        let wall = select(height, height * 0.15, inside < 0.0);
        let part = 0.5 * (1.0 - away / sqrt(away * away + wall * wall));
        let fades = clamp(1.0 - outside / (3.0 * height), 0.0, 1.0);
        let level = clamp(2.0 - abs(beside.z), 0.0, 1.0);
        open *= 1.0 - part * fades * level;
    }
    return open;
}

fn ground(in: Surface, direction: vec3<f32>, distance: f32) -> vec3<f32> {
    let normal = in.normal;
    let pattern = in.look.y;
    // Width of this pixel on level ground, in metres: detail finer than that fades out.
    let footprint = distance * views[view].left.w / max(abs(direction.z), 0.03);
    let at = in.world.xy;

    let broad = noise(at * 0.23);
    let grain_fade = clamp(1.0 - footprint * 16.0, 0.0, 1.0);
    let grain = (hash21(floor(at * 31.0)) - 0.5) * grain_fade;
    let middle_fade = clamp(1.0 - footprint * 0.8, 0.0, 1.0);
    let middle = (noise(at * 1.7) - 0.5) * middle_fade;

    // Joints: every metre and a half along kerbs, a grid on sidewalks.
    let is_paving = select(0.0, 1.0, pattern == 3.0);
    let is_kerb = select(0.0, 1.0, pattern == 2.0);
    let is_grass = select(0.0, 1.0, pattern == 4.0);
    let is_marking = select(0.0, 1.0, pattern == 1.0);
    let spacing = 1.5;
    let to_joint = abs(fract(at / spacing) - 0.5) * spacing;
    let reach = 0.5 * spacing - 0.022;
    let blur = max(footprint * 0.5, 0.004);
    let joints = smoothstep(vec2<f32>(reach - blur), vec2<f32>(reach + blur), to_joint);
    let joint_fade = clamp(1.0 - footprint * 1.2, 0.0, 1.0);
    let joint = max(joints.x, joints.y) * joint_fade * (is_paving + 0.6 * is_kerb);
    let slab = (hash21(floor(at / spacing + 0.5)) - 0.5) * is_paving * joint_fade;

    var vary = 1.0 + 0.30 * (broad - 0.5) + 0.22 * middle + 0.22 * grain + 0.20 * slab;
    vary = mix(vary, 1.0 + 0.75 * middle + 0.7 * grain + 0.55 * (broad - 0.5), is_grass);
    // Worn paint shows the road through.
    vary = mix(vary, 1.0 - 0.25 * max(middle + grain * 0.6, 0.0), is_marking);
    var albedo = in.colour.rgb * vary * (1.0 - 0.45 * joint);
    albedo = mix(albedo, albedo * vec3<f32>(1.25, 1.05, 0.7), is_grass * broad * 0.5);

    let wet = views[view].horizon.w * (1.0 - is_grass) * clamp(0.35 + broad, 0.0, 1.0);
    albedo *= 1.0 - 0.45 * wet;
    let light = arriving(in.world, normal, open_sky(in.world));
    let mirrored = reflect(direction, normal);
    let glance = 1.0 - max(dot(normal, -direction), 0.0);
    let glance2 = glance * glance;
    let shine = (0.02 + 0.5 * glance2 * glance2 * glance) * wet;
    let around = sky(mirrored) + streaks(in.world, mirrored) * 6.0;
    let colour = albedo * light.diffuse + around * shine;
    return colour;
}
