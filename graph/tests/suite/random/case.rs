//! What a random frame is made of.
//!
//! A case is plain numbers, so that proptest can shrink it; [`Case::steps`] gives them a meaning, step by step, and leaves
//! out what would be refused. What it returns says all: the model and the graph run the same steps.

use super::node::{Kind, Node, Owner, Part};
use proptest::prelude::*;
use std::cmp::Reverse;

/// How the first source of a pass is bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Bind {
    Plain,
    /// The first 16 words of a buffer.
    Uniform,
    /// A variable that the shader might write and does not: wgpu counts it as written.
    Exclusive,
    /// By `read_optional`; without a source, the shader sees a buffer of zeros.
    Optional,
}

/// What a pass does. `seed` differs from frame to frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// A kernel that writes the first `count` items of `to` from the sources, as many as the workgroups that `groups` holds
    /// cover.
    Compute { to: Part, from: [Option<Part>; 2], bind: Bind, groups: Option<usize>, count: u32, pinned: bool, seed: u32 },
    /// A kernel that reads and writes `to`.
    Update { to: Part, from: Option<Part>, count: u32, seed: u32 },
    /// Writes the arguments of indirect calls, and noise around them.
    Arguments { to: usize, groups: u32, vertices: u32, seed: u32 },
    /// A draw into one or two attachments and perhaps a depth buffer; columns from `columns` on keep what is there, or the
    /// clear value. It updates `beside` from what it reads.
    Draw {
        to: [Option<Part>; 2],
        depth: Option<usize>,
        from: Option<Part>,
        bind: Bind,
        beside: Option<usize>,
        vertices: Option<usize>,
        clear: Option<u32>,
        columns: u32,
        pinned: bool,
        seed: u32,
    },
    /// Zero bytes, or a texture's part full of `value`.
    Clear { to: Part, value: u32 },
    /// A copy of the whole.
    Copy { to: usize, from: usize },
    /// A copy of `words`, or of the whole texture, by a closure.
    Closure { to: usize, from: usize, words: u32 },
    /// The contents of the first mip at this moment, brought back.
    Read { from: Part },
}

impl Step {
    /// What it needs the contents of.
    pub(super) fn reads(self) -> Vec<Part> {
        let whole = |node: Option<usize>| node.map(Part::whole);
        match self {
            Self::Compute { from, groups, .. } => from.into_iter().flatten().chain(whole(groups)).collect(),
            Self::Update { to, from, .. } => from.into_iter().chain([to]).collect(),
            Self::Draw { from, to, depth, beside, vertices, clear, .. } => {
                let kept = to.into_iter().flatten().chain(whole(depth)).filter(|_| clear.is_none());
                from.into_iter().chain(kept).chain(whole(beside)).chain(whole(vertices)).collect()
            }
            Self::Copy { from, .. } | Self::Closure { from, .. } => vec![Part::whole(from)],
            Self::Read { from } => vec![from],
            Self::Clear { .. } | Self::Arguments { .. } => Vec::new(),
        }
    }

    pub(super) fn writes(self) -> Vec<Part> {
        match self {
            Self::Draw { to, depth, beside, .. } => {
                to.into_iter().flatten().chain(depth.into_iter().chain(beside).map(Part::whole)).collect()
            }
            Self::Compute { to, .. } | Self::Update { to, .. } | Self::Clear { to, .. } => vec![to],
            Self::Arguments { to, .. } | Self::Copy { to, .. } | Self::Closure { to, .. } => vec![Part::whole(to)],
            Self::Read { .. } => Vec::new(),
        }
    }
}

/// A step as numbers.
#[derive(Clone, Copy, Debug)]
struct Raw {
    what: u8,
    to: [u8; 2],
    from: [u8; 2],
    part: u8,
    seed: u32,
    /// Bit `f`: left out of frame `f`.
    skip: u8,
}

/// A random sequence of frames.
#[derive(Clone, Debug)]
pub(super) struct Case {
    nodes: Vec<(u8, u8, u8)>,
    raw: Vec<Raw>,
    /// Bit `n`: node `n` is read back at the end of each frame, if anything wrote it.
    seen: u32,
    /// How it is run.
    pub(super) threads: usize,
    pub(super) transient_attachments: bool,
    pub(super) timing: bool,
}

/// Frames of a case.
pub(super) const FRAMES: u32 = 3;

