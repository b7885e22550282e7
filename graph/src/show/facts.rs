//! What the page's script knows of passes and resources.

use super::{
    html::View,
    tables::{describe, origin, place},
    text::{bytes, time},
};
use crate::declaration::{Access, PassDecl, Write, rust_place};
use serde_json::{Value, json};

/// What the script needs, as JSON that is safe inside a script element.
pub(super) fn data(view: &View<'_>) -> String {
    let View { declaration, plan, times, position } = view;
    let access = |access: &Access| {
        let how = match access.write {
            Write::No => "reads",
            _ if access.read => "reads and writes",
            Write::Keep => "adds to",
            Write::Overwrite => "writes",
        };
        let part = if access.part.is_all() { String::new() } else { access.part.to_string() };
        json!({ "r": access.resource, "how": how, "as": access.binding, "part": part, "in": access.read || !access.writes(), "out": access.writes() })
    };
    let passes: Vec<Value> = declaration
        .passes
        .iter()
        .enumerate()
        .map(|(index, pass)| {
            let at = position.get(&index);
            let step = at.and_then(|at| plan.steps.iter().find(|step| step.contains(at))).filter(|step| step.len() > 1);
            json!({
                "name": pass.name,
                "kind": pass.kind.name(),
                "at": at,
                "time": times.get(&*pass.name).filter(|_| at.is_some()).map(|ms| time(*ms)),
                "live": at.and_then(|at| plan.live_bytes.get(*at)).map(|live| bytes(*live)),
                "why": plan.culled.iter().find(|culled| culled.index == index).map(|culled| &culled.reason),
                "place": rust_place(pass.place.0),
                "marks": marks(pass, step.map(std::ops::Range::len)),
                "uses": pass.accesses.iter().map(access).collect::<Vec<Value>>(),
            })
        })
        .collect();
    let resources: Vec<Value> = declaration
        .resources
        .iter()
        .enumerate()
        .map(|(index, resource)| {
            let place = place(plan, index);
            let life = plan.lifetimes.get(index).copied().flatten();
            json!({
                "name": resource.name,
                "what": describe(resource),
                "origin": origin(resource),
                "bytes": (resource.bytes > 0).then(|| bytes(resource.bytes)),
                "life": life.map(|life| format!("{} to {}", life.first, life.last)),
                "slot": place.as_ref().map(|place| format!("{} at {}", place.0, place.1)),
                "place": rust_place(resource.place.0),
            })
        })
        .collect();
    // `<` begins tags, and `</script>` in a name would end the element.
    json!({ "passes": passes, "resources": resources }).to_string().replace('<', "\\u003c")
}

fn marks(pass: &PassDecl, merged: Option<usize>) -> Vec<String> {
    let flags = [("heavy", pass.heavy), ("side effect", pass.side_effect), ("pinned", pass.pinned)];
    let mut marks: Vec<String> = flags.into_iter().filter(|(_, set)| *set).map(|(name, _)| name.to_owned()).collect();
    marks.extend(merged.map(|count| format!("one render pass of {count}")));
    marks
}
