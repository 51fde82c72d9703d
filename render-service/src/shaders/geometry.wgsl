// Depth, label and normal of every visible surface. Appended to common.
//
// In: vertices (position, packed normal, label), instances (placement, label). Out: metres along the
// view, at most DEPTH_MAX_M; tag and id as the vertex or, where it has one, the instance says; normal
// in the camera's axes as four signed bytes, the last 0.

struct VertexIn {
    @location(0) position: vec3<f32>,
    @location(1) normal_material: vec4<i32>,
    @location(3) row_x: vec4<f32>,
    @location(4) row_y: vec4<f32>,
    @location(5) row_z: vec4<f32>,
    @location(10) label: u32,
    @location(11) instance_label: u32,
};

struct Point {
    @builtin(position) clip: vec4<f32>,
    @location(0) normal: vec3<f32>,
    @location(1) @interpolate(flat) label: u32,
};

struct Facts {
    @location(0) depth_m: f32,
    @location(1) label: u32,
    @location(2) normal: u32,
};

@vertex
fn vertex(in: VertexIn) -> Point {
    let local = vec4<f32>(in.position, 1.0);
    let world = vec3<f32>(dot(in.row_x, local), dot(in.row_y, local), dot(in.row_z, local));
    let n = unstretched(vec3<f32>(in.normal_material.xyz), in.row_x.xyz, in.row_y.xyz, in.row_z.xyz);
    let axes = transpose(mat3x3<f32>(view.forward.xyz, normalize(view.left.xyz), normalize(view.up.xyz)));
    let clip = view.clip_from_world * vec4<f32>(world, 1.0);
    let label = select(in.label, in.instance_label, in.instance_label != 0u);
    return Point(clip, axes * n, label);
}

@fragment
fn fragment(in: Point) -> Facts {
    // A fragment's w is the reciprocal of the clip position's, which is the distance along the view.
    let depth_m = min(1.0 / in.clip.w, DEPTH_MAX_M);
    return Facts(depth_m, in.label, pack4x8snorm(vec4<f32>(normalize(in.normal), 0.0)));
}
