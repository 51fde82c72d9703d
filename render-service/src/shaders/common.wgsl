// Shared by every pass: bindings, light, haze, tone curve.
//
// Colour: all light is linear radiance; `displayed` applies the tone curve, the sRGB target encodes.
// Depth: reversed, 1 at the near plane, 0 at infinity; the shadow map's runs from 0 at the sun to 1.
// Space: positions and directions are in the world, metres, z up.

struct View {
    clip_from_world: mat4x4<f32>,
    shadow_from_world: mat4x4<f32>,
    // Along the view; its y and z axes are scaled to the picture's half extent.
    forward: vec4<f32>,
    left: vec4<f32>,
    up: vec4<f32>,
    // xyz position, w haze per metre.
    eye: vec4<f32>,
    // xyz to the sun, w brightness of its disc.
    to_light: vec4<f32>,
    // rgb, w night 0..1.
    direct: vec4<f32>,
    // rgb, w cloud 0..1.
    zenith: vec4<f32>,
    // rgb, w wetness 0..1.
    horizon: vec4<f32>,
    // rgb, w width of a shadow map's pixel in metres.
    bounce: vec4<f32>,
    // Distance in metres at which haze begins, rain 0..1, phase of the rain 0..1, unused.
    air: vec4<f32>,
    // What radiance is multiplied by before the curve: rows of a matrix; w how fast haze thins
    // upwards, per metre.
    tone_red: vec4<f32>,
    tone_green: vec4<f32>,
    tone_blue: vec4<f32>,
    // Of lamps, of occluders, unused, unused.
    counts: vec4<f32>,
    lamps: array<Lamp, LAMPS_MAX>,
    occluders: array<Occluder, OCCLUDERS_MAX>,
};

// As `raster::Lamp`.
struct Lamp {
    // xyz position, w reach in metres; less than 0 for one that also shines behind itself.
    place: vec4<f32>,
    // rgb at a distance of 1 m, w tangent of the upper edge.
    colour: vec4<f32>,
    // xyz along the middle of the beam, w inverse tangent of its half width.
    ahead: vec4<f32>,
    // xyz to the left, w inverse tangent of its half height.
    left: vec4<f32>,
};

// As `raster::Occluder`.
struct Occluder {
    // xyz middle of the footprint, w height of the sides.
    place: vec4<f32>,
    // xy along its length, zw half of length and width.
    ahead_half: vec4<f32>,
};

struct Material {
    // Reflectance, gloss.
    colour_gloss: vec4<f32>,
    // Pattern, tint slot, unused, unused.
    pattern_tint: vec4<f32>,
};

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> materials: array<Material, MATERIAL_COUNT>;

// World normal of a shape's own. Placement is a turn after a stretch along the axes: normals shrink
// where positions stretch.
fn unstretched(normal: vec3<f32>, row_x: vec3<f32>, row_y: vec3<f32>, row_z: vec3<f32>) -> vec3<f32> {
    let n = normal / (row_x * row_x + row_y * row_y + row_z * row_z);
    return normalize(vec3<f32>(dot(row_x, n), dot(row_y, n), dot(row_z, n)));
}

// Sky without clouds or sun.
fn sky(direction: vec3<f32>) -> vec3<f32> {
    let height = max(direction.z, 0.0);
    let low = 1.0 - height;
    let low2 = low * low;
    return mix(view.zenith.rgb, view.horizon.rgb, low2 * low2);
}

// Mean density along a way that ends so many heights above its beginning, each of which thins the
// air by a factor e.
fn mean_density(heights: f32) -> f32 {
    if view.tone_red.w == 0.0 {
        return 1.0;
    }
    let size = clamp(abs(heights), 1e-2, 8.0);
    let left = exp(-size);
    let upwards = (1.0 - left) / size;
    return select(upwards / max(left, 0.1), upwards, heights >= 0.0);
}

// What is seen through the air.
fn hazed(colour: vec3<f32>, distance: f32, direction: vec3<f32>) -> vec3<f32> {
    let thick = max(distance - view.air.x, 0.0) * mean_density(direction.z * distance * view.tone_red.w);
    let part = 1.0 - exp(-view.eye.w * thick);
    return mix(colour, view.horizon.rgb, part);
}

// From radiance to the display's range: a curve with a soft shoulder and a short toe.
fn displayed(radiance: vec3<f32>) -> vec4<f32> {
    let toned = vec3<f32>(
        dot(radiance, view.tone_red.rgb),
        dot(radiance, view.tone_green.rgb),
        dot(radiance, view.tone_blue.rgb),
    );
    let x = max(toned, vec3<f32>(0.0));
    let mapped = (x * (2.43 * x + 0.05)) / (x * (2.36 * x + 0.62) + 0.15);
    return vec4<f32>(clamp(mapped, vec3<f32>(0.0), vec3<f32>(1.0)), 1.0);
}

fn hash21(cell: vec2<f32>) -> f32 {
    var p = fract(cell * vec2<f32>(0.1031, 0.1130));
    p += dot(p, p.yx + 33.33);
    return fract((p.x + p.y) * p.x);
}

// Smooth noise from 0 to 1 with features of one unit.
fn noise(point: vec2<f32>) -> f32 {
    let cell = floor(point);
    let f = fract(point);
    let s = f * f * (3.0 - 2.0 * f);
    let low = mix(hash21(cell), hash21(cell + vec2<f32>(1.0, 0.0)), s.x);
    let high = mix(hash21(cell + vec2<f32>(0.0, 1.0)), hash21(cell + vec2<f32>(1.0, 1.0)), s.x);
    return mix(low, high, s.y);
}
