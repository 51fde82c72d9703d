// Draws large triangles, and those that come too near to the eye or reach far out: a block of 64 x 64
// pixels of one each workgroup. Appended to layout and triangle.

struct Found {
    clusters: u32,
    large: u32,
};

@group(0) @binding(5) var<storage, read> found: Found;
@group(0) @binding(11) var<storage, read> large: array<vec2<u32>>;

// Side of a tile of pixels that the workgroup draws at once.
const TILE: i32 = 8;

var<workgroup> tiles: array<u32, 64>;
var<workgroup> tile_count: atomic<u32>;

// A side: in whole numbers from a corner, or, where a corner is not good, through the eye and both ends.
struct Side {
    start: vec2<i32>,
    along: vec2<i32>,
    // From the first of both ends to the other one, whichever triangle asks.
    normal: vec3<f32>,
    is_exact: bool,
    is_swapped: bool,
};

fn comes_first(a: vec3<f32>, b: vec3<f32>) -> bool {
    return a.z < b.z || (a.z == b.z && (a.y < b.y || (a.y == b.y && a.x < b.x)));
}

fn side_of(start: Point, end: Point) -> Side {
    let is_swapped = comes_first(end.ray, start.ray);
    let one = select(start.ray, end.ray, is_swapped);
    let other = select(end.ray, start.ray, is_swapped);
    let is_exact = start.is_good && end.is_good;
    return Side(start.snapped, end.snapped - start.snapped, cross(one, other), is_exact, is_swapped);
}

// Whether a place in steps is on the inner side.
fn is_inside(side: Side, place: vec2<i32>, middle: vec2<f32>) -> bool {
    if side.is_exact {
        let beside = place - side.start;
        let turn = i64(side.along.x) * i64(beside.y) - i64(side.along.y) * i64(beside.x);
        return turn > 0li || (turn == 0li && owns_line(side.along));
    }
    let ray = vec3<f32>(vec2<f32>(place) / STEPS_F - middle, 1.0);
    let turn = dot(side.normal, ray);
    return select(turn > 0.0, turn <= 0.0, side.is_swapped);
}

// Whether a square from a place on, so many steps wide, may have a place on the inner side.
fn may_reach(side: Side, start: vec2<i32>, width: i32, middle: vec2<f32>) -> bool {
    return is_inside(side, start, middle)
        || is_inside(side, start + vec2<i32>(width, 0), middle)
        || is_inside(side, start + vec2<i32>(0, width), middle)
        || is_inside(side, start + width, middle);
}

fn draw_block(number: u32, block: vec2<i32>, lane: u32) {
    let it = triangle_of(number);
    let at = placed[chunks[number / (CLUSTERS * TRIANGLES)].x].seen.x;
    let pixels = box_of(it, at);
    let plane = plane_of(it, at);
    let middle = targets[at].lens.zw;
    let samples = targets[at].kind.x;
    let sides = array<Side, 3>(side_of(it.a, it.b), side_of(it.b, it.c), side_of(it.c, it.a));
    if lane == 0u {
        atomicStore(&tile_count, 0u);
    }
    workgroupBarrier();
    let tile = block * 64 + vec2<i32>(i32(lane) % 8, i32(lane) / 8) * TILE;
    let is_in_box = all(tile <= pixels.high) && all(tile + TILE > pixels.low);
    if is_in_box
        && may_reach(sides[0], tile * STEPS, TILE * STEPS, middle)
        && may_reach(sides[1], tile * STEPS, TILE * STEPS, middle)
        && may_reach(sides[2], tile * STEPS, TILE * STEPS, middle) {
        tiles[atomicAdd(&tile_count, 1u)] = lane;
    }
    workgroupBarrier();
    let count = atomicLoad(&tile_count);
    for (var next = 0u; next < count; next++) {
        let corner = block * 64 + vec2<i32>(i32(tiles[next]) % 8, i32(tiles[next]) / 8) * TILE;
        let pixel = corner + vec2<i32>(i32(lane) % TILE, i32(lane) / TILE);
        if all(pixel >= pixels.low) && all(pixel <= pixels.high) {
            for (var sample = 0u; sample < samples; sample++) {
                let place = pixel * STEPS + sample_offset(samples, sample);
                let nearness = nearness_at(plane, place);
                let is_there = it.is_whole || (nearness > plane.least && nearness <= plane.most);
                if is_there
                    && is_inside(sides[0], place, middle)
                    && is_inside(sides[1], place, middle)
                    && is_inside(sides[2], place, middle) {
                    put(at, pixel, sample, clamp(nearness, plane.least, plane.most), number);
                }
            }
        }
    }
    workgroupBarrier();
}

@compute @workgroup_size(64)
fn large_blocks(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let count = min(found.large, arrayLength(&large));
    for (var at = group.x; at < count; at += groups.x) {
        let one = large[at];
        draw_block(one.x, vec2<i32>(i32(one.y & 0xffffu), i32(one.y >> 16u)), lane);
    }
}
