//! What a random frame is made of.
//!
//! A case is plain numbers, so that proptest can shrink it; [`Case::steps`] gives them a meaning, step by step, and leaves
//! out what would be refused. What it returns says all: the model and the graph run the same steps.

use lightloom_graph::{BufferDesc, TextureDesc, wgpu::TextureFormat};
use proptest::prelude::*;

/// What a node holds. All contents are words; a texture's are its texels' channels, row after row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Buffer {
        words: u32,
    },
    /// One channel (r32uint) or four (rgba32uint).
    Texture {
        size: [u32; 2],
        channels: u32,
    },
}

impl Kind {
    /// Buffers of few sizes and textures of few shapes: enough equal ones to share, enough unequal ones to go wrong.
    fn new(number: u8) -> Self {
        match number % 8 {
            0 | 1 => Self::Buffer { words: 16 },
            2 => Self::Buffer { words: 40 },
            3 => Self::Buffer { words: 300 },
            4 | 5 => Self::Texture { size: [4, 4], channels: 1 },
            6 => Self::Texture { size: [4, 4], channels: 4 },
            _ => Self::Texture { size: [5, 3], channels: 1 },
        }
    }

    pub(super) fn is_buffer(self) -> bool {
        matches!(self, Self::Buffer { .. })
    }

    /// Number of words, or of texels.
    pub(super) fn items(self) -> u32 {
        match self {
            Self::Buffer { words } => words,
            Self::Texture { size: [w, h], .. } => w * h,
        }
    }

    pub(super) fn channels(self) -> u32 {
        match self {
            Self::Buffer { .. } => 1,
            Self::Texture { channels, .. } => channels,
        }
    }

    pub(super) fn words(self) -> usize {
        (self.items() * self.channels()) as usize
    }

    pub(super) fn buffer(self) -> BufferDesc {
        BufferDesc::words(self.words() as u64)
    }

    pub(super) fn texture(self) -> TextureDesc {
        let (size, channels) = match self {
            Self::Texture { size, channels } => (size, channels),
            Self::Buffer { .. } => ([1, 1], 1),
        };
        TextureDesc::new_2d(size, if channels == 1 { TextureFormat::R32Uint } else { TextureFormat::Rgba32Uint })
    }
}

/// Whose a node is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Owner {
    Transient,
    Imported,
    /// The halves of a history pair; the current one follows the previous one.
    Previous,
    Current,
}

/// One handle of the frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) kind: Kind,
    pub(super) owner: Owner,
    pub(super) keep: bool,
}

/// What a pass does; `to` and `from` are nodes. `seed` differs from frame to frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// A kernel that writes the first `count` items of `to` from the sources, one of them perhaps as a uniform.
    Compute { to: usize, from: [Option<usize>; 2], uniform: bool, count: u32, seed: u32 },
    /// A kernel that reads and writes `to`.
    Update { to: usize, from: Option<usize>, count: u32, seed: u32 },
    /// A draw into one or two attachments; columns from `columns` on keep what is there, or the clear value.
    Draw { to: [Option<usize>; 2], from: Option<usize>, clear: Option<u32>, columns: u32, seed: u32 },
    /// Zero bytes.
    Clear { to: usize },
    /// A copy of the whole.
    Copy { to: usize, from: usize },
    /// A copy of `words`, or of the whole texture, by a closure.
    Closure { to: usize, from: usize, words: u32 },
    /// The contents at this moment, brought back.
    Read { from: usize },
}

impl Step {
    /// Nodes whose contents it needs.
    pub(super) fn reads(self) -> Vec<usize> {
        match self {
            Self::Compute { from, .. } => from.into_iter().flatten().collect(),
            Self::Update { to, from, .. } => from.into_iter().chain([to]).collect(),
            Self::Draw { from, to, clear, .. } => {
                from.into_iter().chain(to.into_iter().flatten().filter(|_| clear.is_none())).collect()
            }
            Self::Copy { from, .. } | Self::Closure { from, .. } | Self::Read { from } => vec![from],
            Self::Clear { .. } => Vec::new(),
        }
    }

