//! `report.html`: a comparison as one page that needs nothing beside it.
//!
//! Style, script and images are inline, so the file can be moved and sent. Without scripts everything but the slider
//! still shows.

mod charts;
mod error_map;
mod tables;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use std::fmt::Write as _;

use crate::results::Results;
pub(crate) use error_map::error_map_rgb8;

const STYLE: &str = include_str!("report.css");
const SCRIPT: &str = include_str!("report.js");

/// An image of the report.
#[derive(Debug)]
pub(crate) struct Figure {
    /// What it is called: a strategy's name, or `reference`.
    pub(crate) name: String,
    /// The PNG file.
    pub(crate) png: Vec<u8>,
}

/// The page. `images` are tone-mapped with one exposure, the reference first where there is one; `errors` are the error
/// maps of the strategies.
pub(crate) fn html(results: &Results, images: &[Figure], errors: &[Figure]) -> String {
    let title = format!("{} · Lightloom comparison", escape(&results.scene));
    let mut body = header(results);
    body.push_str(&warnings(results));
    body.push_str(&section("Strategies", &tables::strategies(results)));
    body.push_str(&section("Images", &slider(results, images)));
    if !errors.is_empty() {
        let caption = format!("<p class=note>{}</p>", error_map::LEGEND_TEXT);
        let content = format!("{caption}{}{}", error_map::legend(), gallery(errors, "error"));
        body.push_str(&section("Error maps", &content));
    }
    body.push_str(&section("Time per pass", &charts::times(results)));
    body.push_str(&section("Memory", &charts::memory(results)));
    format!(
        "<!doctype html>\n<html lang=en>\n<head>\n<meta charset=utf-8>\n\
         <meta name=viewport content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n{body}</main>\n\
         <script>\n{SCRIPT}</script>\n</body>\n</html>\n"
    )
}

/// Text with the characters that mean something in HTML written out.
pub(crate) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            c => escaped.push(c),
        }
    }
    escaped
}

fn section(title: &str, content: &str) -> String {
    format!("<section>\n<h2>{title}</h2>\n{content}</section>\n")
}

fn header(results: &Results) -> String {
    let settings = &results.settings;
    let mut facts = vec![
        ("adapter", results.adapter.clone()),
        ("rays", results.trace.clone()),
        ("size", format!("{} × {}", results.size[0], results.size[1])),
        ("layer", settings.layer.clone()),
        ("camera", settings.camera.clone()),
        ("photons", crate::format::count(settings.photons.into())),
        ("bounces", settings.bounces.to_string()),
        ("frames", settings.frames.to_string()),
        ("seed", settings.seed.to_string()),
        ("emission", settings.emission.clone()),
        ("first hits", settings.first_hit.clone()),
        ("photon store", settings.photon_store.clone()),
        ("materials", settings.materials.clone()),
        ("filter", settings.filter.clone()),
    ];
    if let Some(radius) = settings.ambient_occlusion {
        facts.push(("ambient occlusion", format!("{radius} m")));
    }
    if let Some(radius) = settings.radius {
        facts.push(("radius", format!("{radius} m")));
    }
    if let Some(reference) = &results.reference {
        let samples = reference.samples.map(|n| format!(", {n} paths per pixel"));
        facts.push(("reference", format!("{}{}", reference.name, samples.unwrap_or_default())));
    }
    let mut list = String::new();
    for (name, value) in facts {
        let _ = writeln!(list, "<div><dt>{name}</dt><dd>{}</dd></div>", escape(&value));
    }
    format!(
        "<header>\n<p class=brand>Lightloom</p>\n<h1>{}</h1>\n<dl class=facts>\n{list}</dl>\n</header>\n",
        escape(&results.scene)
    )
}

fn warnings(results: &Results) -> String {
    if results.warnings.is_empty() {
        return String::new();
    }
    let item = |warning: &String| format!("<li>{}</li>\n", escape(warning));
    let items: String = results.warnings.iter().map(item).collect();
    format!("<aside class=warnings>\n<strong>Before trusting the numbers</strong>\n<ul>\n{items}</ul>\n</aside>\n")
}

