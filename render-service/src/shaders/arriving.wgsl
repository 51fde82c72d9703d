// Light that arrives at a surface. Appended to light.

// 1 where the sun reaches a place of its map at this nearness, else 0.
fn passes(column: i32, row: i32, nearness: f32) -> f32 {
    let shadow = views[view].shadow;
    let last = i32(shadow.z) - 1;
    let place = u32(clamp(row, 0, last)) * shadow.z + u32(clamp(column, 0, last));
    let nearest = max(shadows[shadow.x + place], shadows[shadow.y + place]);
    return select(0.0, 1.0, nearest == 0.0 || nearness >= nearest);
}

// Part of the sun that reaches a point, 0 to 1: the mean of so many filtered taps along each side.
fn sunlit(world: vec3<f32>, normal: vec3<f32>) -> f32 {
    // Off the surface by a little more than a shadow pixel, else it shadows itself.
    let pixel_m = views[view].bounce.w;
    let point = vec4<f32>(world + (normal + views[view].to_light.xyz * 0.5) * pixel_m * 1.3, 1.0);
    let at = vec2<f32>(dot(views[view].sun_right, point), dot(views[view].sun_up, point));
    let outside = smoothstep(0.85, 0.98, max(abs(at.x), abs(at.y)));
    if outside >= 1.0 {
        return 1.0;
    }
    let nearness = 1.0 - dot(views[view].sun_depth, point);
    let taps = i32(views[view].shadow.w);
    let place = (at * vec2<f32>(0.5, -0.5) + 0.5) * f32(views[view].shadow.z) - 0.5 * f32(taps);
    let corner = floor(place);
    let part = place - corner;
    var sum = 0.0;
    for (var y = 0; y <= taps; y++) {
        var of_row = 0.0;
        for (var x = 0; x <= taps; x++) {
            let weight = select(select(1.0, part.x, x == taps), 1.0 - part.x, x == 0);
            of_row += weight * passes(i32(corner.x) + x, i32(corner.y) + y, nearness);
        }
        sum += of_row * select(select(1.0, part.y, y == taps), 1.0 - part.y, y == 0);
    }
    return mix(sum / f32(taps * taps), 1.0, outside);
}

// Part of a lamp's light that goes in a direction and arrives at the square of a distance.
fn sent(lamp: Lamp, direction: vec3<f32>, square: f32) -> f32 {
    let reach = abs(lamp.place.w);
    let along = dot(direction, lamp.ahead.xyz);
    let inverse = 1.0 / max(along, 0.05);
    let upward = dot(direction, cross(lamp.ahead.xyz, lamp.left.xyz)) * inverse;
    let wide = dot(direction, lamp.left.xyz) * inverse * lamp.ahead.w;
    let tall = upward * lamp.left.w;
    let beam = 1.0 / (wide * wide + tall * tall + 1.0);
    let below = clamp((lamp.colour.w - upward) * 25.0 + 0.5, 0.0, 1.0);
    let before = select(clamp(along * 4.0, 0.0, 1.0), 1.0, lamp.place.w < 0.0);
    let fades = clamp(1.0 - square / (reach * reach), 0.0, 1.0);
    let leaves = clamp((sqrt(square) - 0.5) * 0.8, 0.0, 1.0);
    return beam * (below * 0.97 + 0.03) * before * fades * fades * leaves / max(square, 1e-3);
}

// Light of all lamps that arrives at a surface.
fn lamplight(world: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    for (var at = 0u; at < views[view].lists.y; at++) {
        let lamp = lamps[views[view].lists.x + at];
        let from_lamp = world - lamp.place.xyz;
        let square = dot(from_lamp, from_lamp);
        if square < lamp.place.w * lamp.place.w {
            let direction = from_lamp / max(sqrt(square), 1e-3);
            let facing = max((0.25 - dot(normal, direction)) / 1.25, 0.0);
            sum += lamp.colour.rgb * (facing * sent(lamp, direction, square));
        }
    }
    return sum;
}

// What a wet road mirrors of all lamps, as streaks towards the eye.
fn streaks(world: vec3<f32>, mirrored: vec3<f32>) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    let level = max(dot(mirrored.xy, mirrored.xy), 1e-6);
    for (var at = 0u; at < views[view].lists.y; at++) {
        let lamp = lamps[views[view].lists.x + at];
        let from_lamp = world - lamp.place.xyz;
        let square = dot(from_lamp, from_lamp);
        if square < lamp.place.w * lamp.place.w {
            let direction = from_lamp / max(sqrt(square), 1e-3);
            let flat_part = max(dot(direction.xy, direction.xy), 1e-6);
            let across = (mirrored.x * direction.y - mirrored.y * direction.x) * 20.0;
            let steep = (mirrored.z + direction.z) * 2.5;
            let thin = 1.0 / (across * across / (level * flat_part) + 1.0);
            let is_before = select(0.0, 1.0, dot(mirrored.xy, direction.xy) < 0.0);
            let part = thin * thin * is_before / (steep * steep + 1.0);
            sum += lamp.colour.rgb * (part * sent(lamp, direction, square));
        }
    }
    return sum;
}

struct Light {
    diffuse: vec3<f32>,
    sun: vec3<f32>,
};

// Light that arrives at a surface, which sees this part of the sky and the ground around it.
fn arriving(world: vec3<f32>, normal: vec3<f32>, open: f32) -> Light {
    let facing = max(dot(normal, views[view].to_light.xyz), 0.0);
    var direct = facing;
    if facing > 0.0 {
        direct = facing * sunlit(world, normal);
    }
    let sun = views[view].direct.rgb * direct;
    let up = normal.z * 0.5 + 0.5;
    // At night street lamps throw from above what the ground throws back by day.
    let above = mix(views[view].horizon.rgb, views[view].zenith.rgb, 0.55) * 0.62 + views[view].bounce.rgb * views[view].direct.w;
    let around = mix(views[view].bounce.rgb, above, up) * open;
    return Light(sun + around + lamplight(world, normal), sun);
}
