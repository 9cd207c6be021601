//! Budgets: records that survive a file, verdicts, changes, and pairs of runs that are told apart.
//!
//! In:    records and times that are made up here, from seeds.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: flying (the contracts of the workspace), single statistics (beside the code).

use overfly_config::read_budget;
use overfly_core::digest::mix;
use overfly_replay::budget::judge::{budget_names, incomparable, known_names, unshared};
use overfly_replay::budget::pairs::{compare, goes_on};
use overfly_replay::budget::record::{DIGESTS, ERRORS, Facts, Sampled, counters, times};
use overfly_replay::budget::{
    BudgetSettings, ColdStart, Odd, Outcome, PairCells, PairRule, Relation, RunRecord, Status,
    diff, init, judge, outcome,
};
use std::collections::BTreeMap;

const FRAMES: usize = 200;

fn facts() -> Facts {
    Facts {
        program: "overfly 0.1.0".into(),
        profile: "debug".into(),
        platform: "linux x86_64".into(),
        processor: String::new(),
        cores: 2,
        workers: 1,
        flight: "rainier".into(),
        scene: "earth".into(),
        settings_digest: "0123456789abcdef".into(),
        size_px: [1280, 720],
        loader_delay_ms: 0,
        rate_hz: 60.0,
        first_frame: 1000,
        interrupted: false,
    }
}

/// A record of made-up frames: counter c of frame i is 1000 c + i mod 17, times are 2 to 3 ms.
fn record(runs: usize) -> RunRecord {
    let mut record = RunRecord::new(facts());
    let along = |of: fn(f64) -> f64| (0..FRAMES).map(|i| of(i as f64)).collect::<Vec<f64>>();
    record.time_s = along(|i| i / 60.0);
    record.lat_deg = along(|i| 46.0 + i * 1e-4);
    record.lon_deg = along(|i| -121.0 - i / 3.0 * 1e-4);
    record.height_m = along(|_| 2100.5);
    for (c, name) in counters().into_iter().enumerate() {
        let column = (0..FRAMES).map(|i| (1000 * c + i % 17) as f64).collect();
        record.counters.insert(name.into(), column);
    }
    for (d, name) in DIGESTS.into_iter().enumerate() {
        let column = (0..FRAMES).map(|i| mix((i * 4 + d) as u64)).collect();
        record.digests.insert(name.into(), column);
    }
    for run in 0..runs {
        record.cold_starts.push(ColdStart { frames: 20, total_ns: 9_000_000, max_ns: 1_000_000 });
        let time = |i: usize| 2_000_000 + mix((run * FRAMES + i) as u64) % 1_000_000;
        let column: Vec<u64> = (0..FRAMES).map(time).collect();
        let columns = times().into_iter().map(|name| (name.to_owned(), column.clone()));
        record.times_ns.push(columns.collect());
    }
    let columns = ERRORS.map(|name| (name.to_owned(), vec![0.25, 0.1 + 0.2]));
    record.errors = Sampled { frames: vec![50, 150], columns: columns.into() };
    record
}

fn budget(lines: &str) -> BudgetSettings {
    let names = known_names();
    let text = format!("Budget(lines: [{lines}])");
    read_budget(&text, "budget.ron", &budget_names(&names)).unwrap()
}

#[test]
fn a_record_survives_its_file_to_the_last_bit_and_faults_are_named() {
    let mut before = record(2);
    before.odd = Some(Odd { run: 1, frame: 3, name: "splits".into() });
    let column = before.counters.get_mut("error_px_bound").unwrap();
    column.iter_mut().enumerate().for_each(|(i, x)| *x = f64::MAX / (1.0 + i as f64 / 3.0));
    let text = serde_json::to_string(&before).unwrap();
    let after: RunRecord = serde_json::from_str(&text).unwrap();
    assert_eq!(after.clone().checked().unwrap(), before);
    let mut short = after.clone();
    short.counters.get_mut("splits").unwrap().pop();
    let fault = short.checked().unwrap_err().to_string();
    assert_eq!(fault, "its column splits has 199 values for 200 frames");
    let other = RunRecord { format: "overfly-replay-1".into(), ..after };
    let fault = other.checked().unwrap_err().to_string();
    assert_eq!(fault, "its format is overfly-replay-1, expected is overfly-budget-run-1");
    let odd = serde_json::from_str::<RunRecord>(&text.replace("\"odd\"", "\"odds\"")).unwrap_err();
    assert!(odd.to_string().contains("unknown field `odds`"), "{odd}");
    let digest = format!("{:016x}", mix(0));
    let odd = serde_json::from_str::<RunRecord>(&text.replace(&digest, "xyz")).unwrap_err();
    assert!(odd.to_string().contains("`xyz` is not a digest"), "{odd}");
}

