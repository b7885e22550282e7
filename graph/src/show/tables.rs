//! Tables and bars of the page.

use super::{
    dag,
    html::View,
    text::{bytes, escape},
};
use crate::{
    declaration::{Origin, ResourceDecl},
    plan::{Plan, SlotKind},
};
use std::fmt::Write as _;

/// The ways of placing as bars, and what this plan takes.
pub(super) fn memory_bars(plan: &Plan) -> String {
    let memory = &plan.memory;
    let rows = [
        ("unshared", "unshared", memory.unshared_bytes, "each resource has memory of its own"),
        ("pooled", "pooled", memory.pooled_bytes, "objects with merged descriptions, arenas for buffers"),
        ("placed", "placed", memory.placed_bytes, "at offsets of shared memory"),
        ("allocated", "allocated", memory.allocated_bytes, "what this plan takes"),
        ("live, recorded order", "live", memory.peak_live_bytes, "the most in use at once, as recorded"),
        ("live, planned order", "live", memory.ordered_peak_live_bytes, "the most in use at once: the lower bound"),
    ];
    let most = rows.iter().map(|row| row.2).max().unwrap_or(0).max(1) as f64;
    let mut html = "<div class=bars>\n".to_owned();
    for (name, class, value, note) in rows {
        let percent = 100.0 * value as f64 / most;
        let _ = writeln!(
            html,
            "<div class=bar-row title=\"{note}\"><span>{name}</span><i><b class={class} style=\"width:{percent:.2}%\"></b></i><em>{}</em></div>",
            bytes(value)
        );
    }
    html.push_str("</div>\n");
    let slots = &plan.slots;
    let kinds = [SlotKind::Object, SlotKind::Arena, SlotKind::Heap].map(|kind| {
        let of_kind = slots.iter().filter(|slot| slot.kind == kind);
        let (count, total) = of_kind.fold((0_usize, 0_u64), |(count, total), slot| (count + 1, total.saturating_add(slot.bytes)));
        let s = if count == 1 { "" } else { "s" };
        (count > 0).then(|| format!("{count} {}{s} ({})", kind.name(), bytes(total)))
    });
    let kinds: Vec<String> = kinds.into_iter().flatten().collect();
    if !kinds.is_empty() {
        let _ = writeln!(html, "<p class=note>This plan takes {}.</p>", kinds.join(", "));
    }
    html
}

/// Culled passes and why.
pub(super) fn culled_table(view: &View<'_>) -> String {
    let mut rows = String::new();
    for culled in &view.plan.culled {
        let _ = writeln!(
            rows,
            "<tr data-p={} tabindex=-1><th scope=row>{}</th><td class=wide>{}</td></tr>",
            culled.index,
            escape(&culled.pass),
            escape(&culled.reason)
        );
    }
    table(&["pass", "why"], &rows)
}

/// All resources and where they lie.
pub(super) fn resource_table(view: &View<'_>) -> String {
    let mut rows = String::new();
    for (index, resource) in view.declaration.resources.iter().enumerate() {
        let place = place(view.plan, index);
        let lifetime = view.plan.lifetimes.get(index).copied().flatten();
        let life = lifetime.map_or_else(|| "not used".to_owned(), |life| format!("{}–{}", life.first, life.last));
        let _ = writeln!(
            rows,
            "<tr data-r={index} tabindex=-1><th scope=row><i class=\"chip c{}\"></i>{}</th><td>{}</td><td>{}</td><td>{}</td><td>{life}</td><td>{}</td><td>{}</td></tr>",
            index % dag::COLOURS,
            escape(&resource.name),
            escape(&describe(resource)),
            origin(resource),
            if resource.bytes == 0 { "–".to_owned() } else { bytes(resource.bytes) },
            place.as_ref().map_or("–", |place| place.0.as_str()),
            place.as_ref().map_or_else(|| "–".to_owned(), |place| place.1.to_string()),
        );
    }
    table(&["name", "description", "origin", "bytes", "passes", "slot", "offset"], &rows)
}

fn table(heads: &[&str], rows: &str) -> String {
    let heads = heads.iter().fold(String::new(), |row, head| row + "<th scope=col>" + head + "</th>");
    format!(
        "<div class=\"scroll rows\" tabindex=0><table>\n<thead><tr>{heads}</tr></thead>\n<tbody>\n{rows}</tbody>\n</table></div>\n"
    )
}

pub(super) fn describe(resource: &ResourceDecl) -> String {
    resource.kind.to_string()
}

pub(super) fn origin(resource: &ResourceDecl) -> &'static str {
    match resource.origin {
        Origin::Transient if resource.keep => "transient, kept",
        Origin::Transient => "transient",
        Origin::Imported => "imported",
        Origin::Persistent => "persistent",
        Origin::Previous => "previous",
        Origin::Current => "current",
    }
}

/// Slot in words, and offset.
pub(super) fn place(plan: &Plan, resource: usize) -> Option<(String, u64)> {
    let slot = plan.slot_of.get(resource).copied().flatten()?;
    let kind = plan.slots.get(slot).map_or("slot", |slot| slot.kind.name());
    Some((format!("{slot}, {kind}"), plan.offsets.get(resource).copied().flatten().unwrap_or(0)))
}
