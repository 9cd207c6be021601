//! Times of day as scene files write them: `2026-06-21T12:00:00Z`.
//!
//! In:    a text, or seconds since 1970.
//! Out:   the other one.
//! Keeps: nothing.
//! Not here: where the sun stands then (`overfly_core::sun`).
//! Source: RFC 3339, of which this is the form without fractions and in UTC; days by era of 400
//! years as in Howard Hinnant, chrono-compatible low-level date algorithms.

/// First year whose suns are right.
pub(crate) const YEAR_MIN: i64 = 1850;
/// Last year whose suns are right.
pub(crate) const YEAR_MAX: i64 = 2149;

const DAY_S: i64 = 86_400;
const DAYS_PER_ERA: i64 = 146_097;
/// Days from March 1st of the year 0 to January 1st of 1970.
const EPOCH_DAYS: i64 = 719_468;

/// Seconds since 1970-01-01T00:00:00Z of a time in UTC; `None` if it is not one of the form
/// `YYYY-MM-DDTHH:MM:SSZ` from 1850 to 2149. Leap seconds are not counted and not times.
pub fn utc_seconds(text: &str) -> Option<f64> {
    let bytes: &[u8; 20] = text.as_bytes().try_into().ok()?;
    let marks = [(4, b'-'), (7, b'-'), (10, b'T'), (13, b':'), (16, b':'), (19, b'Z')];
    if marks.into_iter().any(|(at, mark)| bytes[at] != mark) {
        return None;
    }
    let [year, month, day, hour, minute, second] =
        [0..4, 5..7, 8..10, 11..13, 14..16, 17..19].map(|digits| number(&bytes[digits]));
    let (year, month, day) = (year?, month?, day?);
    let dated = (YEAR_MIN..=YEAR_MAX).contains(&year) && (1..=12).contains(&month);
    let [hour, minute, second] = [(hour?, 24), (minute?, 60), (second?, 60)]
        .map(|(count, end)| Some(count).filter(|count| *count < end));
    if !dated || !(1..=days_of_month(year, month)).contains(&day) {
        return None;
    }
    Some((days_of(year, month, day) * DAY_S + (hour? * 60 + minute?) * 60 + second?) as f64)
}

/// The time that lies so many seconds after 1970-01-01T00:00:00Z, its fraction of a second
/// dropped, as scene files write it. Within a year of 0 to 9999; others end there.
pub fn utc_text(unix_s: f64) -> String {
    let (first, last) = (days_of(0, 1, 1) * DAY_S, days_of(10_000, 1, 1) * DAY_S - 1);
    let whole_s = unix_s.clamp(first as f64, last as f64).floor();
    #[expect(clippy::cast_possible_truncation, reason = "clamped above; NaN becomes 0")]
    let whole_s = whole_s as i64;
    let [year, month, day] = date_of(whole_s.div_euclid(DAY_S));
    let second = whole_s.rem_euclid(DAY_S);
    let [hour, minute, second] = [second / 3600, second / 60 % 60, second % 60];
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z")
}

/// A number of ASCII digits and nothing else.
fn number(digits: &[u8]) -> Option<i64> {
    digits.iter().try_fold(0, |sum, digit| {
        digit.is_ascii_digit().then(|| sum * 10 + i64::from(digit - b'0'))
    })
}

fn days_of_month(year: i64, month: i64) -> i64 {
    days_of(year + month / 12, month % 12 + 1, 1) - days_of(year, month, 1)
}

/// Days since 1970-01-01 of a date of the Gregorian calendar. Years begin in March here, so that a
/// leap day is the last of its year.
fn days_of(year: i64, month: i64, day: i64) -> i64 {
    let year = year - i64::from(month < 3);
    let (era, of_era) = (year.div_euclid(400), year.rem_euclid(400));
    let of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    era * DAYS_PER_ERA + of_era * 365 + of_era / 4 - of_era / 100 + of_year - EPOCH_DAYS
}

/// Year, month and day of so many days since 1970-01-01.
fn date_of(days: i64) -> [i64; 3] {
    let days = days + EPOCH_DAYS;
    let (era, of_era) = (days.div_euclid(DAYS_PER_ERA), days.rem_euclid(DAYS_PER_ERA));
    let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let march_based = (5 * of_year + 2) / 153;
    let day = of_year - (153 * march_based + 2) / 5 + 1;
    let month = (march_based + 2) % 12 + 1;
    [era * 400 + year + i64::from(month < 3), month, day]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_times_have_their_seconds() {
        for (text, unix_s) in [
            ("1970-01-01T00:00:00Z", 0.0),
            ("2000-01-01T12:00:00Z", 946_728_000.0),
            ("2026-06-21T08:24:00Z", 1_782_030_240.0),
            ("1950-07-04T06:00:00Z", -615_232_800.0),
            ("2024-02-29T23:59:59Z", 1_709_251_199.0),
        ] {
            assert_eq!(utc_seconds(text), Some(unix_s), "{text}");
            assert_eq!(utc_text(unix_s), text);
        }
        assert_eq!(utc_text(-0.25), "1969-12-31T23:59:59Z");
    }

    #[test]
    fn every_day_follows_the_one_before_and_comes_back() {
        let mut days = 0;
        for (year, month) in (YEAR_MIN..=YEAR_MAX).flat_map(|y| (1..=12).map(move |m| (y, m))) {
            for day in 1..=days_of_month(year, month) {
                let unix_s = utc_seconds(&format!("{year}-{month:02}-{day:02}T00:00:00Z")).unwrap();
                assert_eq!(unix_s, utc_seconds("1850-01-01T00:00:00Z").unwrap() + days as f64);
                assert_eq!(utc_text(unix_s), format!("{year}-{month:02}-{day:02}T00:00:00Z"));
                days += DAY_S;
            }
        }
        assert_eq!(days / DAY_S, 300 * 365 + 73, "300 years, all fourths leap but 1900 and 2100");
    }

    #[test]
    fn what_is_no_time_is_refused() {
        for text in [
            "",
            "2026-06-21",
            "2026-06-21T12:00:00",
            "2026-06-21t12:00:00Z",
            "2026-06-21T12:00:00z",
            "2026-06-21 12:00:00Z",
            "2026-06-21T12:00:00+00:00",
            "2026-06-21T12:00:00.5Z",
            "2026-13-01T12:00:00Z",
            "2026-00-01T12:00:00Z",
            "2026-02-29T12:00:00Z",
            "1900-02-29T12:00:00Z",
            "2026-04-31T12:00:00Z",
            "2026-04-00T12:00:00Z",
            "2026-06-21T24:00:00Z",
            "2026-06-21T12:60:00Z",
            "2026-06-30T23:59:60Z",
            "1849-12-31T23:59:59Z",
            "2150-01-01T00:00:00Z",
            "+026-06-21T12:00:00Z",
            "2026-6-021T12:00:00Z",
            "２026-06-21T12:00:0Z",
        ] {
            assert_eq!(utc_seconds(text), None, "{text}");
        }
        assert_eq!(utc_text(f64::NAN), "1970-01-01T00:00:00Z");
        assert_eq!(utc_text(f64::INFINITY), "9999-12-31T23:59:59Z");
        assert_eq!(utc_text(f64::NEG_INFINITY), "0000-01-01T00:00:00Z");
    }
}
