//! One measurement of each sensor for a frame that was several ticks of the world.

use schemas::{LidarPoint, Measurement, Pose, Scan, SemanticLidarPoint, SensorDatum, Vec3};

/// Joins what a sensor measured in consecutive ticks: scans are added up, in the axes of the last
/// one; of states the last counts; events stay apart.
pub(crate) fn merge(data: Vec<SensorDatum>) -> Vec<SensorDatum> {
    let mut merged: Vec<SensorDatum> = Vec::with_capacity(data.len());
    for datum in data {
        let earlier = merged.iter_mut().find(|earlier| earlier.sensor == datum.sensor);
        match earlier {
            Some(earlier) if is_periodic(&datum.measurement) => join(earlier, datum),
            _ => merged.push(datum),
        }
    }
    merged
}

fn is_periodic(measurement: &Measurement) -> bool {
    !matches!(
        measurement,
        Measurement::Collision { .. }
            | Measurement::Obstacle { .. }
            | Measurement::LaneInvasion { .. }
            | Measurement::V2x(_)
            | Measurement::V2xCustom(_)
    )
}

fn join(earlier: &mut SensorDatum, mut later: SensorDatum) {
    let later_from_earlier = later.world_from_sensor.inverse() * earlier.world_from_sensor;
    match (&mut earlier.measurement, &mut later.measurement) {
        (Measurement::Lidar(before), Measurement::Lidar(after)) => {
            after.prepend(before, &later_from_earlier);
        }
        (Measurement::SemanticLidar(before), Measurement::SemanticLidar(after)) => {
            after.prepend(before, &later_from_earlier);
        }
        (Measurement::Radar(before), Measurement::Radar(after)) => {
            before.append(after);
            std::mem::swap(before, after);
        }
        _ => {}
    }
    *earlier = later;
}

/// A point that can be seen from another place.
trait Point: Copy {
    fn position_m(&mut self) -> &mut [f32; 3];
}

impl Point for LidarPoint {
    fn position_m(&mut self) -> &mut [f32; 3] {
        &mut self.position_m
    }
}

impl Point for SemanticLidarPoint {
    fn position_m(&mut self) -> &mut [f32; 3] {
        &mut self.position_m
    }
}

trait Prepend<P> {
    /// Puts the points of an earlier scan before those of the same channel.
    fn prepend(&mut self, earlier: &Scan<P>, here_from_there: &Pose);
}

impl<P: Point> Prepend<P> for Scan<P> {
    fn prepend(&mut self, earlier: &Self, here_from_there: &Pose) {
        let mut points = Vec::with_capacity(self.points.len() + earlier.points.len());
        let (mut ours, mut theirs) = (self.points.iter(), earlier.points.iter());
        let counts = self.points_per_channel.iter_mut();
        for (count, before) in counts.zip(&earlier.points_per_channel) {
            points.extend(theirs.by_ref().take(*before as usize).map(|point| {
                let mut moved = *point;
                let position_m = moved.position_m();
                let there_m = Vec3::from(*position_m);
                *position_m = here_from_there.transform_point(&there_m.into()).coords.into();
                moved
            }));
            points.extend(ours.by_ref().take(*count as usize));
            *count += before;
        }
        self.points = points;
    }
}

#[cfg(test)]
mod tests {
    use schemas::{ActorId, Tick};

    use super::*;

    fn datum(x_m: f32, measurement: Measurement) -> SensorDatum {
        SensorDatum {
            sensor: ActorId::new(3).unwrap(),
            tick: Tick(1),
            sim_secs: 0.1,
            world_from_sensor: Pose::translation(x_m, 0.0, 0.0),
            measurement,
        }
    }

    fn scan(ahead_m: &[f32], points_per_channel: Vec<u32>) -> Measurement {
        let point = |x: &f32| LidarPoint { position_m: [*x, 0.0, 0.0], intensity: 1.0 };
        let points = ahead_m.iter().map(point).collect();
        Measurement::Lidar(Scan { end_angle_rad: 0.0, points_per_channel, points })
    }

    #[test]
    fn two_scans_are_one_from_the_place_of_the_last() {
        let data = vec![
            datum(0.0, scan(&[10.0, 20.0], vec![1, 1])),
            datum(1.0, scan(&[30.0, 40.0, 50.0], vec![2, 1])),
        ];
        let merged = merge(data);
        let [SensorDatum { measurement: Measurement::Lidar(scan), .. }] = &merged[..] else {
            panic!("{merged:?}")
        };
        let ahead_m: Vec<f32> = scan.points.iter().map(|point| point.position_m[0]).collect();
        assert_eq!(ahead_m, [9.0, 30.0, 40.0, 19.0, 50.0]);
        assert_eq!(scan.points_per_channel, [3, 2]);
    }

    #[test]
    fn events_stay_apart_and_of_states_the_last_counts() {
        let event = |distance_m| Measurement::Obstacle { other: None, tag: 3, distance_m };
        let events = [
            event(1.0),
            Measurement::V2x(Vec::new()),
            Measurement::V2xCustom(Vec::new()),
            Measurement::LaneInvasion { marks: Vec::new() },
        ];
        for event in events {
            let twice = vec![datum(0.0, event.clone()), datum(1.0, event)];
            assert_eq!(merge(twice.clone()), twice, "both, and in order");
        }
        let state =
            |altitude_m| Measurement::Gnss { latitude_deg: 0.0, longitude_deg: 0.0, altitude_m };
        let merged = merge(vec![datum(0.0, state(1.0)), datum(0.0, state(2.0))]);
        assert_eq!(merged, [datum(0.0, state(2.0))]);
    }
}
