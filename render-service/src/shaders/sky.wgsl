// Radiance of the sky with clouds and sun. Appended to light.

fn clouded_sky(direction: vec3<f32>) -> vec3<f32> {
    var colour = sky(direction);
    // Clouds on a plane overhead, thinning towards the horizon.
    let cloud = views[view].zenith.w;
    let at = direction.xy / (max(direction.z, 0.0) + 0.12) * 1.6;
    let shape = noise(at) * 0.55 + noise(at * 2.3 + 7.1) * 0.28 + noise(at * 5.1 + 3.7) * 0.17;
    let cover = 0.72 - 0.55 * cloud;
    let thick = smoothstep(cover, cover + 0.30, shape) * smoothstep(0.01, 0.16, direction.z);
    let lit = views[view].horizon.rgb * 0.75 + views[view].direct.rgb * 0.16;
    colour = mix(colour, lit * (1.08 - 0.30 * thick * shape), thick * (0.35 + 0.5 * cloud));
    let toward = max(dot(direction, views[view].to_light.xyz), 0.0);
    let halo = pow(toward, 64.0) * 0.35 + pow(toward, 2000.0) * 6.0;
    colour += views[view].direct.rgb * halo * views[view].to_light.w * (1.0 - 0.8 * thick);
    // Below the horizon, where no ground is drawn: far haze.
    colour = mix(colour, views[view].horizon.rgb * 0.72, smoothstep(0.0, -0.04, direction.z));
    return colour;
}
