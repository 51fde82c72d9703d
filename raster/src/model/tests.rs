//! Clusters of a model: whole, small, and without what is broken.

use super::*;

fn strip(count: u32) -> Model {
    let corner = |x: f32, y: f32| Corner {
        position: [x, y, 0.0],
        normal: [0.0, 0.0, 1.0],
        ..Corner::default()
    };
    let corners = (0..=count).flat_map(|at| [corner(at as f32, 0.0), corner(at as f32, 1.0)]);
    let triangles: Vec<[u32; 3]> = (0..count).map(|at| [2 * at, 2 * at + 2, 2 * at + 1]).collect();
    Model::new(corners.collect(), &triangles, &[Some(4)])
}

#[test]
fn every_triangle_is_in_one_small_cluster_whose_ball_holds_it() {
    let model = strip(1_000);
    let mut seen: Vec<[u32; 3]> = Vec::new();
    for (at, cluster) in model.clusters.iter().enumerate() {
        let Block { balls, cones, .. } = &model.blocks[at / 8];
        let [x, y, z, radius] = balls.map(|part| part[at % 8]);
        assert!(cluster.triangles.len() <= CLUSTER_MAX && cones[3][at % 8] < 0.01);
        for triangle in &model.triangles[cluster.triangles.clone()] {
            if *triangle == [0; 3] {
                continue;
            }
            seen.push(*triangle);
            for corner in model.corners_of(triangle).unwrap() {
                assert!(norm(sub(corner.position, [x, y, z])) <= radius);
            }
        }
    }
    seen.sort();
    assert_eq!(seen.len(), 1_000);
    assert!(seen.iter().zip(0..).all(|(triangle, at)| triangle[0] == 2 * at));
}

#[test]
fn what_is_broken_is_left_out_and_the_thing_goes_with_its_triangle() {
    let mut corners = vec![Corner::default(); 3];
    corners[1].position = [1.0, 0.0, 0.0];
    corners[2].position = [0.0, 1.0, 0.0];
    corners.push(Corner { position: [f32::NAN; 3], ..Corner::default() });
    let triangles = [[0, 1, 3], [0, 0, 1], [0, 1, 9], [0, 1, 2]];
    let things = [None, None, None, Some(7)];
    let model = Model::new(corners, &triangles, &things);
    assert_eq!((model.clusters.len(), model.triangle_count()), (1, 8));
    assert_eq!((model.thing(0), model.thing(1)), (Some(7), None));
    assert_eq!(Model::new(Vec::new(), &triangles, &[]).triangle_count(), 0);
}
