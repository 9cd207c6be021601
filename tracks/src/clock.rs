//! Dates and times of day as nanoseconds of UTC since 1970.
//!
//! In:    ISO 8601 and its relatives; times of day that pass midnight; leap seconds.
//! Out:   nanoseconds that grow by as much as time passes.
//! Keeps: [`Clock`]: the day, the last time, a leap second that was seen.
//! Not here: what to do where time goes back (`clean`).
//! Source: `days_from_civil` after H. Hinnant, chrono-compatible date algorithms.
//!
//! UTC counts 23:59:60 in a leap second, which the count of seconds since 1970 has no room for. A
//! file that has one is continued a second later, so that a flight through it lasts as long as it
//! did. A file that repeats a second instead has two fixes of one time, of which one is dropped.

pub(crate) const SECOND_NS: i64 = 1_000_000_000;
pub(crate) const DAY_NS: i64 = 86_400 * SECOND_NS;
/// Years that recordings may be of.
pub(crate) const YEARS: core::ops::RangeInclusive<i64> = 1900..=2200;

/// A time, and whether it lies in a leap second.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Stamp {
    pub ns: i64,
    pub is_leap: bool,
}

/// A date as days since 1970; `None` where there is no such date.
pub(crate) fn days(year: i64, month: i64, day: i64) -> Option<i64> {
    let leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    let length = match month {
        1 | 3 | 5 | 7 | 8 | 10 | 12 => 31,
        4 | 6 | 9 | 11 => 30,
        2 => 28 + i64::from(leap),
        _ => return None,
    };
    if !YEARS.contains(&year) || !(1..=length).contains(&day) {
        return None;
    }
    let year = year - i64::from(month <= 2);
    let (era, of_era) = (year.div_euclid(400), year.rem_euclid(400));
    let of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    Some(era * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719_468)
}

/// Two digits of a year: 80 to 99 are of the last century.
pub(crate) fn full_year(year: i64) -> i64 {
    if year >= 100 {
        year
    } else if year >= 80 {
        1900 + year
    } else {
        2000 + year
    }
}

/// A whole number of ASCII digits.
pub(crate) fn digits(text: &str) -> Option<i64> {
    let is_number = !text.is_empty() && text.len() <= 12;
    (is_number && text.bytes().all(|b| b.is_ascii_digit())).then(|| text.parse().ok()).flatten()
}

/// `SS` or `SS.fraction` in nanoseconds.
fn seconds(text: &str) -> Option<i64> {
    let (whole, fraction) = text.split_once(['.', ',']).unwrap_or((text, ""));
    let fraction = fraction.get(..fraction.len().min(9))?;
    let part = if fraction.is_empty() { 0 } else { digits(fraction)? };
    let scale = (fraction.len()..9).fold(1, |scale, _| scale * 10);
    (whole.len() <= 2).then_some(())?;
    Some(digits(whole)? * SECOND_NS + part * scale)
}

fn of_day(hour: i64, minute: i64, second_ns: i64) -> Option<Stamp> {
    let is_usable = hour < 24 && minute < 60 && second_ns < 61 * SECOND_NS;
    let is_leap = hour == 23 && minute == 59 && second_ns >= 60 * SECOND_NS;
    let ns = (hour * 60 + minute) * 60 * SECOND_NS + second_ns;
    is_usable.then_some(Stamp { ns, is_leap })
}

/// `HHMMSS` or `HHMMSS.fraction`: time of day.
pub(crate) fn compact(text: &str) -> Option<Stamp> {
    of_day(digits(text.get(..2)?)?, digits(text.get(2..4)?)?, seconds(text.get(4..)?)?)
}

/// `HH:MM`, `HH:MM:SS` or `HH:MM:SS.fraction`: time of day.
pub(crate) fn colons(text: &str) -> Option<Stamp> {
    let (hour, rest) = text.split_once(':')?;
    let (minute, second) = rest.split_once(':').unwrap_or((rest, "00"));
    (hour.len() <= 2 && minute.len() == 2).then_some(())?;
    of_day(digits(hour)?, digits(minute)?, seconds(second)?)
}

/// A date and time in UTC: `2024-07-15T09:00:00.5Z`, with `+02:00` or `UTC` for `Z`, a blank for
/// `T`, strokes for the date's dashes; without zone it is UTC. Or `20240715T090000Z`. Flightradar24
/// writes fractions behind the zone: `2020-01-26 17:37:27Z.466`.
pub(crate) fn iso(text: &str) -> Option<Stamp> {
    let text = text.trim();
    let split = text.find(['T', 't', ' '])?;
    let (date, rest) = (&text[..split], text.get(split + 1..)?.trim());
    let day = match (digits(date), date.len()) {
        (Some(_), 8) => date_of([&date[..4], &date[4..6], &date[6..]])?,
        _ => {
            let mut parts = date.splitn(3, ['-', '/']);
            date_of([parts.next()?, parts.next()?, parts.next()?])?
        }
    };
    let rest = rest.strip_suffix("UTC").or(rest.strip_suffix("GMT")).unwrap_or(rest);
    let end = rest.find(['Z', 'z', '+', '-']).unwrap_or(rest.len());
    let (time, zone) = (rest[..end].trim(), &rest[end..]);
    let late = zone.strip_prefix("Z.").map(|fraction| format!("{time}.{fraction}"));
    let (time, zone) = late.as_deref().map_or((time, zone), |time| (time, "Z"));
    let stamp = colons(time).or_else(|| compact(time))?;
    Some(Stamp { ns: day * DAY_NS + stamp.ns - zone_ns(zone)?, is_leap: stamp.is_leap })
}