pub(super) fn cases() -> impl Strategy<Value = Case> {
    let node = (0_u8..14, 0_u8..20, any::<u8>());
    let raw = (0_u8..28, any::<[u8; 2]>(), any::<[u8; 2]>(), any::<u8>(), any::<u32>(), any::<u8>(), any::<u8>());
    let raw = raw.prop_map(|(what, to, from, part, seed, a, b)| Raw { what, to, from, part, seed, skip: a & b & (b >> 1) });
    // Some are long enough that several threads record them.
    let steps = prop_oneof![
        24 => proptest::collection::vec(raw.clone(), 4..40),
        1 => proptest::collection::vec(raw, 240..400),
    ];
    (proptest::collection::vec(node, 4..20), steps, any::<[u32; 3]>(), any::<[bool; 2]>(), proptest::bool::weighted(0.1))
        .prop_map(|(nodes, raw, seen, [transient_attachments, threads], timing)| {
            let threads = if threads || raw.len() > 200 { 3 } else { 1 };
            Case { nodes, raw, seen: seen[0] & seen[1] & seen[2], threads, transient_attachments, timing }
        })
}

impl Case {
    /// The nodes of every frame.
    pub(super) fn nodes(&self) -> Vec<Node> {
        let mut nodes = Vec::new();
        for &(kind, owner, more) in &self.nodes {
            let kind = Kind::new(kind);
            let node = |owner| Node { kind, owner, keep: more < 12, filled: more % 2 == 1 && !kind.is_depth() };
            match owner {
                16 | 17 => nodes.extend([node(Owner::Previous), node(Owner::Current)]),
                18 => nodes.push(node(Owner::Persistent)),
                // There is no way to give a depth texture its first contents.
                19 if !kind.is_depth() => nodes.push(node(Owner::Imported)),
                _ => nodes.push(node(Owner::Transient)),
            }
        }
        nodes
    }

    /// The steps of frame `frame`, and the first one left out because it reads what nothing wrote, with the steps before it.
    pub(super) fn steps(&self, nodes: &[Node], frame: u32) -> (Vec<Step>, Option<(usize, Step)>) {
        let mut state = State::new(nodes);
        let mut stale = None;
        for raw in self.raw.iter().filter(|raw| raw.skip >> frame & 1 == 0) {
            let Some(step) = raw.step(&state, frame) else { continue };
            if step.reads().into_iter().any(|part| state.age(part) == 0) {
                stale.get_or_insert((state.steps.len(), step));
                continue;
            }
            state.push(step);
        }
        let mut steps = state.steps.clone();
        let firsts = nodes.iter().enumerate().map(|(node, Node { kind, .. })| Part::first_mip(node, *kind));
        let seen = |part: &Part| state.age(*part) > 0 && self.seen >> (part.node % 32) & 1 == 1;
        steps.extend(firsts.filter(seen).map(|from| Step::Read { from }));
        (steps, stale)
    }
}

/// What is so after the steps so far.
struct State<'a> {
    nodes: &'a [Node],
    steps: Vec<Step>,
    /// Per node and cell the number of steps before it was last written, from 1; 0: never.
    written: Vec<Vec<usize>>,
    /// Per node the workgroups that it holds as arguments, if it holds any.
    groups: Vec<Option<u32>>,
}

impl<'a> State<'a> {
    fn new(nodes: &'a [Node]) -> Self {
        let written = |node: &Node| vec![usize::from(node.owner.has_contents()); node.kind.cells().len()];
        let written = nodes.iter().map(written).collect();
        Self { nodes, steps: Vec::new(), written, groups: vec![None; nodes.len()] }
    }

    /// When all of it had been written.
    fn age(&self, part: Part) -> usize {
        part.cells(self.kind(part.node)).map(|cell| self.written[part.node][cell]).min().unwrap_or(0)
    }

    fn kind(&self, node: usize) -> Kind {
        self.nodes[node].kind
    }

    fn push(&mut self, step: Step) {
        self.steps.push(step);
        for part in step.writes() {
            part.cells(self.kind(part.node)).for_each(|cell| self.written[part.node][cell] = self.steps.len() + 1);
            self.groups[part.node] = match step {
                Step::Arguments { groups, .. } => Some(groups),
                Step::Copy { from, .. } => self.groups[from],
                _ => None,
            };
        }
    }