#[test]
fn a_broken_line_names_frame_and_place_of_the_worst() {
    let mut run = record(1);
    run.counters.get_mut("triangles").unwrap()[153] = 402_000.0;
    let lines = "(of: triangles, statistic: max, limit: 201000),
        (of: triangles, statistic: p50, limit: 201000),
        (of: splits, statistic: max, limit: 10, severity: warn)";
    let verdicts = judge(&run, &budget(lines), None);
    let status: Vec<Status> = verdicts.iter().map(|verdict| verdict.status).collect();
    assert_eq!(status, [Status::Fail, Status::Pass, Status::Warn]);
    assert_eq!(verdicts[0].worst, Some(153));
    assert_eq!(
        verdicts[0].sentence,
        "triangles max is 402000, limit 201000; worst in frame 1153 at 46.015300, -121.005100, \
         2100 m, 2.550 s: 402000"
    );
    assert_eq!(outcome(&verdicts), Outcome::Fail);
    assert_eq!(outcome(&verdicts[1..]), Outcome::Pass);
}

#[test]
fn times_hold_in_every_run_or_are_broken_in_every_run_or_nobody_knows() {
    let run = record(3);
    let of = |limit: &str, more: &str| {
        let line = format!("(of: frame, statistic: max, limit: {limit}{more})");
        judge(&run, &budget(&line), None).pop().unwrap()
    };
    assert_eq!(of("3.0", "").status, Status::Pass);
    assert_eq!(of("2.5", "").status, Status::Fail);
    let values = of("3.0", "").values;
    assert_eq!(values.len(), 3);
    let between = (values.iter().copied().fold(f64::INFINITY, f64::min)
        + values.iter().copied().fold(0.0, f64::max))
        / 2.0;
    let verdict = of(&between.to_string(), "");
    assert_eq!(verdict.status, Status::Inconclusive);
    assert_eq!(outcome(&[verdict]), Outcome::Inconclusive);
    assert_eq!(of(&between.to_string(), ", severity: warn").status, Status::Warn);
    let untimed = judge(
        &RunRecord { times_ns: Vec::new(), ..run.clone() },
        &budget("(of: frame, statistic: max, limit: 1)"),
        None,
    );
    assert_eq!(untimed.last().unwrap().status, Status::Skipped);
    assert_eq!(outcome(&untimed), Outcome::Pass);
}

