// Pixels of what is visible: colours, or depth, labels and normals. Appended to all before.
//
// In: the buffer of visible triangles. Out: four bytes a pixel, without gaps.

const NOWHERE: u32 = 0xffffffffu;

// A triangle that a pixel shows.
struct Seen {
    one: u32,
    corners: vec3<u32>,
    label: u32,
};

fn seen_of(number: u32) -> Seen {
    let chunk = chunks[number / (CLUSTERS * TRIANGLES)];
    let cluster = placed[chunk.x].parts.w + chunk.y + number / TRIANGLES % CLUSTERS;
    let triangle = placed[chunk.x].parts.z + clusters[cluster].first + number % TRIANGLES;
    let at = triangles[triangle].xyz + placed[chunk.x].parts.y;
    let own = placed[chunk.x].parts.x;
    return Seen(chunk.x, at, select(own, corners[at.x].looks.w, own == 0u));
}

fn position(seen: Seen, corner: u32) -> vec3<f32> {
    return in_world(seen.one, bitcast<vec3<f32>>(corners[corner].place.xyz));
}

fn normal_of(seen: Seen, corner: u32) -> vec3<f32> {
    let xy = corners[corner].place.w;
    let z = corners[corner].looks.x;
    let packed = vec3<i32>(i32(xy << 16u) >> 16u, i32(xy) >> 16u, i32(z << 16u) >> 16u);
    let one = seen.one;
    return unstretched(vec3<f32>(packed), placed[one].row_x.xyz, placed[one].row_y.xyz, placed[one].row_z.xyz);
}

// Parts of the second and the third corner at a place on a triangle.
fn parts_at(seen: Seen, world: vec3<f32>) -> vec2<f32> {
    let first = position(seen, seen.corners.x);
    let along = position(seen, seen.corners.y) - first;
    let aside = position(seen, seen.corners.z) - first;
    let upright = cross(along, aside);
    let per_area = 1.0 / max(dot(upright, upright), 1e-30);
    let from_first = (world - first) * per_area;
    let parts = vec2<f32>(dot(from_first, cross(aside, upright)), dot(from_first, cross(upright, along)));
    return clamp(parts, vec2<f32>(0.0), vec2<f32>(1.0));
}

fn normal_at(seen: Seen, parts: vec2<f32>) -> vec3<f32> {
    let a = normal_of(seen, seen.corners.x);
    let b = normal_of(seen, seen.corners.y);
    let c = normal_of(seen, seen.corners.z);
    let mixed = a + (b - a) * parts.x + (c - a) * parts.y;
    let square = dot(mixed, mixed);
    return select(a, mixed * inverseSqrt(square), square > 1e-8);
}

fn tint_of(one: u32, slot: u32) -> vec4<f32> {
    if slot >= 4u {
        return vec4<f32>(1.0, 1.0, 1.0, 0.0);
    }
    return unpack4x8unorm(placed[one].tints[slot]);
}

// Radiance of a triangle at a place in the world.
fn radiance_of(number: u32, world: vec3<f32>, direction: vec3<f32>, distance: f32) -> vec3<f32> {
    let seen = seen_of(number);
    let parts = parts_at(seen, world);
    let first = corners[seen.corners.x].looks;
    let material = materials[(first.x >> 16u) & 255u];
    let tint = tint_of(seen.one, u32(material.pattern_tint.y));
    var surface: Surface;
    surface.world = world;
    surface.normal = normal_at(seen, parts);
    surface.colour = vec4<f32>(material.colour_gloss.rgb * tint.rgb, tint.a);
    surface.look = vec3<f32>(material.colour_gloss.a, material.pattern_tint.x, f32(first.x >> 24u));
    var colour: vec3<f32>;
    switch u32(material.pattern_tint.z) {
        case 0u: {
            colour = ground(surface, direction, distance);
        }
        case 1u: {
            let a = bitcast<vec2<f32>>(first.yz);
            let b = bitcast<vec2<f32>>(corners[seen.corners.y].looks.yz);
            let c = bitcast<vec2<f32>>(corners[seen.corners.z].looks.yz);
            surface.facade_m = a + (b - a) * parts.x + (c - a) * parts.y;
            colour = facade(surface, direction, distance);
        }
        default: {
            colour = body(surface, inside_of(seen.one, world, direction), direction, distance);
        }
    }
    return hazed(colour, distance, direction);
}