    /// A cell among those that fit and may be written, by number.
    fn pick(&self, number: u8, fits: &dyn Fn(Part) -> bool) -> Option<Part> {
        let nodes = (0..self.nodes.len()).filter(|&node| self.nodes[node].owner != Owner::Previous);
        let parts = nodes.flat_map(|node| Part::cells_of(node, self.kind(node)));
        let fitting: Vec<Part> = parts.filter(|&part| fits(part)).collect();
        fitting.get(usize::from(number) % fitting.len().max(1)).copied()
    }

    /// A fresh one more often than not.
    fn goal(&self, number: u8, fits: &dyn Fn(Part) -> bool) -> Option<Part> {
        let fresh = self.pick(number, &|part| fits(part) && self.age(part) == 0).filter(|_| !number.is_multiple_of(4));
        fresh.or_else(|| self.pick(number, fits))
    }

    /// A part to read, mostly written lately: so lives are short and memory is shared.
    fn source(&self, number: u8, fits: &dyn Fn(Part) -> bool) -> Option<Part> {
        // Now and then one is not written, which must be refused.
        let wanted = number <= 250;
        let all = (0..self.nodes.len()).flat_map(|node| Part::all_of(node, self.kind(node)));
        let mut parts: Vec<Part> = all.filter(|&part| fits(part) && (self.age(part) > 0) == wanted).collect();
        parts.sort_by_key(|&part| Reverse(self.age(part)));
        if wanted && !number.is_multiple_of(8) {
            parts.truncate(4);
        }
        parts.get(usize::from(number / 8) % parts.len().max(1)).copied()
    }

    /// A buffer that holds arguments.
    fn arguments(&self, number: u8, avoid: &[Part]) -> Option<usize> {
        let held = |&node: &usize| self.groups[node].is_some() && avoid.iter().all(|part| part.node != node);
        let held: Vec<usize> = (0..self.nodes.len()).filter(held).collect();
        held.get(usize::from(number) % held.len().max(1)).copied()
    }
}

impl Raw {
    /// What the numbers mean; `None` if no such pass can be. It may yet read what nothing wrote.
    fn step(&self, state: &State<'_>, frame: u32) -> Option<Step> {
        let seed = self.seed.wrapping_add(frame);
        let pinned = self.seed.is_multiple_of(11);
        let is_buffer = |part: Part| state.kind(part.node).is_buffer();
        let is_color = |part: Part| state.kind(part.node).is_color();
        let not_depth = |part: Part| !state.kind(part.node).is_depth();
        match self.what {
            0..5 | 18 => {
                let to = state.goal(self.to[0], &not_depth)?;
                let kind = state.kind(to.node);
                let fits = |part: Part| not_depth(part) && !part.overlaps(to);
                let first = state.source(self.from[0], &fits).filter(|_| !self.from[1].is_multiple_of(4));
                let bind = self.bind(first.is_some_and(is_buffer), first.is_none());
                // wgpu takes no buffer that is both written and read, though the writing is only possible.
                let alone = |part: Part| fits(part) && (bind != Bind::Exclusive || first.is_some_and(|it| it.node != part.node));
                let second = state.source(self.from[1], &alone).filter(|_| self.from[0].is_multiple_of(3));
                // A part of what is there already, or all.
                let items = to.items(kind);
                let part = state.age(to) > 0 && self.part % 4 == 1;
                let count = if part { u32::from(self.part) % items } else { items };
                let avoid: Vec<Part> = [to].into_iter().chain(first.filter(|_| bind == Bind::Exclusive)).collect();
                let covers = |&node: &usize| state.age(to) > 0 || state.groups[node].is_some_and(|groups| groups * 64 >= count);
                let groups = state.arguments(self.to[1], &avoid).filter(covers).filter(|_| self.what.is_multiple_of(2));
                Some(Step::Compute { to, from: [first, second], bind, groups, count, pinned, seed })
            }
            5..8 => {
                let to = state.source(self.to[0], &|part| is_buffer(part) && state.nodes[part.node].owner != Owner::Previous)?;
                let from = state.source(self.from[0], &|part| not_depth(part) && part.node != to.node);
                let from = from.filter(|_| self.from[1].is_multiple_of(2));
                Some(Step::Update { to, from, count: 1 + u32::from(self.part) % to.items(state.kind(to.node)), seed })
            }
            8..12 => {
                let clear = (self.part.is_multiple_of(2)).then_some(seed % 97);
                let choose = |number: u8, fits: &dyn Fn(Part) -> bool| {
                    let fits = |part: Part| fits(part) && (clear.is_some() || state.age(part) > 0);
                    if clear.is_some() { state.goal(number, &fits) } else { state.pick(number, &fits) }
                };
                let to = choose(self.to[0], &is_color)?;
                let size = |part: Part| part.size(state.kind(part.node));
                let twin = |part: Part| is_color(part) && part.node != to.node && size(part) == size(to);
                let second = choose(self.to[1], &twin).filter(|_| self.to[1].is_multiple_of(3));
                let depth = choose(self.to[1], &|part| state.kind(part.node).is_depth() && size(part) == size(to));
                let depth = depth.filter(|_| !self.from[1].is_multiple_of(3)).map(|part| part.node);
                Some(self.draw(state, [Some(to), second], depth, clear, pinned, seed))
            }
            // Into the attachments of the last draw.
            19..25 => {
                let drawn = |step: &Step| match *step {
                    Step::Draw { to, depth, .. } => Some((to, depth)),
                    _ => None,
                };
                let (to, depth) = state.steps.iter().rev().take(3).find_map(drawn)?;
                Some(self.draw(state, to, depth, None, pinned, seed))
            }
            12 | 25 => Some(Step::Clear { to: state.goal(self.to[0], &|part| !is_color(part))?, value: seed % 9 }),
            26 => Some(Step::Clear { to: state.goal(self.to[0], &is_color)?, value: seed % 97 }),
            13 => {
                let from = state.source(self.from[0], &Part::is_whole)?.node;
                let fits = |part: Part| part.node != from && state.kind(part.node) == state.kind(from);
                Some(Step::Copy { to: state.goal(self.to[0], &fits)?.node, from })
            }
            14 => {
                let from = state.source(self.from[0], &|part| part.is_whole() && not_depth(part))?;
                let kind = |part: Part| state.kind(part.node);
                let fits = |part: Part| {
                    let longer = kind(part).is_buffer() && is_buffer(from) && state.age(part) > 0;
                    part.node != from.node && (kind(part) == kind(from) || longer)
                };
                let to = state.goal(self.to[0], &fits)?;
                let words = kind(from).words().min(kind(to).words()) as u32;
                Some(Step::Closure { to: to.node, from: from.node, words })
            }
            15 => {
                let to = state.goal(self.to[0], &is_buffer)?.node;
                let vertices = if self.part.is_multiple_of(4) { 0 } else { 3 };
                Some(Step::Arguments { to, groups: u32::from(self.part) % 7, vertices, seed })
            }
            _ => {
                let first = |part: Part| part == Part::first_mip(part.node, state.kind(part.node));
                Some(Step::Read { from: state.source(self.from[0], &first)? })
            }
        }
    }