#[test]
fn a_baseline_is_held_to_the_last_digit_and_a_doubled_count_names_frame_and_place() {
    let (base, mut run) = (record(1), record(1));
    let same = judge(&run, &BudgetSettings::default(), Some(&base));
    assert_eq!(same.len(), counters().len() + DIGESTS.len() + ERRORS.len());
    assert_eq!(outcome(&same), Outcome::Pass);
    run.counters.get_mut("triangles").unwrap().iter_mut().for_each(|x| *x *= 2.0);
    run.errors.columns.get_mut("e5").unwrap()[1] = 0.3;
    let verdicts = judge(&run, &BudgetSettings::default(), Some(&base));
    let failed: Vec<_> = verdicts.iter().filter(|one| one.status == Status::Fail).collect();
    assert_eq!(failed.iter().map(|one| &one.of[..]).collect::<Vec<_>>(), ["triangles", "e5"]);
    let sentence = &failed[0].sentence;
    for part in ["200 of 200 frames", "(+100.0 %)", "first in frame 1000 at 46.000000, ", "most in"]
    {
        assert!(sentence.contains(part), "{part} is not in {sentence}");
    }
    assert!(failed[1].sentence.contains("first in frame 1150 at 46.015000"), "{:?}", failed[1]);
    let allowed = budget(
        "(of: triangles, statistic: changed, limit: 200),
        (of: \"e5\", statistic: changed, limit: 0, severity: warn)",
    );
    assert_eq!(outcome(&judge(&run, &allowed, Some(&base))), Outcome::Pass);
    let alone = judge(&run, &allowed, None);
    assert!(alone.iter().all(|one| one.status == Status::Skipped));
}

#[test]
fn an_older_baseline_is_held_for_what_it_has_and_what_it_lacks_is_named() {
    let (run, mut base) = (record(1), record(1));
    for newer in ["allocations", "decoded_bytes"] {
        base.counters.remove(newer);
    }
    assert_eq!(unshared([&run, &base]), ["allocations", "decoded_bytes"]);
    assert_eq!(unshared([&base, &run]), ["allocations", "decoded_bytes"]);
    let verdicts = judge(&run, &BudgetSettings::default(), Some(&base));
    let all = judge(&run, &BudgetSettings::default(), Some(&record(1)));
    assert_eq!((verdicts.len() + 2, outcome(&verdicts)), (all.len(), Outcome::Pass));
    assert!(verdicts.iter().all(|one| !unshared([&run, &base]).contains(&one.of)));
    let asked = budget("(of: allocations, statistic: changed, limit: 0)");
    let asked = &judge(&run, &asked, Some(&base))[0];
    assert_eq!(asked.status, Status::Skipped);
    assert_eq!(asked.sentence, "allocations changed: the baseline does not have it");
    base.counters.get_mut("splits").unwrap()[4] += 1.0;
    let verdicts = judge(&run, &BudgetSettings::default(), Some(&base));
    assert_eq!(outcome(&verdicts), Outcome::Fail, "what it has is still held");
    let text = diff(&base, &run).text(&run);
    assert!(text.contains("differs: counted by one alone: allocations, decoded_bytes"), "{text}");
}

#[test]
fn a_single_heap_call_in_a_single_frame_breaks_its_line_and_names_the_frame() {
    let mut run = record(1);
    run.counters.insert("allocations".into(), vec![0.0; FRAMES]);
    let none = budget("(of: allocations, statistic: max, limit: 0)");
    let calm = run.clone();
    assert_eq!(outcome(&judge(&calm, &none, None)), Outcome::Pass);
    run.counters.get_mut("allocations").unwrap()[77] = 1.0;
    let verdicts = judge(&run, &none, Some(&calm));
    assert_eq!(verdicts[0].status, Status::Fail);
    assert!(verdicts[0].sentence.contains("worst in frame 1077"), "{:?}", verdicts[0]);
    let changed: Vec<_> =
        verdicts[1..].iter().filter(|one| one.status == Status::Fail).map(|one| &one.of).collect();
    assert_eq!(changed, ["allocations"]);
    assert_eq!(diff(&calm, &run).stage, "frame", "it is of no stage alone");
}

#[test]
fn runs_that_count_differently_fail_and_other_flights_are_not_comparable() {
    let mut run = record(2);
    assert_eq!(judge(&run, &BudgetSettings::default(), None)[0].status, Status::Pass);
    run.odd = Some(Odd { run: 1, frame: 7, name: "digest.mesh".into() });
    let verdicts = judge(&run, &BudgetSettings::default(), None);
    assert_eq!(outcome(&verdicts), Outcome::Fail);
    assert!(verdicts[0].sentence.starts_with("digest.mesh of run 2 is not that of run 1 in frame"));
    let other = Facts { size_px: [640, 360], workers: 9, ..facts() };
    assert_eq!(incomparable(&facts(), &other), ["the size is 1280x720, there it is 640x360"]);
}

#[test]
fn a_diff_names_the_first_frame_and_stage_and_what_changed() {
    let (a, mut b) = (record(1), record(1));
    let same = diff(&a, &b);
    assert!(same.same() && same.text(&b).contains("no count and no digest differs"));
    b.counters.get_mut("built").unwrap()[30] += 1.0;
    b.digests.get_mut("digest.vertices").unwrap()[30] += 1;
    b.counters.get_mut("pages").unwrap()[90] += 5.0;
    let found = diff(&a, &b);
    assert_eq!((found.first, found.stage, found.same()), (Some(30), "mesh.build", false));
    let text = found.text(&b);
    for part in [
        "first: frame 1030 at 46.003000",
        "stage mesh.build",
        "result: changed\n  digest.vertices differs in 1 of 200 frames",
        "work: changed",
        "pages differs in 1 of 200 frames",
        "speed: medians",
    ] {
        assert!(text.contains(part), "{part} is not in {text}");
    }
    let work = RunRecord { digests: a.digests.clone(), ..b };
    let found = diff(&a, &work);
    assert!(found.results.is_empty() && found.work.len() == 2);
    assert!(found.text(&work).contains("result: the same\nwork: changed"));
}

#[test]
fn a_budget_from_a_run_is_read_back_and_held_by_that_run() {
    let run = record(3);
    let text = init::budget_text(&run);
    let names = known_names();
    let budget = read_budget(&text, "budget.ron", &budget_names(&names)).unwrap();
    assert!(budget.lines.len() > 20, "{text}");
    assert!(text.contains("1.1 times what that run had") && text.contains("2 times"), "{text}");
    let verdicts = judge(&run, &budget, None);
    assert_eq!(outcome(&verdicts), Outcome::Pass, "{verdicts:?}");
    assert!(verdicts.iter().all(|one| one.status == Status::Pass), "{verdicts:?}");
}

/// A run of made-up times: a flight with hills, a disturbance of the whole run of some percent, of
/// stretches of it, of single frames, and hitches of five times as long.
fn timed(seed: u64, factor: f64) -> BTreeMap<String, Vec<u64>> {
    let share = |x: u64| (mix(x) >> 11) as f64 / (1_u64 << 53) as f64;
    let around = |x: u64| share(x) + share(x ^ (1 << 40)) + share(x ^ (1 << 41)) - 1.5;
    let whole = 1.0 + 0.04 * around(seed);
    let time = |frame: u64| {
        let hills = 1.0 + 0.5 * share(frame / 100);
        let stretch = 1.0 + 0.05 * around(mix(seed) ^ (frame / 50) ^ (1 << 50));
        let single = 1.0 + 0.1 * around(mix(seed) ^ frame ^ (1 << 51));
        let hitch = if share(mix(seed) ^ frame ^ (1 << 52)) < 0.02 { 5.0 } else { 1.0 };
        let ns = 2e6 * factor * hills * whole * stretch * single * hitch;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "below 1e8")]
        let ns = ns as u64;
        ns
    };
    let frame: Vec<u64> = (0..600).map(time).collect();
    let short = vec![400; 600];
    [("frame".to_owned(), frame), ("camera".to_owned(), short)].into()
}

