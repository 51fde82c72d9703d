// One triangle onto samples: which it covers, and how near it is there. Appended to layout.
//
// Whether a sample is covered is computed in whole numbers, so that triangles that share a side neither
// overlap nor leave a gap, whichever kernel draws them.

@group(0) @binding(6) var<storage, read> triangles: array<vec4<u32>>;
@group(0) @binding(7) var<storage, read> corners: array<Corner>;
@group(0) @binding(8) var<storage, read> hidden: array<u32>;
@group(0) @binding(9) var<storage, read_write> visibility: array<atomic<u64>>;
@group(0) @binding(10) var<storage, read_write> shadows: array<atomic<u32>>;

// Sub-pixel steps of a pixel's side.
const STEPS: i32 = 256;
const STEPS_F: f32 = 256.0;
// Places further from the picture's corner than this, in pixels, have no fine grid.
const REACH_PX: f32 = 16000.0;
// Changes of nearness in a pixel that are larger count as none.
const CHANGE_MAX: f32 = 1e30;

// A corner before and after the division.
struct Point {
    // Across and down from the picture's middle in pixels, times w; w.
    ray: vec3<f32>,
    // Whether it is ahead of the eye and not far out.
    is_good: bool,
    // Sub-pixel steps from the picture's upper left corner.
    snapped: vec2<i32>,
    // Pixels from there.
    exact: vec2<f32>,
    nearness: f32,
};

// How near a triangle is: linear in the picture.
struct Plane {
    anchor: vec2<f32>,
    change: vec2<f32>,
    nearness: f32,
    least: f32,
    most: f32,
};

struct Triangle {
    a: Point,
    b: Point,
    c: Point,
    is_shown: bool,
    // Whether all of its corners are good.
    is_whole: bool,
};

// Of a number: the placed model, and the triangle among all.
struct Which {
    one: u32,
    triangle: u32,
    is_there: bool,
};

fn which(number: u32) -> Which {
    let chunk = chunks[number / (CLUSTERS * TRIANGLES)];
    let in_chunk = number / TRIANGLES % CLUSTERS;
    let cluster = placed[chunk.x].parts.w + chunk.y + in_chunk;
    let at = number % TRIANGLES;
    let triangle = placed[chunk.x].parts.z + clusters[cluster].first + at;
    return Which(chunk.x, triangle, at < clusters[cluster].count);
}

fn point(one: u32, at: u32, corner: u32) -> Point {
    let local = bitcast<vec3<f32>>(corners[corner].place.xyz);
    let world = vec4<f32>(in_world(one, local), 1.0);
    let ray = vec3<f32>(dot(targets[at].x, world), dot(targets[at].y, world), dot(targets[at].w, world));
    let is_sun = targets[at].lens.y == 1.0;
    var result: Point;
    result.ray = ray;
    result.exact = ray.xy / ray.z + targets[at].lens.zw;
    let is_near = ray.z >= select(targets[at].lens.x, 0.5, is_sun);
    result.is_good = is_near && all(abs(result.exact) <= vec2<f32>(REACH_PX));
    if result.is_good {
        result.snapped = vec2<i32>(round(result.exact * STEPS_F));
    }
    result.nearness = select(1.0 / ray.z, dot(targets[at].nearness, world), is_sun);
    return result;
}

fn is_hidden(at: u32, thing: u32) -> bool {
    let words = targets[at].kind.z;
    if thing / 32u >= words {
        return false;
    }
    return ((hidden[targets[at].kind.y + thing / 32u] >> (thing % 32u)) & 1u) == 1u;
}

// The triangle of a number as its target sees it, its corners clockwise.
fn triangle_of(number: u32) -> Triangle {
    var result: Triangle;
    let it = which(number);
    if !it.is_there {
        return result;
    }
    let at = placed[it.one].seen.x;
    let indices = triangles[it.triangle];
    if is_hidden(at, indices.w) {
        return result;
    }
    let base = placed[it.one].parts.y;
    result.a = point(it.one, at, base + indices.x);
    result.b = point(it.one, at, base + indices.y);
    result.c = point(it.one, at, base + indices.z);
    result.is_whole = result.a.is_good && result.b.is_good && result.c.is_good;
    let is_sun = targets[at].lens.y == 1.0;
    var area = 0.0;
    if result.is_whole {
        let sides = sides_of(result);
        let exact = i64(sides[0].x) * i64(sides[1].y) - i64(sides[0].y) * i64(sides[1].x);
        area = select(0.0, select(1.0, -1.0, exact < 0li), exact != 0li);
    } else if !is_sun {
        let least = targets[at].lens.x;
        let is_behind = result.a.ray.z < least && result.b.ray.z < least && result.c.ray.z < least;
        area = select(dot(result.a.ray, cross(result.b.ray, result.c.ray)), 0.0, is_behind);
    }
    result.is_shown = area < 0.0 || (is_sun && area > 0.0);
    if area < 0.0 {
        let b = result.b;
        result.b = result.c;
        result.c = b;
    }
    return result;
}

