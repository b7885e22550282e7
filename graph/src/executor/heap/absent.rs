//! In place of heaps where there are none: types without values.

use super::HeapError;
use crate::{
    declaration::{Declaration, ResourceKind},
    executor::Physical,
    plan::{Need, Plan},
};
use std::sync::Arc;

/// No heaps.
#[derive(Debug)]
pub(in crate::executor) enum Heaps {}

/// No layout.
#[derive(Debug)]
pub(in crate::executor) enum Layout {}

impl Heaps {
    pub(in crate::executor) fn new(_device: &wgpu::Device) -> Result<Self, String> {
        Err(if cfg!(feature = "placement") {
            "placement needs Vulkan, which wgpu does not use on this platform".to_owned()
        } else {
            "lightloom-graph was built without its feature `placement`".to_owned()
        })
    }

    pub(in crate::executor) fn need(&mut self, _kind: &ResourceKind, _usage: u32) -> Result<Need, HeapError> {
        match *self {}
    }

    pub(in crate::executor) fn acquire(&mut self, _: &Declaration, _: &Arc<Plan>, _: u64) -> Result<Arc<Layout>, HeapError> {
        match *self {}
    }

    pub(in crate::executor) fn commit(&mut self, _number: u64) {
        match *self {}
    }

    pub(in crate::executor) fn clear(&mut self) {
        match *self {}
    }

    pub(in crate::executor) fn allocated_bytes(&self) -> u64 {
        match *self {}
    }

    pub(in crate::executor) fn objects(&self) -> usize {
        match *self {}
    }
}

impl Layout {
    pub(in crate::executor) fn physical(&self) -> std::iter::Empty<(usize, &Physical)> {
        match *self {}
    }

    pub(in crate::executor) fn hand_over(&self, _device: &wgpu::Device, _position: usize) -> Option<wgpu::CommandBuffer> {
        match *self {}
    }

    pub(in crate::executor) fn begin(&self, _position: usize, _encoder: &mut wgpu::CommandEncoder) {
        match *self {}
    }

    pub(in crate::executor) fn ends(&self, _positions: &std::ops::Range<usize>) -> bool {
        match *self {}
    }

    pub(in crate::executor) fn end(&self, _position: usize, _encoder: &mut wgpu::CommandEncoder) {
        match *self {}
    }
}
