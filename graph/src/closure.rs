//! What a closure pass is given when it is recorded.

use std::fmt;

/// A pass's closure.
pub(crate) struct Record<'f>(pub(crate) RecordFn<'f>);

type RecordFn<'f> = Box<dyn FnOnce(&mut ClosureContext<'_>) -> Result<(), String> + 'f>;

impl fmt::Debug for Record<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("closure")
    }
}

/// The device, an encoder and the resources of a closure pass.
#[derive(Debug)]
pub struct ClosureContext<'a> {
    pub(crate) device: &'a wgpu::Device,
    pub(crate) queue: &'a wgpu::Queue,
    pub(crate) encoder: &'a mut wgpu::CommandEncoder,
    /// Command buffers that go before what the encoder holds now.
    pub(crate) before: Vec<wgpu::CommandBuffer>,
    pub(crate) label: &'a str,
    pub(crate) buffers: Vec<(&'a str, &'a wgpu::Buffer)>,
    pub(crate) textures: Vec<(&'a str, &'a wgpu::Texture)>,
    pub(crate) structures: Vec<(&'a str, &'a wgpu::Tlas)>,
}

impl ClosureContext<'_> {
    /// The device.
    pub fn device(&self) -> &wgpu::Device {
        self.device
    }

    /// The queue. What is submitted or written here runs before this pass's own commands, and may run before those of
    /// earlier passes: use it for resources of your own, as a transient one does not have its memory yet.
    pub fn queue(&self) -> &wgpu::Queue {
        self.queue
    }

    /// The encoder the pass records into. End every pass begun on it, and store what it draws: a transient texture with
    /// other usages than an attachment's must not be discarded.
    pub fn encoder(&mut self) -> &mut wgpu::CommandEncoder {
        self.encoder
    }

    /// Puts `commands` between what the pass has recorded so far and what it records from now on, which goes into a new
    /// encoder: for commands that were recorded below wgpu's interface, which may not share an encoder with others. wgpu
    /// knows nothing of what those do, so barriers and resource states before and behind them are the pass's own affair.
    pub fn insert(&mut self, commands: wgpu::CommandBuffer) {
        let label = Some(self.label);
        let next = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label });
        self.encoder.pop_debug_group();
        self.before.extend([std::mem::replace(self.encoder, next).finish(), commands]);
        self.encoder.push_debug_group(self.label);
    }

    /// The buffer behind the handle of that name, if the pass declared it.
    ///
    /// # Errors
    /// If the pass did not declare such a buffer.
    pub fn buffer(&self, name: &str) -> Result<wgpu::Buffer, String> {
        find(&self.buffers, name)
            .cloned()
            .ok_or_else(|| format!("the pass declares no buffer `{name}`; add `.read(&…)` or `.write(&mut …)`"))
    }

    /// The texture behind the handle of that name, if the pass declared it.
    ///
    /// # Errors
    /// If the pass did not declare such a texture.
    pub fn texture(&self, name: &str) -> Result<wgpu::Texture, String> {
        find(&self.textures, name)
            .cloned()
            .ok_or_else(|| format!("the pass declares no texture `{name}`; add `.read(&…)` or `.write(&mut …)`"))
    }

    /// The acceleration structure behind the handle of that name, if the pass declared it.
    ///
    /// # Errors
    /// If the pass did not declare such a structure.
    pub fn tlas(&self, name: &str) -> Result<wgpu::Tlas, String> {
        find(&self.structures, name)
            .cloned()
            .ok_or_else(|| format!("the pass declares no acceleration structure `{name}`; add `.read(&…)`"))
    }
}

fn find<'a, T>(items: &[(&str, &'a T)], name: &str) -> Option<&'a T> {
    items.iter().find(|(other, _)| *other == name).map(|(_, item)| *item)
}
