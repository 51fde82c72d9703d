// What all kernels read and write. Rows of buffers are as in `device/rows.rs`.
//
// Space: positions and directions are in the world, metres, z up. Pictures: columns to the right, rows
// downwards, from the upper left corner.

// As who looks: a camera, or the sun at a map of its shadows.
struct Target {
    // Rows of the matrix from the world: across and down from the middle in pixels times the distance
    // along the view; that distance; nearness, which is used for the sun alone.
    x: vec4<f32>,
    y: vec4<f32>,
    w: vec4<f32>,
    nearness: vec4<f32>,
    // Least distance, 1 for the sun, middle of the picture in pixels.
    lens: vec4<f32>,
    // What is further from the middle, in pixels, is not in the picture; pixels of a metre at 1 m.
    size: vec4<f32>,
    // How fast distances from the picture's sides grow with a metre: two, and the nearest; pixels of a
    // metre at 1 m for each pixel by which levels may be off.
    reach: vec4<f32>,
    // xyz of the eye, w how much of the steepest change in a pixel everything is put back by.
    eye: vec4<f32>,
    // First sample in the buffer of visible triangles or pixel in that of shadows, pixels of a row, first
    // row, rows.
    place: vec4<u32>,
    // Samples of a pixel, first word of hidden things and how many, unused.
    kind: vec4<u32>,
};

// A model at its place, for one target.
struct Placed {
    // Upper three rows of world from model.
    row_x: vec4<f32>,
    row_y: vec4<f32>,
    row_z: vec4<f32>,
    // Linear colours, eight bits a channel; the last is the part that glows.
    tints: vec4<u32>,
    // Label or 0, first corner, first triangle, first cluster.
    parts: vec4<u32>,
    // Target, clusters, how much longer than in the model its longest axis is, unused.
    seen: vec4<u32>,
};

// As `raster::Cluster`.
struct Cluster {
    // Middle and radius.
    ball: vec4<f32>,
    // Mean normal, sine of the angle within which all are; 2 for none.
    cone: vec4<f32>,
    // Ball around the thing of which this is a level.
    level: vec4<f32>,
    // How far this level and the next coarser one are off.
    errors: vec2<f32>,
    // Of the model's triangles, and how many.
    first: u32,
    count: u32,
};

// Position and x and y of the normal; z of it, material and variant, facade coordinates, label.
struct Corner {
    place: vec4<u32>,
    looks: vec4<u32>,
};

// Up to 64 clusters of one model: its place in `placed`, and the first cluster.
@group(0) @binding(0) var<storage, read> targets: array<Target>;
@group(0) @binding(1) var<storage, read> placed: array<Placed>;
@group(0) @binding(2) var<storage, read> chunks: array<vec2<u32>>;
@group(0) @binding(3) var<storage, read> clusters: array<Cluster>;

// Clusters and triangles of a chunk and a cluster, at most.
const CLUSTERS: u32 = 64u;
const TRIANGLES: u32 = 64u;

// World position of a place in a model.
fn in_world(one: u32, local: vec3<f32>) -> vec3<f32> {
    let place = vec4<f32>(local, 1.0);
    return vec3<f32>(dot(placed[one].row_x, place), dot(placed[one].row_y, place), dot(placed[one].row_z, place));
}

// Where a sample is in its pixel, in steps.
fn sample_offset(samples: u32, sample: u32) -> vec2<i32> {
    if samples == 1u {
        return vec2<i32>(128, 128);
    }
    let even = select(vec2<i32>(96, 32), vec2<i32>(32, 160), sample >= 2u);
    let odd = select(vec2<i32>(224, 96), vec2<i32>(160, 224), sample >= 2u);
    return select(even, odd, (sample & 1u) == 1u);
}
