// Colour pass of vehicles, people, things, trees. Appended to common and surface.
//
// In: Surface. Out: display colour, linear, to an sRGB target.

@fragment
fn fragment(in: Surface) -> @location(0) vec4<f32> {
    let to_eye = view.eye.xyz - in.world;
    let distance = length(to_eye);
    let direction = -to_eye / distance;
    let normal = normalize(in.normal);
    let light = arriving(in.world, normal);

    // Clear coat or glass over the colour: sky above, dark ground below the horizon.
    let gloss = in.look.x;
    let mirrored = reflect(direction, normal);
    let ground = view.bounce.rgb * 0.6;
    let around = mix(ground, sky(mirrored), smoothstep(-0.12, 0.10, mirrored.z));
    let glance = 1.0 - max(dot(normal, -direction), 0.0);
    let glance2 = glance * glance;
    let shine = gloss * (0.05 + 0.65 * glance2 * glance2 * glance);
    let toward_sun = max(dot(mirrored, view.to_light.xyz), 0.0);
    let spark2 = toward_sun * toward_sun;
    let spark8 = spark2 * spark2 * spark2 * spark2;
    let spark = gloss * spark8 * spark8 * spark8 * 0.9;

    let glow = in.colour.rgb * (in.colour.a * 1.6);
    let colour = in.colour.rgb * light.diffuse * (1.0 - 0.5 * shine) + around * shine + light.sun * spark + glow;
    return displayed(hazed(colour, distance, direction));
}
