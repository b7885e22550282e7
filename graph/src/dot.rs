//! A plan as Graphviz DOT and as JSON.

use crate::{
    declaration::{Access, Declaration, Origin, PassDecl},
    plan::{Plan, SlotKind},
};
use std::fmt::Write as _;

/// The frame as a Graphviz digraph: passes are boxes (dashed: culled; framed together: one render pass), resources ellipses.
pub fn to_dot(declaration: &Declaration, plan: &Plan) -> String {
    let mut dot = format!("digraph {} {{\n  rankdir=LR;\n  node [fontname=\"sans-serif\"];\n", quote(&declaration.name));
    let position: std::collections::HashMap<usize, usize> = plan.order.iter().enumerate().map(|(at, &pass)| (pass, at)).collect();
    for (index, pass) in declaration.passes.iter().enumerate() {
        let (style, note) = match position.get(&index) {
            Some(at) => ("solid", format!("{at}: {}", marks(pass))),
            None => ("dashed", format!("culled, {}", marks(pass))),
        };
        let tooltip = plan.culled.iter().find(|culled| culled.index == index).map_or("", |culled| culled.reason.as_str());
        let label = quote(&format!("{}\n{note}", pass.name));
        let _ = writeln!(dot, "  p{index} [shape=box, style={style}, label={label}, tooltip={}];", quote(tooltip));
    }
    for (index, resource) in declaration.resources.iter().enumerate() {
        let style = if resource.origin == Origin::Transient { "solid" } else { "bold" };
        let what = &resource.kind;
        let slot = place(plan, index).map_or_else(String::new, |(slot, kind, offset)| format!("\n{kind} {slot} at {offset}"));
        let label = quote(&format!("{}\n{what}{slot}", resource.name));
        let _ = writeln!(dot, "  r{index} [shape=ellipse, style={style}, label={label}];");
    }
    for (index, step) in plan.steps.iter().enumerate().filter(|(_, step)| step.len() > 1) {
        let passes = plan.order.get(step.clone()).unwrap_or_default();
        let passes = passes.iter().fold(String::new(), |text, pass| text + " p" + &pass.to_string() + ";");
        let _ = writeln!(dot, "  subgraph cluster_{index} {{ label=\"one render pass\"; style=rounded;{passes} }}");
    }
    for (index, pass) in declaration.passes.iter().enumerate() {
        for access in &pass.accesses {
            let label = quote(&label(access));
            if access.read || !access.writes() {
                let _ = writeln!(dot, "  r{} -> p{index} [label={label}];", access.resource);
            }
            if access.writes() {
                let _ = writeln!(dot, "  p{index} -> r{} [label={label}];", access.resource);
            }
        }
    }
    dot.push_str("}\n");
    dot
}

/// The pass's kind and what the planner must respect.
fn marks(pass: &PassDecl) -> String {
    let flags = [("", true), (", heavy", pass.heavy), (", side effect", pass.side_effect), (", pinned", pass.pinned)];
    flags.into_iter().filter(|(_, set)| *set).fold(pass.kind.name().to_owned(), |text, (mark, _)| text + mark)
}

/// The binding, and the part of the texture where it is not all.
fn label(access: &Access) -> String {
    if access.part.is_all() { access.binding.to_string() } else { format!("{}\n{}", access.binding, access.part) }
}

/// A resource's slot, what the slot is, and the offset in it.
fn place(plan: &Plan, resource: usize) -> Option<(usize, &'static str, u64)> {
    let slot = plan.slot_of.get(resource).copied().flatten()?;
    let offset = plan.offsets.get(resource).copied().flatten().unwrap_or(0);
    Some((slot, plan.slots.get(slot)?.kind.name(), offset))
}

fn quote(text: &str) -> String {
    let escaped = text.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n");
    format!("\"{escaped}\"")
}

