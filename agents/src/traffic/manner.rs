//! How hard a driver drives, and the intelligent driver model.

use schemas::AgentBehaviour;

use crate::path::PathPoint;

/// A speed too high is braked off within about this time.
const HASTE_SECS: f32 = 0.6;
/// Slower than this nobody is braked gently any more.
const HELD_MPS: f32 = 0.5;
/// No driver brakes harder, in metres per second squared.
const BRAKING_MAX: f32 = 8.0;

/// A driver in numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Manner {
    /// Of the speed limit.
    share: f32,
    /// Where no limit is posted.
    speed_mps: f32,
    /// To the vehicle ahead, in seconds and at rest.
    headway_secs: f32,
    pub gap_m: f32,
    /// Comfortable acceleration, and braking and sideways in curves with the grip there is.
    speed_up_mps2: f32,
    braking_mps2: f32,
    curve_mps2: f32,
    /// What a lane change must gain, and how much the others' loss counts.
    pub gain_mps2: f32,
    pub politeness: f32,
}

impl Manner {
    /// Of a driver on a road with this grip over that of a dry one.
    pub(super) fn of(behaviour: AgentBehaviour, grip: f32) -> Self {
        let dry = Self::on_dry_roads(behaviour);
        let (braking_mps2, curve_mps2) = (dry.braking_mps2 * grip, dry.curve_mps2 * grip);
        Self { braking_mps2, curve_mps2, ..dry }
    }

    fn on_dry_roads(behaviour: AgentBehaviour) -> Self {
        let normal = Self {
            share: 1.0,
            speed_mps: 50.0 / 3.6,
            headway_secs: 1.4,
            gap_m: 2.0,
            speed_up_mps2: 1.8,
            braking_mps2: 2.0,
            curve_mps2: 2.2,
            gain_mps2: 0.3,
            politeness: 0.3,
        };
        match behaviour {
            AgentBehaviour::Basic | AgentBehaviour::Normal => normal,
            AgentBehaviour::Cautious => Self {
                share: 0.85,
                headway_secs: 1.9,
                gap_m: 2.5,
                speed_up_mps2: 1.2,
                curve_mps2: 1.8,
                gain_mps2: 0.6,
                politeness: 0.6,
                ..normal
            },
            AgentBehaviour::Aggressive => Self {
                share: 1.15,
                headway_secs: 1.0,
                gap_m: 1.6,
                speed_up_mps2: 2.5,
                braking_mps2: 2.8,
                curve_mps2: 2.8,
                gain_mps2: 0.15,
                politeness: 0.0,
                ..normal
            },
        }
    }

    /// How far ahead counts.
    pub(super) fn horizon_m(&self, speed_mps: f32) -> f32 {
        45.0 + 1.5 * self.headway_secs * speed_mps + self.stopping_m(speed_mps)
    }

    pub(super) fn stopping_m(&self, speed_mps: f32) -> f32 {
        speed_mps * speed_mps / (2.0 * self.braking_mps2)
    }

    /// As fast as limits and curves on the way allow here, and its end after `left_m`.
    pub(super) fn free_mps(&self, points: &[PathPoint], left_m: f32) -> f32 {
        let end_mps = (2.0 * self.braking_mps2 * (left_m - 4.0).max(0.0)).sqrt();
        let fastest2 = |at: &PathPoint, next: Option<&PathPoint>| {
            let limit_mps = at.point.limit_mps;
            let posted = if limit_mps > 0.0 { self.limit_mps(limit_mps) } else { self.speed_mps };
            let (posted2, bend_per_m) = (posted * posted, at.curvature_per_m(next).max(1.0e-4));
            // Most of a way bends too little to count.
            let counts = posted2 * bend_per_m > 0.99 * self.curve_mps2;
            let curve = if counts { self.curve_mps2 / bend_per_m } else { posted2 };
            posted2.min(curve) + 2.0 * self.braking_mps2 * at.ahead_m
        };
        let mut least = points.last().map_or(f32::INFINITY, |last| fastest2(last, None));
        for pair in points.windows(2) {
            let [at, next] = pair else { continue };
            // What is farther than it takes to stop slows nobody down.
            if 2.0 * self.braking_mps2 * at.ahead_m > least {
                break;
            }
            least = least.min(fastest2(at, Some(next)));
        }
        end_mps.min(least.max(0.0).sqrt())
    }

