//! Planning beside zenfg: the same frames in the same run.
//!
//! ```text
//! cargo bench --manifest-path graph/benches/Cargo.toml --ignore-rust-version [-- FRAME.json …] [-- --phases] [-- --quality]
//! cargo bench -p lightloom-graph --bench planning   # the same without zenfg
//! ```
//!
//! Times are medians (µs), bytes are MiB. `plan` is a cold plan, all phases, without the
//! bytes of the ways of sharing that it does not take; `cached` is what `PlanCache` takes to
//! know a frame again; `zenfg` is its `compile`, which includes validation, culling, and its pool;
//! `+record` adds its recording, which our declarations are made by beforehand. zenfg is given the same resources, passes,
//! accesses and roots.
//!
//! `--phases` adds a line above each frame's: what a plan without order and sharing takes, and how much more (µs) the search for
//! an order, and each way of sharing, cost.
//!
//! `--quality` plans some hundred random frames instead, and reports how far placements are above the lower bound.

use crate::{frames, peer};
use lightloom_graph::{Declaration, Memory, PassOrder, PlanCache, PlanOptions, Sharing, plan};
use std::{hint::black_box, time::Instant};

pub(crate) fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    if arguments.iter().any(|argument| argument == "--quality") {
        return quality();
    }
    let phases = arguments.iter().any(|argument| argument == "--phases");
    let mut frames: Vec<Declaration> = Vec::new();
    for path in arguments.iter().filter(|argument| *argument != "--phases") {
        match std::fs::read_to_string(path)
            .map_err(|error| error.to_string())
            .and_then(|json| Declaration::from_frame_json(&json).map_err(|error| error.to_string()))
        {
            Ok(frame) => frames.push(frame),
            Err(error) => {
                eprintln!("{path}: {error}");
                std::process::exit(1);
            }
        }
    }
    if frames.is_empty() {
        frames = frames::shipped();
    }
    println!(
        "{:<28} {:>6} {:>8} | {:>8} {:>6} {:>8} {:>8} {:>6} {:>7} | {:>8} {:>8} {:>8} {:>8} {:>8} {:>8}",
        "frame",
        "passes",
        "accesses",
        "plan",
        "cached",
        "zenfg",
        "+record",
        "plan ×",
        "cached ×",
        "unshared",
        "live",
        "ordered",
        "pooled",
        "placed",
        "zenfg"
    );
    for frame in &frames {
        row(frame, phases);
    }
}

fn row(frame: &Declaration, phases: bool) {
    let accesses: usize = frame.passes.iter().map(|pass| pass.accesses.len()).sum();
    let size = frame.passes.len() + accesses;
    let runs = (200_000 / size).clamp(5, 401);
    let options = PlanOptions::default();
    let memory_of = |sharing| plan(frame, &options.sharing(sharing)).expect("frames here are sound").memory;
    let (memory, pooled) = (memory_of(Sharing::Placed), memory_of(Sharing::Merged).pooled_bytes);
    let copy = frame.clone();
    let mut own = options;
    own.only_own_bytes = true;
    let ours = median(runs, || elapsed(|| plan(black_box(frame), &own).is_ok()));
    if phases {
        let with = |order, sharing| {
            let mut options = PlanOptions::default().order(order).sharing(sharing);
            options.only_own_bytes = true;
            median(runs, || elapsed(|| plan(black_box(frame), &options).is_ok()))
        };
        let least = with(PassOrder::Recorded, Sharing::Off);
        let ordered = with(PassOrder::Memory, Sharing::Off);
        let (merged, placed) = (with(PassOrder::Memory, Sharing::Merged), with(PassOrder::Memory, Sharing::Placed));
        println!(
            "  without order and sharing {least:.1}; order {:.1}, merged {:.1}, placed {:.1}",
            ordered - least,
            merged - ordered,
            placed - ordered
        );
    }
    let mut cache = PlanCache::new();
    cache.get(&frame.clone(), own).expect("frames here are sound");
    let cached = median(runs, || elapsed(|| cache.get(black_box(&copy), own).is_ok_and(|planned| planned.cached)));
    let theirs = peer::compile(frame);
    let mut both = Vec::new();
    let compile = median(runs.min(101), || {
        let times = peer::compile(frame);
        both.push(times.record_us + times.compile_us);
        times.compile_us
    });
    both.sort_by(f64::total_cmp);
    let mib = |bytes: u64| format!("{:.1}", bytes as f64 / f64::from(1 << 20));
    println!(
        "{:<28} {:>6} {:>8} | {:>8.1} {:>6.1} {:>8.1} {:>8.1} {:>6.3} {:>7.4} | {:>8} {:>8} {:>8} {:>8} {:>8} {:>8}",
        frame.name.chars().take(28).collect::<String>(),
        frame.passes.len(),
        accesses,
        ours,
        cached,
        compile,
        both[both.len() / 2],
        ours / compile,
        cached / compile,
        mib(memory.unshared_bytes),
        mib(memory.peak_live_bytes),
        mib(memory.ordered_peak_live_bytes),
        mib(pooled),
        mib(memory.placed_bytes),
        mib(theirs.bytes),
    );
}

