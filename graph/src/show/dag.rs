//! The graph of passes as SVG: boxes with what they write, and a line for each reader.

use super::{
    flow::{Flow, boxes},
    layers::{Layout, Net, Size, layout},
    text::{escape, shorten, time},
};
use crate::{declaration::Declaration, plan::Plan};
use std::collections::HashMap;
use std::fmt::Write as _;

/// Frames of more passes have no drawing: nobody could follow it, and browsers would not keep up.
const MOST_PASSES: usize = 2000;
/// Rows of written resources in a box; the rest is counted.
const MOST_ROWS: usize = 6;
/// Heights of a box's parts (px).
const TITLE: f32 = 38.0;
const ROW: f32 = 13.0;
const FOOT: f32 = 7.0;
/// Head and border of a group of passes that run as one (px).
const GROUP_HEAD: f32 = 20.0;
const GROUP_EDGE: f32 = 8.0;
/// Widths of letters (px), a little more than the average of the fonts that browsers take for `system-ui`.
const TITLE_LETTER: f32 = 7.6;
const ROW_LETTER: f32 = 6.2;
/// Colours of resources in the style sheet.
pub(super) const COLOURS: usize = 10;

/// A pass's part of a box.
struct Card {
    pass: usize,
    /// Resources it writes, each once.
    writes: Vec<usize>,
    /// Position, kind and time.
    facts: String,
    size: Size,
}

/// The drawing, or a sentence where there is none.
pub(super) fn dag(declaration: &Declaration, plan: &Plan, flows: &[Flow], times: &HashMap<&str, f64>) -> String {
    if declaration.passes.len() > MOST_PASSES {
        return format!("<p class=note>Not drawn: more than {MOST_PASSES} passes.</p>\n");
    }
    let position: HashMap<usize, usize> = plan.order.iter().enumerate().map(|(at, &pass)| (pass, at)).collect();
    let groups: Vec<Vec<Card>> = boxes(declaration, plan)
        .into_iter()
        .map(|passes| passes.into_iter().map(|pass| card(declaration, pass, position.get(&pass).copied(), times)).collect())
        .collect();
    let mut box_of = vec![None; declaration.passes.len()];
    for (index, cards) in groups.iter().enumerate() {
        for card in cards {
            box_of[card.pass] = Some(index);
        }
    }
    let sizes: Vec<Size> = groups.iter().map(|cards| group_size(cards)).collect();
    let (nets, readers) = nets(&groups, &sizes, flows, &box_of);
    let layout = layout(&sizes, &nets);
    let (width, height) = (layout.size.width.max(1.0), layout.size.height.max(1.0));
    let mut svg = format!(
        "<svg class=dag width={width:.0} height={height:.0} viewBox=\"0 0 {width:.0} {height:.0}\" role=group aria-label=\"passes and what flows between them\">\n<g class=lines>\n"
    );
    lines(&mut svg, &readers, &layout);
    svg.push_str("</g>\n");
    for (index, cards) in groups.iter().enumerate() {
        let [x, y] = layout.corners[index];
        let mut inner = [x, y];
        if cards.len() > 1 {
            let Size { width, height } = sizes[index];
            let _ = writeln!(
                svg,
                "<g class=group><rect x={x:.1} y={y:.1} width={width:.1} height={height:.1} rx=9 /><text x={:.1} y={:.1}>one render pass</text></g>",
                x + 10.0,
                y + 14.0
            );
            inner = [x + GROUP_EDGE, y + GROUP_HEAD];
        }
        for card in cards {
            let width = if cards.len() > 1 { sizes[index].width - 2.0 * GROUP_EDGE } else { card.size.width };
            draw(&mut svg, declaration, plan, card, inner, width);
            inner[1] += card.size.height + 6.0;
        }
    }
    svg.push_str("</svg>\n");
    svg
}

fn card(declaration: &Declaration, pass: usize, position: Option<usize>, times: &HashMap<&str, f64>) -> Card {
    let decl = &declaration.passes[pass];
    let mut writes: Vec<usize> = decl.accesses.iter().filter(|access| access.writes()).map(|access| access.resource).collect();
    writes.retain(|resource| *resource < declaration.resources.len());
    writes.sort_unstable();
    writes.dedup();
    let letters = |text: &str, most: usize| text.chars().count().min(most) as f32;
    let rows = writes.iter().map(|&write| letters(&declaration.resources[write].name, 28) * ROW_LETTER + 34.0);
    let mut facts = position.map_or_else(|| "culled".to_owned(), |position| position.to_string());
    let _ = write!(facts, " · {}", decl.kind.name());
    if let Some(ms) = times.get(&*decl.name).filter(|_| position.is_some()) {
        let _ = write!(facts, " · {}", time(*ms));
    }
    let head = (letters(&decl.name, 28) * TITLE_LETTER).max(letters(&facts, 60) * ROW_LETTER) + 26.0;
    let width = rows.fold(head, f32::max).max(112.0);
    let shown = writes.len().min(MOST_ROWS) + usize::from(writes.len() > MOST_ROWS);
    Card { pass, writes, facts, size: Size { width, height: TITLE + shown as f32 * ROW + FOOT } }
}

fn group_size(cards: &[Card]) -> Size {
    let width = cards.iter().map(|card| card.size.width).fold(0.0, f32::max);
    let height: f32 = cards.iter().map(|card| card.size.height).sum();
    if cards.len() == 1 {
        return Size { width, height };
    }
    Size { width: width + 2.0 * GROUP_EDGE, height: height + (cards.len() - 1) as f32 * 6.0 + GROUP_HEAD + GROUP_EDGE }
}