// Along the view to a place in the picture, in pixels; 1 m along the view.
fn ray_to(place: vec2<f32>) -> vec3<f32> {
    let size = vec2<f32>(views[view].size.xy);
    let at = place / size * 2.0 - 1.0;
    return views[view].forward.xyz - views[view].left.xyz * at.x - views[view].up.xyz * at.y;
}

fn offset_of(samples: u32, sample: u32) -> vec2<f32> {
    return vec2<f32>(sample_offset(samples, sample)) / 256.0;
}

// What a pixel shows of a triangle, or of the sky: displayed colour, linear.
fn shown(number: u32, nearness: f32, place: vec2<f32>) -> vec3<f32> {
    let ray = ray_to(place);
    let length = length(ray);
    let direction = ray / length;
    if nearness <= 0.0 {
        return displayed(clouded_sky(direction));
    }
    let depth = 1.0 / nearness;
    let world = views[view].eye.xyz + ray * depth;
    return displayed(radiance_of(number, world, direction, depth * length));
}

// The colour of a pixel: each triangle that its samples show is shaded once, in the middle of them.
fn colour_of(pixel: vec2<u32>, first: u32) -> u32 {
    let samples = views[view].samples.y;
    var sum = vec3<f32>(0.0);
    for (var at = 0u; at < samples; at++) {
        let number = visibility[first + at].x;
        var is_new = true;
        for (var before = 0u; before < at; before++) {
            is_new = is_new && visibility[first + before].x != number;
        }
        if is_new {
            var count = 0.0;
            var nearness = 0.0;
            var place = vec2<f32>(0.0);
            for (var other = at; other < samples; other++) {
                let seen = visibility[first + other];
                if seen.x == number {
                    count += 1.0;
                    nearness += bitcast<f32>(seen.y);
                    place += offset_of(samples, other);
                }
            }
            sum += count * shown(~number, nearness / count, vec2<f32>(pixel) + place / count);
        }
    }
    var colour = sum / f32(samples);
    if views[view].air.y > 0.0 {
        let height = f32(views[view].size.y);
        let middle = vec2<f32>(views[view].size.xy) * 0.5;
        colour = rained_on(colour, (vec2<f32>(pixel) + 0.5 - middle) / height);
    }
    return pack4x8unorm(vec4<f32>(encoded(colour), 1.0));
}

fn write_geometry(pixel: vec2<u32>, first: u32, place: u32) {
    let seen = visibility[first];
    let nearness = bitcast<f32>(seen.y);
    let outs = views[view].outs;
    let is_there = nearness > 0.0;
    if outs.x != NOWHERE {
        let depth = select(DEPTH_MAX_M, min(1.0 / nearness, DEPTH_MAX_M), is_there);
        pixels[outs.x + place] = bitcast<u32>(depth);
    }
    if outs.y == NOWHERE && outs.z == NOWHERE {
        return;
    }
    var label = SKY_LABEL;
    var normal = vec3<f32>(0.0);
    if is_there {
        let triangle = seen_of(~seen.x);
        label = triangle.label;
        let ray = ray_to(vec2<f32>(pixel) + 0.5);
        let world = views[view].eye.xyz + ray / nearness;
        let turned = normal_at(triangle, parts_at(triangle, world));
        let left = normalize(views[view].left.xyz);
        let up = normalize(views[view].up.xyz);
        normal = vec3<f32>(dot(turned, views[view].forward.xyz), dot(turned, left), dot(turned, up));
    }
    if outs.y != NOWHERE {
        pixels[outs.y + place] = label;
    }
    if outs.z != NOWHERE {
        pixels[outs.z + place] = pack4x8snorm(vec4<f32>(normal, 0.0));
    }
}

// One tile of 8 x 8 pixels each workgroup, of the view that its number says.
@compute @workgroup_size(64)
fn shade(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    view = group.y;
    let size = views[view].size;
    let across = (size.x + 7u) / 8u;
    let tiles = across * ((size.w + 7u) / 8u);
    for (var tile = group.x; tile < tiles; tile += groups.x) {
        let corner = vec2<u32>(tile % across, tile / across) * 8u;
        let at = corner + vec2<u32>(lane % 8u, lane / 8u);
        if at.x < size.x && at.y < size.w {
            let place = at.y * size.x + at.x;
            let first = views[view].samples.x + place * views[view].samples.y;
            let pixel = vec2<u32>(at.x, at.y + size.z);
            if views[view].samples.z == 1u {
                pixels[views[view].outs.x + place] = colour_of(pixel, first);
            } else {
                write_geometry(pixel, first, place);
            }
        }
    }
}
