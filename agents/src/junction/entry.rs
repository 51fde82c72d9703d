//! The entry of a junction: who may enter now, and where others wait.

use schemas::ActorId;
use serde::{Deserialize, Serialize};

use super::claims::{Asker, Claims, URGENT};
use super::grants::Way;
use super::{Passage, room_m};
use crate::network::Stop;
use crate::path::Path;
use crate::scene::{Ahead, Queue};
use crate::senses::Senses;

/// How far before a line or an entry a vehicle stops.
pub(crate) const BEFORE_LINE_M: f32 = 1.0;
/// Slower than this a vehicle stands.
pub(super) const STANDING_MPS: f32 = 0.2;
/// Whoever stands nearer ahead than this is why one stands.
const BLOCKED_M: f32 = 6.0;
/// Lines this far inside a junction belong to its entry.
pub(crate) const INSIDE_M: f32 = 4.0;
/// Who is held by the line of a stop sign just inside a junction stands so far before it.
const AT_SIGN_M: f32 = 2.0;
/// A stop line this far ahead of the bumper at most is the one that a vehicle stands at: so far
/// back at least boxes of stop signs reach.
pub(crate) const AT_LINE_M: f32 = 3.0;
/// Lines so far behind the vehicle still tell who it is to let through.
const BEHIND_M: f32 = 12.0;
/// Who waited as long as this goes before others: behind a stop or yield sign, and elsewhere, as
/// for a left turn through oncoming traffic.
const YIELDING_SECS: f32 = 20.0;
const TURNING_SECS: f32 = 5.0;
/// Whoever waited as long at a junction may lead a circle of those who wait for each other.
const CIRCLE_SECS: f32 = 3.0;
/// Who comes to a junction is heard of so long before it asks for its way.
const TELLING_SECS: f32 = 0.5;
/// Whoever is slower than this beyond a junction may stop there.
const SLOW_MPS: f32 = 1.5;

/// What a driver waits for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Held {
    /// Nothing: the road is free.
    #[default]
    No,
    /// A light or a stop sign.
    Line,
    /// The way through a junction that somebody else holds or is to have first.
    Claim(ActorId),
    /// Room beyond a junction, behind somebody.
    Room(ActorId),
    /// Somebody on the way.
    Behind(ActorId),
    /// Room on the lane beside that it changes to, which somebody takes.
    Beside(ActorId),
}

/// How somebody comes to the next junction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Approach<'a> {
    pub senses: &'a Senses<'a>,
    pub path: &'a Path,
    pub speed_mps: f32,
    /// How far ahead counts, and how far it drives until it stands.
    pub look_m: f32,
    pub stopping_m: f32,
    /// Which it leaves to others at rest.
    pub gap_m: f32,
    /// Nearer than this to somebody at rest ahead it drives no nearer.
    pub rest_m: f32,
    /// From the origin to the line that holds it, and whether it is that of a stop sign.
    pub line_m: Option<f32>,
    pub is_at_sign: bool,
    /// The first one in its way, and all of them.
    pub ahead: Option<Ahead>,
    pub queue: &'a Queue<'a>,
}