/// One net per pass and resource that others see, and per net and box: the flows of its line.
fn nets(groups: &[Vec<Card>], sizes: &[Size], flows: &[Flow], box_of: &[Option<usize>]) -> (Vec<Net>, Vec<Vec<Vec<Flow>>>) {
    let mut nets = Vec::new();
    let mut readers: Vec<Vec<Vec<Flow>>> = Vec::new();
    for (from, cards) in groups.iter().enumerate() {
        let outgoing = cards.iter().flat_map(|card| {
            let first = flows.partition_point(|flow| flow.from < card.pass);
            let last = flows.partition_point(|flow| flow.from <= card.pass);
            flows[first..last].chunk_by(|a, b| a.resource == b.resource)
        });
        let first_net = nets.len();
        for flows in outgoing {
            let mut to: Vec<usize> = Vec::new();
            let mut of_line: Vec<Vec<Flow>> = Vec::new();
            for flow in flows {
                // Boxes come in an order in which what flows goes forwards; within a box it needs no line.
                let Some(target) = box_of[flow.to].filter(|target| *target > from) else { continue };
                if let Some(at) = to.iter().position(|other| *other == target) {
                    of_line[at].push(*flow);
                } else {
                    to.push(target);
                    of_line.push(vec![*flow]);
                }
            }
            if !to.is_empty() {
                nets.push(Net { from, port: 0.0, to });
                readers.push(of_line);
            }
        }
        let count = (nets.len() - first_net) as f32;
        let spacing = ((sizes[from].width - 20.0) / count.max(1.0)).min(24.0);
        for (at, net) in nets[first_net..].iter_mut().enumerate() {
            net.port = sizes[from].width / 2.0 + (at as f32 - (count - 1.0) / 2.0) * spacing;
        }
    }
    (nets, readers)
}

fn lines(svg: &mut String, readers: &[Vec<Vec<Flow>>], layout: &Layout) {
    for (of_net, readers) in layout.lines.iter().zip(readers) {
        let mut colour = 0;
        for (line, flows) in of_net.iter().zip(readers) {
            let mut path = String::new();
            for (at, point) in line.iter().enumerate() {
                let [x, y] = *point;
                if at == 0 {
                    let _ = write!(path, "M{x:.1} {y:.1}");
                } else if at % 2 == 1 {
                    let [from_x, from_y] = line[at - 1];
                    let middle = f32::midpoint(from_y, y);
                    let _ = write!(path, "C{from_x:.1} {middle:.1} {x:.1} {middle:.1} {x:.1} {y:.1}");
                } else {
                    let _ = write!(path, "V{y:.1}");
                }
            }
            let names: Vec<String> = flows.iter().map(|flow| format!("{} {} {}", flow.from, flow.to, flow.resource)).collect();
            colour = flows.first().map_or(0, |flow| flow.resource % COLOURS);
            let _ = writeln!(svg, "<path class=\"line c{colour}\" data-flow=\"{}\" d=\"{path}\"/>", names.join(","));
        }
        if let Some([x, y]) = of_net.first().and_then(|line| line.first()) {
            let _ = writeln!(svg, "<circle class=\"port c{colour}\" cx={x:.1} cy={y:.1} r=3.2 />");
        }
    }
}

fn draw(svg: &mut String, declaration: &Declaration, plan: &Plan, card: &Card, [x, y]: [f32; 2], width: f32) {
    let decl = &declaration.passes[card.pass];
    let name = escape(&decl.name);
    let (kind, facts) = (decl.kind.name(), &card.facts);
    let reason =
        plan.culled.iter().find(|culled| culled.index == card.pass).map(|culled| format!(": {}", escape(&culled.reason)));
    let reason = reason.unwrap_or_default();
    let culled = if card.facts.starts_with("culled") { " culled" } else { "" };
    let height = card.size.height;
    let _ = write!(
        svg,
        "<g class=\"pass k-{kind}{culled}\" data-p={} tabindex=-1 role=button aria-label=\"pass {name}, {facts}{reason}\"><title>{name}: {facts}{reason}</title>\
         <rect class=card x={x:.1} y={y:.1} width={width:.1} height={height:.1} rx=7 /><path class=stripe d=\"M{:.1} {:.1}v{:.1}\"/>\
         <text class=name x={:.1} y={:.1}>{}</text><text class=sub x={:.1} y={:.1}>{facts}</text>",
        card.pass,
        x + 5.0,
        y + 7.0,
        height - 14.0,
        x + 12.0,
        y + 17.0,
        escape(&shorten(&decl.name, 28)),
        x + 12.0,
        y + 31.0,
    );
    let mut row = y + TITLE + 8.0;
    for &write in card.writes.iter().take(MOST_ROWS) {
        let resource = &declaration.resources[write];
        let leaves = if resource.keep || resource.origin.outlives_frame() { " ↗" } else { "" };
        let _ = write!(
            svg,
            "<rect class=\"chip c{}\" x={:.1} y={:.1} width=8 height=8 rx=2 /><text class=row x={:.1} y={row:.1}>{}{leaves}</text>",
            write % COLOURS,
            x + 12.0,
            row - 7.5,
            x + 24.0,
            escape(&shorten(&resource.name, 28)),
        );
        row += ROW;
    }
    if card.writes.len() > MOST_ROWS {
        let _ = write!(svg, "<text class=row x={:.1} y={row:.1}>and {} more</text>", x + 24.0, card.writes.len() - MOST_ROWS);
    }
    svg.push_str("</g>\n");
}
