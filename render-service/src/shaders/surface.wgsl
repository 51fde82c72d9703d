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

struct Light {
    diffuse: vec3<f32>,
    sun: vec3<f32>,
};

// Light that arrives at a surface.
fn arriving(world: vec3<f32>, normal: vec3<f32>) -> Light {
    let facing = max(dot(normal, view.to_light.xyz), 0.0);
    let sun = view.direct.rgb * (facing * sunlit(world, normal));
    let up = normal.z * 0.5 + 0.5;
    // At night street lamps throw from above what the ground throws back by day.
    let above = mix(view.horizon.rgb, view.zenith.rgb, 0.55) * 0.62 + view.bounce.rgb * view.direct.w;
    return Light(sun + mix(view.bounce.rgb, above, up), sun);
}
