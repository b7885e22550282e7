//! GPU time and memory over the passes, on one axis: the position in the plan's order.
//!
//! ```text
//!   ms      ▂ ▇ ▁ ▃          a bar per pass
//!   ─────────────────
//!   slot 1  [ a   ][ c ]     a rectangle per transient resource: its life × its place in its slot;
//!   slot 0  [ b ]    [d]     slots stand on one another, and lines show the bytes in use and the least there can be
//! ```

use super::{
    dag::COLOURS,
    text::{bytes, escape, round_up, shorten, time},
};
use crate::{
    declaration::{Declaration, Origin},
    plan::Plan,
};
use std::collections::HashMap;
use std::fmt::Write as _;

/// Wanted width of the chart (px), and the least and most of a position.
const WIDTH: f32 = 800.0;
const NARROWEST: f32 = 1.0;
const WIDEST: f32 = 90.0;
/// Heights (px).
const TIME: f32 = 110.0;
const BETWEEN: f32 = 26.0;
const MEMORY: f32 = 340.0;
/// Columns from this width on have the pass's name below (px), of so many letters of this height at most.
const NAMED: f32 = 11.0;
const LETTERS: usize = 24;
const LETTER: f32 = 6.3;
/// Width of the axes (px).
const AXIS: f32 = 74.0;
/// Above the topmost mark (px).
const TOP: f32 = 10.0;

/// The scales of the chart.
struct Scales {
    column: f32,
    columns: usize,
    /// Largest value of the time axis (ms); 0 without times.
    most_ms: f64,
    /// Largest value of the memory axis (bytes).
    most_bytes: f64,
    /// Height of the names below (px), where there is room for them.
    names: Option<f32>,
}

impl Scales {
    fn x(&self, position: usize) -> f32 {
        position as f32 * self.column
    }

    fn memory_top(&self) -> f32 {
        if self.most_ms > 0.0 { TOP + TIME + BETWEEN } else { TOP }
    }

    fn y_time(&self, ms: f64) -> f32 {
        TOP + TIME * (1.0 - (ms / self.most_ms) as f32)
    }

    fn y_bytes(&self, bytes: f64) -> f32 {
        self.memory_top() + MEMORY * (1.0 - (bytes / self.most_bytes) as f32)
    }

    fn width(&self) -> f32 {
        self.x(self.columns)
    }

    fn height(&self) -> f32 {
        self.memory_top() + MEMORY + self.names.unwrap_or(22.0)
    }
}

/// The chart; `times` by name (ms), empty where nothing was timed.
pub(super) fn timeline(declaration: &Declaration, plan: &Plan, times: &HashMap<&str, f64>) -> String {
    let memory = &plan.memory;
    let time_of = |pass: usize| declaration.passes.get(pass).and_then(|pass| times.get(&*pass.name)).copied();
    let longest = plan.order.iter().filter_map(|&pass| time_of(pass)).fold(0.0, f64::max);
    let stacked: u64 = plan.slots.iter().map(|slot| slot.bytes).sum();
    let most = stacked.max(memory.peak_live_bytes).max(memory.ordered_peak_live_bytes);
    let columns = plan.order.len().max(1);
    let column = (WIDTH / columns as f32).clamp(NARROWEST, WIDEST).max(if columns <= 120 { 13.0 } else { 0.0 });
    let scales = Scales {
        column,
        columns,
        most_ms: if longest > 0.0 { round_up(longest) } else { 0.0 },
        most_bytes: (most as f64 * 1.03).max(1.0),
        names: (column >= NAMED).then(|| names_height(declaration, plan)),
    };
    let mut svg = String::new();
    bars(&mut svg, declaration, plan, &scales, &time_of);
    slots(&mut svg, plan, &scales);
    blocks(&mut svg, declaration, plan, &scales);
    bounds(&mut svg, plan, &scales);
    feet(&mut svg, declaration, plan, &scales);
    let (width, height) = (scales.width() + 8.0, scales.height());
    format!(
        "<div class=chart>\n{}<div class=\"scroll plot\" tabindex=0><svg class=timeline width={width:.0} height={height:.0} viewBox=\"0 0 {width:.0} {height:.0}\" role=group aria-label=\"GPU time and memory over the passes\">\n{svg}</svg></div>\n</div>\n",
        axes(&scales)
    )
}

