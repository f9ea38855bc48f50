//! Enumerations whose variants have names on the wire, in files and in reports.

/// Declares an enumeration with `ALL`, its variants in their order, `name`, and `from_name`. A variant that states no name has
/// that of its identifier.
///
/// ```
/// wade_core::named_enum! {
///     /// Which way the water comes from.
///     #[derive(Debug, Clone, Copy, PartialEq, Eq)]
///     pub enum Side {
///         /// From ahead.
///         Front = 1 => "head_on",
///         /// From the side.
///         Left = 2 => "abeam",
///     }
/// }
/// assert_eq!(Side::ALL, [Side::Front, Side::Left]);
/// assert_eq!((Side::Left.name(), Side::from_name("head_on")), ("abeam", Some(Side::Front)));
/// ```
#[macro_export]
macro_rules! named_enum {
    (@name $variant:ident) => { stringify!($variant) };
    (@name $variant:ident $name:literal) => { $name };
    (
        $(#[$meta:meta])*
        $visibility:vis enum $enum:ident {
            $($(#[$of_variant:meta])* $variant:ident $(= $code:literal)? $(=> $name:literal)?,)+
        }
    ) => {
        $(#[$meta])*
        $visibility enum $enum {
            $($(#[$of_variant])* $variant $(= $code)?,)+
        }

        impl $enum {
            /// Every variant, in the order of the declaration.
            pub const ALL: [Self; [$(stringify!($variant)),+].len()] = [$(Self::$variant),+];

            /// The name on the wire, in files and in reports.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $crate::named_enum!(@name $variant $($name)?),)+
                }
            }

            /// The variant of that name.
            pub fn from_name(name: &str) -> Option<Self> {
                Self::ALL.into_iter().find(|variant| variant.name() == name)
            }
        }
    };
}
