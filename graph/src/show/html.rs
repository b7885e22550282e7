//! A planned frame as one HTML page that needs nothing beside it.
//!
//! ```text
//!   ┌ name, adapter, counts ────────────────┬──────────┐
//!   │ the graph: boxes and lines            │ what is  │
//!   │ time and memory over the passes       │ pointed  │
//!   │ bytes by way of placing               │ at       │
//!   │ culled passes, resources, passes      │          │
//!   └───────────────────────────────────────┴──────────┘
//! ```
//!
//! Drawings are made here and not in the browser, so that the page shows the same without scripts and its parts can be
//! tested. The script, one file of plain JavaScript, adds what moves: highlights, the panel of facts, zoom, keys. A library
//! for drawing graphs was rejected: the smallest are larger than the pages, and a page must stand alone.

use super::{
    Profile, dag,
    facts::data,
    flow::flows,
    tables::{culled_table, memory_bars, resource_table},
    text::{bytes, escape, time},
    timeline::timeline,
};
use crate::{declaration::Declaration, executor::TimingSource, plan::Plan};
use std::collections::HashMap;
use std::fmt::Write as _;

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// A planned frame as one self-contained HTML page: the graph, time and memory over the passes with their placement and the
/// lower bound, culled passes with reasons, and all resources.
///
/// Needs no device. `profile` gives the times of frames of this declaration that ran, of which the page shows the median;
/// without it the page says that there are none.
///
/// ```
/// use lightloom_graph::{Declaration, PlanOptions, plan, to_html};
///
/// let declaration = Declaration::from_frame_json(r#"{"frame": "empty", "resources": [], "passes": []}"#)?;
/// let page = to_html(&declaration, &plan(&declaration, &PlanOptions::default())?, None);
/// assert!(page.starts_with("<!doctype html>"));
/// # Ok::<(), lightloom_graph::GraphError>(())
/// ```
pub fn to_html(declaration: &Declaration, plan: &Plan, profile: Option<&Profile>) -> String {
    let times = profile.map(Profile::medians).unwrap_or_default();
    let flows = flows(declaration);
    let position: HashMap<usize, usize> = plan.order.iter().enumerate().map(|(at, &pass)| (pass, at)).collect();
    let view = View { declaration, plan, times, position };
    let title = escape(&declaration.name);
    let mut body = header(&view, profile);
    let graph = format!("{}{}", GRAPH_TOOLS, wrap(&dag::dag(declaration, plan, &flows, &view.times)));
    body.push_str(&section("graph", "The graph", &graph));
    let over = format!("{}{}{}", timing_note(profile, &view.times), legend(plan), timeline(declaration, plan, &view.times));
    body.push_str(&section("timeline", "Time and memory over the passes", &over));
    body.push_str(&section("bytes", "Bytes of transient resources", &memory_bars(plan)));
    if !plan.culled.is_empty() {
        body.push_str(&section("culled", "Culled passes", &culled_table(&view)));
    }
    body.push_str(&section("resources", "Resources", &resource_table(&view)));
    format!(
        "<!doctype html>\n<html lang=en>\n<head>\n<meta charset=utf-8>\n\
         <meta name=viewport content=\"width=device-width, initial-scale=1\">\n\
         <title>{title} · Lightloom graph</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<div class=page>\n<main>\n{body}</main>\n\
         <aside id=facts aria-live=polite><p class=note>Point at a pass or a resource, or choose it by the arrow keys, to see what it reads and writes.</p></aside>\n</div>\n\
         <script type=\"application/json\" id=data>{}</script>\n<script>\n{SCRIPT}</script>\n</body>\n</html>\n",
        data(&view)
    )
}

/// What the parts of the page need.
pub(super) struct View<'a> {
    pub(super) declaration: &'a Declaration,
    pub(super) plan: &'a Plan,
    /// Median GPU time (ms) by pass name.
    pub(super) times: HashMap<&'a str, f64>,
    /// Position of each pass that runs.
    pub(super) position: HashMap<usize, usize>,
}

const GRAPH_TOOLS: &str = "<p class=legend><span><i class=k-compute></i>compute</span><span><i class=k-raster></i>raster</span>\
    <span><i class=k-copy></i>copy, transfer</span><span><i class=k-raytrace></i>ray tracing</span><span><i class=k-closure></i>closure</span>\
    <span><i class=dashed></i>culled</span><span>↗ outlives the frame</span></p>\n\
    <p class=tools hidden><button type=button data-zoom=out aria-label=\"smaller\">−</button><button type=button data-zoom=in aria-label=\"larger\">+</button>\
    <button type=button data-zoom=fit>fit</button><button type=button data-zoom=one>1 : 1</button>\
    <span class=note>drag to pan, Ctrl and wheel to zoom</span></p>\n";

fn wrap(svg: &str) -> String {
    format!("<div class=\"scroll canvas\" tabindex=0>{svg}</div>\n")
}

fn section(id: &str, title: &str, content: &str) -> String {
    format!("<section id={id}>\n<h2>{title}</h2>\n{content}</section>\n")
}