impl Passage {
    /// Free way to the next place to stop at, a line or a junction that others are to have first;
    /// claims the next junction if it may.
    pub(crate) fn enter(&mut self, at: &Approach<'_>, claims: &mut Claims) -> Option<f32> {
        let Approach { senses, path, speed_mps, ahead, queue, .. } = *at;
        let front_m = senses.body.half_m.x;
        let line_m = at.line_m.map(|line_m| line_m - front_m);
        let told = std::mem::take(&mut self.comes);
        let part = self.grants.part(path);
        let line_m = line_m.filter(|_| part.is_none_or(|(way, _)| way.entry_m > front_m));
        self.held = ahead.map_or(Held::No, |ahead| Held::Behind(ahead.id));
        // Whoever is held before a junction lets others through.
        if let Some(line_m) = line_m {
            if ahead.is_none_or(|ahead| ahead.gap_m > line_m) {
                self.held = Held::Line;
            }
            self.grants.give_up(path, line_m + front_m);
        }
        self.give_up_behind(at);
        if let Some(wait_m) = self.waits_inside(senses, path, claims) {
            return Some(line_m.map_or(wait_m, |line_m| wait_m.min(line_m - BEFORE_LINE_M)));
        }
        let way = Way::next(senses.network, path, &self.grants, room_m(senses, at.gap_m));
        let way = way.filter(|way| way.entry_m <= at.look_m);
        let Some(way) = way else {
            return line_m.map(|line_m| line_m - BEFORE_LINE_M);
        };
        let entry_m = way.entry_m - front_m;
        let to_entry_m = line_m.map_or(entry_m, |line_m| line_m.min(entry_m));
        let first = ahead.is_none_or(|ahead| ahead.gap_m > entry_m - 0.5);
        let near_m = at.stopping_m + 6.0 + speed_mps;
        let open = line_m.is_none_or(|line_m| line_m > entry_m + INSIDE_M);
        let waited_secs = self.blocked_secs.max(self.grants.waited_secs());
        let leads_circle = waited_secs > CIRCLE_SECS && claims.leads_circle(senses.body.id);
        let asker = Asker { leads_circle, ..self.asker(senses, path, &way) };
        let yields_far = asker.rank == 0 && to_entry_m > 8.0;
        // Who is held before the junction need not ask for room beyond it.
        let beyond = match first && open {
            true => room_beyond(&queue.all(), &way, front_m, at.gap_m),
            false => Ok(()),
        };
        let free = open && first && (beyond.is_ok() || leads_circle);
        self.comes = free && to_entry_m < near_m + TELLING_SECS * speed_mps;
        // Whoever all have heard of may ask: of two who come at once neither is the first.
        if told && free && to_entry_m < near_m && !yields_far {
            match claims.grant(senses.network, &way, &asker) {
                Ok(()) => {
                    self.grants.add(&way, None);
                    self.blocked_secs = 0.0;
                    return None;
                }
                Err(other) => self.held = Held::Claim(other),
            }
            if let Some(until_m) = claims.grant_part(senses.network, &way, &asker) {
                self.grants.add(&way, Some(until_m));
                return Some(entry_m + until_m);
            }
        }
        self.note_blocked(at, beyond.err().flatten());
        let at_sign_m = line_m.filter(|_| at.is_at_sign && !open).map(|line_m| line_m - AT_SIGN_M);
        let before_m = to_entry_m - BEFORE_LINE_M;
        Some(at_sign_m.map_or(before_m, |at_sign_m| at_sign_m.max(before_m)))
    }

    /// Notes who takes the room beyond the next junction, and for how long it has stood for that.
    fn note_blocked(&mut self, at: &Approach<'_>, blocker: Option<ActorId>) {
        if let Some(other) = blocker {
            self.held = Held::Room(other);
        }
        // With a claim or room it would stand there as well.
        if let Some(other) = stands_before(at, at.rest_m) {
            self.held = Held::Behind(other);
        }
        let blocked = blocker.is_some() && at.speed_mps < STANDING_MPS;
        self.blocked_secs = if blocked { self.blocked_secs + at.senses.dt_secs } else { 0.0 };
    }

    /// Whoever stands as somebody stands in its way lets others through the junction ahead: that
    /// one may wait for them.
    fn give_up_behind(&mut self, at: &Approach<'_>) {
        if stands_before(at, BLOCKED_M).is_some() {
            self.grants.give_up(at.path, at.senses.body.half_m.x);
        }
    }

    /// Free way to where it waits inside a junction for oncoming traffic, until it may go on.
    fn waits_inside(
        &mut self,
        senses: &Senses<'_>,
        path: &Path,
        claims: &mut Claims,
    ) -> Option<f32> {
        let (way, until_m) = self.grants.part(path)?;
        let asker = self.asker(senses, path, &way);
        match claims.grant(senses.network, &way, &asker) {
            Ok(()) => {
                self.grants.add(&way, None);
                None
            }
            Err(other) => {
                self.held = Held::Claim(other);
                Some(until_m - senses.body.half_m.x)
            }
        }
    }

    /// As others see it that asks for a way.
    pub(super) fn asker(&self, senses: &Senses<'_>, path: &Path, way: &Way) -> Asker {
        let front_m = (way.entry_m - senses.body.half_m.x).max(0.0);
        let eta_secs = front_m / senses.view.velocity_mps.norm().max(1.0);
        let rank = self.rank(senses, path, way);
        Asker { id: senses.body.id, rank, eta_secs, leads_circle: false }
    }

