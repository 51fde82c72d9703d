// Radiance of walls: windows and storeys from the facade coordinates. Appended to arriving.

const BAY_M: f32 = 3.0;
const STOREY_M: f32 = 3.3;
// What lintels shade of the panes below them and cornices of the wall, in storeys.
const RECESS: f32 = 0.045;
const EAVES: f32 = 0.05;
// Height in metres up to which the corner at its foot keeps light from a wall.
const FOOT_M: f32 = 1.6;

// Part of a pixel of width `blur` at `x` that lies in [low, high] of a pattern with period 1.
fn covered(x: f32, blur: f32, low: f32, high: f32) -> f32 {
    let a = x - 0.5 * blur;
    let b = x + 0.5 * blur;
    let width = high - low;
    let upto_a = floor(a) * width + clamp(fract(a) - low, 0.0, width);
    let upto_b = floor(b) * width + clamp(fract(b) - low, 0.0, width);
    return (upto_b - upto_a) / blur;
}

fn facade(in: Surface, direction: vec3<f32>, distance: f32) -> vec3<f32> {
    let normal = in.normal;
    let footprint = distance * views[view].left.w;
    let slant = max(abs(dot(normal, direction)), 0.08);

    let bay = in.facade_m.x / BAY_M;
    let storey = in.facade_m.y / STOREY_M;
    let blur_x = max(footprint / (slant * BAY_M), 0.004);
    let blur_y = max(footprint / STOREY_M, 0.004);
    let has_windows = step(0.0, storey);
    let is_ground_floor = has_windows * select(0.0, 1.0, storey < 1.0);

    let opening = has_windows * covered(bay, blur_x, mix(0.26, 0.10, is_ground_floor), mix(0.74, 0.90, is_ground_floor));
    let lintel = mix(0.80, 0.78, is_ground_floor);
    let pane = opening * covered(storey, blur_y, mix(0.28, 0.12, is_ground_floor), lintel);
    let frame = has_windows * covered(bay, blur_x, mix(0.22, 0.06, is_ground_floor), mix(0.78, 0.94, is_ground_floor))
        * covered(storey, blur_y, mix(0.23, 0.06, is_ground_floor), mix(0.84, 0.82, is_ground_floor));
    let cross_bar = covered(bay, blur_x, 0.485, 0.515) * (1.0 - is_ground_floor);
    let cornice = has_windows * covered(storey, blur_y, 0.94, 1.0);
    // In the shade of a lintel or a cornice.
    let shaded = 0.55 * opening * covered(storey, blur_y, lintel - RECESS, lintel)
        + 0.3 * has_windows * covered(storey, blur_y, 0.94 - EAVES, 0.94);

    // Kind of wall, and one of a few tones per house.
    let kind = floor(in.look.z / 32.0);
    let tone = fract(in.look.z * 0.619);
    let warm = fract(in.look.z * 0.271);
    let plaster = mix(vec3<f32>(0.58, 0.51, 0.39), vec3<f32>(0.56, 0.57, 0.57), warm);
    let ochre = mix(vec3<f32>(0.56, 0.37, 0.19), vec3<f32>(0.47, 0.25, 0.18), warm);
    let brick = vec3<f32>(0.30, 0.135, 0.085) * (0.80 + 0.5 * warm);
    let concrete = vec3<f32>(0.34, 0.335, 0.32) * (0.85 + 0.35 * tone);
    var wall = mix(plaster, ochre, step(0.60, tone));
    wall = select(wall, brick, kind == 1.0);
    wall = select(wall, concrete, kind == 2.0);
    let stains = noise(vec2<f32>(in.facade_m.x * 0.6, in.facade_m.y * 0.25));
    wall *= 0.86 + 0.24 * stains;
    wall = mix(wall, wall * 0.62 + 0.06, is_ground_floor * 0.7);
    let trim = mix(wall, vec3<f32>(0.62, 0.60, 0.56), 0.65);
    var albedo = mix(wall, trim, max(frame, cornice * 0.8));

    let glass = pane * (1.0 - 0.8 * cross_bar);
    let near = clamp(1.0 - in.facade_m.y / FOOT_M, 0.0, 1.0);
    let light = arriving(in.world, normal, 1.0 - 0.4 * near * near);
    let cell = vec2<f32>(floor(bay) + in.look.z * 7.0, floor(storey));
    let chance = hash21(cell + 3.0);
    let room = mix(vec3<f32>(0.022, 0.028, 0.036), vec3<f32>(0.16, 0.15, 0.13), step(0.72, chance) * 0.7);
    let mirrored = reflect(direction, normal);
    let glance = 1.0 - max(dot(normal, -direction), 0.0);
    let shine = 0.16 + 0.60 * glance * glance * glance;
    let lamp = vec3<f32>(1.0, 0.72, 0.38) * (0.55 * views[view].direct.w * step(0.55, hash21(cell)));
    let seen_in_glass = room * light.diffuse + sky(mirrored) * shine + lamp;
    return mix(albedo * light.diffuse, seen_in_glass, glass) * (1.0 - shaded);
}
