//! Loud words for a state outside the training domain: by how much, in which unit, and what was probably meant.

use std::f64::consts::PI;

use wade_core::domain::{Domain, Outside, Quantity};
use wade_core::effects::{BoxQuantity, OutsideBox};
use wade_core::model::Anchored;

use super::state::StateArgs;

/// A slip of units that people make: what they wrote, and the factor that makes it ours.
type Slip = (&'static str, f64);

/// The usual slips of a quantity.
fn slips(quantity: Quantity) -> &'static [Slip] {
    match quantity {
        Quantity::Depth => &[("cm", 0.01), ("mm", 0.001), ("inches", 0.0254), ("feet", 0.3048)],
        Quantity::Speed => &[("km/h", 1.0 / 3.6), ("knots", 1852.0 / 3600.0), ("cm/s", 0.01)],
        Quantity::Density => &[("g/cm3", 1000.0)],
        Quantity::VerticalSpeed => &[("cm/s", 0.01), ("mm/s", 0.001)],
        Quantity::AngularSpeed => &[("degrees/s", PI / 180.0)],
        Quantity::Angle | Quantity::Tilt | Quantity::Distance => &[],
    }
}

/// The lines of the warning; none for a state inside. `domain` is that of the model, where it is known.
pub fn warning(state: &StateArgs, outside: &Outside, domain: Option<&Domain>) -> Option<String> {
    if outside.is_inside() {
        return None;
    }
    let mut text =
        String::from("warning: the state is outside the training domain; these forces are not reliable\n");
    text += &lines(outside, domain);
    text += &degrees(state);
    Some(text)
}

/// A line for each angle of the attitude that is one of degrees.
pub fn degrees(state: &StateArgs) -> String {
    let mut text = String::new();
    for (flag, angle) in [("--roll", state.roll()), ("--pitch", state.pitch())] {
        // no attitude needs more than half a turn, so such a number is one of degrees
        if angle.abs() > PI {
            let radians = short(angle.to_radians());
            text +=
                &format!("  {flag} {angle} is in radians: were {angle} degrees meant? {flag} {radians}\n");
        }
    }
    text
}

/// A line for each quantity outside.
pub fn lines(outside: &Outside, domain: Option<&Domain>) -> String {
    let line = |(quantity, excess)| match quantity {
        Quantity::Distance => format!("  {}\n", distance(excess)),
        _ => format!("  {}\n", of_range(quantity, excess, domain)),
    };
    outside.iter().map(line).collect()
}

/// The same of the box in which the effects were seen.
pub fn effects_warning(outside: &OutsideBox) -> Option<String> {
    let entries: Vec<String> = BoxQuantity::ALL
        .into_iter()
        .zip(outside)
        .filter(|(_, excess)| **excess != 0.0)
        .map(|(quantity, excess)| format!("{} by {}", quantity.name(), signed(*excess)))
        .collect();
    (!entries.is_empty()).then(|| {
        format!("warning: the effects were fitted to other states; outside these: {}\n", entries.join(", "))
    })
}

/// The nearest training state is this many times the usual spacing away, less one.
fn distance(excess: f64) -> String {
    let times = excess + 1.0;
    // what the blending leaves of the trained remainder
    let weight = 100.0 * Anchored::trust(times);
    format!(
        "nearest training state: {} times the usual spacing of the training states away; the trained part has a weight \
         of {weight:.0} %, the rest is the base",
        short(times)
    )
}

fn of_range(quantity: Quantity, excess: f64, domain: Option<&Domain>) -> String {
    let (name, unit) = (quantity.words(), quantity.unit());
    let side = if excess > 0.0 { "above" } else { "below" };
    let by = short(excess.abs());
    let Some(range) = domain.and_then(|domain| domain.range(quantity)) else {
        return format!("{name}: {by} {unit} {side} the range of the training data");
    };
    let value = if excess > 0.0 { range.max } else { range.min } + excess;
    let trained = format!("{} to {} {unit}", short(range.min), short(range.max));
    let meant = slips(quantity).iter().find_map(|(written, factor)| {
        let meant = value * factor;
        (range.min..=range.max)
            .contains(&meant)
            .then(|| format!("; were {} {written} meant? Write {}", short(value), short(meant)))
    });
    let meant = meant.unwrap_or_default();
    format!("{name}: {} {unit} is {by} {unit} {side} the trained range, {trained}{meant}", short(value))
}

/// Four significant digits, without zeros at the end.
pub fn short(value: f64) -> String {
    let before = value.abs().max(1e-300).log10().floor() as i32 + 1;
    let digits = usize::try_from(4 - before).unwrap_or(0).min(9);
    let text = format!("{value:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// The same with its sign.
pub fn signed(value: f64) -> String {
    if value > 0.0 { format!("+{}", short(value)) } else { short(value) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_never_minus_zero() {
        let texts = [0.18, 17.8, 778.6, -0.00000000001, 0.0, 12_345.6, 0.017_453_3, -2.5].map(short);
        assert_eq!(texts, ["0.18", "17.8", "778.6", "0", "0", "12346", "0.01745", "-2.5"]);
        assert_eq!([signed(0.5), signed(-0.5)], ["+0.5", "-0.5"]);
    }
}