    fn bind(&self, buffer: bool, nothing: bool) -> Bind {
        match self.part % 7 {
            0 | 3 if buffer => Bind::Uniform,
            1 | 5 if buffer => Bind::Exclusive,
            2 => Bind::Optional,
            4 if nothing => Bind::Optional,
            _ => Bind::Plain,
        }
    }

    fn draw(
        &self,
        state: &State<'_>,
        to: [Option<Part>; 2],
        depth: Option<usize>,
        clear: Option<u32>,
        pinned: bool,
        seed: u32,
    ) -> Step {
        let not_depth = |part: Part| !state.kind(part.node).is_depth();
        let attached: Vec<Part> = to.into_iter().flatten().collect();
        let apart = |part: Part| not_depth(part) && attached.iter().all(|other| !other.overlaps(part));
        let from = state.source(self.from[0], &apart).filter(|_| self.from[1].is_multiple_of(2));
        let bind = self.bind(from.is_some_and(|part| state.kind(part.node).is_buffer()), from.is_none());
        let used = from.map(|part| part.node);
        let writable = |part: Part| {
            let owned = state.nodes[part.node].owner != Owner::Previous;
            owned && state.kind(part.node).is_buffer() && Some(part.node) != used
        };
        // Whether a fragment that fails the depth test stores first, drivers choose.
        let beside = state.source(self.to[0], &writable).filter(|_| depth.is_none() && !self.from[1].is_multiple_of(3));
        let beside = beside.map(|part| part.node);
        let avoid: Vec<Part> = beside.into_iter().chain(used.filter(|_| bind == Bind::Exclusive)).map(Part::whole).collect();
        let vertices = state.arguments(self.to[1], &avoid).filter(|_| self.seed.is_multiple_of(2));
        let columns = u32::from(self.part / 2) % 9;
        Step::Draw { to, depth, from, bind, beside, vertices, clear, columns, pinned, seed }
    }
}
