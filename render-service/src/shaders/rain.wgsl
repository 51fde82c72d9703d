// Falling drops over a finished picture. Appended to light.

// Part of a point that drops cover in a layer whose streaks are this wide and long.
fn drops(at: vec2<f32>, size: vec2<f32>, seed: f32) -> f32 {
    // A little aslant.
    let leaning = vec2<f32>(at.x + 0.06 * at.y, at.y) / size;
    let column = floor(leaning.x);
    let fall = leaning.y + 17.0 * hash21(vec2<f32>(column, seed)) + 29.0 * views[view].air.z;
    let is_drop = step(hash21(vec2<f32>(column, floor(fall) + seed)), 0.30 * views[view].air.y);
    let across = abs(fract(leaning.x) - 0.5) * 2.0;
    let along = fract(fall);
    return is_drop * (1.0 - across) * along * (1.0 - along) * 4.0;
}

// A displayed colour with drops before it, at a place across and down in picture heights.
fn rained_on(shown: vec3<f32>, at: vec2<f32>) -> vec3<f32> {
    let near = drops(at, vec2<f32>(0.008, 0.30), 3.0);
    let middle = drops(at, vec2<f32>(0.005, 0.16), 11.0);
    let far = drops(at, vec2<f32>(0.003, 0.08), 23.0);
    let covers = clamp(0.30 * near + 0.25 * middle + 0.20 * far, 0.0, 0.5);
    let drop = displayed(mix(views[view].horizon.rgb, views[view].zenith.rgb, 0.3));
    return mix(shown, drop, covers);
}
