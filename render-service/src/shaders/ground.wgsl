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

// Where a way enters a slab around 0 and where it leaves it, in steps of the way.
fn through(at: f32, step: f32, half: f32) -> vec2<f32> {
    let inverse = 1.0 / select(step, 1e-5, abs(step) < 1e-5);
    let one = (at + half) * inverse;
    let other = (at - half) * inverse;
    return vec2<f32>(-max(one, other), -min(one, other));
}

// What is seen of those that stand on the ground in a direction from a place on it; in the alpha, the
// part that is seen beside and above them. They are boxes whose upper end and upright edges are soft.
fn standing(world: vec3<f32>, direction: vec3<f32>) -> vec4<f32> {
    let level = sqrt(max(dot(direction.xy, direction.xy), 1e-6));
    let facing = max(-dot(direction.xy, views[view].to_light.xy) / level, 0.0);
    let bounce = views[view].bounce.rgb;
    let above = mix(views[view].horizon.rgb, views[view].zenith.rgb, 0.55) * 0.62 + bounce * views[view].direct.w;
    let lit = (above + bounce) * 0.5 + views[view].direct.rgb * (facing * 0.6);
    var seen = vec3<f32>(0.0);
    var rest = 1.0;
    for (var at = 0u; at < views[view].lists.w; at++) {
        let one = occluders[views[view].lists.z + at];
        let from_middle = world - one.place.xyz;
        let ahead = one.ahead_half.xy;
        let half = one.ahead_half.zw;
        let step = vec2<f32>(dot(direction.xy, ahead), direction.y * ahead.x - direction.x * ahead.y);
        let along = through(dot(from_middle.xy, ahead), step.x, half.x);
        let across = through(from_middle.y * ahead.x - from_middle.x * ahead.y, step.y, half.y);
        let enters = max(max(along.x, across.x), 0.0);
        let leaves = min(along.y, across.y);
        let way = (leaves - enters) * level / (0.6 * min(half.x, half.y));
        let high = (from_middle.z + direction.z * enters) / one.colour.w;
        let is_level = clamp(2.0 - abs(from_middle.z), 0.0, 1.0);
        let part = clamp(way, 0.0, 1.0) * clamp((1.0 - high) / 0.35, 0.0, 1.0) * is_level;
        let bright = mix(0.3, 1.0, clamp(high / 0.35, 0.0, 1.0));
        seen += lit * one.colour.rgb * (bright * part * rest);
        rest *= 1.0 - part;
    }
    return vec4<f32>(seen, rest);
}

fn ground(in: Surface, direction: vec3<f32>, distance: f32) -> vec3<f32> {
    let normal = in.normal;
    let pattern = in.look.y;
    // Width of this pixel on level ground, in metres: detail finer than that fades out.
    let footprint = distance * views[view].left.w / max(abs(direction.z), 0.03);
    let at = in.world.xy;

    let broad = noise(at * 0.23);
    let grain_fade = clamp(1.0 - footprint * 16.0, 0.0, 1.0);
    let fine = (noise(at.yx * 97.0) - 0.5) * clamp(1.0 - footprint * 50.0, 0.0, 1.0);
    let grain = (noise(at * 31.0) - 0.5 + 0.8 * fine) * 1.3 * grain_fade;
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
    var around = sky(mirrored);
    if wet > 0.0 {
        let things = standing(in.world, mirrored);
        around = around * things.a + things.rgb;
    }
    around += streaks(in.world, mirrored) * 6.0;
    let colour = albedo * light.diffuse + around * shine;
    return colour;
}
