//! Seeded damage to OpenDRIVE texts.

use std::ops::Range;

use schemas::SplitMix64;

/// What stands in the place of a number: borders of the limits, of types and of arithmetic.
const VALUES: [&str; 24] = [
    "0",
    "-0",
    "1",
    "-1",
    "1e-9",
    "-1e-9",
    "0.5",
    "100",
    "-100",
    "5000",
    "1e5",
    "-1e5",
    "999999",
    "-999999",
    "1e6",
    "1e15",
    "1e308",
    "NaN",
    "inf",
    "2147483648",
    "4294967295",
    "-2147483649",
    "",
    "x",
];
/// Factors a number is multiplied by.
const FACTORS: [f64; 8] = [-1.0, 0.0, 0.001, 0.5, 3.0, 10.0, 1000.0, 1e5];
/// Most copies of an element that are put behind it.
const COPIES_MAX: u64 = 40;

/// What is drawn for one text.
pub(crate) struct Draws(SplitMix64);

impl Draws {
    pub(crate) const fn new(seed: u64) -> Self {
        Self(SplitMix64::new(seed))
    }

    /// A whole number below a limit, 0 for a limit of 0.
    #[allow(clippy::cast_possible_truncation, reason = "the limits are lengths in memory")]
    pub(crate) fn below(&mut self, limit: usize) -> usize {
        (self.0.next_u64() % (limit as u64).max(1)) as usize
    }

    fn pick<'a, T>(&mut self, from: &'a [T]) -> Option<&'a T> {
        self.0.choose(from)
    }
}

/// The text after one to five pieces of damage.
pub(crate) fn damaged(text: &str, draws: &mut Draws) -> String {
    let mut text = text.to_owned();
    for _ in 0..=draws.below(5) {
        text = match draws.below(16) {
            0..=5 => number(text, draws),
            6 => everywhere(text, draws),
            7 => swap_values(text, draws),
            8 => attribute(text, draws),
            9 | 10 => delete(text, draws),
            11 | 12 => duplicate(text, draws),
            13 => swap_elements(text, draws),
            14 => overwrite(text, draws),
            _ => cut(text, draws),
        };
    }
    text
}

/// Where the values of all attributes stand, without their quotes.
fn values(text: &str) -> Vec<Range<usize>> {
    let mut found = Vec::new();
    let mut at = 0;
    while let Some(start) = text[at..].find("=\"").map(|offset| at + offset + 2) {
        let Some(length) = text[start..].find('"') else { break };
        found.push(start..start + length);
        at = start + length + 1;
    }
    found
}

/// The name of the attribute whose value begins at a place, with the sign and quote after it.
fn name_before(text: &str, value: &Range<usize>) -> String {
    let before = &text[..value.start];
    let start = before.rfind(char::is_whitespace).map_or(0, |space| space + 1);
    before[start..].to_owned()
}

fn replaced(mut text: String, place: Range<usize>, with: &str) -> String {
    text.replace_range(place, with);
    text
}

fn number(text: String, draws: &mut Draws) -> String {
    let values = values(&text);
    let is_number = |value: &Range<usize>| text[value.clone()].parse::<f64>().is_ok();
    let numbers: Vec<_> = values.into_iter().filter(is_number).collect();
    let Some(place) = draws.pick(&numbers).cloned() else { return text };
    let new = new_number(&text[place.clone()], draws);
    replaced(text, place, &new)
}

fn new_number(old: &str, draws: &mut Draws) -> String {
    let old: f64 = old.parse().unwrap_or(1.0);
    match draws.below(2) {
        0 => draws.pick(&VALUES).copied().unwrap_or_default().to_owned(),
        _ => (old * draws.pick(&FACTORS).copied().unwrap_or(1.0)).to_string(),
    }
}

