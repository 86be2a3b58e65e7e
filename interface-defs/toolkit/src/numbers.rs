//! Numbers for a reader, and as a person writes them in a scene.

/// The nearest number of so many significant digits: what a printed number reads back as.
pub fn rounded(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits - 1).parse().unwrap_or(value)
}

/// The nearest number whose last digit is the second one of `coarse`, above 0.
pub fn to_place(value: f64, coarse: f64) -> f64 {
    let places = coarse.log10().floor() - 1.0;
    let step = 10.0_f64.powi(places.abs() as i32);
    // A division by a whole power of ten, so that the number is the one that a person would write.
    if places < 0.0 { (value * step).round() / step } else { (value / step).round() * step }
}

/// The first two significant digits of a positive number, for a length of time that is chosen: never longer.
pub fn two_digits(value: f64) -> f64 {
    let power = value.log10().floor() as i32 - 1;
    // Read from text, so that the number is the one that a person would write.
    format!("{}e{power}", (value / 10.0_f64.powi(power) * (1.0 + 1e-9)).floor()).parse().unwrap_or(value)
}

/// Three significant digits, for tables and pictures.
pub fn three(value: f64) -> String {
    significant(value, 3)
}

/// Four significant digits, for a hint.
pub fn four(value: f64) -> String {
    significant(value, 4)
}

/// Six significant digits, for measures and messages.
pub fn short(value: f64) -> String {
    significant(value, 6)
}

fn significant(value: f64, digits: usize) -> String {
    let value = rounded(value, digits);
    let plain = value == 0.0 || !value.is_finite() || (1e-4..1e7).contains(&value.abs());
    if plain { value.to_string() } else { format!("{value:e}") }
}

/// Six significant digits; of metres to the millimetre where that is more: coordinates of a survey are large.
pub fn short_in(unit: &str, value: f64) -> String {
    // From here on six digits are coarser than a millimetre.
    let large = value.is_finite() && value.abs() >= 999.999_5;
    if unit == "m" && large { ((value * 1000.0).round() / 1000.0).to_string() } else { short(value) }
}

/// A share, as a percentage.
pub fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if percent >= 1e6 { format!("{percent:.1e} %") } else { format!("{} %", three(percent)) }
}

/// Seconds of work.
pub fn seconds(value: f64) -> String {
    if value >= 100.0 {
        format!("{:.0} min {:02.0} s", (value / 60.0).floor(), value % 60.0)
    } else {
        format!("{} s", three(value))
    }
}

/// All digits, for a scene: TOML reads the number back bit for bit.
pub fn exact(value: f64) -> String {
    if value == 0.0 || (1e-2..1e5).contains(&value.abs()) {
        format!("{value:?}")
    } else {
        format!("{value:e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_as_long_as_its_reader_needs() {
        let written = [0.1 + 0.2, -1234.5678, 0.0, 9_999_999.6, 2e-5, f64::INFINITY];
        assert_eq!(written.map(short), ["0.3", "-1234.57", "0", "1e7", "2e-5", "inf"]);
        assert_eq!(written.map(four), ["0.3", "-1235", "0", "1e7", "2e-5", "inf"]);
        assert_eq!(written.map(three), ["0.3", "-1230", "0", "1e7", "2e-5", "inf"]);
        assert_eq!([0.0712, 1e5].map(percent), ["7.12 %", "1.0e7 %"]);
        assert_eq!([7.25, 125.0].map(seconds), ["7.25 s", "2 min 05 s"]);
        assert_eq!(
            [2.0, 23.0, 0.0023].map(|coarse| to_place(1234.56789, coarse)),
            [1234.6, 1235.0, 1234.5679]
        );
        assert_eq!([2.0e-4, 4.5678e-5].map(two_digits), [2.0e-4, 4.5e-5]);
        assert_eq!(
            (short_in("m", 1_234_567.891_2), short_in("J", 1_234_567.891_2)),
            ("1234567.891".into(), "1234570".into())
        );
    }

    #[test]
    fn an_exact_number_reads_back_bit_for_bit_as_a_float() {
        for value in [5e-5, 1.0, 0.1 + 0.2, 1e8, 5.4e-5 / 3.0] {
            let read: toml::Table = format!("x = {}", exact(value)).parse().expect("TOML");
            assert_eq!(read["x"].as_float(), Some(value));
        }
    }
}
