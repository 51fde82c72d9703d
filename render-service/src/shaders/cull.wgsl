// Finds the clusters that their targets may show. Appended to layout.
//
// In: chunks of candidates, 64 each. Out: numbers of those that may be seen, in no order; their count.

struct Found {
    // Clusters that may be seen, parts of large triangles.
    clusters: atomic<u32>,
    large: atomic<u32>,
    // Of the submission.
    chunks: u32,
};

@group(0) @binding(4) var<storage, read_write> visible: array<u32>;
@group(0) @binding(5) var<storage, read_write> found: Found;

// Balls that would be smaller than this, in pixels, are left out.
const RADIUS_PX_MIN: f32 = 0.35;

var<workgroup> count: atomic<u32>;
var<workgroup> first: u32;

fn distance_of(at: u32, w: f32, reach: f32) -> f32 {
    return select(max(w - reach, targets[at].lens.x), 1.0, targets[at].lens.y == 1.0);
}

// Whether a cluster is of the level of its thing that is drawn: the coarsest that is off by little enough.
fn is_of_level(cluster: u32, one: u32, at: u32, stretch: f32) -> bool {
    let errors = clusters[cluster].errors * (stretch * targets[at].reach.w);
    let ball = clusters[cluster].level;
    let w = dot(targets[at].w, vec4<f32>(in_world(one, ball.xyz), 1.0));
    let distance = distance_of(at, w, ball.w * stretch);
    return distance >= errors.x && distance < errors.y;
}

// Whether all triangles of a cluster are turned away. A frame that is flat or inside out tells nothing.
fn is_turned_away(cluster: u32, one: u32, at: u32) -> bool {
    let a = placed[one].row_x;
    let b = placed[one].row_y;
    let c = placed[one].row_z;
    let bc = cross(b.xyz, c.xyz);
    let volume = dot(a.xyz, bc);
    if !(volume > 0.0) || targets[at].lens.y == 1.0 {
        return false;
    }
    let rest = targets[at].eye.xyz - vec3<f32>(a.w, b.w, c.w);
    let eye = (bc * rest.x + cross(c.xyz, a.xyz) * rest.y + cross(a.xyz, b.xyz) * rest.z) / volume;
    let to_centre = clusters[cluster].ball.xyz - eye;
    let cone = clusters[cluster].cone;
    return dot(to_centre, cone.xyz) >= cone.w * length(to_centre) + clusters[cluster].ball.w;
}

fn may_show(cluster: u32, one: u32) -> bool {
    let at = placed[one].seen.x;
    let stretch = bitcast<f32>(placed[one].seen.z);
    let ball = clusters[cluster].ball;
    let reach = ball.w * stretch;
    let centre = vec4<f32>(in_world(one, ball.xyz), 1.0);
    let w = dot(targets[at].w, centre);
    let x = dot(targets[at].x, centre);
    let y = dot(targets[at].y, centre);
    let is_sun = targets[at].lens.y == 1.0;
    let ahead = select(w - targets[at].lens.x, dot(targets[at].nearness, centre), is_sun);
    let beside = targets[at].size.xy * w - abs(vec2<f32>(x, y)) + targets[at].reach.xy * reach;
    let is_large = reach * targets[at].size.z >= distance_of(at, w, reach) * RADIUS_PX_MIN;
    return is_large
        && ahead + reach * targets[at].reach.z >= 0.0
        && all(beside >= vec2<f32>(0.0))
        && is_of_level(cluster, one, at, stretch)
        && !is_turned_away(cluster, one, at);
}

@compute @workgroup_size(64)
fn cull(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let chunk = group.x + group.y * groups.x;
    var is_seen = false;
    if chunk < found.chunks {
        let one = chunks[chunk].x;
        let at = chunks[chunk].y + lane;
        is_seen = at < placed[one].seen.y && may_show(placed[one].parts.w + at, one);
    }
    if lane == 0u {
        atomicStore(&count, 0u);
    }
    workgroupBarrier();
    var place = 0u;
    if is_seen {
        place = atomicAdd(&count, 1u);
    }
    workgroupBarrier();
    if lane == 0u {
        first = atomicAdd(&found.clusters, atomicLoad(&count));
    }
    workgroupBarrier();
    if is_seen {
        visible[first + place] = chunk * CLUSTERS + lane;
    }
}
