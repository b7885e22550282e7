//! Rust structs that lie in memory as WGSL structs do, and what the graph knows of them.
//!
//! [`shader_struct!`](crate::shader_struct) writes the Rust side once; the graph compares names, offsets and sizes with
//! the WGSL side whenever a pass binds such a struct, so that neither can drift.

/// One field of a [`ShaderStruct`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Field {
    /// Name, the same in Rust and WGSL. Names that start with `pad` are not compared.
    pub name: &'static str,
    /// Bytes from the start of the struct.
    pub offset: usize,
    /// Bytes the field takes.
    pub size: usize,
}

/// A plain struct with the memory layout of a WGSL struct of the same fields.
///
/// Implement it through [`shader_struct!`](crate::shader_struct).
pub trait ShaderStruct: bytemuck::Pod {
    /// Name of the struct.
    const NAME: &'static str;
    /// Fields in order of offset.
    const FIELDS: &'static [Field];
}

/// The layout of a [`ShaderStruct`], as a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct StructLayout {
    /// Name of the Rust struct.
    pub name: &'static str,
    /// Size, which is also the stride in an array (bytes).
    pub size: usize,
    /// Fields in order of offset.
    pub fields: &'static [Field],
}

impl StructLayout {
    /// The layout of `T`.
    pub fn of<T: ShaderStruct>() -> Self {
        Self { name: T::NAME, size: size_of::<T>(), fields: T::FIELDS }
    }
}

/// Defines a `#[repr(C)]` plain struct and implements [`ShaderStruct`] for it.
///
/// Derives `Clone`, `Copy`, `Debug`, `PartialEq`, `Pod`, `Zeroable` and a zeroed `Default`. Padding is explicit: Rust
/// refuses the struct otherwise. Fields named `pad…` need not exist in WGSL.
///
/// ```
/// lightloom_graph::shader_struct! {
///     /// A point light.
///     pub struct Light {
///         /// Where it is (m, world).
///         pub position_world: [f32; 3],
///         /// 0 point, 1 spot.
///         pub kind: u32,
///     }
/// }
/// use lightloom_graph::ShaderStruct;
/// assert_eq!(Light::FIELDS[1].offset, 12);
/// ```
#[macro_export]
macro_rules! shader_struct {
    ($(#[$meta:meta])* $vis:vis struct $name:ident { $($(#[$field_meta:meta])* $field_vis:vis $field:ident : $ty:ty),+ $(,)? }) => {
        $(#[$meta])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, PartialEq, $crate::bytemuck::Pod, $crate::bytemuck::Zeroable)]
        #[bytemuck(crate = "::lightloom_graph::bytemuck")]
        $vis struct $name { $($(#[$field_meta])* $field_vis $field: $ty),+ }

        impl ::core::default::Default for $name {
            fn default() -> Self {
                $crate::bytemuck::Zeroable::zeroed()
            }
        }

        impl $crate::ShaderStruct for $name {
            const NAME: &'static str = ::core::stringify!($name);
            const FIELDS: &'static [$crate::Field] = &[$($crate::Field {
                name: ::core::stringify!($field),
                offset: ::core::mem::offset_of!($name, $field),
                size: ::core::mem::size_of::<$ty>(),
            }),+];
        }
    };
}
