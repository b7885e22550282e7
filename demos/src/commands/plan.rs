//! `lightloom plan`: a frame description planned without a device.

use std::fmt::Write as _;
use std::hint::black_box;
use std::time::{Duration, Instant};

use lightloom_graph::{Declaration, Plan, PlanCache, PlanOptions, SlotKind, plan, to_html, to_json};

use crate::cli::PlanArgs;
use crate::files::{prepare_parent, write_whole};
use crate::format::{bytes, columns, number};
use crate::{Error, console};

/// Planning is repeated for this long, and the median told: one run is at the mercy of caches and of the scheduler.
const MEASURE: Duration = Duration::from_millis(200);
/// More runs say nothing new.
const MOST_RUNS: usize = 1000;

pub(crate) fn run(args: &PlanArgs) -> Result<(), Error> {
    if let Some(page) = &args.html {
        prepare_parent(page)?;
    }
    let text = std::fs::read_to_string(&args.frame).map_err(|error| Error::read(&args.frame, &error))?;
    let wrong = |error| Error::read(&args.frame, &error);
    let declaration = Declaration::from_frame_json(&text).map_err(wrong)?;
    let options = PlanOptions::default();
    let planned = plan(&declaration, &options).map_err(wrong)?;
    if let Some(page) = &args.html {
        write_whole(page, to_html(&declaration, &planned, None).as_bytes())?;
    }
    // Timed is what an executor does, which reports the bytes of its own way of sharing only. The same declaration was planned
    // without a mistake just before.
    let mut own = options;
    own.only_own_bytes = true;
    let plan_us = median_us(|| {
        let _ = black_box(plan(black_box(&declaration), &own));
    });
    let mut cache = PlanCache::new();
    let cached_plan_us = median_us(|| {
        let _ = black_box(cache.get(black_box(&declaration), own));
    });
    let times = Times { plan_us, cached_plan_us };
    if args.json {
        console::print(&format!("{:#}\n", json(&declaration, &planned, times)))
    } else {
        console::print(&table(&declaration, &planned, times))
    }
}

/// Median times (µs).
#[derive(Clone, Copy)]
struct Times {
    plan_us: f64,
    cached_plan_us: f64,
}

fn median_us(mut work: impl FnMut()) -> f64 {
    let begin = Instant::now();
    let mut times = Vec::new();
    while times.is_empty() || (begin.elapsed() < MEASURE && times.len() < MOST_RUNS) {
        let start = Instant::now();
        work();
        times.push(start.elapsed().as_secs_f64() * 1e6);
    }
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn json(declaration: &Declaration, plan: &Plan, times: Times) -> serde_json::Value {
    let mut json = to_json(declaration, plan);
    json["plan_us"] = times.plan_us.into();
    json["cached_plan_us"] = times.cached_plan_us.into();
    json
}

fn table(declaration: &Declaration, plan: &Plan, times: Times) -> String {
    let mut rows = vec![["pass", "kind", "live"].map(str::to_owned).to_vec()];
    for (position, &index) in plan.order.iter().enumerate() {
        let Some(pass) = declaration.passes.get(index) else { continue };
        let live = plan.live_bytes.get(position).copied().unwrap_or(0);
        rows.push(vec![pass.name.to_string(), pass.kind.name().to_owned(), bytes(live)]);
    }
    let mut text = columns(&rows);
    if !plan.culled.is_empty() {
        text.push_str("\nculled\n");
        for culled in &plan.culled {
            let _ = writeln!(text, "  {}: {}", culled.pass, culled.reason);
        }
    }
    let memory = plan.memory;
    let facts = [
        ("frame", declaration.name.clone()),
        ("passes", format!("{} of {} run", plan.order.len(), declaration.passes.len())),
        ("resources", declaration.resources.len().to_string()),
        ("unshared", bytes(memory.unshared_bytes)),
        ("live at most, as recorded", bytes(memory.peak_live_bytes)),
        ("live at most, as planned", bytes(memory.ordered_peak_live_bytes)),
        ("pooled", bytes(memory.pooled_bytes)),
        ("placed", bytes(memory.placed_bytes)),
        ("allocated", format!("{} ({})", bytes(memory.allocated_bytes), slot_kinds(plan))),
        ("planned in", format!("{} µs", number(Some(times.plan_us)))),
        ("from cache in", format!("{} µs", number(Some(times.cached_plan_us)))),
    ];
    let facts: Vec<Vec<String>> = facts.into_iter().map(|(name, value)| vec![name.to_owned(), value]).collect();
    text.push('\n');
    text.push_str(&columns(&facts));
    text
}

/// Such as "3 objects: 1.0 MiB, 1 arena: 2.0 MiB".
fn slot_kinds(plan: &Plan) -> String {
    let kinds = [SlotKind::Object, SlotKind::Arena, SlotKind::Heap].into_iter().filter_map(|kind| {
        let slots: Vec<u64> = plan.slots.iter().filter(|slot| slot.kind == kind).map(|slot| slot.bytes).collect();
        let s = if slots.len() == 1 { "" } else { "s" };
        (!slots.is_empty()).then(|| format!("{} {}{s}: {}", slots.len(), kind.name(), bytes(slots.iter().sum())))
    });
    kinds.collect::<Vec<String>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_and_json_agree_on_order_and_bytes() {
        let frame = r#"{"frame": "f", "resources": [
            {"name": "a", "kind": "buffer", "origin": "transient", "bytes": 2048},
            {"name": "out", "kind": "buffer", "origin": "imported", "bytes": 4}],
          "passes": [
            {"name": "make", "kind": "compute", "reads": [], "writes": [{"resource": "a", "preserve": false}]},
            {"name": "use", "kind": "compute", "reads": ["a"], "writes": [{"resource": "out", "preserve": false}]},
            {"name": "idle", "kind": "compute", "reads": [], "writes": []}]}"#;
        let declaration = Declaration::from_frame_json(frame).unwrap();
        let planned = plan(&declaration, &PlanOptions::default()).unwrap();
        let times = Times { plan_us: 2.0, cached_plan_us: 1.0 };
        let json = json(&declaration, &planned, times);
        assert_eq!(json["order"], serde_json::json!(["make", "use"]));
        assert_eq!(json["plan_us"], 2.0);
        let text = table(&declaration, &planned, times);
        assert!(text.contains("2 of 3 run") && text.contains("2.0 KiB") && text.contains("idle: "), "{text}");
    }

    #[test]
    fn the_median_is_of_at_least_one_run() {
        let mut runs = 0;
        let time = median_us(|| runs += 1);
        assert!(runs >= 1 && time >= 0.0, "{runs} runs, {time} µs");
    }
}