/// The plan as JSON: counts, bytes, culled passes with reasons, and the names of the passes in order.
pub fn to_json(declaration: &Declaration, plan: &Plan) -> serde_json::Value {
    let memory = &plan.memory;
    let order: Vec<&str> = plan.order.iter().filter_map(|&pass| declaration.passes.get(pass)).map(|pass| &*pass.name).collect();
    let culled: Vec<serde_json::Value> =
        plan.culled.iter().map(|culled| serde_json::json!({ "pass": culled.pass, "reason": culled.reason })).collect();
    let names = |positions: &std::ops::Range<usize>| -> Vec<&str> { order.get(positions.clone()).unwrap_or_default().to_vec() };
    let merged: Vec<Vec<&str>> = plan.steps.iter().filter(|step| step.len() > 1).map(names).collect();
    let pinned: Vec<&str> = declaration.passes.iter().filter(|pass| pass.pinned).map(|pass| &*pass.name).collect();
    let slots: Vec<serde_json::Value> = plan
        .slots
        .iter()
        .map(|slot| {
            let held: Vec<serde_json::Value> = slot
                .resources
                .iter()
                .filter_map(|&resource| {
                    let name = &declaration.resources.get(resource)?.name;
                    Some(serde_json::json!({ "resource": name, "offset": plan.offsets.get(resource).copied().flatten() }))
                })
                .collect();
            serde_json::json!({ "kind": slot.kind, "bytes": slot.bytes, "resources": held })
        })
        .collect();
    let kinds = [SlotKind::Object, SlotKind::Arena, SlotKind::Heap].map(|kind| {
        let of_kind = plan.slots.iter().filter(|slot| slot.kind == kind);
        let (count, bytes) = of_kind.fold((0_u64, 0_u64), |(count, bytes), slot| (count + 1, bytes.saturating_add(slot.bytes)));
        (kind.name(), serde_json::json!({ "count": count, "bytes": bytes }))
    });
    let parts: Vec<serde_json::Value> = declaration
        .passes
        .iter()
        .flat_map(|pass| pass.accesses.iter().filter(|access| !access.part.is_all()).map(move |access| (pass, access)))
        .filter_map(|(pass, access)| {
            let resource = &declaration.resources.get(access.resource)?.name;
            Some(serde_json::json!({
                "pass": pass.name, "resource": resource, "binding": access.binding, "part": access.part.to_string(),
            }))
        })
        .collect();
    serde_json::json!({
        "frame": declaration.name,
        "passes": declaration.passes.len(),
        "resources": declaration.resources.len(),
        "unshared_bytes": memory.unshared_bytes,
        "peak_live_bytes": memory.peak_live_bytes,
        "ordered_peak_live_bytes": memory.ordered_peak_live_bytes,
        "pooled_bytes": memory.pooled_bytes,
        "placed_bytes": memory.placed_bytes,
        "allocated_bytes": memory.allocated_bytes,
        "live_bytes": plan.live_bytes,
        "culled": culled,
        "order": order,
        "merged": merged,
        "pinned": pinned,
        "parts": parts,
        "slots": slots,
        "slot_kinds": serde_json::Map::from_iter(kinds.map(|(kind, sum)| (kind.to_owned(), sum))),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{PlanOptions, Subresources, plan};

    #[test]
    fn parts_steps_slots_and_pins_are_told() {
        let frame = r#"{"frame": "f",
            "resources": [{"name": "a", "kind": "texture", "origin": "transient", "format": "r32float", "size": [4, 4, 1], "mips": 2},
                          {"name": "out", "kind": "buffer", "origin": "imported", "bytes": 4}],
            "passes": [{"name": "make", "kind": "raster", "writes": [{"resource": "a"}]},
                       {"name": "more", "kind": "raster", "writes": [{"resource": "a", "preserve": true}]},
                       {"name": "use", "kind": "compute", "reads": ["a"], "writes": [{"resource": "out"}]}]}"#;
        let mut declaration = Declaration::from_frame_json(frame).unwrap();
        declaration.passes[2].accesses[0].part = Subresources::mip(0);
        declaration.passes[2].pinned = true;
        let mut plan = plan(&declaration, &PlanOptions::default()).unwrap();
        plan.steps = vec![0..2, 2..3];
        let json = to_json(&declaration, &plan);
        assert_eq!(json["merged"], serde_json::json!([["make", "more"]]));
        assert_eq!(json["pinned"], serde_json::json!(["use"]));
        assert_eq!(json["parts"][0]["part"], "mip 0");
        assert_eq!(json["slots"][0]["resources"][0], serde_json::json!({ "resource": "a", "offset": 0 }));
        assert_eq!(json["slot_kinds"]["object"], serde_json::json!({ "count": 1, "bytes": 80 }));
        assert_eq!(json["ordered_peak_live_bytes"], 80);
        let dot = to_dot(&declaration, &plan);
        for part in ["label=\"one render pass\"; style=rounded; p0; p1;", "reads\\nmip 0", "compute, pinned", "object 0 at 0"] {
            assert!(dot.contains(part), "no {part} in {dot}");
        }
    }
}