    /// Who goes first into a junction: 0 behind a stop or yield sign and onto a roundabout, 1
    /// without, 2 after a long wait, 3 with blue lights.
    fn rank(&self, senses: &Senses<'_>, path: &Path, way: &Way) -> u8 {
        if senses.body.is_urgent {
            return URGENT;
        }
        let mut lines = path.lines(senses.network, BEHIND_M, way.entry_m + INSIDE_M);
        let signed = lines.any(|line| matches!(line.why, Stop::Sign | Stop::Yield));
        let first = way.lanes.first().and_then(|lane| senses.network.lane(*lane));
        let yields = signed || first.is_some_and(|lane| lane.enters_ring);
        let patience_secs = if yields { YIELDING_SECS } else { TURNING_SECS };
        if self.grants.waited_secs() > patience_secs { 2 } else { u8::from(!yields) }
    }
}

/// Who stands nearer ahead than this of somebody who stands.
fn stands_before(at: &Approach<'_>, near_m: f32) -> Option<ActorId> {
    let stands_there = |ahead: &Ahead| ahead.gap_m < near_m && ahead.along_mps < STANDING_MPS;
    let ahead = at.ahead.filter(|_| at.speed_mps < STANDING_MPS)?;
    stands_there(&ahead).then_some(ahead.id)
}

