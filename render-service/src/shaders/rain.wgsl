// Falling drops over a finished picture: one triangle over all of it. Appended to common.
//
// In: vertex index, rain 0..1 and its phase. Out: display colour, linear, and how much of it covers.

struct RainPoint {
    @builtin(position) clip: vec4<f32>,
    // Across and down in picture heights.
    @location(0) at: vec2<f32>,
};

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> RainPoint {
    let x = f32(index & 1u) * 4.0 - 1.0;
    let y = f32(index >> 1u) * 4.0 - 1.0;
    let wide = length(view.left.xyz) / length(view.up.xyz);
    return RainPoint(vec4<f32>(x, y, 0.0, 1.0), vec2<f32>(x * wide, -y) * 0.5);
}

// Part of a point that drops cover in a layer whose streaks are this wide and long.
fn streaks(at: vec2<f32>, size: vec2<f32>, seed: f32) -> f32 {
    // A little aslant.
    let leaning = vec2<f32>(at.x + 0.06 * at.y, at.y) / size;
    let column = floor(leaning.x);
    let fall = leaning.y + 17.0 * hash21(vec2<f32>(column, seed)) + 29.0 * view.air.z;
    let is_drop = step(hash21(vec2<f32>(column, floor(fall) + seed)), 0.30 * view.air.y);
    let across = abs(fract(leaning.x) - 0.5) * 2.0;
    let along = fract(fall);
    return is_drop * (1.0 - across) * along * (1.0 - along) * 4.0;
}

@fragment
fn fragment(in: RainPoint) -> @location(0) vec4<f32> {
    let near = streaks(in.at, vec2<f32>(0.008, 0.30), 3.0);
    let middle = streaks(in.at, vec2<f32>(0.005, 0.16), 11.0);
    let far = streaks(in.at, vec2<f32>(0.003, 0.08), 23.0);
    let covers = clamp(0.30 * near + 0.25 * middle + 0.20 * far, 0.0, 0.5);
    let drop = displayed(mix(view.horizon.rgb, view.zenith.rgb, 0.3));
    return vec4<f32>(drop.rgb, covers);
}
