//! Frames as Chrome's trace events, which `chrome://tracing` and Perfetto open, and Tracy by its `import-chrome`.
//!
//! ```text
//!   CPU           │plan│record│                     │plan│record│
//!   GPU passes                │frame `f`           │            │frame `f` …
//!                             │a  │b      │c       │
//!   live bytes                ▁▁▁▁▆▆▆▆▆▆▆▆▃▃▃▃▃▃▃▃▃
//! ```
//!
//! The executor knows how long each pass took and not when it began, so passes are laid end to end behind the CPU's work,
//! and the track's name says so. An event is complete ("X": begin and duration in µs), a counter ("C") or a name ("M").

use super::profile::{FrameProfile, Profile};
use crate::executor::TimingSource;
use serde_json::{Value, json};

const PROCESS: u32 = 1;
const CPU: u32 = 1;
const GPU: u32 = 2;

/// The frames of a profile, one after the other, as a Chrome trace: `{"traceEvents": […]}`.
pub fn to_chrome_trace(profile: &Profile) -> Value {
    let mut events = vec![
        name("process_name", CPU, if profile.adapter.is_empty() { "lightloom" } else { &profile.adapter }),
        name("thread_name", CPU, "CPU"),
        name("thread_name", GPU, &format!("GPU passes, durations laid end to end ({})", profile.source().describe())),
    ];
    let mut now = 0.0;
    for (index, frame) in profile.frames.iter().enumerate() {
        now = add_frame(&mut events, index, frame, now);
    }
    json!({ "displayTimeUnit": "ms", "traceEvents": events })
}

/// Adds the events of one frame that begins at `start` (µs); returns its end.
fn add_frame(events: &mut Vec<Value>, index: usize, frame: &FrameProfile, start: f64) -> f64 {
    let plan_us = clean(frame.plan_us);
    let from = if frame.plan_reason.is_empty() { "the cache" } else { &frame.plan_reason };
    events.push(complete("plan", "cpu", CPU, start, plan_us, &json!({ "frame": index, "from": from })));
    let record_us = clean(frame.record_us);
    events.push(complete("record and submit", "cpu", CPU, start + plan_us, record_us, &json!({ "frame": index })));
    // Where the CPU waits for each pass, the passes run while it records.
    let waits = frame.source == TimingSource::CpuPerPass;
    let begin = start + plan_us + if waits { 0.0 } else { record_us };
    let times: Vec<f64> = frame.passes.iter().map(|pass| clean(pass.gpu_ms.unwrap_or(0.0) * 1e3)).collect();
    let total: f64 = times.iter().sum();
    events.push(complete(&format!("frame `{}`", frame.frame), "frame", GPU, begin, total, &json!({ "frame": index })));
    let mut now = begin;
    for (position, (pass, us)) in frame.passes.iter().zip(times).enumerate() {
        let live = frame.live_bytes.get(position).copied().unwrap_or(0);
        events.push(counter(now, live));
        if pass.gpu_ms.is_some() {
            events.push(complete(&pass.name, "pass", GPU, now, us, &json!({ "position": position, "live_bytes": live })));
        }
        // The sum may round above what was added up one by one.
        now = (now + us).min(begin + total);
    }
    events.push(counter(begin + total, 0));
    (begin + total).max(start + plan_us + record_us)
}

fn counter(ts: f64, live: u64) -> Value {
    json!({ "name": "live bytes", "ph": "C", "ts": ts, "pid": PROCESS, "tid": GPU, "args": { "transient": live } })
}

/// JSON has no NaN, and no pass takes less than nothing.
fn clean(us: f64) -> f64 {
    if us.is_finite() { us.max(0.0) } else { 0.0 }
}

fn name(what: &str, thread: u32, name: &str) -> Value {
    json!({ "name": what, "ph": "M", "pid": PROCESS, "tid": thread, "args": { "name": name } })
}

fn complete(name: &str, category: &str, thread: u32, ts: f64, dur: f64, args: &Value) -> Value {
    json!({ "name": name, "cat": category, "ph": "X", "ts": ts, "dur": dur, "pid": PROCESS, "tid": thread, "args": args })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::executor::PassTime;

    fn profile() -> Profile {
        let pass = |name: &str, gpu_ms| PassTime { name: name.into(), gpu_ms };
        let frame = FrameProfile {
            frame: "f".to_owned(),
            passes: vec![pass("a", Some(0.1)), pass("untimed", None), pass("wrong", Some(f64::NAN)), pass("b", Some(0.3))],
            live_bytes: vec![8, 16, 16, 4],
            plan_us: 5.0,
            record_us: 7.0,
            ..FrameProfile::default()
        };
        let mut profile = Profile::new("an adapter");
        profile.frames = vec![frame; 3];
        profile
    }

    #[test]
    fn events_are_sorted_and_last_no_less_than_nothing() {
        let trace = to_chrome_trace(&profile());
        let events = trace["traceEvents"].as_array().unwrap();
        let timed: Vec<&Value> = events.iter().filter(|event| event["ph"] != "M").collect();
        let starts: Vec<f64> = timed.iter().map(|event| event["ts"].as_f64().unwrap()).collect();
        assert!(starts.is_sorted(), "{starts:?}");
        for event in timed.iter().filter(|event| event["ph"] == "X") {
            assert!(event["dur"].as_f64().unwrap() >= 0.0, "{event}");
        }
        let named = |name: &str| events.iter().filter(|event| event["name"] == name).count();
        assert_eq!(
            [named("a"), named("untimed"), named("plan"), named("live bytes")],
            [3, 0, 3, 15],
            "a counter per pass and one at the end of the frame"
        );
    }

    #[test]
    fn passes_lie_inside_their_frame_and_frames_apart() {
        let trace = to_chrome_trace(&profile());
        let events = trace["traceEvents"].as_array().unwrap();
        let span =
            |event: &Value| (event["ts"].as_f64().unwrap(), event["ts"].as_f64().unwrap() + event["dur"].as_f64().unwrap());
        let frames: Vec<(f64, f64)> = events.iter().filter(|event| event["cat"] == "frame").map(span).collect();
        assert_eq!(frames.len(), 3);
        assert!(frames.windows(2).all(|pair| pair[0].1 < pair[1].0), "{frames:?}");
        for event in events.iter().filter(|event| event["cat"] == "pass") {
            let (begin, end) = span(event);
            assert!(frames.iter().any(|frame| frame.0 <= begin && end <= frame.1 + 1e-6), "{event} lies outside {frames:?}");
        }
    }

    #[test]
    fn the_adapter_and_the_tracks_are_named() {
        let trace = to_chrome_trace(&profile());
        let text = trace.to_string();
        assert!(text.contains("an adapter") && text.contains("laid end to end") && text.contains("\"CPU\""), "{text}");
    }
}