/// Whether there will be room to leave a junction: all who drive ahead need room before whoever is
/// slow, and before the junction after it. Else who is in the way, if it is somebody.
fn room_beyond(
    queue: &[Ahead],
    way: &Way,
    front_m: f32,
    gap_m: f32,
) -> Result<(), Option<ActorId>> {
    let needed_m = way.exit_m + front_m;
    let mut taken_m = gap_m;
    // Whoever crosses the junction is not going to stop in it.
    let crosses = |other: &&Ahead| other.along_mps < SLOW_MPS && other.speed_mps > SLOW_MPS;
    for other in queue.iter().filter(|other| !crosses(other)) {
        if other.gap_m - taken_m < needed_m && other.along_mps < SLOW_MPS {
            return Err(Some(other.id));
        }
        if other.gap_m + front_m > way.next_m {
            break;
        }
        taken_m += other.length_m + gap_m;
    }
    if way.next_m - front_m - taken_m + gap_m < needed_m {
        return Err(queue.first().map(|other| other.id));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use schemas::{Pose, Vec3};

    use super::*;
    use crate::network::{LaneId, Network};
    use crate::path::Leg;
    use crate::pilot::VehicleView;
    use crate::scene::Scene;
    use crate::testing::vehicle;

    const ENTRY_M: f32 = 4.0;
    const HALF_M: f32 = 2.5;
    const WAY: Way = Way { lanes: Vec::new(), entry_m: 10.0, exit_m: 30.0, next_m: f32::INFINITY };

    fn other(id: u32, gap_m: f32, along_mps: f32, speed_mps: f32) -> Ahead {
        let id = ActorId::new(id).unwrap();
        Ahead { id, gap_m, length_m: 5.0, along_mps, speed_mps, is_walker: false }
    }

    fn beyond(queue: &[Ahead], way: &Way) -> Result<(), Option<u32>> {
        room_beyond(queue, way, 2.5, 2.0).map_err(|id| id.map(ActorId::get))
    }

    /// When a vehicle is at the junction 10 m ahead of its middle, at 5 m/s.
    fn eta_secs(half_m: f32) -> f32 {
        let (network, scene) = (Network::default(), Scene::new(Vec::new(), Vec::new()));
        let body = vehicle([half_m, 1.0, 1.0], Vec3::zeros(), Vec3::x(), 5.0);
        let view = VehicleView::of_car(Pose::identity(), body.velocity_mps);
        let senses =
            Senses { network: &network, scene: &scene, view: &view, body: &body, dt_secs: 0.05 };
        Passage::default().asker(&senses, &Path::default(), &WAY).eta_secs
    }

    #[test]
    fn a_vehicle_is_at_a_junction_when_its_front_is() {
        for (half_m, wanted_secs) in [(2.0, 1.6), (6.0, 0.8), (11.0, 0.0)] {
            assert!((eta_secs(half_m) - wanted_secs).abs() < 1.0e-6, "{half_m} m");
        }
    }

    /// How far a vehicle 4 m before a junction may drive that a line so far inside holds.
    fn held_m(inside_m: f32, is_at_sign: bool) -> f32 {
        let line_m = Some(ENTRY_M + inside_m);
        before_a_junction(false, |at| Approach { line_m, is_at_sign, ..at }).0.unwrap()
    }

    #[test]
    fn who_is_held_by_a_sign_just_inside_a_junction_stands_right_before_it() {
        let free_m = ENTRY_M - HALF_M;
        assert_eq!(
            [-1.0, 2.0].map(|inside_m| held_m(inside_m, false)),
            [free_m - 2.0, free_m - 1.0]
        );
        assert_eq!(
            [-1.0, 0.5].map(|inside_m| held_m(inside_m, true)),
            [free_m - 2.0, free_m - 1.0]
        );
        assert!((held_m(2.3, true) - (free_m + 0.3)).abs() < 1.0e-5);
    }

    /// Whether a vehicle that was granted a junction and stands right before it still has it, with
    /// somebody ahead who drives at a speed.
    fn keeps_its_way(gap_m: f32, along_mps: f32) -> bool {
        let ahead = Some(other(2, gap_m, along_mps, along_mps));
        before_a_junction(true, |at| Approach { ahead, ..at }).1
    }

    /// How far a vehicle may drive that stands [`ENTRY_M`] before a junction, which it may have
    /// been granted, and whether it has it then.
    fn before_a_junction(
        granted: bool,
        with: impl FnOnce(Approach<'_>) -> Approach<'_>,
    ) -> (Option<f32>, bool) {
        let text = roads::town::build("Town10HD_Opt").unwrap();
        let network = Network::new(&roads::Map::parse("Town10HD_Opt", &text).unwrap());
        let into_junction = |id: &LaneId| {
            let lane = network.lane(*id)?;
            let through =
                lane.next.iter().find(|next| network.lane(**next).unwrap().junction.is_some());
            Some([*id, *through?]).filter(|_| lane.junction.is_none() && lane.length_m() > 20.0)
        };
        let [before, through] =
            (0..network.lane_count() as LaneId).find_map(|id| into_junction(&id)).unwrap();
        let length_m = |id: LaneId| network.lane(id).unwrap().length_m();
        let leg = |lane, from_m| Leg { lane, from_m, to_m: length_m(lane), onto: None };
        let mut path = Path::default();
        path.push(leg(before, length_m(before) - ENTRY_M));
        path.push(leg(through, 0.0));
        let scene = Scene::new(Vec::new(), Vec::new());
        let body = vehicle([HALF_M, 1.0, 1.0], Vec3::zeros(), Vec3::x(), 0.0);
        let view = VehicleView::of_car(Pose::identity(), Vec3::zeros());
        let senses =
            Senses { network: &network, scene: &scene, view: &view, body: &body, dt_secs: 0.05 };
        let mut passage = Passage::default();
        let way = Way::next(&network, &path, &passage.grants, 7.0).unwrap();
        if granted {
            passage.grants.add(&way, None);
        }
        let queue = Queue::default();
        let at = with(Approach {
            senses: &senses,
            path: &path,
            speed_mps: 0.0,
            look_m: 40.0,
            stopping_m: 0.0,
            gap_m: 2.0,
            rest_m: 3.0,
            line_m: None,
            is_at_sign: false,
            ahead: None,
            queue: &queue,
        });
        let free_m = passage.enter(&at, &mut Claims::default());
        (free_m, !passage.is_free())
    }

    #[test]
    fn whoever_stands_as_somebody_stands_in_its_way_gives_the_junction_back() {
        assert!(!keeps_its_way(2.0, 0.0));
        assert!(keeps_its_way(2.0, 5.0));
        assert!(keeps_its_way(60.0, 0.0));
    }

    #[test]
    fn a_junction_is_entered_only_with_room_to_leave_it() {
        assert_eq!(beyond(&[], &WAY), Ok(()));
        assert_eq!(beyond(&[other(1, 33.0, 0.0, 0.0)], &WAY), Err(Some(1)));
        assert_eq!(beyond(&[other(1, 35.0, 0.0, 0.0)], &WAY), Ok(()));
    }

    #[test]
    fn those_who_drive_ahead_need_room_too() {
        let moving = other(1, 15.0, 6.0, 6.0);
        assert_eq!(beyond(&[moving], &WAY), Ok(()));
        assert_eq!(beyond(&[moving, other(2, 40.0, 0.0, 0.0)], &WAY), Err(Some(2)));
        assert_eq!(beyond(&[moving, other(2, 42.0, 0.0, 0.0)], &WAY), Ok(()));
    }

    #[test]
    fn who_crosses_does_not_take_room_and_the_next_junction_ends_it() {
        assert_eq!(beyond(&[other(1, 20.0, 0.0, 6.0)], &WAY), Ok(()));
        let short = Way { next_m: 36.0, ..WAY };
        assert_eq!(beyond(&[], &short), Ok(()));
        assert_eq!(beyond(&[other(1, 15.0, 6.0, 6.0)], &short), Err(Some(1)));
    }
}