/// The A/B slider, its choosers, and below it all images; the script copies the images from there.
fn slider(results: &Results, images: &[Figure]) -> String {
    let options = |chosen: usize| -> String {
        let option = |(i, figure): (usize, &Figure)| {
            let selected = if i == chosen { " selected" } else { "" };
            format!("<option value={i}{selected}>{}</option>", escape(&figure.name))
        };
        images.iter().enumerate().map(option).collect()
    };
    let last = images.len().saturating_sub(1);
    let slider = format!(
        "<div class=slider hidden>\n<div class=choosers>\n<label>Left <select class=left>{}</select></label>\n\
         <label>Right <select class=right>{}</select></label>\n</div>\n\
         <div class=stage style=\"aspect-ratio:{}/{}\">\n<img class=under alt=\"right image\"><img class=over alt=\"left image\">\n\
         <span class=handle></span>\n\
         <input type=range min=0 max=100 value=50 step=0.1 aria-label=\"where the left image ends\">\n</div>\n</div>\n",
        options(0),
        options(last.min(1)),
        results.size[0].max(1),
        results.size[1].max(1),
    );
    let exposure = format!(
        "<p class=note>All images share one exposure, {} × radiance, and one tone curve.</p>\n",
        crate::format::number(Some(results.settings.exposure.into()))
    );
    format!("{slider}{exposure}{}", gallery(images, "image"))
}

fn gallery(figures: &[Figure], class: &str) -> String {
    let figure = |figure: &Figure| {
        format!(
            "<figure><img class={class} alt=\"{name}\" src=\"data:image/png;base64,{data}\"><figcaption>{name}</figcaption></figure>\n",
            name = escape(&figure.name),
            data = STANDARD.encode(&figure.png),
        )
    };
    let figures: String = figures.iter().map(figure).collect();
    format!("<div class=gallery>\n{figures}</div>\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::{PassTime, Reference, StrategyResult};

    fn example() -> Results {
        let row = |name: &str, ms: f64| StrategyResult {
            name: name.to_owned(),
            gpu_ms: Some(ms),
            passes: vec![PassTime { name: "gather".to_owned(), gpu_ms: Some(ms) }],
            relmse: Some(0.01),
            ..StrategyResult::default()
        };
        Results {
            scene: "a<b>.glb".to_owned(),
            size: [2, 1],
            strategies: vec![row("tiled", 1.5), row("exact", 30.0)],
            reference: Some(Reference { name: "path".to_owned(), samples: Some(8), wall_ms: None }),
            warnings: vec!["\"x\" & y".to_owned()],
            ..Results::default()
        }
    }

    #[test]
    fn the_page_stands_alone_and_is_escaped() {
        let figure = |name: &str| Figure { name: name.to_owned(), png: vec![1, 2, 3] };
        let page = html(&example(), &[figure("reference"), figure("tiled")], &[figure("tiled")]);
        assert!(!page.contains("http://") && !page.contains("https://"), "refers to the network");
        let sources: Vec<&str> = page.split("src=\"").skip(1).collect();
        assert_eq!(sources.len(), 3);
        assert!(sources.iter().all(|s| s.starts_with("data:image/png;base64,AQID\"")), "an outside image");
        assert!(page.contains("a&lt;b&gt;.glb") && !page.contains("a<b>"), "not escaped");
        assert!(page.contains("&quot;x&quot; &amp; y"), "the warning is missing");
        for part in ["Strategies", "Images", "Error maps", "Time per pass", "Memory"] {
            assert!(page.contains(&format!("<h2>{part}</h2>")), "no section {part}");
        }
    }

    #[test]
    fn a_page_without_reference_has_no_error_maps() {
        let mut results = example();
        results.reference = None;
        let page = html(&results, &[Figure { name: "tiled".to_owned(), png: vec![] }], &[]);
        assert!(!page.contains("Error maps"), "error maps without a reference");
    }
}