/// Time of one call (µs).
fn elapsed<R>(call: impl FnOnce() -> R) -> f64 {
    let started = Instant::now();
    let result = call();
    let us = started.elapsed().as_secs_f64() * 1e6;
    black_box(result);
    us
}

fn median(runs: usize, mut run: impl FnMut() -> f64) -> f64 {
    let mut times: Vec<f64> = (0..runs).map(|_| run()).collect();
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// Ratios over many random frames of each kind: quartiles and extremes.
fn quality() {
    println!("{:<24} {:<26} {:>7} {:>7} {:>7} {:>7} {:>7}", "frames", "ratio", "least", "25 %", "median", "75 %", "most");
    for (kind, frames) in frames::random() {
        // Placed, pooled, and pooled in recorded order.
        let memories: Vec<[Memory; 3]> = frames
            .iter()
            .map(|frame| {
                let of = |sharing, order| {
                    let options = PlanOptions::default().sharing(sharing).order(order);
                    plan(frame, &options).expect("frames here are sound").memory
                };
                [
                    of(Sharing::Placed, PassOrder::Memory),
                    of(Sharing::Merged, PassOrder::Memory),
                    of(Sharing::Merged, PassOrder::Recorded),
                ]
            })
            .collect();
        let print = |what, of: &dyn Fn(&[Memory; 3]) -> [u64; 2]| {
            print(
                kind,
                what,
                memories.iter().map(|memories| {
                    let [a, b] = of(memories);
                    a as f64 / b.max(1) as f64
                }),
            );
        };
        print("ordered / live", &|[placed, ..]| [placed.ordered_peak_live_bytes, placed.peak_live_bytes]);
        print("placed / live", &|[placed, ..]| [placed.placed_bytes, placed.peak_live_bytes]);
        print("placed / ordered", &|[placed, ..]| [placed.placed_bytes, placed.ordered_peak_live_bytes]);
        print("pooled / live", &|[_, pooled, _]| [pooled.pooled_bytes, pooled.peak_live_bytes]);
        print("pooled / recorded pooled", &|[_, pooled, recorded]| [pooled.pooled_bytes, recorded.pooled_bytes]);
    }
}

fn print(kind: &str, what: &str, ratios: impl Iterator<Item = f64>) {
    let mut ratios: Vec<f64> = ratios.collect();
    ratios.sort_by(f64::total_cmp);
    let at = |quarters: usize| ratios[(ratios.len() - 1) * quarters / 4];
    println!("{kind:<24} {what:<26} {:>7.3} {:>7.3} {:>7.3} {:>7.3} {:>7.3}", at(0), at(1), at(2), at(3), at(4));
}
