//! A plan as Graphviz DOT and as JSON.

use crate::{
    declaration::{Declaration, Origin, ResourceKind},
    plan::Plan,
};
use std::fmt::Write as _;

/// The frame as a Graphviz digraph: passes are boxes (dashed: culled), resources ellipses.
pub fn to_dot(declaration: &Declaration, plan: &Plan) -> String {
    let mut dot = format!("digraph {} {{\n  rankdir=LR;\n  node [fontname=\"sans-serif\"];\n", quote(&declaration.name));
    let position: std::collections::HashMap<usize, usize> = plan.order.iter().enumerate().map(|(at, &pass)| (pass, at)).collect();
    for (index, pass) in declaration.passes.iter().enumerate() {
        let (style, note) = match position.get(&index) {
            Some(at) => ("solid", format!("{at}: {}", pass.kind.name())),
            None => ("dashed", format!("culled, {}", pass.kind.name())),
        };
        let tooltip = plan.culled.iter().find(|culled| culled.index == index).map_or("", |culled| culled.reason.as_str());
        let label = quote(&format!("{}\n{note}", pass.name));
        let _ = writeln!(dot, "  p{index} [shape=box, style={style}, label={label}, tooltip={}];", quote(tooltip));
    }
    for (index, resource) in declaration.resources.iter().enumerate() {
        let style = if resource.origin == Origin::Transient { "solid" } else { "bold" };
        let what = match &resource.kind {
            ResourceKind::Texture(desc) => desc.to_string(),
            ResourceKind::Buffer(desc) => desc.to_string(),
        };
        let slot = plan.slot_of.get(index).copied().flatten().map_or_else(String::new, |slot| format!("\nslot {slot}"));
        let label = quote(&format!("{}\n{what}{slot}", resource.name));
        let _ = writeln!(dot, "  r{index} [shape=ellipse, style={style}, label={label}];");
    }
    for (index, pass) in declaration.passes.iter().enumerate() {
        for access in &pass.accesses {
            let label = quote(&access.binding);
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
    serde_json::json!({
        "frame": declaration.name,
        "passes": declaration.passes.len(),
        "resources": declaration.resources.len(),
        "unshared_bytes": memory.unshared_bytes,
        "peak_live_bytes": memory.peak_live_bytes,
        "pooled_bytes": memory.pooled_bytes,
        "placed_bytes": memory.placed_bytes,
        "allocated_bytes": memory.allocated_bytes,
        "live_bytes": plan.live_bytes,
        "culled": culled,
        "order": order,
    })
}
