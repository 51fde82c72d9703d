// Draws the triangles of visible clusters, one each thread; large ones are left to `large`. Appended to
// layout and triangle.

struct Found {
    clusters: u32,
    large: atomic<u32>,
};

@group(0) @binding(4) var<storage, read> visible: array<u32>;
@group(0) @binding(5) var<storage, read_write> found: Found;
// Numbers of triangles, and columns and rows of 64 pixels each.
@group(0) @binding(11) var<storage, read_write> large: array<vec2<u32>>;

// Triangles with more samples in their box are large.
const SAMPLES_MAX: i32 = 64;

fn inside(start: vec2<i32>, end: vec2<i32>, sample: vec2<i32>) -> bool {
    let along = end - start;
    let beside = sample - start;
    let turn = along.x * beside.y - along.y * beside.x;
    return turn > 0 || (turn == 0 && owns_line(along));
}

fn draw(number: u32) {
    let it = triangle_of(number);
    if !it.is_shown {
        return;
    }
    let at = placed[chunks[number / (CLUSTERS * TRIANGLES)].x].seen.x;
    let pixels = box_of(it, at);
    let size = pixels.high - pixels.low + 1;
    if size.x <= 0 || size.y <= 0 {
        return;
    }
    let samples = targets[at].kind.x;
    // Products of longer sides do not fit into 32 bits.
    if !it.is_whole || size.x > SAMPLES_MAX || size.y > SAMPLES_MAX || size.x * size.y * i32(samples) > SAMPLES_MAX
        || is_long(it) {
        let blocks = (pixels.high >> vec2<u32>(6u)) - (pixels.low >> vec2<u32>(6u)) + 1;
        let first = atomicAdd(&found.large, u32(blocks.x * blocks.y));
        for (var block = 0; block < blocks.x * blocks.y; block++) {
            let corner = (pixels.low >> vec2<u32>(6u)) + vec2<i32>(block % blocks.x, block / blocks.x);
            if first + u32(block) < arrayLength(&large) {
                large[first + u32(block)] = vec2<u32>(number, u32(corner.x) | (u32(corner.y) << 16u));
            }
        }
        return;
    }
    let plane = plane_of(it, at);
    for (var y = pixels.low.y; y <= pixels.high.y; y++) {
        for (var x = pixels.low.x; x <= pixels.high.x; x++) {
            for (var sample = 0u; sample < samples; sample++) {
                let place = vec2<i32>(x, y) * STEPS + sample_offset(samples, sample);
                if inside(it.a.snapped, it.b.snapped, place)
                    && inside(it.b.snapped, it.c.snapped, place)
                    && inside(it.c.snapped, it.a.snapped, place) {
                    let nearness = clamp(nearness_at(plane, place), plane.least, plane.most);
                    put(at, vec2<i32>(x, y), sample, nearness, number);
                }
            }
        }
    }
}

// Whether a side is longer than 64 pixels.
fn is_long(it: Triangle) -> bool {
    let least = min(min(it.a.snapped, it.b.snapped), it.c.snapped);
    let most = max(max(it.a.snapped, it.b.snapped), it.c.snapped);
    return any(most - least > vec2<i32>(64 * STEPS));
}

@compute @workgroup_size(64)
fn small(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    for (var at = group.x; at < found.clusters; at += groups.x) {
        draw(visible[at] * TRIANGLES + lane);
    }
}