fn axes(scales: &Scales) -> String {
    let height = scales.height();
    let mut svg = format!("<svg class=axes width={AXIS:.0} height={height:.0} aria-hidden=true>\n");
    let mut mark = |y: f32, text: &str| {
        let _ = writeln!(svg, "<text x={:.1} y={:.1}>{text}</text>", AXIS - 6.0, y + 3.5);
    };
    if scales.most_ms > 0.0 {
        for part in [0.0, 0.5, 1.0] {
            mark(scales.y_time(scales.most_ms * part), &if part == 0.0 { "0".to_owned() } else { time(scales.most_ms * part) });
        }
    }
    let step = memory_step(scales.most_bytes);
    let mut at = 0.0;
    while at <= scales.most_bytes {
        mark(scales.y_bytes(at), &if at == 0.0 { "0".to_owned() } else { bytes(at as u64) });
        at += step;
    }
    svg.push_str("</svg>");
    svg
}

fn names_height(declaration: &Declaration, plan: &Plan) -> f32 {
    let letters = plan.order.iter().filter_map(|&pass| declaration.passes.get(pass)).map(|pass| pass.name.chars().count());
    letters.max().unwrap_or(0).min(LETTERS) as f32 * LETTER + 14.0
}

/// A power of two that gives four to eight marks.
fn memory_step(most: f64) -> f64 {
    let mut step = 1.0;
    while most / step > 8.0 {
        step *= 2.0;
    }
    step
}

fn bars(svg: &mut String, declaration: &Declaration, plan: &Plan, scales: &Scales, time_of: &dyn Fn(usize) -> Option<f64>) {
    if scales.most_ms <= 0.0 {
        return;
    }
    for part in [0.0, 0.5, 1.0] {
        let y = scales.y_time(scales.most_ms * part);
        let _ = writeln!(svg, "<path class=grid d=\"M0 {y:.1}h{:.1}\"/>", scales.width());
    }
    for (position, &pass) in plan.order.iter().enumerate() {
        let (Some(ms), Some(decl)) = (time_of(pass), declaration.passes.get(pass)) else { continue };
        let gap = if scales.column > 4.0 { 1.0 } else { 0.0 };
        let y = scales.y_time(ms);
        let _ = writeln!(
            svg,
            "<rect class=\"bar k-{}\" data-p={pass} x={:.1} y={y:.1} width={:.1} height={:.1}><title>{}: {}</title></rect>",
            decl.kind.name(),
            scales.x(position) + gap / 2.0,
            scales.column - gap,
            (TOP + TIME - y).max(0.5),
            escape(&decl.name),
            time(ms),
        );
    }
}

fn slots(svg: &mut String, plan: &Plan, scales: &Scales) {
    let mut base = 0_u64;
    for (index, slot) in plan.slots.iter().enumerate() {
        let top = scales.y_bytes(base.saturating_add(slot.bytes) as f64);
        let height = scales.y_bytes(base as f64) - top;
        let even = if index % 2 == 0 { "" } else { " odd" };
        let _ = writeln!(
            svg,
            "<rect class=\"slot{even}\" x=0 y={top:.2} width={:.1} height={height:.2}><title>slot {index}: {}, {}</title></rect>",
            scales.width(),
            slot.kind.name(),
            bytes(slot.bytes),
        );
        base = base.saturating_add(slot.bytes);
    }
}