fn header(view: &View<'_>, profile: Option<&Profile>) -> String {
    let View { declaration, plan, times, .. } = view;
    let merged = plan.steps.iter().filter(|step| step.len() > 1).count();
    let mut facts = vec![
        ("passes that run", format!("{} of {}", plan.order.len(), declaration.passes.len())),
        ("resources", declaration.resources.len().to_string()),
        ("allocated", bytes(plan.memory.allocated_bytes)),
    ];
    if merged > 0 {
        facts.push(("merged render passes", merged.to_string()));
    }
    let total: f64 = plan.order.iter().filter_map(|&pass| times.get(&*declaration.passes.get(pass)?.name)).sum();
    if total > 0.0 {
        facts.push(("GPU time", time(total)));
    }
    if let Some(profile) = profile {
        facts.push(("adapter", profile.adapter.clone()));
        if let Some(last) = profile.frames.last() {
            facts.push(("last planned in", format!("{:.1} µs", last.plan_us)));
        }
    }
    let mut list = String::new();
    for (name, value) in facts {
        let _ = writeln!(list, "<div><dt>{name}</dt><dd>{}</dd></div>", escape(&value));
    }
    format!(
        "<header>\n<p class=brand>Lightloom graph</p>\n<h1>{}</h1>\n<dl class=facts>\n{list}</dl>\n</header>\n",
        escape(&declaration.name)
    )
}

fn timing_note(profile: Option<&Profile>, times: &HashMap<&str, f64>) -> String {
    let text = match profile {
        None => "There are no times: the frame was planned and not run.".to_owned(),
        Some(_) if times.is_empty() => {
            format!("There are no times: {}.", TimingSource::None.describe().trim_start_matches("not measured: "))
        }
        Some(profile) => {
            let frames = profile.frames.len();
            let of = if frames == 1 { "of one frame".to_owned() } else { format!("median of {frames} frames") };
            format!("GPU time per pass, {of}, by {}.", profile.source().describe())
        }
    };
    format!("<p class=note>{}</p>\n", escape(&text))
}

fn legend(plan: &Plan) -> String {
    let memory = &plan.memory;
    let recorded = if memory.peak_live_bytes == memory.ordered_peak_live_bytes {
        String::new()
    } else {
        format!("<span><i class=\"dash recorded\"></i>the same in recorded order ({})</span>", bytes(memory.peak_live_bytes))
    };
    format!(
        "<p class=legend><span><i class=line></i>bytes in use</span><span><i class=dash></i>most in use at once: the lower bound of this order ({})</span>{recorded}</p>\n",
        bytes(memory.ordered_peak_live_bytes)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{PassTime, PlanOptions, plan, show::FrameProfile};

    const FRAME: &str = r#"{"frame": "f <b>",
        "resources": [{"name": "a</script>", "kind": "buffer", "origin": "transient", "bytes": 2048},
                      {"name": "b", "kind": "texture", "origin": "transient", "format": "r32float", "size": [64, 64, 1]},
                      {"name": "out", "kind": "buffer", "origin": "imported", "bytes": 4}],
        "passes": [{"name": "make \"a\"", "kind": "compute", "reads": [], "writes": [{"resource": "a</script>"}]},
                   {"name": "idle", "kind": "raster", "reads": ["a</script>"], "writes": [{"resource": "b"}]},
                   {"name": "use", "kind": "copy", "reads": ["a</script>"], "writes": [{"resource": "out"}]}]}"#;

    fn page(profile: Option<&Profile>) -> String {
        let declaration = Declaration::from_frame_json(FRAME).unwrap();
        to_html(&declaration, &plan(&declaration, &PlanOptions::default()).unwrap(), profile)
    }

    fn profile(gpu_ms: Option<f64>) -> Profile {
        let mut profile = Profile::new("an <adapter>");
        let passes = vec![PassTime { name: "use".into(), gpu_ms }];
        profile.frames = vec![FrameProfile { passes, source: TimingSource::Timestamps, ..FrameProfile::default() }];
        profile
    }

    #[test]
    fn names_cannot_become_markup() {
        let page = page(Some(&profile(Some(1.5))));
        assert!(!page.contains("f <b>") && page.contains("f &lt;b&gt;"), "the frame's name");
        assert!(!page.contains("an <adapter>") && page.contains("an &lt;adapter&gt;"), "the adapter's name");
        assert_eq!(page.matches("</script>").count(), 2, "the data and the script end, and nothing else does");
        assert!(page.contains("make &quot;a&quot;") && !page.contains("pass make \"a\""), "an attribute ends early");
    }

    #[test]
    fn the_page_needs_nothing_beside_it() {
        let page = page(None);
        for outside in ["http:", "https:", "src=", "<link", "@import", "url("] {
            assert!(!page.contains(outside), "the page has `{outside}`");
        }
    }

    #[test]
    fn every_part_is_there() {
        let page = page(Some(&profile(Some(1.5))));
        for part in [
            "id=graph",
            "id=timeline",
            "id=bytes",
            "id=culled",
            "id=resources",
            "which nothing reads",
            "1.50 ms",
            "2.0 KiB",
            "r32float 64×64",
        ] {
            assert!(page.contains(part), "no {part}");
        }
        assert!(page.contains("of one frame, by timestamps around each pass"), "where the times come from");
    }

    #[test]
    fn without_times_the_page_says_so() {
        assert!(page(None).contains("planned and not run"), "no profile");
        assert!(page(Some(&profile(None))).contains("no clock"), "an adapter without a clock");
        assert!(!page(None).contains("class=\"bar k-"), "bars of nothing");
    }

    #[test]
    fn an_empty_frame_is_a_page() {
        let declaration = Declaration::from_frame_json(r#"{"frame": "", "resources": [], "passes": []}"#).unwrap();
        let page = to_html(&declaration, &plan(&declaration, &PlanOptions::default()).unwrap(), None);
        assert!(page.contains("0 of 0") && !page.contains("NaN") && !page.contains("inf"), "{page}");
    }
}
