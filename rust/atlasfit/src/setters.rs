//! Setters for option structs that may gain fields: `Options::default().with_field(value)`.

/// Makes a `with_` method for each field named. For this project's crates only.
#[doc(hidden)]
#[macro_export]
macro_rules! setters {
    ($options:ty { $($set:ident: $field:ident: $kind:ty),+ $(,)? }) => {
        impl $options {
            $(
                #[doc = concat!(
                    "These options with another [`", stringify!($field), "`](Self::", stringify!($field), ")."
                )]
                #[must_use]
                pub fn $set(mut self, $field: $kind) -> Self {
                    self.$field = $field;
                    self
                }
            )+
        }
    };
}
pub(crate) use setters;