    pub(super) fn writes(self) -> Vec<usize> {
        match self {
            Self::Draw { to, .. } => to.into_iter().flatten().collect(),
            Self::Compute { to, .. }
            | Self::Update { to, .. }
            | Self::Clear { to }
            | Self::Copy { to, .. }
            | Self::Closure { to, .. } => {
                vec![to]
            }
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
    nodes: Vec<(u8, u8, bool)>,
    raw: Vec<Raw>,
    /// Bit `n`: node `n` is read back at the end of each frame, if anything wrote it.
    seen: u32,
}

/// Frames of a case.
pub(super) const FRAMES: u32 = 3;

pub(super) fn cases() -> impl Strategy<Value = Case> {
    let node = (0_u8..8, 0_u8..16, proptest::bool::weighted(0.05));
    let raw = (0_u8..18, any::<[u8; 2]>(), any::<[u8; 2]>(), any::<u8>(), any::<u32>(), any::<u8>(), any::<u8>());
    let raw = raw.prop_map(|(what, to, from, part, seed, a, b)| Raw { what, to, from, part, seed, skip: a & b & (b >> 1) });
    (proptest::collection::vec(node, 4..20), proptest::collection::vec(raw, 4..40), any::<[u32; 3]>())
        .prop_map(|(nodes, raw, seen)| Case { nodes, raw, seen: seen[0] & seen[1] & seen[2] })
}

impl Case {
    /// The nodes of every frame.
    pub(super) fn nodes(&self) -> Vec<Node> {
        let mut nodes = Vec::new();
        for &(kind, owner, keep) in &self.nodes {
            let node = |owner| Node { kind: Kind::new(kind), owner, keep };
            match owner {
                14 => nodes.extend([node(Owner::Previous), node(Owner::Current)]),
                15 => nodes.push(node(Owner::Imported)),
                _ => nodes.push(node(Owner::Transient)),
            }
        }
        nodes
    }

    /// The steps of frame `frame`, and the first one left out because it reads what nothing wrote, with the steps before it.
    pub(super) fn steps(&self, nodes: &[Node], frame: u32) -> (Vec<Step>, Option<(usize, Step)>) {
        // Per node the number of steps before it was last written, from 1; 0: never.
        let mut written: Vec<usize> =
            nodes.iter().map(|node| usize::from(matches!(node.owner, Owner::Imported | Owner::Previous))).collect();
        let mut steps = Vec::new();
        let mut stale = None;
        for raw in self.raw.iter().filter(|raw| raw.skip >> frame & 1 == 0) {
            let Some(step) = raw.step(nodes, frame, &written) else { continue };
            if step.reads().into_iter().any(|node| written[node] == 0) {
                stale.get_or_insert((steps.len(), step));
                continue;
            }
            steps.push(step);
            step.writes().into_iter().for_each(|node| written[node] = steps.len() + 1);
        }
        let seen = (0..nodes.len()).filter(|&node| written[node] > 0 && self.seen >> (node % 32) & 1 == 1);
        steps.extend(seen.map(|from| Step::Read { from }));
        (steps, stale)
    }
}

impl Raw {
    /// What the numbers mean; `None` if no such pass can be. It may yet read what nothing wrote.
    fn step(&self, nodes: &[Node], frame: u32, written: &[usize]) -> Option<Step> {
        let seed = self.seed.wrapping_add(frame);
        // A node among those that fit, by number.
        let pick = |number: u8, fits: &dyn Fn(usize) -> bool| {
            let fitting: Vec<usize> = (0..nodes.len()).filter(|&node| fits(node)).collect();
            fitting.get(usize::from(number) % fitting.len().max(1)).copied()
        };
        let writable = |node: usize| nodes[node].owner != Owner::Previous;
        // Fresh nodes as targets more often than not, and sources written lately: so lives are short and memory is shared.
        let goal = |number: u8, fits: &dyn Fn(usize) -> bool| {
            let fresh = pick(number, &|node| fits(node) && written[node] == 0).filter(|_| !number.is_multiple_of(4));
            fresh.or_else(|| pick(number, fits))
        };
        let source = |number: u8, fits: &dyn Fn(usize) -> bool| {
            // Now and then one is not written, which must be refused.
            if number > 250 {
                return pick(number, &|node| fits(node) && written[node] == 0);
            }
            let mut recent: Vec<usize> = (0..nodes.len()).filter(|&node| fits(node) && written[node] > 0).collect();
            recent.sort_by_key(|&node| std::cmp::Reverse(written[node]));
            recent.truncate(if number.is_multiple_of(8) { usize::MAX } else { 3 });
            recent.get(usize::from(number / 8) % recent.len().max(1)).copied()
        };
        let kind = |node: usize| nodes[node].kind;
        match self.what {
            0..5 => {
                let to = goal(self.to[0], &writable)?;
                let first = source(self.from[0], &|node| node != to);
                let second = source(self.from[1], &|node| node != to);
                let from = [first.filter(|_| !self.from[1].is_multiple_of(4)), second.filter(|_| self.from[0].is_multiple_of(3))];
                let uniform = self.part.is_multiple_of(3) && from[0].is_some_and(|node| kind(node).is_buffer());
                // A part of what is there already, or all.
                let part = written[to] > 0 && self.part % 4 == 1;
                let count = if part { u32::from(self.part) % kind(to).items() } else { kind(to).items() };
                Some(Step::Compute { to, from, uniform, count, seed })
            }
            5..8 => {
                let to = source(self.to[0], &|node| writable(node) && kind(node).is_buffer())?;
                let from = source(self.from[0], &|node| node != to).filter(|_| self.from[1].is_multiple_of(2));
                Some(Step::Update { to, from, count: 1 + u32::from(self.part) % kind(to).items(), seed })
            }
            8..12 => {
                let clear = (self.part.is_multiple_of(2)).then_some(seed % 97);
                let fits = |node: usize| writable(node) && !kind(node).is_buffer();
                let to = if clear.is_some() { goal(self.to[0], &fits)? } else { source(self.to[0], &fits)? };
                let twin = |node: usize| {
                    fits(node) && kind(node).channels() != kind(to).channels() && kind(node).items() == kind(to).items()
                };
                let second = if clear.is_some() { pick(self.to[1], &twin) } else { source(self.to[1], &twin) };
                let second = second.filter(|_| self.to[1].is_multiple_of(3));
                let from =
                    source(self.from[0], &|node| node != to && Some(node) != second).filter(|_| self.from[1].is_multiple_of(2));
                Some(Step::Draw { to: [Some(to), second], from, clear, columns: u32::from(self.part / 2) % 7, seed })
            }
            12 => Some(Step::Clear { to: pick(self.to[0], &|node| writable(node) && kind(node).is_buffer())? }),
            13 => {
                let from = source(self.from[0], &|_| true)?;
                let to = goal(self.to[0], &|node| writable(node) && node != from && kind(node) == kind(from))?;
                Some(Step::Copy { to, from })
            }
            14 => {
                let from = source(self.from[0], &|_| true)?;
                let fits = |node: usize| {
                    let like = kind(node) == kind(from);
                    let longer = kind(node).is_buffer() && kind(from).is_buffer() && written[node] > 0;
                    writable(node) && node != from && (like || longer)
                };
                let to = goal(self.to[0], &fits)?;
                Some(Step::Closure { to, from, words: kind(from).words().min(kind(to).words()) as u32 })
            }
            _ => Some(Step::Read { from: source(self.from[0], &|_| true)? }),
        }
    }
}
