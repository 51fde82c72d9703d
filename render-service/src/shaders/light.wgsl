// Light, haze and the tone curve. Appended to layout.
//
// Colour: all light is linear radiance; `displayed` applies the tone curve, `encoded` the sRGB one.

struct View {
    // Along the view; left and up are scaled to the picture's half extent. w of left: width of a pixel at
    // a distance of 1 m.
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
    // Rows of the matrix from the world to the map of shadows, from -1 to 1, and to its depth, from 0 at
    // the sun to 1.
    sun_right: vec4<f32>,
    sun_up: vec4<f32>,
    sun_depth: vec4<f32>,
    // First lamp, lamps, first occluder, occluders.
    lists: vec4<u32>,
    // First pixel of the town's and the bodies' map of shadows, side of both, taps along a side of it.
    shadow: vec4<u32>,
    // First sample, samples of a pixel, 1 for colour, unused.
    samples: vec4<u32>,
    // Pixels of a row, rows of the picture, first row, rows.
    size: vec4<u32>,
    // Where pixels go: colour or depth, labels, normals; NOWHERE for what nobody wants.
    outs: vec4<u32>,
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
    // rgb mean reflectance of the sides, w height as which it is mirrored.
    colour: vec4<f32>,
};

@group(0) @binding(4) var<storage, read> views: array<View>;
@group(0) @binding(5) var<storage, read> lamps: array<Lamp>;
@group(0) @binding(6) var<storage, read> triangles: array<vec4<u32>>;
@group(0) @binding(7) var<storage, read> corners: array<Corner>;
@group(0) @binding(8) var<storage, read> occluders: array<Occluder>;
// A triangle's number, inverted, and its nearness.
@group(0) @binding(9) var<storage, read> visibility: array<vec2<u32>>;
// How near to the sun the first thing is; 0 for none.
@group(0) @binding(10) var<storage, read> shadows: array<f32>;
@group(0) @binding(11) var<storage, read> materials: array<Material>;
@group(0) @binding(12) var<storage, read_write> pixels: array<u32>;

struct Material {
    // Reflectance, gloss.
    colour_gloss: vec4<f32>,
    // Pattern, tint slot, family, unused.
    pattern_tint: vec4<f32>,
};

// A place on a surface, as a pixel shows it.
struct Surface {
    world: vec3<f32>,
    normal: vec3<f32>,
    facade_m: vec2<f32>,
    // Reflectance, part that glows.
    colour: vec4<f32>,
    // Gloss, pattern, colour variant 0..127.
    look: vec3<f32>,
};

// The view of this thread.
var<private> view: u32;

// World normal of a shape's own. Placement is a turn after a stretch along the axes: normals shrink
// where positions stretch.
fn unstretched(normal: vec3<f32>, row_x: vec3<f32>, row_y: vec3<f32>, row_z: vec3<f32>) -> vec3<f32> {
    let n = normal / (row_x * row_x + row_y * row_y + row_z * row_z);
    let turned = vec3<f32>(dot(row_x, n), dot(row_y, n), dot(row_z, n));
    let square = dot(turned, turned);
    return select(vec3<f32>(0.0, 0.0, 1.0), turned * inverseSqrt(square), square > 0.0 && square < 1e30);
}

// Sky without clouds or sun.
fn sky(direction: vec3<f32>) -> vec3<f32> {
    let height = max(direction.z, 0.0);
    let low = 1.0 - height;
    let low2 = low * low;
    return mix(views[view].zenith.rgb, views[view].horizon.rgb, low2 * low2);
}

// Mean density along a way that ends so many heights above its beginning, each of which thins the
// air by a factor e.
fn mean_density(heights: f32) -> f32 {
    if views[view].tone_red.w == 0.0 {
        return 1.0;
    }
    let size = clamp(abs(heights), 1e-2, 8.0);
    let left = exp(-size);
    let upwards = (1.0 - left) / size;
    return select(upwards / max(left, 0.1), upwards, heights >= 0.0);
}

// What is seen through the air.
fn hazed(colour: vec3<f32>, distance: f32, direction: vec3<f32>) -> vec3<f32> {
    let thick = max(distance - views[view].air.x, 0.0) * mean_density(direction.z * distance * views[view].tone_red.w);
    let part = 1.0 - exp(-views[view].eye.w * thick);
    return mix(colour, views[view].horizon.rgb, part);
}

// From radiance to the display's range: a curve with a soft shoulder and a short toe.
fn displayed(radiance: vec3<f32>) -> vec3<f32> {
    let toned = vec3<f32>(
        dot(radiance, views[view].tone_red.rgb),
        dot(radiance, views[view].tone_green.rgb),
        dot(radiance, views[view].tone_blue.rgb),
    );
    let x = max(toned, vec3<f32>(0.0));
    let mapped = (x * (2.43 * x + 0.05)) / (x * (2.36 * x + 0.62) + 0.15);
    return clamp(mapped, vec3<f32>(0.0), vec3<f32>(1.0));
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

// A channel from linear to sRGB.
fn encoded(linear: vec3<f32>) -> vec3<f32> {
    let curved = 1.055 * pow(linear, vec3<f32>(1.0 / 2.4)) - 0.055;
    return select(curved, linear * 12.92, linear <= vec3<f32>(0.0031308));
}
