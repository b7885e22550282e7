//! The textures and buffers of a random frame, and their parts.

use lightloom_graph::{BufferDesc, Subresources, TextureDesc, wgpu::TextureFormat};
use std::{fmt, ops::Range};

/// What a node holds. All contents are words; a texture's are its texels' channels, row after row, layer after layer, the
/// largest mip first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Buffer {
        words: u32,
    },
    /// One channel (r32uint) or four (rgba32uint).
    Texture {
        size: [u32; 2],
        channels: u32,
        mips: u32,
        layers: u32,
    },
    /// depth32float; the words are the bits.
    Depth {
        size: [u32; 2],
    },
}

impl Kind {
    /// Buffers of few sizes and textures of few shapes: enough equal ones to share, enough unequal ones to go wrong.
    pub(super) fn new(number: u8) -> Self {
        let texture = |size, channels, mips, layers| Self::Texture { size, channels, mips, layers };
        match number % 14 {
            0..=2 => Self::Buffer { words: 16 },
            3 => Self::Buffer { words: 40 },
            4 => Self::Buffer { words: 300 },
            5 | 6 => texture([4, 4], 1, 1, 1),
            7 => texture([4, 4], 4, 1, 1),
            8 => texture([5, 3], 1, 1, 1),
            9 | 10 => texture([8, 8], 1, 3, 1),
            11 => texture([4, 4], 1, 2, 2),
            12 => texture([4, 4], 1, 1, 3),
            _ => Self::Depth { size: [4, 4] },
        }
    }

    pub(super) fn is_buffer(self) -> bool {
        matches!(self, Self::Buffer { .. })
    }

    pub(super) fn is_color(self) -> bool {
        matches!(self, Self::Texture { .. })
    }

    pub(super) fn is_depth(self) -> bool {
        matches!(self, Self::Depth { .. })
    }

    /// Mips and layers.
    pub(super) fn counts(self) -> [u32; 2] {
        match self {
            Self::Texture { mips, layers, .. } => [mips, layers],
            Self::Buffer { .. } | Self::Depth { .. } => [1, 1],
        }
    }

    pub(super) fn channels(self) -> u32 {
        match self {
            Self::Texture { channels, .. } => channels,
            Self::Buffer { .. } | Self::Depth { .. } => 1,
        }
    }

    /// Width and height of a mip.
    pub(super) fn size(self, mip: u32) -> [u32; 2] {
        match self {
            Self::Buffer { words } => [words, 1],
            Self::Texture { size, .. } | Self::Depth { size } => size.map(|side| (side >> mip).max(1)),
        }
    }

    /// Each mip and layer, mip by mip.
    pub(super) fn cells(self) -> Vec<[u32; 2]> {
        let [mips, layers] = self.counts();
        (0..mips).flat_map(|mip| (0..layers).map(move |layer| [mip, layer])).collect()
    }

    /// The words of one cell.
    pub(super) fn range(self, cell: usize) -> Range<usize> {
        let words = |&[mip, _]: &[u32; 2]| self.size(mip).into_iter().product::<u32>() * self.channels();
        let cells = self.cells();
        let start = cells[..cell].iter().map(words).sum::<u32>();
        start as usize..(start + words(&cells[cell])) as usize
    }

    pub(super) fn words(self) -> usize {
        self.range(self.cells().len() - 1).end
    }

    /// The words of the first mip, all layers: what is brought back, and what first contents say.
    pub(super) fn first_mip(self) -> usize {
        self.range(self.counts()[1] as usize - 1).end
    }

    pub(super) fn buffer(self) -> BufferDesc {
        BufferDesc::words(self.words() as u64)
    }

    pub(super) fn texture(self) -> TextureDesc {
        let format = match self {
            Self::Depth { .. } => TextureFormat::Depth32Float,
            _ if self.channels() == 1 => TextureFormat::R32Uint,
            _ => TextureFormat::Rgba32Uint,
        };
        let [mips, layers] = self.counts();
        TextureDesc::new_2d(self.size(0), format).mip_levels(mips).layers(layers)
    }
}