/// One value for every attribute of a name.
fn everywhere(text: String, draws: &mut Draws) -> String {
    let all = values(&text);
    let Some(chosen) = draws.pick(&all).cloned() else { return text };
    let (name, new) = (name_before(&text, &chosen), new_number(&text[chosen], draws));
    let mut out = text.clone();
    for place in all.into_iter().rev().filter(|place| name_before(&text, place) == name) {
        out.replace_range(place, &new);
    }
    out
}

fn swap_values(text: String, draws: &mut Draws) -> String {
    let values = values(&text);
    let pair = (draws.pick(&values).cloned(), draws.pick(&values).cloned());
    let (Some(one), Some(other)) = pair else { return text };
    swapped(text, one, other)
}

fn swapped(text: String, one: Range<usize>, other: Range<usize>) -> String {
    let (first, second) = if one.start < other.start { (one, other) } else { (other, one) };
    if first.end > second.start {
        return text;
    }
    let (a, b) = (text[first.clone()].to_owned(), text[second.clone()].to_owned());
    replaced(replaced(text, second, &a), first, &b)
}

/// Takes an attribute away, or gives it twice.
fn attribute(text: String, draws: &mut Draws) -> String {
    let values = values(&text);
    let Some(value) = draws.pick(&values).cloned() else { return text };
    let start = value.start - name_before(&text, &value).len();
    let whole = text[start..=value.end].to_owned();
    let twice = format!("{whole} {whole}");
    let new = if draws.below(4) == 0 { &twice } else { "" };
    replaced(text, start..value.end + 1, new)
}

/// One element with everything inside, mostly a small one.
fn element(text: &str, draws: &mut Draws) -> Option<Range<usize>> {
    let starts: Vec<usize> = text
        .match_indices('<')
        .map(|(at, _)| at)
        .filter(|at| text[at + 1..].starts_with(|c: char| c.is_ascii_alphabetic()))
        .skip(1)
        .collect();
    let start = *draws.pick(&starts)?;
    let name: &str = text[start + 1..].split([' ', '>', '/', '\n']).next()?;
    let tag_end = start + text[start..].find('>')?;
    if text[..tag_end].ends_with('/') {
        return Some(start..tag_end + 1);
    }
    let (open, close) = (format!("<{name}"), format!("</{name}>"));
    let (mut depth, mut at) = (1, tag_end + 1);
    while depth > 0 {
        let end = at + text[at..].find(&close)?;
        depth += text[at..end].matches(&open).count();
        depth -= 1;
        at = end + close.len();
    }
    Some(start..at)
}

fn delete(text: String, draws: &mut Draws) -> String {
    match element(&text, draws) {
        Some(place) => replaced(text, place, ""),
        None => text,
    }
}

fn duplicate(mut text: String, draws: &mut Draws) -> String {
    const GROWTH_MAX: usize = 1 << 20;
    let Some(place) = element(&text, draws) else { return text };
    let count = 1 + draws.0.next_u64() % COPIES_MAX;
    let copies = text[place.clone()].repeat(usize::try_from(count).unwrap_or(1));
    if copies.len() < GROWTH_MAX {
        text.insert_str(place.end, &copies);
    }
    text
}

fn swap_elements(text: String, draws: &mut Draws) -> String {
    match (element(&text, draws), element(&text, draws)) {
        (Some(one), Some(other)) => swapped(text, one, other),
        _ => text,
    }
}

fn overwrite(text: String, draws: &mut Draws) -> String {
    let at = draws.below(text.len());
    let end = (at + 1 + draws.below(20)).min(text.len());
    let byte = char::from(b' ' + u8::try_from(draws.below(95)).unwrap_or_default());
    if text.is_char_boundary(at) && text.is_char_boundary(end) {
        let new: String = std::iter::repeat_n(byte, end - at).collect();
        return replaced(text, at..end, &new);
    }
    text
}

fn cut(mut text: String, draws: &mut Draws) -> String {
    // A text cut anywhere is refused at once: that is tried seldom.
    let at = draws.below(text.len());
    if draws.below(4) == 0 && text.is_char_boundary(at) {
        text.truncate(at);
    }
    text
}
