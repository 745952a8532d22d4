//! The declarations from which types, readers and reference pages come.

/// Declares a table of settings: a struct whose fields are the keys.
///
/// `key: Type = default => limits,` — the default and the limits may be left out. A key without a default is
/// required unless its type is an `Option`, a `Vec`, or a record whose own keys may all be absent. The comment is
/// the key's entry on the reference page; `#[unit = …]` and `#[example = …]` (as written in a file) complete it,
/// in this order.
#[macro_export]
macro_rules! record {
    (
        $(#[doc = $about:literal])*
        $visibility:vis struct $name:ident, $title:literal {
            $(
                $(#[doc = $field_about:literal])*
                $(#[unit = $unit:literal])?
                $(#[example = $example:literal])?
                $field:ident : $type:ty $(= $default:expr)? $(=> $limits:expr)?
            ),* $(,)?
        }
    ) => {
        $(#[doc = $about])*
        #[derive(Clone, Debug, PartialEq)]
        $visibility struct $name {
            $( $(#[doc = $field_about])* pub $field: $type, )*
        }

        impl $crate::schema::Record for $name {
            const TITLE: &'static str = $title;
            fn keys() -> &'static [&'static str] {
                const { &[$( $crate::key!($field) ),*] }
            }
            #[allow(unused_variables)]
            fn read_keys(
                table: &$crate::schema::Table,
                title: &str,
                reader: &mut $crate::schema::Reader,
            ) -> Option<Self> {
                // Every key is read before any is missed, so that each tells its own problem.
                $( let $field: Option<$type> = reader.field(
                    table, title, $crate::key!($field),
                    $crate::given!($($default)?), $crate::given!($($limits)?),
                ); )*
                Some(Self { $( $field: $field?, )* })
            }
            #[allow(unused_variables)]
            fn describe_keys(docs: &mut $crate::schema::Docs) -> Vec<$crate::schema::FieldDoc> {
                vec![$({
                    <$type as $crate::schema::ReadValue>::document(docs);
                    let default: Option<$type> = $crate::given!($($default)?);
                    let limits: Option<$crate::schema::Limits> = $crate::given!($($limits)?);
                    $crate::schema::FieldDoc {
                        name: $crate::key!($field).to_string(),
                        about: [$($field_about),*].concat().trim().to_string(),
                        kind: <$type as $crate::schema::ReadValue>::expected(),
                        section: <$type as $crate::schema::ReadValue>::section(),
                        unit: $crate::given!($($unit)?),
                        limits: limits.map(|limits| limits.to_string()),
                        required: default.is_none()
                            && <$type as $crate::schema::ReadValue>::absent().is_none(),
                        default: default.map(|value| $crate::schema::ReadValue::written(&value)).unwrap_or_default(),
                        example: $crate::given!($($example)?),
                    }
                }),*]
            }
            fn about() -> String {
                let lines: &[&str] = &[$($about),*];
                lines.iter().map(|line| line.trim()).collect::<Vec<_>>().join("\n")
            }
        }

        impl $crate::schema::ReadValue for $name {
            fn expected() -> String {
                concat!("a table (", $title, ")").into()
            }
            fn read_value(
                value: &$crate::schema::Value,
                reader: &mut $crate::schema::Reader,
            ) -> Option<Self> {
                let $crate::schema::Kind::Table(table) = &value.kind else {
                    reader.mistaken(value, &Self::expected());
                    return None;
                };
                reader.refuse_unknown(table, $title, <Self as $crate::schema::Record>::keys());
                <Self as $crate::schema::Record>::read_keys(table, $title, reader)
            }
            fn absent() -> Option<Self> {
                $crate::schema::read(&$crate::schema::Table::empty()).ok()
            }
            fn section() -> Option<&'static str> {
                Some($title)
            }
            fn document(docs: &mut $crate::schema::Docs) {
                if docs.begin($title) {
                    let fields = <Self as $crate::schema::Record>::describe_keys(docs);
                    docs.record($title, &<Self as $crate::schema::Record>::about(), &fields);
                }
            }
        }
    };
}

/// Declares a setting that is one of several words.
#[macro_export]
macro_rules! choices {
    (
        $(#[doc = $about:literal])*
        $visibility:vis enum $name:ident, $title:literal {
            $( $(#[doc = $choice_about:literal])* $word:literal => $choice:ident ),* $(,)?
        }
    ) => {
        $(#[doc = $about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        $visibility enum $name {
            $( $(#[doc = $choice_about])* $choice, )*
        }

        impl $crate::schema::ReadValue for $name {
            fn expected() -> String {
                [$( concat!("`\"", $word, "\"`") ),*].join(" or ")
            }
            fn read_value(
                value: &$crate::schema::Value,
                reader: &mut $crate::schema::Reader,
            ) -> Option<Self> {
                match &value.kind {
                    $( $crate::schema::Kind::Text(text) if text == $word => return Some(Self::$choice), )*
                    $crate::schema::Kind::Text(text) => {
                        let problem = $crate::schema::Problem::new(
                            &value.origin,
                            format!("expected {}, found \"{text}\"", <Self as $crate::schema::ReadValue>::expected()),
                        );
                        reader.report(match $crate::schema::nearest(text, &[$($word),*]) {
                            Some(near) => problem.help(format!("did you mean \"{near}\"?")),
                            None => problem,
                        });
                    }
                    _ => reader.mistaken(value, &<Self as $crate::schema::ReadValue>::expected()),
                }
                None
            }
            fn written(&self) -> String {
                match self { $( Self::$choice => concat!("\"", $word, "\"").into(), )* }
            }
            fn section() -> Option<&'static str> {
                Some($title)
            }
            fn document(docs: &mut $crate::schema::Docs) {
                if docs.begin($title) {
                    docs.choices($title, [$($about),*].concat().trim(), &[$(
                        $crate::schema::ChoiceDoc {
                            name: $word,
                            about: [$($choice_about),*].concat().trim().to_string(),
                        }
                    ),*]);
                }
            }
        }
    };
}

/// Declares a table whose key `type` says which keys it has: an enum of records. `if "key"` after a variant lets
/// tables without `type` be that variant when they have that key.
///
/// Read it as [`Tagged<Common, Enum>`](crate::schema::Tagged).
#[macro_export]
macro_rules! variants {
    (
        $(#[doc = $about:literal])*
        $visibility:vis enum $name:ident, $title:literal {
            $( $(#[doc = $variant_about:literal])* $word:literal => $variant:ident($record:ty) $(if $key:literal)? ),* $(,)?
        }
    ) => {
        $(#[doc = $about])*
        #[derive(Clone, Debug, PartialEq)]
        $visibility enum $name {
            $( $(#[doc = $variant_about])* $variant($record), )*
        }

        impl $crate::schema::Variants for $name {
            const TITLE: &'static str = $title;
            fn names() -> &'static [&'static str] {
                &[$($word),*]
            }
            fn inferred(_table: &$crate::schema::Table) -> Option<&'static str> {
                $( $( if _table.get($key).is_some() { return Some($word); } )? )*
                None
            }
            fn keys_of(name: &str) -> &'static [&'static str] {
                match name {
                    $( $word => <$record as $crate::schema::Record>::keys(), )*
                    _ => &[],
                }
            }
            fn read_variant(
                name: &str,
                table: &$crate::schema::Table,
                reader: &mut $crate::schema::Reader,
            ) -> Option<Self> {
                match name {
                    $( $word => <$record as $crate::schema::Record>::read_keys(
                        table, concat!($title, " of type \"", $word, "\""), reader,
                    ).map(Self::$variant), )*
                    _ => None,
                }
            }
            fn describe(docs: &mut $crate::schema::Docs, common: Vec<$crate::schema::FieldDoc>) {
                let variants = [$((
                    $crate::schema::ChoiceDoc {
                        name: $word,
                        about: [$($variant_about),*].concat().trim().to_string(),
                    },
                    <$record as $crate::schema::Record>::describe_keys(docs),
                )),*];
                let lines: &[&str] = &[$($about),*];
                let about = lines.iter().map(|line| line.trim()).collect::<Vec<_>>().join("\n");
                docs.variants($title, &about, &common, &variants);
            }
        }
    };
}

/// The key that a field's name stands for.
#[doc(hidden)]
#[macro_export]
macro_rules! key {
    ($field:ident) => {
        $crate::schema::bare(stringify!($field))
    };
}

/// `Some` of what is given, or `None`.
#[doc(hidden)]
#[macro_export]
macro_rules! given {
    () => {
        None
    };
    ($value:expr) => {
        Some($value)
    };
}