/// Pairs until it is decided, as the host does it.
fn told(draw: u64, factor: f64) -> (Relation, usize) {
    let rule = PairRule { seed: draw, ..PairRule::default() };
    let mut pairs = Vec::new();
    loop {
        let seed = mix(draw) ^ ((pairs.len() as u64) << 8);
        pairs.push(PairCells::of(&timed(seed, 1.0), &timed(seed ^ 1, factor)));
        let compared = compare(&pairs, &["frame", "camera"], &rule);
        if !goes_on(&compared, pairs.len(), &rule) {
            assert_eq!(compared[1].relation, Relation::TooShort);
            return (compared[0].relation, pairs.len());
        }
    }
}

fn count(factor: f64, relation: Relation) -> usize {
    let told: Vec<_> = (0..20).map(|draw| told(draw, factor)).collect();
    println!("factor {factor}: {told:?}");
    told.iter().filter(|(found, _)| *found == relation).count()
}

#[test]
fn twenty_of_twenty_equal_programs_are_the_same() {
    assert_eq!(count(1.0, Relation::Same), 20);
}

#[test]
fn ten_percent_more_are_slower_and_ten_percent_less_are_faster_in_twenty_of_twenty() {
    assert_eq!(count(1.1, Relation::Slower), 20);
    assert_eq!(count(0.9, Relation::Faster), 20);
}

#[test]
fn what_lies_at_the_border_of_interest_is_never_called_the_other_way() {
    assert_eq!(count(1.03, Relation::Faster), 0);
    let rule = PairRule::default();
    assert_eq!(compare(&[], &["frame"], &rule)[0].relation, Relation::TooShort);
    assert!(goes_on(&[], 0, &rule) && !goes_on(&[], rule.most, &rule));
}

#[test]
fn both_orders_come_equally_often() {
    for seed in 0..50 {
        let rule = PairRule { seed, ..PairRule::default() };
        let first = (0..30).filter(|&pair| rule.first_goes_first(pair)).count();
        assert_eq!(first, 15, "seed {seed}");
    }
    let orders = |seed| {
        let rule = PairRule { seed, ..PairRule::default() };
        (0..30).map(|pair| rule.first_goes_first(pair)).collect::<Vec<_>>()
    };
    assert_ne!(orders(1), orders(2));
}
