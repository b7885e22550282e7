//! What a strategy may know of the device that runs it.

use lightloom_graph::wgpu;

/// Kind, features and limits of a device: for strategies that choose by them.
#[derive(Clone, Debug)]
pub struct DeviceTraits {
    /// Whether it is hardware, and where it sits.
    pub kind: wgpu::DeviceType,
    /// What it was created with.
    pub features: wgpu::Features,
    /// Likewise.
    pub limits: wgpu::Limits,
}

impl DeviceTraits {
    /// Those of `device`.
    pub fn of(device: &wgpu::Device) -> Self {
        Self { kind: device.adapter_info().device_type, features: device.features(), limits: device.limits() }
    }
}

impl Default for DeviceTraits {
    /// Nothing is known: WebGPU's guarantee.
    fn default() -> Self {
        Self { kind: wgpu::DeviceType::Other, features: wgpu::Features::empty(), limits: wgpu::Limits::default() }
    }
}
