// Colour pass of the sky: one triangle over the whole picture at infinite distance. Appended to common.
//
// In: vertex index. Out: display colour, linear, to an sRGB target; depth 0, behind everything.

struct SkyPoint {
    @builtin(position) clip: vec4<f32>,
    @location(0) direction: vec3<f32>,
};

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> SkyPoint {
    let x = f32(index & 1u) * 4.0 - 1.0;
    let y = f32(index >> 1u) * 4.0 - 1.0;
    let direction = view.forward.xyz - view.left.xyz * x + view.up.xyz * y;
    return SkyPoint(vec4<f32>(x, y, 0.0, 1.0), direction);
}

@fragment
fn fragment(in: SkyPoint) -> @location(0) vec4<f32> {
    let direction = normalize(in.direction);
    var colour = sky(direction);
    // Clouds on a plane overhead, thinning towards the horizon.
    let cloud = view.zenith.w;
    let at = direction.xy / (max(direction.z, 0.0) + 0.12) * 1.6;
    let shape = noise(at) * 0.55 + noise(at * 2.3 + 7.1) * 0.28 + noise(at * 5.1 + 3.7) * 0.17;
    let cover = 0.72 - 0.55 * cloud;
    let thick = smoothstep(cover, cover + 0.30, shape) * smoothstep(0.01, 0.16, direction.z);
    let lit = view.horizon.rgb * 0.75 + view.direct.rgb * 0.16;
    colour = mix(colour, lit * (1.08 - 0.30 * thick * shape), thick * (0.35 + 0.5 * cloud));
    let toward = max(dot(direction, view.to_light.xyz), 0.0);
    let halo = pow(toward, 64.0) * 0.35 + pow(toward, 2000.0) * 6.0;
    colour += view.direct.rgb * halo * view.to_light.w * (1.0 - 0.8 * thick);
    // Below the horizon, where no ground is drawn: far haze.
    colour = mix(colour, view.horizon.rgb * 0.72, smoothstep(0.0, -0.04, direction.z));
    return displayed(colour);
}
