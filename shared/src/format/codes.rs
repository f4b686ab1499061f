//! The codes of a model's parts.

use crate::pattern::Patterns;

/// The header's descriptor code for a model over rows of features instead of touches.
pub const RAW_FEATURES: u8 = 255;

/// The header's layout of a model that has maps instead of trees; no [`Layout`], since readers of trees refuse it.
pub const MAPS_LAYOUT: u8 = 3;

macro_rules! codes {
    ($(#[$meta:meta])* $enum:ident { $($(#[$variant_meta:meta])* $variant:ident = $code:literal, $name:literal;)* }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum $enum { $($(#[$variant_meta])* $variant,)* }

        impl $enum {
            /// All, in the order of their codes.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];

            /// The code in the model format.
            pub const fn code(self) -> u8 {
                match self { $(Self::$variant => $code,)* }
            }

            /// The one with this [`code`](Self::code).
            pub const fn from_code(code: u8) -> Option<Self> {
                match code { $($code => Some(Self::$variant),)* _ => None }
            }

            /// The name on the command line and in JSON.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }
        }
    };
}

codes! {
    /// Layout of the trees.
    Layout {
        /// Splits in preorder, three bytes each, leaves in order.
        Compact = 0, "compact";
        /// Splits in preorder, six bytes each: for what [`Layout::Compact`] cannot number.
        Wide = 1, "wide";
        /// No trees: they are a function of the program that reads the model.
        Code = 2, "code";
    }
}

codes! {
    /// Type that a leaf's value is stored as.
    LeafType {
        /// One byte.
        I8 = 0, "i8";
        /// Two bytes.
        I16 = 1, "i16";
        /// The trainer's own value, added in f32.
        F32 = 2, "f32";
    }
}

impl LeafType {
    /// Bytes per value.
    pub const fn size(self) -> usize {
        // 1, 2, 4: a shift, and not a table.
        1 << self.code()
    }
}

codes! {
    /// Type that features are compared as.
    Key {
        /// Whole numbers, as the descriptors give them.
        Whole = 0, "whole";
        /// f32 values as [`f32_key`](super::f32_key)s.
        Real = 1, "real";
    }
}

codes! {
    /// Approaches that count as evidence.
    Counted {
        /// Full touches: all three fingers.
        Full = 0, "full";
        /// Touches with at least one contact.
        Contacts = 1, "contacts";
        /// Every approach, also one that touched nothing.
        All = 2, "all";
    }
}

impl Counted {
    /// The contact patterns that can count.
    pub const fn patterns(self) -> Patterns {
        match self {
            Self::Full => Patterns::FULL,
            Self::Contacts => Patterns::CONTACTS,
            Self::All => Patterns::ALL,
        }
    }
}

codes! {
    /// Names that a promised error rate covers. A name that is given and wrong is an error; no name, at the limit of touches, is
    /// neither right nor wrong.
    Per {
        /// All names that are given, with objects touched equally often.
        Average = 0, "average";
        /// Each name, when it is given.
        Name = 1, "name";
        /// The names that are given to each object.
        Object = 2, "object";
    }
}

codes! {
    /// Unit of a probe's lengths.
    Length {
        /// A tenth of the object's longest side, as objects are scaled in the paper.
        Tenth = 0, "unit";
        /// Millimeters, with objects at their true size.
        Millimeter = 1, "mm";
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_find_what_they_stand_for() {
        assert!(Layout::ALL.iter().all(|&x| Layout::from_code(x.code()) == Some(x)));
        assert!(LeafType::ALL.iter().all(|&x| LeafType::from_code(x.code()) == Some(x)));
        assert!(Key::ALL.iter().all(|&x| Key::from_code(x.code()) == Some(x)));
        assert!(Counted::ALL.iter().all(|&x| Counted::from_code(x.code()) == Some(x)));
        assert!(Length::ALL.iter().all(|&x| Length::from_code(x.code()) == Some(x)));
        assert_eq!(Layout::from_code(MAPS_LAYOUT), None);
    }
}
