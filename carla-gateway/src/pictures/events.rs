//! A camera of events: what changed its brightness, and when.
//!
//! - **Source:** Rebecq, Gehrig, Scaramuzza, "ESIM: an open event camera simulator", CoRL 2018, as
//!   CARLA uses it: every pixel remembers the brightness of its last event, and between two frames
//!   the brightness runs straight.

use crate::dialect::Actor;
use crate::rpc::Refusal;

/// Brightness that changes by less in one frame does not change.
const TOLERANCE: f32 = 1.0e-6;
/// Events of one pixel in one frame: more than the 255 steps of brightness are at CARLA's
/// threshold.
const EVENTS_PER_PIXEL_MAX: usize = 1_024;
/// Events of one frame; what would be more is left out.
const EVENTS_MAX: usize = 4_194_304;
/// Thresholds that pixels cross in one frame, also without an event while they are blind; those of
/// further pixels are left out.
const CROSSINGS_MAX: usize = 4 * EVENTS_MAX;
const NANOS_PER_SEC: f64 = 1.0e9;

/// How a camera of events reacts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Reaction {
    /// Rise of the brightness that makes an event.
    pub(crate) rise: f32,
    /// Fall that makes one.
    pub(crate) fall: f32,
    /// A pixel is blind for so long after an event.
    pub(crate) refractory_ns: i64,
    /// Added to the brightness, from 0 to 1, before its logarithm is taken; none: brightness is
    /// from 0 to 255.
    pub(crate) log_eps: Option<f32>,
}

/// One change of brightness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Event {
    pub(crate) column: u16,
    pub(crate) row: u16,
    /// Simulated time.
    pub(crate) at_ns: i64,
    pub(crate) brighter: bool,
}

/// What a camera of events remembers between frames.
#[derive(Debug, Default)]
pub(crate) struct Memory {
    sim_secs: f64,
    width_px: u32,
    brightness: Vec<f32>,
    /// At the last event of each pixel.
    reference: Vec<f32>,
    last_ns: Vec<i64>,
}

/// What happened in one frame so far.
struct Seen {
    events: Vec<Event>,
    crossings_left: usize,
}

impl Reaction {
    /// As a camera's attributes ask for it.
    ///
    /// # Errors
    /// Thresholds that are not positive, or what is no number.
    pub(crate) fn of(actor: &Actor) -> Result<Self, Refusal> {
        let threshold = |id| match actor.number(id, 0.3)? {
            value if value > 0.0 => Ok(value),
            value => Err(Refusal(format!("{id} must be more than 0, not {value}"))),
        };
        let eps = actor.number("log_eps", 1.0e-3)?.max(f32::MIN_POSITIVE);
        Ok(Self {
            rise: threshold("positive_threshold")?,
            fall: threshold("negative_threshold")?,
            refractory_ns: actor.number("refractory_period_ns", 0.0)?.max(0.0) as i64,
            log_eps: (actor.text("use_log") != Some("false")).then_some(eps),
        })
    }

    fn brightness(self, [red, green, blue, _]: [u8; 4]) -> f32 {
        let [red, green, blue] = [red, green, blue].map(f32::from);
        let grey = 0.2989 * red + 0.587 * green + 0.114 * blue;
        self.log_eps.map_or(grey, |eps| (eps + grey / 255.0).ln())
    }
}

impl Memory {
    /// What happened since the last picture, ordered by time; nothing at the first one.
    ///
    /// - **Domain:** `pixels` are rows of red, green, blue and a fourth byte.
    pub(crate) fn look(
        &mut self,
        reaction: Reaction,
        width_px: u32,
        pixels: &[u8],
        sim_secs: f64,
    ) -> Vec<Event> {
        let (pixels, _) = pixels.as_chunks::<4>();
        let now: Vec<f32> = pixels.iter().map(|pixel| reaction.brightness(*pixel)).collect();
        let is_first = self.width_px != width_px || self.brightness.len() != now.len();
        if is_first || sim_secs <= self.sim_secs {
            *self = Self {
                sim_secs,
                width_px,
                reference: now.clone(),
                last_ns: vec![i64::MIN; now.len()],
                brightness: now,
            };
            return Vec::new();
        }
        let mut seen = Seen { events: Vec::new(), crossings_left: CROSSINGS_MAX };
        for (at, after) in now.iter().enumerate() {
            if (after - self.brightness[at]).abs() > TOLERANCE {
                self.cross(reaction, at, *after, sim_secs, &mut seen);
            }
        }
        (self.brightness, self.sim_secs) = (now, sim_secs);
        seen.events.sort_by_key(|event| event.at_ns);
        seen.events
    }