/// Year, month and day as figures.
fn date_of([year, month, day]: [&str; 3]) -> Option<i64> {
    days(digits(year)?, digits(month)?, digits(day)?)
}

fn zone_ns(zone: &str) -> Option<i64> {
    let minutes = match zone {
        "" | "Z" | "z" => 0,
        _ => {
            let sign = if zone.starts_with('-') { -1 } else { 1 };
            let figures: String = zone[1..].chars().filter(|&c| c != ':').collect();
            let (hours, minutes) = (figures.get(..2)?, figures.get(2..).filter(|m| !m.is_empty()));
            let (hours, minutes) = (digits(hours)?, minutes.map_or(Some(0), digits)?);
            (hours <= 18 && minutes < 60).then_some(sign * (hours * 60 + minutes))?
        }
    };
    Some(minutes * 60 * SECOND_NS)
}

/// Turns times of day into times, and leaves room for leap seconds.
#[derive(Clone, Debug, Default)]
pub(crate) struct Clock {
    /// Days since 1970; 0 while no date is known.
    pub day: i64,
    /// The last time of day.
    last_ns: Option<i64>,
    /// Times from here on come a second later.
    leap_ns: Option<i64>,
}

impl Clock {
    /// From the next time of day on it is this day.
    pub fn set_day(&mut self, day: i64) {
        self.day = day;
        self.last_ns = None;
    }

    /// A time of day, on the day that continues the file: one that is more than twelve hours
    /// earlier than the last is of the next day; one 23 hours later is a step back over midnight.
    pub fn of_day(&mut self, stamp: Stamp) -> i64 {
        if let Some(last) = self.last_ns {
            let step = stamp.ns - last;
            let day = i64::from(step < -DAY_NS / 2) - i64::from(step > DAY_NS - DAY_NS / 24);
            self.day += day;
        }
        self.last_ns = Some(stamp.ns);
        self.whole(Stamp { ns: self.day * DAY_NS + stamp.ns, is_leap: stamp.is_leap })
    }

    /// A whole time, moved on by the leap seconds before it in the file.
    pub fn whole(&mut self, stamp: Stamp) -> i64 {
        let midnight = stamp.ns.div_euclid(DAY_NS) * DAY_NS;
        if stamp.is_leap {
            self.leap_ns = Some(midnight);
            return stamp.ns;
        }
        let is_after = self.leap_ns.is_some_and(|leap| stamp.ns >= leap);
        stamp.ns + if is_after { SECOND_NS } else { 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_count_from_1970() {
        assert_eq!(days(1970, 1, 1), Some(0));
        assert_eq!(days(2000, 3, 1), Some(11_017));
        assert_eq!(days(2024, 2, 29), Some(19_782));
        assert_eq!(days(1969, 12, 31), Some(-1));
        for (year, month, day) in [(2023, 2, 29), (2024, 13, 1), (2024, 4, 31), (1800, 1, 1)] {
            assert_eq!(days(year, month, day), None);
        }
    }

    #[test]
    fn times_are_read_as_they_are_written() {
        let ns = |text: &str| iso(text).map(|stamp| stamp.ns);
        let noon = days(2024, 7, 15).unwrap() * DAY_NS + DAY_NS / 2;
        for text in [
            "2024-07-15T12:00:00Z",
            "2024-07-15 12:00:00",
            "2024-07-15T14:00:00.000+02:00",
            "2024-07-15T06:30-0530",
            "2024/07/15 12:00:00 UTC",
            "20240715T120000Z",
            "2024-07-15 12:00:00Z.000",
        ] {
            assert_eq!(ns(text), Some(noon), "{text}");
        }
        assert_eq!(ns("2024-07-15T12:00:00.25Z"), Some(noon + SECOND_NS / 4));
        for text in
            ["2024-07-15", "2024-07-15T25:00:00Z", "noon", "2024-07-15T12:00:61Z", "T", "éT12:00"]
        {
            assert_eq!(ns(text), None, "{text}");
        }
        assert_eq!(compact("090001.50").map(|s| s.ns), Some(32_401 * SECOND_NS + SECOND_NS / 2));
        assert_eq!(colons("9:05").map(|s| s.ns), Some(32_700 * SECOND_NS));
    }

    #[test]
    fn a_leap_second_lasts_a_second_and_so_does_the_one_after() {
        let mut clock = Clock::default();
        let times = ["235958", "235959", "235960", "000000", "000001"];
        let ns: Vec<_> = times.iter().map(|t| clock.of_day(compact(t).unwrap())).collect();
        assert!(ns.windows(2).all(|pair| pair[1] - pair[0] == SECOND_NS), "{ns:?}");
    }

    #[test]
    fn midnight_is_passed_forwards_and_a_step_back_over_it_is_one() {
        let mut clock = Clock::default();
        let mut at = |text| clock.of_day(compact(text).unwrap()) / SECOND_NS;
        assert_eq!([at("235959"), at("000001"), at("235958")], [86_399, 86_401, 86_398]);
        assert_eq!([at("000002"), at("110000"), at("230000")], [86_402, 126_000, 169_200]);
    }
}