    /// Acceleration with nobody ahead.
    pub(super) fn free(&self, speed_mps: f32, free_mps: f32) -> f32 {
        // Whoever is to stand and does stays where it is.
        if free_mps <= 0.0 && speed_mps < HELD_MPS {
            return -HELD_MPS / HASTE_SECS;
        }
        let share = speed_mps / free_mps.max(0.1);
        let wanted = self.speed_up_mps2 * (1.0 - share.powi(4));
        let over_mps = speed_mps - free_mps;
        let wanted = if over_mps > 0.0 { wanted.min(-over_mps / HASTE_SECS) } else { wanted };
        wanted.max(-self.braking_mps2 * 1.5)
    }

    /// Acceleration behind somebody at a gap, who drives at a speed.
    pub(super) fn behind(&self, speed_mps: f32, free_mps: f32, leader: (f32, f32)) -> f32 {
        let (gap_m, leader_mps) = leader;
        self.follow(speed_mps, free_mps, (gap_m, leader_mps.max(0.0)), self.gap_m)
    }

    /// Gap at which it keeps a speed behind somebody as fast as itself.
    pub(super) fn steady_gap_m(&self, speed_mps: f32, free_mps: f32) -> f32 {
        let share = (speed_mps / free_mps).min(1.0);
        (self.gap_m + self.headway_secs * speed_mps) / (1.0 - share.powi(4)).sqrt()
    }

    /// Speed on a free road with this limit.
    pub(super) fn limit_mps(&self, limit_mps: f32) -> f32 {
        self.share * limit_mps
    }

    /// Acceleration before a place to stop at.
    pub(super) fn before(&self, speed_mps: f32, free_mps: f32, line_m: f32) -> f32 {
        self.follow(speed_mps, free_mps, (line_m, 0.0), 0.3)
    }

    fn follow(
        &self,
        speed_mps: f32,
        free_mps: f32,
        (gap_m, leader_mps): (f32, f32),
        rest_m: f32,
    ) -> f32 {
        let closing = speed_mps * (speed_mps - leader_mps);
        let hasty = 2.0 * (self.speed_up_mps2 * self.braking_mps2).sqrt();
        let moving_m = speed_mps * self.headway_secs * if rest_m < 1.0 { 0.4 } else { 1.0 };
        let wanted_m = rest_m + (moving_m + closing / hasty).max(0.0);
        let share = wanted_m / gap_m.max(0.1);
        let free = self.speed_up_mps2 * (1.0 - (speed_mps / free_mps.max(0.1)).powi(4));
        let held = free - self.speed_up_mps2 * share * share;
        // Standing close behind is no reason to roll on.
        let held = if gap_m < rest_m && speed_mps < 0.5 { held.min(-1.0) } else { held };
        held.max(-BRAKING_MAX)
    }
}

#[cfg(test)]
mod tests {
    use schemas::Vec3;

    use super::*;
    use crate::network::LanePoint;

    #[test]
    fn a_driver_settles_behind_a_leader_at_its_speed_and_distance() {
        let manner = Manner::of(AgentBehaviour::Normal, 1.0);
        let (mut gap_m, mut speed_mps) = (60.0, 14.0);
        let mut least_m: f32 = gap_m;
        for _ in 0..2_000 {
            speed_mps += manner.behind(speed_mps, 14.0, (gap_m, 8.0)) * 0.05;
            gap_m += (8.0 - speed_mps) * 0.05;
            least_m = least_m.min(gap_m);
        }
        assert!((speed_mps - 8.0).abs() < 0.05, "{speed_mps}");
        assert!((11.0..18.0).contains(&gap_m) && least_m > 8.0, "{gap_m}, {least_m}");
    }

    fn way(points: &[(f32, f32, f32)]) -> Vec<PathPoint> {
        let point = |&(ahead_m, curvature_per_m, limit_mps): &(f32, f32, f32)| {
            let point = LanePoint {
                at_m: ahead_m,
                point_m: Vec3::new(ahead_m, 0.0, 0.0),
                heading_rad: 0.0,
                curvature_per_m,
                limit_mps,
                width_m: 3.5,
            };
            PathPoint { point, ahead_m }
        };
        points.iter().map(point).collect()
    }