// From the first corner to the second and to the third, in steps.
fn sides_of(it: Triangle) -> array<vec2<i32>, 2> {
    return array<vec2<i32>, 2>(it.b.snapped - it.a.snapped, it.c.snapped - it.a.snapped);
}

fn is_too_steep(change: f32) -> bool {
    return !(abs(change) <= CHANGE_MAX);
}

fn plane_of(it: Triangle, at: u32) -> Plane {
    var plane: Plane;
    if it.is_whole {
        let b = it.b.exact - it.a.exact;
        let c = it.c.exact - it.a.exact;
        let bn = it.b.nearness - it.a.nearness;
        let cn = it.c.nearness - it.a.nearness;
        let per_area = 1.0 / (b.x * c.y - b.y * c.x);
        plane.anchor = it.a.exact;
        plane.change = vec2<f32>(bn * c.y - cn * b.y, cn * b.x - bn * c.x) * per_area;
        plane.nearness = it.a.nearness;
        plane.least = min(min(it.a.nearness, it.b.nearness), it.c.nearness);
        plane.most = max(max(it.a.nearness, it.b.nearness), it.c.nearness);
    } else {
        // What is 1 at all three corners.
        let normal = cross(it.b.ray - it.a.ray, it.c.ray - it.a.ray);
        let per_metre = normal / dot(normal, it.a.ray);
        plane.anchor = targets[at].lens.zw;
        plane.change = per_metre.xy;
        plane.nearness = per_metre.z;
        plane.least = 0.0;
        plane.most = 1.0 / targets[at].lens.x;
    }
    if is_too_steep(plane.change.x) || is_too_steep(plane.change.y) {
        plane.change = vec2<f32>(0.0);
    }
    let back = targets[at].eye.w * max(abs(plane.change.x), abs(plane.change.y));
    plane.nearness -= back;
    plane.least -= back;
    plane.most -= back;
    return plane;
}

fn nearness_at(plane: Plane, sample: vec2<i32>) -> f32 {
    let offset = vec2<f32>(sample) / STEPS_F - plane.anchor;
    return plane.nearness + dot(plane.change, offset);
}

// Pixels of which a sample may be between two places, in steps; no row that is not the target's.
struct Box {
    low: vec2<i32>,
    high: vec2<i32>,
};

fn box_of(it: Triangle, at: u32) -> Box {
    let width = i32(targets[at].place.y);
    let first = i32(targets[at].place.z);
    let rows = i32(targets[at].place.w);
    var low = vec2<i32>(0, first);
    var high = vec2<i32>(width - 1, first + rows - 1);
    if it.is_whole {
        let inner = select(32, 128, targets[at].kind.x == 1u);
        let least = min(min(it.a.snapped, it.b.snapped), it.c.snapped);
        let most = max(max(it.a.snapped, it.b.snapped), it.c.snapped);
        low = max(low, (least - (STEPS - inner) + STEPS - 1) >> vec2<u32>(8u));
        high = min(high, (most - inner) >> vec2<u32>(8u));
    }
    return Box(low, high);
}

// Whether samples on a side belong to the triangle: those right of it or below.
fn owns_line(along: vec2<i32>) -> bool {
    return along.y < 0 || (along.y == 0 && along.x > 0);
}

// Notes a triangle at a sample if nothing nearer is there; of what is equally near, the first number stays.
fn put(at: u32, pixel: vec2<i32>, sample: u32, nearness: f32, number: u32) {
    if nearness <= 0.0 {
        return;
    }
    let row = u32(pixel.y) - targets[at].place.z;
    let place = row * targets[at].place.y + u32(pixel.x);
    let bits = bitcast<u32>(nearness);
    if targets[at].lens.y == 1.0 {
        atomicMax(&shadows[targets[at].place.x + place], bits);
    } else {
        let value = (u64(bits) << 32u) | u64(~number);
        atomicMax(&visibility[targets[at].place.x + place * targets[at].kind.x + sample], value);
    }
}
