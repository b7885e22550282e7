//! Typed names of resources: what a pass reads and writes.

use crate::{BufferDesc, TextureDesc};
use std::{fmt::Debug, sync::Arc};

mod sealed {
    #[expect(unnameable_types, reason = "no other crate can add a kind of resource")]
    pub trait Sealed {}
    impl Sealed for super::Texture {}
    impl Sealed for super::Buffer {}
    impl Sealed for super::Tlas {}
}

/// What a [`Handle`] can name: [`Texture`], [`Buffer`] or [`Tlas`].
pub trait Resource: sealed::Sealed + Debug {
    /// Its description.
    type Desc: Clone + Debug + PartialEq;
    /// Its wgpu usage flags.
    type Usages: Copy + Debug;
    #[doc(hidden)]
    fn usages(usages: Self::Usages) -> u32;
}

/// Marks a [`Handle`] to a texture.
#[derive(Debug)]
pub enum Texture {}

/// Marks a [`Handle`] to a buffer.
#[derive(Debug)]
pub enum Buffer {}

/// Marks a [`Handle`] to a top-level acceleration structure, WGSL's `acceleration_structure`: imported, read only, and no
/// part of the frame's memory. Who builds it does so between frames.
#[derive(Debug)]
pub enum Tlas {}

impl Resource for Texture {
    type Desc = TextureDesc;
    type Usages = wgpu::TextureUsages;
    fn usages(usages: wgpu::TextureUsages) -> u32 {
        usages.bits()
    }
}

impl Resource for Buffer {
    type Desc = BufferDesc;
    type Usages = wgpu::BufferUsages;
    fn usages(usages: wgpu::BufferUsages) -> u32 {
        usages.bits()
    }
}

impl Resource for Tlas {
    type Desc = ();
    type Usages = ();
    fn usages((): ()) -> u32 {
        0
    }
}

/// Names a resource of one [`Graph`](crate::Graph); carries its description.
///
/// Not `Clone`: a pass reads `&handle` and writes `&mut handle`, so a function's signature states its data flow.
#[derive(Debug)]
pub struct Handle<T: Resource> {
    pub(crate) index: usize,
    pub(crate) graph: u64,
    pub(crate) name: Arc<str>,
    pub(crate) desc: T::Desc,
}

impl<T: Resource> Handle<T> {
    /// The resource's description.
    pub fn desc(&self) -> &T::Desc {
        &self.desc
    }

    /// The resource's name, unique in its graph.
    pub fn name(&self) -> &str {
        &self.name
    }
}

/// A resource that lives on: this frame's contents and the last frame's.
///
/// `previous` holds what the last frame of a graph of the same name wrote to `current`. It is zero on the first frame,
/// after a change of description and after [`Executor::reset_history`](crate::Executor::reset_history). A frame in
/// which nothing writes `current` leaves `previous` as it was.
#[derive(Debug)]
pub struct History<T: Resource> {
    /// The last frame's contents; read only.
    pub previous: Handle<T>,
    /// This frame's contents; write before reading.
    pub current: Handle<T>,
}