/// Whose a node is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Owner {
    Transient,
    Imported,
    Persistent,
    /// The halves of a history pair; the current one follows the previous one.
    Previous,
    Current,
}

impl Owner {
    pub(super) fn has_contents(self) -> bool {
        matches!(self, Self::Imported | Self::Persistent | Self::Previous)
    }
}

/// One handle of the frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) kind: Kind,
    pub(super) owner: Owner,
    pub(super) keep: bool,
    /// Whether its first contents are given, if it is kept between frames.
    pub(super) filled: bool,
}

/// A node, or one mip or layer of it.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct Part {
    pub(super) node: usize,
    mip: Option<u32>,
    layer: Option<u32>,
}

impl Part {
    pub(super) fn whole(node: usize) -> Self {
        Self { node, mip: None, layer: None }
    }

    /// What is brought back of a node: its first mip, all layers.
    pub(super) fn first_mip(node: usize, kind: Kind) -> Self {
        Self { mip: (kind.counts()[0] > 1).then_some(0), ..Self::whole(node) }
    }

    pub(super) fn is_whole(self) -> bool {
        self.mip.is_none() && self.layer.is_none()
    }

    /// The parts that are one cell. A node of one cell is told whole.
    pub(super) fn cells_of(node: usize, kind: Kind) -> Vec<Self> {
        match kind.counts() {
            [1, 1] => vec![Self::whole(node)],
            _ => kind.cells().into_iter().map(|[mip, layer]| Self { node, mip: Some(mip), layer: Some(layer) }).collect(),
        }
    }

    /// All parts: each cell, each mip and each layer, and the whole.
    pub(super) fn all_of(node: usize, kind: Kind) -> Vec<Self> {
        let [mips, layers] = kind.counts().map(|count| if count == 1 { 0 } else { count });
        let mut parts = if kind.is_color() {
            kind.cells().into_iter().map(|[mip, layer]| Self { node, mip: Some(mip), layer: Some(layer) }).collect()
        } else {
            Vec::new()
        };
        parts.extend((0..mips).map(|mip| Self { node, mip: Some(mip), layer: None }));
        parts.extend((0..layers).map(|layer| Self { node, mip: None, layer: Some(layer) }));
        parts.push(Self::whole(node));
        parts
    }

    pub(super) fn subresources(self) -> Subresources {
        let part = self.mip.map_or(Subresources::ALL, Subresources::mip);
        self.layer.map_or(part, |layer| part.layer(layer))
    }

    pub(super) fn overlaps(self, other: Self) -> bool {
        let meet = |a: Option<u32>, b: Option<u32>| a.is_none() || b.is_none() || a == b;
        self.node == other.node && meet(self.mip, other.mip) && meet(self.layer, other.layer)
    }

    /// Positions of its cells among those of the node.
    pub(super) fn cells(self, kind: Kind) -> impl Iterator<Item = usize> {
        let inside = move |&(_, [mip, layer]): &(usize, [u32; 2])| {
            self.mip.is_none_or(|only| only == mip) && self.layer.is_none_or(|only| only == layer)
        };
        kind.cells().into_iter().enumerate().filter(inside).map(|(cell, _)| cell)
    }

    /// Whether it has several layers.
    pub(super) fn is_array(self, kind: Kind) -> bool {
        self.layer.is_none() && kind.counts()[1] > 1
    }

    /// Width and height of its first mip.
    pub(super) fn size(self, kind: Kind) -> [u32; 2] {
        kind.size(self.mip.unwrap_or(0))
    }

    /// Words or texels of its first cell.
    pub(super) fn items(self, kind: Kind) -> u32 {
        self.size(kind).into_iter().product()
    }
}

impl fmt::Debug for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "n{}", self.node)?;
        self.mip.map_or(Ok(()), |mip| write!(f, ".m{mip}"))?;
        self.layer.map_or(Ok(()), |layer| write!(f, ".l{layer}"))
    }
}