fn blocks(svg: &mut String, declaration: &Declaration, plan: &Plan, scales: &Scales) {
    let mut bases = Vec::with_capacity(plan.slots.len());
    let mut base = 0_u64;
    for slot in &plan.slots {
        bases.push(base);
        base = base.saturating_add(slot.bytes);
    }
    for (index, resource) in declaration.resources.iter().enumerate() {
        let slot = plan.slot_of.get(index).copied().flatten();
        let lifetime = plan.lifetimes.get(index).copied().flatten();
        let offset = plan.offsets.get(index).copied().flatten().unwrap_or(0);
        let (Some(slot), Some(lifetime), Origin::Transient) = (slot, lifetime, resource.origin) else { continue };
        let low = bases.get(slot).copied().unwrap_or(0).saturating_add(offset);
        let top = scales.y_bytes(low.saturating_add(resource.bytes) as f64);
        let height = (scales.y_bytes(low as f64) - top).max(0.75);
        let (x, width) = (scales.x(lifetime.first), scales.x(lifetime.last + 1) - scales.x(lifetime.first));
        let name = escape(&resource.name);
        let facts = format!("{}, passes {} to {}, slot {slot} at {offset}", bytes(resource.bytes), lifetime.first, lifetime.last);
        let _ = write!(
            svg,
            "<g class=\"block c{}\" data-r={index} tabindex=-1 role=button aria-label=\"resource {name}, {facts}\"><title>{name}: {facts}</title><rect x={x:.1} y={top:.2} width={width:.1} height={height:.2} />",
            index % COLOURS,
        );
        let letters = ((width - 8.0) / 5.9).max(0.0) as usize;
        if height >= 11.0 && letters >= 4 {
            let text = escape(&shorten(&resource.name, letters));
            let _ = write!(svg, "<text x={:.1} y={:.1}>{text}</text>", x + 4.0, top + (height / 2.0).min(14.0) + 3.5);
        }
        svg.push_str("</g>\n");
    }
}

fn bounds(svg: &mut String, plan: &Plan, scales: &Scales) {
    let mut path = String::new();
    for (position, &live) in plan.live_bytes.iter().enumerate() {
        let y = scales.y_bytes(live as f64);
        let (from, to) = (scales.x(position), scales.x(position + 1));
        let _ = write!(path, "{}{from:.1} {y:.1}H{to:.1}", if position == 0 { "M" } else { "L" });
    }
    let _ = writeln!(svg, "<path class=\"live halo\" d=\"{path}\"/><path class=live d=\"{path}\"/>");
    let memory = &plan.memory;
    let mut line = |class: &str, value: u64| {
        let y = scales.y_bytes(value as f64);
        let _ = writeln!(svg, "<path class=\"{class}\" d=\"M0 {y:.1}H{:.1}\"/>", scales.width());
    };
    if memory.peak_live_bytes != memory.ordered_peak_live_bytes {
        line("bound recorded", memory.peak_live_bytes);
    }
    line("bound", memory.ordered_peak_live_bytes);
}

fn feet(svg: &mut String, declaration: &Declaration, plan: &Plan, scales: &Scales) {
    let y = scales.memory_top() + MEMORY;
    let _ = writeln!(svg, "<path class=grid d=\"M0 {y:.1}h{:.1}\"/>", scales.width());
    if scales.names.is_some() {
        for (position, decl) in plan.order.iter().enumerate().filter_map(|(at, &pass)| Some((at, declaration.passes.get(pass)?)))
        {
            let x = scales.x(position) + scales.column / 2.0 + 3.5;
            let _ = writeln!(
                svg,
                "<text class=foot data-p={} transform=\"translate({x:.1} {:.1}) rotate(-90)\">{}</text>",
                plan.order[position],
                y + 6.0,
                escape(&shorten(&decl.name, LETTERS)),
            );
        }
        return;
    }
    let every = round_up(f64::from(60.0 / scales.column)) as usize;
    for position in (0..scales.columns).step_by(every.max(1)) {
        let _ = writeln!(svg, "<text class=tick x={:.1} y={:.1}>{position}</text>", scales.x(position), y + 15.0);
    }
}
