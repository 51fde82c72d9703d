// Radiance of vehicles, people, things, trees. Appended to cabin.

// Clumps of leaves, lighter and darker, that face all ways: what bends the normal, then what the
// colour is multiplied by. As `raster`'s.
struct Leaves {
    bend: vec3<f32>,
    tint: vec3<f32>,
};

fn leaves(world: vec3<f32>, footprint: f32, variant: f32) -> Leaves {
    let one = world.xy + world.z * vec2<f32>(0.5, 0.3);
    let two = vec2<f32>(world.z + world.y * 0.4, world.x - world.y * 0.6);
    let clump = (noise(one * 1.9) + noise(two * 2.3) - 1.0) * clamp(1.0 - footprint * 1.2, 0.0, 1.0);
    let fade = clamp(1.0 - footprint * 6.0, 0.0, 1.0);
    let leaf = (noise(one * 9.0) - 0.5) * fade;
    let other = (noise(two * 10.0) - 0.5) * fade;
    let vary = max(1.0 + 0.8 * clump + 0.9 * (leaf + other), 0.25);
    let yellowed = mix(vec3<f32>(1.0), vec3<f32>(1.35, 1.1, 0.8), clamp(clump + 0.3, 0.0, 1.0));
    let bend = vec3<f32>(leaf + clump * 0.5, other - clump * 0.4, (leaf - other) * 0.6 + clump * 0.4);
    let green = floor(variant * 0.25);
    let shade = variant - green * 4.0;
    let dark = select(0.8 + 0.17 * shade, 0.55, shade < 0.5);
    let tint = vec3<f32>(0.8 + 0.15 * green, 0.9 + 0.06 * green, 1.0 - 0.05 * green);
    return Leaves(bend * 0.9, tint * (vary * dark) * yellowed);
}

// What the colour of bark is multiplied by.
fn bark(world: vec3<f32>, footprint: f32) -> f32 {
    let fade = clamp(1.0 - footprint * 12.0, 0.0, 1.0);
    let ridge = noise(vec2<f32>((world.x + world.y) * 17.0, world.z * 2.6 + world.y * 3.0));
    return 1.0 + 1.1 * (ridge - 0.5) * fade;
}

fn body(in: Surface, inside: Inside, direction: vec3<f32>, distance: f32) -> vec3<f32> {
    var normal = in.normal;
    var albedo = in.colour.rgb;
    let footprint = distance * views[view].left.w;
    if in.look.y == 5.0 {
        let leafy = leaves(in.world, footprint, in.look.z);
        normal = normalize(normal + leafy.bend);
        albedo *= leafy.tint;
    } else if in.look.y == 6.0 {
        albedo *= bark(in.world, footprint);
    }
    let light = arriving(in.world, normal, 1.0);

    // Clear coat or glass over the colour: sky above, dark ground below the horizon.
    let gloss = in.look.x;
    let mirrored = reflect(direction, normal);
    let ground = views[view].bounce.rgb * 0.6;
    let around = mix(ground, sky(mirrored), smoothstep(-0.12, 0.10, mirrored.z));
    let glance = 1.0 - max(dot(normal, -direction), 0.0);
    let glance2 = glance * glance;
    let shine = gloss * (0.05 + 0.65 * glance2 * glance2 * glance);
    let toward_sun = max(dot(mirrored, views[view].to_light.xyz), 0.0);
    let spark2 = toward_sun * toward_sun;
    let spark8 = spark2 * spark2 * spark2 * spark2;
    let spark = gloss * spark8 * spark8 * spark8 * 0.9;

    let glow = in.colour.rgb * (in.colour.a * 1.6);
    var own = albedo * light.diffuse;
    if in.look.y >= WINDOWS {
        own = cabin(inside, in.look.y, direction, light.diffuse, in.colour.rgb * in.colour.a);
    }
    let colour = own * (1.0 - 0.5 * shine) + around * shine + light.sun * spark + glow;
    return colour;
}
