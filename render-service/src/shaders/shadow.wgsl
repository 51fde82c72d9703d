// Depth pass as the sun sees it. Appended to common.
//
// In: vertex positions, instance placement. Out: depth only, 0 towards the sun and 1 away from it.

struct CasterIn {
    @location(0) position: vec3<f32>,
    @location(3) row_x: vec4<f32>,
    @location(4) row_y: vec4<f32>,
    @location(5) row_z: vec4<f32>,
};

@vertex
fn vertex(in: CasterIn) -> @builtin(position) vec4<f32> {
    let local = vec4<f32>(in.position, 1.0);
    let world = vec3<f32>(dot(in.row_x, local), dot(in.row_y, local), dot(in.row_z, local));
    return view.shadow_from_world * vec4<f32>(world, 1.0);
}