    /// The thresholds that one pixel crosses on its way to a new brightness.
    fn cross(&mut self, reaction: Reaction, at: usize, after: f32, sim_secs: f64, seen: &mut Seen) {
        let before = self.brightness[at];
        let brighter = after > before;
        let step = if brighter { reaction.rise } else { -reaction.fall };
        for _ in 0..EVENTS_PER_PIXEL_MAX.min(seen.crossings_left) {
            let next = self.reference[at] + step;
            let passed = if brighter {
                before < next && next <= after
            } else {
                after <= next && next < before
            };
            if !passed {
                return;
            }
            self.reference[at] = next;
            seen.crossings_left -= 1;
            let share = f64::from((next - before) / (after - before));
            let at_secs = self.sim_secs + share * (sim_secs - self.sim_secs);
            let at_ns = (at_secs * NANOS_PER_SEC) as i64;
            if at_ns.saturating_sub(self.last_ns[at]) < reaction.refractory_ns {
                continue;
            }
            self.last_ns[at] = at_ns;
            let column = (at as u32 % self.width_px) as u16;
            let row = (at as u32 / self.width_px) as u16;
            if seen.events.len() < EVENTS_MAX {
                seen.events.push(Event { column, row, at_ns, brighter });
            }
        }
        // The rest is left out; the next change counts from where the brightness is.
        let steps_left = ((after - self.reference[at]) / step).floor().max(0.0);
        self.reference[at] += steps_left * step;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A change by three tenths of full brightness.
    const REACTION: Reaction = Reaction { rise: 76.5, fall: 76.5, refractory_ns: 0, log_eps: None };

    fn grey(levels: &[u8]) -> Vec<u8> {
        levels.iter().flat_map(|level| [*level, *level, *level, 255]).collect()
    }

    #[test]
    fn a_still_picture_has_no_events() {
        let mut memory = Memory::default();
        for frame in 1..5 {
            let seen = memory.look(REACTION, 2, &grey(&[10, 200, 30, 40]), f64::from(frame));
            assert_eq!(seen, []);
        }
    }

    #[test]
    fn brightness_crosses_thresholds_in_the_order_of_time() {
        let mut memory = Memory::default();
        memory.look(REACTION, 2, &grey(&[0, 255]), 1.0);
        let seen = memory.look(REACTION, 2, &grey(&[255, 128]), 2.0);
        let told: Vec<_> = seen.iter().map(|event| (event.column, event.brighter)).collect();
        assert_eq!(told, [(0, true), (0, true), (1, false), (0, true)]);
        assert!(seen.windows(2).all(|pair| pair[0].at_ns <= pair[1].at_ns));
        assert!(seen.iter().all(|event| (1_000_000_000..=2_000_000_000).contains(&event.at_ns)));
    }

    fn count(reaction: Reaction, levels: [u8; 2]) -> usize {
        let mut memory = Memory::default();
        memory.look(reaction, 1, &grey(&levels[..1]), 1.0);
        memory.look(reaction, 1, &grey(&levels[1..]), 2.0).len()
    }

    #[test]
    fn brightness_without_a_logarithm_has_255_steps_and_with_it_counts_by_its_ratio() {
        let plain = Reaction { rise: 3.0, fall: 3.0, ..REACTION };
        assert_eq!(count(plain, [100, 110]), 3);
        assert_eq!(count(plain, [110, 100]), 3);
        let carlas = Reaction { rise: 0.3, fall: 0.3, ..REACTION };
        assert!((32..=33).contains(&count(carlas, [100, 110])));
        let logarithmic = Reaction { log_eps: Some(1.0e-3), ..carlas };
        assert_eq!(count(logarithmic, [100, 110]), 0);
        assert_eq!(count(logarithmic, [50, 100]), 2);
    }

    #[test]
    fn a_pixel_with_too_many_events_goes_on_from_where_it_is() {
        let fine = Reaction { rise: 0.01, fall: 0.01, ..REACTION };
        let mut memory = Memory::default();
        memory.look(fine, 1, &grey(&[0]), 1.0);
        assert_eq!(memory.look(fine, 1, &grey(&[200]), 2.0).len(), EVENTS_PER_PIXEL_MAX);
        let next = memory.look(fine, 1, &grey(&[201]), 3.0).len();
        assert!((90..=110).contains(&next), "{next}");
    }

    #[test]
    fn a_picture_in_which_too_much_happens_costs_no_more_than_that() {
        let pixels = 20_000;
        let tired = Reaction { rise: 0.01, refractory_ns: i64::MAX, ..REACTION };
        let mut memory = Memory::default();
        memory.look(tired, 200, &grey(&vec![0; pixels]), 1.0);
        let seen = memory.look(tired, 200, &grey(&vec![255; pixels]), 2.0);
        assert_eq!(seen.len(), CROSSINGS_MAX / EVENTS_PER_PIXEL_MAX);
    }

    #[test]
    fn small_changes_add_up_and_a_pixel_rests_after_an_event() {
        let mut memory = Memory::default();
        let mut count = 0;
        for (frame, level) in (0..=5u8).map(|step| (f64::from(step), 40 * step)) {
            count += memory.look(REACTION, 1, &grey(&[level]), frame + 1.0).len();
        }
        assert_eq!(count, 2);
        let tired = Reaction { refractory_ns: 10_000_000_000, ..REACTION };
        let mut memory = Memory::default();
        memory.look(tired, 1, &grey(&[0]), 1.0);
        assert_eq!(memory.look(tired, 1, &grey(&[255]), 2.0).len(), 1);
    }
}