    #[test]
    fn a_driver_brakes_before_a_curve_and_a_lower_limit_in_comfort() {
        let manner = Manner::of(AgentBehaviour::Normal, 1.0);
        let free_mps = |points: &[(f32, f32, f32)]| manner.free_mps(&way(points), 1_000.0);
        assert_eq!(free_mps(&[(0.0, 0.0, 12.0), (50.0, 0.0, 12.0)]), 12.0);
        // Radius 20 m: 2.2 m/s² sideways are 6.63 m/s, whichever way it turns.
        for curvature_per_m in [0.05, -0.05] {
            let here_mps = free_mps(&[(0.0, curvature_per_m, 20.0)]);
            assert!((here_mps - 6.63).abs() < 0.01, "{here_mps}");
            let before_mps = free_mps(&[(0.0, 0.0, 20.0), (30.0, curvature_per_m, 20.0)]);
            assert!((before_mps - 12.81).abs() < 0.01, "{before_mps}");
        }
        // With 0.64 of the grip everything that tyres do is so much weaker.
        let wet = Manner::of(AgentBehaviour::Normal, 0.64);
        let bend = way(&[(0.0, 0.0, 20.0), (30.0, 0.05, 20.0)]);
        let wet_mps = wet.free_mps(&bend, 1_000.0);
        assert!((wet_mps - 0.8 * 12.81).abs() < 0.01, "{wet_mps}");
        assert!(wet.stopping_m(10.0) > 1.5 * manner.stopping_m(10.0));
        // Two lanes that meet at 41°.
        let mut kinked = way(&[(0.0, 0.0, 20.0), (2.0, 0.0, 20.0), (4.0, 0.0, 20.0)]);
        kinked[2].point.heading_rad = 0.715;
        let kink_mps = manner.free_mps(&kinked, 1_000.0);
        let wanted_mps = (2.2f32 / ((0.715 - 0.05) / 2.0) + 2.0 * 2.0 * 2.0).sqrt();
        assert!((kink_mps - wanted_mps).abs() < 0.01, "{kink_mps}");
        let lower_mps = free_mps(&[(0.0, 0.0, 20.0), (25.0, 0.0, 10.0)]);
        assert!((lower_mps - 14.14).abs() < 0.01, "{lower_mps}");
    }

    #[test]
    fn who_is_to_stand_is_held_whether_it_moves_or_not() {
        let manner = Manner::of(AgentBehaviour::Normal, 1.0);
        for speed_mps in [0.0, 0.01, 0.3, 1.0, 10.0] {
            let free_mps2 = manner.free(speed_mps, 0.0);
            assert!((-3.0..-0.5).contains(&free_mps2), "{speed_mps} m/s: {free_mps2}");
        }
        assert!(manner.free(0.0, 1.0) > 0.5);
    }

    #[test]
    fn at_its_steady_gap_a_driver_keeps_its_speed() {
        for behaviour in
            [AgentBehaviour::Cautious, AgentBehaviour::Normal, AgentBehaviour::Aggressive]
        {
            let manner = Manner::of(behaviour, 1.0);
            for speed_mps in [0.6, 3.0, 8.0, 13.0] {
                let gap_m = manner.steady_gap_m(speed_mps, 14.0);
                let held_mps2 = manner.behind(speed_mps, 14.0, (gap_m, speed_mps));
                assert!(held_mps2.abs() < 1.0e-3, "{behaviour:?}, {speed_mps}: {held_mps2}");
            }
        }
    }

    #[test]
    fn a_driver_stops_before_a_line_and_not_beyond() {
        for behaviour in
            [AgentBehaviour::Cautious, AgentBehaviour::Normal, AgentBehaviour::Aggressive]
        {
            let manner = Manner::of(behaviour, 1.0);
            let (mut line_m, mut speed_mps) = (60.0f32, 14.0f32);
            for _ in 0..1_200 {
                speed_mps = (speed_mps + manner.before(speed_mps, 14.0, line_m) * 0.05).max(0.0);
                line_m -= speed_mps * 0.05;
            }
            assert!((0.0..2.0).contains(&line_m) && speed_mps < 0.1, "{line_m}, {speed_mps}");
        }
    }
}
