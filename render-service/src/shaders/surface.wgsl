// Vertex stage of every visible surface, and its lighting.
//
// In: vertices (position, packed normal and material, facade coordinates), instances (placement, tints).
// Out: clip position, world position, normal, colour.

@group(1) @binding(0) var shadow_map: texture_depth_2d;
@group(1) @binding(1) var shadow_sampler: sampler_comparison;

// True on software adapters: one filtered tap instead of nine.
override CHEAP_SHADOW: bool = false;

struct VertexIn {
    @location(0) position: vec3<f32>,
    @location(1) normal_material: vec4<i32>,
    @location(2) facade_m: vec2<f32>,
    @location(3) row_x: vec4<f32>,
    @location(4) row_y: vec4<f32>,
    @location(5) row_z: vec4<f32>,
    @location(6) tint_0: vec4<f32>,
    @location(7) tint_1: vec4<f32>,
    @location(8) tint_2: vec4<f32>,
    @location(9) tint_3: vec4<f32>,
};

struct Surface {
    @builtin(position) clip: vec4<f32>,
    @location(0) world: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) facade_m: vec2<f32>,
    // Reflectance, part that glows.
    @location(3) @interpolate(flat) colour: vec4<f32>,
    // Gloss, pattern, colour variant 0..127, unused.
    @location(4) @interpolate(flat) look: vec4<f32>,
};

@vertex
fn vertex(in: VertexIn) -> Surface {
    let local = vec4<f32>(in.position, 1.0);
    let world = vec3<f32>(dot(in.row_x, local), dot(in.row_y, local), dot(in.row_z, local));
    let number = u32(in.normal_material.w);
    let material = materials[number & 255u];
    let slot = material.pattern_tint.y;
    var tint = vec4<f32>(1.0, 1.0, 1.0, 0.0);
    tint = select(tint, in.tint_0, slot == 0.0);
    tint = select(tint, in.tint_1, slot == 1.0);
    tint = select(tint, in.tint_2, slot == 2.0);
    tint = select(tint, in.tint_3, slot == 3.0);

    var out: Surface;
    out.clip = view.clip_from_world * vec4<f32>(world, 1.0);
    out.world = world;
    out.normal = unstretched(vec3<f32>(in.normal_material.xyz), in.row_x.xyz, in.row_y.xyz, in.row_z.xyz);
    out.facade_m = in.facade_m;
    out.colour = vec4<f32>(material.colour_gloss.rgb * tint.rgb, tint.a);
    out.look = vec4<f32>(material.colour_gloss.a, material.pattern_tint.x, f32(number >> 8u), 0.0);
    return out;
}

// Part of the sun that reaches a point, 0 to 1.
fn sunlit(world: vec3<f32>, normal: vec3<f32>) -> f32 {
    // Off the surface by a little more than a shadow pixel, else it shadows itself.
    let pixel_m = view.bounce.w;
    let point = world + (normal + view.to_light.xyz * 0.5) * pixel_m * 1.3;
    let clip = view.shadow_from_world * vec4<f32>(point, 1.0);
    let at = clip.xy * vec2<f32>(0.5, -0.5) + 0.5;
    let edge = max(abs(clip.x), abs(clip.y));
    var part = 0.0;
    if CHEAP_SHADOW {
        part = textureSampleCompareLevel(shadow_map, shadow_sampler, at, clip.z);
    } else {
        let step = 1.0 / f32(textureDimensions(shadow_map).x);
        for (var y = -1; y <= 1; y++) {
            for (var x = -1; x <= 1; x++) {
                let tap = at + vec2<f32>(f32(x), f32(y)) * step;
                part += textureSampleCompareLevel(shadow_map, shadow_sampler, tap, clip.z) / 9.0;
            }
        }
    }
    return mix(part, 1.0, smoothstep(0.85, 0.98, edge));
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
    for (var at = 0u; at < u32(view.counts.x); at++) {
        let lamp = view.lamps[at];
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
    for (var at = 0u; at < u32(view.counts.x); at++) {
        let lamp = view.lamps[at];
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
    let facing = max(dot(normal, view.to_light.xyz), 0.0);
    let sun = view.direct.rgb * (facing * sunlit(world, normal));
    let up = normal.z * 0.5 + 0.5;
    // At night street lamps throw from above what the ground throws back by day.
    let above = mix(view.horizon.rgb, view.zenith.rgb, 0.55) * 0.62 + view.bounce.rgb * view.direct.w;
    let around = mix(view.bounce.rgb, above, up) * open;
    return Light(sun + around + lamplight(world, normal), sun);
}
